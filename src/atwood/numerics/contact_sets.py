"""Which one-sided rows hold: linear complementarity with friction, for accelerations and for impulses.

A row i moves by ``a = b + A f``. A gap has ``f >= 0``, ``a >= 0`` and ``f a = 0``. A slip sticks with ``a = 0`` and ``|f|``
within its static limit, or goes on in the direction s with ``f = -s L`` and ``s a >= 0``; its limits are ``L = L_0 + P f``
(F. Pfeiffer and C. Glocker, *Multibody Dynamics with Unilateral Contacts*, 1996, sections 6.3 and 8.3).

A set of states is tried, and the state that contradicts most is changed, until none does; where that comes back to a set,
all sets of few rows are looked through.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from atwood.arrays import BoolArray, FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import least_norm

OPEN, GOES_ON, STICKS = 0, 1, 2
"""States of a row: a gap is open or sticks (is closed); a slip is free, goes on or sticks."""

SLACK = 1e-9
"""Of the largest force, and of the largest motion: by so much an inequality may be missed, by rounding."""

_MOST_SETS = 20_000
"""More sets than these are not looked through."""


@dataclass(frozen=True, eq=False)
class Rows:
    """What is asked of some rows.

    Attributes
    ----------
    response
        A, shape (rows, rows).
    free
        b, shape (rows,).
    limits, shares
        L_0 and P of the limits, of gaps zero, shapes (rows,) and (rows, rows).
    static_limits, static_shares
        The same while it sticks.
    is_slip
        Whether each is a slip.
    given
        The direction of slips that go on already; 0 for those at rest.
    at
        For each slip the row of its gap; -1 where it has none among these.
    """

    response: FloatArray
    free: FloatArray
    limits: FloatArray
    shares: FloatArray
    static_limits: FloatArray
    static_shares: FloatArray
    is_slip: BoolArray
    given: FloatArray
    at: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.free)


@dataclass(frozen=True, eq=False)
class Found:
    """States that contradict nothing.

    Attributes
    ----------
    states, directions
        State of each row, and the direction of what goes on.
    forces, motions
        f and a.
    others
        How many other sets of states contradict nothing either, so far as these were looked for.
    """

    states: tuple[int, ...]
    directions: tuple[float, ...]
    forces: FloatArray
    motions: FloatArray
    others: int = 0


States = tuple[tuple[int, float], ...]
"""State and direction of each row."""


def find_states(rows: Rows, states: Sequence[int], directions: Sequence[float]) -> Found | None:
    """Return states of rows that contradict nothing, the nearest to those given; None where there are none."""
    present = tuple(_allowed(rows, i, int(s), float(d)) for i, (s, d) in enumerate(zip(states, directions, strict=True)))
    found = _improved(rows, present)
    return found if found is not None else _any_of_all(rows, present)


def _allowed(rows: Rows, i: int, state: int, direction: float) -> tuple[int, float]:
    if not rows.is_slip[i]:
        return (STICKS if state else OPEN), 0.0
    if rows.given[i]:
        return GOES_ON, float(rows.given[i])
    return (GOES_ON, direction) if state == GOES_ON and direction else (STICKS, 0.0)


def _improved(rows: Rows, tried: States) -> Found | None:
    """Change the state that contradicts most, until none does or a set comes again."""
    seen: set[States] = set()
    while tried not in seen:
        seen.add(tried)
        forces, motions = _solve(rows, tried)
        missed, better = _contradictions(rows, tried, forces, motions)
        if missed is None:
            return _told(tried, forces, motions)
        tried = (*tried[:missed], better, *tried[missed + 1 :])
    return None


def _any_of_all(rows: Rows, present: States) -> Found | None:
    """Look through all sets; of those that contradict nothing the one with the fewest changes, then the least forces."""
    choices = [_choices(rows, i) for i in range(len(rows))]
    if np.prod([float(len(one)) for one in choices]) > _MOST_SETS:
        return None
    best: tuple[tuple[int, float], States, FloatArray, FloatArray] | None = None
    count = 0
    for tried in product(*choices):
        forces, motions = _solve(rows, tried)
        if _contradictions(rows, tried, forces, motions)[0] is not None:
            continue
        count += 1
        price = sum(a != b for a, b in zip(tried, present, strict=True)), float(np.sum(np.abs(forces)))
        if best is None or price < best[0]:
            best = price, tried, forces, motions
    return None if best is None else _told(*best[1:], others=count - 1)


def _choices(rows: Rows, i: int) -> list[tuple[int, float]]:
    if not rows.is_slip[i]:
        return [(OPEN, 0.0), (STICKS, 0.0)]
    if rows.given[i]:
        return [(GOES_ON, float(rows.given[i]))]
    return [(STICKS, 0.0), (GOES_ON, 1.0), (GOES_ON, -1.0)]


def _told(states: States, forces: FloatArray, motions: FloatArray, others: int = 0) -> Found:
    return Found(tuple(s for s, _ in states), tuple(d for _, d in states), forces, motions, others)


def _solve(rows: Rows, states: States) -> tuple[FloatArray, FloatArray]:
    """Return the forces and motions of a set of states."""
    count = len(rows)
    matrix, right = np.eye(count), np.zeros(count)
    for i, (state, direction) in enumerate(states):
        if state == STICKS and not _is_loose(rows, states, i):
            matrix[i], right[i] = rows.response[i], -rows.free[i]
        elif state == GOES_ON:
            matrix[i] = matrix[i] + direction * rows.shares[i]
            right[i] = -direction * rows.limits[i]
    if not count:
        return right, right
    size = np.max(np.abs(matrix), axis=1)
    size = np.where(size > 0.0, size, 1.0)
    forces = least_norm(matrix / size[:, None], right / size)
    return forces, rows.free + rows.response @ forces


def _is_loose(rows: Rows, states: States, i: int) -> bool:
    """Return whether a slip is one at a gap that is open."""
    return bool(rows.is_slip[i]) and rows.at[i] >= 0 and states[rows.at[i]][0] == OPEN


def _contradictions(
    rows: Rows, states: States, forces: FloatArray, motions: FloatArray
) -> tuple[int | None, tuple[int, float]]:
    """Return the row whose state contradicts most, and the state it has then; None where none does."""
    if not len(rows):
        return None, (OPEN, 0.0)
    limits = rows.limits + rows.shares @ forces
    static = rows.static_limits + rows.static_shares @ forces
    pushes = max(float(np.max(np.abs(forces))), float(np.max(np.abs(limits)))) or 1.0
    moves = float(np.max(np.maximum(np.abs(rows.free), np.abs(rows.response) @ np.abs(forces)))) or 1.0
    worst: tuple[float, int | None, tuple[int, float]] = (SLACK, None, (OPEN, 0.0))
    for i, (state, direction) in enumerate(states):
        if not rows.is_slip[i]:
            miss = -forces[i] / pushes if state == STICKS else -motions[i] / moves
            better = (OPEN, 0.0) if state == STICKS else (STICKS, 0.0)
        elif _is_loose(rows, states, i):
            continue
        elif state == STICKS:
            miss = (abs(forces[i]) - static[i]) / pushes
            better = (GOES_ON, -1.0 if forces[i] > 0.0 else 1.0)
            if abs(motions[i]) > SLACK * moves:  # rows that depend on each other, and cannot all stick
                miss = max(miss, abs(motions[i]) / moves)
        else:
            miss = 0.0 if rows.given[i] else -direction * motions[i] / moves
            better = (STICKS, 0.0)
            miss, better = max((miss, better), (-limits[i] / pushes, (OPEN, 0.0)), key=lambda one: one[0])
        if miss > worst[0]:
            worst = float(miss), i, better
    return worst[1], worst[2]


def all_states(rows: Rows) -> Iterator[Found]:
    """Yield every set of states that contradicts nothing; for few rows."""
    for tried in product(*(_choices(rows, i) for i in range(len(rows)))):
        forces, motions = _solve(rows, tried)
        if _contradictions(rows, tried, forces, motions)[0] is None:
            yield _told(tried, forces, motions)
