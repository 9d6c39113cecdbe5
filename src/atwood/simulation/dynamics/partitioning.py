"""Which coordinates follow from the others in a mechanism with loops, and when another choice is better.

Of all choices, that one is good for which no independent speed moves a dependent one by much more than itself, each
measured by its size: no entry of ``W = G_d^-1 G_i`` is large. Where one is, the two change places, which multiplies
the determinant of G_d by that entry; so a few exchanges lead to a choice where no further one makes it larger.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.numerics.matrices import or_one

POOR = 1.5
"""A choice is poor where an independent coordinate moves a dependent one by so many times as much.

Of 1.2 to 10, tried on four-bars none of whose links can turn fully, values up to 2 took the fewest steps; at 10 they
took a quarter more, and ten times as many Jacobians where steps that failed followed each other.
"""

_SETTLED = 1.01
"""Exchanges go on until no entry is larger."""


def choose_dependent_coordinates(jacobian: FloatArray, scales: FloatArray) -> tuple[int, ...]:
    """Return the coordinates that the constraints determine best: in turn, the column of which most is left."""
    count = jacobian.shape[0]
    rows = or_one(np.max(np.abs(jacobian * scales), axis=1, initial=0.0))
    left = jacobian * scales / rows[:, None]
    chosen: list[int] = []
    for _ in range(count):
        sizes = np.einsum("ij,ij->j", left, left)
        sizes[chosen] = -1.0
        best = int(np.argmax(sizes))
        chosen.append(best)
        if sizes[best] > 0.0:
            direction = left[:, best] / np.sqrt(sizes[best])
            for _ in range(2):  # once more, against rounding
                left = left - direction[:, None] * (direction @ left)
    return tuple(sorted(chosen))


def review_partitioning(jacobian: FloatArray, scales: FloatArray, dependent: tuple[int, ...]) -> tuple[int, ...]:
    """Return a better choice of dependent coordinates if a choice has become poor, else the same one."""
    scaled = jacobian * scales
    chosen = list(dependent)
    bound = POOR
    for _ in range(10 * len(chosen)):
        free = [i for i in range(len(scales)) if i not in set(chosen)]
        if not free:
            break
        weights = _weights(scaled, chosen, free)
        if weights is None:
            better = choose_dependent_coordinates(jacobian, scales)
            if better == tuple(sorted(chosen)):
                break
            chosen, bound = list(better), _SETTLED
            continue
        row, column = np.unravel_index(int(np.argmax(weights)), weights.shape)
        if weights[row, column] <= bound:
            break
        chosen[int(row)], bound = free[int(column)], _SETTLED
    return tuple(sorted(chosen))


def _weights(scaled: FloatArray, chosen: list[int], free: list[int]) -> FloatArray | None:
    try:
        weights = np.abs(np.linalg.solve(scaled[:, chosen], scaled[:, free]))
    except np.linalg.LinAlgError:
        return None
    return weights if np.all(np.isfinite(weights)) else None
