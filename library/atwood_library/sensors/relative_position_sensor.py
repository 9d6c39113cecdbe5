"""RelativePositionSensor: where one point is, seen from another."""

from __future__ import annotations

from atwood import Point, Scalar, Vector, connector, observable
from atwood_library.interfaces.resolved import Resolved


class RelativePositionSensor(Resolved):
    """Measures where point b is, seen from point a, in the axes of any frame; it does not act on them."""

    synonyms = ("RelativePosition", "RelativeVelocity", "TransformRelativeVector", "Distance")

    a: Point = connector(Point, "The point that is measured from.")
    b: Point = connector(Point, "The point that is measured.")

    @observable(unit="m", doc="Position of b minus position of a.")
    def position(self) -> Vector:
        """Return the relative position."""
        return self.resolved(self.b.position - self.a.position)

    @observable(unit="m/s", doc="Velocity of b minus velocity of a, against the world.")
    def velocity(self) -> Vector:
        """Return the relative velocity."""
        return self.resolved(self.b.velocity - self.a.velocity)

    @observable(unit="m", doc="Distance of the points; on a line, positive in the order in which they start.")
    def distance_apart(self) -> Scalar:
        """Return the distance."""
        return self.distance(self.a, self.b)
