"""Eigenvalues of ``K v = lambda M v`` in closed form, block by block.

Coordinates that are not coupled are apart. Where exchanging coordinates in pairs leaves both matrices as they are,
vectors are even or odd under the exchange (Landau and Lifshitz, Quantum Mechanics, section 94, for any symmetry). Of
what is left, a tridiagonal Toeplitz matrix with free, fixed or mirrored ends has sines (Yueh, Applied Mathematics
E-Notes 5, 2005); else the factors of the characteristic polynomial of degree one and two are solved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.formulas.printers import Sympy


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
    """Return the eigenvalues of ``K v = lambda M v``; ``symbol`` stands for lambda in polynomials."""
    found: list[Eigenvalue] = []
    for basis in blocks((mass, stiffness)):
        m, k = (on_block(one, basis) for one in (mass, stiffness))
        for one in _of_block(m, k, symbol):
            found.append(Eigenvalue(one.value, tuple(basis * vector for vector in one.vectors), one.polynomial))
    joined: list[Eigenvalue] = []
    for one in found:
        twin = None if one.value is None else _place_of(one.value, joined)
        if twin is None:
            joined.append(one)
        else:
            joined[twin] = Eigenvalue(one.value, joined[twin].vectors + one.vectors, one.polynomial)
    return joined


def _place_of(value: Sympy, among: Sequence[Eigenvalue]) -> int | None:
    every = [other.value for other in among]
    return next((i for i, other in enumerate(every) if other is not None and short(value - other) == 0), None)


def short(value: Sympy) -> Sympy:
    """Return an expression as one fraction of factors."""
    return value.factor() if value.is_Add or value.is_Mul else value


def on_block(matrix: Sympy, basis: Sympy) -> Sympy:
    """Return a matrix on the columns of a basis."""
    return (basis.T * matrix * basis).applyfunc(short)


# -- what is apart: components, even and odd under an exchange ---------------------------------------------------------


def blocks(matrices: Sequence[Sympy]) -> Iterator[Sympy]:
    """Yield bases of spaces that all matrices leave apart, as columns."""
    n = matrices[0].shape[0]
    for own in _components(matrices):
        basis = sympy.zeros(n, len(own))
        for column, row in enumerate(own):
            basis[row, column] = 1
        inner = [one.extract(own, own) for one in matrices]
        exchange = None if len(inner) == 2 and chain_ends(*inner) is not None else _exchange(inner)
        if exchange is None:
            yield basis
            continue
        for half in _halves(exchange):
            for part in blocks([on_block(one, half) for one in inner]):
                yield basis * half * part


def _components(matrices: Sequence[Sympy]) -> list[list[int]]:
    """Return the coordinates in groups that are not coupled to each other."""
    n = range(matrices[0].shape[0])
    edges = [(i, j) for i in n for j in n if any(one[i, j] != 0 for one in matrices)]
    return [sorted(one) for one in sympy.utilities.iterables.connected_components((list(n), edges))]


def _exchange(matrices: Sequence[Sympy]) -> list[int] | None:
    """Return an exchange of coordinates in pairs that leaves all matrices as they are; where each one goes."""
    n = matrices[0].shape[0]
    steps = 0

    def fits(goes: dict[int, int]) -> bool:
        return all(one[i, j] == one[goes[i], goes[j]] for one in matrices for i in goes for j in goes)

    def search(goes: dict[int, int]) -> dict[int, int] | None:
        nonlocal steps
        steps += 1
        open_ones = [i for i in range(n) if i not in goes]
        if not open_ones or steps > _MOST:
            return goes if not open_ones and any(i != j for i, j in goes.items()) else None
        first = open_ones[0]
        for other in open_ones[::-1]:  # the farthest first: most are mirrored
            more = {**goes, first: other, other: first}
            if fits(more):
                found = search(more)
                if found is not None:
                    return found
        return None

    found = search({}) if n > 1 else None
    return None if found is None else [found[i] for i in range(n)]


_MOST = 500
"""So many exchanges are tried, whole or in part."""


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


# -- one block ---------------------------------------------------------------------------------------------------------


def _of_block(mass: Sympy, stiffness: Sympy, symbol: Sympy) -> Iterator[Eigenvalue]:
    """Yield the eigenvalues of matrices that are not taken apart further."""
    ends = chain_ends(mass, stiffness)
    if ends is not None:
        yield from _of_chain(mass, stiffness, ends, symbol)
        return
    yield from of_pencil(stiffness - symbol * mass, symbol)


def of_pencil(pencil: Sympy, symbol: Sympy) -> Iterator[Eigenvalue]:
    """Yield the values at which a matrix is singular, by the factors of its determinant, the smaller of two first."""
    for factor, times in sympy.factor_list(pencil.det(method="berkowitz"), symbol)[1]:
        modulus = sympy.Poly(factor, symbol)
        if modulus.degree() > 2:
            yield Eigenvalue(None, (), factor)
        elif modulus.degree() > 0:
            found = _vectors(pencil, modulus, times)
            for value, middle, share in _roots(modulus):
                told = partial(_with_root, symbol=symbol, middle=middle, share=share)
                yield Eigenvalue(value, tuple(vector.applyfunc(told) for vector in found), factor)


def of_even(
    pencil: Sympy, coefficients: Sequence[Sympy], symbol: Sympy, number: Callable[[Sympy], complex]
) -> Iterator[Eigenvalue]:
    """Yield one of each pair of values ``+-s`` at which a matrix is singular, by the factors of a polynomial in s^2."""
    square = sympy.Dummy("square")
    for factor, times in sympy.factor_list(sympy.Poly(coefficients, square).as_expr(), square)[1]:
        polynomial = factor.xreplace({square: symbol**2})
        if sympy.degree(factor, square) > 2:
            yield Eigenvalue(None, (), polynomial)
            continue
        for value, *_ in _roots(sympy.Poly(factor, square)):
            found = _vectors(pencil, sympy.Poly(symbol**2 - value, symbol), times) if times == 1 else ()
            root = sympy.sqrt(value) if number(value).real > 0.0 else sympy.I * sympy.sqrt(-value)
            told = partial(_with_root, symbol=symbol, middle=sympy.Integer(0), share=root)
            yield Eigenvalue(root, tuple(vector.applyfunc(told) for vector in found), polynomial)


def _roots(modulus: Sympy) -> Iterator[tuple[Sympy, Sympy, Sympy]]:
    """Yield the roots of a polynomial of degree one or two, the smaller first, each with its rational part and rest."""
    a, b, *rest = map(sympy.factor, modulus.all_coeffs())
    middle = short(-b / (2 * a if rest else a))
    reach = short(sympy.sqrt((b**2 - 4 * a * rest[0]).factor()) / (2 * a)) if rest else sympy.Integer(0)
    sign = 1 if reach.could_extract_minus_sign() else -1
    for one in (sign, -sign) if rest else (0,):
        yield sympy.factor_terms(middle + one * reach), middle, one * reach


def _with_root(entry: Sympy, symbol: Sympy, middle: Sympy, share: Sympy) -> Sympy:
    """Return ``p + q lambda`` at the root ``middle + share``."""
    return sympy.factor_terms(short(entry.subs(symbol, middle)) + short(entry.diff(symbol) * share))


def _vectors(pencil: Sympy, modulus: Sympy, times: int) -> tuple[Sympy, ...]:
    """Return so many vectors that a matrix takes to zero at the roots of a polynomial, the first entry made one."""
    symbol = modulus.gen

    def reduced(value: Sympy) -> Sympy:
        above, below = (sympy.Poly(one, symbol) for one in sympy.fraction(sympy.together(value)))
        return (above * below.invert(modulus)).rem(modulus).as_expr()

    if times > 1:
        found, _ = null_space(pencil, times, reduced)
        columns = [found[:, k] for k in range(found.shape[1])]
    else:  # the cofactors of a row
        n = pencil.shape[0]
        rows = (sympy.Matrix([reduced(pencil.cofactor(i, j, "berkowitz")) for j in range(n)]) for i in range(n))
        columns = [next(row for row in rows if not row.is_zero_matrix)]
    return tuple((v / next(one for one in v if one != 0)).applyfunc(reduced) for v in columns)


def null_space(
    matrix: Sympy, times: int | None = None, reduce: Callable[[Sympy], Sympy] = short
) -> tuple[Sympy, tuple[int, ...]]:
    """Return what a matrix takes to zero as columns, and the rows in which these are a unit matrix."""
    count, n = matrix.shape
    rows = [[reduce(one) for one in row] for row in matrix.tolist()]
    pivots: list[int] = []
    for column in range(n):
        place = next((i for i in range(len(pivots), count) if rows[i][column] != 0), None)
        if place is None or (times is not None and len(pivots) == n - times):
            continue
        rows[len(pivots)], rows[place] = rows[place], rows[len(pivots)]
        chosen = rows[len(pivots)] = [reduce(one / rows[len(pivots)][column]) for one in rows[len(pivots)]]
        for i in range(count):
            if i != len(pivots) and rows[i][column] != 0:
                rows[i] = [reduce(x - rows[i][column] * y) for x, y in zip(rows[i], chosen, strict=True)]
        pivots.append(column)
    free = tuple(one for one in range(n) if one not in pivots)
    found = sympy.zeros(n, len(free))
    for k, one in enumerate(free):
        found[one, k] = 1
        for row, column in enumerate(pivots):
            found[column, k] = -rows[row][one]
    return found, free


# -- chains ------------------------------------------------------------------------------------------------------------


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
            value = sympy.factor_terms(short((middle + 2 * coupling * cosine) / mass[0, 0]).expand())
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
