"""Quantities of many runs at many times in one call."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.forms.assembly import Assembly
from atwood.result.segment_quantities import quantities_at
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.study.sweeps.motions import Motion, with_rows


def read_quantities(
    motion: Motion,
    paths: tuple[str, ...],
    state: tuple[FloatArray, FloatArray, FloatArray],
    rows: FloatArray | None,
    numbers: NDArray[np.intp],
    own: Callable[[int], Assembly],
) -> FloatArray:
    """Return quantities at states of many runs, shape (quantities, states)."""
    assembly, (t, q, u) = motion.assembly, state
    if not len(t):
        return np.zeros((len(paths), 0))
    many = with_rows(assembly, rows)
    q = kinematic_map_of(assembly, "reduced").normalized(q)
    return quantities_at(
        many,
        paths,
        (t, q, u),
        lambda: motion.accelerations(t, q, u, rows),
        lambda: _reactions(assembly, (t, q, u), None if rows is None else many.parameter_values, numbers, own),
    )


def _reactions(
    assembly: Assembly,
    state: tuple[FloatArray, FloatArray, FloatArray],
    values: FloatArray | None,
    numbers: NDArray[np.intp],
    own: Callable[[int], Assembly],
) -> FloatArray:
    t, q, u = state
    first = ReactionSolver(assembly, float(t[0]), q[:, 0], u[:, 0])
    if values is None:
        return first.at(t, q, u)[0]
    if not first.finding.redundant:
        return first.for_rows(values).at(t, q, u)[0]
    found = np.zeros((len(assembly.reactions), len(t)))
    for run in np.unique(numbers).tolist():
        part = np.flatnonzero(numbers == run)
        solver = ReactionSolver(own(run), float(t[part[0]]), q[:, part[0]], u[:, part[0]])
        found[:, part] = solver.at(t[part], q[:, part], u[:, part])[0]
    return found
