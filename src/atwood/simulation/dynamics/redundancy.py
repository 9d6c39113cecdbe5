"""Which constraints follow from others, and which coordinates follow from the others.

Ranks are asked at the start and at admissible positions near by. One that drops everywhere means a redundant design;
one that drops at the start alone means a singular position, which must not be taken for additional freedom.

Of all choices of dependent coordinates, that one is good for which no independent speed moves a dependent one by much
more than itself, each measured by its size: no entry of ``W = G_d^-1 G_i`` is large. Where one is, the two change
places, which multiplies the determinant of G_d by that entry; so a few exchanges lead to a choice where no further one
makes it larger.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray, uneven
from atwood.codegen.rounding import ROUGHNESS
from atwood.errors import KernelEvaluationError
from atwood.lazy_dataclasses import dataclass, replace
from atwood.numerics.matrices import Matrix, is_full, or_one, scaled, to_array
from atwood.numerics.rank import (
    independent_by_groups,
    independent_rows,
    is_clear,
    lost_rank,
    open_directions,
    review_rows,
    row_sizes,
    singular_values,
)
from atwood.simulation.dynamics.balance import Balance
from atwood.tolerances import tolerances

_STEPS = (1e-2, 3e-2, 3e-2)
"""How far away the positions are that are asked, relative to the scene's sizes."""

_MOVE = 0.2
"""Between two looks at which constraints are kept nothing moves by more of its size; an angle by so many radians."""


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


@dataclass(frozen=True, eq=False)
class _Place:
    """The constraints' slopes at a place, columns scaled, with their errors, and the rows that are independent.

    Also by how much the place misses the constraints on position, relative to the scales.
    """

    jacobian: FloatArray
    errors: FloatArray
    kept: list[int]
    miss: float


def find_rank(balance: Balance, t: float, q: FloatArray, scales: FloatArray) -> RankFinding:
    """Find the rank of the constraints."""
    count = balance.constraints
    if count == 0:
        return RankFinding((), (), 0, 0)
    if _hangs_together(balance, t, q, scales):
        return RankFinding(tuple(range(count)), (), count, count)
    here = _look(balance, t, q, scales)
    # A row may be small because it vanishes at a singular position: it is measured by the terms that cancel in it.
    units = np.maximum(row_sizes(here.jacobian, np.ones(len(scales))), here.errors / ROUGHNESS)
    everything = list(range(count))
    if len(here.kept) == count and is_clear(here.jacobian / units[:, None]):
        return RankFinding(tuple(everything), (), count, count)
    nearby, is_movable = _nearby(balance, t, q, scales, here)
    if is_movable and not nearby:
        # It looks movable here and is not: a singular position, and no reason to call a constraint redundant.
        left = [i for i in everything if i not in set(here.kept)]
        return RankFinding(tuple(everything), (), count, len(here.kept), tuple(left))
    best = max([here, *nearby], key=lambda place: len(place.kept))
    redundant = tuple(i for i in everything if i not in set(best.kept))
    lost = _lost(here, nearby, best.kept)
    return RankFinding(tuple(best.kept), redundant, len(best.kept), len(best.kept) - len(lost), lost)


def _hangs_together(balance: Balance, t: float, q: FloatArray, scales: FloatArray) -> bool:
    """Return whether the constraints of a large scene are independent joint by joint, as those of a tree are.

    A law whose slopes by what it alone moves are independent is so of all others, whatever these are. Without it,
    others are alone with what they move. How many there are does not matter, as for singular values of them all.
    """
    slopes = balance.constraints_at(t, q, np.zeros_like(scales)).jacobian
    if is_full(slopes):
        return False
    rows = row_sizes(slopes, scales)
    units = np.maximum(rows, balance.errors.of_jacobian(t, q, scales, 0.0) / ROUGHNESS)
    return bool(np.all(rows > 0.0)) and independent_by_groups(scaled(slopes, scales, units), balance.errors.laws)


def review_kept(finding: RankFinding, balance: Balance, t: float, q: FloatArray, scales: FloatArray) -> RankFinding:
    """Return a finding with other independent constraints if those that were kept have become a poor choice.

    Which components of a joint's constraint follow from others changes as the mechanism turns.
    """
    if not finding.redundant or not finding.kept:
        return finding
    jacobian = scaled(balance.constraints_at(t, q, np.zeros_like(scales)).jacobian, scales)
    errors = balance.errors.near(t, q, scales)  # what says nothing at the start may say something by now, and round
    kept = tuple(review_rows(jacobian, errors, finding.kept, _holding(balance)))
    if kept == finding.kept or len(kept) < len(finding.kept):  # at a singular position no choice is a good one
        return finding
    redundant = tuple(i for i in range(balance.constraints) if i not in set(kept))
    return replace(finding, kept=kept, redundant=redundant)


def kept_along(
    finding: RankFinding, balance: Balance, t: FloatArray, q: FloatArray, scales: FloatArray, sizes: FloatArray
) -> list[tuple[slice, NDArray[np.intp]]]:
    """Return which constraints to keep along a motion: stretches of its samples, with the constraints for each."""
    parts = [0]
    kept = [finding.kept]
    way = np.concatenate([[0.0], np.cumsum(np.max(np.abs(np.diff(q, axis=1)) / sizes[:, None], axis=0, initial=0.0))])
    last = -np.inf
    for i in range(len(t) if finding.redundant else 0):
        if way[i] - last < _MOVE and not balance.errors.moves_by_itself:
            continue
        last = way[i]
        finding = review_kept(finding, balance, float(t[i]), q[:, i], scales)
        if finding.kept != kept[-1]:
            parts.append(i)
            kept.append(finding.kept)
    ends = [*parts[1:], len(t)]
    found = zip(parts, ends, kept, strict=True)
    return [(slice(a, b), np.asarray(one, dtype=np.intp)) for a, b, one in found if b > a]


def _look(balance: Balance, t: float, q: FloatArray, scales: FloatArray) -> _Place:
    now = balance.constraints_at(t, q, np.zeros_like(scales))
    miss = float(np.max(np.abs(now.value / balance.row_scales(now, t, q, scales))))
    jacobian = scaled(now.jacobian, scales)
    errors = balance.errors.of_jacobian(t, q, scales, miss)  # slopes are known no better than a place that has drifted
    # What holds positions comes first: then a constraint on velocities alone is never kept in place of one.
    kept = independent_rows(jacobian, errors, first=_holding(balance))
    return _Place(to_array(jacobian), errors, kept, miss)


def _holding(balance: Balance) -> NDArray[np.bool_]:
    """Return which constraints hold positions."""
    return np.isin(np.arange(balance.constraints), balance.holonomic)


def _nearby(balance: Balance, t: float, q: FloatArray, scales: FloatArray, here: _Place) -> tuple[list[_Place], bool]:
    """Return admissible places near by, and whether there seem to be any."""
    # Constraints on velocities alone keep nothing from being reached.
    holding = [i for i in here.kept if i in set(balance.holonomic.tolist())]
    admissible = open_directions(here.jacobian[holding], tolerances.CLEAR)
    still, found = np.zeros_like(scales), []
    for attempt, step in enumerate(_STEPS, 1):
        if not len(admissible):
            break
        # any direction that no symmetry singles out
        along = uneven(len(admissible), attempt) @ admissible
        way = step * scales * along / np.linalg.norm(along)
        # From a singular position, Newton's method falls back into it unless something holds it away.
        held = np.where(np.arange(len(scales)) == np.argmax(np.abs(along)), 0.0, scales)
        for free, iterations in ((scales, 12), (held, 30)):
            try:
                nearby, _ = balance.project(t, balance.kinematic_map.moved(t, q, way), still, free, iterations)
                place = _look(balance, t, nearby, scales)
                if place.miss <= tolerances.CLOSED:
                    found.append(place)
                    break
            except (KernelEvaluationError, np.linalg.LinAlgError):
                continue  # a law has no value there: that says nothing about the start
    return found, bool(len(admissible))


def _lost(here: _Place, nearby: list[_Place], kept: list[int]) -> tuple[int, ...]:
    """Return which independent constraints follow from the others at the start, or all but follow."""
    if not nearby or not kept:
        return ()
    ones = np.ones(here.jacobian.shape[1])
    units = np.max([row_sizes(place.jacobian, ones) for place in (here, *nearby)], axis=0)
    first, *others = (singular_values(place.jacobian[kept] / units[kept, None]) for place in (here, *nearby))
    missing = lost_rank(first, max(float(values[-1]) for values in others))
    if not missing:
        return ()
    left = independent_rows(here.jacobian[kept], here.errors[kept], len(kept) - missing)
    return tuple(one for i, one in enumerate(kept) if i not in set(left))


POOR = 1.5
"""A choice is poor where an independent coordinate moves a dependent one by so many times as much.

Of 1.2 to 10, tried on four-bars none of whose links can turn fully, values up to 2 took the fewest steps; at 10 they
took a quarter more, and ten times as many Jacobians where steps that failed followed each other.
"""

_SETTLED = 1.01
"""Exchanges go on until no entry is larger."""


_LOST = 1e-20
"""What is so small beside the largest entry of its row is rounding, and taken as zero: so little else is touched."""

_ALL = 50
"""Of so many constraints each is taken to touch all others, which takes no longer."""


def choose_dependent_coordinates(jacobian: Matrix, scales: FloatArray) -> tuple[int, ...]:
    """Return the coordinates that the constraints determine best: in turn, the column of which most is left."""
    count = jacobian.shape[0]
    if count > _ALL or not isinstance(jacobian, np.ndarray):
        return _choose_among_many(jacobian, scales)
    rows = or_one(np.max(np.abs(jacobian * scales), axis=1, initial=0.0))
    left = jacobian * scales / rows[:, None]
    sizes = np.einsum("ij,ij->j", left, left)
    is_chosen = np.zeros(len(sizes), dtype=bool)
    for _ in range(count):
        best = int(np.argmax(sizes))
        is_chosen[best] = True
        if sizes[best] > 0.0:
            left = _without(left[:, best] / np.sqrt(sizes[best]), left)
            sizes = np.where(is_chosen, -1.0, np.einsum("ij,ij->j", left, left))
        sizes[best] = -1.0
    return tuple(np.flatnonzero(is_chosen).tolist())


def _without(direction: FloatArray, part: FloatArray) -> FloatArray:
    """Return what is left of columns without a direction, taken out once more against rounding."""
    for _ in range(2):
        part = part - direction[:, None] * (direction @ part)
    return part


def _choose_among_many(jacobian: Matrix, scales: FloatArray) -> tuple[int, ...]:
    """Return the same for a large mechanism, of which each constraint touches few others: only these are worked on."""
    count, width = jacobian.shape
    rows, columns = jacobian.nonzero()
    values = np.asarray(jacobian[rows, columns]).ravel() * scales[columns]
    units = np.zeros(count)
    np.maximum.at(units, rows, np.abs(values))
    left: list[dict[int, float]] = [{} for _ in range(count)]
    touching: list[set[int]] = [set() for _ in range(width)]
    for i, j, value in zip(*(one.tolist() for one in (rows, columns, values / or_one(units)[rows])), strict=True):
        left[i][j] = value
        touching[j].add(i)

    def size(column: int) -> float:
        return sum(left[i][column] ** 2 for i in sorted(touching[column]))

    sizes = np.array([size(j) for j in range(width)])
    chosen: set[int] = set()
    for _ in range(count):
        best = int(np.argmax(sizes))
        chosen.add(best)
        if sizes[best] > 0.0:
            own = sorted(touching[best])
            touched = sorted(set[int]().union(*(left[i] for i in own)))
            part = np.array([[left[i].get(j, 0.0) for j in touched] for i in own])
            part = _without(part[:, touched.index(best)] / np.sqrt(sizes[best]), part)
            for i, row in zip(own, np.where(np.abs(part) < _LOST, 0.0, part).tolist(), strict=True):
                for j, value in zip(touched, row, strict=True):
                    if value:
                        left[i][j] = value
                        touching[j].add(i)
                    elif left[i].pop(j, None) is not None:
                        touching[j].remove(i)
            sizes[touched] = [-1.0 if j in chosen else size(j) for j in touched]
        sizes[best] = -1.0
    return tuple(sorted(chosen))


def review_partitioning(jacobian: FloatArray, scales: FloatArray, dependent: tuple[int, ...]) -> tuple[int, ...]:
    """Return a better choice of dependent coordinates if a choice has become poor, else the same one."""
    scaled = jacobian * scales
    chosen = list(dependent)
    bound = POOR
    for _ in range(10 * len(chosen)):
        free = [i for i in range(len(scales)) if i not in set(chosen)]
        if not free:
            break
        weights = _weights(scaled, chosen, free)
        if weights is None:
            better = choose_dependent_coordinates(jacobian, scales)
            if better == tuple(sorted(chosen)):
                break
            chosen, bound = list(better), _SETTLED
            continue
        row, column = np.unravel_index(int(np.argmax(weights)), weights.shape)
        if weights[row, column] <= bound:
            break
        chosen[int(row)], bound = free[int(column)], _SETTLED
    return tuple(sorted(chosen))


def _weights(scaled: FloatArray, chosen: list[int], free: list[int]) -> FloatArray | None:
    try:
        weights = np.abs(np.linalg.solve(scaled[:, chosen], scaled[:, free]))
    except np.linalg.LinAlgError:
        return None
    return weights if np.all(np.isfinite(weights)) else None
