"""The shape of a body: its own, or, where it only has a mass and an inertia, the simplest one that has both."""

from __future__ import annotations

from functools import cached_property
from typing import Literal

import numpy as np

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass, replace
from atwood.lazy_modules import scipy
from atwood.plotting.scene3d.reading import Lump
from atwood.plotting.shapes.meshes import Mesh, box, cylinder, frame_along, outline_mesh

_EQUAL = 1e-6
"""Moments that differ by less, relative to the largest, are equal."""

_LONG = 2.5
"""What is so many times longer than thick is a bar."""


@dataclass(frozen=True, eq=False)
class BodyShape:
    """A uniform box or cylinder with a given mass and inertia, or the shape that a part has itself.

    Attributes
    ----------
    lump
        What it stands for.
    kind
        ``point`` has no inertia; ``own`` is the part's own shape.
    axes
        Its axes in those of the body, as columns; of a cylinder the last is its own.
    sides
        Full sides of the box; diameter, diameter and height of the cylinder; of an own shape those of the box that it
        fits in, m.
    surface
        Of an own shape its surface, in the axes of the body.
    """

    lump: Lump
    kind: Literal["point", "box", "round", "own"]
    axes: FloatArray
    sides: FloatArray
    surface: Mesh | None = None

    @cached_property
    def center(self) -> FloatArray:
        """Its centre in the axes of the body, m."""
        if self.surface is None:
            return self.lump.center
        seen = self.surface.vertices @ self.axes
        return np.asarray(self.axes @ (0.5 * (seen.min(axis=0) + seen.max(axis=0))))

    @property
    def axis(self) -> FloatArray:
        """Its axis of revolution in the axes of the body, or else the z axis of its frame."""
        if self.kind == "round":
            return self.axes[:, 2]
        outline = self.lump.outline
        if outline is None or outline.axes is None:
            return self.lump.axes[:, 2 if outline is None else outline.axis]
        return np.asarray(self.lump.axes @ outline.axes[:, outline.axis])

    @property
    def radius(self) -> float:
        """Radius of the ball about its centre that it fits in, m."""
        if self.kind == "round":
            return float(np.hypot(0.5 * self.sides[0], 0.5 * self.sides[2]))
        return float(0.5 * np.linalg.norm(self.sides))

    @property
    def corners(self) -> FloatArray:
        """Corners of the box that it fits in, in the axes of the body, m."""
        signs = np.array(list(np.ndindex(2, 2, 2))) - 0.5
        return np.asarray(self.center + (signs * self.sides) @ self.axes.T)

    @property
    def is_long(self) -> bool:
        """Whether it is a bar."""
        order = np.sort(self.sides)
        return self.kind != "point" and bool(order[2] > _LONG * order[1])

    @property
    def girth(self) -> float:
        """Half the thickness of a bar, m."""
        return float(0.5 * np.sort(self.sides)[1])

    @property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Middles of the two ends of a bar, in the axes of the body, m."""
        along = int(np.argmax(self.sides))
        half = 0.5 * self.sides[along] * self.axes[:, along]
        return self.center - half, self.center + half

    def nearest(self, point: FloatArray) -> FloatArray:
        """Return the point in it that is nearest to another one, in the axes of the body, m; of a bar, on its axis."""
        seen = self.axes.T @ (point - self.center)
        half = 0.5 * self.sides.copy()
        if self.is_long:
            half[np.arange(3) != int(np.argmax(self.sides))] = 0.0
        held = np.clip(seen, -half, half)
        if self.kind == "round" and not self.is_long:
            across = float(np.hypot(seen[0], seen[1]))
            held[:2] = seen[:2] * min(1.0, half[0] / across if across > 0.0 else 1.0)
        return np.asarray(self.center + self.axes @ held)

    def drawn(self, thinnest: float, thickest: float) -> BodyShape:
        """Return it as it is drawn."""
        if self.kind == "own":
            return self
        sides = np.maximum(self.sides, thinnest)
        if self.is_long:
            along = int(np.argmax(self.sides))
            sides = np.where(np.arange(3) == along, sides, np.minimum(sides, thickest))
        return replace(self, sides=sides)

    def mesh(self) -> Mesh:
        """Return its surface in the axes of the body."""
        sides = self.sides
        if self.surface is not None:
            return self.surface
        if self.kind == "round":
            made = cylinder(0.5 * float(sides[0]), float(sides[2]), marks=not self.is_long)
        else:
            made = box([float(side) for side in sides], cells=8 if self.is_long else 5)
        return made.placed(self.center, self.axes)


def shape_of(lump: Lump) -> BodyShape:
    """Return a part's own shape, or the uniform box of its mass and moments, or cylinder where two of these are equal.

    Of a box with sides a, b and c the moments are ``m (b^2 + c^2)/12`` and so on, so that
    ``a^2 = 6 (J2 + J3 - J1)/m``. Of a cylinder they are ``m r^2/2`` about its axis and ``m (3 r^2 + h^2)/12`` across
    (Landau and Lifshitz, Mechanics, section 32). Every inertia that a body can have has such a box and, where it is
    symmetrical, such a cylinder.
    """
    if lump.outline is not None:
        surface = outline_mesh(lump.outline)
        placed = surface.placed(lump.origin, lump.axes)
        return BodyShape(lump, "own", lump.axes, np.ptp(surface.vertices, axis=0), placed)
    moments, axes = np.linalg.eigh(lump.tensor)
    largest = float(moments[2])
    if largest <= 0.0:
        return BodyShape(lump, "point", lump.axes, np.zeros(3))
    low, high = (abs(moments[i + 1] - moments[i]) <= _EQUAL * largest for i in range(2))
    if low and high:
        return BodyShape(lump, "box", lump.axes, np.full(3, np.sqrt(6.0 * largest / lump.mass)))
    if low or high:
        own, across = (2, 0) if low else (0, 2)
        axis = axes[:, own] * _sign(lump.axes.T @ axes[:, own])
        diameter = 2.0 * np.sqrt(2.0 * max(moments[own], 0.0) / lump.mass)
        height = np.sqrt(max(12.0 * moments[across] - 6.0 * moments[own], 0.0) / lump.mass)
        frame = frame_along(axis, lump.axes[:, 0])
        return BodyShape(lump, "round", frame, np.array([diameter, diameter, height]))
    # In the order and the sense of the frame's axes, where they are along these.
    order = scipy.optimize.linear_sum_assignment(-np.abs(lump.axes.T @ axes))[1]
    axes = np.column_stack([axes[:, i] * _sign(lump.axes.T @ axes[:, i]) for i in order])
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    a, b, c = (moments[i] for i in order)
    squares = 6.0 * np.array([b + c - a, c + a - b, a + b - c]) / lump.mass
    return BodyShape(lump, "box", axes, np.sqrt(np.maximum(squares, 0.0)))


def _sign(components: FloatArray) -> float:
    return -1.0 if components[int(np.argmax(np.abs(components)))] < 0.0 else 1.0
