"""Results of laws: inertia, loads and placements of joints, and how they are read, or refused in words.

Which parts make a body is known only when all parts have said what they join. So laws are evaluated on symbols first,
which note what is asked for, and then on what the body has.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Literal, Protocol

from atwood.arguments import Kind, Refused, check_fields, each, either, instance, one_of, optional, show, takes_names
from atwood.errors import AtwoodError, DeclarationError, is_about, suggestion
from atwood.expr import Expression, Graph, Scalar
from atwood.expr.core.functions import SCALAR
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.connectors import Frame, JointCoordinate, Point
from atwood.model.declare.laws import Law
from atwood.model.values.rotation import Axes, FreeRotation, Rotation
from atwood.model.values.space import ZERO, Vector, as_vector

_POINT = instance("a connector that is a point or a frame, such as self.a", Point)
_FRAME = instance("a connector that is a frame, such as self.frame", Frame)
_COORDINATE = instance("a connector that takes hold of a joint, such as self.shaft", JointCoordinate)
_MATRIX = each(each(SCALAR, "numbers or expressions"), "rows of numbers or expressions")
_ROTATION = optional(either(instance("a Rotation or FREE", Rotation, FreeRotation), SCALAR))


def _tensor(value: Any) -> Any:
    rows = _MATRIX.read(value)
    if [len(row) for row in rows] != [3, 3, 3]:
        raise Refused
    return rows


_TENSOR = Kind("three rows of three numbers or expressions", _tensor)


def _vector(value: object, name: str) -> Vector:
    """Return a field as a vector, or refuse it by its name."""
    try:
        return as_vector(getattr(value, name))
    except DeclarationError as error:
        raise DeclarationError(f"{name}: {error.message}", where=type(value).__name__, advice=error.advice) from None


@takes_names
@dataclass(frozen=True)
class PointInertia:
    """Kinetic energy ``1/2 sum_ij m_ij v_i . v_j`` of material points.

    Attributes
    ----------
    points
        Where the velocities are taken.
    masses
        The symmetric mass matrix m_ij, kg, row by row.
    """

    points: Sequence[Point]
    masses: Sequence[Sequence[Scalar]]

    def __post_init__(self) -> None:
        check_fields(
            self, DeclarationError, points=each(_POINT, "points in brackets, such as (self.a,)", 1), masses=_MATRIX
        )
        if any(len(row) != len(self.points) for row in (self.masses, *self.masses)):
            raise DeclarationError(
                f"masses cannot be {show(self.masses)} for {len(self.points)} points",
                where="PointInertia",
                advice="Give a square matrix with a row for each point.",
            )


@takes_names
@dataclass(frozen=True)
class BodyInertia:
    """Inertia of a rigid body.

    Attributes
    ----------
    frame
        The frame it is fixed in.
    mass
        Mass, kg.
    center_of_mass
        Position of the centre of mass in the axes of the frame, m.
    moment
        Moment of inertia about the axis through the centre of mass, normal to the plane, kg m^2; in space not read.
    tensor
        Inertia tensor about the centre of mass in the axes of the frame, row by row, kg m^2; needed in space.
    """

    frame: Frame
    mass: Scalar
    center_of_mass: Vector
    moment: Scalar
    tensor: Sequence[Sequence[Scalar]] | None = None

    def __post_init__(self) -> None:
        check_fields(self, DeclarationError, frame=_FRAME, mass=SCALAR, moment=SCALAR, tensor=optional(_TENSOR))
        object.__setattr__(self, "center_of_mass", _vector(self, "center_of_mass"))


@takes_names
@dataclass(frozen=True)
class Load:
    """A force and a torque on whatever is connected at a connector, in world axes.

    Attributes
    ----------
    at
        Where they act.
    force
        N.
    torque
        N m; only at a frame.
    """

    at: Point
    force: Vector = ZERO
    torque: Vector = ZERO

    def __post_init__(self) -> None:
        if isinstance(self.at, JointCoordinate):
            raise DeclarationError(
                "a load acts on a point or a frame, and not on a joint's coordinate",
                advice="Write it as a CoordinateLoad.",
            )
        check_fields(self, DeclarationError, at=_POINT)
        object.__setattr__(self, "force", _vector(self, "force"))
        object.__setattr__(self, "torque", _vector(self, "torque"))

    @property
    def components(self) -> tuple[Scalar, ...]:
        """The components of force and torque."""
        return (*self.force, *self.torque)


@takes_names
@dataclass(frozen=True)
class CoordinateLoad:
    """A force along the coordinate of a joint, or a torque about its axis, on whatever the joint is between.

    Attributes
    ----------
    at
        The connector that takes hold of the joint.
    value
        N along a displacement, N m about an angle; positive makes the coordinate grow.
    """

    at: JointCoordinate
    value: Scalar

    def __post_init__(self) -> None:
        check_fields(self, DeclarationError, at=_COORDINATE, value=SCALAR)

    @property
    def force(self) -> Vector:
        """The force on a point: none."""
        return ZERO

    @property
    def torque(self) -> Vector:
        """The torque on a frame: none."""
        return ZERO


@takes_names
@dataclass(frozen=True)
class Placement:
    """Where connector b of a joint is, seen from connector a.

    Attributes
    ----------
    displacement
        Position of b minus position of a, m.
    rotation
        Rotation of frame b from frame a: an angle in the plane, counter-clockwise, rad, which in space is one about
        -y; in space also a `Rotation`, or `FREE` where every rotation is free. None for a joint between points.
    axes
        ``"a"`` if the displacement is given in the axes of frame a, ``"world"`` if in world axes.
    """

    displacement: Vector
    rotation: Scalar | Rotation | FreeRotation = None
    axes: Literal["a", "world"] = "world"

    def __post_init__(self) -> None:
        object.__setattr__(self, "displacement", _vector(self, "displacement"))
        check_fields(self, DeclarationError, axes=one_of(("a", "world")), rotation=_ROTATION)


class Carried(Protocol):
    """Mass, centre of mass and inertia tensor of a body, in the axes of one of its frames."""

    @property
    def mass(self) -> Scalar:
        """Mass, kg."""

    @property
    def is_light(self) -> bool:
        """Whether it moves and has no mass."""

    @property
    def center_of_mass(self) -> Vector:
        """Centre of mass, m."""

    @property
    def inertia(self) -> Axes:
        """Inertia tensor about the centre of mass, kg m^2."""


class Asked:
    """Stands for the inertia of a body that is not known yet, and notes whether somebody asks for it.

    Parameters
    ----------
    graph
        Where its symbols live.
    path
        Path of the connector.
    """

    def __init__(self, graph: Graph, path: str) -> None:
        self._graph, self._path = graph, path
        self.is_read = False

    @property
    def mass(self) -> Any:
        """A symbol for the mass."""
        return self._symbol("mass")

    @property
    def is_light(self) -> bool:
        """Whether it has no mass, which is taken not to be so as long as it is not known."""
        self.is_read = True
        return False

    @property
    def center_of_mass(self) -> Vector:
        """Symbols for the centre of mass."""
        return Vector(*(self._symbol(f"center.{axis}") for axis in "xyz"))

    @property
    def inertia(self) -> Axes:
        """Symbols for the inertia tensor."""
        x, y, z = (Vector(*(self._symbol(f"inertia.{row}{column}") for column in "xyz")) for row in "xyz")
        return x, y, z

    def _symbol(self, name: str) -> Scalar:
        self.is_read = True
        return self._graph.parameter(f"{self._path} {name} of body")


def law_value(bound: Any, name: str) -> Any:
    """Return what a law of a bound component gives that is called with nothing; a state is read, and not called."""
    found = getattr(bound, name)
    return found() if callable(found) else found


def call_law(path: str, law: Law, function: Callable[[], Any]) -> Any:
    """Return what a function gives that evaluates a law; whatever it raises says the part and the law."""
    try:
        return function()
    except AtwoodError as error:
        if is_about(error, path):
            raise
        raise type(error)(error.message, where=f"{path}.{law.name}", advice=error.advice) from error
    except Exception as error:  # whatever a law of somebody's own can raise
        raise not_evaluated(path, law, error) from error


def not_evaluated(path: str, law: Law, error: Exception) -> DeclarationError:
    """Return the error that says that a law of a part raises something."""
    return DeclarationError(
        f"the law cannot be evaluated ({type(error).__name__}: {error})",
        where=f"{path}.{law.name}",
        advice=_what_to_write(error),
    )


def _what_to_write(error: Exception) -> str:
    """Return the advice for a law that raises something."""
    plain = "A law is plain arithmetic with Atwood's functions, on self's parameters and connectors."
    if not isinstance(error, AttributeError) or not isinstance(error.name, str) or error.obj is None:
        return plain
    if isinstance(error.obj, Point) and not isinstance(error.obj, Frame) and hasattr(Frame, error.name):
        return "A Point has a position and no orientation: declare the connector as a Frame."
    return suggestion(error.name, [name for name in dir(error.obj) if not name.startswith("_")]) or plain


def one_scalar(graph: Graph, value: Any) -> Expression:
    """Return the one number that a law gives, as an expression."""
    if value is None:
        raise DeclarationError("it returns nothing", advice="End it with return and a number.")
    if isinstance(value, Vector):
        raise DeclarationError(
            "it returns a Vector where one number is wanted",
            advice="Return a component, or atwood.dot or atwood.norm of it.",
        )
    try:
        return graph.convert(value)
    except (TypeError, ValueError):
        raise DeclarationError(f"it returns {_in_words(value)} where a number is wanted") from None


def finite_scalar(graph: Graph, value: Any) -> Expression:
    """Return the one number that a law gives, as an expression; refuse what is never finite, as `one_scalar` does."""
    found = one_scalar(graph, value)
    if found.is_constant and not math.isfinite(found.value):
        raise DeclarationError(f"it returns {found.value:g}", advice="Return a number, or an expression that has one.")
    return found


def listed(value: Any, kinds: tuple[type, ...]) -> list[Any]:
    """Return what a law gives as a list of loads, or of inertias."""
    wanted = " or ".join(kind.__name__ for kind in kinds)
    advice = f"Yield each {wanted}, or return a list of them, which may be empty."
    if value is None:
        raise DeclarationError("it returns nothing", advice=advice)
    if isinstance(value, kinds):
        raise DeclarationError(f"it returns one {type(value).__name__} and no list", advice=advice)
    if isinstance(value, (Vector, str)) or not isinstance(value, Iterable):
        raise DeclarationError(f"it returns {_in_words(value)}", advice=advice)
    found = list(value)
    for one in found:
        if not isinstance(one, kinds):
            raise DeclarationError(f"it gives {_in_words(one)} where a {wanted} is wanted", advice=advice)
    return found


def _in_words(value: Any) -> str:
    kind = type(value).__name__
    return f"a {kind}" if isinstance(value, (Vector, Load, Placement, PointInertia)) else f"{value!r} of type {kind}"
