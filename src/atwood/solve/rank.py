"""Which constraints are independent: a numeric question, asked at the start and at admissible positions nearby.

A rank that drops everywhere means a redundant design; one that drops at the start alone means a singular position,
which must not be taken for additional freedom.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from atwood.solve.balance import Balance, independent_rows, row_scales
from atwood.solve.matrices import Matrix, to_array
from atwood.solve.matrices import scaled as scale

__all__ = ["RankFinding", "find_rank"]

FloatArray = NDArray[np.float64]

_ADMISSIBLE = 1e-9
"""How well a position near the start must fulfil the constraints to be asked for their rank."""


_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
"""The angle whose multiples are spread most evenly."""


@dataclass(frozen=True)
class RankFinding:
    """What the constraints of a form determine.

    Attributes
    ----------
    kept
        Numbers of constraints that are independent.
    redundant
        Numbers of constraints that follow from the others, everywhere.
    rank
        Number of independent constraints.
    rank_at_start
        The same at the start position alone.
    lost_at_start
        Numbers of independent constraints that follow from the others at the start position.
    """

    kept: tuple[int, ...]
    redundant: tuple[int, ...]
    rank: int
    rank_at_start: int
    lost_at_start: tuple[int, ...] = ()

    @property
    def starts_singular(self) -> bool:
        """Whether the start is a singular position."""
        return self.rank_at_start < self.rank


def find_rank(balance: Balance, t: float, q: FloatArray, scales: FloatArray) -> RankFinding:
    """Find the rank of the constraints.

    Parameters
    ----------
    balance
        The balance of forces of the form.
    t, q
        Time and position of the start.
    scales
        Size of a displacement along each speed.
    """
    count = balance.constraints
    if count == 0:
        return RankFinding((), (), 0, 0)
    still = np.zeros_like(scales)

    def scaled(position: FloatArray) -> Matrix:
        slope = balance.held(t, position, still).slope
        return scale(slope, scales, row_scales(slope, scales))

    whole = scaled(q)
    at_start = independent_rows(whole)
    if len(at_start) == count:  # no position has more
        return RankFinding(tuple(at_start), (), count, count)
    best = at_start
    # Constraints on velocities alone keep nothing from being reached.
    matrix = to_array(whole)[balance.holonomic]
    _, sizes, directions = np.linalg.svd(matrix)
    rank = int(np.sum(sizes > 1e-7 * np.max(sizes, initial=0.0)))
    admissible = directions[rank:]
    asked = 0
    for attempt, step in enumerate((1e-2, 3e-2, 3e-2), 1):
        if not len(admissible):
            break
        # any direction that no symmetry singles out
        along = np.sin(attempt * _GOLDEN * np.arange(1.0, len(admissible) + 1.0)) @ admissible
        moved = balance.turning.moved(t, q, step * scales * along / np.linalg.norm(along))
        nearby, _ = balance.project(t, moved, still, scales)
        if balance.misses(t, nearby, still, scales)[0] > _ADMISSIBLE:
            # From a singular position, Newton's method falls back into it unless something holds it away.
            held = np.where(np.arange(len(scales)) == np.argmax(np.abs(along)), 0.0, scales)
            nearby, _ = balance.project(t, moved, still, held, iterations=30)
            if balance.misses(t, nearby, still, scales)[0] > _ADMISSIBLE:
                continue
        asked += 1
        found = independent_rows(scaled(nearby))
        if len(found) > len(best):
            best = found
    if len(admissible) and not asked and len(best) < count:
        # It looks movable here and is not: a singular position, and no reason to call a constraint redundant.
        best = list(range(count))
    redundant = tuple(i for i in range(count) if i not in set(best))
    lost = tuple(i for i in best if i not in set(at_start)) if len(at_start) < len(best) else ()
    return RankFinding(tuple(best), redundant, len(best), len(at_start), lost)
