"""What there is to draw of a scene in space, found from laws and not from names."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import depends_on, is_zero
from atwood.forms.quantities import state_program
from atwood.late import replace
from atwood.mechanics.kinematics.mechanism import Mechanism, world_position
from atwood.mechanics.kinematics.orientation import body_offsets
from atwood.model.declare.contributions import BodyInertia
from atwood.model.local.parts import LocalPart
from atwood.plotting.scene3d.joint_reading import read_joint, seen_from
from atwood.plotting.scene3d.reading import Joining, Lump, Pose, Reading, Tie, TieKind
from atwood.plotting.shapes.curves import holds_distance, numbers
from atwood.plotting.shapes.outlines import outline_of
from atwood.result.result import Result

__all__ = ["read_scene"]


def read_scene(result: Result) -> Reading:
    """Return what there is to draw of a scene in space.

    Parameters
    ----------
    result
        The run.
    """
    mechanism = result.assembly.mechanism
    offsets, turns = _layouts(mechanism)
    poses = _poses(result)
    bare = Reading(result.time, mechanism.bodies.body_of, offsets, turns, poses, _steps(mechanism))
    joinings: list[Joining] = []
    lumps: list[Lump] = []
    ties: list[Tie] = []
    grounds: list[int] = []
    for path, local in mechanism.locals_.items():
        nodes = {name: mechanism.graph.node_of[path, name] for name in local.connectors}
        joinings += [one for joint in local.joints for one in read_joint(bare, mechanism, path, joint, nodes)]
        lumps += _lumps(bare, mechanism, path, local, nodes)
        followed = _followed(bare, path, local, nodes)
        joinings += followed
        ties += [] if followed or _is_unseen(local) else _ties(path, local, nodes)
        options = [joint.law.options for joint in local.joints]
        if any(one.rigid and one.a == "world" for one in options):
            grounds += nodes.values()
    return replace(
        bare,
        joinings=tuple(joinings),
        lumps=tuple(lumps),
        ties=tuple(ties),
        grounds=tuple(dict.fromkeys(grounds)),
        is_heavy=not is_zero(mechanism.gravity.z),
    )


def _is_unseen(local: LocalPart) -> bool:
    outline = outline_of(local)
    return outline is not None and outline.kind == "nothing"


def _followed(reading: Reading, path: str, local: LocalPart, nodes: Mapping[str, int]) -> list[Joining]:
    """Return, as a curve, the way of a connector as seen from the first one, where the part's outline is that."""
    outline = outline_of(local)
    if outline is None or outline.kind != "path":
        return []
    first, other = next(iter(nodes.values())), nodes[outline.frame]
    return [Joining(path, "curve", (first, other), curve=seen_from(reading, first, other))]


def _layouts(mechanism: Mechanism) -> tuple[dict[int, FloatArray], dict[int, FloatArray]]:
    """Return place and axes of each node in its body, as numbers."""
    offsets: dict[int, FloatArray] = {}
    turns: dict[int, FloatArray] = {}
    for body in mechanism.bodies.bodies:
        places, axes = body_offsets(body, mechanism.space)
        for node, place in places.items():
            turn = axes[node]
            assert isinstance(turn, tuple)
            offsets[node] = numbers(mechanism, tuple(place))
            turns[node] = np.column_stack([numbers(mechanism, tuple(axis)) for axis in turn])
    return offsets, turns


def _steps(mechanism: Mechanism) -> tuple[tuple[int, int], ...]:
    steps = [step for body in mechanism.bodies.bodies for step in body.steps]
    return tuple((one.parent, one.child) for one in steps if one.joint.local.law.options.a != "world")


def _poses(result: Result) -> dict[int, Pose]:
    """Return where every body is at the output times; what has no orientation is drawn unturned."""
    pieces: list[dict[int, FloatArray]] = []
    for segment in result.run.segments:
        assembly, mechanism = segment.assembly, segment.assembly.mechanism
        placements, graph = assembly.own_equations.kinematics.placements, mechanism.table.graph
        expressions = []
        for body in mechanism.bodies.bodies:
            expressions += [graph.convert(c) for c in world_position(mechanism, placements, body.root)]
            axes = placements.axes.get(body.index)
            unturned = [graph.constant(float(i == j)) for i in range(3) for j in range(3)]
            expressions += unturned if axes is None else [graph.convert(c) for axis in axes for c in axis]
        program = state_program(assembly, "poses", expressions)
        idle = (np.zeros_like(segment.speeds), np.zeros((len(assembly.reactions), len(segment.time))))
        kernel = assembly.kernel(program, vectorized=True)
        values = np.asarray(kernel(segment.time[None, :], segment.coordinates, segment.speeds, *idle)[0])
        shown = values[:, segment.shown].reshape(len(mechanism.bodies.bodies), 12, -1)
        pieces.append({body.index: shown[i] for i, body in enumerate(mechanism.bodies.bodies)})
    poses = {}
    for index in pieces[0]:
        whole = np.concatenate([piece[index] for piece in pieces], axis=1).T
        # Row by row an axis each; as columns they turn what is in the body into the world.
        poses[index] = Pose(whole[:, :3].copy(), whole[:, 3:].reshape(-1, 3, 3).transpose(0, 2, 1).copy())
    return poses


def _lumps(reading: Reading, mechanism: Mechanism, path: str, local: LocalPart, nodes: Mapping[str, int]) -> list[Lump]:
    found, outline = [], outline_of(local)
    if outline is not None and outline.kind in ("path", "nothing"):
        return []
    for one in local.point_inertias:
        if len(one.points) == 1:
            node = nodes[one.points[0].name]
            (mass,) = numbers(mechanism, [one.masses[0][0]])
            found.append(_lump(reading, path, node, float(mass), np.zeros(3), np.zeros((3, 3))))
    for body in local.body_inertias:
        center = numbers(mechanism, tuple(body.center_of_mass))
        (mass,) = numbers(mechanism, [body.mass])
        lump = _lump(reading, path, nodes[body.frame.name], float(mass), center, _tensor(mechanism, body))
        found.append(replace(lump, outline=outline, origin=reading.offsets[lump.node]))
    if outline is not None and not local.body_inertias:
        lump = _lump(reading, path, nodes[outline.frame or next(iter(nodes))], 0.0, np.zeros(3), np.zeros((3, 3)))
        found.append(replace(lump, outline=outline, origin=reading.offsets[lump.node]))
    return [one for one in found if one.mass > 0.0 or one.outline is not None]


def _tensor(mechanism: Mechanism, body: BodyInertia) -> FloatArray:
    if body.tensor is None:
        return np.zeros((3, 3))
    return numbers(mechanism, [entry for row in body.tensor for entry in row]).reshape(3, 3)


def _lump(reading: Reading, path: str, node: int, mass: float, center: FloatArray, tensor: FloatArray) -> Lump:
    turn = reading.turns[node]
    place = reading.offsets[node] + turn @ center
    return Lump(path, reading.body_of[node], node, mass, place, turn, turn @ tensor @ turn.T)


def _ties(path: str, local: LocalPart, nodes: Mapping[str, int]) -> list[Tie]:
    """Return what a part that only pulls or pushes between its nodes looks like."""
    ends = tuple(dict.fromkeys(nodes.values()))
    if local.joints or len(ends) < 2:
        return []
    if any(holds_distance(local, one.value) for one in local.constraints):
        return [Tie(path, "rope" if local.part.component.modes else "rod", ends)]
    kinds: list[TieKind] = []
    symbols = [symbol for one in local.connectors.values() for symbol in one.position]
    if any(depends_on(one, symbols) for one in local.potentials):
        kinds.append("spring")
    if any(depends_on(one, symbols) for one in local.dissipations):
        kinds.append("damper")
    return [Tie(path, kind, ends) for kind in kinds]
