"""A scene as an environment of gymnasium, and as a vector of them (M. Towers et al., arXiv 2407.17032, 2024)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arguments import BY_PATH, CALLBACK, PATHS, check, number, one_of, optional, takes, whole
from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.exchange.environments.plant import Motions, Plant, Seen, make_plant
from atwood.exchange.environments.walks import WalkedPlant, Walks
from atwood.forms.assembly import Assembly
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assembly_of
from atwood.simulation.problem.arguments import RTOL, T_END
from atwood.tolerances import tolerances

try:
    import gymnasium
    from gymnasium.vector import VectorEnv
    from gymnasium.vector.utils import batch_space

    _Env: Any = gymnasium.Env
    _VectorEnv: Any = VectorEnv
except ImportError:  # said when an environment is made
    gymnasium = None
    _Env = _VectorEnv = object

_PERIOD = number("a time above zero, s", above=0.0)
_MODE = optional(one_of(("rgb_array",)))
_COUNT = whole("a whole number of environments, at least 1", 1)


class Environment(_Env):  # type: ignore[misc]
    """A scene as an environment of gymnasium: actions are held for a period, and then it is observed.

    Parameters
    ----------
    scene
        The scene, or an assembly of it in either form. Many motions of a smooth one in the reduced form go on
        together in machine code. What has events, states of its own, or constraints that no formula solves is
        simulated one motion after the other.
    actions
        Parameters that are set at each step, by path, with the least and the largest value:
        ``{"push.value": (-10.0, 10.0)}``. Where motions are simulated one after the other they must be inputs, which
        nothing else feeds. Before the first step they have the scene's own values.
    observations
        Paths of quantities; the coordinates and speeds of joints, forces and whatever else the scene has.
    reward
        A function of what is seen after the step: a mapping of quantities by path, with the actions by theirs and
        ``"time"``. Each is an array over the environments, so that it is written in arrays; it returns one, too.
    period
        For how long an action is held, s.
    terminated
        A function as `reward`, True where an episode is over; where an event of the scene ends its run, it is over
        in any case.
    start
        Start values by path: a range ``(low, high)`` or a distribution of `scipy.stats`, in SI units, drawn for each
        episode. The scene's own otherwise; ``reset(options={"start": {path: value}})`` gives one.
    t_end
        When an episode is truncated, s; the scene's own end when not given.
    rtol
        Error allowed in a step of the solver.
    render_mode
        ``"rgb_array"`` for pictures.

    Raises
    ------
    AtwoodError
        If gymnasium is not installed (``pip install 'atwood[gym]'``), a path is none, or an action cannot be one.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012  # as gymnasium has it

    @takes(
        scene=SCENE,
        actions=BY_PATH,
        observations=PATHS,
        reward=CALLBACK,
        period=_PERIOD,
        terminated=optional(CALLBACK),
        start=optional(BY_PATH),
        t_end=T_END,
        rtol=RTOL,
        render_mode=_MODE,
    )
    def __init__(
        self,
        scene: Model | Assembly,
        *,
        actions: Mapping[str, Any],
        observations: Iterable[str],
        reward: Callable[[Mapping[str, FloatArray]], Any],
        period: float,
        terminated: Callable[[Mapping[str, FloatArray]], Any] | None = None,
        start: Mapping[str, Any] | None = None,
        t_end: float | None = None,
        rtol: float = tolerances.RTOL,
        render_mode: str | None = None,
    ) -> None:
        if gymnasium is None:
            raise UsageError("gymnasium is not installed", where="Environment", advice="pip install 'atwood[gym]'")
        assembly = assembly_of(scene)
        begin, end = assembly.flat.t_start, assembly.flat.t_end if t_end is None else float(t_end)
        if not period <= (end - begin) * (1.0 + 1e-9):
            raise UsageError(f"an episode of {end - begin:g} s ends before the first period", where="Environment")
        self.period, self.limit = period, math.ceil((end - begin) / period * (1.0 - 1e-9))
        self.plant = make_plant(assembly, actions, observations, start or {}, end, rtol)
        self.reward, self.is_over = reward, terminated
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": max(1, round(1.0 / period))}
        low, high = self.plant.bounds
        self.action_space = gymnasium.spaces.Box(low, high, dtype=np.float64)
        shape = (len(self.plant.observations),)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, shape, dtype=np.float64)
        self._motions = self.plant.motions(1, period, self.limit)
        self._begun = False

    def vector(self, count: int) -> Any:
        """Return a vector of such environments; smooth ones go on together in one call of machine code.

        Parameters
        ----------
        count
            How many.

        Returns
        -------
        gymnasium.vector.VectorEnv
            With the seed s its environment k has the episodes of this one with the seed s + k. What is over begins
            anew in the step after, as gymnasium's usual mode (``NEXT_STEP``) has it.
        """
        return VectorEnvironment(self, check(_COUNT, count, "count", "Environment.vector"))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin an episode; return what is observed, and nothing more.

        Parameters
        ----------
        seed
            Of its start: the same seed gives the same episode.
        options
            ``{"start": {path: value}}`` gives start values, in SI units.
        """
        super().reset(seed=seed)
        self._motions.begin(np.array([0]), [self.np_random], _given(self.plant, options))
        self._begun = True
        return self._motions.read(self.plant.observations)[:, 0], {}

    def step(self, action: Any) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Hold an action for a period; return observation, reward, whether it is over or truncated, and nothing more.

        Parameters
        ----------
        action
            Values in SI units, shape (actions,), within their bounds.
        """
        if not self._begun:
            raise UsageError("it has not begun", where="Environment.step", advice="Call reset first.")
        which = np.array([0])
        seen, rewards, over, late = _stepped(self, self._motions, which, _actions(self.plant, action, (1,)))
        return seen[0], float(rewards[0]), bool(over[0]), bool(late[0]), {}

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture of the scene as it is now, shape (height, width, 3)."""
        return None if self.render_mode is None else _picture_of(self._motions, 0)


class VectorEnvironment(_VectorEnv):  # type: ignore[misc]
    """Environments of one scene that go on together; see `Environment.vector`."""

    def __init__(self, one: Environment, count: int) -> None:
        self.one, self.num_envs, self.spec = one, count, None
        self.render_mode = one.render_mode
        self.metadata = dict(one.metadata)
        if hasattr(gymnasium.vector, "AutoresetMode"):
            self.metadata["autoreset_mode"] = gymnasium.vector.AutoresetMode.NEXT_STEP
        self.single_action_space, self.single_observation_space = one.action_space, one.observation_space
        self.action_space = batch_space(one.action_space, count)
        self.observation_space = batch_space(one.observation_space, count)
        self._motions = one.plant.motions(count, one.period, one.limit)
        self._draw = [np.random.default_rng() for _ in range(count)]
        self._over = np.ones(count, dtype=bool)
        self._begun = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin all episodes; see `Environment.reset`. A seed s gives s, s + 1 and so on."""
        seeds = (
            [None if seed is None else seed + k for k in range(self.num_envs)]
            if not isinstance(seed, Sequence)
            else seed
        )
        if len(seeds) != self.num_envs:
            raise UsageError(
                f"{len(seeds)} seeds are not one for each of {self.num_envs}", where="VectorEnvironment.reset"
            )
        for k, own in enumerate(seeds):
            if own is not None or not self._begun:
                self._draw[k] = gymnasium.utils.seeding.np_random(own)[0]
        self._motions.begin(np.arange(self.num_envs), self._draw, _given(self.one.plant, options))
        self._over[:], self._begun = False, True
        return self._motions.read(self.one.plant.observations).T, {}

    def step(self, actions: Any) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Hold an action each for a period; where an episode was over another one begins instead."""
        if not self._begun:
            raise UsageError("it has not begun", where="VectorEnvironment.step", advice="Call reset first.")
        held = _actions(self.one.plant, actions, (self.num_envs,))
        again, going = np.flatnonzero(self._over), np.flatnonzero(~self._over)
        if len(again):
            self._motions.begin(again, [self._draw[k] for k in again], {})
        seen, rewards, over, late = _stepped(self.one, self._motions, going, held[going])
        rewards[again], over[again], late[again] = 0.0, False, False
        self._over = over | late
        return seen, rewards, over, late, {}

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return a picture of each."""
        if self.render_mode is None:
            return None
        return tuple(_picture_of(self._motions, k) for k in range(self.num_envs))


def _picture_of(motions: Motions | Walks, which: int) -> NDArray[np.uint8]:
    """Return a picture of a motion as it is now, shape (height, width, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from atwood.plotting.drawing import plot_mechanism

    result, t = motions.picture_run(which), float(motions.time[which])
    canvas: Any = FigureCanvasAgg(plot_mechanism(result, times=[t]))
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def _given(plant: Plant | WalkedPlant, options: Mapping[str, Any] | None) -> dict[str, float]:
    """Return the start values of the options of a reset."""
    unknown = sorted(set(options or {}) - {"start"})
    given = (options or {}).get("start", {})
    if unknown or not isinstance(given, Mapping):
        advice = "Give options={'start': {path: value}}."
        raise UsageError(f"a reset has no options {unknown or given!r}", where="Environment.reset", advice=advice)
    known = plant.assembly.start_observables
    for path, value in given.items():
        if path not in known or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise UsageError(f"{value!r} is no start value, or there is none of this path", where=str(path))
    return {path: float(value) for path, value in given.items()}


def _actions(plant: Plant | WalkedPlant, given: Any, lanes: tuple[int]) -> FloatArray:
    """Return actions, shape (lanes, actions), within their bounds."""
    low, high = plant.bounds
    try:
        found = np.asarray(given, dtype=float).reshape(*lanes, len(low))
    except (TypeError, ValueError):
        advice = f"Give an array of {len(low)} numbers for each."
        raise UsageError("this is no action", where="Environment.step", advice=advice) from None
    room = 1e-6 * (high - low)  # what has been through single precision
    if not np.all((found >= low - room) & (found <= high + room)):
        bounds = ", ".join(f"{path}: {a:g} to {b:g}" for path, a, b in zip(plant.actions, low, high, strict=True))
        raise UsageError(f"an action is beyond its bounds ({bounds})", where="Environment.step", advice="Clip it.")
    return np.asarray(np.clip(found, low, high))


def _stepped(
    environment: Environment, motions: Motions | Walks, which: NDArray[np.intp], actions: FloatArray
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], NDArray[np.bool_]]:
    """Go on with some motions; return of all observations (a row each), rewards, and which are over or truncated."""
    if len(which):
        motions.go_on(which, actions)
    observed = motions.read(environment.plant.observations)
    seen = Seen(motions, dict(zip(environment.plant.observations, observed, strict=True)))
    count = len(motions.steps)
    rewards = _each(environment.reward(seen), count, "reward").astype(float)
    if not np.all(np.isfinite(rewards[which])):
        raise UsageError("a reward is no finite number", where="reward", advice="Look at what it is made of.")
    over = motions.stopped.copy()
    if environment.is_over is not None:
        over |= _each(environment.is_over(seen), count, "terminated").astype(bool)
    return np.ascontiguousarray(observed.T), rewards, over, motions.steps >= environment.limit


def _each(given: Any, count: int, name: str) -> NDArray[Any]:
    """Return a number for each environment."""
    found = np.asarray(given)
    if found.dtype.kind not in "biuf" or found.shape not in ((), (1,), (count,)):
        advice = f"Return an array of one dimension with a number for each environment, of {count} here."
        raise UsageError(f"it returned {found.dtype} of shape {found.shape}", where=name, advice=advice)
    return np.broadcast_to(found, (count,)).copy()
