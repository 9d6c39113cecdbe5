"""Which one-sided rows hold: linear complementarity with friction, for accelerations and for impulses.

Rows move by ``a = b + A f``. A gap has ``f >= 0``, ``a >= 0`` and ``f a = 0``. A slip, of one row or of two that are
square to each other, sticks with ``a = 0`` and ``|f|`` within its static limit, or goes on in a direction d with
``f = -L d`` and ``a = |a| d``; its limits, which may be others backwards, are ``L = L_0 + P f`` (F. Pfeiffer and C.
Glocker, *Multibody Dynamics with Unilateral Contacts*, 1996, chapters 6 and 8).

A set of states is tried, and the state that contradicts most is changed, until none does; where that does not end, all
sets of few rows are looked through.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import least_norm

OPEN, GOES_ON, STICKS = 0, 1, 2
"""States: a gap is open or sticks (is closed); a slip is free, goes on or sticks."""

SLACK = 1e-9
"""Of the largest force, and of the largest motion: by so much an inequality may be missed, by rounding."""

_MOST_SETS = 20_000
"""More sets than these are not looked through."""

_CLEAR = 1e-8
"""A pivot of scaled rows that is no larger may be rounding: rows then depend on each other."""

_TURNS = 60
"""So many turns find the direction in which something begins to slip."""

Direction = tuple[float, ...]
State = tuple[int, Direction]
"""What a gap or a slip does, and the direction in which it goes on, a number for each row."""


@dataclass(frozen=True, eq=False)
class Unit:
    """A gap, or a slip.

    Attributes
    ----------
    rows
        Its rows: two for a slip in a plane of directions.
    is_slip
        Whether it is a slip.
    given
        The direction in which it goes on already; zeros at rest.
    at
        The number of its gap among the units; -1 where it has none.
    """

    rows: tuple[int, ...]
    is_slip: bool
    given: Direction
    at: int

    @property
    def is_given(self) -> bool:
        """Whether it is not at rest."""
        return any(self.given)


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of friction ``L_0 + P f``, a row for each unit, and the same while it sticks."""

    free: FloatArray
    shares: FloatArray
    static_free: FloatArray
    static_shares: FloatArray


@dataclass(frozen=True, eq=False)
class Contacts:
    """What is asked of some gaps and slips: A, b, the units and their limits, also those of what goes backwards.

    The static limit of a gap is what it bears that is pulled open.
    """

    response: FloatArray
    free: FloatArray
    units: tuple[Unit, ...]
    limits: Limits
    backwards: Limits | None = None


@dataclass(frozen=True, eq=False)
class Found:
    """States that contradict nothing, the forces f, and the motions a."""

    states: tuple[State, ...]
    forces: FloatArray
    motions: FloatArray


@dataclass(frozen=True, eq=False)
class _Listed:
    """The same in plain numbers: arrays of so few take ten times as long."""

    response: list[list[float]]
    free: list[float]
    units: tuple[Unit, ...]
    sides: tuple[_Side, _Side]


_Side = tuple[list[float], list[list[float]], list[float], list[list[float]]]
"""Limits and their shares, and the same of what sticks."""


def _listed(contacts: Contacts) -> _Listed:
    ahead, back = _side(contacts.limits), contacts.backwards
    sides = ahead, ahead if back is None else _side(back)
    return _Listed(contacts.response.tolist(), contacts.free.tolist(), contacts.units, sides)


def _side(one: Limits) -> _Side:
    return one.free.tolist(), one.shares.tolist(), one.static_free.tolist(), one.static_shares.tolist()


def is_back(direction: Direction) -> bool:
    """Return whether a direction is that in which limits may be others."""
    return len(direction) == 1 and direction[0] < 0.0


def find_states(contacts: Contacts, states: Sequence[State]) -> Found | None:
    """Return states that contradict nothing, near to those given; None where there are none."""
    present = tuple(_allowed(unit, *one) for unit, one in zip(contacts.units, states, strict=True))
    found = _improved(_listed(contacts), present)
    if found is not None:
        return found
    every = [
        (sum(a[0] != b[0] for a, b in zip(one.states, present, strict=True)), float(np.sum(np.abs(one.forces))), one)
        for one in all_states(contacts)
    ]
    return min(every, key=lambda one: one[:2])[2] if every else None


def all_states(contacts: Contacts) -> Iterator[Found]:
    """Yield every set of states that contradicts nothing; nothing where there are too many sets."""
    choices = [_choices(unit) for unit in contacts.units]
    if math.prod(map(len, choices)) > _MOST_SETS:
        return
    listed = _listed(contacts)
    for tried in product(*choices):
        states = tried
        for _ in range(_TURNS):
            forces, motions = _solve(listed, states)
            number, better = _contradiction(listed, states, forces, motions)
            if number < 0:
                yield Found(states, np.array(forces), np.array(motions))
                break
            if len(listed.units[number].rows) < 2 or better[0] != states[number][0]:
                break
            states = (*states[:number], better, *states[number + 1 :])


def _allowed(unit: Unit, state: int, direction: Direction) -> State:
    none = (0.0,) * len(unit.rows)
    if not unit.is_slip:
        return (STICKS if state else OPEN), none
    if unit.is_given:
        return GOES_ON, unit.given
    return (GOES_ON, direction) if state == GOES_ON and any(direction) else (STICKS, none)


def _choices(unit: Unit) -> list[State]:
    none = (0.0,) * len(unit.rows)
    if not unit.is_slip:
        return [(OPEN, none), (STICKS, none)]
    if unit.is_given:
        return [(GOES_ON, unit.given)]
    turns = [0.25 * math.pi * i for i in range(8)]
    ways: list[Direction] = [(1.0,), (-1.0,)] if len(none) == 1 else [(math.cos(x), math.sin(x)) for x in turns]
    return [(STICKS, none), *((GOES_ON, way) for way in ways)]


def _improved(contacts: _Listed, tried: tuple[State, ...]) -> Found | None:
    """Change the state that contradicts most, until none does or a set comes again."""
    seen: set[tuple[State, ...]] = set()
    while tried not in seen and len(seen) < _TURNS * (1 + len(contacts.units)):
        seen.add(tried)
        forces, motions = _solve(contacts, tried)
        number, better = _contradiction(contacts, tried, forces, motions)
        if number < 0:
            return Found(tried, np.array(forces), np.array(motions))
        tried = (*tried[:number], better, *tried[number + 1 :])
    return None


def _is_loose(states: Sequence[State], unit: Unit) -> bool:
    """Return whether a slip is one at a gap that is open."""
    return unit.is_slip and unit.at >= 0 and states[unit.at][0] == OPEN


def _solve(contacts: _Listed, states: Sequence[State]) -> tuple[list[float], list[float]]:
    """Return the forces and motions of a set of states."""
    acting: list[int] = []
    rows: list[list[float]] = []
    right: list[float] = []
    for k, (unit, (state, direction)) in enumerate(zip(contacts.units, states, strict=True)):
        if state == OPEN or _is_loose(states, unit):
            continue
        for row, part in zip(unit.rows, direction, strict=True):
            acting.append(row)
            if state == STICKS:
                rows.append(contacts.response[row])
                right.append(-contacts.free[row])
            else:
                limits, shares, _, _ = contacts.sides[is_back(direction)]
                turned = [part * share for share in shares[k]]
                turned[row] += 1.0
                rows.append(turned)
                right.append(-part * limits[k])
    forces, motions = [0.0] * len(contacts.free), list(contacts.free)
    for row, force in zip(acting, _solved([[one[i] for i in acting] for one in rows], right), strict=True):
        forces[row] = force
        for i, by in enumerate(contacts.response):
            motions[i] += by[row] * force
    return forces, motions


def _solved(matrix: list[list[float]], right: list[float]) -> list[float]:
    """Solve a small linear system; where rows depend on each other, by least norm."""
    count = len(right)
    sizes = [max(map(abs, row)) or 1.0 for row in matrix]
    left = [[*(x / size for x in row), one / size] for row, one, size in zip(matrix, right, sizes, strict=True)]
    for i in range(count):
        best = max(range(i, count), key=lambda k: abs(left[k][i]))
        if not abs(left[best][i]) > _CLEAR:
            size = np.array(sizes)
            found: list[float] = least_norm(np.array(matrix) / size[:, None], np.array(right) / size).tolist()
            return found
        left[i], left[best] = left[best], left[i]
        pivot = left[i]
        for row in left[i + 1 :]:
            share = row[i] / pivot[i]
            for k in range(i + 1, count + 1):
                row[k] -= share * pivot[k]
    solution = [0.0] * count
    for i in reversed(range(count)):
        row = left[i]
        solution[i] = (row[count] - sum(row[k] * solution[k] for k in range(i + 1, count))) / row[i]
    return solution


def _contradiction(
    contacts: _Listed, states: Sequence[State], forces: Sequence[float], motions: Sequence[float]
) -> tuple[int, State]:
    """Return the unit whose state contradicts most, and the state it has then; -1 where none does."""
    better: State = (OPEN, (0.0,))
    worst, number = SLACK, -1
    if not contacts.units:
        return number, better
    size = max(abs(_limits(contacts.sides[0], k, forces)[0]) for k in range(len(contacts.units)))
    pushes = max(max(map(abs, forces)), size) or 1.0
    moves = max(
        max(abs(free), sum(abs(by * force) for by, force in zip(row, forces, strict=True)))
        for free, row in zip(contacts.free, contacts.response, strict=True)
    )
    moves = moves or 1.0
    for k, (unit, state) in enumerate(zip(contacts.units, states, strict=True)):
        if _is_loose(states, unit):
            continue
        f, a = [forces[i] / pushes for i in unit.rows], [motions[i] / moves for i in unit.rows]
        side = contacts.sides[is_back(state[1] if state[0] == GOES_ON else tuple(-x for x in f))]
        limit, static = (one / pushes for one in _limits(side, k, forces))
        by = max(contacts.response[i][i] for i in unit.rows) * pushes / moves
        for miss, other in _misses(unit, state, f, a, limit, static, any(side[1][k]), by):
            if miss > worst:
                worst, number, better = miss, k, other
    return number, better


def _limits(side: _Side, k: int, forces: Sequence[float]) -> tuple[float, float]:
    """Return limit and static limit of a unit at some forces."""
    limits, shares, static, static_shares = side
    ahead = sum(share * force for share, force in zip(shares[k], forces, strict=True))
    return limits[k] + ahead, static[k] + sum(share * f for share, f in zip(static_shares[k], forces, strict=True))


def _misses(
    unit: Unit,
    state: State,
    f: Sequence[float],
    a: Sequence[float],
    limit: float,
    static: float,
    reads: bool,
    by: float,
) -> Iterator[tuple[float, State]]:
    """Yield by how much a state contradicts each law, and the state that does not.

    A limit that reads forces is zero now and then, and what has it rubs all the same. A direction is turned towards
    that of the motion as an augmented Lagrangian turns it, by what the limit itself moves: lest it swings.
    """
    none = (0.0,) * len(f)
    if not unit.is_slip:
        yield (-f[0] - static, (OPEN, none)) if state[0] == STICKS else (-a[0], (STICKS, none))
        if state[0] == STICKS:
            yield -a[0], (STICKS, none)
        return
    is_alone = unit.at < 0 and not reads
    if is_alone and max(limit, static) <= 0.0:  # nothing is pressed
        yield (0.0 if state[0] == OPEN else 1.0), (OPEN, none)
        return
    if state[0] == STICKS:
        size = math.hypot(*f)
        way = tuple(-x / size for x in f) if size else (1.0, *none[1:])
        yield size - static, (GOES_ON, way)
        yield math.hypot(*a), (GOES_ON, way)  # rows that depend on each other cannot all stick
        return
    if state[0] == GOES_ON:
        if is_alone:  # at a gap it is negative only where the gap pulls, which is said there
            yield -limit, (OPEN, none)
        if unit.is_given:
            return
        along = sum(x * d for x, d in zip(a, state[1], strict=True))
        if along <= 0.0:
            yield -along, (STICKS, none)
            return
        size = math.hypot(*a)
        across = math.hypot(*(x - along * d for x, d in zip(a, state[1], strict=True)))
        turned = [x / max(size, limit * by) + d for x, d in zip(a, state[1], strict=True)]
        yield across, (GOES_ON, tuple(x / math.hypot(*turned) for x in turned))
        return
    yield max(limit, static, float(reads)), (GOES_ON, unit.given) if unit.is_given else (STICKS, none)
