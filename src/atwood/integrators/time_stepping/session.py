"""Steps of Moreau and Jean: the midpoint rule, with the impulses of all contacts in a step at its end.

With ``y = (q, u)`` and ``y' = f(t, y)`` where nothing touches, a step of length h solves

    y_m = y_0 + h/2 f(t_0 + h/2, y_m) + (0, W p)/2,    y_1 = 2 y_m - y_0,

in which the impulses p are those that the laws of contact and friction allow for the velocities at its end. What can
touch is asked at ``q_0 + h/2 q'_0`` (J. J. Moreau 1988; M. Jean 1999, with theta = 1/2).
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any, NamedTuple, Protocol

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import SolveError, StartError
from atwood.integrators.protocol import RATES, Budget, ExplicitProblem, State, Statistics, Status, StepResult
from atwood.integrators.session import SteppingSession, copied
from atwood.lazy_dataclasses import dataclass

_SAME = 1e-9
"""Of a step: times that are so near are one."""

_MET = 1e-13
"""Of its size: a state that changes by no more is found."""

_PLAIN, _TURNS = 12, 60
"""So many turns are tried without, and so many with, the derivatives of the rates."""

_MOST_DERIVED = 1000
"""With more unknowns than these, derivatives are not worked out by differences."""


class Pushed(NamedTuple):
    """What contacts do in a step.

    Attributes
    ----------
    change
        That of the speeds, at the end of the step.
    is_impact
        Whether something collides, so that speeds jump.
    loss
        Energy that is lost in contacts whose work nothing else tells, J.
    states
        States of the contacts from now on, to be compared with those before; None where none are recorded.
    told
        What is told of it.
    error
        By how much of the largest speed impulses are off that have not been found to rounding.
    """

    change: FloatArray
    is_impact: bool
    loss: float
    states: tuple[float, ...] | None
    told: Callable[[float], list[Any]]
    error: float = 0.0


class Touching(Protocol):
    """What may touch in a step."""

    def pushed(self, free: FloatArray) -> Pushed:
        """Return what contacts do, given the speeds at the end of the step without them."""


@dataclass(frozen=True, eq=False)
class ImpulsiveProblem:
    """A motion with contacts.

    Attributes
    ----------
    smooth
        The equations where nothing touches, with the projection onto constraints that stay.
    coordinates
        The number of coordinates among the unknowns; speeds follow.
    sizes
        Of the unknowns.
    step
        Length of the steps, s.
    touching
        ``touching(t, y, u, h)``: what may touch at a state, in a step that begins with speeds u; None where nothing is
        near.
    """

    smooth: ExplicitProblem
    coordinates: int
    sizes: FloatArray
    step: float
    touching: Callable[[float, FloatArray, FloatArray, float], Touching | None]


class Change(NamedTuple):
    """A moment at which contacts change: time, states before and after, those of contacts, and what is told.

    `strikes` says whether velocities may jump, `rests` whether impacts have accumulated.
    """

    time: float
    states: FloatArray
    held: tuple[float, ...] | None
    told: list[Any]
    strikes: bool = True
    rests: bool = False


class TimeSteppingSession(SteppingSession):
    """A run in progress.

    Parameters
    ----------
    problem
        The motion.
    t, y
        Start values.
    budget
        Limits of the session.
    end
        The last time that will be asked for; no step goes beyond.
    """

    def __init__(self, problem: ImpulsiveProblem, t: float, y: FloatArray, budget: Budget | None, end: float) -> None:
        self._motion, self._end, self._n = problem, end, problem.coordinates
        self._steps = self._evaluations = self._failures = 0
        self._changes: list[Change] = []
        self._losses: list[tuple[float, float]] = [(t, 0.0)]
        self._native = None if problem.smooth.compiled is None else problem.smooth.compiled()
        super().__init__(problem.smooth, end - t, budget)
        self.reinitialize(t, y)

    @property
    def statistics(self) -> Statistics:
        """What the session has cost so far."""
        return Statistics(
            steps=self._steps,
            residual_evaluations=self._evaluations,
            reinitializations=self._starts - 1,
            seconds=self._seconds,
            error_test_failures=0,
            convergence_failures=self._failures,
        )

    def reinitialize(self, t: float, y: FloatArray, yp: FloatArray | None = None) -> None:
        """Go on from another state; steps are counted from there."""
        values = np.array(y, dtype=np.float64)
        if not (isfinite(t) and np.isfinite(values).all()):
            raise StartError(f"the start values at t = {t} are not all finite numbers")
        self._stale, self._root, self._starts = False, None, self._starts + 1
        self._origin, self._since = float(t), 0
        self._inverse: tuple[float, FloatArray] | None = None
        self._before = self._pre = self._newest = self._here = (float(t), values, self._rates(t, values))
        self._reached = self._searched = float(t)
        self._held: tuple[float, ...] | None = None
        self._last: tuple[float, FloatArray] | None = None
        h = min(self._motion.step, self._end - t)
        touching = self._motion.touching(t, values, values[self._n :], h) if h > 0.0 else None
        if touching is not None:  # so that states are right before the first step, too
            self._held = touching.pushed(values[self._n :] + h * self._newest[2][self._n :]).states
        self._changes.append(Change(float(t), np.array([values, values]), self._held, []))

    def take_changes(self) -> list[Change]:
        """Return what has changed up to the state that was handed out last, since this was last asked."""
        made = [one for one in self._changes if one.time <= self._here[0]]
        self._changes = self._changes[len(made) :]
        return made

    @property
    def has_losses(self) -> bool:
        """Whether contacts have taken energy that nothing else tells."""
        return len(self._losses) > 1

    def loss_until(self, times: FloatArray) -> FloatArray:
        """Return the energy that was lost by some times in contacts whose work nothing else tells, J."""
        at, total = np.array(self._losses).T
        found: FloatArray = total[np.maximum(np.searchsorted(at, times, side="right") - 1, 0)]
        return found

    # -- between two steps ----------------------------------------------------------------------------------------

    def _arrive(self, t_out: float) -> StepResult | None:
        if t_out > self._newest[0] + _SAME * self._motion.step:
            return None
        if abs(t_out - self._newest[0]) <= _SAME * self._motion.step:
            self._here = (t_out, *self._newest[1:])
        else:
            self._here = self._interpolate(t_out)
        return StepResult(*copied(self._here), Status.REACHED, self._no_events)

    def _interpolate(self, t: float) -> State:
        """Return the state within the last step: speeds along a line, and coordinates along a parabola."""
        (t_0, y_0, yp_0), (t_1, y_1, yp_1), n = self._before, self._pre, self._n
        h = t_1 - t_0
        s = (t - t_0) / h
        y = y_0 + s * (y_1 - y_0)
        y[:n] += 0.5 * s * (s - 1.0) * h * (yp_1[:n] - yp_0[:n])
        return t, y, self._rates(t, y)

    # -- steps ----------------------------------------------------------------------------------------------------

    def _count_steps(self) -> int:
        return self._steps

    def _step(self, t_out: float) -> StepResult | None:
        (t, y, yp), n = self._newest, self._n
        end = self._origin + self._motion.step * (self._since + 1)
        if end > self._end - _SAME * self._motion.step:
            end = self._end
        if end == t:
            return self._stopped(Status.FAILED, "the steps became too small to move the time")
        h = end - t
        ahead = y + 0.5 * h * yp
        touching = self._motion.touching(t + 0.5 * h, ahead, y[n:], h)
        middle, pushed = self._middle(t, y, yp, h, touching)
        made = 2.0 * middle - y
        project = self._motion.smooth.project
        if project is not None:
            made = np.asarray(project(end, made), dtype=float)
        self._before, self._steps, self._since = self._newest, self._steps + 1, self._since + 1
        self._newest = self._pre = (end, made, self._rates(end, made))
        self._reached = self._searched = end
        states = None if pushed is None else pushed.states
        if pushed is not None and pushed.loss:
            self._losses.append((end, self._losses[-1][1] + pushed.loss))
        is_impact = pushed is not None and pushed.is_impact
        if is_impact and pushed is not None:
            free = made.copy()
            free[n:] -= pushed.change
            self._pre = (end, free, self._rates(end, free))
        if is_impact or states != self._held:
            told = [] if pushed is None else pushed.told(end)
            self._changes.append(Change(end, np.array([self._pre[1], made]), states, told))
            self._held = states
        return None

    def _middle(
        self, t: float, y: FloatArray, yp: FloatArray, h: float, touching: Touching | None
    ) -> tuple[FloatArray, Pushed | None]:
        """Return the state in the middle of a step, and what contacts do in it."""
        n, middle, push = self._n, y + 0.5 * h * yp, np.zeros(len(y))
        if touching is not None and self._last is not None and self._last[0] == h:
            push[n:] = self._last[1]  # what is held goes on to be
        pushed: Pushed | None = None
        last, known = np.inf, push[n:]
        for _ in range(_TURNS):
            middle = self._solved(t + 0.5 * h, y + 0.5 * push, middle, 0.5 * h)
            if touching is None:
                self._last = None
                return middle, None
            free = 2.0 * middle[n:] - y[n:] - push[n:]
            if pushed is not None:
                moved = self._relative(free - known, free, n)
                # Rounding in what follows from many rows is larger than that of one.
                if moved <= max(_MET, pushed.error) or (moved <= 1e3 * _MET and moved >= last):
                    self._last = None if pushed.is_impact else (h, pushed.change)
                    return middle, pushed
                last = moved
            pushed, known = touching.pushed(free), free
            push[n:] = pushed.change
            middle[n:] = 0.5 * (y[n:] + free + pushed.change)
        raise self._failure(t, "the impulses of contacts and the forces of a step do not settle")

    def _solved(self, t: float, base: FloatArray, guess: FloatArray, half: float) -> FloatArray:
        """Return the solution of ``y = base + half f(t, y)``."""
        y, last = guess, np.inf
        for turn in range(_TURNS):
            miss = base + half * self._rates(t, y) - y
            if turn >= _PLAIN or self._inverse is not None:
                miss = self._derived(t, y, half) @ miss
            moved, y = self._relative(miss, y), y + miss
            if moved <= _MET or (moved <= 1e3 * _MET and moved >= last):
                return y
            if turn in (2 * _PLAIN, 4 * _PLAIN):
                self._inverse = None  # the derivatives are those of another state
            if not isfinite(moved) or (turn >= _PLAIN and len(y) > _MOST_DERIVED):
                break
            last = moved
        raise self._failure(t, "the forces change too fast for a step of this length")

    def _derived(self, t: float, y: FloatArray, half: float) -> FloatArray:
        """Return the inverse of ``1 - half df/dy``, by differences; it is kept as long as it leads on."""
        found = self._inverse
        if found is None or found[0] != half:
            here, moves = self._rates(t, y), 1e-7 * self._motion.sizes
            slopes = [(self._rates(t, y + one) - here) / one[i] for i, one in enumerate(np.diag(moves))]
            found = self._inverse = half, np.asarray(np.linalg.inv(np.eye(len(y)) - half * np.array(slopes).T))
        return found[1]

    def _rates(self, t: float, y: FloatArray) -> FloatArray:
        self._evaluations += 1
        native, found = self._native, np.empty(len(y))
        if native is None or RATES(native.function)(t, y.ctypes.data, found.ctypes.data, native.data):
            found[:] = self._motion.smooth.rates(t, y)  # which says what has no value
        return found

    def _relative(self, move: FloatArray, at: FloatArray, first: int = 0) -> float:
        return float(np.max(np.abs(move) / (self._motion.sizes[first:] + np.abs(at)), initial=0.0))

    def _failure(self, t: float, what: str) -> SolveError:
        self._failures += 1
        return SolveError(f"at t = {t:.9g} {what}, {self._motion.step:g} s", advice="Give a shorter step.")
