"""How far two solutions of a scene are apart: errors of quantities, and of the motion as a whole."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.forms.assembly import Assembly
from atwood.integrators.methods import METHODS
from atwood.lazy_dataclasses import dataclass
from atwood.result.second_run import needed_error
from atwood.simulation.run.made import Run

_LOST = 0.1
"""Errors beyond this share of the scene's size are no longer those of the same motion."""

_SURE = 3.0
"""So many times the distance of two solutions is told: the second has an error, too, at times one as large."""

_DOUBT = 100.0
"""So many tolerances of a second solution its balance of energy may be off before it is not believed."""


@dataclass(frozen=True, eq=False)
class Accuracy:
    """How right a run is, as far as a second, more accurate solution and the balance of energy tell.

    The second solution is more accurate and takes other steps, at most a hundredth of the run each. It is believed
    where its energy balances as far as its tolerance lets one expect, or no worse than that of the run and by no more
    than the two are apart; otherwise the scene is solved with an eighth of these steps, and an eighth again. Where no
    solution is to be believed, the error is not known, and `reached` is infinite.

    What is guaranteed: no solution is compared with whose energy drifts, at any sample, by more than its tolerance or
    the error that is told accounts for; see `atwood.EnergyLedger`. What is not: the distance of two solutions is an
    estimate of the error, so three times this distance is told. A law that both solutions step over is not seen where
    it leaves the energy at all samples as it is, such as a short pulse that a function in Python gives to a body at
    rest. Errors that keep the energy, as those of the time along a periodic motion, are told by the distance alone.

    Attributes
    ----------
    asked
        The largest error that was asked for; None if none was.
    reached
        Three times the estimated error of positions, relative to the extent of the scene, of angles, rad, and of
        quantities with nominal sizes, relative to these: the largest over all outputs. Infinite where it is not known.
    path
        Which quantity it is of.
    until
        Until when the error is within what was asked, or, where nothing was asked, within a tenth of the scene's size:
        beyond, neighbouring motions have parted, and the run tells little of the motion; s.
    events
        Estimated errors of the times of events, s; nan where the second solution has no such event.
    how
        What the second solution is.
    """

    asked: float | None
    reached: float
    path: str
    until: float
    events: FloatArray
    how: str

    @property
    def is_known(self) -> bool:
        """Whether there is a second solution that is to be believed."""
        return math.isfinite(self.reached)

    @property
    def is_met(self) -> bool:
        """Whether the error is within what was asked."""
        return self.asked is None or self.reached <= self.asked

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data, for JSON."""
        events = [None if np.isnan(one) else float(one) for one in self.events]
        reached = self.reached if self.is_known else None
        own = {"asked": self.asked, "reached": reached, "path": self.path, "until": self.until}
        return {**own, "events": events, "how": self.how}

    def describe(self) -> str:
        """Return it in a sentence."""
        if not self.is_known:
            return f"the error is not known (compared with {self.how})"
        found = f"error {self.reached:.1e} at most, of {self.path}" if self.path else "nothing has an error"
        if self.asked is not None and not self.is_met:
            found += f"; {self.asked:g} was asked for, and holds until t = {self.until:.6g} s"
        elif self.reached > _LOST:
            found += f"; it tells little of the motion after t = {self.until:.6g} s"
        return f"{found} (estimated by {self.how})"


def compared_paths(assembly: Assembly) -> list[str]:
    """Return the positions of all bodies with mass, the coordinates that are angles, and, in space, axes of bodies.

    Axes that differ by less than they are long differ by the angle between two orientations, in radians; coordinates
    of orientations differ where nothing does.
    """
    known = assembly.observables
    owners = [path for path, local in assembly.mechanism.locals_.items() if local.point_inertias or local.body_inertias]
    paths = [f"{owner}.position.{axis}" for owner in owners for axis in "xyz"]
    paths += [one.name for one in assembly.reduced.names]
    found = [path for path in dict.fromkeys(paths) if path in known and known[path].unit in ("m", "rad")]
    if assembly.mechanism.space.is_spatial:
        axes = [f"{owner}.{axis}_axis.{part}" for owner in owners for axis in "xyz" for part in "xyz"]
        found += [path for path in axes if path in known]
    return found


def difference(time: FloatArray, values: FloatArray, other_time: FloatArray, other: FloatArray) -> FloatArray:
    """Return by how much two solutions differ at the output times of the first, shape (times,).

    At an event the first has states before and after; which of them the other one has there is not known, and the
    larger error beside the event is taken.
    """
    at = np.minimum(np.searchsorted(other_time, time), len(other_time) - 1)
    twice = np.zeros(len(time), dtype=bool)
    twice[1:] = np.diff(time) == 0.0
    twice[:-1] |= twice[1:]
    found = np.where((other_time[at] == time) & ~twice, np.abs(values - other[at]), np.nan)
    known = np.flatnonzero(~np.isnan(found))
    if len(known):
        before = known[np.maximum(np.searchsorted(known, np.arange(len(time)), side="right") - 1, 0)]
        after = known[np.minimum(np.searchsorted(known, np.arange(len(time))), len(known) - 1)]
        found = np.maximum(found[before], found[after])
    return found


def estimate_accuracy(first: Run, second: Run, time: FloatArray, error: Callable[[str], FloatArray]) -> Accuracy:
    """Return how right a motion is from the errors of its positions and angles."""
    asked, known = first.options.accuracy, first.assembly.observables
    length = first.start.length if first.start is not None else 1.0
    compared = dict.fromkeys([*compared_paths(first.assembly), *first.options.nominal])
    paths = [path for path in compared if path in second.assembly.observables]
    usual = {path: length if known[path].unit == "m" else 1.0 for path in paths}
    scales = {path: first.options.nominal.get(path, size) for path, size in usual.items()}
    rtol = second.options.relative_tolerance
    limit = _LOST if asked is None else asked
    worst, path = 0.0, ""
    late = len(time)
    for one, scale in scales.items():
        found = _SURE * error(one) / scale
        largest = float(np.max(found, initial=0.0))
        if not largest <= worst:
            worst, path = largest, one
        beyond = np.flatnonzero(~(found <= limit))
        late = min(late, int(beyond[0]) if len(beyond) else late)
    until = float(time[late - 1]) if late else float(time[0])
    form, solver = second.assembly.form, METHODS[second.solver].title
    how = f"a second solution, {form} form, {solver}, rtol {rtol:.1g}"
    needed = needed_error(second, _DOUBT * rtol)
    if needed > _DOUBT * rtol and needed > min(worst, needed_error(first, _DOUBT * rtol)):
        how = f"{how}, whose own energy drifts as if it had an error of {needed:.1e}"
        worst, path, until = math.inf, "", float(time[0])
    alike = [(a.part, a.law) == (b.part, b.law) for a, b in zip(first.events, second.events, strict=False)]
    missed = [
        abs(a.time - b.time) if same else np.nan for a, b, same in zip(first.events, second.events, alike, strict=False)
    ]
    missed += [np.nan] * (len(first.events) - len(missed))
    return Accuracy(asked, worst, path, until, np.array(missed, dtype=float), how)
