"""FreeJoint: no constraint at all."""

from __future__ import annotations

from atwood import FREE, Component, Frame, Placement, Scalar, Vector, connector, joint, observable
from atwood_library.interfaces.bearings import velocity_seen


class FreeJoint(Component):
    """Two frames that move freely against each other: it holds nothing, and says where b is as seen from a.

    A body that hangs on it has coordinates relative to frame a, which suits what moves along with a carrier.
    """

    synonyms = ("FreeMotion", "Six-degree-of-freedom joint", "FreeMotionScalarInit")

    a: Frame = connector(Frame, "The frame that carries the joint.")
    b: Frame = connector(Frame, "The frame that moves.")

    @joint("a", "b", coordinates=("x", "y", "z"), spaces=("space",))
    def float_in_space(self, x: Scalar, y: Scalar, z: Scalar) -> Placement:
        """Place b anywhere; how it is turned is its own affair."""
        return Placement(Vector(x, y, z), FREE, axes="a")

    @observable(unit="m", doc="First component of the position of b, in the axes of a.", spaces=("space",))
    def x(self) -> Scalar:
        """Return the component."""
        return self.a.to_frame(self.b.position - self.a.position).x

    @observable(unit="m", doc="Second component of the position of b, in the axes of a.", spaces=("space",))
    def y(self) -> Scalar:
        """Return the component."""
        return self.a.to_frame(self.b.position - self.a.position).y

    @observable(unit="m", doc="Third component of the position of b, in the axes of a.", spaces=("space",))
    def z(self) -> Scalar:
        """Return the component."""
        return self.a.to_frame(self.b.position - self.a.position).z

    @observable(unit="m/s", doc="Velocity of b as seen from frame a, in the axes of a.", spaces=("space",))
    def velocity(self) -> Vector:
        """Return the velocity."""
        return self.a.to_frame(velocity_seen(self.a, self.b))
