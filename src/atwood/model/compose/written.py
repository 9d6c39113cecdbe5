"""Components, their differences and their values as plain data."""

from __future__ import annotations

import importlib
import sys
from typing import Any

from atwood.errors import AtwoodError, UsageError, suggestion
from atwood.model.compose.composite import Model
from atwood.model.compose.connection_rules import Parts
from atwood.model.compose.differences import Differences, find_differences, join_path
from atwood.model.declare.component import Component
from atwood.model.declare.fields import FieldReference
from atwood.model.declare.function_values import Function
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.model.declare.time_functions import write_function

CHANGES = ("settings", "replaced", "added", "connections", "starts")
"""What a model can have that its class does not say."""


def write_component(component: Component, path: str) -> dict[str, Any]:
    """Return a component as plain data: its class, the values it was given, and what its parts were made of."""
    written: dict[str, Any] = {"class": _class_name(component._written_class(), path)}
    values = {name: _write_value(value, join_path(path, name)) for name, value in component._settings.items()}
    if values:
        written["values"] = values
    if isinstance(component, Model):
        parts = {name: _write_parts(part, join_path(path, name)) for name, part in component._given.items()}
        if parts:
            written["parts"] = parts
        changes = _write_differences(find_differences(component), path)
        if changes:
            written["changes"] = changes
    return written


def _write_parts(parts: Parts, path: str) -> Any:
    if isinstance(parts, list):
        return [write_component(one, f"{path}[{index}]") for index, one in enumerate(parts)]
    return write_component(parts, path)


def _write_differences(differences: Differences, path: str) -> dict[str, Any]:
    changes = {
        "settings": {
            part: {name: _write_value(value, join_path(path, f"{part}.{name}")) for name, value in values.items()}
            for part, values in differences.settings.items()
        },
        "replaced": {name: _write_parts(part, join_path(path, name)) for name, part in differences.replaced.items()},
        "added": {name: _write_parts(parts, join_path(path, name)) for name, parts in differences.added.items()},
        "connections": {part: [list(pair) for pair in joined] for part, joined in differences.joined.items()},
        "starts": {
            part: {
                kind: {key: _write_value(value, key) for key, value in values.items()}
                for kind, values in starts.items()
            }
            for part, starts in differences.starts.items()
        },
    }
    return {name: change for name, change in changes.items() if change}


def _write_value(value: Any, where: str) -> Any:
    if isinstance(value, FieldReference):
        return {"bound": value.name}
    if isinstance(value, ParameterExpression):
        return {"bound": [value.operation, *(_write_operand(one) for one in value.arguments)]}
    if isinstance(value, tuple):
        return list(value)
    if isinstance(value, Function):
        letters = {"letters": list(value.letters)} if value.letters else {}
        return {"function": value.steps(where), "arguments": list(value.arguments), "text": value.text, **letters}
    if callable(value):
        return {"function": write_function(value, where)}
    return value


def _write_operand(operand: Any) -> Any:
    if isinstance(operand, FieldReference):
        return operand.name
    if isinstance(operand, ParameterExpression):
        return [operand.operation, *(_write_operand(one) for one in operand.arguments)]
    return float(operand)


def _class_name(cls: type[Component], path: str) -> str:
    name = f"{cls.__module__}:{cls.__qualname__}"
    try:
        same = find_class(name, path) is cls
    except AtwoodError:
        same = False
    if not same:
        raise UsageError(
            f"the class {cls.__qualname__} could not be found again by its name",
            where=path or cls.__name__,
            advice="Write the class at the outer level of a module, not inside a function.",
        )
    return name


def find_class(name: Any, where: str) -> type[Component]:
    """Return the class that a saved name means, which is imported."""
    module_name, _, qualified = name.partition(":") if isinstance(name, str) else ("", "", "")
    if not module_name or not qualified:
        raise UsageError(f"{name!r} does not name a class", where=where, advice="A class is named 'module:Class'.")
    advice = (
        f"The module must be one that Python can import: install it, start Python in its folder, or, for a scene "
        f"in a file {module_name}.py, put the folder of that file on the path."
    )
    if module_name == "__main__":
        advice = "It was declared in a script that was run; put the class into a module of its own and save it again."
    try:
        found: Any = sys.modules.get(module_name) or importlib.import_module(module_name)
    except (Exception, SystemExit) as error:  # importing runs code of others
        raise UsageError(
            f"the module {module_name!r} cannot be imported ({type(error).__name__}: {error})",
            where=where,
            advice=advice,
        ) from error
    for step in qualified.split("."):
        known = [key for key in vars(found) if not key.startswith("_")]
        found = vars(found).get(step) if isinstance(found, type) else getattr(found, step, None)
        if found is None:
            raise UsageError(
                f"there is no class {qualified!r} in the module {module_name!r}",
                where=where,
                advice=advice if module_name == "__main__" else suggestion(step, known) or advice,
            )
        if not isinstance(found, type):
            break
    if not isinstance(found, type) or not issubclass(found, Component):
        raise UsageError(f"{name!r} is no component", where=where, advice="Name a class derived from Component.")
    return found
