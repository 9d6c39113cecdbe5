"""A Lagrangian by powers of the velocities: ``L = q'.M q'/2 + b.q' - U`` (Goldstein, section 1.6), in numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, jacobian, jvp, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import lagrangian_of

__all__ = ["Parts", "PartsAt", "parts_of"]


class Parts(NamedTuple):
    """The parts of a Lagrangian at places, with their derivatives by one coordinate.

    Attributes
    ----------
    mass, linear, potential
        M, shape (n, n, places), b, shape (n, places), and U, shape (places,).
    mass_slope, linear_slope, potential_slope
        Their derivatives.
    """

    mass: FloatArray
    linear: FloatArray
    potential: FloatArray
    mass_slope: FloatArray
    linear_slope: FloatArray
    potential_slope: FloatArray


PartsAt: TypeAlias = Callable[[FloatArray], Parts]
"""Gives the parts at places, shape (n, places)."""


def parts_of(assembly: Assembly, along: int, t: float) -> PartsAt:
    """Return what gives the parts of a scene's Lagrangian at places.

    Parameters
    ----------
    assembly
        The scene, in the reduced form.
    along
        Number of the coordinate by which they are differentiated.
    t
        Time, which they do not depend on.

    Raises
    ------
    UnsupportedError
        If L is no polynomial of second degree in the velocities.
    """
    found = lagrangian_of(assembly, "reduced")
    graph, n = found.graph, len(found.velocities)
    still: dict[Expression, Expression | float] = dict.fromkeys(found.velocities, 0.0)
    mass = [graph.zero] * (n * n)
    slope = jacobian(list(found.momenta), list(found.velocities))
    for row, column, entry in zip(slope.rows, slope.columns, slope.entries, strict=True):
        mass[row * n + column] = entry
    if any(depends_on(one, found.velocities) for one in mass):
        raise UnsupportedError(
            "its Lagrangian is no polynomial of second degree in the velocities",
            where=assembly.flat.name,
            advice="Simulate it.",
        )
    linear = substitute(list(found.momenta), still)
    potential = [-one for one in substitute([found.lagrangian], still)]
    every = [*mass, *linear, *potential]
    slopes = jvp(every, {found.coordinates[along]: 1.0})
    inputs = InputGroup("t", (found.time,)), InputGroup("q", found.coordinates)
    outputs = OutputGroup("parts", tuple(every)), OutputGroup("slopes", tuple(slopes))
    program = Program(f"{assembly.flat.name} reduced", inputs, assembly.parameters, outputs)
    kernel = assembly.kernel(program, vectorized=True)

    def at(q: FloatArray) -> Parts:
        q = np.ascontiguousarray(q, dtype=float)
        count = q.shape[1]
        made: list[FloatArray] = []
        for values in kernel(np.full((1, count), t), q):
            whole = np.broadcast_to(np.asarray(values, dtype=float), (n * n + n + 1, count))
            made += [whole[: n * n].reshape(n, n, count), whole[n * n : -1], whole[-1]]
        return Parts(*made)

    return at
