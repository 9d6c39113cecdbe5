"""Functions of time: from formulas in text, tried out on an expression, written as plain data, and read back.

A function is written as a list of steps, each ``[operation, argument, ...]``. An argument is a number, ``"t"`` for the
time (or the name of another argument of the function), or ``"#3"`` for the value of step 3; the value of the function
is that of the last step.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from atwood.arguments import show
from atwood.errors import AtwoodError, ParameterError, UsageError, near_matches, suggestion
from atwood.expr.core import functions
from atwood.expr.core.analysis import live
from atwood.expr.core.graph import Expression, Graph
from atwood.expr.core.operations import BINARY, UNARY
from atwood.model.values.units import Unit, parse_quantity, parse_unit, split_quantity, unit_of

_ADVICE = "Write it in plain arithmetic with Atwood's own functions (atwood.sin, atwood.select, ...)."
Steps = Sequence[Sequence[Any]]


def trace(function: Callable[..., Any], where: str, arguments: Sequence[str] = ("t",)) -> Expression:
    """Return what a function gives for symbols of a graph of its own: ``t``, or those of other arguments."""
    graph = Graph()
    try:
        return graph.convert(function(*map(graph.symbol, arguments)))
    except RecursionError:
        reason = "it calls itself without end"
    except Exception as error:  # what a user's function raises is anything
        reason = error.message if isinstance(error, AtwoodError) else f"{type(error).__name__}: {error}"
    raise ParameterError(
        f"this function of time cannot be evaluated on an expression ({reason})", where=where, advice=_ADVICE
    )


def check_function(function: Callable[[Any], Any], where: str) -> None:
    """Refuse a function of time that cannot be evaluated on an expression."""
    if not isinstance(function, StoredFunction):
        trace(function, where)


def write_function(function: Callable[[Any], Any], where: str) -> list[list[Any]]:
    """Return a function of time as steps."""
    if isinstance(function, StoredFunction):
        return [list(step) for step in function.steps]
    return steps_of(trace(function, where), where)


def steps_of(result: Expression, where: str) -> list[list[Any]]:
    """Return an expression as steps; symbols go by their names."""
    written: dict[int, Any] = {}
    steps: list[list[Any]] = []
    for node in live([result]):
        if node.is_symbol:
            written[node.index] = node.name
            continue
        if node.is_constant and math.isfinite(node.value):
            written[node.index] = node.value
            continue
        if node.operation not in _EVALUATE:
            raise ParameterError(
                f"this function cannot be stored, because of {node!r}",
                where=where,
                advice="External functions and infinite constants cannot be written to a file; set it after loading.",
            )
        own = [] if node.payload is None else [node.payload]
        written[node.index] = f"#{len(steps)}"
        steps.append([node.operation, *own, *(written[argument.index] for argument in node.arguments)])
    if written[result.index] != f"#{len(steps) - 1}":  # the time itself, or a constant
        steps.append(["value", written[result.index]])
    return steps


class StoredFunction:
    """A function that was read back; works on floats and expressions alike.

    Parameters
    ----------
    steps
        As written by `write_function`.
    where
        The path of the input that it drives, or of the parameter that it is.
    arguments
        The names of its arguments; the time alone if not given.

    Raises
    ------
    ParameterError
        If the steps do not make sense.
    """

    def __init__(self, steps: Steps, where: str = "", arguments: Sequence[str] = ("t",)) -> None:
        if not isinstance(steps, (list, tuple)) or not steps:
            raise ParameterError("a stored function needs a list of steps", where=where)
        self.arguments = tuple(arguments)
        self.steps = tuple(_checked_step(step, number, where, self.arguments) for number, step in enumerate(steps))
        check = trace(self, where, self.arguments)
        self.__name__ = f"stored function of {len(live([check]))} operations"

    def __call__(self, *given: Any) -> Any:
        """Return the value, of the time or of the arguments that it has."""
        known = dict(zip(self.arguments, given, strict=True))
        values: list[Any] = []
        for name, *arguments in self.steps:
            read = (_operand(one, known, values) for one in arguments)
            values.append(_EVALUATE[name](*read))
        return values[-1]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, StoredFunction) and self.steps == other.steps

    def __hash__(self) -> int:
        return hash(self.steps)

    def __repr__(self) -> str:
        return f"StoredFunction({[list(step) for step in self.steps]!r})"


def _operand(one: Any, known: Mapping[str, Any], values: Sequence[Any]) -> Any:
    if not isinstance(one, str):
        return one
    return known[one] if one in known else values[int(one[1:])]


def _checked_step(step: Any, number: int, where: str, arguments: Sequence[str]) -> tuple[Any, ...]:
    problem = ""
    if not isinstance(step, (list, tuple)) or not step or not isinstance(step[0], str) or step[0] not in _EVALUATE:
        problem = f"{step!r} is no operation that Atwood knows"
    elif len(step) - 1 != _argument_count(step):
        problem = f"{step!r} has a wrong number of arguments"
    else:
        for one in step[1:]:
            if isinstance(one, str):
                if one not in arguments and not (one[:1] == "#" and one[1:].isdecimal() and int(one[1:]) < number):
                    problem = f"{one!r} is not a value that is known at step {number}"
            elif isinstance(one, bool) or not isinstance(one, (int, float)) or not math.isfinite(one):
                problem = f"{one!r} is not a finite number"
    if problem:
        raise ParameterError(f"the stored function cannot be read: {problem}", where=where)
    return tuple(step)


def _argument_count(step: Sequence[Any]) -> int:
    name = step[0]
    if name == "solve":
        size = step[1] if len(step) > 1 and isinstance(step[1], int) and step[1] > 0 else 0
        return 1 + size * size + size
    return 1 if name in UNARY or name == "value" else 3 if name == "select" else 2


def _solve(size: int, *values: Any) -> list[Any]:
    split = size * size
    rows = [values[i * size : (i + 1) * size] for i in range(size)]
    return functions.solve(rows, values[split:])


def _component(position: int, unknowns: Any) -> Any:
    if not isinstance(unknowns, list) or not 0 <= position < len(unknowns):
        raise UsageError("it is not one of the unknowns of a linear system")
    return unknowns[position]


def _not(a: Any) -> Any:
    return ~a if isinstance(a, Expression) else not a


_NAMED: Mapping[str, Callable[..., Any]] = {
    "value": lambda a: a,
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "neg": operator.neg,
    "pow": operator.pow,
    "less": operator.lt,
    "less_equal": operator.le,
    "logical_and": operator.and_,
    "logical_or": operator.or_,
    "logical_not": _not,
    "select": functions.select,
    "solve": _solve,
    "component": _component,
}
_EVALUATE: Mapping[str, Callable[..., Any]] = {
    name: _NAMED[name] if name in _NAMED else getattr(functions, name) for name in (*_NAMED, *UNARY, *BINARY)
}


_NAMES: Mapping[str, Any] = {
    "pi": math.pi,
    "abs": functions.absolute,
    "min": functions.minimum,
    "max": functions.maximum,
    **{
        name: getattr(functions, name)
        for name in (
            *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "sqrt"),
            *("hypot", "absolute", "minimum", "maximum", "sign", "floor", "select"),
        )
    },
}
_OPERATORS: Mapping[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


def read_text(text: str, symbols: Mapping[str, Any], unit: Unit, where: str) -> Any:
    """Return the value of a formula, or of a quantity, which has no operator between its number and its unit."""
    tree, split = _parsed(text), split_quantity(text)
    if tree is not None:
        try:
            return _value_of(tree, symbols, where)
        except ParameterError as error:
            if split is None or _unit_in(split[1]) is None:
                raise
            raise _two_ways(text, error.message, symbols, unit, where) from None
    if split is None:
        advice = f"Write it as '0.5*{next(iter(symbols))}**2', with {', '.join(symbols)}, pi and functions such as sin."
        raise ParameterError(f"{show(text)} is no formula", where=where, advice=advice)
    if split[1].startswith(("*", "/", "·")) or set(_WORDS.findall(split[1])) & set(symbols):
        raise _two_ways(text, f"{show(text)} is no formula, and no number with a unit", symbols, unit, where)
    return parse_quantity(text, unit, where)


def _parsed(text: str) -> ast.expr | None:
    """Return the tree of a formula; None if it is none, as a quantity is."""
    try:
        tree = ast.parse(text.strip().replace("^", "**").replace("·", "*"), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        return None
    return None if isinstance(tree, ast.Constant) and isinstance(tree.value, complex) else tree  # 5J is five joules


def _unit_in(text: str) -> Unit | None:
    """Return the unit that stands behind a number, maybe after an operator; None if there is none."""
    try:
        return parse_unit(text)
    except AtwoodError:
        return None


def _two_ways(text: str, problem: str, symbols: Mapping[str, Any], unit: Unit, where: str) -> ParameterError:
    """Return the error about text that is neither a formula nor a quantity, with how each is written."""
    number, unit_text = split_quantity(text) or (0.0, "")
    words = set(_WORDS.findall(unit_text))
    behind, given = unit_text.lstrip("*· "), _unit_in(unit_text)
    if given is None or not given.has_dimension_of(unit):
        quantity = f"'{number:g} {'m' if unit.text in ('1', 'any') else unit.text}'"
    elif words & set(symbols):
        quantity = f"'{number * given.factor:g} {unit_of(given.exponents).text}'"
    else:
        quantity = f"'{number:g} {'1' if behind.startswith('/') else ''}{behind}'"
    formula = f"{number:g}*{behind}" if words <= {*symbols, *_NAMES} else f"{number:g}*{next(iter(symbols))}"
    return ParameterError(problem, where=where, advice=f"Write '{formula}' for a formula, {quantity} for a quantity.")


_WORDS = re.compile("[A-Za-z_][A-Za-z_0-9]*")


def unknown_name(name: str, symbols: Mapping[str, Any], where: str) -> ParameterError:
    """Return the error about a name in a formula that is no argument of it."""
    known = [*symbols, *_NAMES]
    advice = suggestion(name, known) if near_matches(name, known) else f"It is a function of {', '.join(symbols)}."
    return ParameterError(f"the formula reads {name!r}, which is no argument of it", where=where, advice=advice)


def _value_of(node: ast.expr, symbols: Mapping[str, Any], where: str) -> Any:
    """Return the value of a formula; nothing in it is run that is not arithmetic."""

    def value(one: ast.expr) -> Any:
        return _value_of(one, symbols, where)

    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
        return float(node.value)
    if isinstance(node, ast.Name):
        if node.id in symbols:
            return symbols[node.id]
        if node.id != "pi":
            raise unknown_name(node.id, symbols, where)
        return math.pi
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](value(node.left), value(node.right))
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](value(node.operand))
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _OPERATORS:
        return _OPERATORS[type(node.ops[0])](value(node.left), value(node.comparators[0]))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        if node.func.id not in _NAMES or node.func.id == "pi":
            raise unknown_name(node.func.id, symbols, where)
        return _NAMES[node.func.id](*map(value, node.args))
    raise ParameterError(f"{ast.unparse(node)!r} has no place in a formula", where=where, advice=_ARITHMETIC)


_ARITHMETIC = "It has numbers (1.5, with a point), its arguments, + - * / **, brackets and functions such as sin."
