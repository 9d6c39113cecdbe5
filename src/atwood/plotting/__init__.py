"""Pictures: quantities over time, the mechanism itself, work against precision, and sweeps. Needs matplotlib.

Modules are imported when they are first used: pages need none of these.
"""

from typing import TYPE_CHECKING

from atwood.lazy_modules import imports_later

if TYPE_CHECKING:
    from atwood.plotting.drawing import animate, plot_mechanism
    from atwood.plotting.plots.precision import plot_comparison
    from atwood.plotting.plots.quantities import plot
    from atwood.plotting.plots.sweep import plot_sweep
    from atwood.plotting.scene3d.sphere import plot_on_sphere

__all__ = ["animate", "plot", "plot_comparison", "plot_mechanism", "plot_on_sphere", "plot_sweep"]

__getattr__ = imports_later(__name__)
