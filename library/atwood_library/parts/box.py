"""Box: a solid box."""

from __future__ import annotations

from atwood import (
    Frame,
    Number,
    Outline,
    ParameterError,
    Placement,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    cross,
    joint,
    norm,
    parameter,
)
from atwood_library.interfaces.shape import Shape
from atwood_library.interfaces.solid import Tensor


class Box(Shape):
    """A solid box with its edges along the axes of its frame, which is at its centre, or along given directions.

    Its moments of inertia are ``m (b^2 + c^2)/12`` and so on. Frames a and b are in the middles of its faces at -x and
    +x. In a plane `length_y` is its thickness, which counts for its mass where the density is given.
    """

    synonyms = ("BodyBox", "Cuboid")

    length_x: Number = parameter(1.0, unit="m", above=0.0, doc="Length along x, from a to b.", symbol="a")
    length_y: Number = parameter(1.0, unit="m", above=0.0, doc="Length along y.", symbol="b")
    length_z: Number = parameter(1.0, unit="m", above=0.0, doc="Length along z.", symbol="c")
    direction: Triple = parameter(
        (1.0, 0.0, 0.0), direction=True, doc="Direction in the frame of the edges of length_x, from a to b."
    )
    upward: Triple = parameter(
        (0.0, 0.0, 1.0),
        direction=True,
        doc="Direction of the edges of length_z, as far as it is square to `direction`.",
    )
    a: Frame = connector(Frame, "The middle of the face at -x.")
    b: Frame = connector(Frame, "The middle of the face at +x.")

    def volume(self) -> Scalar:
        """Return the volume."""
        return self.length_x * self.length_y * self.length_z

    def check_values(self) -> None:
        """Refuse edges that are not square to each other."""
        super().check_values()
        if norm(cross(as_vector(self.upward), as_vector(self.direction))) < 1e-6:
            raise ParameterError(
                "it is parallel to the edges of length_x",
                where=f"{self.path or type(self).__name__}.upward",
                advice="Give another direction, of which the part square to `direction` is taken.",
            )

    def edges(self) -> tuple[Vector, Vector, Vector]:
        """Return unit vectors along the edges of length_x, length_y and length_z."""
        x = as_vector(self.direction)
        y = cross(as_vector(self.upward), x)
        y = y / norm(y)
        return x, y, cross(x, y)

    def gyration(self) -> Tensor:
        """Return the inertia per mass."""
        x, y, z = (side * side for side in (self.length_x, self.length_y, self.length_z))
        about = (y + z) / 12.0, (z + x) / 12.0, (x + y) / 12.0
        edges = [tuple(edge) for edge in self.edges()]

        def entry(i: int, k: int) -> Scalar:
            return sum((j * (e[i] * e[k]) for j, e in zip(about, edges, strict=True)), 0.0)

        return (
            (entry(0, 0), entry(0, 1), entry(0, 2)),
            (entry(1, 0), entry(1, 1), entry(1, 2)),
            (entry(2, 0), entry(2, 1), entry(2, 2)),
        )

    @joint("frame", "a", rigid=True, spaces=("line", "plane", "space"))
    def near_face(self) -> Placement:
        """Place a in the axes of the frame."""
        return Placement(self.edges()[0] * (-0.5 * self.length_x), 0.0, axes="a")

    @joint("frame", "b", rigid=True, spaces=("line", "plane", "space"))
    def far_face(self) -> Placement:
        """Place b in the axes of the frame."""
        return Placement(self.edges()[0] * (0.5 * self.length_x), 0.0, axes="a")

    def outline(self) -> Outline:
        """Return what it looks like."""
        drawn = Outline.box(self.length_x, self.length_y, self.length_z)
        x, y, z = self.edges()
        return drawn if (x.x, z.z) == (1.0, 1.0) else drawn.turned(x, y, z)
