"""Three-vectors whose components are numbers, expressions or sympy terms.

Laws are written on these, so one law serves a line, a plane and space: what is constant in the declared space
is a plain zero, and folds away.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from atwood.arguments import show
from atwood.errors import DeclarationError
from atwood.expr import Expression, Scalar, sqrt
from atwood.expr.core.functions import is_scalar


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
        for name, one in (("x", x), ("y", y), ("z", z)):
            if type(one) not in _PLAIN and not is_scalar(one):
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
