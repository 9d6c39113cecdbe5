"""How values show themselves: in a `repr` of a few lines, and as plain data."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Mapping
from typing import Any

__all__ = ["brief", "count_of", "data_of", "duration", "field_text", "fitted", "listed", "plain"]

LINES, WIDTH = 10, 110
"""What a `repr` may take, in lines and columns."""

_FIELD = 72
"""Columns of one field in a `repr`."""


def brief(value: object, names: Iterable[str]) -> str:
    """Return the `repr` of a value with fields, with long fields cut short: ``Start(time=0.0, ...)``."""
    said = ", ".join(f"{name}={field_text(getattr(value, name))}" for name in names)
    return fitted(f"{type(value).__name__}({said})")


def fitted(text: str) -> str:
    """Return a text as it is if a terminal shows it in ten lines; else its beginning."""
    lines = text.split("\n")
    if sum(max(1, -(-len(line) // WIDTH)) for line in lines) <= LINES:
        return text
    import textwrap

    wrapped = [piece for line in lines for piece in textwrap.wrap(line, WIDTH, subsequent_indent="    ") or [""]]
    return "\n".join([*wrapped[: LINES - 1], "    ..."])


def count_of(number: int, one: str, many: str = "") -> str:
    """Return a number with its noun, as in "1 loop" and "2 loops"."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def listed(names: Iterable[object], shown: int = 6) -> str:
    """Return names with commas; of a long list the first ones, and how many follow."""
    every = [str(name) for name in names]
    if len(every) <= shown + 1:
        return ", ".join(every)
    return f"{', '.join(every[:shown])} and {len(every) - shown} more"


def duration(seconds: float) -> str:
    """Return a time as a reader says it, in milliseconds where it is short."""
    return f"{1e3 * seconds:.3g} ms" if seconds < 1.0 else f"{seconds:.3g} s"


def data_of(value: object, *names: str) -> dict[str, Any]:
    """Return attributes of a value as plain data by name."""
    return {name: plain(getattr(value, name)) for name in names}


def plain(value: Any) -> Any:
    """Return a value as plain data: numbers, texts, lists and dictionaries, as JSON knows them."""
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(value, complex):
        return [value.real, value.imag]
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    for own in ("to_data", "to_dict", "tolist"):
        if hasattr(value, own):
            return plain(getattr(value, own)())
    fields = getattr(type(value), "__dataclass_fields__", None)
    return str(value) if fields is None else data_of(value, *fields)


class _Fields(reprlib.Repr):
    """Shows what stands in fields: few items, arrays by their shapes, values with fields by their classes."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel = 3
        self.maxstring = self.maxother = _FIELD
        self.maxtuple = self.maxlist = self.maxdict = 4

    def repr1(self, x: Any, level: int) -> str:
        """Return what one value is shown as."""
        kind = type(x)
        if kind.__name__ == "ndarray" and x.size > 6:
            return f"<array {x.shape} of {x.dtype}>"
        if hasattr(kind, "__dataclass_fields__") and level < self.maxlevel:
            return f"<{kind.__name__}>"
        if isinstance(x, Mapping) and kind is not dict:
            return self.repr_dict(dict(x), level)
        text = super().repr1(x, level)
        return " ".join(text.split())


_SHORT = _Fields()


def field_text(value: object) -> str:
    """Return a value as it stands in the `repr` of another: short, on one line, with arrays by their shapes."""
    text = _SHORT.repr(value)
    return text if len(text) <= 2 * _FIELD else f"{text[:_FIELD]}...{text[-8:]}"
