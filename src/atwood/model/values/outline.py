"""Outlines: what a part looks like, as plain numbers; pictures are drawn from them, and nothing else reads them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Literal

import numpy as np

from atwood.arguments import FLAG, NAME, Kind, Refused, check, number, one_of, real, show, takes_names
from atwood.errors import DeclarationError, UsageError
from atwood.lazy_dataclasses import dataclass, replace


@dataclass(frozen=True, eq=False)
class Outline:
    """The surface of a part, in the axes of its first frame; made by `box`, `revolved`, `mesh`, `path` or `nothing`.

    Attributes
    ----------
    kind
        ``"box"``, ``"revolved"``, ``"mesh"``, ``"path"`` or ``"nothing"``.
    sides
        Of a box, its sides along x, y and z, m; its centre is the origin.
    profile
        Of a surface of revolution, distance from the axis and height along it of each point of the line that is turned
        about the axis, m, shape (points, 2): counter-clockwise about what is inside, as seen with the axis on the left.
    axis
        Of a surface of revolution: 0, 1 or 2 for x, y or z.
    axes
        Where its x, y and z axes point in the axes of the frame, in columns; None if they are the same.
    frame
        Name of the connector in whose axes it is; empty for the first one.
    is_ring
        Whether the line ends where it begins, as that of a tube does; otherwise it begins and ends on the axis.
    vertices, triangles
        Arrays of a mesh: m, shape (vertices, 3), and its triangles, counter-clockwise from outside.
    """

    kind: Literal["box", "revolved", "mesh", "path", "nothing"]
    sides: tuple[float, float, float] = (0.0, 0.0, 0.0)
    profile: tuple[tuple[float, float], ...] = ()
    axis: int = 2
    axes: Any = None
    frame: str = ""
    is_ring: bool = False
    vertices: Any = None
    triangles: Any = None

    @classmethod
    @takes_names
    def box(cls, length_x: float, length_y: float, length_z: float) -> Outline:
        """Return a box about the origin with its edges along the axes, lengths in m."""
        named = {"length_x": length_x, "length_y": length_y, "length_z": length_z}
        x, y, z = (float(check(_LENGTH, size, name, "Outline.box")) for name, size in named.items())
        return cls("box", sides=(x, y, z))

    @classmethod
    @takes_names
    def revolved(cls, profile: Iterable[Sequence[float]], axis: Any = "z", is_ring: bool = False) -> Outline:
        """Return a surface of revolution about an axis of the frame; see `profile`.

        The axis is ``"x"``, ``"y"`` or ``"z"``, or a direction.
        """
        line = check(_PROFILE, profile, "profile", "Outline.revolved", DeclarationError)
        check(FLAG, is_ring, "is_ring", "Outline.revolved")
        if not isinstance(axis, str):
            z = check(_DIRECTION, axis, "axis", "Outline.revolved")
            side = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
            x = side / np.linalg.norm(side)
            return cls("revolved", profile=line, is_ring=is_ring).turned(x, np.cross(z, x), z)
        check(one_of(("x", "y", "z")), axis, "axis", "Outline.revolved")
        return cls("revolved", profile=line, axis="xyz".index(axis), is_ring=is_ring)

    @classmethod
    @takes_names
    def mesh(cls, vertices: Any, triangles: Any) -> Outline:
        """Return a closed triangle mesh; see `vertices` and `triangles`."""
        corners = check(Kind("numbers of shape (vertices, 3), m", _table), vertices, "vertices", "Outline.mesh")
        kind = Kind(f"the numbers of vertices, 0 to {len(corners) - 1}, of shape (triangles, 3)", _table)
        faces = check(kind, triangles, "triangles", "Outline.mesh")
        if np.any(faces < 0) or np.any(faces >= len(corners)) or np.any(faces != np.round(faces)):
            raise UsageError(
                f"triangles cannot be {show(triangles)}", where="Outline.mesh", advice=f"Give {kind.what}."
            )
        return cls("mesh", vertices=vertices, triangles=triangles)

    @classmethod
    @takes_names
    def path(cls, frame: str) -> Outline:
        """Return the way of a connector, by its name, along a run as seen from the first one: what a guide shows."""
        return cls("path", frame=check(NAME, frame, "frame", "Outline.path"))

    @classmethod
    def nothing(cls) -> Outline:
        """Return what is not to be seen, such as an attraction through empty space."""
        return cls("nothing")

    @takes_names
    def on(self, frame: str) -> Outline:
        """Return the same surface in the axes of another connector of the part, by its name."""
        return replace(self, frame=check(NAME, frame, "frame", "Outline.on"))

    @takes_names
    def turned(self, x_axis: Any, y_axis: Any, z_axis: Any) -> Outline:
        """Return the same surface with its axes along three unit vectors, square to each other, of the frame."""
        named = {"x_axis": x_axis, "y_axis": y_axis, "z_axis": z_axis}
        columns = [check(_DIRECTION, one, name, "Outline.turned") for name, one in named.items()]
        return replace(self, axes=np.array(columns).T)


_LENGTH = number("a length above 0, m", above=0.0)


def _points(value: Any) -> tuple[tuple[float, float], ...]:
    line = tuple((real(distance), real(height)) for distance, height in value)
    if len(line) < 2 or not all(math.isfinite(one) for point in line for one in point):
        raise Refused
    return line


_PROFILE = Kind("at least two points, each (distance from the axis, height along it), m", _points)


def _direction(value: Any) -> Any:
    given = np.array([float(one) for one in value])
    if given.shape != (3,) or not np.all(np.isfinite(given)) or not np.any(given):
        raise Refused
    return given / np.linalg.norm(given)


_DIRECTION = Kind("a direction: three numbers, not all zero", _direction)


def _table(value: Any) -> Any:
    table = np.asarray(value, dtype=float)
    if table.ndim != 2 or table.shape[1] != 3 or not len(table) or not np.all(np.isfinite(table)):
        raise Refused
    return table
