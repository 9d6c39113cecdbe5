"""Quantities of many runs at many times in one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.expr import Expression, depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import find_observables, observer
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.study.sweeps.motions import Motion


def reads(assembly: Assembly, paths: Sequence[str], symbols: Sequence[Expression]) -> bool:
    """Return whether a quantity depends on any of some symbols."""
    return any(depends_on(one.value, symbols) for one in find_observables(assembly, paths))


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
    values = assembly.parameter_values if rows is None else rows[:, : len(assembly.parameters)].T
    q = kinematic_map_of(assembly, "reduced").normalized(q)
    a, reactions = np.zeros_like(u), np.zeros((len(assembly.reactions), len(t)))
    if reads(assembly, paths, list(assembly.reduced.accelerations)):
        a = motion.accelerations(t, q, u, rows)
    if reads(assembly, paths, [one.symbol for one in assembly.reactions]):
        reactions = _reactions(assembly, (t, q, u), None if rows is None else values, numbers, own)
    kernel = assembly.compiled(observer(assembly, paths), vectorized=True).bind(values)
    found: FloatArray = kernel(t[None, :], q, u, a, reactions)[0]
    return found


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
