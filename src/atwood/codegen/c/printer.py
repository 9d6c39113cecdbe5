"""Routines as C99: functions on words of 8 bytes.

A word is a union of a number, an integer and an address, so that memory is read as it was written.  A function that is
called by its address lies in a word, and that word's address is the function's.  Lanes are unrolled.  Every value is a
constant of its own, which compilers of C take away again.

Sums and products round as in machine code without contraction, which `HEAD` switches off where a compiler hears that;
others are told by an option (``-ffp-contract=off``).  Integers wrap at 64 bits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from atwood.codegen.routines import (
    ADDRESS,
    BOOLEAN,
    CODE,
    INTEGER,
    NUMBER,
    WORD,
    Block,
    Branch,
    Call,
    Instruction,
    Jump,
    Kind,
    Lanes,
    Loop,
    Routine,
    Value,
)

HEAD = """#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0
#error "numbers must be evaluated as doubles: with gcc, give -msse2 -mfpmath=sse"
#endif
#if defined(__clang__) || !defined(__GNUC__)
#pragma STDC FP_CONTRACT OFF
#endif
"""
"""What a file with routines begins with, after the definition of a word."""

WORDS = """typedef union word {
    double f;
    int64_t i;
    union word *p;
    void (*call)(void);
} word;
"""
"""What memory is made of."""

BITS = """static inline int64_t bits_of(double a) { word w; w.f = a; return w.i; }
static inline double number_of(int64_t a) { word w; w.i = a; return w.f; }
static inline double of_words(int64_t a, int64_t b) { return number_of((int64_t)(((uint64_t)a << 32) | (uint64_t)b)); }
"""
"""What routines call that ask for the bits of a number."""

_TYPES: dict[Kind, str] = {
    NUMBER: "double",
    INTEGER: "int64_t",
    WORD: "int64_t",
    CODE: "int32_t",
    BOOLEAN: "int",
    ADDRESS: "word *",
}
_FIELDS: dict[Kind, str] = {NUMBER: "f", ADDRESS: "p"}
_SIGNS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/", "and": "&", "or": "|"}
_COMPARED = {
    "less": "<",
    "less or equal": "<=",
    "greater": ">",
    "greater or equal": ">=",
    "equal": "==",
    "unequal": "!=",
}
_MATH = {"sqrt": "sqrt", "size": "fabs", "floor": "floor"}
_RESERVED = frozenset({"case", "default", "do", "double", "for", "if", "int", "long", "register", "short", "signed"})


def literal(value: float) -> str:
    """Return a number as C writes it."""
    if value != value:
        return "((double)NAN)"
    if abs(value) == float("inf"):
        return "((double)INFINITY)" if value > 0 else "(-(double)INFINITY)"
    text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


def called_in(routine: Routine) -> set[str]:
    """Return the names of what a routine calls by name."""
    return {
        one.function for one in _statements(routine.body) if isinstance(one, Call) and isinstance(one.function, str)
    }


def reached(routines: Iterable[Routine], roots: Iterable[str]) -> list[Routine]:
    """Return the routines that are called from some names, by each other too."""
    known = {one.name: one for one in routines}
    found, waiting = set[str](), [one for one in roots if one in known]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += [one for one in called_in(known[name]) if one in known]
    return [one for name, one in known.items() if name in found]


def print_routines(routines: Sequence[Routine], known: Mapping[str, Mapping[int, int]] | None = None) -> str:
    """Return the declarations and the functions of some routines, and the tables that they read.

    Parameters
    ----------
    routines
        The routines.
    known
        By the name of a routine, what is known of the integers that its first argument leads to, by their places.
    """
    tables: dict[tuple[float, ...], str] = {}
    printers = [_Printer(one, tables, (known or {}).get(one.name, {})) for one in routines]
    parts = [one.text() for one in printers]
    heads = [f"static const double {name}[] = {{{', '.join(map(literal, one))}}};" for one, name in tables.items()]
    return "\n".join([*(f"{one.head()};" for one in printers), *heads, *parts]) + "\n"


class _Printer:
    """The lines of one function."""

    def __init__(
        self, routine: Routine, tables: dict[tuple[float, ...], str], constants: Mapping[int, int] | None = None
    ) -> None:
        self.routine, self.tables = routine, tables
        self.constants = _constants(routine, constants or {})
        self.lines: list[str] = []
        self.names = {one.name: f"{one.name}_" if one.name in _RESERVED else str(one.name) for one in routine.arguments}
        self.live = _live(routine, self.constants)
        self.loops: list[tuple[Loop, int]] = []
        self.labels: set[str] = set()
        self._count = 0

    def head(self) -> str:
        """Return the declaration of the function."""
        given = ", ".join(_declared(one.kind, self.names[one.name]) for one in self.routine.arguments)
        result = "void" if self.routine.result is None else _TYPES[self.routine.result]
        return f"static {result} {self.routine.name}({given or 'void'})"

    def text(self) -> str:
        """Return the function."""
        for one in self.routine.arguments:
            if one.name not in self.live:
                self.lines.append(f"(void){self.names[one.name]};")
        for place, kind in self.routine.variables:
            if place.name not in self.live:
                continue
            if isinstance(kind, int):
                self.lines.append(f"word {place.name}[{max(kind, 1)}];")
            else:
                start = "NULL" if kind is ADDRESS else "0"
                self.lines += [f"{_declared(kind, name)} = {start};" for name in _lanes(place.name, kind)]
        self.block(self.routine.body)
        last = self.routine.body[-1] if self.routine.body else None
        if self.routine.result is not None and not (isinstance(last, Instruction) and last.operation == "return"):
            self.lines.append("return 0;")
        body = "\n".join(self.lines)
        return f"{self.head()}\n{{\n{body}\n}}\n"

    # -- statements -------------------------------------------------------------------------------------------------

    def block(self, block: Block) -> None:
        """Write what stands in a block."""
        for one in block:
            match one:
                case Instruction():
                    self._instruction(one)
                case Call():
                    self._call(one)
                case Branch():
                    self.lines.append(f"if ({self._one(one.condition)}) {{")
                    self.block(one.then)
                    if one.otherwise:
                        self.lines.append("} else {")
                        self.block(one.otherwise)
                    self.lines.append("}")
                case Loop():
                    self._loop(one)
                case Jump():
                    self._jump(one)

    def _loop(self, loop: Loop) -> None:
        self._count += 1
        self.loops.append((loop, self._count))
        self.lines.append("for (;;) {")
        self.block(loop.body)
        number = self.loops.pop()[1]
        if f"turn{number}" in self.labels:
            self.lines.append(f"turn{number}:;")
        self.lines.append("}")
        if f"end{number}" in self.labels:
            self.lines.append(f"end{number}:;")

    def _jump(self, jump: Jump) -> None:
        if jump.loop is self.loops[-1][0]:
            self.lines.append("break;" if jump.leaves else "continue;")
            return
        number = next(number for loop, number in self.loops if loop is jump.loop)
        label = f"{'end' if jump.leaves else 'turn'}{number}"
        self.labels.add(label)
        self.lines.append(f"goto {label};")

    def _call(self, call: Call) -> None:
        given = ", ".join(self._one(one) for one in call.arguments)
        if isinstance(call.function, str):
            target = call.function
        else:
            result = "void" if call.result is None else _TYPES[call.result.kind]
            kinds = ", ".join(_TYPES[one.kind] for one in call.arguments)
            target = f"(({result} (*)({kinds}))({self._one(call.function)})->call)"
        if call.result is not None and call.result.name in self.live:
            target = f"const {_declared(call.result.kind, str(call.result.name))} = {target}"
        self.lines.append(f"{target}({given});")

    def _instruction(self, one: Instruction) -> None:
        values, result = one.arguments, one.result
        if result is not None:
            if result.name in self.live:
                texts = self._expression(one.operation, result, values)
                names = _lanes(result.name, result.kind)
                kind = _element(result.kind)
                for name, text in zip(names, texts, strict=True):
                    constant = f"word *const {name}" if kind is ADDRESS else f"const {_TYPES[kind]} {name}"
                    self.lines.append(f"{constant} = {text};")
            return
        match one.operation:
            case "return":
                self.lines.append(f"return{''.join(f' {self._one(each)}' for each in values)};")
            case "set":
                if values[1].name in self.live:
                    names = _lanes(values[1].name, values[0].kind)
                    self.lines += [f"{a} = {b};" for a, b in zip(names, self._of(values[0]), strict=True)]
            case "store":
                texts, place, field = self._of(values[0]), self._one(values[1]), _field(values[0].kind)
                self.lines += [f"{place}[{k}].{field} = {text};" for k, text in enumerate(texts)]
            case "copy" | "copy of codes":
                target, source, count = map(self._one, values)
                self.lines.append(f"memcpy({target}, {source}, (size_t){count} * sizeof(word));")
            case _:
                begin, end = map(self._one, values)
                self.lines.append(f"memset({begin}, 0, (size_t)({end} - {begin}) * sizeof(word));")

    # -- expressions ------------------------------------------------------------------------------------------------

    def _of(self, value: Value) -> tuple[str, ...]:
        """Return the text of each lane of a value."""
        name, kind = value.name, value.kind
        if isinstance(name, str):
            return tuple(self.names.get(one, one) for one in _lanes(name, kind))
        element = _element(kind)
        text = literal(float(name)) if element is NUMBER else _whole(int(name)) if element is not ADDRESS else "NULL"
        return (text,) * (kind.count if isinstance(kind, Lanes) else 1)

    def _one(self, value: Value) -> str:
        return self._of(value)[0]

    def _expression(self, operation: str, result: Value, values: tuple[Any, ...]) -> tuple[str, ...]:
        count = result.kind.count if isinstance(result.kind, Lanes) else 1
        if operation == "load":
            if result.name in self.constants:
                return (_whole(self.constants[result.name]),)
            place, field = self._one(values[0]), _field(result.kind)
            cast = "(int32_t)" if result.kind is CODE else "(int)" if result.kind is BOOLEAN else ""
            return tuple(f"{cast}{place}[{k}].{field}" for k in range(count))
        if operation == "get":
            return _lanes(values[0].name, result.kind)
        if operation == "spread":
            return self._of(values[0]) * count
        if operation == "look up":
            table = self.tables.setdefault(values[1], f"{self.routine.name}_table{len(self.tables)}")
            return (f"{table}[{self._one(values[0])}]",)
        given = [self._of(one) for one in values]
        if operation in _REDUCED:
            return (_REDUCED[operation](given[0]),)
        width = max(map(len, given))
        rows = [one if len(one) == width else one * width for one in given]
        return tuple(_scalar(operation, result.kind, values[0].kind, parts) for parts in zip(*rows, strict=True))


def _scalar(operation: str, made: Kind, kind: Kind, parts: Sequence[str]) -> str:
    """Return an operation on single values."""
    a, element = parts[0], _element(kind)
    if operation in _COMPARED:
        return f"{a} {_COMPARED[operation]} {parts[1]}"
    if operation in _SIGNS:
        if element in (INTEGER, WORD) and operation in ("add", "subtract", "multiply"):
            return f"(int64_t)((uint64_t){a} {_SIGNS[operation]} (uint64_t){parts[1]})"
        return f"{a} {_SIGNS[operation]} {parts[1]}"
    match operation:
        case "shift right" | "shift left":
            return f"(int64_t)((uint64_t){a} {'>>' if operation == 'shift right' else '<<'} {parts[1]})"
        case "offset" | "offset of codes":
            return f"{a} + {parts[1]}"
        case "choose" | "pick":
            return f"{a} ? {parts[1]} : {parts[2]}"
        case "flip":
            return f"{a} ? -{parts[1]} : {parts[1]}"
        case "not":
            return f"!{a}" if element is BOOLEAN else f"{a} ^ 1"
        case "bits":
            return f"{'number_of' if made is NUMBER else 'bits_of'}({a})"
        case "high":
            return f"(int64_t)((uint64_t)bits_of({a}) >> 32)"
        case "low":
            return f"bits_of({a}) & INT64_C(0xffffffff)"
        case "of words":
            return f"of_words({a}, {parts[1]})"
        case "is null":
            return f"{a} == NULL"
        case "truncated" | "to integer" | "to code" | "to number":
            return f"({_TYPES[_element(made)]}){a}"
        case _:
            return f"{_MATH[operation]}({a})"


def _largest(lanes: Sequence[str]) -> str:
    text = lanes[0]
    for one in lanes[1:]:
        text = f"fmax({text}, {one})"
    return text


_REDUCED: dict[str, Callable[[Sequence[str]], str]] = {
    "sum of lanes": lambda lanes: " + ".join(lanes),
    "largest lane": _largest,
    "any lane": lambda lanes: " || ".join(lanes),
}


def _whole(value: int) -> str:
    if abs(value) < 2**31:
        return str(value) if value >= 0 else f"({value})"
    return f"(int64_t)UINT64_C({value & (2**64 - 1):#x})"


def _element(kind: Kind) -> Kind:
    """Return the kind of one lane."""
    if isinstance(kind, Lanes):
        return NUMBER if kind.is_float else WORD if kind.is_word else BOOLEAN
    return kind


def _field(kind: Kind) -> str:
    return _FIELDS.get(_element(kind), "i")


def _declared(kind: Kind, name: str) -> str:
    text = _TYPES[_element(kind)]
    return f"{text}{name}" if text.endswith("*") else f"{text} {name}"


def _lanes(name: str | int | float, kind: Kind) -> tuple[str, ...]:
    return tuple(f"{name}_{k}" for k in range(kind.count)) if isinstance(kind, Lanes) else (str(name),)


def _statements(block: Block) -> Iterator[Instruction | Call | Branch | Loop | Jump]:
    """Yield what stands in a block, and in what stands there."""
    for one in block:
        yield one
        if isinstance(one, Branch):
            yield from (*_statements(one.then), *_statements(one.otherwise))
        elif isinstance(one, Loop):
            yield from _statements(one.body)


_Name = str | int | float


def _constants(routine: Routine, known: Mapping[int, int]) -> dict[_Name, int]:
    """Return the values that are known of what is read at the first argument, by their names."""
    places: dict[_Name, int] = {}
    found: dict[_Name, int] = {}
    for one in _statements(routine.body) if known else ():
        if not isinstance(one, Instruction) or one.result is None:
            continue
        if one.operation == "offset" and one.arguments[0].name == routine.arguments[0].name:
            places[one.result.name] = one.arguments[1].name
        elif one.operation == "load" and one.result.kind is INTEGER and places.get(one.arguments[0].name) in known:
            found[one.result.name] = known[places[one.arguments[0].name]]
    return found


def _live(routine: Routine, constants: Mapping[_Name, int]) -> set[_Name]:
    """Return the names of the values that something comes of: what is stored, returned, compared or handed on."""
    made: dict[_Name, Instruction] = {}
    settings: dict[_Name, list[Value]] = {}
    waiting: list[Value] = []
    for one in _statements(routine.body):
        match one:
            case Instruction():
                if one.result is not None:
                    made[one.result.name] = one
                elif one.operation == "set":
                    settings.setdefault(one.arguments[1].name, []).append(one.arguments[0])
                else:
                    waiting += one.arguments
            case Call():
                waiting += (*one.arguments, *(() if isinstance(one.function, str) else (one.function,)))
            case Branch():
                waiting.append(one.condition)
            case _:
                pass
    live: set[_Name] = set()
    while waiting:
        name = waiting.pop().name
        if name in live:
            continue
        live.add(name)
        waiting += settings.get(name, ())
        if name in made and name not in constants:
            waiting += [each for each in made[name].arguments if isinstance(each, Value)]
    return live
