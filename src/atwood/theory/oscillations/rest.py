"""Equations of motion near rest in symbols: what vanishes at rest, and its derivatives there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.numerics.rank import rank
from atwood.theory.equations.equations import EquationsOfMotion, read_equations
from atwood.theory.formulas.printers import Sympy, objects
from atwood.theory.oscillations.conditions import Solution
from atwood.theory.oscillations.spectrum import null_space, on_block, short


@dataclass(frozen=True, eq=False)
class PlainEquations:
    """Equations of motion on symbols that do not depend on time, parameters with the sign of their value.

    Attributes
    ----------
    equations
        Those of the scene.
    coordinates, velocities, accelerations, multipliers
        Their symbols, real.
    rows, constraints
        What is zero in every motion; functions of the coordinates that are.
    back
        For each symbol the one that people see.
    values
        Numbers of the parameters.
    """

    equations: EquationsOfMotion
    coordinates: tuple[Sympy, ...]
    velocities: tuple[Sympy, ...]
    accelerations: tuple[Sympy, ...]
    multipliers: tuple[Sympy, ...]
    rows: tuple[Sympy, ...]
    constraints: tuple[Sympy, ...]
    back: Mapping[Sympy, Sympy]
    values: Mapping[Sympy, float]

    @property
    def name(self) -> str:
        """What the scene is called."""
        return self.equations.name

    @cached_property
    def paths(self) -> tuple[str, ...]:
        """Paths of the coordinates."""
        return tuple(one.name for one in self.equations.expressions.names)

    @cached_property
    def is_angle(self) -> tuple[bool, ...]:
        """Whether each coordinate comes back after a turn."""
        return tuple(one.unit == "rad" for one in self.equations.expressions.names)

    @cached_property
    def conditions(self) -> tuple[Sympy, ...]:
        """What is zero at rest: forces, and constraints."""
        still = dict.fromkeys((*self.velocities, *self.accelerations), sympy.Integer(0))
        return (*(one.xreplace(still) for one in self.rows), *self.constraints)

    def number(self, value: Sympy) -> complex:
        """Return an expression with the values of the scene."""
        return complex(self.exact(value).evalf(20))

    def exact(self, value: Sympy) -> Sympy:
        """Return an expression with the values of the scene in place of the parameters."""
        return sympy.sympify(value).xreplace(self._exact)

    @cached_property
    def _exact(self) -> Mapping[Sympy, Sympy]:
        return {symbol: sympy.Float(value, 20) for symbol, value in self.values.items()}

    def holds(self, condition: Sympy) -> bool:
        """Return whether a condition is fulfilled with the values of the scene."""
        return bool(self.exact(condition))

    def place(self, coordinate: Sympy, value: Sympy) -> float:
        """Return the number of a coordinate, angles within half a turn."""
        found = self.number(value).real
        if self.is_angle[self.coordinates.index(coordinate)]:
            found = np.pi - (np.pi - found) % (2.0 * np.pi)
        return float(found)

    def letter(self, path: str) -> Sympy:
        """Return the symbol that people see of a coordinate."""
        return self.back[self.coordinates[self.paths.index(path)]]

    def told(self, value: Sympy) -> Sympy:
        """Return an expression in the symbols that people see."""
        return value.xreplace(self.back) if hasattr(value, "xreplace") else value


def plain_equations(assembly: Assembly, symbols: Mapping[str, str] | None = None) -> PlainEquations:
    """Return the equations of motion on symbols that do not depend on time."""
    equations = read_equations(assembly, symbols=symbols)
    found, t = equations.expressions, sympy.Symbol("t")
    if not equations.is_readable:
        raise _refused(equations, "its equations are too long to be solved by hand", "Leave out `symbolic`.")
    if any(one.kind == "sampled value" for one in equations.legend):
        raise _refused(equations, "it holds values from sample to sample", "Leave out `symbolic`.")
    if any(place is None for place in found.moves) or len(found.velocities) != len(found.coordinates):
        advice = "Give it in Euler angles: atwood.assemble(scene, orientation='euler-zxz')."
        raise _refused(equations, "its velocities are not all derivatives of coordinates", advice)
    if not all(one.holonomic for one in found.constraints):
        raise _refused(equations, "it has constraints on velocities", "Leave out `symbolic`.")
    letters = equations.coordinates
    names = [str(one.func) for one in letters]
    q, u, a = (tuple(sympy.Dummy(one + dots, real=True) for one in names) for dots in ("", "'", "''"))
    held = tuple(sympy.Dummy(str(one.func), real=True) for one in equations.multipliers)
    moving: dict[Sympy, Sympy] = {}
    for one, *plain in zip(letters, u, a, strict=True):
        moving |= {one.diff(t): plain[0], one.diff(t, 2): plain[1]}
    by = dict(zip((*letters, *equations.multipliers), (*q, *held), strict=True))
    values: dict[Sympy, float] = {}
    for symbol in equations.legend:
        if symbol.value is not None:
            assumed = {"positive": True} if symbol.value > 0 else {"negative": True} if symbol.value < 0 else {}
            made = sympy.Symbol(symbol.name, real=True, **assumed)
            by[objects.letter(symbol)], values[made] = made, symbol.value
    rows, constraints = (
        tuple(one.xreplace(moving).xreplace(by) for one in every) for every in (equations.rows, equations.constraints)
    )
    if any(one.has(t) for one in (*rows, *constraints)):
        advice = "Rest belongs to scenes that keep still or turn evenly."
        raise _refused(equations, "its equations depend on time", advice)
    back = {plain: one for one, plain in by.items()}
    back |= {plain: sympy.Symbol(name) for plain, name in zip(q, names, strict=True)}
    return PlainEquations(equations, q, u, a, held, rows, constraints, back, values)


def _refused(equations: EquationsOfMotion, text: str, advice: str) -> UnsupportedError:
    return UnsupportedError(text, where=equations.name, advice=advice)


@dataclass(frozen=True, eq=False)
class Expansion:
    """Equations of motion to first order about a state of rest, ``M z'' + C z' + K z = 0``.

    Attributes
    ----------
    solution
        The state.
    mass, damping, stiffness
        M, C and K on independent deviations z.
    basis
        Deviations of all coordinates by those that are independent, as columns.
    independent
        Numbers of the coordinates whose deviations are independent.
    """

    solution: Solution
    mass: Sympy
    damping: Sympy
    stiffness: Sympy
    basis: Sympy
    independent: tuple[int, ...]


def expand(plain: PlainEquations, solution: Solution) -> Expansion | None:
    """Return equations of motion to first order about a state of rest; None where coordinates are singular there."""
    if is_singular(plain, solution):
        return None
    by = dict(solution.values)
    still = dict.fromkeys((*plain.velocities, *plain.accelerations), sympy.Integer(0))

    def there(values: Sequence[Sympy], unknowns: Sequence[Sympy]) -> Sympy:
        entries = [sympy.expand_trig(one.diff(x).xreplace(still)).subs(by) for one in values for x in unknowns]
        return sympy.Matrix(len(values), len(unknowns), [short(_signed(one, solution.positive)) for one in entries])

    q = plain.coordinates
    slopes = there(plain.constraints, q)
    basis, independent = null_space(slopes) if plain.constraints else (sympy.eye(len(q)), tuple(range(len(q))))
    mass, damping = there(plain.rows, plain.accelerations), there(plain.rows, plain.velocities)
    stiffness = there(plain.conditions[: len(q)], q)
    mass, damping, stiffness = (on_block(one, basis) for one in (mass, damping, stiffness))
    return Expansion(solution, mass, damping, stiffness, basis, independent)


def _signed(value: Sympy, positive: Sequence[Sympy]) -> Sympy:
    """Return an expression in which magnitudes and signs of what is positive, or of its opposite, are known."""

    def turned(inside: Sympy) -> int:
        shares = ((inside / one).cancel() for one in positive)
        return next((1 if share.is_positive else -1 for share in shares if share.is_positive or share.is_negative), 0)

    def bare(inside: Sympy) -> Sympy:
        return turned(inside) * inside or abs(inside)

    def sign(inside: Sympy) -> Sympy:
        return turned(inside) or sympy.sign(inside)

    return value.replace(sympy.Abs, bare).replace(sympy.sign, sign) if positive else value


_ASIDE = 1e-3
"""So far from a state, in radians and metres, it is looked whether it is a singular one."""


def is_singular(plain: PlainEquations, solution: Solution, of_pole: bool = False) -> bool:
    """Return whether masses or constraints lose rank at a state of rest, with the values of the scene.

    At the pole of some coordinates, one of which may be anything there, rest is rest all the same: then only what keeps
    its meaning is looked at.
    """
    free = {one for one in solution.free if of_pole}
    kept = [k for k, one in enumerate(plain.coordinates) if one not in free]
    at = {**dict.fromkeys(solution.free, sympy.Float(0.3)), **solution.values}
    there = {one: at[one].subs(at) for one in (*plain.coordinates, *plain.multipliers)}
    aside = {one: value + _ASIDE * (k + 1) for k, (one, value) in enumerate(there.items())}
    return _rank(plain, there, kept) < _rank(plain, aside, kept)


def _rank(plain: PlainEquations, there: Mapping[Sympy, Sympy], kept: Sequence[int]) -> int:
    """Return the rank of masses bordered by the slopes of constraints."""
    n, m = len(kept), len(plain.constraints)
    matrix = np.zeros((n + m, n + m), dtype=complex)
    for i, k in enumerate(kept):
        for j, other in enumerate(kept):
            matrix[i, j] = plain.number(plain.rows[k].diff(plain.accelerations[other]).subs(there))
        for j, one in enumerate(plain.constraints):
            matrix[i, n + j] = matrix[n + j, i] = plain.number(one.diff(plain.coordinates[k]).subs(there))
    size: FloatArray = np.sqrt(np.abs(matrix).max(axis=1, initial=0.0))
    size[size == 0.0] = 1.0
    scaled = matrix / np.outer(size, size)
    return rank(np.block([[scaled.real, -scaled.imag], [scaled.imag, scaled.real]]), 1e-9)
