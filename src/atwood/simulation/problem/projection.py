"""States of the solver projected onto the constraints, many at once.

The same Newton steps of least norm as for one state (`atwood.simulation.dynamics.balance.Balance.project`), by the
normal equations of the independent constraints. A state that does not come out well is left to the slower way, which is
safe where constraints nearly depend on each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, TypeAlias, TypeVar

import numpy as np

from atwood.arrays import BoolArray, FloatArray, IndexArray
from atwood.forms.caches import Key
from atwood.forms.loose import has_touched
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import is_best_full
from atwood.numerics.rank import trusted_sizes
from atwood.simulation.problem.problem import SceneProblem
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.codegen.llvm.misses import MissProgram
    from atwood.integrators.protocol import Nearest
    from atwood.numerics.sparse_batch import Normal, Pattern

_T = TypeVar("_T")

_NORMAL: Key[Normal] = Key("normal equations of the constraints")

_MISSES: Key[MissProgram] = Key("machine code of what states miss constraints by")

_MISSES_HERE: Key[Callable[..., FloatArray]] = Key("the same with parameters")

_PATTERN: Key[Pattern] = Key("where the constraint Jacobian has entries")

_LEAST = 1e-17
"""What is less is less than rounding, although it may go on to shrink."""

_STEPS = 12

_EXACT = 1e-14
"""States that miss all constraints by less, in the units of their rows, are left as they are: formulas gave them."""

_FAR = 1e-11
"""What moves by more of the sizes to meet the constraints has missed them."""

_LOOKED_AT = 16
"""Of states that were taken onto constraints so many are taken there again."""

_FEW, _MANY = 12, 100
"""Of so many entries for each state the largest is found one after another."""

_CHUNK = 4_000_000
"""Numbers in the matrices that are worked on at once."""


Misses: TypeAlias = Callable[[], FloatArray]
"""Gives by how much states miss the constraints on position and velocity, shape (2, states)."""

TakesNearest: TypeAlias = Callable[[FloatArray, FloatArray, FloatArray], "Nearest | None"]
"""Takes states at times, one row each, onto the constraints, and says for which it could, and how far they move in
units of their sizes; None where it can for none."""


@dataclass(frozen=True, eq=False)
class Projected:
    """Projected states.

    Attributes
    ----------
    coordinates, speeds
        Shape (number, states).
    misses
        Gives by how much the states missed the constraints on position and velocity before, shape (2, states).
    doubtful
        Which states have to be looked at one by one.
    """

    coordinates: FloatArray
    speeds: FloatArray
    misses: Misses
    doubtful: BoolArray


@dataclass(frozen=True, eq=False)
class ConstraintsAt:
    """Constraints at many states, each in units of how much it changes with a displacement of the size that counts.

    The slopes are entries of a pattern, of shape (entries, states); the units, in `rows`, of shape (states,
    constraints).
    """

    value: FloatArray
    entries: FloatArray
    explicit_rate: FloatArray
    kept: list[int]
    pattern: Pattern
    normal: Normal | None
    rows: FloatArray

    @cached_property
    def jacobian(self) -> FloatArray:
        """The slopes as arrays, of shape (states, constraints, coordinates)."""
        full = np.zeros((len(self.value), *self.pattern.shape))
        full[:, self.pattern.rows, self.pattern.columns] = self.entries.T
        return full

    def some(self, which: BoolArray) -> ConstraintsAt:
        """Return the same at some of the states."""
        own = self.value[which], self.entries[:, which], self.explicit_rate[which]
        return ConstraintsAt(*own, self.kept, self.pattern, self.normal, self.rows[which])

    def rate(self, speeds: FloatArray) -> FloatArray:
        """Return the constraints on velocity for speeds in units of the scales, shape (states, number)."""
        return self.pattern.times(self.entries, speeds.T).T + self.explicit_rate

    def step(self, right: FloatArray, rows: Sequence[int] | None = None) -> FloatArray:
        """Return the shortest displacements that change independent constraints by so much."""
        if self.normal is not None or rows is None:
            return self.solver()(right)
        chosen = list(rows)
        return _least_norm(self.jacobian[:, chosen])(right[:, chosen])

    def solver(self) -> Callable[[FloatArray], FloatArray]:
        """Return what gives such displacements for one right-hand side after another."""
        kept = self.kept
        if self.normal is not None:
            solve = self.normal.factorised(self.entries)
            return lambda right: solve(right[:, kept].T).T
        dense = _least_norm(self.jacobian[:, kept])
        return lambda right: dense(right[:, kept])


def project_states(plan: SceneProblem, t: FloatArray, q: FloatArray, u: FloatArray) -> Projected:
    """Return the nearest states that fulfil the constraints on position and velocity."""
    return _in_chunks(plan, len(t), lambda one: _project(plan, t[one], q[:, one], u[:, one]))


def project_rows(
    plan: SceneProblem, t: FloatArray, y: FloatArray, nearest: TakesNearest | None, is_apart: bool = False
) -> Projected:
    """Return the same of states of a solver, one row each, in C order.

    What machine code finds, if it is given, is taken where it misses nothing. The last state comes out as by itself if
    that is asked for: what is projected together rounds as the number of states has it.
    """
    normalized = plan.balance.kinematic_map.normalized
    if plan.balance.kinematic_map.has_homogeneous:
        q, u = plan.program.split(y.T)
        y = np.ascontiguousarray(np.concatenate([normalized(normalized(q)), u]).T)
    if is_apart and nearest is not None and len(t) <= _chunk(plan):
        taken = _taken(plan, t, y, nearest, _APART)
        if taken is not None:
            return taken
    return _in_chunks(plan, len(t), lambda one: _project_rows(plan, t[one], y[one], nearest), is_apart)


def left_alone(plan: SceneProblem, t: FloatArray, y: FloatArray) -> Projected | None:
    """Return states of an explicit method, one row each, as they are; None where not all of them meet the constraints.

    What formulas give does; then it makes no difference which states are looked at together.
    """
    if plan.balance.kinematic_map.has_homogeneous or len(t) > _chunk(plan):
        return None
    q, u = plan.program.split(y.T)
    held = misses_of(plan, t, q, u, y)
    if not _are_exact(plan, held):
        return None
    return Projected(q.copy(), u.copy(), lambda: held, np.zeros(len(t), dtype=bool))


def _in_chunks(
    plan: SceneProblem, states: int, project: Callable[[slice], Projected], is_apart: bool = False
) -> Projected:
    """Return states that are projected so many at a time, the last apart from the others if that is asked for."""
    chunk, last = _chunk(plan), states - 1 if is_apart else states
    parts = [project(slice(i, min(i + chunk, last))) for i in range(0, last, chunk)]
    parts += [project(slice(last, states))] if is_apart else []
    if len(parts) == 1:
        return parts[0]
    joined = (
        np.concatenate([getattr(one, name) for one in parts], axis=-1) for name in ("coordinates", "speeds", "doubtful")
    )
    near, moving, doubtful = joined
    return Projected(near, moving, lambda: np.concatenate([one.misses() for one in parts], axis=1), doubtful)


@dataclass(frozen=True, eq=False)
class ProjectedStates:
    """States after one step of Newton's method towards the constraints.

    Attributes
    ----------
    coordinates, speeds
        Shape (number, states).
    hold
        Projects other speeds at the same places.
    """

    coordinates: FloatArray
    speeds: FloatArray
    hold: Callable[[FloatArray], FloatArray]


def nearly_projected(plan: SceneProblem, t: FloatArray, q: FloatArray, u: FloatArray) -> ProjectedStates:
    """Return states after one step of Newton's method towards the constraints on position and velocity.

    For iterations that come ever nearer to the constraints by themselves: what is missed is missed squared afterwards.
    Speeds are projected once: where little is missed, so is little by rounding.
    """
    sizes, kinematic_map = plan.sizes[:, None], plan.balance.kinematic_map
    holding = plan.balance.holding(list(plan.finding.kept))
    q = kinematic_map.normalized(q)
    now = constraints_at(plan, t, q, u)
    q = kinematic_map.moved_each(t, q, -sizes * now.step(now.value, holding).T)
    now = constraints_at(plan, t, q, u)
    solve = now.solver()

    def hold(other: FloatArray) -> FloatArray:
        speeds = (other / sizes).T
        return sizes * (speeds - solve(now.rate(speeds))).T

    return ProjectedStates(q, hold(u), hold)


def misses_of(
    plan: SceneProblem, t: FloatArray, q: FloatArray, u: FloatArray, rows: FloatArray | None = None
) -> FloatArray:
    """Return by how much states miss the constraints on position and velocity, shape (2, states).

    `rows` are the states one row each, if they are there.
    """
    held = plan.balance.program
    if plan.pays(held.constraints_alone, len(t)):
        rows = np.concatenate([q, u]).T if rows is None else rows
        return _misses(plan)(t, rows, plan.sizes, tolerances.TRUSTED * errors_at(plan, t, q))
    chunk = _chunk(plan)
    found = np.zeros((2, len(t)))
    for i in range(0, len(t), chunk):
        part = slice(i, i + chunk)
        now = constraints_at(plan, t[part], q[:, part], u[:, part])
        found[:, part] = _largest(now, (u[:, part] / plan.sizes[:, None]).T)
    return found


def _misses(plan: SceneProblem) -> Callable[..., FloatArray]:
    """Return the same as machine code."""
    held, assembly = plan.balance.program, plan.assembly

    def compiled() -> MissProgram:
        from atwood.codegen.llvm.misses import compile_misses

        places = tuple(zip(held.jacobian_rows.tolist(), held.jacobian_columns.tolist(), strict=True))
        return compile_misses(held.constraints_alone, places)

    made = assembly.shared.get(_MISSES, compiled, assembly.form)
    return assembly.kept.get(_MISSES_HERE, lambda: made.bind(assembly.parameter_values), made)


def errors_at(plan: SceneProblem, t: FloatArray, q: FloatArray) -> FloatArray:
    """Return how far rounding can take the constraints at states."""
    farthest = int(np.abs(q.T).argmax()) // len(q) if q.size else 0
    return plan.balance.errors.near(float(t[farthest]), q[:, farthest], plan.sizes)


def once(make: Callable[[], _T]) -> Callable[[], _T]:
    """Return the same, made at the first call; `functools.cache` takes longer than it saves a run."""
    made: list[_T] = []

    def get() -> _T:
        if not made:
            made.append(make())
        return made[0]

    return get


def _chunk(plan: SceneProblem) -> int:
    """Return how many states to work on at once."""
    program = plan.balance.program
    normal = normal_equations(plan)
    volume = program.constraints * program.speeds if normal is None else normal.volume + program.program.size
    return max(1, _CHUNK // max(1, volume))


def normal_equations(plan: SceneProblem) -> Normal | None:
    """Return the normal equations of the independent constraints by their entries; None where arrays are better."""
    program = plan.balance.program
    plain = plan.balance.kinematic_map.is_plain and len(program.holonomic) == program.constraints
    if not plain or is_best_full((program.constraints, program.speeds), len(program.jacobian_rows), many=True):
        return None
    from atwood.numerics.sparse_batch import Normal

    kept = plan.finding.kept
    return plan.assembly.shared.get(_NORMAL, lambda: Normal(_pattern(plan), kept), plan.assembly.form, kept)


def _pattern(plan: SceneProblem) -> Pattern:
    """Return where the constraint Jacobian has entries."""
    from atwood.numerics.sparse_batch import Pattern

    program, assembly = plan.balance.program, plan.assembly
    shape = program.constraints, program.speeds
    places = program.jacobian_rows, program.jacobian_columns
    return assembly.shared.get(_PATTERN, lambda: Pattern(*places, shape), assembly.form)


def _largest_entry(values: FloatArray) -> FloatArray:
    """Return the size of the largest of the entries along the last axis; of few in turn, which is faster."""
    if not 0 < values.shape[-1] <= _FEW or len(values) < _MANY:
        return np.asarray(np.max(np.abs(values), axis=-1))
    found: FloatArray = np.abs(values[..., 0])
    for k in range(1, values.shape[-1]):
        np.maximum(found, np.abs(values[..., k]), out=found)
    return found


def _largest(now: ConstraintsAt, speeds: FloatArray) -> FloatArray:
    return np.stack([_largest_entry(now.value), _largest_entry(now.rate(speeds))])


def constraints_at(
    plan: SceneProblem, t: FloatArray, q: FloatArray, u: FloatArray, errors: FloatArray | None = None
) -> ConstraintsAt:
    """Return the constraints at states, of shape (states,) and (number, states); with errors, if they are known."""
    program, count = plan.balance.program.constraints_alone, len(t)
    if count == 1:  # numbers one by one take a tenth of the time of arrays with one number each
        alone = plan.assembly.kernel(program)(t, q[:, 0], u[:, 0])
        value, entries, explicit_rate = (np.reshape(one, (-1, 1)) for one in alone)
    else:
        value, entries, explicit_rate = plan.columns(program, count)(t[None, :], q, u)
    kept, pattern = list(plan.finding.kept), _pattern(plan)
    errors = errors_at(plan, t, q) if errors is None else errors
    entries = entries * plan.sizes[pattern.columns, None]
    rows = trusted_sizes(pattern.largest(entries).T, errors)
    entries /= rows.T[pattern.rows]
    return ConstraintsAt(value.T / rows, entries, explicit_rate.T / rows, kept, pattern, normal_equations(plan), rows)


def _project_rows(plan: SceneProblem, t: FloatArray, y: FloatArray, nearest: TakesNearest | None) -> Projected:
    taken = None if nearest is None else _taken(plan, t, y, nearest)
    if taken is not None:
        return taken
    q, u = plan.program.split(y.T)
    return _project(plan, t, q, u, y if y.shape[1] == len(q) + len(u) else None)


def _project(
    plan: SceneProblem, t: FloatArray, q: FloatArray, u: FloatArray, rows: FloatArray | None = None
) -> Projected:
    kinematic_map = plan.balance.kinematic_map
    q = q.copy() if rows is not None else kinematic_map.normalized(q.copy())
    held = misses_of(plan, t, q, u, rows)
    if _are_exact(plan, held):
        return Projected(q, u.copy(), lambda: held, np.zeros(len(t), dtype=bool))
    sizes, holding = plan.sizes[:, None], plan.balance.holding(list(plan.finding.kept))
    speeds = (u / sizes).T
    q, now, active = _onto_places(plan, t, q, u, holding)
    solve = now.solver()
    for _ in range(2):  # the second pass takes out the rounding of the first
        speeds = speeds - solve(now.rate(speeds))
    left = _largest(now, speeds) * np.array([[1.0], [plan.scales.time]])
    doubtful = ~np.all(left <= 10.0 * tolerances.MET, axis=0)
    doubtful[active] = True
    return Projected(q, sizes * speeds.T, lambda: held, doubtful)


def _onto_places(
    plan: SceneProblem, t: FloatArray, q: FloatArray, u: FloatArray, holding: Sequence[int] | None
) -> tuple[FloatArray, ConstraintsAt, IndexArray]:
    """Return coordinates on the constraints, these there, and numbers of the states that have come to no end.

    Those that have are left out: of most, one step later nothing but rounding is left, which now and then is halved.
    """
    kinematic_map, sizes = plan.balance.kinematic_map, plan.sizes[:, None]
    now, active, last = constraints_at(plan, t, q, u), np.arange(len(t)), np.full(len(t), np.inf)
    for _ in range(_STEPS):
        miss = _largest_entry(now.value)
        going = (miss > _LEAST) & ((miss >= tolerances.MET) | (miss < 0.5 * last))
        if not going.all():
            active, miss, now = active[going], miss[going], now.some(going)
        if not len(active):
            break
        last, step = miss, now.step(now.value, holding)
        moved = kinematic_map.moved_each(t[active], q[:, active], -sizes * step.T)
        q = kinematic_map.normalized(q)
        q[:, active] = moved
        now = constraints_at(plan, t[active], q[:, active], u[:, active], errors_at(plan, t, q))
    return q, now if len(now.value) == len(t) else constraints_at(plan, t, q, u), active


def _are_exact(plan: SceneProblem, held: FloatArray) -> bool:
    """Return whether all states are left as they are."""
    return bool(np.all(held[0] <= _EXACT) and np.all(held[1] * plan.scales.time <= _EXACT))


_TOGETHER = (slice(None),)

_APART = (slice(-1), slice(-1, None))


def _taken(
    plan: SceneProblem, t: FloatArray, y: FloatArray, nearest: TakesNearest, parts: Sequence[slice] = _TOGETHER
) -> Projected | None:
    """Return what machine code finds, the rest projected; None where it finds nothing. Parts are judged one by one."""
    sizes = np.concatenate([plan.coordinate_sizes, plan.sizes / plan.scales.time])
    made = nearest(t, y, sizes)
    if made is None:
        return None
    q, u = plan.program.split(y.T)
    own = [once(partial(misses_of, plan, t[one], q[:, one], u[:, one], y[one])) for one in parts]
    misses = own[0] if len(own) == 1 else once(lambda: np.concatenate([one() for one in own], axis=1))
    contacts = has_touched(plan.assembly)
    has_more = contacts or bool(plan.finding.redundant)
    leaves, free = [], np.zeros(len(t), dtype=bool)
    for one, held in zip(parts, own, strict=True):
        moved = float(made.moved[one].max())
        # A row in units of its largest entry misses no more than the sum of what its unknowns move by to meet it.
        meets = not has_more and len(sizes) * moved <= _EXACT
        is_near = contacts or moved <= _FAR
        leaves.append(bool(made.met[one].all()) and (meets or (is_near and _are_exact(plan, held()))))
    if all(leaves):
        return Projected(q.copy(), u.copy(), misses, free)
    near, moving = (part.copy() for part in plan.program.split(made.states.T))
    found = Projected(plan.balance.kinematic_map.normalized(near), moving, misses, free)
    stays = [False for _ in parts] if has_more else _stay(t, made, sizes, nearest, parts)
    for one, is_left, stay in zip(parts, leaves, stays, strict=True):
        if is_left:
            found.coordinates[:, one], found.speeds[:, one] = q[:, one], u[:, one]
            continue
        met = made.met[one]
        if not stay:
            rows = made.states[one] if found.coordinates is near else None
            left = misses_of(plan, t[one], found.coordinates[:, one], moving[:, one], rows)
            met = met & np.all(left * np.array([[1.0], [plan.scales.time]]) <= tolerances.MET, axis=0)
        if not met.all():
            rest = np.arange(len(t))[one][~met]
            again = _project(plan, t[rest], q[:, rest], u[:, rest])
            found.coordinates[:, rest], found.speeds[:, rest] = again.coordinates, again.speeds
            free[rest] = again.doubtful
    return found


def _stay(t: FloatArray, made: Nearest, sizes: FloatArray, nearest: TakesNearest, parts: Sequence[slice]) -> list[bool]:
    """Return of which parts states move by next to nothing where they are taken onto the constraints again.

    What is left is of second order in how far they were taken: those that moved most are looked at.
    """
    rows = [np.arange(len(t))[one] for one in parts]
    most = [
        one[np.argpartition(made.moved[one], -_LOOKED_AT)[-_LOOKED_AT:]] if len(one) > _LOOKED_AT else one
        for one in rows
    ]
    every = np.concatenate(most)
    again = nearest(t[every], made.states[every], sizes)
    if again is None:
        return [False for _ in parts]
    stays, first = [], 0
    for one, looked in zip(parts, map(len, most), strict=True):
        which, first = slice(first, first + looked), first + looked
        is_met = made.met[one].all() and again.met[which].all()
        stays.append(bool(is_met and 2 * len(sizes) * again.moved[which].max() <= tolerances.MET))
    return stays


def _least_norm(jacobian: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return what gives the shortest solutions of ``slope x = right``; not finite where rows depend on each other."""
    across = np.swapaxes(jacobian, 1, 2)
    with np.errstate(all="ignore"):
        square = jacobian @ across

    def solve(right: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):
            try:
                solved = np.linalg.solve(square, right[:, :, None])
            except np.linalg.LinAlgError:
                return np.full((len(jacobian), jacobian.shape[2]), np.nan)
            return np.asarray((across @ solved)[:, :, 0])

    return solve


def project_safely(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return one projected state that meets all constraints."""
    q, u = plan.balance.project(t, q, u, plan.sizes)
    plan.check_held(t, q, u)
    return q, u
