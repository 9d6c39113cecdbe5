"""From a problem and its options to IDA's memory, ready for the first step."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.integrators.ida.callbacks import Record, address, jacobian_function, residual_function, weight_function
from atwood.integrators.ida.library import library
from atwood.integrators.ida.memory import IdaMemory
from atwood.integrators.protocol import (
    ImplicitProblem,
    LinearSolver,
    NativeCallbacks,
    SolverOptions,
    State,
    absolute_tolerances,
)
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import or_one

LOOSE_NEWTON, TIGHT_NEWTON, FIXED_NEWTON = 0.33, 0.01, 0.1
"""IDA's own choice of the Newton coefficient, that for problems with multipliers, and for large ones of them."""

_GROWTH, _SMOOTH_GROWTH, _HELD_GROWTH = 2.0, 1.5, 1.2
"""Bounds for `IdaTuning.least_growth`: IDA's own, and those for few unknowns without and with algebraic ones."""

_AGE, _SHORT_AGE, _FIXED_AGE = 0.25, 0.05, 0.1
"""Bounds for `IdaTuning.jacobian_age`: IDA's own, that for few unknowns, and with fixed pivots for many."""

_SHORTENINGS = 40
"""So often a step may be cut to a quarter where steps are judged."""

_CHEAP, _CHEAPEST = 60, 40
"""Up to so many unknowns a new Jacobian costs little, and less than the iterations that it saves."""


@dataclass(frozen=True, eq=False)
class IdaTuning:
    """What IDA can be told beyond the options that all drivers have.

    Parameters
    ----------
    suppress_algebraic
        Leave the algebraic unknowns out of the error test.  They still count in Newton's iteration.
    newton_coefficient
        How small the error of Newton's iteration must be, as a share of the error that a step may have.  `None`
        takes what was measured to be best: `LOOSE_NEWTON` without algebraic unknowns, else `TIGHT_NEWTON`, which
        saves a quarter to a half of the steps of constrained pendulums for the same number of residuals, or, with
        fixed pivots beyond 60 unknowns, `FIXED_NEWTON`, which saves up to half the work of loose tolerances there.
    least_growth
        A step is made longer once it can grow by this factor. `None` takes 1.2 with fixed pivots and up to 60 unknowns
        if some of them are algebraic, 1.5 if none is, and else IDA's own 2, since every change of the step can ask for
        a new Jacobian. Below 1.15 steps change so often that the order cannot rise: runs take many times as long.
    jacobian_age
        By which share the step may have changed before the Jacobian is worked out anew. `None` takes 0.05 up to 40
        unknowns, with fixed pivots up to 60 and then 0.1, where that costs less than the iterations it saves, and
        else IDA's own 0.25. Together these save a quarter to a third of the time for the same error of pendulums and
        linkages.
    angle_like
        Unknowns whose error is allowed as a share of `angle_size` instead of their own value: angles that go round
        and round, or anything else whose zero means nothing.
    angle_size
        That size; one for all of these unknowns, or one for each.
    stop_time
        A time that IDA never steps over, because the equations end or change there.
    """

    suppress_algebraic: bool = False
    newton_coefficient: float | None = None
    least_growth: float | None = None
    jacobian_age: float | None = None
    angle_like: tuple[int, ...] = ()
    angle_size: FloatArray | float = 1.0
    stop_time: float | None = None

    def __post_init__(self) -> None:
        if self.newton_coefficient is not None and not 0.0 < self.newton_coefficient < np.inf:
            raise UsageError(f"newton_coefficient must be positive and finite, not {self.newton_coefficient}")
        if self.least_growth is not None and not 1.15 <= self.least_growth < np.inf:
            raise UsageError(f"least_growth must be at least 1.15, not {self.least_growth}")
        if self.jacobian_age is not None and not 0.0 < self.jacobian_age < 1.0:
            raise UsageError(f"jacobian_age must lie between 0 and 1, not be {self.jacobian_age}")
        if not np.all(np.asarray(self.angle_size) > 0.0):
            raise UsageError("angle_size must be positive")
        if self.stop_time is not None and not np.isfinite(self.stop_time):
            raise UsageError(f"stop_time must be finite, not {self.stop_time}")


IDAS_OWN = IdaTuning(newton_coefficient=LOOSE_NEWTON, least_growth=_GROWTH, jacobian_age=_AGE)
"""What IDA does where it is told nothing."""


def prepare(
    problem: ImplicitProblem,
    options: SolverOptions,
    tuning: IdaTuning,
    linear_solver: LinearSolver,
    native: NativeCallbacks | None,
    record: Record,
    state: State,
) -> IdaMemory:
    """Return IDA's memory at a start."""
    sundials = library()
    memory = IdaMemory(sundials, problem.size)
    if native is None:
        residual = residual_function(problem, record, sundials)
        jacobian = jacobian_function(problem, record, sundials, linear_solver)
        memory.keep(residual, jacobian)
        native = NativeCallbacks(address(residual), address(jacobian))
    else:
        memory.keep(native)
    memory.y[:], memory.yp[:] = state[1:]
    memory.begin(native.residual, state[0], native.user_data)
    _set_weights(memory, problem, options, tuning, native, record)
    pivots = problem.pivots if linear_solver == "fixed" else None
    sizes = or_one(absolute_tolerances(options, problem.size, least=0.0))
    sizes[list(problem.algebraic)] *= options.relative_tolerance  # theirs are not small
    is_sparse = linear_solver == "sparse"
    memory.set_linear_solver(len(problem.pattern[0]), native.jacobian, is_sparse, pivots, record, sizes)
    if problem.algebraic:
        kinds = np.ones(problem.size)
        kinds[list(problem.algebraic)] = 0.0
        memory.call("IDASetId", memory.vector(kinds)[1])
        memory.call("IDASetSuppressAlg", int(tuning.suppress_algebraic))
    newton, growth, age = measured_tuning(problem.size, bool(problem.algebraic), linear_solver == "fixed")
    memory.call("IDASetNonlinConvCoef", tuning.newton_coefficient or newton)
    memory.call("IDASetEtaFixedStepBounds", 1.0, tuning.least_growth or growth)
    memory.call("IDASetDeltaCjLSetup", tuning.jacobian_age or age)
    if native.events:
        memory.call("IDARootInit", problem.event_count, native.events)
        memory.call("IDASetNoInactiveRootWarn")
    if problem.begin is not None:
        memory.call("IDASetMaxConvFails", _SHORTENINGS)
    memory.call("IDASetMaxOrd", options.max_order)
    if options.first_step is not None:
        memory.call("IDASetInitStep", options.first_step)
    if options.max_step is not None:
        memory.call("IDASetMaxStep", options.max_step)
    return memory


def measured_tuning(size: int, is_held: bool, has_fixed_pivots: bool) -> tuple[float, float, float]:
    """Return the Newton coefficient, the least growth of a step and the age of a Jacobian that `IdaTuning` takes."""
    if has_fixed_pivots and is_held and size > _CHEAP:
        return FIXED_NEWTON, _HELD_GROWTH, _FIXED_AGE
    growth = _GROWTH if size > _CHEAP else _HELD_GROWTH if is_held else _SMOOTH_GROWTH
    age = _SHORT_AGE if size <= (_CHEAP if has_fixed_pivots else _CHEAPEST) else _AGE
    return TIGHT_NEWTON if is_held else LOOSE_NEWTON, growth, age


def _set_weights(
    memory: IdaMemory,
    problem: ImplicitProblem,
    options: SolverOptions,
    tuning: IdaTuning,
    native: NativeCallbacks,
    record: Record,
) -> None:
    """Tell IDA which error each unknown may have."""
    n, share = problem.size, options.relative_tolerance
    absolute = absolute_tolerances(options, n, least=0.0)
    fixed = list(tuning.angle_like)
    if not all(0 <= index < n for index in fixed):
        raise UsageError(f"the angle-like unknowns must lie in 0..{n - 1}")
    absolute[fixed] += share * np.asarray(tuning.angle_size)
    if len(set(fixed)) in (0, n) and native.attend is None:
        # Then the weights are of the kind that IDA computes itself, and nothing else depends on being asked for them.
        memory.call("IDASVtolerances", 0.0 if fixed else share, memory.vector(absolute)[1])
        return
    relative = np.full(n, share)
    relative[fixed] = 0.0
    weights = native.weights
    if weights and native.set_weights is not None:
        native.set_weights(relative, absolute)
    else:
        function = weight_function(relative, absolute, record, memory.library)
        memory.keep(function)
        weights = address(function)
    memory.call("IDAWFtolerances", weights)
