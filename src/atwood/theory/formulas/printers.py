"""Formulas written down: as plain text in Unicode, in LaTeX, as Python code, and as sympy objects.

One walk over the tree; each printer says how it writes names, numbers, powers, products and functions.
"""

from __future__ import annotations

import keyword
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from fractions import Fraction
from functools import lru_cache
from math import isqrt
from typing import Any, ClassVar, Generic, TypeAlias, TypeVar

from atwood.lazy_modules import sympy
from atwood.model.values.letters import GREEK, GREEK_SIGNS
from atwood.theory.formulas.tree import Call, Factor, Name, Node, Number, Sum, Symbol, Term

Sympy: TypeAlias = Any
"""A sympy object."""

_T = TypeVar("_T")


class Printer(ABC, Generic[_T]):
    """Writes formulas in one language."""

    def formula(self, node: Node) -> _T:
        """Return a formula."""
        if isinstance(node, Name):
            return self.letter(node.symbol, node.dots)
        return self._call(node) if isinstance(node, Call) else self._sum(node.terms)

    @abstractmethod
    def letter(self, symbol: Symbol, dots: int = 0) -> _T:
        """Return a symbol, or its derivative by time of an order."""

    @abstractmethod
    def _call(self, node: Call) -> _T:
        """Return a function of some arguments."""

    @abstractmethod
    def _sum(self, terms: Iterable[Term]) -> _T:
        """Return a sum of terms."""


class _Lines(Printer[str]):
    """Writes formulas in one line of characters: signs between terms, what is below behind one stroke."""

    zero: ClassVar[str]
    times: ClassVar[str]
    relations: ClassVar[Mapping[str, str]] = {}
    """How conditions are written, which stand in brackets within sums."""
    forms: ClassVar[Mapping[str, str]]
    """How functions are written that are not their name before their arguments in brackets."""

    def _sum(self, terms: Iterable[Term]) -> str:
        terms, written = tuple(terms), ""
        if len(terms) == 1 and terms[0].number == 1 and len(terms[0].factors) == 1:
            node, power = terms[0].factors[0]
            if power == 1 and isinstance(node, Call) and node.function in self.relations:
                return self.formula(node)
        for term in terms:
            sign, one = "-" if term.number < 0 else "+", self._term(term)
            written += f" {sign} {one}" if written else f"-{one}" if sign == "-" else one
        return written or self.zero

    def _term(self, term: Term) -> str:
        """Return a term without its sign."""
        above = [self._power(node, exponent) for node, exponent in term.factors if exponent > 0]
        below = [self._power(node, -exponent) for node, exponent in term.factors if exponent < 0]
        head = [] if abs(term.number) == 1 and above else [self._number(term.number)]
        written = self.times.join((*head, *above))
        if not below:
            return written
        return f"{written} / {below[0]}" if len(below) == 1 else f"{written} / ({self.times.join(below)})"

    def _call(self, node: Call, raised: str = "") -> str:
        arguments = [self.formula(one) for one in node.arguments]
        form = self.forms.get(node.function)
        return self._function(node, arguments, raised) if form is None else form.format(*arguments)

    @abstractmethod
    def _number(self, value: Number) -> str:
        """Return the magnitude of a number."""

    @abstractmethod
    def _power(self, node: Node, power: Fraction) -> str:
        """Return a power of what is multiplied."""

    @abstractmethod
    def _function(self, node: Call, arguments: list[str], raised: str) -> str:
        """Return a function by its name, with an exponent where functions have one there."""


def _relations(less_equal: str, both: str, either: str, form: str = "{{0}} {} {{1}}") -> dict[str, str]:
    """Return how comparisons and what joins them are written."""
    signs = {"less": "<", "less_equal": less_equal, "logical_and": both, "logical_or": either}
    return {name: form.format(sign) for name, sign in signs.items()}


class _Text(_Lines):
    """Plain text, with the letters, dots and small figures of Unicode."""

    zero, times = "0", " "
    relations = _relations("≤", "∧", "∨") | {"equal": "{0} = {1}", "greater": "{0} > {1}"}
    forms = relations | {
        "select": "({1} if {0} else {2})",
        "logical_not": "¬({0})",
        "pow": "({0})^({1})",
        "absolute": "|{0}|",
        "integral": "∫[{2}, {3}] {0} d{1}",
        "antiderivative": "∫ {0} d{1}",
        "elliptic_k": "K({0})",
        "elliptic_e": "E({0})",
    }
    _LETTERS: ClassVar = dict(zip(GREEK, GREEK_SIGNS, strict=True))
    _BELOW, _ABOVE = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"), str.maketrans("0123456789-/", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻ᐟ")
    _DOTS = ("", "\u0307", "\u0308", "\u20db")
    _PARTS: ClassVar = {Fraction(1, n): part for n, part in zip((2, 3, 4, 6, 8), "½⅓¼⅙⅛", strict=True)}
    _PARTS |= {Fraction(2, 3): "⅔", Fraction(3, 4): "¾", Fraction(3, 2): "3/2"}

    def letter(self, symbol: Symbol, dots: int = 0) -> str:
        if symbol.kind == "momentum":  # it has the letter of its coordinate below
            return f"p_{self.letter(Symbol(symbol.subscripts[0], symbol.subscripts[1:]))}"
        if symbol.kind == "distance":
            return f"|{' - '.join(self.letter(Symbol(symbol.letter, (end,))) for end in symbol.subscripts)}|"
        base = self._LETTERS.get(symbol.letter, symbol.letter) + self._DOTS[dots]
        if all(one.isdigit() for one in symbol.subscripts):
            return base + "".join(symbol.subscripts).translate(self._BELOW)
        return "_".join((base, *symbol.subscripts))

    def _number(self, value: Number) -> str:
        if isinstance(value, Fraction):
            size = abs(value)
            return self._PARTS.get(size) or (str(size) if size.denominator == 1 else f"({size})")
        return f"{abs(value):.14g}"

    def _power(self, node: Node, power: Fraction) -> str:
        if power == Fraction(1, 2):
            inner = self.formula(node)
            return f"√{inner}" if isinstance(node, Name) or inner.isdigit() else f"√({inner})"
        raised = "" if power == 1 else str(power).translate(self._ABOVE)
        if isinstance(node, Call) and node.function in ("sin", "cos", "tan"):
            return self._call(node, raised)
        written = self.formula(node)
        if isinstance(node, Call) and node.function in self.relations:
            return f"[{written}]{raised}"
        return (f"({written})" if isinstance(node, Sum) or (isinstance(node, Call) and raised) else written) + raised

    def _function(self, node: Call, arguments: list[str], raised: str) -> str:
        single = isinstance(node.arguments[0], Name) or (len(arguments) == 1 and len(arguments[0].split()) == 1)
        if single and node.function in ("sin", "cos", "tan"):
            return f"{node.function}{raised} {arguments[0]}"
        return f"{node.function}{raised}({', '.join(arguments)})"


class _Latex(_Lines):
    """LaTeX, for use between dollar signs."""

    zero, times = "0", " "
    relations = _relations(r"\le", r"\wedge", r"\vee") | {"equal": "{0} = {1}", "greater": "{0} > {1}"}
    forms = relations | {
        "select": r"\begin{{cases}} {1} & {0} \\ {2} & \text{{else}} \end{{cases}}",
        "logical_not": r"\neg \left({0}\right)",
        "pow": r"\left({0}\right)^{{{1}}}",
        "absolute": r"\left|{0}\right|",
        "floor": r"\left\lfloor {0} \right\rfloor",
        "integral": r"\int_{{{2}}}^{{{3}}} {0} \, d{1}",
        "exp": "e^{{{0}}}",
        "antiderivative": r"\int {0} \, d{1}",
        "elliptic_k": r"K\left({0}\right)",
        "elliptic_e": r"E\left({0}\right)",
    }
    _DOTS = ("", r"\dot", r"\ddot", r"\dddot")
    _WAVES = ("sin", "cos", "tan", "sinh", "cosh", "tanh")
    _NAMES: ClassVar = {"log": r"\ln", "asin": r"\arcsin", "acos": r"\arccos", "atan": r"\arctan", "minimum": r"\min"}
    _NAMES |= {"maximum": r"\max", "sign": r"\operatorname{sgn}"} | {name: rf"\{name}" for name in _WAVES}

    def letter(self, symbol: Symbol, dots: int = 0) -> str:
        if symbol.kind == "momentum":  # it has the letter of its coordinate below
            return f"p_{{{self.letter(Symbol(symbol.subscripts[0], symbol.subscripts[1:]))}}}"
        if symbol.kind == "distance":
            ends = r" - ".join(rf"\mathbf{{{symbol.letter}}}_{{\mathrm{{{end}}}}}" for end in symbol.subscripts)
            return rf"\left|{ends}\right|"
        base = symbol.letter
        if base in GREEK:
            base = f"\\{base}"
        elif len(base) > 1:
            base = rf"\mathrm{{{base}}}"
        if dots:
            base = f"{self._DOTS[dots]}{{{base}}}"
        below = ",".join(one if len(one) == 1 or one.isdigit() else rf"\mathrm{{{one}}}" for one in symbol.subscripts)
        return f"{base}_{{{below}}}" if below else base

    def _number(self, value: Number) -> str:
        if isinstance(value, Fraction):
            above, below = abs(value.numerator), value.denominator
            return str(above) if below == 1 else rf"\frac{{{above}}}{{{below}}}"
        mantissa, _, exponent = f"{abs(value):.14g}".partition("e")
        return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else mantissa

    def _term(self, term: Term) -> str:
        above = [(node, power) for node, power in term.factors if power > 0]
        below = [(node, -power) for node, power in term.factors if power < 0]
        if not below:
            return super()._term(term)
        top = term.times(Fraction(1 if term.number > 0 else -1)).number
        bottom = 1
        if isinstance(top, Fraction):
            top, bottom = Fraction(top.numerator), top.denominator
        upper = [] if top == 1 and above else [self._number(top)]
        lower = [] if bottom == 1 else [str(bottom)]
        upper += [self._power(node, power, len(above) == 1 and not upper) for node, power in above]
        lower += [self._power(node, power, len(below) == 1 and not lower) for node, power in below]
        return rf"\frac{{{' '.join(upper)}}}{{{' '.join(lower)}}}"

    def _power(self, node: Node, power: Fraction, alone: bool = False) -> str:
        if power.denominator == 2 and abs(power.numerator) == 1:
            return rf"\sqrt{{{self.formula(node)}}}"
        raised = "" if power == 1 else f"^{{{power}}}"
        if isinstance(node, Call) and node.function in self._WAVES:
            return self._call(node, raised)
        written = self.formula(node)
        if isinstance(node, Call) and node.function in self.relations:
            return rf"\left[{written}\right]{raised}"
        if (isinstance(node, Sum) and (raised or not alone)) or (isinstance(node, Call) and raised):
            return rf"\left({written}\right){raised}"
        return written + raised

    def _function(self, node: Call, arguments: list[str], raised: str) -> str:
        head = self._NAMES.get(node.function, rf"\operatorname{{{node.function}}}") + raised
        if len(arguments) == 1 and node.function in ("sin", "cos", "tan") and _needs_no_brackets(node.arguments[0]):
            return f"{head} {arguments[0]}"
        return rf"{head}\left({', '.join(arguments)}\right)"


def _needs_no_brackets(node: Node) -> bool:
    """Return whether an argument is one product of names, perhaps with a positive number."""

    def is_plain(factor: Factor) -> bool:
        return isinstance(factor[0], Name) and factor[1] == 1

    if isinstance(node, Sum):
        return len(node.terms) == 1 and node.terms[0].number > 0 and all(map(is_plain, node.terms[0].factors))
    return isinstance(node, Name)


class _Code(_Lines):
    """Python, with the functions of `math`."""

    zero, times = "0.0", " * "
    MATH = (
        *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "exp", "log"),
        *("sinh", "cosh", "tanh", "sqrt", "floor", "pi"),
    )
    """The names of `math` that formulas use."""

    _BINARY = _relations("<=", "and", "or", "({{0}}) {} ({{1}})") | {"pow": "({0}) ** ({1})"}
    _NAMES: ClassVar = {"absolute": "abs", "minimum": "min", "maximum": "max"}
    forms = _BINARY | {
        "select": "({1} if {0} else {2})",
        "logical_not": "not ({0})",
        "sign": "(({0} > 0.0) - ({0} < 0.0))",
    }
    KNOWN = frozenset({*MATH, *_NAMES, *forms, "component"})
    """The functions that can be written down."""

    RESERVED = frozenset(
        {"t", "y", "q", "u", "a", "np", "solve", "rates", "mass_matrix", "bias", "constraints", "constraint_jacobian"}
        | {"constraint_bias", "accelerations", "derivative", "M", "G", "RANK", *MATH, *_NAMES.values()}
    )
    """Names that mean something else in a module; a symbol that is called so has a line after its name."""

    _ENDS = ("", "_dot", "_ddot", "_dddot")

    def letter(self, symbol: Symbol, dots: int = 0) -> str:
        name = "".join(one if one.isalnum() or one == "_" else "_" for one in symbol.name) + self._ENDS[dots]
        taken = keyword.iskeyword(name) or (name in self.RESERVED and symbol.kind != "time")
        return f"{name}_" if taken else name

    def _number(self, value: Number) -> str:
        if isinstance(value, Fraction):
            size = abs(value)
            return f"{size.numerator}.0" if size.denominator == 1 else f"({size.numerator} / {size.denominator})"
        return repr(abs(value))

    def _power(self, node: Node, power: Fraction) -> str:
        if power == Fraction(1, 2):
            return f"sqrt({self.formula(node)})"
        written = self.formula(node)
        if isinstance(node, Sum) or (isinstance(node, Call) and node.function in self._BINARY):
            written = f"({written})"
        if power == 1:
            return written
        return f"{written} ** {power}" if power.denominator == 1 else f"{written} ** ({power})"

    def _function(self, node: Call, arguments: list[str], raised: str) -> str:
        if node.function == "component":
            size = isqrt(len(arguments) - 1)
            matrix, right = ", ".join(arguments[: size * size]), ", ".join(arguments[size * size : -1])
            return f"solve(np.reshape([{matrix}], ({size}, {size})), [{right}])[int({arguments[-1]})]"
        return f"{self._NAMES.get(node.function, node.function)}({', '.join(arguments)})"


class _Objects(Printer[Sympy]):
    """Sympy objects: what moves is a function of time, so that it can be differentiated; nothing is assumed of it."""

    _NAMES: ClassVar = {"absolute": "Abs", "minimum": "Min", "maximum": "Max", "less": "Lt", "less_equal": "Le"}
    _NAMES |= {"pow": "Pow"}
    _LOGIC: ClassVar = {"logical_and": "And", "logical_or": "Or", "logical_not": "Not"}

    @staticmethod
    @lru_cache(maxsize=4096)
    def _symbol(symbol: Symbol, dots: int) -> Sympy:
        if symbol.letter == "pi" and symbol.kind == "time":
            return sympy.pi
        t = sympy.Symbol("t")
        made = sympy.Function(symbol.name)(t) if symbol.moves else sympy.Symbol(symbol.name)
        return sympy.Derivative(made, (t, dots)) if dots else made

    def letter(self, symbol: Symbol, dots: int = 0) -> Sympy:
        return self._symbol(symbol, dots)

    def _sum(self, terms: Iterable[Term]) -> Sympy:
        return sympy.Add(*map(self._term, terms))

    def _term(self, term: Term) -> Sympy:
        powers = [_value(self.formula(node)) ** self._number(power) for node, power in term.factors]
        return sympy.Mul(self._number(term.number), *powers)

    def _number(self, value: Number) -> Sympy:
        return sympy.Rational(value.numerator, value.denominator) if isinstance(value, Fraction) else sympy.Float(value)

    def _call(self, node: Call) -> Sympy:
        name, arguments = node.function, [self.formula(one) for one in node.arguments]
        if name == "component":
            size = isqrt(len(arguments) - 1)
            matrix = sympy.Matrix(size, size, arguments[: size * size])
            return matrix.LUsolve(sympy.Matrix(arguments[size * size : -1]))[int(arguments[-1])]
        if name == "select":
            return sympy.Piecewise((_value(arguments[1]), _condition(arguments[0])), (_value(arguments[2]), True))
        if name in self._LOGIC:
            return getattr(sympy, self._LOGIC[name])(*map(_condition, arguments))
        function = getattr(sympy, self._NAMES.get(name, name), None) or sympy.Function(name)
        return function(*map(_value, arguments))


def _value(item: Sympy) -> Sympy:
    """Return a condition as 1 or 0, other things as they are."""
    return sympy.Piecewise((1, item), (0, True)) if _is_condition(item) else item


def _condition(item: Sympy) -> Sympy:
    """Return a number as the condition that it is not zero, conditions as they are."""
    return item if _is_condition(item) else sympy.Ne(item, 0)


def _is_condition(item: Sympy) -> bool:
    return isinstance(item, sympy.logic.boolalg.Boolean) and not isinstance(item, sympy.Symbol)


text, latex, code, objects = _Text(), _Latex(), _Code(), _Objects()
