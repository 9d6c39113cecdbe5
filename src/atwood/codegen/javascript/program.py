"""Programs as JavaScript, with the signature that routines call; see `atwood.codegen.llvm.module`.

A long program is cut into functions that hand values on through the scratch array, since browsers compile no long
function well.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial

from atwood.codegen.chunks import ChunkWriter, print_bodies, write_chunks, write_places
from atwood.codegen.functions import write_routines
from atwood.codegen.javascript.printer import literal, print_routines
from atwood.codegen.llvm.layout import Body, main_body, prologue_body
from atwood.codegen.llvm.text import OWN_FUNCTIONS
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import Program

_WAVES = """const own_sin = x => { own_sin_cos(x, M[0], M[0] + 1); return M[M[0]]; };
const own_cos = x => { own_sin_cos(x, M[0], M[0] + 1); return M[M[0] + 1]; };
"""


def print_functions(programs: Iterable[Program]) -> str:
    """Return the elementary functions that programs call."""
    used = {node.operation for program in programs for node in program.nodes} & set(OWN_FUNCTIONS)
    has_waves = not used.isdisjoint(("sin", "cos"))
    names = sorted(used - {"sin", "cos"} | ({"sin_cos"} if has_waves else set()))
    return f"{print_routines(write_routines(names, each=False))}\n{_WAVES if has_waves else ''}"


def print_program(name: str, program: Program) -> tuple[str, int]:
    """Return the two functions of a program, ``name`` and ``name_prologue``, and the scratch that they need.

    Raises
    ------
    UnsupportedError
        If the program calls functions in Python.
    """
    texts, scratch = print_bodies(program, _print, name, (main_body(program), prologue_body(program)))
    calls = f"""function {name}_prologue(parameters, derived, scratch) {{
const top = M[0]; M[0] = top + 2; M[top] = parameters; M[top + 1] = derived;
{name}_values(top, 0, scratch, top + 1);
M[0] = top;
}}"""
    return "\n".join([*texts, calls]), scratch


def _print(name: str, body: Body) -> tuple[str, int]:
    places = write_places(body, lambda pointer, k: f"M[{pointer} + {k}]")
    written = write_chunks(places, partial(_Writer, places))
    alone, checks = len(written) == 1, not name.endswith("_values")
    arguments = ", ".join(["derived", "scratch", *places.pointers])
    functions = [
        (f"{name}_{k}", "\n".join([*one.lines, f"return {' + '.join(one.sums if checks else []) or '0'};"]))
        for k, one in enumerate(written)
    ]
    heads = [
        f"const {one} = M[{'inputs' if one.startswith('in') else 'outputs'} + {one.lstrip('inout')}];"
        for one in places.pointers
    ]
    text = [] if alone else [f"function {one}({arguments}) {{\n{lines}\n}}" for one, lines in functions]
    calls = " + ".join(f"{one}({arguments})" for one, _ in functions)
    inside = functions[0][1].rpartition("return ") if alone else ("", "", f"{calls};")
    ending = f"{inside[0]}const sum = {inside[2]}\nreturn sum - sum === 0 ? 0 : 1;"
    return "\n".join(
        [*text, f"function {name}(inputs, derived, scratch, outputs) {{", *heads, f"{ending}\n}}"]
    ), places.scratch


class _Writer(ChunkWriter):
    """What has been written of one chunk of operations."""

    language, declares, differs, bits = "JavaScript", "const", "!==", ("1", "0")
    functions: Mapping[str, str] = {"sqrt": "Math.sqrt", "floor": "Math.floor", "absolute": "Math.abs"}

    def literal(self, value: float) -> str:
        return literal(value)

    def cell(self, place: int) -> str:
        return f"M[scratch + {place}]"

    def waves(self, argument: Expression) -> dict[str, str]:
        self.lines.append(f"own_sin_cos({self.value(argument)}, M[0], M[0] + 1);")
        return {"sin": "M[M[0]]", "cos": "M[M[0] + 1]"}
