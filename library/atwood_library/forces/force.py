"""Force: an applied force in a fixed direction."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import Component, Load, Point, Scalar, Vector, as_vector, connector, force, observable, parameter, signal


class Force(Component):
    """A force on a point, in a direction that is fixed in the world, with a value given as a function of time."""

    direction: tuple[float, float, float] = parameter((1.0, 0.0, 0.0), direction=True, doc="Direction in world axes.")
    value: float = signal(0.0, unit="N", doc="Force along the direction, a function of time.")
    point: Point = connector(Point, "Where the force acts.")

    @force
    def applied_force(self) -> Iterable[Load]:
        """Return the load."""
        yield Load(self.point, as_vector(self.direction) * self.value)

    @observable(unit="N", doc="Force along the direction.")
    def force(self) -> Scalar:
        """Return the force."""
        return self.value

    @observable(unit="m", doc="Where it acts.")
    def position(self) -> Vector:
        """Return the position."""
        return self.point.position
