"""Coefficients of the methods of Gauss, correctly rounded.

Collocation at the zeros of the shifted Legendre polynomial of degree s has the order 2s, is symmetric and symplectic
(Hairer, Lubich and Wanner, Geometric Numerical Integration, sections II.1.3 and VI.4.1). It is symplectic since
``b_i a_ij + b_j a_ji = b_i b_j``; with ``m_ij = a_ij/b_j`` that is ``m_ij + m_ji = 1``, which holds exactly for
floating-point numbers too where ``m_ij`` is taken as one less ``m_ji`` (Antonana, Makazaga and Murua, Numerical
Algorithms 76, 2017).
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from functools import cache
from typing import NamedTuple

ORDERS = (2, 4, 6, 8, 10, 12)
"""The orders there are."""

_DIGITS = 60


class Tableau(NamedTuple):
    """A method of s stages: with ``L_j = h b_j f(Y_j)``, ``Y_i = y + sum m_ij L_j`` and the step is ``sum L_j``.

    Attributes
    ----------
    nodes
        c.
    weights
        b.
    shares
        m, by rows.
    ahead
        What the polynomial through the L of one step gives for those of the next, by rows.
    """

    nodes: tuple[float, ...]
    weights: tuple[float, ...]
    shares: tuple[tuple[float, ...], ...]
    ahead: tuple[tuple[float, ...], ...]


@cache
def tableau(order: int) -> Tableau:
    """Return the method of an order, one of `ORDERS`."""
    s = order // 2
    with localcontext() as context:
        context.prec = _DIGITS
        nodes = _zeros(s)
        basis = [_lagrange(nodes, j) for j in range(s)]
        weights = [_integral(one, Decimal(1)) for one in basis]
        exact = [[_integral(basis[j], c) / weights[j] for j in range(s)] for c in nodes]
        shares = [[0.5] * s for _ in range(s)]
        for i in range(s):
            for j in range(i):
                # The larger of the two is rounded, so that the other is one less it without rounding.
                above = float(exact[i][j])
                shares[i][j], shares[j][i] = above, 1.0 - above
        ahead = tuple(
            tuple(float(weights[i] / weights[j] * _value(basis[j], 1 + nodes[i])) for j in range(s)) for i in range(s)
        )
        return Tableau(tuple(map(float, nodes)), tuple(map(float, weights)), tuple(map(tuple, shares)), ahead)


Polynomial = list[Decimal]
"""Coefficients, lowest power first."""


def _zeros(s: int) -> list[Decimal]:
    """Return the zeros of the shifted Legendre polynomial, ``(d/dx)^s x^s (x - 1)^s``, by Newton's method."""
    row: Polynomial = [Decimal(1)]
    for k in range(s):  # the coefficients of the polynomial P_s(1 - 2x) = sum (-s)_k (s+1)_k/(k!)^2 x^k
        row.append(row[-1] * (k - s) * (s + 1 + k) / ((k + 1) ** 2))
    slope = [k * value for k, value in enumerate(row)][1:]
    found: list[Decimal] = []
    for _ in range(s):
        x = Decimal(0)  # below all zeros that are left, from where the iteration rises without passing one
        for _ in range(500):
            value, rate = _value(row, x), _value(slope, x)
            rate -= value * sum((1 / (x - known) for known in found), Decimal(0))
            step = value / rate
            x -= step
            if abs(step) < Decimal(10) ** (10 - _DIGITS):
                break
        found.append(x)
    return sorted(found)


def _value(row: Polynomial, x: Decimal) -> Decimal:
    total = Decimal(0)
    for coefficient in reversed(row):
        total = total * x + coefficient
    return total


def _integral(row: Polynomial, x: Decimal) -> Decimal:
    return _value([Decimal(0), *(value / (k + 1) for k, value in enumerate(row))], x)


def _lagrange(nodes: list[Decimal], j: int) -> Polynomial:
    """Return the polynomial that is one at a node and zero at the others."""
    row: Polynomial = [Decimal(1)]
    for i, node in enumerate(nodes):
        if i != j:
            shifted = [Decimal(0), *row]
            row = [(a - node * b) / (nodes[j] - node) for a, b in zip(shifted, [*row, Decimal(0)], strict=True)]
    return row
