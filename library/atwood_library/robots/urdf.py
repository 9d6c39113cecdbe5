"""URDF read as a scene: links are rigid bodies and joints are joints, by their names.

The format: http://wiki.ros.org/urdf/XML. Lengths are in m, angles in rad, axes z up, all as here.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from atwood import Component, Frame, Scene, UsageError
from atwood_library.joints.drive import Drive
from atwood_library.joints.free_joint import FreeJoint
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.planar import Planar
from atwood_library.joints.rotary_drive import RotaryDrive
from atwood_library.joints.slider import Slider
from atwood_library.joints.weld import Weld
from atwood_library.parts.appearance import Appearance
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody
from atwood_library.robots.building import Building, add_armature, add_friction, add_gear, choice, existing_file
from atwood_library.robots.inertias import checked_inertia
from atwood_library.robots.xml import XMLElement, name_of, number, numbers, only, read_xml

__all__ = ["Packages", "read_urdf", "rotation_of"]

Packages = Mapping[str, str | os.PathLike[str]] | Iterable[str | os.PathLike[str]]
"""Folders of packages by name, or folders in which packages are."""

_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_ZERO = (0.0, 0.0, 0.0)


def read_urdf(
    file: str | os.PathLike[str],
    *,
    base: str = "fixed",
    inertias: str = "refuse",
    packages: Packages = (),
    stops: float | None = None,
    friction: bool = True,
) -> Scene:
    """Return the scene of a URDF file.

    A link is a `RigidBody` and a joint a `Pivot`, a `Slider`, a `Weld`, a `FreeJoint` or a `Planar`, under its name; a
    `Weld` ``<joint>_origin`` says where it is on its parent. A joint that mimics another one is geared to it
    (``<joint>_mimic``), dry friction is ``<joint>_friction``, the inertia of a rotor behind a reduction
    ``<joint>_armature``, and visuals are `Appearance` parts. Limits of speed and effort, collision shapes, safety
    controllers and what simulators add have no counterpart, and are left out.

    Parameters
    ----------
    file
        The file.
    base
        ``"fixed"``: the root link is on the ground; ``"free"``: it moves.
    inertias
        What is done with an inertia that no body can have: ``"refuse"``, or ``"nearest"`` for the one that is nearest
        to it (see `nearest_inertia`).
    packages
        Where ``package://`` is: folders by name of the package, or folders in which packages are; besides, those above
        the file.
    stops
        Restitution of rigid stops at the limits of joints, 0 to 1; no stops if not given.
    friction
        Whether dry friction is read.

    Raises
    ------
    UsageError
        If the file is no URDF, or its links are no tree, with file and line.
    ParameterError
        If no body can have an inertia.
    """
    choice(base, ("fixed", "free"), "base", "read_urdf")
    choice(inertias, ("refuse", "nearest"), "inertias", "read_urdf")
    path = existing_file(file, "read_urdf")
    robot = read_xml(path, "robot")
    building = Building(path)
    links = _by_name(robot, "link")
    joints = _by_name(robot, "joint")
    order, root = _tree(robot, links, joints)
    _check_mimics(joints)
    bodies: dict[str, RigidBody] = {}
    for name in [root, *(_end(joints[one], "child", links) for one in order)]:
        bodies[name] = _add_link(building, name, links[name], inertias)
    if base == "fixed":
        building.scene.connect(building.add("ground", Ground()).frame, bodies[root].frame)
    made: dict[str, Component] = {}
    for name in order:
        parent, child = (bodies[_end(joints[name], end, links)].frame for end in ("parent", "child"))
        made[name] = _add_joint(building, name, joints[name], (parent, child), _held_at(joints, name), stops)
    for name in order:
        _add_loads(building, name, joints[name], made, friction)
    for name, body in bodies.items():
        _add_visuals(building, name, links[name], body, packages)
    _add_rotors(building, robot, made)
    return building.scene


# -- links and joints as a tree ----------------------------------------------------------------------------------------


def _by_name(robot: XMLElement, tag: str) -> dict[str, XMLElement]:
    found: dict[str, XMLElement] = {}
    for node in robot.findall(tag):
        name = name_of(node)
        if name in found:
            raise UsageError(f"there are two {tag}s {name!r}, the first at {found[name].place}", where=node.place)
        found[name] = node
    return found


def _end(joint: XMLElement, end: str, links: Mapping[str, XMLElement]) -> str:
    """Return the name of the link at one end of a joint."""
    node = only(joint, end)
    if node is None:
        raise UsageError(f"joint {joint.get('name')!r} has no <{end}>", where=joint.place)
    name = name_of(node, "link")
    if name not in links:
        raise UsageError(f"joint {joint.get('name')!r} names a link {name!r} that there is not", where=node.place)
    return name


def _tree(
    robot: XMLElement, links: Mapping[str, XMLElement], joints: Mapping[str, XMLElement]
) -> tuple[list[str], str]:
    """Return the joints from the root on, and the root link."""
    above: dict[str, str] = {}
    below: dict[str, list[str]] = {name: [] for name in links}
    for name, joint in joints.items():
        child = _end(joint, "child", links)
        if child in above:
            message = f"link {child!r} is the child of two joints, {above[child]!r} and {name!r}"
            raise UsageError(message, where=joint.place, advice="A URDF is a tree; close a loop in the scene.")
        above[child] = name
        below[_end(joint, "parent", links)].append(name)
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        message = f"it has {len(roots)} root links, {', '.join(map(repr, roots[:4]))}"
        raise UsageError(message, where=links[roots[1]].place, advice="Join them, so that one is the root.")
    order: list[str] = []
    reached = set(roots)
    stack = [*roots]
    while stack:
        link = stack.pop()
        for name in reversed(below[link]):
            stack.append(_end(joints[name], "child", links))
        if link in above:
            order.append(above[link])
            reached.add(link)
    lost = [name for name in links if name not in reached]
    if lost or not links:
        where = links[lost[0]].place if lost else robot.place
        said = f"links {', '.join(map(repr, lost[:4]))} are a loop of parents" if lost else "it has no links"
        raise UsageError(said, where=where)
    return order, roots[0]


# -- links -------------------------------------------------------------------------------------------------------------


def rotation_of(rpy: Iterable[float]) -> Any:
    """Return the matrix of a rotation by roll, pitch and yaw about fixed x, y and z axes, rad, shape (3, 3)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(list(rpy)), np.sin(list(rpy))
    return np.array(
        [
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr),
        ]
    )


def _origin(node: XMLElement) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the position of an element and its roll, pitch and yaw."""
    origin = only(node, "origin")
    if origin is None:
        return _ZERO, _ZERO
    return numbers(origin, "xyz", 3, _ZERO), numbers(origin, "rpy", 3, _ZERO)


def _add_link(building: Building, name: str, link: XMLElement, inertias: str) -> RigidBody:
    inertial = only(link, "inertial")
    if inertial is None:
        return building.add(name, RigidBody(mass=0.0))
    mass, tensor = only(inertial, "mass"), only(inertial, "inertia")
    if mass is None:
        raise UsageError(f"the inertial of link {name!r} has no <mass>", where=inertial.place)
    values = {} if tensor is None else {one: number(tensor, one, 0.0) for one in _ENTRIES}
    xx, xy, xz, yy, yz, zz = (values.get(one, 0.0) for one in _ENTRIES)
    centre, rpy = _origin(inertial)
    turn = rotation_of(rpy)
    inertia = turn @ np.array([(xx, xy, xz), (xy, yy, yz), (xz, yz, zz)]) @ turn.T
    where = f"{(tensor if tensor is not None else mass).place}: link {name!r}"
    return building.add(name, RigidBody.of(checked_inertia(number(mass, "value"), centre, inertia, inertias, where)))


_ENTRIES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def _add_visuals(building: Building, name: str, link: XMLElement, body: RigidBody, packages: Packages) -> None:
    """Add what a link looks like."""
    for count, visual in enumerate(link.findall("visual"), 1):
        geometry = only(visual, "geometry")
        for shape in [] if geometry is None else list(geometry):
            if shape.tag == "box":
                sizes, given = numbers(shape, "size", 3), {"shape": "box"}
            elif shape.tag in ("cylinder", "sphere", "capsule"):
                wide = 2.0 * number(shape, "radius")
                long = wide if shape.tag == "sphere" else number(shape, "length")
                sizes = (wide, wide, long + wide if shape.tag == "capsule" else long)
                given = {"shape": "ellipsoid" if shape.tag == "sphere" else shape.tag}
            elif shape.tag == "mesh":
                sizes = numbers(shape, "scale", 3, (1.0, 1.0, 1.0))
                given = {"shape": "mesh", "file": _mesh_file(name_of(shape, "filename"), building.file, packages)}
            else:
                continue
            seen = building.add(f"{name}_visual_{count}", Appearance(sizes=sizes, **given, **_pose(*_origin(visual))))
            building.scene.connect(body.frame, seen.a)


def _mesh_file(name: str, file: Path, packages: Packages) -> str:
    """Return the path of a mesh; where none is found, what the file calls it."""
    kind, _, rest = name.rpartition("://")
    if kind not in ("package", "model"):
        return str(file.parent / rest)
    package, _, inner = rest.partition("/")
    if isinstance(packages, Mapping):
        folders = [Path(packages[package])] if package in packages else []
    else:
        given = [packages] if isinstance(packages, (str, os.PathLike)) else packages
        folders = [Path(one) / package for one in given]
    for above in file.resolve().parents:
        folders += [above / package, *([above] if above.name == package else [])]
    return next((str(one / inner) for one in folders if (one / inner).is_file()), name)


# -- joints ------------------------------------------------------------------------------------------------------------


def _pose(position: Iterable[float], rpy: Iterable[float]) -> dict[str, Any]:
    """Return the values of a weld: about fixed axes by roll, pitch, yaw is about new axes by yaw, pitch, roll."""
    roll, pitch, yaw = rpy
    turned = {"turned_by": "three angles", "convention": "zyx", "angles": (yaw, pitch, roll)}
    return {"displacement": tuple(position), **(turned if any((roll, pitch, yaw)) else {})}


def _held_at(joints: Mapping[str, XMLElement], name: str) -> float | None:
    """Return the coordinate of a joint that mimics a fixed one, if only by way of others; None if it moves."""
    mimic = only(joints[name], "mimic")
    followed = None if mimic is None else joints.get(name_of(mimic, "joint"))
    if mimic is None or followed is None:
        return None
    master = 0.0 if followed.get("type") == "fixed" else _held_at(joints, name_of(mimic, "joint"))
    return None if master is None else number(mimic, "multiplier", 1.0) * master + number(mimic, "offset", 0.0)


def _add_joint(
    building: Building, name: str, joint: XMLElement, ends: tuple[Frame, Frame], held: float | None, stops: float | None
) -> Component:
    """Add a joint between two links, where it is on the first; one that is held has a coordinate that stays."""
    parent, child = ends
    kind = joint.get("type")
    if kind not in _TYPES:
        message = f"joint {name!r} has the type {kind!r}, and there are {', '.join(_TYPES)}"
        raise UsageError(message, where=joint.place)
    origin = _origin(joint)
    scene = building.scene
    if kind == "fixed":
        weld = building.add(name, Weld(**_pose(*origin)))
        scene.connect(parent, weld.a)
        scene.connect(weld.b, child)
        return weld
    axis_node = only(joint, "axis")
    axis = (1.0, 0.0, 0.0) if axis_node is None else numbers(axis_node, "xyz", 3, (1.0, 0.0, 0.0))
    if not any(axis) and kind != "floating":
        raise UsageError(f"the axis of joint {name!r} is zero", where=joint.place)
    part: Any
    if kind == "floating":
        part = FreeJoint()
    elif kind == "planar":
        part = Planar(axis=axis)
    elif held is not None:
        part = Drive(axis=axis, motion=held) if kind == "prismatic" else RotaryDrive(axis=axis, rotation=held)
    else:
        limits = _limits(name, joint, kind, stops)
        part = Slider(axis=axis, **limits) if kind == "prismatic" else Pivot(axis=axis, **limits)
    building.add(name, part)
    if any(origin[0]) or any(origin[1]):
        weld = building.add(f"{name}_origin", Weld(**_pose(*origin)))
        scene.connect(parent, weld.a)
        parent = weld.b
    scene.connect(parent, part.a)
    scene.connect(part.b, child)
    return part  # type: ignore[no-any-return]


def _limits(name: str, joint: XMLElement, kind: str, stops: float | None) -> dict[str, float]:
    """Return the values of stops at the limits of a joint, and its damping."""
    dynamics, limit = only(joint, "dynamics"), only(joint, "limit")
    values = {} if dynamics is None else {"damping": number(dynamics, "damping", 0.0)}
    if kind == "continuous":
        return values
    lower, upper = (0.0, 0.0) if limit is None else (number(limit, one, 0.0) for one in ("lower", "upper"))
    if lower > upper:
        message = f"the lower limit of joint {name!r}, {lower:g}, is above the upper one, {upper:g}"
        raise UsageError(message, where=joint.place)
    if stops is not None and limit is not None and lower < upper:
        values.update(lower_stop=lower, upper_stop=upper, stop_restitution=stops)
    return values


def _add_loads(building: Building, name: str, joint: XMLElement, made: Mapping[str, Component], friction: bool) -> None:
    """Add what acts on the coordinate of a joint besides: dry friction, and the gear to the joint that it mimics."""
    part, dynamics, mimic = made[name], only(joint, "dynamics"), only(joint, "mimic")
    dry = 0.0 if dynamics is None else number(dynamics, "friction", 0.0)
    if dry < 0.0:
        raise UsageError(f"the friction of joint {name!r} is {dry:g}", where=joint.place)
    if friction and dry > 0.0 and isinstance(part, (Pivot, Slider)):
        add_friction(building, name, part, dry)
    if mimic is None or isinstance(part, (Weld, Drive, RotaryDrive)):
        return  # or it is held
    followed = name_of(mimic, "joint")
    master = made.get(followed)
    if master is None:
        text = f"{mimic.place}: joint {name!r} mimics a joint {followed!r} that there is not, and moves freely"
        warnings.warn(text, stacklevel=3)
        return
    if not isinstance(part, (Pivot, Slider)) or not isinstance(master, (Pivot, Slider)):
        message = f"joint {name!r} mimics {followed!r}, and one of the two has no single coordinate"
        raise UsageError(message, where=mimic.place)
    add_gear(building, f"{name}_mimic", part, master, (number(mimic, "multiplier", 1.0), number(mimic, "offset", 0.0)))


def _check_mimics(joints: Mapping[str, XMLElement]) -> None:
    """Refuse joints that mimic themselves, if only by way of others."""
    follows = {name: mimic for name, joint in joints.items() if (mimic := only(joint, "mimic")) is not None}
    for name, mimic in follows.items():
        seen, one = [name], name_of(mimic, "joint")
        while one in follows and one not in seen:
            seen.append(one)
            one = name_of(follows[one], "joint")
        if one == name:
            raise UsageError(f"joint {' mimics '.join(map(repr, [*seen, name]))}", where=mimic.place)


def _add_rotors(building: Building, robot: XMLElement, made: Mapping[str, Component]) -> None:
    """Add the inertia of rotors: of a reduction n it counts n^2 times about the joint."""
    for transmission in robot.findall("transmission"):
        for actuator in transmission.findall("actuator"):
            reduction, rotor = (
                next((one for one in (only(actuator, tag), only(transmission, tag)) if one is not None), None)
                for tag in ("mechanicalReduction", "rotorInertia")
            )
            for joint in transmission.findall("joint") if rotor is not None else ():
                part = made.get(name_of(joint))
                if not isinstance(part, (Pivot, Slider)):
                    message = f"the rotor of {transmission.get('name')!r} is on no joint with a coordinate"
                    raise UsageError(message, where=joint.place)
                ratio = 1.0 if reduction is None else _content(reduction)
                add_armature(building, name_of(joint), part, _content(rotor) * ratio * ratio)


def _content(node: XMLElement | None) -> float:
    """Return the number between the tags of an element."""
    if node is None:
        return 0.0
    return number(XMLElement(node.tag, {"content": node.text or ""}, node.place), "content")
