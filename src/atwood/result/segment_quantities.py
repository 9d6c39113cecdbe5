"""What follows from the samples of a run: accelerations, reactions, and quantities by path.

Runs with contacts have thousands of short segments. Those with the same equations and parameters are worked out as one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, Program, Scalar, depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.quantities import find_observables, observer, state_program
from atwood.lazy_dataclasses import replace
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
    """The quantities of segments of a run with the same equations and parameters, computed when they are asked for.

    Parameters
    ----------
    parts
        The segments by their numbers in the run.

    Attributes
    ----------
    segment
        A record of all their samples.
    places
        Which of these are those of each segment.
    """

    def __init__(self, parts: Mapping[int, SegmentRecord]) -> None:
        self.parts = parts
        first, *others = parts.values()
        self.segment = first if not others else _joined([first, *others])
        ends = accumulate((len(one.time) for one in parts.values()), initial=0)
        self.places = dict(zip(parts, (slice(*ends) for ends in pairwise(ends)), strict=True))

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


def _joined(segments: Sequence[SegmentRecord]) -> SegmentRecord:
    """Return a record of the samples of all of some segments."""
    times = np.concatenate([one.time for one in segments])
    places, speeds = (np.concatenate([getattr(one, x) for one in segments], axis=1) for x in ("coordinates", "speeds"))
    shown = np.concatenate([one.shown for one in segments])
    return replace(segments[0], time=times, coordinates=places, speeds=speeds, shown=shown)


def quantities_of(segments: Iterable[SegmentRecord]) -> list[SegmentQuantities]:
    """Return the quantities of all segments of a run, of those that are alike together."""
    alike: dict[tuple[Any, ...], dict[int, SegmentRecord]] = {}
    for number, one in enumerate(segments):
        plan, alone = one.plan, number if one.singular_crossings else -1
        sizes = plan.coordinate_sizes.tobytes(), plan.sizes.tobytes(), plan.scales.time
        alike.setdefault((alone, id(plan.assembly), plan.finding, *sizes), {})[number] = one
    return [SegmentQuantities(parts) for parts in alike.values()]


def values_along(readings: Sequence[SegmentQuantities], paths: tuple[str, ...]) -> FloatArray:
    """Return quantities by path at all samples of a run in their order, shape (paths, samples)."""
    pieces = {}
    for one in readings:
        values = one.values(paths)
        pieces.update({number: values[:, place] for number, place in one.places.items()})
    return np.concatenate([pieces[number] for number in range(len(pieces))], axis=1)
