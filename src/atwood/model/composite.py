"""Models: components made of components and connections."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self, TypeVar, overload

from atwood.errors import ConnectError, DeclarationError, UsageError, suggestion
from atwood.model.component import Component
from atwood.model.connectors import Connector, ConnectorSpec, InputRef, OutputRef

__all__ = ["Connection", "Model", "connect"]

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*$")
End = Connector | ConnectorSpec | InputRef | OutputRef
_P = TypeVar("_P", bound=Component)


@dataclass(frozen=True)
class Connection:
    """Two ends that are joined, as written in the class body of a model."""

    a: Any
    b: Any


def connect(a: Any, b: Any) -> Connection:
    """Join two connectors, or an output with an input, in the class body of a model.

    Parameters
    ----------
    a, b
        Connectors of parts (``rod.a``), connectors of the model itself, or an output and an input.

    Raises
    ------
    ConnectError
        If the two cannot meet.
    """
    return Connection(a, b)


class Model(Component):
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

    _prototypes: ClassVar[dict[str, Component | list[Component]]] = {}
    _joined: ClassVar[tuple[tuple[str, str], ...]] = ()

    _parts: dict[str, Component]
    _connections: list[tuple[str, str]]
    _replaced: dict[str, Component]
    _built: tuple[int, frozenset[str]]

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls._prototypes = dict(cls._prototypes)
        for name, value in list(vars(cls).items()):
            if isinstance(value, Component) or (
                isinstance(value, list) and value and all(isinstance(v, Component) for v in value)
            ):
                if name in cls._prototypes:
                    _check_same_connectors(cls._prototypes[name], value, f"{cls.__name__}.{name}")
                cls._prototypes[name] = value
        names = {id(part): name for name, part in _named(cls._prototypes)}
        own = [c for c in vars(cls).get("connections", ())]
        joined = [
            (_class_path(c.a, names, cls.__name__), _class_path(c.b, names, cls.__name__), c) for c in own
        ]
        for a, b, connection in joined:
            _check_ends(connection.a, connection.b, a, b)
        cls._joined = cls._joined + tuple((a, b) for a, b, _ in joined)

    def __init__(self, **values: Any) -> None:
        replaced = {name: value for name, value in values.items() if name in self._prototypes}
        object.__setattr__(self, "_replaced", replaced)
        super().__init__(**{name: value for name, value in values.items() if name not in replaced})
        self._assemble()

    def build(self) -> None:
        """Add parts and connections that depend on parameters; for subclasses, called when a model is made."""

    def _assemble(self) -> None:
        object.__setattr__(self, "_parts", {})
        object.__setattr__(self, "_connections", list(self._joined))
        for name, prototype in self._prototypes.items():
            part = self._replaced.get(name, prototype)
            if part is not prototype:
                _check_same_connectors(prototype, part, f"{type(self).__name__}.{name}")
            self._attach(name, [p.copy() for p in part] if isinstance(part, list) else part.copy())
        self.build()
        object.__setattr__(self, "_built", (len(self._connections), frozenset(self._parts)))

    def _attach(self, name: str, part: Component | list[Component]) -> None:
        for full_name, one in _named({name: part}):
            object.__setattr__(one, "_parent", self)
            object.__setattr__(one, "_name", full_name)
            self._parts[full_name] = one
        object.__setattr__(self, name, part)

    # -- building ------------------------------------------------------------------------------------------------

    @overload
    def add(self, name: str, part: _P) -> _P: ...
    @overload
    def add(self, name: str, part: list[_P]) -> list[_P]: ...
    def add(self, name: str, part: Any) -> Any:
        """Add a part, or an array of parts, under a name, and return it.

        Raises
        ------
        DeclarationError
            If the name is taken or no identifier, or the part belongs to a model already.
        """
        if not _NAME.match(name):
            raise DeclarationError(f"{name!r} cannot be the name of a part", advice="Use letters, digits and _.")
        if hasattr(type(self), name) or name in self.__dict__:
            raise DeclarationError(f"the name {name!r} is taken", where=self.path or type(self).__name__)
        parts = part if isinstance(part, list) else [part]
        for one in parts:
            if not isinstance(one, Component):
                raise DeclarationError(f"{name!r} is given {one!r}, which is no component")
            if one._parent is not None:
                raise DeclarationError(
                    f"the part given as {name!r} is already there as {one.path!r}", advice="Give each its own object."
                )
        self._attach(name, part)
        return part

    def connect(self, a: Any, b: Any) -> None:
        """Join two connectors, or an output with an input.

        Raises
        ------
        ConnectError
            If they cannot meet, or belong to a part that is not in this model.
        """
        path_a, path_b = self._relative(a), self._relative(b)
        _check_ends(a, b, path_a, path_b)
        self._connections.append((path_a, path_b))

    def replace(self, name: str, part: Component) -> Component:
        """Put another part with the same connectors in the place of one, and return it."""
        if name not in self._parts:
            raise DeclarationError(f"it has no part {name!r}", where=self.path, advice=suggestion(name, self._parts))
        _check_same_connectors(self._parts[name], part, f"{self.path or type(self).__name__}.{name}")
        new = part.copy()
        self._attach(name, new)
        self._replaced[name] = part
        return new

    def _relative(self, end: Any) -> str:
        if isinstance(end, ConnectorSpec):
            return end.name
        if not isinstance(end, (Connector, InputRef, OutputRef)):
            raise ConnectError(f"{end!r} is no connector", advice="Connect things like rod.a or mass.point.")
        names = [end.name]
        component: Component | None = end.component
        while component is not None and component is not self:
            names.append(component._name or type(component).__name__)
            component = component._parent
        path = ".".join(reversed(names))
        if component is None:
            raise ConnectError(
                "it belongs to a part that is not in this model", where=path, advice="Add the part first."
            )
        return path

    # -- reading and setting -------------------------------------------------------------------------------------

    @property
    def parts(self) -> Mapping[str, Component]:
        """The parts by name, each element of an array on its own."""
        return self._parts

    def __getitem__(self, path: str) -> Any:
        """Return the part at a dotted path, such as ``"left.rod"`` or ``"rod[2]"``."""
        component: Component = self
        for step in path.split("."):
            parts = component._parts if isinstance(component, Model) else {}
            if step not in parts:
                where = component.path or type(self).__name__
                raise UsageError(f"there is no part {step!r} in it", where=where, advice=suggestion(step, parts))
            component = parts[step]
        return component

    def set(self, path: str, value: Any) -> None:
        """Set a parameter by its dotted path; nothing changes if the value is refused.

        Parameters
        ----------
        path
            For instance ``"rod1.length"`` or, for a parameter of the model itself, ``"length"``.
        value
            A number in SI units, or text with a unit (``"30 cm"``).
        """
        *steps, name = path.split(".")
        target = self[".".join(steps)] if steps else self
        if not isinstance(target, Component):
            raise UsageError("it is no part", where=path)
        setattr(target, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        before = dict(self._settings)
        super().__setattr__(name, value)
        if type(self).build is not Model.build:
            try:
                self._rebuild()
            except Exception:
                object.__setattr__(self, "_settings", before)
                self._rebuild()
                raise

    def _rebuild(self) -> None:
        """Make the parts anew from changed parameters, keeping what was set on them and added since."""
        count, built = self._built
        extra_connections = self._connections[count:]
        old = dict(self._parts)
        added: dict[str, Any] = {name: part for name, part in self.__dict__.items() if name not in _PRIVATE}
        for name in [name for name in self.__dict__ if name not in _PRIVATE]:
            object.__delattr__(self, name)
        self._assemble()
        for name, part in added.items():
            if not any(full in built for full, _ in _named({name: part})):
                self._attach(name, part)
        for name, part in self._parts.items():
            if name in old and old[name] is not part:
                _carry_changes(old[name], part)
        self._connections.extend(extra_connections)

    def copy(self) -> Self:
        """Return a model with the same settings and its own parts, that belongs to no model."""
        twin = super().copy()
        for name in list(twin.__dict__):
            if name not in _PRIVATE:
                object.__delattr__(twin, name)
        object.__setattr__(twin, "_parts", {})
        object.__setattr__(twin, "_connections", list(self._connections))
        object.__setattr__(twin, "_replaced", dict(self._replaced))
        for name, part in self.__dict__.items():
            if name not in _PRIVATE:
                twin._attach(name, [p.copy() for p in part] if isinstance(part, list) else part.copy())
        return twin


_PRIVATE = frozenset(
    {"_parent", "_name", "_settings", "_changed", "_bound", "_parts", "_connections", "_replaced", "_built", "start", "guess"}
)


def _carry_changes(old: Component, new: Component) -> None:
    """Repeat on a part that was made anew what had been set on the old one."""
    if type(old) is not type(new):
        return
    for name in sorted(old._changed):
        setattr(new, name, old._settings[name])
    if isinstance(old, Model) and isinstance(new, Model):
        for name, part in new._parts.items():
            if name in old._parts:
                _carry_changes(old._parts[name], part)


def _named(parts: Mapping[str, Any]) -> list[tuple[str, Component]]:
    """Return every part with its own name, the elements of an array as ``name[0]``, ``name[1]``, ..."""
    found: list[tuple[str, Component]] = []
    for name, part in parts.items():
        if isinstance(part, list):
            found.extend((f"{name}[{i}]", one) for i, one in enumerate(part))
        else:
            found.append((name, part))
    return found


def _class_path(end: Any, names: Mapping[int, str], where: str) -> str:
    if isinstance(end, ConnectorSpec):
        return end.name
    if not isinstance(end, (Connector, InputRef, OutputRef)):
        raise ConnectError(f"{end!r} is no connector", where=where, advice="Connect things like rod.a or mass.point.")
    steps = [end.name]
    component = end.component
    while component._parent is not None:
        steps.append(component._name)
        component = component._parent
    if id(component) not in names:
        raise ConnectError("it belongs to a part that is not declared in the class body", where=f"{where}.{end.name}")
    return ".".join([names[id(component)], *reversed(steps)])


def _check_ends(a: Any, b: Any, path_a: str, path_b: str) -> None:
    if path_a == path_b:
        raise ConnectError("it is joined to itself", where=path_a, advice="Connect it to another connector.")
    if isinstance(a, (InputRef, OutputRef)) or isinstance(b, (InputRef, OutputRef)):
        if {type(a), type(b)} != {InputRef, OutputRef}:
            raise ConnectError(
                f"{path_a} and {path_b} are not an output and an input",
                advice="Connect sensor.output('...') with part.input('...').",
            )
        return
    kind_a, kind_b = (end.kind if isinstance(end, ConnectorSpec) else type(end) for end in (a, b))
    if kind_a.family != kind_b.family:
        raise ConnectError(
            f"{path_a} is a {kind_a.__name__} and {path_b} is a {kind_b.__name__}; they are unlike and cannot meet",
            advice="A Groove takes a rope's bend; points and frames meet each other.",
        )


def _check_same_connectors(old: Any, new: Any, where: str) -> None:
    if isinstance(old, list) or isinstance(new, list):
        return
    if not isinstance(new, Component):
        raise DeclarationError(f"{new!r} is no component", where=where)
    have = new.connectors()
    for name, wanted in old.connectors().items():
        if name not in have or have[name].family != wanted.family:
            raise DeclarationError(
                f"a {type(new).__name__} cannot take the place of a {type(old).__name__}: it has no connector {name!r}",
                where=where,
                advice=suggestion(name, have),
            )


