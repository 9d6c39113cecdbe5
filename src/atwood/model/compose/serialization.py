"""Scenes as plain data, and back: what is written to a file is what the class does not say by itself.

A component is written as a reference to its class and the values it was given. A model adds what was changed on it
afterwards (see `atwood.model.compose.differences`). Classes are not written but named, and reading a scene imports the
modules that they are in. So that a file cannot have code run that its reader did not choose, only modules of Atwood, of
installed component libraries, and of whom the reader trusts are imported.

`importlib.metadata` knows every way in which packages can be installed, but to import it and to have it look through
all of them takes longer than a short run. So the files that nearly every installation has are read directly first.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from atwood.arguments import FILE, MAPPING, NAME, each, instance, takes
from atwood.errors import AtwoodError, UsageError, check_known, suggestion
from atwood.files import check_readable, write_atomically
from atwood.model.compose.composite import Model
from atwood.model.compose.connection_rules import find_end
from atwood.model.compose.differences import REMOVED, join_path
from atwood.model.compose.written import CHANGES, find_class, write_component
from atwood.model.declare.component import Component
from atwood.model.declare.fields import FieldReference
from atwood.model.declare.function_values import read_function
from atwood.model.declare.parameter_expressions import OPERATIONS, ParameterExpression
from atwood.model.declare.time_functions import StoredFunction

FORMAT = "atwood scene"
VERSION = 1

_MODULES = each(NAME, "names of modules, such as ['my_parts']")
_FOREIGN = "atwood.exchange.fmi.part:FMU"
"""Parts of this class run code that is in a file."""


@takes(scene=instance("a Scene or a Model", Model))
def to_data(scene: Model) -> dict[str, Any]:
    """Return a scene as plain data: dictionaries, lists, text and numbers.

    Parameters
    ----------
    scene
        The scene or model.

    Raises
    ------
    UsageError
        If it is no model, or a class in it cannot be found again by name.
    ParameterError
        If a function of time cannot be written.
    """
    return {"format": FORMAT, "version": VERSION, "scene": write_component(scene, "")}


def _checksum(data: Mapping[str, Any]) -> str:
    text = json.dumps(data.get("scene"), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@takes(data=MAPPING, trust=_MODULES)
def from_data(data: Mapping[str, Any], trust: Iterable[str] = ()) -> Model:
    """Return the scene that plain data stand for; every value is checked as when it is given by hand.

    Classes are looked for in Atwood itself and in installed libraries, those that a package declares in its entry
    points ``atwood.libraries``. Any other module is imported only if it is listed in `trust`: importing it, and making
    its components, runs its code.

    Parameters
    ----------
    data
        As returned by `to_data`.
    trust
        Names of other modules or packages whose classes may be used, such as ``"my_parts"``, with all modules in them;
        and paths of FMUs, as they stand in the data, which run foreign code.

    Raises
    ------
    UsageError
        If the data are no scene, of an unknown version, or name a class that cannot be found, or a module that is
        neither of an installed library nor trusted.
    ParameterError
        If a value is not admissible.
    """
    if data.get("format") != FORMAT:
        raise UsageError("these data are no scene of Atwood", advice="A scene is written with save_scene or to_data.")
    version = data.get("version")
    if version != VERSION or isinstance(version, bool):
        raise UsageError(
            f"the scene is written in version {version!r} of the format and this Atwood reads version {VERSION}",
            advice="Read it with the Atwood that wrote it, or a newer one.",
        )
    if "checksum" in data and data["checksum"] != _checksum(data):
        raise UsageError(
            "the scene is not what was saved: its checksum is that of other contents",
            where="checksum",
            advice="Save it again; if it was changed by hand, take the entry 'checksum' away.",
        )
    _refuse_strangers(data.get("scene"), tuple(trust))
    try:
        scene = _read(data.get("scene"), "scene")
    except RecursionError:
        raise UsageError("the data are nested too deeply for a scene", where="scene", advice="Save it again.") from None
    except AtwoodError:
        raise
    except Exception as error:  # classes work out what they are made of, and may do so with anything
        raise UsageError(
            f"its values cannot be what its classes are made of ({type(error).__name__}: {error})", where="scene"
        ) from error
    if not isinstance(scene, Model):
        raise UsageError(f"a {type(scene).__name__} is no scene", where="scene", advice="Only models are scenes.")
    return scene


@takes(scene=instance("a Scene or a Model", Model), path=FILE)
def save_scene(scene: Model, path: str | Path) -> None:
    """Write a scene to a file, as JSON.

    Parameters
    ----------
    scene
        The scene or model.
    path
        The file; it is written only when the whole scene can be.
    """
    data = to_data(scene)
    text = json.dumps({**data, "checksum": _checksum(data)}, indent=2, allow_nan=False)
    write_atomically(Path(path), lambda part: part.write_text(text + "\n", encoding="utf-8"))


@takes(path=FILE, trust=_MODULES)
def load_scene(path: str | Path, trust: Iterable[str] = ()) -> Model:
    """Read a scene from a file that `save_scene` wrote.

    Parameters
    ----------
    path
        The file.
    trust
        Names of modules with parts of one's own, which may be imported; see `from_data`.

    Raises
    ------
    UsageError
        If the file cannot be read, holds no scene, or names a module that is not trusted.
    """
    check_readable(Path(path))
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"the file cannot be read ({error.strerror})", where=str(path)) from None
    except (ValueError, RecursionError) as error:
        raise UsageError(f"the file is no JSON ({error})", where=str(path)) from None
    try:
        return from_data(data, trust)
    except AtwoodError as error:
        where = f"{path}: {error.where}" if error.where else str(path)
        raise type(error)(error.message, where=where, advice=error.advice) from error


# -- reading -----------------------------------------------------------------------------------------------------


def _refuse_strangers(scene: Any, trust: tuple[str, ...]) -> None:
    """Refuse data that name a module which is neither of an installed library nor trusted; nothing is imported yet."""
    stack, libraries = [("scene", scene)], None
    while stack:
        where, one = stack.pop()
        if isinstance(one, (list, tuple)):
            stack += [(f"{where}[{index}]", inner) for index, inner in enumerate(one)]
        if not isinstance(one, Mapping):
            continue
        stack += [(join_path(where, str(name)), inner) for name, inner in one.items()]
        name = one.get("class")
        module = name.partition(":")[0] if isinstance(name, str) else ""
        if name == _FOREIGN:
            _refuse_foreign(one, where, trust)
        if not module or is_within(module, ("atwood", *trust)):
            continue
        libraries = installed_libraries() if libraries is None else libraries
        if not is_within(module, libraries):
            raise UsageError(
                f"the file names {name!r}, and its module {module!r} is not of an installed library",
                where=where,
                advice=f"If you trust that code, have it imported with trust={module!r}.",
            )


def _refuse_foreign(one: Mapping[str, Any], where: str, trust: tuple[str, ...]) -> None:
    """Refuse a part whose code is in a file that is not trusted."""
    values = one.get("values")
    file = values.get("file") if isinstance(values, Mapping) else None
    if file not in trust:
        raise UsageError(
            f"the file names the FMU {file!r}, which runs foreign code",
            where=where,
            advice=f"If you trust that code, have it loaded with trust={file!r}.",
        )


def _read(data: Any, where: str) -> Component:
    entries = _mapping(data, where, ("class", "values", "parts", "changes"))
    cls = find_class(entries.get("class"), where)
    given = {
        name: _read_value(value, join_path(where, name))
        for name, value in _mapping(entries.get("values"), where).items()
    }
    parts = {
        name: _read_parts(part, join_path(where, name)) for name, part in _mapping(entries.get("parts"), where).items()
    }
    cls = cls._of_values(given, where)
    if not issubclass(cls, Model):
        if "parts" in entries or "changes" in entries:
            raise UsageError(f"a {cls.__name__} has no parts", where=where)
        made = object.__new__(cls)
        Component.__init__(made, **_told_apart(given, cls, where))
        return made
    unknown = sorted(set(parts) - set(cls._prototypes))
    if unknown:
        raise UsageError(
            f"a {cls.__name__} has no part {unknown[0]!r}", where=where, advice=suggestion(unknown[0], cls._prototypes)
        )
    model = object.__new__(cls)  # not by calling the class: what its constructor may add is written as added parts
    Model.__init__(model, **_told_apart(given, cls, where), **parts)
    if not _depends_on_around(model):
        _read_changes(model, entries.get("changes"), where)
    return model


def _depends_on_around(part: Component) -> bool:
    """Return whether a part that belongs to no model yet has values bound to the model that it will be in.

    Its own parts may not be there before; so its changes are read when it has its place.
    """
    return isinstance(part, Model) and any(
        isinstance(part._value(name), ParameterExpression) for name in part._settings
    )


def _place(part: Component, data: Any, where: str, put: Callable[[Component], Component]) -> None:
    """Put a part that was read into its place, and read the changes that had to wait for it."""
    waits = _depends_on_around(part)
    placed = put(part)
    if waits and isinstance(placed, Model):
        _read_changes(placed, data.get("changes"), where)


def _told_apart(values: dict[str, Any], cls: type[Component], where: str) -> dict[str, Any]:
    """Return values if all of them are those of parameters and inputs."""
    for name in values:
        if name not in cls._parameters and name not in cls._signals:
            raise UsageError(
                f"a {cls.__name__} has no parameter {name!r}",
                where=where,
                advice=suggestion(name, [*cls._parameters, *cls._signals]),
            )
    return values


def _read_parts(data: Any, where: str) -> Any:
    if isinstance(data, list):
        return [_read(one, f"{where}[{index}]") for index, one in enumerate(data)]
    return _read(data, where)


def _read_changes(model: Model, data: Any, where: str) -> None:
    changes = _mapping(data, where, CHANGES)
    for path, values in _mapping(changes.get("settings"), where).items():
        for name, value in _mapping(values, join_path(where, path)).items():
            setattr(model[path], name, _read_value(value, f"{path}.{name}"))
    for path, part in _mapping(changes.get("replaced"), where).items():
        owner, name = _owner(model, path)
        _place(_read(part, path), part, path, functools.partial(owner.replace, name))
    for path, part in _mapping(changes.get("added"), where).items():
        owner, name = _owner(model, path)
        if name in owner._attached:  # a part that was made anew with its parameters is there already
            continue
        if isinstance(part, list):
            _place_array(owner, name, part, path)
        else:
            _place(_read(part, path), part, path, functools.partial(owner.add, name))
    for path, joined in _mapping(changes.get("connections"), where).items():
        owner = _model_at(model, path)
        present = set(owner._connections)
        for pair in joined if isinstance(joined, list) else ():
            if not isinstance(pair, list) or len(pair) != 2:
                raise UsageError(f"{pair!r} does not name two ends", where=where)
            if tuple(map(str, pair)) not in present:
                owner.connect(*(find_end(owner, str(end)) for end in pair))
    for path, starts in _mapping(changes.get("starts"), where).items():
        owner = _model_at(model, path)
        for kind, values in _mapping(starts, where).items():
            if kind not in owner._start_values():
                raise UsageError(f"it has no {kind!r}", where=join_path(where, path))
            target = owner._start_values()[kind]
            for key, value in _mapping(values, where).items():
                if value is REMOVED:
                    target.pop(key, None)
                else:
                    target[key] = _read_value(value, key)


def _place_array(owner: Model, name: str, data: list[Any], where: str) -> None:
    parts = _read_parts(data, where)
    waiting = [_depends_on_around(one) for one in parts]
    owner.add(name, parts)
    for index, (one, entries) in enumerate(zip(parts, data, strict=True)):
        if waiting[index]:
            _read_changes(one, entries.get("changes"), f"{where}[{index}]")


def _owner(model: Model, path: str) -> tuple[Model, str]:
    outer, _, name = path.rpartition(".")
    return _model_at(model, outer), name


def _model_at(model: Model, path: str) -> Model:
    found = model[path] if path else model
    if not isinstance(found, Model):
        raise UsageError("it has no parts", where=path)
    return found


def _mapping(data: Any, where: str, known: tuple[str, ...] = ()) -> Mapping[str, Any]:
    """Return entries by name, none where there are no data; `known` are the names allowed, if not any."""
    if data is None:
        return {}
    if not isinstance(data, dict):
        raise UsageError(f"the scene cannot be read: {str(data)[:60]!r} should be entries by name", where=where)
    for key in data if known else ():
        check_known(key, known, f"the scene cannot be read: unknown entry {key!r}", where=where)
    return data


def _read_value(value: Any, where: str) -> Any:
    if not isinstance(value, Mapping):
        return value
    if set(value) == {"function"}:
        return StoredFunction(value["function"], where)
    if set(value) - {"letters"} == {"function", "arguments", "text"}:
        return read_function(value["function"], value["arguments"], value["text"], where, value.get("letters", ()))
    if set(value) == {"bound"}:
        return _read_bound(value["bound"], where)
    raise UsageError(f"the value {str(value)[:60]!r} cannot be read", where=where)


def _read_bound(written: Any, where: str) -> Any:
    if isinstance(written, str):
        return FieldReference(written)
    if isinstance(written, (int, float)) and not isinstance(written, bool) and abs(written) <= sys.float_info.max:
        return float(written)  # in which powers cannot grow without end
    operation = written[0] if isinstance(written, list) and written else None
    if not isinstance(operation, str) or operation not in OPERATIONS:
        raise UsageError(f"the bound value {str(written)[:60]!r} cannot be read", where=where)
    operands = tuple(_read_bound(one, where) for one in written[1:])
    if len(operands) != (1 if operation == "neg" else 2):
        raise UsageError(f"the bound value {str(written)[:60]!r} has a wrong number of operands", where=where)
    return ParameterExpression(operation, operands, None)


GROUP = "atwood.libraries"
"""The entry point group in which component libraries make themselves known."""


def declared_libraries() -> Iterator[str]:
    """Yield the modules of libraries that are declared in files on the import path; there may be others."""
    for folder in sys.path:
        try:
            names = os.listdir(folder or os.curdir)
        except OSError:  # not a folder
            continue
        for name in names:
            if name.endswith((".dist-info", ".egg-info")):
                try:
                    with open(os.path.join(folder, name, "entry_points.txt"), encoding="utf-8") as file:
                        text = file.read()
                except (OSError, UnicodeDecodeError):
                    continue
                if GROUP in text:
                    yield from _entries(text)


def _entries(text: str) -> Iterator[str]:
    """Yield the values of the group's entries."""
    section = ""
    for line in text.splitlines():
        stripped = line.strip()
        if stripped.startswith("[") and stripped.endswith("]"):
            section = stripped[1:-1].strip()
        elif section == GROUP and "=" in stripped and not stripped.startswith(("#", ";")):
            yield stripped.partition("=")[2].strip()


def all_libraries() -> list[str]:
    """Return the modules of all libraries that are installed in any way."""
    from importlib.metadata import entry_points

    return [entry.value for entry in entry_points(group=GROUP)]


def installed_libraries() -> tuple[str, ...]:
    """Return the modules of all libraries, however they are declared."""
    return *declared_libraries(), *all_libraries()


def is_within(module: str, packages: Iterable[str]) -> bool:
    """Return whether a module is one of some packages, or in one of them and no command of it."""
    is_command = module.endswith(".__main__")
    return any(module == one or (module.startswith(f"{one}.") and not is_command) for one in packages)
