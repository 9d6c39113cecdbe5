"""Expressions as polynomials: the working form of :mod:`atwood.expr.simplify.collect`.

A polynomial maps monomials in atoms to coefficients, and a coefficient is again a polynomial, in parameter
atoms, whose exponents may be negative.  Keeping coefficients apart in this way lets equal terms meet and cancel
exactly, whatever the order in which their parameters were multiplied.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import field
from functools import partial
from typing import NamedTuple, TypeAlias

from atwood.expr.core.analysis import live, varying
from atwood.expr.core.graph import Expression
from atwood.lazy_dataclasses import dataclass

Monomial: TypeAlias = tuple[tuple[int, int], ...]
"""Pairs of an atom and its exponent, sorted by atom."""

Coefficient: TypeAlias = dict[Monomial, float]
"""A polynomial in parameter atoms."""

Polynomial: TypeAlias = dict[Monomial, Coefficient]
"""A polynomial in atoms that vary during a run."""

Wave: TypeAlias = tuple[int, ...]
"""How often each angle goes into the argument of a sine or cosine."""

ONE: Monomial = ()

_CANCELLED = 4e-15
"""Relative to the terms: a sum that is less is what some ten roundings of the machine left of zero."""


class TooLargeError(Exception):
    """The polynomial form has more terms than is worth while, or takes more work."""


def volume(polynomial: Polynomial) -> int:
    """Return the number of terms, with those in parameters counted singly."""
    return sum(map(len, polynomial.values()))


class Atom(NamedTuple):
    """Something that a polynomial does not look into.

    Attributes
    ----------
    kind
        ``"node"`` for a value, ``"inverse"`` for one over a value, ``"sin"`` or ``"cos"``.
    argument
        The value, or the argument of the sine or cosine: an expression, or a combination of angles.
    """

    kind: str
    argument: Expression | Wave


class Effort:
    """How many operations on single terms may still be spent, by one expansion or by many that share it."""

    def __init__(self, left: int, whole: Effort | None = None) -> None:
        self.left: int = left if whole is None else min(left, whole.left)
        self._whole = whole

    def spend(self, operations: int) -> None:
        """Take operations off, or raise if there are not so many left."""
        self.left -= operations
        if self._whole is not None:
            self._whole.left -= operations
        if self.left < 0:
            raise TooLargeError


@dataclass
class Expansion:
    """Polynomials and the atoms that they are about.

    Attributes
    ----------
    angles
        What sines and cosines of integer combinations are recognised for.
    atoms
        The atoms that vary, by number.
    constants
        The atoms that depend on parameters alone, by number.
    rows
        One polynomial for each expression that was expanded.
    effort
        What may still be spent: coefficients of general directions and positions have thousands of terms in parameters.
    taken
        What was taken whole, by its terms up to a factor: the value, and its first coefficient.
    """

    angles: tuple[Expression, ...]
    atoms: list[Atom] = field(default_factory=list)
    constants: list[Expression] = field(default_factory=list)
    rows: list[Polynomial] = field(default_factory=list)
    numbers: dict[Atom | Expression, int] = field(default_factory=dict)
    effort: Effort = field(default_factory=partial(Effort, 0))
    taken: dict[tuple[tuple[Monomial, float], ...], tuple[Expression, float]] = field(default_factory=dict)

    def spend(self, operations: int) -> None:
        """Take operations on single terms off what may be spent, or raise if there are not so many left."""
        self.effort.spend(operations)

    def taken_whole(self, node: Expression, coefficient: Coefficient) -> Coefficient:
        """Return a coefficient as an atom, or as a multiple of one that was taken before."""
        terms = sorted(coefficient.items())
        leading = terms[0][1]
        shape = tuple((monomial, value / leading) for monomial, value in terms)
        first, factor = self.taken.setdefault(shape, (node, leading))
        return {((self.constant_number(first), 1),): leading / factor}

    def number(self, atom: Atom) -> int:
        """Return the number of an atom, new or not."""
        if atom not in self.numbers:
            self.numbers[atom] = len(self.atoms)
            self.atoms.append(atom)
        return self.numbers[atom]

    def constant_number(self, node: Expression) -> int:
        """Return the number of an atom that depends on parameters alone, new or not."""
        if node not in self.numbers:
            self.numbers[node] = len(self.constants)
            self.constants.append(node)
        return self.numbers[node]


def multiply_monomials(a: Monomial, b: Monomial) -> Monomial:
    """Return the product of two monomials."""
    if not a:
        return b
    if not b:
        return a
    powers = dict(a)
    for atom, exponent in b:
        powers[atom] = powers.get(atom, 0) + exponent
    return tuple(sorted(item for item in powers.items() if item[1]))


def _accumulate(target: Coefficient, monomial: Monomial, value: float) -> None:
    """Add a term to a coefficient; what cancels to rounding is dropped."""
    present = target.get(monomial, 0.0)
    total = present + value
    if abs(total) <= _CANCELLED * (abs(present) + abs(value)):
        target.pop(monomial, None)
    else:
        target[monomial] = total


def add_coefficient(target: Polynomial, monomial: Monomial, coefficient: Coefficient, factor: float = 1.0) -> None:
    """Add a multiple of a term to a polynomial, in place."""
    present = target.setdefault(monomial, {})
    for parameter_monomial, value in coefficient.items():
        _accumulate(present, parameter_monomial, factor * value)
    if not present:
        del target[monomial]


def add_polynomials(a: Polynomial, b: Polynomial, factor: float) -> Polynomial:
    """Return ``a + factor * b``."""
    result = {monomial: dict(coefficient) for monomial, coefficient in a.items()}
    for monomial, coefficient in b.items():
        add_coefficient(result, monomial, coefficient, factor)
    return result


def multiply_coefficients(a: Coefficient, b: Coefficient) -> Coefficient:
    """Return the product of two coefficients."""
    result: Coefficient = {}
    for p, x in a.items():
        for q, y in b.items():
            _accumulate(result, multiply_monomials(p, q), x * y)
    return result


def multiply_polynomials(a: Polynomial, b: Polynomial, limit: int) -> Polynomial:
    """Return the product of two polynomials, or raise if it is too large."""
    if len(a) * len(b) > 4 * limit:
        raise TooLargeError
    result: Polynomial = {}
    for p, x in a.items():
        for q, y in b.items():
            if len(x) * len(y) > 4 * limit:
                raise TooLargeError
            add_coefficient(result, multiply_monomials(p, q), multiply_coefficients(x, y))
    return result


def expand(
    rows: Sequence[Expression],
    angles: Collection[Expression],
    parameters: Collection[Expression],
    limit: int,
    effort: Effort | None = None,
    longest: int | None = None,
) -> Expansion:
    """Write expressions as polynomials."""
    expansion = Expansion(tuple(angles), effort=effort or Effort(1_000_000))
    nodes = live(rows)
    moving = {node.index for node in varying(nodes, parameters).union(angles)}
    wanted = _wanted(rows, nodes, moving, expansion.angles)
    known: dict[int, Polynomial] = {}
    for node in nodes:
        if node.index in wanted:
            known[node.index] = _expand_node(expansion, node, moving, known, limit)
            if longest is not None and node.index not in moving and volume(known[node.index]) > longest:
                known[node.index] = {ONE: expansion.taken_whole(node, known[node.index][ONE])}
            if len(known[node.index]) > limit:
                raise TooLargeError
    expansion.rows = [known[row.index] for row in rows]
    return expansion


def _wanted(
    rows: Iterable[Expression], nodes: Sequence[Expression], moving: set[int], angles: Collection[Expression]
) -> set[int]:
    """Return the indices of the nodes whose polynomials are needed."""
    wanted = {row.index for row in rows}
    leaves = {angle.index for angle in angles}
    for node in reversed(nodes):
        if node.index not in wanted or node.index in leaves:
            continue
        if node.operation in ("add", "sub", "mul", "neg"):
            wanted.update(argument.index for argument in node.arguments)
        elif node.operation == "div":
            wanted.add(node.arguments[0].index)
            if node.arguments[1].index not in moving:
                wanted.add(node.arguments[1].index)
        elif node.operation in ("sin", "cos") and node.index in moving:
            wanted.add(node.arguments[0].index)
    return wanted


def _expand_node(
    expansion: Expansion, node: Expression, moving: set[int], known: Mapping[int, Polynomial], limit: int
) -> Polynomial:
    """Return the polynomial of one node from those of its arguments."""
    operation = node.operation
    if operation == "constant":
        if not math.isfinite(node.payload):
            raise TooLargeError
        return {ONE: {ONE: node.payload}} if node.payload else {}
    if node in expansion.angles:
        return _single(expansion.number(Atom("node", node)))
    arguments = [known.get(argument.index, {}) for argument in node.arguments]
    if operation == "neg":
        return add_polynomials({}, arguments[0], -1.0)
    if operation in ("add", "sub"):
        expansion.spend(volume(arguments[0]) + volume(arguments[1]))
        return add_polynomials(arguments[0], arguments[1], 1.0 if operation == "add" else -1.0)
    if operation == "mul":
        expansion.spend(volume(arguments[0]) * volume(arguments[1]))
        return multiply_polynomials(arguments[0], arguments[1], limit)
    if operation == "div":
        return multiply_polynomials(arguments[0], _inverse(expansion, node.arguments[1], moving, arguments[1]), limit)
    if node.index not in moving:
        return {ONE: {((expansion.constant_number(node), 1),): 1.0}}
    if operation in ("sin", "cos"):
        return _expand_wave(expansion, operation, node.arguments[0], arguments[0])
    return _single(expansion.number(Atom("node", node)))


def _single(atom: int) -> Polynomial:
    return {((atom, 1),): {ONE: 1.0}}


def _inverse(expansion: Expansion, divisor: Expression, moving: set[int], polynomial: Polynomial) -> Polynomial:
    """Return one over a divisor."""
    if divisor.index in moving:
        return _single(expansion.number(Atom("inverse", divisor)))
    coefficient = polynomial.get(ONE, {})
    if len(coefficient) == 1:
        [(monomial, value)] = coefficient.items()
        return {ONE: {tuple((atom, -exponent) for atom, exponent in monomial): 1.0 / value}}
    return {ONE: {((expansion.constant_number(divisor), -1),): 1.0}}


def _expand_wave(expansion: Expansion, kind: str, argument: Expression, polynomial: Polynomial) -> Polynomial:
    """Return a sine or cosine: of a combination of angles if it is one, else as it is."""
    counts = dict.fromkeys(expansion.angles, 0)
    for monomial, coefficient in polynomial.items():
        count = coefficient.get(ONE, 0.0)
        if len(coefficient) != 1 or not (count and count.is_integer()) or len(monomial) != 1 or monomial[0][1] != 1:
            return _single(expansion.number(Atom(kind, argument)))
        atom = expansion.atoms[monomial[0][0]]
        if atom.kind != "node" or atom.argument not in counts:
            return _single(expansion.number(Atom(kind, argument)))
        counts[atom.argument] = int(count)
    return wave_polynomial(expansion, kind, tuple(counts.values()), 1.0)


def canonical_wave(kind: str, wave: Wave) -> tuple[int, Wave]:
    """Return the sign and the wave whose first entry that is not zero is positive."""
    leading = next((count for count in wave if count), 0)
    if leading >= 0:
        return 1, wave
    return (-1 if kind == "sin" else 1), tuple(-count for count in wave)


def wave_polynomial(expansion: Expansion, kind: str, wave: Wave, factor: float) -> Polynomial:
    """Return a multiple of the sine or cosine of a combination of angles."""
    sign, wave = canonical_wave(kind, wave)
    if not any(wave):
        return {ONE: {ONE: factor}} if kind == "cos" else {}
    return {((expansion.number(Atom(kind, wave)), 1),): {ONE: sign * factor}}
