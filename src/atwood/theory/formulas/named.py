"""Sub-expressions to which somebody gives a name, found in formulas wherever they stand, up to a factor."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from atwood.arguments import BY_PATH, Refused
from atwood.errors import UsageError, check_known
from atwood.lazy_dataclasses import replace
from atwood.lazy_modules import sympy
from atwood.model.values.letters import LETTER, split_letter
from atwood.theory.formulas.page import Line, Section, formulas_of, line_for, line_with
from atwood.theory.formulas.printers import objects
from atwood.theory.formulas.reading import read_formula
from atwood.theory.formulas.search import Search
from atwood.theory.formulas.tree import Name, Sum, Symbol, names_in


def _names(value: Any) -> dict[str, Any]:
    found = {LETTER.read(name): one for name, one in BY_PATH.read(value).items()}
    if not found:
        raise Refused
    return found


NAMED = replace(BY_PATH, what="formulas by name, such as {'Delta': 'm1 + m2'}", read=_names, word="NAME=FORMULA")
"""What has a name in formulas."""


def with_given_names(sections: Sequence[Section], named: Mapping[str, Any], where: str) -> list[Section]:
    """Return sections in which sub-expressions have the names that were given, and what these stand for.

    Parameters
    ----------
    sections
        Formulas under headings.
    named
        By name what it stands for, in the letters of the formulas and of the names before it.
    where
        Of what the formulas are.
    """
    lines = [line for one in sections for line in one.lines]
    heads = {line.left[1] for line in lines}
    taken = {one.symbol.name: one for line in lines for one in names_in(formulas_of(line))}
    told: list[Line] = []
    for order, (name, given) in enumerate(named.items()):
        if name in taken or name in heads:
            raise UsageError(f"{name} stands for something already", where=where, advice="Take another letter.")
        formula = _read(given, {key: one.symbol for key, one in taken.items()}, where)
        letter, *below = name.split("_")
        unit = next((one.symbol.unit for one in names_in([formula])), "1")  # by which factors are ordered
        taken[name] = own = Name(Symbol(letter, tuple(below), unit=unit, kind="shared", order=order))
        search = Search(formula, own)
        sections = [replace(s, lines=tuple(line_with(line, search.put) for line in s.lines)) for s in sections]
        if not search.has_found:
            raise UsageError(f"{given} stands in no formula", where=where, advice="Write it as the formulas have it.")
        told.append(line_for(own, formula))
    return [*sections, Section("Names", tuple(told))]


def _read(given: Any, known: Mapping[str, Symbol], where: str) -> Sum:
    """Return what was given as a formula: text, or an expression of sympy."""
    if isinstance(given, str):
        by: dict[str, Any] = {}

        def letter(found: re.Match[str]) -> str:
            name = "_".join(split_letter(found[1]))
            check_known(name, known, f"no formula has {found[1]}", where=where)
            by[f"s{len(by)}_"] = objects.letter(known[name], len(found[2]))
            return f"s{len(by) - 1}_"

        text = re.sub(r"\b([A-Za-z]\w*)\b(?!\s*\()('*)", letter, given)
        try:
            given = sympy.sympify(text, by)
        except (sympy.SympifyError, TypeError) as error:
            raise UsageError(f"{given!r} is no formula", where=where) from error
    made = read_formula(given, known)
    if not any(names_in([made])):
        raise UsageError(f"{given} has no letters", where=where, advice="A number needs no name.")
    return made
