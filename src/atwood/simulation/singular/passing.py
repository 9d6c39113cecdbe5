"""Singular positions that steps pass by themselves: what they need for it, and what they have passed."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray, address_of
from atwood.codegen.routines import NUMBER
from atwood.integrators.protocol import CompiledRates, StepMonitor
from atwood.lazy_dataclasses import replace
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.singular.arc_routine import SETTLED
from atwood.simulation.singular.collocation import Arc, Path, points, sweeps_of
from atwood.simulation.singular.crossing import (
    Loss,
    RankMeasure,
    SingularCrossing,
    find_loss,
    labels_of,
    least_energy,
    nearly_lost,
)
from atwood.simulation.singular.crossing_routine import PASSED, POINTS, WAY, singular_routines
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.codegen.sundials.step_monitor import MonitorData

_ROOM = 1 << 17
"""So many numbers are kept of what was passed, until somebody takes it."""

_MOST = 128

_SETTLED = 1e-4
"""Times the tolerance of a run: what further sweeps change by less is none of its errors."""


class PassedCrossing(SingularCrossing):
    """A singular position that steps have passed; what is lost there is worked out where somebody asks.

    Parameters
    ----------
    plan
        The scene in its mode.
    time, path
        When, s, and the motion over the place, which is its last arc.
    away
        How far away that was from the place at its ends.
    rows
        By how much each constraint has changed most so far.
    """

    def __init__(self, plan: SceneProblem, time: float, path: Path, away: float, rows: FloatArray) -> None:
        self.__dict__.update(time=time, path=path, _given=(plan, path.arcs[-1], away, rows))

    @cached_property
    def _loss(self) -> tuple[Loss, tuple[tuple[str, ...], tuple[str, ...]]]:
        plan, arc, away, rows = self.__dict__["_given"]
        measure = RankMeasure(plan)
        measure.rows = rows
        q = arc.at(np.array([self.time]))[0][:, 0]
        found = find_loss(measure, arc, self.time, away) or Loss(1, (nearly_lost(measure, self.time, q),))
        return found, labels_of(plan, found.constraints)

    @property
    def arcs(self) -> tuple[Arc, ...]:
        """The motion over the place."""
        path: Path = self.__dict__["path"]
        return path.arcs

    @property
    def ways(self) -> int:
        """See `SingularCrossing`."""
        return self._loss[0].rank

    @property
    def gap(self) -> float:
        """See `SingularCrossing`."""
        return self._loss[0].gap

    @property
    def constraints(self) -> tuple[str, ...]:
        """See `SingularCrossing`."""
        return self._loss[1][0]

    @property
    def parts(self) -> tuple[str, ...]:
        """See `SingularCrossing`."""
        return self._loss[1][1]


class Passages:
    """What lets steps pass singular positions by themselves, in one stretch of a run.

    Parameters
    ----------
    plan
        The scene in its mode, whose constraints are all on positions.
    monitor
        What looks at the motion; it judges by itself.
    rates
        Rates and projections on the constraints.
    tolerance, accurate
        The relative tolerance of the run, and how large the estimate of an arc's error may be.
    end
        When the stretch ends, s; an arc ends no later.
    """

    def __init__(
        self,
        plan: SceneProblem,
        monitor: MonitorData,
        rates: CompiledRates,
        tolerance: float,
        accurate: float,
        end: float,
    ) -> None:
        width, conditions = plan.program.coordinates + plan.program.speeds, monitor.code.shape.conditions
        self._plan, self._monitor, self._width, self._conditions = plan, monitor, width, conditions
        states, settled = np.empty((POINTS, width)), max(SETTLED, _SETTLED * tolerance)
        self._sweeps = sweeps_of(plan, rates, np.empty(width), 0.0, np.empty(POINTS), states, settled, accurate)
        size = len(PASSED) + conditions + (POINTS + 1) * width
        self._log, self._behind = np.empty((min(_MOST, 1 + _ROOM // size), size)), np.empty(2 + width)
        self._look = singular_routines().code.addresses["watch"]
        x, series, _ = points()
        given = {
            "arc": self._sweeps.address,
            "look": monitor.code.look_address,
            "measure": monitor.code.measure_address,
            "judge": monitor.code.judge_address,
            "monitor": monitor.address,
            "points": address_of(x),
            "series": address_of(series),
            "behind": address_of(self._behind),
            "log": address_of(self._log),
            "capacity": len(self._log),
            "accurate": accurate,
            "slow": least_energy(tolerance),
            "singular": tolerances.SINGULAR,
            "fits": tolerances.NEARLY_FITS,
            "until": end,
        }
        self._way = np.zeros(len(WAY), dtype=np.int64)
        for place, (name, kind) in enumerate(WAY.items()):
            (self._way.view(np.float64) if kind is NUMBER else self._way)[place] = given.get(name, 0)
        monitor.pass_in_steps()
        self._count = list(WAY).index("count")

    def watched(self, given: StepMonitor) -> StepMonitor:
        """Return what looks at the motion, and passes what it sees."""
        data, behind = address_of(self._way), address_of(self._behind)
        return replace(given, watch=self._look, watch_data=data, behind=behind, keep=(given.keep, self))

    def take(self) -> list[PassedCrossing]:
        """Return what was passed since this was last asked."""
        count = int(self._way[self._count])
        self._way[self._count] = 0
        rows, n, arcs, found = self._log[:count].copy(), self._plan.program.coordinates, list[Arc](), []
        behind = len(PASSED) + self._conditions
        for row in rows:
            time, start, end, error, away = row[: len(PASSED)].tolist()
            sizes, integrated = row[len(PASSED) : behind], row[behind:].reshape(-1, self._width)
            arcs.append(Arc(start, end, integrated[:, :n], integrated[:, n:], error))
            if time == time:  # else one before the place
                found.append(PassedCrossing(self._plan, time, Path(tuple(arcs)), away, sizes))
                arcs = []
        return found
