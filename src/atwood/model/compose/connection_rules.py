"""Rules of composition: which parts a model takes, which ends may be connected, and which parts can be exchanged."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any, TypeAlias

from atwood.arguments import NAME, check, show
from atwood.errors import ConnectError, DeclarationError, UsageError, suggestion
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.component import Component
from atwood.model.declare.connectors import Connector, ConnectorSpec, InputRef, OutputRef
from atwood.model.declare.declaring import check_reserved
from atwood.model.values.units import Unit, parse_unit

Parts: TypeAlias = Component | list[Component]
"""What a name in a model stands for: a part, or an array of parts."""


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
        When the class is made, if the two cannot meet.
    """
    return Connection(a, b)


def named_parts(parts: Mapping[str, Parts]) -> Iterator[tuple[str, Component]]:
    """Return every part with its own name, the elements of an array as ``name[0]``, ``name[1]``, ..."""
    for name, part in parts.items():
        if isinstance(part, list):
            yield from ((f"{name}[{index}]", one) for index, one in enumerate(part))
        else:
            yield name, part


def class_path(end: Any, names: Mapping[int, str], where: str) -> str:
    """Return the path of an end that was written in the class body of a model."""
    _check_is_end(end, where)
    if isinstance(end, ConnectorSpec):
        return end.name
    steps = [end.name]
    component = end.component
    while component._parent is not None:
        steps.append(component._name)
        component = component._parent
    if id(component) not in names:
        raise ConnectError("it belongs to a part that is not declared in the class body", where=f"{where}.{end.name}")
    return ".".join([names[id(component)], *reversed(steps)])


def relative_path(end: Any, model: Component) -> str:
    """Return the path of an end, as seen from the model that joins it."""
    _check_is_end(end, model.path or type(model).__name__)
    if isinstance(end, ConnectorSpec):
        if model.connector_specs().get(end.name) is not end:
            raise ConnectError("it is declared by another class", where=end.name, advice="Connect things like rod.a.")
        return end.name
    names = [end.name]
    component: Component | None = end.component
    while component is not None and component is not model:
        names.append(component._name or type(component).__name__)
        component = component._parent
    path = ".".join(reversed(names))
    if component is None:
        raise ConnectError("it belongs to a part that is not in this model", where=path, advice="Add the part first.")
    return path


def _check_is_end(end: Any, where: str) -> None:
    if isinstance(end, ConnectorSpec) and end.count is not None:
        end = (end,)
    if isinstance(end, tuple) and end and all(isinstance(one, (Connector, ConnectorSpec)) for one in end):
        name = end[0].name.partition("[")[0]
        raise ConnectError(
            f"{name!r} is an array of connectors",
            where=where,
            advice=f"Connect its elements one by one, as in {name}[0]; in a method build(self) if their number varies.",
        )
    if not isinstance(end, (Connector, ConnectorSpec, InputRef, OutputRef)):
        advice = "Connect things like rod.a or mass.point; signals as table.output('value') and drive.input('motion')."
        if isinstance(end, Component):
            where = end.path or where
            advice = f"Name one of its connectors: {', '.join(end.connector_specs())}."
        raise ConnectError(f"{show(end)} is no connector", where=where, advice=advice)


def check_ends(a: Any, b: Any, path_a: str, path_b: str) -> None:
    """Refuse a connection of an end to itself, or of unlike ends."""
    if path_a == path_b:
        raise ConnectError("it is joined to itself", where=path_a, advice="Connect it to another connector.")
    if isinstance(a, (InputRef, OutputRef)) or isinstance(b, (InputRef, OutputRef)):
        if isinstance(a, InputRef) and isinstance(b, OutputRef):
            _check_signal_units(b, a, path_b, path_a)
        elif isinstance(a, OutputRef) and isinstance(b, InputRef):
            _check_signal_units(a, b, path_a, path_b)
        else:
            raise ConnectError(
                f"{path_a} and {path_b} are not an output and an input",
                advice="Connect sensor.output('...') with part.input('...').",
            )
        return
    kind_a, kind_b = (end.kind if isinstance(end, ConnectorSpec) else type(end) for end in (a, b))
    if kind_a.family != kind_b.family:
        raise ConnectError(
            f"{path_a} is a {kind_a.__name__} and {path_b} is a {kind_b.__name__}; they are unlike and cannot meet",
            advice=_of_family(a, kind_b, path_a)
            or _of_family(b, kind_a, path_b)
            or "A Groove takes a rope's bend, a Shaft or a Slide a gear; points and frames meet each other.",
        )


def _of_family(end: Any, kind: type[Connector], path: str) -> str:
    """Return which connectors of an end's part could be joined to one of another kind; nothing where none could."""
    if not isinstance(end, Connector):
        return ""
    part = path.removesuffix(end.name)
    fits = [part + name for name, one in end.component.connectors().items() if one.family == kind.family]
    return f"Connect {' or '.join(fits)}, a {kind.__name__}, instead of {path}." if fits else ""


def _check_signal_units(source: OutputRef, target: InputRef, path_source: str, path_target: str) -> None:
    given, wanted = output_unit(source), target.component.signal_specs()[target.name].unit
    if given is not None and not given.has_dimension_of(wanted):
        advice = f"Connect an output in {wanted.text}, or put a part between that makes one of it."
        raise ConnectError(f"{path_source} is in {given.text} and {path_target} takes {wanted.text}", advice=advice)


def output_unit(output: OutputRef) -> Unit | None:
    """Return the unit of an observable; None if it is not known."""
    for law in output.component.laws("observable"):
        if law.name == output.name.split(".")[0]:
            return parse_unit(law.options.unit)
    return None


def check_same_connectors(old: Parts, new: Any, where: str) -> None:
    """Refuse a part, or an array of parts, that cannot take the place of another."""
    if isinstance(old, list) or isinstance(new, list):
        if not isinstance(new, list) or not isinstance(old, list) or len(old) != len(new):
            wanted = f"an array of {len(old)} parts" if isinstance(old, list) else "one part"
            raise DeclarationError(f"here must be {wanted}", where=where)
        for index, (old_one, new_one) in enumerate(zip(old, new, strict=True)):
            check_same_connectors(old_one, new_one, f"{where}[{index}]")
        return
    if not isinstance(new, Component):
        raise DeclarationError(f"{show(new)} is no component", where=where, advice="Give a part, such as Rod().")
    have = new.connectors()
    for name, connector in old.connectors().items():
        if name not in have or have[name].family != connector.family:
            raise DeclarationError(
                f"a {type(new).__name__} cannot take the place of a {type(old).__name__}: it has no connector {name!r}",
                where=where,
                advice=suggestion(name, have),
            )


def find_end(model: Component, path: str) -> Connector | InputRef | OutputRef:
    """Return the end at a dotted path within a model."""
    component, steps = model, path.split(".")
    while len(steps) > 1 and steps[0] in component._children():
        component = component._children()[steps[0]]
        steps = steps[1:]
    name = ".".join(steps)
    connector = component._connector_named(name)
    if connector is not None:
        return connector
    if name in component.signal_specs():
        return component.input(name)
    if steps[0] in component.output_names():
        return component.output(name)
    raise UsageError(
        f"there is no connector, input or output {name!r}",
        where=component.path or type(component).__name__,
        advice=suggestion(name, [*component.connectors(), *component._children()]),
    )


def declared_parts(cls: type[Component], inherited: dict[str, Parts]) -> dict[str, Parts]:
    """Return the parts that a class declares and inherits, each an object of its own."""
    found = dict(inherited)
    for name, value in list(vars(cls).items()):
        is_array = isinstance(value, list) and bool(value) and all(isinstance(one, Component) for one in value)
        if isinstance(value, Component) or is_array:
            check_reserved(cls, name)
            if name in inherited:
                check_same_connectors(inherited[name], value, f"{cls.__name__}.{name}")
            found[name] = value
        elif name in inherited:
            raise DeclarationError(
                f"the part {name!r} is declared again as {value!r}, which is no component", where=cls.__name__
            )
    names: dict[int, str] = {}
    for name, part in named_parts(found):
        if id(part) in names:
            raise DeclarationError(
                f"one object is declared as {names[id(part)]!r} and as {name!r}",
                where=cls.__name__,
                advice="Give each its own object.",
            )
        names[id(part)] = name
        if not part._declared:
            object.__setattr__(part, "_declared", f"{cls.__name__}.{name}")
    return found


def declared_connection(cls: type[Component], connection: Any, names: Mapping[int, str]) -> tuple[str, str]:
    """Return the paths of the two ends of a connection that was written in a class body."""
    if not isinstance(connection, Connection):
        raise ConnectError(
            f"{connection!r} is no connection", where=cls.__name__, advice="Write connect(rod.a, mass.point)."
        )
    pair = class_path(connection.a, names, cls.__name__), class_path(connection.b, names, cls.__name__)
    check_ends(connection.a, connection.b, *pair)
    return pair


_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")


def check_new_parts(model: Component, name: str, part: Any, taken: Collection[str]) -> None:
    """Refuse a part, or an array of parts, that a model cannot take under a name."""
    where = model.path or type(model).__name__
    check(NAME, name, "name", f"{where}.add", DeclarationError)
    if not _NAME.match(name):
        advice = "Use letters, digits and _, a letter first."
        raise DeclarationError(f"{name!r} cannot be the name of a part", where=where, advice=advice)
    if name in taken:
        advice = "Use replace, or another name."
        raise DeclarationError(f"there is a part {name!r} already", where=where, advice=advice)
    if hasattr(type(model), name):
        problem = f"the name {name!r} has a meaning of its own in a {type(model).__name__}"
        raise DeclarationError(problem, where=where, advice="Choose another name.")
    parts: list[Any] = part if isinstance(part, list) else [part]
    if not parts:
        raise DeclarationError(f"the array {name!r} has no parts", where=where, advice="Give at least one.")
    for one in parts:
        _check_is_free(model, name, one, where)
    if len({id(one) for one in parts}) < len(parts):
        advice = "Give each its own object."
        raise DeclarationError(f"the array {name!r} holds one object twice", where=where, advice=advice)


def _check_is_free(model: Component, name: str, part: Any, where: str) -> None:
    if not isinstance(part, Component):
        advice = "Give a part, such as Rod(), or a list of parts."
        if isinstance(part, type):
            advice = f"Call the class: {part.__name__}() and not {part.__name__}."
        problem = f"the part {name!r} cannot be {show(part)}, which is no component"
        raise DeclarationError(problem, where=where, advice=advice)
    if part._declared or part._parent is not None:
        problem = f"the part given as {name!r} is already there as {part._declared or part.path!r}"
        raise DeclarationError(problem, where=where, advice="Give each its own object; copy() makes one.")
    around: Component | None = model
    while around is not None:
        if around is part:
            advice = "Give it a copy(), or another model."
            raise DeclarationError(f"a model cannot be a part of itself, as {name!r}", where=where, advice=advice)
        around = around._parent
