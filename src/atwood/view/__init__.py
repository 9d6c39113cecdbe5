"""Pictures: quantities over time, the mechanism itself, work against precision, and sweeps. Needs matplotlib."""

from atwood.view.drawing import animate, plot_mechanism
from atwood.view.plot import plot
from atwood.view.precision import plot_comparison
from atwood.view.sphere import plot_on_sphere
from atwood.view.sweep import plot_sweep

__all__ = ["animate", "plot", "plot_comparison", "plot_mechanism", "plot_on_sphere", "plot_sweep"]
