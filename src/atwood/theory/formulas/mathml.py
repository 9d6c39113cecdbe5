"""Formulas in MathML, which browsers show without further help (W3C, MathML Core)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from html import escape

from atwood.theory.formulas.page import Line, Matrix, Section, rows_of
from atwood.theory.formulas.printers import Printer, text
from atwood.theory.formulas.tree import Call, Factor, Name, Node, Number, Sum, Symbol, Term

_DOTS = ("", "\u02d9", "\u00a8", "\u20db")
_WAVES = ("sin", "cos", "tan", "sinh", "cosh", "tanh")
_NAMES = {"log": "ln", "asin": "arcsin", "acos": "arccos", "atan": "arctan", "minimum": "min", "maximum": "max"}
_NAMES |= {"sign": "sgn"}
_RELATIONS = {"less": "&lt;", "greater": "&gt;", "less_equal": "≤", "logical_and": "∧", "logical_or": "∨", "equal": "="}
_STYLE = (
    "body { font-family: serif; max-width: 60em; margin: 2em auto; padding: 0 1em } td, th { padding: 0 .8em; "
    "text-align: left; vertical-align: top } math { font-size: 115% } mtd { text-align: left; padding: .2em } "
    ".line { overflow-x: auto; padding: .3em 0 }"
)


class _MathML(Printer[str]):
    """Writes elements of MathML."""

    def letter(self, symbol: Symbol, dots: int = 0) -> str:
        if symbol.kind == "momentum":  # it has the letter of its coordinate below
            below = self.letter(Symbol(symbol.subscripts[0], symbol.subscripts[1:]))
            return f"<msub><mi>p</mi>{below}</msub>"
        base = f"<mi>{escape(text.letter(Symbol(symbol.letter)))}</mi>"
        if dots:
            base = f"<mover>{base}<mo>{_DOTS[dots]}</mo></mover>"
        kinds = [("mn" if one.isdigit() else "mi", escape(text.letter(Symbol(one)))) for one in symbol.subscripts]
        below = "".join(f"<{kind}>{one}</{kind}>" for kind, one in kinds)
        return f"<msub>{base}{_row(below)}</msub>" if below else base

    def _sum(self, terms: Iterable[Term]) -> str:
        return "".join(self.signed(term, not place) for place, term in enumerate(terms)) or "<mn>0</mn>"

    def signed(self, term: Term, is_first: bool) -> str:
        """Return a term with its sign, which the first one of a sum has only where it is subtracted."""
        sign = "−" if term.number < 0 else "" if is_first else "+"
        return (_sign(sign, not is_first) if sign else "") + self._term(term)

    def _term(self, term: Term) -> str:
        """Return a term without its sign, what is below as a fraction."""
        above = [(node, power) for node, power in term.factors if power > 0]
        below = [(node, -power) for node, power in term.factors if power < 0]
        size: Number = term.number if term.number > 0 else -term.number
        under = 1
        if isinstance(size, Fraction):
            under = size.denominator
            size = Fraction(size.numerator)
        upper = ([] if size == 1 and above else [_number(size)]) + self._factors(above, alone=size == 1)
        lower = ([] if under == 1 else [f"<mn>{under}</mn>"]) + self._factors(below, alone=under == 1)
        top = "".join(upper)
        return f"<mfrac>{_row(top)}{_row(''.join(lower))}</mfrac>" if lower else top

    def _factors(self, factors: Sequence[Factor], alone: bool) -> list[str]:
        return [self._power(node, power, alone and len(factors) == 1) for node, power in factors]

    def _power(self, node: Node, power: Fraction, is_alone: bool) -> str:
        if power == Fraction(1, 2):
            return f"<msqrt>{self.formula(node)}</msqrt>"
        raised = "" if power == 1 else f"<mn>{power}</mn>"
        if isinstance(node, Call) and node.function in _WAVES:
            return self._function(node, raised)
        written = self.formula(node)
        is_sum = isinstance(node, Sum) and (bool(raised) or not is_alone)
        if is_sum or (isinstance(node, Call) and (raised or node.function in _RELATIONS)):
            written = _brackets(written)
        if raised and isinstance(node, Name) and written.startswith("<msub>"):
            return f"<msubsup>{written.removeprefix('<msub>').removesuffix('</msub>')}{raised}</msubsup>"
        return f"<msup>{_row(written)}{raised}</msup>" if raised else written

    def _call(self, node: Call) -> str:
        arguments = [self.formula(one) for one in node.arguments]
        match node.function:
            case "less" | "greater" | "less_equal" | "logical_and" | "logical_or" | "equal":
                return f"<mo>{_RELATIONS[node.function]}</mo>".join(arguments)
            case "logical_not":
                return f"<mo>¬</mo>{_brackets(arguments[0])}"
            case "absolute":
                return f"<mo>|</mo>{arguments[0]}<mo>|</mo>"
            case "exp":
                return f"<msup><mi>e</mi>{_row(arguments[0])}</msup>"
            case "pow":
                return f"<msup>{_row(_brackets(arguments[0]))}{_row(arguments[1])}</msup>"
            case "select":
                cells = ((arguments[1], arguments[0]), (arguments[2], "<mtext>else</mtext>"))
                rows = "".join(f"<mtr><mtd>{a}</mtd><mtd>{b}</mtd></mtr>" for a, b in cells)
                return f"<mrow><mo>{{</mo><mtable>{rows}</mtable></mrow>"
            case "integral" | "antiderivative":
                sign = "<mo>∫</mo>"
                if len(arguments) == 4:
                    sign = f"<msubsup>{sign}{_row(arguments[2])}{_row(arguments[3])}</msubsup>"
                return f"{sign}{arguments[0]}<mi>d</mi>{arguments[1]}"
        return self._function(node, "")

    def _function(self, node: Call, raised: str) -> str:
        name = f"<mi>{escape(_NAMES.get(node.function, node.function))}</mi>"
        head = f"<msup>{name}{raised}</msup>" if raised else name
        arguments = [self.formula(one) for one in node.arguments]
        if node.function in _WAVES and isinstance(node.arguments[0], Name):
            return f"{head}<mo>&#x2061;</mo>{arguments[0]}"
        return f"{head}<mo>&#x2061;</mo>{_brackets('<mo>,</mo>'.join(arguments))}"


def _sign(sign: str, is_between: bool = True) -> str:
    """Return a sign between two terms, or before one."""
    return f'<mo form="{"infix" if is_between else "prefix"}">{sign}</mo>'


def _row(inside: str) -> str:
    return f"<mrow>{inside}</mrow>"


def _brackets(inside: str) -> str:
    return f"<mrow><mo>(</mo>{inside}<mo>)</mo></mrow>"


def _number(value: Number) -> str:
    mantissa, _, exponent = (str(value) if isinstance(value, Fraction) else f"{value:.14g}").partition("e")
    power = f"<mo>·</mo><msup><mn>10</mn><mn>{int(exponent)}</mn></msup>" if exponent else ""
    return f"<mn>{mantissa}</mn>{power}"


mathml = _MathML()


def as_mathml(title: str, sections: Sequence[Section], tables: Sequence[str] = (), by_part: bool = False) -> str:
    """Return sections as HTML; each term says on hovering, or by part beside it, from which parts it comes."""
    blocks = [f"<h2>{escape(title)}</h2>", *tables]
    for section in sections:
        blocks.append(f"<h3>{escape(section.title)}</h3>")
        blocks += [f"<p>{escape(section.said)}</p>"] if section.said else []
        blocks += [_line(line, by_part) for line in section.lines]
    return "\n".join(blocks)


def document(title: str, body: str) -> str:
    """Return a page of HTML with a title and a body."""
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'
    return f"<!doctype html>\n<html><head>{head}</head>\n<body>\n{body}\n</body></html>\n"


def _line(line: Line | Matrix, by_part: bool) -> str:
    left = f"<mtext>{escape(line.left[1])}</mtext>{_sign('=')}" if line.left[1] else ""
    if isinstance(line, Matrix):
        cells = ("".join(f"<mtd>{mathml.formula(one)}</mtd>" for one in row) for row in line.entries)
        table = f"<mtable>{''.join(f'<mtr>{row}</mtr>' for row in cells)}</mtable>"
        return f'<div class="line"><math>{_row(left + _brackets(table))}</math></div>'
    rows = [
        "".join(_owned(term, not number + k, by_part) for k, term in enumerate(row))
        for number, row in enumerate(rows_of(line, by_part))
    ]
    rows[-1] = (rows[-1] or "<mn>0</mn>") + (f"<mtext> {escape(line.right)}</mtext>" if line.right else "")
    shown = "".join(f"<mtr><mtd>{'' if k else left}</mtd><mtd>{row}</mtd></mtr>" for k, row in enumerate(rows))
    return f'<div class="line"><math><mtable displaystyle="true">{shown}</mtable></math></div>'


def _owned(term: Term, is_first: bool, by_part: bool) -> str:
    """Return a term with its sign, that says on hovering from which parts it comes."""
    tip = f' title="{escape(", ".join(term.owners), quote=True)}"' if term.owners else ""
    said = f"<mtext>&#xa0;&#xa0;[{escape(', '.join(term.owners))}]</mtext>" if by_part and term.owners else ""
    return f"<mrow{tip}>{mathml.signed(term, is_first)}{said}</mrow>"
