"""Pictures: quantities over time, the mechanism itself, and work against precision. Needs matplotlib."""

from atwood.view.drawing import animate, plot_mechanism
from atwood.view.plot import plot
from atwood.view.precision import plot_comparison

__all__ = ["animate", "plot", "plot_comparison", "plot_mechanism"]
