"""Which bounds of the suite are tight: value / bound of what tests compare, over machines."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from .run import Run

ALIKE = 1e-6
"""A value that differs by less than this, relative to itself, is no rounding, and its bound is on no edge."""


@dataclass(frozen=True)
class Bound:
    """A comparison in a test, and the value relative to its bound on each machine where the test passed."""

    test: str
    text: str
    ratios: dict[str, float]

    @property
    def largest(self) -> float:
        return max(self.ratios.values())

    @property
    def smallest(self) -> float:
        return min(self.ratios.values())

    @property
    def differs(self) -> bool:
        """Whether the value depends on the machine, or may: it was seen on one only."""
        return len(self.ratios) < 2 or self.largest - self.smallest > ALIKE * self.largest


def tightest(runs: Mapping[str, Run], count: int) -> list[Bound]:
    """Return the bounds that are nearest to being missed, of those whose values differ between machines."""
    found: defaultdict[tuple[str, str], dict[str, float]] = defaultdict(dict)
    for name, run in runs.items():
        for test, margins in run.margins.items():
            for text, ratio in margins.items():
                found[test, text][name] = ratio
    bounds = [Bound(test, text, ratios) for (test, text), ratios in found.items()]
    return sorted((bound for bound in bounds if bound.differs), key=lambda bound: -bound.largest)[:count]
