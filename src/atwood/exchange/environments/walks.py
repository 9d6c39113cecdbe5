"""A scene with events, states of its own or constraints that stay, under actions that are held for a period each.

Each motion is one run from its start to the end of its episode, which pauses after each period. An action feeds an
input, as the output of a computer does: it is a state that is held, so that nothing is compiled anew, and contacts and
one-sided constraints are settled where it changes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import StartError, UnsupportedError, UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import find_observables
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model, owner_of
from atwood.model.declare.component import Component
from atwood.model.declare.field_functions import discrete_state, parameter
from atwood.pipeline import assemble
from atwood.result.result import Result
from atwood.result.segment_quantities import quantities_at
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.events.sampling import Updated
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.recorder import Recorder
from atwood.simulation.run.run import Walk, begun
from atwood.simulation.run.run_record import Outcome


class Held(Component):
    """A number that is held until another one is given."""

    initial: float = parameter(0.0, unit="any", doc="The number before the first one is given.")
    value: float = discrete_state(lambda values, _: (values["initial"],), unit="any", doc="The number.")


@dataclass(frozen=True, eq=False)
class WalkedPlant:
    """What all motions of a scene under actions have in common; see `atwood.exchange.environments.plant.Plant`.

    Attributes
    ----------
    assembly
        The scene with what holds its actions.
    rtol
        Error allowed in a step of the solver.
    actions, bounds, starts, observations
        As of `Plant`.
    columns
        Where the actions are among the discrete states.
    """

    assembly: Assembly
    rtol: float
    actions: tuple[str, ...]
    columns: NDArray[np.intp]
    bounds: FloatArray
    starts: Mapping[str, Callable[[float], float]]
    observations: tuple[str, ...]

    def motions(self, count: int, period: float, limit: int) -> Walks:
        """Return motions of so many periods at most."""
        return Walks(self, count, period, limit)


def make_walked(assembly: Assembly, scene: Model, own: Mapping[str, float], reason: str, **common: Any) -> WalkedPlant:
    """Return a scene whose actions, with their own values, feed inputs; `reason` says why it is walked."""
    scene, names = scene.copy(), []
    for k, (path, value) in enumerate(own.items()):
        part, name = owner_of(scene, path)
        if name not in part.signal_specs():
            said = f"it is no input of a part, as actions are where {reason}"
            raise UnsupportedError(said, where=path, advice="Let an input act, such as the value of a Force.")
        names.append(next(one for one in (f"action_{k}{'_' * n}" for n in range(100)) if one not in scene))
        held = scene.add(names[-1], Held(initial=value))
        scene.connect(held.output("value"), part.input(name))
    given = {"form": assembly.form, "orientation": assembly.orientation.kind, "name": assembly.flat.name}
    made = assemble(scene, **given, **({"level": assembly.level} if assembly.level else {}))
    for one in find_observables(made, common["observations"]):
        if one.periodic:
            advice = "Observe its sine and cosine, or the angle of a joint."
            raise UnsupportedError("it counts turns, for which it has to be followed", where=one.path, advice=advice)
    held_paths = [one.path for one in made.discrete_states]
    columns = np.array([held_paths.index(f"{name}.value") for name in names], dtype=np.intp)
    return WalkedPlant(made, actions=tuple(own), columns=columns, **common)


class _Pause(Exception):
    """A run has come to where it pauses."""


class PausingWalk(Walk):
    """The way of a run that pauses at its output times, where numbers that are held are given anew."""

    passes_moments = False

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.until = np.inf
        self.sampler = self.sampler.with_stops(self.samples.times[self.samples.shown])

    def go_on(self, until: float, columns: NDArray[np.intp], values: FloatArray) -> bool:
        """Go on with other values of some discrete states; return whether the scene stopped before."""
        held = np.array(self.assembly.held_now)
        held[columns] = values
        del self.segments[:-1]
        self.until = until
        self.take(Updated(tuple(held.tolist()), self.q))
        try:
            status = self.go().status
        except _Pause:
            return False
        if status == "interrupted":
            raise KeyboardInterrupt
        return status == "stopped"

    def prepare(self) -> None:
        """Prepare the next stretch; time events and updates of this moment are made, and an action comes after them."""
        super().prepare()
        if self.t >= self.until:
            raise _Pause

    def _segment(self) -> tuple[Recorder, Outcome]:
        recorder, outcome = super()._segment()
        if not recorder.is_empty:  # where the run ends nothing else takes it up
            _, self.q, self.u, _ = recorder.last()
        return recorder, outcome


class Walks:
    """Some motions of a plant that are walked; see `atwood.exchange.environments.plant.Motions`.

    Parameters
    ----------
    plant
        What they have in common.
    count
        How many there are.
    period
        For how long actions are held, s.
    limit
        Of how many periods they are at most.
    """

    def __init__(self, plant: WalkedPlant, count: int, period: float, limit: int) -> None:
        self.plant, self.period = plant, period
        self.steps, self.stopped = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=bool)
        self._stops: FloatArray = plant.assembly.flat.t_start + period * np.arange(limit + 1.0)
        self._walks: list[PausingWalk | None] = [None] * count

    @property
    def time(self) -> FloatArray:
        """The time of each motion, s."""
        return np.array([self._stops[0] if walk is None else walk.t for walk in self._walks])

    @property
    def actions(self) -> FloatArray:
        """What is held in each motion, shape (motions, actions)."""
        return np.array([self._walk(k).assembly.held_now for k in range(len(self._walks))])[:, self.plant.columns]

    def _walk(self, which: int) -> PausingWalk:
        walk = self._walks[which]
        assert walk is not None
        return walk

    def begin(self, which: NDArray[np.intp], draw: list[Generator], given: Mapping[str, float]) -> None:
        """Begin some motions anew, each with a start of its own generator."""
        plant = self.plant
        options = RunOptions(float(self._stops[-1]), plant.rtol, outputs=self._stops, samples=1)
        for k, rng in zip(which.tolist(), draw, strict=True):
            values = {path: float(one(rng.random())) for path, one in plant.starts.items()} | dict(given)
            assembly = plant.assembly.with_values(start=values) if values else plant.assembly
            try:
                start = find_start(assembly)
            except StartError as error:
                where, said = assembly.flat.name, f"an episode cannot begin with {values}: {error.message}"
                raise StartError(said, where=where, advice=error.advice) from error
            self._walks[k] = begun(assembly, start, options, PausingWalk)
        self.steps[which], self.stopped[which] = 0, False

    def go_on(self, which: NDArray[np.intp], actions: FloatArray) -> None:
        """Go on with some motions for a period, with an action each."""
        for k, values in zip(which.tolist(), actions, strict=True):
            if self.stopped[k] or self.steps[k] + 1 == len(self._stops):
                raise UsageError("its episode is over", where="Environment.step", advice="Call reset first.")
            self.steps[k] += 1
            until = float(self._stops[self.steps[k]])
            self.stopped[k] = self._walk(k).go_on(until, self.plant.columns, values)

    def read(self, paths: tuple[str, ...]) -> FloatArray:
        """Return quantities of all motions, shape (quantities, motions)."""
        return np.stack([_read(self._walk(k), paths) for k in range(len(self._walks))], axis=1)

    def picture_run(self, which: int) -> Result:
        """Return a run that ends where a motion is now."""
        walk = self._walk(which)
        if not walk.segments:
            end = float(walk.t + 1e-3 * self.period)
            ahead = begun(walk.first, walk.start, RunOptions(end, self.plant.rtol, outputs=2), Walk)
            return Result(ahead.go())
        return Result(walk.run_so_far("finished", ""))


def _read(walk: Walk, paths: tuple[str, ...]) -> FloatArray:
    """Return quantities where a run is, shape (quantities,)."""
    assert walk.plan is not None
    assembly, finding = walk.plan.assembly, walk.plan.finding
    state = np.array([walk.t]), walk.q[:, None], walk.u[:, None]
    solver = partial(ReactionSolver, assembly, walk.t, walk.q, walk.u)
    accelerations = lambda: solver().own_accelerations(*state, finding)  # noqa: E731
    return np.asarray(quantities_at(assembly, paths, state, accelerations, lambda: solver().at(*state)[0])[:, 0])
