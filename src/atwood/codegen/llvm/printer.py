"""Routines in LLVM's language.

Variables lie in memory; LLVM makes registers of them (`atwood.codegen.llvm.engine.compile_text`), so no phi node is
written by hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from atwood.codegen.llvm.text import literal
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

_TYPES: dict[Kind, str] = {NUMBER: "double", INTEGER: "i64", WORD: "i64", CODE: "i32", BOOLEAN: "i1", ADDRESS: "ptr"}
_CONVERTED: dict[Kind, str] = {CODE: "sext", INTEGER: "trunc"}
_FLOATING = {"add": "fadd", "subtract": "fsub", "multiply": "fmul", "divide": "fdiv"}
_WHOLE = {"add": "add", "subtract": "sub", "multiply": "mul", "divide": "sdiv", "and": "and", "or": "or"} | {
    "shift right": "lshr",
    "shift left": "shl",
}
_COMPARED = {
    "less": ("olt", "slt"),
    "less or equal": ("ole", "sle"),
    "greater": ("ogt", "sgt"),
    "greater or equal": ("oge", "sge"),
    "equal": ("oeq", "eq"),
    "unequal": ("une", "ne"),
}
_MATH = {"sqrt": "sqrt", "size": "fabs", "floor": "floor"}
_REDUCED = {  # the function of LLVM, what it returns, and what it takes first
    "sum of lanes": ("fadd", "double", "double -0.0, "),
    "largest lane": ("fmax", "nnan double", ""),
    "any lane": ("or", "i1", ""),
}


def print_routines(routines: Sequence[Routine]) -> str:
    """Return the functions of a module, and the declarations of LLVM's own functions that they call."""
    printer = _Printer()
    parts = [printer.function(one) for one in routines]
    return "\n".join([*parts, *sorted(printer.declared)])


class _Printer:
    """The lines of the function that is being printed, and the declarations of all."""

    def __init__(self) -> None:
        self.declared: set[str] = set()
        self.tables: dict[tuple[float, ...], str] = {}
        self.lines: list[str] = []
        self._labels = 0
        self._loops: dict[Loop, int] = {}

    def function(self, routine: Routine) -> str:
        """Return a whole function."""
        given = ", ".join(f"{_type(one.kind)} %{one.name}" for one in routine.arguments)
        result = "void" if routine.result is None else _type(routine.result)
        scope = "" if routine.exported else "internal "
        self.lines = [f"define {scope}{result} @{routine.name}({given}) #0 {{", "entry:"]
        for place, kind in routine.variables:
            room = f"[{kind} x i64]" if isinstance(kind, int) else _type(kind)
            self.lines.append(f"  {_name(place)} = alloca {room}")
        self.block(routine.body)
        self.lines += ["  ret void" if routine.result is None else "  unreachable", "}"]
        return "\n".join(self.lines)

    def block(self, block: Block) -> None:
        """Write what stands in a block."""
        for one in block:
            match one:
                case Instruction():
                    self.instruction(one)
                case Call():
                    self.call(one)
                case Branch():
                    self.branch(one)
                case Loop():
                    self.loop(one)
                case Jump():
                    label = f"{'end' if one.leaves else 'turn'}{self._loops[one.loop]}"
                    self.end_of_block(f"br label %{label}")

    def end_of_block(self, jump: str) -> None:
        """Write a jump; what follows in the text, if anything does, is never reached."""
        self._labels += 1
        self.lines += [f"  {jump}", f"after{self._labels}:"]

    def branch(self, branch: Branch) -> None:
        """Write a branch."""
        self._labels += 1
        k = self._labels
        other = "else" if branch.otherwise else "end"
        self.lines += [f"  br i1 {_name(branch.condition)}, label %then{k}, label %{other}{k}", f"then{k}:"]
        self.block(branch.then)
        self.lines.append(f"  br label %end{k}")
        if branch.otherwise:
            self.lines.append(f"else{k}:")
            self.block(branch.otherwise)
            self.lines.append(f"  br label %end{k}")
        self.lines.append(f"end{k}:")

    def loop(self, loop: Loop) -> None:
        """Write a loop."""
        self._labels += 1
        k = self._loops[loop] = self._labels
        self.lines += [f"  br label %turn{k}", f"turn{k}:"]
        self.block(loop.body)
        self.lines += [f"  br label %turn{k}", f"end{k}:"]

    def call(self, call: Call) -> None:
        """Write a call."""
        given = ", ".join(map(_typed, call.arguments))
        target = f"@{call.function}" if isinstance(call.function, str) else _name(call.function)
        if call.result is None:
            self.lines.append(f"  call void {target}({given})")
        else:
            self.lines.append(f"  {_name(call.result)} = call {_type(call.result.kind)} {target}({given})")

    def instruction(self, one: Instruction) -> None:
        """Write an operation."""
        result, operation, values = one.result, one.operation, one.arguments
        if operation == "return":
            self.end_of_block(f"ret {_typed(values[0])}" if values else "ret void")
        elif operation in ("store", "set"):
            align = ", align 8" if isinstance(values[0].kind, Lanes) else ""
            self.lines.append(f"  store {_typed(values[0])}, {_typed(values[1])}{align}")
        elif operation in ("copy", "copy of codes"):
            self._copy(8 if operation == "copy" else 4, *values)
        elif operation == "clear":
            self._clear(*values)
        else:
            assert result is not None
            self.lines.append(f"  {_name(result)} = {self._expression(operation, result, values)}")

    def _expression(self, operation: str, result: Value, values: tuple[Value, ...]) -> str:
        a, kind = values[0], _type(values[0].kind)
        if operation in _COMPARED:
            word = ("fcmp " if a.kind.is_float else "icmp ") + _COMPARED[operation][not a.kind.is_float]
            return f"{word} {kind} {_name(a)}, {_name(values[1])}"
        if operation in _WHOLE:
            word = (_FLOATING if a.kind.is_float else _WHOLE)[operation]
            return f"{word} {kind} {_name(a)}, {_name(values[1])}"
        match operation:
            case "load" | "get":
                align = ", align 8" if isinstance(result.kind, Lanes) else ""
                return f"load {_type(result.kind)}, {_typed(a)}{align}"
            case "offset" | "offset of codes":
                return f"getelementptr {'double' if operation == 'offset' else 'i32'}, {_typed(a)}, {_typed(values[1])}"
            case "choose":
                return f"select {', '.join(map(_typed, values))}"
            case "not":
                return f"xor {kind} {_name(a)}, {_name(Value(a.routine, a.kind, 1))}"
            case "bits":
                return f"bitcast {_typed(a)} to {_type(result.kind)}"
            case "truncated":
                return f"fptosi {_typed(a)} to i64"
            case "is null":
                return f"icmp eq ptr {_name(a)}, null"
            case "to number" if a.kind is INTEGER or a.kind is CODE:
                return f"sitofp {kind} {_name(a)} to double"
            case "high" | "low" | "of words" | "pick" | "flip" | "to number":
                return self._words(operation, result, values)
            case "look up":
                return self._look_up(result, a, values[1])
            case "to integer" if isinstance(a.kind, Lanes):
                self.lines.append(f"  {_name(result)}.bits = bitcast {_typed(a)} to i{a.kind.count}")
                return f"zext i{a.kind.count} {_name(result)}.bits to i64"
            case "conditions":
                assert isinstance(result.kind, Lanes)
                self.lines.append(f"  {_name(result)}.bits = trunc {_typed(a)} to i{result.kind.count}")
                return f"bitcast i{result.kind.count} {_name(result)}.bits to {_type(result.kind)}"
            case "to code" | "to integer":
                word = _CONVERTED.get(a.kind, "zext")
                return f"{word} {_typed(a)} to {_type(result.kind)}"
            case "spread":
                return self._spread(result, a)
            case "sum of lanes" | "largest lane" | "any lane":
                assert isinstance(a.kind, Lanes)
                word, made, first = _REDUCED[operation]
                name = f"llvm.vector.reduce.{word}.v{a.kind.count}{'f64' if a.kind.is_float else 'i1'}"
                start = "double, " if first else ""
                self.declared.add(f"declare {_type(result.kind)} @{name}({start}{kind})")
                return f"call {made} @{name}({first}{_typed(a)})"
            case _:
                lanes = f"v{a.kind.count}" if isinstance(a.kind, Lanes) else ""
                name = f"llvm.{_MATH[operation]}.{lanes}f64"
                if lanes:  # those of plain numbers every module declares
                    self.declared.add(f"declare {kind} @{name}({', '.join([kind] * len(values))})")
                return f"call {kind} @{name}({', '.join(map(_typed, values))})"

    def _spread(self, result: Value, a: Value) -> str:
        assert isinstance(result.kind, Lanes)
        kind, count = _type(result.kind), result.kind.count
        first = f"{_name(result)}.first"
        self.lines.append(f"  {first} = insertelement {kind} poison, {_typed(a)}, i32 0")
        return f"shufflevector {kind} {first}, {kind} poison, <{count} x i32> zeroinitializer"

    def _words(self, operation: str, result: Value, values: tuple[Value, ...]) -> str:
        """Return the last instruction of what is done with the bits of numbers."""
        number = result if result.kind.is_float else values[0]
        word = values[0] if result.kind.is_float else result
        bits, kind, name = _type(word.kind), _type(number.kind), _name(result)

        def constant(one: int) -> str:
            return _name(Value(word.routine, word.kind, one))

        def put(end: str, text: str) -> str:
            self.lines.append(f"  {name}.{end} = {text}")
            return f"{name}.{end}"

        def bits_of(one: Value, end: str) -> str:
            return put(end, f"bitcast {_typed(one)} to {bits}")

        if operation == "high":
            return f"lshr {bits} {bits_of(number, 'a')}, {constant(32)}"
        if operation == "low":
            return f"and {bits} {bits_of(number, 'a')}, {constant(2**32 - 1)}"
        if operation == "to number":  # the word is the end of the bits of a number from 2^52 on
            found = put("a", f"or {bits} {_name(word)}, {constant(0x433 << 52)}")
            shifted = put("b", f"bitcast {bits} {found} to {kind}")
            return f"fsub {kind} {shifted}, {_name(Value(word.routine, number.kind, 2.0**52))}"
        if operation == "of words":
            above = put("a", f"shl {bits} {_name(word)}, {constant(32)}")
            found = put("b", f"or {bits} {above}, {_name(values[1])}")
        elif operation == "flip":
            sign = put("a", f"shl {bits} {_name(word)}, {constant(63)}")
            found = put("b", f"xor {bits} {sign}, {bits_of(values[1], 'c')}")
        else:
            mask = put("a", f"sub {bits} {constant(0)}, {_name(word)}")
            first, second = (bits_of(one, end) for one, end in zip(values[1:], "bc", strict=True))
            changed = put("d", f"xor {bits} {first}, {second}")
            kept = put("e", f"and {bits} {changed}, {mask}")
            found = put("f", f"xor {bits} {kept}, {second}")
        return f"bitcast {bits} {found} to {kind}"

    def _look_up(self, result: Value, word: Value, table: Any) -> str:
        kind = f"[{len(table)} x double]"
        if table not in self.tables:
            self.tables[table] = f"@table.{len(self.tables)}"
            numbers = ", ".join(f"double {literal(one)}" for one in table)
            self.declared.add(f"{self.tables[table]} = internal constant {kind} [{numbers}]")
        place = f"{_name(result)}.place"
        self.lines.append(f"  {place} = getelementptr {kind}, ptr {self.tables[table]}, i64 0, {_typed(word)}")
        return f"load double, ptr {place}"

    def _copy(self, width: int, target: Value, source: Value, count: Value) -> None:
        self._labels += 1
        size = f"%size{self._labels}"
        self.declared.add("declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)")
        self.lines.append(f"  {size} = mul i64 {_name(count)}, {width}")
        self.lines.append(
            f"  call void @llvm.memcpy.p0.p0.i64({_typed(target)}, {_typed(source)}, i64 {size}, i1 false)"
        )

    def _clear(self, begin: Value, end: Value) -> None:
        self._labels += 1
        k = self._labels
        self.declared.add("declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)")
        for name, one in (("from", begin), ("to", end)):
            self.lines.append(f"  %{name}{k} = ptrtoint ptr {_name(one)} to i64")
        self.lines.append(f"  %size{k} = sub i64 %to{k}, %from{k}")
        self.lines.append(f"  call void @llvm.memset.p0.i64(ptr {_name(begin)}, i8 0, i64 %size{k}, i1 false)")


def _type(kind: Kind) -> str:
    if isinstance(kind, Lanes):
        return f"<{kind.count} x {'double' if kind.is_float else 'i64' if kind.is_word else 'i1'}>"
    return _TYPES[kind]


def _name(value: Value) -> str:
    name = value.name
    if isinstance(name, str):
        return f"%{name}"
    if isinstance(value.kind, Lanes):
        one = (
            f"double {literal(name)}" if isinstance(name, float) else f"{'i64' if value.kind.is_word else 'i1'} {name}"
        )
        return f"<{', '.join([one] * value.kind.count)}>"
    return literal(name) if isinstance(name, float) else str(name)


def _typed(value: Value) -> str:
    return f"{_type(value.kind)} {_name(value)}"
