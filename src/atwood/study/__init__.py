"""Studies: many runs of one scene, and what they say together."""

from atwood.study.compare import Comparison, ComparisonRow, Reference, compare
from atwood.study.sweep import Sweep, SweepStatistics, sweep

__all__ = ["Comparison", "ComparisonRow", "Reference", "Sweep", "SweepStatistics", "compare", "sweep"]
