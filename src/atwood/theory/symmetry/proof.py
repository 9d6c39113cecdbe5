"""Proofs that quantities are conserved: identities between their rates and the equations of motion.

``dC/dt - sum w_k (row_k - G^T lambda)_k = 0`` in all coordinates, velocities, accelerations and multipliers.
The expression is written as a polynomial; divisions are cleared by what was divided by, squares of roots are what is
under the root, and sines and cosines are brought to the one form that each polynomial in them has. What is zero then is
zero identically, up to rounding of the numbers that laws and directions contain.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from enum import IntEnum
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, count_operations, jvp, substitute
from atwood.expr.simplify.polynomial import (
    Atom,
    Effort,
    Expansion,
    Monomial,
    Polynomial,
    TooLargeError,
    add_polynomials,
    expand,
    multiply_monomials,
    multiply_polynomials,
)
from atwood.expr.simplify.trigonometry import sum_of_waves, without_squares
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.outputs.totals import add_up
from atwood.numerics.matrices import least_norm, least_squares, or_one
from atwood.simulation.dynamics.scales import motion_scales, scene_length
from atwood.theory.formulas.notation import Notation
from atwood.theory.symmetry.quantities import Quantities
from atwood.theory.symmetry.states import State

Generator: TypeAlias = "Mapping[int, Expression] | None"
"""Displacements along speeds by number; None where they are not known as formulas."""

_COORDINATES, _OPERATIONS = 12, 1_500
"""Beyond either nothing is proven on the graph."""

_FITTED = 1e-9
"""Relative: how well displacements must be what was fitted to them."""

_SHARES = 64
"""Coefficients of displacements are multiples of one over this, where they are as near to them as that."""


class Proof(IntEnum):
    """For which parameters something is proven: for none, for the values of the scene, or for all."""

    NONE, VALUES, ALL = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Prover:
    """Proves identities of one scene.

    Attributes
    ----------
    quantities
        The quantities of the scene.
    notation
        Says which parameters are equal.
    """

    quantities: Quantities
    notation: Notation

    @cached_property
    def is_small(self) -> bool:
        """Whether the scene is small enough for proofs."""
        found = self.quantities.found
        many = sum(count_operations(list(found.rows), self.quantities.assembly.parameters).values())
        return len(found.coordinates) <= _COORDINATES and many <= _OPERATIONS

    @property
    def why_not(self) -> str:
        """Why something is not proven."""
        return "no proof was found" if self.is_small else "too large to be proven on the graph"

    @cached_property
    def angles(self) -> tuple[Expression, ...]:
        """The coordinates that are angles."""
        found = self.quantities.found
        return tuple(q for q, one in zip(found.coordinates, found.names, strict=True) if one.unit == "rad")

    def is_zero(self, value: Expression) -> Proof:
        """Return whether an expression is proven to be zero: for all parameters, or for those of the scene."""
        if value.is_zero:
            return Proof.ALL
        if not self.is_small:
            return Proof.NONE
        merged: dict[Expression, Expression | float] = dict(self.notation.merged)
        if is_proven_zero(substitute([value], merged)[0] if merged else value, self.angles):
            return Proof.ALL
        numbers: dict[Expression, Expression | float] = dict(self.quantities.assembly.mechanism.table.values)
        return Proof.VALUES if is_proven_zero(substitute([value], numbers)[0], self.angles) else Proof.NONE

    def evidence(self, proof: Proof, states: int, when: str = "") -> str:
        """Return how a quantity is known, in words: proven, or checked at so many states."""
        if not proof:
            return f"checked at {states} random states{when} ({self.why_not})"
        return "proven on the graph" + (", for these values of the parameters" if proof is Proof.VALUES else "")

    def along(self, value: Expression, generator: Generator, with_rates: bool = False) -> Proof:
        """Return whether a quantity is proven to be conserved."""
        return Proof.NONE if generator is None else self.is_zero(self.rest(value, generator, with_rates))

    def rest(self, value: Expression, generator: Mapping[int, Expression], with_rates: bool = False) -> Expression:
        """Return what is left of the rate of a quantity without the equations of motion times displacements."""
        found = self.quantities.found
        terms = [jvp([value], found.course)[0]]
        terms += [w * (found.constraint_rows[k] - found.rows[k]) for k, w in generator.items()]
        if with_rates:
            terms += [-(one.multiplier * one.rate) for one in found.constraints]
        return add_up(terms)

    def of_motion(self, value: Expression, generator: Generator) -> Proof:
        """Return whether a quantity is proven to be conserved, with displacements along the speeds of states."""
        if generator is None or not self.is_small:
            return Proof.NONE
        e = self.quantities.found.equations
        [value] = self.quantities.on_speeds([value])
        rows = e.rows_with_multipliers or e.rows
        pairs = [
            (w, rows[k], e.constraint_rows[k] if e.constraint_rows else e.graph.zero) for k, w in generator.items()
        ]
        return self.is_zero(add_up([jvp([value], e.course)[0], *(w * (held - row) for w, row, held in pairs)]))

    # -- displacements as formulas ------------------------------------------------------------------------------------

    def fitted(self, states: Sequence[State], moved: Sequence[FloatArray]) -> Generator:
        """Fit a generator to displacements: affine in coordinates, for orientations a rotation about an axis."""
        e = self.quantities.found.equations
        if not self.is_small:
            return None
        turned = {i for one in e.orientation_coordinates for i in one.coordinates}
        plain = [i for i in range(e.placing) if i not in turned]
        if len(states) < len(plain) + 3:
            return None
        affine = np.array([[1.0, *(one.q[i] for i in plain)] for one in states])
        symbols = [e.graph.one, *(e.coordinates[i] for i in plain)]
        spins = {k for one in e.orientation_coordinates for k in one.speeds}
        sizes = motion_scales(e, scene_length(self.quantities.assembly))
        largest = max(float(np.max(np.abs(one) / sizes, initial=0.0)) for one in moved)
        found: dict[int, Expression] = {}
        for k in range(len(e.speeds)):
            if k not in spins:
                values = np.array([one[k] for one in moved])
                made = _fit(affine, values, symbols, largest * sizes[k])
                if made is None:
                    return None
                found[k] = made
        for orientation in e.orientation_coordinates:
            if orientation.kind != "quaternion" or len(orientation.speeds) != 3:
                return None
            own = list(orientation.coordinates)
            basis = [np.array([in_body(list(one.q[own]), axis) for axis in _AXES]).T for one in states]
            values = np.concatenate([one[list(orientation.speeds)] for one in moved])
            weights = least_squares(np.concatenate(basis), values)
            if np.max(np.abs(np.concatenate(basis) @ weights - values)) > _FITTED * largest:
                return None
            axis = [_share(w) for w in weights]
            turn = in_body([e.coordinates[i] for i in own], axis)
            found |= {k: e.graph.convert(w) for k, w in zip(orientation.speeds, turn, strict=True)}
        return {k: w for k, w in found.items() if not w.is_zero}


_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _fit(rows: FloatArray, values: FloatArray, symbols: Sequence[Expression], size: float) -> Expression | None:
    """Return values as a combination of symbols; None if they are none to so small a share of a size."""
    scales = or_one(np.max(np.abs(rows), axis=0))
    weights = least_norm(rows / scales, values) / scales
    if np.max(np.abs(rows @ weights - values), initial=0.0) > _FITTED * size:
        return None
    weights = np.where(np.abs(weights) * scales > _FITTED * size, weights, 0.0)
    return add_up([symbols[0].graph.zero, *(_share(w) * one for w, one in zip(weights, symbols, strict=True) if w)])


def _share(value: float) -> float:
    near = round(float(value) * _SHARES) / _SHARES
    return near if abs(value - near) <= _FITTED * max(abs(near), 1.0 / _SHARES) else float(value)


def in_body(quaternion: Sequence[Any], axis: Sequence[float]) -> list[Any]:
    """Return an axis of the space in the axes of a body, from its quaternion: of numbers, or of expressions."""
    w, v = quaternion[0], quaternion[1:]
    along = v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2]
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    size = w * w + square
    across = (
        v[1] * axis[2] - v[2] * axis[1],
        v[2] * axis[0] - v[0] * axis[2],
        v[0] * axis[1] - v[1] * axis[0],
    )
    return [((w * w - square) * axis[i] + 2.0 * along * v[i] - 2.0 * w * across[i]) / size for i in range(3)]


_TERMS, _BUDGET = 5_000, 150_000
"""Beyond so many terms, or operations on single ones, nothing is proven."""

_ROUNDS = 12
"""How often roots and divisors that stand inside each other are looked into."""


def is_proven_zero(value: Expression, angles: Collection[Expression] = ()) -> bool:
    """Return whether an expression is proven to be zero identically."""
    if value.is_zero:
        return True
    try:
        return not normal_form(value, angles)[1]
    except TooLargeError:
        return False


def normal_form(value: Expression, angles: Collection[Expression] = ()) -> tuple[Expansion, Polynomial]:
    """Return an expression as a polynomial, times what it divides by: it is empty where the expression is zero.

    Raises
    ------
    TooLargeError
        If it would have too many terms.
    """
    expansion, inner = _expanded(value, angles)
    row = _cleared(expansion, expansion.rows[0], inner)
    for kind in ("sin", "cos"):
        row = row and without_squares(expansion, row, kind, _TERMS)
    return expansion, row and sum_of_waves(expansion, row, _TERMS)


def _expanded(value: Expression, angles: Collection[Expression]) -> tuple[Expansion, dict[Expression, Polynomial]]:
    """Return the polynomial of an expression, and those of what it divides by and of what stands under its roots."""
    inner: list[Expression] = []
    for _ in range(_ROUNDS):
        expansion = expand([value, *inner], tuple(angles), (), _TERMS, Effort(_BUDGET))  # parameters as any symbols
        asked = [one for one in map(_inside, expansion.atoms) if one is not None]
        new = [one for one in dict.fromkeys(asked) if one not in inner]
        if not new:
            return expansion, dict(zip(inner, expansion.rows[1:], strict=True))
        inner += new
    raise TooLargeError


def _inside(atom: Atom) -> Expression | None:
    """Return what an atom divides by, or has under its root."""
    if not isinstance(atom.argument, Expression):
        return None
    if atom.kind == "inverse":
        return atom.argument
    return atom.argument.arguments[0] if atom.argument.operation == "sqrt" and atom.kind == "node" else None


def _cleared(expansion: Expansion, row: Polynomial, inner: dict[Expression, Polynomial]) -> Polynomial:
    """Return a polynomial times what it divides by, without squares of roots."""
    for _ in range(4 * _ROUNDS):
        number = next((n for n, atom in enumerate(expansion.atoms) if _is_met(row, n) and _must_go(atom, row, n)), None)
        if number is None:
            return row
        atom = expansion.atoms[number]
        value = _inside(atom)
        assert value is not None
        highest = max(_power(monomial, number) for monomial in row)
        # Of an inverse, all terms are brought to its highest power; of a root, each pair is what is under it.
        power = {e: highest - e if atom.kind == "inverse" else e // 2 for e in range(highest + 1)}
        kept = {e: 0 if atom.kind == "inverse" else e % 2 for e in range(highest + 1)}
        total: Polynomial = {}
        powers = _powers(inner[value], max(power.values()))
        for e in range(highest + 1):
            own = {
                multiply_monomials(monomial, ((number, kept[e] - e),)) if kept[e] != e else monomial: coefficient
                for monomial, coefficient in row.items()
                if _power(monomial, number) == e
            }
            expansion.spend(len(own) * len(powers[power[e]]))
            total = add_polynomials(total, multiply_polynomials(own, powers[power[e]], _TERMS), 1.0)
        row = total
    raise TooLargeError


def _must_go(atom: Atom, row: Polynomial, number: int) -> bool:
    if _inside(atom) is None:
        return False
    return atom.kind == "inverse" or any(_power(monomial, number) > 1 for monomial in row)


def _is_met(row: Polynomial, number: int) -> bool:
    return any(_power(monomial, number) for monomial in row)


def _power(monomial: Monomial, number: int) -> int:
    return next((exponent for atom, exponent in monomial if atom == number), 0)


def _powers(base: Polynomial, highest: int) -> list[Polynomial]:
    found: list[Polynomial] = [{(): {(): 1.0}}]
    for _ in range(highest):
        found.append(multiply_polynomials(found[-1], base, _TERMS))
    return found
