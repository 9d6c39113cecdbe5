"""Errors of a component about its names: what is unknown, missing or given without a name."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

from atwood.arguments import show
from atwood.errors import DeclarationError, MissingNameError, ParameterError, near_matches, suggestion
from atwood.model.declare.fields import ParameterSpec

__all__ = [
    "given_without_name",
    "must_be_given",
    "no_private_name",
    "no_such_name",
    "no_such_parameter",
    "no_such_reaction",
]


def given_without_name(kind: str, parameters: Iterable[str], value: Any) -> ParameterError:
    """Return the error of a value that is given by its place, with the call that names the first parameter."""
    first = next(iter(parameters), "")
    call = f"{kind}({f'{first}={show(value)}' if first else ''})"
    return ParameterError("its parameters are given by name", where=kind, advice=f"Write {call}.")


def must_be_given(kind: str, spec: ParameterSpec) -> ParameterError:
    """Return the error of a parameter without default that was not given."""
    unit = "" if spec.unit.text == "1" else f" Unit {spec.unit.text}."
    return ParameterError(
        "it has no default and must be given", where=f"{kind}.{spec.name}", advice=f"{spec.name} is: {spec.doc}{unit}"
    )


def no_such_name(
    kind: str, path: str, name: str, there: Collection[str], connectors: Collection[str]
) -> MissingNameError:
    """Return the error that says what there is instead of a name: something alike, and the connectors."""
    close = near_matches(name, there)
    advice = suggestion(name, close) if close else ""
    if connectors:
        advice += f"{' ' if advice else ''}Its connectors are {', '.join(connectors)}."
    return MissingNameError(f"a {kind} has no {name!r}", where=path or kind, advice=advice)


def no_such_parameter(kind: str, path: str, name: str, known: Collection[str], otherwise: str = "") -> ParameterError:
    """Return the error of a name that is no parameter and no input, with advice where nothing is called alike."""
    advice = suggestion(name, known) or otherwise
    return ParameterError(f"a {kind} has no parameter {name!r}", where=path or kind, advice=advice)


def no_such_reaction(path: str, name: str, readable: Collection[str], is_rigid: bool) -> DeclarationError:
    """Return the error of a law that reads a reaction that it may not read."""
    advice = suggestion(name, readable)
    if is_rigid:
        advice = (
            "What passes through a rigid connection is worked out after the motion: hold the parts by a "
            "@constraint, whose reaction a force may read."
        )
    return DeclarationError(f"this law may not read the reaction {name!r}", where=path, advice=advice)


def no_private_name(kind: str, name: str, component: Any) -> AttributeError:
    """Return the error for a private name that a component does not have."""
    if name in ("_parent", "_name", "_settings", "_token"):
        advice = "Call super().__init__(**values) in it first; parameters need no __init__."
        return MissingNameError("its __init__ does not call that of Component", where=kind, advice=advice)
    return AttributeError(f"{kind!r} has no attribute {name!r}", name=name, obj=component)
