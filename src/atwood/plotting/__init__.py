"""Pictures: quantities over time, the mechanism itself, work against precision, and sweeps. Needs matplotlib."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from atwood.plotting.drawing import animate as animate, plot_mechanism as plot_mechanism
    from atwood.plotting.plots.precision import plot_comparison as plot_comparison
    from atwood.plotting.plots.quantities import plot as plot
    from atwood.plotting.plots.sweep import plot_sweep as plot_sweep
    from atwood.plotting.scene3d.sphere import plot_on_sphere as plot_on_sphere

__all__ = ["animate", "plot", "plot_comparison", "plot_mechanism", "plot_on_sphere", "plot_sweep"]

_LATER = {
    "animate": "drawing",
    "plot": "plots.quantities",
    "plot_comparison": "plots.precision",
    "plot_mechanism": "drawing",
    "plot_on_sphere": "scene3d.sphere",
    "plot_sweep": "plots.sweep",
}
"""Modules are imported when they are first used: pages need none of these."""


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LATER[name]}"), name)
