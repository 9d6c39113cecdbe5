"""What can move without inertia, which no force may act on: named before a run."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import StartError
from atwood.expr import Expression, depends_on, is_zero
from atwood.forms.assembly import Assembly
from atwood.numerics.matrices import Matrix, is_full, scaled, to_array
from atwood.numerics.rank import open_directions
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.dynamics.scales import motion_names

_APART = 1e8
"""Masses that differ by less do not explain why inertia is lost."""


State = tuple[float, FloatArray, FloatArray]


def check_massless_directions(
    assembly: Assembly, mass: Matrix, jacobian: Matrix, sizes: FloatArray, state: State
) -> None:
    """Refuse a direction in which something can move without inertia."""
    n = mass.shape[0]
    if n == 0:
        return
    sizes = _sizes_of_inertia(mass, sizes)
    if not is_full(mass):
        from atwood.numerics.sparse import massless_directions

        moving = massless_directions(mass, jacobian, sizes)
        if moving is not None:
            raise _massless_directions(assembly, moving, state)
        return
    weighed = mass * sizes[:, None] * sizes[None, :]
    if _is_clearly_positive(weighed):
        return
    if jacobian.shape[0]:
        free = open_directions(scaled(jacobian, sizes))
    else:
        free = np.eye(n)
    if not len(free):
        return
    values, vectors = np.linalg.eigh(free @ weighed @ free.T)
    if values[0] > 1e-14 * max(values[-1], 1e-300):
        return
    raise _massless_directions(assembly, np.abs(vectors[:, 0] @ free), state)


def _is_clearly_positive(weighed: FloatArray) -> bool:
    """Return whether there is inertia in every direction, free or not: then what is free need not be found."""
    try:
        np.linalg.cholesky(weighed - 1e-12 * np.trace(weighed) * np.eye(len(weighed)))
    except np.linalg.LinAlgError:
        return False
    return True


def _sizes_of_inertia(mass: Matrix, sizes: FloatArray) -> FloatArray:
    """Return displacements that move as much inertia along each speed: a satellite is small beside its orbit.

    What has none along a speed keeps its size beside the others.
    """
    own = np.asarray(mass.diagonal(), dtype=float)
    has = own > 0.0
    if not np.any(has):
        return sizes
    even = np.where(has, 1.0 / np.sqrt(np.where(has, own, 1.0)), 0.0)
    return np.where(has, even, sizes * _median(even[has] / sizes[has]))


def _massless_directions(assembly: Assembly, moving: FloatArray, state: State) -> StartError:
    every = motion_names(assembly.own_equations)
    names = [name for name, size in zip(every, moving, strict=True) if size > 0.1 * np.max(moving)]
    apart = _masses_apart(assembly, *state) if assembly.form == "reduced" else ""
    if apart:
        return StartError(
            f"the inertia along {', '.join(names)} is lost to rounding: {apart}, and a sum of them keeps 16 digits",
            where=_part_of(assembly, names[0]),
            advice="Simulate it with form='dae', where masses are not added up, or leave out what is so light.",
        )
    units = dict(zip(every, (one.unit for one in assembly.own_equations.speed_names), strict=True))
    turns = all(units[name] == "rad/s" for name in names)
    where = _part_of(assembly, names[0])
    acting = _acting_on(assembly, where)
    speeds = zip(assembly.own_equations.speeds, every, strict=True)
    bare = _without_mass(assembly, [speed for speed, name in speeds if name in names])
    if bare and not acting:
        return StartError(
            f"its mass is zero, and something without inertia is free to move along {', '.join(names)}: "
            "a force would accelerate it without bound",
            where=bare,
            advice="Give it a mass.",
        )
    return StartError(
        f"something without inertia is free to move along {', '.join(names)}: "
        "a force would accelerate it without bound" + (f", as {' and '.join(acting)} would" if acting else ""),
        where=where,
        advice=f"Give it a {'moment of inertia' if turns else 'mass'}, or hold it with a joint.",
    )


def _masses_apart(assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> str:
    """Return by how much masses differ where every body has inertia in all directions of its own; else nothing."""
    maximal = assembly.maximal
    big_q, big_u = (one[:, 0] for one in maximal_state(assembly, np.array([t]), q[:, None], u[:, None]))
    mass = to_array(balance_of(assembly, "dae").at(t, big_q, big_u).mass)
    own = np.diag(mass)
    moved = [i for i, one in enumerate(maximal.speed_names) if one.unit == "m/s"]
    if not np.all(own > 0.0) or not moved:
        return ""
    units = np.sqrt(own)
    if np.linalg.eigvalsh(mass / units[:, None] / units[None, :])[0] < 1e-12:
        return ""
    names = motion_names(maximal)
    light, heavy = min(moved, key=lambda i: own[i]), max(moved, key=lambda i: own[i])
    if own[heavy] < _APART * own[light]:
        return ""
    said = [f"{_part_of(assembly, names[i])} has {own[i]:.3g} kg" for i in (light, heavy)]
    return f"masses differ by too much ({' and '.join(said)})"


def _part_of(assembly: Assembly, name: str) -> str:
    """Return the part, or the connector, that a coordinate belongs to."""
    path = name.rpartition(".")[0]
    head, _, last = path.rpartition(".")
    return head if last in ("position", "velocity", "spin") and head else path


def _without_mass(assembly: Assembly, speeds: list[Expression]) -> str:
    """Return the part without mass that some speeds move, best one that holds nothing; empty if there is none."""
    equations, found = assembly.own_equations, ""
    for path, local in assembly.mechanism.locals_.items():
        masses = [m for one in local.point_inertias for row in one.masses for m in row]
        masses += [m for one in local.body_inertias for m in (one.mass, one.moment)]
        nodes = [assembly.mechanism.graph.node_of[path, name] for name in local.connectors]
        moved = [v for node in nodes for v in equations.kinematics.velocities.get(node, ())]
        if masses and all(map(is_zero, masses)) and any(depends_on(v, speeds) for v in moved):
            if not local.constraints:
                return path
            found = found or path
    return found


def _acting_on(assembly: Assembly, where: str) -> list[str]:
    """Return the parts whose forces act on a body without inertia: it has this name, or hangs on the joint that has."""
    graph, bodies = assembly.mechanism.graph, assembly.mechanism.bodies
    hanging = {bodies.body_of[node] for joint in graph.joints if joint.part == where for node in (joint.a, joint.b)}
    own = {one.index for one in bodies.bodies if one.name == where or one.index in hanging} - {0}
    found: dict[str, None] = {}
    for (path, _), node in graph.node_of.items():
        local = assembly.mechanism.locals_[path]
        if bodies.body_of[node] in own and (local.loads or local.potentials or local.dissipations or local.lagrangians):
            found[path] = None
    return list(found)


def _median(values: FloatArray) -> float:
    """Return the median; NumPy's loads its masked arrays, which takes longer than many a run."""
    ordered, half = np.sort(values), len(values) // 2
    return float(0.5 * (ordered[half] + ordered[-half - 1]))
