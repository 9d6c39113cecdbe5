"""What Atwood offers, written down: names, signatures, options of the command line, entry points.

``python -m tests.signatures write`` writes it anew after a change that is meant; the difference is then read in review.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import sys
import tomllib
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

ROOT = Path(__file__).resolve().parents[1]
FILE = Path(__file__).with_name("public_signatures.txt")

FACADES = (
    "atwood",
    "atwood.checking",
    "atwood.functions",
    "atwood.plotting",
    "atwood.reporting",
    "atwood.solids",
    "atwood.study",
)


def text() -> str:
    """Return all that is public, one thing a line."""
    lines = [f"This file is written by `python -m tests.signatures write`.\n\n# Entry points\n\n{_entry_points()}"]
    described: dict[int, str] = {}
    for name in FACADES:
        room = importlib.import_module(name)
        lines.append(f"\n# {name}\n")
        for one in room.__all__:
            thing = getattr(room, one)
            if id(thing) in described and callable(thing):
                lines.append(f"{one} is {described[id(thing)]}")
                continue
            described[id(thing)] = f"{name}.{one}"
            lines += _lines(one, thing)
    lines += ["\n# Command line\n", *_commands()]
    return "\n".join(lines) + "\n"


def _entry_points() -> str:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    scripts = [f"{name} = {target}" for name, target in project["scripts"].items()]
    groups = project["entry-points"].items()
    return "\n".join([*scripts, *(f"{group}: {name} = {to}" for group, all_ in groups for name, to in all_.items())])


def _lines(name: str, thing: Any) -> Iterator[str]:
    if isinstance(thing, type):
        yield from _class(name, thing)
    elif callable(thing):
        yield f"def {name}{_signature(thing)}"
    elif name == "__version__":
        yield "__version__: str"
    else:
        yield f"{name}: {type(thing).__name__}" if type(thing).__module__ != "typing" else name


def _class(name: str, kind: type) -> Iterator[str]:
    bases = ", ".join(one.__name__ for one in kind.__bases__ if one is not object and one.__name__[0] != "_")
    yield f"class {name}({bases})" if bases else f"class {name}"
    if issubclass(kind, BaseException):
        return
    if "__init__" in vars(kind) or "__dataclass_fields__" in vars(kind):
        yield f"    def __init__{_signature(kind)}"
    fields = getattr(kind, "__dataclass_fields__", {})
    known = {member for base in kind.__mro__[1:] if base in _classes() for member in dir(base)}
    known |= {member for base in kind.__mro__ if not base.__module__.startswith("atwood") for member in vars(base)}
    for member in sorted({*dir(kind), *fields}):
        if member.startswith("_") or (member in known and member not in vars(kind)):
            continue
        found = inspect.getattr_static(kind, member, None)
        if member in fields:
            yield f"    {member}: {_plain(fields[member].type)}"
        elif isinstance(found, (classmethod, staticmethod)):
            yield f"    {type(found).__name__} def {member}{_signature(found.__func__)}"
        elif inspect.isfunction(found):
            yield f"    def {member}{_signature(found)}"
        elif isinstance(found, property) or type(found).__name__ == "cached_property":
            read = found.fget if isinstance(found, property) else found.func
            yield f"    property {member}: {_plain(inspect.signature(read).return_annotation)}"
        else:
            yield f"    {member}"


@functools.cache
def _classes() -> set[type]:
    """Return all public classes, whose members need no repetition in what derives from them."""
    rooms = [importlib.import_module(name) for name in FACADES]
    return {one for room in rooms for one in (getattr(room, name) for name in room.__all__) if isinstance(one, type)}


def _signature(thing: Any) -> str:
    found = inspect.signature(thing)
    given = [one.replace(annotation=_Words(one.annotation)) for one in found.parameters.values()]
    if isinstance(thing, type):
        return str(found.replace(parameters=given, return_annotation=inspect.Signature.empty))
    return str(found.replace(parameters=given, return_annotation=_Words(found.return_annotation)))


class _Words:
    """An annotation that prints as it was written."""

    def __new__(cls, annotation: Any) -> Any:
        return annotation if annotation is inspect.Parameter.empty else super().__new__(cls)

    def __init__(self, annotation: Any) -> None:
        self.annotation = annotation

    def __repr__(self) -> str:
        return _plain(self.annotation)


def _plain(annotation: Any) -> str:
    if annotation is inspect.Parameter.empty:
        return ""
    if isinstance(annotation, str):
        return annotation
    return annotation.__name__ if isinstance(annotation, type) else str(annotation).replace("typing.", "")


def _commands() -> Iterator[str]:
    from atwood.cli.app import main

    group = typing.cast(click.Group, main)
    context = click.Context(group)
    for name, command in ((one, group.get_command(context, one)) for one in group.list_commands(context)):
        context = click.Context(command)
        arguments = [one.make_metavar(context) for one in command.params if isinstance(one, click.Argument)]
        yield " ".join(["atwood", name, *arguments])
        for option in command.params:
            if isinstance(option, click.Option):
                kind = option.type
                values = "|".join(map(str, kind.choices)) if isinstance(kind, click.Choice) else kind.name
                several = ", repeated" if option.multiple else ""
                yield f"    {', '.join([*option.opts, *option.secondary_opts])} ({values}{several})"


if __name__ == "__main__":
    if sys.argv[1:] == ["write"]:
        FILE.write_text(text(), encoding="utf-8")
    else:
        print(text(), end="")
