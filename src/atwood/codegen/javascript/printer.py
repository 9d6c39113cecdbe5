"""Routines as JavaScript: functions on one array of numbers.

All memory is a `Float64Array` called ``M``: an address is the number of a word, an integer is a number in one, and an
address of a function its number in the array ``F``. Word 0 leads nowhere; it holds where the stack ends, on which
arrays of calls lie. Lanes are unrolled. What is used once stands where it is used, if nothing between could change it.

Sums and products round as in machine code without contraction. Integers are exact up to 2^53; where their bits are
asked for they are of 64 bits.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from atwood.codegen.routines import (
    BOOLEAN,
    INTEGER,
    NUMBER,
    WORD,
    Block,
    Branch,
    Call,
    Instruction,
    Jump,
    Lanes,
    Loop,
    Routine,
    Value,
)

_INFIX = {
    "add": "+",
    "subtract": "-",
    "multiply": "*",
    "divide": "/",
    "less": "<",
    "less or equal": "<=",
    "greater": ">",
    "greater or equal": ">=",
    "equal": "===",
    "unequal": "!==",
}
_LOGICAL = {"and": "&&", "or": "||"}
_BITS = {"and": "&", "or": "|", "shift right": ">>", "shift left": "<<"}
_WORDS = {"and": "&", "or": "|", "shift right": ">>>", "shift left": "<<"}
_OF_WORDS = {"high": "high", "low": "low", "of words": "ofWords", "flip": "flip"}
_MATH = {"sqrt": "Math.sqrt", "size": "Math.abs", "floor": "Math.floor"}
_RESERVED = frozenset(
    {"case", "default", "delete", "do", "function", "if", "in", "let", "new", "of", "this", "var", "with"}
)
_MEMORY = "M"
_LONGEST = 400

BITS = """const word = new DataView(new ArrayBuffer(8));
const toBits = a => { word.setFloat64(0, a); return word.getBigInt64(0); };
const fromBits = a => { word.setBigInt64(0, BigInt(a)); return word.getFloat64(0); };
const whole = new Float64Array(1), words = new Uint32Array(whole.buffer);
const high = a => { whole[0] = a; return words[1]; };
const low = a => { whole[0] = a; return words[0]; };
const ofWords = (a, b) => { words[1] = a; words[0] = b; return whole[0]; };
const flip = (a, b) => a ? -b : b;
"""
"""What routines call that ask for the bits of a number."""


def literal(value: float) -> str:
    """Return a number as JavaScript writes it."""
    if value != value:
        return "NaN"
    text = repr(value) if abs(value) != float("inf") else "Infinity" if value > 0 else "-Infinity"
    text = text.removesuffix(".0")
    return f"({text})" if text.startswith("-") else text


def print_routines(routines: Sequence[Routine]) -> str:
    """Return the functions of some routines, and the tables that they read."""
    tables: dict[tuple[float, ...], str] = {}
    parts = [_Printer(one, tables).text() for one in routines]
    heads = [f"const {name} = [{', '.join(map(literal, table))}];" for table, name in tables.items()]
    return "\n".join([*heads, *parts])


class _Text(NamedTuple):
    """What stands for a value: a text for each lane, what it reads that can change, and whether it is a BigInt."""

    lanes: tuple[str, ...]
    reads: frozenset[str] = frozenset()
    is_wide: bool = False


class _Printer:
    """The lines of one function."""

    def __init__(self, routine: Routine, tables: dict[tuple[float, ...], str]) -> None:
        self.routine, self.tables = routine, tables
        self.lines: list[str] = []
        self.known: dict[str | int | float, _Text] = {}
        self.waiting: dict[str, Value] = {}
        self.loops: dict[Loop, int] = {}
        self.uses = Counter(one.name for one in _used(routine.body))
        self.has_arrays = any(isinstance(kind, int) for _, kind in routine.variables)

    def text(self) -> str:
        """Return the function."""
        names = [f"{one.name}_" if one.name in _RESERVED else str(one.name) for one in self.routine.arguments]
        for one, name in zip(self.routine.arguments, names, strict=True):
            self.known[one.name] = _Text((name,))
        places, count = [], 0
        if self.has_arrays:
            self.lines.append("const top = M[0];")
        for place, kind in self.routine.variables:
            if isinstance(kind, int):
                places.append(f"{place.name} = top + {count}")
                self.known[place.name] = _Text((str(place.name),))
                count += kind
            else:
                self.lines.append(f"let {', '.join(_names(place.name, kind))};")
        if self.has_arrays:
            self.lines.append(f"const {', '.join(places)}; M[0] = top + {count};")
        self.block(self.routine.body)
        if self.routine.result is None:
            self._return("")
        body = "\n".join(self.lines)
        return f"function {self.routine.name}({', '.join(names)}) {{\n{body}\n}}"

    def _return(self, value: str) -> None:
        self.lines.append(f"{'M[0] = top; ' if self.has_arrays else ''}return{value};")

    # -- statements -------------------------------------------------------------------------------------------------

    def block(self, block: Block) -> None:
        """Write what stands in a block."""
        for one in block:
            match one:
                case Instruction():
                    self._instruction(one)
                case Call():
                    given = ", ".join(self._one(value) for value in one.arguments)
                    target = one.function if isinstance(one.function, str) else f"F[{self._one(one.function)}]"
                    self._settle(_MEMORY)
                    kept = one.result is not None and self.uses[one.result.name] > 0
                    if one.result is not None and kept:
                        self.known[one.result.name] = _Text((str(one.result.name),))
                        target = f"const {one.result.name} = {target}"
                    self.lines.append(f"{target}({given});")
                case Branch():
                    condition = self._one(one.condition)
                    self._settle()
                    self._nested(f"if ({condition}) {{", one.then)
                    if one.otherwise:
                        self._nested("} else {", one.otherwise)
                    self.lines.append("}")
                case Loop():
                    self._settle()
                    self.loops[one] = len(self.loops)
                    self._nested(f"L{self.loops[one]}: while (true) {{", one.body)
                    self.lines.append("}")
                case Jump():
                    self.lines.append(f"{'break' if one.leaves else 'continue'} L{self.loops[one.loop]};")

    def _nested(self, head: str, block: Block) -> None:
        self.lines.append(head)
        self.block(block)
        self.waiting.clear()  # what is left is used nowhere

    def _instruction(self, one: Instruction) -> None:
        values, result = one.arguments, one.result
        if result is not None:
            self._value(one.operation, result, values)
            return
        match one.operation:
            case "return":
                self._return(f" {self._one(values[0])}" if values else "")
            case "set":
                texts, name = self._plain(values[0]), values[1].name
                self._settle(str(name))
                self.lines += [f"{a} = {b};" for a, b in zip(_names(name, values[0].kind), texts, strict=True)]
            case "store":
                texts, place = self._plain(values[0]), self._simple(values[1], len(self._of(values[0]).lanes) > 1)
                self._settle(_MEMORY)
                if len(texts) > 1 and any("M[" in one for one in texts):  # all is read before anything is written
                    texts = self._named(texts)
                self.lines += [f"M[{place}{f' + {k}' if k else ''}] = {a};" for k, a in enumerate(texts)]
            case "copy" | "copy of codes":
                target, source, count = self._one(values[0]), self._simple(values[1], True), self._one(values[2])
                self._settle(_MEMORY)
                self.lines.append(f"M.copyWithin({target}, {source}, {source} + {count});")
            case _:
                begin, end = map(self._one, values)
                self._settle(_MEMORY)
                self.lines.append(f"M.fill(0, {begin}, {end});")

    def _value(self, operation: str, result: Value, values: tuple[Value, ...]) -> None:
        """Take note of a value; it is written where it is used once, or else now."""
        uses = self.uses[result.name]
        if not uses:
            return
        self.known[result.name] = self._expression(operation, result, values)
        if uses > 1 or any(len(one) > _LONGEST for one in self.known[result.name].lanes):
            self._write(result)
        else:
            self.waiting[str(result.name)] = result

    def _write(self, value: Value) -> None:
        """Give a value a name of its own."""
        text = self.known[value.name]
        names = _names(value.name, value.kind)
        self.lines += [f"const {a} = {b};" for a, b in zip(names, text.lanes, strict=True) if a != b]
        self.known[value.name] = _Text(names, is_wide=text.is_wide)

    def _settle(self, changed: str = "") -> None:
        """Write what is still to be used and reads what changes now; all of it where nothing is said."""
        for name, value in list(self.waiting.items()):
            if not changed or changed in self.known[name].reads:
                del self.waiting[name]
                self._write(value)

    def _named(self, texts: Sequence[str]) -> list[str]:
        names = [f"s{len(self.lines)}_{k}" for k in range(len(texts))]
        self.lines += [f"const {a} = {b};" for a, b in zip(names, texts, strict=True)]
        return names

    # -- expressions ------------------------------------------------------------------------------------------------

    def _of(self, value: Value) -> _Text:
        """Return what stands for a value, which is used where this is written."""
        name = value.name
        if not isinstance(name, str):
            text = (
                literal(name)
                if isinstance(name, float)
                else ("true", "false")[not name]
                if value.kind is BOOLEAN
                else literal(name)
            )
            return _Text((text,) * (value.kind.count if isinstance(value.kind, Lanes) else 1))
        self.waiting.pop(name, None)
        return self.known[name]

    def _plain(self, value: Value) -> list[str]:
        """Return the text of each lane, integers as numbers."""
        text = self._of(value)
        return [f"Number({one})" for one in text.lanes] if text.is_wide else list(text.lanes)

    def _one(self, value: Value) -> str:
        return self._plain(value)[0]

    def _simple(self, value: Value, matters: bool = True) -> str:
        """Return a name or a number for a value that is mentioned more than once."""
        if matters and isinstance(value.name, str) and not self.known[value.name].lanes[0].isidentifier():
            self.waiting.pop(value.name, None)
            self._write(value)
        return self._one(value)

    def _expression(self, operation: str, result: Value, values: tuple[Value, ...]) -> _Text:
        count = result.kind.count if isinstance(result.kind, Lanes) else 1
        if operation == "load":
            place, reads = self._simple(values[0], count > 1), self.known[values[0].name].reads
            lanes = [f"M[{place}{f' + {k}' if k else ''}]" for k in range(count)]
            return _Text(tuple(lanes), reads | {_MEMORY})
        if operation == "get":
            return _Text(_names(values[0].name, result.kind), frozenset({str(values[0].name)}))
        if operation == "spread":
            return _Text((self._simple(values[0]),) * count, self.known[values[0].name].reads)
        if operation == "look up":
            numbers: Any = values[1]
            table = self.tables.setdefault(numbers, f"{self.routine.name}_table{len(self.tables)}")
            return _Text((f"{table}[{self._one(values[0])}]",))
        given = [self._of(one) for one in values]
        reads = frozenset().union(*(one.reads for one in given))
        if (
            values[0].kind is INTEGER and (operation in _BITS or any(one.is_wide for one in given))
        ) or operation == "bits":
            wide = self._wide(operation, result, given)
            if wide is not None:
                return wide._replace(reads=reads)
        if operation in ("sum of lanes", "largest lane", "any lane"):
            return _Text((_REDUCED[operation](given[0].lanes),), reads)
        width = max(len(one.lanes) for one in given)
        rows = [one.lanes if len(one.lanes) == width else one.lanes * width for one in given]
        return _Text(tuple(_scalar(operation, result, values, parts) for parts in zip(*rows, strict=True)), reads)

    def _wide(self, operation: str, result: Value, given: Sequence[_Text]) -> _Text | None:
        """Return an operation on integers of 64 bits; None for what takes them as they are."""
        texts = [one.lanes[0] if one.is_wide else f"BigInt({one.lanes[0]})" for one in given]
        if operation == "bits":
            to_number = result.kind is NUMBER
            return _Text((f"{'fromBits' if to_number else 'toBits'}({given[0].lanes[0]})",), is_wide=not to_number)
        if operation == "shift right":
            return _Text((f"(BigInt.asUintN(64, {texts[0]}) >> {texts[1]})",), is_wide=True)
        if operation == "choose":
            return _Text((f"({given[0].lanes[0]} ? {texts[1]} : {texts[2]})",), is_wide=True)
        if operation in ("to number", "to code"):
            return _Text((f"Number({texts[0]})",))
        sign = {**_INFIX, **_BITS}[operation]
        if result.kind is BOOLEAN:
            return _Text((f"({texts[0]} {sign} {texts[1]})",))
        return _Text((f"BigInt.asIntN(64, {texts[0]} {sign} {texts[1]})",), is_wide=True)


def _scalar(operation: str, result: Value, values: tuple[Value, ...], parts: Sequence[str]) -> str:
    """Return an operation on single values."""
    a, kind = parts[0], values[0].kind
    if operation == "divide" and not kind.is_float:
        return f"Math.trunc({a} / {parts[1]})"
    if operation in _INFIX:
        return f"({a} {_INFIX[operation]} {parts[1]})"
    if operation in _OF_WORDS:
        return f"{_OF_WORDS[operation]}({', '.join(parts)})"
    if operation in _WORDS and (kind is WORD or (isinstance(kind, Lanes) and kind.is_word)):
        return f"({a} {_WORDS[operation]} {parts[1]})"
    if operation in _LOGICAL:
        return (
            f"({a} {_LOGICAL[operation]} {parts[1]})"
            if _is_truth(values[0])
            else f"({a} {_BITS[operation]} {parts[1]})"
        )
    match operation:
        case "offset" | "offset of codes":
            return a if parts[1] == "0" else f"({a} + {parts[1]})"
        case "choose" | "pick":
            return f"({a} ? {parts[1]} : {parts[2]})"
        case "not":
            return f"(!{a})" if _is_truth(values[0]) else f"({a} ^ 1)"
        case "truncated":
            return f"Math.trunc({a})"
        case "is null":
            return f"({a} === 0)"
        case "to integer" | "to code" | "to number":
            return f"({a} ? 1 : 0)" if kind is BOOLEAN else a
        case _:
            return f"{_MATH[operation]}({a})"


_REDUCED: dict[str, Callable[[Sequence[str]], str]] = {
    "sum of lanes": lambda lanes: "(" * (len(lanes) - 1) + lanes[0] + "".join(f" + {one})" for one in lanes[1:]),
    "largest lane": lambda lanes: f"Math.max({', '.join(lanes)})",
    "any lane": lambda lanes: f"({' || '.join(lanes)})",
}


def _is_truth(value: Value) -> bool:
    return value.kind is BOOLEAN or (
        isinstance(value.kind, Lanes) and not value.kind.is_float and not value.kind.is_word
    )


def _names(name: str | int | float, kind: object) -> tuple[str, ...]:
    return tuple(f"{name}_{k}" for k in range(kind.count)) if isinstance(kind, Lanes) else (str(name),)


def _used(block: Block) -> Iterator[Value]:
    """Yield the values that are used in a block, as often as they are."""
    for one in block:
        match one:
            case Instruction():
                yield from (value for value in one.arguments if isinstance(value, Value))
            case Call():
                yield from (*one.arguments, *(() if isinstance(one.function, str) else (one.function,)))
            case Branch():
                yield one.condition
                yield from (*_used(one.then), *_used(one.otherwise))
            case Loop():
                yield from _used(one.body)
