"""MJCF, the format of MuJoCo, read as a scene: bodies are rigid bodies and joints are joints, by their names."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from atwood import Component, Frame, Scene, UnsupportedError, UsageError
from atwood.solids import MassProperties, combine
from atwood_library.blocks.gain import Gain
from atwood_library.joints.free_joint import FreeJoint
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.slider import Slider
from atwood_library.joints.spherical import Spherical
from atwood_library.joints.weld import Weld
from atwood_library.parts.appearance import Appearance
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody
from atwood_library.robots.building import Building, add_armature, add_friction, add_gear, choice, existing_file
from atwood_library.robots.graph import IDENTITY, Pose
from atwood_library.robots.inertias import checked_inertia
from atwood_library.robots.mjcf_elements import Elements, ends_of, geom_solid, read_elements, rotation_matrix, sizes_of
from atwood_library.robots.xml import XMLElement, name_of, number, numbers

__all__ = ["read_mjcf"]

_SILENT = ("light", "camera", "site", "plugin", "body", "joint", "freejoint", "geom", "inertial", "frame")
_SECTIONS = ("compiler", "option", "size", "visual", "statistic", "default", "asset", "worldbody", "custom", "keyframe")
_OPTIONS = ("density", "viscosity", "wind", "magnetic")


@dataclass
class _Reading:
    """What is known while a model is read.

    Attributes
    ----------
    poses
        Where bodies are in the world while all joints are at their references.
    left
        What has no counterpart.
    """

    building: Building
    elements: Elements
    inertias: str
    stops: float | None
    friction: bool
    meshes: dict[str, tuple[str, Any]] = field(default_factory=dict)
    bodies: dict[str, RigidBody] = field(default_factory=dict)
    poses: dict[str, Pose] = field(default_factory=dict)
    joints: dict[str, Component] = field(default_factory=dict)
    left: dict[str, None] = field(default_factory=dict)
    total_mass: float = 0.0


def read_mjcf(
    file: str | os.PathLike[str],
    *,
    inertias: str = "refuse",
    stops: float | None = None,
    friction: bool = True,
    strict: bool = False,
) -> Scene:
    """Return the scene of an MJCF file, MuJoCo's format.

    A body is a `RigidBody` and a joint a `Pivot`, a `Slider`, a `Spherical` or a `FreeJoint` under its name, with
    springs and dampers; the coordinate of a joint is zero at its reference. Armature is ``<joint>_armature``, friction
    loss ``<joint>_friction``. A motor is a `Gain` under its name, whose input `u` is its control. Equalities of the
    kinds ``connect``, ``weld`` and ``joint`` are rigid. Contact, tendons, sensors and other actuators have no
    counterpart; what of these a file has is said in a warning.

    Parameters
    ----------
    file
        The file; what it includes is beside it.
    inertias, stops, friction
        See `read_urdf`.
    strict
        Whether a file with something that has no counterpart is refused.

    Raises
    ------
    UsageError
        If the file is no MJCF, with file and line.
    UnsupportedError
        If it has something without which its bodies are others, or, if `strict`, anything without a counterpart.
    ParameterError
        If no body can have an inertia.
    """
    choice(inertias, ("refuse", "nearest"), "inertias", "read_mjcf")
    path = existing_file(file, "read_mjcf")
    reading = _Reading(Building(path), read_elements(path), inertias, stops, friction)
    _read_options(reading)
    _read_meshes(reading, path)
    ground = reading.building.add("ground", Ground())
    _read_bodies(reading, ground.frame)
    _read_equalities(reading, ground.frame)
    _read_motors(reading)
    if reading.left:
        listed = "; ".join(reading.left)
        if strict:
            raise UnsupportedError(f"it has what has no counterpart: {listed}", where=str(path))
        warnings.warn(f"{path}: left out, for there is no counterpart: {listed}", stacklevel=2)
    return reading.building.scene


def _read_options(reading: _Reading) -> None:
    scene, gravity = reading.building.scene, np.array([0.0, 0.0, -9.81])
    for node in reading.elements.root.findall("option"):
        gravity = np.array(numbers(node, "gravity", 3, gravity))
        for name in _OPTIONS:
            if any(numbers(node, name, None, ())):
                reading.left[f"option {name}"] = None
        if any(flag.get("gravity") == "disable" for flag in node.findall("flag")):
            gravity = np.zeros(3)
    size = float(np.linalg.norm(gravity))
    scene.gravity = size
    if size:
        scene.gravity_direction = tuple(gravity / size)
    for name in ("inertiagrouprange", "balanceinertia", "boundmass", "boundinertia", "fusestatic"):
        if reading.elements.compiler.get(name, "false") not in ("false", "0"):
            reading.left[f"compiler {name}"] = None
    for section in reading.elements.root:
        if section.tag not in _SECTIONS and section.tag not in ("actuator", "equality") and len(section):
            kinds = dict.fromkeys(f"{section.tag} {one.tag}" for one in section)
            reading.left.update(dict.fromkeys(kinds))


def _read_meshes(reading: _Reading, path: Path) -> None:
    compiler = reading.elements.compiler
    folder = path.parent / compiler.get("meshdir", compiler.get("assetdir", ""))
    for node in reading.elements.sections("asset"):
        if node.tag == "mesh":
            full = reading.elements.full(node)
            name = full.get("name") or Path(full.get("file")).stem
            scale = np.array(numbers(full, "scale", 3, (1.0, 1.0, 1.0)))
            reading.meshes[name] = str(folder / full.get("file")), scale
            if "refpos" in full.attrib or "refquat" in full.attrib or not full.get("file"):
                raise UnsupportedError("a mesh with a reference pose, or without a file, is not read", where=full.place)
        elif node.tag not in ("texture", "material", "hfield"):
            reading.left[f"asset {node.tag}"] = None


# -- bodies ------------------------------------------------------------------------------------------------------------


def _read_bodies(reading: _Reading, ground: Frame) -> None:
    """Add the bodies from the world on; frames between them only place what they hold."""
    sections = reading.elements.sections("worldbody")
    world = XMLElement("body", {"name": "world"}, reading.elements.root.place, inner=sections)
    stack: list[tuple[XMLElement, Frame, Pose, Pose, str]] = [(world, ground, IDENTITY, IDENTITY, "main")]
    solids: dict[str, MassProperties] = {}
    while stack:
        node, carrier, inner, outer, near = stack.pop()
        near = node.get("childclass") or near
        for one in node:
            if one.tag not in ("body", "frame"):
                if one.tag not in _SILENT:
                    raise UnsupportedError(f"<{one.tag}> is not read, and bodies come from it", where=one.place)
                continue
            place = rotation_matrix(reading.elements, one), np.array(numbers(one, "pos", 3, (0.0, 0.0, 0.0)))
            local = inner[0] @ place[0], inner[0] @ place[1] + inner[1]
            if one.tag == "frame":
                if any(held.tag not in ("body", "frame", "light", "camera", "site") for held in one):
                    raise UnsupportedError("only bodies are read in a <frame>", where=one.place)
                stack.append((one, carrier, local, outer, near))
                continue
            name = one.get("name") or f"body{len(reading.bodies) + 1}"
            if name in reading.bodies:
                raise UsageError(f"there are two bodies {name!r}", where=one.place)
            body = _read_body(reading, name, one, carrier, local, one.get("childclass") or near, solids)
            reading.poses[name] = outer[0] @ local[0], outer[0] @ local[1] + outer[1]
            stack.append((one, body.frame, IDENTITY, reading.poses[name], near))
    wanted, found = number(_compiler(reading), "settotalmass", 0.0), sum(one.mass for one in solids.values())
    scale = wanted / found if wanted > 0.0 and found else 1.0
    for name, solid in solids.items():
        made = RigidBody.of(MassProperties(scale * solid.mass, solid.centre, scale * solid.inertia))
        for parameter in ("mass", "center", "moments", "products"):
            setattr(reading.bodies[name], parameter, getattr(made, parameter))


def _compiler(reading: _Reading) -> XMLElement:
    return XMLElement("compiler", reading.elements.compiler, reading.elements.root.place)


def _read_body(
    reading: _Reading,
    name: str,
    node: XMLElement,
    carrier: Frame,
    local: Pose,
    near: str,
    solids: dict[str, MassProperties],
) -> RigidBody:
    """Add a body with its joints, which follow each other, each about its anchor."""
    building = reading.building
    body = reading.bodies[name] = building.add(name, RigidBody(mass=0.0))
    joints = [reading.elements.full(one, near) for one in node.findall("joint")]
    joints += [XMLElement(one.tag, {**one.attrib, "type": "free"}, one.place) for one in node.findall("freejoint")]
    if node.get("mocap") == "true":
        reading.left[f"mocap of body {name}, which stays"] = None
    shift = np.zeros(3)
    pose = local
    for count, joint in enumerate(joints, 1):
        label = joint.get("name") or (f"{name}_joint" if len(joints) == 1 else f"{name}_joint_{count}")
        if label in reading.joints:
            raise UsageError(f"there are two joints {label!r}", where=joint.place)
        anchor = np.zeros(3) if joint.get("type") == "free" else np.array(numbers(joint, "pos", 3, (0.0, 0.0, 0.0)))
        part = reading.joints[label] = building.add(label, _read_joint(reading, label, joint))
        pose = (pose[0], pose[1] + pose[0] @ anchor) if count == 1 else (np.eye(3), anchor - shift)
        if joint.get("type") != "free":
            carrier = _placed(building, f"{label}_origin", carrier, pose)
        else:
            if len(joints) > 1:
                raise UsageError(f"body {name!r} has a free joint and others", where=joint.place)
            starts = zip("xyz", map(float, local[1]), strict=True)
            building.scene.guess.update({f"{part.path}.{letter}": value for letter, value in starts})
        building.scene.connect(carrier, part.a)
        carrier, shift, pose = part.b, anchor, (np.eye(3), -anchor)
        if isinstance(part, (Pivot, Slider)):
            _add_loads(reading, label, joint, part)
    building.scene.connect(_placed(building, f"{name}_origin", carrier, pose), body.frame)
    solids[name] = _body_solid(reading, name, node, near)
    _add_appearances(reading, name, node, body, near)
    return body


def _placed(building: Building, name: str, carrier: Frame, pose: Pose) -> Frame:
    """Return a frame that is placed on another one."""
    turned, place = pose
    if np.array_equal(turned, np.eye(3)) and not np.any(place):
        return carrier
    weld = building.add(name, Weld(**_weld_values(turned, place)))
    building.scene.connect(carrier, weld.a)
    return weld.b


def _weld_values(turned: Any, place: Any) -> dict[str, Any]:
    values: dict[str, Any] = {"displacement": tuple(map(float, place))}
    if not np.array_equal(turned, np.eye(3)):
        x, y = (tuple(map(float, turned[:, column])) for column in (0, 1))
        values.update(turned_by="two axes", x_axis=x, y_axis=y)
    return values


def _body_solid(reading: _Reading, name: str, node: XMLElement, near: str) -> MassProperties:
    """Return the mass properties of a body: what it says, or those of its geoms."""
    inertial, mode = node.findall("inertial"), reading.elements.compiler.get("inertiafromgeom", "auto")
    if inertial and mode != "true":
        one = inertial[0]
        place = np.array(numbers(one, "pos", 3))
        if "fullinertia" in one.attrib:
            xx, yy, zz, xy, xz, yz = numbers(one, "fullinertia", 6)
            tensor = np.array([(xx, xy, xz), (xy, yy, yz), (xz, yz, zz)])
        else:
            turned = rotation_matrix(reading.elements, one)
            tensor = turned @ np.diag(numbers(one, "diaginertia", 3)) @ turned.T
        where = f"{one.place}: body {name!r}"
        return checked_inertia(number(one, "mass"), place, tensor, reading.inertias, where)
    geoms = [reading.elements.full(one, near) for one in node.findall("geom")] if mode != "false" else []
    for geom in geoms:
        if geom.get("shellinertia") == "true":
            raise UnsupportedError("the inertia of a shell is not read", where=geom.place)
    solids = [geom_solid(reading.elements, geom, reading.meshes) for geom in geoms]
    found = [solid for solid in solids if solid is not None]
    return combine(*found) if found else MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))


def _add_appearances(reading: _Reading, name: str, node: XMLElement, body: RigidBody, near: str) -> None:
    """Add what the geoms of a body look like."""
    for count, one in enumerate(node.findall("geom"), 1):
        geom = reading.elements.full(one, near)
        (turned, place), half = ends_of(reading.elements, geom)
        kind, sizes = sizes_of(geom, half)
        if kind == "mesh":
            file, scale = reading.meshes[geom.get("mesh")]
            given: dict[str, Any] = {"shape": "mesh", "file": file, "sizes": tuple(map(float, scale))}
        elif kind in ("sphere", "ellipsoid", "box"):
            a, b, c = (2.0 * size for size in (sizes * 3)[:3])
            given = {"shape": "box" if kind == "box" else "ellipsoid", "sizes": (a, b, c)}
        elif kind in ("capsule", "cylinder"):
            wide = 2.0 * sizes[0]
            given = {"shape": kind, "sizes": (wide, wide, 2.0 * sizes[1] + (wide if kind == "capsule" else 0.0))}
        else:
            continue
        if number(geom, "contype", 1.0) or number(geom, "conaffinity", 1.0):
            reading.left["contact of geoms"] = None
        label = geom.get("name") or f"{name}_geom_{count}"
        seen = reading.building.add(label, Appearance(**given, **_weld_values(turned, place)))
        reading.building.scene.connect(body.frame, seen.a)


# -- joints ------------------------------------------------------------------------------------------------------------


def _read_joint(reading: _Reading, label: str, joint: XMLElement) -> Any:
    """Return the part of a joint, with spring, damper and stops."""
    kind = joint.get("type", "hinge")
    if kind in ("free", "ball"):
        for name in ("stiffness", "armature", "frictionloss", *(("damping",) if kind == "free" else ())):
            if number(joint, name, 0.0):
                reading.left[f"{name} of {kind} joint {label}"] = None
        return FreeJoint() if kind == "free" else Spherical(damping=number(joint, "damping", 0.0))
    if kind not in ("hinge", "slide"):
        raise UsageError(f"joint {label!r} has the type {kind!r}, and no free, ball, hinge, slide", where=joint.place)
    if all(numbers(joint, "springdamper", 2, (0.0, 0.0))):
        reading.left["joint springdamper"] = None
    axis = numbers(joint, "axis", 3, (0.0, 0.0, 1.0))
    if not any(axis):
        raise UsageError(f"the axis of joint {label!r} is zero", where=joint.place)
    hinge = kind == "hinge"

    def coordinate(name: str) -> float:
        return reading.elements.angle(joint, name, 0.0) if hinge else number(joint, name, 0.0)

    values: dict[str, float] = {name: number(joint, name, 0.0) for name in ("stiffness", "damping")}
    reference = coordinate("ref")
    if values["stiffness"]:
        values["natural_angle" if hinge else "natural_length"] = coordinate("springref") - reference
    limited = joint.get("limited", "auto")
    if reading.stops is not None and "range" in joint.attrib and limited != "false":
        ends = numbers(joint, "range", 2)
        radian = not hinge or reading.elements.compiler.get("angle") == "radian"
        lower, upper = (one if radian else float(np.radians(one)) for one in ends)
        values.update(lower_stop=lower - reference, upper_stop=upper - reference, stop_restitution=reading.stops)
    return Pivot(axis=axis, **values) if hinge else Slider(axis=axis, **values)


def _add_loads(reading: _Reading, label: str, joint: XMLElement, part: Pivot | Slider) -> None:
    if armature := number(joint, "armature", 0.0):
        add_armature(reading.building, label, part, armature)
    if (loss := number(joint, "frictionloss", 0.0)) and reading.friction:
        add_friction(reading.building, label, part, loss)


# -- equalities and motors ---------------------------------------------------------------------------------------------


def _read_equalities(reading: _Reading, ground: Frame) -> None:
    """Close loops: MuJoCo's are soft, and these are rigid."""
    for count, node in enumerate(reading.elements.sections("equality"), 1):
        one = reading.elements.full(node, tag="equality")
        label = one.get("name") or f"equality_{count}"
        if one.get("active") == "false":
            continue
        if one.tag == "joint" and one.get("joint2"):
            part, master = (_joint(reading, one, end) for end in ("joint1", "joint2"))
            law = numbers(one, "polycoef", None, (0.0, 1.0, 0.0, 0.0, 0.0))
            if not any(law[2:]):
                add_gear(reading.building, label, part, master, (law[1], law[0]))
                continue
        if one.tag not in ("connect", "weld") or not one.get("body1") or "relpose" in one.attrib:
            reading.left[f"equality {one.tag} {label}"] = None
            continue
        anchor = np.array(numbers(one, "anchor", 3, (0.0, 0.0, 0.0)))
        (frame, pose), (other, base) = (_body(reading, one, end, ground) for end in ("body1", "body2"))
        place = base[0].T @ (pose[0] @ anchor + pose[1] - base[1])
        turned = base[0].T @ pose[0] if one.tag == "weld" else np.eye(3)
        here = _placed(reading.building, f"{label}_a", other, (turned, place))
        there = _placed(reading.building, f"{label}_b", frame, (np.eye(3), anchor))
        closing: Any = reading.building.add(label, Spherical() if one.tag == "connect" else Weld())
        reading.building.scene.connect(here, closing.a)
        reading.building.scene.connect(closing.b, there)


def _joint(reading: _Reading, node: XMLElement, end: str) -> Pivot | Slider:
    part = reading.joints.get(name_of(node, end))
    if not isinstance(part, (Pivot, Slider)):
        raise UsageError(f"{node.get(end)!r} is no joint that turns or slides", where=node.place)
    return part


def _body(reading: _Reading, node: XMLElement, end: str, ground: Frame) -> tuple[Frame, Pose]:
    name = node.get(end)
    if name in ("", "world"):
        return ground, IDENTITY
    if name not in reading.bodies:
        raise UsageError(f"there is no body {name!r}", where=node.place)
    return reading.bodies[name].frame, reading.poses[name]


def _read_motors(reading: _Reading) -> None:
    driven: set[str] = set()
    for count, node in enumerate(reading.elements.sections("actuator"), 1):
        one = reading.elements.full(node, tag="general")
        label = one.get("name") or f"motor_{count}"
        joint = reading.joints.get(one.get("joint"))
        if node.tag != "motor" or not isinstance(joint, (Pivot, Slider)) or one.get("joint") in driven:
            reading.left[f"{node.tag} {label}"] = None
            continue
        driven.add(one.get("joint"))
        gain = reading.building.add(label, Gain(gain=numbers(one, "gear", None, (1.0,))[0]))
        entry = "motor" if isinstance(joint, Pivot) else "actuator"
        reading.building.scene.connect(gain.output("y"), joint.input(entry))
