"""Integrals of scenes with free coordinates: polynomials in momenta, coordinates and time, found and solved exactly.

Noether's theorem for ``delta q = dC/dp`` (Goldstein, section 13.7): with ``p' = dL/dq + Q + row`` the rate of a
function C(q, p, t) is ``sum w_k row_k + R`` with ``w = dC/dp`` and a rest R in which there are no accelerations. C is
conserved where R is zero identically. That is linear in the coefficients of C: which of its terms can belong together
is seen in numbers, and their coefficients are solved for as formulas of the parameters, monomial by monomial.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import combinations, combinations_with_replacement, product
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.rounding import ON_ARRAYS
from atwood.errors import AtwoodError
from atwood.expr import Expression, depends_on, jvp, live, substitute, vjp
from atwood.expr.simplify.polynomial import Expansion, Polynomial, TooLargeError
from atwood.expr.sympy_bridge import from_sympy
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.mechanics.outputs.totals import add_up
from atwood.numerics.matrices import least_norm, or_one
from atwood.numerics.rank import null_space, ranks
from atwood.simulation.dynamics.orientation_coordinates import from_regular
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.initialization.start import find_start
from atwood.theory.symmetry.proof import Generator, Proof, Prover, normal_form
from atwood.theory.symmetry.quantities import Quantities, row_echelon
from atwood.theory.symmetry.states import State

_COORDINATES, _SQUARES = 6, 4
"""So many coordinates at most: for integrals of first order in the momenta, and for those of second order."""

_ZERO = 1e-9
"""Relative to the sizes of terms: what is less is rounding."""

_SUPPORT = 24
"""An integral of more terms is not solved for."""

_DENOMINATOR = 10**6
"""Coefficients that are numbers are fractions with no larger denominator."""


@dataclass(frozen=True, eq=False)
class Part:
    """A term of the ansatz: a function C(q, p, t), the displacements ``dC/dp``, and the rest R of its rate.

    Attributes
    ----------
    value, moves, rest
        C, the displacements by the number of the velocity, and R, all in coordinates, velocities and time.
    """

    value: Expression
    moves: Mapping[int, Expression]
    rest: Expression


@dataclass(frozen=True, eq=False)
class Integral:
    """An integral that was found.

    Attributes
    ----------
    value, generator
        The quantity, and the displacements of its symmetry.
    kind
        ``"first"`` or ``"second"`` order in the momenta, or with coefficients in ``"time"``.
    proof
        For which parameters it is proven.
    """

    value: Expression
    generator: Generator
    kind: str
    proof: Proof


def find_integrals(
    quantities: Quantities, prover: Prover, states: Sequence[State], known: Sequence[Expression]
) -> Iterator[Integral]:
    """Yield integrals that are proven, and are no polynomials in those that are known."""
    found = quantities.found
    if (
        None in found.moves
        or found.constraints
        or found.is_restricted
        or not 0 < len(found.coordinates) <= _COORDINATES
        or quantities.assembly.relations
        or not prover.is_small
        or found.equations.states
    ):
        return
    try:
        yield from _Ansatz(quantities, prover, states).search(known)
    except (_UnknownError, TooLargeError):
        return


class _UnknownError(Exception):
    """An operation that has no value here, such as a choice."""


class _Ansatz:
    """The terms of one scene, in numbers and as formulas."""

    def __init__(self, quantities: Quantities, prover: Prover, states: Sequence[State]) -> None:
        self.quantities, self.prover, self.found = quantities, prover, quantities.found
        found = self.found
        order = sorted(range(len(found.moves)), key=lambda k: found.moves[k] or 0)
        self._order = order
        self._v = [found.velocities[k] for k in order]
        self._p = [quantities.momenta[k] for k in order]
        lagrangian, one = found.lagrangian, found.graph.one
        slopes = vjp([lagrangian], [one], [*found.coordinates, found.time])
        losses = vjp([found.rayleigh], [one], self._v)
        self._others = [found.forces[k] - loss for k, loss in zip(order, losses, strict=True)]
        self._forces = [a + b for a, b in zip(slopes, self._others, strict=False)]
        self._explicit = slopes[-1]
        self._along: dict[Expression, Expression | float] = {found.time: 1.0}
        self._along |= dict(zip(found.coordinates, self._v, strict=True))
        self._states = states

    # -- the terms ----------------------------------------------------------------------------------------------------

    def _function(self, value: Expression) -> Part:
        """Return a function of coordinates and time as a term."""
        return Part(value, {}, jvp([value], self._along)[0])

    def _momentum(self, numbers: tuple[int, ...], factor: Expression) -> Part:
        """Return a product of momenta and a function of coordinates and time as a term."""
        whole, rest = factor, jvp([factor], self._along)[0]
        moves: dict[int, Expression] = {}
        for place, k in enumerate(numbers):
            others = factor
            for i in numbers[:place] + numbers[place + 1 :]:
                others = others * self._p[i]
            number = self._order[k]
            moves[number] = moves[number] + others if number in moves else others
            whole, rest = whole * self._p[k], rest * self._p[k]
        for number, move in moves.items():
            rest = rest + move * self._forces[self._order.index(number)]
        return Part(whole, moves, rest)

    def _energy(self, factor: Expression) -> Part:
        """Return the energy function times a function of time as a term."""
        h = self.quantities.energy_function
        power = add_up([self.found.graph.zero, *(v * q for v, q in zip(self._v, self._others, strict=True))])
        rest = factor * (power - self._explicit) + jvp([factor], {self.found.time: 1.0})[0] * h
        moves = {k: factor * v for k, v in zip(self._order, self._v, strict=True)}
        return Part(factor * h, moves, rest)

    def _stages(self) -> Iterator[tuple[str, Callable[[], list[Part]]]]:
        """Yield what an integral can be, the simplest first, with the terms that it may have, the simplest first."""
        found, t, one = self.found, self.found.time, self.found.graph.one
        q = list(found.coordinates)
        second = [a * b for a, b in combinations_with_replacement(q, 2)]
        still = dict.fromkeys(self._v, 0.0)
        at_rest = substitute([*(p.lagrangian for p in found.parts), *self._p], still)
        roots = [one / node for node in live([*found.rows]) if node.operation == "sqrt" and self._is_place(node)]
        special = [value for value in dict.fromkeys([*at_rest, *roots]) if not value.is_parametric]

        def functions(times: Sequence[Expression]) -> list[Part]:
            plain = [
                self._function(a * b) for a, b in product(times, [one, *q, *second]) if a is not one or b is not one
            ]
            return plain + [self._function(a * b) for a, b in product(special, [one, *q])]

        def linear(times: Sequence[Expression]) -> list[Part]:
            steady = [self._momentum((k,), a) for a in times for k in range(len(q))]
            return steady + [self._momentum((k,), a * b) for a in times for k in range(len(q)) for b in q]

        def still_first() -> list[Part]:
            return [*functions([one]), *linear([one]), self._energy(one)]

        def moving_first() -> list[Part]:
            energies = [self._energy(one), self._energy(t), self._energy(t * t)]
            return [*functions([one, t, t * t]), *linear([one, t]), *energies]

        def still_second() -> list[Part]:
            pairs = [*combinations(range(len(q)), 2), *((k, k) for k in range(len(q)))]
            squares = [self._momentum(pair, b) for pair in pairs for b in (one, *q)]
            return [*functions([one]), *linear([one]), self._energy(one), *squares]

        yield "first", still_first
        yield "time", moving_first
        if len(q) <= _SQUARES:
            yield "second", still_second

    def _is_place(self, node: Expression) -> bool:
        return depends_on(node, self.found.coordinates) and not depends_on(node, [*self._v, self.found.time])

    # -- in numbers ---------------------------------------------------------------------------------------------------

    def search(self, known: Sequence[Expression]) -> Iterator[Integral]:
        """Yield what is found beyond what is known."""
        values = list(known)
        for kind, make in self._stages():
            if self._is_complete(values):
                return
            parts = make()
            many = len(parts) + len(values) ** 2 + 12
            points = self._points(many)
            numbers = _values([*(one.value for one in parts), *(one.rest for one in parts), *values], points)
            whole = np.all(np.isfinite(numbers), axis=0)
            numbers = numbers[:, whole]
            scale = or_one(np.median(np.abs(numbers[: len(parts)]), axis=1))
            c = numbers[: len(parts)].T / scale
            e = numbers[len(parts) : 2 * len(parts)].T / scale
            held = list(numbers[2 * len(parts) :])
            own = _independent(c)
            e = e[:, own]
            e = _tempered(e)
            sizes = np.linalg.norm(e, axis=0)
            sizes = np.where(sizes > _ZERO * np.max(sizes), sizes, np.max(sizes) or 1.0)
            kept = null_space(e / sizes, _ZERO) / sizes[:, None]
            if not kept.shape[1]:
                continue
            rows = row_echelon(kept.T[:, ::-1] / np.max(np.abs(kept)))[:, ::-1]
            for row in rows[::-1]:
                if _follows(c[:, own] @ row, held):
                    continue
                support = np.flatnonzero(np.abs(row) > 1e-7 * np.max(np.abs(row)))
                weights = {int(own[k]): float(row[k] / scale[own[k]]) for k in support}
                made = self._exact(parts, weights, kind)
                if made is None:
                    continue
                [value] = _values([made.value], points)[:, whole]
                if not _follows(value, held):
                    held.append(value)
                    values.append(made.value)
                    yield made

    def _is_complete(self, values: Sequence[Expression]) -> bool:
        """Return whether all integrals are functions of given ones: as many of these are independent as there are."""
        state = [*self.found.coordinates, *self._v]
        slopes = [slope for value in values for slope in vjp([value], [self.found.graph.one], state)]
        if len(values) < len(state):
            return False
        at = _values(slopes, self._points(6)).T.reshape(-1, len(values), len(state))
        sizes = np.max(np.abs(at), axis=(0, 1)), np.max(np.abs(at), axis=(0, 2))
        scaled = at / or_one(sizes[0]) / or_one(sizes[1])[None, :, None]
        return bool(np.max(ranks(scaled, 1e-8)) == len(state))

    def _points(self, count: int) -> dict[Expression, FloatArray]:
        """Return random values of coordinates, velocities and time, and those of the parameters."""
        found, random = self.found, np.random.default_rng(1918)
        start, length = find_start(self.quantities.assembly), self.quantities.center[1]
        middle = from_regular(self.quantities.assembly, start.coordinates)
        reach = np.array([1.0 if one.unit == "rad" else length for one in found.names])
        fast = np.median([np.abs(one.u) for one in self._states], axis=0)
        pace = float(np.median(fast / motion_scales(found.equations, length))) or 1.0
        points: dict[Expression, FloatArray] = {
            one: np.full(count, value) for one, value in self.quantities.assembly.mechanism.table.values.items()
        }
        points[found.time] = start.time + random.uniform(0.2, 2.0, count) / pace
        for k, one in enumerate(found.coordinates):
            points[one] = middle[k] + 0.8 * reach[k] * random.uniform(-1.0, 1.0, count)
            points[self._v[k]] = pace * reach[k] * random.uniform(-1.0, 1.0, count)
        return points

    # -- as formulas --------------------------------------------------------------------------------------------------

    def _exact(self, parts: Sequence[Part], weights: Mapping[int, float], kind: str) -> Integral | None:
        """Return an integral of given terms with coefficients of the parameters, proven; None if there is none."""
        if len(weights) > _SUPPORT:
            return None
        lead = max(weights)
        for coefficients in self._solutions([parts[k].rest for k in weights], list(weights).index(lead), weights):
            chosen = dict(zip(weights, coefficients, strict=True))
            value = add_up([factor * parts[k].value for k, factor in chosen.items()])
            generator: dict[int, Expression] = {}
            for k, factor in chosen.items():
                for number, move in parts[k].moves.items():
                    generator[number] = generator.get(number, self.found.graph.zero) + factor * move
            # A function of coordinates and time alone that is conserved is a number.
            if all(one.is_zero for one in generator.values()):
                continue
            proof = self.prover.along(value, generator)
            if proof:
                return Integral(value, generator, kind, proof)
        return None

    def _solutions(
        self, rests: Sequence[Expression], lead: int, weights: Mapping[int, float]
    ) -> Iterator[list[Expression]]:
        """Yield coefficients that may make a sum of terms zero: as formulas, and as numbers."""
        graph = self.found.graph
        letters = [graph.one if k == lead else graph.symbol(f"coefficient:{k}") for k in range(len(rests))]
        total = add_up([a * b for a, b in zip(letters, rests, strict=True)])
        merged: dict[Expression, Expression | float] = dict(self.prover.notation.merged)
        try:
            expansion, row = normal_form(substitute([total], merged)[0] if merged else total, self.prover.angles)
            solved = _solved(expansion, row, [one for one in letters if one is not graph.one])
        except (TooLargeError, AtwoodError):
            solved = None
        if solved is not None:
            yield [graph.one * solved[""] if one is graph.one else solved[one.name] for one in letters]
        first = list(weights.values())[lead]
        near = [Fraction(value / first).limit_denominator(_DENOMINATOR) for value in weights.values()]
        yield [graph.constant(float(one)) for one in near]


def _values(outputs: Sequence[Expression], points: Mapping[Expression, FloatArray]) -> FloatArray:
    """Return expressions at many points, a row each."""
    known = {one.index: np.asarray(value) for one, value in points.items()}
    count = len(next(iter(points.values())))
    with np.errstate(all="ignore"):
        for node in live(outputs):
            if node.index in known:
                continue
            if node.operation == "constant":
                known[node.index] = np.full(count, node.value)
            elif node.operation in ON_ARRAYS and node.operation != "select":
                known[node.index] = ON_ARRAYS[node.operation](*(known[one.index] for one in node.arguments))
            else:
                raise _UnknownError
    return np.array([known[one.index] for one in outputs])


def _tempered(columns: FloatArray) -> FloatArray:
    """Return columns with each row divided by its largest entry, so that no point counts for more than others."""
    return np.asarray(columns / or_one(np.max(np.abs(columns), axis=1))[:, None])


def _independent(columns: FloatArray) -> FloatArray:
    """Return the numbers of columns that no combination of earlier ones and of a constant is."""
    [first, *others] = _tempered(np.column_stack([np.ones(len(columns)), columns])).T
    basis = [first / np.linalg.norm(first)]
    chosen = []
    for k, column in enumerate(others):
        size = float(np.linalg.norm(column))
        rest = column
        for _ in range(2):
            rest = rest - np.array(basis).T @ (np.array(basis) @ rest)
        left = float(np.linalg.norm(rest))
        if left > _ZERO * size:
            basis.append(rest / left)
            chosen.append(k)
    return np.array(chosen, dtype=int)


def _follows(value: FloatArray, held: Sequence[FloatArray]) -> bool:
    """Return whether values are a combination of others and of products of two of these."""
    units = [one / or_one(np.median(np.abs(one))) for one in (value, *held)]
    products = [a * b for a, b in combinations_with_replacement(units[1:], 2)]
    [aim, *columns] = _tempered(np.array([*units, *products, np.ones(len(value))]).T).T
    weights = least_norm(np.array(columns).T, aim)
    return bool(np.linalg.norm(weights @ np.array(columns) - aim) <= 1e-7 * np.linalg.norm(aim))


def _solved(expansion: Expansion, row: Polynomial, unknowns: Sequence[Expression]) -> dict[str, Expression] | None:
    """Return the unknowns that a polynomial is linear in so that it vanishes, each times the one of the name ``""``."""
    graph = unknowns[0].graph if unknowns else None
    names = {one: sympy.Symbol(f"c{k}") for k, one in enumerate(unknowns)}
    letters: dict[int, Any] = {}
    known = {}
    equations: dict[Any, list[Any]] = {}
    for monomial, coefficient in row.items():
        rest, factor = [], sympy.Integer(1)
        for number, exponent in monomial:
            node = expansion.atoms[number].argument
            if (
                isinstance(node, Expression)
                and expansion.atoms[number].kind == "node"
                and (node in names or node.is_parametric)
            ):
                letter = names.get(node) or letters.setdefault(number, sympy.Symbol(f"a{number}"))
                known[letter] = node
                factor *= letter**exponent
            else:
                rest.append((number, exponent))
        [(_, value)] = coefficient.items()
        near = Fraction(value).limit_denominator(_DENOMINATOR)
        equations.setdefault(tuple(rest), []).append(factor * sympy.Rational(near.numerator, near.denominator))
    every = {sympy.Add(*one) for one in equations.values()} - {sympy.Integer(0)}
    found = sympy.linsolve(list(every), list(names.values())) if names else {()}
    if not found or (not names and every):
        return None
    [values] = found
    if any(one.has(*names.values()) for one in values):
        return None
    below = [sympy.fraction(sympy.together(one))[1].as_coeff_Mul()[1] for one in values]
    common = sympy.lcm_list([sympy.Integer(1), *below])
    whole = {
        "": common,
        **{one.name: sympy.factor(sympy.cancel(v * common)) for one, v in zip(unknowns, values, strict=True)},
    }
    where = {letter: known[letter] for letter in letters.values()}
    return {name: from_sympy(value, graph, where) for name, value in whole.items()} if graph else None
