"""LLVM's language from one chunk of operations: straight-line code in which every value is written once.

The text is written directly, without objects for instructions: for tens of thousands of operations that is a
good part of the time to compile.  No instruction carries a fast-math flag, so that nothing is reassociated or
contracted, and functions are Atwood's own (`atwood.codegen.llvm.own`): every machine gives the same values.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import field

from atwood.codegen.routines import own_name
from atwood.errors import UnsupportedError
from atwood.expr.core.graph import Expression
from atwood.expr.core.operations import ExternalFunction
from atwood.lazy_dataclasses import dataclass

OWN_FUNCTIONS: Mapping[str, int] = dict.fromkeys(
    ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sinh", "cosh", "tanh"), 1
) | {"atan2": 2, "pow": 2}
"""Operations that functions of their own compute, with the number of arguments."""

_INTRINSICS = {"sqrt": "@llvm.sqrt.f64", "absolute": "@llvm.fabs.f64", "floor": "@llvm.floor.f64"}
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


@dataclass
class Needs:
    """What the functions of a module call.

    Attributes
    ----------
    functions
        The elementary functions, by their names as operations.
    externals
        The functions in Python, each with its number of arguments and its position among them.
    elimination
        Whether there is a linear system that is not eliminated in registers.
    """

    functions: set[str] = field(default_factory=set)
    externals: dict[tuple[ExternalFunction, int], int] = field(default_factory=dict)
    elimination: bool = False


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
    kept
        What goes to the arrays that are held: a value, the name of the pointer and the position.
    """

    places: Mapping[int, tuple[str, int]]
    needs: Needs
    held: frozenset[str] = frozenset()
    lines: list[str] = field(default_factory=list)
    values: dict[int, str] = field(default_factory=dict)
    conditions: dict[int, str] = field(default_factory=dict)
    pointers: set[str] = field(default_factory=set)
    waves: bool = False
    kept: list[tuple[str, str, int]] = field(default_factory=list)
    _checks: list[str] = field(default_factory=list)
    _count: int = 0

    def put(self, instruction: str) -> str:
        """Write an instruction, and return the name of its value."""
        self._count += 1
        name = f"%t{self._count}"
        self.lines.append(f"  {name} = {instruction}")
        return name

    def address(self, pointer: str, position: int) -> str:
        """Return the address of one number of an array."""
        self.pointers.add(pointer)
        if position == 0:
            return f"%{pointer}"
        return self.put(f"getelementptr double, ptr %{pointer}, i64 {position}")

    def load(self, pointer: str, position: int) -> str:
        """Read one number of an array."""
        fixed = ", !invariant.load !0" if pointer != "scratch" else ""
        return self.put(f"load double, ptr {self.address(pointer, position)}{fixed}")

    def store(self, value: str, pointer: str, position: int) -> None:
        """Write one number of an array."""
        if pointer in self.held:
            self.kept.append((value, pointer, position))
            return
        address = self.address(pointer, position)
        self.lines.append(f"  store double {value}, ptr {address}")

    def value(self, node: Expression) -> str:
        """Return what stands for the value of a node."""
        found = self.values.get(node.index)
        if found is not None:
            return found
        if node.operation == "constant":
            found = literal(node.payload)
        elif node.index in self.conditions:
            found = self.put(f"uitofp i1 {self.conditions[node.index]} to double")
        else:
            found = self.load(*self.places[node.index])
        self.values[node.index] = found
        return found

    def condition(self, node: Expression) -> str:
        """Return what stands for the truth of a node."""
        found = self.conditions.get(node.index)
        if found is None:
            found = self.put(f"fcmp une double {self.value(node)}, 0.0")
            self.conditions[node.index] = found
        return found

    def write(self, node: Expression) -> None:
        """Write the operation of a node; linear systems and pairs of sine and cosine are written elsewhere."""
        operation = node.operation
        infix = _ARITHMETIC.get(operation)
        if infix is not None:
            a, b = node.arguments
            self.values[node.index] = self.put(f"{infix} double {self.value(a)}, {self.value(b)}")
        elif operation in _CONDITIONS:
            self.conditions[node.index] = self._truth(node)
        elif operation in OWN_FUNCTIONS:
            self.values[node.index] = self._call_own(node)
        elif operation == "external":
            self.values[node.index] = self._call_external(node)
        elif operation in _OTHER:
            self.values[node.index] = _OTHER[operation](self, node)
        else:
            raise UnsupportedError(f"there is no machine code for the operation {operation} in {node!r}")

    def write_wave(self, sine: Expression, cosine: Expression) -> None:
        """Write the sine and the cosine of one argument."""
        argument = self.value(sine.arguments[0])
        self.needs.functions.add("sin_cos")
        self.waves = True
        name = own_name("sin_cos")
        self.lines.append(f"  call void @{name}(double {argument}, ptr %sine, ptr %cosine)")
        self.values[sine.index] = self.put("load double, ptr %sine")
        self.values[cosine.index] = self.put("load double, ptr %cosine")

    def check(self, value: str) -> None:
        """Take a result into the sums that show whether all are finite: one that is not makes its sum so too."""
        if len(self._checks) < _CHECKS:
            self._checks.append(value)
        else:
            self._checks.append(self.put(f"fadd double {self._checks.pop(0)}, {value}"))

    def checked(self) -> str:
        """Return the sum of all results so far, which is finite only if they are."""
        if not self._checks:
            return "0.0"
        total = self._checks[0]
        for term in self._checks[1:]:
            total = self.put(f"fadd double {total}, {term}")
        return total

    def _truth(self, node: Expression) -> str:
        operation = node.operation
        if operation in _COMPARISONS:
            a, b = (self.value(argument) for argument in node.arguments)
            return self.put(f"fcmp {_COMPARISONS[operation]} double {a}, {b}")
        conditions = [self.condition(argument) for argument in node.arguments]
        if operation == "logical_not":
            return self.put(f"xor i1 {conditions[0]}, true")
        return self.put(f"{_LOGICAL[operation]} i1 {conditions[0]}, {conditions[1]}")

    def _call_own(self, node: Expression) -> str:
        name = node.operation
        self.needs.functions.add(name)
        arguments = ", ".join(f"double {self.value(argument)}" for argument in node.arguments)
        return self.put(f"call double @{own_name(name)}({arguments})")

    def _call_external(self, node: Expression) -> str:
        key = (node.payload, len(node.arguments))
        position = self.needs.externals.setdefault(key, len(self.needs.externals))
        arguments = ", ".join(f"double {self.value(argument)}" for argument in node.arguments)
        return self.put(f"call double @external.{position}({arguments})")


def _negate(writer: Writer, node: Expression) -> str:
    return writer.put(f"fneg double {writer.value(node.arguments[0])}")


def _intrinsic(writer: Writer, node: Expression) -> str:
    return writer.put(f"call double {_INTRINSICS[node.operation]}(double {writer.value(node.arguments[0])})")


def _sign(writer: Writer, node: Expression) -> str:
    """Return -1, 0 or 1, and not a number for what is none: 0 a, unless a is above or below zero."""
    a = writer.value(node.arguments[0])
    above = writer.put(f"fcmp ogt double {a}, 0.0")
    below = writer.put(f"fcmp olt double {a}, 0.0")
    neither = writer.put(f"fmul double {a}, 0.0")
    rest = writer.put(f"select i1 {below}, double {literal(-1.0)}, double {neither}")
    return writer.put(f"select i1 {above}, double {literal(1.0)}, double {rest}")


def _choose(writer: Writer, node: Expression) -> str:
    a, b = (writer.value(argument) for argument in node.arguments)
    first = writer.put(f"fcmp {_CHOICES[node.operation]} double {a}, {b}")
    return writer.put(f"select i1 {first}, double {a}, double {b}")


def _select(writer: Writer, node: Expression) -> str:
    condition, a, b = node.arguments
    truth = writer.condition(condition)
    return writer.put(f"select i1 {truth}, double {writer.value(a)}, double {writer.value(b)}")


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

_ELSEWHERE = frozenset({"constant", "symbol", "solve", "component", "external"})
"""Operations that need no code, or are written elsewhere."""


def has_code(operation: str) -> bool:
    """Return whether there is machine code for an operation."""
    return operation in _OTHER or any(
        operation in known for known in (_ARITHMETIC, _CONDITIONS, OWN_FUNCTIONS, _ELSEWHERE)
    )
