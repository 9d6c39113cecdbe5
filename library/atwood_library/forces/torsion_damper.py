"""TorsionDamper: a linear torsion damper."""

from __future__ import annotations

from atwood import Number, Scalar, dissipation, observable, parameter
from atwood_library.interfaces.twisted import Twisted


class TorsionDamper(Twisted):
    """A massless torsion damper between two frames, linear in the rate of the angle between them about an axis.

    Rayleigh function ``1/2 c w^2`` (Goldstein, section 1.5). In space the rate is that of the twist about the axis, as
    in a `TorsionSpring`; where both frames share the axis it is the relative angular velocity along it.
    """

    synonyms = ("Rotational damper",)

    damping: Number = parameter(1.0, unit="N*m*s/rad", minimum=0.0, doc="Torque for a rate of one radian a second.")

    @dissipation
    def rayleigh_function(self) -> Scalar:
        """Return half the dissipated power."""
        rate = self.rate()
        return 0.5 * self.damping * rate * rate

    @observable(unit="rad/s", doc="Rate of the angle of frame b from frame a about the axis.")
    def rate(self) -> Scalar:
        """Return the rate of the angle."""
        return self.twisting()

    @observable(unit="N*m", doc="Torque on frame b about the axis.")
    def torque(self) -> Scalar:
        """Return the torque on frame b."""
        return -(self.damping * self.rate())
