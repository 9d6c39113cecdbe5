"""Studies: many runs of one scene, and what they say together."""

from atwood.study.comparison.compare import compare
from atwood.study.comparison.found import Comparison, ComparisonRow
from atwood.study.comparison.reference import Reference
from atwood.study.sweeps.files import load_sweep
from atwood.study.sweeps.indices import SobolIndices
from atwood.study.sweeps.result import Sweep, SweepStatistics
from atwood.study.sweeps.sweep import sweep

__all__ = [
    "Comparison",
    "ComparisonRow",
    "Reference",
    "SobolIndices",
    "Sweep",
    "SweepStatistics",
    "compare",
    "load_sweep",
    "sweep",
]
