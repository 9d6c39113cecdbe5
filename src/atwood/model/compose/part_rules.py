"""Which parts a model takes, and under which names."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any

from atwood.arguments import NAME, check, show
from atwood.errors import DeclarationError
from atwood.model.declare.component import Component

__all__ = ["check_new_parts"]

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")


def check_new_parts(model: Component, name: str, part: Any, taken: Collection[str]) -> None:
    """Refuse a part, or an array of parts, that a model cannot take under a name.

    Parameters
    ----------
    model
        The model.
    name, part
        What it is to take.
    taken
        Names of the parts that it has.

    Raises
    ------
    DeclarationError
        If the name is taken or no identifier, or a part is none, or is somewhere already.
    """
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
