"""What the fields of a component make: the signature of its class, and the sections of its docstring.

Both are made when somebody asks for them, so that declaring a class costs nothing more.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any

from atwood.model.declare.fields import MISSING, ParameterSpec
from atwood.showing import field_text

__all__ = ["docstring_of", "signature_of"]


def signature_of(cls: Any) -> inspect.Signature:
    """Return the signature with which a class of components is called: its parameters, inputs and parts, by name.

    Raises
    ------
    AttributeError
        If its `__init__` says that by itself: a class with one of its own, and the bases of all.
    """
    parts = getattr(cls, "_prototypes", {})
    is_base = cls.__module__.startswith("atwood.model.") and not cls._parameters
    if is_base or not cls.__init__.__module__.startswith("atwood.model."):
        raise AttributeError("__signature__")
    written = [vars(base).get("__annotations__", {}) for base in cls.__mro__]
    fields = {name: spec.default for table in (cls._parameters, cls._signals) for name, spec in _own_first(cls, table)}
    empty = inspect.Parameter.empty
    return inspect.Signature(
        [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=empty if default is MISSING else default,
                annotation=next((one[name] for one in written if name in one), empty),
            )
            for name, default in {**fields, **parts}.items()
        ]
    )


def _own_first(cls: Any, table: dict[str, Any]) -> list[tuple[str, Any]]:
    """Return declarations by name, those of the class itself before those of its bases."""
    return sorted(table.items(), key=lambda one: one[0] not in vars(cls))


def docstring_of(cls: Any) -> str | None:
    """Return the docstring of a class of components, with sections for what it declares, in NumPy's style."""
    own = next((vars(base)["__doc__"] for base in cls.__mro__[:-1] if vars(base).get("__doc__")), None)
    if not (cls._parameters or cls._signals or cls._connectors) or own is None:
        return own
    text = inspect.cleandoc(own)
    written = set(re.findall(r"^(\w+)\n-{3,}$", text, re.MULTILINE))
    sections = {"Parameters": _fields(cls), "Connectors": _connectors(cls), "Quantities": _quantities(cls)}
    for title, entries in sections.items():
        lines = [f"{name} : {kind}\n    {doc}" for name, kind, doc in entries]
        if lines and title not in written:
            text += "\n\n" + "\n".join([title, "-" * len(title), *lines])
    return text


def _fields(cls: Any) -> Iterator[tuple[str, str, str]]:
    for name, spec in _own_first(cls, cls._parameters):
        yield name, ", ".join(_about(spec)), spec.doc
    for name, spec in cls._signals.items():
        yield name, f"{_unit(spec.unit.text)}, input, default {field_text(spec.default)}", spec.doc
    for name, part in getattr(cls, "_prototypes", {}).items():
        several = isinstance(part, list)
        yield name, f"list of {type(part[0]).__name__}" if several else type(part).__name__, "Part; may be replaced."


def _about(spec: ParameterSpec) -> Iterator[str]:
    """Yield what there is to say of what a parameter may be."""
    kinds = {
        "direction": spec.direction,
        "text": spec.text,
        "numbers": spec.array,
        "whole number": spec.integer,
    }
    if spec.choices:
        yield "{" + ", ".join(map(repr, spec.choices)) + "}"
    elif spec.function_of:
        yield f"{_unit(spec.unit.text)}, function of {', '.join(spec.function_of)}"
    elif any(kinds.values()):
        yield next(kind for kind, is_so in kinds.items() if is_so)
    else:
        yield f"{spec.size} numbers in {_unit(spec.unit.text)}" if spec.size else _unit(spec.unit.text)
    for word, bound in (("at least", spec.minimum), ("above", spec.above), ("at most", spec.maximum)):
        if bound is not None:
            yield f"{word} {bound:g}"
    yield "required" if spec.default is MISSING else f"default {field_text(spec.default)}"


def _connectors(cls: Any) -> Iterator[tuple[str, str, str]]:
    for name, spec in cls._connectors.items():
        yield name, spec.kind.__name__ + (f", as many as {spec.count}" if spec.count else ""), spec.doc


def _quantities(cls: Any) -> Iterator[tuple[str, str, str]]:
    for law in cls._laws.values():
        if law.kind == "observable":
            yield law.name, _unit(law.options.unit), law.options.doc
        elif law.kind == "constraint":
            for reaction in law.options.reactions:
                yield reaction, _unit(law.options.unit), law.options.doc


def _unit(text: str) -> str:
    return "number" if text == "1" else text
