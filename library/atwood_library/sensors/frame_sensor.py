"""FrameSensor: where a point is, as seen from a frame."""

from __future__ import annotations

from atwood import Component, Frame, Point, Vector, connector, cross, observable


class FrameSensor(Component):
    """Measures position and velocity of a point as seen from a frame that may move and turn. A part of space."""

    synonyms = ("RelativeSensor",)
    spaces = ("space",)

    frame: Frame = connector(Frame, "The frame of the observer.")
    point: Point = connector(Point, "The point that is measured.")

    @observable(unit="m", doc="Position of the point in the axes of the frame.", spaces=("space",))
    def position(self) -> Vector:
        """Return the position."""
        return self.frame.to_frame(self.point.position - self.frame.position)

    @observable(unit="m/s", doc="Velocity of the point as seen from the frame, in its axes.", spaces=("space",))
    def velocity(self) -> Vector:
        """Return the velocity less that of the frame's own points."""
        arm = self.point.position - self.frame.position
        carried = self.frame.velocity + cross(self.frame.angular_velocity, arm)
        return self.frame.to_frame(self.point.velocity - carried)
