"""Programs as C99, with the signature that routines call; see `atwood.codegen.llvm.module`.

A long program is cut into functions that hand values on through the scratch array, since compilers take longer than in
proportion to the length of a function.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial

from atwood.codegen.c.printer import literal
from atwood.codegen.chunks import ChunkWriter, print_bodies, write_chunks, write_places
from atwood.codegen.llvm.layout import Body, main_body, prologue_body
from atwood.codegen.llvm.text import OWN_FUNCTIONS
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import Program


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
    """What has been written of one chunk of operations."""

    language, declares, differs, bits = "C", "const double", "!=", ("1.0", "0.0")
    functions: Mapping[str, str] = {"sqrt": "sqrt", "floor": "floor", "absolute": "fabs"}

    def literal(self, value: float) -> str:
        return literal(value)

    def cell(self, place: int) -> str:
        return f"scratch[{place}].f"

    def waves(self, argument: Expression) -> dict[str, str]:
        name = f"w{len(self.lines)}"
        text = self.value(argument)
        self.lines += [f"word {name}[2];", f"own_sin_cos({text}, {name}, {name} + 1);"]
        return {"sin": f"{name}[0].f", "cos": f"{name}[1].f"}
