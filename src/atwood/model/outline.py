"""Outlines: what a part looks like, as plain numbers; pictures are drawn from them, and nothing else reads them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from atwood.errors import DeclarationError

__all__ = ["Outline"]


@dataclass(frozen=True, eq=False)
class Outline:
    """The surface of a part, in the axes of its first frame; made by `box`, `revolved` or `mesh`.

    Attributes
    ----------
    kind
        ``"box"``, ``"revolved"`` or ``"mesh"``.
    sides
        Of a box, its sides along x, y and z, m; its centre is the origin.
    profile
        Of a surface of revolution, distance from the axis and height along it of each point of the line that is turned
        about the axis, m, shape (points, 2): counter-clockwise about what is inside, as seen with the axis on the left.
    axis
        Of a surface of revolution: 0, 1 or 2 for x, y or z.
    is_ring
        Whether the line ends where it begins, as that of a tube does; otherwise it begins and ends on the axis.
    vertices, triangles
        Arrays of a mesh: m, shape (vertices, 3), and its triangles, counter-clockwise from outside.
    """

    kind: Literal["box", "revolved", "mesh"]
    sides: tuple[float, float, float] = (0.0, 0.0, 0.0)
    profile: tuple[tuple[float, float], ...] = ()
    axis: int = 2
    is_ring: bool = False
    vertices: Any = None
    triangles: Any = None

    @classmethod
    def box(cls, length_x: float, length_y: float, length_z: float) -> Outline:
        """Return a box about the origin with its edges along the axes, lengths in m."""
        return cls("box", sides=(float(length_x), float(length_y), float(length_z)))

    @classmethod
    def revolved(cls, profile: Iterable[Sequence[float]], axis: str = "z", is_ring: bool = False) -> Outline:
        """Return a surface of revolution about an axis of the frame, ``"x"``, ``"y"`` or ``"z"``; see `profile`."""
        line = tuple((float(distance), float(height)) for distance, height in profile)
        if len(line) < 2:
            raise DeclarationError("an outline needs points (distance from the axis, height)", advice="Give two.")
        return cls("revolved", profile=line, axis="xyz".index(axis), is_ring=is_ring)

    @classmethod
    def mesh(cls, vertices: Any, triangles: Any) -> Outline:
        """Return a closed triangle mesh; see `vertices` and `triangles`."""
        return cls("mesh", vertices=vertices, triangles=triangles)
