"""AngleSensor: the angle between two frames about an axis."""

from __future__ import annotations

from atwood import Component, Frame, Scalar, as_vector, connector, observable, parameter
from atwood_library.interfaces.bearings import twist_about, twist_rate


class AngleSensor(Component):
    """Measures the angle of frame b from frame a about an axis; it does not act on them.

    In space it is the twist about the axis, as in a `TorsionSpring`; where both frames share the axis it is the angle
    between them.
    """

    spaces = ("plane", "space")

    axis: tuple[float, float, float] = parameter(
        (0.0, -1.0, 0.0),
        turning=True,
        doc="Axis in both frames; the angle is right-handed about it, so counter-clockwise in a plane unless reversed.",
    )
    a: Frame = connector(Frame, "The frame that the angle is measured from.")
    b: Frame = connector(Frame, "The frame that turns.")

    @observable(
        unit="rad",
        doc="Angle of frame b from frame a about the axis.",
        periodic=True,
        rate="angular_velocity",
        spaces=("plane", "space"),
    )
    def angle(self) -> Scalar:
        """Return the angle."""
        if self.in_space:
            return twist_about(self.a, self.b, as_vector(self.axis))
        return -as_vector(self.axis).y * (self.b.angle - self.a.angle)

    @observable(unit="rad/s", doc="Rate of the angle.", spaces=("plane", "space"))
    def angular_velocity(self) -> Scalar:
        """Return the rate of the angle."""
        return twist_rate(self.a, self.b, as_vector(self.axis), self.in_space)
