"""TorsionSpring: a linear torsion spring."""

from __future__ import annotations

from atwood import Component, Frame, Scalar, connector, observable, parameter, potential


class TorsionSpring(Component):
    """A massless torsion spring between two frames, linear in the angle between them.

    Potential energy ``1/2 c (phi - phi0)^2``. It acts on the orientations only; a `Pivot` keeps the frames together.
    """

    stiffness: float = parameter(1.0, unit="N*m/rad", minimum=0.0, doc="Torque for a twist by one radian.")
    natural_angle: float = parameter(0.0, unit="rad", doc="Angle without torque.")
    a: Frame = connector(Frame, "The frame that the angle is measured from.")
    b: Frame = connector(Frame, "The other frame.")

    @potential
    def elastic_energy(self) -> Scalar:
        """Return the elastic energy."""
        twist = self.b.angle - self.a.angle - self.natural_angle
        return 0.5 * self.stiffness * twist * twist

    @observable(unit="rad", doc="Angle of frame b from frame a, counter-clockwise.", spaces=("plane",))
    def angle(self) -> Scalar:
        """Return the angle."""
        return self.b.angle - self.a.angle

    @observable(unit="N*m", doc="Torque on frame b, counter-clockwise.", spaces=("plane",))
    def torque(self) -> Scalar:
        """Return the torque on frame b."""
        return -(self.stiffness * (self.b.angle - self.a.angle - self.natural_angle))
