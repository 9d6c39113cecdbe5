"""Studies: many runs of one scene, and what they say together."""

from atwood.study.compare import Comparison, ComparisonRow, Reference, compare

__all__ = ["Comparison", "ComparisonRow", "Reference", "compare"]
