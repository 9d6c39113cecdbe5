"""What follows from the samples of one segment of a run: accelerations, reactions, and quantities by path."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import depends_on
from atwood.forms.quantities import find_observables, observer
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.run.recorder import SegmentRecord


class SegmentQuantities:
    """The quantities of one segment of a run, computed when they are asked for.

    Parameters
    ----------
    segment
        The segment.
    """

    def __init__(self, segment: SegmentRecord) -> None:
        self.segment = segment

    def values(self, paths: tuple[str, ...]) -> FloatArray:
        """Return quantities by path, shape (paths, samples)."""
        segment, assembly = self.segment, self.segment.assembly
        symbols = [one.symbol for one in assembly.reactions]
        expressions = [one.value for one in find_observables(assembly, paths)]
        reactions, accelerations = np.zeros((len(symbols), len(segment.time))), np.zeros_like(segment.speeds)
        if any(depends_on(one, symbols) for one in expressions):
            reactions, _ = self.reactions
        if segment.speeds.size and any(depends_on(one, assembly.own_equations.accelerations) for one in expressions):
            accelerations = self.accelerations()
        kernel = assembly.kernel(observer(assembly, paths), vectorized=True)
        state = segment.time[None, :], segment.coordinates, segment.speeds
        found: FloatArray = kernel(*state, accelerations, reactions)[0]
        return found

    @cached_property
    def _solver(self) -> ReactionSolver:
        segment = self.segment
        start = float(segment.time[0]), segment.coordinates[:, 0], segment.speeds[:, 0]
        return ReactionSolver(segment.assembly, *start)

    def accelerations(self) -> FloatArray:
        """Return the accelerations of the form's coordinates; near singular positions those of the smooth motion."""
        segment = self.segment
        found, clear = np.zeros_like(segment.speeds), np.ones(len(segment.time), dtype=bool)
        for crossing in segment.singular_crossings:
            inside = crossing.has_in_its_middle(segment.time)
            if crossing.path is not None:
                found[:, inside] = crossing.path.at(segment.time[inside])[2]
                clear &= ~inside
        state = segment.time[clear], segment.coordinates[:, clear], segment.speeds[:, clear]
        found[:, clear] = self._solver.own_accelerations(*state, segment.plan.finding)
        return found

    @cached_property
    def reactions(self) -> tuple[FloatArray, FloatArray]:
        """All reactions, nan at singular positions, and the power of constraints that move with time, W."""
        segment, t = self.segment, self.segment.time
        clear = np.ones(len(t), dtype=bool)
        for crossing in segment.singular_crossings:
            clear &= ~crossing.leaves_open(t)
        values, power = np.full((len(segment.assembly.reactions), len(t)), np.nan), np.zeros(len(t))
        if np.any(clear):  # otherwise the segment lies within a moment, in which no work is done
            values[:, clear], power[clear] = self._solver.at(
                t[clear], segment.coordinates[:, clear], segment.speeds[:, clear]
            )
            power[~clear] = np.interp(t[~clear], t[clear], power[clear])
        return values, power
