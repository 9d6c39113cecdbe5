"""Stability as inequalities between parameters.

Without velocity terms a state of rest is stable where the stiffness is positive (Sylvester). With damping all roots of
``det(s^2 M + s C + K)`` must have negative real parts (Hurwitz); where it has even powers alone, as with gyroscopic
terms, its roots in ``s^2`` must be real and negative (Hermite: their power sums make a positive matrix).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from atwood.lazy_modules import sympy
from atwood.theory.formulas.printers import Sympy
from atwood.theory.oscillations.conditions import is_positive
from atwood.theory.oscillations.rest import Expansion
from atwood.theory.oscillations.spectrum import blocks, on_block, short

_LARGEST = 6
"""Blocks of more degrees of freedom with velocity terms are not decided in symbols."""


def stability_of(one: Expansion) -> Sympy | None:
    """Return where in the parameters no small deviation grows, as a relation of sympy; None if that is not decided.

    Deviations along which rest goes on keep their size, and count as stable.
    """
    positive: list[Sympy] = []
    neutral = len(one.solution.free)
    matrices = (one.mass, one.damping, one.stiffness)
    for basis in blocks(matrices):
        mass, damping, stiffness = (on_block(matrix, basis) for matrix in matrices)
        if damping.is_zero_matrix and stiffness.is_symmetric():
            minors = list(_minors(stiffness))
            neutral -= stiffness.shape[0] - len(minors)
        elif mass.shape[0] > _LARGEST:
            return None
        else:
            s = sympy.Dummy("s")
            coefficients = characteristic(mass, damping, stiffness, s).all_coeffs()
            while coefficients[-1] == 0:
                coefficients.pop()
            zeros = 2 * mass.shape[0] + 1 - len(coefficients)
            neutral -= zeros if damping.det() != 0 else (zeros + 1) // 2
            is_even = not any(coefficients[1::2])
            minors = list(_hermite(coefficients[::2])) if is_even else list(_hurwitz(coefficients))
        positive += minors
    found = sympy.And(*dict.fromkeys(map(is_positive, positive)))
    return None if neutral < 0 and found != False else found  # noqa: E712 - truth values of sympy


def characteristic(mass: Sympy, damping: Sympy, stiffness: Sympy, s: Sympy) -> Sympy:
    """Return ``det(s^2 M + s C + K)`` as a polynomial."""
    return sympy.Poly((s**2 * mass + s * damping + stiffness).det(method="berkowitz"), s)


def _minors(stiffness: Sympy) -> Iterator[Sympy]:
    """Yield what must be positive for a symmetric matrix to be so, but for directions that it takes to zero."""
    left, product = stiffness, sympy.Integer(1)
    while left.shape[0]:
        place = next((i for i in range(left.shape[0]) if left[i, i] != 0), None)
        if place is None:
            if not left.is_zero_matrix:
                yield sympy.Integer(-1)
            return
        others = [i for i in range(left.shape[0]) if i != place]
        pivot, column = left[place, place], left.extract(others, [place])
        product = short(product * pivot)
        yield product
        left = (left.extract(others, others) - column * column.T / pivot).applyfunc(short)


def _hurwitz(coefficients: Sequence[Sympy]) -> Iterator[Sympy]:
    """Yield what must be positive for all roots of a polynomial to have negative real parts (Hurwitz, 1895)."""
    first = coefficients[0]
    a = [short(one / first) for one in coefficients]
    n = len(a) - 1
    yield from a[1:]
    for size in range(2, n):
        yield sympy.Matrix(size, size, lambda i, j: a[2 * j + 1 - i] if 0 <= 2 * j + 1 - i <= n else 0).det()


def _hermite(coefficients: Sequence[Sympy]) -> Iterator[Sympy]:
    """Yield what must be positive for all roots of a polynomial to be real, apart from each other, and negative."""
    first, *a = coefficients
    a = [short(one / first) for one in a]
    n = len(a)
    yield from a
    sums = [sympy.Integer(n)]
    for k in range(1, 2 * n - 1):  # Newton's identities
        sums.append(-sum((a[j - 1] * sums[k - j] for j in range(1, min(k, n + 1))), k * a[k - 1] if k <= n else 0))
        if k > n:
            sums[k] = -sum(a[j - 1] * sums[k - j] for j in range(1, n + 1))
    for size in range(2, n + 1):
        yield sympy.Matrix(size, size, lambda i, j: sums[i + j]).det()
