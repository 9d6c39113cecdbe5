"""PositionSensor: position and velocity of a point."""

from __future__ import annotations

from atwood import Component, Point, Vector, connector, observable


class PositionSensor(Component):
    """Measures the position and the velocity of a point, in world axes; it does not act on it."""

    synonyms = ("AbsolutePosition", "AbsoluteSensor")

    point: Point = connector(Point, "The point that is measured.")

    @observable(unit="m", doc="Position in world axes.")
    def position(self) -> Vector:
        """Return the position."""
        return self.point.position

    @observable(unit="m/s", doc="Velocity in world axes.")
    def velocity(self) -> Vector:
        """Return the velocity."""
        return self.point.velocity
