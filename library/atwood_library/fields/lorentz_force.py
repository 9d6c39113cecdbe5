"""LorentzForce: a charged point in an electric and a magnetic field."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from atwood import Component, Load, Number, Point, Vector, connector, cross, force, observable, parameter
from atwood_library.fields.charge import PLACE_AND_TIME


class LorentzForce(Component):
    """The force ``q (E + v x B)`` on a point charge in fields E and B of place and time (Goldstein, section 1.5).

    Fields that have potentials are better given by these, as `Charge` takes them: then energy and canonical momentum
    are known. In a plane, only what acts within it counts.
    """

    synonyms = ("Charge in fields", "Electromagnetic force")

    charge: Number = parameter(1.0, unit="C", doc="Charge.")
    electric_field: Any = parameter(
        (0.0, 0.0, 0.0), unit="V/m", size=3, function_of=PLACE_AND_TIME, doc="Electric field E in world axes."
    )
    magnetic_field: Any = parameter(
        (0.0, 0.0, 0.0), unit="T", size=3, function_of=PLACE_AND_TIME, doc="Magnetic field B in world axes."
    )
    point: Point = connector(Point, "The point that is charged.")

    def lorentz(self) -> Vector:
        """Return the force."""
        r, v = self.point.position, self.point.velocity
        e, b = (field(r.x, r.y, r.z, self.time) for field in (self.electric_field, self.magnetic_field))
        force: Vector = (e + cross(v, b)) * self.charge
        return force

    @force
    def push(self) -> Iterable[Load]:
        """Return the load."""
        yield Load(self.point, self.lorentz())

    @observable(unit="N", doc="Force on the charge, in world axes.")
    def force(self) -> Vector:
        """Return the force."""
        return self.lorentz()
