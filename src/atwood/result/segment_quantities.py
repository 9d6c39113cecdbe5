"""What follows from the samples of one segment of a run: accelerations, reactions, and quantities by path."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, Program, Scalar, depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.quantities import find_observables, observer, state_program
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.run.recorder import SegmentRecord

_READS: Key[bool] = Key("whether quantities depend on symbols")


def reads(assembly: Assembly, paths: Sequence[str], symbols: Sequence[Expression]) -> bool:
    """Return whether a quantity depends on any of some symbols."""
    return assembly.shared.get(
        _READS,
        lambda: depends_on([one.value for one in find_observables(assembly, paths)], symbols),
        (tuple(paths), tuple(symbols)),
    )


def quantities_at(
    assembly: Assembly,
    paths: tuple[str, ...],
    state: tuple[FloatArray, FloatArray, FloatArray],
    accelerations: Callable[[], FloatArray],
    reactions: Callable[[], FloatArray],
) -> FloatArray:
    """Return quantities by path at many states, shape (paths, states); what none of them depends on is not found."""
    t, q, u = state
    symbols = [one.symbol for one in assembly.reactions]
    a, forces = np.zeros_like(u), np.zeros((len(symbols), len(t)))
    if reads(assembly, paths, symbols):
        forces = reactions()
    if u.size and reads(assembly, paths, assembly.own_equations.accelerations):
        a = accelerations()
    kernel = assembly.kernel(observer(assembly, paths), vectorized=True)
    return np.asarray(kernel(t[None, :], q, u, a, forces)[0])


def state_values(assembly: Assembly, program: Program, t: FloatArray, q: FloatArray, u: FloatArray) -> FloatArray:
    """Return what a program of the state gives that reads no accelerations and reactions, shape (values, samples)."""
    idle = (np.zeros_like(u), np.zeros((len(assembly.reactions), len(t))))
    found = assembly.kernel(program, vectorized=True)(t[None, :], q, u, *idle)[0]
    return np.array([np.broadcast_to(row, t.shape) for row in found])


def shown_values(segment: SegmentRecord, name: str, quantities: Iterable[Scalar]) -> FloatArray:
    """Return quantities of the configuration at the output times of a segment, shape (quantities, times)."""
    assembly, convert = segment.assembly, segment.assembly.mechanism.table.graph.convert
    program = state_program(assembly, name, [convert(one) for one in quantities])
    return state_values(assembly, program, segment.time, segment.coordinates, segment.speeds)[:, segment.shown]


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
        segment = self.segment
        state = segment.time, segment.coordinates, segment.speeds
        return quantities_at(segment.assembly, paths, state, self.accelerations, lambda: self.reactions[0])

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
