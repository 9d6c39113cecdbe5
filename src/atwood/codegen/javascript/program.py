"""Programs as JavaScript, with the signature that routines call; see `atwood.codegen.llvm.module`.

A long program is cut into functions that hand values on through the scratch array, since browsers compile no long
function well. What is used once stands where it is used.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial

from atwood.codegen.chunks import CHOICES, FUNCTIONS, ChunkWriter, Places, print_bodies, write_chunks, write_places
from atwood.codegen.functions import write_routines
from atwood.codegen.javascript.printer import literal, print_routines
from atwood.codegen.llvm.layout import Body, MatrixKey, Unit, main_body, prologue_body
from atwood.codegen.llvm.text import OWN_FUNCTIONS
from atwood.errors import UnsupportedError
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import Program

_LARGEST_INLINE = 24
"""Operations in one expression."""

_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
_COMPARED = {"less": "<", "less_equal": "<="}
_LOGICAL = {"logical_and": "&&", "logical_or": "||"}
_CONDITIONS = frozenset({*_COMPARED, *_LOGICAL, "logical_not"})
_FUNCTIONS = FUNCTIONS | {"sqrt": "Math.sqrt", "floor": "Math.floor", "absolute": "Math.abs"}
_TWICE = frozenset({"minimum", "maximum", "sign"})
"""What mentions its arguments more than once."""

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
    """What has been written of one chunk of operations; what is used once stands where it is used."""

    declares = "const"

    def __init__(self, places: Places, chunk: Sequence[Unit], factorised: set[MatrixKey]) -> None:
        super().__init__(places, chunk, factorised)
        own = [node for unit in chunk for node in unit]
        self.uses = Counter(one.index for node in own if node.operation != "component" for one in node.arguments)
        twice = (one.index for node in own if node.operation in _TWICE for one in node.arguments)
        self.uses.update(twice)

    def cell(self, place: int) -> str:
        return f"M[scratch + {place}]"

    def waves(self, argument: Expression) -> dict[str, str]:
        self.lines.append(f"own_sin_cos({self.value(argument)}, M[0], M[0] + 1);")
        return {"sin": "M[M[0]]", "cos": "M[M[0] + 1]"}

    def value(self, node: Expression) -> str:
        return self._text(node)[0]

    def _text(self, node: Expression) -> tuple[str, int]:
        found = self.texts.get(node.index)
        if found is None:
            if node.operation == "constant":
                found = literal(node.payload), 0
            else:
                found = self.places.known[node.index], 0
                if self.uses[node.index] > 1:
                    self.keep(node, found[0])
                    return self.texts[node.index]
            self.texts[node.index] = found
        return found

    def node(self, node: Expression) -> None:
        size = 1 + sum(self._text(one)[1] for one in node.arguments)
        parts = [self._text(one)[0] for one in node.arguments]
        self.texts[node.index] = self._expression(node, parts), size
        if self.uses[node.index] != 1 or size > _LARGEST_INLINE:
            self.name(node)

    def _expression(self, node: Expression, parts: list[str]) -> str:
        operation = node.operation
        if operation in _INFIX:
            return f"({parts[0]} {_INFIX[operation]} {parts[1]})"
        if operation == "neg":
            return f"(-{parts[0]})"
        if operation in _FUNCTIONS:
            return f"{_FUNCTIONS[operation]}({', '.join(parts)})"
        if operation in CHOICES:
            return f"({parts[0]} {CHOICES[operation]} {parts[1]} ? {parts[0]} : {parts[1]})"
        if operation == "sign":
            return f"({parts[0]} > 0 ? 1 : {parts[0]} < 0 ? -1 : {parts[0]} * 0)"
        if operation == "select":
            return f"({self._truth(node.arguments[0])} ? {parts[1]} : {parts[2]})"
        if operation in _CONDITIONS:
            return f"({self._compared(node)} ? 1 : 0)"
        raise UnsupportedError(f"there is no JavaScript for the operation {operation} in {node!r}")

    def _truth(self, node: Expression) -> str:
        text, size = self._text(node)
        return self._compared(node) if size and node.operation in _CONDITIONS else f"({text} !== 0)"

    def _compared(self, node: Expression) -> str:
        if node.operation in _COMPARED:
            a, b = (self._text(one)[0] for one in node.arguments)
            return f"({a} {_COMPARED[node.operation]} {b})"
        found = [self._truth(one) for one in node.arguments]
        if node.operation == "logical_not":
            return f"(!{found[0]})"
        return f"({found[0]} {_LOGICAL[node.operation]} {found[1]})"
