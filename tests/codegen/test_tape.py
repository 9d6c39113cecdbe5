"""Programs as tapes: the bits of machine code, whatever the operation, the numbers and the scene."""

import itertools
import math

import numpy as np
import pytest

from atwood import AtwoodError, expr as ex, simulate
from atwood.codegen.llvm import tiers
from atwood.codegen.llvm.backend import NativeProgram
from atwood.codegen.llvm.build import build_code
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.codegen.llvm.tape import _CODES, _computed
from atwood.codegen.llvm.taped import TapedProgram
from atwood.codegen.llvm.text import OWN_FUNCTIONS, has_code
from atwood.codegen.python.walk import WALKS
from atwood.codegen.routines import NUMBER, Routine
from atwood.errors import KernelEvaluationError, UnsupportedError
from atwood.expr.core.operations import BINARY, UNARY
from atwood_library.scenes import SCENES

NUMBERS = [0.0, -0.0, 1.0, -1.5, 0.3, 2.0, 5e-324, -1e-310, 1e308, -1e308, 3e6, math.inf, -math.inf, math.nan]


def both(program):
    part = Part("kernel", program)
    made = tiers.build_tapes([part]), build_code([part], CodeOptions(level=0), cached=False)
    return [NativeProgram(program, one) for one in made]


def assert_alike(program, given, parameters=()):
    """Return whether all results of a tape and of machine code are finite, which both must say alike."""
    said, tables = [], []
    for one in both(program):
        kernel = one.bind(parameters)
        outputs = [np.full(len(group.expressions), 7.0) for group in program.outputs]
        rows = [(kernel.into(outputs, *inputs), np.concatenate([kernel.derived, *outputs])) for inputs in given]
        said.append([is_finite for is_finite, _ in rows])
        tables.append(np.array([row for _, row in rows]))
    first, second = tables
    numbers = ~np.isnan(first)
    assert np.array_equal(numbers, ~np.isnan(second))
    assert np.array_equal(first[numbers].view(np.uint64), second[numbers].view(np.uint64))
    assert said[0] == said[1]
    return said[0]


def program_of(outputs, groups, parameters=()):
    inputs = tuple(ex.InputGroup(f"in{k}", tuple(one)) for k, one in enumerate(groups))
    return ex.Program("made", inputs, tuple(parameters), (ex.OutputGroup("out", tuple(outputs)),))


@pytest.mark.parametrize("operation", sorted({*UNARY, *BINARY, "select"}))
def test_every_operation_on_every_kind_of_number(operation):
    graph = ex.Graph()
    count = 1 if operation in UNARY else 2 if operation in BINARY else 3
    symbols = [graph.symbol(f"x{k}") for k in range(count)]
    given = [[np.array(one)] for one in itertools.product(NUMBERS, repeat=count)]
    assert_alike(program_of([graph.node(operation, tuple(symbols), None)], [symbols]), given)


def test_every_operation_with_machine_code_is_known_to_tapes():
    r = Routine("r", {"a": NUMBER, "b": NUMBER})
    for one in sorted({*UNARY, *BINARY, "select"}):
        assert has_code(one) == (one in _CODES or one in OWN_FUNCTIONS)
        if one in _CODES and one != "select":
            assert _computed(r, one, *r.arguments[: 2 if one in BINARY else 1]).kind is NUMBER


@pytest.mark.parametrize("size", [1, 2, 3, 4, 7])
def test_linear_systems_of_any_size(size):
    """With rows that change places, pivots that are as large as others, and none at all."""
    graph = ex.Graph()
    a = [graph.symbol(f"a{k}") for k in range(size * size)]
    b = [graph.symbol(f"b{k}") for k in range(size)]
    first = graph.node("solve", (*a, *b), size)
    unknowns = [graph.node("component", (first,), k) for k in range(size)]
    second = graph.node("solve", (*a, *unknowns), size)
    again = [graph.node("component", (second,), k) for k in reversed(range(size))]
    rng = np.random.default_rng(size)
    given = []
    for trial in range(60):
        matrix = rng.normal(size=size * size) if trial % 2 else rng.integers(-2, 3, size * size).astype(float)
        given.append([matrix, rng.normal(size=size)])
    given.append([np.zeros(size * size), np.ones(size)])
    said = assert_alike(program_of([*again, *unknowns[:1]], [a, b]), given)
    assert any(said)
    assert not said[-1]


def test_what_is_given_or_constant_or_of_parameters_alone_is_a_result():
    graph = ex.Graph()
    x, y, p = (graph.symbol(one) for one in ("x", "y", "p"))
    angle = x * ex.sin(p)
    outputs = [x, p, ex.sqrt(p), graph.constant(0.5), ex.sin(angle), ex.cos(angle), ex.cos(y), y, ex.sin(angle)]
    given = [np.array([0.3]), np.array([2.0]), np.zeros(0)]
    assert all(assert_alike(program_of(outputs, [[x], [y], []], [p]), [given], [1.7]))
    assert all(assert_alike(program_of([], [[x]]), [given[:1]]))


def test_functions_in_python_have_no_tape():
    graph = ex.Graph()
    x = graph.symbol("x")
    program = program_of([ex.external(ex.ExternalFunction("half", lambda a: 0.5 * a), x)], [[x]])
    with pytest.raises(UnsupportedError, match="no tape for an operation"):
        tiers.build_tapes([Part("kernel", program)])


@pytest.mark.sample(10)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", SCENES)
def test_every_program_of_a_first_run_has_the_bits_of_its_machine_code(name, form, monkeypatch):
    found, make = {}, tiers.build_tapes

    def build_tapes(parts, *others):
        found.update({part.program: None for part in parts})
        return make(parts, *others)

    monkeypatch.setattr(tiers, "build_tapes", build_tapes)
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    try:
        simulate(SCENES[name](), form=form, solver="explicit", t_end=1e-3, outputs=3)
    except AtwoodError:
        pytest.skip("it does not run so")
    assert found
    rng = np.random.default_rng(1)
    for program in found:
        given = [[rng.uniform(-1.2, 1.2, len(group.symbols)) for group in program.inputs] for _ in range(4)]
        assert_alike(program, given, rng.uniform(0.5, 1.5, len(program.parameters)))


def test_what_runs_often_in_python_keeps_the_bits_of_its_walks():
    program = simulate(SCENES["stewart-platform"](), t_end=1e-3, outputs=3).run.segments[0].plan.balance.program.program
    assert not any(node.operation in ("external", "solve") for node in program.nodes)
    rng = np.random.default_rng(1)
    kernel = TapedProgram(program).bind(rng.uniform(0.5, 1.5, len(program.parameters)))
    given = [rng.uniform(-1.2, 1.2, len(group.symbols)) for group in program.inputs]
    rows = [kernel(*given) for _ in range(WALKS + 2)]
    assert "main" in vars(kernel.compiled)
    assert all(row == rows[0] for row in rows)
    with pytest.raises(KernelEvaluationError, match="takes the groups"):
        kernel(given[0], given[1][1:], given[2])
    given[1][0] = math.inf
    with pytest.raises(KernelEvaluationError, match="no finite value"):
        kernel(*given)
