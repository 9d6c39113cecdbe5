"""Python source from a program: straight-line code, one statement for each shared value.

A value that is used once is written inside the statement that uses it.  Python compiles a function in a time
proportional to its length (measured up to 300,000 nodes), so that there is one function whatever the size.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import field
from typing import Literal

from atwood.expr.core.graph import Expression
from atwood.expr.core.operations import UNARY
from atwood.lazy_dataclasses import dataclass

Flavour = Literal["fast", "careful", "vectorized"]
"""``fast`` raises outside a function's domain; ``careful`` gives nan there; ``vectorized`` works on arrays."""

_LARGEST_INLINE = 24
_CONDITIONS = {"less": "<", "less_equal": "<="}
_LOGICAL = {"logical_and": "and", "logical_or": "or"}
_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/"}


@dataclass(frozen=True)
class _Text:
    """A piece of source: the text, and how many operations it holds."""

    text: str
    size: int


@dataclass
class _Writer:
    """What has been written so far: the text that stands for each node, and the statements in order."""

    flavour: Flavour
    uses: Counter[int]
    texts: dict[int, _Text] = field(default_factory=dict)
    statements: list[tuple[str, _Text]] = field(default_factory=list)
    externals: list[object] = field(default_factory=list)
    variables: int = 0

    def take_variable(self, node: Expression) -> str:
        """Give a value a variable of its own, and return its name."""
        name = f"v{self.variables}"
        self.variables += 1
        self.texts[node.index] = _Text(name, 0)
        return name


def write_function(
    name: str,
    flavour: Flavour,
    given: Sequence[Sequence[Expression]],
    nodes: Iterable[Expression],
    results: Sequence[Sequence[Expression]],
) -> tuple[str, list[object]]:
    """Return the source of a function, and the external functions that it calls as ``e0``, ``e1``, ..."""
    nodes = list(nodes)
    uses = Counter(argument.index for node in nodes for argument in node.arguments)
    uses.update(result.index for group in results for result in group)
    writer = _Writer(flavour, uses)
    for group in given:
        for symbol in group:
            writer.take_variable(symbol)
    for node in nodes:
        if node.index not in writer.texts:
            _write_node(writer, node)
    returned = [[writer.texts[result.index] for result in group] for group in results]
    lines = [f"def {name}({', '.join(f'g{k}' for k in range(len(given)))}):"]
    for k, group in enumerate(given):
        names = ", ".join(writer.texts[symbol.index].text for symbol in group)
        lines.append(f"    [{names}] = g{k}")
    lines.extend(f"    {target} = {written.text}" for target, written in writer.statements)
    lines.append(f"    return {_lists(returned)}")
    return "\n".join(lines) + "\n", writer.externals


def _write_node(writer: _Writer, node: Expression) -> None:
    """Write a node as text inside its only user, or as a statement of its own."""
    written = _compose(writer, node)
    free = node.operation in ("constant", "component")
    if free or (writer.uses[node.index] == 1 and written.size <= _LARGEST_INLINE and node.operation != "solve"):
        writer.texts[node.index] = written
        return
    writer.statements.append((writer.take_variable(node), written))


def _compose(writer: _Writer, node: Expression) -> _Text:
    """Return the text of a node's operation."""
    operation = node.operation
    if operation == "constant":
        return _Text(_literal(node.payload), 0)
    if operation == "component":
        solved = writer.texts[node.arguments[0].index]
        return _Text(f"{solved.text}[{node.payload}]", 0)
    if operation in ("minimum", "maximum"):
        for argument in node.arguments:
            _name(writer, argument)
    if operation == "external":
        if node.payload not in writer.externals:
            writer.externals.append(node.payload)
        operation = f"e{writer.externals.index(node.payload)}"
    parts = [writer.texts[argument.index] for argument in node.arguments]
    return _Text(_text(writer, node, operation, [part.text for part in parts]), 1 + sum(part.size for part in parts))


def _name(writer: _Writer, node: Expression) -> None:
    """Make sure that a value that is mentioned more than once has a statement of its own."""
    written = writer.texts[node.index]
    if written.size:
        writer.statements.append((writer.take_variable(node), written))


def _text(writer: _Writer, node: Expression, operation: str, parts: list[str]) -> str:
    vectorized = writer.flavour == "vectorized"
    if operation in ("add", "sub", "mul") or (operation == "div" and writer.flavour != "careful"):
        return f"({parts[0]} {_INFIX[operation]} {parts[1]})"
    if operation == "neg":
        return f"(-{parts[0]})"
    if operation in ("minimum", "maximum"):
        compare = "<=" if operation == "minimum" else ">="
        return _choice(f"{parts[0]} {compare} {parts[1]}", parts[0], parts[1], vectorized)
    if operation == "select":
        return _choice(_condition(writer, node.arguments[0]), parts[1], parts[2], vectorized)
    if operation in _CONDITIONS or operation.startswith("logical"):
        return _choice(_comparison(writer, node), "1.0", "0.0", vectorized)
    if operation == "solve":
        split = node.payload**2
        return f"solve({node.payload}, ({', '.join(parts[:split])},), ({', '.join(parts[split:])},))"
    if operation in UNARY or operation in ("div", "pow", "atan2") or node.operation == "external":
        return f"{operation}({', '.join(parts)})"
    raise NotImplementedError(operation)


def _choice(condition: str, a: str, b: str, vectorized: bool) -> str:
    return f"where({condition}, {a}, {b})" if vectorized else f"({a} if {condition} else {b})"


def _condition(writer: _Writer, node: Expression) -> str:
    """Return a node as a truth value."""
    inlined = writer.texts[node.index].size > 0
    if inlined and (node.operation in _CONDITIONS or node.operation.startswith("logical")):
        return _comparison(writer, node)
    return f"({writer.texts[node.index].text} != 0.0)"


def _comparison(writer: _Writer, node: Expression) -> str:
    """Return a comparison or a combination of conditions as a truth value."""
    operation = node.operation
    if operation in _CONDITIONS:
        a, b = (writer.texts[argument.index].text for argument in node.arguments)
        return f"({a} {_CONDITIONS[operation]} {b})"
    conditions = [_condition(writer, argument) for argument in node.arguments]
    if writer.flavour == "vectorized":
        return f"{operation}({', '.join(conditions)})"
    if operation == "logical_not":
        return f"(not {conditions[0]})"
    return f"({conditions[0]} {_LOGICAL[operation]} {conditions[1]})"


def _literal(value: float) -> str:
    if math.isfinite(value):
        return repr(value) if value >= 0.0 else f"({value!r})"
    return "nan" if value != value else "inf" if value > 0.0 else "(-inf)"


def _lists(groups: Sequence[Sequence[_Text]]) -> str:
    lists = ["[" + ", ".join(item.text for item in group) + "], " for group in groups]
    return f"({''.join(lists)})"
