"""PointMass: a material point."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import Component, Number, Point, PointInertia, Vector, connector, inertia, observable, parameter


class PointMass(Component):
    """A material point: it has mass and no size.

    Kinetic energy ``1/2 m v^2`` (Goldstein, Classical Mechanics, section 1.1); the weight is added by the scene.
    """

    synonyms = ("Particle", "Material point")

    mass: Number = parameter(1.0, unit="kg", minimum=0.0, doc="Mass.")
    point: Point = connector(Point, "Where the mass is.")

    @inertia
    def material_point(self) -> Iterable[PointInertia]:
        """Return the inertia."""
        yield PointInertia((self.point,), ((self.mass,),))

    @observable(unit="m", doc="Position in world axes.")
    def position(self) -> Vector:
        """Return the position."""
        return self.point.position

    @observable(unit="m/s", doc="Velocity in world axes.")
    def velocity(self) -> Vector:
        """Return the velocity."""
        return self.point.velocity

    @observable(unit="m/s^2", doc="Acceleration in world axes.")
    def acceleration(self) -> Vector:
        """Return the acceleration."""
        return self.point.acceleration
