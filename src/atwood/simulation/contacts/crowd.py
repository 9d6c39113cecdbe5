"""Many bodies of which any two may touch, in steps that look for no event."""

from __future__ import annotations

import warnings
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import SolveError, StartError, UnsupportedError
from atwood.expr import evaluate, read_by
from atwood.forms.assembly import Assembly
from atwood.integrators.time_stepping.session import Pushed
from atwood.mechanics.kinematics.mechanism import world_position
from atwood.model.declare.contact_group import ContactGroup
from atwood.numerics.cone_impulses import Touches, impulses
from atwood.numerics.near_pairs import near_pairs
from atwood.simulation.contacts.convex_pairs import ConvexBodies, Near, turns_of
from atwood.simulation.contacts.groups import groups_of
from atwood.simulation.problem.problem import SceneProblem

_CLOSED = 1e-9
"""Of a radius: what is no farther apart touches, and bodies may start inside of each other by so much."""

_SMALL, _MISSED = 1e-4, 1e-2
"""Of the largest speed: by so much the laws may be missed without a word, and from so much on a run fails."""

_PLACES = 1 << 16
"""More places than these never touch between two bodies."""


class Geometry(Protocol):
    """The shapes of the bodies of a group.

    Attributes
    ----------
    size
        Of a body, m.
    """

    size: float

    def near(self, y: FloatArray, margin: float) -> Near:
        """Return what is no farther apart than a margin."""

    def slopes(self, y: FloatArray, near: Near) -> FloatArray:
        """Return how rates of opening and slipping follow from speeds; see `Touches`."""


def crowd_of(plan: SceneProblem, t: float, y: FloatArray) -> Crowd | None:
    """Return the group of bodies of a scene, which starts at a state; None where there is none."""
    paths, assembly = groups_of(plan.assembly), plan.assembly
    if not paths:
        return None
    others = [one.row.key[0] for one in assembly.own_equations.contacts]
    if len(paths) > 1 or others:
        raise UnsupportedError(
            f"contacts of a group are solved by themselves, and there is {(*paths, *others)[1]} as well",
            where=paths[0],
            advice="Put all bodies and walls into one group.",
        )
    return Crowd(plan, paths[0], t, y)


class Crowd:
    """A group of bodies, step by step.

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
        assembly, part = plan.assembly, plan.assembly.flat.parts[path]
        assert isinstance(part.component, ContactGroup)
        self.path, self.member, values = path, type(part.component).member, part.values
        self.restitution, self.friction = float(values["restitution"]), float(values["friction"])
        places, self.columns = _columns(assembly, path, self.member, int(values["count"]))
        in_plane = places.shape[1] == 2
        walls = np.array(values["walls"] or (), dtype=float).reshape(-1, 4 if in_plane else 6)
        points, normals = np.hsplit(walls, 2)
        given = places, (points, normals / np.linalg.norm(normals, axis=1)[:, None])
        made = Discs(float(values["radius"]), *given) if in_plane else ConvexBodies(values["shapes"], path, *given)
        self.geometry: Geometry = made
        speeds = self.columns.shape[1]
        self.inverse = np.zeros((len(self.columns) + 1, speeds, speeds))
        self.inverse[:-1] = np.linalg.inv(_masses(plan, self.columns, path, self.member, t, y).astype(np.float64))
        self.has_said, self.drift = False, 0.0
        self.known: tuple[NDArray[np.intp], FloatArray] = (
            np.zeros(0, dtype=np.intp),
            np.zeros((2 if in_plane else 3, 0)),
        )

    def names(self, near: Near) -> NDArray[np.intp]:
        """Return a number for each pair of bodies, which is larger than those of their places."""
        found: NDArray[np.intp] = (near.bodies[0] * (2 * len(self.columns) + _PLACES) + near.bodies[1]) * _PLACES
        return found

    def check_start(self, y: FloatArray) -> None:
        """Refuse bodies that start inside of each other or of a wall."""
        near, name = self.geometry.near(y, 0.0), self.member
        if len(near.gaps) and np.min(near.gaps) < -_CLOSED * self.geometry.size:
            first, other = near.bodies[:, np.argmin(near.gaps)].tolist()
            what = f"{name}[{other}]" if other < len(self.columns) else f"wall {other - len(self.columns)}"
            raise StartError(
                f"{name}[{first}] starts inside {what}, by {-float(np.min(near.gaps)):.6g} m",
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
        closed = _CLOSED * self.geometry.size
        near = self.geometry.near(y, max(closed, h * self.drift))
        names, (known, pushed) = self.names(near), self.known
        pressed = known[pushed[0] > 0.0] // _PLACES
        is_closed = (near.gaps <= closed) | np.isin(names // _PLACES, pressed)
        if not np.any(is_closed):
            return None
        touching = near.chosen(is_closed)
        return _Pile(self, touching, self.geometry.slopes(y, touching), t, u)


class _Pile:
    """The bodies that touch something in one step."""

    def __init__(self, crowd: Crowd, near: Near, slopes: FloatArray, t: float, u: FloatArray) -> None:
        self.crowd, self.t, self.u = crowd, t, u
        self.names = crowd.names(near) + near.number
        bodies = np.minimum(near.bodies, len(crowd.columns))
        self.touches = Touches(bodies, slopes, crowd.inverse, crowd.friction)
        self.guess = np.zeros((slopes.shape[2], len(self.names)))
        known, pushed = crowd.known
        if len(known):
            at = np.minimum(np.searchsorted(known, self.names), len(known) - 1)
            same = known[at] == self.names
            self.guess[:, same] = pushed[:, at[same]]

    def pushed(self, free: FloatArray) -> Pushed:
        """Return what contacts do, given the speeds at the end of the step without them."""
        crowd, columns = self.crowd, self.crowd.columns
        start, ahead = np.zeros((2, len(columns) + 1, columns.shape[1]))
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
        return Pushed(change, False, -work, None, lambda time: [], missed / fastest if missed > 0.0 else 0.0)


class Discs:
    """Equal discs in a plane.

    Parameters
    ----------
    radius
        Of each, m.
    places
        Which coordinates are those of each.
    walls
        Points of walls and their normals into the room.
    """

    def __init__(self, radius: float, places: NDArray[np.intp], walls: tuple[FloatArray, FloatArray]) -> None:
        self.size, self.columns, (self.points, self.normals) = radius, places, walls

    def near(self, y: FloatArray, margin: float) -> Near:
        """See `Geometry`."""
        places, radius = y[self.columns], self.size
        pairs = np.sort(near_pairs(places, 2.0 * radius + margin), axis=1)
        between = places[pairs[:, 1]] - places[pairs[:, 0]]
        distance = np.hypot(*between.T)
        if np.any(distance == 0.0):
            raise SolveError("two discs are in one place", advice="Give a shorter step.")
        off = np.stack([(places - p) @ n for p, n in zip(self.points, self.normals, strict=True)] or [np.zeros(0)])
        wall, disc = np.nonzero(off <= radius + margin) if len(self.points) else (pairs[:0, 0], pairs[:0, 0])
        bodies = np.concatenate([pairs, np.stack([disc, len(places) + wall], axis=1)]).T
        normals = np.concatenate([between / distance[:, None], -self.normals[wall]])
        gaps = np.concatenate([distance - 2.0 * radius, off[wall, disc] - radius])
        close = gaps <= margin
        bodies, normals = bodies[:, close], normals[close]
        number = np.zeros(len(normals), dtype=np.intp)
        return Near(bodies, number, normals, places[bodies[0]] + radius * normals, gaps[close])

    def slopes(self, y: FloatArray, near: Near) -> FloatArray:
        """See `Geometry`: speeds are those along x and z and of the angle; slips are to the left of the normal."""
        (x, z), none = near.normals.T, np.zeros(len(near.normals))
        arm = none - self.size
        one, other = np.array([[-x, -z, none], [z, -x, arm]]), np.array([[x, z, none], [-z, x, arm]])
        return np.moveaxis(np.array([one, other]), -1, 1)


def _columns(assembly: Assembly, path: str, member: str, count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return which coordinates, and which speeds, are those of each body: of its place, then of its orientation."""
    equations = assembly.own_equations
    site, kinematics = equations.site, equations.kinematics
    places = {one: i for i, one in enumerate(equations.coordinates)}
    speeds = {one: i for i, one in enumerate(equations.speeds)}
    found: list[tuple[list[int], list[int]]] = []
    for i in range(count):
        name = f"{member}[{i}]"
        node = site.node(path, name)
        body = site.bodies.body_of[node]
        own = [places.get(one, -1) for one in world_position(assembly.mechanism, kinematics.placements, node)]
        rates = [speeds.get(one, -2) for one in kinematics.velocities[node]]
        is_free, turn = own == rates or len(own) == 3, kinematics.angular_velocities.get(body, (None,))
        if len(own) == 3 and body in kinematics.placements.axes:
            entries = [one for axis in kinematics.placements.axes[body] for one in axis]
            turning = read_by(entries, list(equations.coordinates))
            own += [places[one] for one in turning]
            chance = np.array([0.5, -0.7, 0.1, 0.5][: len(turning)])
            values = dict(zip(turning, chance.tolist(), strict=True))
            is_free = len(turning) == 4 and (
                i > 0 or np.allclose(np.reshape(evaluate(entries, values), (3, 3)), turns_of(chance[None])[0].T)
            )
        rates += [-2 if one is None else speeds.get(one, -2) for one in turn]
        if -1 in own or -2 in rates or not is_free:
            raise UnsupportedError(
                "it is no body that moves freely, with its frame at its centre",
                where=f"{path}.{name}",
                advice="Join the group to bodies that nothing else holds, such as Disc, Sphere or Box.",
            )
        found.append((own, rates))
    own_places, own_speeds = (np.array(one, dtype=np.intp) for one in zip(*found, strict=True))
    return own_places, own_speeds


def _masses(
    plan: SceneProblem, columns: NDArray[np.intp], path: str, member: str, t: float, y: FloatArray
) -> FloatArray:
    """Return the mass matrix of each body, on which nothing else depends."""
    program, count = plan.assembly.balance(plan.assembly.form), plan.program.speeds
    bodies, speeds = columns.shape
    straight = 2 if speeds == 3 else 3
    of, place = np.full(count, -1), np.zeros(count, dtype=np.intp)
    of[columns], place[columns] = np.arange(bodies)[:, None], np.arange(speeds)
    rows, others = program.mass_rows, program.mass_columns
    is_mixed = (of[rows] != of[others]) | ((rows != others) & (np.minimum(place[rows], place[others]) < straight))
    mixes = program.mass_product is not None or np.any(is_mixed & ((of[rows] >= 0) | (of[others] >= 0)))
    if mixes or np.any(of[program.jacobian_columns] >= 0):
        raise UnsupportedError(
            "its bodies do not move freely about their frames: other parts share their inertia, or hold them",
            where=path,
            advice=f"Join {member}[0] and so on at the centres of bodies that have nothing but parts with forces.",
        )
    own = of[rows] >= 0
    rows, others = rows[own], others[own]
    masses = np.zeros((bodies, speeds, speeds))
    entries = np.asarray(plan.assembly.kernel(program.program)([t], *plan.program.split(y))[0])[own]
    masses[of[rows], place[rows], place[others]] = entries
    return masses
