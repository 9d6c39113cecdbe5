"""Sheets of formulas in sympy, written as textbooks write them: in plain text, LaTeX, Markdown and HTML."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from atwood.errors import UsageError, suggestion
from atwood.lazy_dataclasses import dataclass, replace
from atwood.lazy_modules import sympy
from atwood.table import table
from atwood.theory.formulas import page
from atwood.theory.formulas.described import Page, Paged, line_of
from atwood.theory.formulas.page import Line, Matrix, Section
from atwood.theory.formulas.printers import Sympy, text
from atwood.theory.formulas.reading import latex_of, read_symbol, text_of


@dataclass(frozen=True, eq=False)
class Statement:
    """A formula with its name.

    Attributes
    ----------
    name
        By which a sheet finds it.
    meaning
        What it is, in a line.
    value
        An expression, a matrix or a relation of sympy.
    left
        What it is equal to; a matrix of letters for a vector, None where it stands alone.
    """

    name: str
    meaning: str
    value: Sympy
    left: Sympy | None = None


def statements_of(lines: str) -> list[Statement]:
    """Return formulas that are written a line each: name, meaning, left side and formula with strokes between.

    What moves is written as x(t), its derivative as x', the components of a vector with semicolons between.
    """
    rows = [[one.strip() for one in line.split("|")] for line in lines.splitlines() if line]
    return [Statement(name, told, _read(value), _read(left) if left else None) for name, told, left, value in rows]


def _read(written: str) -> Sympy:
    if ";" in written:
        return sympy.Matrix([_read(one) for one in written.split(";")])
    if " = " in written:
        return sympy.Eq(*map(_read, written.split(" = ")))
    written = re.sub(r"([A-Za-z]\w*)'", r"Derivative(\1(t), t)", written)
    called = set(re.findall(r"([A-Za-z]\w*)\(", written))
    known = {name: sympy.Symbol(name) for name in re.findall(r"[A-Za-z]\w*", written)}
    return sympy.sympify(
        written, {**known, **{name: getattr(sympy, name, None) or sympy.Function(name) for name in called}}
    )


class FormulaSheet(Paged, Mapping[str, Sympy]):
    """Formulas by name, each an expression, a matrix or a relation of sympy; what moves is a function of `t`.

    Parameters
    ----------
    title
        What they are about.
    statements
        The formulas, in order.
    numbers
        Values of letters, in SI units, where there are some.
    """

    def __init__(self, title: str, statements: Iterable[Statement], numbers: Mapping[str, float] | None = None) -> None:
        self.title, self.statements, self.numbers = title, tuple(statements), dict(numbers or {})

    def __len__(self) -> int:
        return len(self.statements)

    def __iter__(self) -> Any:
        return (one.name for one in self.statements)

    def __contains__(self, name: object) -> bool:
        return name in [one.name for one in self.statements]

    def __getitem__(self, name: str) -> Sympy:
        named = {one.name: one.value for one in self.statements}
        if name in named:
            return named[name]
        advice = suggestion(name, list(self)) or f"There are {', '.join(self)}."
        raise UsageError("there is no such formula", where=f"{self.title}: {name}", advice=advice)

    def in_letters(self, symbols: Mapping[str, str] | None) -> FormulaSheet:
        """Return the same formulas in other letters, given by those that they stand for."""
        known = {one.name: one for s in self.statements for one in _letters_of(s.value, s.left)}
        by = {}
        for old, new in (symbols or {}).items():
            if old not in known:
                told = suggestion(old, known)
                raise UsageError("no formula has this letter", where=f"{self.title}: {old}", advice=told)
            one = known[old]
            by[one] = sympy.Symbol(new) if one.is_Symbol else sympy.Function(new)(*one.args)
        if not by:
            return self
        moved = [replace(s, value=s.value.xreplace(by), left=s.left and s.left.xreplace(by)) for s in self.statements]
        return FormulaSheet(self.title, moved, {(symbols or {}).get(name, name): v for name, v in self.numbers.items()})

    @property
    def sections(self) -> list[Section]:
        """The formulas on a page, each under what it means."""
        return [Section(one.meaning, _lines(one)) for one in self.statements]

    @property
    def _page(self) -> Page:
        values = [(text.letter(read_symbol(name)), f"{value:.9g}") for name, value in self.numbers.items()]
        return Page(self.title, tuple(self.sections), table(("", ""), values, "Values, SI units" if values else ""))

    def latex(self) -> str:
        """Return the formulas in LaTeX, as one aligned block."""
        return page.as_latex([line for one in self.statements for line in _lines(one)])

    def to_data(self) -> dict[str, Any]:
        """Return the formulas as plain data: each in sympy's words, in LaTeX, and what it means."""
        told = {one.name: (str(one.value), page.as_latex(_lines(one)), one.meaning) for one in self.statements}
        return {name: dict(zip(("formula", "latex", "meaning"), said, strict=True)) for name, said in told.items()}

    def __repr__(self) -> str:
        return f"<FormulaSheet {self.title}: {', '.join(self)}>"

    def __str__(self) -> str:
        return self.text()

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"


def _letters_of(*values: Sympy | None) -> set[Sympy]:
    known = [one for one in values if one is not None]
    return set().union(*(one.free_symbols | one.atoms(sympy.core.function.AppliedUndef) for one in known))


def _lines(one: Statement) -> tuple[Line | Matrix, ...]:
    """Return a statement as it is written: a vector that is equal to named components one by one."""
    if isinstance(one.left, sympy.MatrixBase):
        return tuple(line_of(_head(left), value) for left, value in zip(one.left, one.value, strict=True))
    return (line_of(("", "") if one.left is None else _head(one.left), one.value),)


def _head(value: Sympy) -> tuple[str, str]:
    return latex_of(value), text_of(value)
