"""The expression graph: nodes that are shared by construction.

A :class:`Graph` owns a table of nodes.  Asking for a node that is already there returns that node, so that equal
expressions are the same object, and common subexpressions are found when they are written down.  A node's
``index`` counts creations; arguments exist before the nodes that use them, so sorting by index sorts
topologically and nothing ever needs recursion.
"""

from __future__ import annotations

import numbers
from collections import defaultdict
from collections.abc import Callable, Sequence
from sys import getrefcount
from typing import TYPE_CHECKING, Any, NamedTuple

from atwood.clock import check_time
from atwood.errors import AtwoodError
from atwood.expr.core import algebra

if TYPE_CHECKING:
    from atwood.expr.core.relations import TimeRelations

KINDS = 8
"""So many kinds of symbols are told apart, by what stands before a colon in their names; others share these bits.

The sets of them are the numbers that Python has once.
"""

_LOOK = 256
"""After so many new nodes the clock is looked at."""

MANY = 200_000
"""A graph of more nodes forgets what is not needed any more, and is not kept on disk."""


def _of_two(apply: Callable[[Expression, Expression], Expression]) -> Callable[[Expression, object], Expression]:
    """Return a method that applies an operation to a node and to whatever can be made one."""

    def method(self: Expression, other: object) -> Expression:
        b = _operand(self, other)
        return NotImplemented if b is None else apply(self, b)

    return method


class Expression:
    """One value in a graph: an operation applied to earlier values.

    Made by :meth:`Graph.symbol`, :meth:`Graph.constant`, arithmetic, and the functions of
    :mod:`atwood.expr.core.functions`; not by calling the class.  Equality and hash are those of identity: two
    expressions of one graph that were built alike are the same object.

    Attributes
    ----------
    graph
        The graph that owns the node.
    operation
        The name of the operation, such as ``"add"``, ``"sin"`` or ``"symbol"``.
    arguments
        The expressions it is applied to.
    payload
        A constant's value, a symbol's name, the size of a linear solve, the position of a component, or the
        :class:`~atwood.expr.core.operations.ExternalFunction`; otherwise ``None``.
    index
        The position in order of creation.
    reads
        A bit for each kind of symbols that it depends on, of which parameters are none; see `Graph`.
    """

    __slots__ = ("arguments", "graph", "index", "operation", "payload", "reads")

    graph: Graph
    operation: str
    arguments: tuple[Expression, ...]
    payload: Any
    index: int
    reads: int

    def __init__(
        self,
        graph: Graph,
        operation: str,
        arguments: tuple[Expression, ...],
        payload: Any,
        index: int,
        reads: int,
    ) -> None:
        self.graph = graph
        self.operation = operation
        self.arguments = arguments
        self.payload = payload
        self.index = index
        self.reads = reads

    @property
    def is_parametric(self) -> bool:
        """Whether it depends on constants and parameters alone, so that it is computed once a run."""
        return not self.reads

    @property
    def is_constant(self) -> bool:
        """Whether this is a number."""
        return self.operation == "constant"

    @property
    def is_symbol(self) -> bool:
        """Whether this is a symbol."""
        return self.operation == "symbol"

    @property
    def is_zero(self) -> bool:
        """Whether this is the constant 0: a structural zero."""
        return self.operation == "constant" and self.payload == 0.0

    @property
    def value(self) -> float:
        """The value of a constant."""
        if self.operation != "constant":
            raise AtwoodError(
                f"{self!r} is not a constant and has no value yet",
                advice="In a law, use Atwood's own functions (atwood.sqrt, atwood.select, ...) and no others.",
            )
        return float(self.payload)

    @property
    def name(self) -> str:
        """The name of a symbol."""
        if self.operation != "symbol":
            raise AtwoodError(f"{self!r} is not a symbol and has no name")
        return str(self.payload)

    def __add__(self, other: object) -> Expression:
        if type(other) is Expression and other.graph is self.graph:
            return algebra.add(self, other)
        b = _operand(self, other)
        return NotImplemented if b is None else algebra.add(self, b)

    def __sub__(self, other: object) -> Expression:
        if type(other) is Expression and other.graph is self.graph:
            return algebra.subtract(self, other)
        b = _operand(self, other)
        return NotImplemented if b is None else algebra.subtract(self, b)

    def __mul__(self, other: object) -> Expression:
        if type(other) is Expression and other.graph is self.graph:
            return algebra.multiply(self, other)
        b = _operand(self, other)
        return NotImplemented if b is None else algebra.multiply(self, b)

    def __floor__(self) -> Expression:
        return algebra.unary("floor", self)

    __truediv__ = _of_two(lambda a, b: algebra.divide(a, b))
    __pow__ = _of_two(lambda a, b: algebra.power(a, b))
    __lt__ = _of_two(lambda a, b: algebra.less(a, b))
    __le__ = _of_two(lambda a, b: algebra.less_equal(a, b))
    __gt__ = _of_two(lambda a, b: algebra.less(b, a))
    __ge__ = _of_two(lambda a, b: algebra.less_equal(b, a))
    __and__ = _of_two(lambda a, b: algebra.logical("logical_and", a, b))
    __or__ = _of_two(lambda a, b: algebra.logical("logical_or", a, b))
    __floordiv__ = _of_two(lambda a, b: algebra.unary("floor", algebra.divide(a, b)))
    __radd__ = _of_two(lambda a, b: algebra.add(b, a))
    __rsub__ = _of_two(lambda a, b: algebra.subtract(b, a))
    __rmul__ = _of_two(lambda a, b: algebra.multiply(b, a))
    __rtruediv__ = _of_two(lambda a, b: algebra.divide(b, a))
    __rpow__ = _of_two(lambda a, b: algebra.power(b, a))
    __mod__ = _of_two(lambda a, b: a - b * (a // b))
    __rand__ = __and__
    __ror__ = __or__

    def __neg__(self) -> Expression:
        return algebra.negate(self)

    def __pos__(self) -> Expression:
        return self

    def __abs__(self) -> Expression:
        return algebra.unary("absolute", self)

    def __invert__(self) -> Expression:
        return algebra.unary("logical_not", self)

    def __bool__(self) -> bool:
        if self.operation == "constant":
            return bool(self.payload != 0.0)
        raise AtwoodError(
            "an if, a while, or one of and, or, not asks whether something holds that is only known while a scene runs",
            advice="Write select(condition, a, b) instead of if, and & | ~ instead of and, or, not.",
        )

    def __float__(self) -> float:
        return self.value

    def __copy__(self) -> Expression:
        return self

    def __deepcopy__(self, memory: object) -> Expression:
        return self

    def __repr__(self) -> str:
        return _describe(self, 3)


class RenamedNode(NamedTuple):
    """A node whose symbols have a name in common that can be another one.

    Attributes
    ----------
    operation
        What it does.
    arguments
        Places of its arguments, among nodes that are there and those before it in its record.
    payload
        As of a node; of a symbol what stands before and after the name.
    reads
        As of a node.
    """

    operation: str
    arguments: tuple[int, ...]
    payload: Any
    reads: int


class Graph:
    """The table of nodes that expressions live in.

    Graphs do not mix: an expression of one graph cannot be combined with one of another.

    Examples
    --------
    >>> graph = Graph()
    >>> x = graph.symbol("x")
    >>> 2 * x + 0 is x * 2
    True

    Attributes
    ----------
    relations
        Takes up relations of functions of time alone while laws are read; None where there is no time.
    origin
        Where positions are counted from, if that is far from the world's origin: sums keep it outside.
    """

    __slots__ = ("_kinds", "_table", "nodes", "one", "origin", "relations", "zero")

    def __init__(self) -> None:
        self.origin: tuple[Expression, ...] | None = None
        self.relations: TimeRelations | None = None
        self._kinds: dict[str, int] = {}
        self.nodes: list[Expression] = []
        self._table: defaultdict[str, dict[Any, Expression]] = defaultdict(dict)  # by operation, then by `_key`
        self.zero = self.constant(0.0)
        self.one = self.constant(1.0)

    def __len__(self) -> int:
        return len(self.nodes)

    def __repr__(self) -> str:
        return f"<Graph of {len(self.nodes)} nodes>"

    def __deepcopy__(self, memory: object) -> Graph:
        return self

    @property
    def operations(self) -> frozenset[str]:
        """The names of all operations in it."""
        return frozenset(name for name, nodes in list(self._table.items()) if nodes)

    def constant(self, value: float) -> Expression:
        """Return the node of a number; there is one zero, without sign."""
        number = float(value)
        if number == 0.0:
            number = 0.0
        key = number if number == number else "nan"
        found = self._table["constant"].get(key)
        return self._insert(key, "constant", (), number) if found is None else found

    def symbol(self, name: str) -> Expression:
        """Return the symbol of that name; the same name gives the same symbol."""
        return self.node("symbol", (), name)

    def parameter(self, name: str) -> Expression:
        """Return the symbol of that name, marked as one that keeps its value for a run.

        Products and sums are arranged so that what depends on parameters alone stays together.
        """
        key = _key((), name)
        found = self._table["symbol"].get(key)
        return self._insert(key, "symbol", (), name, is_parameter=True) if found is None else found

    def node(self, operation: str, arguments: tuple[Expression, ...], payload: Any = None) -> Expression:
        """Return the node of an operation as it stands, without any folding."""
        key = arguments if payload is None else _key(arguments, payload)
        found = self._table[operation].get(key)
        return self._insert(key, operation, arguments, payload) if found is None else found

    def find(self, operation: str, arguments: tuple[Expression, ...], payload: Any = None) -> Expression | None:
        """Return the node of an operation if it is there already."""
        return self._table[operation].get(_key(arguments, payload))

    def convert(self, value: Expression | float) -> Expression:
        """Return a number as a constant of this graph, and an expression of this graph as it is."""
        if isinstance(value, Expression):
            if value.graph is not self:
                raise _mixed(value)
            return value
        return self.constant(value)

    def plain(self) -> tuple[list[Any], ...]:
        """Return all that tells this graph from another: operations, arguments, payloads, and whether parametric."""
        nodes = self.nodes
        return (
            [node.operation for node in nodes],
            [len(node.arguments) for node in nodes],
            [argument.index for node in nodes for argument in node.arguments],
            [node.payload for node in nodes],
            [node.is_parametric for node in nodes],
        )

    def recorded(self, start: int) -> list[tuple[Any, ...]]:
        """Return what makes the nodes from a place on: operation, places of arguments, payload, whether parametric."""
        return [
            (node.operation, tuple(a.index for a in node.arguments), node.payload, node.is_parametric)
            for node in self.nodes[start:]
        ]

    def replay(self, record: list[tuple[Any, ...]]) -> None:
        """Add the nodes that `recorded` gave, to a graph that is as it was when they were made."""
        nodes = self.nodes
        for operation, places, payload, is_parametric in record:
            if operation == "constant":
                self.constant(payload)
                continue
            arguments = tuple(nodes[place] for place in places)
            self._insert(_key(arguments, payload), operation, arguments, payload, is_parametric)

    def forget(self, start: int) -> None:
        """Forget the nodes from a place on to which nobody refers, if there are `MANY`: half of what deriving makes.

        A place whose node is forgotten has the number 0, and is not used again.
        """
        if len(self.nodes) <= MANY:
            return
        nodes, table, zero = self.nodes, self._table, self.zero
        for place in range(len(nodes) - 1, start - 1, -1):  # what refers to a node comes after it
            node = nodes[place]
            if getrefcount(node) == _UNUSED and node.arguments:
                del table[node.operation][_key(node.arguments, node.payload)]
                nodes[place] = zero

    def renamed(self, foreign: Sequence[Expression], record: Sequence[RenamedNode], name: str) -> Sequence[Expression]:
        """Return nodes that are there, and after them nodes of a record with another name, made where they are not."""
        check_time()
        found, table, nodes = list(foreign), self._table, self.nodes
        for operation, places, payload, reads in record:
            arguments = tuple([found[place] for place in places])
            if operation == "symbol":
                payload = payload[0] + name + payload[1]
            key = arguments if payload is None else _key(arguments, payload)
            node = table[operation].get(key)
            if node is None:
                node = table[operation][key] = Expression(self, operation, arguments, payload, len(nodes), reads)
                nodes.append(node)
            found.append(node)
        return found

    def _insert(
        self,
        key: Any,
        operation: str,
        arguments: tuple[Expression, ...],
        payload: Any,
        is_parameter: bool = False,
    ) -> Expression:
        if not len(self.nodes) % _LOOK:
            check_time()
        reads = 0
        for argument in arguments:
            reads |= argument.reads
        if operation == "symbol" and not is_parameter:
            kinds = self._kinds
            reads = 1 << kinds.setdefault(payload.partition(":")[0] if ":" in payload else "", len(kinds)) % KINDS
        elif operation == "external" and not arguments:
            reads = 1  # it may be another number each time
        created = Expression(self, operation, arguments, payload, len(self.nodes), reads)
        self._table[operation][key] = created
        self.nodes.append(created)
        return created


def _key(arguments: tuple[Expression, ...], payload: Any) -> Any:
    """Return what a node is told from others of its operation by: mostly the tuple or the name that it has anyhow."""
    if payload is None:
        return arguments
    return (arguments, payload) if arguments else payload


def _references_of_unused() -> int:
    """Return the references to a node that only its graph has: those of its list, its table, and who counts."""
    nodes = [object()]
    table = {"": nodes[0]}
    node = nodes[len(table) - 1]
    return getrefcount(node)


_UNUSED = _references_of_unused()


def _operand(own: Expression, other: object) -> Expression | None:
    """Return the other operand as an expression of the same graph, or None for foreign types."""
    if isinstance(other, Expression):
        if other.graph is not own.graph:
            raise _mixed(other)
        return other
    if isinstance(other, (float, int, numbers.Real)):
        return own.graph.constant(float(other))
    return None


def _mixed(stray: Expression) -> AtwoodError:
    return AtwoodError(
        f"{stray!r} belongs to another graph",
        advice="Build all expressions of one program from the symbols of one Graph.",
    )


def _describe(expression: Expression, depth: int) -> str:
    """Return a short text of an expression, cut off at a depth."""
    if expression.operation == "constant":
        return f"{expression.payload:g}"
    if expression.operation == "symbol":
        return str(expression.payload)
    if depth == 0:
        return "..."
    inner = ", ".join(_describe(argument, depth - 1) for argument in expression.arguments[:6])
    more = ", ..." if len(expression.arguments) > 6 else ""
    name = expression.operation
    if name == "external":
        name = expression.payload.name
    elif expression.payload is not None:
        name = f"{name}[{expression.payload}]"
    return f"{name}({inner}{more})"


def graph_of(*values: object) -> Graph | None:
    """Return the graph of the first expression among the values, if there is one."""
    for value in values:
        if isinstance(value, Expression):
            return value.graph
    return None
