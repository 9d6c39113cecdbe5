"""What a scene in space would save in a plane or on a line, where by symmetry its motion stays there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.display import data_of
from atwood.errors import AtwoodError
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import coordinate_program, state_program
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.kinematics.mechanism import world_position
from atwood.mechanics.kinematics.orientation import node_axes, spin_in_world
from atwood.model.local.flatten import FlatScene
from atwood.model.values.space import Vector, make_space
from atwood.numerics.matrices import scaled
from atwood.numerics.rank import independent_rows
from atwood.pipeline import assemble_flat
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.initialization.start import Start, find_start, own_state
from atwood.simulation.problem.preparation import make_problem
from atwood.theory.symmetry.dimension import Symmetry, find_symmetries

_SAME = 1e-8
"""Relative to the scene's sizes: how well place, speed and acceleration at the start must agree in both spaces."""

_CARRIED = (
    *("position.x", "position.z", "velocity.x", "velocity.z", "displacement", "speed"),
    *("angle", "angular_velocity"),
)
"""Quantities that mean the same in both spaces and are handed on as guesses."""


@dataclass(frozen=True, eq=False)
class Offer:
    """Where a motion in space stays by symmetry, and what it would cost to compute it there.

    Attributes
    ----------
    space
        ``"plane"`` or ``"line"``.
    where
        Which one, in words.
    direction
        Unit normal of the plane, or unit vector along the line, in world axes.
    states, operations
        Of the scene there, by form: length of the solver's vector, and operations of one residual. Empty where the
        scene could not be assembled there.
    why_not
        Why it could not be; empty if it was.
    assembly
        The scene there in the reduced form, ready to be simulated; None where it could not be assembled.
    """

    space: str
    where: str
    direction: tuple[float, float, float]
    states: Mapping[str, int] = field(default_factory=dict)
    operations: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    why_not: str = ""
    assembly: Assembly | None = field(default=None, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Return the offer as plain data."""
        return data_of(self, "space", "where", "direction", "states", "operations", "why_not")


def find_offers(assembly: Assembly, start: Start) -> tuple[Offer, ...]:
    """Return where the motion of a scene in space stays by symmetry: on a line, in a plane, or neither."""
    return tuple(_offer(assembly, start, one) for one in find_symmetries(assembly, start))


def _offer(assembly: Assembly, start: Start, found: Symmetry) -> Offer:
    x, y, z = (float(component) for component in found.direction)
    offer = Offer(found.space, found.name, (x, y, z))
    if found.space == "plane" and (x, y, z) != (0.0, 1.0, 0.0):
        return replace(offer, why_not=_elsewhere(x, y, z))
    other = _other_moment(assembly)
    if other and found.space == "plane":
        return replace(offer, why_not=f"the moment of inertia of {other} in a plane is not that of its tensor about y")
    try:
        reduced, plans = _assemble_there(assembly, start, found)
        gap = _gap(assembly, start, reduced, found)
    except AtwoodError as error:
        return replace(offer, why_not=str(error).splitlines()[0])
    except np.linalg.LinAlgError:
        return replace(offer, why_not="its accelerations there are not determined")
    if not gap < _SAME:
        return replace(offer, why_not="its start could not be carried over")
    states = {form: plan[0] for form, plan in plans.items()}
    return replace(offer, states=states, operations={form: plan[1] for form, plan in plans.items()}, assembly=reduced)


def _other_moment(assembly: Assembly) -> str:
    """Return the part whose moment of inertia in a plane is not that of its tensor; empty if there is none."""
    for path, local in assembly.mechanism.locals_.items():
        for one in local.body_inertias:
            if one.tensor is not None:
                plane, space = assembly.mechanism.values_at_start([one.moment, one.tensor[1][1]])
                if not math.isclose(plane, space, rel_tol=1e-12):
                    return path
    return ""


def _elsewhere(x: float, y: float, z: float) -> str:
    """Return why the plane with this normal is not offered, and what would make it one that is."""
    if z != 0.0:
        return "a scene in a plane lies in the plane x-z"
    angle = np.degrees(np.arctan2(x, y))  # about z, which takes the normal to y
    turned = f"turned by {angle:.4g} deg about z"
    return f"a scene in a plane lies in the plane x-z, where this one would be if it were {turned}"


def _assemble_there(
    assembly: Assembly, start: Start, found: Symmetry
) -> tuple[Assembly, dict[str, tuple[int, dict[str, int]]]]:
    """Return the scene in a plane or on a line, and of each form its states and operations."""
    flat = assembly.flat
    x, y, z = map(float, found.direction)
    there = replace(
        flat,
        space=make_space(found.space, (x, y, z)),
        start={},
        guess=_carried(assembly, start) if found.space == "line" else {},
    )
    known = assemble_flat(there, modes=assembly.modes).start_observables
    moved = _with_start(assembly, start, there, known)
    plans = {}
    for form in ("reduced", "dae"):
        made = assemble_flat(moved, form=form, level=assembly.level or "ggl", modes=assembly.modes)
        begun = find_start(made)
        span = max(flat.t_end - begun.time, 1e-3)
        program = make_problem(made, begun.time, *own_state(made, begun), begun.length, span).program
        plans[form] = program.size, program.operations
    return assemble_flat(moved, modes=assembly.modes), plans


def _with_start(assembly: Assembly, start: Start, there: FlatScene, known: Mapping[str, object]) -> FlatScene:
    """Return the scene with what its start says there: what has a meaning, and guesses for the rest."""
    kept = {path: value for path, value in assembly.flat.start.items() if _is_free(known, path)}
    guess = {path: value for path, value in assembly.flat.guess.items() if _is_free(known, path)}
    guess.update({path: value for path, value in _carried(assembly, start).items() if _is_free(known, path)})
    return replace(there, start=kept, guess={path: value for path, value in guess.items() if path not in kept})


def _is_free(known: Mapping[str, object], path: str) -> bool:
    """Return whether there is such a quantity, and it can have more than one value."""
    value = getattr(known.get(path), "value", None)
    return value is not None and not value.is_parametric


def _carried(assembly: Assembly, start: Start) -> dict[str, float]:
    """Return what is handed on: quantities that mean the same there, with their values at the start."""
    known = assembly.start_observables
    paths = [path for path in known if path.endswith(_CARRIED)]
    q, u = start.coordinates, start.speeds
    program = coordinate_program(assembly, "carried", assembly.reduced, [known[path].value for path in paths])
    values = np.asarray(assembly.kernel(program)([start.time], q, u)[0], dtype=float)
    found = {path: float(value) for path, value in zip(paths, values, strict=True) if np.isfinite(value)}
    found.update(_angles(assembly, start))
    return found


def _angles(assembly: Assembly, start: Start) -> dict[str, float]:
    """Return the angles in the plane, and their rates, of parts with a body frame, from the frame's x axis."""
    reduced, bodies, graph = assembly.reduced, assembly.mechanism.bodies, assembly.mechanism.table.graph
    placements = reduced.kinematics.placements
    found: dict[str, float] = {}
    for path, local in assembly.mechanism.locals_.items():
        for one in local.body_inertias:
            node = assembly.mechanism.graph.node_of[path, one.frame.name]
            axes = node_axes(None, placements.axes.get(bodies.body_of[node]), reduced.site.node_turns[node])
            if axes is None or bodies.body_of[node] not in reduced.kinematics.angular_velocities:
                continue
            body = bodies.body_of[node]
            spin = spin_in_world(reduced.kinematics.angular_velocities[body], placements.axes[body])
            program = coordinate_program(assembly, "angle", reduced, [graph.convert(c) for c in (*axes[0], spin.y)])
            x, _, z, rate = assembly.kernel(program)([start.time], start.coordinates, start.speeds)[0]
            found[f"{path}.angle"] = math.atan2(z, x)
            found[f"{path}.angular_speed"] = found[f"{path}.angular_velocity"] = -float(rate)  # about -y
    return found


def _gap(assembly: Assembly, start: Start, there: Assembly, found: Symmetry) -> float:
    """Return how far the starts are apart: place and turn of all nodes, and how both change, relative to the sizes."""
    begun = find_start(there)
    sets = [_nodes(one, first) for one, first in ((assembly, start), (there, begun))]
    nodes = [key for key in sets[0] if key in sets[1]]
    here, other = (np.array([known[key] for key in nodes]) for known in sets)
    gap = np.abs(np.where(np.isfinite(here) & np.isfinite(other), here - other, 0.0))
    # How far aside bodies are means nothing there.
    seen = np.eye(3)[[0, 2]] if found.space == "plane" else found.direction[None]
    gap[:, 0, : len(seen)], gap[:, 0, len(seen) :] = np.abs((here[:, 0] - other[:, 0]) @ seen.T), 0.0
    size = np.nanmax(np.abs(here), axis=(0, 2), initial=0.0)
    length = start.length
    rates = [size[1] / length, math.sqrt(size[2] / length), size[6], math.sqrt(size[7])]
    pace = max(rates) or 1.0
    sizes = np.array([length, length * pace, length * pace**2, 1.0, 1.0, 1.0, pace, pace**2])
    return float(np.max(gap / sizes[:, None], initial=0.0))


def _nodes(assembly: Assembly, start: Start) -> dict[tuple[str, str], FloatArray]:
    """Return of every connector at the start what tells how it is and moves, shape (8, 3), in world axes.

    Place, velocity and acceleration, the three axes of its frame, and angular velocity and acceleration; those of what
    is not oriented are nan.
    """
    equations, mechanism = assembly.reduced, assembly.mechanism
    kinematics, graph = equations.kinematics, assembly.mechanism.table.graph
    balance = balance_of(assembly, "reduced")
    q, u = start.coordinates, start.speeds
    sizes = motion_scales(equations, start.length)
    constraint_jacobian = scaled(balance.at(start.time, q, u).jacobian, sizes)
    kept = np.asarray(
        independent_rows(constraint_jacobian, balance.errors.of_jacobian(start.time, q, sizes)), dtype=np.intp
    )
    a, _ = balance.accelerate(start.time, q, u, kept)
    placements = kinematics.placements
    places = {node: world_position(mechanism, placements, node) for node in placements.positions}
    tables = (places, kinematics.velocities, kinematics.accelerations)
    nodes, expressions = sorted(tables[0]), []
    for node in nodes:
        body = mechanism.bodies.body_of[node]
        vectors = [mechanism.space.vector(tuple(table[node])) for table in tables]
        own = placements.axes.get(body)
        axes = node_axes(placements.angles.get(body), own, equations.site.node_turns[node])
        if axes is not None and body in kinematics.angular_velocities:
            spins = (kinematics.angular_velocities[body], kinematics.angular_accelerations[body])
            vectors += [*axes, *(spin_in_world(one, own) for one in spins)]
        else:
            vectors += [Vector(math.nan, math.nan, math.nan)] * 5
        expressions += [graph.convert(c) for vector in vectors for c in vector]
    program = state_program(assembly, "nodes", expressions)
    idle = np.zeros(len(assembly.reactions))
    values = np.asarray(assembly.kernel(program)([start.time], q, u, a, idle)[0], dtype=float).reshape(-1, 8, 3)
    place = dict(zip(nodes, values, strict=True))
    return {key: place[node] for key, node in mechanism.graph.node_of.items() if node in place}
