"""Pages of what functions of theory return: formulas written as in a book, the rest as a table with its meanings.

What a value holds, and what it means, is read from its class: the attributes that its docstring tells, and its
properties with the first sentence of theirs.
"""

from __future__ import annotations

import cmath
import inspect
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any

from atwood.arguments import check
from atwood.docstrings import documented, first_sentence
from atwood.errors import AtwoodError
from atwood.lazy_dataclasses import dataclass, replace
from atwood.table import Shown, Table, table
from atwood.theory.formulas.mathml import as_mathml
from atwood.theory.formulas.named import NAMED, with_given_names
from atwood.theory.formulas.page import Line, Matrix, Section, as_html, as_latex, as_markdown, as_text, with_names
from atwood.theory.formulas.printers import latex, text
from atwood.theory.formulas.reading import latex_of, read_formula, text_of
from atwood.theory.formulas.tree import Name, Symbol, names_in

_LARGE = 16
"""Arrays of more numbers are not written in a line."""

_OTHERS = ("name", "scene")
"""Attributes that say of what a page is."""


_NO_FACTS = table((), ())


@dataclass(frozen=True)
class Page:
    """A title, what symbols stand for, facts in words and numbers, and formulas under headings.

    Attributes
    ----------
    title
        Of what it is.
    sections
        Formulas, with what they mean.
    facts
        Names, values and meanings of what is no formula.
    symbols
        What is told with path, unit and value; as plain text they stand in place of the title.
    by_part
        Whether each term says from which parts it comes.
    """

    title: str
    sections: tuple[Section, ...] = ()
    facts: Table = _NO_FACTS
    symbols: tuple[Symbol, ...] = ()
    by_part: bool = False

    @property
    def _told(self) -> list[Table]:
        return [self.facts] if self.facts.rows or self.facts.notes else []

    @property
    def _letters(self) -> list[tuple[Symbol, str, str]]:
        """Symbols with their units and values as text."""
        values = ("" if one.value is None else f"{one.value:.6g}" for one in self.symbols)
        return [(one, "" if one.unit == "1" else one.unit, v) for one, v in zip(self.symbols, values, strict=True)]

    def text(self) -> str:
        """Return it as plain text."""
        rows = ((text.letter(one), one.path, " ".join(filter(None, (v, unit)))) for one, unit, v in self._letters)
        head = "\n  ".join(["Symbols", *table(("", "", ""), rows).lines()]) if self.symbols else self.title
        told = [one.text() for one in self._told] + ([as_text(self.sections, self.by_part)] if self.sections else [])
        return "\n\n".join((head, *told))

    def latex(self) -> str:
        """Return its formulas as an aligned block of LaTeX for each heading, which is a comment."""
        return "\n".join(f"% {one.title}\n{as_latex(one.lines, self.by_part)}" for one in self.sections if one.lines)

    def markdown(self) -> str:
        """Return it as Markdown, with formulas between dollar signs."""
        rows = ["| symbol | stands for | unit | value |", "|---|---|---|---|"]
        rows += [f"| ${latex.letter(one)}$ | `{one.path}` | {unit} | {value} |" for one, unit, value in self._letters]
        tables = ["\n".join(rows)] if self.symbols else []
        tables += [f"```text\n{one.text()}\n```" for one in self._told]
        return as_markdown(self.title, self.sections, tables, self.by_part)

    def html(self) -> str:
        """Return it as HTML with MathML, which browsers show as it is."""
        rows = ((text.letter(one), one.path, unit, value) for one, unit, value in self._letters)
        symbols = [table(("symbol", "stands for", "unit", "value>"), rows)] if self.symbols else []
        return as_mathml(self.title, self.sections, [one.html() for one in (*symbols, *self._told)], self.by_part)

    def named(self, names: Mapping[str, Any]) -> Page:
        """Return it with names for sub-expressions; see `Paged.named`."""
        return replace(self, sections=tuple(with_given_names(self.sections, check(NAMED, names, "names"), self.title)))

    def notebook(self) -> str:
        """Return it for a notebook, with formulas between dollar signs; symbols say themselves on other pages."""
        return as_html(self.title, self.sections, [one.html() for one in self._told], self.by_part)


class Paged:
    """A value that is shown by a page: as text, in notebooks, and in LaTeX and Markdown."""

    @property
    def _page(self) -> Any:
        raise NotImplementedError

    def text(self) -> str:
        """Return it as plain text, for a terminal, formulas as in a book."""
        return str(self._page.text())

    def latex(self) -> str:
        """Return its formulas in LaTeX, for use in display mathematics."""
        return str(self._page.latex())

    def markdown(self) -> str:
        """Return a page of Markdown, with formulas between dollar signs."""
        return str(self._page.markdown())

    def html(self) -> str:
        """Return it as HTML, with formulas in MathML, which browsers show as they are."""
        return str(self._page.html())

    def named(self, names: Mapping[str, Any]) -> Page:
        """Return the page of it on which sub-expressions have names.

        Parameters
        ----------
        names
            By name what it stands for, as text or in sympy, in the letters of the formulas and of the names before it:
            ``{"Delta": "m1 + m2*sin(theta1 - theta2)^2"}``. It is found wherever all its terms stand, with whatever
            factor is before them.

        Raises
        ------
        UsageError
            If a name stands for something already, or what it is to stand for is in no formula.
        """
        return self._page.named(names)  # type: ignore[no-any-return]

    def _repr_html_(self) -> str:
        return str(self._page.notebook())


class Described(Paged):
    """A value that is shown by the page of what it holds."""

    @property
    def _page(self) -> Page:
        return page_of(self, type(self).__name__)


def page_of(value: Any, title: str, known: Callable[[], Mapping[str, Symbol]] = dict) -> Page:
    """Return the page of a value: a formula, or something that holds formulas and numbers.

    Parameters
    ----------
    value
        The value.
    title
        What stands above.
    known
        Gives symbols by the names that they have in formulas of sympy; it is called where there is a formula.
    """
    writer = _Writer(known)
    if is_formula(value):
        return _page(title, [], [Section("Formula", tuple(writer.lines(value)))])
    rows, sections = [], []
    for name, held, meaning in attributes(value):
        words = name.replace("_", " ").capitalize()
        lines = tuple(writer.lines(held))
        if lines:
            sections.append(Section(words, lines, meaning))
        else:
            rows.append((name, writer.fact(held), meaning))
    return _page(title, rows, sections)


def _page(title: str, rows: Iterable[tuple[str, str, str]], sections: list[Section]) -> Page:
    formulas = [one.formula for section in sections for one in section.lines if isinstance(one, Line)]
    taken = [one.symbol for one in names_in(formulas)]
    return Page(title, tuple(with_names(sections, taken)), table(("", "~", "~"), rows))


def attributes(value: Any) -> Iterator[tuple[str, Any, str]]:
    """Yield what a value holds that can be written: name, value and meaning; first what its docstring tells."""
    kind, told = type(value), documented(type(value))
    for base in reversed(kind.__mro__):
        for name, one in vars(base).items():
            if isinstance(one, (property, cached_property)) and not name.startswith("_"):
                told.setdefault(name, inspect.getdoc(one) or "")
    for name, meaning in told.items():
        try:
            held = getattr(value, name)
        except AtwoodError:  # what it does not have
            continue
        is_empty = isinstance(held, (str, tuple, list, Mapping)) and not held
        if name not in _OTHERS and not is_empty and (_is_plain(held) or is_theory(held)):
            yield name, held, first_sentence(meaning)


def is_theory(value: Any) -> bool:
    """Return whether a value is a result of theory, which shows itself."""
    is_shown = isinstance(value, (Described, Shown)) or hasattr(type(value), "markdown")
    return is_shown and type(value).__module__.startswith("atwood.theory")


def _is_plain(value: Any) -> bool:
    if isinstance(value, (dict, tuple, list)):
        return all(_is_plain(one) for one in (value.values() if isinstance(value, dict) else value))
    return isinstance(value, (str, bool, int, float, complex)) or hasattr(value, "dtype") or is_formula(value)


def is_formula(value: Any) -> bool:
    """Return whether a value is an expression or a matrix of sympy."""
    return hasattr(value, "free_symbols")


def _is_letter(value: Any) -> bool:
    """Return whether a value is a single name, of a symbol or of a function of the time."""
    return is_formula(value) and (getattr(value, "is_Symbol", False) or str(value).endswith("(t)"))


def line_of(left: tuple[str, str], held: Any, known: Mapping[str, Symbol] | None = None) -> Line | Matrix:
    """Return a formula, or a matrix of them, behind what it is equal to."""
    if not getattr(held, "is_Matrix", False):
        return Line(left, read_formula(held, known))
    return Matrix(left, tuple(tuple(read_formula(one, known) for one in row) for row in held.tolist()))


class _Writer:
    """Writes what a value holds.

    Parameters
    ----------
    known
        Gives symbols by the names that they have in formulas of sympy.
    """

    def __init__(self, known: Callable[[], Mapping[str, Symbol]]) -> None:
        self._ask = known

    @cached_property
    def _known(self) -> Mapping[str, Symbol]:
        return self._ask()

    def lines(self, held: Any) -> Iterator[Line | Matrix]:
        """Yield the formulas in a value, each a line; none where there is nothing but names, numbers and words."""
        if isinstance(held, Mapping):
            if any(is_formula(one) and one.free_symbols for one in held.values()):
                for name, one in held.items():
                    yield line_of(self._left(name), one, self._known)
        elif isinstance(held, (tuple, list)):
            if any(is_formula(one) and not _is_letter(one) for one in held):
                for one in held:
                    yield from self.lines(one)
        elif getattr(held, "is_Matrix", False):
            if held.rows:
                yield line_of(("M", "M"), held, self._known)
        elif getattr(held, "is_Equality", False):
            yield line_of(self._left(held.lhs), held.rhs, self._known)
        elif is_formula(held):
            yield line_of(("", ""), held, self._known)

    def _left(self, name: Any) -> tuple[str, str]:
        """Return a name before a sign of equality, in LaTeX and in plain text."""
        if is_formula(name):
            return latex_of(name, self._known), text_of(name, self._known)
        symbol = self._known.get(str(name))
        if symbol is not None:
            return latex.formula(Name(symbol)), text.formula(Name(symbol))
        return rf"\text{{{str(name).replace('_', chr(92) + '_')}}}", str(name)

    def fact(self, value: Any) -> str:
        """Return a value in a line; of large arrays their shape."""
        if is_theory(value):
            return repr(value)
        if is_formula(value):
            return text_of(value, self._known)
        if isinstance(value, Mapping):
            return ", ".join(f"{self.fact(name)} = {self.fact(one)}" for name, one in value.items())
        if getattr(value, "shape", None) and math.prod(value.shape) > _LARGE and hasattr(value, "dtype"):
            return f"array of shape {value.shape}: --json writes it"
        if hasattr(value, "tolist"):
            value = value.tolist()
        if isinstance(value, (tuple, list)):
            return ", ".join(
                f"[{self.fact(one)}]" if isinstance(one, (tuple, list)) else self.fact(one) for one in value
            )
        if isinstance(value, (float, complex)):
            return f"{value:.9g}" if cmath.isfinite(value) else "none"
        return str(value)
