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
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial
from itertools import compress, product

import numpy as np

from atwood.arrays import BoolArray, FloatArray
from atwood.lazy_dataclasses import dataclass, replace
from atwood.numerics.matrices import least_norm, or_one
from atwood.numerics.rank import decompose, null_space

OPEN, GOES_ON, STICKS = 0, 1, 2
"""States: a gap is open or sticks (is closed); a slip is free, goes on or sticks."""

SLACK = 1e-9
"""Of the largest force, and of the largest motion: by so much an inequality may be missed, by rounding."""

TIGHT = 1e-13
"""The same where states are looked for first: rows that do not depend on each other have no more of it."""

_MOST_SETS = 20_000
"""More sets than these are not looked through."""

CLEAR = 1e-8
"""A pivot of scaled rows that is no larger may be rounding: rows then depend on each other."""

FIRM = 1e-5
"""A pivot of scaled rows of which a share is chosen is larger: forces of what is less are a hundred times the load."""

NOTHING = 1e-14
"""What moves by so small a share of what others do is held by joints but for rounding."""

_GIVES = 0.03
"""Of what rows move by their own forces: what gives way does so by as much while forces are projected one by one."""

SWEEPS = 5000
"""So often all forces are projected; each time takes some ten microseconds for each."""

STILL = 1e-12
"""Directions that change by so little are found."""

TURNS = 60
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

    @property
    def is_free_cone(self) -> bool:
        """Whether it may begin to slip in any direction."""
        return len(self.rows) == 2 and not self.is_given


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

    The static limit of a gap is what it bears that is pulled open. Rows that give way, as springs do that are ever so
    stiff, share a load by that where nothing else determines it; the others have zeros there. Rows may be lengths and
    angles: motions of these sizes are alike.
    """

    response: FloatArray
    free: FloatArray
    units: tuple[Unit, ...]
    limits: Limits
    backwards: Limits | None = None
    compliance: FloatArray | None = None
    sizes: FloatArray | float = 1.0


@dataclass(frozen=True, eq=False)
class Found:
    """States that contradict nothing, the forces f and the motions a.

    Attributes
    ----------
    states, forces, motions
        Of all units, and of all rows.
    is_redundant
        Whether other forces make the same of what holds, so that nothing determines how it is shared.
    moving
        The gaps among whose units forces could be shared otherwise with another motion, as friction can make it.
    at_limits
        The same rest with the forces of some slips at their limits, where such a set was found first.
    """

    states: tuple[State, ...]
    forces: FloatArray
    motions: FloatArray
    is_redundant: bool = False
    moving: tuple[tuple[int, ...], ...] = ()
    at_limits: Found | None = None


@dataclass(frozen=True, eq=False)
class _Listed:
    """The same in plain numbers: arrays of so few take ten times as long."""

    response: list[list[float]]
    free: list[float]
    units: tuple[Unit, ...]
    sides: tuple[_Side, _Side]
    compliance: FloatArray | None
    sizes: FloatArray


_Side = tuple[list[float], list[list[float]], list[float], list[list[float]]]
"""Limits and their shares, and the same of what sticks."""


def _listed(contacts: Contacts) -> _Listed:
    ahead, back = _side(contacts.limits), contacts.backwards
    sides = ahead, ahead if back is None else _side(back)
    gives = None if contacts.compliance is None or not contacts.compliance.any() else contacts.compliance
    sizes = np.broadcast_to(contacts.sizes, contacts.free.shape)
    return _Listed(contacts.response.tolist(), contacts.free.tolist(), contacts.units, sides, gives, sizes)


def _side(one: Limits) -> _Side:
    return one.free.tolist(), one.shares.tolist(), one.static_free.tolist(), one.static_shares.tolist()


def is_back(direction: Direction) -> bool:
    """Return whether a direction is that in which limits may be others."""
    return len(direction) == 1 and direction[0] < 0.0


def find_states(contacts: Contacts, states: Sequence[State], rests: bool = False) -> Found | None:
    """Return states that contradict nothing, near to those given, or of rest if asked for; None where none are."""
    found = _found(contacts, states)
    is_free = [not unit.is_given for unit in contacts.units]
    if found is None or (rests and any(one[0] != STICKS for one in compress(found.states, is_free))):
        is_idle = found is not None and not any(compress(_is_moved(contacts, found), is_free))
        resting = _at_rest(contacts)
        found = found if resting is None else replace(resting, at_limits=found if is_idle else None)
    return None if found is None else _judged(contacts, found)


def _is_moved(contacts: Contacts, found: Found) -> list[bool]:
    """Return which units move, by more than rounding."""
    small = SLACK * float(np.max(np.abs(found.motions), initial=0.0) + np.max(np.abs(contacts.free), initial=0.0))
    return [math.hypot(*found.motions[list(unit.rows)]) > small for unit in contacts.units]


def _at_rest(contacts: Contacts) -> Found | None:
    """Return the states of rest where rows depend on each other and some share of forces holds everything.

    What goes on already has to go on alike with any share. Least forces may contradict a law that others meet. Whether
    any do is a linear program: the share is looked for that is furthest within all cones, whose sides are tangents, and
    more of these are added where it is beyond (J. E. Kelley, *The Cutting-Plane Method for Solving Convex Programs*,
    J. SIAM 8, 1960).
    """
    listed = _listed(contacts)
    rest = tuple(_allowed(unit, STICKS, (0.0,) * len(unit.rows)) for unit in contacts.units)
    acting, rows, right = _equations(listed, rest)
    by_springs = _by_springs(listed, acting, {one.rows[0] for one in contacts.units if not one.is_slip})
    matrix, wanted = np.vstack([np.array(rows), by_springs]), np.append(right, np.zeros(len(by_springs)))
    size = or_one(np.max(np.abs(matrix), axis=1, initial=0.0))
    matrix, wanted = matrix / size[:, None], wanted / size
    null, response = null_space(matrix, CLEAR), contacts.response[:, acting]
    if not null.size or np.max(np.abs(response @ null)) > math.sqrt(CLEAR) * np.max(np.abs(response)):
        return None
    forces = np.zeros(len(contacts.free))
    unit = float(or_one(np.max(np.abs(least_norm(matrix, wanted)), initial=0.0)))
    sides = [(k, way) for k, one in enumerate(contacts.units) if not one.is_given for way in _first_sides(one)]
    for _ in range(TURNS):
        tangents = [_side_of(contacts, k, way) for k, way in sides]
        most = np.array([limit for _, limit in tangents])
        solved = _furthest_within(np.array([one[acting] for one, _ in tangents]), most / unit, matrix, wanted / unit)
        if solved is None:
            return None
        forces[acting] = unit * solved
        motions = contacts.free + contacts.response @ forces
        number, (_, way) = _contradiction(listed, rest, forces.tolist(), motions.tolist())
        if number < 0:
            return Found(rest, forces, motions)
        if not contacts.units[number].is_free_cone:
            return None
        sides.append((number, tuple(-x for x in way)))
    return None


def _first_sides(unit: Unit) -> list[Direction]:
    """Return the directions in which the forces of what sticks have a limit."""
    if len(unit.rows) == 2:
        return [(math.cos(x), math.sin(x)) for x in (0.25 * math.pi * i for i in range(8))]
    return [(1.0,), (-1.0,)] if unit.is_slip else [(-1.0,)]


def _side_of(contacts: Contacts, k: int, way: Direction) -> tuple[FloatArray, float]:
    """Return a row and a number: the product of the row and the forces is no larger, as far as a unit has a limit."""
    limits = contacts.limits
    if contacts.backwards is not None and is_back(tuple(-x for x in way)):
        limits = contacts.backwards
    row = -limits.static_shares[k]
    row[list(contacts.units[k].rows)] += way
    return row, float(limits.static_free[k])


def _furthest_within(sides: FloatArray, most: FloatArray, rows: FloatArray, right: FloatArray) -> FloatArray | None:
    """Return the forces with ``rows f = right`` and ``sides f <= most`` by the largest margin; None where none are."""
    from scipy.optimize import linprog

    count = rows.shape[1]
    margin, none = np.ones((len(sides), 1)), np.zeros((len(rows), 1))
    solved = linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=np.hstack([sides, margin]),
        b_ub=most,
        A_eq=np.hstack([rows, none]),
        b_eq=right,
        bounds=[(None, None)] * count + [(-SLACK, 1.0)],
        method="highs",
    )
    return None if solved.x is None else np.asarray(solved.x)[:count]


def _judged(contacts: Contacts, found: Found) -> Found:
    """Return the same with what is known of forces that nothing determines.

    They are null vectors of the equations for forces, and what is pressed by no force can only be pressed more.
    What would slip nowhere sticks then: some share holds it.
    """
    listed = _listed(contacts)
    acting, rows, _ = _equations(listed, found.states)
    if not acting:
        return found
    # A motion of each row by the force that would make it alone: no unit has a say.
    every = sizes_of(np.diag(contacts.response), contacts.sizes)
    size = np.where(np.isfinite(every), every, 1.0)[acting]
    matrix = np.where(np.isfinite(every[acting]), 1.0, 0.0)[:, None] * np.array(rows) / size
    matrix = matrix / or_one(np.max(np.abs(matrix), axis=1, keepdims=True))
    null = null_space(matrix, CLEAR)
    if not null.size:
        return found
    states = tuple(
        (STICKS, (0.0,) * len(unit.rows)) if state[0] == GOES_ON and not unit.is_given and not is_moved else state
        for unit, state, is_moved in zip(contacts.units, found.states, _is_moved(contacts, found), strict=True)
    )
    by_springs = _by_springs(listed, acting, _sticking(contacts.units, found.states)) / size
    if len(by_springs):
        null = null_space(np.vstack([matrix, by_springs / np.max(np.abs(by_springs), axis=1, keepdims=True)]), CLEAR)
        if not null.size:
            is_met = np.abs(by_springs @ (size * found.forces[acting])) <= SLACK * (
                np.abs(by_springs) @ np.abs(size * found.forces[acting])
            )
            is_other = states != found.states or not np.all(is_met)
            return replace(found, states=states, is_redundant=is_other)
    moved = contacts.response[:, acting] / size @ null / every[:, None]
    kinds = decompose(moved, math.sqrt(CLEAR))
    moving = null @ kinds.right[: kinds.rank].T
    pressed = found.forces[acting] > SLACK * float(np.max(np.abs(found.forces)))
    gaps = {unit.rows[0]: k for k, unit in enumerate(contacts.units) if not unit.is_slip}
    bare = np.array([row in gaps for row in acting]) & ~pressed
    open_ways = [way for way in moving.T if any(np.all(sign * way[bare] >= -CLEAR) for sign in (1.0, -1.0))]
    shared = [np.flatnonzero(np.abs(way) > math.sqrt(CLEAR)) for way in open_ways]
    units = tuple(tuple(gaps[acting[i]] for i in some if acting[i] in gaps) for some in shared)
    return replace(found, states=states, is_redundant=True, moving=units)


def _found(contacts: Contacts, states: Sequence[State]) -> Found | None:
    present = tuple(_allowed(unit, *one) for unit, one in zip(contacts.units, states, strict=True))
    listed = _listed(contacts)
    closed = tuple(_allowed(unit, STICKS, (0.0,) * len(unit.rows)) for unit in contacts.units)
    tries = ((states, slack) for states in (present, closed) for slack in (TIGHT, SLACK))
    found = next(filter(None, (_improved(listed, *one) for one in tries)), None)
    if found is not None:
        return found
    states, forces = _relaxed(contacts)
    found = _improved(listed, states) or _shared(listed, states, forces)
    if found is not None:
        return found
    every = [
        (sum(a[0] != b[0] for a, b in zip(one.states, present, strict=True)), float(np.sum(np.abs(one.forces))), one)
        for one in all_states(contacts)
    ]
    return min(every, key=lambda one: one[:2])[2] if every else None


def _relaxed(contacts: Contacts) -> tuple[tuple[State, ...], FloatArray]:
    """Return states, and forces that are projected one by one on what they may be (Jean and Moreau, 1992).

    Where there are no such forces they grow without bound.
    """
    response, free = contacts.response, contacts.free
    gives = contacts.compliance
    if gives is not None and gives.any():  # far more than a little, so that it ends: states are looked for alone
        own = np.diag(response)
        response = response + np.diag(_GIVES * np.min(own[gives > 0.0] / gives[gives > 0.0]) * gives)
    forces = np.zeros(len(free))
    states: list[State] = []
    steps = [1.0 / (float(np.linalg.norm(response[np.ix_(one.rows, one.rows)], 2)) or 1.0) for one in contacts.units]
    usual = float(np.max(np.abs(free), initial=0.0)) * max(steps)
    small = SLACK * float(np.max(np.abs(free), initial=0.0))
    for _ in range(SWEEPS):
        states, last = [], forces.copy()
        for k, (unit, step) in enumerate(zip(contacts.units, steps, strict=True)):
            rows, none = list(unit.rows), (0.0,) * len(unit.rows)
            motion = free[rows] + response[rows] @ forces
            pushed = forces[rows] - step * motion
            limits = contacts.backwards or contacts.limits if is_back(tuple(-pushed)) else contacts.limits
            limit = max(0.0, float(limits.free[k] + limits.shares[k] @ forces))
            size = math.hypot(*pushed)
            if not unit.is_slip:
                least = -float(limits.static_free[k] + limits.static_shares[k] @ forces)
                forces[rows] = pushed if pushed[0] > least else 0.0
                states.append((STICKS if pushed[0] > least else OPEN, none))
            elif unit.is_given or size > limit:
                way = np.array(unit.given) if unit.is_given else -pushed / (size or 1.0)
                forces[rows] = -limit * way
                is_still = not unit.is_given and math.hypot(*motion) <= small
                states.append((STICKS, none) if is_still else (GOES_ON, tuple(way.tolist())))
            else:
                forces[rows] = pushed
                states.append((STICKS, none))
        most = float(np.max(np.abs(forces)))
        if float(np.max(np.abs(forces - last))) <= 1e-3 * SLACK * most or most > usual / SLACK:
            break
    return tuple(states), forces


def _shared(contacts: _Listed, states: tuple[State, ...], forces: FloatArray) -> Found | None:
    """Return these states if forces near to those given contradict nothing, though the least ones may."""
    acting, rows, right = _equations(contacts, states)
    if contacts.compliance is not None:  # which share is meant is known
        return None
    given = forces[acting]
    more = _solved(rows, (np.array(right) - np.array(rows).reshape(len(rows), len(rows)) @ given).tolist())
    found, motions = _moved(contacts, acting, (given + np.array(more)).tolist())
    if _contradiction(contacts, states, found, motions)[0] >= 0:
        return None
    return Found(states, np.array(found), np.array(motions))


def _sticking(units: Sequence[Unit], states: Sequence[State]) -> set[int]:
    """Return the rows that hold."""
    return {row for unit, (state, _) in zip(units, states, strict=True) if state == STICKS for row in unit.rows}


def sizes_of(own: FloatArray, sizes: FloatArray | float) -> FloatArray:
    """Return by what rows are scaled, from how each moves by its own force; infinite where joints hold it.

    Lengths and angles are compared by motions that are alike.
    """
    alike = own / np.square(sizes)
    return np.sqrt(np.where(alike > NOTHING * np.max(alike, initial=0.0), own, np.inf))


def balancing(response: FloatArray, gives: BoolArray, sizes: FloatArray) -> FloatArray:
    """Return forces that balance each other, of the rows that give way, a column each; see `sizes_of`."""
    soft, every = np.flatnonzero(gives), sizes_of(np.diag(response), sizes)
    scaled = response[:, soft] / every[:, None] / every[soft]
    some = null_space(scaled, CLEAR) / np.where(np.isfinite(every[soft]), every[soft], 1.0)[:, None]
    found = np.zeros((len(every), some.shape[1]))
    found[soft] = some
    return found


def _by_springs(contacts: _Listed, acting: Sequence[int], holding: Collection[int]) -> FloatArray:
    """Return what more is asked of forces that act, as equations whose right-hand sides are zero, where some rows hold.

    With ``A + e C`` in the place of A, the limit for small e has ``C f`` square to all forces that balance each other,
    of the rows that give way: the least elastic energy ``f C f/2``.
    """
    found, places = np.zeros((0, len(acting))), [i for i, row in enumerate(acting) if row in holding]
    if contacts.compliance is not None and places:
        rows = [acting[i] for i in places]
        gives = contacts.compliance[rows]
        response = np.array(contacts.response)[np.ix_(rows, rows)]
        more = (gives[:, None] * balancing(response, gives > 0.0, contacts.sizes[rows])).T
        found = np.zeros((len(more), len(acting)))
        found[:, places] = more
    return found


def all_states(contacts: Contacts) -> Iterator[Found]:
    """Yield every set of states that contradicts nothing; nothing where there are too many sets."""
    choices = [_choices(unit) for unit in contacts.units]
    if math.prod(map(len, choices)) > _MOST_SETS:
        return
    listed = _listed(contacts)
    for tried in product(*choices):
        states, forces, motions = _met(listed, tried)
        if _contradiction(listed, states, forces, motions)[0] < 0:
            yield Found(states, np.array(forces), np.array(motions))


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


def _improved(contacts: _Listed, tried: tuple[State, ...], slack: float = SLACK) -> Found | None:
    """Change the state that contradicts most, until none does or a set comes again."""
    seen: set[tuple[State, ...]] = set()
    while tried not in seen and len(seen) < TURNS * (1 + len(contacts.units)):
        seen.add(tried)
        tried, forces, motions = _met(contacts, tried)
        number, better = _contradiction(contacts, tried, forces, motions, slack)
        if number < 0:
            return Found(tried, np.array(forces), np.array(motions))
        tried = (*tried[:number], better, *tried[number + 1 :])
    return None


def _is_loose(states: Sequence[State], unit: Unit) -> bool:
    """Return whether a slip is one at a gap that is open."""
    return unit.is_slip and unit.at >= 0 and states[unit.at][0] == OPEN


def _met(contacts: _Listed, states: tuple[State, ...]) -> tuple[tuple[State, ...], Sequence[float], Sequence[float]]:
    """Return states with the directions that cones of two rows take, and their forces and motions.

    What begins to slip goes the way of its motion a, which depends on the force: ``f + L(f) a/|a| = 0``, by Newton's
    method. Where the motion turns round there is no such direction, and it is left as it is.
    """
    acting, rows, right = _equations(contacts, states)
    springs = partial(_by_springs, contacts, acting, _sticking(contacts.units, states))
    forces, motions = _moved(contacts, acting, _solved(rows, right, springs))
    slipping = zip(contacts.units, states, strict=True)
    cones = [k for k, (unit, state) in enumerate(slipping) if state[0] == GOES_ON and unit.is_free_cone]
    cones = [k for k in cones if not _is_loose(states, contacts.units[k])]
    for _ in range(TURNS if cones else 0):
        turned, most = list(states), 0.0
        for k in cones:
            pair = contacts.units[k].rows
            size = math.hypot(*(motions[row] for row in pair))
            way = tuple(motions[row] / size for row in pair) if size else (0.0, 0.0)
            if not way[0] * states[k][1][0] + way[1] * states[k][1][1] > 0.0:
                return states, forces, motions
            most = max(most, *(abs(new - old) for new, old in zip(way, states[k][1], strict=True)))
            turned[k] = (GOES_ON, way)
        if most <= STILL:
            break
        states = tuple(turned)
        acting, rows, right = _equations(contacts, states)
        for k in cones:
            first, second = contacts.units[k].rows
            (c, s), share = states[k][1], _limits(contacts.sides[0], k, forces)[0]
            share /= math.hypot(motions[first], motions[second])
            across = [c * y - s * x for x, y in zip(contacts.response[first], contacts.response[second], strict=True)]
            before = sum(by * force for by, force in zip(across, forces, strict=True))
            for row, part in ((first, -s), (second, c)):
                place = acting.index(row)
                rows[place] = [x + share * part * across[i] for x, i in zip(rows[place], acting, strict=True)]
                right[place] += share * part * before
        forces, motions = _moved(contacts, acting, _solved(rows, right, springs))
    return states, forces, motions


def _equations(contacts: _Listed, states: Sequence[State]) -> tuple[list[int], list[list[float]], list[float]]:
    """Return the rows that act, and the equations for their forces."""
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
    return acting, [[one[i] for i in acting] for one in rows], right


def _moved(contacts: _Listed, acting: list[int], given: list[float]) -> tuple[list[float], list[float]]:
    """Return the forces of all rows, and how all rows move by those that act."""
    forces, motions = [0.0] * len(contacts.free), list(contacts.free)
    for row, force in zip(acting, given, strict=True):
        forces[row] = force
        for i, by in enumerate(contacts.response):
            motions[i] += by[row] * force
    return forces, motions


def _solved(
    matrix: list[list[float]], right: list[float], springs: Callable[[], FloatArray] | None = None
) -> list[float]:
    """Solve a small linear system; where rows depend on each other, by least norm, with what springs ask besides."""
    count = len(right)
    sizes = [max(map(abs, row)) or 1.0 for row in matrix]
    left = [[*(x / size for x in row), one / size] for row, one, size in zip(matrix, right, sizes, strict=True)]
    for i in range(count):
        best = max(range(i, count), key=lambda k: abs(left[k][i]))
        if not abs(left[best][i]) > CLEAR:
            more = np.zeros((0, count)) if springs is None else springs()
            every = np.vstack([np.array(matrix), more])
            size = or_one(np.max(np.abs(every), axis=1))
            wanted = np.append(right, np.zeros(len(more)))
            found: list[float] = least_norm(every / size[:, None], wanted / size).tolist()
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
    contacts: _Listed,
    states: Sequence[State],
    forces: Sequence[float],
    motions: Sequence[float],
    slack: float = SLACK,
) -> tuple[int, State]:
    """Return the unit whose state contradicts most, and the state it has then; -1 where none does."""
    better: State = (OPEN, (0.0,))
    worst, number = slack, -1
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
        for miss, other in _misses(unit, state, f, a, limit, static, any(side[1][k])):
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
) -> Iterator[tuple[float, State]]:
    """Yield by how much a state contradicts each law, and the state that does not.

    A limit that reads forces is zero now and then, and what has it rubs all the same.
    """
    none = (0.0,) * len(f)
    if not unit.is_slip:
        yield (-f[0] - static, (OPEN, none)) if state[0] == STICKS else (-a[0], (STICKS, none))
        if state[0] == STICKS:
            yield -a[0], (STICKS, none)
            yield a[0], (OPEN, none)  # rows that depend on each other cannot all stick
        return
    is_alone = unit.at < 0 and not reads
    if is_alone and max(limit, static) <= 0.0:  # nothing is pressed
        yield (0.0 if state[0] == OPEN else 1.0), (OPEN, none)
        return
    if state[0] == STICKS:
        size = math.hypot(*f)
        way = tuple(-x / size for x in f) if size else (1.0, *none[1:])
        yield size - static, (GOES_ON, way)
        yield math.hypot(*a), (GOES_ON, way)
        return
    if state[0] == GOES_ON:
        if is_alone:  # at a gap it is negative only where the gap pulls, which is said there
            yield -limit, (OPEN, none)
        if unit.is_given:
            return
        # Where nothing moves after all there is no direction, and the equations for it do not hold.
        yield math.hypot(*(x + limit * d for x, d in zip(f, state[1], strict=True))), (STICKS, none)
        along = sum(x * d for x, d in zip(a, state[1], strict=True))
        if along <= 0.0:
            yield math.hypot(*a), (STICKS, none)
            return
        size = math.hypot(*a)
        across = math.hypot(*(x - along * d for x, d in zip(a, state[1], strict=True)))
        yield across, (GOES_ON, tuple(x / size for x in a))
        return
    yield max(limit, static, float(reads)), (GOES_ON, unit.given) if unit.is_given else (STICKS, none)
