"""PositionSensor: position, velocity and acceleration of a point."""

from __future__ import annotations

from atwood import Point, Vector, connector, observable
from atwood_library.interfaces.resolved import Resolved


class PositionSensor(Resolved):
    """Measures position, velocity and acceleration of a point against the world, in the axes of any frame.

    It does not act on the point. What an observer on a frame sees that moves with it is measured by a `FrameSensor`.
    """

    synonyms = ("AbsolutePosition", "AbsoluteVelocity", "AbsoluteSensor", "TransformAbsoluteVector", "Accelerometer")

    point: Point = connector(Point, "The point that is measured.")

    @observable(unit="m", doc="Position.")
    def position(self) -> Vector:
        """Return the position."""
        return self.resolved(self.point.position)

    @observable(unit="m/s", doc="Velocity against the world.")
    def velocity(self) -> Vector:
        """Return the velocity."""
        return self.resolved(self.point.velocity)

    @observable(unit="m/s^2", doc="Acceleration against the world.")
    def acceleration(self) -> Vector:
        """Return the acceleration."""
        return self.resolved(self.point.acceleration)
