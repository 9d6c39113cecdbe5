"""Parameters and starts of many runs as arrays."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError
from atwood.expr import Expression
from atwood.forms.assembly import Assembly
from atwood.forms.other_values import Slot, decisions_of, find_slots, starting
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.mechanism import extent, sizing_parameters
from atwood.model.compose.composite import Model
from atwood.model.declare.component import Component
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.model.local.flatten import flatten
from atwood.pipeline import scene_of
from atwood.simulation.dynamics.scales import TOO_LARGE, motion_scales, origin_part, size_of_way, way_of
from atwood.simulation.initialization.many import meet_positions, meet_speeds
from atwood.simulation.initialization.start import find_start
from atwood.simulation.initialization.system import Conditions, Level, sort_targets, start_conditions
from atwood.study.sweeps.cases import Axis
from atwood.study.sweeps.runs import SweepRequest


class ParameterRows:
    """The parameters of each run, in the order of the programs' parameters.

    Parameters
    ----------
    request
        What is to be run.
    """

    def __init__(self, request: SweepRequest) -> None:
        self._request = request
        assembly = request.assembly
        axes = [(k, axis) for k, axis in enumerate(request.cases.axes) if not axis.is_start]
        # Constants that the start gives are parameters, too.
        self.varies = bool(axes or assembly.mechanism.constants)
        self._lock = threading.Lock()
        if not self.varies:
            return
        self._scene = scene_of(assembly).copy()
        assert assembly.source is not None
        self._source = assembly.source
        numbers = {symbol.name: i for i, symbol in enumerate(assembly.parameters)}
        slots = [(slot, numbers.get(name)) for name, slot in find_slots(assembly.flat) if slot.part]
        # What follows from what is varied: arguments of the programs, and what must stay as it is.
        followers = {slot: number for slot, number in slots if _is_bound(self._scene, slot)}
        followed = {slot.part for slot in followers}
        self._direct: list[tuple[int, int]] = []
        self._through: list[tuple[int, Axis]] = []
        for k, axis in axes:
            own = {slot: number for slot, number in slots if f"{slot.part}.{slot.name}" == axis.path}
            numbers_of = [number for slot, number in own.items() if number is not None and slot.axis is None]
            if len(numbers_of) == 1 and not followed & {slot.part for slot in own}:
                self._direct.append((k, numbers_of[0]))
            else:
                self._through.append((k, axis))
                followers |= own
        self._followers = list(followers.items())
        mechanism = assembly.mechanism
        # Parts that check how their values go together are looked at run by run.
        varied = {slot.part for slot in followers} | {axis.path.rpartition(".")[0] for _, axis in axes}
        kinds = {type(part.component) for path, part in assembly.flat.parts.items() if path in varied}
        checks = any(kind.check_values is not Component.check_values for kind in kinds)
        closures = mechanism.bodies.closures
        is_plain = (
            not decisions_of(mechanism, assembly.shared) and not mechanism.constants and not closures and not checks
        )
        self._is_simple = is_plain and not self._builds()

    def _builds(self) -> bool:
        """Return whether some model makes its parts from its parameters."""
        return bool(self._through) and any(getattr(one, "_builds", lambda: False)() for one in _within(self._scene))

    def read(self, runs: NDArray[np.intp]) -> tuple[FloatArray | None, NDArray[np.bool_]]:
        """Return the parameters of runs, a row each (None if all are equal), and which runs keep the structure."""
        usable = np.ones(len(runs), dtype=bool)
        if not self.varies:
            return None, usable
        rows = np.tile(self._request.assembly.parameter_values, (len(runs), 1))
        if self._is_simple:
            for k, number in self._direct:
                rows[:, number] = self._request.cases.column(k)[runs]
                usable &= rows[:, number] != 0.0
            if self._through:
                with self._lock:
                    for place, run in enumerate(runs.tolist()):
                        usable[place] &= self._follow(run, rows[place])
            return rows, usable
        for place, run in enumerate(runs.tolist()):
            found = self._assembly(run)
            usable[place] = found is not None
            if found is not None:
                rows[place] = found.parameter_values
        return rows, usable

    def _follow(self, run: int, row: FloatArray) -> bool:
        """Write what follows from the parameters of models; return whether the structure stays."""
        cases, scene = self._request.cases, self._scene
        for k, axis in self._through:
            try:
                scene.set(axis.path, axis.given[cases.places[k][run]])
            except AtwoodError:
                return False
        try:
            return all(self._take(slot, number, row) for slot, number in self._followers) and self._settings(row)
        except AtwoodError:
            return False

    def _take(self, slot: Slot, number: int | None, row: FloatArray) -> bool:
        value = self._scene[slot.part]._value(slot.name)
        value = value if slot.axis is None or value is None else value[slot.axis]
        if number is None:
            before = slot.read(self._request.assembly.flat)
            return value is before or (type(value) is type(before) and bool(value == before))
        if not isinstance(value, (int, float)) or value == 0.0:
            return False
        row[number] = value
        return True

    def _settings(self, row: FloatArray) -> bool:
        """Take up the scene's own gravity; its other settings must stay."""
        flat, scene = self._request.assembly.flat, self._scene
        names = [symbol.name for symbol in self._request.assembly.parameters]
        now = getattr(scene, "gravity", flat.gravity)
        if "gravity" in names and now != 0.0:
            row[names.index("gravity")] = now
        elif now != flat.gravity:
            return False
        before = flat.space.name, flat.t_start
        return (getattr(scene, "space", before[0]), getattr(scene, "t_start", before[1])) == before

    def _assembly(self, run: int) -> Assembly | None:
        cases, assembly = self._request.cases, self._request.assembly
        try:
            flat = flatten(self._source.changed(*cases.of(run), {}), assembly.flat.name)
            return assembly.follow(flat, self._source)[0]
        except AtwoodError:
            return None

    def assembly(self, run: int) -> Assembly:
        """Return the assembly of one run, whose structure is that of all."""
        found = self._assembly(run)
        return found if found is not None else self._request.assembly


def _within(component: Component) -> Iterator[Component]:
    """Yield a component and all that are in it."""
    yield component
    for one in component._children().values():
        yield from _within(one)


def _is_bound(scene: object, slot: Slot) -> bool:
    """Return whether a number follows from parameters of a model around its part."""
    part = scene[slot.part]  # type: ignore[index]
    return isinstance(part._settings.get(slot.name, part._field(slot.name).default), ParameterExpression)


class StartRows:
    """The start of each run in generalized coordinates.

    Parameters
    ----------
    request
        What is to be run.
    """

    def __init__(self, request: SweepRequest) -> None:
        self._request = request
        assembly = request.assembly
        equations = assembly.reduced
        columns = {axis.path: request.cases.column(k) for k, axis in enumerate(request.cases.axes) if axis.is_start}
        self._columns = columns
        positions, speeds = sort_targets(assembly, equations)
        self._positions = self._start_values(positions, equations.coordinates)
        self._speeds = self._start_values(speeds, equations.speeds)
        fixed = [one.observable.value for one in positions.fixed]
        is_simple = len(self._positions) == len(positions.fixed) + len(positions.guessed) and len(set(fixed)) == len(
            fixed
        )
        # Guesses of other speeds than the coordinates' own, and orientations in space, are for one run at a time.
        is_simple = (
            is_simple
            and not speeds.guessed
            and not equations.orientation_coordinates
            and starting(assembly) is assembly
            and not (assembly.mechanism.table.origin and any(not axis.is_start for axis in request.cases.axes))
            and not (equations.constraints and assembly.mechanism.space.is_spatial)  # turns, and ways to assemble it
        )
        self.is_direct = is_simple and not self._start_is_bound()
        self._conditions: tuple[_Conditions, _Conditions | None] | None = None
        if self.is_direct:
            has_loops = bool(equations.constraints)
            places = self._conditions_of(equations, positions, False) if has_loops else None
            self._conditions = self._conditions_of(equations, speeds, True), places
        observables = assembly.start_observables
        self._lengths, self._fast = (
            [
                columns.get(path, value) - origin_part(assembly, observables[path])
                for path, value in assembly.flat.start.items()
                if observables[path].unit == unit
            ]
            for unit in ("m", "m/s")
        )

    def _conditions_of(self, equations: Equations, level: Level, of_speeds: bool) -> _Conditions:
        """Return the conditions on places or on speeds, and what each is to be."""
        made = start_conditions(self._request.assembly, equations, level.fixed, True, of_speeds)
        held: list[FloatArray | float] = [0.0] * (made.shape[0] - len(level.fixed))
        return _Conditions(made, (*held, *(self._columns.get(one.path, one.value) for one in level.fixed)))

    def _start_values(self, level: Level, unknowns: Sequence[Expression]) -> list[tuple[int, FloatArray | float]]:
        """Return what is said of unknowns themselves: their numbers and values."""
        found: list[tuple[int, FloatArray | float]] = []
        for is_fixed, targets in ((False, level.guessed), (True, level.fixed)):
            for one in targets:
                if one.observable.value in unknowns:
                    value = self._columns.get(one.path, one.value) if is_fixed else one.value
                    found.append((unknowns.index(one.observable.value), value))
        return found

    def _start_is_bound(self) -> bool:
        """Return whether a start value follows from a parameter that is varied."""
        if all(axis.is_start for axis in self._request.cases.axes):
            return False
        models = [one for one in _within(scene_of(self._request.assembly)) if isinstance(one, Model)]
        values = [value for one in models for own in one._start_values().values() for value in own.values()]
        return any(isinstance(value, ParameterExpression) for value in values)

    def read(
        self, runs: NDArray[np.intp], parameters: FloatArray | None
    ) -> tuple[FloatArray, FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return coordinates, speeds and extents of runs, one row each, and which of them could be found."""
        assembly = self._request.assembly
        q, u = (np.zeros((len(runs), len(s))) for s in (assembly.reduced.coordinates, assembly.reduced.speeds))
        lengths = self._extents(runs, parameters)
        if self._conditions is not None:
            for rows, said in ((q, self._positions), (u, self._speeds)):
                for place, given in said:
                    rows[:, place] = _of(given, runs)
            values = assembly.parameter_values if parameters is None else parameters.T
            sizes = motion_scales(assembly.reduced, lengths)
            of_speeds, of_places = self._conditions
            t, met = assembly.flat.t_start, np.ones(len(runs), dtype=bool)
            if of_places is not None:
                met = meet_positions(assembly, of_places.conditions, values, t, q, sizes, of_places.rows(runs))
            met &= meet_speeds(assembly, of_speeds.conditions, values, t, q, u, sizes, of_speeds.rows(runs))
            return q, u, lengths, met
        found = np.ones(len(runs), dtype=bool)
        for place, run in enumerate(runs.tolist()):
            try:
                start = find_start(self.assembly(run))
            except AtwoodError:
                found[place] = False
                continue
            if (len(start.coordinates), len(start.speeds)) != (q.shape[1], u.shape[1]):
                found[place] = False  # of another structure
                continue
            q[place], u[place], lengths[place] = start.coordinates, start.speeds, start.length
        return q, u, lengths, found

    def assembly(self, run: int) -> Assembly:
        """Return the assembly of a run."""
        request, assembly = self._request, self._request.assembly
        if assembly.mechanism.constants or any(not axis.is_start for axis in request.cases.axes):
            return assembly.with_values(request.cases.of(run)[0], start=request.cases.of(run)[1])
        start = {path: float(column[run]) for path, column in self._columns.items()}
        return replace(assembly, flat=replace(assembly.flat, start={**assembly.flat.start, **start}))

    def _extents(self, runs: NDArray[np.intp], parameters: FloatArray | None) -> FloatArray:
        """Return the extent of the scene for each run, as `scene_length` has it."""
        fastest = np.zeros(len(runs))
        for given in self._fast:
            fastest = np.maximum(fastest, np.abs(_of(given, runs)))
        lengths = self._own_lengths(runs, parameters)
        return np.where(lengths > 0.0, lengths, size_of_way(way_of(self._request.assembly, fastest)))

    def _own_lengths(self, runs: NDArray[np.intp], parameters: FloatArray | None) -> FloatArray:
        """Return what parameters and start values that are lengths say of it, as `own_length` has it."""
        assembly = self._request.assembly
        lengths = np.full(len(runs), extent(assembly.mechanism))
        if parameters is not None:
            lengths = _moving_lengths(assembly, parameters)
        for given in self._lengths:
            lengths = np.maximum(lengths, np.abs(_of(given, runs)))
        return lengths

    def are_right(
        self, runs: NDArray[np.intp], parameters: FloatArray | None, moved: Callable[[], FloatArray]
    ) -> NDArray[np.bool_]:
        """Return which runs have had the right size by how far their lengths changed, m; see `smaller_size`."""
        right = self._own_lengths(runs, parameters) > 0.0
        if not np.all(right):
            share = moved() / self._extents(runs, parameters)
            right |= (share == 0.0) | (share >= TOO_LARGE)
        return right


def read_starts(
    starts: StartRows, rows: ParameterRows, runs: NDArray[np.intp]
) -> tuple[NDArray[np.intp], tuple[FloatArray, FloatArray], FloatArray, FloatArray | None]:
    """Return the runs whose structure and start could be found, and of these states, extents and parameters."""
    parameters, usable = rows.read(runs)
    q, u, lengths, found = starts.read(runs, parameters)
    usable &= found & np.all(np.isfinite(q), axis=1) & np.all(np.isfinite(u), axis=1)
    kept = None if parameters is None else parameters[usable]
    return runs[usable], (q[usable], u[usable]), lengths[usable], kept


@dataclass(frozen=True, eq=False)
class _Conditions:
    """Conditions of a start, and what each is to be: constraints zero."""

    conditions: Conditions
    wanted: tuple[FloatArray | float, ...]

    def rows(self, runs: NDArray[np.intp]) -> FloatArray:
        """Return what each condition is to be in some runs, shape (conditions, runs)."""
        return np.array([np.broadcast_to(_of(one, runs), len(runs)) for one in self.wanted])


def _of(given: FloatArray | float, runs: NDArray[np.intp]) -> FloatArray | float:
    return given[runs] if isinstance(given, np.ndarray) else given


def _moving_lengths(assembly: Assembly, parameters: FloatArray) -> FloatArray:
    """Return the largest length among the parameters of what moves, for each row of parameters; see `extent`."""
    numbers = {symbol.name: i for i, symbol in enumerate(assembly.parameters)}
    counted = {(path, name): unsaid for path, name, unsaid in sizing_parameters(assembly.mechanism)}
    squares: dict[tuple[str, str], FloatArray] = {}
    for name, slot in find_slots(assembly.flat):
        key = slot.part, slot.name
        if key not in counted:
            continue
        value = parameters[:, numbers[name]] if name in numbers else np.float64(slot.read(assembly.flat))
        said = np.where(value == counted[key], 0.0, value)
        squares[key] = squares.get(key, np.zeros(len(parameters))) + said**2
    return np.sqrt(np.max(list(squares.values()), axis=0)) if squares else np.zeros(len(parameters))
