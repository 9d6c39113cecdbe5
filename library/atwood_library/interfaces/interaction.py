"""Interaction: what points do to each other at a distance."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from atwood import Component, Number, Outline, Point, Scalar, Vector, norm, observable, parameter, potential

__all__ = ["Interaction"]

GRAVITATIONAL_CONSTANT = 6.67430e-11
"""m^3/(kg s^2), CODATA 2018."""
COULOMB_CONSTANT = 8.9875517923e9
"""N m^2/C^2, CODATA 2018."""


class Interaction(Component):
    """An energy of each of several pairs of points that depends on their distance; `pairs` says which.

    By ``law="gravity"`` it is ``-G m1 m2 / r`` with the masses of the bodies that the points are on, by
    ``law="coulomb"`` it is ``k q1 q2 / r``, by ``law="function"`` any function of the distance r and of time.
    """

    law: str = parameter("gravity", choices=("gravity", "coulomb", "function"), doc="What it is.")
    energy_function: Any = parameter(
        0.0, unit="J", function_of={"r": "m", "t": "s"}, doc="For a function: energy of a pair at the distance r."
    )
    gravitational_constant: Number = parameter(
        GRAVITATIONAL_CONSTANT, unit="m^3/(kg*s^2)", doc="For gravity: the constant G; negative to repel."
    )
    coulomb_constant: Number = parameter(
        COULOMB_CONSTANT, unit="N*m^2/C^2", minimum=0.0, doc="For charges: the constant k, ``1/(4 pi epsilon)``."
    )

    def outline(self) -> Outline:
        """Return what it looks like: nothing, since it acts through empty space."""
        return Outline.nothing()

    def pairs(self) -> Iterator[tuple[Point, Point, Scalar]]:
        """Yield the pairs, with the product of their charges."""
        raise NotImplementedError

    def of_pair(self, a: Point, b: Point, charges: Scalar) -> Scalar:
        """Return the energy of a pair."""
        r = norm(b.position - a.position)
        if self.law == "gravity":
            return -(self.gravitational_constant * (a.mass * b.mass)) / r
        if self.law == "coulomb":
            return self.coulomb_constant * charges / r
        return self.energy_function(r, self.time)

    def pull(self, a: Point, b: Point, charges: Scalar) -> Vector:
        """Return the force on b in world axes."""
        arm = b.position - a.position
        r = norm(arm)
        if self.law == "gravity":
            slope = self.gravitational_constant * (a.mass * b.mass) / (r * r)
        elif self.law == "coulomb":
            slope = -(self.coulomb_constant * charges) / (r * r)
        else:
            slope = self.energy_function.derivative("r")(r, self.time)
        force: Vector = arm * (-1.0 * slope / r)
        return force

    @potential
    def interaction_energy(self) -> Scalar:
        """Return the energy of all pairs."""
        total: Scalar = 0.0
        for a, b, charges in self.pairs():
            total = total + self.of_pair(a, b, charges)
        return total

    @observable(unit="J", doc="Potential energy.")
    def energy(self) -> Scalar:
        """Return the energy."""
        return self.interaction_energy()
