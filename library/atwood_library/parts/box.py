"""Box: a solid box."""

from __future__ import annotations

from atwood import Frame, Outline, Placement, Scalar, Vector, connector, joint, parameter
from atwood_library.interfaces.shape import Shape, diagonal
from atwood_library.interfaces.solid import Tensor


class Box(Shape):
    """A solid box with its edges along the axes of its frame, which is at its centre.

    Its moments of inertia are ``m (b^2 + c^2)/12`` and so on. Frames a and b are in the middles of its faces at -x and
    +x. In a plane `length_y` is its thickness, which counts for its mass where the density is given.
    """

    synonyms = ("BodyBox", "Cuboid")

    length_x: float = parameter(1.0, unit="m", above=0.0, doc="Length along x, from a to b.")
    length_y: float = parameter(1.0, unit="m", above=0.0, doc="Length along y.")
    length_z: float = parameter(1.0, unit="m", above=0.0, doc="Length along z.")
    a: Frame = connector(Frame, "The middle of the face at -x.")
    b: Frame = connector(Frame, "The middle of the face at +x.")

    def volume(self) -> Scalar:
        """Return the volume."""
        return self.length_x * self.length_y * self.length_z

    def gyration(self) -> Tensor:
        """Return the inertia per mass."""
        x, y, z = (side * side for side in (self.length_x, self.length_y, self.length_z))
        return diagonal((y + z) / 12.0, (z + x) / 12.0, (x + y) / 12.0)

    @joint("frame", "a", rigid=True, spaces=("line", "plane", "space"))
    def near_face(self) -> Placement:
        """Place a in the axes of the frame."""
        return Placement(Vector(-0.5 * self.length_x, 0.0, 0.0), 0.0, axes="a")

    @joint("frame", "b", rigid=True, spaces=("line", "plane", "space"))
    def far_face(self) -> Placement:
        """Place b in the axes of the frame."""
        return Placement(Vector(0.5 * self.length_x, 0.0, 0.0), 0.0, axes="a")

    def outline(self) -> Outline:
        """Return what it looks like."""
        return Outline.box(self.length_x, self.length_y, self.length_z)
