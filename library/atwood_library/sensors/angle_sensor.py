"""AngleSensor: the angle between two frames about an axis."""

from __future__ import annotations

from atwood import Scalar, observable
from atwood_library.interfaces.twisted import Twisted


class AngleSensor(Twisted):
    """Measures the angle of frame b from frame a about an axis; it does not act on them.

    In space it is the twist about the axis, as in a `TorsionSpring`; where both frames share the axis it is the angle
    between them.
    """

    synonyms = ("RelativeAngles",)

    @observable(
        unit="rad",
        doc="Angle of frame b from frame a about the axis.",
        periodic=True,
        rate="angular_velocity",
        spaces=("plane", "space"),
    )
    def angle(self) -> Scalar:
        """Return the angle."""
        return self.twist()

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("plane", "space"))
    def angular_velocity(self) -> Scalar:
        """Return the rate of the angle."""
        return self.twisting()
