"""Twisted: what acts on, or measures, the angle between two frames about an axis."""

from __future__ import annotations

from atwood import Component, Frame, Scalar, Triple, as_vector, connector, parameter
from atwood_library.interfaces.bearings import twist_about, twist_rate


class Twisted(Component):
    """Two frames and the angle of b from a about an axis.

    In space the angle is the twist about the axis (`atwood_library.interfaces.bearings.twist_about`).
    """

    spaces = ("plane", "space")

    axis: Triple = parameter(
        (0.0, -1.0, 0.0),
        turning=True,
        doc="Axis in both frames; the angle is right-handed about it, so counter-clockwise in a plane unless reversed.",
    )
    a: Frame = connector(Frame, "The frame that the angle is measured from.")
    b: Frame = connector(Frame, "The frame that turns.")

    def twist(self) -> Scalar:
        """Return the angle about the axis, rad."""
        if self.in_space:
            return twist_about(self.a, self.b, as_vector(self.axis))
        return -as_vector(self.axis).y * (self.b.angle - self.a.angle)

    def twisting(self) -> Scalar:
        """Return the rate of the angle, rad/s."""
        return twist_rate(self.a, self.b, as_vector(self.axis), self.in_space)
