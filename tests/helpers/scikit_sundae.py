"""SUNDIALS IDA through scikit-sundae: what the driver of the framework is compared with.

Every residual is a call back into Python.  IDA takes one internal step at a time; what lies between two steps is
read from its interpolant, so that outputs and events never change the steps, and so that limits, progress and
Ctrl-C have their turn after each.

Facts about scikit-sundae that this module rests on:

- a callback cannot report a recoverable failure; but a residual or a Jacobian that is not a number makes Newton's
  iteration diverge, which IDA answers with a smaller step;
- an exception in a callback ends the call and comes out of it unchanged;
- a ``"normal"`` step to a time inside the last internal step interpolates and evaluates nothing;
- IDA goes on for ever with steps that are too small to change the time;
- messages of IDA are printed, even though its flags say the same.
"""

from __future__ import annotations

import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import isfinite
from typing import Any, cast

import numpy as np

from atwood.arrays import FloatArray, IndexArray
from atwood.errors import KernelEvaluationError
from atwood.integrators.event_location import ROUNDING
from atwood.integrators.ida.callbacks import Record
from atwood.integrators.ida.memory import REASONS, TOO_LONG
from atwood.integrators.ida.states import checked_state
from atwood.integrators.ida.watchdog import STALLED_STEPS, hardly_moves, other_first_steps
from atwood.integrators.protocol import (
    Budget,
    ImplicitProblem,
    SolverOptions,
    State,
    Statistics,
    Status,
    StepResult,
    absolute_tolerances,
    choose_linear_solver,
)
from atwood.integrators.session import SteppingSession, copied
from atwood.lazy_dataclasses import replace
from atwood.lazy_modules import scipy


class _Forwarding:
    """A text stream that passes everything on except IDA's own messages."""

    def __init__(self, stream: Any) -> None:
        self.stream = stream
        self._skip = threading.local()

    def write(self, text: str) -> int:
        if text.startswith("\n[IDA") and ", Error: " in text:
            self._skip.newline = True
            return len(text)
        if text == "\n" and getattr(self._skip, "newline", False):
            self._skip.newline = False
            return 1
        return cast("int", self.stream.write(text))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


_forwarding_lock = threading.Lock()
_forwarding_depth = 0
_forwarding: _Forwarding | None = None


@contextmanager
def without_solver_messages() -> Iterator[None]:
    """Keep IDA's messages off the standard output; shared by all sessions that are advancing."""
    global _forwarding, _forwarding_depth
    with _forwarding_lock:
        _forwarding_depth += 1
        if _forwarding_depth == 1 and sys.stdout is not None:
            _forwarding = _Forwarding(sys.stdout)
            sys.stdout = cast("Any", _forwarding)
    try:
        yield
    finally:
        with _forwarding_lock:
            _forwarding_depth -= 1
            if _forwarding_depth == 0 and _forwarding is not None:
                if sys.stdout is cast("Any", _forwarding):
                    sys.stdout = _forwarding.stream
                _forwarding = None


class SundaeSession(SteppingSession):
    """A run in progress.

    Parameters
    ----------
    problem
        The equations.
    options
        Accuracy and means.
    t, y, yp
        Consistent start values.
    budget
        Limits of the session.
    """

    def __init__(
        self,
        problem: ImplicitProblem,
        options: SolverOptions,
        t: float,
        y: FloatArray,
        yp: FloatArray,
        budget: Budget | None = None,
    ) -> None:
        super().__init__(problem, options.horizon, budget)
        self._begins = problem.begin
        self._horizon = options.horizon
        self._record = Record()
        self._create: Callable[[float], Any] = lambda first: _create_solver(
            problem, replace(options, first_step=first), self._record
        )
        self._solver = _create_solver(problem, options, self._record)
        self._taken_steps = 0
        self.reinitialize(t, y, yp)

    @property
    def statistics(self) -> Statistics:
        """What the session has cost so far, over all its restarts."""
        record, locator = self._record, self._locator
        return Statistics(
            steps=self._taken_steps,
            residual_evaluations=record.residuals,
            jacobian_evaluations=record.jacobians,
            event_evaluations=locator.evaluations if locator else 0,
            undefined_values=record.undefined,
            reinitializations=self._starts - 1,
            seconds=self._seconds,
        )

    def reinitialize(self, t: float, y: FloatArray, yp: FloatArray | None = None) -> None:
        """Go on from another consistent state, after an event, a change of mode, or a projection."""
        state = checked_state(self._size, t, y, yp)
        if self._begins is not None:
            self._begins(*state)
        self._solver.init_step(*state)
        if self._locator is not None:
            self._locator.restart(state)
        self._here = self._newest = state
        self._behind = False  # whether IDA last handed out a time before the newest
        self._root = None
        self._reached = self._searched = state[0]
        self._stalled = 0
        self._stale, self._is_first = False, True
        self._starts += 1

    def _run(self, t_out: float) -> StepResult:
        with without_solver_messages(), np.errstate(all="ignore"):
            return super()._run(t_out)

    def _arrive(self, t_out: float) -> StepResult | None:
        is_there = t_out <= self._reached
        self._here = self._interpolate(t_out) if is_there else self._newest
        return StepResult(*copied(self._here), Status.REACHED, self._no_events) if is_there else None

    def _count_steps(self) -> int:
        return self._taken_steps

    def _interpolate(self, t: float) -> State:
        if t == self._newest[0]:
            return self._newest
        result = self._solver.step(t, "normal", None)
        if result.status < 0:
            raise KernelEvaluationError(f"no interpolated value at t = {t:.9g} (IDA flag {result.status})")
        self._behind = True
        return t, result.y, result.yp

    def _step(self, t_out: float) -> StepResult | None:
        """Take one internal step, and return an answer only if that failed."""
        t_before = self._newest[0]
        result = self._solver.step(t_before + self._horizon, "onestep", None)
        for first in other_first_steps(t_before, self._horizon) if self._is_first else ():
            if result.status in TOO_LONG or hardly_moves(t_before, result.t):
                self._solver = self._create(first)
                self._solver.init_step(*self._newest)
                result = self._solver.step(t_before + self._horizon, "onestep", None)
        if self._behind and result.t <= t_before:
            # After an interpolation IDA first hands out the step that it has already taken.
            result = self._solver.step(t_before + self._horizon, "onestep", None)
        if result.status < 0:
            return self._failed(REASONS.get(result.status, f"IDA stopped with flag {result.status}"))
        if not isfinite(result.y.dot(result.y)) and not np.isfinite(result.y).all():
            return self._failed("the solution is no longer finite")
        self._newest, self._reached, self._behind = (result.t, result.y, result.yp), result.t, False
        self._is_first = False
        self._taken_steps += 1
        if result.t - t_before > 4 * ROUNDING * abs(result.t):
            self._stalled = 0
            self._record.complaint, self._record.equation = "", None
        else:
            self._stalled += 1
        if self._stalled >= STALLED_STEPS:
            return self._failed("the steps became too small to move the time")
        return None

    def _stopped(self, status: Status, reason: str) -> StepResult:
        ended, record = super()._stopped(status, reason), self._record
        if status is not Status.FAILED or not record.complaint:
            return ended
        return replace(ended, message=f"{ended.message}; {record.complaint}", equation=record.equation)


def _create_solver(problem: ImplicitProblem, options: SolverOptions, record: Record) -> Any:
    """Return scikit-sundae's solver of a problem, with callbacks that count."""
    from sksundae.ida import IDA

    n = problem.size
    rows, columns = problem.pattern
    settings: dict[str, Any] = {
        "rtol": float(options.relative_tolerance),
        "atol": absolute_tolerances(options, n, least=0.0),
        "first_step": options.first_step or 0.0,
        "max_step": options.max_step or 0.0,
        "max_order": options.max_order,
        "algebraic_idx": list(problem.algebraic) or None,
    }
    places: slice | IndexArray = rows * n + columns
    if choose_linear_solver(problem, options) == "sparse":
        settings |= {"linsolver": "sparse", "sparsity": _sparsity(problem)}
        places = slice(None)
    with warnings.catch_warnings():
        # It warns that the Jacobian is taken instead of differences by the pattern, which is what is wanted.
        warnings.simplefilter("ignore", UserWarning)
        return IDA(_residual_callback(problem, record), jacfn=_jacobian_callback(problem, record, places), **settings)


def _sparsity(problem: ImplicitProblem) -> Any:
    """Return the pattern as a SciPy matrix, entry by entry in the pattern's order."""
    rows, columns = problem.pattern
    starts = np.searchsorted(columns, np.arange(problem.size + 1))
    parts = (np.ones(len(rows)), rows.astype(np.int32), starts.astype(np.int32))
    return scipy.sparse.csc_matrix(parts, shape=(problem.size, problem.size))


def _residual_callback(problem: ImplicitProblem, record: Record) -> Callable[..., None]:
    def residual(t: float, y: FloatArray, yp: FloatArray, out: FloatArray) -> None:
        record.residuals += 1
        # Newton's iteration goes on for a while after a value was missing; that says nothing new.
        is_known = bool(record.complaint) and not np.isfinite(y).all()
        if is_known or not record.take_residual(problem, t, y, yp, out):
            out.fill(np.nan)

    return residual


def _jacobian_callback(problem: ImplicitProblem, record: Record, places: slice | IndexArray) -> Callable[..., None]:
    """Return the callback that writes the entries to their places in a flat view of scikit-sundae's array."""

    def jacobian(t: float, y: FloatArray, yp: FloatArray, _: FloatArray, cj: float, out: FloatArray) -> None:
        record.jacobians += 1
        entries = record.take_jacobian(problem, t, y, yp, cj)
        out.reshape(-1)[places] = np.nan if entries is None else entries

    return jacobian


open_session = SundaeSession
"""Starts a run with scikit-sundae's IDA."""
