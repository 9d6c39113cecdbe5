"""Formulas of sympy read as trees, so that they are written down as those of equations of motion are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from fractions import Fraction

from atwood.lazy_dataclasses import replace
from atwood.lazy_modules import sympy
from atwood.model.values.letters import GREEK
from atwood.theory.formulas.printers import Sympy, latex, text
from atwood.theory.formulas.tree import (
    ONE,
    Call,
    Factor,
    Name,
    Node,
    Number,
    Sum,
    Symbol,
    Term,
    alone,
    as_decimal,
    in_brackets,
    in_order,
    names_in,
    product,
)

_FUNCTIONS = {"Abs": "absolute", "Min": "minimum", "Max": "maximum", "ceiling": "ceil", "Equality": "equal"}
_RELATIONS = {"StrictLessThan": "less", "LessThan": "less_equal", "StrictGreaterThan": "greater"}
_TURNED = {"GreaterThan": "less_equal"}
_LOGIC = {"And": "logical_and", "Or": "logical_or", "Not": "logical_not"}


def read_formula(formula: Sympy, known: Mapping[str, Symbol] | None = None) -> Sum:
    """Return a formula of sympy as a tree; names that are not known are read as letters with indices."""
    return alone(_Reader(known or {}).node(sympy.sympify(formula)))


def text_of(formula: Sympy, known: Mapping[str, Symbol] | None = None) -> str:
    """Return a formula of sympy in plain text, as in a book."""
    return text.formula(read_formula(formula, known))


def latex_of(formula: Sympy, known: Mapping[str, Symbol] | None = None) -> str:
    """Return a formula of sympy in LaTeX, as in a book."""
    return latex.formula(read_formula(formula, known))


class _Reader:
    """Reads formulas.

    Parameters
    ----------
    known
        Symbols by their names.
    """

    def __init__(self, known: Mapping[str, Symbol]) -> None:
        self._known = known

    def node(self, one: Sympy) -> Node:
        """Return a formula as a tree."""
        if one.is_Add:
            return in_brackets(map(self._term, one.args))
        if one.is_Number and one.is_finite:
            return Sum(() if one.is_zero else (Term(_number(one)),))
        if one.is_Mul or (one.is_Pow and one.exp.is_Rational):
            return Sum((self._term(one),))
        return self._atom(one)

    def _term(self, one: Sympy) -> Term:
        """Return a product as a term."""
        number: Number = ONE
        factors: list[Factor] = []
        for factor in one.as_ordered_factors() if one.is_Mul else (one,):
            if factor.is_Number and factor.is_finite:
                number = number * _number(factor)
            elif factor.is_Pow and factor.exp.is_Rational:
                factors.append((self.node(factor.base), Fraction(int(factor.exp.p), int(factor.exp.q))))
            else:
                factors.append((self.node(factor), ONE))
        return _bracket_last(product(number, factors))

    def _atom(self, one: Sympy) -> Node:
        """Return what is neither a sum nor a product nor a number."""
        name = type(one).__name__
        if one.is_Symbol:
            stem = one.name.rstrip("'")
            return Name(self._symbol(stem), len(one.name) - len(stem))
        if one.is_NumberSymbol or one.is_Number or one is sympy.I:
            return Name(Symbol(_CONSTANTS.get(str(one), str(one)), kind="constant"))
        if one.is_Derivative and _is_moving(one.expr) and len(one.variable_count) == 1:
            return Name(self._symbol(one.expr.func.__name__, moves=True), int(one.variable_count[0][1]))
        if _is_moving(one):
            return Name(self._symbol(name, moves=True))
        if one.is_Pow:
            return Call("pow", tuple(map(self.node, one.args)))
        if one.is_Piecewise:
            return self._cases(one.args)
        if isinstance(one, sympy.Integral) and len(one.limits) == 1:
            name = "antiderivative" if len(one.limits[0]) == 1 else "integral"
            return Call(name, tuple(map(self.node, (one.function, *one.limits[0]))))
        if name in _TURNED:
            return Call(_TURNED[name], tuple(map(self.node, one.args[::-1])))
        function = _RELATIONS.get(name) or _LOGIC.get(name) or _FUNCTIONS.get(name, name)
        return Call(function, tuple(map(self.node, one.args)))

    def _cases(self, cases: Iterable[Sympy]) -> Node:
        first, *others = cases
        value = self.node(first.args[0])
        if first.args[1] == True or not others:  # noqa: E712 - a truth value of sympy is no `True`
            return value
        return Call("select", (self.node(first.args[1]), value, self._cases(others)))

    def _symbol(self, name: str, moves: bool = False) -> Symbol:
        return self._known.get(name) or read_symbol(name, moves)


def read_symbol(name: str, moves: bool = False) -> Symbol:
    """Return the symbol that a name of sympy's says: a letter, or the name of a Greek one, with indices behind it."""
    letter, *subscripts = name.split("_")
    split = re.fullmatch(rf"([A-Za-z]|{'|'.join(GREEK)})(\d+)", letter)
    if split:
        letter, subscripts = split[1], [split[2], *subscripts]
    is_momentum = letter == "p" and subscripts and not subscripts[0].isdigit()
    kind = "momentum" if is_momentum else "coordinate" if moves else "parameter"
    below = tuple(one for one in subscripts if one)
    return Symbol(letter, below, unit=_UNITS.get(letter, "1"), kind=kind)


_UNITS = {"m": "kg", "M": "kg", "I": "kg*m^2", "J": "kg*m^2", "g": "m/s^2"}
"""Units of letters, by which textbooks order factors: what stands for masses comes first."""


def _bracket_last(term: Term) -> Term:
    """Return a term in order, sums of what has no mass last."""
    found = in_order(term)
    return replace(found, factors=tuple(sorted(found.factors, key=_is_plain_bracket)))


def _is_plain_bracket(factor: Factor) -> bool:
    units = [one.symbol.unit for one in names_in([factor[0]])]
    return isinstance(factor[0], Sum) and bool(units) and not any("kg" in one for one in units)


_CONSTANTS = {"pi": "pi", "E": "e", "I": "i", "oo": "infinity", "-oo": "-infinity"}


def _is_moving(one: Sympy) -> bool:
    """Return whether something is an unknown function of the time alone, ``theta(t)``."""
    return isinstance(one, sympy.core.function.AppliedUndef) and [str(of) for of in one.args] == ["t"]


def _number(one: Sympy) -> Number:
    return Fraction(int(one.p), int(one.q)) if one.is_Rational else as_decimal(float(one))
