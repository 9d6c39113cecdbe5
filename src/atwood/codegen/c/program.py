"""Programs as C99, with the signature that routines call; see `atwood.codegen.llvm.module`.

A long program is cut into functions that hand values on through the scratch array, since compilers take longer than in
proportion to the length of a function.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

from atwood.codegen.c.printer import literal
from atwood.codegen.chunks import CHOICES, FUNCTIONS, ChunkWriter, print_bodies, write_chunks, write_places
from atwood.codegen.llvm.layout import Body, main_body, prologue_body
from atwood.codegen.llvm.text import OWN_FUNCTIONS
from atwood.errors import UnsupportedError
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import Program

_SIGNS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "less": "<", "less_equal": "<="}
_FUNCTIONS = FUNCTIONS | {"sqrt": "sqrt", "floor": "floor", "absolute": "fabs"}


def functions_of(programs: Iterable[Program]) -> list[str]:
    """Return the elementary functions that programs call, as `atwood.codegen.functions.write_routines` takes them."""
    used = {node.operation for program in programs for node in program.nodes} & set(OWN_FUNCTIONS)
    waves = used & {"sin", "cos"}
    return sorted(used | ({"sin_cos"} if waves else set()))


def print_program(name: str, program: Program) -> tuple[str, int]:
    """Return the two functions of a program, ``name`` and ``name_prologue``, and the scratch that they need.

    Raises
    ------
    UnsupportedError
        If the program calls functions in Python.
    """
    texts, scratch = print_bodies(program, _print, name, (main_body(program), prologue_body(program)))
    calls = f"""static void {name}_prologue(word *parameters, word *derived, word *scratch)
{{
word inputs[1], outputs[1];
inputs[0].p = parameters;
outputs[0].p = derived;
{name}_values(inputs, NULL, scratch, outputs);
}}
"""
    return "\n".join([*texts, calls]), scratch


def _print(name: str, body: Body) -> tuple[str, int]:
    places = write_places(body, lambda pointer, k: f"{pointer}[{k}].f")
    written = write_chunks(places, partial(_Writer, places))
    parts = ["\n".join([*one.lines, f"return {' + '.join(one.sums) or '0.0'};"]) for one in written]
    return _joined(name, parts, places.pointers), places.scratch


def _joined(name: str, parts: Sequence[str], pointers: Sequence[str]) -> str:
    """Return the functions of the parts of a program, and the one that calls them."""
    names = ["derived", "scratch", *pointers]
    arguments = ", ".join(f"word *{one}" for one in names)
    unused = " ".join(f"(void){one};" for one in names)
    functions = [f"static double {name}_{k}({arguments})\n{{\n{unused}\n{part}\n}}\n" for k, part in enumerate(parts)]
    given = {one: f"{'inputs' if one.startswith('in') else 'outputs'}[{one.lstrip('inout')}].p" for one in pointers}
    handed = ", ".join(given.get(one, one) for one in names)
    # A part reads what those before it left.
    lines = ["double sum = 0.0;", *(f"sum += {name}_{k}({handed});" for k in range(len(parts)))]
    head = f"static int32_t {name}(word *inputs, word *derived, word *scratch, word *outputs)"
    body = "\n".join([*lines, "(void)inputs;", "(void)outputs;", "return sum - sum == 0.0 ? 0 : 1;"])
    return "\n".join([*functions, f"{head}\n{{\n{body}\n}}\n"])


class _Writer(ChunkWriter):
    """What has been written of one chunk of operations; every value has a name."""

    declares = "const double"

    def cell(self, place: int) -> str:
        return f"scratch[{place}].f"

    def waves(self, argument: Expression) -> dict[str, str]:
        name = f"w{len(self.lines)}"
        text = self.value(argument)
        self.lines += [f"word {name}[2];", f"own_sin_cos({text}, {name}, {name} + 1);"]
        return {"sin": f"{name}[0].f", "cos": f"{name}[1].f"}

    def node(self, node: Expression) -> None:
        self.keep(node, self._expression(node, [self.value(one) for one in node.arguments]))

    def value(self, node: Expression) -> str:
        if node.operation == "constant":
            return literal(float(node.payload))
        if node.index not in self.texts:
            self.keep(node, self.places.known[node.index])
        return f"v{node.index}"

    def _expression(self, node: Expression, parts: list[str]) -> str:
        operation = node.operation
        if operation in _SIGNS:
            return f"{parts[0]} {_SIGNS[operation]} {parts[1]}"
        if operation in _FUNCTIONS:
            return f"{_FUNCTIONS[operation]}({', '.join(parts)})"
        if operation in CHOICES:
            return f"{parts[0]} {CHOICES[operation]} {parts[1]} ? {parts[0]} : {parts[1]}"
        match operation:
            case "neg":
                return f"-{parts[0]}"
            case "sign":
                return f"{parts[0]} > 0.0 ? 1.0 : {parts[0]} < 0.0 ? -1.0 : {parts[0]} * 0.0"
            case "select":
                return f"{parts[0]} != 0.0 ? {parts[1]} : {parts[2]}"
            case "logical_and" | "logical_or":
                return f"{parts[0]} != 0.0 {'&&' if operation == 'logical_and' else '||'} {parts[1]} != 0.0"
            case "logical_not":
                return f"{parts[0]} == 0.0"
        raise UnsupportedError(f"there is no C for the operation {operation} in {node!r}")
