"""Models: components made of components and connections."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from itertools import islice
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar, overload

from atwood.arguments import NAME, Kind, check, takes_names
from atwood.display import count_of, field_text, fitted, listed
from atwood.errors import DeclarationError, ParameterError, UsageError, check_known, suggestion
from atwood.model.compose.connection_rules import (
    Connection,
    Parts,
    check_ends,
    check_new_parts,
    check_same_connectors,
    declared_connection,
    declared_parts,
    named_parts,
    relative_path,
)
from atwood.model.compose.differences import (
    Snapshot,
    apply_differences,
    check_connections,
    check_pairs,
    copy_parts,
    find_differences,
    take_over,
    take_snapshot,
)
from atwood.model.declare.component import Component
from atwood.model.declare.declaring import no_such_parameter
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.table import table

PATH = Kind("a dotted path, such as 'left.rod'", NAME.read)


_P = TypeVar("_P", bound=Component)


class _State:
    """What a model holds besides its parameters; a plain class, so that type checkers see no fields in it.

    Attributes
    ----------
    _given
        Parts that the constructor was given in the place of declared ones.
    _attached
        Parts, and arrays of parts, by name.
    _parts
        The same, each element of an array on its own.
    _connections
        Pairs of paths.
    _baseline
        The model as its class made it.
    """

    _given: dict[str, Parts]
    _attached: dict[str, Parts]
    _parts: dict[str, Component]
    _connections: list[tuple[str, str]]
    _baseline: Snapshot


class Model(_State, Component):
    """A component made of components and connections; reusable, parameterised and nestable.

    A subclass declares parts in its class body and joins them in ``connections``::

        class Pendulum(Model):
            length: float = parameter(1.0, unit="m", above=0.0, doc="Length of the rod.")
            top: Point = connector(Point, "Where it hangs.")
            rod: Rod = Rod(length=length)
            bob: PointMass = PointMass(mass=1.0)
            connections = [connect(top, rod.a), connect(rod.b, bob.point)]

    A part is replaced by one with the same connectors by giving it to the constructor, in a subclass, or with
    `replace`. A model whose parts depend on a count defines `build`.

    Parameters
    ----------
    **values
        Parameters, signals and replacements of parts, by name.
    """

    connections: ClassVar[Sequence[Connection]] = ()

    _prototypes: ClassVar[dict[str, Parts]] = {}
    _joined: ClassVar[tuple[tuple[str, str], ...]] = ()
    _joined_here: ClassVar[tuple[tuple[str, str], ...]] = ()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        inherited: dict[str, Parts] = {}
        joined: list[tuple[str, str]] = []
        for base in reversed(cls.__mro__[1:]):
            inherited.update(vars(base).get("_prototypes", {}))
            joined.extend(pair for pair in vars(base).get("_joined_here", ()) if pair not in joined)
        cls._prototypes = declared_parts(cls, inherited)
        names = {id(part): name for name, part in named_parts(cls._prototypes)}
        cls._joined_here = tuple(declared_connection(cls, one, names) for one in vars(cls).get("connections", ()))
        cls._joined = (*joined, *cls._joined_here)
        for name, part in named_parts(cls._prototypes):
            if name.partition("[")[0] in vars(cls):
                check_pairs(joined, f"{name}.", part)

    def __init__(self, *unnamed: Any, **values: Any) -> None:
        given = {name: value for name, value in values.items() if name in self._prototypes}
        super().__init__(*unnamed, **{name: value for name, value in values.items() if name not in given})
        for name, part in given.items():
            check_same_connectors(self._prototypes[name], part, f"{type(self).__name__}.{name}")
        object.__setattr__(self, "_given", {name: copy_parts(part) for name, part in given.items()})
        self._assemble()

    if TYPE_CHECKING:  # parts that are added have a name in no class

        def __getattr__(self, name: str) -> Any: ...

    def build(self) -> None:
        """Add parts and connections that depend on parameters; for subclasses, called when a model is made."""

    def _assemble(self) -> None:
        """Make the parts and connections that the class says."""
        object.__setattr__(self, "_attached", {})
        object.__setattr__(self, "_parts", {})
        object.__setattr__(self, "_connections", list(self._joined))
        for name, prototype in self._prototypes.items():
            self._attach(name, copy_parts(self._given.get(name, prototype)))
        for name, part in named_parts(self._given):
            check_connections(self, name, part)
        if not self._is_open():
            self.build()
        object.__setattr__(self, "_baseline", take_snapshot(self))

    def _attach(self, name: str, parts: Parts) -> None:
        self._attached[name] = parts
        object.__setattr__(self, name, parts)
        for full_name, one in named_parts({name: parts}):
            self._take(full_name, one)
        for _, one in named_parts({name: parts}):
            one._settle()

    def _take(self, name: str, part: Component) -> None:
        self._parts[name] = part
        object.__setattr__(part, "_parent", self)
        object.__setattr__(part, "_name", name)

    def _hold(self, attached: dict[str, Parts]) -> None:
        """Take these parts, and no others, as the own ones."""
        object.__setattr__(self, "_attached", attached)
        object.__setattr__(self, "_parts", {})
        for full_name, one in named_parts(attached):
            self._take(full_name, one)
        for name, parts in attached.items():
            object.__setattr__(self, name, parts)

    def _release(self, name: str) -> None:
        """Let go of parts that were just attached."""
        for _, one in named_parts({name: self._attached[name]}):
            object.__setattr__(one, "_parent", None)
        object.__delattr__(self, name)
        self._hold({other: parts for other, parts in self._attached.items() if other != name})

    # -- building ------------------------------------------------------------------------------------------------

    @overload
    def add(self, name: str, part: _P) -> _P: ...
    @overload
    def add(self, name: str, part: list[_P]) -> list[_P]: ...
    @takes_names
    def add(self, name: str, part: Any) -> Any:
        """Add a part, or an array of parts, under a name, and return it.

        Raises
        ------
        DeclarationError
            If the name is taken or no identifier, or the part belongs to a model already.
        """
        check_new_parts(self, name, part, taken=self._attached)
        added = list(part) if isinstance(part, list) else part
        try:
            self._attach(name, added)
        except Exception:
            self._release(name)
            raise
        return added

    @takes_names
    def connect(self, a: Any, b: Any) -> None:
        """Join two connectors, or an output with an input.

        Raises
        ------
        ConnectError
            If they cannot meet, or belong to a part that is not in this model.
        """
        path_a, path_b = relative_path(a, self), relative_path(b, self)
        check_ends(a, b, path_a, path_b)
        self._connections.append((path_a, path_b))

    @takes_names
    def replace(self, name: str, part: _P) -> _P:
        """Put a copy of another part with the same connectors in the place of one, and return it.

        Parameters
        ----------
        name
            Name of the part, or of one element of an array (``"rod[2]"``); or its dotted path, such as ``"arm.motor"``,
            for a part of a model in it.
        part
            What takes its place.

        Raises
        ------
        DeclarationError
            If there is no such part, or the new one lacks one of its connectors.
        """
        where = self.path or type(self).__name__
        check(NAME, name, "name", f"{where}.replace", DeclarationError)
        around, _, last = name.rpartition(".")
        if around:
            inner = self[around]
            if not isinstance(inner, Model):
                raise DeclarationError("it has no parts of its own", where=inner.path)
            return inner.replace(last, part)
        check_known(name, self._parts, f"it has no part {name!r}", where=where, error=DeclarationError)
        old = self._parts[name]
        check_same_connectors(old, part, f"{self.path or type(self).__name__}.{name}")
        before, new = dict(self._attached), part.copy()
        array = self._attached.get(name.partition("[")[0])
        if isinstance(array, list):
            short = name.partition("[")[0]
            after = {**before, short: [new if one is old else one for one in array]}
        else:
            after = {**before, name: new}
        self._hold(after)
        try:
            new._settle()
            check_connections(self, name, new)
        except Exception:
            self._hold(before)
            raise
        object.__setattr__(old, "_parent", None)
        return new

    # -- reading and setting -------------------------------------------------------------------------------------

    @property
    def parts(self) -> Mapping[str, Component]:
        """The parts by name, each element of an array on its own."""
        return MappingProxyType(self._parts)

    @property
    def connected(self) -> tuple[tuple[str, str], ...]:
        """Pairs of paths of connectors, or of outputs and inputs, that are connected."""
        return tuple(self._connections)

    def __getitem__(self, path: str) -> Any:
        """Return the part at a dotted path, such as ``"left.rod"`` or ``"rod[2]"``."""
        component: Component = self
        for step in check(PATH, path, "path", self.path or type(self).__name__).split("."):
            parts = component._children()
            if step not in parts:
                where = component.path or type(component).__name__
                raise UsageError(f"there is no part {step!r} in it", where=where, advice=suggestion(step, parts))
            component = parts[step]
        return component

    def __contains__(self, path: object) -> bool:
        """Return whether there is a part at a dotted path."""
        try:
            return self[str(path)] is not None
        except UsageError:
            return False

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the parts."""
        return iter(self._parts)

    @takes_names
    def set(self, path: str, value: Any) -> None:
        """Set a parameter by its dotted path; nothing changes if the value is refused.

        Parameters
        ----------
        path
            For instance ``"rod1.length"`` or, for a parameter of the model itself, ``"length"``.
        value
            A number in SI units, or text with a unit (``"30 cm"``).
        """
        *steps, name = check(PATH, path, "path", f"{self.path or type(self).__name__}.set").split(".")
        setattr(self[".".join(steps)] if steps else self, name, value)

    def _unknown(self, name: str) -> ParameterError:
        kind = type(self).__name__
        if name in getattr(self, "_parts", {}) or name in getattr(self, "_attached", {}):
            return ParameterError(
                f"{name!r} is a part and cannot be set", where=self.path or kind, advice="Use replace."
            )
        known = [*self._parameters, *self._signals, *self._prototypes]
        return no_such_parameter(kind, self.path, name, known, otherwise="A part is added with add.")

    # -- showing -------------------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        return fitted("\n".join([super().__repr__(), *(f"    {name}: {text}" for name, text in self._facts())]))

    def _facts(self) -> Iterator[tuple[str, str]]:
        """Yield what there is to say of it in a few lines."""
        counts = {name: len(one) if isinstance(one, list) else 0 for name, one in self._attached.items()}
        arrays = (f"{name}[0..{count - 1}]" if count else name for name, count in counts.items())
        yield count_of(len(self._parts), "part"), listed(arrays, 12)
        yield count_of(len(self._connections), "connection"), listed(map(" - ".join, self._connections), 4)

    def _repr_html_(self) -> str:
        rows = ((name, type(part).__name__, _settings(part)) for name, part in islice(self._parts.items(), _SHOWN))
        rest = f"and {len(self._parts) - _SHOWN} more parts; " if len(self._parts) > _SHOWN else ""
        note = rest + "; ".join(f"{name}: {text}" for name, text in [*self._facts()][1:])
        return table(("part", "component", "set to"), rows, Component.__repr__(self), [note]).html()

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._parts)

    # -- keeping up with changes ---------------------------------------------------------------------------------

    def _children(self) -> Mapping[str, Component]:
        return self._parts

    def _start_values(self) -> Mapping[str, MutableMapping[str, Any]]:
        """Return what a scene says about its start; for scenes."""
        return {}

    def _builds(self) -> bool:
        return type(self).build is not Model.build

    def _is_open(self) -> bool:
        """Return whether it builds from parameters that depend on a model that is only declared so far."""
        return self._builds() and any(isinstance(self._value(name), ParameterExpression) for name in self._settings)

    def _is_built_from_around(self) -> bool:
        """Return whether it builds from parameters of the model around it."""
        return self._builds() and any(isinstance(value, ParameterExpression) for value in self._settings.values())

    def _settle(self) -> None:
        if self._is_built_from_around():
            if not self._is_open():
                self._make_anew()
            return
        for child in self._children().values():
            child._settle()

    def _follow(self) -> None:
        if self._builds() or _any_built_from_around(self):
            self._make_anew()

    def _make_anew(self) -> None:
        """Make the parts from changed parameters, keeping what was changed and added since; all of it or nothing."""
        fresh = object.__new__(type(self))
        fresh._start_as(self._settings, self._parent, self._name)
        object.__setattr__(fresh, "_given", self._given)
        object.__setattr__(fresh, "_token", self._token)
        fresh._assemble()
        apply_differences(fresh, find_differences(self))
        check_connections(self._parent, self._name, fresh)
        take_over(self, fresh)

    def copy(self) -> Self:
        """Return a model with the same settings and its own parts, that belongs to no model."""
        twin = super().copy()
        object.__setattr__(twin, "_connections", list(self._connections))
        object.__setattr__(twin, "_given", dict(self._given))
        twin._hold({name: copy_parts(part) for name, part in self._attached.items()})
        return twin


def owner_of(model: Model, path: str) -> tuple[Any, str]:
    """Return the component that a parameter is of, which may be the model itself, and the name of the parameter."""
    owner, _, name = path.rpartition(".")
    return (model[owner] if owner else model), name


_SHOWN = 30
"""So many parts are listed in a notebook."""


def _settings(part: Component) -> str:
    return ", ".join(f"{name} = {field_text(value)}" for name, value in part._settings.items())


def _any_built_from_around(model: Component) -> bool:
    return any(
        (isinstance(child, Model) and child._is_built_from_around()) or _any_built_from_around(child)
        for child in model._children().values()
    )
