"""What laws return and may read of bodies: inertia, loads, and the placements of joints.

Which parts make a body is known only when all parts have said what they join. So laws are evaluated on symbols first,
which note what is asked for, and then on what the body has.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, Protocol

from atwood.arguments import Kind, Refused, check_fields, each, either, instance, one_of, optional, show, takes_names
from atwood.errors import DeclarationError
from atwood.expr import Graph, Scalar
from atwood.expr.core.functions import SCALAR
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.connectors import Frame, JointCoordinate, Point
from atwood.model.values.rotation import Axes, FreeRotation, Rotation
from atwood.model.values.vector import ZERO, Vector, as_vector

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
