"""Scenes written as MJCF."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from atwood import Scene, UsageError
from atwood_library.blocks.gain import Gain
from atwood_library.contacts.rotational_friction import RotationalFriction
from atwood_library.contacts.translational_friction import TranslationalFriction
from atwood_library.fields.coordinate_lagrangian import CoordinateLagrangian
from atwood_library.joints.free_joint import FreeJoint
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.slider import Slider
from atwood_library.joints.spherical import Spherical
from atwood_library.parts.appearance import Appearance
from atwood_library.robots.graph import GEARS, IDENTITY, Branch, Graph, Pose, constant, graph_of, inverse, pose_of
from atwood_library.robots.urdf_written import armature_of, friction_of, gear_of, save_xml, written

__all__ = ["write_mjcf"]


def write_mjcf(scene: Scene, file: str | os.PathLike[str]) -> Path:
    """Write a scene of bodies and joints as an MJCF file, and return its path.

    What `read_mjcf` gives is written so that it is read again with the same equations; joints without a body between
    them are of one body. Meshes are left out, and so are start values but those of free joints. MuJoCo itself refuses
    bodies that move and have no mass.

    Parameters
    ----------
    scene
        A scene in space: bodies, hinges, guides, balls and free joints that make a tree from the ground on, welds,
        gears, dry friction of joints, armatures, gains as motors, and appearances.
    file
        The file; it is written only when the whole scene can be.

    Raises
    ------
    UsageError
        If the scene has parts or values that the format does not know, by name, or its joints close a loop.
    """
    graph = graph_of(scene, "write_mjcf")
    root = Element("mujoco", model=Path(file).stem)
    SubElement(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    gravity = scene.gravity_direction
    SubElement(root, "option", gravity=written(*(float(scene.gravity) * one for one in tuple(gravity))))
    world = SubElement(root, "worldbody")
    joints = _add_bodies(graph, world)
    _add_others(graph, root, joints)
    return save_xml(root, Path(file))


def quaternion_of(rotation: Any) -> tuple[float, float, float, float]:
    """Return the unit quaternion w, x, y, z of a rotation, from its largest component on."""
    r = np.asarray(rotation, dtype=float)
    squares = 1.0 + np.array([np.trace(r), *(2.0 * r[i, i] - np.trace(r) for i in range(3))])
    products = np.array(
        [
            (squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]),
            (r[2, 1] - r[1, 2], squares[1], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]),
            (r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], squares[2], r[1, 2] + r[2, 1]),
            (r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[3]),
        ]
    )
    row = products[int(np.argmax(squares))]
    w, x, y, z = row / np.linalg.norm(row)
    return float(w), float(x), float(y), float(z)


def _placed(node: Element, pose: Pose) -> None:
    if np.any(pose[1]):
        node.set("pos", written(*pose[1]))
    if not np.array_equal(pose[0], np.eye(3)):
        node.set("quat", written(*quaternion_of(pose[0])))


def _after(pose: Pose, other: Pose) -> Pose:
    return pose[0] @ other[0], pose[0] @ other[1] + pose[1]


def _add_bodies(graph: Graph, world: Element) -> dict[str, Element]:
    """Add the bodies from the root on; return the elements of the joints by name."""
    joints: dict[str, Element] = {}
    below: dict[int, list[Branch]] = {}
    for branch in graph.branches:
        below.setdefault(branch.parent, []).append(branch)
    connected = list(graph.node.values())
    root = _add_node(graph, world, graph.root, IDENTITY, "base")
    if graph.grounded is None:
        SubElement(root, "freejoint", name=f"{graph.bodies[graph.root][0]}_free")
    stack = [(graph.root, root)]
    while stack:
        node, element = stack.pop()
        for branch in below.get(node, ()):
            chain = [branch]
            while (end := chain[-1].child) not in graph.bodies and connected.count(end) == 2 and end in below:
                chain += below[end]
            body = _add_chain(graph, element, chain, joints)
            stack.append((chain[-1].child, body))
    return joints


def _add_node(graph: Graph, parent: Element, node: int, pose: Pose, joint: str) -> Element:
    """Add the bodies of a node: the first, and in it the others."""
    bodies = graph.bodies.get(node, [])
    if node == graph.root and graph.grounded is not None:
        first, rest = parent, bodies
    else:
        first, rest = SubElement(parent, "body", name=bodies[0] if bodies else f"{joint}_body"), bodies[1:]
        _placed(first, pose)
        if bodies:
            _add_inertial(first, graph.scene[bodies[0]])
    for name in rest:
        _add_inertial(SubElement(first, "body", name=name), graph.scene[name])
    for name, part in graph.of(Appearance):
        if graph.node[f"{name}.a"] == node:
            _add_geom(first, name, part)
    return first


def _add_inertial(body: Element, part: Any) -> None:
    try:
        mass, centre = float(part.total_mass()), part.center_of_mass()
        place = [float(one) for one in (centre.x, centre.y, centre.z)]
        j = [[float(one) for one in row] for row in part.tensor()]
    except (TypeError, ValueError):
        raise UsageError("its inertia is no number, and a robot's file has only such", where=part.path) from None
    if mass or any(map(any, j)):
        full = written(j[0][0], j[1][1], j[2][2], j[0][1], j[0][2], j[1][2])
        SubElement(body, "inertial", pos=written(*place), mass=written(mass), fullinertia=full)


def _add_geom(body: Element, name: str, part: Any) -> None:
    x, y, z = (0.5 * float(one) for one in part.sizes)
    if part.shape == "mesh":
        return
    sizes = {"capsule": (x, max(z - x, 0.0)), "cylinder": (x, z)}.get(part.shape, (x, y, z))
    geom = SubElement(body, "geom", name=name, type=part.shape, size=written(*sizes), contype="0", conaffinity="0")
    _placed(geom, pose_of(part))


def _add_chain(graph: Graph, parent: Element, chain: list[Branch], joints: dict[str, Element]) -> Element:
    """Add a body that follows joints one after another, each where it is while all of them are at zero."""
    pose, moving = IDENTITY, list[tuple[Branch, Pose]]()
    for branch in chain:
        pose = _after(pose, branch.pose)
        part: Any = graph.scene[branch.joint]
        if isinstance(part, (Pivot, Slider, Spherical, FreeJoint)):
            moving.append((branch, pose))
            if type(part) is FreeJoint:
                pose = np.eye(3), np.array([_begin(graph.scene, f"{branch.joint}.{letter}") for letter in "xyz"])
        elif hasattr(part, "displacement") or hasattr(part, "motion") or hasattr(part, "rotation"):
            held = pose_of(part)
            pose = _after(pose, inverse(held) if branch.reversed else held)
        else:
            raise UsageError(f"MJCF has no joint like a {type(part).__name__}", where=branch.joint)
    body = _add_node(graph, parent, chain[-1].child, pose, chain[0].joint)
    for branch, place in moving:
        here = _after(inverse(pose), place)
        joints[branch.joint] = _add_joint(graph, body, branch, here, len(moving) == 1)
    return body


def _begin(scene: Scene, path: str) -> float:
    """Return where a coordinate starts, as far as a plain number says it."""
    value = scene.start.get(path, scene.guess.get(path, 0.0))
    return float(value) if isinstance(value, (int, float)) else 0.0


def _add_joint(graph: Graph, body: Element, branch: Branch, place: Pose, alone: bool) -> Element:
    part: Any = graph.scene[branch.joint]
    kinds: dict[type[Any], str] = {Pivot: "hinge", Slider: "slide", Spherical: "ball", FreeJoint: "free"}
    joint = SubElement(body, "joint", name=branch.joint, type=kinds[type(part)])
    if type(part) is FreeJoint:
        if not alone or branch.parent != graph.root or graph.grounded is None or branch.reversed:
            raise UsageError("MJCF has free joints between the world and a body alone", where=branch.joint)
        return joint
    if np.any(place[1]):
        joint.set("pos", written(*place[1]))
    if type(part) is Spherical:
        carried = ["stiffness", "stop_stiffness", "motor_x", "motor_y", "motor_z"]
    else:
        axis = place[0] @ np.array(tuple(part.axis), dtype=float)
        joint.set("axis", written(*(-axis if branch.reversed else axis)))
        carried = ["stop_stiffness"]
        _add_loads(joint, part, -1.0 if branch.reversed else 1.0)
    for name in carried:
        if constant(part, name):
            raise UsageError(f"MJCF has nothing like its {name}", where=part.path, advice="Take it away first.")
    if constant(part, "damping"):
        joint.set("damping", written(part.damping))
    return joint


def _add_loads(joint: Element, part: Any, sign: float) -> None:
    """Add the spring and the stops of a joint."""
    if constant(part, "stiffness"):
        natural = part.natural_angle if type(part) is Pivot else part.natural_length
        joint.set("stiffness", written(part.stiffness))
        joint.set("springref", written(sign * float(natural)))
    stops = [sign * float(one) for one in (part.lower_stop, part.upper_stop) if one is not None]
    if len(stops) == 1:
        raise UsageError("MJCF knows a range on both sides alone", where=part.path)
    if stops:
        joint.set("range", written(*sorted(stops)))


def _add_others(graph: Graph, root: Element, joints: dict[str, Element]) -> None:
    """Add friction, armature, gears and motors; refuse what is none of these."""
    known = Appearance, RotationalFriction, TranslationalFriction, CoordinateLagrangian, Gain, *GEARS
    strangers = [name for name in graph.others if type(graph.scene[name]) not in known]
    if strangers:
        listed = ", ".join(f"{name} ({type(graph.scene[name]).__name__})" for name in strangers)
        raise UsageError(f"these parts have no counterpart in MJCF: {listed}", where="write_mjcf")
    for name, part in graph.of(RotationalFriction, TranslationalFriction):
        joints[graph.at(name, "b")].set("frictionloss", written(friction_of(part, "MJCF")))
    for name, part in graph.of(CoordinateLagrangian):
        joint, inertia = armature_of(graph, name, part)
        joints[joint].set("armature", written(inertia))
    gears = [(name, gear_of(graph, name, part)) for name, part in graph.of(*GEARS)]
    if gears:
        equality = SubElement(root, "equality")
        for name, (follows, followed, ratio, offset) in gears:
            law = written(offset, ratio, 0.0, 0.0, 0.0)
            SubElement(equality, "joint", name=name, joint1=follows, joint2=followed, polycoef=law)
    motors = dict(graph.of(Gain))
    if motors:
        actuator = SubElement(root, "actuator")
        for name, part in motors.items():
            driven = [b if a.startswith(f"{name}.") else a for a, b in graph.scene.connected if f"{name}.y" in (a, b)]
            joint, _, entry = driven[0].rpartition(".") if len(driven) == 1 else ("", "", "")
            if joint not in joints or entry not in ("motor", "actuator") or part.offset:
                raise UsageError("only a gain from a control to one joint is a motor", where=name)
            SubElement(actuator, "motor", name=name, joint=joint, gear=written(part.gain))
