"""What laws return: read into expressions, or refused in words."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from atwood.errors import AtwoodError, DeclarationError, is_about, suggestion
from atwood.expr import Expression, Graph
from atwood.model.declare.connectors import Frame, Point
from atwood.model.declare.contributions import Load, Placement, PointInertia
from atwood.model.declare.law import Law
from atwood.model.values.vector import Vector


def law_value(bound: Any, name: str) -> Any:
    """Return what a law of a bound component gives that is called with nothing; a state is read, and not called."""
    found = getattr(bound, name)
    return found() if callable(found) else found


def call_law(path: str, law: Law, function: Callable[[], Any]) -> Any:
    """Return what a function gives that evaluates a law; whatever it raises says the part and the law."""
    try:
        return function()
    except AtwoodError as error:
        if is_about(error, path):
            raise
        raise type(error)(error.message, where=f"{path}.{law.name}", advice=error.advice) from error
    except Exception as error:  # whatever a law of somebody's own can raise
        raise not_evaluated(path, law, error) from error


def not_evaluated(path: str, law: Law, error: Exception) -> DeclarationError:
    """Return the error that says that a law of a part raises something."""
    return DeclarationError(
        f"the law cannot be evaluated ({type(error).__name__}: {error})",
        where=f"{path}.{law.name}",
        advice=_what_to_write(error),
    )


def _what_to_write(error: Exception) -> str:
    """Return the advice for a law that raises something."""
    plain = "A law is plain arithmetic with Atwood's functions, on self's parameters and connectors."
    if not isinstance(error, AttributeError) or not isinstance(error.name, str) or error.obj is None:
        return plain
    if isinstance(error.obj, Point) and not isinstance(error.obj, Frame) and hasattr(Frame, error.name):
        return "A Point has a position and no orientation: declare the connector as a Frame."
    return suggestion(error.name, [name for name in dir(error.obj) if not name.startswith("_")]) or plain


def one_scalar(graph: Graph, value: Any) -> Expression:
    """Return the one number that a law gives, as an expression."""
    if value is None:
        raise DeclarationError("it returns nothing", advice="End it with return and a number.")
    if isinstance(value, Vector):
        raise DeclarationError(
            "it returns a Vector where one number is wanted",
            advice="Return a component, or atwood.dot or atwood.norm of it.",
        )
    try:
        return graph.convert(value)
    except (TypeError, ValueError):
        raise DeclarationError(f"it returns {_in_words(value)} where a number is wanted") from None


def finite_scalar(graph: Graph, value: Any) -> Expression:
    """Return the one number that a law gives, as an expression; refuse what is never finite, as `one_scalar` does."""
    found = one_scalar(graph, value)
    if found.is_constant and not math.isfinite(found.value):
        raise DeclarationError(f"it returns {found.value:g}", advice="Return a number, or an expression that has one.")
    return found


def listed(value: Any, kinds: tuple[type, ...]) -> list[Any]:
    """Return what a law gives as a list of loads, or of inertias."""
    wanted = " or ".join(kind.__name__ for kind in kinds)
    advice = f"Yield each {wanted}, or return a list of them, which may be empty."
    if value is None:
        raise DeclarationError("it returns nothing", advice=advice)
    if isinstance(value, kinds):
        raise DeclarationError(f"it returns one {type(value).__name__} and no list", advice=advice)
    if isinstance(value, (Vector, str)) or not isinstance(value, Iterable):
        raise DeclarationError(f"it returns {_in_words(value)}", advice=advice)
    found = list(value)
    for one in found:
        if not isinstance(one, kinds):
            raise DeclarationError(f"it gives {_in_words(one)} where a {wanted} is wanted", advice=advice)
    return found


def _in_words(value: Any) -> str:
    kind = type(value).__name__
    return f"a {kind}" if isinstance(value, (Vector, Load, Placement, PointInertia)) else f"{value!r} of type {kind}"
