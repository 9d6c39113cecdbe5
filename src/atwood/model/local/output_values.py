"""Values of outputs: what an observable or a reaction is, component by component, where an input is linked to it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from atwood.errors import DeclarationError, suggestion
from atwood.expr import Scalar
from atwood.model.declare.law import Law
from atwood.model.local.flatten import Part
from atwood.model.returned import call_law, law_value
from atwood.model.values.space import WHERE, Space
from atwood.model.values.vector import Vector

__all__ = ["output_value"]


def output_value(part: Part, bound: Any, name: str, space: Space) -> Scalar:
    """Return what an output is.

    Parameters
    ----------
    part
        The part.
    bound
        The same, bound to what its laws read.
    name
        The output: an observable or a reaction, with its axis if it is a vector.
    space
        What the scene lives in.

    Raises
    ------
    DeclarationError
        If it has no meaning in this space, or if it is a vector and no component is named, or the other way round.
    """
    stem, _, axis = name.partition(".")
    law = next((one for one in part.component.laws("observable") if one.name == stem), None)
    if law is None or name in bound._binding().reactions:
        value = bound.reaction(name)  # which says which there are
    else:
        where = f"{part.path}.{name}"
        if not law.holds_in(space.name):
            message = f"{stem} has no meaning {WHERE[space.name]}"
            raise DeclarationError(message, where=where, advice=_instead(part, law, space))
        value = call_law(part.path, law, partial(law_value, bound, stem))
        if isinstance(value, Vector):
            if axis not in ("x", "y", "z"):
                axes = space.reported(value, law.options.unit)
                raise _no_component(axis, [f"{stem}.{'xyz'[i]}" for i in axes], where)
            value = getattr(value, axis)
        elif axis:
            raise DeclarationError(f"{stem} is a number and no vector", where=where, advice=f"Connect {stem}.")
    found: Scalar = value
    return found


def _instead(part: Part, law: Law, space: Space) -> str:
    """Return a hint for an observable of another space: what looks alike here, or in which spaces it has a meaning."""
    names = [one.name for one in part.component.laws("observable") if one.holds_in(space.name)]
    return suggestion(law.name, names) or f"It has one {' or '.join(WHERE[one] for one in law.options.spaces)}."


def _no_component(axis: str, names: Sequence[str], where: str) -> DeclarationError:
    """Return the error of a vector of which no component is named, or one that it does not have."""
    what = f"a vector has no component {axis!r}" if axis else "it is a vector"
    *first, last = names
    return DeclarationError(what, where=where, advice=f"Connect {', '.join(first)}{' or ' * bool(first)}{last}.")
