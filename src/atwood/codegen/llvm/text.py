"""LLVM's language from one chunk of operations: straight-line code in which every value is written once.

The text is written directly, without objects for instructions: for tens of thousands of operations that is a
good part of the time to compile.  No instruction carries a fast-math flag, so that nothing is reassociated or
contracted, and functions are Atwood's own (`atwood.codegen.llvm.own`): every machine gives the same values.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field

from atwood.codegen.routines import own_name
from atwood.errors import UnsupportedError
from atwood.expr.core.graph import Expression
from atwood.lazy_dataclasses import dataclass

OWN_FUNCTIONS: Mapping[str, int] = dict.fromkeys(
    ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sinh", "cosh", "tanh"), 1
) | {"atan2": 2, "pow": 2}
"""Operations that functions of their own compute, with the number of arguments."""

ELIMINATION = {"factorise": "i64, ptr, ptr", "substitute": "i64, ptr, ptr, ptr"}
"""Routines for linear systems that are not eliminated in registers, with what they are given."""

INTRINSICS = {"sqrt": "sqrt", "absolute": "fabs", "floor": "floor"}
_ARITHMETIC = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
_COMPARISONS = {"less": "olt", "less_equal": "ole"}
_LOGICAL = {"logical_and": "and", "logical_or": "or"}
_CHOICES = {"minimum": "ole", "maximum": "oge"}
_CONDITIONS = frozenset({*_COMPARISONS, *_LOGICAL, "logical_not"})
_CHECKS = 4
"""Sums that the check of the results is spread over, so that it waits for no other addition."""


def literal(value: float) -> str:
    """Return a number as LLVM writes it, to the last bit."""
    return f"0x{struct.pack('>d', value).hex()}"


def number_type(runs: int) -> str:
    """Return the type of a number of each of several runs."""
    return "double" if runs == 1 else f"<{runs} x double>"


def spread(value: float, runs: int) -> str:
    """Return a number that all of several runs share, without its type."""
    one = literal(value)
    return one if runs == 1 else f"<{', '.join([f'double {one}'] * runs)}>"


@dataclass(frozen=True)
class Strided:
    """A place in an array that is another in each stretch of a loop.

    Attributes
    ----------
    places
        Where it is in each stretch.
    """

    places: tuple[int, ...]

    @property
    def step(self) -> int | None:
        """By how much it moves from each stretch to the next; None where that is not the same."""
        first, step = self.places[0], self.places[1] - self.places[0]
        return step if self.places == tuple(first + step * k for k in range(len(self.places))) else None


Position = int | Strided
"""A place in an array."""


@dataclass
class Needs:
    """What the functions of a module call.

    Attributes
    ----------
    functions
        The elementary functions, by their names as operations, and the routines of `ELIMINATION`.
    tables
        Where values lie that a loop cannot count.
    """

    functions: set[str] = field(default_factory=set)
    tables: dict[tuple[int, ...], str] = field(default_factory=dict)


@dataclass
class Writer:
    """What has been written of one chunk.

    Attributes
    ----------
    places
        Where known values and values of earlier chunks lie: the name of a pointer and a position.
    needs
        What is called.
    held
        Arrays whose numbers are not written one by one.
    runs
        How many runs are computed side by side: each value has so many lanes, and so many places in every array.
    lines
        The instructions so far.
    values
        What stands for the value of each node in this chunk.
    conditions
        What stands for the truth of each node in this chunk.
    pointers
        The arrays that the chunk needs.
    waves
        Whether it calls for a sine and cosine together.
    calls
        Whether it calls functions of lanes.
    kept
        What goes to the arrays that are held: a value, the name of the pointer and the position.
    """

    places: Mapping[int, tuple[str, Position]]
    needs: Needs
    held: frozenset[str] = frozenset()
    runs: int = 1
    lines: list[str] = field(default_factory=list)
    values: dict[int, str] = field(default_factory=dict)
    conditions: dict[int, str] = field(default_factory=dict)
    pointers: set[str] = field(default_factory=set)
    waves: bool = False
    calls: bool = False
    kept: list[tuple[str, str, Position]] = field(default_factory=list)
    _checks: list[str] = field(default_factory=list)
    _count: int = 0

    @property
    def kind(self) -> str:
        """The type of values."""
        return number_type(self.runs)

    @property
    def truth(self) -> str:
        """The type of conditions."""
        return "i1" if self.runs == 1 else f"<{self.runs} x i1>"

    def constant(self, value: float) -> str:
        """Return a number as a value."""
        return spread(value, self.runs)

    def intrinsic(self, operation: str, value: str) -> str:
        """Write a call of a function of LLVM's own."""
        lanes = "" if self.runs == 1 else f"v{self.runs}"
        return self.put(f"call {self.kind} @llvm.{INTRINSICS[operation]}.{lanes}f64({self.kind} {value})")

    def put(self, instruction: str) -> str:
        """Write an instruction, and return the name of its value."""
        self._count += 1
        name = f"%t{self._count}"
        self.lines.append(f"  {name} = {instruction}")
        return name

    def address(self, pointer: str, position: Position) -> str:
        """Return the address of one number of an array."""
        self.pointers.add(pointer)
        if position == 0:
            return f"%{pointer}"
        at = position * self.runs if isinstance(position, int) else self._place(position)
        return self.put(f"getelementptr double, ptr %{pointer}, i64 {at}")

    def _place(self, position: Strided) -> str:
        """Return a place in the stretch ``%k`` of a loop."""
        step, first = position.step, position.places[0] * self.runs
        if step == 0:
            return str(first)
        if step is not None:
            return self.put(f"add i64 {self.put(f'mul i64 %k, {step * self.runs}')}, {first}")
        places = tuple(one * self.runs for one in position.places)
        table = self.needs.tables.setdefault(places, f"@places.{len(self.needs.tables)}")
        entry = self.put(f"getelementptr i32, ptr {table}, i64 %k")
        return self.put(f"zext i32 {self.put(f'load i32, ptr {entry}, !invariant.load !0')} to i64")

    def load(self, pointer: str, position: Position) -> str:
        """Read one number of an array."""
        fixed = ", !invariant.load !0" if pointer != "scratch" else ""
        return self.put(f"load {self.kind}, ptr {self.address(pointer, position)}, align 8{fixed}")

    def store(self, value: str, pointer: str, position: Position) -> None:
        """Write one number of an array."""
        if pointer in self.held:
            self.kept.append((value, pointer, position))
            return
        address = self.address(pointer, position)
        self.lines.append(f"  store {self.kind} {value}, ptr {address}, align 8")

    def value(self, node: Expression) -> str:
        """Return what stands for the value of a node."""
        found = self.values.get(node.index)
        if found is not None:
            return found
        if node.operation == "constant":
            found = self.constant(node.payload)
        elif node.index in self.conditions:
            found = self.put(f"uitofp {self.truth} {self.conditions[node.index]} to {self.kind}")
        else:
            found = self.load(*self.places[node.index])
        self.values[node.index] = found
        return found

    def condition(self, node: Expression) -> str:
        """Return what stands for the truth of a node."""
        found = self.conditions.get(node.index)
        if found is None:
            found = self.put(f"fcmp une {self.kind} {self.value(node)}, {self.constant(0.0)}")
            self.conditions[node.index] = found
        return found

    def write(self, node: Expression) -> None:
        """Write the operation of a node; linear systems and pairs of sine and cosine are written elsewhere."""
        operation = node.operation
        infix = _ARITHMETIC.get(operation)
        if infix is not None:
            a, b = node.arguments
            self.values[node.index] = self.put(f"{infix} {self.kind} {self.value(a)}, {self.value(b)}")
        elif operation in _CONDITIONS:
            self.conditions[node.index] = self._truth(node)
        elif operation in OWN_FUNCTIONS:
            self.values[node.index] = self._call_own(node)
        elif operation in _OTHER:
            self.values[node.index] = _OTHER[operation](self, node)
        else:
            raise UnsupportedError(f"there is no machine code for the operation {operation} in {node!r}")

    def choose(self, condition: str, a: str, b: str) -> str:
        """Write a choice by a condition."""
        return self.put(f"select {self.truth} {condition}, {self.kind} {a}, {self.kind} {b}")

    def write_wave(self, sine: Expression, cosine: Expression) -> None:
        """Write the sine and the cosine of one argument."""
        argument = self.value(sine.arguments[0])
        self.waves = True
        name, (given,) = self._own("sin_cos", [argument])
        self.lines.append(f"  call void @{name}({given}, ptr %sine, ptr %cosine)")
        self.values[sine.index] = self.put(f"load {self.kind}, ptr %sine")
        self.values[cosine.index] = self.put(f"load {self.kind}, ptr %cosine")

    def _own(self, function: str, arguments: Sequence[str]) -> tuple[str, list[str]]:
        """Return the name of an elementary function, and what it is given: lanes lie in memory."""
        if self.runs == 1:
            self.needs.functions.add(function)
            return own_name(function), [f"double {one}" for one in arguments]
        name = f"{function}_{self.runs}"
        self.needs.functions.add(name)
        self.calls = True
        places = [f"ptr %given{k}" for k in range(len(arguments))]
        for place, one in zip(places, arguments, strict=True):
            self.lines.append(f"  store {self.kind} {one}, {place}")
        return own_name(name), places

    def check(self, value: str) -> None:
        """Take a result into the sums that show whether all are finite: one that is not makes its sum so too."""
        if len(self._checks) < _CHECKS:
            self._checks.append(value)
        else:
            self._checks.append(self.put(f"fadd {self.kind} {self._checks.pop(0)}, {value}"))

    def checked(self) -> str:
        """Return the sum of all results so far, which is finite only if they are."""
        if not self._checks:
            return self.constant(0.0)
        total = self._checks[0]
        for term in self._checks[1:]:
            total = self.put(f"fadd {self.kind} {total}, {term}")
        return total

    def _truth(self, node: Expression) -> str:
        operation = node.operation
        if operation in _COMPARISONS:
            a, b = (self.value(argument) for argument in node.arguments)
            return self.put(f"fcmp {_COMPARISONS[operation]} {self.kind} {a}, {b}")
        conditions = [self.condition(argument) for argument in node.arguments]
        if operation == "logical_not":
            true = "true" if self.runs == 1 else f"<{', '.join(['i1 true'] * self.runs)}>"
            return self.put(f"xor {self.truth} {conditions[0]}, {true}")
        return self.put(f"{_LOGICAL[operation]} {self.truth} {conditions[0]}, {conditions[1]}")

    def _call_own(self, node: Expression) -> str:
        name, given = self._own(node.operation, [self.value(argument) for argument in node.arguments])
        if self.runs == 1:
            return self.put(f"call double @{name}({', '.join(given)})")
        self.waves = True
        self.lines.append(f"  call void @{name}({', '.join(given)}, ptr %sine)")
        return self.put(f"load {self.kind}, ptr %sine")


def _negate(writer: Writer, node: Expression) -> str:
    return writer.put(f"fneg {writer.kind} {writer.value(node.arguments[0])}")


def _intrinsic(writer: Writer, node: Expression) -> str:
    return writer.intrinsic(node.operation, writer.value(node.arguments[0]))


def _sign(writer: Writer, node: Expression) -> str:
    """Return -1, 0 or 1, and not a number for what is none: 0 a, unless a is above or below zero."""
    a, kind, zero = writer.value(node.arguments[0]), writer.kind, writer.constant(0.0)
    above = writer.put(f"fcmp ogt {kind} {a}, {zero}")
    below = writer.put(f"fcmp olt {kind} {a}, {zero}")
    neither = writer.put(f"fmul {kind} {a}, {zero}")
    rest = writer.choose(below, writer.constant(-1.0), neither)
    return writer.choose(above, writer.constant(1.0), rest)


def _choose(writer: Writer, node: Expression) -> str:
    a, b = (writer.value(argument) for argument in node.arguments)
    first = writer.put(f"fcmp {_CHOICES[node.operation]} {writer.kind} {a}, {b}")
    return writer.choose(first, a, b)


def _select(writer: Writer, node: Expression) -> str:
    condition, a, b = node.arguments
    truth = writer.condition(condition)
    return writer.choose(truth, writer.value(a), writer.value(b))


_OTHER: dict[str, Callable[[Writer, Expression], str]] = {
    "neg": _negate,
    "sqrt": _intrinsic,
    "absolute": _intrinsic,
    "floor": _intrinsic,
    "sign": _sign,
    "minimum": _choose,
    "maximum": _choose,
    "select": _select,
}

_ELSEWHERE = frozenset({"constant", "symbol", "solve", "component"})
"""Operations that need no code, or are written elsewhere."""


def has_code(operation: str) -> bool:
    """Return whether there is machine code for an operation."""
    return operation in _OTHER or any(
        operation in known for known in (_ARITHMETIC, _CONDITIONS, OWN_FUNCTIONS, _ELSEWHERE)
    )
