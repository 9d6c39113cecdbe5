"""Programs in languages that are compiled elsewhere: what the printers of C and of JavaScript have in common.

A long program is cut into functions that hand values on through the scratch array; see `atwood.codegen.llvm.layout`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from atwood.codegen.llvm.layout import Body, Layout, MatrixKey, Unit, lay_out, matrix_key, places_of, targets_of
from atwood.codegen.llvm.text import OWN_FUNCTIONS
from atwood.codegen.routines import own_name
from atwood.errors import UnsupportedError
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import Program
from atwood.lazy_dataclasses import dataclass

_LONGEST = 500
"""Operations in one function."""

_LARGEST_INLINE = 24
"""Operations in one expression."""

_FUNCTIONS = {one: own_name(one) for one in OWN_FUNCTIONS}
_CHOICES = {"minimum": "<=", "maximum": ">="}
_SIGNS = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
_COMPARED = {"less": "<", "less_equal": "<="}
_LOGICAL = {"logical_and": "&&", "logical_or": "||"}
_CONDITIONS = frozenset({*_COMPARED, *_LOGICAL, "logical_not"})
_TWICE = frozenset({"minimum", "maximum", "sign"})
"""What mentions its arguments more than once."""


@dataclass(frozen=True, eq=False)
class Places:
    """Where a body finds what it reads, and puts what it computes.

    Attributes
    ----------
    layout
        The body in chunks.
    regions
        Where the factors of a matrix begin in the scratch array, whatever its size.
    scratch
        The length of that array.
    known
        The text of each value that is given, or handed on.
    targets
        Texts of the places of each result.
    passed
        Results that are given.
    pointers
        Arrays beside those of derived values and scratch, in order.
    """

    layout: Layout
    regions: dict[MatrixKey, int]
    scratch: int
    known: dict[int, str]
    targets: dict[int, list[str]]
    passed: list[Expression]
    pointers: list[str]


def write_places(body: Body, at: Callable[[str, int], str]) -> Places:
    """Return where everything is of a body; ``at`` writes an element of an array."""
    layout = lay_out(body, _LONGEST)
    systems = {matrix_key(unit[0]) for chunk in layout.chunks for unit in chunk if unit[0].operation == "solve"}
    regions, used = dict(layout.regions), layout.scratch
    for key in sorted(systems - set(regions)):
        size = round(len(key) ** 0.5)
        regions[key], used = used, used + size * (size + 2)
    known = {index: at(*place) for index, place in places_of(body).items()}
    known |= {index: at("scratch", slot) for index, slot in layout.slots.items()}
    targets = {index: [at(*place) for place in places] for index, places in targets_of(body).items()}
    results = {node.index: node for node, _, _ in body.results}
    computed = {node.index for chunk in layout.chunks for unit in chunk for node in unit}
    passed = [node for index, node in results.items() if index not in computed]
    given = {pointer for pointer, _ in body.given if pointer != "derived"}
    pointers = sorted(given | {one for _, one, _ in body.results})
    return Places(layout, regions, used, known, targets, passed, pointers)


class ChunkWriter(ABC):
    """What has been written of one chunk of operations; what is used once stands where it is used.

    Texts are those of values, with the operations in them. Of a language there are its name, what the declaration of
    a value with a name begins with, functions that it calls otherwise, the sign between what differs, and one and zero.
    """

    language: str
    declares: str
    functions: Mapping[str, str]
    differs: str
    bits: tuple[str, str]

    def __init__(self, places: Places, chunk: Sequence[Unit], factorised: set[MatrixKey]) -> None:
        self.places, self.factorised = places, factorised
        own = [node for unit in chunk for node in unit]
        self.uses = Counter(one.index for node in own if node.operation != "component" for one in node.arguments)
        twice = (one.index for node in own if node.operation in _TWICE for one in node.arguments)
        self.uses.update(twice)
        self.lines: list[str] = []
        self.sums: list[str] = []
        self.texts: dict[int, tuple[str, int]] = {}

    @abstractmethod
    def cell(self, place: int) -> str:
        """Return an element of the scratch array."""

    @abstractmethod
    def waves(self, argument: Expression) -> dict[str, str]:
        """Write a sine and a cosine, and return where they are."""

    @abstractmethod
    def literal(self, value: float) -> str:
        """Return a number."""

    def value(self, node: Expression) -> str:
        """Return the text of a value that is used once."""
        return self._text(node)[0]

    def _text(self, node: Expression) -> tuple[str, int]:
        found = self.texts.get(node.index)
        if found is None:
            if node.operation == "constant":
                found = self.literal(float(node.payload)), 0
            else:
                found = self.places.known[node.index], 0
                if self.uses[node.index] > 1:
                    self.keep(node, found[0])
                    return self.texts[node.index]
            self.texts[node.index] = found
        return found

    def node(self, node: Expression) -> None:
        """Write an operation."""
        size = 1 + sum(self._text(one)[1] for one in node.arguments)
        parts = [self._text(one)[0] for one in node.arguments]
        self.texts[node.index] = self._expression(node, parts), size
        if self.uses[node.index] != 1 or size > _LARGEST_INLINE:
            self.name(node)

    def _expression(self, node: Expression, parts: list[str]) -> str:
        operation, (one, zero) = node.operation, self.bits
        if operation in _SIGNS:
            return f"({parts[0]} {_SIGNS[operation]} {parts[1]})"
        if operation == "neg":
            return f"(-{parts[0]})"
        if operation in self.functions or operation in _FUNCTIONS:
            return f"{self.functions.get(operation) or _FUNCTIONS[operation]}({', '.join(parts)})"
        if operation in _CHOICES:
            return f"({parts[0]} {_CHOICES[operation]} {parts[1]} ? {parts[0]} : {parts[1]})"
        if operation == "sign":
            return f"({parts[0]} > {zero} ? {one} : {parts[0]} < {zero} ? -{one} : {parts[0]} * {zero})"
        if operation == "select":
            return f"({self._truth(node.arguments[0])} ? {parts[1]} : {parts[2]})"
        if operation in _CONDITIONS:
            return f"({self._compared(node)} ? {one} : {zero})"
        raise UnsupportedError(f"there is no {self.language} for the operation {operation} in {node!r}")

    def _truth(self, node: Expression) -> str:
        text, size = self._text(node)
        return (
            self._compared(node)
            if size and node.operation in _CONDITIONS
            else f"({text} {self.differs} {self.bits[1]})"
        )

    def _compared(self, node: Expression) -> str:
        if node.operation in _COMPARED:
            a, b = (self._text(one)[0] for one in node.arguments)
            return f"({a} {_COMPARED[node.operation]} {b})"
        found = [self._truth(one) for one in node.arguments]
        if node.operation == "logical_not":
            return f"(!{found[0]})"
        return f"({found[0]} {_LOGICAL[node.operation]} {found[1]})"

    def keep(self, node: Expression, text: str) -> None:
        """Give a value a name."""
        self.lines.append(f"{self.declares} v{node.index} = {text};")
        self.texts[node.index] = f"v{node.index}", 0

    def name(self, node: Expression) -> str:
        """Return a name, a number or a place for a value."""
        text = self.value(node)
        if self.texts.get(node.index, ("", 0))[1]:
            self.keep(node, text)
            return f"v{node.index}"
        return text

    def unit(self, unit: Unit) -> None:
        """Write operations that stay together, and store what others need of them."""
        first = unit[0]
        if first.operation == "solve":
            start = self.solve(first)
            for one in unit[1:]:
                self.keep(one, self.cell(start + one.payload))
        is_wave = len(unit) == 2 and unit[1].operation != "component"
        waves = self.waves(first.arguments[0]) if is_wave else {}
        for node in unit:
            if waves:
                self.keep(node, waves[node.operation])
            elif node.operation not in ("solve", "component"):
                self.node(node)
            if node.operation != "solve":
                self.hand_on(node)

    def store(self, node: Expression) -> None:
        """Store a result, and take it into the sum that shows whether all are finite."""
        text = self.name(node)
        self.lines += [f"{one} = {text};" for one in self.places.targets[node.index]]
        self.sums.append(text)

    def hand_on(self, node: Expression) -> None:
        """Store what later chunks need, and results."""
        if node.index in self.places.layout.slots:
            self.lines.append(f"{self.cell(self.places.layout.slots[node.index])} = {self.name(node)};")
        if node.index in self.places.targets:
            self.store(node)

    def solve(self, node: Expression) -> int:
        """Write a linear system, and return where its unknowns are; systems with the same matrix share its factors."""
        size, key = node.payload, matrix_key(node)
        start = self.places.regions[key]
        entries, right = node.arguments[: size * size], node.arguments[size * size :]
        pivots, side = start + size * size, start + size * (size + 1)
        if key not in self.factorised:
            self.factorised.add(key)
            self._fill(start, entries)
            self.lines.append(f"factorise({size}, scratch + {start}, scratch + {pivots});")
        self._fill(side, right)
        self.lines.append(f"substitute({size}, scratch + {start}, scratch + {pivots}, scratch + {side});")
        return int(side)

    def _fill(self, start: int, values: Sequence[Expression]) -> None:
        texts = [self.value(one) for one in values]
        self.lines += [f"{self.cell(start + k)} = {text};" for k, text in enumerate(texts)]


def write_chunks(places: Places, begin: Callable[[Sequence[Unit], set[MatrixKey]], ChunkWriter]) -> list[ChunkWriter]:
    """Return what was written of each chunk, by writers that are made for them."""
    factorised: set[MatrixKey] = set()
    writers = []
    for chunk in places.layout.chunks:
        writer = begin(chunk, factorised)
        for unit in chunk:
            writer.unit(unit)
        writers.append(writer)
    for node in places.passed:
        writers[-1].store(node)
    return writers


def print_bodies(
    program: Program, write: Callable[[str, Body], tuple[str, int]], name: str, bodies: tuple[Body, Body]
) -> tuple[list[str], int]:
    """Return the functions of a program and of what is computed once a run, and the scratch that they need.

    Raises
    ------
    UnsupportedError
        If the program calls functions in Python.
    """
    try:
        found = write(name, bodies[0]), write(f"{name}_values", bodies[1])
    except UnsupportedError as error:
        raise UnsupportedError(error.message, where=program.name) from None
    return [one for one, _ in found], max(scratch for _, scratch in found)
