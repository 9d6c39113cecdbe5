"""Equations of motion written as an expert would by hand."""

from __future__ import annotations

from collections.abc import Sequence

from atwood.expr import Expression
from atwood.expr.simplify.collect import collect
from atwood.forms.derived import derive_once
from atwood.mechanics.dynamics.equations import Equations

__all__ = ["as_by_hand"]

_MOST_COORDINATES = 12
"""Up to so many coordinates equations are rewritten; beyond, the recursion is shorter than any closed form."""


def as_by_hand(equations: Equations, parameters: Sequence[Expression], rows: Sequence[Expression]) -> list[Expression]:
    """Return rows rewritten with fewer operations, for scenes of the size that one would do by hand.

    Parameters
    ----------
    equations
        Whose rows they are.
    parameters
        Symbols that keep their values for a run.
    rows
        The rows, with their values.
    """
    if len(equations.coordinates) > _MOST_COORDINATES or equations.solved_speeds:
        return list(rows)
    angles = [q for q, c in zip(equations.coordinates, equations.names, strict=True) if c.unit == "rad"]
    read = tuple(rows), tuple(angles), parameters
    _, found = derive_once("rows", equations.graph, read, lambda: ("", collect(list(rows), angles, parameters)))
    return found
