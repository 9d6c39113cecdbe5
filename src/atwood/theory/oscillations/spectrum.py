"""Eigenvalues of ``K v = lambda M v`` in closed form, block by block.

Coordinates that are not coupled are apart. Where exchanging coordinates in pairs leaves both matrices as they are,
vectors are even or odd under the exchange (Landau and Lifshitz, Quantum Mechanics, section 94, for any symmetry). Of
what is left, a tridiagonal Toeplitz matrix with free, fixed or mirrored ends has sines (Yueh, Applied Mathematics
E-Notes 5, 2005); else the factors of the characteristic polynomial of degree one and two are solved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from typing import Any, TypeAlias

import networkx as nx

from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy

Sympy: TypeAlias = Any
"""A sympy object."""


@dataclass(frozen=True)
class Eigenvalue:
    """An eigenvalue with its vectors.

    Attributes
    ----------
    value
        In terms of the parameters; None where the polynomial that it is a root of has no roots in closed form.
    vectors
        Columns, as many as the eigenvalue is often there.
    polynomial
        The factor of the characteristic polynomial in ``lambda`` that it is a root of.
    """

    value: Sympy | None
    vectors: tuple[Sympy, ...]
    polynomial: Sympy


def eigenvalues(mass: Sympy, stiffness: Sympy, symbol: Sympy) -> list[Eigenvalue]:
    """Return the eigenvalues of ``K v = lambda M v``, M and K symmetric.

    Parameters
    ----------
    mass, stiffness
        Square matrices of sympy.
    symbol
        Stands for lambda in polynomials.
    """
    found: list[Eigenvalue] = []
    for basis in _blocks(mass, stiffness):
        m, k = (_expanded(basis.T * one * basis) for one in (mass, stiffness))
        for one in _of_block(m, k, symbol):
            found.append(Eigenvalue(one.value, tuple(basis * vector for vector in one.vectors), one.polynomial))
    joined: list[Eigenvalue] = []
    for one in found:
        twin = next(
            (
                i
                for i, other in enumerate(joined)
                if one.value is not None and other.value is not None and sympy.cancel(one.value - other.value) == 0
            ),
            None,
        )
        if twin is None:
            joined.append(one)
        else:
            joined[twin] = Eigenvalue(one.value, joined[twin].vectors + one.vectors, one.polynomial)
    return joined


def _expanded(matrix: Sympy) -> Sympy:
    return matrix.applyfunc(lambda one: one.cancel().factor() if one.is_Add else one)


# -- what is apart: components, even and odd under an exchange -----------------------------------------------------------


def _blocks(mass: Sympy, stiffness: Sympy) -> Iterator[Sympy]:
    """Yield bases of spaces that both matrices leave apart, as columns."""
    n = mass.shape[0]
    coupled = nx.Graph()
    coupled.add_nodes_from(range(n))
    coupled.add_edges_from((i, j) for i, j in combinations(range(n), 2) if mass[i, j] != 0 or stiffness[i, j] != 0)
    for component in nx.connected_components(coupled):
        own = sorted(component)
        basis = sympy.zeros(n, len(own))
        for column, row in enumerate(own):
            basis[row, column] = 1
        m, k = mass.extract(own, own), stiffness.extract(own, own)
        if chain_ends(m, k) is not None:
            yield basis
            continue
        exchange = _exchange(m, k)
        if exchange is None:
            yield basis
            continue
        for half in _halves(exchange):
            for inner in _blocks(_expanded(half.T * m * half), _expanded(half.T * k * half)):
                yield basis * half * inner


def _exchange(mass: Sympy, stiffness: Sympy) -> list[int] | None:
    """Return an exchange of coordinates in pairs that leaves both matrices as they are; where each one goes."""
    n = mass.shape[0]
    colored = nx.complete_graph(n)
    for i in range(n):
        colored.nodes[i]["entry"] = (mass[i, i], stiffness[i, i])
    for i, j in combinations(range(n), 2):
        colored.edges[i, j]["entry"] = (mass[i, j], stiffness[i, j])

    def same(a: dict[str, Any], b: dict[str, Any]) -> bool:
        return bool(a["entry"] == b["entry"])

    mirror = list(range(n))[::-1]
    candidates = nx.isomorphism.GraphMatcher(colored, colored, same, same).isomorphisms_iter()
    for goes in ({i: mirror[i] for i in range(n)}, *(one for one, _ in zip(candidates, range(_MOST), strict=False))):
        is_pairs = all(goes[goes[i]] == i for i in goes) and any(goes[i] != i for i in goes)
        if is_pairs and all(
            one[i, j] == one[goes[i], goes[j]] for one in (mass, stiffness) for i in range(n) for j in range(i + 1)
        ):
            return [goes[i] for i in range(n)]
    return None


_MOST = 500
"""So many symmetries are looked at for one that is its own inverse."""


def _halves(exchange: Sequence[int]) -> tuple[Sympy, Sympy]:
    """Return what is even and what is odd under an exchange, as columns."""
    n = len(exchange)
    pairs = [(i, j) for i, j in enumerate(exchange) if i < j]
    fixed = [i for i, j in enumerate(exchange) if i == j]
    even, odd = sympy.zeros(n, len(pairs) + len(fixed)), sympy.zeros(n, len(pairs))
    for column, (i, j) in enumerate(pairs):
        even[i, column] = even[j, column] = odd[i, column] = 1
        odd[j, column] = -1
    for column, i in enumerate(fixed):
        even[i, len(pairs) + column] = 1
    return even, odd


# -- one block -----------------------------------------------------------------------------------------------------------


def _of_block(mass: Sympy, stiffness: Sympy, symbol: Sympy) -> Iterator[Eigenvalue]:
    """Yield the eigenvalues of matrices that are not taken apart further."""
    ends = chain_ends(mass, stiffness)
    if ends is not None:
        yield from _of_chain(mass, stiffness, ends, symbol)
        return
    pencil = stiffness - symbol * mass
    for factor, times in sympy.factor_list(pencil.det(method="berkowitz"), symbol)[1]:
        coefficients = sympy.Poly(factor, symbol).all_coeffs()
        if len(coefficients) > 3:
            yield Eigenvalue(None, (), factor)
        elif len(coefficients) == 2:
            value = (-coefficients[1] / coefficients[0]).cancel().factor()
            yield Eigenvalue(value, _vectors(pencil.subs(symbol, value), times), factor)
        else:
            yield from _of_quadratic(pencil, symbol, coefficients, factor, times)


def _of_quadratic(
    pencil: Sympy, symbol: Sympy, coefficients: Sequence[Sympy], factor: Sympy, times: int
) -> Iterator[Eigenvalue]:
    """Yield the two roots of ``a lambda^2 + b lambda + c``, the smaller first; vectors are rational in the root."""
    a, b, c = (one.factor() for one in coefficients)
    square = (b**2 - 4 * a * c).factor()
    outside = sympy.sqrt(square)
    root = sympy.Dummy("root")
    if not outside.has(sympy.Pow) or outside.is_rational_function():
        values = [((-b + sign * outside) / (2 * a)).cancel().factor() for sign in (-1, 1)]
        yield from (Eigenvalue(one, _vectors(pencil.subs(symbol, one), times), factor) for one in values)
        return

    def reduced(value: Sympy) -> Sympy:
        return _rationalized(value, root, square)

    sign = -1 if a.could_extract_minus_sign() or a.is_negative else 1
    found = _vectors(pencil.subs(symbol, (-b + root) / (2 * a)), times, reduced)
    for one in (-sign * outside, sign * outside):
        value = (-b + one) / (2 * a)
        short = value.cancel() if outside.is_number or len(square.free_symbols) < 2 else value
        yield Eigenvalue(short, tuple(vector.subs(root, one) for vector in found), factor)


def _rationalized(value: Sympy, root: Sympy, square: Sympy) -> Sympy:
    """Return a rational function of a square root as ``p + q root``."""
    above, below = (sympy.Poly(one, root) for one in sympy.fraction(sympy.together(value)))
    modulus = sympy.Poly(root**2 - square, root)
    (p, q), (s, t) = ((one.rem(modulus).nth(0), one.rem(modulus).nth(1)) for one in (above, below))
    size = s**2 - t**2 * square
    first, second = (p * s - q * t * square) / size, (q * s - p * t) / size
    return first.cancel().factor() + second.cancel().factor() * root


def _vectors(singular: Sympy, times: int, reduced: Callable[[Sympy], Sympy] | None = None) -> tuple[Sympy, ...]:
    """Return the null space of ``K - lambda M``, the first entry that is not zero made one."""
    reduce = reduced or (lambda one: one.cancel().factor())
    n = singular.shape[0]
    rows = [[reduce(one) for one in row] for row in singular.tolist()]
    pivots: list[int] = []
    for column in range(n):
        place = next((i for i in range(len(pivots), n) if rows[i][column] != 0), None)
        if place is None or len(pivots) == n - times:
            continue
        rows[len(pivots)], rows[place] = rows[place], rows[len(pivots)]
        chosen = rows[len(pivots)] = [reduce(one / rows[len(pivots)][column]) for one in rows[len(pivots)]]
        for i in range(n):
            if i != len(pivots) and rows[i][column] != 0:
                rows[i] = [reduce(x - rows[i][column] * y) for x, y in zip(rows[i], chosen, strict=True)]
        pivots.append(column)
    found = []
    for free in (one for one in range(n) if one not in pivots):
        entries = [sympy.Integer(int(i == free)) for i in range(n)]
        for row, column in enumerate(pivots):
            entries[column] = -rows[row][free]
        first = next(one for one in entries if one != 0)
        found.append(sympy.Matrix([reduce(one / first) for one in entries]))
    return tuple(found)


# -- chains --------------------------------------------------------------------------------------------------------------


def chain_ends(mass: Sympy, stiffness: Sympy) -> tuple[int, int] | None:
    """Return how a chain of equal masses on equal springs ends on each side: 0 fixed, 1 free, -1 mirrored; else None.

    At a free end the neighbour that is missing moves as the last one, at a mirrored end against it.
    """
    n = mass.shape[0]
    if n < 2 or any(mass[i, j] != (mass[0, 0] if i == j else 0) for i in range(n) for j in range(n)):
        return None
    coupling = stiffness[0, 1]
    if coupling == 0 or any(
        stiffness[i, j] != (coupling if abs(i - j) == 1 else 0) for i in range(n) for j in range(n) if i != j
    ):
        return None
    inside = {stiffness[i, i] for i in range(1, n - 1)}
    if len(inside) != 1:
        return None
    (middle,) = inside
    ends = []
    for i in (0, n - 1):
        extra = ((stiffness[i, i] - middle) / coupling).cancel()
        if extra not in (0, 1, -1):
            return None
        ends.append(int(extra))
    return ends[0], ends[1]


def _of_chain(mass: Sympy, stiffness: Sympy, ends: tuple[int, int], symbol: Sympy) -> Iterator[Eigenvalue]:
    """Yield the eigenvalues of a chain: ``(a + 2 b cos theta) / m`` with vectors that are sines or cosines."""
    n = mass.shape[0]
    middle, coupling = stiffness[1, 1], stiffness[0, 1]
    flipped = ends[0] == 0 != ends[1]
    first, last = ends[::-1] if flipped else ends
    for k in range(1, n + 1):
        angle = sympy.pi * _turn(k, n, first, last)
        wave, shift = (sympy.cos if first == 1 else sympy.sin), sympy.Rational(abs(first), 2)
        entries = [wave((j - shift) * angle) for j in range(1, n + 1)]
        cosine, own = sympy.cos(angle), (middle + 2 * coupling).cancel()
        if cosine.has(sympy.cos, sympy.sin):  # as a square it is short where nothing but the neighbours hold a mass
            value = (own - 4 * coupling * sympy.sin(angle / 2) ** 2) / mass[0, 0]
        else:
            value = ((middle + 2 * coupling * cosine) / mass[0, 0]).expand().factor()
        vector = sympy.Matrix(entries[::-1] if flipped else entries)
        yield Eigenvalue(value, (vector,), symbol - value)


def _turn(k: int, n: int, first: int, last: int) -> Sympy:
    """Return the angle from one mass to the next in a mode of a chain, over pi."""
    if first == last == 0:
        return sympy.Rational(k, n + 1)
    if first == last:
        return sympy.Rational(k - 1 if first == 1 else k, n)
    if last == 0:
        return sympy.Rational(2 * k - 1 if first == 1 else 2 * k, 2 * n + 1)
    return sympy.Rational(2 * k - 1, 2 * n)
