"""Which coordinates follow from the others in a mechanism with loops, and when another choice is better.

Of all choices, that one is good for which no independent speed moves a dependent one by much more than itself, each
measured by its size: no entry of ``W = G_d^-1 G_i`` is large. Where one is, the two change places, which multiplies
the determinant of G_d by that entry; so a few exchanges lead to a choice where no further one makes it larger.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.forms.loops import LoopProgram
from atwood.kernels.llvm_loops import LoopShape
from atwood.topology.groups import connected_groups

__all__ = ["POOR", "choice_lists", "choose_dependent", "loop_shape", "review_choice"]

FloatArray = NDArray[np.float64]

POOR = 1.5
"""A choice is poor where an independent coordinate moves a dependent one by so many times as much.

Of 1.2 to 10, tried on four-bars none of whose links can turn fully, values up to 2 took the fewest steps; at 10 they
took a quarter more, and ten times as many Jacobians where steps that failed followed each other.
"""

_SETTLED = 1.01
"""Exchanges go on until no entry is larger."""


def choose_dependent(slope: FloatArray, scales: FloatArray) -> tuple[int, ...]:
    """Return the coordinates that the constraints determine best: in turn, the column of which most is left.

    Parameters
    ----------
    slope
        Derivatives of independent constraints.
    scales
        Size of each coordinate.
    """
    count = slope.shape[0]
    rows = np.max(np.abs(slope * scales), axis=1, initial=0.0)
    rows[rows == 0.0] = 1.0
    left = slope * scales / rows[:, None]
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


def review_choice(slope: FloatArray, scales: FloatArray, dependent: tuple[int, ...]) -> tuple[int, ...]:
    """Return a better choice of dependent coordinates if a choice has become poor, else the same one.

    Parameters
    ----------
    slope
        Derivatives of independent constraints.
    scales
        Size of each coordinate.
    dependent
        The choice.
    """
    scaled = slope * scales
    chosen = list(dependent)
    bound = POOR
    for _ in range(10 * len(chosen)):
        free = [i for i in range(len(scales)) if i not in set(chosen)]
        if not free:
            break
        weights = _weights(scaled, chosen, free)
        if weights is None:
            better = choose_dependent(slope, scales)
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


def loop_shape(program: LoopProgram) -> LoopShape:
    """Return how many there are of each in a mechanism."""
    return LoopShape(program.coordinates, program.speeds, program.values, program.rates)


def choice_lists(program: LoopProgram, dependent: tuple[int, ...]) -> NDArray[np.int64]:
    """Return a choice as the lists of numbers that compiled code reads.

    The rows come in the order kinematic rows of independent coordinates, constraints, balances of independent speeds,
    rates of constraints.

    Parameters
    ----------
    program
        The mechanism.
    dependent
        The choice: as many coordinates as there are constraints, and the speeds of the same numbers.
    """
    shape, given = loop_shape(program), set(dependent)
    free = [i for i in range(shape.speeds) if i not in given]
    kinematic = [i for i in range(shape.coordinates) if i not in given]
    balances = [shape.coordinates + i for i in free]
    values = [shape.size + j for j in range(shape.values)]
    rates = [shape.size + shape.values + j for j in range(shape.rates)]
    blocks = _blocks(program, dependent)
    starts = np.cumsum([0, *(len(constraints) for constraints, _ in blocks)]).tolist()
    starts += [starts[-1]] * (shape.rates + 1 - len(starts))
    lists = {
        "source": [*kinematic, *values, *balances, *rates],
        "target": [len(kinematic) + shape.values + k for k in range(shape.free)],
        "independent": free,
        "dependent": [i for _, speeds in blocks for i in speeds],
        "constraints": [j for constraints, _ in blocks for j in constraints],
        "starts": starts,
        "blocks": [len(blocks)],
    }
    return np.array([number for name in shape.choice if name != "end" for number in lists[name]], dtype=np.int64)


def _blocks(program: LoopProgram, dependent: tuple[int, ...]) -> list[tuple[list[int], list[int]]]:
    """Return constraints and dependent speeds in groups that share nothing."""
    given = set(dependent)
    owner: dict[int, int] = {}
    shared = [
        (owner.setdefault(column, row), row)
        for row, column in zip(program.slope_rows.tolist(), program.slope_columns.tolist(), strict=True)
        if column in given
    ]
    blocks: list[tuple[list[int], list[int]]] = []
    for group in connected_groups(range(program.rates), shared):
        inside = set(group)
        blocks.append((group, [i for i in dependent if owner.get(i) in inside]))
    if all(len(constraints) == len(speeds) for constraints, speeds in blocks):
        return blocks
    return [(list(range(program.rates)), list(dependent))]  # it cannot be solved, which the numbers will say
