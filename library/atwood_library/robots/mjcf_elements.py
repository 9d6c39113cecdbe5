"""MJCF's elements with what includes, default classes and compiler options make of them; poses and inertias.

The format: https://mujoco.readthedocs.io/en/stable/XMLreference.html. Formulas of inertia are those of solids, and of
meshes those that MuJoCo's compiler has in its documentation of ``mesh/inertia``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from atwood import UsageError
from atwood.solids import MassProperties, read_stl
from atwood_library.robots.graph import Pose, turn_about
from atwood_library.robots.xml import XMLElement, number, numbers, read_xml

__all__ = ["Elements", "ends_of", "geom_solid", "read_elements", "rotation_matrix", "sizes_of"]


@dataclass(frozen=True)
class Elements:
    """A model's elements.

    Attributes
    ----------
    root
        The root element, with includes in their places.
    classes
        Attributes of each default class by tag, those of the classes around it included.
    compiler
        Attributes of all ``<compiler>``.
    """

    root: XMLElement
    classes: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict)
    compiler: dict[str, str] = field(default_factory=dict)

    def sections(self, tag: str) -> list[XMLElement]:
        """Return what is in all sections of a kind, such as ``"worldbody"``."""
        return [node for section in self.root.findall(tag) for node in section]

    def full(self, node: XMLElement, near: str = "main", tag: str = "") -> XMLElement:
        """Return an element with what its class, or that of the body around it, says where itself does not.

        Parameters
        ----------
        node
            The element.
        near
            The class of the body around it.
        tag
            The kind whose defaults hold; that of the element if not given.
        """
        name = node.get("class") or near
        if name not in self.classes:
            raise UsageError(f"<{node.tag}> names a default class {name!r} that there is not", where=node.place)
        given = {**self.classes[name].get(tag or node.tag, {}), **node.attrib}
        return XMLElement(node.tag, given, node.place, node.text or "", node)

    def angle(self, node: XMLElement, name: str, default: float) -> float:
        """Return an angle, rad."""
        value = number(node, name, default if self.compiler.get("angle") == "radian" else math.degrees(default))
        return value if self.compiler.get("angle") == "radian" else math.radians(value)


def read_elements(file: Path) -> Elements:
    """Return the elements of a model with everything that it includes."""
    root = read_xml(file, "mujoco")
    _include(root, file.parent, {file.resolve()})
    elements = Elements(root)
    for section in root.findall("default"):
        stack: list[tuple[XMLElement, str]] = [(section, "")]
        while stack:
            node, around = stack.pop()
            name = node.get("class") or "main" if not around else node.get("class")
            if not name:
                raise UsageError("<default> in another one has no 'class'", where=node.place)
            known = elements.classes.setdefault(name, {})
            for tag, given in elements.classes.get(around, {}).items():
                known[tag] = {**given, **known.get(tag, {})}
            for one in node:
                if one.tag == "default":
                    stack.append((one, name))
                else:
                    known[one.tag] = {**known.get(one.tag, {}), **one.attrib}
    elements.classes.setdefault("main", {})
    for node in root.findall("compiler"):
        elements.compiler.update(node.attrib)
    return elements


def _include(root: XMLElement, folder: Path, seen: set[Path]) -> None:
    """Put included files in the places of ``<include>``; each can be included once."""
    stack = [root]
    while stack:
        node = stack.pop()
        inner: list[XMLElement] = []
        for one in node:
            if one.tag != "include":
                inner.append(one)
                continue
            path = folder / one.get("file")
            if not one.get("file") or path.resolve() in seen:
                said = "it includes a file a second time" if one.get("file") else "<include> has no 'file'"
                raise UsageError(f"{said}: {one.get('file')!r}", where=one.place)
            seen.add(path.resolve())
            held = read_xml(path, "mujoco", "mujocoinclude")
            _include(held, folder, seen)
            inner += held
        node[:] = inner
        stack += inner


# -- poses -------------------------------------------------------------------------------------------------------------


def rotation_matrix(elements: Elements, node: XMLElement) -> Any:
    """Return the matrix of the orientation that an element says in one of the format's ways."""
    given = [one for one in ("quat", "axisangle", "xyaxes", "zaxis", "euler") if one in node.attrib]
    if len(given) > 1:
        raise UsageError(f"<{node.tag}> has both {given[0]!r} and {given[1]!r}", where=node.place)
    kind = given[0] if given else ""
    values = np.array(numbers(node, kind, {"quat": 4, "axisangle": 4, "xyaxes": 6}.get(kind, 3))) if kind else None
    if values is None:
        return np.eye(3)
    if kind != "euler" and not np.linalg.norm(values[:3] if kind != "quat" else values):
        raise UsageError(f"{kind!r} of <{node.tag}> is zero", where=node.place)
    scale = 1.0 if elements.compiler.get("angle") == "radian" else math.pi / 180.0
    if kind == "quat":
        w, x, y, z = values / np.linalg.norm(values)
        cross = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
        return np.eye(3) + 2.0 * (w * cross + cross @ cross)
    if kind == "axisangle":
        return turn_about(values[:3], scale * values[3])
    if kind == "xyaxes":
        x = values[:3] / np.linalg.norm(values[:3])
        y = values[3:] - (values[3:] @ x) * x
        if not np.linalg.norm(y):
            raise UsageError(f"the axes of <{node.tag}> are parallel", where=node.place)
        y = y / np.linalg.norm(y)
        return np.column_stack([x, y, np.cross(x, y)])
    if kind == "zaxis":
        return _z_turned(values)
    turned = np.eye(3)
    for letter, angle in zip(elements.compiler.get("eulerseq", "xyz"), values, strict=True):
        one = turn_about(np.eye(3)["xyz".index(letter.lower())], scale * float(angle))
        turned = turned @ one if letter.islower() else one @ turned
    return turned


def _z_turned(direction: Any) -> Any:
    """Return the least rotation that takes z into a direction."""
    axis = np.cross((0.0, 0.0, 1.0), direction)
    if not np.linalg.norm(axis):
        return np.eye(3) if direction[2] > 0.0 else np.diag((1.0, -1.0, -1.0))
    return turn_about(axis, math.atan2(float(np.linalg.norm(axis)), float(direction[2])))


def ends_of(elements: Elements, geom: XMLElement) -> tuple[Pose, float | None]:
    """Return the pose of a geom in its body, and half its length where ``fromto`` says it."""
    if "fromto" not in geom.attrib:
        return (rotation_matrix(elements, geom), np.array(numbers(geom, "pos", 3, (0.0, 0.0, 0.0)))), None
    line = np.array(numbers(geom, "fromto", 6))
    along = line[:3] - line[3:]
    if not np.linalg.norm(along):
        raise UsageError("the ends of <geom> are in one place", where=geom.place)
    return (_z_turned(along), (line[:3] + line[3:]) / 2), float(np.linalg.norm(along)) / 2


# -- inertias ----------------------------------------------------------------------------------------------------------


def sizes_of(geom: XMLElement, half: float | None) -> tuple[str, tuple[float, ...]]:
    """Return the type of a geom and its half sizes: radius and half length, or three half axes."""
    kind = geom.get("type") or ("mesh" if "mesh" in geom.attrib else "sphere")
    count = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}.get(kind, 0)
    given = numbers(geom, "size", None, ())
    if half is not None and count == 2:
        given = (*given[:1], half)
    elif half is not None and count == 3:
        given = (given[0], given[1] if len(given) > 1 else given[0], half) if given else ()
    if len(given) < count or min(given[:count], default=1.0) <= 0.0:
        raise UsageError(f"a {kind} has {count} sizes above 0, and not {given}", where=geom.place)
    return kind, given[:count]


def geom_solid(elements: Elements, geom: XMLElement, meshes: Mapping[str, tuple[str, Any]]) -> MassProperties | None:
    """Return the mass properties of a geom in its body; None of what has none."""
    (turned, place), half = ends_of(elements, geom)
    kind, sizes = sizes_of(geom, half)
    if kind == "mesh":
        if geom.get("mesh") not in meshes:
            raise UsageError(f"<geom> names a mesh {geom.get('mesh')!r} that there is not", where=geom.place)
        volume, centre, gyration = _mesh(*meshes[geom.get("mesh")], geom.place)
        place = place + turned @ centre
    elif kind in ("sphere", "capsule", "cylinder", "ellipsoid", "box"):
        volume, moments = _solid(kind, sizes)
        gyration = np.diag(moments)
    else:
        return None
    mass = number(geom, "mass", number(geom, "density", 1000.0) * volume)
    return MassProperties(mass, np.zeros(3), mass * gyration).placed(turned, place) if mass > 0.0 else None


def _solid(kind: str, sizes: tuple[float, ...]) -> tuple[float, tuple[float, float, float]]:
    """Return the volume of a shape and its moments of inertia per mass."""
    a, b, c = (sizes * 3)[:3] if kind == "sphere" else (sizes if len(sizes) == 3 else (sizes[0], sizes[0], sizes[1]))
    if kind == "box":
        return 8.0 * a * b * c, ((b * b + c * c) / 3, (a * a + c * c) / 3, (a * a + b * b) / 3)
    if kind in ("sphere", "ellipsoid"):
        return 4 / 3 * math.pi * a * b * c, ((b * b + c * c) / 5, (a * a + c * c) / 5, (a * a + b * b) / 5)
    drum = 2.0 * math.pi * a * a * c
    across, along = (3 * a * a + 4 * c * c) / 12, a * a / 2
    if kind == "cylinder":
        return drum, (across, across, along)
    caps = 4 / 3 * math.pi * a**3  # two hemispheres, whose centres are 3/8 of the radius outside of the ends
    share = caps / (drum + caps)
    across = (1 - share) * across + share * (0.4 * a * a + c * c + 0.75 * a * c)
    return drum + caps, (across, across, (1 - share) * along + share * 0.4 * a * a)


def _mesh(file: str, scale: Any, place: str) -> tuple[float, Any, Any]:
    """Return volume, centre of mass, and inertia per mass of a mesh about it.

    Pyramids stand on the triangles; their tips are in the mean of the faces for the centre of mass, and there for the
    inertia. Each counts as positive, which is exact where all of the surface is seen from there.
    """
    if not file.lower().endswith(".stl"):
        raise UsageError(f"the inertia of {file!r} is read of STL files alone", where=place)
    corners = read_stl(file) * scale
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    middles = corners.mean(axis=1)
    areas = np.linalg.norm(normals, axis=1)
    tip = areas @ middles / areas.sum()
    volumes = np.abs(np.sum((middles - tip) * normals, axis=1)) / 3
    centre = volumes @ (0.75 * middles + 0.25 * tip) / volumes.sum()
    corners = corners - centre
    volumes = np.abs(np.sum((middles - centre) * normals, axis=1)) / 3
    sums = corners.sum(axis=1)
    second = np.einsum("n,nki,nkj->ij", volumes, corners, corners) + np.einsum("n,ni,nj->ij", volumes, sums, sums)
    second /= 20.0 * volumes.sum()
    return float(volumes.sum()), centre, np.trace(second) * np.eye(3) - second
