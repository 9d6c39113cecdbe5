"""Laws: what a component contributes to mechanics.

A law is a method of a component, marked by one of the decorators here.  It is written in plain arithmetic with
Atwood's functions, and never sees the graph or the solver.  Newton's equations are nobody's law: they are put
together from inertia, energy, forces and constraints.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from atwood.errors import DeclarationError
from atwood.expr import Scalar
from atwood.model.connectors import Frame, JointCoordinate, Point
from atwood.model.quantities import ObservableLaw
from atwood.model.rotation import FreeRotation, Rotation
from atwood.model.units import parse_si_unit
from atwood.model.vector import ZERO, Vector, as_vector

__all__ = [
    "BodyInertia",
    "Load",
    "Placement",
    "PointInertia",
    "constraint",
    "dissipation",
    "event",
    "force",
    "inertia",
    "joint",
    "observable",
    "potential",
]

Kind = Literal["potential", "dissipation", "force", "inertia", "constraint", "joint", "observable", "event"]
_F = TypeVar("_F", bound=Callable[..., Any])


@dataclass(frozen=True)
class Law:
    """A marked method of a component; `options` is one of the `...Options` below, or None."""

    kind: Kind
    name: str
    options: Any = None

    def holds_in(self, space: str) -> bool:
        """Return whether the law has a meaning in a space."""
        return self.options is None or space in getattr(self.options, "spaces", (space,))

    def acts_in(self, mode: str) -> bool:
        """Return whether the law acts while its component is in a mode."""
        modes = getattr(self.options, "modes", ())
        return not modes or mode in modes


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
                advice="Write it as a @potential of the coordinate and of time, or as a @dissipation of its rate.",
            )
        object.__setattr__(self, "force", as_vector(self.force))
        object.__setattr__(self, "torque", as_vector(self.torque))


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


@dataclass(frozen=True)
class ConstraintOptions:
    """See `constraint`."""

    reactions: tuple[str, ...]
    unit: str
    sign: float
    doc: str
    modes: tuple[str, ...]
    spaces: tuple[str, ...]


@dataclass(frozen=True)
class JointOptions:
    """See `joint`."""

    a: str
    b: str
    coordinates: tuple[str, ...]
    solves: tuple[str, ...]
    spaces: tuple[str, ...]
    rigid: bool
    reaction_doc: str
    modes: tuple[str, ...]


@dataclass(frozen=True)
class ObservableOptions:
    """See `observable`."""

    unit: str
    doc: str
    periodic: bool
    rate: str
    spaces: tuple[str, ...]


@dataclass(frozen=True)
class EventOptions:
    """See `event`."""

    modes: tuple[str, ...]
    direction: int
    target: str
    message: str
    unit: str
    impact: bool
    spaces: tuple[str, ...] = ("line", "plane", "space")


def _mark(function: _F, law: Law) -> _F:
    function._atwood_law = law  # type: ignore[attr-defined]
    return function


def potential(function: _F) -> _F:
    """Mark a method that returns a potential energy, J, from positions, angles and time."""
    return _mark(function, Law("potential", function.__name__))


def dissipation(function: _F) -> _F:
    """Mark a method that returns a Rayleigh function, W: half the dissipated power, from velocities.

    The force on each connector is minus the derivative with respect to its velocity (Goldstein, section 1.5).
    """
    return _mark(function, Law("dissipation", function.__name__))


def force(function: _F) -> _F:
    """Mark a method that returns the loads it puts on its connectors, an iterable of `Load`."""
    return _mark(function, Law("force", function.__name__))


def inertia(function: _F) -> _F:
    """Mark a method that returns an iterable of `PointInertia` and `BodyInertia`; it reads parameters only."""
    return _mark(function, Law("inertia", function.__name__))


def constraint(
    *,
    reaction: str | Sequence[str],
    unit: str = "N",
    doc: str,
    sign: float = 1.0,
    modes: Sequence[str] = (),
    spaces: Sequence[str] = ("line", "plane", "space"),
) -> Callable[[_F], _F]:
    """Mark a method that returns what must stay zero: one scalar, a `Vector`, or a sequence of scalars.

    Parameters
    ----------
    reaction
        Name of the quantity that the multiplier is reported as; one for each scalar (``"force"`` for a vector gives
        ``force.x``, ``force.y``, ``force.z``).
    unit
        Unit of the reaction.
    doc
        One line of what the reaction is, with its sign.
    sign
        The reaction is `sign` times the multiplier. With +1 it is the generalized force along the residual.
    modes
        The modes of the component in which the constraint acts; all when empty.
    spaces
        The spaces in which it acts.
    """
    parse_si_unit(unit)
    names = (reaction,) if isinstance(reaction, str) else tuple(reaction)
    options = ConstraintOptions(names, unit, sign, doc, tuple(modes), tuple(spaces))
    return lambda function: _mark(function, Law("constraint", function.__name__, options))


def joint(
    a: str,
    b: str,
    *,
    coordinates: Sequence[str] = (),
    solves: Sequence[str] = (),
    spaces: Sequence[str] = ("plane",),
    rigid: bool = False,
    reaction: str = "",
    modes: Sequence[str] = (),
) -> Callable[[_F], _F]:
    """Mark a method that returns the `Placement` of connector b seen from connector a, for given joint coordinates.

    A joint is a constraint together with coordinates that solve it.

    Parameters
    ----------
    a, b
        Names of two connectors; ``"world"`` for a joint to the world itself.
    coordinates
        Names of the joint coordinates, which are the arguments of the method, in this order. Each is also an
        observable of the component.
    solves
        Names of the constraints that hold whatever the coordinates are.
    spaces
        The spaces in which this description holds.
    rigid
        Whether a and b belong to one body; then there are no coordinates and no constraint.
    reaction
        For a rigid joint: one line of what its force and torque are reported as; empty to report none.
    modes
        The modes of the component in which it holds; all when empty.
    """
    options = JointOptions(a, b, tuple(coordinates), tuple(solves), tuple(spaces), rigid, reaction, tuple(modes))
    return lambda function: _mark(function, Law("joint", function.__name__, options))


def observable(
    *,
    unit: str,
    doc: str,
    periodic: bool = False,
    rate: str = "",
    spaces: Sequence[str] = ("line", "plane", "space"),
) -> Callable[[_F], _F]:
    """Mark a method that returns a quantity to report: a scalar or a `Vector`.

    Parameters
    ----------
    unit
        SI unit.
    doc
        One line of meaning.
    periodic
        Whether it is an angle that comes out within one turn; it is then unwrapped along a run.
    rate
        Name of the observable that is its rate, by which the turns of a periodic one are counted.
    spaces
        The spaces in which it has a meaning.
    """
    parse_si_unit(unit)
    if not doc.strip():
        raise DeclarationError("an observable needs one line of meaning", advice="Give doc='...'.")

    def decorate(function: _F) -> _F:
        name = function.__name__

        @functools.wraps(function)
        def read(self: Any) -> Any:
            known = self._known_observable(name)
            return function(self) if known is None else known

        law = Law("observable", name, ObservableOptions(unit, doc, periodic, rate, tuple(spaces)))
        return ObservableLaw(read, law)  # type: ignore[return-value]

    return decorate


def event(
    *,
    target: str,
    message: str,
    unit: str = "1",
    modes: Sequence[str] = (),
    direction: int = 0,
    impact: bool = False,
    spaces: Sequence[str] = ("line", "plane", "space"),
) -> Callable[[_F], _F]:
    """Mark a method whose zero crossing changes the mode of the component or ends the run.

    Parameters
    ----------
    target
        The mode to go to, ``"stop"``, or the name of a choice parameter that says which of these.
    message
        What has happened, in words.
    unit
        SI unit of the value, which says what is small.
    modes
        The modes in which it is watched; all when empty.
    direction
        +1 to see crossings upwards only, -1 downwards only, 0 both.
    impact
        Whether velocities jump: they are made consistent with the new mode by a plastic impact.
    spaces
        The spaces in which it is watched.
    """
    options = EventOptions(tuple(modes), direction, target, message, unit, impact, tuple(spaces))
    return lambda function: _mark(function, Law("event", function.__name__, options))


def scalars(value: Any) -> list[Scalar]:
    """Return what a law gave as a list of scalars."""
    if isinstance(value, Vector):
        return list(value)
    if isinstance(value, Iterable):
        return list(value)
    return [value]
