"""Derivatives of velocities by the speeds of a scene."""

from __future__ import annotations

from collections.abc import Sequence

from atwood.errors import UsageError, suggestion_in_parts
from atwood.expr import Expression, depends_on, jacobian, jvp
from atwood.forms.assembly import Assembly
from atwood.mechanics.dynamics.equations import Equations

__all__ = ["by_speeds", "velocity_jacobian"]


def velocity_jacobian(assembly: Assembly, equations: Equations, path: str) -> tuple[list[Expression], tuple[int, ...]]:
    """Return the derivatives of a quantity's rate, or of a velocity, by the speeds, and the shape of what they make.

    Parameters
    ----------
    assembly
        The scene.
    equations
        Its equations, in the coordinates that are wanted.
    path
        A quantity, or a vector of them.

    Raises
    ------
    UsageError
        If there is no such quantity, or it depends on accelerations or reactions.
    """
    e, observables = equations, assembly.observables
    vector = [f"{path}.{axis}" for axis in "xyz" if f"{path}.{axis}" in observables]
    if path not in observables and not vector:
        known = sorted({one.rpartition(".")[0] if one[-2:] in (".x", ".y", ".z") else one for one in observables})
        raise UsageError("there is no such quantity", where=path, advice=suggestion_in_parts(path, known))
    values = [observables[one].value for one in ([path] if path in observables else vector)]
    others = [*e.accelerations, *(one.symbol for one in assembly.reactions)]
    if any(depends_on(value, others) for value in values):
        raise UsageError(
            "it depends on accelerations or reactions, and has no derivative of motion",
            where=path,
            advice="Ask for a position, an angle or a velocity.",
        )
    if not any(depends_on(value, e.speeds) for value in values):
        values = jvp(values, {e.time: 1.0, **dict(zip(e.coordinates, e.rates, strict=True))})
    entries = by_speeds(values, e)
    if any(depends_on(one, e.speeds) for one in dict.fromkeys(entries)):
        raise UsageError("it is not linear in the speeds", where=path, advice="Ask for a position or a velocity.")
    shape = (len(e.speeds),)
    return entries, shape if path in observables else (len(vector), *shape)


def by_speeds(values: Sequence[Expression], equations: Equations) -> list[Expression]:
    """Return the derivatives of values by the speeds, row by row."""
    n = len(equations.speeds)
    entries = [equations.graph.zero] * (len(values) * n)
    found = jacobian(list(values), list(equations.speeds)) if values else None
    if found is not None:
        for row, column, entry in zip(found.rows, found.columns, found.entries, strict=True):
            entries[row * n + column] = entry
    return entries
