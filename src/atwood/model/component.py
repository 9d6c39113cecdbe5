"""The base of every part: parameters, connectors, signals and laws, declared in a class body like a dataclass."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self, dataclass_transform

from atwood.errors import DeclarationError, ParameterError, UsageError, suggestion
from atwood.expr import Scalar
from atwood.model.connectors import Connector, ConnectorSpec, InputRef, Motion, OutputRef, connector
from atwood.model.fields import MISSING, Deferred, ParameterSpec, SignalSpec, parameter, signal
from atwood.model.laws import Kind, Law
from atwood.model.vector import Vector, dot, norm

__all__ = ["Binding", "Component", "bind"]


@dataclass(frozen=True)
class Binding:
    """What the laws of a component are evaluated on: floats, expressions or sympy terms.

    Attributes
    ----------
    values
        Parameters and signals by name.
    motions
        What each connector knows, by name.
    time
        The time.
    space
        ``"line"``, ``"plane"`` or ``"space"``.
    line
        Unit vector of the line, for a scene on a line.
    sides
        On a line: +1 or -1 for a pair of connector names, the sign of the second's position minus the first's.
    known
        Observables that are known without their formula, such as a joint coordinate.
    reactions
        Reactions by name.
    energies
        ``"kinetic"`` and ``"potential"`` energy of the model that the component is placed in.
    """

    values: Mapping[str, Any]
    motions: Mapping[str, Motion] = field(default_factory=dict)
    time: Scalar = 0.0
    space: str = "plane"
    line: Vector | None = None
    sides: Mapping[tuple[str, str], float] = field(default_factory=dict)
    known: Mapping[str, Any] = field(default_factory=dict)
    reactions: Mapping[str, Any] = field(default_factory=dict)
    energies: Mapping[str, Any] = field(default_factory=dict)


@dataclass_transform(kw_only_default=True, field_specifiers=(parameter, signal, connector))
class Component:
    """A part: it has parameters, connectors and laws, and sees neither the graph nor the solver.

    Subclasses declare their fields in the class body with `parameter`, `connector` and `signal`, and their laws as
    methods marked with `inertia`, `potential`, `dissipation`, `force`, `constraint`, `joint`, `observable` and
    `event`. Within a law, ``self.stiffness`` is the parameter, ``self.a.position`` what the connector knows,
    ``self.time`` the time.

    Parameters
    ----------
    **values
        Parameters and signals by name.

    Raises
    ------
    ParameterError
        If a name is unknown, a required parameter is missing, or a value is not admissible.
    """

    modes: ClassVar[tuple[str, ...]] = ()
    """Modes of the component, the usual one first; empty if it has just one."""

    _parameters: ClassVar[dict[str, ParameterSpec]] = {}
    _signals: ClassVar[dict[str, SignalSpec]] = {}
    _connectors: ClassVar[dict[str, ConnectorSpec]] = {}
    _laws: ClassVar[dict[str, Law]] = {}

    _parent: Component | None
    _name: str
    _settings: dict[str, Any]
    _changed: set[str]
    _bound: Binding | None

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls._parameters = dict(cls._parameters)
        cls._signals = dict(cls._signals)
        cls._connectors = dict(cls._connectors)
        cls._laws = dict(cls._laws)
        for name, value in list(vars(cls).items()):
            if isinstance(value, ParameterSpec):
                cls._parameters[name] = value
            elif isinstance(value, SignalSpec):
                cls._signals[name] = value
            elif isinstance(value, ConnectorSpec):
                cls._connectors[name] = value
            elif isinstance(getattr(value, "_atwood_law", None), Law):
                cls._laws[name] = value._atwood_law
            elif name in cls._parameters:
                changed = cls._parameters[name].with_default(value)
                changed.default = changed.check(value, f"{cls.__name__}.{name}")
                cls._parameters[name] = changed
                setattr(cls, name, changed)

    def __init__(self, **values: Any) -> None:
        object.__setattr__(self, "_parent", None)
        object.__setattr__(self, "_name", "")
        object.__setattr__(self, "_settings", {})
        object.__setattr__(self, "_bound", None)
        object.__setattr__(self, "_changed", set())
        self._check_names(values)
        self._settings.update({name: self._checked(name, value) for name, value in values.items()})
        for name, spec in self._parameters.items():
            if spec.default is MISSING and name not in self._settings:
                raise ParameterError(
                    "it has no default and must be given",
                    where=f"{type(self).__name__}.{name}",
                    advice=f"{name} is: {spec.doc} Unit {spec.unit.text}.",
                )

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._parameters and name not in self._signals:
            raise ParameterError(
                f"it has no parameter {name!r}",
                where=self.path or type(self).__name__,
                advice=suggestion(name, [*self._parameters, *self._signals]),
            )
        self._settings[name] = self._checked(name, value)
        self._changed.add(name)

    def __repr__(self) -> str:
        settings = ", ".join(f"{name}={value!r}" for name, value in self._settings.items())
        return f"{type(self).__name__}({settings})"

    # -- what a law reads ---------------------------------------------------------------------------------------

    @property
    def time(self) -> Scalar:
        """The time, s; only within a law."""
        return self._binding().time

    @property
    def on_a_line(self) -> bool:
        """Whether the scene is on a line; only within a law."""
        return self._binding().space == "line"

    @property
    def line(self) -> Vector:
        """Unit vector of the scene's line; only within a law of a scene on a line."""
        line = self._binding().line
        if line is None:
            raise DeclarationError("the scene is not on a line, so there is no direction of it", where=self.path)
        return line

    def side(self, a: Connector, b: Connector) -> float:
        """Return, on a line, +1 if b starts further along than a, and -1 otherwise."""
        sides = self._binding().sides
        forward = sides.get((a.name, b.name))
        return forward if forward is not None else -sides.get((b.name, a.name), -1.0)

    def distance(self, a: Any, b: Any) -> Scalar:
        """Return the distance of two points, m; on a line, positive in the order in which they start."""
        separation = b.position - a.position
        if self.on_a_line:
            return dot(separation, self.line) * self.side(a, b)
        return norm(separation)

    def reaction(self, name: str) -> Scalar:
        """Return a reaction of this component; only within an observable or an event."""
        reactions = self._binding().reactions
        if name not in reactions:
            raise DeclarationError(
                f"this law may not read the reaction {name!r}", where=self.path, advice=suggestion(name, reactions)
            )
        return reactions[name]

    def energy_around(self, kind: str) -> Scalar:
        """Return the kinetic or potential energy of the enclosing model; only within an observable."""
        energies = self._binding().energies
        if kind not in energies:
            raise DeclarationError(f"this law may not read the {kind} energy", where=self.path)
        return energies[kind]

    def _binding(self) -> Binding:
        if self._bound is None:
            raise UsageError("this has a value only inside a law", where=self.path or type(self).__name__)
        return self._bound

    def _known_observable(self, name: str) -> Any:
        return self._bound.known.get(name) if self._bound is not None else None

    # -- what the fields read -----------------------------------------------------------------------------------

    def _value(self, name: str) -> Any:
        if self._bound is not None:
            return self._bound.values[name]
        spec: ParameterSpec | SignalSpec = self._parameters.get(name) or self._signals[name]
        value = self._settings.get(name, spec.default)
        if isinstance(value, Deferred) and self._parent is not None:
            value = spec.check(value.value_in(self._parent), f"{self.path}.{name}")
        return value

    def _connector(self, spec: ConnectorSpec) -> Any:
        motions = self._bound.motions if self._bound is not None else {}
        made = tuple(spec.kind(self, name, motions.get(name)) for name in spec.names(self))
        return made if spec.count is not None else made[0]

    def _check_names(self, values: Mapping[str, Any]) -> None:
        for name in values:
            if name not in self._parameters and name not in self._signals:
                raise ParameterError(
                    f"it has no parameter {name!r}",
                    where=type(self).__name__,
                    advice=suggestion(name, [*self._parameters, *self._signals]),
                )

    def _checked(self, name: str, value: Any) -> Any:
        spec = self._parameters.get(name) or self._signals[name]
        return spec.check(value, f"{self.path or type(self).__name__}.{name}")

    # -- what the rest of Atwood reads --------------------------------------------------------------------------

    @property
    def path(self) -> str:
        """The dotted path of the component from the outermost model; empty for the outermost itself."""
        if self._parent is None:
            return ""
        prefix = self._parent.path
        return f"{prefix}.{self._name}" if prefix else self._name

    @classmethod
    def laws(cls, kind: Kind) -> list[Law]:
        """Return the laws of one kind, in the order in which they are declared."""
        return [law for law in cls._laws.values() if law.kind == kind]

    @classmethod
    def parameter_specs(cls) -> Mapping[str, ParameterSpec]:
        """Return the declared parameters by name."""
        return cls._parameters

    @classmethod
    def signal_specs(cls) -> Mapping[str, SignalSpec]:
        """Return the declared inputs by name."""
        return cls._signals

    @classmethod
    def connector_specs(cls) -> Mapping[str, ConnectorSpec]:
        """Return the declared connectors by name."""
        return cls._connectors

    def connectors(self) -> dict[str, Connector]:
        """Return the connectors by name, each element of an array on its own."""
        found: dict[str, Connector] = {}
        for spec in self._connectors.values():
            made = self._connector(spec)
            found.update({one.name: one for one in (made if isinstance(made, tuple) else (made,))})
        return found

    def parameters(self) -> dict[str, Any]:
        """Return the parameter values by name."""
        return {name: self._value(name) for name in self._parameters}

    def input(self, name: str) -> InputRef:
        """Return an input, to be connected to an output of another component."""
        if name not in self._signals:
            raise DeclarationError(
                f"it has no input {name!r}", where=self.path, advice=suggestion(name, self._signals)
            )
        return InputRef(self, name)

    def output(self, name: str) -> OutputRef:
        """Return a scalar observable, to be connected to an input of another component."""
        names = [law.name for law in self.laws("observable")]
        if name.split(".")[0] not in names:
            raise DeclarationError(f"it has no output {name!r}", where=self.path, advice=suggestion(name, names))
        return OutputRef(self, name)

    def copy(self) -> Self:
        """Return a component with the same settings, that belongs to no model."""
        twin = copy.copy(self)
        object.__setattr__(twin, "_settings", dict(self._settings))
        object.__setattr__(twin, "_changed", set(self._changed))
        object.__setattr__(twin, "_parent", None)
        object.__setattr__(twin, "_name", "")
        return twin


def bind(component: Component, binding: Binding) -> Any:
    """Return the component with values in place of its fields, so that its laws can be evaluated.

    Parameters
    ----------
    component
        The component.
    binding
        Numbers, expressions or sympy terms for everything its laws may read.
    """
    twin = object.__new__(type(component))
    for name in ("_parent", "_name", "_settings", "_changed"):
        object.__setattr__(twin, name, getattr(component, name))
    object.__setattr__(twin, "_bound", binding)
    return twin
