"""Where convex bodies in space are near each other, or near a wall.

A shape is a polytope that is made larger all around by a radius, of one point for a ball and of two for a capsule, or
an ellipsoid. Balls are sought with numbers alone. Of other pairs the library coal says the normal between them (GJK
and EPA: E. Gilbert and others 1988; G. van den Bergen 2001). Where that is the normal of a face, the other body's face
is cut to what is above it: in the corners of that the two touch.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import BoolArray, FloatArray
from atwood.errors import SolveError, UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import needed
from atwood.numerics.near_pairs import near_pairs

_FLAT = 1e-6
"""Of a normal: what differs by no more from that of a face, in its cosine, is that of the face."""

_ONE = 1e-9
"""Of a size: faces whose planes are no farther apart are one, and so far beyond an edge is within it."""

Walls = tuple[FloatArray, FloatArray]


class Near(NamedTuple):
    """Places at which bodies are near each other, or a wall.

    Attributes
    ----------
    bodies
        Numbers of the two of each place, shape (2, places); walls count on behind the bodies.
    number
        A number of each place among those of its two bodies.
    normals, points
        Unit vectors from the first to the second, and where they are, shape (places, 2 or 3).
    gaps
        How far they are apart.
    """

    bodies: NDArray[np.intp]
    number: NDArray[np.intp]
    normals: FloatArray
    points: FloatArray
    gaps: FloatArray

    def chosen(self, some: BoolArray) -> Near:
        """Return some of them."""
        number, bodies = self.number[some], self.bodies[:, some]
        return Near(bodies, number, self.normals[some], self.points[some], self.gaps[some])


@dataclass(frozen=True, eq=False)
class Shape:
    """A convex shape in the axes of its body.

    Attributes
    ----------
    points, radius
        Corners, and by how much the polytope of these is larger; the half axes of an ellipsoid, of radius -1.
    faces
        The numbers of the corners of each face in order, and its normal.
    """

    points: FloatArray
    radius: float
    faces: tuple[tuple[NDArray[np.intp], FloatArray], ...]

    @property
    def is_ellipsoid(self) -> bool:
        """Whether it is an ellipsoid."""
        return self.radius < 0.0

    @property
    def is_ball(self) -> bool:
        """Whether it is a ball about the origin."""
        return self.radius > 0.0 and len(self.points) == 1 and not np.any(self.points)

    @cached_property
    def reach(self) -> float:
        """The radius of a ball about its origin that it is in."""
        if self.is_ellipsoid:
            return float(np.max(self.points))
        return float(np.max(np.linalg.norm(self.points, axis=1))) + self.radius

    @cached_property
    def of_coal(self) -> Any:
        """The same for the library coal."""
        coal = _coal()
        if self.is_ellipsoid:
            return coal.Ellipsoid(*map(float, self.points[0]))
        if len(self.points) == 1:
            return coal.Sphere(self.radius)
        if len(self.points) == 2:
            return coal.Capsule(self.radius, float(np.linalg.norm(self.points[1] - self.points[0])))
        corners = coal.StdVec_Vec3s()
        corners.extend(list(self.points))
        return coal.ConvexBase.convexHull(corners, False, "")


def _coal() -> Any:
    what = "pairs of bodies that are not both balls are found by coal, which"
    return needed("coal", "'atwood[coal]'", what, "ConvexContacts")


def _shape(rows: FloatArray) -> Shape:
    radius, points = float(rows[0, 0]), rows[:, 1:]
    faces = _faces(points) if len(points) > 3 else ()
    return Shape(points, radius, faces)


def _faces(points: FloatArray) -> tuple[tuple[NDArray[np.intp], FloatArray], ...]:
    """Return the faces of a polytope, each once, though it may be of many triangles."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull, size = ConvexHull(points), float(np.max(np.ptp(points, axis=0)))
    except QhullError:
        raise UsageError(
            "the corners of a hull are in one plane", where="ConvexContacts.shapes", advice="Give corners of a solid."
        ) from None
    found: list[tuple[NDArray[np.intp], FloatArray]] = []
    for plane in hull.equations:
        normal, below = plane[:3], points @ plane[:3] + plane[3]
        if any(normal @ other > 1.0 - _ONE for _, other in found):
            continue
        corners = np.intersect1d(np.flatnonzero(below > -_ONE * size), hull.vertices)
        spokes = points[corners] - np.mean(points[corners], axis=0)
        angle = np.arctan2(np.cross(spokes[0], spokes) @ normal, spokes @ spokes[0])
        found.append((corners[np.argsort(angle)], normal))
    return tuple(found)


def turns_of(quaternions: FloatArray) -> FloatArray:
    """Return rotation matrices, whose columns are the axes of bodies, of unit quaternions or others."""
    w, x, y, z = quaternions.T
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), -1, 0)


class ConvexBodies:
    """The shapes of a group in space.

    Parameters
    ----------
    shapes
        Rows of a number, a radius and a point: a shape for all bodies, or one for each; see `Shape`.
    path
        The group.
    places
        Which coordinates are those of each: of its place, and of its quaternion.
    walls
        Points of walls and their normals into the room.
    """

    def __init__(self, shapes: Any, path: str, places: NDArray[np.intp], walls: Walls) -> None:
        rows, count = np.array(shapes, dtype=float), len(places)
        made = [_shape(rows[rows[:, 0] == number, 1:]) for number in np.unique(rows[:, 0])]
        if len(made) not in (1, count):
            raise UsageError(
                f"there are {len(made)} shapes for {count} bodies",
                where=f"{path}.shapes",
                advice="Give one shape for all, or one for each.",
            )
        self.shapes = made * (count if len(made) == 1 else 1)
        self.columns, self.walls, self.path = places, walls, path
        self.reach = np.array([one.reach for one in self.shapes])
        self.is_ball = np.array([one.is_ball for one in self.shapes])
        self.alike = [np.array([i for i in range(count) if self.shapes[i] is one]) for one in made]
        self.size = float(np.max(self.reach))
        if count > 1 and not np.all(self.is_ball):
            _coal()  # so that what is missing is said at once

    def _state(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        own = y[self.columns]
        quaternions = own[:, 3:] / np.linalg.norm(own[:, 3:], axis=1)[:, None]
        return own[:, :3], turns_of(quaternions)

    def near(self, y: FloatArray, margin: float) -> Near:
        """See `crowd.Geometry`."""
        places, turns = self._state(y)
        found = [self._at_walls(places, turns, margin)]
        pairs = near_pairs(places, 2.0 * self.size + margin) if len(places) > 1 else np.zeros((0, 2), dtype=np.intp)
        pairs = np.sort(pairs, axis=1)
        between = places[pairs[:, 1]] - places[pairs[:, 0]]
        distance = np.linalg.norm(between, axis=1)
        is_near = distance <= np.sum(self.reach[pairs], axis=1) + margin
        round_ones = np.all(self.is_ball[pairs], axis=1)
        if np.any(distance[round_ones] == 0.0):
            raise SolveError("two balls are in one place", where=self.path, advice="Give a shorter step.")
        balls = pairs[is_near & round_ones]
        normals = between[is_near & round_ones] / distance[is_near & round_ones, None]
        gaps = distance[is_near & round_ones] - np.sum(self.reach[balls], axis=1)
        points = places[balls[:, 0]] + normals * (self.reach[balls[:, 0]] + 0.5 * gaps)[:, None]
        found.append((balls, np.zeros(len(balls), dtype=np.intp), normals, points, gaps))
        found += [self._between(i, j, places, turns, margin) for i, j in pairs[is_near & ~round_ones].tolist()]
        bodies, *others = (np.concatenate(one) for one in zip(*found, strict=True))
        return Near(bodies.T, *others)

    def slopes(self, y: FloatArray, near: Near) -> FloatArray:
        """See `crowd.Geometry`: speeds are the velocity in world axes, and the spin in those of the body."""
        places, turns = self._state(y)
        n = near.normals
        least = np.eye(3)[np.argmin(np.abs(n), axis=1)]
        first = np.cross(n, least)
        first /= np.linalg.norm(first, axis=1)[:, None]
        rows = np.stack([n, first, np.cross(n, first)], axis=1)
        found = np.zeros((2, len(n), 3, 6))
        for k, (sign, bodies) in enumerate(zip((-1.0, 1.0), near.bodies, strict=True)):
            own = np.minimum(
                bodies, len(places) - 1
            )  # what walls have there, whose inverse mass is zero, does not count
            found[k, :, :, :3] = sign * rows
            arms = near.points - places[own]
            found[k, :, :, 3:] = sign * np.cross(arms[:, None], rows) @ turns[own]
        return found

    def _at_walls(self, places: FloatArray, turns: FloatArray, margin: float) -> Any:
        """Return the corners of bodies, or their lowest points, that are near walls."""
        found = [_nothing()]
        for wall, (point, normal) in enumerate(zip(*self.walls, strict=True)):
            for bodies in self.alike:
                one = self.shapes[bodies[0]]
                corners, radius = one.points[None], max(one.radius, 0.0)
                if one.is_ellipsoid:
                    ahead = one.points[0] * (turns[bodies].transpose(0, 2, 1) @ normal)
                    corners = (-one.points[0] * ahead / np.linalg.norm(ahead, axis=1)[:, None])[:, None]
                there = places[bodies, None] + corners @ turns[bodies].transpose(0, 2, 1)
                gaps = (there - point) @ normal - radius
                k, number = np.nonzero(gaps <= margin)
                pair = np.stack([bodies[k], np.full(len(k), len(places) + wall)], axis=1)
                against = np.broadcast_to(-normal, (len(k), 3))
                found.append((pair, number, against, there[k, number] - radius * normal, gaps[k, number]))
        return tuple(np.concatenate(one) for one in zip(*found, strict=True))

    def _between(self, i: int, j: int, places: FloatArray, turns: FloatArray, margin: float) -> Any:
        """Return where two bodies are near each other that are not both balls."""
        coal = _coal()
        request, result = coal.CollisionRequest(), coal.CollisionResult()
        request.security_margin = margin
        frames = [coal.Transform3s(np.ascontiguousarray(turns[k]), places[k]) for k in (i, j)]
        if not coal.collide(self.shapes[i].of_coal, frames[0], self.shapes[j].of_coal, frames[1], request, result):
            return _nothing()
        one = result.getContact(0)
        normal = np.array(one.normal, dtype=float)
        flat = self._on_faces((i, j), places, turns, normal)
        normals, points, gaps = flat or (normal[None], np.array(one.pos)[None], np.array([one.penetration_depth]))
        close = gaps <= margin
        number = np.arange(len(gaps))[close]
        return np.tile([i, j], (len(number), 1)), number, normals[close], points[close], gaps[close]

    def _on_faces(
        self, pair: tuple[int, int], places: FloatArray, turns: FloatArray, normal: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Return where one body is above a face of the other, which the normal between them is square to."""
        best: tuple[float, int, int] = (1.0 - _FLAT, -1, -1)
        for side, (k, sign) in enumerate(zip(pair, (1.0, -1.0), strict=True)):
            ahead = sign * normal @ turns[k]
            for number, (_, way) in enumerate(self.shapes[k].faces):
                best = max(best, (float(way @ ahead), side, number), key=lambda one: one[0])
        _, side, number = best
        if side < 0:
            return None
        own, other = (self.shapes[k] for k in (pair[side], pair[1 - side]))
        if other.is_ellipsoid:
            return None
        k, far = pair[side], pair[1 - side]
        corners, up = own.faces[number]
        # In the axes of the body with the face.
        turned = turns[k].T @ turns[far]
        down = up @ turned
        facing = min(other.faces, key=lambda face: float(face[1] @ down), default=None)
        facing_points = other.points if facing is None else other.points[facing[0]]
        left = facing_points @ turned.T + turns[k].T @ (places[far] - places[k])
        base = own.points[corners]
        left = _clipped(left, base, up, own.reach)
        gaps = (left - base[0]) @ up - own.radius - max(other.radius, 0.0)
        met = left - up * (max(other.radius, 0.0) + 0.5 * gaps)[:, None]
        normals = np.broadcast_to((1.0 if side == 0 else -1.0) * (turns[k] @ up), (len(gaps), 3))
        return (normals, places[k] + met @ turns[k].T, gaps) if len(gaps) else None


def _nothing() -> tuple[Any, ...]:
    none = np.zeros(0, dtype=np.intp)
    return none.reshape(0, 2), none, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)


def _clipped(points: FloatArray, base: FloatArray, up: FloatArray, size: float) -> FloatArray:
    """Return the corners of what is left of a polygon, a line or a point above a face (Sutherland and Hodgman 1974)."""
    for first, second in zip(base, np.roll(base, -1, axis=0), strict=True):
        out = np.cross(second - first, up)
        off = (points - first) @ out / np.linalg.norm(out)
        points = _cut(points, off, off <= _ONE * size)
    return points


def _cut(points: FloatArray, off: FloatArray, inside: BoolArray) -> FloatArray:
    kept: list[FloatArray] = []
    for i in range(len(points)):
        if inside[i]:
            kept.append(points[i])
        j = (i + 1) % len(points)
        if inside[i] != inside[j] and not (len(points) == 2 and i == 1):
            kept.append(points[i] + (points[j] - points[i]) * (off[i] / (off[i] - off[j])))
    return np.array(kept).reshape(-1, 3)
