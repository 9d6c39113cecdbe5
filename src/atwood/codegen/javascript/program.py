"""Programs as JavaScript, with the signature that routines call; see `atwood.codegen.llvm.module`.

A long program is cut into functions that hand values on through the scratch array, since browsers compile no long
function well. What is used once stands where it is used.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from atwood.codegen.functions import write_routines
from atwood.codegen.javascript.printer import literal, print_routines
from atwood.codegen.llvm.layout import Body, Layout, Unit, lay_out, main_body, matrix_key, prologue_body
from atwood.codegen.llvm.text import OWN_FUNCTIONS
from atwood.codegen.routines import own_name
from atwood.errors import UnsupportedError
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import Program

_LONGEST = 500
"""Operations in one function."""

_LARGEST_INLINE = 24
"""Operations in one expression."""

_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
_COMPARED = {"less": "<", "less_equal": "<="}
_LOGICAL = {"logical_and": "&&", "logical_or": "||"}
_CHOICES = {"minimum": "<=", "maximum": ">="}
_CONDITIONS = frozenset({*_COMPARED, *_LOGICAL, "logical_not"})
_FUNCTIONS = {one: own_name(one) for one in OWN_FUNCTIONS}
_FUNCTIONS |= {"sqrt": "Math.sqrt", "floor": "Math.floor", "absolute": "Math.abs"}
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
    try:
        main, first = _print(name, main_body(program), True)
        prologue, second = _print(f"{name}_values", prologue_body(program), False)
    except UnsupportedError as error:
        raise UnsupportedError(error.message, where=program.name) from None
    calls = f"""function {name}_prologue(parameters, derived, scratch) {{
const top = M[0]; M[0] = top + 2; M[top] = parameters; M[top + 1] = derived;
{name}_values(top, 0, scratch, top + 1);
M[0] = top;
}}"""
    return "\n".join([main, prologue, calls]), max(first, second)


def _print(name: str, body: Body, checks: bool) -> tuple[str, int]:
    layout = lay_out(body, _LONGEST)
    systems = {matrix_key(unit[0]) for chunk in layout.chunks for unit in chunk if unit[0].operation == "solve"}
    regions, used = dict(layout.regions), layout.scratch
    for key in sorted(systems - set(regions)):
        size = round(len(key) ** 0.5)
        regions[key], used = used, used + size * (size + 2)
    places = {node.index: f"M[{pointer} + {k}]" for pointer, nodes in body.given for k, node in enumerate(nodes)}
    places |= {index: f"M[scratch + {slot}]" for index, slot in layout.slots.items()}
    targets: dict[int, list[str]] = {}
    results = {node.index: node for node, _, _ in body.results}
    for node, pointer, position in body.results:
        targets.setdefault(node.index, []).append(f"M[{pointer} + {position}]")
    computed = {node.index for chunk in layout.chunks for unit in chunk for node in unit}
    passed = [node for index, node in results.items() if index not in computed]
    pointers = sorted(
        {pointer for pointer, _ in body.given if pointer != "derived"} | {one for _, one, _ in body.results}
    )
    factorised: set[tuple[int, ...]] = set()
    functions, alone = [], len(layout.chunks) == 1
    arguments = ", ".join(["derived", "scratch", *pointers])
    for number, chunk in enumerate(layout.chunks):
        writer = _Writer(places, layout, results, chunk, regions, factorised)
        for unit in chunk:
            writer.unit(unit, targets)
        if number == len(layout.chunks) - 1:
            for node in passed:
                writer.store(node, targets[node.index])
        functions.append(
            (f"{name}_{number}", "\n".join([*writer.lines, f"return {writer.checked() if checks else 0};"]))
        )
    heads = [
        f"const {one} = M[{'inputs' if one.startswith('in') else 'outputs'} + {one.lstrip('inout')}];"
        for one in pointers
    ]
    text = [] if alone else [f"function {one}({arguments}) {{\n{lines}\n}}" for one, lines in functions]
    calls = " + ".join(f"{one}({arguments})" for one, _ in functions)
    inside = functions[0][1].rpartition("return ") if alone else ("", "", f"{calls};")
    ending = f"{inside[0]}const sum = {inside[2]}\nreturn sum - sum === 0 ? 0 : 1;"
    return "\n".join([*text, f"function {name}(inputs, derived, scratch, outputs) {{", *heads, f"{ending}\n}}"]), used


class _Writer:
    """What has been written of one chunk of operations."""

    def __init__(
        self,
        places: dict[int, str],
        layout: Layout,
        results: dict[int, Expression],
        chunk: Sequence[Unit],
        regions: dict[tuple[int, ...], int],
        factorised: set[tuple[int, ...]],
    ) -> None:
        self.places, self.slots, self.results = places, layout.slots, results
        self.regions, self.factorised = regions, factorised
        self.lines: list[str] = []
        self.texts: dict[int, tuple[str, int]] = {}
        self.sums: list[str] = []
        own = [node for unit in chunk for node in unit]
        self.uses = Counter(one.index for node in own if node.operation != "component" for one in node.arguments)
        twice = (one.index for node in own if node.operation in _TWICE for one in node.arguments)
        self.uses.update(twice)

    def unit(self, unit: Unit, targets: dict[int, list[str]]) -> None:
        """Write operations that stay together, and store what others need of them."""
        if unit[0].operation == "solve":
            self._solve(unit[0], unit[1:])
        is_wave = len(unit) == 2 and unit[1].operation != "component"
        if is_wave:
            self.lines.append(f"own_sin_cos({self._text(unit[0].arguments[0])[0]}, M[0], M[0] + 1);")
        for node in unit:
            if is_wave:
                place = "M[M[0]]" if node.operation == "sin" else "M[M[0] + 1]"
                self.lines.append(f"const v{node.index} = {place};")
                self.texts[node.index] = f"v{node.index}", 0
            elif node.operation not in ("solve", "component"):
                self._node(node)
            if node.index in self.slots:
                self.lines.append(f"M[scratch + {self.slots[node.index]}] = {self._name(node)};")
            if node.index in self.results:
                self.store(node, targets[node.index])

    def store(self, node: Expression, targets: Sequence[str]) -> None:
        """Store a result, and take it into the sum that shows whether all are finite."""
        text = self._name(node)
        self.lines += [f"{one} = {text};" for one in targets]
        self.sums.append(text)

    def checked(self) -> str:
        """Return the sum of all results, which is finite only if they are."""
        return " + ".join(self.sums) or "0"

    def _name(self, node: Expression) -> str:
        """Return a name, a number or a place for a value."""
        text, size = self._text(node)
        if size:
            name = f"v{node.index}"
            self.lines.append(f"const {name} = {text};")
            self.texts[node.index] = name, 0
            return name
        return text

    def _text(self, node: Expression) -> tuple[str, int]:
        found = self.texts.get(node.index)
        if found is None:
            if node.operation == "constant":
                found = literal(node.payload), 0
            elif self.uses[node.index] > 1:
                self.lines.append(f"const v{node.index} = {self.places[node.index]};")
                found = f"v{node.index}", 0
            else:
                found = self.places[node.index], 0
            self.texts[node.index] = found
        return found

    def _node(self, node: Expression) -> None:
        size = 1 + sum(self._text(one)[1] for one in node.arguments)
        parts = [self._text(one)[0] for one in node.arguments]
        self.texts[node.index] = self._expression(node, parts), size
        if self.uses[node.index] != 1 or size > _LARGEST_INLINE:
            self._name(node)

    def _expression(self, node: Expression, parts: list[str]) -> str:
        operation = node.operation
        if operation in _INFIX:
            return f"({parts[0]} {_INFIX[operation]} {parts[1]})"
        if operation == "neg":
            return f"(-{parts[0]})"
        if operation in _FUNCTIONS:
            return f"{_FUNCTIONS[operation]}({', '.join(parts)})"
        if operation in _CHOICES:
            return f"({parts[0]} {_CHOICES[operation]} {parts[1]} ? {parts[0]} : {parts[1]})"
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

    def _solve(self, node: Expression, unknowns: Sequence[Expression]) -> None:
        """Write a linear system; systems with the same matrix share its factors."""
        size, key = node.payload, matrix_key(node)
        start = self.regions[key]
        entries, right = node.arguments[: size * size], node.arguments[size * size :]
        pivots, side = start + size * size, start + size * (size + 1)
        if key not in self.factorised:
            self.factorised.add(key)
            self.lines += [f"M[scratch + {start + k}] = {self._text(one)[0]};" for k, one in enumerate(entries)]
            self.lines.append(f"factorise({size}, scratch + {start}, scratch + {pivots});")
        self.lines += [f"M[scratch + {side + k}] = {self._text(one)[0]};" for k, one in enumerate(right)]
        self.lines.append(f"substitute({size}, scratch + {start}, scratch + {pivots}, scratch + {side});")
        for one in unknowns:
            self.lines.append(f"const v{one.index} = M[scratch + {side + one.payload}];")
            self.texts[one.index] = f"v{one.index}", 0
