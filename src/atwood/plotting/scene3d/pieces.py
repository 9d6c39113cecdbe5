"""What is drawn of a scene in space, piece by piece, each fixed in a body."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.plotting.scene3d.body_shapes import BodyShape
from atwood.plotting.scene3d.reading import Joining, Reading
from atwood.plotting.shapes.meshes import Mesh, cylinder, frame_along


@dataclass(frozen=True, eq=False)
class Piece:
    """A surface, a line or a ball that is fixed in a body; all in the axes of the body.

    Attributes
    ----------
    body
        The body.
    colour
        Its colour.
    mesh
        A surface; None for a line or a ball.
    points
        Corners of a line, or the centre of a ball, m, shape (points, 3).
    size
        Width of a line, points; radius of a ball, m.
    up
        Of a plane that others stand on, its normal; None for everything else.
    part
        Path of the part that it shows.
    """

    body: int
    colour: str
    mesh: Mesh | None = None
    points: FloatArray | None = None
    size: float = 0.0
    up: FloatArray | None = None
    part: str = ""

    @property
    def corners(self) -> FloatArray:
        """Points that it lies between, in the axes of the body, m."""
        if self.mesh is not None:
            return self.mesh.vertices
        assert self.points is not None
        if len(self.points) > 1:
            return self.points
        return self.points + self.size * np.concatenate([np.eye(3), -np.eye(3)])


@dataclass(frozen=True, eq=False)
class Hinge:
    """A hinge as a body sees it.

    Attributes
    ----------
    joining
        The joint.
    point, axis
        Its place and its axis in the axes of the body.
    other, other_axis
        The body on its other side, and the axis there.
    """

    joining: Joining
    point: FloatArray
    axis: FloatArray
    other: int
    other_axis: FloatArray


@dataclass(frozen=True, eq=False)
class Tip:
    """A point of a body whose path is worth seeing.

    Attributes
    ----------
    body
        The body.
    point
        In its axes, m.
    center
        Where the body is held or keeps its centre, in its axes, where the path lies on a sphere about it; else None.
    """

    body: int
    point: FloatArray
    center: FloatArray | None = None


@dataclass
class Bench:
    """Where the pieces of a scene are put together.

    Attributes
    ----------
    reading
        What there is to draw.
    shapes
        The shape of each lump.
    unit
        A hundredth of the extent of the scene, m: the measure of all symbols.
    depth
        How many joints each body is away from the world; bodies that hang on nothing are not in it.
    pieces, tips
        What was made so far.
    drawn
        Joints that need no symbol any more.
    footed
        Places of nodes of the world, in world axes, m, and whether what stands there is drawn; by node.
    clad
        Bodies whose shapes are drawn in another way, or whose nodes need no bars.
    part
        The part that is being drawn.
    """

    reading: Reading
    shapes: tuple[BodyShape, ...]
    unit: float
    depth: dict[int, int]
    pieces: list[Piece] = field(default_factory=list)
    tips: list[Tip] = field(default_factory=list)
    drawn: set[str] = field(default_factory=set)
    feet: dict[int, list[FloatArray]] = field(default_factory=dict)
    clad: set[int] = field(default_factory=set)
    part: str = ""

    def of_body(self, body: int) -> list[BodyShape]:
        """Return the shapes of a body that have an inertia."""
        return [one for one in self.shapes if one.lump.body == body and one.kind != "point"]

    def joinings(self, body: int) -> list[Joining]:
        """Return the joints of a body."""
        of = self.reading.body_of
        return [one for one in self.reading.joinings if body in (of[one.nodes[0]], of[one.nodes[1]])]

    def hinges(self, body: int) -> list[Hinge]:
        """Return the hinges of a body."""
        reading, found = self.reading, []
        for one in self.joinings(body):
            if one.kind != "hinge":
                continue
            a, b = one.nodes
            in_a = one.axes[0]
            in_b = reading.turns[b] @ reading.turns[a].T @ in_a
            bodies = reading.body_of[a], reading.body_of[b]
            if bodies[0] == body:
                found.append(Hinge(one, reading.offsets[a], in_a, bodies[1], in_b))
            else:
                found.append(Hinge(one, reading.offsets[b], in_b, bodies[0], in_a))
        return found

    def is_at_one_place(self, body: int) -> bool:
        """Whether all nodes and the centres of mass of a body are so near together that nothing shows it."""
        nodes = [node for node in self.reading.used if self.reading.body_of[node] == body]
        points = [self.reading.offsets[node] for node in nodes]
        return bool(points) and bool(np.max(np.ptp(np.array(points), axis=0)) <= 1e-6 * self.unit)

    def is_own(self, body: int) -> bool:
        """Whether parts of a body have a shape of their own, which is then what is drawn."""
        return any(one.kind == "own" for one in self.of_body(body))

    def children(self, body: int) -> list[int]:
        """Return the bodies that hang on a body, farther from the world."""
        of = self.reading.body_of
        ends = [{of[node] for node in one.nodes} - {body} for one in self.joinings(body)]
        return [other for one in ends for other in one if self.depth.get(other, 0) > self.depth.get(body, 0)]

    def radius_about(self, node: int) -> float:
        """Return how far the shapes of a node's body reach from it, m."""
        shapes, place = self.of_body(self.reading.body_of[node]), self.reading.offsets[node]
        return max((float(np.max(np.linalg.norm(one.corners - place, axis=1))) for one in shapes), default=0.0)

    def is_within(self, inner: BodyShape, outer: BodyShape) -> bool:
        """Return whether the shape of one body lies within a larger one of another where the run begins."""
        own, other = (self.reading.poses[one.lump.body] for one in (inner, outer))
        if np.prod(inner.sides) > 0.5 * np.prod(outer.sides):
            return False
        corners = inner.center[None] if inner.kind == "point" else inner.corners
        seen = (own.origin[0] + corners @ own.axes[0].T - other.origin[0]) @ other.axes[0]
        return all(float(np.linalg.norm(outer.nearest(one) - one)) < 1e-3 * self.unit for one in seen)

    def edges(self, body: int, mesh: Mesh, colour: str) -> None:
        """Put the edges of a surface on a body, so that what is within is seen."""
        ends, _, sharp = mesh.edges
        for pair in mesh.vertices[ends[sharp]]:
            self.line(body, pair, 1.4, colour)

    def tube(self, body: int, a: FloatArray, b: FloatArray, radius: float, colour: str) -> None:
        """Put a round bar between two points of a body."""
        length = float(np.linalg.norm(b - a))
        if length > 1e-9 * self.unit:
            made = cylinder(radius, length, around=16)
            self.pieces.append(Piece(body, colour, made.placed(0.5 * (a + b), frame_along(b - a)), part=self.part))

    def ball(self, body: int, center: FloatArray, radius: float, colour: str) -> None:
        """Put a ball on a body."""
        self.pieces.append(Piece(body, colour, points=np.array([center]), size=radius, part=self.part))

    def line(self, body: int, points: FloatArray, width: float, colour: str) -> None:
        """Put a line on a body."""
        self.pieces.append(Piece(body, colour, None, np.asarray(points, dtype=float), width, part=self.part))

    def surface(self, body: int, mesh: Mesh, colour: str, up: FloatArray | None = None) -> None:
        """Put a surface on a body; with its normal a plane that others stand on."""
        self.pieces.append(Piece(body, colour, mesh, up=up, part=self.part))
