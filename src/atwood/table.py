"""Tables: the one value behind what text, terminals, notebooks, JSON and LaTeX show of reports and results."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

from atwood.display import fitted
from atwood.lazy_dataclasses import dataclass

__all__ = ["Column", "Shown", "Table", "facts", "table"]

WIDTH = 120
"""Columns of a text that is not written to a terminal."""

_NARROWEST = 20
"""Columns that a wrapped cell has at least."""

_GAP = "  "


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name
        What it is of.
    unit
        Unit of its numbers.
    align
        ``"<"`` to the left, ``">"`` to the right, ``"~"`` for sentences that are wrapped.
    """

    name: str
    unit: str = ""
    align: str = "<"

    @property
    def heading(self) -> str:
        """Name and unit."""
        return ", ".join(one for one in (self.name, self.unit) if one)


@dataclass(frozen=True)
class Table:
    """Rows of numbers and texts under columns, with a title and notes.

    Attributes
    ----------
    columns
        The columns; without names the rows stand alone, as labels and what is said of them.
    rows
        The cells, as many in each row as there are columns.
    title
        Stands above.
    notes
        Stand below, a line each.
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...]
    title: str = ""
    notes: tuple[str, ...] = ()

    @property
    def has_headings(self) -> bool:
        """Whether a column has a name."""
        return any(one.heading for one in self.columns)

    def cells(self) -> list[list[str]]:
        """Return the rows as text, numbers to six digits."""
        return [[_written(cell) for cell in row] for row in self.rows]

    def _rows(self) -> list[list[str]]:
        """Return the rows as text, below headings where there are some."""
        return [*([[one.heading for one in self.columns]] if self.has_headings else []), *self.cells()]

    def lines(self, width: int = WIDTH) -> list[str]:
        """Return headings and rows as lines of text; cells are never cut, and only sentences are wrapped."""
        rows = self._rows()
        if not rows:
            return []
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        wrapped = [k for k, one in enumerate(self.columns) if one.align == "~"]
        for number, k in enumerate(wrapped):
            room = width - sum(widths[:k]) - len(_GAP) * k
            widths[k] = min(widths[k], max(_NARROWEST, room // (len(wrapped) - number)))
        return [line for row in rows for line in self._placed(row, widths)]

    def _placed(self, row: Sequence[str], widths: Sequence[int]) -> list[str]:
        wrapped = [
            textwrap.wrap(cell, room, break_on_hyphens=False) or [""] if one.align == "~" else [cell]
            for cell, room, one in zip(row, widths, self.columns, strict=True)
        ]
        sides = [">" if one.align == ">" else "<" for one in self.columns]
        return [
            _GAP.join(
                f"{cell[k] if k < len(cell) else '':{side}{room}}"
                for cell, side, room in zip(wrapped, sides, widths, strict=True)
            ).rstrip()
            for k in range(max(map(len, wrapped)))
        ]

    def text(self, width: int = WIDTH) -> str:
        """Return title, table and notes as text."""
        return "\n".join([*([self.title] if self.title else []), *self.lines(width), *self.notes])

    def html(self) -> str:
        """Return it for a notebook; all texts are escaped."""
        import html

        def cell(value: object, align: str) -> str:
            side = "right" if align == ">" or _is_number(value) else "left"
            return f'<td style="text-align: {side}">{html.escape(_written(value))}</td>'

        lines = [f"<div><strong>{html.escape(self.title)}</strong>", "<table>"]
        if self.has_headings:
            headings = "".join(f"<th>{html.escape(one.heading)}</th>" for one in self.columns)
            lines.append(f"<thead><tr>{headings}</tr></thead>")
        aligned = [one.align for one in self.columns]
        body = (f"<tr>{''.join(map(cell, row, aligned))}</tr>" for row in self.rows)
        notes = [f"<p>{html.escape(' '.join(self.notes))}</p>"] if self.notes else []
        return "\n".join([*lines, "<tbody>", *body, "</tbody></table>", *notes, "</div>"])

    def latex(self) -> str:
        """Return it as a ``tabular`` of LaTeX."""
        sides = "".join("r" if one.align == ">" else "l" for one in self.columns)
        body = [" & ".join(map(_escaped, row)) + r" \\" for row in self._rows()]
        if self.has_headings:
            body.insert(1, r"\hline")
        return "\n".join([rf"\begin{{tabular}}{{{sides}}}", *body, r"\end{tabular}"])

    def brief(self) -> str:
        """Return it as a `repr` of ten lines at most; facts stand below their title in brackets."""
        if self.has_headings:
            return fitted(self.text())
        return fitted("\n".join([f"<{self.title}>", *(f"    {label}: {text}" for label, text in self.cells())]))

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data."""
        columns = [{"name": one.name, "unit": one.unit} for one in self.columns]
        return {"title": self.title, "columns": columns, "rows": [*map(list, self.rows)], "notes": [*self.notes]}

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return self.brief()

    def _repr_html_(self) -> str:
        return self.html()


def table(headings: Iterable[str], rows: Iterable[Iterable[Any]], title: str = "", notes: Iterable[str] = ()) -> Table:
    """Return a table whose columns are told by their headings."""
    return Table(tuple(map(_column, headings)), tuple(map(tuple, rows)), title, tuple(notes))


def facts(rows: Iterable[tuple[str, str]], title: str = "", notes: Iterable[str] = ()) -> Table:
    """Return a table of labels and sentences."""
    return table(("", "~"), rows, title, notes)


def _column(heading: str) -> Column:
    align = heading[-1:] if heading[-1:] in (">", "~") else ""
    name, _, unit = heading.removesuffix(align).partition(", ")
    return Column(name, unit, align or "<")


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _written(value: object) -> str:
    return f"{value:.6g}" if _is_number(value) else str(value)


def _escaped(text: str) -> str:
    return "".join(_LATEX.get(one, one) for one in text)


_LATEX = {**{one: f"\\{one}" for one in "&%$#_{}"}, "\\": r"\textbackslash{}", "~": r"\~{}", "^": r"\^{}"}


class Shown:
    """A value that is shown by tables: in a `repr`, in text, on terminals, and in notebooks."""

    def tables(self) -> Sequence[Table]:
        """Return the tables that say what it is; the first alone is its `repr`."""
        raise NotImplementedError

    def as_text(self) -> str:
        """Return its tables as text."""
        return "\n\n".join(one.text() for one in self.tables())

    def __repr__(self) -> str:
        return self.tables()[0].brief()

    def _repr_html_(self) -> str:
        return "\n".join(one.html() for one in self.tables())
