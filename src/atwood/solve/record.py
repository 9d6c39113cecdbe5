"""What is recorded of a run: samples of each stretch in one mode, projected where the form has constraints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.forms.assembly import Assembly
from atwood.solve.problem import Plan

__all__ = ["Recorder", "Segment"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Segment:
    """A stretch of a run in one mode.

    Attributes
    ----------
    plan
        What it was run with.
    impact
        Whether it began with an impact.
    time
        Sample times, shape (samples,).
    coordinates, speeds
        Of the form, projected where the form has constraints, orientations with coordinates of size one; shape
        (number, samples).
    shown
        Which samples are outputs.
    held
        By how much the solver's own states missed the constraints on position and velocity, shape (2, samples).
    """

    plan: Plan
    impact: bool
    time: FloatArray
    coordinates: FloatArray
    speeds: FloatArray
    shown: NDArray[np.bool_]
    held: FloatArray

    @property
    def assembly(self) -> Assembly:
        """The scene in this mode."""
        return self.plan.assembly


@dataclass
class Recorder:
    """Takes up samples of a segment."""

    plan: Plan
    time: list[float] = field(default_factory=list)
    q: list[FloatArray] = field(default_factory=list)
    u: list[FloatArray] = field(default_factory=list)
    shown: list[bool] = field(default_factory=list)
    held: list[tuple[float, float]] = field(default_factory=list)

    def take(self, t: float, y: FloatArray, shown: bool) -> tuple[FloatArray, FloatArray]:
        """Record a state of the solver, projected; return what was recorded."""
        plan = self.plan
        q, u = (part.copy() for part in plan.program.split(y))
        held = plan.balance.misses(t, q, u, plan.sizes)
        q = plan.balance.turning.normalized(q)
        if plan.is_projected:
            q, u = plan.balance.project(t, q, u, plan.sizes)
            plan.check_held(t, q, u)
        if self.time and self.time[-1] == t:  # an output time that is also an event: keep the state after it
            for last in (self.time, self.q, self.u, self.shown, self.held):
                del last[-1]
        self.time.append(t)
        self.q.append(q)
        self.u.append(u)
        self.shown.append(shown)
        self.held.append(held)
        return q, u

    def close(self) -> float:
        """Drop a sample that was not recorded to its end, show the last one, and return its time."""
        lists: tuple[list[Any], ...] = (self.time, self.q, self.u, self.shown, self.held)
        complete = min(len(one) for one in lists)
        for one in lists:
            del one[complete:]
        self.shown[-1] = True
        return self.time[-1]

    def segment(self, impact: bool) -> Segment:
        """Return what was recorded."""
        return Segment(
            self.plan,
            impact,
            np.array(self.time),
            np.array(self.q).T.reshape(self.plan.program.coordinates, len(self.time)),
            np.array(self.u).T.reshape(self.plan.program.speeds, len(self.time)),
            np.array(self.shown),
            np.array(self.held).T,
        )
