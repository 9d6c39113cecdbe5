"""Formulas on a page: lines that fit, shared brackets with names, in LaTeX, Markdown, HTML and plain text."""

from __future__ import annotations

import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from html import escape
from typing import Any

from atwood.lazy_dataclasses import dataclass, replace
from atwood.theory.formulas.printers import latex, text
from atwood.theory.formulas.quantities import distances_in, moments_in
from atwood.theory.formulas.search import Search
from atwood.theory.formulas.tree import Name, Node, Sum, Symbol, Term, alone, names_in, replaced, sums_within

_WIDTH = 88
"""Columns of a line of formulas, as plain text."""

_LONG = 2
"""Formulas of more lines have their brackets named."""

_WORTH_A_NAME, _TIMES = 14, 3
"""A bracket has a name where it is at least so wide and stands so often."""


@dataclass(frozen=True)
class Line:
    """One equation: a formula with what stands before and after it.

    Attributes
    ----------
    left
        In LaTeX and in plain text; empty where there is nothing.
    formula
        The formula.
    right
        What it is equal to, such as ``"= 0"``.
    """

    left: tuple[str, str]
    formula: Sum
    right: str = ""


def line_for(name: Name, formula: Sum) -> Line:
    """Return a line that says what a name stands for."""
    return Line((latex.formula(name), text.formula(name)), formula)


@dataclass(frozen=True)
class Matrix:
    """A matrix with its name, by rows; entries that are zero are empty sums."""

    left: tuple[str, str]
    entries: tuple[tuple[Sum, ...], ...]


@dataclass(frozen=True)
class Section:
    """Equations under a heading, with a sentence."""

    title: str
    lines: tuple[Line | Matrix, ...]
    note: str = ""

    @property
    def said(self) -> str:
        """The sentence where there are no formulas in it, so that it reads in any language."""
        return "" if "$" in self.note else self.note


def width(written: str) -> int:
    """Return how many columns a plain text takes."""
    return sum(not unicodedata.combining(one) for one in written)


# -- names for brackets ---------------------------------------------------------------------------------------------


def with_names(sections: Sequence[Section], legend: Sequence[Symbol]) -> list[Section]:
    """Return sections with names for what has one in mechanics, and for brackets that stand often in long formulas."""
    formulas = [one for section in sections for line in section.lines for one in formulas_of(line)]
    distances = distances_in(formulas, legend)
    taken = {one.name for one in legend}
    moments = {one: name for one, name in moments_in(formulas).items() if name.symbol.name not in taken}
    where = {
        name: Line((f"{latex.formula(name)}^2", f"{text.formula(name)}²"), one) for name, one in distances.values()
    }
    where |= {name: line_for(name, one) for one, name in moments.items()}
    if where:
        searches = [Search(one, name, Fraction(2)) for one, (name, _) in distances.items()]
        for search in (*searches, *(Search(one, name) for one, name in moments.items())):
            sections = [replace(s, lines=tuple(line_with(one, search.put) for one in s.lines)) for s in sections]
        sections = [*sections, Section("Distances and moments of inertia", tuple(where.values()))]
    return _with_short_names(sections, taken)


def _with_short_names(sections: Sequence[Section], taken: Iterable[str]) -> list[Section]:
    """Return sections in which brackets that stand often have names, if formulas would not fit; and what these are."""
    formulas = [one for section in sections for line in section.lines for one in formulas_of(line)]
    if not any(width(text.formula(one)) > _LONG * _WIDTH for one in formulas):
        return list(sections)
    counts = Counter(bracket for bracket in sums_within(formulas, in_calls=False) if len(bracket.terms) > 1)
    chosen = [one for one, n in counts.items() if n >= _TIMES and width(text.formula(one)) >= _WORTH_A_NAME]
    if not chosen:
        return list(sections)
    letter = next(one for one in ("S", "Sigma", "Xi") if not any(name.startswith(f"{one}_") for name in taken))
    names: dict[Node, Node] = {
        bracket: Name(Symbol(letter, (str(i + 1),), kind="shared", order=i)) for i, bracket in enumerate(chosen)
    }

    def short(one: Sum) -> Sum:
        return alone(replaced(one, names))

    shorter = [replace(one, lines=tuple(line_with(line, short) for line in one.lines)) for one in sections]
    where = []
    for bracket, name in names.items():
        assert isinstance(bracket, Sum)
        inner = {other: short for other, short in names.items() if other is not bracket}
        shown = replaced(bracket, inner)
        assert isinstance(name, Name)
        assert isinstance(shown, Sum)
        where.append(line_for(name, shown))
    return [*shorter, Section("Abbreviations", tuple(where), "What stands in brackets several times has a name.")]


def formulas_of(line: Line | Matrix) -> list[Sum]:
    """Return the formulas in a line."""
    return [line.formula] if isinstance(line, Line) else [one for row in line.entries for one in row]


def line_with(line: Line | Matrix, change: Callable[[Sum], Sum]) -> Line | Matrix:
    """Return a line with each of its formulas changed."""
    if isinstance(line, Line):
        return replace(line, formula=change(line.formula))
    return replace(line, entries=tuple(tuple(map(change, row)) for row in line.entries))


def shared_in(formulas: Iterable[Node], shared: Sequence[tuple[Name, Sum]]) -> list[tuple[Name, Sum]]:
    """Return those names that a book gave to what formulas share that occur in some, each after what it needs."""
    wanted, needed = set(names_in(formulas)), list[tuple[Name, Sum]]()
    for name, value in reversed(shared):
        if name in wanted:
            wanted |= set(names_in([value]))
            needed.insert(0, (name, value))
    return needed


def shared_lines(formulas: Iterable[Node], shared: Sequence[tuple[Name, Sum]]) -> tuple[Line, ...]:
    """Return what these names stand for, a line each."""
    return tuple(line_for(name, one) for name, one in shared_in(formulas, shared))


# -- lines ------------------------------------------------------------------------------------------------------------


def rows_of(line: Line, by_part: bool = False) -> list[list[Term]]:
    """Return the terms of a formula in rows that fit a line of text each; by part each term is one."""
    rows: list[list[Term]] = [[]]
    used = width(line.left[1])
    for term in line.formula.terms:
        size = width(text.formula(Sum((term,)))) + 2
        if rows[-1] and (by_part or used + size > _WIDTH):
            rows.append([])
            used = 6
        rows[-1].append(term)
        used += size
    return rows


def _pieces(line: Line, write: Callable[[Sum], str], by_part: bool) -> tuple[list[str], list[str]]:
    """Return a formula in pieces that fit a line each, signs first, and the parts that they come from, if asked."""
    owners = _owners_of(line) if by_part else []
    written = []
    for i, terms in enumerate(rows_of(line, bool(owners))):
        body = write(Sum(tuple(terms)))
        if i and terms[0].number > 0:
            body = f"+ {body}"
        elif i and body.startswith("-"):
            body = f"- {body[1:].lstrip()}"
        written.append(body)
    written[-1] += f" {line.right}" if line.right else ""
    return written, owners


def _owners_of(line: Line) -> list[str]:
    """Return the parts that each term comes from; nothing where that is not known of any."""
    return [", ".join(term.owners) for term in line.formula.terms] if any(t.owners for t in line.formula.terms) else []


def terms_data(formula: Sum) -> dict[str, list[dict[str, Any]]]:
    """Return each term with the parts that it comes from as plain data; nothing where that is not known of any."""
    terms = [{"latex": latex.formula(Sum((one,))), "parts": list(one.owners)} for one in formula.terms]
    return {"terms": terms} if any(one.owners for one in formula.terms) else {}


def symbols_data(legend: Sequence[Symbol]) -> list[dict[str, Any]]:
    """Return what symbols stand for as plain data."""
    return [
        {"symbol": one.name, "path": one.path, "unit": one.unit, "value": one.value, "kind": one.kind} for one in legend
    ]


def _latex_rows(line: Line | Matrix, by_part: bool = False) -> list[str]:
    """Return the rows of an aligned block."""
    if isinstance(line, Matrix):
        return _latex_matrix(line)
    pieces, owners = _pieces(line, latex.formula, by_part)
    for i, one in enumerate(owners):
        pieces[i] += rf" && \text{{{one}}}".replace("_", r"\_")
    head = f"{line.left[0]} &= " if line.left[0] else "& "
    return [head + pieces[0], *(rf"&\qquad {piece}" for piece in pieces[1:])]


def _latex_matrix(matrix: Matrix) -> list[str]:
    widths = [max(width(text.formula(row[j])) for row in matrix.entries) for j in range(len(matrix.entries[0]))]
    if sum(widths) + 2 * len(widths) <= _WIDTH + 10:
        rows = r" \\ ".join(" & ".join(latex.formula(one) for one in row) for row in matrix.entries)
        return [rf"{matrix.left[0]} &= \begin{{pmatrix}} {rows} \end{{pmatrix}}"]
    return [row for line in _single(matrix) for row in _latex_rows(line)]


def _single(matrix: Matrix) -> Iterator[Line]:
    """Yield the entries of a matrix that are not zero as lines; of a symmetric one those from the diagonal on."""
    rows = matrix.entries
    symmetric = len(rows) == len(rows[0]) and all(rows[i][j] == rows[j][i] for i in range(len(rows)) for j in range(i))
    for i, row in enumerate(rows):
        for j, one in enumerate(row):
            if one.terms and not (symmetric and j < i):
                place = f"{i + 1}{j + 1}" if max(len(rows), len(row)) < 10 else f"{i + 1},{j + 1}"
                both = rf" = {matrix.left[0]}_{{{place[::-1]}}}" if symmetric and i != j and len(place) == 2 else ""
                yield Line((f"{matrix.left[0]}_{{{place}}}{both}", f"{matrix.left[1]}[{i + 1},{j + 1}]"), one)


def as_latex(lines: Sequence[Line | Matrix], by_part: bool = False) -> str:
    """Return equations as one aligned block, for use in display mathematics; by part, each term with its parts."""
    return aligned(row for line in lines for row in _latex_rows(line, by_part))


def aligned(rows: Iterable[str]) -> str:
    """Return rows of LaTeX as an aligned block."""
    return "\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}"


def as_markdown(title: str, sections: Sequence[Section], tables: Sequence[str] = (), by_part: bool = False) -> str:
    """Return sections as a page of Markdown with formulas between dollar signs."""
    blocks = [f"# {title}", *tables]
    for section in sections:
        blocks.append(f"## {section.title}")
        if section.note:
            blocks.append(section.note)
        blocks += [f"$$\n{as_latex(section.lines, by_part)}\n$$"] * bool(section.lines)
    return "\n\n".join(blocks) + "\n"


def as_text(sections: Sequence[Section], by_part: bool = False) -> str:
    """Return sections in plain text; by part, each term on a line with the parts that it comes from."""
    blocks = []
    for section in sections:
        blocks.append(": ".join(filter(None, (section.title, section.said))))
        for line in section.lines:
            blocks += [f"  {one}" for one in _text_rows(line, by_part)]
        blocks.append("")
    return "\n".join(blocks[:-1])


def _text_rows(line: Line | Matrix, by_part: bool = False) -> list[str]:
    if isinstance(line, Matrix):
        return [row for one in _single(line) for row in _text_rows(one)]
    pieces, owners = _pieces(line, text.formula, by_part)
    head = f"{line.left[1]} = " if line.left[1] else ""
    rows = [head + pieces[0], *(f"{' ' * 6}{piece}" for piece in pieces[1:])]
    size = max(map(width, rows))
    said = [f"   [{one}]" if one else "" for one in owners] or [""] * len(rows)
    return [f"{row}{' ' * (size - width(row))}{one}".rstrip() for row, one in zip(rows, said, strict=True)]


def as_html(title: str, sections: Sequence[Section], tables: Sequence[str] = (), by_part: bool = False) -> str:
    """Return sections for a notebook; each term says on hovering from which parts it comes."""
    blocks = [f"<h4>{escape(title)}</h4>", *tables]
    for section in sections:
        rows = [f"<div>{_html_line(line, by_part)}</div>" for line in section.lines]
        said = f" {escape(section.said)}" if section.said else ""
        blocks.append(f"<p><b>{escape(section.title)}</b>{said}</p>" + "".join(rows))
    return "".join(blocks)


def _html_line(line: Line | Matrix, by_part: bool) -> str:
    if isinstance(line, Matrix):
        return f"$\\displaystyle {as_latex([line])}$"
    head = f"${line.left[0]} =$ " if line.left[0] else ""
    spans = []
    for i, term in enumerate(line.formula.terms):
        body = latex.formula(Sum((term,)))
        if i:
            body = f"- {body[1:]}" if term.number < 0 else f"+ {body}"
        tip = f' title="{escape(", ".join(term.owners), quote=True)}"' if term.owners else ""
        said = f" <small>[{escape(', '.join(term.owners))}]</small>" if by_part and term.owners else ""
        spans.append(f"<span{tip}>$\\displaystyle {escape(body, quote=False)}${said}</span>")
    return f"{head}{' '.join(spans) or '$0$'}" + (f" ${line.right}$" if line.right else "")
