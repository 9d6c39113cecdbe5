"""Results: trajectories by component path, computed from the states when they are asked for."""

from __future__ import annotations

import os
from collections.abc import ItemsView, Iterable, Iterator, Mapping, ValuesView
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from atwood.arguments import ANYTHING, FILE, instance, takes
from atwood.arrays import FloatArray
from atwood.display import count_of, listed
from atwood.errors import ResultError
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import find_observables
from atwood.integrators.protocol import Statistics
from atwood.model.declare.connectors import PATHS, Quantity
from atwood.result.energy import ConservedLedger, EnergyLedger, accounts
from atwood.result.segment_quantities import SegmentQuantities, quantities_of, values_along
from atwood.result.trajectories import Trajectories
from atwood.result.turns import TurnCounter
from atwood.result.work import find_ledger
from atwood.simulation.dynamics.numerical_failure import named
from atwood.simulation.dynamics.orientation_coordinates import CoordinateSwitch
from atwood.simulation.events.modes import EventRecord, Impact
from atwood.simulation.initialization.mobility import Immobile, find_immobile
from atwood.simulation.initialization.report import InitializationReport, report_initialization
from atwood.simulation.initialization.start import Start, own_state
from atwood.simulation.problem.options import how_solved
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.projection import misses_of
from atwood.simulation.run.recorder import SegmentRecord
from atwood.simulation.run.run_record import Run

if TYPE_CHECKING:
    from atwood.result.accuracy import Accuracy
    from atwood.simulation.singular.crossing import SingularCrossing


_LONGER = "Give it more time; or assemble the scene first, and hand the assembly to several runs."


class Result(Trajectories):
    """The motion of a scene, and every quantity of every component along it.

    A mapping from paths to arrays: ``result["bob2.position.x"]`` is the quantity at the output times. All quantities of
    a component are `group` ``("bob2")``, or ``result.parts.bob2``. Forces are worked out after the run, and only if
    asked for.

    Parameters
    ----------
    run
        What the solver gave.
    conserved
        Conserved quantities along it; see `simulate(..., monitor=)`.
    second
        A second solution, if there is one already; see `error`.
    """

    @takes(run=instance("a run, as solve.run makes it", Run), conserved=ANYTHING, second=ANYTHING)
    def __init__(self, run: Run, conserved: ConservedLedger | None = None, second: Run | None = None) -> None:
        self.run, self.conserved, self._second_run = run, conserved, second
        self._cache: dict[str, FloatArray] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return Result, (self.run, self.conserved, self._second_run)

    # -- what it is of --------------------------------------------------------------------------------------------

    @property
    def assembly(self) -> Assembly:
        """The scene as it was assembled at the start."""
        return self.run.assembly

    @property
    def form(self) -> str:
        """``"reduced"`` or ``"dae"``."""
        return self.assembly.form

    @property
    def level(self) -> str:
        """Level of the dae form; empty for the reduced form."""
        return self.assembly.level

    @property
    def method(self) -> str:
        """Form and solver in words, such as ``"dae (ggl), IDA"``; a level is that of IDA's equations."""
        return how_solved(self.form, self.level, (one.solver for one in self.run.choices))

    @property
    def status(self) -> str:
        """``"finished"``, ``"stopped"``, ``"step_limit"``, ``"time_limit"`` or ``"interrupted"``."""
        return self.run.status

    @property
    def message(self) -> str:
        """Why the run ended, in words; empty if it went to its end."""
        return self.run.message

    @property
    def start(self) -> Start:
        """The start.

        Raises
        ------
        ResultError
            If there was no time to find it.
        """
        if self.run.start is None:
            raise self._empty()
        return self.run.start

    @property
    def _segments(self) -> tuple[SegmentRecord, ...]:
        if not self.run.segments:
            raise self._empty()
        return self.run.segments

    @property
    def first_plan(self) -> SceneProblem:
        """What the run was prepared with at the start."""
        return self._segments[0].plan

    def _empty(self) -> ResultError:
        return ResultError(f"there is nothing in it: {self.message}", where=self.assembly.flat.name, advice=_LONGER)

    @property
    def events(self) -> tuple[EventRecord, ...]:
        """Events on the way, in order."""
        return self.run.events

    @property
    def impacts(self) -> tuple[Impact, ...]:
        """Impacts of gaps in order, with impulses, speeds and what was lost; of those that accumulate the first."""
        return tuple(one.struck for one in self.events if one.struck is not None)

    @property
    def singular_crossings(self) -> tuple[SingularCrossing, ...]:
        """Singular positions that the run passed through, or came too close to, in order."""
        return self.run.singular_crossings

    @property
    def coordinate_switches(self) -> tuple[CoordinateSwitch, ...]:
        """When which orientation went on in other coordinates, since its own came near to where they are singular."""
        return self.run.coordinate_switches

    @property
    def solver(self) -> str:
        """What solved it and why, as a sentence."""
        return self.run.why

    @cached_property
    def immobile(self) -> Immobile | None:
        """Why nothing can move, and what would have to let go; None if something can, or is driven."""
        plan, start = self._segments[0].plan, self.start
        freedom = len(plan.assembly.own_equations.speeds) - plan.finding.rank
        return find_immobile(self.assembly, freedom, start)

    @cached_property
    def initialization(self) -> InitializationReport:
        """What the start moved: bodies and guesses, and the joints that were open before."""
        with named(self.assembly, self.start.time, *own_state(self.assembly, self.start)):
            return report_initialization(self.assembly, self.start)

    @property
    def timings(self) -> Mapping[str, float]:
        """What each stage from the scene to the motion took, s; `atwood.stages.STAGES` says what each makes.

        Stages whose work was done before, such as those of an assembly that is given, are not there or take no time.
        """
        return self.run.timings

    @property
    def statistics(self) -> Statistics:
        """What the solver did."""
        return self.run.statistics

    # -- how right it is ------------------------------------------------------------------------------------------

    @cached_property
    def second(self) -> Result:
        """A second, more accurate solution, which is solved when it is first asked for.

        Raises
        ------
        UsageError
            If there is none: of a scene whose parts call functions at sample times, and where nothing more accurate
            can be solved.
        """
        from atwood.result.accuracy import second_run

        if self._second_run is None:
            self._second_run = second_run(self.run, np.unique(self.time), lambda o: Result(self.run, None, o).accuracy)
        return Result(self._second_run)

    def error(self, path: str) -> FloatArray:
        """Return the estimated error of a quantity at the output times, shape (times,): its distance from `second`.

        Where neighbouring motions have parted, it is of the size of the quantity itself; `accuracy` says when.

        Raises
        ------
        ResultError
            If there is no such quantity.
        UsageError
            If there is no second solution.
        """
        from atwood.result.accuracy import difference

        known, other = self._known(path), self.second
        return difference(self.time, self[known], other.time, other[known])

    @cached_property
    def accuracy(self) -> Accuracy:
        """How right the motion is as a whole, by the `second` solution; an error where there is none."""
        from atwood.result.accuracy import estimate_accuracy

        return estimate_accuracy(self.run, self.second.run, self.time, self.error)

    # -- quantities -----------------------------------------------------------------------------------------------

    @cached_property
    def time(self) -> FloatArray:
        """Output times, s."""
        return np.asarray(self._all_time[self._shown])

    @cached_property
    def _all_time(self) -> FloatArray:
        return np.concatenate([segment.time for segment in self._segments])

    @cached_property
    def _shown(self) -> NDArray[np.bool_]:
        return np.concatenate([segment.shown for segment in self._segments])

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of all quantities."""
        return tuple(self.assembly.observables)

    def unit(self, path: str) -> str:
        """Return the SI unit of a quantity."""
        return find_observables(self.assembly, [self._known(path)])[0].unit

    def describe(self, path: str) -> str:
        """Return one line of meaning of a quantity."""
        return find_observables(self.assembly, [self._known(path)])[0].doc

    def __contains__(self, path: object) -> bool:
        return isinstance(path, (str, Quantity)) and str(path) in self.assembly.observables

    def array(self, path: str) -> FloatArray:
        """Return a quantity at the output times, shape (times,).

        Raises
        ------
        ResultError
            If there is no such quantity.
        """
        return self.samples(self._known(path))[self._shown]

    @takes(paths=PATHS)
    def table(self, paths: Iterable[str] | None = None) -> dict[str, FloatArray]:
        """Return quantities at the output times by path; all when no paths are given."""
        wanted = tuple(self.paths if paths is None else (self._known(path) for path in paths))
        self._fill(wanted)
        return {path: self._cache[path][self._shown] for path in wanted}

    def items(self) -> ItemsView[str, FloatArray]:
        """Return a view of all paths and arrays, worked out in one pass."""
        self._fill(self.paths)
        return super().items()

    def values(self) -> ValuesView[FloatArray]:
        """Return a view of all arrays, worked out in one pass."""
        self._fill(self.paths)
        return super().values()

    def samples(self, path: str) -> FloatArray:
        """Return a quantity at all samples of the run, outputs and others."""
        path = self._known(path)
        if path not in self._cache:
            self._fill((path,))
        return self._cache[path]

    def _fill(self, paths: tuple[str, ...]) -> None:
        """Compute quantities that are not there yet, all in one pass."""
        missing = tuple(path for path in paths if path not in self._cache)
        if not missing:
            return
        turning = self._turns.needed(missing)
        needed = tuple(dict.fromkeys((*missing, *turning)))
        raw = dict(zip(needed, values_along(self._readings, needed), strict=True))
        for path in missing:
            counts = self.assembly.observables[path].periodic
            self._cache[path] = self._turns.counted(path, raw, self._all_time) if counts else raw[path]

    @cached_property
    def _turns(self) -> TurnCounter:
        return TurnCounter(self.run)

    @cached_property
    def _readings(self) -> list[SegmentQuantities]:
        return quantities_of(self._segments)

    # -- how good it is -------------------------------------------------------------------------------------------

    @cached_property
    def energy(self) -> EnergyLedger:
        """Kinetic and potential energy, work, and how well they balance."""
        pieces = accounts(self._readings)
        every = (x for one in pieces for x in (one.kinetic, one.potential, one.power) if x is not None)
        if not all(np.all(np.isfinite(x)) for x in every):
            raise ResultError(
                "the energy, or the power put in, has no value somewhere along the run",
                where=self._without_energy(),
                advice="A law is evaluated outside its domain there: look at its formula and at the start.",
            )
        return find_ledger(self.run, pieces, self._shown)

    def _without_energy(self) -> str:
        """Return the part whose energy has no value."""
        for path in self.paths:
            if path.endswith("_energy") and not np.all(np.isfinite(self.samples(path))):
                return path
        return self.assembly.flat.name

    @cached_property
    def constraint_max(self) -> dict[str, float]:
        """By how much constraints are missed at most, relative to the scene's sizes.

        ``position`` and ``velocity`` of what the result holds, ``held_position`` and ``held_velocity`` of what the
        solver held before projection.
        """
        found = {"position": 0.0, "velocity": 0.0, "held_position": 0.0, "held_velocity": 0.0}
        for segment in self._segments:
            plan, shown = segment.plan, segment.shown
            if not plan.balance.constraints:
                continue
            speed = 1.0 / plan.scales.time
            missed = misses_of(plan, segment.time[shown], segment.coordinates[:, shown], segment.speeds[:, shown])
            position, velocity = np.max(missed, axis=1, initial=0.0)
            found["position"] = max(found["position"], float(position))
            found["velocity"] = max(found["velocity"], float(velocity) / speed)
            found["held_position"] = max(found["held_position"], float(np.max(segment.held[0])))
            found["held_velocity"] = max(found["held_velocity"], float(np.max(segment.held[1])) / speed)
        return found

    @property
    def multipliers(self) -> Mapping[str, FloatArray]:
        """Every reaction of every component at the output times, by path."""
        return self.table([one.path for one in self.assembly.reactions])

    # -- keeping and showing --------------------------------------------------------------------------------------

    @takes(file=FILE, paths=PATHS)
    def save(self, file: str | os.PathLike[str], paths: Iterable[str] | None = None) -> Path:
        """Save trajectories as NetCDF-3 (``.nc``), NumPy (``.npz``) or ``.csv``; see `atwood.load_result`.

        Parameters
        ----------
        file
            Where to.
        paths
            Which quantities; all when not given.
        """
        from atwood.result.files import save_result

        return save_result(self, file, paths)

    def to_html(self, file: str | os.PathLike[str], **options: Any) -> Path:
        """Save a page on which the scene moves, and return its file; see `atwood.page`, also for the options."""
        made = import_module("atwood.plotting.pages.page").page(self, file, **options)
        return Path(made)

    def _about(self) -> Mapping[str, Any]:
        return {"scene": self.assembly.flat.name, "form": self.form, "level": self.level, "status": self.status}

    def _facts(self) -> Iterator[tuple[str, str]]:
        yield "Result", f"{self.assembly.flat.name}, {self.method}"
        yield "status", self.status.replace("_", " ") + (f": {self.message}" if self.message else "")
        if not self.run.segments:
            return
        yield "time", f"{self.time[0]:g} to {self.time[-1]:g} s, {count_of(len(self.time), 'output time')}"
        yield "solver", f"{self.solver} ({count_of(self.statistics.steps, 'step')})"
        yield "coordinates", listed(one.name for one in self.assembly.own_equations.names)
        if self.conserved is not None:
            yield "conserved", self.conserved.describe()
        if self.events:
            yield "events", listed((f"{one.message or one.part} at {one.time:.6g} s" for one in self.events), 4)
        if self.singular_crossings:
            yield "singular positions", listed((f"{one.time:.6g} s" for one in self.singular_crossings), 4)
