"""Formulas in LaTeX."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from atwood.theory.formulas.notation import GREEK
from atwood.theory.formulas.tree import Call, Factor, Name, Node, Number, Sum, Symbol, Term

_DOTS = ("", r"\dot", r"\ddot", r"\dddot")
_FUNCTIONS = {"log": r"\ln", "asin": r"\arcsin", "acos": r"\arccos", "atan": r"\arctan", "minimum": r"\min"}
_FUNCTIONS |= {"maximum": r"\max", "sign": r"\operatorname{sgn}", "atan2": r"\operatorname{atan2}"}
_FUNCTIONS |= {name: rf"\{name}" for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")}
_RELATIONS = {"less": "<", "less_equal": r"\le", "logical_and": r"\wedge", "logical_or": r"\vee"}


def formula(node: Node) -> str:
    """Return a formula in LaTeX, for use between dollar signs."""
    if isinstance(node, Name):
        return letter(node.symbol, node.dots)
    if isinstance(node, Call):
        return _call(node)
    return _joined(signed_terms(node)) or "0"


def signed_terms(node: Sum) -> list[tuple[str, str]]:
    """Return sign and text of each term of a sum."""
    return [("-" if term.number < 0 else "+", _term(term)) for term in node.terms]


def _joined(terms: Sequence[tuple[str, str]]) -> str:
    text = ""
    for sign, term in terms:
        text += f" {sign} {term}" if text else (f"-{term}" if sign == "-" else term)
    return text


def letter(symbol: Symbol, dots: int = 0) -> str:
    """Return a symbol in LaTeX, with dots for derivatives by time."""
    if symbol.kind == "momentum":  # it has the letter of its coordinate below
        return f"p_{{{letter(Symbol(symbol.subscripts[0], symbol.subscripts[1:]))}}}"
    base = symbol.letter
    if base in GREEK:
        base = f"\\{base}"
    elif len(base) > 1:
        base = rf"\mathrm{{{base}}}"
    if dots:
        base = f"{_DOTS[dots]}{{{base}}}"
    below = ",".join(one if len(one) == 1 or one.isdigit() else rf"\mathrm{{{one}}}" for one in symbol.subscripts)
    return f"{base}_{{{below}}}" if below else base


def number(value: Number) -> str:
    """Return the magnitude of a number."""
    if isinstance(value, Fraction):
        above, below = abs(value.numerator), value.denominator
        return str(above) if below == 1 else rf"\frac{{{above}}}{{{below}}}"
    text = f"{abs(value):.14g}"
    mantissa, _, exponent = text.partition("e")
    return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else text


def _term(term: Term) -> str:
    """Return a term without its sign."""
    above = [(node, power) for node, power in term.factors if power > 0]
    below = [(node, -power) for node, power in term.factors if power < 0]
    if not below:
        head = "" if abs(term.number) == 1 and above else number(term.number)
        body = " ".join(_power(node, power) for node, power in above)
        return f"{head} {body}".strip()
    value = term.number
    top, bottom = (abs(value.numerator), value.denominator) if isinstance(value, Fraction) else (abs(value), 1)
    upper = [] if top == 1 and above else [number(top) if isinstance(top, float) else str(top)]
    lower = [] if bottom == 1 else [str(bottom)]
    upper += [_power(node, power, len(above) == 1 and not upper) for node, power in above]
    lower += [_power(node, power, len(below) == 1 and not lower) for node, power in below]
    return rf"\frac{{{' '.join(upper)}}}{{{' '.join(lower)}}}"


def _power(node: Node, power: Fraction, alone: bool = False) -> str:
    if power.denominator == 2 and abs(power.numerator) == 1:
        return rf"\sqrt{{{formula(node)}}}"
    exponent = str(power.numerator) if power.denominator == 1 else f"{power.numerator}/{power.denominator}"
    if isinstance(node, Call) and node.function in ("sin", "cos", "tan", "sinh", "cosh", "tanh"):
        raised = "" if power == 1 else f"^{{{exponent}}}"
        return _call(node, raised)
    if isinstance(node, Call) and node.function in _RELATIONS:
        text = rf"\left[{_call(node)}\right]"
    elif isinstance(node, Sum) and not (alone and power == 1):
        text = rf"\left({formula(node)}\right)"
    elif isinstance(node, Call) and power != 1:
        text = rf"\left({_call(node)}\right)"
    else:
        text = formula(node)
    return text if power == 1 else f"{text}^{{{exponent}}}"


def _call(node: Call, raised: str = "") -> str:
    arguments = [formula(one) for one in node.arguments]
    name = node.function
    if name in _RELATIONS:
        return f"{arguments[0]} {_RELATIONS[name]} {arguments[1]}"
    if name == "logical_not":
        return rf"\neg \left({arguments[0]}\right)"
    if name == "absolute":
        return rf"\left|{arguments[0]}\right|"
    if name == "floor":
        return rf"\left\lfloor {arguments[0]} \right\rfloor"
    if name == "exp":
        return f"e^{{{arguments[0]}}}"
    if name == "pow":
        return rf"\left({arguments[0]}\right)^{{{arguments[1]}}}"
    if name == "select":
        rows = rf"{arguments[1]} & {arguments[0]} \\ {arguments[2]} & \text{{else}}"
        return rf"\begin{{cases}} {rows} \end{{cases}}"
    head = _FUNCTIONS.get(name, rf"\operatorname{{{name}}}") + raised
    single = node.arguments[0]
    if len(arguments) == 1 and name in ("sin", "cos", "tan") and _is_single(single):
        return f"{head} {arguments[0]}"
    return rf"{head}\left({', '.join(arguments)}\right)"


def _is_single(node: Node) -> bool:
    """Return whether an argument needs no brackets: one name, perhaps with a number."""
    if isinstance(node, Sum):
        return len(node.terms) == 1 and node.terms[0].number > 0 and all(map(_is_plain, node.terms[0].factors))
    return isinstance(node, Name)


def _is_plain(factor: Factor) -> bool:
    return isinstance(factor[0], Name) and factor[1] == 1
