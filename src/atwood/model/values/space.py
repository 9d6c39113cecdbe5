"""Line, plane and space: which position components there are, and how a frame turns."""

from __future__ import annotations

from atwood.expr import Scalar, cos, sin
from atwood.late import dataclass
from atwood.model.values.vector import Vector, dot

__all__ = ["Space", "make_space"]


@dataclass(frozen=True)
class Space:
    """What a scene lives in.

    Attributes
    ----------
    name
        ``"line"``, ``"plane"`` or ``"space"``.
    basis
        Unit vectors of the free position components.
    axis_names
        Names of these components in symbols.
    reported_axes
        Which of x, y, z (0, 1, 2) quantities are reported along.
    line
        Unit vector of the line, for a scene on a line.
    """

    name: str
    basis: tuple[Vector, ...]
    axis_names: tuple[str, ...]
    reported_axes: tuple[int, ...]
    line: Vector | None = None

    @property
    def has_rotation(self) -> bool:
        """Whether frames can turn."""
        return self.name != "line"

    def vector(self, components: tuple[Scalar, ...]) -> Vector:
        """Return the vector with the given free components."""
        total = Vector(0.0, 0.0, 0.0)
        for component, direction in zip(components, self.basis, strict=True):
            total = total + direction * component
        return total

    def components(self, vector: Vector) -> tuple[Scalar, ...]:
        """Return the free components of a vector."""
        return tuple(dot(vector, direction) for direction in self.basis)


_X, _Y, _Z = Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0)


def make_space(name: str, line_axis: tuple[float, float, float]) -> Space:
    """Return the space of a scene from its name and, for a line, its direction."""
    if name == "line":
        line = Vector(*line_axis)
        reported = tuple(i for i in range(3) if line[i] != 0.0)
        return Space("line", (line,), ("s",), reported, line)
    if name == "plane":
        return Space("plane", (_X, _Z), ("x", "z"), (0, 2))
    return Space("space", (_X, _Y, _Z), ("x", "y", "z"), (0, 1, 2))


def planar_axes(angle: Scalar) -> tuple[Vector, Vector, Vector]:
    """Return the axes of a frame turned by an angle, counter-clockwise as seen on the page, that is about -y."""
    c, s = cos(angle), sin(angle)
    return Vector(c, 0.0, s), _Y, Vector(-s, 0.0, c)


FIXED_AXES = (_X, _Y, _Z)
