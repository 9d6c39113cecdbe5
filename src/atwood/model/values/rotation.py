"""Rotations in space as a sequence of turns about fixed axes.

A joint says how frame b is turned against frame a as one turn after another, each about an axis that is fixed in the
frame that the turns before it have made. Axes, angular velocities and accelerations then follow by one short rule a
turn, with nothing to simplify afterwards.
"""

from __future__ import annotations

from typing import TypeAlias

from atwood.arguments import check, check_fields, each, instance, show
from atwood.errors import DeclarationError, UsageError
from atwood.expr import Expression, Scalar, cos, sin
from atwood.expr.core.functions import SCALAR
from atwood.lazy_dataclasses import dataclass
from atwood.model.values.space import Vector, as_vector, cross

Axes: TypeAlias = tuple[Vector, Vector, Vector]
"""The x, y and z axes of a frame, in the axes of another one: the columns of a rotation matrix."""

IDENTITY: Axes = (Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Turn:
    """A right-handed turn about an axis.

    Attributes
    ----------
    axis
        Unit vector; the same in the frame before and after the turn.
    angle
        rad.
    """

    axis: Vector
    angle: Scalar

    def axes(self) -> Axes:
        """Return the axes of the turned frame in the frame before: Rodrigues' formula (Goldstein, section 4.7)."""
        c, s = cos(self.angle), sin(self.angle)
        n = [_number(component) for component in self.axis]
        axis = self.axis if None in n else Vector(*n)
        normal = (
            Vector(0.0, -axis.z, axis.y),
            Vector(axis.z, 0.0, -axis.x),
            Vector(-axis.y, axis.x, 0.0),
        )  # normal[i][j] = -epsilon_ijk n_k
        rows = []
        for i in range(3):
            row = []
            for j in range(3):
                along = axis[i] * axis[j]
                across = (1.0 if i == j else 0.0) - along
                row.append(_sum(along, _times(across, c), _times(normal[i][j], s)))
            rows.append(row)
        return (
            Vector(rows[0][0], rows[1][0], rows[2][0]),
            Vector(rows[0][1], rows[1][1], rows[2][1]),
            Vector(rows[0][2], rows[1][2], rows[2][2]),
        )

    def reversed(self) -> Turn:
        """Return the turn that undoes this one."""
        return Turn(self.axis, -self.angle)


_TURNS = each(instance("a turn", Turn), "turns, as turn() makes them")


@dataclass(frozen=True)
class Rotation:
    """One turn after another, each about an axis of the frame that those before it have made.

    Attributes
    ----------
    turns
        The turns; none for no rotation.
    """

    turns: tuple[Turn, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self, DeclarationError, turns=_TURNS)

    def then(self, axis: Vector | tuple[Scalar, Scalar, Scalar], angle: Scalar) -> Rotation:
        """Return this rotation followed by a turn about an axis of the turned frame."""
        return Rotation((*self.turns, Turn(as_vector(axis), check(SCALAR, angle, "angle", "turn", DeclarationError))))

    def inverse(self) -> Rotation:
        """Return the rotation that undoes this one."""
        return Rotation(tuple(one.reversed() for one in reversed(self.turns)))

    def axes(self) -> Axes:
        """Return the axes of the turned frame in the frame before."""
        found = IDENTITY
        for one in self.turns:
            found = compose(found, one.axes())
        return found


class FreeRotation:
    """Says that a joint leaves every rotation free, as a ball and socket does."""

    def __repr__(self) -> str:
        return "FREE"


FREE = FreeRotation()
"""Rotation of a joint that leaves all rotations free."""


def turn(axis: Vector | tuple[Scalar, Scalar, Scalar], angle: Scalar) -> Rotation:
    """Return the rotation by one right-handed turn about an axis.

    Parameters
    ----------
    axis
        Unit vector.
    angle
        rad.
    """
    try:
        vector = as_vector(axis)
    except DeclarationError as error:
        raise DeclarationError(f"axis: {error.message}", where="turn", advice=error.advice) from None
    return Rotation().then(vector, angle)


def as_rotation(value: Scalar | Rotation | None) -> Rotation:
    """Return a rotation in space; a plain angle is one in the x-z plane, counter-clockwise there, that is about -y."""
    if isinstance(value, Rotation):
        return value
    if value is None or isinstance(value, FreeRotation):
        raise UsageError("this joint does not say how it turns")
    if _number(value) == 0.0:
        return Rotation()
    return turn((0.0, -1.0, 0.0), value)


def compose(outer: Axes, inner: Axes) -> Axes:
    """Return the axes of a frame from those of a frame between: the product of the two matrices."""
    if outer is IDENTITY or inner is IDENTITY:
        return inner if outer is IDENTITY else outer
    return from_axes(outer, inner[0]), from_axes(outer, inner[1]), from_axes(outer, inner[2])


def transposed(axes: Axes) -> Axes:
    """Return the inverse of a rotation matrix."""
    if axes is IDENTITY:
        return axes
    x, y, z = axes
    return Vector(x.x, y.x, z.x), Vector(x.y, y.y, z.y), Vector(x.z, y.z, z.z)


def from_axes(axes: Axes, vector: Vector) -> Vector:
    """Return a vector, given by its components along some axes, in the frame that these axes are given in."""
    if axes is IDENTITY:
        return vector
    components = []
    for i in range(3):
        terms = [_times(vector[j], axes[j][i]) for j in range(3)]
        components.append(_sum(*terms))
    return Vector(*components)


def to_axes(axes: Axes, vector: Vector) -> Vector:
    """Return the components of a vector along some axes."""
    if axes is IDENTITY:
        return vector
    return Vector(*(_sum(*(_times(axis[i], vector[i]) for i in range(3))) for axis in axes))


def spin_through(turn_: Turn, rate: Scalar, spin: Vector) -> Vector:
    """Return the angular velocity behind a turn, in the axes there."""
    found: Vector = to_axes(turn_.axes(), spin) + turn_.axis * rate
    return found


def spin_rate_through(turn_: Turn, rate: Scalar, second: Scalar, spin: Vector, spin_rate: Vector) -> Vector:
    """Return the angular acceleration behind a turn, in the axes there.

    With T the turn and n its axis: ``T^T alpha + n theta'' + (T^T omega) x n theta'``.
    """
    axes = turn_.axes()
    found: Vector = to_axes(axes, spin_rate) + turn_.axis * second + cross(to_axes(axes, spin), turn_.axis * rate)
    return found


def _number(value: Scalar) -> float | None:
    if isinstance(value, Expression):
        return value.payload if value.operation == "constant" else None
    return float(value) if isinstance(value, (int, float)) else None


def _times(a: Scalar, b: Scalar) -> Scalar:
    """Return a product; what is exactly zero or one leaves no operation, whatever the other factor is."""
    for one, other in ((a, b), (b, a)):
        number = _number(one)
        if number == 0.0:
            return 0.0
        if number == 1.0:
            return other
        if number == -1.0:
            return -other
    return a * b


def _sum(*terms: Scalar) -> Scalar:
    total: Scalar = 0.0
    for term in terms:
        number = _number(term)
        if number == 0.0:
            continue
        total = term if _number(total) == 0.0 else total + term
    return total


def normals(axis: Vector) -> tuple[Vector, Vector]:
    """Return two unit vectors n1 and n2 such that n1, n2 and a unit axis are right-handed.

    For an axis along x, y or z they are along the next two; else n1 is square to the axis of the frame that the axis is
    farthest from.
    """
    if not isinstance(axis, Vector):
        raise UsageError(f"axis cannot be {show(axis)}", where="normals", advice="Give a Vector.")
    numbers = [_number(component) for component in axis]
    if not any(numbers):
        raise UsageError(f"axis cannot be {show(axis)}, which has no direction", advice="Give one that is not zero.")
    if None in numbers:
        raise UsageError("the direction of this axis must be known", advice="Declare it as a direction.")
    sizes = [abs(number or 0.0) for number in numbers]
    along = sizes.index(max(sizes))
    helper = IDENTITY[(along + 1) % 3]
    unit = Vector(*(number or 0.0 for number in numbers))
    raw = helper - unit * (unit.x * helper.x + unit.y * helper.y + unit.z * helper.z)
    size = float(raw.x**2 + raw.y**2 + raw.z**2) ** 0.5
    first = raw / size
    return first, cross(unit, first)
