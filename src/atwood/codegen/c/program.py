"""Programs as C99, with the signature that routines call; see `atwood.codegen.llvm.module`.

A long program is cut into functions that hand values on through the scratch array, since compilers take longer than in
proportion to the length of a function.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from atwood.codegen.c.printer import literal
from atwood.codegen.llvm.layout import Body, Layout, Unit, lay_out, main_body, matrix_key, prologue_body
from atwood.codegen.llvm.text import OWN_FUNCTIONS
from atwood.codegen.routines import own_name
from atwood.errors import UnsupportedError
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import Program

_LONGEST = 500
"""Operations in one function."""

_SIGNS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "less": "<", "less_equal": "<="}
_CHOICES = {"minimum": "<=", "maximum": ">="}
_FUNCTIONS = {one: own_name(one) for one in OWN_FUNCTIONS}
_FUNCTIONS |= {"sqrt": "sqrt", "floor": "floor", "absolute": "fabs"}


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
    try:
        main, first = _print(name, main_body(program))
        prologue, second = _print(f"{name}_values", prologue_body(program))
    except UnsupportedError as error:
        raise UnsupportedError(error.message, where=program.name) from None
    calls = f"""static void {name}_prologue(word *parameters, word *derived, word *scratch)
{{
word inputs[1], outputs[1];
inputs[0].p = parameters;
outputs[0].p = derived;
{name}_values(inputs, NULL, scratch, outputs);
}}
"""
    return "\n".join([main, prologue, calls]), max(first, second)


def _print(name: str, body: Body) -> tuple[str, int]:
    layout = lay_out(body, _LONGEST)
    systems = {matrix_key(unit[0]) for chunk in layout.chunks for unit in chunk if unit[0].operation == "solve"}
    regions, used = dict(layout.regions), layout.scratch
    for key in sorted(systems - set(regions)):
        size = round(len(key) ** 0.5)
        regions[key], used = used, used + size * (size + 2)
    places = {node.index: f"{pointer}[{k}].f" for pointer, nodes in body.given for k, node in enumerate(nodes)}
    places |= {index: f"scratch[{slot}].f" for index, slot in layout.slots.items()}
    targets: dict[int, list[str]] = {}
    results = {node.index: node for node, _, _ in body.results}
    for node, pointer, position in body.results:
        targets.setdefault(node.index, []).append(f"{pointer}[{position}].f")
    computed = {node.index for chunk in layout.chunks for unit in chunk for node in unit}
    passed = [node for index, node in results.items() if index not in computed]
    factorised: set[tuple[int, ...]] = set()
    parts = []
    for number, chunk in enumerate(layout.chunks):
        writer = _Writer(places, layout, regions, factorised)
        for unit in chunk:
            writer.unit(unit, targets)
        if number == len(layout.chunks) - 1:
            for node in passed:
                writer.store(node, targets[node.index])
        parts.append("\n".join([*writer.lines, f"return {writer.checked()};"]))
    given = {pointer for pointer, _ in body.given if pointer != "derived"}
    return _joined(name, parts, sorted(given | {one for _, one, _ in body.results})), used


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


class _Writer:
    """What has been written of one chunk of operations."""

    def __init__(
        self,
        places: dict[int, str],
        layout: Layout,
        regions: dict[tuple[int, ...], int],
        factorised: set[tuple[int, ...]],
    ) -> None:
        self.places, self.slots = places, layout.slots
        self.regions, self.factorised = regions, factorised
        self.lines: list[str] = []
        self.known: set[int] = set()
        self.sums: list[str] = []

    def unit(self, unit: Unit, targets: dict[int, list[str]]) -> None:
        """Write operations that stay together, and store what others need of them."""
        first = unit[0]
        is_wave = len(unit) == 2 and unit[1].operation != "component"
        if first.operation == "solve":
            self._solve(first, unit[1:])
        elif is_wave:
            self.lines.append(f"word w{first.index}[2];")
            argument = self._text(first.arguments[0])
            self.lines.append(f"own_sin_cos({argument}, w{first.index}, w{first.index} + 1);")
        for node in unit:
            if is_wave:
                self._keep(node, f"w{first.index}[{0 if node.operation == 'sin' else 1}].f")
            elif node.operation not in ("solve", "component"):
                self._keep(node, self._expression(node, [self._text(one) for one in node.arguments]))
            if node.index in self.slots:
                self.lines.append(f"scratch[{self.slots[node.index]}].f = v{node.index};")
            if node.index in targets and node.operation != "solve":
                self.store(node, targets[node.index])

    def store(self, node: Expression, targets: Sequence[str]) -> None:
        """Store a result, and take it into the sum that shows whether all are finite."""
        text = self._text(node)
        self.lines += [f"{one} = {text};" for one in targets]
        self.sums.append(text)

    def checked(self) -> str:
        """Return the sum of all results, which is finite only if they are."""
        return " + ".join(self.sums) or "0.0"

    def _keep(self, node: Expression, text: str) -> None:
        self.lines.append(f"const double v{node.index} = {text};")
        self.known.add(node.index)

    def _text(self, node: Expression) -> str:
        if node.operation == "constant":
            return literal(float(node.payload))
        if node.index not in self.known:
            self._keep(node, self.places[node.index])
        return f"v{node.index}"

    def _expression(self, node: Expression, parts: list[str]) -> str:
        operation = node.operation
        if operation in _SIGNS:
            return f"{parts[0]} {_SIGNS[operation]} {parts[1]}"
        if operation in _FUNCTIONS:
            return f"{_FUNCTIONS[operation]}({', '.join(parts)})"
        if operation in _CHOICES:
            return f"{parts[0]} {_CHOICES[operation]} {parts[1]} ? {parts[0]} : {parts[1]}"
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

    def _solve(self, node: Expression, unknowns: Sequence[Expression]) -> None:
        """Write a linear system; systems with the same matrix share its factors."""
        size, key = node.payload, matrix_key(node)
        start = self.regions[key]
        entries, right = node.arguments[: size * size], node.arguments[size * size :]
        pivots, side = start + size * size, start + size * (size + 1)
        if key not in self.factorised:
            self.factorised.add(key)
            texts = [self._text(one) for one in entries]
            self.lines += [f"scratch[{start + k}].f = {text};" for k, text in enumerate(texts)]
            self.lines.append(f"factorise({size}, scratch + {start}, scratch + {pivots});")
        texts = [self._text(one) for one in right]
        self.lines += [f"scratch[{side + k}].f = {text};" for k, text in enumerate(texts)]
        self.lines.append(f"substitute({size}, scratch + {start}, scratch + {pivots}, scratch + {side});")
        for one in unknowns:
            self._keep(one, f"scratch[{side + one.payload}].f")
