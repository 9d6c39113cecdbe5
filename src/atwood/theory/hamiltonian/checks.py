"""Which scenes have a Hamiltonian, and of which it is the energy."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, KernelEvaluationError, UnsupportedError, UsageError
from atwood.forms.assembly import Assembly
from atwood.showing import count_of
from atwood.simulation.dynamics.orientation_coordinates import from_regular
from atwood.simulation.initialization.start import find_start
from atwood.theory.hamiltonian.legendre import LegendreTransform
from atwood.tolerances import tolerances

__all__ = ["changes_in_time", "check_mass", "is_energy", "refuse_without_hamiltonian", "sample_states"]

_SAMPLES = 6
"""States at random at which it is looked whether the mass matrix is singular everywhere, and whether H is T + V."""


def refuse_without_hamiltonian(assembly: Assembly) -> None:
    """Refuse a scene whose motion is not that of free coordinates with a momentum each.

    Parameters
    ----------
    assembly
        The scene.

    Raises
    ------
    UsageError
        If it is in the dae form.
    UnsupportedError
        If it rolls, if closed loops tie its coordinates, or if parts have states of their own.
    """
    name = assembly.flat.name
    if assembly.form == "dae":
        raise UsageError(
            "in the dae form coordinates are tied by constraints, and have no free momenta",
            where=name,
            advice="Assemble the scene in the reduced form.",
        )
    equations = assembly.reduced
    rolling = [one for one in equations.constraints if not one.holonomic]
    if rolling or equations.solved_speeds:
        where = rolling[0].key[0] if rolling else name
        raise UnsupportedError(
            "it rolls: its constraints hold velocities and cannot be integrated, so that the forces of these are in no "
            "Hamiltonian, and its flow is not canonical",
            where=where,
            advice="Its energy function is kept all the same (`simulate` has it as `energy`), and `equations` has its "
            "equations of motion with multipliers.",
        )
    if equations.constraints:
        raise UnsupportedError(
            f"closed loops tie its {count_of(len(equations.coordinates), 'coordinate')} by "
            f"{count_of(len(equations.constraints), 'constraint')}, so that their momenta are not free",
            where=equations.constraints[0].key[0],
            advice="Take coordinates that the constraints leave free, such as angles in place of positions; or "
            "`equations`, which keeps the constraints with multipliers.",
        )
    if equations.states:
        raise UnsupportedError(
            "parts have states of their own, which follow equations of first order and have no momenta",
            where=name,
            advice="Take the scene without these parts, or `equations`.",
        )
    if not equations.coordinates:
        raise UnsupportedError("nothing in it can move, so that it has no momenta", where=name)


def sample_states(transform: LegendreTransform) -> tuple[float, FloatArray, FloatArray]:
    """Return a time and states: coordinates and velocities, a row each; those of the start first if there is one."""
    assembly, n = transform.assembly, transform.size
    random = np.random.default_rng(20)
    try:
        begun = find_start(assembly)
        t, q, size = begun.time, from_regular(assembly, begun.coordinates), begun.length
    except AtwoodError:
        t, q, size = assembly.flat.t_start, np.zeros(n), 1.0
    units = np.array([1.0 if one.unit == "rad" else size for one in transform.lagrangian.names])
    near = q + 0.5 * units * random.uniform(-1.0, 1.0, (_SAMPLES, n))
    return t, np.vstack([q, near]), units * random.uniform(-1.0, 1.0, (_SAMPLES + 1, n))


def check_mass(transform: LegendreTransform) -> None:
    """Refuse a scene whose mass matrix is singular everywhere.

    Parameters
    ----------
    transform
        Its Legendre transform.

    Raises
    ------
    UnsupportedError
        If it is so; the error names a coordinate that has no inertia of its own.
    """
    t, places, velocities = sample_states(transform)
    worst: FloatArray | None = None
    for q, v in zip(places, velocities, strict=True):
        try:
            mass = transform.mass_matrix(q, 0.1 * v, t)
        except KernelEvaluationError:  # not every place is one where all laws have values
            continue
        sizes = np.sqrt(np.abs(np.diag(mass)))
        if np.all(sizes > 0.0):
            values, vectors = np.linalg.eigh(mass / np.outer(sizes, sizes))
            if np.min(np.abs(values)) > tolerances.SAME * len(values):
                return
            worst = np.abs(vectors[:, int(np.argmin(np.abs(values)))]) if worst is None else worst
        elif worst is None:
            worst = np.where(sizes > 0.0, 0.0, 1.0)
    if worst is None:
        return
    names = transform.lagrangian.names
    found = [names[i].name for i in np.flatnonzero(worst > 0.5 * np.max(worst))]
    what = f"{found[0]} has no inertia" if len(found) == 1 else f"{' and '.join(found)} move together without inertia"
    raise UnsupportedError(
        f"its mass matrix is singular: {what}, so that momenta do not determine velocities and there is no Hamiltonian",
        where=found[0],
        advice="Give what moves there a mass, or leave that coordinate out; `simulate` and `equations` need neither.",
    )


def is_energy(transform: LegendreTransform) -> bool:
    """Return whether H is T + V, as compared at random states.

    Parameters
    ----------
    transform
        The Legendre transform of the scene.
    """
    t, places, velocities = sample_states(transform)
    for q, v in zip(places, velocities, strict=True):
        try:
            h = float(transform.momenta(q, v, t) @ v - transform.lagrange_function(q, v, t))
            kinetic, potential = transform.energies(q, v, t)
        except KernelEvaluationError:
            continue
        if abs(h - kinetic - potential) > tolerances.CLOSED * (abs(kinetic) + abs(potential) + abs(h)):
            return False
    return True


def changes_in_time(transform: LegendreTransform) -> bool:
    """Return whether ``dL/dt`` is not zero at some of some random states and times.

    Parameters
    ----------
    transform
        The Legendre transform of the scene.
    """
    begin, places, velocities = sample_states(transform)
    span = transform.assembly.flat.t_end - begin
    for k, (q, v) in enumerate(zip(places, velocities, strict=True)):
        t = begin + span * (k + 0.5) / (len(places) + 1)
        try:
            rate = float(transform.time_derivative(q, v, t))
            size = float(np.sum(np.abs(transform.energies(q, v, t)))) + abs(float(transform.lagrange_function(q, v, t)))
        except KernelEvaluationError:
            continue
        if abs(rate) > tolerances.CLOSED * size / span:
            return True
    return False
