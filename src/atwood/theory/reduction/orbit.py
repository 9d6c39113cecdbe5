"""Formulas of the problem of one coordinate: the orbit, its elements, period and advance, the angle of scattering."""

from __future__ import annotations

from collections.abc import Mapping

from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.formulas.printers import Sympy
from atwood.theory.hamiltonian.closed_forms import Quadrature
from atwood.theory.hamiltonian.tidied import tidied


@dataclass(frozen=True, eq=False)
class RadialFormulas:
    """What follows from ``mu s'^2/2 + U = E`` in closed form, in terms of E, momenta and parameters.

    Attributes
    ----------
    coordinate
        Symbol of the coordinate that is left.
    inertia, potential
        mu and the effective potential.
    ignorable
        Symbols of the other coordinates, with their momenta.
    values
        Values of all symbols at the start; that of E, too.
    """

    coordinate: Sympy
    inertia: Sympy
    potential: Sympy
    ignorable: Mapping[Sympy, Sympy]
    values: Mapping[Sympy, float]

    @property
    def quadrature(self) -> Quadrature:
        """The integral of ``mu s'`` over s."""
        terms = (2 * self.inertia * one for one in sympy.Add.make_args(sympy.Symbol("E") - self.potential))
        return Quadrature(sympy.Add(*map(tidied, terms)), self.coordinate, self.values)

    @property
    def orbit(self) -> dict[Sympy, Sympy]:
        """The coordinate as a function of each of the others, counted from a turning point: ``r(phi)``."""
        of, made = self.quadrature, {}
        for c, p in self.ignorable.items():
            found = of.inverse(p, c - sympy.Symbol(f"{c}_0")) if of.square.has(p) else None
            if found is not None:
                made[c] = found
        return made

    @property
    def elements(self) -> dict[str, Sympy]:
        """Semi-latus rectum, eccentricity and semi-major axis, where the orbit is a conic about its focus."""
        of = self.quadrature
        if of.conic is None:
            return {}
        a, b, c = of.conic
        b = b if self._number(b) > 0.0 else -b
        found = {"semi_latus_rectum": tidied(-2 * a / b, of.known), "eccentricity": of.root(1 - 4 * a * c / b**2)}
        axis = tidied(-b / (2 * c), of.known) if c != 0 else sympy.oo
        return {**found, "semi_major_axis": axis if self._number(c) < 0.0 else -axis}

    @property
    def period(self) -> Sympy | None:
        """The time from one turning point to the other and back."""
        return self.quadrature.turn(sympy.Symbol("E"))

    @property
    def advance(self) -> dict[Sympy, Sympy]:
        """How far the others go in a period."""
        made = {c: self.quadrature.turn(p) for c, p in self.ignorable.items() if self.quadrature.square.has(p)}
        return {c: -one for c, one in made.items() if one is not None}

    @property
    def action(self) -> Sympy | None:
        """The action variable: the integral of the momentum over a period."""
        return self.quadrature.turn()

    @property
    def scattering_angle(self) -> Sympy | None:
        """By how much the direction of an unbounded motion changes, where it is an orbit about a centre."""
        every = (self.quadrature.unbound(p) for p in self.ignorable.values() if self.quadrature.square.has(p))
        found = [one for one in every if one is not None]
        if len(found) != 1:
            return None
        off = sympy.pi - (found[0] if self._number(found[0]) > 0.0 else -found[0])
        return off if self._number(off) > 0.0 else -off

    def __repr__(self) -> str:
        return f"<RadialFormulas of {self.coordinate}>"

    def _number(self, value: Sympy) -> float:
        return float(value.xreplace({one: sympy.Float(known) for one, known in self.values.items()}).evalf())
