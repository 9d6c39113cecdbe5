"""How values show themselves: `repr` in a few lines, and tables for notebooks."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

__all__ = ["brief", "count_of", "field_text", "fitted", "html_table", "listed"]

LINES, WIDTH = 10, 110
"""What a `repr` may take, in lines and columns."""

_FIELD = 72
"""Columns of one field in a `repr`."""


def brief(value: object, names: Iterable[str]) -> str:
    """Return the `repr` of a value with fields, with long fields cut short: ``Start(time=0.0, ...)``.

    Parameters
    ----------
    value
        The value.
    names
        Its fields.

    Returns
    -------
    str
        What a terminal shows in ten lines at most.
    """
    said = ", ".join(f"{name}={field_text(getattr(value, name))}" for name in names)
    return fitted(f"{type(value).__name__}({said})")


def fitted(text: str) -> str:
    """Return a text as it is if a terminal shows it in ten lines; else its beginning.

    Parameters
    ----------
    text
        One line or several.
    """
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
    """Return names with commas; of a long list the first ones, and how many follow.

    Parameters
    ----------
    names
        The names.
    shown
        So many are named.
    """
    every = [str(name) for name in names]
    if len(every) <= shown + 1:
        return ", ".join(every)
    return f"{', '.join(every[:shown])} and {len(every) - shown} more"


def html_table(title: str, heads: Sequence[str], rows: Iterable[Sequence[object]], note: str = "") -> str:
    """Return a table for a notebook; all texts are escaped.

    Parameters
    ----------
    title
        Stands above the table.
    heads
        Headings of the columns; none for a table of names and what is said of them.
    rows
        The cells; numbers are aligned to the right.
    note
        Stands below the table.
    """
    import html

    lines = [f"<div><strong>{html.escape(title)}</strong>", "<table>"]
    if heads:
        cells = "".join(f"<th>{html.escape(head)}</th>" for head in heads)
        lines.append(f"<thead><tr>{cells}</tr></thead>")
    lines.append("<tbody>")
    lines += [f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows]
    lines.append("</tbody></table>")
    if note:
        lines.append(f"<p>{html.escape(note)}</p>")
    return "\n".join([*lines, "</div>"])


def _cell(value: object) -> str:
    import html

    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return f'<td style="text-align: right">{value:.6g}</td>'
    return f'<td style="text-align: left">{html.escape(str(value))}</td>'


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
