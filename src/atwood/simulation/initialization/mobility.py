"""Mechanisms that cannot move, and what can move without inertia: both are refused before a run, by name."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import StartError, TopologyError
from atwood.expr import Expression, OutputGroup, Program, SparseMatrix, depends_on, is_zero, jacobian
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.program import state_groups
from atwood.forms.quantities import known_program
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Constraint
from atwood.model.declare.component import Component
from atwood.model.declare.laws import Kind
from atwood.numerics.matrices import LARGEST_FULL, Matrix, is_full, scaled, to_array
from atwood.numerics.rank import independent_rows, least_inertia, open_directions
from atwood.numerics.sparse import csr_of, massless_directions
from atwood.simulation.dynamics.balance import BalanceValues, balance_of, is_wide
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.dynamics.scales import is_length, motion_names, motion_scales, scene_length
from atwood.simulation.initialization.start import Start, start_in_maximal
from atwood.tolerances import tolerances

_SHOWN = 4

_PRESCRIBED: Key[Program] = Key("prescribed")
_MOVES: Key[None] = Key("whether something can move")


@dataclass(frozen=True)
class Immobile:
    """A mechanism in which nothing can move: a structure, whose forces are those of statics.

    Attributes
    ----------
    freed
        Joint laws and ties with the degrees of freedom that there would be without each; those that give fewest first.
        None where there are too many to try each.
    surplus
        How many of its constraints follow from the others, so that their reactions are not unique; 0 where that was
        not looked at.
    """

    freed: tuple[tuple[str, int], ...] | None
    surplus: int

    def describe(self) -> str:
        """Return what it is, and what would have to let go, as a sentence."""
        text = "nothing can move: joints and ties hold every body where it is"
        if self.surplus:
            text += f", {self.surplus} of their constraints to spare"
        if self.freed is None:
            text += f" (with more than {LARGEST_FULL} speeds it is not tried what would happen if one let go)"
        elif self.freed:
            ways = [f"{name} ({count})" for name, count in self.freed[:_SHOWN]]
            more = len(self.freed) - _SHOWN
            text += f"; degrees of freedom if one let go: {', '.join(ways)}" + (f" and {more} more" if more > 0 else "")
        else:
            text += "; it takes more than one of them to let go"
        return text

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        freed = None
        if self.freed is not None:
            freed = [{"path": path, "degrees_of_freedom": count} for path, count in self.freed]
        return {"freed": freed, "surplus": self.surplus}


def find_immobile(assembly: Assembly, freedom: int, start: Start) -> Immobile | None:
    """Return why nothing can move; None if something can, or is driven."""
    equations = assembly.maximal
    values = [one.value if one.value is not None else one.rate for one in equations.constraints]
    if freedom > 0 or not equations.speeds:
        return None
    if equations.prescribed or any(depends_on(value, assembly.mechanism.relations.roots) for value in values):
        return None  # driven
    if len(equations.speeds) > LARGEST_FULL:
        return Immobile(None, 0)
    scales = motion_scales(equations, start.length)
    q, _ = start_in_maximal(assembly, start)
    balance = balance_of(assembly, "dae")
    rows = scaled(to_array(balance.at(start.time, q, np.zeros_like(scales)).jacobian), scales)
    errors = balance.errors.of_jacobian(start.time, q, scales)
    groups: dict[str, list[int]] = {}
    for i, one in enumerate(equations.constraints):
        groups.setdefault(_name(assembly, one), []).append(i)
    found = []
    for name, numbers in groups.items():
        others = np.delete(np.arange(len(rows)), numbers)
        left = len(scales) - len(independent_rows(rows[others], errors[others]))
        if left > 0:
            found.append((name, left))
    found.sort(key=lambda one: one[1])
    return Immobile(tuple(found), len(rows) - len(independent_rows(rows, errors)))


def refuse_immobile(assembly: Assembly, freedom: int, start: Start) -> None:
    """Raise if nothing can move, and nothing is driven or may let go later: this is seldom what was meant."""
    assembly.kept.get(_MOVES, lambda: _refuse_immobile(assembly, freedom, start), freedom)


def _refuse_immobile(assembly: Assembly, freedom: int, start: Start) -> None:
    if all(_only_holds(part.component) for part in assembly.flat.parts.values()):
        raise TopologyError(
            "there is nothing in it but what is fixed in the world",
            where=assembly.flat.name,
            advice="Add what moves: scene.add('bob', PointMass()), and connect it.",
        )
    found = find_immobile(assembly, freedom, start) if freedom <= 0 and not assembly.modes else None
    if found is None:
        return
    for path, part in _without_moment(assembly):
        raise TopologyError(
            f"it could only turn at {path}, and has no moment of inertia about that place to turn with",
            where=part,
            advice="Give it a moment of inertia, or a centre of mass away from the joint.",
        )
    raise TopologyError(
        found.describe(),
        where=found.freed[0][0] if found.freed else assembly.flat.name,
        advice="Look at the axes and places of the joints; if it is meant as a structure, say structure=True "
        "(on the command line: --structure).",
    )


def _without_moment(assembly: Assembly) -> Iterator[tuple[str, str]]:
    """Yield joints at which a body with mass could turn whose moment of inertia is zero, with a part of the body."""
    bodies, masses = assembly.mechanism.bodies, assembly.maximal.masses.bodies
    for joint in assembly.mechanism.graph.joints:
        for node in (joint.a, joint.b):
            body = bodies.body_of[node]
            if joint.turns and body in masses and body not in bodies.oriented:
                yield joint.part, masses[body].parts[0]


_OTHER_KINDS = tuple(kind for kind in get_args(Kind) if kind != "joint")


def _only_holds(component: Component) -> bool:
    """Return whether all that a component does is to fix frames in the world."""
    fixes = all(law.options.a == "world" and law.options.rigid for law in component.laws("joint"))
    return fixes and not any(component.laws(kind) for kind in _OTHER_KINDS)


def _name(assembly: Assembly, one: Constraint) -> str:
    """Return the path of a law; of the part alone where it has no other law that holds."""
    part, law, _ = one.key
    laws = {other.key[1] for other in assembly.maximal.constraints if other.key[0] == part}
    return part if len(laws) == 1 else f"{part}.{law}"


def check_prescribed(assembly: Assembly, times: FloatArray) -> None:
    """Refuse motions that are prescribed for what is held, or twice over, where they contradict each other."""
    prescribed = assembly.own_equations.prescribed
    if not prescribed:
        return
    program = known_program(assembly, _PRESCRIBED, lambda: [value for _, value in prescribed])
    n, m = len(assembly.own_equations.coordinates), len(assembly.own_equations.speeds)
    idle = (np.zeros(n), np.zeros(m), np.zeros(m), np.zeros(len(assembly.reactions)))
    misses = np.abs(assembly.kernel(program, vectorized=True)(times[None, :], *idle)[0])
    length, equations = scene_length(assembly), assembly.own_equations
    units = np.array([length if is_length(equations, key) else 1.0 for key, _ in prescribed])
    misses = misses / units[:, None]
    if float(np.max(misses)) > tolerances.CLOSED:
        worst, moment = np.unravel_index(int(np.argmax(misses)), misses.shape)
        part, law, _ = prescribed[int(worst)][0]
        raise TopologyError(
            f"the constraint cannot be satisfied: at t = {times[moment]:.6g} a prescribed motion contradicts a "
            "fixed part, by "
            f"{misses[worst, moment] * units[worst]:.3g}",
            where=f"{part}.{law}",
            advice="Two drives, or a drive and a fixed part, prescribe the same motion differently.",
        )


_APART = 1e8
"""Masses that differ by less do not explain why inertia is lost."""


State = tuple[float, FloatArray, FloatArray]


def check_massless_directions(
    assembly: Assembly, now: BalanceValues, jacobian: Matrix, sizes: FloatArray, state: State
) -> None:
    """Refuse a direction in which something can move without inertia."""
    n = len(now.bias)
    if n == 0 or (is_wide(assembly, assembly.form) and bodies_have_inertia(assembly, *state)):
        return
    mass = now.mass
    sizes = _sizes_of_inertia(mass, sizes)
    if not is_full(mass):
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


_INERTIA: Key[tuple[Program, SparseMatrix]] = Key("inertia of bodies")


def bodies_have_inertia(assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> bool:
    """Return whether each body has inertia in all its directions, and none so much more that others' is rounding.

    Then there is inertia along all generalized coordinates, and their mass matrix, which is large, need not be made.
    """
    maximal = assembly.maximal

    def make() -> tuple[Program, SparseMatrix]:
        found = jacobian(list(maximal.rows), list(maximal.accelerations))
        outputs = (OutputGroup("inertia", tuple(found.entries)),)
        return Program("inertia of bodies", state_groups(maximal), assembly.parameters, outputs), found

    program, places = assembly.shared.get(_INERTIA, make)
    big_q, big_u = (one[:, 0] for one in maximal_state(assembly, np.array([t]), q[:, None], u[:, None]))
    n = len(maximal.speeds)
    mass = csr_of(places.rows, places.columns, assembly.kernel(program)([t], big_q, big_u)[0], (n, n))
    own = np.asarray(mass.diagonal(), dtype=float)
    units = np.array([one.unit for one in maximal.speed_names])
    alike = (own[units == unit] for unit in np.unique(units))
    if not np.all(own > 0.0) or any(np.max(one) > _APART * np.min(one) for one in alike):
        return False
    return massless_directions(mass, np.zeros((0, n)), 1.0 / np.sqrt(own)) is None


def _is_clearly_positive(weighed: FloatArray) -> bool:
    """Return whether there is inertia in every direction, free or not: then what is free need not be found."""
    raised = weighed.copy()  # in its place: of ten thousand bodies each copy is large
    raised[np.diag_indices_from(raised)] -= 1e-12 * np.trace(weighed)
    try:
        np.linalg.cholesky(raised)
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
    ratios, count = np.sort(even[has] / sizes[has]), np.count_nonzero(has)
    middle = np.mean(ratios[(count - 1) // 2 : count // 2 + 1])  # NumPy's median loads masked arrays, longer than a run
    return np.where(has, even, sizes * middle)


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
    if not moved or least_inertia(mass) < 1e-12:
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
