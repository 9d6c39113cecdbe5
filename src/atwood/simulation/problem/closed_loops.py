"""Runs of mechanisms whose loops are solved by formulas: only the independent coordinates are integrated.

Which coordinates these are is a choice, as in the numeric loop (`atwood.simulation.dynamics.redundancy`). Of all that
formulas can do with, one is preferred that meets no dead centre in a whole turn; else the one that is farthest from
any. Where a dead centre comes near, others take over; where none are better, the position is singular or nearly so, and
constraints are kept from there on. Branches are found at one position and at many in the same way.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from contextlib import suppress
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.clock import check_time
from atwood.codegen import BoundKernel
from atwood.errors import KernelEvaluationError
from atwood.expr import DivisionByExactZeroError, Expression, Program, dependencies
from atwood.forms.assembly import Assembly, compiled_columns
from atwood.forms.caches import Key
from atwood.forms.loops.assur_groups import Loops
from atwood.forms.loops.closed_form import ClosedForm, Place, closed_form
from atwood.lazy_dataclasses import dataclass, replace
from atwood.simulation.dynamics.scales import coordinate_scales, motion_scales
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.projection import misses_of

if TYPE_CHECKING:
    from atwood.codegen.llvm.columns import ColumnKernel


_NEAR = 0.1
"""Nearer to a dead centre of every choice, as the square of a sine, the constraints are kept from there on.

That is 18 degrees before links are in line: whoever looks out for singular positions has to see the motion from well
before one on.
"""

_START = 0.15
"""Formulas begin only where so much is left, so that they do not end at once."""

_LEAVE = 0.25
"""Where this is left of the distance from a dead centre, another choice is looked for."""

_AMPLE = 0.5
"""Of several independent coordinates, among which none turns fully for all others, a choice so far is good enough."""

_LARGEST = 4000
"""With more products of freedoms and speeds constraints are kept: formulas know of no entry that is zero."""

_FEW_FREEDOMS = 3
"""Of so few freedoms the products are as many as the speeds, however many these are."""

_MOST, _FEWEST, _WORK = 60, 3, 120
"""So many choices of independent coordinates are tried at most; of mechanisms of many coordinates fewer, down to the
second number: the third divided by the number of coordinates. Each costs formulas for the whole mechanism."""

_LONG = 400
"""Of mechanisms of more coordinates the first choice that is good enough is taken, as of those of several freedoms."""


@dataclass(frozen=True, eq=False)
class Solved:
    """A mechanism with loops in terms of independent coordinates, on the branch of a position.

    Attributes
    ----------
    form
        Its programs.
    assembly
        The scene in its mode.
    branches
        Values of the branches.
    margin
        How far the position is from a dead centre, as the square of a sine.
    least
        What is left of that in a whole turn of the independent coordinate; 0 where it meets a dead centre, or does not
        turn.
    is_clear
        Whether that is so much that no dead centre needs to be looked out for.
    """

    form: ClosedForm
    assembly: Assembly
    branches: Mapping[Expression, float]
    margin: float = 0.0
    least: float = 0.0
    is_clear: bool = False
    _kernels: dict[tuple[Program, bool], BoundKernel] = field(default_factory=dict, init=False, repr=False)

    @property
    def independent(self) -> list[int]:
        """Numbers of the independent coordinates."""
        return list(self.form.loops.independent)

    @cached_property
    def values(self) -> FloatArray:
        """Values of all parameters of its programs."""
        return np.array([*self.assembly.parameter_values, *(self.branches[one] for one in self.form.loops.branches)])

    def kernel(self, program: Program, vectorized: bool = False) -> BoundKernel:
        """Return one of its programs with these values."""
        key = (program, vectorized)
        if key not in self._kernels:
            self._kernels[key] = self.assembly.compiled(program, vectorized).bind(self.values)
        return self._kernels[key]

    def reduced(self, y: FloatArray) -> FloatArray:
        """Return the state of the independent coordinates from that of all."""
        free, moving, n = self.independent, self.form.loops.speeds, len(self.assembly.reduced.coordinates)
        return np.concatenate([y[free], y[[n + i for i in moving]]])

    def states(self, t: FloatArray, y: FloatArray, is_compiled: bool = False) -> FloatArray:
        """Return all coordinates and speeds from the independent ones, shape (samples, unknowns)."""
        n = len(self.form.loops.independent)
        if not len(t):
            equations = self.assembly.reduced
            return np.zeros((0, len(equations.coordinates) + len(equations.speeds)))
        kernel = self._columns if is_compiled else self.kernel(self.form.states, vectorized=True)
        q, u = kernel(t[None, :], y[:, :n].T, y[:, n:].T)
        return np.concatenate([q, u]).T

    @cached_property
    def _columns(self) -> ColumnKernel:
        return compiled_columns(self.assembly, self.form.states).bind(self.values)

    def state(self, t: float, y: FloatArray) -> FloatArray:
        """Return the same of one state."""
        n = len(self.form.loops.independent)
        return np.concatenate(self.kernel(self.form.states)([t], y[:n], y[n:]))

    def flipped(self, number: int, t: float, y: FloatArray) -> Solved:
        """Return the same after one of the counted directions has turned away by a quarter, or come back."""
        n, one = len(self.form.loops.independent), self.form.loops.counted[number]
        assert one.flip is not None
        assert one.offset is not None
        beside = self.kernel(self.form.watched)([t], y[:n], y[n:])[1][number]
        flip = self.branches[one.flip]
        half = math.copysign(math.pi, flip * beside)
        return replace(self, branches={**self.branches, one.flip: -flip, one.offset: self.branches[one.offset] + half})


class _Choices:
    """What formulas can do for a mechanism with one choice of independent coordinates or another."""

    def __init__(self, plan: SceneProblem, t: float, q: FloatArray) -> None:
        assembly = plan.assembly
        self.equations = assembly.reduced
        self.loops = Loops(self.equations, _place(plan, t, q))
        every = self.loops.choices(len(self.equations.speeds) - plan.finding.rank)
        most = min(_MOST, max(_FEWEST, _WORK // len(self.equations.coordinates)))
        fitting = (one for one in itertools.islice(every, 20 * _MOST) if self.loops.can_be_solved(one))
        self.every = tuple(itertools.islice(fitting, most))
        self._forms: dict[tuple[int, ...], ClosedForm | None] = {}

    def form(self, assembly: Assembly, independent: tuple[int, ...]) -> ClosedForm | None:
        """Return the programs for one choice; None where the loops are not of such a form.

        Formulas whose divisor is zero by structure, as between axes that are always parallel, are none.
        """
        if independent not in self._forms:
            graph, start = self.equations.graph, len(self.equations.graph)
            with assembly.shared.lock:
                found = self.loops.solve(independent)
                try:
                    self._forms[independent] = (
                        None
                        if found is None
                        else closed_form(assembly.flat.name, self.equations, assembly.parameters, found, assembly.rows)
                    )
                except DivisionByExactZeroError:
                    self._forms[independent] = None
                graph.forget(start)
        return self._forms[independent]


_CHOICES: Key[_Choices] = Key("choices of independent coordinates")


def _choices(plan: SceneProblem, t: float, q: FloatArray) -> _Choices:
    return plan.assembly.shared.get(_CHOICES, lambda: _Choices(plan, t, q), plan.finding.rank)


def _place(plan: SceneProblem, t: float, q: FloatArray) -> Place:
    equations, assembly = plan.assembly.reduced, plan.assembly
    here = {equations.time: t, **dict(zip(equations.coordinates, map(float, q), strict=True))}
    values = dict(zip(assembly.parameters, map(float, assembly.parameter_values), strict=True))
    return Place(values, here, plan.scales.length)


def can_be_solved(plan: SceneProblem) -> bool:
    """Return whether a scene is one of which loops are solved by formulas, if their form is right.

    Its constraints hold positions, and its rates are speeds.
    """
    equations = plan.assembly.reduced
    return bool(
        plan.assembly.form == "reduced"
        and equations.constraints
        and plan.finding.kept
        and len(equations.speeds) > plan.finding.rank
        and all(one.is_homogeneous for one in equations.orientation_coordinates)
        and _freedoms_besides(plan) >= 0
        and _is_short(len(equations.speeds) - plan.finding.rank, len(equations.speeds))
        and all(one.value is not None for one in equations.constraints)
    )


def _is_short(freedoms: int, speeds: int) -> bool:
    return freedoms <= _FEW_FREEDOMS or freedoms * speeds <= _LARGEST


def _freedoms_besides(plan: SceneProblem) -> int:
    """Return how many freedoms are not those of orientations, which formulas take as they are."""
    equations = plan.assembly.reduced
    turning = sum(len(one.speeds) for one in equations.orientation_coordinates)
    return len(equations.speeds) - plan.finding.rank - turning


def solve_at(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> Solved | None:
    """Return the loops of a mechanism solved by formulas on the branch of a position, with the best choice there."""
    if plan.assembly.form != "reduced":
        return None
    return _remembered(plan, (t, q, u), None, lambda: _solve_at(plan, t, q, u) if can_be_solved(plan) else None)


def stay_at(plan: SceneProblem, form: ClosedForm, t: float, q: FloatArray, u: FloatArray) -> Solved | None:
    """Return the same with the choice of a form; see `on_branch`."""
    return _remembered(plan, (t, q, u), form, lambda: on_branch(plan, form, t, q, u))


def _remembered(
    plan: SceneProblem,
    state: tuple[float, FloatArray, FloatArray],
    form: ClosedForm | None,
    solve: Callable[[], Solved | None],
) -> Solved | None:
    """Return how loops are solved at a place where it has been asked before, else solve them."""
    t, q, u = state
    about = t, q.tobytes(), u.tobytes(), plan.finding.kept, plan.scales.length, form
    return plan.assembly.kept.recall(_SOLVED, solve, *about)


_SOLVED: Key[dict[tuple[Hashable, ...], Solved | None]] = Key("solved loops")


def _solve_at(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> Solved | None:
    assembly, choices = plan.assembly, _choices(plan, t, q)
    best: Solved | None = None
    for independent in choices.every:
        check_time()
        form = choices.form(assembly, independent)
        found = None if form is None else on_branch(plan, form, t, q, u)
        if found is None:
            continue
        if best is None or found.margin > best.margin:
            best = found
        is_enough = len(found.form.loops.speeds) > 1 or len(plan.assembly.reduced.coordinates) > _LONG
        if found.least or (is_enough and found.margin > _AMPLE):
            return found
    return best


def on_branch(plan: SceneProblem, form: ClosedForm, t: float, q: FloatArray, u: FloatArray) -> Solved | None:
    """Return a form on the branch of a position; None where it does not lead there, or a dead centre is near."""
    assembly, many = plan.assembly, ManyBranches(form, plan.assembly)
    values, found = many.branches(np.array([t]), q[None], assembly.parameter_values[None])
    if not found[0]:
        return None
    branches = values[0, len(assembly.parameters) :].tolist()
    solved = Solved(form, assembly, dict(zip(form.loops.branches, branches, strict=True)))
    y = solved.reduced(np.concatenate([q, u]))
    try:
        margin = min(_margins(solved, t, y), default=1.0)
        if not margin > CLEAR:
            return None
        made = solved.state(t, y)
    except KernelEvaluationError:
        return None
    misses = np.abs(made[: len(q)] - q) / plan.coordinate_sizes
    if not (np.all(misses <= AGREES) and _holds(plan, solved, t, y)):
        return None
    least, steepest = (float(one[0]) for one in many.least(t, y[None], values))
    if not (margin > _START or least):
        return None
    is_clear = least > steepest and not any(dependencies(form.watched.results, [plan.assembly.reduced.time]))
    return replace(solved, margin=margin, least=least, is_clear=is_clear)


def _margins(solved: Solved, t: float, y: FloatArray) -> Sequence[float]:
    n, form = len(solved.form.loops.independent), solved.form
    found: Sequence[float] = solved.kernel(form.watched)([t], y[:n], y[n:])[0][: len(form.loops.margins)]
    return found


def _holds(plan: SceneProblem, solved: Solved, t: float, y: FloatArray) -> bool:
    """Return whether all constraints hold wherever formulas lead to near by, with these parameters."""
    n, sizes = len(solved.independent), plan.coordinate_sizes[solved.independent]
    states = []
    for i, step in itertools.product(range(n), (ASIDE, -ASIDE)):
        moved = y.copy()
        moved[i] += step * sizes[i]
        with suppress(KernelEvaluationError):  # where the loop does not close
            states.append(solved.state(t, moved))
    if not states:
        return False
    misses = misses_of(plan, np.full(len(states), t), *plan.program.split(np.array(states).T))
    return bool(np.all(misses[0] <= AGREES) and np.all(misses[1] * plan.scales.time <= AGREES))


def levels(solved: Solved) -> tuple[float, float]:
    """Return at which distances from dead centres another choice is looked for, and at which none will do."""
    if solved.least:
        return 0.5 * solved.least, 0.25 * solved.least
    return max(_NEAR, min(_LEAVE, 0.5 * solved.margin)), _NEAR


CLEAR = 0.003
"""A choice of which so much is left in a whole turn meets no dead centre."""

TURN = 144
"""In so many positions of a whole turn it is seen whether there is a dead centre."""

AGREES = 1e-7
"""Formulas that miss a position by more, in units of the scene's sizes, are not those of its branch."""

ASIDE = 0.05
"""By so many of their sizes independent coordinates are moved to see whether formulas are right near by, too."""


@dataclass(frozen=True, eq=False)
class ManyBranches:
    """Closed loops solved with one choice of one independent angle, with no direction whose half turns are counted.

    Attributes
    ----------
    form
        Its programs.
    assembly
        The scene.
    """

    form: ClosedForm
    assembly: Assembly

    def states(self, t: FloatArray, y: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return all coordinates and speeds, each of shape (number, samples)."""
        n = len(self.form.loops.independent)
        q, u = self._call(self.form.states, values, t, y[:, :n].T, y[:, n:].T)
        return q, u

    def values(
        self, t: float, q: FloatArray, u: FloatArray, parameters: FloatArray, lengths: FloatArray, time: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return parameters and branches of admissible states, and which of them lead there and meet no dead centre."""
        values, found = self.branches(np.full(len(q), t), q, parameters)
        if not np.any(found):
            return values, found
        free = list(self.form.loops.independent)
        y = np.concatenate([q[:, free], u[:, free]], axis=1)
        equations = self.assembly.reduced
        sizes, moving_sizes = coordinate_scales(equations, lengths), motion_scales(equations, lengths)
        with np.errstate(all="ignore"):
            places, _ = self.states(np.full(len(y), t), y, values)
            found &= np.all(np.abs(places.T - q) / sizes <= AGREES, axis=1)
            found &= self._hold(t, y, values, sizes, moving_sizes, time)
            least, steepest = self.least(t, y, values)
            found &= least > steepest
        return values, found

    def branches(self, t: FloatArray, q: FloatArray, parameters: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return parameters and branches of admissible positions, and to which of these formulas may lead."""
        with np.errstate(all="ignore"):
            branches, conditions = self._call(self.form.branches, parameters, t, q.T)
        values = np.concatenate([parameters, np.reshape(branches, (-1, len(q))).T], axis=1)
        found: NDArray[np.bool_] = np.isfinite(values).all(axis=1) & np.all(
            np.reshape(conditions, (-1, len(q))) > 0.0, axis=0
        )
        return values, found

    def _hold(
        self, t: float, y: FloatArray, values: FloatArray, sizes: FloatArray, moving: FloatArray, time: FloatArray
    ) -> NDArray[np.bool_]:
        """Return where all constraints hold wherever formulas lead to near by."""
        program = self.assembly.balance("reduced")
        holds = np.ones(len(y), dtype=bool)
        known = len(self.assembly.parameters)
        times = np.full(len(y), t)
        for i, k in enumerate(self.form.loops.independent):
            for side in (ASIDE, -ASIDE):
                aside = y.copy()
                aside[:, i] += side * sizes[:, k]
                q, u = self.states(times, aside, values)
                value, entries, explicit = self._call(program.constraints_alone, values[:, :known], times, q, u)
                rows = np.zeros((len(y), program.constraints, program.speeds))
                rows[:, program.jacobian_rows, program.jacobian_columns] = entries.T
                rates = np.einsum("rij,rj->ri", rows, u.T) + explicit.T
                size = np.max(np.abs(rows * moving[:, None, :]), axis=2)
                is_there = np.all(np.isfinite(q), axis=0) & np.all(np.isfinite(u), axis=0)
                good = np.all(np.abs(value.T) <= AGREES * size, axis=1)
                good &= np.all(np.abs(rates) * time[:, None] <= AGREES * size, axis=1)
                holds &= good | ~is_there
        return holds

    def least(self, t: float, y: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what is left of the distance from a dead centre in a whole turn of the only independent coordinate.

        The second is the most by which it changes from one position that was looked at to the next. Both are zero where
        a dead centre is met, a loop does not close, or no angle turns.
        """
        loops, runs = self.form.loops, len(y)
        count, names = len(loops.margins), self.assembly.reduced.names
        if not count or not loops.speeds or len(loops.speeds) > 1 or names[loops.independent[0]].unit != "rad":
            return np.zeros(runs), np.zeros(runs)
        turn = np.linspace(0.0, 2.0 * np.pi, TURN + 1)
        angles = (y[:, :1] + turn[None, :]).ravel()
        own, others = np.repeat(values, len(turn), axis=0), np.repeat(y[:, 1:], len(turn), axis=0).T  # states, speed
        with np.errstate(all="ignore"):
            groups = np.concatenate([angles[None, :], others[:-1]]), others[-1:]
            ahead, _ = self._call(self.form.watched, own, np.full(len(angles), t), *groups)
            margins = ahead[:count].reshape(count, runs, len(turn))
            least = np.min(margins, axis=(0, 2))
            steepest = np.max(np.abs(np.diff(margins, axis=2)), axis=(0, 2))
        is_met = ~(least > CLEAR)  # also where the loop does not close
        return np.where(is_met, 0.0, least), np.where(is_met, 0.0, steepest)

    def _call(self, program: Program, values: FloatArray, t: FloatArray, *groups: FloatArray) -> tuple[FloatArray, ...]:
        kernel = self.assembly.compiled(program, vectorized=True).bind(values.T)
        return tuple(np.asarray(one) for one in kernel(t[None, :], *groups))
