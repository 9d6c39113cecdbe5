"""What a solver driver is given, and what it gives back.

A driver integrates ``F(t, y, y') = 0`` from consistent start values.  This module holds only the words that all
drivers share: the problem, the options, the limits, and the answer of one advance; a run in progress is a
`~atwood.integrators.session.Session`.

What a problem brings as compiled functions, and what looks at its motion.

What an explicit method is given, and what takes its steps.

An explicit method integrates ``y' = f(t, y)``.  A *stepper* holds the state and takes steps; everything else, such as
output times, events and limits, is the session's, which is the same for all steppers.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from enum import Enum
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from atwood.arrays import BoolArray, FloatArray, IndexArray
from atwood.errors import UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventData
    from atwood.integrators.jumps import Jumps
    from atwood.numerics.fixed_pivots import FixedPivots

State: TypeAlias = tuple[float, FloatArray, FloatArray]
Values: TypeAlias = Sequence[float] | FloatArray
ChoosePivots: TypeAlias = "Callable[[Sequence[FloatArray]], FixedPivots | None]"
LinearSolver: TypeAlias = Literal["dense", "sparse", "fixed"]

FIXED_SIZE = 20
"""From so many unknowns on elimination with fixed pivots pays."""

FIXED_SHARE = 0.3
"""The largest share of the operations of a dense factorisation for which it pays: each takes longer."""

SPARSE_SIZE = 90
"""From so many unknowns on a sparse matrix pays: chains take 0.8 of the time without it at 60, and 1.6 at 120."""

SPARSE_DENSITY = 0.15
"""The largest share of entries that are not zero for which it pays."""


JUST_HAPPENED = 2
"""What is given in place of the sign of an event that a run starts after."""


@dataclass(frozen=True, eq=False)
class ImplicitProblem:
    """The equations ``F(t, y, y') = 0`` of one mode.

    The functions get arrays that are only valid during the call and must not be written to.  A function that has
    no value at a state raises `~atwood.errors.KernelEvaluationError` (or an arithmetic error), or returns values
    that are not finite: the solver then tries a smaller step.

    Parameters
    ----------
    size
        The number of unknowns and of equations.
    residual
        ``residual(t, y, yp)``: the values of F.
    jacobian
        ``jacobian(t, y, yp, cj)``: the entries of ``dF/dy + cj dF/dy'`` in the order of `pattern`.
    pattern
        Row and column of each entry, by column and then by row, each place once.
    algebraic
        The unknowns whose derivative does not appear.
    events
        ``events(t, y, yp)``: one value per event, which happens where its value passes through zero.
    event_count
        The number of events.
    event_directions
        For each event +1 (rising values only), -1 (falling values only) or 0 (both).  Empty: all 0.
    event_rough
        Numbers of the events whose exact time does not matter: they happen at the end of a step.
    event_signs
        The sign that each event had before the start, 0 where it is not known, or `JUST_HAPPENED`.  Empty: all 0.
    native
        ``native(linear_solver)``: compiled forms of the residual and the Jacobian for a matrix that is dense, sparse,
        or one column with all entries.  Each session asks once, and must not share its answer with
        another one.  Drivers that cannot use them ignore them.
    pivots
        ``pivots(samples)``: an elimination of the matrix with fixed pivots, which are good for matrices given by
        their entries in the order of `pattern`; None if there is none.  It answers alike whenever it is asked.
    begin
        ``begin(t, y, yp)``, called at every start of a session: residuals that judge steps hear of it so.
    """

    size: int
    residual: Callable[[float, FloatArray, FloatArray], Values]
    jacobian: Callable[[float, FloatArray, FloatArray, float], Values]
    pattern: tuple[IndexArray, IndexArray]
    algebraic: tuple[int, ...] = ()
    events: Callable[[float, FloatArray, FloatArray], Values] | None = None
    event_count: int = 0
    event_directions: tuple[int, ...] = ()
    event_rough: tuple[int, ...] = ()
    event_signs: tuple[int, ...] = ()
    native: Callable[[LinearSolver], NativeCallbacks] | None = None
    pivots: ChoosePivots | None = None
    begin: Callable[[float, FloatArray, FloatArray], None] | None = None

    def __post_init__(self) -> None:
        _check_watch(self)
        rows, columns = (np.asarray(part, dtype=np.intp) for part in self.pattern)
        object.__setattr__(self, "pattern", (rows, columns))
        if rows.ndim != 1 or rows.shape != columns.shape:
            raise UsageError("the pattern needs one row and one column for each entry")
        if rows.size and not (0 <= min(rows.min(), columns.min()) <= max(rows.max(), columns.max()) < self.size):
            raise UsageError(f"the pattern has places outside a matrix of size {self.size}")
        if np.any(np.diff(columns * self.size + rows) <= 0):
            raise UsageError("the pattern must go by column and then by row, and name each place once")
        if not all(0 <= index < self.size for index in self.algebraic):
            raise UsageError(f"the algebraic unknowns must lie in 0..{self.size - 1}")

    @property
    def density(self) -> float:
        """The share of the matrix that the pattern fills."""
        return len(self.pattern[0]) / self.size**2


@dataclass(frozen=True, eq=False)
class SolverOptions:
    """How accurately, and by which means.

    Parameters
    ----------
    relative_tolerance
        The error allowed in a step, as a share of each unknown.
    absolute_tolerances
        The error allowed in a step on top of that, one value for each unknown or one for all.  Unknowns that must
        stay out of the error test, such as multipliers, get a very large one.
    first_step
        The first step of the run and after each `Session.reinitialize`; `None` estimates it.
    max_step
        The largest step; `None` for no bound.
    max_order
        The highest order of the method, 1 to 5.
    linear_solver
        ``"auto"`` takes fixed pivots where the problem has them and the driver can, and otherwise sparse for large
        problems with few entries.
    horizon
        A typical length of the run in seconds.  An estimated first step is at most a thousandth of it.  It is an
        option, and not taken from the first output time, so that outputs never change the solution.
    """

    relative_tolerance: float = tolerances.RTOL
    absolute_tolerances: FloatArray | float = 1e-8
    first_step: float | None = None
    max_step: float | None = None
    max_order: int = 5
    linear_solver: Literal["auto", "dense", "sparse", "fixed"] = "auto"
    horizon: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.relative_tolerance < 1.0:
            raise UsageError(f"the relative tolerance must lie between 0 and 1, not be {self.relative_tolerance}")
        if not np.all(np.asarray(self.absolute_tolerances) >= 0.0):
            raise UsageError("absolute tolerances must not be negative")
        for name in ("first_step", "max_step", "horizon"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < np.inf:
                raise UsageError(f"{name} must be positive and finite, not {value}")
        if not 1 <= self.max_order <= 5:
            raise UsageError(f"max_order must lie in 1..5, not be {self.max_order}")
        if self.linear_solver not in ("auto", "dense", "sparse", "fixed"):
            raise UsageError(f"the linear solver is 'auto', 'dense', 'sparse' or 'fixed', not {self.linear_solver!r}")


@dataclass(frozen=True)
class Budget:
    """Limits of a session, looked at between internal steps.

    Parameters
    ----------
    max_steps
        The number of internal steps of the whole session.
    wall_seconds
        The time since the session first went on, whoever spends it.
    poll
        Called with the time reached before each internal step, for progress and cancelling.  When it raises
        `KeyboardInterrupt` the advance ends as interrupted; any other exception passes through.
    """

    max_steps: int | None = None
    wall_seconds: float | None = None
    poll: Callable[[float], object] | None = None

    @property
    def is_unlimited(self) -> bool:
        """Whether there is nothing to look at between internal steps."""
        return self.max_steps is None and self.wall_seconds is None and self.poll is None


def paced(steps: int, seconds: float, is_used_up: bool, moment: float, most: int) -> int:
    """Return how many steps a call may take, so that it takes about a moment, after one that took so many seconds."""
    if seconds > 2.0 * moment:
        return max(1, int(steps * moment / seconds))
    return min(2 * steps, most) if is_used_up and seconds < 0.5 * moment else steps


class Status(Enum):
    """Why an advance ended; `STIFF` where another method was asked to take over, `NOTICED` by a `StepMonitor`."""

    REACHED = "reached"
    NOTICED = "noticed"
    EVENT = "event"
    FAILED = "failed"
    STEP_LIMIT = "step_limit"
    TIME_LIMIT = "time_limit"
    INTERRUPTED = "interrupted"
    STIFF = "stiff"


@dataclass(frozen=True, eq=False)
class StepResult:
    """Where an advance ended, and why.

    Parameters
    ----------
    t, y, yp
        The last good point of the solution: the time asked for, the event, or the last internal step.
    status
        Why it ended.
    events
        For each event function +1 (passed zero rising), -1 (falling) or 0 (did not happen).
    message
        The reason in words, where it ended neither at the time asked for nor at an event.
    equation
        The index of the first equation that had no finite value, where that is known to be the reason.
    """

    t: float
    y: FloatArray
    yp: FloatArray
    status: Status
    events: tuple[int, ...] = ()
    message: str = ""
    equation: int | None = None


@dataclass(frozen=True)
class Statistics:
    """What a session has cost so far; the sum of two is what both have cost.

    Parameters
    ----------
    steps
        Accepted internal steps.
    residual_evaluations, jacobian_evaluations, event_evaluations
        Calls of the problem's functions, for whatever purpose.
    undefined_values
        Those of the calls that gave no finite value.
    reinitializations
        Restarts of the method.
    seconds
        Time spent inside `Session.advance`, and in looking out for singular positions between steps.
    monitor_seconds
        What of it went into the latter; looks in machine code take at most half a step each, and are not told apart.
    error_test_failures, convergence_failures
        Steps that were repeated; `None` where a driver cannot tell.
    """

    steps: int = 0
    residual_evaluations: int = 0
    jacobian_evaluations: int = 0
    event_evaluations: int = 0
    undefined_values: int = 0
    reinitializations: int = 0
    seconds: float = 0.0
    monitor_seconds: float = 0.0
    error_test_failures: int | None = None
    convergence_failures: int | None = None

    def __add__(self, other: Statistics) -> Statistics:
        if self is NOTHING:
            return other
        both = zip(_COUNTED(self), _COUNTED(other), strict=True)
        sums: list[Any] = [None if a is None or b is None else a + b for a, b in both]
        return Statistics(*sums)


_COUNTED = attrgetter(*Statistics.__annotations__)

NOTHING = Statistics(error_test_failures=0, convergence_failures=0)
"""What has cost nothing so far."""


def choose_linear_solver(problem: ImplicitProblem, options: SolverOptions, has_fixed: bool = False) -> LinearSolver:
    """Return the linear solver that the options and the pattern ask for."""
    if options.linear_solver == "dense" or options.linear_solver == "sparse":
        return options.linear_solver
    wanted = options.linear_solver == "fixed"
    if has_fixed and problem.pivots is not None and (wanted or problem.size >= FIXED_SIZE):
        pivots = problem.pivots(())
        if pivots is not None and (wanted or 3 * pivots.operations["factorise"] < FIXED_SHARE * problem.size**3):
            return "fixed"
    return "sparse" if problem.size >= SPARSE_SIZE and problem.density < SPARSE_DENSITY else "dense"


@dataclass(frozen=True, eq=False)
class Nearest:
    """States that were taken onto constraints as the ends of steps are.

    Attributes
    ----------
    states
        One row each.
    met
        Which of them could be.
    moved
        By how much of its size one of the unknowns of each has moved at most; nan where that is no number.
    """

    states: FloatArray
    met: BoolArray
    moved: FloatArray


@dataclass(frozen=True, eq=False)
class NativeCallbacks:
    """Addresses of compiled functions with SUNDIALS' own C signatures, for one session.

    Residual and Jacobian return 0, or +1 where a value is not finite, which makes IDA try a smaller step.

    Parameters
    ----------
    residual
        An ``IDAResFn``: ``int (double t, N_Vector y, N_Vector yp, N_Vector out, void *data)``.
    jacobian
        An ``IDALsJacFn``: ``int (double t, double cj, N_Vector y, N_Vector yp, N_Vector out, SUNMatrix J,
        void *data, N_Vector, N_Vector, N_Vector)``.  The matrix comes filled with zeros; a sparse one (by column)
        has its index arrays zeroed too, so that these are written as well.
    user_data
        The last argument of all of them, this session's own; 0 for none.
    weights
        An ``IDAEwtFn``: ``int (N_Vector y, N_Vector weights, void *data)``, or 0 for none.
    set_weights
        ``set_weights(relative, absolute)``, called once before `weights` is used: it makes it give
        ``1 / (relative[i] * |y[i]| + absolute[i])``.
    events
        An ``IDARootFn``: ``int (double t, N_Vector y, N_Vector yp, double *values, void *data)``; 0 for none.  It
        writes values that are never zero and returns 0, 1 where an event function is not finite, or -2 where one may
        have passed zero.  So it tells in which steps something happens; what and when is then found out with the
        problem's own functions.
    restart_events
        ``restart_events(t)``: called before IDA starts at a time.
    has_noticed
        Asked where `events` did not return 0: whether that was to say that a value may have passed zero since they
        were called before, in which case they return 0 when they are called again.
    watched
        The same event functions for routines that look for their zeros; None where these are looked for in Python.
    undefined_values
        How often residual and Jacobian had no finite value so far, if somebody counts it.
    attend
        ``attend(t, y)``, called where `weights` have made IDA stop between two steps: None if that was not on
        purpose, else whether the equations are written in another way from now on, at the same solution.
    last_rate
        The factor cj of the last Jacobian, with which it is worked out anew when the equations have changed.
    keep
        Whatever must live as long as the addresses are used.
    data_bytes
        How long what `user_data` leads to is, if it holds nothing but pointers and so may be copied; else 0.
    """

    residual: int
    jacobian: int
    user_data: int = 0
    weights: int = 0
    set_weights: Callable[[FloatArray, FloatArray], None] | None = None
    events: int = 0
    restart_events: Callable[[float], None] | None = None
    has_noticed: Callable[[], bool] | None = None
    watched: EventData | None = None
    undefined_values: Callable[[], int] | None = None
    attend: Callable[[float, FloatArray], bool | None] | None = None
    last_rate: Callable[[], float] | None = None
    keep: object = None
    data_bytes: int = 0


@dataclass(frozen=True, eq=False)
class StepMonitor:
    """Compiled functions that look at a motion now and then, and say when somebody else should.

    Parameters
    ----------
    drive
        Address of ``int (solve, steps, memory, double t_out, double *reached, y, yp, double *y_at, double *yp_at, long
        allowed, data)``: sends a solver on to a time from look to look, with the addresses of its functions that go
        on and that count steps.
    fill
        Address of ``int (solve, steps, dky, current, memory, double *reached, y, yp, double *y_at, double *yp_at, long
        allowed, data, double *times, long wanted, double *table, long *filled, double *end)``: sends a solver on
        through times in the same way and fills a row of a table with y at each, with the addresses of its functions
        that read a solution and that tell the end of the last step, which is put into `end`.
    noticed
        The flag that `drive` then returns; else it returns the solver's, or -1 after as many steps as were allowed.
    paused
        The flag of `fill` where it has taken as many steps as were allowed, and read what lies in the last of them.
    data
        Their own data.
    due, due_at
        When the next look is to be taken, and the address of that time.
    look
        Address of ``int (double t, double *y, double *yp, data)``: takes one look, and returns whether somebody else
        should.
    spend
        Told for how long, in seconds, steps have been taken, or 0 at a start: what is faster may take its place.
    keep
        Whatever must live as long as the addresses are used.
    watch, watch_data, behind
        The addresses of a function like `look` and of its data, which may pass what was seen, and says so by `CROSSED`;
        and that of the times from which on and until when it did, before the values with which steps go on behind.
    """

    drive: int
    fill: int
    noticed: int
    paused: int
    data: int
    due: Callable[[], float]
    due_at: int = 0
    look: int = 0
    spend: Callable[[float], None] | None = None
    keep: object = None
    watch: int = 0
    watch_data: int = 0
    behind: int = 0


CROSSED = 3
"""What a look returns where steps are to go on behind what was seen; see `StepMonitor`."""


@dataclass(frozen=True, eq=False)
class StepGuard:
    """What judges a step that a method would keep: whether laws did something within it that slopes may have missed.

    Parameters
    ----------
    function
        Address of ``int (double t0, y0, yp0, double t1, y1, yp1, data)``: times, values and rates at both ends of a
        step; it returns 0 where the step is good.
    data
        Its last argument.
    passes
        The same for Python: ``passes(t0, y0, yp0, t1, y1, yp1)``.
    keep
        Whatever must live as long as the addresses are used.
    """

    function: int
    data: int
    passes: Callable[[float, FloatArray, FloatArray, float, FloatArray, FloatArray], bool]
    keep: object = None


MET = 1e-8
"""A step of Newton's method that moves nothing by more of its size leaves misses of the square of that: rounding."""

STEPS = 6
"""So many of these are tried; at the end of a step that is good enough one or two are needed."""


RATES = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, *[ctypes.c_void_p] * 3)
"""The function of `CompiledRates`."""

PROJECTION = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, *[ctypes.c_void_p] * 2)
"""Its projection."""


@dataclass(frozen=True, eq=False)
class CompiledRates:
    """The address of a compiled right-hand side, for one session.

    Parameters
    ----------
    function
        ``int (double t, const double *y, double *yp, void *data)``, which returns 0, or another number where a value is
        not finite.
    data
        Its last argument.
    keep
        Whatever must live as long as the addresses are used.
    project, project_data
        The address of ``int (double t, double *y, void *data)``, which takes values onto the constraints and returns
        0, or another number where it cannot, and its last argument; 0 where there are no constraints.
    faster
        Told for how long, in seconds, steps have been taken, or 0 at a start, it returns what is faster and gives the
        same bits with the same data, as soon as that pays; None before. It is None where there is nothing faster.
    """

    function: int
    data: int = 0
    keep: object = None
    project: int = 0
    project_data: int = 0
    faster: Callable[[float], CompiledRates | None] | None = None


@dataclass(frozen=True, eq=False)
class ExplicitProblem:
    """The equations ``y' = f(t, y)`` of one mode.

    The functions get arrays that are only valid during the call and must not be written to.  A function that has no
    value at a state raises `~atwood.errors.KernelEvaluationError` (or an arithmetic error), or returns values that
    are not finite: a smaller step is then tried.

    Parameters
    ----------
    size
        The number of unknowns.
    rates
        ``rates(t, y)``: the derivatives.
    events
        ``events(t, y, yp)``: one value per event, which happens where its value passes through zero.
    event_count
        The number of events.
    event_directions
        For each event +1 (rising values only), -1 (falling values only) or 0 (both).  Empty: all 0.
    event_rough
        Numbers of the events whose exact time does not matter: they happen at the end of a step.
    event_anew
        Numbers of the events at which the solution starts anew, so that the step before may end there.
    event_signs
        The sign that each event had before the start, 0 where it is not known, or
        `~atwood.integrators.protocol.JUST_HAPPENED`.  Empty: all 0.
    compiled
        ``compiled()``: a compiled form of `rates`.  Each session asks once, and must not share it with another one.
    compiled_events
        The same for `events`, if there is one: bound to values, and to no other session.
    project
        ``project(t, y)``: the values nearest to these that meet the constraints, with which steps end; None where there
        are none.
    guard
        What judges steps besides their error; None where there is nothing to be missed.
    jumps
        What is done at some of the compiled events without Python; None where nothing is.
    """

    size: int
    rates: Callable[[float, FloatArray], Values]
    events: Callable[[float, FloatArray, FloatArray], Values] | None = None
    event_count: int = 0
    event_directions: tuple[int, ...] = ()
    event_rough: tuple[int, ...] = ()
    event_anew: tuple[int, ...] = ()
    event_signs: tuple[int, ...] = ()
    compiled: Callable[[], CompiledRates] | None = None
    compiled_events: EventData | None = None
    project: Callable[[float, FloatArray], Values] | None = None
    guard: StepGuard | None = None
    jumps: Jumps | None = None

    def __post_init__(self) -> None:
        _check_watch(self)


LOOSEST = 1e-3
"""The largest relative tolerance that steps are chosen by: longer steps gain energy unseen, until chains fly apart."""


_TINY = float(np.finfo(float).tiny)


def absolute_tolerances(options: SolverOptions, size: int, least: float = _TINY) -> FloatArray:
    """Return the absolute tolerance of each unknown; by default nothing is divided by zero where it is zero."""
    if isinstance(options.absolute_tolerances, float):
        return np.full(size, max(options.absolute_tolerances, least))
    try:
        given = np.asarray(options.absolute_tolerances, dtype=np.float64)
        return np.maximum(given if given.shape == (size,) else np.broadcast_to(given, (size,)), least)
    except ValueError:
        raise UsageError(f"give one absolute tolerance, or one for each of the {size} unknowns") from None


def _check_watch(problem: ImplicitProblem | ExplicitProblem) -> None:
    """Refuse a problem without unknowns, or with events that do not fit each other."""
    if problem.size < 1:
        raise UsageError("a problem needs at least one unknown")
    if (problem.events is None) != (problem.event_count == 0):
        raise UsageError("give both the event function and the number of events, or neither")
    if problem.event_directions and len(problem.event_directions) != problem.event_count:
        raise UsageError(f"{problem.event_count} events need as many directions")
    if not set(problem.event_directions) <= {-1, 0, 1}:
        raise UsageError("an event direction is -1, 0 or +1")


@dataclass(frozen=True, eq=False)
class Handed:
    """What a run is handed over with that was watched in a lane, after a step in which it may have met an event.

    Attributes
    ----------
    rows
        The table of arrays, one row each.
    fields
        Fields of the session by name.
    looked
        Time, length and signs of the last look, and values and slopes of each event there.
    """

    rows: FloatArray
    fields: dict[str, float]
    looked: tuple[float, float, FloatArray, FloatArray]
