"""What becomes of fields and laws when the class body of a component has been read."""

from __future__ import annotations

from typing import Any

from atwood.errors import DeclarationError
from atwood.model.declare.connectors import ConnectorSpec
from atwood.model.declare.fields import MISSING, Field

__all__ = ["check_field_name", "check_reserved", "merge_inherited", "with_checked_default"]


def merge_inherited(cls: type) -> None:
    """Give a class what all its bases declare, in the order in which Python looks names up."""
    for table in ("_parameters", "_signals", "_connectors", "_laws"):
        merged: dict[str, Any] = {}
        for base in reversed(cls.__mro__[1:]):
            merged.update(vars(base).get(table, {}))
        setattr(cls, table, merged)


def with_checked_default(spec: Any, cls: type) -> Any:
    """Return a field whose default has been checked as a value that is given is."""
    if spec.default is not MISSING:
        spec.default = spec.check(spec.default, f"{cls.__name__}.{spec.name}")
    return spec


def check_field_name(cls: type, name: str, value: Any) -> None:
    """Refuse a field that is declared elsewhere under another name, or that has the name of something else."""
    if getattr(value, "name", name) != name:
        raise DeclarationError(
            f"{name!r} is a second name for {value.name!r}",
            where=cls.__name__,
            advice=f"Declare {name!r} on its own; its default can be {value.name!r}.",
        )
    check_reserved(cls, name)


def check_reserved(cls: type, name: str) -> None:
    """Refuse a name that every component, or every model, uses for something else."""
    for base in cls.__mro__[1:]:
        if not base.__module__.startswith("atwood.model."):
            continue
        taken = vars(base).get(name)
        if taken is not None and not isinstance(taken, (Field, ConnectorSpec)):
            raise DeclarationError(
                f"the name {name!r} has a meaning of its own in every {base.__name__}",
                where=cls.__name__,
                advice="Choose another name.",
            )
