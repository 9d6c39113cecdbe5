"""Singular positions that a run passed through, came close to, or came to rest in.

Where all bars of a row of parallelograms lie in one line some constraints follow from the others, and how the
mechanism goes on is not determined by where it is. Its motion until then goes on smoothly in one way only. A motion
that reaches the place with little speed would turn back a little before or behind it for another energy. So it is told
apart from one that passes, and from one that turns back clearly, by more than what its errors can change.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import SolveError
from atwood.integrators.event_location import EventLocator, Root, State
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Constraint
from atwood.simulation.events.modes import EventProbe
from atwood.simulation.problem.problem import Plan
from atwood.simulation.singular.collocation import Arc
from atwood.simulation.singular.rank_measure import RankMeasure

if TYPE_CHECKING:
    from atwood.simulation.singular.collocation import Path


_PIECES = 8
"""In so many pieces a path is searched for events."""


@dataclass(frozen=True, eq=False)
class SingularCrossing:
    """A singular position that a run passed through, or came close to.

    Attributes
    ----------
    time
        When, s.
    ways
        How many more degrees of freedom the mechanism has there than near by; zero where it only comes close.
    constraints
        What follows from the other constraints there, and nowhere near.
    parts
        The parts that these belong to.
    path
        The motion over the place or past it; None where it could not be told.
    gap
        By how much the constraints do not quite hold there, relative to the scene's sizes.
    """

    time: float
    ways: int
    constraints: tuple[str, ...]
    parts: tuple[str, ...]
    path: Path | None
    gap: float = 0.0

    @property
    def is_told(self) -> bool:
        """Whether there is something to tell: not where a motion only came close, and could be followed."""
        return self.ways > 0 or self.path is None

    def has_in_its_middle(self, t: FloatArray) -> NDArray[np.bool_]:
        """Return which times are so near that states are better taken from the path than projected."""
        return np.asarray(np.abs(t - self.time) < 0.1 * self._half)

    def covers(self, t: FloatArray) -> NDArray[np.bool_]:
        """Return at which times states are better taken from the path than from between the ends of a solver's step."""
        return np.zeros(len(t), dtype=bool) if self.path is None else (t > self.path.start) & (t < self.path.end)

    def leaves_open(self, t: FloatArray) -> NDArray[np.bool_]:
        """Return at which times reactions are not determined, within rounding."""
        return np.asarray(np.abs(t - self.time) < 1e-6 * self._half) if self.ways else np.zeros(len(t), dtype=bool)

    @property
    def _half(self) -> float:
        return 0.0 if self.path is None else self.path.end - self.time

    def describe(self) -> str:
        """Return it as a sentence."""
        more = len(self.constraints) - 3
        said = ", ".join(self.constraints[:3]) + (f" and {more} more" if more > 0 else "")
        follow = "follows" if len(self.constraints) == 1 else "follow"
        if self.path is None:
            return (
                f"t = {self.time:.6g} s: came so close to a singular position, where {said} nearly {follow} from the "
                "other constraints, that it could not be told which way the mechanism goes on: do not rely on what "
                "comes after"
            )
        return (
            f"t = {self.time:.6g} s: passed through a singular position, where {said} {follow} from the other "
            f"constraints and there {'is one more way' if self.ways == 1 else f'are {self.ways} more ways'} to move; "
            f"went on smoothly{self._fit}"
        )

    @property
    def _fit(self) -> str:
        """What is to be said of lengths that do not quite fit."""
        if self.gap < 1e-12:
            return ""
        return f" (lengths fit there to {self.gap:.0e} of the scene's size, which was taken for exactly)"


def stuck_at(constraint: Constraint, t: float, message: str) -> SolveError:
    """Return the error of a solver that failed at a singular position."""
    return SolveError(
        f"near t = {t:.6g} the mechanism comes to a singular position, where {constraint.label} nearly follows from "
        f"the other constraints, too slowly or too closely to determine how the motion continues: {message}",
        where=constraint.key[0],
        advice="Change lengths, start or speed slightly, so that the motion clearly crosses the singular position "
        "or avoids it.",
    )


def events_on(path: Path, plan: Plan, probe: EventProbe) -> Root | None:
    """Return the first event on a path; None if there is none."""
    if not probe.event_functions:
        return None
    size, n, m = plan.program.size, plan.program.coordinates, len(plan.sizes)

    def at(t: float) -> State:
        q, u, a = (one[:, 0] for one in path.at(np.array([t])))
        y, yp = np.zeros(size), np.zeros(size)
        y[:n], y[n : n + m], yp[n : n + m] = plan.balance.kinematic_map.normalized(q), u, a
        yp[:n] = plan.balance.kinematic_map.rates(t, y[:n], u)
        return t, y, yp

    locator = EventLocator(plan.problem(probe.function(), probe.directions), path.end - path.start)
    locator.restart(at(path.start))
    times = np.linspace(path.start, path.end, _PIECES + 1).tolist()
    found = (locator.search(one, other, at) for one, other in pairwise(times))
    return next((root for root in found if root is not None), None)


_ENERGIES, _PLACES = 30.0, 300.0
"""Times the tolerance: what a run's errors may change, of energies and of places, relative to their sizes."""

_LEAST = 1e-7
"""At tighter tolerances the same; rank is judged to be lost within 1e-5."""


def is_slow(plan: Plan, arc: Arc, t: float, fastest: float, tolerance: float) -> bool:
    """Return whether a motion has so little energy at a time that errors could have it turn back."""
    here, *ends = np.max(np.abs(arc.at(np.array([t, arc.start, arc.end]))[1]) / plan.sizes[:, None], axis=0).tolist()
    return bool(here**2 < max(_ENERGIES * tolerance, _LEAST) * max(fastest, *ends) ** 2)


def slowest(t: FloatArray, speeds: FloatArray, sizes: FloatArray) -> float | None:
    """Return when a motion is slowest between some times; None where it is at their ends."""
    square = np.sum((speeds / sizes[:, None]) ** 2, axis=0)
    least = int(np.argmin(square))
    if least in (0, len(t) - 1):
        return None
    before, here, after = square[least - 1 : least + 2].tolist()
    bend = before - 2.0 * here + after
    share = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(t[least] + share * (t[1] - t[0]))


def rests_at(plan: Plan, measure: RankMeasure, arc: Arc, far: float, fastest: float, tolerance: float) -> float | None:
    """Return when an arc comes to rest so close to a singular position that errors decide what follows, or None."""
    times = np.linspace(arc.start, arc.end, 65)
    rest = slowest(times, arc.at(times)[1], plan.sizes)
    if rest is None:
        return None
    near = measure.at(np.array([rest]), arc.at(np.array([rest]))[0])[0] < max(_PLACES * tolerance, _LEAST) * far
    return rest if near and is_slow(plan, arc, rest, fastest, tolerance) else None
