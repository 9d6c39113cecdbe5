"""Small oscillations in symbols (Goldstein, chapter 6): ``det(V - omega^2 T) = 0``, frequencies, vectors and motions.

With velocity terms, as of rotating frames, magnetic fields and damping, motions ``exp(s t)`` fulfil
``det(s^2 M + s C + K) = 0``.
"""

from __future__ import annotations

from collections.abc import Mapping

from atwood.lazy_dataclasses import dataclass
from atwood.table import Shown
from atwood.theory.formulas.printers import Sympy
from atwood.theory.oscillations.conditions import Solution
from atwood.theory.oscillations.rest import PlainEquations


@dataclass(frozen=True, eq=False)
class SymbolicMode:
    """A normal mode in symbols.

    Attributes
    ----------
    square
        omega^2; None where the characteristic polynomial has no roots in closed form.
    shapes
        For each independent shape the amplitude of every coordinate, by path.
    polynomial
        The factor of the characteristic polynomial, in ``lambda = omega^2``, that omega^2 is a root of.
    number
        The angular frequency with the values of the scene, rad/s; imaginary where the mode grows.
    """

    square: Sympy | None
    shapes: tuple[Mapping[str, Sympy], ...]
    polynomial: Sympy
    number: tuple[complex, ...]

    @property
    def angular_frequency(self) -> Sympy | None:
        """omega, rad/s."""
        import sympy

        return None if self.square is None else sympy.sqrt(self.square)


@dataclass(frozen=True, eq=False)
class SymbolicModes(Shown):
    """Small oscillations about a state of rest, in symbols.

    Attributes
    ----------
    values
        The state of rest, by path.
    conditions
        Where in the parameters it exists.
    """

    plain: PlainEquations
    solution: Solution
