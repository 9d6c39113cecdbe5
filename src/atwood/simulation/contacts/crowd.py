"""Many discs that may touch each other, in steps that look for no event."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import SolveError, StartError, UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.integrators.time_stepping.session import Pushed
from atwood.mechanics.kinematics.mechanism import world_position
from atwood.numerics.cone_impulses import Touches, impulses
from atwood.numerics.near_pairs import near_pairs
from atwood.simulation.contacts.groups import groups_of
from atwood.simulation.problem.problem import SceneProblem

_CLOSED = 1e-9
"""Of a radius: what is no farther apart touches, and discs may start inside of each other by so much."""

_SMALL, _MISSED = 1e-4, 1e-2
"""Of the largest speed: by so much the laws may be missed without a word, and from so much on a run fails."""


def crowd_of(plan: SceneProblem, t: float, y: FloatArray) -> Crowd | None:
    """Return the group of discs of a scene, which starts at a state; None where there is none."""
    paths, assembly = groups_of(plan.assembly), plan.assembly
    if not paths:
        return None
    others = [one.row.key[0] for one in assembly.own_equations.contacts]
    if len(paths) > 1 or others:
        raise UnsupportedError(
            f"contacts of a group are solved by themselves, and there is {(*paths, *others)[1]} as well",
            where=paths[0],
            advice="Put all discs and walls into one group.",
        )
    return Crowd(plan, paths[0], t, y)


class Crowd:
    """A group of discs, step by step.

    Parameters
    ----------
    plan
        The scene.
    path
        The group.
    t, y
        A state.
    """

    def __init__(self, plan: SceneProblem, path: str, t: float, y: FloatArray) -> None:
        assembly, values = plan.assembly, plan.assembly.flat.parts[path].values
        self.path, self.radius = path, float(values["radius"])
        self.restitution, self.friction = float(values["restitution"]), float(values["friction"])
        walls = np.array(values["walls"], dtype=float).reshape(-1, 4)
        self.points, self.normals = walls[:, :2], walls[:, 2:] / np.linalg.norm(walls[:, 2:], axis=1)[:, None]
        self.columns = _columns(assembly, path, int(values["count"]))
        self.inverse = np.zeros((len(self.columns) + 1, 3))
        self.inverse[:-1] = 1.0 / _masses(plan, self.columns, path, t, y)
        self.has_said, self.drift = False, 0.0
        self.known: tuple[NDArray[np.intp], FloatArray] = (np.zeros(0, dtype=np.intp), np.zeros((2, 0)))

    def places(self, y: FloatArray) -> FloatArray:
        """Return the centres of the discs, shape (discs, 2)."""
        return y[self.columns[:, :2]]

    def near(self, y: FloatArray, margin: float) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
        """Return what is no farther apart than a margin: names of pairs, normals and gaps.

        A pair is named by the number of its first disc, times a number above all others, and that of the other disc or
        of the wall, which are counted from that of the world.
        """
        places, count = self.places(y), len(self.columns)
        pairs = near_pairs(places, 2.0 * self.radius + margin)
        between = places[pairs[:, 1]] - places[pairs[:, 0]]
        distance = np.hypot(*between.T)
        if np.any(distance == 0.0):
            raise SolveError("two discs are in one place", where=self.path, advice="Give a shorter step.")
        off = np.stack([(places - p) @ n for p, n in zip(self.points, self.normals, strict=True)] or [np.zeros(0)])
        wall, disc = np.nonzero(off <= self.radius + margin) if len(self.points) else (pairs[:0, 0], pairs[:0, 0])
        base = count + len(self.points)
        names = np.concatenate([np.min(pairs, axis=1) * base + np.max(pairs, axis=1), disc * base + count + wall])
        turned = np.where(pairs[:, 0] < pairs[:, 1], 1.0, -1.0)[:, None]
        normals = np.concatenate([turned * between / distance[:, None], -self.normals[wall]])
        gaps = np.concatenate([distance - 2.0 * self.radius, off[wall, disc] - self.radius])
        close = gaps <= margin
        return names[close], normals[close], gaps[close]

    def check_start(self, y: FloatArray) -> None:
        """Refuse discs that start inside of each other or of a wall."""
        names, _, gaps = self.near(y, 0.0)
        if len(gaps) and np.min(gaps) < -_CLOSED * self.radius:
            first, other = divmod(int(names[np.argmin(gaps)]), len(self.columns) + len(self.points))
            what = f"disc[{other}]" if other < len(self.columns) else f"wall {other - len(self.columns)}"
            raise StartError(
                f"disc[{first}] starts inside {what}, by {-float(np.min(gaps)):.6g} m",
                where=self.path,
                advice="Start where nothing is inside of anything.",
            )

    def say(self, what: str, is_failure: bool) -> None:
        """Say how far impulses are off that did not settle: in an error, or in a warning, once."""
        if is_failure:
            raise SolveError(what, where=self.path, advice="Give a shorter step.")
        if not self.has_said:
            warnings.warn(f"{self.path}: {what}; a shorter step errs less", stacklevel=2)
        self.has_said = True

    def touching(self, t: float, y: FloatArray, u: FloatArray, h: float) -> _Pile | None:
        """Return what touches at a state, in a step that begins with speeds u; None where nothing does.

        What was pressed goes on to touch within what velocities leave open in a step.
        """
        names, normals, gaps = self.near(y, max(_CLOSED * self.radius, h * self.drift))
        known, pushed = self.known
        is_closed = (gaps <= _CLOSED * self.radius) | np.isin(names, known[pushed[0] > 0.0])
        return _Pile(self, names[is_closed], normals[is_closed], t, u) if np.any(is_closed) else None


class _Pile:
    """The discs that touch something in one step."""

    def __init__(self, crowd: Crowd, names: NDArray[np.intp], normals: FloatArray, t: float, u: FloatArray) -> None:
        self.crowd, self.names, self.t, self.u = crowd, names, t, u
        count = len(crowd.columns)
        first, second = np.divmod(names, count + len(crowd.points))
        is_disc = second < count
        arms = np.array([np.full(len(names), crowd.radius), np.where(is_disc, crowd.radius, 0.0)])
        bodies = np.array([first, np.where(is_disc, second, count)])
        self.touches = Touches(bodies, normals.T, arms, crowd.inverse, crowd.friction)
        self.guess = np.zeros((2, len(names)))
        known, pushed = crowd.known
        if len(known):
            at = np.minimum(np.searchsorted(known, names), len(known) - 1)
            same = known[at] == names
            self.guess[:, same] = pushed[:, at[same]]

    def pushed(self, free: FloatArray) -> Pushed:
        """Return what contacts do, given the speeds at the end of the step without them."""
        crowd, columns = self.crowd, self.crowd.columns
        start, ahead = np.zeros((2, len(columns) + 1, 3))
        start[:-1], ahead[:-1] = self.u[columns], free[columns]
        before, now = self.touches.rates(start), self.touches.rates(ahead)
        by_forces = np.abs(now[0] - before[0])
        # A bounce that ends within the step is none: its energy would come from nowhere.
        bounce = crowd.restitution * before[0]
        least = np.where(-bounce > by_forces, -bounce, 0.0)
        fastest = float(np.max(np.abs(np.concatenate([before, now]))))
        v, p, missed = impulses(self.touches, ahead, least, self.guess, _SMALL * fastest, _MISSED * fastest)
        if missed > _SMALL * fastest:
            crowd.say(
                f"at t = {self.t:.9g} the laws of {len(self.names)} contacts are missed by {missed:.2g} m/s of "
                f"{fastest:.2g} m/s, in quadratic mean",
                missed > _MISSED * fastest,
            )
        self.guess, crowd.drift = p, float(np.max(by_forces))
        order = np.argsort(self.names)
        crowd.known = self.names[order], p[:, order]
        work = 0.5 * float(np.sum(p * (before + self.touches.rates(v))))
        change = np.zeros(len(free))
        change[columns] = (v - ahead)[:-1]
        return Pushed(change, False, -work, None, lambda time: [])


def _columns(assembly: Assembly, path: str, count: int) -> NDArray[np.intp]:
    """Return which coordinates, and which speeds, are those of the place and the angle of each disc."""
    equations = assembly.own_equations
    site, kinematics = equations.site, equations.kinematics
    places = {one: i for i, one in enumerate(equations.coordinates)}
    speeds = {one: i for i, one in enumerate(equations.speeds)}
    found = np.zeros((count, 3), dtype=np.intp)
    for i in range(count):
        name = f"disc[{i}]"
        node = site.node(path, name)
        own = [places.get(one, -1) for one in world_position(assembly.mechanism, kinematics.placements, node)]
        turn = kinematics.angular_velocities.get(site.bodies.body_of[node], (None,))
        rates = [speeds.get(one, -2) for one in (*kinematics.velocities[node], *turn)]
        if own != rates[:2] or -2 in rates:
            raise UnsupportedError(
                "it is no disc that moves freely, with its frame at its centre",
                where=f"{path}.{name}",
                advice="Join the group to discs that nothing else holds, such as Disc.",
            )
        found[i] = rates
    return found


def _masses(plan: SceneProblem, columns: NDArray[np.intp], path: str, t: float, y: FloatArray) -> FloatArray:
    """Return mass, mass and moment of inertia of each disc, on which nothing else depends."""
    program, count = plan.assembly.balance(plan.assembly.form), plan.program.speeds
    own = np.zeros(count, dtype=bool)
    own[columns] = True
    rows, others = program.mass_rows, program.mass_columns
    is_own = rows == others
    mixes = program.mass_product is not None or np.any((own[rows] | own[others]) & ~is_own)
    if mixes or np.any(own[program.jacobian_columns]):
        raise UnsupportedError(
            "its discs do not move freely: other parts share their inertia, or hold them",
            where=path,
            advice="Join them to nothing but parts with forces.",
        )
    masses = np.zeros(count)
    masses[rows[is_own]] = np.asarray(plan.assembly.kernel(program.program)([t], *plan.program.split(y))[0])[is_own]
    found: FloatArray = masses[columns]
    return found
