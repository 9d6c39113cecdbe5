"""The Jacobian of a residual as a program: entry by entry, or, where that is too long, as its product with a direction.

The Jacobian of a long chain in generalized coordinates is full.  Written out entry by entry it grows with the square of
the number of links; its product with one direction is a single forward sweep, which is written once and done for one
column after the other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.expr import Expression, InputGroup, OutputGroup, Program, jacobian, jvp, live, sweeps_exceed
from atwood.late import dataclass

__all__ = ["Derivative", "derive", "directions", "is_too_long"]

_LONGEST = 60_000
"""Entries are written out if no more nodes than these are visited for them.

A chain of 80 links is about that long. There, on one core, the columns of 100 links take 1 ms and its entries 0.03 ms,
which is little beside the 5 ms of a factorisation; to derive and compile them takes 0.1 s instead of 2 s.
"""

_FULL = 0.05
"""A Jacobian is full if a column visits more than this share of the nodes; where it is not, a product wastes work."""


@dataclass(frozen=True)
class Derivative:
    """The Jacobian ``dF/dy + cj dF/dy'``.

    Attributes
    ----------
    program
        Program of (t, y, yp, cj) with the entries; by columns, of (t, y, yp, cj, direction) with the product.
    rows, columns
        Where the entries are, by column and then by row; by columns, everywhere.
    by_columns
        Which of the two it is.
    """

    program: Program
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    by_columns: bool


def is_too_long(
    outputs: Sequence[Expression], wrt: Sequence[Expression | dict[Expression, Expression | float]]
) -> bool:
    """Return whether a Jacobian is better done by columns than entry by entry."""
    if len(wrt) < 50:
        return False
    return sweeps_exceed(outputs, wrt, max(_LONGEST, int(_FULL * len(wrt) * len(live(outputs)))))


def directions(symbols: Sequence[Expression]) -> InputGroup:
    """Return a direction: one symbol for each of the given ones."""
    return InputGroup("direction", tuple(s.graph.symbol(f"direction:{s.name}") for s in symbols))


def derive(
    name: str,
    residual: Sequence[Expression],
    groups: tuple[InputGroup, ...],
    parameters: tuple[Expression, ...],
    may_go_by_columns: bool,
) -> Derivative:
    """Return the Jacobian of a residual.

    Parameters
    ----------
    name
        What the program is called.
    residual
        F.
    groups
        Its inputs: time, y and y'.
    parameters
        The symbols of parameters.
    may_go_by_columns
        Whether it may be its product with a direction.
    """
    _, (_, y), (_, yp) = groups
    graph = y[0].graph if y else parameters[0].graph
    cj = graph.symbol("cj")
    inputs = (*groups, InputGroup("cj", (cj,)))
    wrt: list[dict[Expression, Expression | float]] = [{a: 1.0, b: cj} for a, b in zip(y, yp, strict=True)]
    n = len(y)
    if may_go_by_columns and is_too_long(residual, wrt):
        along = directions(y)
        seeds: dict[Expression, Expression | float] = {}
        for a, b, v in zip(y, yp, along.symbols, strict=True):
            seeds[a], seeds[b] = v, cj * v
        outputs = (OutputGroup("product", tuple(jvp(list(residual), seeds))),)
        rows, columns = np.tile(np.arange(n), n), np.repeat(np.arange(n), n)
        return Derivative(Program(name, (*inputs, along), parameters, outputs), rows, columns, True)
    entries = jacobian(list(residual), list(wrt))
    outputs = (OutputGroup("entries", tuple(entries.entries)),)
    rows, columns = np.asarray(entries.rows, dtype=np.intp), np.asarray(entries.columns, dtype=np.intp)
    return Derivative(Program(name, inputs, parameters, outputs), rows, columns, False)
