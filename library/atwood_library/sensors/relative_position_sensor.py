"""RelativePositionSensor: where one point is, seen from another."""

from __future__ import annotations

from atwood import Component, Point, Scalar, Vector, connector, observable


class RelativePositionSensor(Component):
    """Measures where point b is, seen from point a, in world axes; it does not act on them."""

    synonyms = ("RelativePosition",)

    a: Point = connector(Point, "The point that is measured from.")
    b: Point = connector(Point, "The point that is measured.")

    @observable(unit="m", doc="Position of b minus position of a, in world axes.")
    def position(self) -> Vector:
        """Return the relative position."""
        return self.b.position - self.a.position

    @observable(unit="m/s", doc="Velocity of b minus velocity of a, in world axes.")
    def velocity(self) -> Vector:
        """Return the relative velocity."""
        return self.b.velocity - self.a.velocity

    @observable(unit="m", doc="Distance of the points; on a line, positive in the order in which they start.")
    def distance_apart(self) -> Scalar:
        """Return the distance."""
        return self.distance(self.a, self.b)
