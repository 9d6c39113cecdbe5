"""What a problem brings as compiled functions, and what looks at its motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError
from atwood.lazy_dataclasses import dataclass


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
    undefined_values: Callable[[], int] | None = None
    attend: Callable[[float, FloatArray], bool | None] | None = None
    last_rate: Callable[[], float] | None = None
    keep: object = None
    data_bytes: int = 0


@dataclass(frozen=True, eq=False)
class Lookout:
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
    keep
        Whatever must live as long as the addresses are used.
    """

    drive: int
    fill: int
    noticed: int
    paused: int
    data: int
    due: Callable[[], float]
    due_at: int = 0
    look: int = 0
    keep: object = None


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


class GuardedResidual:
    """A residual in Python that judges each step before it is worked out.

    It has no value where a step may have passed over something, which makes IDA try a smaller one. Time goes on only
    from a step that was kept.

    Parameters
    ----------
    residual
        The residual itself.
    guard
        What judges.
    size
        How many of the unknowns, the first ones, are looked at.
    """

    def __init__(self, residual: Callable[..., Any], guard: StepGuard, size: int) -> None:
        self._residual, self._guard, self._size = residual, guard, size
        self._kept = self._tried = (0.0, np.zeros(size), np.zeros(size))
        self._passes = True

    def begin(self, t: float, y: FloatArray, yp: FloatArray) -> None:
        """Hear of a start."""
        self._kept = self._tried = (t, y[: self._size].copy(), yp[: self._size].copy())

    def __call__(self, t: float, y: FloatArray, yp: FloatArray) -> Any:
        """Return the values of the residual."""
        if t > self._tried[0]:
            self._kept = self._tried
        here = (t, y[: self._size].copy(), yp[: self._size].copy())
        if t != self._tried[0]:
            self._passes = self._guard.passes(*self._kept, *here)
        self._tried = here if self._passes else (t, *self._tried[1:])
        if not self._passes:
            raise KernelEvaluationError(f"a law may change too fast within a step to t = {t:.9g}")
        return self._residual(t, y, yp)
