"""Questions about expressions: what they depend on, what they cost, what they are worth.

Every traversal goes over indices in order, never by recursion.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import lru_cache
from operator import attrgetter
from typing import Any

from atwood.clock import check_time
from atwood.errors import AtwoodError
from atwood.expr.core import algebra
from atwood.expr.core.graph import KINDS, Expression, graph_of
from atwood.expr.core.operations import BINARY, LEAVES, UNARY, UNCOUNTED, solve_or_nan

_INDEX = attrgetter("index")


def live(
    outputs: Iterable[Expression | float], roots: Collection[Expression] = (), leaves: Collection[Expression] = ()
) -> list[Expression]:
    """Return every node that the outputs need, themselves included, arguments before users.

    Parameters
    ----------
    outputs
        Expressions of one graph; numbers among them are passed over.
    roots
        Where only what depends on some of these matters: most of the rest, which reads other kinds of symbols, is left
        out.
    leaves
        Expressions of which it does not matter what they are made of.
    """
    check_time()
    stack = [output for output in outputs if isinstance(output, Expression)]
    for output in stack:
        if output.graph is not stack[0].graph:
            raise AtwoodError("the outputs belong to different graphs")
    kinds = frozenset([root.reads for root in roots]) if 0 < len(roots) <= _MOST_ROOTS else _ANY
    if leaves or 0 not in kinds:
        return _live_with(stack, _with_kinds(kinds), leaves)
    found = set(stack)
    add, pop, push = found.add, stack.pop, stack.append
    while stack:
        for node in pop().arguments:
            if node not in found:
                add(node)
                if node.arguments:
                    push(node)
    return sorted(found, key=_INDEX)


_MOST_ROOTS = 300
"""With more of them nothing is left out: to look at all of these would take longer in one part of a large scene."""

_ANY = frozenset([0])


@lru_cache(maxsize=256)
def _with_kinds(kinds: frozenset[int]) -> list[bool]:
    """Return whether what reads some kinds of symbols may depend on what reads some of these."""
    return [any(one & reads == one for one in kinds) for reads in range(1 << KINDS)]


def _live_with(stack: list[Expression], is_kept: Sequence[bool], leaves: Collection[Expression]) -> list[Expression]:
    """Return what is live beyond leaves, and kept by the kinds of symbols that it reads."""
    found = {output for output in stack if is_kept[output.reads]}
    stack = [output for output in found if output not in leaves]
    add, pop, push = found.add, stack.pop, stack.append
    while stack:
        for node in pop().arguments:
            if node not in found and is_kept[node.reads]:
                add(node)
                if node.arguments and node not in leaves:
                    push(node)
    return sorted(found, key=_INDEX)


def dependents(nodes: Sequence[Expression], roots: Iterable[Expression]) -> set[int]:
    """Return the indices of the nodes that depend on a root, roots among them included."""
    result = {root.index for root in roots}
    for node in nodes:
        if node.index not in result:
            for argument in node.arguments:
                if argument.index in result:
                    result.add(node.index)
                    break
    return result


def dependencies(outputs: Sequence[Expression | float], symbols: Sequence[Expression]) -> list[frozenset[Expression]]:
    """Return, for each output, which of the given symbols it depends on."""
    bits = {symbol.index: 1 << position for position, symbol in enumerate(symbols)}
    for node in live(outputs):
        mask = bits.get(node.index, 0)
        for argument in node.arguments:
            mask |= bits[argument.index]
        bits[node.index] = mask
    masks = [bits[output.index] if isinstance(output, Expression) else 0 for output in outputs]
    return [frozenset(symbol for i, symbol in enumerate(symbols) if mask >> i & 1) for mask in masks]


def depends_on(values: Expression | float | Iterable[Expression | float], symbols: Collection[Expression]) -> bool:
    """Return whether an expression, or any of several, depends on any of the symbols."""
    wanted = _to_look_up(symbols)
    several = [values] if isinstance(values, Expression | float) else values
    return any(node in wanted for node in live(several, wanted))


def read_by(values: Iterable[Expression | float], symbols: Collection[Expression]) -> list[Expression]:
    """Return those of some symbols on which any of several expressions depends."""
    reached = set(live(values, symbols))
    return [symbol for symbol in symbols if symbol in reached]


def _to_look_up(expressions: Iterable[Expression]) -> Collection[Expression]:
    """Return expressions as something that can be asked at once, themselves if they are."""
    return expressions if isinstance(expressions, set | frozenset | dict) else set(expressions)


def varying(nodes: Sequence[Expression], parameters: Iterable[Expression]) -> set[Expression]:
    """Return the nodes that need something besides constants and parameters."""
    fixed = _to_look_up(parameters)
    result: set[Expression] = set()
    add, are_fixed = result.add, result.isdisjoint
    for node in nodes:
        arguments = node.arguments
        if (not are_fixed(arguments) if arguments else node.operation == "symbol") and node not in fixed:
            add(node)
    return result


def count_operations(outputs: Sequence[Expression | float], parameters: Collection[Expression] = ()) -> dict[str, int]:
    """Return how many operations of each kind one evaluation of the outputs takes.

    Parameters
    ----------
    outputs
        The expressions to evaluate together; what they share counts once.
    parameters
        Symbols that keep their value for a run.  What depends on nothing but these and constants is computed once
        a run and does not count.

    Returns
    -------
    dict
        Counts by the name of the operation, such as ``{"add": 2, "sin": 1}``, without those that are zero.
    """
    return count_nodes(live(outputs), parameters)


def count_nodes(nodes: Sequence[Expression], parameters: Collection[Expression] = ()) -> dict[str, int]:
    """Return the same for all nodes that outputs need, arguments before users."""
    needed = varying(nodes, parameters)
    counts = Counter(node.operation for node in nodes if node in needed and node.operation not in UNCOUNTED)
    return dict(sorted(counts.items()))


def substitute(
    outputs: Sequence[Expression | float],
    mapping: Mapping[Expression, Expression | float],
    again: Collection[Expression] = (),
) -> list[Expression]:
    """Replace expressions by others and simplify what follows from it.

    Parameters
    ----------
    outputs
        The expressions to rewrite.
    mapping
        What to replace, usually symbols, and by what.  All replacements happen at once.
    again
        What is to be made again, although nothing in it is replaced.
    """
    if not outputs:
        return []
    graph = graph_of(*outputs) or graph_of(*mapping)  # a large scene has many to be replaced
    if graph is None:
        raise AtwoodError("there is no expression among the outputs")
    is_large = len(mapping) > _MOST_ROOTS
    leaves = () if is_large else {old for old in mapping if old.arguments}
    nodes = live(outputs, () if is_large else [*mapping, *again], leaves)
    if len(mapping) > len(nodes):  # one part of a large scene
        mapping = {node: mapping[node] for node in nodes if node in mapping}
    replaced = {old.index: graph.convert(new) for old, new in mapping.items()}
    touched = dependents(nodes, [*mapping, *again])
    unknowns: dict[int, list[Expression]] = {}
    for node in nodes:
        index = node.index
        if index not in touched or index in replaced:
            continue
        if node.operation == "component":
            replaced[index] = unknowns[node.arguments[0].index][node.payload]
            continue
        arguments = [replaced.get(argument.index, argument) for argument in node.arguments]
        if node.operation == "solve":
            split = node.payload**2
            unknowns[index] = algebra.solve(arguments[:split], arguments[split:])
            replaced[index] = node
        else:
            replaced[index] = algebra.build(graph, node.operation, arguments, node.payload)
    converted = [graph.convert(output) for output in outputs]
    return [replaced.get(output.index, output) for output in converted]


def evaluate(
    outputs: Sequence[Expression | float],
    values: Mapping[Expression, float] | Mapping[str, float] | Mapping[Expression | str, float],
    nodes: Sequence[Expression] | None = None,
) -> list[float]:
    """Return the values of expressions, one node at a time: the reference for compiled programs.

    Parameters
    ----------
    outputs
        The expressions to evaluate.
    values
        The value of every symbol that they need, by symbol or by name.
    nodes
        What is live in the expressions, where that is known.

    Returns
    -------
    list of float
        The values, with ``nan`` and infinities as in IEEE arithmetic.
    """
    given: Mapping[Any, float] = values  # a large scene has many, of which few are asked for
    known: dict[int, float] = {}
    unknowns: dict[int, list[float]] = {}
    for node in live(outputs) if nodes is None else nodes:
        value, operation = given.get(node), node.operation
        if value is None and operation == "symbol":
            value = given.get(node.name)
            if value is None:
                raise AtwoodError(f"no value was given for the symbol {node.name}")
        if value is not None:
            known[node.index] = float(value)
        elif operation in BINARY:
            a, b = node.arguments
            known[node.index] = BINARY[operation](known[a.index], known[b.index])
        elif operation in UNARY:
            known[node.index] = UNARY[operation](known[node.arguments[0].index])
        elif operation in LEAVES:
            known[node.index] = node.value
        elif operation == "solve":
            data = [known[argument.index] for argument in node.arguments]
            split = node.payload**2
            unknowns[node.index] = solve_or_nan(node.payload, data[:split], data[split:])
            known[node.index] = 0.0
        elif operation == "component":
            known[node.index] = unknowns[node.arguments[0].index][node.payload]
        else:
            data = [known[argument.index] for argument in node.arguments]
            if operation == "select":
                known[node.index] = data[1] if data[0] != 0.0 else data[2]
            else:
                known[node.index] = float(node.payload.function(*data))
    return [known[output.index] if isinstance(output, Expression) else float(output) for output in outputs]
