"""Expressions in sympy, to be compared with what sympy makes of them."""

import math
from collections import Counter
from fractions import Fraction

import sympy

from atwood.expr.core.analysis import live
from atwood.expr.core.graph import Expression
from atwood.expr.core.operations import LEAVES

_LARGEST_DENOMINATOR = 64
_TO_SYMPY = {"absolute": "Abs", "log": "log", "minimum": "Min", "maximum": "Max"}


def to_sympy(expressions, symbols=None):
    """Return expressions written out in full in sympy."""
    return _translate(expressions, symbols or {}, None)[1]


def to_sympy_shared(
    expressions,
    symbols=None,
    prefix="x",
):
    """Return expressions in sympy with names for what they share."""
    return _translate(expressions, symbols or {}, prefix)


def _translate(expressions, symbols, prefix):
    nodes = live(expressions)
    uses = Counter(argument.index for node in nodes for argument in node.arguments)
    known = {node.index: text for node, text in symbols.items()}
    taken = {str(text) for text in symbols.values()} | {node.name for node in nodes if node.is_symbol}
    replacements = []
    for node in nodes:
        if node.index in known:
            continue
        written = _write(node, [known[argument.index] for argument in node.arguments])
        if prefix is not None and uses[node.index] > 1 and _deserves_name(node):
            name = sympy.Symbol(_free_name(prefix, len(replacements), taken), real=True)
            replacements.append((name, written))
            written = name
        known[node.index] = written
    return replacements, [known[e.index] if isinstance(e, Expression) else _number(e) for e in expressions]


def _deserves_name(node):
    """Return whether an intermediate value is worth a name: not leaves, conditions, signs or bare solves."""
    return node.operation not in LEAVES | {"neg", "solve"} and not node.operation.startswith(("less", "logical"))


def _free_name(prefix, position, taken):
    name = f"{prefix}{position}"
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def _number(value):
    """Return a float as an exact small fraction or multiple of pi if it is one, else as a float."""
    if not math.isfinite(value):
        return sympy.nan if value != value else sympy.oo if value > 0 else -sympy.oo
    fraction = Fraction(value).limit_denominator(_LARGEST_DENOMINATOR)
    if float(fraction) == value:
        return sympy.Rational(fraction.numerator, fraction.denominator)
    turns = Fraction(value / math.pi).limit_denominator(12)
    if turns and turns.numerator * math.pi / turns.denominator == value:
        return sympy.Rational(turns.numerator, turns.denominator) * sympy.pi
    return sympy.Float(value)


def _write(node, arguments):
    """Return one node in sympy.  Conditions become sympy booleans, solves become lists of unknowns."""
    operation = node.operation
    if operation == "constant":
        return _number(node.payload)
    if operation == "symbol":
        return sympy.Symbol(node.payload, real=True)
    if operation == "component":
        return arguments[0][node.payload]
    if operation == "external":
        return sympy.Function(node.payload.name)(*(_as_value(argument) for argument in arguments))
    if operation in ("logical_and", "logical_or", "logical_not"):
        function = {"logical_and": sympy.And, "logical_or": sympy.Or, "logical_not": sympy.Not}[operation]
        return function(*(_as_condition(argument) for argument in arguments))
    if operation == "select":
        condition, a, b = arguments
        return sympy.Piecewise((_as_value(a), _as_condition(condition)), (_as_value(b), True))
    values = [_as_value(argument) for argument in arguments]
    if operation == "solve":
        split = node.payload**2
        matrix = sympy.Matrix(node.payload, node.payload, values[:split])
        return list(matrix.LUsolve(sympy.Matrix(values[split:])))
    simple = {
        "add": lambda a, b: a + b,
        "sub": lambda a, b: a - b,
        "mul": lambda a, b: a * b,
        "div": lambda a, b: a / b,
        "neg": lambda a: -a,
        "pow": lambda a, b: a**b,
        "less": sympy.Lt,
        "less_equal": sympy.Le,
    }
    function = simple.get(operation) or getattr(sympy, _TO_SYMPY.get(operation, operation))
    return function(*values)


def _as_value(item):
    """Return a condition as 1 or 0, other things as they are."""
    if isinstance(item, (sympy.logic.boolalg.Boolean, bool)) and not isinstance(item, sympy.Symbol):
        return sympy.Piecewise((1, item), (0, True))
    return item


def _as_condition(item):
    """Return a number as the condition that it is not zero, other things as they are."""
    if isinstance(item, sympy.logic.boolalg.Boolean) and not isinstance(item, sympy.Symbol):
        return item
    return sympy.Ne(item, 0)
