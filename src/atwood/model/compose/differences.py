"""What was changed on a model since its class made it: found, repeated on a model made anew, and kept in files.

A model is what its class declares and builds, and what was changed afterwards: parameters of its parts, parts put in
the place of others, parts and connections added, start values. A `Snapshot` is taken when the class has done its
work; `find_differences` compares with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

from atwood.errors import ConnectError, UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.connection_rules import Parts, find_end, named_parts
from atwood.model.declare.component import Component

if TYPE_CHECKING:
    from atwood.model.compose.composite import Model


REMOVED: Any = None
"""Stands for a start value that was taken away."""


@dataclass(frozen=True)
class Snapshot:
    """A model as its class made it.

    Attributes
    ----------
    parts
        By path: a token of the part's identity, its settings, and the snapshot that it took itself.
    joined
        Connections of each model by path; the model itself has the empty path.
    starts
        Start and guess of each scene by path.
    """

    parts: Mapping[str, tuple[object, Mapping[str, Any], Snapshot | None]]
    joined: Mapping[str, tuple[tuple[str, str], ...]]
    starts: Mapping[str, Mapping[str, Mapping[str, Any]]]


@dataclass
class Differences:
    """What was changed on a model; all by path from that model.

    Attributes
    ----------
    settings
        Parameters and signals of parts.
    replaced
        Parts put in the place of others.
    added
        Parts, and arrays of parts.
    joined
        Connections, by path of the model that holds them.
    starts
        Start values, by path of the scene, ``"start"`` or ``"guess"``, and key.
    """

    settings: dict[str, dict[str, Any]] = field(default_factory=dict)
    replaced: dict[str, Component] = field(default_factory=dict)
    added: dict[str, Parts] = field(default_factory=dict)
    joined: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    starts: dict[str, dict[str, dict[str, Any]]] = field(default_factory=dict)


def take_snapshot(model: Model) -> Snapshot:
    """Return a model as it is now, for comparison."""
    parts: dict[str, tuple[object, Mapping[str, Any], Snapshot | None]] = {}
    joined: dict[str, tuple[tuple[str, str], ...]] = {}
    starts: dict[str, Mapping[str, Mapping[str, Any]]] = {}
    for path, one in _walk(model, ""):
        if path:
            parts[path] = (one._token, one._settings, getattr(one, "_baseline", None))
        if hasattr(one, "_connections"):
            joined[path] = tuple(one._connections)
            starts[path] = {name: dict(values) for name, values in one._start_values().items()}
    return Snapshot(parts, joined, starts)


def _walk(component: Component, path: str) -> Iterator[tuple[str, Any]]:
    yield path, component
    for name, child in component._children().items():
        yield from _walk(child, join_path(path, name))


def join_path(path: str, name: str) -> str:
    """Return the path of something inside a component."""
    return f"{path}.{name}" if path else name


def find_differences(model: Model) -> Differences:
    """Return what was changed on a model since its class made it; added and replaced parts are the ones there."""
    differences = Differences()
    _compare(model, "", model._baseline, "", differences)
    return differences


def _compare(model: Model, path: str, base: Snapshot, base_path: str, differences: Differences) -> None:
    """Compare a model with a snapshot, in which it is found at another path."""
    before = set(base.joined.get(base_path, ()))
    joined = [pair for pair in model._connections if pair not in before]
    if joined:
        differences.joined[path] = joined
    _compare_starts(model, path, base.starts.get(base_path, {}), differences)
    for name, given in model._attached.items():
        named = list(named_parts({name: given}))
        if all(join_path(base_path, full) not in base.parts for full, _ in named):
            differences.added[join_path(path, name)] = given
            continue
        for full, part in named:
            own, own_base = join_path(path, full), join_path(base_path, full)
            token, settings, snapshot = base.parts[own_base]
            if part._token is not token:
                differences.replaced[own] = part
                continue
            changed = {
                key: value for key, value in part._settings.items() if key not in settings or settings[key] != value
            }
            if changed:
                differences.settings[own] = changed
            if hasattr(part, "_connections"):
                model_part: Any = part
                if model_part._baseline is snapshot:
                    _compare(model_part, own, base, own_base, differences)
                else:  # made anew since, from other parameters
                    _compare(model_part, own, model_part._baseline, "", differences)


def _compare_starts(model: Model, path: str, before: Mapping[str, Mapping[str, Any]], differences: Differences) -> None:
    for name, values in model._start_values().items():
        old = before.get(name, {})
        changed = {key: value for key, value in values.items() if key not in old or old[key] != value}
        changed.update({key: REMOVED for key in old if key not in values})
        if changed:
            differences.starts.setdefault(path, {})[name] = changed


def copy_parts(parts: Parts) -> Any:
    """Return a copy of a part, or of an array of parts, that belongs to no model."""
    return [one.copy() for one in parts] if isinstance(parts, list) else parts.copy()


def apply_differences(model: Model, differences: Differences) -> None:
    """Repeat changes on a model; what is there already, or whose part is gone, is left out."""
    for path, values in differences.settings.items():  # outer parts come first, so that the inner ones are there
        part = _part_at(model, path)
        if part is not None:
            for name, value in values.items():
                setattr(part, name, value)
    for path, replacement in differences.replaced.items():
        owner, name = _owner_of(model, path)
        if owner is not None and name in owner.parts:
            owner.replace(name, replacement)
    for path, parts in differences.added.items():
        owner, name = _owner_of(model, path)
        if owner is not None and name not in owner._attached:
            owner.add(name, copy_parts(parts))
    for path, joined in differences.joined.items():
        owner = _part_at(model, path)
        present = set(owner._connections) if owner is not None else set()
        for a, b in joined if owner is not None else ():
            if (a, b) not in present:
                check_end(owner, a, b)
                check_end(owner, b, a)
                owner.connect(find_end(owner, a), find_end(owner, b))
    for path, starts in differences.starts.items():
        owner = _part_at(model, path)
        for name, changed in starts.items() if owner is not None else ():
            target = owner._start_values()[name]
            for key, value in changed.items():
                if value is REMOVED:
                    target.pop(key, None)
                else:
                    target[key] = value


def _owner_of(model: Model, path: str) -> tuple[Any, str]:
    outer, _, name = path.rpartition(".")
    return _part_at(model, outer), name


def _part_at(model: Model, path: str) -> Any:
    component: Component | None = model
    for step in path.split(".") if path else ():
        component = component._children().get(step) if component is not None else None
    return component


def check_end(model: Component, path: str, other: str) -> None:
    """Refuse to lose an end of a connection that is to stay."""
    try:
        find_end(model, path)
    except UsageError:
        raise ConnectError(
            f"it is connected with {other} and would no longer be there",
            where=join_path(model.path, path),
            advice="Connections cannot be taken away; make the model anew.",
        ) from None


def check_pairs(joined: Iterable[tuple[str, str]], prefix: str, new: Component) -> None:
    """Refuse a component that lacks an end that connections with a prefix name."""
    for pair in joined:
        for end, other in (pair, pair[::-1]):
            if end.startswith(prefix):
                check_end(new, end[len(prefix) :], other)


def check_connections(around: Any, name: str, new: Component) -> None:
    """Refuse a component that lacks an end that the models around have connected."""
    prefix = f"{name}."
    while around is not None:
        check_pairs(around._connections, prefix, new)
        prefix, around = f"{around._name}.{prefix}", around._parent


def take_over(old: Any, new: Any) -> None:
    """Give an object the state of another, part by part, so that whoever holds its parts still holds the real ones."""
    kept: dict[int, Component] = {}
    for name, part in new._children().items():
        known = old._children().get(name)
        if known is not None and type(known) is type(part) and known is not part:
            take_over(known, part)
            kept[id(part)] = known
    for name, part in old._children().items():
        if new._children().get(name) is None or id(new._children()[name]) not in kept:
            object.__setattr__(part, "_parent", None)
    place = {"_parent": old._parent, "_name": old._name}
    starts = old._start_values() if hasattr(old, "_connections") else {}
    old.__dict__.clear()
    old.__dict__.update({**new.__dict__, **place})
    if hasattr(old, "_connections"):
        attached = {
            name: [kept.get(id(one), one) for one in part] if isinstance(part, list) else kept.get(id(part), part)
            for name, part in old._attached.items()
        }
        old._hold(attached)
        for name, values in starts.items():
            now = dict(getattr(new, name))
            values.clear()
            values.update(now)
            object.__setattr__(old, name, values)
