"""The motion of a scene at any times, in the stretches in which neighbouring motions move smoothly beside it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import SolveError, UsageError
from atwood.forms.assembly import Assembly
from atwood.late import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import assemble, simulate
from atwood.result.result import Result
from atwood.simulation.dynamics.orientation_coordinates import to_regular
from atwood.simulation.run.record import SegmentRecord
from atwood.theory.flow.field import States
from atwood.theory.linear.variations import LinearScene

__all__ = ["SmoothMotion", "Stretch"]


@dataclass(frozen=True, eq=False)
class Stretch:
    """A part of a motion in which nothing jumps.

    Attributes
    ----------
    scene
        The scene's equations and their derivatives there.
    kept
        Independent constraints.
    begin, end
        s.
    """

    scene: LinearScene
    kept: tuple[int, ...]
    begin: float
    end: float


class SmoothMotion:
    """The motion of a scene, simulated again with other output times whenever states are asked for.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    outputs
        Output times, or their number.
    options
        What else `atwood.simulate` is given.

    Raises
    ------
    UsageError
        If the form is not the reduced one, or the motion jumps on its way.
    SolveError
        If it does not get to its end.
    """

    def __init__(self, scene: Model | Assembly, outputs: Any, options: Mapping[str, Any]) -> None:
        self.assembly = scene if isinstance(scene, Assembly) else assemble(scene)
        self._options = dict(options)
        if self.assembly.form != "reduced":
            raise UsageError(
                "deviations are those of generalized coordinates, and this assembly is of the dae form",
                where=self.assembly.flat.name,
                advice="Give the scene, or an assembly of the reduced form.",
            )
        self.result: Result = simulate(self.assembly, outputs=outputs, **self._options)
        _refuse_jumps(self.result)

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """The stretches, in order; between two of them is a time event, at which the state does not jump."""
        found = []
        for segment in self.result.run.segments:
            scene = LinearScene(segment.assembly, "reduced")
            q = to_regular(segment.assembly, segment.coordinates[:, 0])
            begin, end = float(segment.time[0]), float(segment.time[-1])
            found.append(Stretch(scene, scene.rank(begin, q).kept, begin, end))
        return tuple(found)

    def states(self, number: int, times: FloatArray) -> States:
        """Return states in a stretch.

        Parameters
        ----------
        number
            Of the stretch.
        times
            Inside it or at its ends, in any order; s.
        """
        wanted, places = np.unique(times, return_inverse=True)
        result = simulate(self.assembly, outputs=wanted, samples=1, **self._options)
        _refuse_jumps(result)
        segment = result.run.segments[number]
        found = np.searchsorted(segment.time, wanted)
        if found[-1] >= len(segment.time) or not np.array_equal(segment.time[found], wanted):
            raise SolveError(
                "the motion did not come to the same times when it was simulated again",
                where=self.assembly.flat.name,
                advice="Run on one thread, or with a limit of steps that does not depend on time.",
            )
        q = _regular(segment)[:, found]
        return States(wanted, q, segment.speeds[:, found])[places]


def _regular(segment: SegmentRecord) -> FloatArray:
    """Return the coordinates of a segment with quaternions for orientations."""
    if segment.assembly.own_equations is segment.assembly.regular:
        return segment.coordinates
    return np.stack([to_regular(segment.assembly, q) for q in segment.coordinates.T], axis=1)


def _refuse_jumps(result: Result) -> None:
    where = result.assembly.flat.name
    if result.status != "finished":
        raise SolveError(f"the motion does not get to its end: {result.message}", where=where)
    jumps = [(one.time, one.describe()) for one in result.events if one.target or one.impact]
    jumps += [(one.time, f"at t = {one.time:.9g} s, a singular position") for one in result.singular_crossings]
    told = {time for time, _ in jumps}
    for one in result.run.segments[1:]:
        time = float(one.time[0])
        if (one.impact or not one.after_time_event) and time not in told:
            jumps.append((time, f"at t = {time:.9g} s, {'an impact' if one.impact else 'another mode'}"))
    if jumps:
        time, what = min(jumps)
        raise UsageError(
            f"neighbouring motions do not move smoothly beside this one: {what}",
            where=where,
            advice=f"Let it end before, with t_end below {time:.9g}.",
        )
