"""What the runs of a sweep integrate: all coordinates and speeds, or the independent ones of closed loops; their sizes.

Everything here is worked out for many runs at once, one row each. What a run by itself does is in
`atwood.simulation.problem.preparation` and `atwood.simulation.problem.closed_loops`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.llvm.engine import lane_count
from atwood.codegen.sundials.events import EventData
from atwood.errors import AtwoodError, UnsupportedError
from atwood.expr import Program
from atwood.forms.accelerations import AccelerationProgram, accelerations_of
from atwood.forms.assembly import Assembly
from atwood.integrators.batch import BatchPlaces
from atwood.integrators.embedded.looks import events_of_many
from atwood.integrators.embedded.rates import OwnRates
from atwood.integrators.lanes import LanePlaces
from atwood.integrators.methods import AUTO, Method, Task
from atwood.integrators.protocol import LOOSEST, SolverOptions
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.outputs.event_functions import EventFunction
from atwood.simulation.dynamics.balance import masses_at
from atwood.simulation.dynamics.reactions import accelerations_at
from atwood.simulation.dynamics.scales import coordinate_scales, find_times, motion_scales
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.closed_loops import ManyBranches, Solved, solve_at
from atwood.simulation.problem.explicit_scene import (
    compiled_rates,
    compiled_rates_of_many,
    explicit_problem,
    explicit_problem_of,
    first_order_rows,
)
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.problem.preparation import make_problem
from atwood.simulation.problem.step_guard import step_guard
from atwood.simulation.problem.taylor_scene import taylor_problem
from atwood.simulation.run.choice import can_be_stiff, choose, find_stiff_rows
from atwood.study.sweeps.runs import SweepRequest


@dataclass(frozen=True, eq=False)
class Motion:
    """How states of a scene become those of a method, and back: all coordinates and speeds are integrated.

    Parameters are values by run or sample, one row each, or None where all have those of the scene.
    """

    assembly: Assembly

    @property
    def program(self) -> AccelerationProgram:
        """What is integrated."""
        found = accelerations_of(self.assembly)
        assert found is not None
        return found

    def begin(
        self, q: FloatArray, u: FloatArray, values: FloatArray | None, lengths: FloatArray, time: FloatArray
    ) -> tuple[FloatArray, FloatArray | None, NDArray[np.bool_]]:
        """Return what is integrated, the values of its parameters, and which runs can be made so."""
        return np.concatenate([q, u], axis=1), values, np.ones(len(q), dtype=bool)

    def columns(self) -> list[int]:
        """Return which coordinates and speeds are integrated, by their places in (q, u)."""
        equations = self.assembly.reduced
        return list(range(len(equations.coordinates) + len(equations.speeds)))

    def states(self, t: FloatArray, y: FloatArray, values: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        """Return coordinates and speeds, of shape (number, samples), from what was integrated, one row each."""
        n = len(self.assembly.reduced.coordinates)
        return y[:, :n].T, y[:, n:].T

    def accelerations(self, t: FloatArray, q: FloatArray, u: FloatArray, values: FloatArray | None) -> FloatArray:
        """Return the accelerations of all speeds, shape (number, samples), at states of the same shape."""
        kernel = with_rows(self.assembly, values).kernel(self.program.program, vectorized=True)
        return np.asarray(kernel(t[None, :], q, u)[-1])

    def open_directions(
        self, t: FloatArray, q: FloatArray, u: FloatArray, values: FloatArray | None
    ) -> FloatArray | None:
        """Return how all speeds move with integrated ones, shape (runs, number, few); None if they are all."""
        return None


@dataclass(frozen=True, eq=False)
class ClosedLoops(Motion):
    """The independent coordinates of loops that formulas solve are integrated; branches are further parameters.

    Attributes
    ----------
    assembly
        The scene.
    solved
        The loops of the first run.
    kept
        Numbers of the constraints, which are all independent.
    """

    solved: Solved
    kept: NDArray[np.intp]

    @property
    def program(self) -> AccelerationProgram:
        """What is integrated."""
        return self.solved.form.accelerations

    @property
    def _branches(self) -> ManyBranches:
        return ManyBranches(self.solved.form, self.assembly)

    def begin(
        self, q: FloatArray, u: FloatArray, values: FloatArray | None, lengths: FloatArray, time: FloatArray
    ) -> tuple[FloatArray, FloatArray | None, NDArray[np.bool_]]:
        """Return independent coordinates and speeds, and the branches of each run."""
        parameters = np.tile(self.assembly.parameter_values, (len(q), 1)) if values is None else values
        found, usable = self._branches.values(self.assembly.flat.t_start, q, u, parameters, lengths, time)
        return np.concatenate([q, u], axis=1)[:, self.columns()], found, usable

    def columns(self) -> list[int]:
        """Return the places of independent coordinates and their speeds in (q, u)."""
        free, n = self.solved.independent, len(self.assembly.reduced.coordinates)
        return [*free, *(n + i for i in free)]

    def states(self, t: FloatArray, y: FloatArray, values: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        """Return all coordinates and speeds."""
        assert values is not None
        return self._branches.states(t, y, values)

    def accelerations(self, t: FloatArray, q: FloatArray, u: FloatArray, values: FloatArray | None) -> FloatArray:
        """Return the accelerations of all speeds, from the balance of forces with the constraints."""
        return accelerations_at(with_rows(self.assembly, values), "reduced", t, q, u, self.kept)

    def open_directions(self, t: FloatArray, q: FloatArray, u: FloatArray, values: FloatArray | None) -> FloatArray:
        """Return how all speeds move with the independent ones."""
        assert values is not None
        free = self.solved.independent
        y, few = np.concatenate([q[free], np.zeros((len(free), q.shape[1]))]).T, len(free)
        at_rest = self._branches.states(t, y, values)[1]
        found = np.empty((q.shape[1], len(u), few))
        for k in range(few):
            y[:, few:] = np.eye(few)[k]
            found[:, :, k] = (self._branches.states(t, y, values)[1] - at_rest).T
        return found


@dataclass(frozen=True, eq=False)
class Way:
    """How the runs of a sweep are made in machine code.

    Attributes
    ----------
    motion
        What is integrated.
    method
        A method with which many runs can be made in one call.
    values
        Parameters of the first run.
    """

    motion: Motion
    method: Method
    values: FloatArray


def find_way(request: SweepRequest) -> tuple[Way | None, str]:
    """Return how runs are made in machine code, by what the first of them is; None, and why not, where none is."""
    assembly, options = request.assembly, request.options
    try:
        start = find_start(assembly)
        q, u = start.coordinates, start.speeds
        plan = make_problem(assembly, start.time, q, u, start.length, options.t_end - start.time)
        chosen = choose(plan, options, start.time, q, u).method
    except AtwoodError:
        return None, "the first run cannot start"
    if plan.relative_share < 1.0:
        return None, "bodies float far from the origin"
    if chosen.batch is None:
        is_closed = bool(plan.balance.constraints)
        return None, "no formulas solve its closed loops" if is_closed else f"the solver is {chosen.key!r}"
    motion = Motion(assembly)
    if plan.balance.constraints:
        solved = solve_at(plan, start.time, q, u)
        if solved is None:
            return None, "no formulas solve its closed loops"
        if not solved.is_clear or solved.form.loops.counted or plan.finding.redundant:
            return None, "formulas for its closed loops have dead centres on the way"
        motion = ClosedLoops(assembly, solved, np.asarray(plan.finding.kept, dtype=np.intp))
        values = solved.values
    else:
        problem, values = explicit_problem(assembly), assembly.parameter_values
        if problem is None or problem.compiled is None:
            return None, "it calls functions in Python"
    return Way(motion, chosen, values), ""


def open_places(motion: Motion, method: Method, options: RunOptions, values: FloatArray) -> BatchPlaces:
    """Open a session of a method, for one thread, and return where a batch finds what it needs of it."""
    own = compiled_rates(motion.assembly, motion.program).at_its_best().open()
    task = task_of(motion, method, options, values, own)
    assert method.batch is not None
    places = method.batch(task)
    return replace(places, parameters=(own.prologues[0], own.derived, own.scratch)) if method.tableau else places


def open_lanes(
    motion: Motion, method: Method, options: RunOptions, values: FloatArray, count: int
) -> LanePlaces | None:
    """Open a session that takes runs side by side; None where so many are made one after another.

    That is where a method or an operation of the scene has no code in lanes, and where something judges each step.
    """
    if method.lanes is None or count < lane_count():
        return None
    own = compiled_rates(motion.assembly, motion.program).open()
    return lanes_for(method, task_of(motion, method, options, values, own))


def lanes_for(method: Method, task: Task) -> LanePlaces | None:
    """Open a session for a task that takes runs side by side; None where there is none for it."""
    assert method.lanes is not None
    try:
        return None if task.problem.guard is not None else method.lanes(task, lane_count())
    except UnsupportedError:
        return None


def task_of(
    motion: Motion,
    method: Method,
    options: RunOptions,
    values: FloatArray,
    own: OwnRates,
    functions: Sequence[EventFunction] = (),
    data: EventData | None = None,
    watched: Program | None = None,
) -> Task:
    """Return what a session is opened for that makes one run of a sweep after another."""
    assembly, begin = motion.assembly, motion.assembly.flat.t_start
    relative = min(options.relative_tolerance, method.loosest_tolerance)
    settings = SolverOptions(relative, 1.0, max_step=options.max_step, horizon=options.t_end - begin)
    form = (motion.solved.form, values) if isinstance(motion, ClosedLoops) else None
    guard = step_guard(assembly, (begin, options.t_end), method.reach, form)
    compiled_rates(assembly, motion.program).fill(own, values)
    directions = tuple(one.direction for one in functions)
    events = None if data is None else data.function()
    problem = explicit_problem_of(assembly, motion.program, values, events, directions)
    problem = replace(problem, compiled=lambda: own.rates, guard=guard, compiled_events=data)
    series = partial(taylor_problem, assembly, options.t_end, False, motion.program.program, values)
    start = np.zeros(problem.size)
    return Task(
        settings,
        begin,
        start,
        end=options.t_end,
        explicit=problem,
        many=lambda runs: (
            compiled_rates_of_many(assembly, motion.program, runs),
            values,
            None if watched is None else events_of_many(watched, runs),
        ),
        series=series,
    )


def with_rows(assembly: Assembly, values: FloatArray | None) -> Assembly:
    """Return a scene for kernels at many states, each with its own parameters where they differ."""
    return assembly if values is None else assembly.with_rows(values[:, : len(assembly.parameters)].T)


def _masses(assembly: Assembly, t: FloatArray, q: FloatArray, u: FloatArray) -> FloatArray:
    """Return the mass matrices of all speeds, shape (runs, number, number), at states of shape (number, runs)."""
    program = assembly.balance("reduced")
    if program.mass_product is not None:
        return masses_at(assembly, t, q.T, u.T, assembly.parameter_values)
    entries = assembly.kernel(program.program, vectorized=True)(t[None, :], q, u)[0]
    found = np.zeros((len(t), program.speeds, program.speeds))
    found[:, program.mass_rows, program.mass_columns] = np.broadcast_to(entries.T, (len(t), entries.shape[0]))
    return found


def make_ready(
    motion: Motion,
    t: FloatArray,
    q: FloatArray,
    u: FloatArray,
    values: FloatArray | None,
    lengths: FloatArray,
    options: RunOptions,
) -> tuple[FloatArray, FloatArray | None, FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return what `make_problem` and `choose` find out about one run before its first step, for many.

    That is what is integrated, the values of its parameters, in what time something happens, absolute tolerances, and
    which of the runs can be made many at a time.
    """
    span = options.t_end - motion.assembly.flat.t_start
    with np.errstate(all="ignore"):
        time = time_scales(motion, t, q, u, lengths, values, span)
        state, values, usable = motion.begin(q, u, values, lengths, time)
        usable &= np.isfinite(time) & have_inertia(motion, t, q, u, values, lengths)
        every = absolute_tolerances(motion.assembly, lengths, time, options.relative_tolerance)
        tolerances = every[:, motion.columns()]
        usable &= np.all(np.isfinite(tolerances), axis=1) & np.all(np.isfinite(state), axis=1)
        own = None if values is None else values[usable]
        some = t[usable], state[usable], own, tolerances[usable], time[usable]
        usable[usable] &= ~are_stiff(motion, *some, options)
    return state, values, time, tolerances, usable


def time_scales(
    motion: Motion,
    t: FloatArray,
    q: FloatArray,
    u: FloatArray,
    lengths: FloatArray,
    values: FloatArray | None,
    span: float,
) -> FloatArray:
    """Return in what time something happens in each run, as `find_scales` has it; nan where that has no value."""
    assembly = motion.assembly
    if not len(t):
        return np.zeros(0)
    a = motion.accelerations(t, q.T, u.T, values).T
    sizes = motion_scales(assembly.reduced, lengths)
    symbols = [one.name for one in assembly.parameters]
    given = assembly.parameter_values if values is None else values.T
    gravity = given[symbols.index("gravity")] if "gravity" in symbols else 0.0
    time = find_times(lengths, u, a, sizes, gravity, span)
    return np.where(np.all(np.isfinite(a), axis=1), time, np.nan)


def absolute_tolerances(assembly: Assembly, lengths: FloatArray, time: FloatArray, relative: float) -> FloatArray:
    """Return the absolute tolerances of coordinates and speeds of each run, as `SceneProblem.tolerances` has them."""
    share, equations = min(relative, LOOSEST), assembly.reduced
    sizes = coordinate_scales(equations, lengths), motion_scales(equations, lengths) / time[:, None]
    return np.concatenate([share * one for one in sizes], axis=1)


def have_inertia(
    motion: Motion, t: FloatArray, q: FloatArray, u: FloatArray, values: FloatArray | None, lengths: FloatArray
) -> NDArray[np.bool_]:
    """Return where nothing can move without inertia, by the measure of `make_problem`; see `time_scales`."""
    mass = _masses(with_rows(motion.assembly, values), t, q.T, u.T)
    directions = motion.open_directions(t, q.T, u.T, values)
    if directions is None:
        sizes = motion_scales(motion.assembly.reduced, lengths)
    else:
        mass = np.swapaxes(directions, 1, 2) @ mass @ directions
        sizes = 1.0 / np.sqrt(np.abs(np.diagonal(mass, axis1=1, axis2=2)))
    mass = mass * sizes[:, :, None] * sizes[:, None, :]
    usable = np.all(np.isfinite(mass), axis=(1, 2))
    mass[~usable] = np.eye(mass.shape[1])
    found = np.linalg.eigvalsh(mass)
    good: NDArray[np.bool_] = usable & (found[:, 0] > 1e-14 * np.maximum(found[:, -1], 1e-300))
    return good


def are_stiff(
    motion: Motion,
    t: FloatArray,
    y: FloatArray,
    values: FloatArray | None,
    tolerances: FloatArray,
    time: FloatArray,
    options: RunOptions,
) -> NDArray[np.bool_]:
    """Return which runs `choose` would give to an implicit method; none where a method was asked for."""
    assembly = motion.assembly
    if not len(t) or options.solver != AUTO or not can_be_stiff(assembly):
        return np.zeros(len(t), dtype=np.bool_)
    program = motion.program.program
    kernel = assembly.compiled(program, vectorized=True).bind(assembly.parameter_values if values is None else values.T)
    rates = first_order_rows(kernel, len(program.inputs[1].symbols))

    def each(moved: FloatArray) -> FloatArray:
        return np.array([rates(t, one) for one in moved])

    relative = options.relative_tolerance
    return find_stiff_rows(each, y, tolerances / min(relative, LOOSEST), time, options.t_end - t, relative)
