"""Potential: an energy that depends on where a point is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from atwood import Component, Frame, Point, Scalar, Vector, connector, observable, parameter, potential
from atwood_library.fields.charge import PLACE_AND_TIME


class Potential(Component):
    """A potential energy V of the place of a point and of time; the force is minus its gradient.

    (Goldstein, section 1.2.) The place is that in world axes, or with ``seen_from="frame"`` in the axes of a frame that
    may move, which then feels the reaction. What is given for each kilogram, as a field of gravity is, counts for the
    mass of the body that the point is on.
    """

    synonyms = ("External potential", "Force field", "Potential well")

    energy_function: Any = parameter(0.0, unit="J", function_of=PLACE_AND_TIME, doc="Potential energy V.")
    energy_per_mass: Any = parameter(
        0.0, unit="J/kg", function_of=PLACE_AND_TIME, doc="Potential energy for each kilogram, besides V."
    )
    seen_from: str = parameter("world", choices=("world", "frame"), doc="In whose axes the place is.")
    frame: Frame = connector(Frame, "The frame that carries the field.", when={"seen_from": ("frame",)})
    point: Point = connector(Point, "The point that the field acts on.")

    def place(self) -> Vector:
        """Return where the point is."""
        if self.seen_from == "world":
            return self.point.position
        return self.frame.to_frame(self.point.position - self.frame.position)

    @potential
    def field_energy(self) -> Scalar:
        """Return the energy."""
        return self.summed(lambda function, r: function(r.x, r.y, r.z, self.time))

    def summed(self, value: Callable[[Any, Vector], Scalar]) -> Scalar:
        """Return something of the energy function, and as much of the other as the point has mass."""
        r, whole, of_mass = self.place(), self.energy_function, self.energy_per_mass
        found = value(whole, r)
        return found if of_mass.is_zero else found + value(of_mass, r) * self.point.mass

    @observable(unit="J", doc="Potential energy of the point.")
    def energy(self) -> Scalar:
        """Return the energy."""
        return self.field_energy()

    @observable(unit="N", doc="Force on the point, in world axes.")
    def force(self) -> Vector:
        """Return minus the gradient."""
        slope: Vector = self.summed(
            lambda function, r: Vector(*(function.derivative(axis)(r.x, r.y, r.z, self.time) for axis in "xyz"))
        )
        force = slope * -1.0
        return force if self.seen_from == "world" else self.frame.to_world(force)
