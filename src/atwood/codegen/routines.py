"""Kinds of values of a routine: numbers, integers, conditions, lanes of numbers and addresses.

What a routine becomes: a tree of instructions with structured control flow, which printers read.

A small imperative language: typed values, variables, arrays, records, loops, branches and calls.

A routine is written with Python's operators on values, and becomes a tree of instructions that says nothing of the
target.  Each operation is an instruction of its own, in the order of writing: a value that was read from memory stays
what it was.  Control flow is structured: printers for other languages need no jumps.

Calls of a program's functions from a routine (`atwood.codegen.llvm.module` says what these take).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import accumulate
from typing import Any, NamedTuple, TypeAlias

from atwood.lazy_dataclasses import dataclass


class Scalar(NamedTuple):
    """A kind of one value.

    Attributes
    ----------
    name
        Its name in messages.
    is_float
        Whether its arithmetic is that of floating-point numbers.
    """

    name: str
    is_float: bool = False


@dataclass(frozen=True)
class Lanes:
    """Several neighbouring numbers, or conditions on them, on which an operation works at once.

    Attributes
    ----------
    count
        Their number.
    is_float
        False for conditions, one for each lane, and for words.
    is_word
        Whether they are words.
    """

    count: int
    is_float: bool = True
    is_word: bool = False

    @property
    def name(self) -> str:
        """What messages call them."""
        return f"{self.count} lanes of {'numbers' if self.is_float else 'words' if self.is_word else 'conditions'}"


Kind: TypeAlias = Scalar | Lanes

NUMBER = Scalar("number", is_float=True)
"""A double."""

INTEGER = Scalar("integer")
"""An integer of 64 bits, with sign."""

CODE = Scalar("code")
"""An integer of 32 bits: what a function returns, zero where all went well, or an element of a list of such."""

WORD = Scalar("word")
"""Half the bits of a number, as an integer from 0 on, with room for sums: it lies where a number would."""

BOOLEAN = Scalar("condition")
"""True or false."""

ADDRESS = Scalar("address")
"""Where numbers, integers or addresses of 8 bytes each lie, or a function."""


class Instruction(NamedTuple):
    """An operation on values; `result` is None where it has none."""

    operation: str
    result: Value | None
    arguments: tuple[Any, ...]


class Call(NamedTuple):
    """A call of a routine by its name, or of a function by its address."""

    result: Value | None
    function: str | Value
    arguments: tuple[Value, ...]


@dataclass(frozen=True, eq=False)
class Branch:
    """What is done where a condition holds, and what otherwise."""

    condition: Value
    then: Block
    otherwise: Block


@dataclass(frozen=True, eq=False)
class Loop:
    """What is done again and again until a jump leaves it."""

    number: int
    body: Block


@dataclass(frozen=True, eq=False)
class Jump:
    """To the end of a loop, or to its next turn."""

    loop: Loop
    leaves: bool


Block = list["Instruction | Call | Branch | Loop | Jump"]


class Value:
    """A value of the routine that is being written.

    Parameters
    ----------
    routine
        The routine.
    kind
        What it is.
    name
        Its name among the values and arguments of the routine, or the constant.
    """

    __slots__ = ("kind", "name", "routine")
    __hash__ = object.__hash__

    def __init__(self, routine: Routine, kind: Kind, name: str | int | float) -> None:
        self.routine, self.kind, self.name = routine, kind, name

    def _two(self, operation: str, other: Operand, swapped: bool = False, kind: Kind | None = None) -> Value:
        a, b = self.routine.alike(self, other)
        a, b = (b, a) if swapped else (a, b)
        if kind is BOOLEAN and isinstance(a.kind, Lanes):
            kind = Lanes(a.kind.count, is_float=False)
        return self.routine.put(operation, kind or a.kind, a, b)

    def __add__(self, other: Operand) -> Value:
        return self._two("add", other)

    def __radd__(self, other: Operand) -> Value:
        return self._two("add", other, swapped=True)

    def __sub__(self, other: Operand) -> Value:
        return self._two("subtract", other)

    def __rsub__(self, other: Operand) -> Value:
        return self._two("subtract", other, swapped=True)

    def __mul__(self, other: Operand) -> Value:
        return self._two("multiply", other)

    def __rmul__(self, other: Operand) -> Value:
        return self._two("multiply", other, swapped=True)

    def __truediv__(self, other: Operand) -> Value:
        return self._two("divide", other)

    def __rtruediv__(self, other: Operand) -> Value:
        return self._two("divide", other, swapped=True)

    def __lt__(self, other: Operand) -> Value:
        return self._two("less", other, kind=BOOLEAN)

    def __le__(self, other: Operand) -> Value:
        return self._two("less or equal", other, kind=BOOLEAN)

    def __gt__(self, other: Operand) -> Value:
        return self._two("greater", other, kind=BOOLEAN)

    def __ge__(self, other: Operand) -> Value:
        return self._two("greater or equal", other, kind=BOOLEAN)

    def __eq__(self, other: Operand) -> Value:  # type: ignore[override]
        return self._two("equal", other, kind=BOOLEAN)

    def __ne__(self, other: Operand) -> Value:  # type: ignore[override]
        return self._two("unequal", other, kind=BOOLEAN)

    def __and__(self, other: Value | int) -> Value:
        return self._two("and", other)

    def __or__(self, other: Value | int) -> Value:
        return self._two("or", other)

    def __invert__(self) -> Value:
        return self.routine.put("not", self.kind, self)

    def __rshift__(self, count: Operand) -> Value:
        return self._two("shift right", count)

    def __lshift__(self, count: Operand) -> Value:
        return self._two("shift left", count)

    def __bool__(self) -> bool:
        raise TypeError("a value of a routine is not known while the routine is written: use `when` or `choose`")

    def at(self, offset: Operand, kind: Kind = NUMBER) -> Value:
        """Return the address of an element of this array of numbers, or of another kind."""
        operation = "offset of codes" if kind is CODE else "offset"
        self.routine.require(self, ADDRESS)
        return self.routine.put(operation, ADDRESS, self, self.routine.value(offset, INTEGER))

    def read(self, offset: Operand, kind: Kind = NUMBER) -> Value:
        """Return an element of this array, or the lanes that begin there."""
        return self.routine.put("load", kind, self.at(offset, kind))

    def write(self, offset: Operand, value: Operand, kind: Kind = NUMBER) -> None:
        """Set an element of this array, or the lanes that begin there."""
        given = value if isinstance(value, Value) else self.routine.value(value, kind)
        self.routine.do("store", given, self.at(offset, given.kind))

    def __getitem__(self, offset: Operand) -> Value:
        return self.read(offset)

    def __setitem__(self, offset: Operand, value: Operand) -> None:
        self.write(offset, value)

    def number(self) -> Value:
        """Return an integer as a number."""
        return self.routine.put("to number", NUMBER, self)

    def integer(self) -> Value:
        """Return a condition or a code as an integer; of conditions of lanes, a bit each, from the lowest on."""
        return self.routine.put("to integer", INTEGER, self)

    def conditions(self, count: int) -> Value:
        """Return the lowest bits of an integer as conditions of lanes."""
        return self.routine.put("conditions", Lanes(count, is_float=False), self)

    def bits(self) -> Value:
        """Return the integer with the bits of this number."""
        return self.routine.put("bits", INTEGER, self)

    def number_of_bits(self) -> Value:
        """Return the number with the bits of this integer."""
        return self.routine.put("bits", NUMBER, self)

    def code(self) -> Value:
        """Return a condition as a code, 1 where it holds, or an integer that has room in one."""
        return self.routine.put("to code", CODE, self)


Operand = Value | float | int


class Variable:
    """A value that can be set anew."""

    __slots__ = ("_address", "_kind")

    def __init__(self, address: Value, kind: Kind) -> None:
        self._address, self._kind = address, kind

    @property
    def now(self) -> Value:
        """The present value."""
        return self._address.routine.put("get", self._kind, self._address)

    @now.setter
    def now(self, value: Operand) -> None:
        routine = self._address.routine
        routine.do("set", routine.value(value, self._kind), self._address)


class Record:
    """Named fields of 8 bytes, or lanes of them, that follow each other in memory, read and set as attributes.

    Parameters
    ----------
    base
        Where they begin.
    fields
        Their names and kinds, in their order.
    """

    def __init__(self, base: Value, fields: Mapping[str, Kind]) -> None:
        self.__dict__.update(_base=base, _fields=fields, _places=places_of(fields))

    def __getattr__(self, name: str) -> Value:
        inside = self.__dict__
        base: Value = inside["_base"]
        return base.read(inside["_places"][name], inside["_fields"][name])

    def __setattr__(self, name: str, value: Operand) -> None:
        inside = self.__dict__
        inside["_base"].write(inside["_places"][name], value, inside["_fields"][name])


def places_of(fields: Mapping[str, Kind]) -> dict[str, int]:
    """Return where the fields of a record begin, in units of 8 bytes."""
    ends = accumulate((kind.count if isinstance(kind, Lanes) else 1 for kind in fields.values()), initial=0)
    return dict(zip(fields, ends, strict=False))


def place_in(record: Record, name: str) -> Value:
    """Return the address of a field."""
    inside = record.__dict__
    found: Value = inside["_base"].at(inside["_places"][name])
    return found


class Routine:
    """A function while it is being written.

    `variables` are its own places in memory: each with its kind, or the length of an array.

    Parameters
    ----------
    name
        Its name in the module.
    arguments
        Their names and kinds.
    result
        What it returns; None for nothing.
    exported
        Whether it is called from outside the module.
    """

    def __init__(
        self, name: str, arguments: Mapping[str, Kind], result: Kind | None = CODE, exported: bool = False
    ) -> None:
        self.name, self.result, self.exported = name, result, exported
        self.arguments = [Value(self, kind, one) for one, kind in arguments.items()]
        self.body: Block = []
        self.variables: list[tuple[Value, Kind | int]] = []
        self._blocks = [self.body]
        self._count = 0
        self._last: Branch | None = None

    def put(self, operation: str, kind: Kind, *arguments: Any) -> Value:
        """Add an operation, and return its value."""
        self._count += 1
        result = Value(self, kind, f"v{self._count}")
        self._blocks[-1].append(Instruction(operation, result, arguments))
        return result

    def do(self, operation: str, *arguments: Any) -> None:
        """Add an operation without a value."""
        self._blocks[-1].append(Instruction(operation, None, arguments))

    def value(self, one: Operand, kind: Kind) -> Value:
        """Return a value, from a constant where it is one; a number is spread over lanes where these are asked for."""
        if isinstance(one, Value):
            if isinstance(kind, Lanes) and one.kind is NUMBER:
                return self.put("spread", kind, one)
            self.require(one, kind)
            return one
        if not kind.is_float and one != int(one):
            raise TypeError(f"a value of the kind {kind.name} is needed in {self.name}, not {one}")
        return Value(self, kind, float(one) if kind.is_float else int(one))

    def require(self, one: Value, kind: Kind) -> None:
        """Refuse a value of another kind, in the line that asks for this one."""
        if one.kind is not kind and one.kind != kind:
            raise TypeError(f"a value of the kind {kind.name} is needed in {self.name}, not {one.kind.name}")

    def alike(self, a: Value, b: Operand) -> tuple[Value, Value]:
        """Return two operands as values of one kind."""
        if isinstance(b, Value) and isinstance(b.kind, Lanes):
            return self.value(a, b.kind), b
        return a, self.value(b, a.kind)

    def variable(self, value: Operand, kind: Kind = NUMBER) -> Variable:
        """Return a variable with its first value."""
        self._count += 1
        place = Value(self, ADDRESS, f"v{self._count}")
        self.variables.append((place, kind))
        made = Variable(place, kind)
        made.now = value
        return made

    def array(self, length: int) -> Value:
        """Return an array of this call's own, with elements of 8 bytes each."""
        self._count += 1
        place = Value(self, ADDRESS, f"v{self._count}")
        self.variables.append((place, length))
        return place

    def give(self, value: Operand | None = None) -> None:
        """Return from the routine."""
        self.do("return", *(() if value is None or self.result is None else (self.value(value, self.result),)))

    def give_if(self, condition: Value, value: Operand | None = None) -> None:
        """Return where a condition holds, with a value that is known before."""
        with self.when(condition):
            self.give(value)

    @contextmanager
    def when(self, condition: Value) -> Iterator[None]:
        """Do what follows only where a condition holds."""
        branch = Branch(condition, [], [])
        self._blocks[-1].append(branch)
        yield from self._inside(branch.then)
        self._last = branch

    @contextmanager
    def otherwise(self) -> Iterator[None]:
        """Do what follows where the condition of the `when` before did not hold."""
        assert self._last is not None
        assert self._blocks[-1][-1] is self._last, "`otherwise` follows a `when`"
        yield from self._inside(self._last.otherwise)

    @contextmanager
    def forever(self) -> Iterator[Loop]:
        """Do what follows until `leave`."""
        self._count += 1
        loop = Loop(self._count, [])
        self._blocks[-1].append(loop)
        self._blocks.append(loop.body)
        yield loop
        self._blocks.pop()

    @contextmanager
    def count(self, end: Operand, start: Operand = 0, step: int = 1) -> Iterator[Value]:
        """Do what follows for ``start <= i < end``; the value is i."""
        i = self.variable(start, INTEGER)
        with self.forever() as loop:
            now = i.now
            with self.when(now >= end):
                self.leave(loop)
            yield now
            i.now = now + step

    def leave(self, loop: Loop) -> None:
        """Go on behind a loop."""
        self._blocks[-1].append(Jump(loop, leaves=True))

    def repeat(self, loop: Loop) -> None:
        """Go on with the next turn of a loop."""
        self._blocks[-1].append(Jump(loop, leaves=False))

    def call(self, function: Routine | str | Value, *arguments: Operand, result: Kind | None = CODE) -> Value:
        """Call a routine of the module, or a function by its address; return its value, for what it is worth."""
        kinds: Sequence[Kind] = [one.kind if isinstance(one, Value) else NUMBER for one in arguments]
        if isinstance(function, Routine):
            kinds, result = [one.kind for one in function.arguments], function.result
        given = tuple(self.value(one, kind) for one, kind in zip(arguments, kinds, strict=True))
        self._count += 1
        value = Value(self, result or CODE, f"v{self._count}")
        target = function.name if isinstance(function, Routine) else function
        self._blocks[-1].append(Call(value if result else None, target, given))
        return value

    def choose(self, condition: Value, a: Operand, b: Operand, kind: Kind = NUMBER) -> Value:
        """Return the first value where a condition holds, and else the second; constants are of a kind."""
        kind = next((one.kind for one in (a, b) if isinstance(one, Value)), kind)
        if isinstance(condition.kind, Lanes) and kind is NUMBER:
            kind = Lanes(condition.kind.count)
        first, second = self.value(a, kind), self.value(b, kind)
        return self.put("choose", first.kind, condition, first, second)

    def least(self, a: Value, b: Operand) -> Value:
        """Return the smaller of two values; the second where one is no number."""
        first, second = self.alike(a, b)
        return self.choose(first < second, first, second, first.kind)

    def most(self, a: Value, b: Operand) -> Value:
        """Return the larger of two values; the second where one is no number."""
        first, second = self.alike(a, b)
        return self.choose(first > second, first, second, first.kind)

    def sqrt(self, a: Value) -> Value:
        """Return the square root."""
        return self.put("sqrt", a.kind, a)

    def size(self, a: Value) -> Value:
        """Return the absolute value."""
        return self.put("size", a.kind, a)

    def floor(self, a: Value) -> Value:
        """Return the largest whole number that is not larger."""
        return self.put("floor", a.kind, a)

    def high(self, a: Value) -> Value:
        """Return the first 32 bits of a number as a word."""
        return self.put("high", _words(a.kind), a)

    def low(self, a: Value) -> Value:
        """Return the last 32 bits of a number as a word."""
        return self.put("low", _words(a.kind), a)

    def of_words(self, high: Value, low: Operand) -> Value:
        """Return the number of two words."""
        kind = Lanes(high.kind.count) if isinstance(high.kind, Lanes) else NUMBER
        return self.put("of words", kind, high, self.value(low, high.kind))

    def as_number(self, word: Value) -> Value:
        """Return a word as a number."""
        return self.put("to number", Lanes(word.kind.count) if isinstance(word.kind, Lanes) else NUMBER, word)

    def pick(self, word: Value, a: Operand, b: Operand) -> Value:
        """Return the first value where a word is 1, and the second where it is 0, without a branch."""
        kind = Lanes(word.kind.count) if isinstance(word.kind, Lanes) else NUMBER
        return self.put("pick", kind, word, self.value(a, kind), self.value(b, kind))

    def either(self, word: Value, a: Callable[[], Value], b: Callable[[], Value]) -> Value:
        """Return what the first function gives where a word is 1, else of the second; lanes take both."""
        if isinstance(word.kind, Lanes):
            return self.pick(word, a(), b())
        found = self.variable(0.0)
        with self.when(word == 1):
            found.now = a()
        with self.otherwise():
            found.now = b()
        return found.now

    def shortcut(
        self, condition: Value, quick: Callable[[], Sequence[Value]], usual: Callable[[], Sequence[Value]]
    ) -> Sequence[Value]:
        """Return what two functions give that are the same where a condition holds; lanes take the second."""
        if isinstance(condition.kind, Lanes):
            return usual()
        with self.when(condition):
            found = [self.variable(one) for one in quick()]
        with self.otherwise():
            for variable, one in zip(found, usual(), strict=True):
                variable.now = one
        return tuple(one.now for one in found)

    def flip(self, word: Value, a: Operand) -> Value:
        """Return a number, with the other sign where a word is 1 and not 0."""
        kind = Lanes(word.kind.count) if isinstance(word.kind, Lanes) else NUMBER
        return self.put("flip", kind, word, self.value(a, kind))

    def look_up(self, table: tuple[float, ...], word: Value) -> Value:
        """Return an element of a table of constants."""
        return self.put("look up", NUMBER, word, table)

    def unless(
        self, usual: Value, values: Callable[[], Sequence[Value]], otherwise: Callable[..., object], *given: Value
    ) -> tuple[Value, ...]:
        """Return values where a condition holds, and else those that a function gives, lane by lane.

        It is called by its name, with the addresses of what it is given and of its results.
        """
        lanes = usual.kind.count if isinstance(usual.kind, Lanes) else 0
        found = [self.variable(one, one.kind) for one in values()]
        name, rare = own_name(otherwise.__name__), ~usual
        with self.when(self.any_lane(rare) if lanes else rare):
            taken, filled = self.array(len(given)), self.array(len(found))
            if not lanes:
                for k, one in enumerate(given):
                    taken[k] = one
                self.call(name, taken, filled, result=None)
                for k, variable in enumerate(found):
                    variable.now = filled[k]
            else:
                self._one_by_one(rare, name, [place_of(self, one) for one in given], found, taken, filled)
        return tuple(one.now for one in found)

    def _one_by_one(
        self, rare: Value, name: str, given: list[Value], found: list[Variable], taken: Value, filled: Value
    ) -> None:
        """Call a function for each lane in which a condition holds."""
        assert isinstance(rare.kind, Lanes)
        marks = place_of(self, self.choose(rare, 1.0, 0.0))
        results = [place_of(self, one.now) for one in found]
        with self.count(rare.kind.count) as lane, self.when(marks[lane] == 1.0):
            for k, place in enumerate(given):
                taken[k] = place[lane]
            self.call(name, taken, filled, result=None)
            for k, place in enumerate(results):
                place[lane] = filled[k]
        for variable, place in zip(found, results, strict=True):
            variable.now = place.read(0, Lanes(rare.kind.count))

    def truncated(self, a: Value) -> Value:
        """Return a number as an integer, without its fraction."""
        return self.put("truncated", INTEGER, a)

    def any_lane(self, a: Value) -> Value:
        """Tell whether a condition holds in one of the lanes."""
        return self.put("any lane", BOOLEAN, a)

    def largest_lane(self, a: Value) -> Value:
        """Return the largest of the lanes, of which none is no number."""
        return self.put("largest lane", NUMBER, a)

    def sum_of_lanes(self, a: Value) -> Value:
        """Return the sum of the lanes, from the first to the last."""
        return self.put("sum of lanes", NUMBER, a)

    def is_finite(self, a: Value) -> Value:
        """Tell whether a number is one, and no infinite one."""
        return a - a == 0.0

    def copy(self, target: Value, source: Value, count: Operand, kind: Kind = NUMBER) -> None:
        """Copy so many elements between arrays that do not overlap."""
        self.do("copy of codes" if kind is CODE else "copy", target, source, self.value(count, INTEGER))

    def clear(self, begin: Value, end: Value) -> None:
        """Set all elements between two addresses to zero."""
        self.do("clear", begin, end)

    def is_null(self, address: Value) -> Value:
        """Tell whether an address leads nowhere."""
        return self.put("is null", BOOLEAN, address)

    def _inside(self, block: Block) -> Iterator[None]:
        self._blocks.append(block)
        yield
        self._blocks.pop()


def addresses(r: Routine, places: Sequence[Value]) -> Value:
    """Return an array of this call's own that holds addresses."""
    table = r.array(len(places))
    for k, place in enumerate(places):
        table.write(k, place, ADDRESS)
    return table


def place_of(r: Routine, number: Value) -> Value:
    """Return an array of this call's own that holds a number, or lanes of them."""
    place = r.array(number.kind.count if isinstance(number.kind, Lanes) else 1)
    place[0] = number
    return place


def own_name(function: str) -> str:
    """Return what a function of `atwood.expr.core.elementary` is called in a module."""
    return f"own_{function}"


def _words(kind: Kind) -> Kind:
    return Lanes(kind.count, is_float=False, is_word=True) if isinstance(kind, Lanes) else WORD


def call_kernel(
    r: Routine, name: str | Value, inputs: Sequence[Value], derived: Value, scratch: Value, outputs: Sequence[Value]
) -> Value:
    """Call a program, by its name or its address; return 0, or 1 where a result is not finite."""
    return r.call(name, addresses(r, inputs), derived, scratch, addresses(r, outputs))
