"""`atwood check`: the conformance test of components."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import click

from atwood.arguments import FLAG
from atwood.checking import CheckReport, check
from atwood.cli.command import Request, command
from atwood.cli.errors import FAILED
from atwood.cli.output import print_json, writer
from atwood.cli.parts import library_parts, looks_like_a_part
from atwood.cli.scenes import load_file
from atwood.errors import UsageError, check_known, suggestion
from atwood.model.compose.composite import Model
from atwood.model.declare.component import Component
from atwood.table import table


def check_components(request: Request) -> None:
    """Check the components of TARGET as the parts of the library are checked.

    TARGET is FILE.py for all components that the file defines, FILE.py:NAME for one, or the name of a library's part.
    Units of laws, joints against constraints, forces against energies, observables, both forms, all spaces. The exit
    code is 1 if something is wrong.
    """
    reports = [check(one, run=request.run) for one in _components(request.target)]
    if request.as_json:
        print_json({"ok": all(one.ok for one in reports), "components": [one.to_dict() for one in reports]})
    else:
        _print(reports)
    if not all(one.ok for one in reports):
        click.get_current_context().exit(FAILED)


def _components(target: str) -> list[Any]:
    file_text, colon, name = target.rpartition(":")
    if not colon or not file_text.endswith(".py"):
        file_text, name = target, ""
    if looks_like_a_part(target):
        parts = library_parts()
        check_known(target, parts, f"no library has a part {target!r}", where="")
        return [parts[target]]
    if not file_text.endswith(".py"):
        raise UsageError(f"{target!r} is no file", advice="Write FILE.py, FILE.py:NAME or the name of a part.")
    found = _defined(load_file(Path(file_text)))
    if name and name not in found:
        raise UsageError(f"the file defines no component {name!r}", where=target, advice=suggestion(name, found))
    if not found:
        raise UsageError("it defines no component", where=file_text)
    return [found[name]] if name else list(found.values())


def _defined(module: ModuleType) -> dict[str, Any]:
    """Return the components that a module itself defines: classes, and objects that have values."""
    found: dict[str, Any] = {}
    for name, value in vars(module).items():
        is_class = isinstance(value, type) and issubclass(value, Component) and value.__module__ == module.__name__
        kind = value if is_class else type(value)
        if name.startswith("_") or not (is_class or isinstance(value, Component)) or issubclass(kind, Model):
            continue
        found[name] = value
    with_values = {type(value) for value in found.values() if not isinstance(value, type)}
    return {name: value for name, value in found.items() if value not in with_values}


def _print(reports: Sequence[CheckReport]) -> None:
    rows = []
    for one in reports:
        sound = "nothing to check" if one.is_empty else "sound"
        result = sound if one.ok else f"{len(one.failures)} wrong"
        rows.append((one.component, ", ".join(one.spaces), str(sum(one.tests.values())), result))
    out = writer()
    out.show(table(("component", "spaces~", "comparisons", "result"), rows))
    for one in reports:
        for finding in one.findings:
            place = ", ".join(word for word in (finding.test, finding.law, finding.space) if word)
            gravity = (f"{finding.gravity} ", _STYLES[finding.gravity])
            out.line((one.component, "bold"), (" ", ""), gravity, (f"({place}): {finding.message}", ""))


_STYLES = {"failure": "red", "note": "dim"}

COMMAND = command("check", check_components, argument="target", more={"run": (FLAG, True)})
