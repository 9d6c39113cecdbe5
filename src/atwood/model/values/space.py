"""Vectors, whose components are numbers, expressions or sympy terms, and the line, plane or space they are in.

Laws are written on these, so one law serves a line, a plane and space: what is constant in the declared space
is a plain zero, and folds away.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from atwood.arguments import show
from atwood.errors import DeclarationError
from atwood.expr import Expression, Scalar, cos, is_zero, sin, sqrt
from atwood.expr.core.functions import is_scalar
from atwood.lazy_dataclasses import dataclass


class Vector:
    """A vector with components along x (right), y (into the page) and z (up).

    Parameters
    ----------
    x, y, z
        The components, each a number, an expression or a sympy term.
    """

    __slots__ = ("x", "y", "z")

    def __init__(self, x: Scalar = 0.0, y: Scalar = 0.0, z: Scalar = 0.0) -> None:
        self.x = x
        self.y = y
        self.z = z
        if type(x) in _PLAIN and type(y) in _PLAIN and type(z) in _PLAIN:
            return
        for name, one in (("x", x), ("y", y), ("z", z)):
            if not is_scalar(one):
                raise DeclarationError(f"{name} cannot be {show(one)}", where="Vector", advice=_COMPONENT)

    def __iter__(self) -> Iterator[Scalar]:
        return iter((self.x, self.y, self.z))

    def __getitem__(self, axis: int) -> Scalar:
        return (self.x, self.y, self.z)[axis]

    def __add__(self, other: Vector) -> Vector:
        if not isinstance(other, Vector):
            raise _not_a_vector(other)
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: Vector) -> Vector:
        if not isinstance(other, Vector):
            raise _not_a_vector(other)
        return Vector(self.x - other.x, self.y - other.y, self.z - other.z)

    def __neg__(self) -> Vector:
        return Vector(-self.x, -self.y, -self.z)

    def __mul__(self, factor: Scalar) -> Vector:
        return Vector(self.x * factor, self.y * factor, self.z * factor)

    __rmul__ = __mul__

    def __truediv__(self, divisor: Scalar) -> Vector:
        return Vector(self.x / divisor, self.y / divisor, self.z / divisor)

    def __repr__(self) -> str:
        return f"Vector({self.x!r}, {self.y!r}, {self.z!r})"


_PLAIN = frozenset((float, int, Expression))


_COMPONENT = "Give a number, or an expression."


def _not_a_vector(value: object) -> DeclarationError:
    """Return the error that says that something else is in the place of a vector."""
    return DeclarationError(
        f"a vector cannot be {show(value)}", advice="Give a Vector, or three numbers or expressions."
    )


ZERO = Vector(0.0, 0.0, 0.0)


def as_vector(value: Vector | Sequence[Any]) -> Vector:
    """Return a vector from a vector or from three components."""
    if isinstance(value, Vector):
        return value
    try:
        x, y, z = value
    except Exception:  # whatever it is, it has no three components
        raise _not_a_vector(value) from None
    return Vector(x, y, z)


def dot(a: Vector, b: Vector) -> Scalar:
    """Return the scalar product of two vectors."""
    for one in (a, b):
        if not isinstance(one, Vector):
            raise _not_a_vector(one)
    return a.x * b.x + a.y * b.y + a.z * b.z


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product of two vectors."""
    for one in (a, b):
        if not isinstance(one, Vector):
            raise _not_a_vector(one)
    return Vector(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


def norm(a: Vector) -> Scalar:
    """Return the length of a vector; it has no derivative where the length is zero."""
    return sqrt(dot(a, a))


_AXIAL_UNITS = ("rad/s", "rad/s^2", "N*m", "kg*m^2/s")


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
    turn_axes
        Unit vectors of the axes that frames can turn about, in the directions in which turns are counted.
    turn_names
        What quantities about these axes have after their name.
    line
        Unit vector of the line, for a scene on a line.
    """

    name: str
    basis: tuple[Vector, ...]
    axis_names: tuple[str, ...]
    reported_axes: tuple[int, ...]
    turn_axes: tuple[Vector, ...] = ()
    turn_names: tuple[str, ...] = ()
    line: Vector | None = None

    @property
    def has_rotation(self) -> bool:
        """Whether frames can turn."""
        return bool(self.turn_axes)

    @property
    def is_line(self) -> bool:
        """Whether everything is on a line, and nothing turns."""
        return self.line is not None

    @property
    def is_planar(self) -> bool:
        """Whether an orientation is one angle."""
        return len(self.turn_axes) == 1

    @property
    def is_spatial(self) -> bool:
        """Whether orientations are rotations in space."""
        return len(self.turn_axes) == 3

    def reported(self, vector: Vector, unit: str) -> tuple[int, ...]:
        """Return which components of a vector are reported: of what is about a plane's normal that along it, y.

        Angular velocities, torques and angular momenta, as their unit tells, are so also where they are zero.
        """
        is_across = all(is_zero(vector[axis]) for axis in self.reported_axes)
        if self.is_planar and is_across and (unit in _AXIAL_UNITS or not is_zero(vector.y)):
            return (1,)
        return self.reported_axes

    def turn_components(self, vector: Vector) -> tuple[Scalar, ...]:
        """Return the components of a torque or an angular velocity about the axes that frames can turn about."""
        return tuple(vector) if self.is_spatial else (-vector.y,) if self.is_planar else ()

    def vector(self, components: tuple[Scalar, ...]) -> Vector:
        """Return the vector with the given free components."""
        total = Vector(0.0, 0.0, 0.0)
        for component, direction in zip(components, self.basis, strict=True):
            total = total + direction * component
        return total

    def components(self, vector: Vector) -> tuple[Scalar, ...]:
        """Return the free components of a vector."""
        return tuple(dot(vector, direction) for direction in self.basis)


_X, _Y, _Z = FIXED_AXES = Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0)

WHERE = {"line": "on a line", "plane": "in a plane", "space": "in space"}
"""Where a scene is, in words."""


def make_space(name: str, line_axis: tuple[float, float, float]) -> Space:
    """Return the space of a scene from its name and, for a line, its direction."""
    if name == "line":
        line = Vector(*line_axis)
        reported = tuple(i for i in range(3) if line[i] != 0.0)
        return Space("line", (line,), ("s",), reported, line=line)
    if name == "plane":
        return Space("plane", (_X, _Z), ("x", "z"), (0, 2), (Vector(0.0, -1.0, 0.0),), ("",))
    return Space("space", (_X, _Y, _Z), ("x", "y", "z"), (0, 1, 2), FIXED_AXES, (".x", ".y", ".z"))


def planar_axes(angle: Scalar) -> tuple[Vector, Vector, Vector]:
    """Return the axes of a frame turned by an angle, counter-clockwise as seen on the page, that is about -y."""
    c, s = cos(angle), sin(angle)
    return Vector(c, 0.0, s), _Y, Vector(-s, 0.0, c)
