"""Programs and routines as JavaScript: what they give is what Python's kernels and machine code give, to the bit."""

from __future__ import annotations

import itertools
import math
import random
import struct
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from atwood import expr as ex
from atwood.codegen import compile_native
from atwood.codegen.javascript.printer import BITS, print_routines
from atwood.codegen.javascript.program import print_functions, print_program
from atwood.codegen.llvm.linear_systems import write_elimination
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, BOOLEAN, INTEGER, NUMBER, Lanes, Routine, Value, addresses
from atwood.errors import UnsupportedError
from atwood.expr.core.algebra import build
from atwood.expr.core.operations import BINARY, UNARY

from ..helpers.node import run_node
from .test_routines import compiled

CORNERS = (0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 3.0, 1e-310, -7e300, 1e17, math.pi, math.inf, -math.inf, math.nan)
MEMORY = "const M = new Float64Array(200000), F = [null];\nM[0] = 1;\n"


def number(text: str) -> float:
    return float(struct.unpack(">d", bytes.fromhex(text))[0])


def same(a: float, b: float, units: int = 0) -> bool:
    """Tell whether two numbers have the same bits, nan apart, or differ by so many units in the last place."""
    if a == b or (a != a and b != b):
        return math.copysign(1.0, a) == math.copysign(1.0, b) or a != a or units > 0
    return units > 0 and abs(a - b) <= units * math.ulp(max(abs(a), abs(b)))


def evaluated(programs: Sequence[ex.Program], samples: Sequence[Sequence[Sequence[float]]]) -> list[list[list[float]]]:
    """Return all results of programs at samples: parameters, then the input groups one after the other."""
    calls = []
    for k, program in enumerate(programs):
        text, scratch = print_program(f"p{k}", program)
        groups = [len(one.symbols) for one in program.inputs]
        counts = [len(one.expressions) for one in program.outputs]
        shape = [len(program.parameters), len(program.prologue), scratch, groups, counts]
        calls.append(f"{text}\nresults.push(tried(p{k}, p{k}_prologue, {shape}, given[{k}]));")
    harness = """
    const results = [];
    function tried(f, prologue, [parameters, derived, scratch, groups, counts], samples) {
      return samples.map(sample => {
        let end = 4000;
        const room = n => { const at = end; end += n; return at; };
        const own = room(parameters), known = room(derived), free = room(scratch), tables = room(20);
        const inputs = groups.map(room), outputs = counts.map(room);
        const numbers = sample.map(ofBits);
        M.set(numbers.slice(0, parameters), own);
        let from = parameters;
        inputs.forEach((at, k) => { M.set(numbers.slice(from, from += groups[k]), at); M[tables + k] = at; });
        outputs.forEach((at, k) => { M[tables + 10 + k] = at; });
        prologue(own, known, free);
        f(tables, known, free, tables + 10);
        return outputs.flatMap((at, k) => Array.from(M.slice(at, at + counts[k]), asBits));
      });
    }
    """
    code = MEMORY + BITS + print_functions(programs) + print_routines(write_elimination()) + harness + "\n".join(calls)
    given = [[[struct.pack(">d", x).hex() for x in one] for one in each] for each in samples]
    found = run_node(code + "\nprint(results);", given)
    return [[[number(one) for one in row] for row in rows] for rows in found]


def test_every_operation_on_corner_cases() -> None:
    programs, samples, names = [], [], []
    pairs = list(itertools.product(CORNERS, CORNERS))
    for name, function in {**UNARY, **BINARY}.items():
        graph = ex.Graph()
        a, b = graph.symbol("a"), graph.symbol("b")
        made = build(graph, name, (a, b))
        programs.append(ex.Program(name, (ex.InputGroup("x", (a, b)),), (), (ex.OutputGroup("y", (made,)),)))
        samples.append(pairs)
        names.append((name, function))
    graph = ex.Graph()
    a, b = graph.symbol("a"), graph.symbol("b")
    chosen = ex.select((a < b) | ~(b <= a), a, b * 2.0)
    programs.append(ex.Program("select", (ex.InputGroup("x", (a, b)),), (), (ex.OutputGroup("y", (chosen,)),)))
    samples.append(pairs)
    names.append(("select", lambda a, b: a if a < b or not b <= a else b * 2.0))
    for (name, function), rows in zip(names, evaluated(programs, samples), strict=True):
        for (x, y), [found] in zip(pairs, rows, strict=True):
            expected = function(x, y) if name in BINARY or name == "select" else function(x)
            if name == "floor" and expected == 0.0:  # machine code keeps the sign of zero, as C does
                assert found == 0.0
                continue
            assert same(found, expected), (name, x, y, found, expected)


FIVE = range(5)
STEPS: tuple[Callable[[ex.Expression, ex.Expression, ex.Expression], ex.Expression], ...] = (
    lambda a, b, c: a + b,
    lambda a, b, c: a - b,
    lambda a, b, c: a * b,
    lambda a, b, c: a / (1.5 + b * b),
    lambda a, b, c: ex.sqrt(ex.absolute(a)),
    lambda a, b, c: ex.minimum(a, b) * ex.sign(c),
    lambda a, b, c: ex.maximum(a, ex.floor(b)) * 0.25,
    lambda a, b, c: ex.select((a < b) & (c <= 1.0), a, c),
    lambda a, b, c: -a * 0.5,
    lambda a, b, c: sum(
        ex.solve([[6.0 if i == j else a * i + b * j for j in range(5)] for i in range(5)], [a, b, c, 1.0, 0.0])
    ),
)


def recipe(chance: random.Random, length: int) -> ex.Program:
    graph = ex.Graph()
    x, y, p, q = (graph.symbol(one) for one in "xypq")
    pool = [x, y, p, q, graph.constant(-1.5), graph.constant(3.0)]
    for _ in range(length):
        given = (chance.choice(pool[-12:] if chance.random() < 0.7 else pool) for _ in range(3))
        made = chance.choice(STEPS)(*given)
        pool.append(made * 0.5 if chance.random() < 0.3 else made)
    groups = (ex.InputGroup("x", (x, y)), ex.InputGroup("none", ()))
    outputs = (ex.OutputGroup("first", tuple(pool[-5:])), ex.OutputGroup("second", (x, p, pool[4], pool[-1])))
    return ex.Program("random", groups, (p, q), outputs)


def test_random_programs_have_the_bits_of_machine_code() -> None:

    chance = random.Random(5)
    programs = [recipe(chance, length) for length in (*range(1, 40, 3), 400, 2500)]
    samples = [[[chance.uniform(-2.0, 2.0) for _ in range(4)] for _ in range(5)] for _ in programs]
    for program, points, rows in zip(programs, samples, evaluated(programs, samples), strict=True):
        plain = compile_native(program, options=CodeOptions())
        for point, row in zip(points, rows, strict=True):
            expected = np.concatenate(plain.bind(point[:2])(point[2:], ()))
            assert all(map(same, row, expected.tolist())), program.size


def test_functions_in_python_are_refused() -> None:
    graph = ex.Graph()
    a = graph.symbol("a")
    outside = ex.external(ex.ExternalFunction("outside", abs), a)
    program = ex.Program("demo", (ex.InputGroup("x", (a,)),), (), (ex.OutputGroup("y", (outside,)),))
    with pytest.raises(UnsupportedError, match="no JavaScript for the operation external"):
        print_program("demo", program)


def lanes_of(r: Routine, a: Value, b: Value) -> None:
    four = Lanes(4)
    x, y = a.read(0, four), a.read(4, four)
    b.write(0, r.choose((x < y) & ~(x == 2.0), x * y - 3.0, r.most(x, r.size(y)) / 2.5))
    b[4], b[5] = r.sum_of_lanes(x + y), r.largest_lane(r.least(x, y))
    b[6] = r.any_lane(x > 3.0).integer().number()
    total = r.variable(1.5, four)
    with r.count(8, step=4) as j:
        total.now = total.now + r.sqrt(r.size(a.read(j, four))) * a[1]
    b.write(8, total.now)


def whole_numbers(r: Routine, a: Value, b: Value) -> None:
    one, other = r.truncated(a[0] * 1e6), r.truncated(a[1] * 7.0)
    for k, value in enumerate((one + other, one * other - 5, one / (other * 2 + 1), one & 255, (one | 6) & 1023)):
        b[k] = value.number()
    b[5] = r.choose(one > other, one, other).number()
    b[6] = a[2].bits().number_of_bits()
    b[7] = ((a[2].bits() & (2**52 - 1)) | (1023 << 52)).number_of_bits()
    b[8] = ((a[3].bits() >> 52) - 1024).number()
    b[9] = ((r.truncated(r.floor(a[1])) + 1023) << 52).number_of_bits()


def memory_of(r: Routine, a: Value, b: Value) -> None:
    own = r.array(6)
    r.copy(own, a, 4)
    before = own[1]
    own[1], own[2] = own[2], own[1]
    b[0], b[1], b[2] = before, own[1], own[1] + own[2]
    r.clear(own, own.at(3))
    b[3] = own[0] + own[3]
    held = r.variable(a[0])
    was = held.now
    held.now = 2.0 * was
    b[4] = was + held.now
    table = addresses(r, [a, b])
    b[5] = table.read(0, ADDRESS)[5] + r.is_null(table.read(1, ADDRESS)).integer().number()
    with r.forever() as outer:
        with r.count(8) as i:
            with r.when(a[i] > 4.0):
                r.leave(outer)
            with r.when(a[i] < 0.0):
                b[6] = a[i]
            with r.otherwise():
                b[7] = a[i]
        r.leave(outer)
    found = r.variable(False, BOOLEAN)
    with r.when((a[0] != a[0]) | r.is_finite(a[1])):
        found.now = True
    b[8] = r.choose(found.now, a[1], 0.5)


@pytest.mark.parametrize("write", [lanes_of, whole_numbers, memory_of])
def test_routines_do_what_machine_code_does(write: Callable[[Routine, Value, Value], None]) -> None:
    r = Routine("tried", {"a": ADDRESS, "b": ADDRESS}, None)
    write(r, *r.arguments)
    chance = random.Random(3)
    samples = [[chance.uniform(-6.0, 6.0) for _ in range(8)] for _ in range(20)] + [
        [1.5, 0.0, -0.0, 1e-3, 5.0, 2.0, 4.5, 3.0]
    ]
    call, expected = compiled(r), []
    for one in samples:
        b = np.zeros(12)
        call(np.array(one), b)
        expected.append(b.tolist())
    found = run_node(
        f"{MEMORY}{BITS}{print_routines([r])}"
        "print(given.map(one => { M.set(one, 100); M.fill(0, 120, 132); tried(100, 120);"
        "return Array.from(M.slice(120, 132), asBits); }));",
        samples,
    )
    for row, wanted in zip(found, expected, strict=True):
        assert all(same(number(x), y) for x, y in zip(row, wanted, strict=True)), (row, wanted)


def test_routines_call_each_other_and_functions_by_address() -> None:
    inner = Routine("inner", {"x": NUMBER, "n": INTEGER}, NUMBER)
    inner.give(inner.arguments[0] * inner.arguments[1].number())
    outer = Routine("outer", {"f": ADDRESS, "x": NUMBER}, NUMBER)
    f, x = outer.arguments
    given = outer.call(f, x, result=NUMBER)
    outer.give(outer.call(inner, given, 3) - given)
    script = f"{MEMORY}F.push(x => x + 0.5);{print_routines([inner, outer])}print([outer(1, 2.25), M[0]]);"
    assert run_node(script) == [5.5, 1]
