"""Which solver a scene is given to, and why: stiffness, constraints, accuracy.

An explicit method of high order needs a tenth of IDA's steps for the same error wherever nothing dies away quickly:
measured on the library's scenes at tolerances from 1e-3 to 1e-12, its errors are 0.02 to 1 of IDA's (once 3.4, at
1e-4), in 0.05 to 0.5 of the time; where constraints stay, and steps end on them, more is gained.

A scene is stiff where something in it dies away far faster than anything else happens. An explicit method must follow
the fastest decay with its steps although nothing of it is left to be seen; an implicit one steps over it. Fast
vibrations that do not die away are not stiff in this sense: every method that is to give them right must follow them.
Measured on masses with springs and dampers (both methods at the same true error): up to a ratio of about 300 between
the decay and the rest the explicit method of order 8(5,3) costs less than IDA. A mode that decays while it vibrates
fast costs IDA more, since only its order two stays stable beside the imaginary axis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, KernelEvaluationError, UsageError, suggestion
from atwood.expr import Expression, depends_on
from atwood.forms.accelerations import accelerations_of
from atwood.forms.assembly import Assembly, compiled_columns
from atwood.forms.caches import Key
from atwood.integrators.methods import AUTO, EXPLICIT, IDA, METHODS, TAYLOR, Method
from atwood.lazy_dataclasses import dataclass
from atwood.simulation.events.modes import find_event_functions
from atwood.simulation.problem.explicit_scene import first_order_rows, program_on_constraints, values_on_constraints
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.problem.problem import SceneProblem

if TYPE_CHECKING:
    from atwood.simulation.problem.closed_loops import Solved

ASKED = "as asked for"

_MANY = 400
"""With more unknowns it is not seen beforehand whether a scene with constraints is stiff, where something dies away."""

VERY_ACCURATE = 1e-10
"""From this relative tolerance on Taylor series, whose order follows it, cost least, and err a hundredth as much."""


_SAID = 4
"""So many changes of the solver are told one by one."""


@dataclass(frozen=True)
class Choice:
    """What solves a scene from a time on, and why.

    Attributes
    ----------
    time
        From when on, s.
    solver
        A key of `~atwood.integrators.methods.METHODS`.
    reason
        Why, in words.
    keeps_constraints
        Whether an explicit method keeps constraints, also where formulas would solve the loops.
    """

    time: float
    solver: str
    reason: str
    keeps_constraints: bool = False

    @property
    def method(self) -> Method:
        """The method."""
        return METHODS[self.solver]

    @property
    def name(self) -> str:
        """The name of the solver."""
        return self.method.title

    def is_like(self, other: Choice) -> bool:
        """Return whether another choice is of the same solver for the same equations."""
        return (self.solver, self.keeps_constraints) == (other.solver, other.keeps_constraints)


def check_solver(asked: str) -> None:
    """Refuse a solver that there is not, or that cannot be had."""
    if asked not in (AUTO, *METHODS):
        raise UsageError(f"there is no solver {asked!r}", advice=suggestion(asked, (AUTO, *METHODS)))


def check_asked(options: RunOptions) -> None:
    """Refuse what the solver that was asked for cannot do."""
    asked = options.solver
    if options.looks_for_events:
        return
    given = (("accuracy=", options.accuracy is not None), ("conditions to watch", bool(options.conditions)))
    for what, is_given in given:
        if is_given:
            raise UsageError(
                f"{METHODS[asked].title} has steps of one length and looks for no event: it takes no {what}",
                advice=f"Leave it out, or leave solver={asked!r} out.",
            )


def choose(plan: SceneProblem, options: RunOptions, t: float, q: FloatArray, u: FloatArray) -> Choice:
    """Return what solves one mode of a scene, and why."""
    if options.solver != AUTO:
        return Choice(t, options.solver, ASKED)
    assembly = plan.assembly
    if not len(q):
        return Choice(t, IDA.key, "nothing is free to move")
    if assembly.own_equations.contacts:
        return _choose_on_constraints(plan, options, t, q, u, "gaps and slips hold and let go")
    if assembly.form == "dae":
        return _choose_on_constraints(plan, options, t, q, u, "the dae form keeps constraints")
    if plan.balance.constraints:
        return _choose_for_loops(plan, options, t, q, u)
    found = stiffness_of(plan, options, t, q, u)
    if found is not None and found.is_stiff:
        return Choice(t, IDA.key, f"it is stiff: {_in_words(found)}")
    if found is None and options.relative_tolerance <= VERY_ACCURATE and _has_series(assembly):
        reason = f"no constraints are left among its coordinates, nothing dies away, and {VERY_ACCURATE:g} or better"
        return Choice(t, TAYLOR.key, f"{reason} is asked for")
    if found is None and plan.balance.kinematic_map.has_singular_coordinates and _has_series(assembly):
        reason = "its orientations are in three coordinates, which are singular somewhere: series err least near there"
        return Choice(t, TAYLOR.key, reason)
    return Choice(t, EXPLICIT.key, "its coordinates are independent, and the problem is not stiff")


def solved_loops(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> Solved | None:
    """Return closed loops solved by formulas on the branch of a state; None where no formulas do."""
    from atwood.simulation.problem.closed_loops import solve_at  # few scenes have loops

    return solve_at(plan, t, q, u)


def _choose_for_loops(plan: SceneProblem, options: RunOptions, t: float, q: FloatArray, u: FloatArray) -> Choice:
    """Return what solves a mechanism with closed loops: an explicit method where formulas solve these."""
    solved = solved_loops(plan, t, q, u)
    if solved is None:
        return _choose_on_constraints(plan, options, t, q, u, "closed loops leave constraints among the coordinates")
    found = stiffness_of(plan, options, t, q, u)
    if found is not None and found.is_stiff:
        return Choice(t, IDA.key, f"it is stiff: {_in_words(found)}")
    names = plan.assembly.reduced.names
    free = ", ".join(names[i].name for i in solved.independent)
    how = f"formulas solve its closed loops, in terms of {free}"
    # One angle is too few unknowns for error estimates of Runge-Kutta steps: series err a tenth as much, in less time.
    if found is None and _has_closed_series(plan, options, solved):
        return Choice(t, TAYLOR.key, f"{how}, and nothing dies away")
    return Choice(t, EXPLICIT.key, f"{how}, and the problem is not stiff")


def _choose_on_constraints(
    plan: SceneProblem, options: RunOptions, t: float, q: FloatArray, u: FloatArray, reason: str
) -> Choice:
    """Return what solves a scene whose constraints stay: an explicit method with steps on them, unless it is stiff.

    Its errors are a thousandth of IDA's, in a tenth of the time. Where a form at index 1 was asked for, it is what IDA
    makes of it that is to be seen.
    """
    kinematic_map = plan.balance.kinematic_map
    is_for_ida = not plan.assembly.own_equations.contacts and (
        plan.program.level not in ("", "ggl")
        or bool(plan.not_compilable)
        or kinematic_map.has_singular_coordinates
        or (can_be_stiff(plan.assembly) and len(q) + len(u) > _MANY)
    )
    if is_for_ida:
        return Choice(t, IDA.key, reason)
    found = stiffness_of(plan, options, t, q, u)
    if found is not None and found.is_stiff:
        return Choice(t, IDA.key, f"it is stiff: {_in_words(found)}")
    return Choice(t, EXPLICIT.key, f"{reason}, on which steps end, and the problem is not stiff", True)


def _has_closed_series(plan: SceneProblem, options: RunOptions, solved: Solved) -> bool:
    """Return whether accelerations with solved loops have Taylor series that pay: no event keeps them short."""
    watches = solved.form.loops.counted or options.conditions or find_event_functions(plan.assembly)
    if options.relative_tolerance > VERY_ACCURATE and (watches or not solved.is_clear):
        return False
    return _can_be_recurrences(plan.assembly, solved)


def dead_centre(plan: SceneProblem, options: RunOptions, t: float, q: FloatArray, u: FloatArray) -> Choice:
    """Return what goes on with the constraints in the middle of a run, where formulas for loops have no value near by.

    Arguments as of `choose`. It keeps them to the end: mechanisms pass such a place twice in each turn, and steps on
    constraints cost hardly more than formulas whose choice is made anew each time.
    """
    reason = "a dead centre of every choice of independent coordinates is near, and constraints are kept"
    return _choose_on_constraints(plan, options, t, q, u, reason)


_HAS_SERIES: Key[bool] = Key("whether accelerations have Taylor series")


def _has_series(assembly: Assembly) -> bool:
    """Return whether the accelerations of a scene have Taylor series: nothing switches, nothing is called in Python."""
    return assembly.shared.get(_HAS_SERIES, lambda: _can_be_recurrences(assembly, None))


def _can_be_recurrences(assembly: Assembly, solved: Solved | None) -> bool:
    """Return whether accelerations, with loops solved by formulas if there are any, can be written as recurrences."""
    from atwood.simulation.problem.taylor_scene import recurrences, recurrences_of  # many runs need no series

    try:
        recurrences(assembly) if solved is None else recurrences_of(assembly, solved.form.accelerations.program)
    except AtwoodError:
        return False
    return True


def turned_stiff(t: float, found: Stiffness) -> Choice:
    """Return the choice of an implicit method in the middle of a run."""
    return Choice(t, IDA.key, f"it has turned out stiff: {_in_words(found)}")


def _in_words(found: Stiffness) -> str:
    return f"something dies away {found.ratio:.2g} times as fast as anything else happens"


def stiffness_of(
    plan: SceneProblem, options: RunOptions, t: float, q: FloatArray, u: FloatArray, goes_on: bool = False
) -> Stiffness | None:
    """Return how stiff a scene is at a state; None if nothing in it can die away."""
    assembly = plan.assembly
    if not can_be_stiff(assembly):
        return None
    y, count, time, solved = np.concatenate([q, u]), len(q), plan.scales.time, None
    scale = np.concatenate([plan.coordinate_sizes, plan.sizes / plan.scales.time])
    if plan.balance.constraints:
        solved = solved_loops(plan, t, q, u)
        if solved is not None:
            program, values = solved.form.accelerations.program, solved.values
            y, scale, count = solved.reduced(y), solved.reduced(scale), len(solved.independent)
    if solved is None and (plan.balance.constraints or assembly.form == "dae" or assembly.own_equations.contacts):
        program, values = program_on_constraints(plan, t, y).accelerations, values_on_constraints(plan)
    elif solved is None:
        found = accelerations_of(assembly)
        if found is None or not len(q):
            return None
        program, values = found.program, assembly.parameter_values

    @cache
    def many() -> Callable[[FloatArray, FloatArray], FloatArray]:
        is_long = program.size >= _LONG and not plan.not_compilable
        code = compiled_columns(assembly, program) if is_long else assembly.compiled(program, vectorized=True)
        return first_order_rows(code.bind(values), count)

    def rates(states: FloatArray) -> FloatArray:
        return many()(np.full(len(states), t), states)

    span = max(options.t_end - t, 0.0)
    if goes_on:
        time = present_time(rates, y, scale, count, time, span)
    judged = time, span, options.relative_tolerance
    about = program, t, *judged, *(one.tobytes() for one in (values, y, scale))
    return assembly.kept.get(_STIFFNESS, lambda: find_stiffness(rates, y, scale, *judged), *about)


_LONG = 2000
"""Programs of so many nodes are worked out for all states by a tape, and not with NumPy."""

_STIFFNESS: Key[Stiffness] = Key("how stiff a scene is at the state that was last asked about")


def describe_choices(choices: Sequence[Choice]) -> str:
    """Return what solved a run and why, as a sentence."""
    if not choices:
        return "none: the run ended before one was chosen"
    said = [f"{choices[0].name}: {choices[0].reason}"]
    said += [f"from t = {one.time:.6g} s {one.name}: {one.reason}" for one in choices[1:_SAID]]
    if len(choices) > _SAID:
        said.append(f"and so on, {len(choices) - 1} times in all until t = {choices[-1].time:.6g} s")
    return "; ".join(said)


RATIO = 300.0
"""A decay that is so many times as fast as anything else is left to an implicit method."""

_GONE = 20.0
"""What decays so many times by e within the run is gone for most of it."""


@dataclass(frozen=True)
class Stiffness:
    """How stiff a scene is at a state.

    Attributes
    ----------
    decay
        Size of the eigenvalue of what dies away fastest, 1/s; zero if nothing does.
    ratio
        How many times as fast that is as anything else.
    limit
        The ratio from which on an implicit method costs less.
    """

    decay: float
    ratio: float
    limit: float

    @property
    def is_stiff(self) -> bool:
        """Whether an implicit method costs less."""
        return self.ratio > self.limit


_CAN_BE_STIFF: Key[bool] = Key("whether anything can be stiff")


def can_be_stiff(assembly: Assembly) -> bool:
    """Return whether anything can make motions die away: a Rayleigh function, or a load that reads velocities.

    Dry friction does so only where its limit reads velocities.
    """

    def find() -> bool:
        for local in assembly.mechanism.locals_.values():
            if len(local.dissipations) > len(local.contacts):  # each gap and slip has one
                return True
            speeds: list[Expression] = []
            for one in local.connectors.values():
                speeds += [*one.velocity, *one.spin]
            speeds += local.signal_symbols.values()  # what it is linked to may be a velocity
            if depends_on([one.limit for one in local.contacts if one.limit is not None], speeds):
                return True
            speeds += local.reads  # a reaction depends on velocities
            for load in local.loads:
                read = [*assembly.mechanism.space.components(load.force), *load.torque]
                if any(isinstance(one, Expression) and depends_on(one, speeds) for one in read):
                    return True
        return False

    return assembly.shared.get(_CAN_BE_STIFF, find)


def find_stiffness(
    rates: Callable[[FloatArray], FloatArray],
    y: FloatArray,
    scale: FloatArray,
    time: float,
    span: float,
    relative_tolerance: float,
) -> Stiffness:
    """Return how stiff ``y' = f(y)``, ``y = (q, u)``, is at a state, from the eigenvalues of its Jacobian.

    The rates are those of many states, one row each.
    """
    try:
        matrix = _jacobians(lambda moved: rates(moved[:, 0])[:, None], y[None], scale[None])[0]
    except (KernelEvaluationError, ArithmeticError):
        return Stiffness(0.0, 0.0, RATIO)
    return _judged(matrix, time, span, relative_tolerance)


def present_time(
    rates: Callable[[FloatArray], FloatArray],
    y: FloatArray,
    scale: FloatArray,
    coordinates: int,
    time: float,
    span: float,
) -> float:
    """Return the time in which something happens at a state, s, by how fast it changes."""
    try:
        changes = np.abs(rates(y[None])[0]) / scale
    except (KernelEvaluationError, ArithmeticError):
        return time
    fastest = max(np.max(changes[:coordinates]), np.sqrt(np.max(changes[coordinates:], initial=0.0) / time))
    return min(span, 1.0 / float(fastest)) if fastest > 0.0 else span


def find_stiff_rows(
    rates: Callable[[FloatArray], FloatArray],
    y: FloatArray,
    scale: FloatArray,
    time: FloatArray,
    span: FloatArray,
    relative_tolerance: float,
) -> NDArray[np.bool_]:
    """Return which of many runs are stiff, as `find_stiffness` has it of one."""
    matrices = _jacobians(rates, y, scale)
    each = zip(matrices, time.tolist(), span.tolist(), strict=True)
    return np.array([_judged(*one, relative_tolerance).is_stiff for one in each], dtype=np.bool_)


def _judged(matrix: FloatArray, time: float, span: float, relative_tolerance: float) -> Stiffness:
    """Return how stiff a problem is by its Jacobian in units of its sizes."""
    if not np.isfinite(matrix).all():
        return Stiffness(0.0, 0.0, RATIO)
    try:
        values = np.linalg.eigvals(matrix)
    except np.linalg.LinAlgError:  # nothing is known of it; the explicit method tells by its steps where it is stiff
        return Stiffness(0.0, 0.0, RATIO)
    decays = (values.real < 0.0) & (np.abs(values.real) * span > _GONE)
    slow = max(1.0 / time, float(np.max(np.abs(values[~decays]), initial=0.0)))
    plain = decays & (np.abs(values.real) >= np.abs(values.imag))
    found = []
    # Beside the imaginary axis steps of order two remain, against those of order five.
    for chosen, limit in ((plain, RATIO), (decays, RATIO * relative_tolerance ** (-2.0 / 15.0))):
        fastest = float(np.max(np.abs(values[chosen]), initial=0.0))
        found.append(Stiffness(fastest, fastest / slow, limit))
    return next((one for one in found if one.is_stiff), found[0])


def _jacobians(rates: Callable[[FloatArray], FloatArray], y: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the Jacobians of runs in units of their sizes, by differences; not finite where they have no value.

    The rates are given states of shape (places, runs, unknowns): the runs, and these with one unknown moved each.
    """
    count = y.shape[1]
    with np.errstate(all="ignore"):
        moved = y + np.concatenate([np.zeros((1, count)), 1e-7 * np.eye(count)])[:, None, :] * scale
        steps = np.diagonal(moved[1:] - y, axis1=0, axis2=2).T
        found = rates(moved)
        slopes = (found[1:] - found[0]) * (scale.T / steps)[:, :, None] / scale
        return np.moveaxis(slopes, 0, 2)
