"""A choice of dependent coordinates as the lists of numbers that compiled code reads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.codegen.sundials.null_space import NullSpaceShape
from atwood.forms.null_space import NullSpaceProgram
from atwood.topology.graph import connected_groups

__all__ = ["choice_lists", "null_space_shape"]


def null_space_shape(program: NullSpaceProgram) -> NullSpaceShape:
    """Return how many there are of each in a mechanism."""
    return NullSpaceShape(program.coordinates, program.speeds, program.values, program.rates)


def choice_lists(
    program: NullSpaceProgram, dependent: tuple[int, ...], places: tuple[int, ...] | None = None
) -> NDArray[np.int64]:
    """Return a choice as the lists of numbers that compiled code reads.

    The rows come in the order kinematic rows of independent coordinates, constraints, balances of independent speeds,
    rates of constraints.

    Parameters
    ----------
    program
        The mechanism.
    dependent
        The choice: as many speeds as there are constraints.
    places
        As many speeds as there are constraints on positions, along which displacements follow; the same when None.
    """
    shape, given = null_space_shape(program), set(dependent)
    free = [i for i in range(shape.speeds) if i not in given]
    kinematic = [i for i in range(shape.coordinates) if i not in set(dependent if places is None else places)]
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


def _blocks(program: NullSpaceProgram, dependent: tuple[int, ...]) -> list[tuple[list[int], list[int]]]:
    """Return constraints and dependent speeds in groups that share nothing."""
    given = set(dependent)
    owner: dict[int, int] = {}
    shared = [
        (owner.setdefault(column, row), row)
        for row, column in zip(program.jacobian_rows.tolist(), program.jacobian_columns.tolist(), strict=True)
        if column in given
    ]
    blocks: list[tuple[list[int], list[int]]] = []
    for group in connected_groups(range(program.rates), shared):
        inside = set(group)
        blocks.append((group, [i for i in dependent if owner.get(i) in inside]))
    if all(len(constraints) == len(speeds) for constraints, speeds in blocks):
        return blocks
    return [(list(range(program.rates)), list(dependent))]  # it cannot be solved, which the numbers will say
