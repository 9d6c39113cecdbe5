"""Charge: a charged point in an electromagnetic field given by its potentials."""

from __future__ import annotations

from typing import Any

from atwood import (
    Component,
    Number,
    Point,
    Scalar,
    Vector,
    connector,
    cross,
    dot,
    lagrangian,
    observable,
    parameter,
    potential,
)

PLACE_AND_TIME = {"x": "m", "y": "m", "z": "m", "t": "s"}
"""What fields are functions of: the position in world axes, and time."""


class Charge(Component):
    """A point charge in an electromagnetic field, given by the potentials phi and A of place and time.

    Its Lagrangian is ``q (v . A - phi)`` (Goldstein, section 1.5), so that whatever carries it has the canonical
    momentum ``m v + q A`` besides what other parts add, and what the potentials do not depend on is conserved. The
    gauge makes no difference to the motion. In a plane, y is zero and a magnetic field along y bends the path.
    """

    synonyms = ("Charged particle", "Electromagnetic potentials", "Generalized potential")

    charge: Number = parameter(1.0, unit="C", doc="Charge.")
    scalar_potential: Any = parameter(0.0, unit="V", function_of=PLACE_AND_TIME, doc="Electric potential phi.")
    vector_potential: Any = parameter(
        (0.0, 0.0, 0.0), unit="Wb/m", size=3, function_of=PLACE_AND_TIME, doc="Vector potential A in world axes."
    )
    point: Point = connector(Point, "The point that is charged.")

    def at(self, field: str, by: str = "") -> Scalar | Vector:
        """Return a potential at the charge, or its partial derivative by a coordinate or by time."""
        function = getattr(self, field)
        r = self.point.position
        return (function.derivative(by) if by else function)(r.x, r.y, r.z, self.time)

    @potential
    def electric_energy(self) -> Scalar:
        """Return ``q phi``."""
        return self.charge * self.at("scalar_potential")

    @lagrangian
    def magnetic_term(self) -> Scalar:
        """Return ``q v . A``."""
        return self.charge * dot(self.point.velocity, self.at("vector_potential"))

    @observable(unit="V/m", doc="Electric field at the charge, in world axes.")
    def electric_field(self) -> Vector:
        """Return ``-grad phi - dA/dt``."""
        slope = Vector(*(self.at("scalar_potential", axis) for axis in "xyz"))
        field: Vector = -slope - self.at("vector_potential", "t")
        return field

    @observable(unit="T", doc="Magnetic field at the charge, in world axes.")
    def magnetic_field(self) -> Vector:
        """Return ``curl A``."""
        by_x, by_y, by_z = (self.at("vector_potential", axis) for axis in "xyz")
        return Vector(by_y.z - by_z.y, by_z.x - by_x.z, by_x.y - by_y.x)

    @observable(unit="T", doc="Magnetic field at the charge along y, which is across a plane.")
    def magnetic_field_y(self) -> Scalar:
        """Return ``dA_x/dz - dA_z/dx``."""
        return self.at("vector_potential", "z").x - self.at("vector_potential", "x").z

    @observable(unit="N", doc="Force on the charge, in world axes.")
    def force(self) -> Vector:
        """Return ``q (E + v x B)``."""
        whole: Vector = (self.electric_field() + cross(self.point.velocity, self.magnetic_field())) * self.charge
        return whole

    @observable(unit="kg*m/s", doc="Canonical momentum of the body that carries it, as a point mass, in world axes.")
    def canonical_momentum(self) -> Vector:
        """Return ``m v + q A``."""
        momentum: Vector = self.point.velocity * self.point.mass + self.at("vector_potential") * self.charge
        return momentum
