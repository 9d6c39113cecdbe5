"""A program: outputs to be computed again and again from inputs, with parameters fixed for a run."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

from atwood.display import brief
from atwood.errors import AtwoodError
from atwood.expr.core.analysis import count_operations, live, varying
from atwood.expr.core.graph import Expression, Graph
from atwood.expr.core.operations import COMMUTATIVE
from atwood.lazy_dataclasses import dataclass


class InputGroup(NamedTuple):
    """Symbols that are handed over together, as one array.

    Attributes
    ----------
    name
        What the group is called.
    symbols
        The symbols, in the order of the array.
    """

    name: str
    symbols: tuple[Expression, ...]

    def __repr__(self) -> str:
        return brief(self, self._fields)


class OutputGroup(NamedTuple):
    """Expressions that are returned together, as one array.

    Attributes
    ----------
    name
        What the group is called.
    expressions
        The expressions, in the order of the array.
    """

    name: str
    expressions: tuple[Expression, ...]

    def __repr__(self) -> str:
        return brief(self, self._fields)


@dataclass(frozen=True, eq=False)
class Program:
    """Outputs as expressions of inputs and parameters; what kernels are made from.

    A program is equal to itself alone, so that what is made of it can be kept under it.

    Attributes
    ----------
    name
        Named in messages about the program.
    inputs
        The groups of symbols that change from call to call.
    parameters
        The symbols that keep their value for a run.
    outputs
        The groups of expressions to compute.

    Raises
    ------
    AtwoodError
        If an output needs a symbol that is neither input nor parameter, or a symbol is listed twice.
    """

    name: str
    inputs: tuple[InputGroup, ...]
    parameters: tuple[Expression, ...]
    outputs: tuple[OutputGroup, ...]

    def __post_init__(self) -> None:
        listed: set[Expression] = set()
        for symbol in (*(symbol for group in self.inputs for symbol in group[1]), *self.parameters):
            if not symbol.is_symbol:
                raise AtwoodError(f"{symbol!r} is an input or parameter but not a symbol", where=self.name)
            if symbol in listed:
                raise AtwoodError(f"the symbol {symbol.name} is listed twice", where=self.name)
            listed.add(symbol)
        for node in self.nodes:
            if node.operation == "symbol" and node not in listed:
                raise self._unknown(node)
        if any(symbol.graph is not self.graph for symbol in listed):
            raise AtwoodError("its inputs and outputs belong to different graphs", where=self.name)

    def _unknown(self, symbol: Expression) -> AtwoodError:
        """Return the error that says which outputs depend on a symbol that is not listed."""
        group = next(group for group in self.outputs if symbol in live(group[1]))
        return AtwoodError(
            f"the output group {group[0]} depends on the symbol {symbol.name}, which is no input or parameter",
            where=self.name,
            advice="Add the symbol to the inputs or parameters, or substitute it.",
        )

    @property
    def results(self) -> tuple[Expression, ...]:
        """All outputs, group after group."""
        return tuple(expression for group in self.outputs for expression in group[1])

    @cached_property
    def graph(self) -> Graph:
        """The graph that the program lives in."""
        for expression in (*self.results, *self.parameters, *(s for group in self.inputs for s in group[1])):
            return expression.graph
        return Graph()

    @cached_property
    def nodes(self) -> tuple[Expression, ...]:
        """Every node that the outputs need, arguments before users."""
        return tuple(live(self.results))

    @cached_property
    def prologue(self) -> tuple[Expression, ...]:
        """What is computed once a run: the last values that depend on parameters alone, bare parameters included.

        These are the values that the rest of the program, or an output, uses directly.
        """
        used = set(self.results).union(*[node.arguments for node in self._moving])
        return tuple([node for node in self.once if node.operation != "constant" and node in used])

    @cached_property
    def once(self) -> tuple[Expression, ...]:
        """Every node that the prologue needs, itself included, arguments before users."""
        moving = self._moving
        known = [node for node in self.nodes if node not in moving]
        used = set[Expression]().union(*[node.arguments for node in known])
        return tuple([node for node in known if node.operation != "constant" or node in used])

    @cached_property
    def _moving(self) -> set[Expression]:
        return varying(self.nodes, self.parameters)

    @cached_property
    def operations(self) -> dict[str, int]:
        """The operations of one evaluation, by kind; see :func:`~atwood.expr.core.analysis.count_operations`."""
        return count_operations(self.results, self.parameters)

    @property
    def size(self) -> int:
        """The number of nodes that the outputs need, leaves included."""
        return len(self.nodes)

    @cached_property
    def calls_python(self) -> bool:
        """Whether it calls functions in Python, which machine code does not."""
        return any(node.operation == "external" for node in self.nodes)

    @cached_property
    def digest(self) -> str:
        """A hash of what the program computes, independent of the order in which it was written down."""
        return _digest(self)


def _digest(program: Program) -> str:
    """Return the hash of a program from those of its nodes, each made from its arguments' hashes."""
    from hashlib import blake2b

    known: dict[int, bytes] = {}
    said: dict[tuple[str, int, object], bytes] = {}
    for node in (*live([*program.parameters, *(s for group in program.inputs for s in group[1])]), *program.nodes):
        arguments = [known[argument.index] for argument in node.arguments]
        if node.operation in COMMUTATIVE:
            arguments.sort()
        payload = node.payload.name if node.operation == "external" else node.payload
        kind = node.operation, len(arguments), payload
        if kind not in said:
            said[kind] = repr(kind).encode()
        known[node.index] = blake2b(said[kind] + b"".join(arguments), digest_size=_SIZE).digest()
    groups = [
        [(group[0], [known[one.index] for one in group[1]]) for group in several]
        for several in (program.inputs, program.outputs)
    ]
    whole = program.name, groups, [known[parameter.index] for parameter in program.parameters]
    return blake2b(repr(whole).encode(), digest_size=32).hexdigest()


_SIZE = 32
"""Bytes of the hash of a node: no two nodes that differ have the same one."""
