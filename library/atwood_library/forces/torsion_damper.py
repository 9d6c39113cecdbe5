"""TorsionDamper: a linear torsion damper."""

from __future__ import annotations

from atwood import Component, Frame, Scalar, connector, dissipation, observable, parameter


class TorsionDamper(Component):
    """A massless torsion damper between two frames, linear in the rate of the angle between them.

    Rayleigh function ``1/2 c w^2`` (Goldstein, section 1.5).
    """

    damping: float = parameter(1.0, unit="N*m*s/rad", minimum=0.0, doc="Torque for a rate of one radian a second.")
    a: Frame = connector(Frame, "The frame that the angle is measured from.")
    b: Frame = connector(Frame, "The other frame.")

    @dissipation
    def rayleigh_function(self) -> Scalar:
        """Return half the dissipated power."""
        rate = self.rate()
        return 0.5 * self.damping * rate * rate

    @observable(unit="rad/s", doc="Rate of the angle of frame b from frame a, counter-clockwise.")
    def rate(self) -> Scalar:
        """Return the rate of the angle; the rotation is about -y."""
        return self.a.angular_velocity.y - self.b.angular_velocity.y

    @observable(unit="N*m", doc="Torque on frame b, counter-clockwise.")
    def torque(self) -> Scalar:
        """Return the torque on frame b."""
        return -(self.damping * self.rate())
