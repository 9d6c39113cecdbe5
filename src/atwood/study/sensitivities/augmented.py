"""A motion together with its derivatives, as one problem for explicit methods.

With ``y' = f(t, y, p)`` the derivatives ``s = dy/dp`` obey the variational equations ``s' = f_y s + f_p`` (Hairer,
Norsett and Wanner, Solving ODEs I, 2nd edition, section I.14). They are written into the graph by forward derivatives
of the right-hand side, so that all columns share what they have in common with it, and the error of every column is
controlled. Where constraints stay, the projection onto them is differentiated too: columns are tangent to the
constraints, and what these say of the parameters is met.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, SolveError, UnsupportedError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, jvp
from atwood.forms.accelerations import accelerations_of
from atwood.forms.caches import Key
from atwood.integrators.methods import EXPLICIT, LEAST, Task
from atwood.integrators.protocol import Budget, ExplicitProblem, SolverOptions, Status, StepGuard
from atwood.lazy_dataclasses import dataclass
from atwood.simulation.dynamics.orientation_coordinates import longest_step
from atwood.simulation.problem.explicit_scene import program_on_constraints
from atwood.simulation.problem.problem import SceneProblem

if TYPE_CHECKING:
    from atwood.integrators.embedded.rates import CompiledAccelerations

Pattern = tuple[tuple[int, ...], ...]
"""For each column the numbers of the parameters that change with it."""

_CODE: Key[CompiledAccelerations] = Key("machine code of a motion with its derivatives")
_MOTION: Key[Programs] = Key("a motion with its derivatives")

_LONGEST = 60_000
"""So many nodes of all columns together are written out; more columns are done in several runs."""

_CLOSER = 0.5
"""Tolerance of a motion with its derivatives, in that which was asked for."""


@dataclass(frozen=True, eq=False)
class Programs:
    """A motion with its derivatives: rates and accelerations, and where constraints stay a step towards these."""

    accelerations: Program
    projection: Program | None


def keeps_constraints(plan: SceneProblem) -> bool:
    """Return whether a motion is integrated in coordinates that its constraints bind."""
    assembly = plan.assembly
    return bool(plan.balance.constraints or assembly.form == "dae" or assembly.own_equations.contacts)


def _plain(plan: SceneProblem, t: float, y: FloatArray) -> Programs:
    if keeps_constraints(plan):
        found = program_on_constraints(plan, t, y)
        return Programs(found.accelerations, found.projection if plan.holds else None)
    program = accelerations_of(plan.assembly)
    assert program is not None
    return Programs(program.program, None)


def _augmented(plain: Programs, pattern: Pattern) -> Programs:
    """Return programs of coordinates and speeds followed by their derivatives, one column after the other."""
    program = plain.accelerations
    graph, (time, q, u) = program.graph, program.inputs
    state = (*q.symbols, *u.symbols)
    columns = [tuple(graph.symbol(f"column {j} of {s.name}") for s in state) for j in range(len(pattern))]
    names = [one.name for one in program.parameters]
    seeds = [[graph.parameter(f"seed {j} of {names[k]}") for k in own] for j, own in enumerate(pattern)]
    tangents: list[dict[Expression, Expression | float]] = [
        {
            **dict(zip(state, column, strict=True)),
            **{program.parameters[k]: seed for k, seed in zip(own, some, strict=True)},
        }
        for column, some, own in zip(columns, seeds, pattern, strict=True)
    ]
    n = len(q.symbols)
    groups = (
        time,
        InputGroup("q", (*q.symbols, *(s for one in columns for s in one[:n]))),
        InputGroup("u", (*u.symbols, *(s for one in columns for s in one[n:]))),
    )
    parameters = (*program.parameters, *(seed for some in seeds for seed in some))

    def with_derivatives(one: Program, still: str = "") -> Program:
        outputs = []
        for group in one.outputs:
            own = list(group.expressions)
            more = [[graph.zero] * len(own) if group.name == still else jvp(own, tangent) for tangent in tangents]
            outputs.append(OutputGroup(group.name, (*own, *(e for some in more for e in some))))
        return Program(f"{one.name} with {len(pattern)} derivatives", groups, parameters, tuple(outputs))

    nearer = None if plain.projection is None else with_derivatives(plain.projection, "moved")
    return Programs(with_derivatives(program), nearer)


@dataclass(frozen=True, eq=False)
class Stretch:
    """A motion with its derivatives at output times, and at its end.

    Attributes
    ----------
    states
        Coordinates and speeds, shape (times, n).
    columns
        Their derivatives, times the scales of the columns, shape (times, columns, n).
    steps
        How many were taken.
    """

    states: FloatArray
    columns: FloatArray
    steps: int


class Augmented:
    """What integrates a scene in one mode with derivatives.

    Parameters
    ----------
    plan
        The scene in its mode.
    t, y
        Where it begins: coordinates and speeds.
    seeds
        The change of each parameter by each column, shape (columns, parameters).
    pattern
        The parameters that change with each column, or do in another stretch of the run.
    """

    def __init__(
        self, plan: SceneProblem, t: float, y: FloatArray, seeds: FloatArray, pattern: Pattern | None = None
    ) -> None:
        assembly = plan.assembly
        if plan.not_compilable:
            raise UnsupportedError(
                f"its derivatives are machine code, and {plan.not_compilable}", where=assembly.flat.name
            )
        self.plan, self.split, self.seeds = plan, (plan.program.coordinates, plan.program.speeds), seeds
        plain = _plain(plan, t, y)
        sizes = plan.sizes if keeps_constraints(plan) else np.zeros(0)
        self.values = np.concatenate([assembly.parameter_values, sizes])
        count = len(plain.accelerations.nodes)
        self.block = max(1, _LONGEST // max(1, 4 * count))
        self.plain = plain
        self.pattern = tuple(tuple(np.flatnonzero(row).tolist()) for row in seeds) if pattern is None else pattern

    def _programs(self, pattern: Pattern) -> tuple[Programs, CompiledAccelerations]:
        from atwood.integrators.embedded.rates import CompiledAccelerations

        shared, plain = self.plan.assembly.shared, self.plain
        about = plain.accelerations, plain.projection, pattern
        made = shared.get(_MOTION, lambda: _augmented(plain, pattern), *about)
        code = shared.get(_CODE, lambda: CompiledAccelerations(made.accelerations, made.projection), *about)
        return made, code

    def run(
        self, t: float, y: FloatArray, columns: FloatArray, times: FloatArray, rtol: float, max_steps: int | None
    ) -> Stretch:
        """Integrate over some times, of which the last is the end, from a state and its derivatives (columns, n)."""
        parts = [slice(k, k + self.block) for k in range(0, len(columns), self.block)]
        found = [self._run(t, y, columns[part], part, times, rtol, max_steps) for part in parts]
        return Stretch(
            found[0].states, np.concatenate([one.columns for one in found], axis=1), sum(one.steps for one in found)
        )

    def _run(
        self,
        t: float,
        y: FloatArray,
        columns: FloatArray,
        part: slice,
        times: FloatArray,
        rtol: float,
        max_steps: int | None,
    ) -> Stretch:
        count = len(columns)
        programs, code = self._programs(self.pattern[part])
        values, absolute = self._values(part), self._absolute(rtol)
        z, packed = self._packed(y, columns), self._packed(absolute, np.tile(absolute, (count, 1)))
        problem = ExplicitProblem(size=len(z), rates=_no_rates, compiled=code.bind(values))
        found, steps = self._sampled(problem, t, z, y, packed, times, rtol, max_steps)
        if programs.projection is not None:
            found = self._projected(programs.projection, values, times, found)
        rows = self._unpacked(found, count)
        return Stretch(rows[:, 0], rows[:, 1:], steps)

    def steps_of(
        self, t: float, y: FloatArray, times: FloatArray, rtol: float, max_steps: int | None, guard: StepGuard
    ) -> None:
        """Integrate the motion alone, and show each step to a guard."""
        from atwood.integrators.embedded.rates import CompiledAccelerations

        about = self.plain.accelerations, self.plain.projection
        code = self.plan.assembly.shared.get(_CODE, lambda: CompiledAccelerations(*about), *about)
        problem = ExplicitProblem(size=len(y), rates=_no_rates, compiled=code.bind(self.values), guard=guard)
        self._sampled(problem, t, y, y, self._absolute(rtol), times, rtol, max_steps)

    def _absolute(self, rtol: float) -> FloatArray:
        found: FloatArray = _CLOSER * self.plan.tolerances(rtol, {})[: sum(self.split)]
        return found

    def _sampled(
        self,
        problem: ExplicitProblem,
        t: float,
        z: FloatArray,
        y: FloatArray,
        absolute: FloatArray,
        times: FloatArray,
        rtol: float,
        max_steps: int | None,
    ) -> tuple[FloatArray, int]:
        """Integrate a problem; return it at some times, and the number of steps."""
        plan = self.plan
        settings = SolverOptions(
            relative_tolerance=max(_CLOSER * rtol * plan.relative_share, LEAST),
            absolute_tolerances=absolute,
            horizon=max(float(times[-1]) - t, 1e-300),
        )
        task = Task(settings, t, z, budget=Budget(max_steps=max_steps), end=float(times[-1]), explicit=problem)
        try:
            session = EXPLICIT.open(task)
        except AtwoodError as error:
            raise UnsupportedError(
                f"at t = {t:.9g} s a derivative has no finite value, as that of the size of a slip that is zero",
                where=plan.assembly.flat.name,
                advice="Start a little beside that state, or let the run end before.",
            ) from error
        session.limit_steps(longest_step(plan.assembly.own_equations, y[self.split[0] :]))
        found, _, ended = session.sample(times)
        if ended.status is not Status.REACHED:
            raise SolveError(
                f"the motion with its derivatives does not go on: {ended.message}",
                where=plan.assembly.flat.name,
                advice="Its steps are explicit, and many where it is stiff: ask for a larger rtol or max_steps.",
            )
        return found, session.statistics.steps

    def _values(self, part: slice) -> FloatArray:
        """Return the values of parameters and seeds of some columns."""
        pairs = zip(self.seeds[part], self.pattern[part], strict=True)
        return np.concatenate([self.values, *(seeds[list(own)] for seeds, own in pairs)])

    def _packed(self, y: FloatArray, columns: FloatArray) -> FloatArray:
        n, _ = self.split
        every = np.concatenate([y[None, :], columns])
        return np.concatenate([every[:, :n].ravel(), every[:, n:].ravel()])

    def _unpacked(self, z: FloatArray, count: int) -> FloatArray:
        """Return states and columns, shape (times, 1 + columns, n)."""
        n, m = self.split
        cut = n * (1 + count)
        parts = z[:, :cut].reshape(len(z), 1 + count, n), z[:, cut:].reshape(len(z), 1 + count, m)
        return np.concatenate(parts, axis=2)

    def _projected(self, program: Program, values: FloatArray, times: FloatArray, z: FloatArray) -> FloatArray:
        """Return states and columns on the constraints: between steps they are only as near as the interpolation."""
        kernel = self.plan.assembly.compiled(program, vectorized=True).bind(values)
        cut = len(program.inputs[1].symbols)
        for _ in range(2):
            made = kernel(times[None, :], z[:, :cut].T, z[:, cut:].T)
            q, u, _ = (np.broadcast_to(one, (len(one), len(times))) for one in made)
            z = np.concatenate([q, u]).T
        return z

    def tangent(self, t: float, y: FloatArray, columns: FloatArray) -> FloatArray:
        """Return columns taken onto the constraints, to which the state belongs."""
        if self.plain.projection is None:
            return columns
        programs, _ = self._programs(self.pattern)
        assert programs.projection is not None
        values = self._values(slice(None))
        z = self._projected(programs.projection, values, np.array([t]), self._packed(y, columns)[None, :])
        return self._unpacked(z, len(columns))[0, 1:]


def _no_rates(t: float, y: FloatArray) -> FloatArray:
    raise NotImplementedError  # steps call machine code alone
