"""Sizes of many runs at once: in what time something happens, tolerances, and whether all that moves has inertia."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.forms.assembly import Assembly
from atwood.integrators.explicit_problem import LOOSEST
from atwood.integrators.methods import AUTO
from atwood.simulation.dynamics.scales import coordinate_scales, find_times, motion_scales
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.stiffness import can_be_stiff, find_stiff_rows
from atwood.study.sweeps.motions import Motion


def time_scales(
    motion: Motion,
    t: FloatArray,
    q: FloatArray,
    u: FloatArray,
    lengths: FloatArray,
    values: FloatArray | None,
    span: float,
) -> FloatArray:
    """Return in what time something happens in each run, as `find_scales` has it; nan where that has no value."""
    assembly = motion.assembly
    if not len(t):
        return np.zeros(0)
    a = motion.accelerations(t, q.T, u.T, values).T
    sizes = motion_scales(assembly.reduced, lengths)
    symbols = [one.name for one in assembly.parameters]
    given = assembly.parameter_values if values is None else values.T
    gravity = given[symbols.index("gravity")] if "gravity" in symbols else 0.0
    time = find_times(lengths, u, a, sizes, gravity, span)
    return np.where(np.all(np.isfinite(a), axis=1), time, np.nan)


def absolute_tolerances(assembly: Assembly, lengths: FloatArray, time: FloatArray, relative: float) -> FloatArray:
    """Return the absolute tolerances of coordinates and speeds of each run, as `Plan.tolerances` has them."""
    share, equations = min(relative, LOOSEST), assembly.reduced
    sizes = coordinate_scales(equations, lengths), motion_scales(equations, lengths) / time[:, None]
    return np.concatenate([share * one for one in sizes], axis=1)


def have_inertia(
    motion: Motion, t: FloatArray, q: FloatArray, u: FloatArray, values: FloatArray | None, lengths: FloatArray
) -> NDArray[np.bool_]:
    """Return where nothing can move without inertia, by the measure of `make_plan`; see `time_scales`."""
    mass = motion.masses(t, q.T, u.T, values)
    directions = motion.open_directions(t, q.T, u.T, values)
    if directions is None:
        sizes = motion_scales(motion.assembly.reduced, lengths)
    else:
        mass = np.swapaxes(directions, 1, 2) @ mass @ directions
        sizes = 1.0 / np.sqrt(np.abs(np.diagonal(mass, axis1=1, axis2=2)))
    mass = mass * sizes[:, :, None] * sizes[:, None, :]
    usable = np.all(np.isfinite(mass), axis=(1, 2))
    mass[~usable] = np.eye(mass.shape[1])
    found = np.linalg.eigvalsh(mass)
    good: NDArray[np.bool_] = usable & (found[:, 0] > 1e-14 * np.maximum(found[:, -1], 1e-300))
    return good


def are_stiff(
    motion: Motion,
    t: FloatArray,
    y: FloatArray,
    values: FloatArray | None,
    tolerances: FloatArray,
    time: FloatArray,
    options: RunOptions,
) -> NDArray[np.bool_]:
    """Return which runs `choose` would give to an implicit method; none where a method was asked for."""
    assembly = motion.assembly
    if not len(t) or options.solver != AUTO or not can_be_stiff(assembly):
        return np.zeros(len(t), dtype=np.bool_)
    program = motion.program.program
    kernel = assembly.compiled(program, vectorized=True).bind(assembly.parameter_values if values is None else values.T)
    n = len(program.inputs[1].symbols)

    def rates(states: FloatArray) -> FloatArray:
        found = kernel(t[None, :], states[:, :n].T, states[:, n:].T)
        first = states[:, n:].T if len(found) == 1 else found[0]
        both = [np.broadcast_to(one, (len(one), len(t))) for one in (first, found[-1])]
        return np.asarray(np.concatenate(both).T, dtype=np.float64)

    relative = options.relative_tolerance
    return find_stiff_rows(rates, y, tolerances / min(relative, LOOSEST), time, options.t_end - t, relative)
