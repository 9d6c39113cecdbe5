"""A module in LLVM's language from programs: a function for each chunk, and one that calls them in turn.

Every function of a program has one signature in C::

    int kernel(const double *const *inputs, const double *derived, double *scratch, double *const *outputs);

with a pointer for each input and output group, and returns 1 if a result is not finite (or the results are so large
that their sum is not), else 0.  ``derived`` is what the program's second function computes once a run from the
parameters::

    void prologue(const double *parameters, double *derived, double *scratch);

No array may overlap another.  Nothing is kept between calls, so that many threads can call one function at once,
each with arrays of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from atwood.codegen.llvm.layout import (
    Body,
    LayoutOf,
    lay_out_in_loops,
    main_body,
    places_of,
    prologue_body,
    targets_of,
)
from atwood.codegen.llvm.linear_systems import Solver
from atwood.codegen.llvm.loops import Chunk, Loop, Unit, rows_of, units_of
from atwood.codegen.llvm.text import (
    ELIMINATION,
    INTRINSICS,
    OWN_FUNCTIONS,
    Needs,
    Position,
    Strided,
    Writer,
    number_type,
    spread,
)
from atwood.codegen.routines import own_name
from atwood.errors import UnsupportedError
from atwood.expr.core.graph import Expression
from atwood.expr.core.program import Program
from atwood.lazy_dataclasses import dataclass

_ARGUMENTS = (
    "ptr noalias readonly %inputs, ptr noalias readonly %derived, ptr noalias %scratch, ptr noalias readonly %outputs"
)
_STORES = 300
"""So many results that are inputs or constants are stored in one function: more, and LLVM takes far longer for them."""

_PASSED = "ptr %inputs, ptr %derived, ptr %scratch, ptr %outputs"


@dataclass(frozen=True)
class CodeOptions:
    """What the generated code depends on besides the program.

    Attributes
    ----------
    longest_chunk
        The number of operations in one function.
    least_in_loops
        With so many operations what repeats is written as loops: these run as fast only where straight code is so long
        that it has to be fetched from far.
    level
        How hard LLVM works on the machine code, from 0 to 3.
    runs
        How many runs are computed side by side: every number of every array is so many neighbouring numbers, one of
        each run, and what a function returns has a bit for each, from the lowest on.
    """

    longest_chunk: int = 150
    least_in_loops: int = 1_500
    level: int = 1
    runs: int = 1


@dataclass(frozen=True)
class ModuleText:
    """A module in LLVM's language.

    Attributes
    ----------
    text
        The module.
    scratch
        The length of the scratch array that suits all its functions.
    functions
        The elementary functions that it calls, by their names as operations, and the routines of `ELIMINATION`.
    has_loops
        Whether operations that repeat are written once.
    """

    text: str
    scratch: int
    functions: tuple[str, ...]
    has_loops: bool


@dataclass(frozen=True)
class Part:
    """One program of a module.

    Attributes
    ----------
    name
        Its functions are called ``name`` and ``name_prologue``.
    program
        What it computes.
    positions
        Where all results go in the arrays of their groups, if not one after the other.
    lanes
        So many neighbouring places of the groups in `packed` are stored at once, those without a result as zero, where
        one function computes all: whoever reads them at once need not wait until each has arrived in memory.
    packed
        The output groups for which this is wanted; their arrays are aligned and padded to it.
    """

    name: str
    program: Program
    positions: tuple[int, ...] | None = None
    lanes: int = 1
    packed: tuple[int, ...] = ()


def write_module(programs: Sequence[Part], options: CodeOptions) -> ModuleText:
    """Write the two functions of each program."""
    needs = Needs()
    parts: list[str] = []
    scratch, has_loops = 0, False
    for part in programs:
        name, program = part.name, part.program
        bodies = ((name, main_body(program, part.positions)), (f"{name}_values", prologue_body(program)))
        for function, body in bodies:
            layout = lay_out_in_loops(body, options.longest_chunk, options.least_in_loops)
            scratch = max(scratch, layout.scratch)
            has_loops |= any(isinstance(one, Loop) for one in layout.chunks)
            try:
                whole = part if function == name and len(layout.chunks) == 1 else None
                parts.extend(_write_function(function, body, layout, options, needs, whole))
            except UnsupportedError as error:
                raise UnsupportedError(error.message, where=program.name) from None
        parts.append(_write_prologue(name))
    parts.extend(_declarations(needs, options.runs))
    return ModuleText(
        "\n".join(parts),
        scratch * options.runs,
        tuple(sorted(needs.functions)),
        has_loops,
    )


def _write_function(
    name: str, body: Body, layout: LayoutOf[Chunk], options: CodeOptions, needs: Needs, whole: Part | None = None
) -> list[str]:
    """Write the chunks of a body, and the function that calls them; `whole` says how the only chunk stores results."""
    places: dict[int, tuple[str, Position]] = {**places_of(body)}
    places |= {index: ("scratch", slot) for index, slot in layout.slots.items()}
    targets = targets_of(body)
    held = frozenset(f"out{group}" for group in whole.packed) if whole is not None else frozenset()
    solver = Solver(layout.regions)
    parts: list[str] = []
    computed = {node.index for chunk in layout.chunks for unit in units_of(chunk) for node in unit}
    passed_on = [(node, pointer, at) for node, pointer, at in body.results if node.index not in computed]
    pieces = _pieces(passed_on, places) if len(passed_on) > _STORES else []
    chunks = layout.chunks if pieces or not isinstance(layout.chunks[-1], Loop) else (*layout.chunks, ())
    alone = len(chunks) == 1 and not pieces
    for number, chunk in enumerate(chunks):
        if isinstance(chunk, Loop):
            parts.append(_write_loop(f"{name}.{number}", chunk, places, targets, needs, options.runs))
            continue
        writer = Writer(places, needs, held if alone else frozenset(), options.runs)
        solver.start_chunk()
        for unit in chunk:
            _write_unit(writer, solver, unit)
            for node in unit:
                if node.index in layout.slots:
                    writer.store(writer.value(node), "scratch", layout.slots[node.index])
                if node.index in targets:
                    _write_result(writer, node, targets[node.index])
        if number == len(chunks) - 1 and not pieces:
            for node, pointer, at in passed_on:
                _write_result(writer, node, [(pointer, at)])
        if alone:
            if whole is not None:
                _pack(writer, whole.lanes)
            return [_as_function(name, writer)]
        parts.append(_as_chunk(f"{name}.{number}", writer))
    for piece in pieces:
        parts.append(_write_copies(f"{name}.{len(parts)}", piece, places, needs, options.runs))
    parts.append(_write_calls(name, len(parts), options.runs))
    return parts


def _write_loop(
    name: str,
    loop: Loop,
    places: Mapping[int, tuple[str, Position]],
    targets: Mapping[int, Sequence[tuple[str, int]]],
    needs: Needs,
    runs: int,
) -> str:
    """Write a loop as a function of its own: its first stretch, with places that move from stretch to stretch.

    What a stretch reads of the one before stays in a register.
    """
    made = {row[0].index: row for row in rows_of(loop)}
    before = {tuple(one.index for one in row[:-1]): row[0] for row in made.values()}
    writer = Writer({}, needs, frozenset(), runs)
    read: dict[int, tuple[str, Position]] = {}
    carried: list[tuple[str, str, Expression]] = []
    for first, *others in loop.read:
        made_before = before.get(tuple(one.index for one in others))
        if made_before is None:
            read[first.index] = _moving([places[one.index] for one in (first, *others)])
        else:
            name_of_it = f"%carried{len(carried)}"
            carried.append((name_of_it, writer.load(*places[first.index]), made_before))
            writer.values[first.index] = name_of_it
    start, writer.lines, writer.places = writer.lines, [], read
    solver = Solver({})
    for unit in loop.stretches[0]:
        _write_unit(writer, solver, unit)
        for node in unit:
            row = made[node.index]
            if node.index in places:
                writer.store(writer.value(node), *_moving([places[one.index] for one in row]))
            if node.index in targets:
                several = zip(*(targets[one.index] for one in row), strict=True)
                _write_result(writer, node, [_moving(one) for one in several])
    phis = [
        f"  {here} = phi {writer.kind} [ {first}, %entry ], [ {writer.value(node)}, %stretch ]"
        for here, first, node in carried
    ]
    return _as_loop(name, writer, len(loop.stretches), start, phis)


def _moving(places: Sequence[tuple[str, Position]]) -> tuple[str, Position]:
    """Return the array in which all of some places lie, and where."""
    return places[0][0], Strided(tuple(at for _, at in places if isinstance(at, int)))


Copy = tuple[Expression, str, int]
"""A value that is given or constant, and the place of an array to which it goes."""


def _pieces(copies: Sequence[Copy], places: Mapping[int, tuple[str, Position]]) -> list[list[Copy]]:
    """Return copies cut into pieces, each between two arrays or not too long."""
    pieces: list[list[Copy]] = []
    kind: object = None
    for node, pointer, at in copies:
        found = (places[node.index][0], pointer) if node.index in places else None
        if not pieces or found != kind or (kind is None and len(pieces[-1]) == _STORES):
            pieces.append([])
        pieces[-1].append((node, pointer, at))
        kind = found
    return pieces


def _write_copies(
    name: str, copies: Sequence[Copy], places: Mapping[int, tuple[str, Position]], needs: Needs, runs: int
) -> str:
    """Write copies as a function of its own: between two arrays as a loop."""
    first, pointer, _ = copies[0]
    if len(copies) > 1 and first.index in places:
        inside = {first.index: _moving([places[node.index] for node, _, _ in copies])}
        writer = Writer(inside, needs, frozenset(), runs)
        _write_result(writer, first, [(pointer, Strided(tuple(at for _, _, at in copies)))])
        return _as_loop(name, writer, len(copies))
    writer = Writer(places, needs, frozenset(), runs)
    for node, pointer, at in copies:
        _write_result(writer, node, [(pointer, at)])
    return _as_chunk(name, writer)


def _write_unit(writer: Writer, solver: Solver, unit: Unit) -> None:
    """Write operations that stay together."""
    node = unit[0]
    if node.operation == "solve":
        solver.write(writer, node, unit[1:])
    elif len(unit) == 2:
        sine, cosine = unit if node.operation == "sin" else (unit[1], node)
        writer.write_wave(sine, cosine)
    else:
        writer.write(node)


def _pointers(writer: Writer) -> list[str]:
    """Return the instructions that fetch the pointers that a chunk uses."""
    rooms = ["sine", "cosine"] if writer.waves else []
    rooms += ["given0", "given1"] if writer.calls else []
    lines = [f"  %{room} = alloca {writer.kind}" for room in rooms]
    for pointer in sorted(writer.pointers):
        for prefix, table in (("in", "inputs"), ("out", "outputs")):
            if pointer.startswith(prefix):
                place = f"%{pointer}.place"
                lines.append(f"  {place} = getelementptr ptr, ptr %{table}, i64 {pointer.removeprefix(prefix)}")
                lines.append(f"  %{pointer} = load ptr, ptr {place}, !invariant.load !0")
    return lines


def _write_result(writer: Writer, node: Expression, targets: Sequence[tuple[str, Position]]) -> None:
    value = writer.value(node)
    for pointer, position in targets:
        writer.store(value, pointer, position)
    writer.check(value)


def _pack(writer: Writer, lanes: int) -> None:
    """Store what was held back, neighbouring results at once."""
    kind = f"<{lanes} x double>"
    vectors: dict[tuple[str, int], dict[int, str]] = {}
    for value, pointer, position in writer.kept:
        assert isinstance(position, int)  # no loop is held back
        vectors.setdefault((pointer, position // lanes), {})[position % lanes] = value
    for (pointer, block), values in vectors.items():
        vector = "zeroinitializer"
        for lane, value in sorted(values.items()):
            vector = writer.put(f"insertelement {kind} {vector}, double {value}, i32 {lane}")
        address = writer.address(pointer, block * lanes)
        writer.lines.append(f"  store {kind} {vector}, ptr {address}, align {8 * lanes}")


def _as_chunk(name: str, writer: Writer) -> str:
    """Return a chunk as a function of its own, which returns the sum of its results."""
    checked = writer.checked()
    start = [f"define internal {writer.kind} @{name}({_ARGUMENTS}) #0 {{", *_pointers(writer)]
    return "\n".join([*start, *writer.lines, f"  ret {writer.kind} {checked}", "}"])


def _as_loop(name: str, writer: Writer, count: int, start: Sequence[str] = (), phis: Sequence[str] = ()) -> str:
    """Return a chunk as a function that does it so many times, and returns the sum of all results."""
    kind, checked = writer.kind, writer.checked()
    lines = [f"define internal {kind} @{name}({_ARGUMENTS}) #0 {{", "entry:", *_pointers(writer), *start]
    lines += ["  br label %stretch", "stretch:", "  %k = phi i64 [ 0, %entry ], [ %next, %stretch ]", *phis]
    lines.append(f"  %before = phi {kind} [ {spread(0.0, writer.runs)}, %entry ], [ %after, %stretch ]")
    lines += [*writer.lines, f"  %after = fadd {kind} %before, {checked}", "  %next = add i64 %k, 1"]
    lines += [f"  %goes.on = icmp ult i64 %next, {count}", "  br i1 %goes.on, label %stretch, label %end"]
    return "\n".join([*lines, "end:", f"  ret {kind} %after", "}"])


def _as_function(name: str, writer: Writer) -> str:
    """Return the only chunk of a body as the whole function."""
    checked = writer.checked()
    start = [f"define i32 @{name}({_ARGUMENTS}) #0 {{", *_pointers(writer)]
    return "\n".join([*start, *writer.lines, *_ending(checked, writer.runs)])


def _ending(checked: str, runs: int) -> list[str]:
    """Return the end of a function: 1 if the sum of all results is not finite, a bit for each run."""
    kind, bits = number_type(runs), f"i{runs}"
    return [
        f"  %nothing = fsub {kind} {checked}, {checked}",
        f"  %undefined = fcmp une {kind} %nothing, {spread(0.0, runs)}",
        *([f"  %bits = bitcast <{runs} x i1> %undefined to {bits}"] if runs > 1 else []),
        f"  %code = zext {bits} %{'bits' if runs > 1 else 'undefined'} to i32",
        "  ret i32 %code",
        "}",
    ]


def _write_calls(name: str, count: int, runs: int) -> str:
    """Write the function that calls all chunks of a body."""
    lines = [f"define i32 @{name}({_ARGUMENTS}) #0 {{"]
    kind, total = number_type(runs), spread(0.0, runs)
    for k in range(count):
        lines.append(f"  %c{k} = call {kind} @{name}.{k}({_PASSED})")
        lines.append(f"  %s{k} = fadd {kind} {total}, %c{k}")
        total = f"%s{k}"
    return "\n".join([*lines, *_ending(total, runs)])


def _write_prologue(name: str) -> str:
    """Write the function that computes what depends on parameters alone."""
    return f"""define void @{name}_prologue(ptr noalias %parameters, ptr noalias %derived, ptr noalias %scratch) #0 {{
  %inputs = alloca ptr
  %outputs = alloca ptr
  store ptr %parameters, ptr %inputs
  store ptr %derived, ptr %outputs
  %code = call i32 @{name}_values(ptr %inputs, ptr null, ptr %scratch, ptr %outputs)
  ret void
}}"""


def stub_text(names: Sequence[str]) -> str:
    """Return the functions of programs that are tapes: the evaluator is called with ``tape.name``."""
    lines = ["declare i32 @evaluate(ptr, ptr, ptr, ptr, ptr)"]
    for name in names:
        for one in (name, f"{name}_values"):
            lines.append(f"@tape.{one} = external global i8")
            lines.append(f"define i32 @{one}({_ARGUMENTS}) #0 {{")
            lines.append(f"  %code = call i32 @evaluate(ptr @tape.{one}, {_PASSED})\n  ret i32 %code\n}}")
        lines.append(_write_prologue(name))
    return "\n".join(lines)


def _declarations(needs: Needs, runs: int) -> list[str]:
    """Return the declarations of what the module calls."""
    lines = [f"declare double @llvm.{name}.f64(double)" for name in INTRINSICS.values()]
    if runs > 1:
        kind = number_type(runs)
        lines += [f"declare {kind} @llvm.{name}.v{runs}f64({kind})" for name in INTRINSICS.values()]
    for name in sorted(needs.functions):
        if runs > 1:
            plain = name.removesuffix(f"_{runs}")
            places = 3 if plain == "sin_cos" else OWN_FUNCTIONS[plain] + 1
            lines.append(f"declare void @{own_name(name)}({', '.join(['ptr'] * places)}) #0")
            continue
        kind, given = ("void", "double, ptr, ptr") if name == "sin_cos" else ("double", "")
        kind, given = ("void", ELIMINATION[name]) if name in ELIMINATION else (kind, given)
        given = given or ", ".join(["double"] * OWN_FUNCTIONS[name])
        lines.append(f"declare {kind} @{own_name(name)}({given}) #0")
    for entries, name in needs.tables.items():
        numbers = ", ".join(f"i32 {one}" for one in entries)
        lines.append(f"{name} = internal constant [{len(entries)} x i32] [{numbers}]")
    return [*lines, "attributes #0 = { nounwind }", "!0 = !{}"]
