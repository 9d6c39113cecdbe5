"""What the laws of a part made, taken down without the part, and written down again for another one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from atwood.expr import Expression, Graph
from atwood.expr.core.graph import RenamedNode
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.component import Component
from atwood.model.declare.laws import Law
from atwood.model.local.flatten import Part
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import FreeRotation
from atwood.model.values.space import Space

_PLAIN = (type(None), bool, int, float, Law, Space, FreeRotation)
"""What is the same for all parts of a kind if it is equal."""

_OF_COMPONENT = ("_parent", "_name", "_settings")
"""What a component whose laws are evaluated has of the component itself, beside what they are evaluated on."""

_Tree = tuple[Any, ...]
"""What something is made of: a word, and what that says."""

_Term = tuple[str, bool]
"""A term of Python, and whether anything of a part is in it."""


class _UntoldError(Exception):
    """A part has something that cannot be written down."""


def take_down(local: LocalPart, graph: Graph, start: int) -> Record | None:
    """Return what laws made of a part; None if it has something in it that cannot be written down.

    The nodes from `start` on were made by these laws. Others that they use were there before.
    """
    taken = _Taken(local.part, graph)
    try:
        tree = taken.tree(local)
        foreign, nodes, mentioned = _nodes_of(taken.mentioned, local.part.path, graph, start)
    except _UntoldError:
        return None
    return Record(tree, foreign, nodes, mentioned, taken.composed)


@dataclass(frozen=True, eq=False)
class Record:
    """What the laws of a part made, without the part; two are equal if they serve the same parts.

    Attributes
    ----------
    tree
        What the `LocalPart` is made of.
    foreign, nodes
        Nodes that are of no part, such as constants and time, and those that depend on its symbols, in order.
    mentioned
        The numbers, among both, of the nodes in the tree.
    composed
        All that the tree puts together, by the numbers that it gives them.
    """

    tree: _Tree
    foreign: tuple[Expression, ...]
    nodes: tuple[RenamedNode, ...]
    mentioned: tuple[int, ...]
    composed: list[Any]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Record) and self._told() == other._told()

    __hash__ = None  # type: ignore[assignment]

    def _told(self) -> tuple[object, ...]:
        return self.foreign, self.nodes, self.mentioned, self.tree

    def writer(self, graph: Graph, unread: frozenset[str]) -> Callable[[Part], LocalPart]:
        """Return what writes the same down for another part, which reads the same of its parameters."""
        build, foreign, nodes = _Writer(self, graph).function(), self.foreign, self.nodes

        def write(part: Part) -> LocalPart:
            found: LocalPart = build(part, part.component, part.path, graph.renamed(foreign, nodes, part.path))
            vars(found)["unread"] = unread
            return found

        return write


class _Taken:
    """Goes through what a part contributes, once."""

    def __init__(self, part: Part, graph: Graph) -> None:
        self._part, self._graph = part, graph
        self._places: dict[int, int] = {}
        self._open: set[int] = set()
        self._mentioned: dict[Expression, int] = {}
        self.composed: list[Any] = []

    @property
    def mentioned(self) -> list[Expression]:
        """The nodes in the tree, in the order in which it numbers them."""
        return list(self._mentioned)

    def tree(self, one: Any) -> _Tree:
        """Return what something is made of, with places for all that is the part's own."""
        if isinstance(one, Expression):
            return "node", self._mentioned.setdefault(one, len(self._mentioned))
        if one is self._part or one is self._part.component or one is self._graph:
            return ("part" if one is self._part else "graph" if one is self._graph else "component",)
        if isinstance(one, str):
            path = self._part.path
            return ("path", one[len(path) :]) if one == path or one.startswith(f"{path}.") else ("plain", str, one)
        if isinstance(one, _PLAIN):
            return "plain", type(one), one
        if id(one) not in self._places:
            self._places[id(one)] = number = len(self._places)
            self.composed.append(one)  # so that no identity is used again, too
            self._open.add(number)
            found = "made", number, *self._composed(one)
            self._open.remove(number)
            return found
        if self._places[id(one)] in self._open:
            raise _UntoldError
        return "again", self._places[id(one)]

    def _composed(self, one: Any) -> _Tree:
        """Return how something is put together: a word, its class, names, and what is put together."""
        kind, names, values = type(one), tuple[str, ...](), list[Any]()
        if kind is list or issubclass(kind, tuple):
            word, values = "listed", [*one]
        elif kind is dict:
            word, values = "mapped", [each for pair in one.items() for each in pair]
        elif isinstance(one, Component):
            word, own = "bound", vars(one)
            if own.keys() != {*_OF_COMPONENT, "_bound"} or own["_settings"] is not self._part.component._settings:
                raise _UntoldError
            values = [own["_bound"]]
        elif kind.__module__.startswith("atwood.") and not callable(one):
            slots = [name for base in reversed(kind.__mro__) for name in vars(base).get("__slots__", ())]
            word, names = "slotted" if slots else "named", tuple(slots or vars(one))
            if slots and hasattr(one, "__dict__"):
                raise _UntoldError
            values = [getattr(one, name) for name in names]
        else:
            raise _UntoldError
        return word, kind, names, [self.tree(each) for each in values]


def _nodes_of(
    mentioned: Iterable[Expression], path: str, graph: Graph, start: int
) -> tuple[tuple[Expression, ...], tuple[RenamedNode, ...], tuple[int, ...]]:
    """Return the nodes that are of no part, and those of a part; and the numbers of those that are mentioned."""
    mentioned = list(mentioned)
    found = {node.index: node for node in (*mentioned, *graph.nodes[start:])}
    stack = list(found.values())
    while stack:
        for one in stack.pop().arguments:
            if one.index not in found:
                found[one.index] = one
                stack.append(one)
    own: dict[int, Expression] = {}
    foreign: dict[int, Expression] = {}
    for index in sorted(found):
        node = found[index]
        named = node.is_symbol and _around(node.name, path) is not None
        is_own = named or any(one.index in own for one in node.arguments)
        (own if is_own else foreign)[index] = node
    first = min(own, default=len(graph))
    if any(index > first and not node.is_constant for index, node in foreign.items()):
        raise _UntoldError  # other parts find it there, and have products with it in another order
    used = {one.index for node in own.values() for one in node.arguments} | {node.index for node in mentioned}
    outside = tuple([node for index, node in foreign.items() if index in used])
    numbers = {node.index: k for k, node in enumerate((*outside, *own.values()))}
    told = [
        RenamedNode(
            node.operation,
            tuple([numbers[one.index] for one in node.arguments]),
            _around(node.name, path) if node.is_symbol else node.payload,
            node.reads,
        )
        for node in own.values()
    ]
    return outside, tuple(told), tuple([numbers[node.index] for node in mentioned])


def _around(name: str, path: str) -> tuple[str, str] | None:
    """Return what stands before and after a part's path in the name of a symbol; None if that is not the part's."""
    before = name.rfind(":") + 1
    after = name[before + len(path) :]
    return (name[:before], after) if name.startswith(path, before) and after[:1] in (".", "[") else None


class _Writer:
    """Writes a record as a function of Python, which takes a part of the time of going through its tree."""

    def __init__(self, record: Record, graph: Graph) -> None:
        self._record = record
        self._known: dict[str, Any] = {"graph": graph, "new": object.__new__, "new_tuple": tuple.__new__}
        self._known["put"] = object.__setattr__  # instances share the names of what they have
        self._lines: list[str] = []
        self._values: dict[int, _Term] = {}

    def function(self) -> Callable[..., Any]:
        """Return the function of a part, its component, its path, and the nodes."""
        value, _ = self._value(self._record.tree)
        body = "".join(f"    {line}\n" for line in self._lines)
        exec(f"def build(part, component, path, nodes):\n{body}    return {value}\n", self._known)
        found: Callable[..., Any] = self._known["build"]
        return found

    def _value(self, tree: _Tree) -> _Term:
        """Return something as a term of Python."""
        word, *told = tree
        if word == "made":
            self._values[told[0]] = self._made(*told)
        if word in ("made", "again"):
            return self._values[told[0]]
        if word == "node":
            number = self._record.mentioned[told[0]]
            return f"nodes[{number}]", number >= len(self._record.foreign)
        if word == "path":
            return f"path + {told[0]!r}", True
        return (word, word != "graph") if not told else (self._constant(told[1]), False)

    def _constant(self, value: Any) -> str:
        name = f"c{len(self._known)}"
        self._known[name] = value
        return name

    def _made(self, number: int, word: str, kind: type, names: Sequence[str], inner: Sequence[_Tree]) -> _Term:
        """Return the name of something composed; what cannot change, and has nothing of the part, stays what it is."""
        found = [self._value(one) for one in inner]
        if word != "bound" and kind not in (dict, list) and not any(is_own for _, is_own in found):
            return self._constant(self._record.composed[number]), False
        name, made = f"v{number}", self._constant(kind)
        terms = [term for term, _ in found]
        if word == "listed":
            text = "".join(f"{one}, " for one in terms)
            listed = f"[{text}]" if kind is list else f"({text})"
            self._lines.append(f"{name} = {listed if kind in (list, tuple) else f'new_tuple({made}, {listed})'}")
        elif word == "mapped":
            pairs = zip(terms[::2], terms[1::2], strict=True)
            self._lines.append(f"{name} = {{{', '.join(f'{key}: {value}' for key, value in pairs)}}}")
        elif word == "slotted":
            self._lines += [
                f"{name} = new({made})",
                *(f"{name}.{one} = {v}" for one, v in zip(names, terms, strict=True)),
            ]
        else:
            own = [(one, f"component.{one}") for one in _OF_COMPONENT] if word == "bound" else []
            own += zip(("_bound",) if word == "bound" else names, terms, strict=True)
            self._lines.append(f"{name} = new({made})")
            self._lines += [f"put({name}, {one!r}, {value})" for one, value in own]
        return name, True
