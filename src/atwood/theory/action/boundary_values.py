"""`boundary_value_motions`: the motions of a scene that join two places in a given time, found by shooting."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from atwood.arguments import BY_PATH, command, optional, takes
from atwood.arrays import FloatArray
from atwood.display import count_of
from atwood.errors import AtwoodError, SolveError, StartError, UnsupportedError, UsageError, check_known
from atwood.forms.assembly import Assembly
from atwood.forms.program import rates_are_speeds
from atwood.integrators.methods import EXPLICIT, Task
from atwood.integrators.protocol import SolverOptions, Status
from atwood.lazy_dataclasses import dataclass, replace
from atwood.lazy_modules import scipy
from atwood.model.compose.composite import Model
from atwood.model.values.units import parse_quantity, parse_unit
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.result.result import Result
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.arguments import T_END, check_span
from atwood.simulation.problem.explicit_scene import explicit_problem
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.problem.preparation import make_problem
from atwood.simulation.run.run import run
from atwood.theory.action.integral import Action, action_of_run

_GRID, _TRIES = 401, 40
"""So many velocities are tried for one coordinate, and so many begins of Newton's method for several."""

_FASTEST = 6.0
"""Velocities are sought up to so many times what is typical of the scene and of the ends."""

_JOINED = 1e-9
"""Of the scene's sizes: what ends so near has joined its ends; solutions that differ by less are one."""

_TIMES, _CONJUGATE = 400, 1e-6
"""Times at which neighbours are looked at, and the share of their largest spread that is none."""


@dataclass(frozen=True, eq=False)
class JoiningMotion:
    """A motion that joins two places in a given time.

    Attributes
    ----------
    velocities
        At the start, by the path of the coordinate.
    result
        The motion.
    action
        Its action: Hamilton's principal function of these ends, for this motion.
    conjugate_times
        When neighbours that started from the same place meet it again, up to the end, s: the start's conjugate points.
        Where there is none before the end, S is a minimum among paths with these ends; each more is a direction in
        which it is not (Morse). Those of even multiplicity are not seen.
    ends_are_conjugate
        Whether the end is such a point itself, so that other motions all but join the same ends.
    """

    velocities: Mapping[str, float]
    result: Result
    action: Action
    conjugate_times: tuple[float, ...]
    ends_are_conjugate: bool

    @property
    def is_minimum(self) -> bool:
        """Whether its action is a minimum among neighbouring paths."""
        return not self.conjugate_times and not self.ends_are_conjugate

    def __repr__(self) -> str:
        speeds = ", ".join(f"{path}' = {value:.6g}" for path, value in self.velocities.items())
        points = count_of(len(self.conjugate_times), "conjugate point")
        return f"<JoiningMotion: {speeds}; S = {self.action.value:.9g} J s, {points}>"


@command("motions")
@takes(scene=SCENE, end=BY_PATH, t_end=T_END, start=optional(BY_PATH))
def boundary_value_motions(
    scene: Model | Assembly,
    end: Mapping[str, Any],
    *,
    t_end: float | str | None = None,
    start: Mapping[str, Any] | None = None,
) -> tuple[JoiningMotion, ...]:
    """Return the motions that lead from one place to another in a given time: Hamilton's boundary value problem.

    For one coordinate all velocities up to several times what is typical of the scene are looked through; for more,
    Newton's method begins at a straight line and at velocities chosen at random, the same each time, so that there may
    be motions that it does not find.

    Parameters
    ----------
    scene
        The scene, whose coordinates are free.
    end
        Where it ends: each coordinate by its path, in SI units or as text with a unit. Angles count their turns.
    t_end
        When, s; the scene's own end if not given.
    start
        Where it starts, for coordinates that are not to be where the scene has them.

    Returns
    -------
    tuple of JoiningMotion
        In the order of their actions.

    Raises
    ------
    SolveError
        If no motion was found that joins the ends.
    UsageError
        If a coordinate of the end is missing, or unknown.
    UnsupportedError
        If the coordinates are tied by constraints, or the equations switch on the way.
    """
    assembly = smooth_assembly_of(scene)
    refuse_tied(assembly)
    begun = find_start(assembly)
    last = assembly.flat.t_end if t_end is None else float(t_end)
    check_span(begun.time, last)
    names = assembly.own_equations.names
    place = _read(start or {}, names, begun.coordinates, assembly.flat.name)
    target = _read(end, names, place, assembly.flat.name)
    missing = [one.name for one in names if one.name not in end]
    if missing:
        advice = "Give the end of each coordinate."
        raise UsageError(f"the end leaves out {', '.join(missing)}", where=assembly.flat.name, advice=advice)
    shooter = Shooter(assembly, place, begun.length, begun.time, last)
    found = _joining(shooter, target, assembly.flat.name)
    made = []
    for velocity in found:
        options = RunOptions(t_end=last, relative_tolerance=1e-12)
        there = replace(begun, coordinates=place, speeds=velocity)
        whole = run(assembly, there, options, assembly.other_mode)
        times, at_end = _conjugate_times(shooter, velocity)
        velocities = dict(zip(shooter.names, velocity.tolist(), strict=True))
        made.append(JoiningMotion(velocities, Result(whole), action_of_run(whole), times, at_end))
    return tuple(sorted(made, key=lambda one: one.action.value))


def _read(given: Mapping[str, Any], names: Sequence[Any], values: FloatArray, where: str) -> FloatArray:
    """Return coordinates, of which some are given."""
    found = np.array(values, dtype=float)
    known = {one.name: (k, one.unit) for k, one in enumerate(names)}
    for path, value in given.items():
        check_known(path, known, f"{path!r} is no coordinate of it", where=where)
        number, unit = known[path]
        try:
            found[number] = parse_quantity(value, parse_unit(unit), path) if isinstance(value, str) else float(value)
        except (TypeError, ValueError):
            raise UsageError(f"{value!r} is no number", where=path) from None
    if not np.all(np.isfinite(found)):
        raise UsageError("its ends are not all finite numbers", where=where)
    return found


def _joining(shooter: Shooter, target: FloatArray, name: str) -> list[FloatArray]:
    """Return the velocities with which motions reach a place at the end."""
    span, apart = shooter.end - shooter.begin, np.abs(target - shooter.place)
    fastest = _FASTEST * (shooter.sizes / shooter.time + np.maximum(apart, shooter.sizes) / span)
    misses: list[float] = []

    def miss(velocity: FloatArray) -> FloatArray:
        found = (shooter.arrival(velocity) - target) / shooter.sizes
        if np.all(np.isfinite(found)):
            misses.append(float(np.max(np.abs(found))))
        return found

    found: list[FloatArray] = []
    tried = _brackets(miss, float(fastest[0])) if shooter.size == 1 else _guesses(miss, target, shooter, fastest)
    for velocity in tried:
        near = miss(velocity)
        if not np.max(np.abs(near)) < _JOINED:
            continue
        if all(np.max(np.abs(velocity - other) / fastest) > _JOINED for other in found):
            found.append(velocity)
    if found:
        return found
    if misses and max(misses) < _JOINED:
        raise SolveError(
            "every motion from the start joins these ends: they are conjugate points",
            where=name,
            advice="Give another time, for which there are single motions.",
        )
    nearest = f"the nearest misses by {min(misses):.3g} of the scene's size" if misses else "none comes to the end"
    raise SolveError(
        f"no motion was found that joins these ends in {span:g} s: of {len(misses)} that were tried {nearest}",
        where=name,
        advice="Give other ends or another time; ends that are conjugate points are joined by none, or by very many.",
    )


def _brackets(miss: Any, fastest: float) -> Iterator[FloatArray]:
    """Yield the zeros of what is missed by one coordinate, between velocities at which it changes its sign."""
    # Closer together where velocities are small, and the same for motions there and back.
    grid = fastest * np.sinh(np.linspace(-4.0, 4.0, _GRID)) / np.sinh(4.0)
    values = np.array([miss(np.array([one]))[0] for one in grid])
    for k in np.flatnonzero(np.abs(values) < _JOINED**1.5):
        if not np.all(np.abs(values) < _JOINED):
            yield grid[k : k + 1]
    for k in np.flatnonzero(np.sign(values[1:]) * np.sign(values[:-1]) < 0.0):
        if np.all(np.abs(values) < _JOINED):
            return
        root = scipy.optimize.brentq(
            lambda v: miss(np.array([v]))[0], grid[k], grid[k + 1], xtol=1e-15 * fastest, rtol=4e-16 * 4
        )
        yield np.array([root])


def _guesses(miss: Any, target: FloatArray, shooter: Shooter, fastest: FloatArray) -> Iterator[FloatArray]:
    """Yield where Newton's method ends from many velocities."""
    random = np.random.default_rng(7)
    straight = (target - shooter.place) / (shooter.end - shooter.begin)
    begins = [straight, *(0.5 * fastest * random.uniform(-1.0, 1.0, (_TRIES, shooter.size)) ** 3 + straight)]
    for begin in begins:

        def scaled(x: FloatArray) -> FloatArray:
            found = miss(x * fastest)
            return np.where(np.all(np.isfinite(found)), found, 1e3)

        try:
            ended = scipy.optimize.root(scaled, begin / fastest, method="hybr", options={"xtol": 1e-14})
        except (AtwoodError, ArithmeticError):
            continue
        yield ended.x * fastest


def _conjugate_times(shooter: Shooter, velocity: FloatArray) -> tuple[tuple[float, ...], bool]:
    """Return when neighbours from the same place come together again, and whether they do at the end."""
    span = shooter.end - shooter.begin
    times = shooter.begin + span * np.arange(1, _TIMES + 1) / _TIMES
    spread = np.linalg.det(shooter.fields(velocity, times) / (times - shooter.begin)[:, None, None])
    if not np.all(np.isfinite(spread)):
        return (), False
    found = scipy.interpolate.CubicSpline(times, spread).roots(extrapolate=False)
    at_end = abs(spread[-1]) < _CONJUGATE * float(np.max(np.abs(spread)))
    inside = [float(t) for t in found if not (at_end and t > shooter.end - 2.0 * span / _TIMES)]
    return tuple(inside), bool(at_end)


_RELATIVE, _ABSOLUTE = 1e-12, 1e-13
"""Of the explicit method, the second as a share of the scene's sizes."""

_DIFFERENCE = 1e-5
"""Of the size of a velocity: with steps of the method as accurate as above, derivatives err by some 1e-8."""


def refuse_tied(assembly: Assembly) -> None:
    """Refuse a scene whose ends are not those of free coordinates, or whose equations switch."""
    name, equations = assembly.flat.name, assembly.own_equations
    if assembly.form == "dae" or equations.constraints or not rates_are_speeds(equations):
        raise UnsupportedError(
            "its ends are not those of free coordinates: closed loops, rolling, or bodies in space",
            where=name,
            advice="Describe it by as many coordinates as it has degrees of freedom.",
        )
    if assembly.modes or assembly.relations or equations.states:
        raise UnsupportedError(
            "its equations change on the way, by modes or by the clock, or parts have states of their own",
            where=name,
            advice="Take the scene without the parts that switch.",
        )


class Shooter:
    """Runs a scene from a place with velocities that are given.

    Parameters
    ----------
    assembly
        The scene.
    place
        Coordinates at the start.
    length
        Extent of the scene, m.
    begin, end
        s.
    """

    def __init__(self, assembly: Assembly, place: FloatArray, length: float, begin: float, end: float) -> None:
        refuse_tied(assembly)
        problem = explicit_problem(assembly)
        assert problem is not None
        self.place, self.begin, self.end, self.size = place, begin, end, len(place)
        self.names = tuple(one.name for one in assembly.own_equations.names)
        still = np.zeros(self.size)
        plan = make_problem(assembly, begin, place, still, length, end - begin)
        self.sizes, self.time = plan.coordinate_sizes, plan.scales.time
        both = np.concatenate([self.sizes, self.sizes / self.time])
        options = SolverOptions(_RELATIVE, _ABSOLUTE * both, horizon=end - begin)
        self._session = EXPLICIT.open(Task(options, begin, np.concatenate([place, still]), end=end, explicit=problem))

    def at(self, velocity: FloatArray, times: FloatArray) -> FloatArray:
        """Return coordinates and velocities at times, a row each; nan from where there are none."""
        found = np.full((len(times), 2 * self.size), np.nan)
        try:
            self._session.reinitialize(self.begin, np.concatenate([self.place, velocity]))
            rows, _, ended = self._session.sample(times)
        except (StartError, AtwoodError):
            return found
        if ended.status in (Status.REACHED, Status.FAILED):
            found[: len(rows)] = rows
        return found

    def arrival(self, velocity: FloatArray) -> FloatArray:
        """Return the coordinates at the end."""
        return self.at(velocity, np.array([self.end]))[0, : self.size]

    def fields(self, velocity: FloatArray, times: FloatArray) -> FloatArray:
        """Return the derivatives of coordinates at times by the velocities at the start, shape (times, n, n)."""
        found = np.empty((len(times), self.size, self.size))
        pace = max(float(np.max(np.abs(velocity) / self.sizes)), 1.0 / self.time)
        for k in range(self.size):
            step = np.zeros(self.size)
            step[k] = _DIFFERENCE * self.sizes[k] * pace
            ahead, behind = self.at(velocity + step, times), self.at(velocity - step, times)
            found[:, :, k] = (ahead - behind)[:, : self.size] / (2.0 * step[k])
        return found
