"""Scenes written as URDF."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ElementTree, SubElement, indent

import numpy as np

from atwood import Scene, UsageError
from atwood_library.contacts.rotational_friction import RotationalFriction
from atwood_library.contacts.translational_friction import TranslationalFriction
from atwood_library.fields.coordinate_lagrangian import CoordinateLagrangian
from atwood_library.joints.free_joint import FreeJoint
from atwood_library.joints.gear import Gear
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.planar import Planar
from atwood_library.joints.rack_and_pinion import RackAndPinion
from atwood_library.joints.slider import Slider
from atwood_library.parts.appearance import Appearance
from atwood_library.robots.graph import GEARS, Branch, Graph, Pose, constant, graph_of, pose_of

__all__ = ["write_urdf"]


def write_urdf(scene: Scene, file: str | os.PathLike[str]) -> Path:
    """Write a scene of bodies and joints as a URDF file, and return its path.

    What `read_urdf` gives is written so that it is read again with the same equations. Start values and gravity have no
    place in the format.

    Parameters
    ----------
    scene
        A scene in space: bodies, joints that make a tree from the ground or from the first body on, welds, gears,
        dry friction of joints, and appearances.
    file
        The file; it is written only when the whole scene can be.

    Raises
    ------
    UsageError
        If the scene has parts or values that the format does not know, by name, or its joints close a loop.
    """
    graph = graph_of(scene, "write_urdf")
    root = Element("robot", name=Path(file).stem)
    names = _add_links(graph, root)
    joints = {branch.joint: _add_joint(graph, root, branch, names) for branch in graph.branches}
    _add_others(graph, root, joints, names)
    return save_xml(root, Path(file))


def save_xml(root: Element, file: Path) -> Path:
    """Write an XML file, which appears only once it is complete."""
    indent(root)
    part = file.with_name(f"{file.name}.part")
    try:
        ElementTree(root).write(part, encoding="utf-8", xml_declaration=True)
        part.replace(file)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise UsageError(f"the file cannot be written ({error.strerror})", where=str(file)) from None
    return file


def written(*values: Any) -> str:
    """Return numbers as text that reads as the same numbers."""
    return " ".join(repr(float(one)) for one in values)


def angles_of(rotation: Any) -> tuple[float, float, float]:
    """Return roll, pitch and yaw about fixed x, y and z axes, rad; with the pitch at a quarter turn too."""
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    pitch = np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0]))
    sine, cosine = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(rotation[0, 2] * sine - rotation[1, 2] * cosine, rotation[1, 1] * cosine - rotation[0, 1] * sine)
    return float(roll), float(pitch), float(yaw)


def _add_origin(node: Element, pose: Pose) -> None:
    rotation, place = pose
    if np.any(place) or not np.array_equal(rotation, np.eye(3)):
        SubElement(node, "origin", xyz=written(*place), rpy=written(*angles_of(rotation)))


def _add_links(graph: Graph, root: Element) -> dict[int, str]:
    """Add a link for each body, further ones of a node fixed to its first; return the first by node."""
    names: dict[int, str] = {}
    for node, joint in [(graph.root, "base"), *((one.child, one.joint) for one in graph.branches)]:
        bodies = graph.bodies.get(node, [])
        names[node] = bodies[0] if bodies else f"{joint}_link"
        for body in bodies or [names[node]]:
            link = SubElement(root, "link", name=body)
            part: Any = graph.scene.parts.get(body)
            if part is not None and (part.total_mass() or any(map(any, part.tensor()))):
                _add_inertial(link, part)
        for body in bodies[1:]:
            fixed = SubElement(root, "joint", name=f"{body}_fixed", type="fixed")
            SubElement(fixed, "parent", link=names[node])
            SubElement(fixed, "child", link=body)
    return names


def _add_inertial(link: Element, part: Any) -> None:
    try:
        centre = part.center_of_mass()
        numbers = [float(part.total_mass()), *(float(one) for one in (centre.x, centre.y, centre.z))]
        tensor = np.array([[float(one) for one in row] for row in part.tensor()])
    except (TypeError, ValueError):
        raise UsageError("its inertia is no number, and a robot's file has only such", where=part.path) from None
    inertial = SubElement(link, "inertial")
    if any(numbers[1:]):
        SubElement(inertial, "origin", xyz=written(*numbers[1:]))
    SubElement(inertial, "mass", value=written(numbers[0]))
    entries = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    SubElement(inertial, "inertia", {f"i{'xyz'[i]}{'xyz'[k]}": written(tensor[i, k]) for i, k in entries})


def _add_joint(graph: Graph, root: Element, branch: Branch, names: dict[int, str]) -> Element:
    part: Any = graph.scene[branch.joint]
    node = SubElement(root, "joint", name=branch.joint)
    pose = branch.pose
    if isinstance(part, (Pivot, Slider, Planar)):
        check_plain(part)
        node.set("type", "prismatic" if type(part) is Slider else "planar" if type(part) is Planar else "continuous")
        axis = np.array(tuple(part.axis), dtype=float)
        SubElement(node, "axis", xyz=written(*(-axis if branch.reversed else axis)))
        if type(part) is Planar and branch.reversed:
            raise UsageError("frame b of a plate on a table is to be farther from the root", where=branch.joint)
    elif isinstance(part, FreeJoint):
        node.set("type", "floating")
    elif hasattr(part, "displacement") or hasattr(part, "motion") or hasattr(part, "rotation"):
        node.set("type", "fixed")
        turned, place = pose_of(part)
        if branch.reversed:
            turned, place = turned.T, -turned.T @ place
        pose = pose[0] @ turned, pose[0] @ place + pose[1]
    else:
        raise UsageError(f"URDF has no joint like a {type(part).__name__}", where=branch.joint)
    if type(part) in (Pivot, Slider):
        _add_limits(node, part, branch.reversed)
    SubElement(node, "parent", link=names[branch.parent])
    SubElement(node, "child", link=names[branch.child])
    _add_origin(node, pose)
    return node


def check_plain(part: Any) -> None:
    """Refuse what a joint carries and the format does not know."""
    for name in ("stiffness", "stop_stiffness", "motor", "actuator"):
        if hasattr(part, name) and constant(part, name):
            raise UsageError(f"URDF has nothing like its {name}", where=part.path, advice="Take it away first.")


def _add_limits(node: Element, part: Any, is_reversed: bool) -> None:
    lower, upper = (getattr(part, f"{one}_stop") for one in ("lower", "upper"))
    if lower is not None and upper is not None:
        ends = (-float(upper), -float(lower)) if is_reversed else (float(lower), float(upper))
        SubElement(node, "limit", lower=written(ends[0]), upper=written(ends[1]), effort="0.0", velocity="0.0")
        if type(part) is Pivot:
            node.set("type", "revolute")
    elif lower is not None or upper is not None:
        raise UsageError("URDF knows limits on both sides alone", where=part.path)
    if constant(part, "damping"):
        SubElement(node, "dynamics", damping=written(part.damping))


def _add_others(graph: Graph, root: Element, joints: dict[str, Element], names: dict[int, str]) -> None:
    """Add gears, friction, rotors and appearances; refuse what is none of these."""
    known = Appearance, RotationalFriction, TranslationalFriction, CoordinateLagrangian, *GEARS
    strangers = [name for name in graph.others if type(graph.scene[name]) not in known]
    if strangers:
        listed = ", ".join(f"{name} ({type(graph.scene[name]).__name__})" for name in strangers)
        raise UsageError(f"these parts have no counterpart in URDF: {listed}", where="write_urdf")
    links = {link.get("name"): link for link in root.iter("link")}
    for name, part in graph.of(Appearance):
        _add_visual(links[names[graph.node[f"{name}.a"]]], part)
    for name, part in graph.of(RotationalFriction, TranslationalFriction):
        joint = joints[graph.at(name, "b")]
        dynamics = joint.find("dynamics")
        dynamics = SubElement(joint, "dynamics") if dynamics is None else dynamics
        dynamics.set("friction", written(friction_of(part, "URDF")))
    for name, part in graph.of(*GEARS):
        _add_mimic(graph, joints, name, part)
    for name, part in graph.of(CoordinateLagrangian):
        _add_rotor(graph, root, name, part)


def friction_of(part: Any, language: str) -> float:
    """Return the size of dry friction about a joint, or refuse what is more than a size."""
    size = float(part.sliding(1.0))
    if part.against != "ground" or size != float(part.sliding(2.0)) or part.peak != 1.0 or part.viscous:
        raise UsageError(f"{language} knows friction of one size alone, about the joint", where=part.path)
    return size


def gear_of(graph: Graph, name: str, part: Any) -> tuple[str, str, float, float]:
    """Return which joint follows which, with ratio and offset."""
    is_rack = type(part) is RackAndPinion
    follower, master = ("rack", "pinion") if is_rack else ("a", "b")
    if type(part) is Gear and part.support != "ground":
        raise UsageError("robots' files have no gear with a housing", where=name)
    ratio = float(part.radius if is_rack else part.ratio)
    return graph.at(name, follower), graph.at(name, master), ratio, float(part.offset)


def _add_mimic(graph: Graph, joints: dict[str, Element], name: str, part: Any) -> None:
    follows, followed, ratio, offset = gear_of(graph, name, part)
    if joints[follows].find("mimic") is not None:  # the other way round
        follows, followed, ratio, offset = followed, follows, 1.0 / ratio, -offset / ratio
    if joints[follows].find("mimic") is not None:
        raise UsageError("a joint of URDF follows one other", where=name)
    given = {"joint": followed, "multiplier": written(ratio), "offset": written(offset)}
    SubElement(joints[follows], "mimic", given)


def armature_of(graph: Graph, name: str, part: Any) -> tuple[str, float]:
    """Return the joint with whose coordinate a rotor turns, and its inertia."""
    inertia = 2.0 * _kinetic(part, 1.0)
    if part.shafts + part.slides != 1 or abs(_kinetic(part, 3.0) - 4.5 * inertia) > 1e-12 * inertia or inertia <= 0.0:
        raise UsageError("robots' files know the inertia of a rotor alone, J rate^2/2", where=name)
    return graph.at(name, "shaft[0]" if part.shafts else "slide[0]"), inertia


def _add_rotor(graph: Graph, root: Element, name: str, part: Any) -> None:
    joint, inertia = armature_of(graph, name, part)
    transmission = SubElement(root, "transmission", name=name)
    SubElement(transmission, "joint", name=joint)
    actuator = SubElement(transmission, "actuator", name=name)
    SubElement(actuator, "mechanicalReduction").text = "1.0"
    SubElement(actuator, "rotorInertia").text = written(inertia)


def _kinetic(part: Any, rate: float) -> float:
    """Return the energy of a rotor at a rate."""
    values = [0.0] * 13
    values[3 if part.shafts else 9] = rate
    return float(part.function(*values))


def _add_visual(link: Element, part: Any) -> None:
    x, y, z = (float(one) for one in part.sizes)
    if part.shape == "ellipsoid" and not x == y == z:
        warnings.warn(f"{part.path}: URDF has no ellipsoid, and it is left out", stacklevel=4)
        return
    visual = SubElement(link, "visual")
    _add_origin(visual, pose_of(part))
    geometry = SubElement(visual, "geometry")
    if part.shape == "box":
        SubElement(geometry, "box", size=written(x, y, z))
    elif part.shape == "mesh":
        SubElement(geometry, "mesh", filename=part.file, scale=written(x, y, z))
    elif part.shape == "ellipsoid":
        SubElement(geometry, "sphere", radius=written(0.5 * x))
    else:
        long = z - x if part.shape == "capsule" else z
        SubElement(geometry, part.shape, radius=written(0.5 * x), length=written(long))
