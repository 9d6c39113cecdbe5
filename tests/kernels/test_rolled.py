"""Large programs as loops over what is alike in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from atwood import expr as ex
from atwood import simulate
from atwood.errors import KernelEvaluationError
from atwood.kernels import compile_native, compile_program, llvm_build
from atwood.kernels.llvm_engine import sincos_name
from atwood.kernels.llvm_layout import main_body, prologue_body
from atwood.kernels.llvm_module import CodeOptions
from atwood.kernels.rolled import Rolled, roll, roll_large
from atwood.pipeline import assemble
from atwood_library.scenes import Chain

from ..helpers.nets import rod_ladder, spring_net
from .test_llvm_backend import _step, build

LOOPS = CodeOptions(sincos=sincos_name(), rolled_from=0)
STRAIGHT = CodeOptions(sincos=sincos_name(), rolled_from=10**9)


def rolled(program: ex.Program) -> Rolled:
    found = roll(main_body(program))
    assert found is not None
    return found


def programs(assembly):
    form = assembly.form_program()
    return (
        form.residual,
        form.jacobian,
        assembly.balance(assembly.form).program,
        assembly.energy_program,
        assembly.to_maximal,
    )


SCENES = {
    "chain": lambda: Chain(links=14),
    "net": lambda: spring_net(4, 5),
    "ladder": lambda: rod_ladder(5),
}


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", SCENES)
def test_values_are_those_of_straight_code_to_the_last_bit(name, form, monkeypatch):
    monkeypatch.setattr("atwood.kernels.rolled._GAIN", 0)
    assembly = assemble(SCENES[name](), form=form)
    if assembly.form == "reduced" and assembly.reduced.constraints:
        chosen = [assembly.balance("reduced").program, assembly.energy_program, assembly.to_maximal]
    else:
        chosen = programs(assembly)
    random = np.random.default_rng(3)
    for program in chosen:
        inputs = [random.uniform(0.3, 1.0, len(group.symbols)) for group in program.inputs]
        values = random.uniform(0.8, 1.2, len(program.parameters))
        found, expected = (
            compile_native(program, cache=False, options=options).bind(values)(*inputs) for options in (LOOPS, STRAIGHT)
        )
        assert found == expected, program.name
        reference = compile_program(program).bind(values)(*inputs)
        for a, b in zip(found, reference, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(
    st.lists(_step.filter(lambda step: step[0] != 17), min_size=1, max_size=14),  # without the large linear system
    st.lists(st.floats(-2, 2).map(lambda v: round(v, 2)), min_size=5, max_size=5),
)
def test_random_programs(recipe, numbers):
    program = build(recipe)
    t, x, y, p, q = numbers
    expected = ex.evaluate(program.results, {"t": t, "x": x, "y": y, "p": p, "q": q})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("atwood.kernels.rolled._GAIN", 0)
        native = compile_native(program, cache=False, options=LOOPS)
    if not np.all(np.isfinite(expected)):
        with pytest.raises(KernelEvaluationError):
            native.bind([p, q])([t], [x, y], ())
        return
    first, second = native.bind([p, q])([t], np.array([x, y]), ())
    np.testing.assert_allclose([*first, *second], expected, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_code_does_not_grow_with_a_chain(form):
    shapes = []
    for links in (30, 60):
        assembly = assemble(Chain(links=links), form=form)
        made = [roll(body(p)) for p in programs(assembly) for body in (main_body, prologue_body)][: 2 * 2]
        made += [rolled(assembly.energy_program), rolled(assembly.to_maximal)]
        shapes.append([(len(one.patterns), len(one.runs), one.operations) for one in made])
    assert shapes[0] == shapes[1]
    assert all(operations < 60 for _, _, operations in shapes[0])


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_code_does_not_grow_with_a_net(form):
    counts = []
    for size in (12, 18):
        assembly = assemble(spring_net(size, size), form=form)
        made = assembly.form_program()
        counts.append([rolled(p).operations for p in (made.residual, made.jacobian)])
    assert counts[0] == counts[1]
    assert max(counts[0]) < 400


def test_a_sum_along_a_chain_is_a_loop():
    graph = ex.Graph()
    x = tuple(graph.symbol(f"x{i}") for i in range(100))
    total = graph.zero
    for one in x:
        total = total + one * one
    program = ex.Program("sum", (ex.InputGroup("x", x),), (), (ex.OutputGroup("out", (total,)),))
    assert rolled(program).operations <= 6
    numbers = np.linspace(-1.0, 1.0, 100)
    assert compile_native(program, cache=False, options=LOOPS).bind([])(numbers)[0][0] == pytest.approx(
        float(numbers @ numbers), rel=1e-14
    )


def test_constants_and_what_is_shared():
    graph = ex.Graph()
    x = tuple(graph.symbol(f"x{i}") for i in range(50))
    c = graph.symbol("c")
    rows = tuple(ex.sin(c) * one + (0.5 + i) * ex.cos(one) for i, one in enumerate(x))
    groups = (ex.InputGroup("c", (c,)), ex.InputGroup("x", x))
    more = (x[3], graph.constant(7.0), c, rows[4], rows[4], graph.constant(8.0))
    program = ex.Program("mixed", groups, (), (ex.OutputGroup("out", (*rows, *more)), ex.OutputGroup("twice", rows)))
    kernel = compile_native(program, cache=False, options=LOOPS).bind([])
    numbers = np.linspace(0.0, 1.0, 50)
    out, twice = kernel([0.3], numbers)
    expected = np.sin(0.3) * numbers + (0.5 + np.arange(50)) * np.cos(numbers)
    np.testing.assert_allclose(twice, expected, rtol=1e-15)
    np.testing.assert_allclose(out, [*expected, numbers[3], 7.0, 0.3, expected[4], expected[4], 8.0], rtol=1e-15)
    assert rolled(program).operations < 12


def test_a_value_that_is_not_finite_is_noticed():
    graph = ex.Graph()
    x = tuple(graph.symbol(f"x{i}") for i in range(50))
    program = ex.Program(
        "roots", (ex.InputGroup("x", x),), (), (ex.OutputGroup("out", tuple(ex.sqrt(one) for one in x)),)
    )
    kernel = compile_native(program, cache=False, options=LOOPS).bind([])
    numbers = np.ones(50)
    assert kernel(numbers)[0] == [1.0] * 50
    numbers[31] = -1.0
    with pytest.raises(KernelEvaluationError, match=r"out\[31\]"):
        kernel(numbers)


def test_a_linear_system_that_is_too_large_stays_straight():
    graph = ex.Graph()
    b = [graph.symbol(f"b{i}") for i in range(4)]
    matrix = [[4.0 if i == j else 1.0 for j in range(4)] for i in range(4)]
    found = ex.solve(matrix, b)
    program = ex.Program("solve", (ex.InputGroup("b", tuple(b)),), (), (ex.OutputGroup("out", tuple(found)),))
    assert roll(main_body(program)) is None
    values = compile_native(program, cache=False, options=LOOPS).bind([])([1.0, 2.0, 3.0, 4.0])[0]
    np.testing.assert_allclose(np.array(matrix) @ values, [1.0, 2.0, 3.0, 4.0])


def test_only_what_is_large_and_repeats_itself_becomes_loops():
    chain = assemble(Chain(links=30), form="dae").form_program().residual
    assert roll_large(main_body(chain), 10**6) is None
    assert roll_large(main_body(chain), 500) is not None
    pendulum = assemble(Chain(links=1), form="dae").form_program().residual
    assert roll_large(main_body(pendulum), 0) is None


@pytest.fixture
def directory(tmp_path, monkeypatch):
    monkeypatch.setenv("ATWOOD_CACHE_DIR", str(tmp_path / "kernels"))
    monkeypatch.delenv("ATWOOD_CACHE", raising=False)


def test_loops_come_from_the_cache_with_their_tables(directory):
    for links in (20, 30):
        program = assemble(Chain(links=links), form="dae").form_program().residual
        random = np.random.default_rng(1)
        inputs = [random.uniform(0.3, 1.0, len(group.symbols)) for group in program.inputs]
        values = random.uniform(0.8, 1.2, len(program.parameters))
        first = compile_native(program, options=LOOPS)
        second = compile_native(program, options=LOOPS)
        assert (first.from_cache, second.from_cache) == (False, True)
        assert first.bind(values)(*inputs) == second.bind(values)(*inputs)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_the_solver_takes_the_same_steps(form, monkeypatch):
    runs = []
    for smallest in (10**9, 0):
        usual = llvm_build.default_options
        with monkeypatch.context() as patch:
            patch.setattr(
                "atwood.kernels.llvm_ida.default_options",
                lambda parts, usual=usual, smallest=smallest: replace(usual(parts), rolled_from=smallest),
            )
            runs.append(simulate(Chain(links=15), form=form, solver="ida", t_end=0.3, outputs=4))
    first, second = runs
    assert first.statistics.steps == second.statistics.steps
    assert np.array_equal(first.run.segments[0].coordinates, second.run.segments[0].coordinates)
