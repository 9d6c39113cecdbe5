"""The way of derivatives through the stretches of a run, and over what happens between them."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray, IndexArray
from atwood.errors import SolveError, UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.result.result import Result
from atwood.simulation.initialization.start import own_state
from atwood.simulation.run.recorder import SegmentRecord
from atwood.study.sensitivities.augmented import Augmented, Stretch
from atwood.study.sensitivities.columns import Column, seeds_of
from atwood.study.sensitivities.quantities import derivatives, written

_AGREES = 1e3
"""So many tolerances may lie between a motion with derivatives and the run; its own errors grow like the columns."""


class Passage:
    """Derivatives along a run.

    Parameters
    ----------
    result
        The run.
    columns
        What it is differentiated by.
    paths
        Quantities.
    rtol, max_steps
        Tolerance and limit.
    """

    def __init__(
        self, result: Result, columns: tuple[Column, ...], paths: tuple[str, ...], rtol: float, max_steps: int | None
    ) -> None:
        self.run, self.columns, self.paths = result.run, columns, paths
        self.rtol, self.max_steps = rtol, max_steps
        self.where = self.run.assembly.flat.name

    def go(self) -> tuple[FloatArray, FloatArray]:
        """Return values and derivatives of the quantities at the outputs, times the scales of the columns."""
        segments = [one for one in self.run.segments if len(one.time)]
        first, start = segments[0], self.run.start
        assert start is not None
        if first.assembly.shared is not self.run.assembly.shared:
            raise UnsupportedError(
                "the run begins in other coordinates than the scene was assembled in",
                where=self.where,
                advice="Ask with orientation='quaternion'.",
            )
        state = own_state(self.run.assembly, start)
        moved = np.array([one.start(state, start.length) for one in self.columns])
        values, found = [], []
        for number, segment in enumerate(segments):
            if segment.singular_crossings:
                crossing = segment.singular_crossings[0]
                raise SolveError(
                    f"it passes a singular position at t = {crossing.time:.9g} s, where there are no derivatives",
                    where=self.where,
                    advice="Let the run end before.",
                )
            seeds = self._seeds(segment)
            begin = self._state(segment, 0)
            augmented = Augmented(segment.plan, float(segment.time[0]), begin, seeds)
            moved = augmented.tangent(float(segment.time[0]), begin, moved)
            stretch = self._along(segment, augmented, begin, moved)
            shown = np.flatnonzero(segment.shown)
            expressions = written(segment.plan, self.paths, float(segment.time[0]), begin)
            now = derivatives(
                segment.assembly, expressions, segment.time[shown], stretch.states[shown], stretch.columns[shown], seeds
            )
            values.append(now[0])
            found.append(now[1])
            if number + 1 < len(segments):
                moved = self._over(segment, segments[number + 1], stretch)
        return np.concatenate(values, axis=1), np.concatenate(found, axis=2)

    def _state(self, segment: SegmentRecord, number: int) -> FloatArray:
        return np.concatenate([segment.coordinates[:, number], segment.speeds[:, number]])

    def _seeds(self, segment: SegmentRecord) -> FloatArray:
        """Return the change of each parameter in a stretch by each column."""
        now = segment.assembly
        return seeds_of(self.columns, lambda other: self.beside(now, other))

    def beside(self, now: Assembly, other: Assembly) -> Assembly:
        """Return a scene with other values in the mode and the piece that an assembly is in."""
        if now.shared is other.shared:
            made = other
        else:
            raise UnsupportedError("derivatives through changes of mode are not there yet", where=self.where)
        return made.with_relations(now.relation_values) if now.relations else made

    def _along(self, segment: SegmentRecord, augmented: Augmented, begin: FloatArray, moved: FloatArray) -> Stretch:
        """Return the motion with its derivatives at the samples of a stretch."""
        times = segment.time
        if len(times) == 1:
            return Stretch(begin[None, :], moved[None, :, :], 0)
        wanted = np.flatnonzero(segment.shown | (np.arange(len(times)) == len(times) - 1))
        wanted = wanted[wanted > 0]
        part = augmented.run(float(times[0]), begin, moved, times[wanted], self.rtol, self.max_steps)
        states, columns = np.zeros((len(times), len(begin))), np.zeros((len(times), *moved.shape))
        states[0], columns[0] = begin, moved
        states[wanted], columns[wanted] = part.states, part.columns
        self._check(segment, states[wanted], columns[wanted], wanted)
        return Stretch(states, columns, part.steps)

    def _check(self, segment: SegmentRecord, states: FloatArray, columns: FloatArray, wanted: IndexArray) -> None:
        """Refuse a motion that comes out otherwise than in the run, by more than errors can have grown."""
        plan = segment.plan
        sizes = plan.tolerances(1.0, {})[: states.shape[1]]
        run = np.concatenate([segment.coordinates, segment.speeds])[:, wanted].T
        apart = np.max(np.abs(states - run) / sizes, axis=1)
        grown = 1.0 + np.max(np.abs(columns) / sizes, axis=(1, 2)) + np.max(np.abs(run) / sizes, axis=1)
        far = np.flatnonzero(~(apart <= _AGREES * max(self.rtol, 1e-13) * grown))
        if len(far):
            raise SolveError(
                f"the motion with its derivatives leaves the run at t = {segment.time[wanted[far[0]]]:.9g} s",
                where=self.where,
                advice="Ask for a smaller rtol, or let the run end before.",
            )

    def _over(self, before: SegmentRecord, after: SegmentRecord, stretch: Stretch) -> FloatArray:
        raise UnsupportedError("derivatives over events are not there yet", where=self.where)
