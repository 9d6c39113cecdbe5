"""Surfaces of parts that say what they look like."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from atwood.arrays import FloatArray
from atwood.model.declare.binding import Binding, bind
from atwood.model.local.parts import LocalPart
from atwood.model.values.outline import Outline
from atwood.plotting.shapes.meshes import Mesh, box, revolved

__all__ = ["outline_mesh", "outline_of"]


_PARTS = 8
"""Into about so many parts the longest side is divided, since a painter sorts small faces better."""

_THIN = 0.01
"""What has no thickness is drawn so thick, relative to its largest side."""


def outline_of(local: LocalPart) -> Outline | None:
    """Return what a part looks like, with the numbers of its scene; None if it does not say.

    Parameters
    ----------
    local
        The part.
    """
    part = local.part
    found: Outline | None = bind(part.component, Binding(values=part.values)).outline()
    return found


def outline_mesh(outline: Outline, around: int = 40) -> Mesh:
    """Return the surface of an outline, in the axes of the part's frame.

    Parameters
    ----------
    outline
        The outline.
    around
        How many corners stand for a circle.
    """
    made = _own_mesh(outline, around)
    return made if outline.axes is None else made.placed(np.zeros(3), outline.axes)


def _own_mesh(outline: Outline, around: int) -> Mesh:
    if outline.kind == "box":
        return box(outline.sides, cells=_PARTS - 3)
    if outline.kind == "mesh":
        triangles = np.asarray(outline.triangles, dtype=np.intp)
        faces = np.column_stack([triangles, triangles[:, 2]])
        return Mesh(np.asarray(outline.vertices, dtype=float), faces, np.zeros(len(faces), dtype=bool))
    line = _with_thickness(np.asarray(outline.profile, dtype=float), outline.is_ring)
    made = revolved(_divided(line, outline.is_ring), around=around, marks=True, closed=outline.is_ring)
    # z of the surface along the axis, x and y along the next two: a right-handed turn.
    turn = np.eye(3)[:, [(outline.axis + 1) % 3, (outline.axis + 2) % 3, outline.axis]]
    return made.placed(np.zeros(3), turn)


def _with_thickness(line: FloatArray, is_ring: bool) -> FloatArray:
    """Return a line that encloses something: of a plate without thickness, or a wall without it, with a little."""
    widths, heights = np.ptp(line, axis=0)
    least = _THIN * max(float(np.max(line[:, 0])), float(heights))
    line = line.copy()
    if heights < least:
        line[:, 1] = 0.5 * least * np.array([-1.0 if i < (len(line) + 1) // 2 else 1.0 for i in range(len(line))])
    if widths < least and is_ring:
        line[[0, -1], 0] -= least
    elif 0.0 < widths < least:
        line[:, 0] *= least / widths
    return line


def _divided(line: FloatArray, is_ring: bool) -> FloatArray:
    """Return a line in pieces that are not much longer than a part of its longest side."""
    whole = np.concatenate([line, line[:1]]) if is_ring else line
    longest = float(np.max(np.ptp(whole, axis=0)))
    found = []
    for one, other in pairwise(whole):
        count = max(1, int(np.ceil(_PARTS * float(np.linalg.norm(other - one)) / (1.5 * longest))))
        found += [one + (other - one) * k / count for k in range(count)]
    return np.array(found if is_ring else [*found, whole[-1]])
