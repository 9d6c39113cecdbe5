"""How steps of second order are put together to steps of higher order.

A symmetric composition with steps ``g_i h`` has the order 4 if ``sum g_i = 1`` and ``sum g_i^3 = 0``; higher ones ask
for more (Hairer, Lubich and Wanner, Geometric Numerical Integration, section V.3).
"""

from __future__ import annotations

from typing import Final

__all__ = ["ORDERS", "steps_of"]

ORDERS: Final = (2, 4, 6, 8)
"""The orders there are."""

_SUZUKI = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))

_FIRST_HALF = {
    2: (),
    4: (_SUZUKI, _SUZUKI),
    6: (0.39216144400731413928, 0.33259913678935943860, -0.70624617255763935981, 0.08221359629355080023),
    8: (
        *(0.13020248308889008088, 0.56116298177510838456, -0.38947496264484728641, 0.15884190655515560090),
        *(-0.39590389413323757734, 0.18453964097831570709, 0.25837438768632204729, 0.29501172360931029887),
    ),
}
"""Suzuki's five steps of order 4, and of order 6 and 8 the nine and seventeen of Kahan and Li (1997)."""


def steps_of(order: int) -> tuple[float, ...]:
    """Return the steps of a composition, as shares of the whole."""
    half = _FIRST_HALF[order]
    return (*half, 1.0 - 2.0 * sum(half), *half[::-1])
