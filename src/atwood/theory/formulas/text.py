"""Formulas in one line of plain text, with the letters, dots and small figures of Unicode."""

from __future__ import annotations

from fractions import Fraction

from atwood.theory.formulas.lines import quotient, signed_sum
from atwood.theory.formulas.notation import GREEK
from atwood.theory.formulas.tree import Call, Name, Node, Number, Sum, Symbol, Term

_LETTERS = dict(
    zip(GREEK, "αβγδεζηθικλμνξπρστυφχψωΓΔΘΛΞΠΣΥΦΨΩ", strict=True),
)
_BELOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_ABOVE = str.maketrans("0123456789-/", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻ᐟ")
_DOTS = ("", "\u0307", "\u0308", "\u20db")
_PARTS = {Fraction(1, 2): "½", Fraction(1, 3): "⅓", Fraction(1, 4): "¼", Fraction(2, 3): "⅔", Fraction(3, 4): "¾"}
_PARTS |= {Fraction(1, 6): "⅙", Fraction(1, 8): "⅛", Fraction(3, 2): "3/2"}
_RELATIONS = {"less": "<", "less_equal": "≤", "logical_and": "∧", "logical_or": "∨"}


def formula(node: Node) -> str:
    """Return a formula in one line."""
    if isinstance(node, Name):
        return letter(node.symbol, node.dots)
    if isinstance(node, Call):
        return _call(node)
    return signed_sum(node.terms, _term) or "0"


def letter(symbol: Symbol, dots: int = 0) -> str:
    """Return a symbol with dots for derivatives by time."""
    if symbol.kind == "momentum":  # it has the letter of its coordinate below
        return f"p_{letter(Symbol(symbol.subscripts[0], symbol.subscripts[1:]))}"
    base = _LETTERS.get(symbol.letter, symbol.letter) + _DOTS[dots]
    figures = [one for one in symbol.subscripts if one.isdigit()]
    if len(figures) == len(symbol.subscripts):
        return base + "".join(one.translate(_BELOW) for one in figures)
    return "_".join((base, *symbol.subscripts))


def _term(term: Term) -> str:
    return quotient(term, _number, _power, times=" ")


def _number(value: Number) -> str:
    if isinstance(value, Fraction):
        size = abs(value)
        return _PARTS.get(size) or (str(size) if size.denominator == 1 else f"({size})")
    return f"{abs(value):.14g}"


def _power(node: Node, power: Fraction) -> str:
    if power == Fraction(1, 2):
        inner = formula(node)
        return f"√{inner}" if isinstance(node, Name) else f"√({inner})"
    raised = "" if power == 1 else str(power).translate(_ABOVE)
    if isinstance(node, Call) and node.function in ("sin", "cos", "tan"):
        return _call(node, raised)
    text = formula(node)
    if isinstance(node, Call) and node.function in _RELATIONS:
        return f"[{text}]{raised}"
    return (f"({text})" if isinstance(node, Sum) or (isinstance(node, Call) and raised) else text) + raised


def _call(node: Call, raised: str = "") -> str:
    arguments = [formula(one) for one in node.arguments]
    if node.function in _RELATIONS:
        return f"{arguments[0]} {_RELATIONS[node.function]} {arguments[1]}"
    if node.function == "select":
        return f"({arguments[1]} if {arguments[0]} else {arguments[2]})"
    if node.function == "logical_not":
        return f"¬({arguments[0]})"
    if node.function == "pow":
        return f"({arguments[0]})^({arguments[1]})"
    if node.function == "absolute":
        return f"|{arguments[0]}|"
    single = isinstance(node.arguments[0], Name) or (len(node.arguments) == 1 and len(arguments[0].split()) == 1)
    if single and node.function in ("sin", "cos", "tan"):
        return f"{node.function}{raised} {arguments[0]}"
    return f"{node.function}{raised}({', '.join(arguments)})"
