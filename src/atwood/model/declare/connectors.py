"""What a component is known by from outside: connectors, where parts meet, and its quantities, by name.

Connecting makes the across quantities (position, orientation) equal and the through quantities (force, torque) sum
to zero.  Through quantities are positive *into* the component.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, TypeVar

from atwood.arguments import ANYTHING, BY_PATH, DOC, NAME, TEXT, Kind, Refused, each, optional, takes
from atwood.errors import DeclarationError, UsageError
from atwood.expr import Scalar
from atwood.lazy_dataclasses import dataclass
from atwood.model.values.letters import OWN_LETTERS
from atwood.model.values.space import Vector, dot

if TYPE_CHECKING:
    import typing_extensions

    from atwood.model.declare.component import Component
    from atwood.model.declare.law_results import Carried

    Reading = typing_extensions.TypeVar("Reading", default=Any)
else:
    Reading = TypeVar("Reading")


@dataclass(frozen=True)
class Motion:
    """What a connector knows while a law is evaluated; what the law may not read is None.

    Attributes
    ----------
    position, velocity, acceleration
        Of the connector, in world axes.
    axes
        The frame's x, y and z axes, in world axes.
    angle
        Rotation of the frame in the plane, counter-clockwise as seen on the page, rad.
    angular_velocity, angular_acceleration
        Of the frame, in world axes.
    spin
        Angular velocity along the frame's own axes, in space; None where it follows from the two above.
    value, rate
        Of a joint's coordinate, for a `Shaft` or a `Slide`.
    second_rate
        Gives its second rate, which is derived when it is asked for.
    body
        Inertia of the body that the connector is on.
    """

    position: Vector | None = None
    velocity: Vector | None = None
    acceleration: Vector | None = None
    axes: tuple[Vector, Vector, Vector] | None = None
    angle: Scalar = None
    angular_velocity: Vector | None = None
    angular_acceleration: Vector | None = None
    spin: Vector | None = None
    value: Scalar = None
    rate: Scalar = None
    second_rate: Callable[[], Scalar] | None = None
    body: Carried | None = None


class _Named:
    """Something of a component that has a name there, and so a path in its scene."""

    __slots__ = ("component", "name")

    def __init__(self, component: Component, name: str) -> None:
        self.component, self.name = component, name

    @property
    def path(self) -> str:
        """Its dotted path."""
        prefix = self.component.path
        return f"{prefix}.{self.name}" if prefix else self.name


class Quantity(_Named, Generic[Reading]):
    """A quantity of a component: a name to read it by, ``result[scene["bob2"].position.x]``.

    Parameters
    ----------
    component
        The component.
    name
        Name of the quantity there, such as ``position`` or ``position.x``.
    unit, doc
        Unit and meaning.
    """

    __slots__ = ("doc", "unit")

    def __init__(self, component: Component, name: str, unit: str, doc: str) -> None:
        super().__init__(component, name)
        self.unit, self.doc = unit, doc

    def __str__(self) -> str:
        return self.path

    def __repr__(self) -> str:
        return f"<{self.path} [{self.unit}]: {self.doc}>"

    def __call__(self, *_: Any) -> Reading:
        """Refuse: outside a law a quantity has a name and no value."""
        raise UsageError(
            "it has a value only inside a law", where=self.path, advice=f"After a run, read result[{self.path!r}]."
        )

    @property
    def x(self) -> Quantity:
        """The component along x of a vector."""
        return Quantity(self.component, f"{self.name}.x", self.unit, self.doc)

    @property
    def y(self) -> Quantity:
        """The component along y of a vector."""
        return Quantity(self.component, f"{self.name}.y", self.unit, self.doc)

    @property
    def z(self) -> Quantity:
        """The component along z of a vector."""
        return Quantity(self.component, f"{self.name}.z", self.unit, self.doc)


class Connector(_Named):
    """Base of all connectors.

    Parameters
    ----------
    component
        The component that it belongs to.
    name
        Its name there.
    motion
        The quantities a law sees; None outside a law.
    """

    across: ClassVar[Mapping[str, str]] = {}
    """Quantities that become equal where connectors meet, with their units."""
    through: ClassVar[Mapping[str, str]] = {}
    """Quantities that sum to zero where connectors meet, positive into the component, with their units."""
    family: ClassVar[str] = ""
    """Connectors of one family can meet."""

    __slots__ = ("motion",)

    def __init__(self, component: Component, name: str, motion: Motion | None = None) -> None:
        super().__init__(component, name)
        self.motion = motion

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.path}>"

    def _read(self, quantity: str) -> Any:
        if self.motion is None:
            raise UsageError(
                f"its {quantity} has a value only inside a law",
                where=self.path,
                advice="After a run, read the quantity from the result.",
            )
        value = getattr(self.motion, quantity)
        if value is None:
            raise DeclarationError(f"this law may not read its {quantity}", where=self.path)
        return value


class Point(Connector):
    """A point where forces pass and no torque does: end of a rod, of a spring, of a rope; a mass point."""

    across: ClassVar[Mapping[str, str]] = {"position": "m"}
    through: ClassVar[Mapping[str, str]] = {"force": "N"}
    family: ClassVar[str] = "mechanical"
    __slots__ = ()

    @property
    def position(self) -> Vector:
        """Position in world axes, m."""
        value: Vector = self._read("position")
        return value

    @property
    def velocity(self) -> Vector:
        """Velocity in world axes, m/s."""
        value: Vector = self._read("velocity")
        return value

    @property
    def acceleration(self) -> Vector:
        """Acceleration in world axes, m/s^2; only observables may read it."""
        value: Vector = self._read("acceleration")
        return value

    @property
    def mass(self) -> Scalar:
        """Mass of the body that it is on, kg: of all parts that are rigidly joined there."""
        return self._read("body").mass

    @property
    def is_light(self) -> bool:
        """Whether it is on something that moves and has no mass."""
        return bool(self._read("body").is_light)


class Frame(Point):
    """A point with an orientation, where forces and torques pass.

    Joined to a plain point it shares the position only: a hinge without friction.
    """

    across: ClassVar[Mapping[str, str]] = {"position": "m", "orientation": "1"}
    through: ClassVar[Mapping[str, str]] = {"force": "N", "torque": "N*m"}
    __slots__ = ()

    @property
    def angle(self) -> Scalar:
        """Rotation in the plane, counter-clockwise as seen on the page, rad."""
        return self._read("angle")

    @property
    def angular_velocity(self) -> Vector:
        """Angular velocity in world axes, rad/s."""
        value: Vector = self._read("angular_velocity")
        return value

    @property
    def angular_acceleration(self) -> Vector:
        """Angular acceleration in world axes, rad/s^2; only observables may read it."""
        value: Vector = self._read("angular_acceleration")
        return value

    @property
    def spin(self) -> Vector:
        """Angular velocity along the frame's own axes, rad/s."""
        if self.motion is not None and self.motion.spin is not None:
            return self.motion.spin
        return self.to_frame(self.angular_velocity)

    @property
    def axes(self) -> tuple[Vector, Vector, Vector]:
        """Its x, y and z axes, in world axes."""
        value: tuple[Vector, Vector, Vector] = self._read("axes")
        return value

    @property
    def center_of_mass(self) -> Vector:
        """Centre of mass of the body that it is on, in the axes of this frame, m."""
        value: Vector = self._read("body").center_of_mass
        return value

    @property
    def inertia(self) -> tuple[Vector, Vector, Vector]:
        """Inertia tensor of the body that it is on, about its centre of mass, in the axes of this frame, kg m^2."""
        value: tuple[Vector, Vector, Vector] = self._read("body").inertia
        return value

    def to_frame(self, vector: Vector) -> Vector:
        """Return, in the axes of this frame, a vector that is given in world axes."""
        return Vector(*(dot(axis, vector) for axis in self.axes))

    def to_world(self, vector: Vector) -> Vector:
        """Return, in world axes, a vector that is given in the axes of this frame."""
        x_axis, y_axis, z_axis = self.axes
        world: Vector = x_axis * vector.x + y_axis * vector.y + z_axis * vector.z
        return world


class Groove(Point):
    """The groove of a pulley, which takes a rope; its position is the centre of the pulley."""

    family: ClassVar[str] = "groove"
    __slots__ = ()


class JointCoordinate(Connector):
    """The coordinate of a joint, where gears take hold of it: a `Shaft` turns, a `Slide` moves along.

    Joints offer them, and other parts are connected to them, each to one joint's.
    """

    __slots__ = ()

    @property
    def value(self) -> Scalar:
        """The coordinate; an angle counts its turns."""
        return self._read("value")

    @property
    def rate(self) -> Scalar:
        """The rate of the coordinate."""
        return self._read("rate")

    @property
    def acceleration(self) -> Scalar:
        """The second rate of the coordinate; only observables may read it."""
        return self._read("second_rate")()


class Shaft(JointCoordinate):
    """The angle of frame b of a joint from frame a, and the torque about it."""

    across: ClassVar[Mapping[str, str]] = {"value": "rad"}
    through: ClassVar[Mapping[str, str]] = {"torque": "N*m"}
    family: ClassVar[str] = "shaft"
    __slots__ = ()


class Slide(JointCoordinate):
    """The displacement of frame b of a joint from frame a, and the force along it."""

    across: ClassVar[Mapping[str, str]] = {"value": "m"}
    through: ClassVar[Mapping[str, str]] = {"force": "N"}
    family: ClassVar[str] = "slide"
    __slots__ = ()


class ConnectorSpec:
    """The declaration of a connector in a class body; see `connector`."""

    def __init__(
        self,
        kind: type[Connector],
        doc: str,
        count: str | None,
        when: Mapping[str, Sequence[str]] | None = None,
        of: str = "",
        symbol: Sequence[str] = (),
    ) -> None:
        self.kind = kind
        self.doc = doc
        self.symbol = tuple(symbol)
        self.count = count
        self.of = of
        self.when = dict(when or {})
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = self.name or name

    def __get__(self, instance: Component | None, owner: type) -> Any:
        return self if instance is None else instance._connector(self)

    def names(self, component: Component) -> tuple[str, ...]:
        """Return the names of the connectors it declares on a component: one, none, or an array of them."""
        count = self._size(component)
        return (self.name,) if count is None else tuple(f"{self.name}[{i}]" for i in range(count))

    def has(self, component: Component, name: str) -> bool:
        """Return whether a name is one of `names`."""
        count, index = self._size(component), name[len(self.name) + 1 : -1]
        if count is None:
            return name == self.name
        is_number = index.isdecimal() and len(index) <= len(str(count)) and int(index) < count
        return is_number and name == f"{self.name}[{int(index)}]"

    def _size(self, component: Component) -> int | None:
        """Return how many there are on a component; None for one that is no array."""
        if self.when and not any(component._value(choice) in words for choice, words in self.when.items()):
            return 0
        if self.count is None:
            return None
        count = component._value(self.count)
        if not isinstance(count, int):
            raise DeclarationError(
                f"how many connectors {self.name!r} has is not known here, since {self.count!r} is {count!r}",
                where=component.path or type(component).__name__,
                advice="Connect them in a method build(self), where the parameters have their values.",
            )
        return count

    def absent(self, component: Component) -> DeclarationError:
        """Return the error that says that a component, as it is set, does not have this connector."""
        asked = " or ".join(f"{choice}={word!r}" for choice, words in self.when.items() for word in words)
        return DeclarationError(
            f"it has no connector {self.name!r} as it is set",
            where=component.path or type(component).__name__,
            advice=f"It has one with {asked}.",
        )


def _connector_class(value: Any) -> Any:
    if not (isinstance(value, type) and issubclass(value, Connector) and value is not Connector):
        raise Refused
    return value


_C = TypeVar("_C", bound=Connector)


@takes(
    DeclarationError,
    kind=Kind("one of Point, Frame, Groove, Shaft and Slide, or a class derived from one", _connector_class),
    doc=DOC,
    count=optional(NAME),
    when=optional(BY_PATH),
    of=TEXT,
    symbol=OWN_LETTERS,
    init=ANYTHING,
)
def connector(
    kind: type[_C],
    doc: str,
    *,
    count: str | None = None,
    when: Mapping[str, Sequence[str]] | None = None,
    of: str = "",
    symbol: str | Sequence[str] = (),
    init: Literal[False] = False,
) -> Any:
    """Declare a connector in the class body of a component.

    Parameters
    ----------
    kind
        `Point`, `Frame`, `Groove`, `Shaft` or `Slide`.
    doc
        One line that says where it is.
    count
        Name of the integer parameter that says how many there are; then it is a tuple of connectors.
    when
        For a connector that is there only if asked for: names of choice parameters, each with the values that ask.
    of
        For a `Shaft` or a `Slide` that a joint offers: name of the joint coordinate that it is.
    symbol
        The letter in formulas of its position, or of the joint coordinate that it is; one for each component, or one
        for all.
    """
    return ConnectorSpec(kind, doc, count, when, of, tuple(symbol))


@dataclass(frozen=True)
class InputRef:
    """An input of a component, as one end of a signal connection."""

    component: Component
    name: str


@dataclass(frozen=True)
class OutputRef:
    """A scalar observable of a component, as the other end of a signal connection."""

    component: Component
    name: str


def _path(value: Any) -> str:
    if not isinstance(value, (str, Quantity)) or not str(value).strip():
        raise Refused
    return str(value)


PATH = Kind("the path of a quantity, such as 'rod.angle'", _path, "PATH")


PATHS = optional(each(PATH, "the paths of quantities, such as ['rod.angle']"))
