"""A scene under actions that are held for a period each: many motions of it, gone on with in one call of machine code.

What cannot be gone on with so is walked, motion by motion; see `atwood.exchange.environments.walks`.

It is made of what sweeps are made of: starts and tolerances are arrays over the motions, and one call takes all of them
a period further. An action is a parameter of the programs, so that nothing is compiled anew. Each motion takes the
steps that it takes alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from atwood.arguments import show
from atwood.arrays import FloatArray
from atwood.errors import ResultError, SolveError, StartError, UsageError, suggestion
from atwood.exchange.environments.walks import WalkedPlant, Walks, make_walked
from atwood.expr import depends_on
from atwood.forms.assembly import Assembly
from atwood.integrators.batch import Batch
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import owner_of
from atwood.pipeline import scene_of
from atwood.result.result import Result
from atwood.simulation.events.modes import find_event_functions
from atwood.simulation.initialization.start import Start, find_start
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.run import Walk, begun
from atwood.study.sweeps.batch import why_not_batched
from atwood.study.sweeps.batch_values import StartRows
from atwood.study.sweeps.cases import Axis, Cases, make_cases
from atwood.study.sweeps.designs import is_distribution
from atwood.study.sweeps.motions import Way, find_way, make_ready, open_places
from atwood.study.sweeps.readout import read_quantities
from atwood.study.sweeps.runs import SweepRequest, expand_paths


@dataclass(frozen=True, eq=False)
class Plant:
    """What is compiled once for all motions of a scene under actions.

    Attributes
    ----------
    request
        The scene and how each period is integrated, as a sweep has it.
    way
        How motions are made in machine code.
    actions
        Paths of the actions.
    columns
        Where they are among the parameters.
    own
        Values of the actions in the scene itself, which hold at the start of an episode.
    bounds
        Least and largest action, shape (2, actions).
    starts
        For each start value that is drawn, what gives it for a share between 0 and 1.
    places
        The session that takes the steps.
    follows_time
        Whether laws depend on the time itself, so that only motions at one time go together.
    """

    request: SweepRequest
    way: Way
    actions: tuple[str, ...]
    columns: NDArray[np.intp]
    own: FloatArray
    bounds: FloatArray
    starts: Mapping[str, Callable[[float], float]]
    places: Any
    follows_time: bool

    @property
    def observations(self) -> tuple[str, ...]:
        """Paths of what is observed."""
        return self.request.paths

    @property
    def assembly(self) -> Assembly:
        """The scene."""
        return self.request.assembly

    def motions(self, count: int, period: float, limit: int) -> Motions:
        """Return motions of so many periods at most."""
        return Motions(self, count, period)


def make_plant(
    assembly: Assembly,
    actions: Mapping[str, Any],
    observations: Any,
    starts: Mapping[str, Any],
    t_end: float,
    rtol: float,
) -> Plant | WalkedPlant:
    """Compile a scene for actions; what machine code cannot go on with many at a time is walked."""
    scene = scene_of(assembly)
    if not actions:
        advice = "Give paths of parameters with the least and the largest value: {'push.value': (-10.0, 10.0)}."
        raise UsageError("it has no actions", where="Environment", advice=advice)
    bounds = np.array([_bounds(scene, path, given) for path, given in actions.items()]).T
    own = {path: _number(scene, path) for path in actions}
    own = {path: value if math.isfinite(value) else 0.0 for path, value in own.items()}
    # Equations of a force of zero lack it: they are made for one that is not.
    nominal = {path: high or low for path, low, high in zip(actions, *bounds.tolist(), strict=True)}
    inverse = {path: _inverse(path, given) for path, given in starts.items()}
    medians = {path: [inverse[path](0.5)] for path in starts}
    if starts:
        make_cases(scene, None, medians, "list")  # which checks the paths
    first = assembly.with_values(nominal, start={path: one[0] for path, one in medians.items()})
    names = [one.name for one in first.parameters]
    for path in actions:
        if path not in names:
            advice = suggestion(path, names) or f"Those that do are {', '.join(names[:12])}."
            raise UsageError("it does not enter the equations as a number of its own", where=path, advice=advice)
    axes = [Axis(path, False, (value, value), np.array([value, value])) for path, value in nominal.items()]
    paths, options = expand_paths(first, observations), RunOptions(t_end, rtol)
    request = SweepRequest(first, Cases(tuple(axes), (2,)), paths, np.array([t_end]), False, options)
    find_start(first)  # which says why there is none
    reason = why_not_batched(request)
    if not reason and find_event_functions(first):
        reason = "something in it stops, sticks or changes its mode"
    way, reason = (None, reason) if reason else find_way(request)
    common = {"bounds": bounds, "starts": inverse, "observations": paths, "rtol": rtol}
    if way is None:
        return make_walked(assembly, scene, own, reason, **common)
    columns = np.array([names.index(path) for path in actions], dtype=np.intp)
    program = way.motion.program.program
    follows_time = depends_on(
        [one for group in program.outputs for one in group.expressions], program.inputs[0].symbols
    )
    places = open_places(way.motion, way.method, options, way.values)
    values = np.array(list(own.values()))
    return Plant(request, way, tuple(actions), columns, values, bounds, inverse, places, follows_time)


def _bounds(scene: Any, path: str, given: Any) -> tuple[float, float]:
    """Return the least and the largest value of an action, in SI units."""
    advice = "Give the least and the largest value, such as (-10.0, 10.0)."
    if not isinstance(given, (tuple, list)) or len(given) != 2:
        raise UsageError(f"{show(given)} is no range of an action", where=path, advice=advice)
    trial, found = scene.copy(), []
    for one in given:
        trial.set(path, one)
        found.append(_number(trial, path))
    low, high = found
    if not -math.inf < low < high < math.inf:
        raise UsageError(f"{show(given)} is no range of an action", where=path, advice=advice)
    return low, high


def _number(scene: Any, path: str) -> float:
    """Return the number that a parameter is; nan if it is none."""
    part, name = owner_of(scene, path)
    value = part._value(name)
    return float(value) if isinstance(value, (int, float)) else math.nan


def _inverse(path: str, given: Any) -> Callable[[float], float]:
    """Return what gives a start value for a share: of a distribution, or evenly between two numbers."""
    if is_distribution(given):
        found: Callable[[float], float] = given.ppf if hasattr(given, "ppf") else given.icdf
        return found
    is_pair = isinstance(given, (tuple, list)) and len(given) == 2
    if not is_pair or not all(isinstance(one, (int, float)) and math.isfinite(one) for one in given):
        advice = "Give a range such as (-0.05, 0.05), or a distribution of scipy.stats, in SI units."
        raise UsageError(f"{show(given)} is no range of a start value", where=path, advice=advice)
    low, high = given
    return lambda share: float(low + share * (high - low))


_SHARE = 1e-3
"""A picture is that of the beginning of a run, which takes so small a share of a period."""


class Motions:
    """Some motions of a plant, each at its own time.

    Parameters
    ----------
    plant
        What is compiled.
    count
        How many there are.
    period
        For how long actions are held, s.
    """

    def __init__(self, plant: Plant, count: int, period: float) -> None:
        self.plant, self.period = plant, period
        assembly = plant.request.assembly
        self.steps, self.stopped = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=bool)
        self.values = np.tile(plant.way.values, (count, 1))
        n = len(plant.way.motion.columns())
        self.state, self.tolerances = np.zeros((count, n)), np.ones((count, n))
        self._begin = assembly.flat.t_start

    @property
    def time(self) -> FloatArray:
        """The time of each motion, s."""
        return np.asarray(self._begin + self.period * self.steps, dtype=np.float64)

    @property
    def actions(self) -> FloatArray:
        """What is held in each motion, shape (motions, actions)."""
        return np.asarray(self.values[:, self.plant.columns])

    def begin(self, which: NDArray[np.intp], draw: list[Generator], given: Mapping[str, float]) -> None:
        """Begin some motions anew, each with a start of its own generator."""
        request = self.plant.request
        motion, assembly = self.plant.way.motion, request.assembly
        columns = {
            path: np.array([float(one(rng.random())) for rng in draw]) for path, one in self.plant.starts.items()
        }
        columns |= {path: np.full(len(which), value) for path, value in given.items()}
        rows = np.tile(assembly.parameter_values, (len(which), 1))
        rows[:, self.plant.columns] = self.plant.own
        if columns:
            axes = tuple(Axis(path, True, tuple(one.tolist()), one) for path, one in columns.items())
            own = SweepRequest(assembly, Cases(axes, (len(which),)), *_rest(request))
            q, u, lengths, found = StartRows(own).read(np.arange(len(which)), None)
        else:
            start = find_start(assembly)
            q, u = (np.tile(one, (len(which), 1)) for one in (start.coordinates, start.speeds))
            lengths, found = np.full(len(which), start.length), np.ones(len(which), dtype=bool)
        t = np.full(len(which), self._begin)
        state, values, _, tolerances, usable = make_ready(motion, t, q, u, rows, lengths, request.options)
        if not np.all(found & usable):
            drawn = {path: float(one[np.argmin(found & usable)]) for path, one in columns.items()}
            raise StartError(f"an episode cannot begin with {drawn}", where=assembly.flat.name)
        assert values is not None
        self.state[which], self.values[which], self.tolerances[which] = state, values, tolerances
        self.steps[which] = 0

    def go_on(self, which: NDArray[np.intp], actions: FloatArray) -> None:
        """Go on with some motions for a period, with an action each."""
        self.values[np.ix_(which, self.plant.columns)] = actions
        groups = [which]
        if self.plant.follows_time:
            groups = [which[self.steps[which] == one] for one in np.unique(self.steps[which])]
        for group in groups:
            t = float(self.time[group[0]]) if self.plant.follows_time and len(group) else self._begin
            given = self.state[group], self.tolerances[group], None, self.values[group]
            batch = Batch(self.plant.places, t, np.array([t + self.period]), *given)
            while not batch.advance():
                pass
            good = (batch.codes == 0) & np.all(np.isfinite(batch.values), axis=(1, 2))
            if not np.all(good):
                lane = int(group[np.argmin(good)])
                said = f"the motion could not go on from t = {self.time[lane]:g} s"
                raise SolveError(said, where=self.plant.request.assembly.flat.name, advice="End episodes before.")
            self.state[group] = batch.values[:, 0]
            self.steps[group] += 1

    def read(self, paths: tuple[str, ...]) -> FloatArray:
        """Return quantities of all motions, shape (quantities, motions)."""
        plant, t = self.plant, self.time
        q, u = plant.way.motion.states(t, self.state, self.values)
        numbers = np.arange(len(t))
        return read_quantities(plant.way.motion, paths, (t, q, u), self.values, numbers, lambda run: self.assembly(run))

    def picture_run(self, run: int) -> Result:
        """Return a run that begins where a motion is now."""
        t, state, values = self.time[run : run + 1], self.state[run : run + 1], self.values[run : run + 1]
        q, u = (one[:, 0] for one in self.plant.way.motion.states(t, state, values))
        assembly, start = self.assembly(run), Start(float(t[0]), q, u, 1.0, (), (), (), q)
        options = RunOptions(start.time + _SHARE * self.period, outputs=2)
        return Result(begun(assembly, start, options, Walk).go())

    def assembly(self, run: int) -> Assembly:
        """Return the scene with the actions of a motion."""
        actions = dict(zip(self.plant.actions, self.actions[run].tolist(), strict=True))
        return self.plant.assembly.with_values(actions)


def _rest(request: SweepRequest) -> tuple[Any, ...]:
    return request.paths, request.times, request.only_end, request.options


class Seen(Mapping[str, FloatArray]):
    """What rewards are made of: quantities by path, shape (motions,), read when they are asked for.

    Also the actions by their paths, and ``"time"``, s.

    Parameters
    ----------
    motions
        Of these.
    observed
        What was read already.
    """

    def __init__(self, motions: Motions | Walks, observed: Mapping[str, FloatArray]) -> None:
        self._motions, self._known = motions, dict(observed)
        plant = motions.plant
        self._known |= {"time": motions.time, **dict(zip(plant.actions, motions.actions.T, strict=True))}

    def __getitem__(self, path: str) -> FloatArray:
        if path not in self._known:
            known = self._motions.plant.assembly.observables
            if path not in known:
                raise ResultError("there is no such quantity", where=str(path), advice=suggestion(str(path), known))
            self._known[path] = self._motions.read((path,))[0]
        return self._known[path]

    def __iter__(self) -> Iterator[str]:
        yield from {**self._known, **self._motions.plant.assembly.observables}

    def __len__(self) -> int:
        return sum(1 for _ in self)
