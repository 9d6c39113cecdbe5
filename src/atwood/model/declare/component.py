"""The base of every part: parameters, connectors, signals and laws, declared in a class body like a dataclass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any, ClassVar, Self, dataclass_transform

from atwood.arguments import NAME, check
from atwood.display import field_text, fitted
from atwood.errors import DeclarationError, MissingNameError, ParameterError, UsageError, check_known, suggestion
from atwood.expr import Scalar
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.connectors import Connector, ConnectorSpec, InputRef, Motion, OutputRef, Quantity, connector
from atwood.model.declare.declaring import (
    ComponentType,
    collect_declarations,
    given_without_name,
    must_be_given,
    no_private_name,
    no_such_name,
    no_such_parameter,
    no_such_reaction,
)
from atwood.model.declare.field_functions import StateSpec, discrete_state, state
from atwood.model.declare.fields import MISSING, Field, FieldReference, ParameterSpec, SignalSpec
from atwood.model.declare.function_values import Function
from atwood.model.declare.laws import Kind, Law
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.model.values.outline import Outline
from atwood.model.values.space import Vector, dot, norm
from atwood.table import table


@dataclass_transform(kw_only_default=True, field_specifiers=(connector, state, discrete_state))
class Component(metaclass=ComponentType):
    """A part: it has parameters, connectors and laws, and sees neither the graph nor the solver.

    Subclasses declare their fields in the class body with `parameter`, `connector`, `signal`, `state` and
    `discrete_state`, and their laws as methods marked with `inertia`, `potential`, `dissipation`, `force`,
    `constraint`, `joint`, `observable`, `event`, `derivative` and `update`. Within a law, ``self.stiffness`` is the
    parameter, ``self.a.position`` what the connector knows, ``self.time`` the time.

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
    mode_parameter: ClassVar[str] = ""
    """Name of the choice parameter that says the mode at the start; the usual one if empty."""

    spaces: ClassVar[tuple[str, ...]] = ("line", "plane", "space")
    """Where it means something; in a scene that lives elsewhere it is refused."""
    synonyms: ClassVar[tuple[str, ...]] = ()
    """What textbooks and Modelica call it; a class derived from it has none of them."""

    _parameters: ClassVar[dict[str, ParameterSpec]] = {}
    _signals: ClassVar[dict[str, SignalSpec]] = {}
    _connectors: ClassVar[dict[str, ConnectorSpec]] = {}
    _states: ClassVar[dict[str, StateSpec]] = {}
    _laws: ClassVar[dict[str, Law]] = {}
    _contacts: ClassVar[dict[str, Law]] = {}

    _parent: Component | None
    _name: str
    _settings: dict[str, Any]
    _token: object
    _bound: Binding | None = None
    _declared: str = ""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        collect_declarations(cls)

    def __init__(self, *unnamed: Any, **values: Any) -> None:
        self._start_as({}, None, "")
        if unnamed:
            raise given_without_name(type(self).__name__, self._parameters, unnamed[0])
        for name in values:
            if name not in self._parameters and name not in self._signals:
                raise self._unknown(name)
        object.__setattr__(self, "_settings", {name: self._checked(name, value) for name, value in values.items()})
        for name, spec in self._parameters.items():
            if spec.default is MISSING and name not in self._settings:
                raise must_be_given(type(self).__name__, spec)

    def _start_as(self, settings: dict[str, Any], parent: Component | None, name: str) -> None:
        """Give the object its bare state."""
        object.__setattr__(self, "_parent", parent)
        object.__setattr__(self, "_name", name)
        object.__setattr__(self, "_settings", settings)
        object.__setattr__(self, "_token", object())

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._parameters and name not in self._signals:
            raise self._unknown(name)
        before = self._settings
        object.__setattr__(self, "_settings", {**before, name: self._checked(name, value)})
        try:
            self._follow()
        except Exception:
            object.__setattr__(self, "_settings", before)
            raise

    def __getattr__(self, name: str) -> Quantity:
        """Return a reaction, which no method computes, as a quantity."""
        for law in self.laws("constraint") if not name.startswith("_") else ():
            if name in {reaction.split(".")[0] for reaction in law.options.reactions}:
                return Quantity(self, name, law.options.unit, law.options.doc)
        for law in self.laws("joint") if name in ("force", "torque") else ():
            if law.options.rigid and law.options.reaction_doc:
                return Quantity(self, name, "N" if name == "force" else "N*m", law.options.reaction_doc)
        # Private names Python asks for, and nobody reads.
        raise no_private_name(type(self).__name__, name, self) if name.startswith("_") else self._missing(name)

    def _missing(self, name: str) -> MissingNameError:
        there = [*self._connectors, *self._children(), *self._parameters, *self._signals]
        there += [law.name for law in self.laws("observable")]
        return no_such_name(type(self).__name__, self.path, name, there, self._connectors)

    def __delattr__(self, name: str) -> None:
        raise UsageError(f"{name!r} cannot be taken away", where=self.path or type(self).__name__)

    def __repr__(self) -> str:
        settings = ", ".join(f"{name}={field_text(value)}" for name, value in self._settings.items())
        return fitted(f"{type(self).__name__}({settings})")

    def _repr_html_(self) -> str:
        title, fields = f"{type(self).__name__} {self.path}".strip(), {**self._parameters, **self._signals}
        rows = ((name, field_text(self._value(name)), one.unit.text, one.doc) for name, one in fields.items())
        return table(("parameter", "value", "unit", "meaning"), rows, title).html()

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
    def in_space(self) -> bool:
        """Whether the scene is in space; only within a law."""
        return self._binding().space == "space"

    @property
    def line(self) -> Vector:
        """Unit vector of the scene's line; only within a law of a scene on a line."""
        line = self._binding().line
        if line is None:
            raise DeclarationError("the scene is not on a line, so there is no direction of it", where=self.path)
        return line

    def side(self, a: Connector, b: Connector, default: float | None = 1.0) -> float:
        """Return, on a line, +1 if b starts further along than a, and -1 otherwise.

        Parameters
        ----------
        a, b
            Connectors of this component.
        default
            What to return if the start does not tell; None to refuse.
        """
        line_signs = self._binding().line_signs
        if line_signs is None:
            return 1.0
        known = line_signs.get((a.name, b.name), default)
        if known is None:
            raise DeclarationError(
                f"it is not known on which side of {a.name} the end {b.name} starts",
                where=self.path,
                advice="Give start or guess positions of what they are joined to, such as 'm1.position.z'.",
            )
        return known

    def distance(self, a: Any, b: Any, side: float | None = 1.0) -> Scalar:
        """Return the distance of two points, m; on a line, positive in the order in which they start.

        Parameters
        ----------
        a, b
            Connectors of this component.
        side
            On a line, the sign if the start does not tell it; None to refuse.
        """
        separation = b.position - a.position
        if self.on_a_line:
            return dot(separation, self.line) * self.side(a, b, side)
        return norm(separation)

    def restate_start(self, given: Mapping[str, float], space: str) -> dict[str, float]:
        """Return start values of this component, said in a way that a start can be found from.

        A component overrides this where what people say is no good condition: Euler angles, say, have no derivative
        where they meet, while the axes they stand for have one everywhere.

        Parameters
        ----------
        given
            Start values of its quantities by name, in SI units.
        space
            ``"line"``, ``"plane"`` or ``"space"``.
        """
        return dict(given)

    def check_values(self) -> None:
        """Refuse parameters of which each is admissible and which do not go together.

        A component overrides this where a bound is another parameter, as the radius of a hole has; it is called before
        the scene is assembled, and its parameters are then plain numbers.

        Raises
        ------
        ParameterError
            If they do not, with the path of the parameter and what to do.
        """

    @classmethod
    def _of_values(cls, values: Mapping[str, Any], where: str) -> type[Component]:
        """Return the class that a component with some values is of; one whose fields are in a file overrides this."""
        return cls

    @classmethod
    def _written_class(cls) -> type[Component]:
        """Return the class that stands for this one in a file."""
        return cls

    def check_run(self, start: float, end: float) -> None:
        """Refuse a run that the component is not made for, as one that goes on beyond the end of a table.

        A component overrides this; it is called before each run, and its parameters are then plain numbers.

        Parameters
        ----------
        start, end
            Times of the start and of the end of the run, s.

        Raises
        ------
        ParameterError
            If it is not made for it.
        """

    def outline(self) -> Outline | None:
        """Return what it looks like, for pictures; None for what has no shape of its own. Parameters are numbers."""
        return None

    def reaction(self, name: str) -> Scalar:
        """Return a reaction of this component; only within a force, a dissipation, an observable or an event."""
        reactions = self._binding().reactions
        if name not in reactions:
            is_rigid = any(law.options.rigid and law.options.reaction_doc for law in self.laws("joint"))
            raise no_such_reaction(self.path, name, reactions, is_rigid)
        return reactions[name]

    def total_around(self, kind: str) -> Any:
        """Return something of the enclosing model as a whole; only within an observable.

        Parameters
        ----------
        kind
            ``"kinetic"`` or ``"potential"``, an energy; ``"power"``, the rate of both; ``"mass"``; or a `Vector` in
            world axes about the world's origin: ``"first_moment"`` (mass times centre of mass), ``"momentum"``,
            ``"angular_momentum"``, ``"moments"`` and ``"products"`` (entries xx, yy, zz and xy, xz, yz of the inertia
            tensor).
        """
        energies = self._binding().energies
        if kind not in energies:
            raise DeclarationError(f"this law may not read {kind!r} of the model around it", where=self.path)
        return energies[kind]

    def _binding(self) -> Binding:
        if self._bound is None:
            raise UsageError("this has a value only inside a law", where=self.path or type(self).__name__)
        return self._bound

    def _known_observable(self, name: str) -> Any:
        return self._bound.known.get(name) if self._bound is not None else None

    # -- what the fields read -----------------------------------------------------------------------------------

    def _value(self, name: str) -> Any:
        """Return the value of a field; deferred if it depends on a model that is only declared so far."""
        if self._bound is not None:
            return self._bound.values[name]
        spec = self._field(name)
        given = name in self._settings
        value = self._settings[name] if given else spec.default
        scope = self._parent if given else self
        if isinstance(value, Function) and value.letters and scope is not None:
            known = {one: FieldReference(one).value_in(scope) for one in value.letters}
            is_open = any(isinstance(one, ParameterExpression) for one in known.values())
            return value if is_open else value.with_letters({one: float(held) for one, held in known.items()})
        if not isinstance(value, ParameterExpression) or scope is None:
            return value
        return self._checked(name, value.worked_out(scope, f"{self.path or type(self).__name__}.{name}"))

    def _field(self, name: str) -> Field:
        return self._parameters[name] if name in self._parameters else self._signals[name]

    def _connector(self, spec: ConnectorSpec) -> Any:
        made = self._made(spec)
        if not made and spec.count is None:
            raise spec.absent(self)
        return made if spec.count is not None else made[0]

    def _made(self, spec: ConnectorSpec) -> tuple[Connector, ...]:
        """Return the connectors that a declaration stands for, of which there may be none."""
        motions = self._bound.motions if self._bound is not None else {}
        return tuple([spec.kind(self, name, motions.get(name)) for name in spec.names(self)])

    def _checked(self, name: str, value: Any) -> Any:
        return self._field(name).check(value, f"{self.path or type(self).__name__}.{name}")

    def _unknown(self, name: str) -> ParameterError:
        return no_such_parameter(type(self).__name__, self.path, name, [*self._parameters, *self._signals])

    # -- what models change -------------------------------------------------------------------------------------

    def _follow(self) -> None:
        """Make what depends on a changed setting; for models."""

    def _settle(self) -> None:
        """Make what could not be made before the parts around were there; for models."""

    def _children(self) -> Mapping[str, Component]:
        """Return the parts by name; for models."""
        return {}

    # -- what the rest of Atwood reads --------------------------------------------------------------------------

    @property
    def path(self) -> str:
        """The dotted path of the component from the outermost model; empty for the outermost itself."""
        if self._bound is not None:
            self._bound.asked["path"] = True
        if self._parent is None:
            return ""
        prefix = self._parent.path
        return f"{prefix}.{self._name}" if prefix else self._name

    @classmethod
    def laws(cls, kind: Kind) -> list[Law]:
        """Return the laws of one kind, in the order in which they are declared."""
        return [law for law in cls._laws.values() if law.kind == kind]

    @classmethod
    def contact_laws(cls) -> Mapping[str, Law]:
        """Return the declared gaps and slips by name."""
        return cls._contacts

    @classmethod
    def parameter_specs(cls) -> Mapping[str, ParameterSpec]:
        """Return the declared parameters by name."""
        return cls._parameters

    @classmethod
    def signal_specs(cls) -> Mapping[str, SignalSpec]:
        """Return the declared inputs by name."""
        return cls._signals

    @classmethod
    def state_specs(cls) -> Mapping[str, StateSpec]:
        """Return the declared states by name."""
        return cls._states

    @classmethod
    def connector_specs(cls) -> Mapping[str, ConnectorSpec]:
        """Return the declared connectors by name."""
        return cls._connectors

    def _connector_named(self, name: str) -> Connector | None:
        """Return a connector by its name, such as ``point[2]``; None where there is none."""
        spec = self._connectors.get(name.partition("[")[0])
        if spec is None or not spec.has(self, name):
            return None
        motions = self._bound.motions if self._bound is not None else {}
        return spec.kind(self, name, motions.get(name))

    def connectors(self) -> dict[str, Connector]:
        """Return the connectors by name, each element of an array on its own."""
        return {one.name: one for spec in self._connectors.values() for one in self._made(spec)}

    def parameters(self) -> dict[str, Any]:
        """Return the parameter values by name."""
        return {name: self._value(name) for name in self._parameters}

    def input(self, name: str) -> InputRef:
        """Return an input, to be connected to an output of another component."""
        check(NAME, name, "name", f"{self.path or type(self).__name__}.input", DeclarationError)
        check_known(name, self._signals, f"it has no input {name!r}", where=self.path, error=DeclarationError)
        return InputRef(self, name)

    def output(self, name: str) -> OutputRef:
        """Return a scalar observable, or a reaction, to be connected to an input of another component."""
        check(NAME, name, "name", f"{self.path or type(self).__name__}.output", DeclarationError)
        names = self.output_names()
        if name.split(".")[0] not in names:
            raise DeclarationError(f"it has no output {name!r}", where=self.path, advice=suggestion(name, names))
        return OutputRef(self, name)

    @classmethod
    def output_names(cls) -> list[str]:
        """Return the names of its outputs: observables, and reactions of its constraints."""
        reactions = (name.split(".")[0] for law in cls.laws("constraint") for name in law.options.reactions)
        return [*(law.name for law in cls.laws("observable")), *dict.fromkeys(reactions)]

    def copy(self) -> Self:
        """Return a component with the same settings, that belongs to no model."""
        twin = object.__new__(type(self))
        vars(twin).update(vars(self))
        object.__setattr__(twin, "_parent", None)
        object.__setattr__(twin, "_name", "")
        object.__setattr__(twin, "_declared", "")
        return twin

    def __copy__(self) -> Self:
        return self.copy()  # parts that two models share would belong to one of them


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
    line_signs
        On a line: +1 or -1 for a pair of connector names, the sign of the second's position minus the first's.
        None while the signs are not known yet.
    known
        Observables that are known without their formula, such as a joint coordinate.
    reactions
        Reactions by name.
    energies
        Energies and totals of the model that the component is placed in, by name; see `Component.total_around`.
    asked
        What laws have asked of the component itself, noted as they are evaluated: ``path``.
    """

    values: Mapping[str, Any]
    motions: Mapping[str, Motion] = field(default_factory=dict)
    time: Scalar = 0.0
    space: str = "plane"
    line: Vector | None = None
    line_signs: Mapping[tuple[str, str], float] | None = None
    known: Mapping[str, Any] = field(default_factory=dict)
    reactions: Mapping[str, Any] = field(default_factory=dict)
    energies: Mapping[str, Any] = field(default_factory=dict)
    asked: dict[str, bool] = field(default_factory=dict)


def bind(component: Component, binding: Binding) -> Any:
    """Return the component with values in place of its fields, so that its laws can be evaluated."""
    twin = object.__new__(type(component))
    for name in ("_parent", "_name", "_settings"):
        object.__setattr__(twin, name, getattr(component, name))
    object.__setattr__(twin, "_bound", binding)
    return twin
