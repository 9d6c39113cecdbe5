"""Pulley: an ideal pulley, fixed or moving."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    Groove,
    Number,
    Placement,
    Point,
    PointInertia,
    Vector,
    connector,
    inertia,
    joint,
    observable,
    parameter,
)


class Pulley(Component):
    """An ideal pulley: small, without friction or rotational inertia, so a rope has one tension on both sides.

    Fixed if its centre is joined to the ground, moving if it is joined to anything else or to nothing.
    """

    mass: Number = parameter(0.0, unit="kg", minimum=0.0, doc="Mass of the pulley, taken at its centre.")
    center: Point = connector(Point, "The centre, where it is held.")
    groove: Groove = connector(Groove, "The groove, which takes a rope.")

    @inertia
    def material_point(self) -> Iterable[PointInertia]:
        """Return the inertia."""
        yield PointInertia((self.center,), ((self.mass,),))

    @joint("center", "groove", rigid=True, spaces=("line", "plane", "space"))
    def smallness(self) -> Placement:
        """Place the groove at the centre."""
        return Placement(Vector(0.0, 0.0, 0.0))

    @observable(unit="m", doc="Position of the centre in world axes.")
    def position(self) -> Vector:
        """Return the position."""
        return self.center.position

    @observable(unit="m/s", doc="Velocity of the centre in world axes.")
    def velocity(self) -> Vector:
        """Return the velocity."""
        return self.center.velocity
