import math
import random
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from atwood import expr as ex
from atwood.codegen import compile_native, compile_program
from atwood.codegen.llvm.module import CodeOptions, Part, write_module
from atwood.errors import KernelEvaluationError, UnsupportedError, UsageError

from ..helpers.runs import prepare
from ..helpers.smooth import SMOOTH as SCENES

_OPERATIONS = (
    lambda a, b: a + b,
    lambda a, b: a - b * 2,
    lambda a, b: a * b,
    lambda a, b: a / (b * b + 1.25),
    lambda a, b: ex.minimum(a, b) - ex.maximum(a, 0.5 * b),
    lambda a, b: ex.select(a < b, ex.sin(a), ex.cos(b)),
    lambda a, b: ex.select((a <= b) & ~(b < 0), a, 1.0),
    lambda a, b: ex.select((a > 0) | (b > 0), a, b) + ((a < b) & (a > -1)),
    lambda a, b: ex.absolute(a) * ex.sign(b) + (a > b) * 2,
    lambda a, b: ex.sin(a) * ex.cos(a) - b,
    lambda a, b: ex.atan2(a, b),
    lambda a, b: ex.tanh(a) + ex.exp(ex.sin(b)) - ex.cosh(ex.cos(a)),
    lambda a, b: ex.sqrt(a * a + 1) ** 0.7 + ex.log(b * b + 2),
    lambda a, b: ex.asin(0.5 * ex.sin(a)) + ex.acos(0.5 * ex.sin(b)) * ex.atan(a) - ex.tan(ex.sin(b)),
    lambda a, b: ex.sinh(ex.sin(a)) - a,
    lambda a, b: ex.solve([[3.0, ex.sin(a)], [ex.cos(b), 4.0]], [a, b])[1],
    lambda a, b: ex.solve([[0.0, 3.0, ex.sin(a)], [3.0, 1.0, 0.0], [ex.cos(b), 0.0, 4.0]], [a, b, 1])[0],
    lambda a, b: sum(
        ex.solve([[4.0 if i == j else ex.sin(a * i + j) for j in range(5)] for i in range(5)], [a, b, 1, 0, 2])
    ),
)


_step = st.tuples(st.integers(0, len(_OPERATIONS) - 1), st.integers(0, 30), st.integers(0, 30))
_numbers = st.lists(st.floats(-2, 2).map(lambda v: round(v, 2)), min_size=5, max_size=5)


def build(recipe):
    graph = ex.Graph()
    x, y, p, q = (graph.symbol(name) for name in ("x", "y", "p", "q"))
    time = graph.symbol("t")
    pool = [x, y, p, q, time, graph.constant(-1.5)]
    for operation, i, j in recipe:
        pool.append(_OPERATIONS[operation](pool[i % len(pool)], pool[j % len(pool)]))
    groups = (ex.InputGroup("time", (time,)), ex.InputGroup("state", (x, y)), ex.InputGroup("none", ()))
    outputs = (ex.OutputGroup("first", tuple(pool[-3:])), ex.OutputGroup("second", (pool[3], pool[4])))
    return ex.Program("random", groups, (p, q), outputs)


@settings(derandomize=True, max_examples=80, deadline=None)
@given(st.lists(_step, min_size=1, max_size=14), _numbers, st.sampled_from([1, 7, 150]))
def test_values_agree_with_the_python_back_end(recipe, numbers, longest):
    program = build(recipe)
    t, x, y, p, q = numbers
    native = compile_native(program, cache=False, options=CodeOptions(longest_chunk=longest))
    expected = ex.evaluate(program.results, {"t": t, "x": x, "y": y, "p": p, "q": q})
    if not np.all(np.isfinite(expected)):
        with pytest.raises(KernelEvaluationError):
            native.bind([p, q])([t], [x, y], ())
        return
    first, second = native.bind([p, q])([t], np.array([x, y]), ())
    np.testing.assert_allclose([*first, *second], expected, rtol=1e-13, atol=1e-13)


def make(function, size=1, **options):
    graph = ex.Graph()
    x = [graph.symbol(f"x{i}") for i in range(size)]
    p = graph.symbol("p")
    results = tuple(graph.convert(value) for value in function(*x, p))
    program = ex.Program("demo", (ex.InputGroup("x", tuple(x)),), (p,), (ex.OutputGroup("out", results),))
    return compile_native(program, cache=False, **options)


_UNARY = ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sinh", "cosh", "tanh")
_BINARY = ("add", "sub", "mul", "div", "pow", "atan2", "minimum", "maximum", "less", "less_equal")
_EDGES = (0.0, -0.0, 0.5, -0.75, 1.0, 3.0, -2.0, 800.0, -800.0, 1e300, math.inf, -math.inf, math.nan)


@pytest.mark.parametrize("operation", [*_UNARY, "absolute", "sign", "neg", "logical_not"])
def test_every_function_of_one_number_keeps_its_corner_cases(operation):
    graph = ex.Graph()
    x = graph.symbol("x")
    out = (graph.node(operation, (x,)),)
    program = ex.Program(operation, (ex.InputGroup("x", (x,)),), (), (ex.OutputGroup("out", out),))
    kernel = compile_native(program, cache=False).bind([])
    found = np.empty(1)
    for value in _EDGES:
        [expected] = ex.evaluate(out, {"x": value})
        assert kernel.into([found], np.array([value])) == math.isfinite(expected)
        np.testing.assert_allclose(found, expected, rtol=4e-16)


@pytest.mark.parametrize("operation", [*_BINARY, "logical_and", "logical_or"])
def test_every_function_of_two_numbers_keeps_its_corner_cases(operation):
    graph = ex.Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    out = (graph.node(operation, (x, y)),)
    program = ex.Program(operation, (ex.InputGroup("x", (x, y)),), (), (ex.OutputGroup("out", out),))
    kernel = compile_native(program, cache=False).bind([])
    found = np.empty(1)
    for a in _EDGES:
        for b in _EDGES:
            [expected] = ex.evaluate(out, {"x": a, "y": b})
            assert kernel.into([found], np.array([a, b])) == math.isfinite(expected), (a, b)
            np.testing.assert_allclose(found, expected, rtol=4e-16, err_msg=str((a, b)))


def system(size, longest=150):
    """Return a compiled program that solves two systems of one matrix, and its reference."""
    graph = ex.Graph()
    a = [graph.symbol(f"a{k}") for k in range(size * size)]
    b = [graph.symbol(f"b{k}") for k in range(size)]
    first = graph.node("solve", (*a, *b), size)
    unknowns = [graph.node("component", (first,), k) for k in range(size)]
    second = graph.node("solve", (*a, *unknowns), size)
    again = [graph.node("component", (second,), k) for k in range(size)]
    groups = (ex.InputGroup("a", tuple(a)), ex.InputGroup("b", tuple(b)))
    outputs = (ex.OutputGroup("x", tuple(unknowns)), ex.OutputGroup("y", tuple(again)))
    program = ex.Program(f"solve {size}", groups, (), outputs)
    return compile_native(program, cache=False, options=CodeOptions(longest_chunk=longest)).bind([])


@pytest.mark.parametrize("longest", [1, 150])
@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 6, 11])
def test_linear_systems_of_any_size(size, longest):
    kernel = system(size, longest)
    rng = np.random.default_rng(size)
    for trial in range(20):
        matrix = rng.normal(size=(size, size))
        if trial % 2 and size > 1:
            matrix[0, 0] = 0.0
            matrix = matrix[rng.permutation(size)]
        right = rng.normal(size=size)
        x, y = kernel(matrix.ravel(), right)
        scale = np.linalg.cond(matrix) * 1e-15 * 20
        expected = np.linalg.solve(matrix, right)
        np.testing.assert_allclose(x, expected, rtol=scale, atol=scale * np.abs(expected).max())
        np.testing.assert_allclose(matrix @ y, x, atol=scale * np.abs(matrix).max() * np.abs(y).max() * size)


@pytest.mark.parametrize("size", [1, 2, 3, 4, 6])
def test_a_singular_matrix_gives_no_number_at_all(size):
    kernel = system(size)
    x, y = np.zeros(size), np.zeros(size)
    triangle = np.triu(np.ones((size, size)))
    triangle[size // 2, size // 2] = 0.0
    identity = np.eye(size)
    identity[-1, -1] = 0.0
    for matrix in (np.zeros((size, size)), triangle, identity):
        assert not kernel.into([x, y], matrix.ravel(), np.ones(size))
        if np.linalg.matrix_rank(matrix[:, : size // 2 + 1]) <= size // 2:
            assert np.isnan(x).all()
        assert not np.isfinite(x).all()


def test_what_select_leaves_out_may_be_undefined():
    kernel = make(lambda x, p: [ex.select(x > 0, ex.sqrt(x), 0) + ex.select(x > 1, 1 / (x + 1), p)]).bind([1.0])
    assert kernel([-1.0]) == ([1.0],)
    assert kernel([3.0]) == ([math.sqrt(3.0) + 0.25],)
    fixed = make(lambda x, p: [ex.select(p > 0, ex.sqrt(p), 0) * x]).bind([-1.0])
    assert fixed([2.0]) == ([0.0],)


@pytest.mark.parametrize(
    ("function", "value"),
    [
        (lambda x, p: [1 / x], 0.0),
        (lambda x, p: [ex.sqrt(x)], -1.0),
        (lambda x, p: [p, ex.log(x)], 0.0),
        (lambda x, p: ex.solve([[x, 1], [x, 1]], [1, p]), 1.0),
        (lambda x, p: [ex.sqrt(p - 10) * x], 1.0),
        (lambda x, p: [x * 1.0], math.inf),
        (lambda x, p: [*(x + k for k in range(20)), ex.sqrt(x), *(x * k for k in range(2, 20))], -1.0),
    ],
)
def test_domain_errors_are_reported_and_explained(function, value):
    kernel = make(function).bind([1.0])
    outputs = [np.empty(len(kernel.compiled.program.results))]
    assert not kernel.into(outputs, np.array([value]))
    with pytest.raises(KernelEvaluationError, match=r"demo: the output out\[\d+\] has no finite value: "):
        kernel([value])


def test_wrong_sizes_and_arrays_are_explained():
    compiled = make(lambda x, y, p: [x * y * p], size=2)
    with pytest.raises(KernelEvaluationError, match="needs 1 parameter values"):
        compiled.bind([1.0, 2.0])
    kernel = compiled.bind([1.0])
    for groups in ([[1.0]], [[1.0, 2.0, 3.0]], [], [[1.0, 2.0], [1.0]]):
        with pytest.raises(KernelEvaluationError, match="takes the groups x of 2"):
            kernel(*groups)
    good, out = np.ones(2), np.ones(1)
    for good[0] in (2.0, 3.0):
        assert kernel.into([out], good)
        assert out[0] == good[0]
    other, elsewhere = np.array([4.0, 5.0]), np.zeros(1)
    assert kernel.into([elsewhere], other)
    assert [out[0], elsewhere[0]] == [3.0, 20.0]
    frozen = np.ones(1)
    frozen.flags.writeable = False
    for outputs, inputs in (
        ([out], [np.ones(4)[::2]]),
        ([out], [np.ones(2, dtype=np.float32)]),
        ([out], [np.ones(3)]),
        ([out], []),
        ([], [good]),
        ([frozen], [good]),
    ):
        with pytest.raises(UsageError):
            kernel.into(outputs, *inputs)


def test_functions_in_python_are_refused():
    with pytest.raises(UnsupportedError, match="there is no machine code for the operation external"):
        make(lambda x, p: [ex.external(ex.ExternalFunction("table", abs), x) * p])


def test_an_operation_without_machine_code_is_named():
    graph = ex.Graph()
    x = graph.symbol("rope.stretch")
    out = (1.0 + graph.node("airy", (x,)),)
    program = ex.Program("crane residual", (ex.InputGroup("x", (x,)),), (), (ex.OutputGroup("out", out),))
    with pytest.raises(UnsupportedError, match=r"crane residual: .* operation airy in airy\(rope.stretch\)"):
        compile_native(program, cache=False)


def test_nothing_to_compute_is_no_special_case():
    empty = ex.Program("empty", (), (), ())
    assert compile_native(empty, cache=False).bind([])() == ()
    graph = ex.Graph()
    p = graph.symbol("p")
    fixed = ex.Program("fixed", (), (p,), (ex.OutputGroup("out", (graph.constant(2.0), p, ex.sin(p))),))
    assert compile_native(fixed, cache=False).bind([0.5])() == ([2.0, 0.5, math.sin(0.5)],)


def long_program(steps):
    graph = ex.Graph()
    x, p = graph.symbol("x"), graph.symbol("p")
    made = random.Random(3)
    pool = [x, p, x * p]
    for _ in range(steps):
        a, b = made.choice(pool), made.choice(pool[-6:])
        pool.append(made.choice([ex.sin(a) + b, 0.5 * (a - b), ex.cos(a) * b, ex.select(a < b, a, ex.sin(b))]))
    return ex.Program("long", (ex.InputGroup("x", (x,)),), (p,), (ex.OutputGroup("out", tuple(pool[-40:])),))


def test_chunks_change_no_value():
    program = long_program(600)
    whole = compile_native(program, cache=False, options=CodeOptions(longest_chunk=10**6))
    assert whole.scratch == 0
    expected = whole.bind([0.3])([0.2])
    for longest, level in ((1, 0), (17, 1), (150, 0), (400, 2)):
        cut = compile_native(program, cache=False, options=CodeOptions(longest_chunk=longest, level=level))
        assert cut.scratch > 0
        np.testing.assert_allclose(cut.bind([0.3])([0.2]), expected, rtol=1e-14)


def test_results_that_are_inputs_or_constants_are_stored_in_pieces():
    # one long function of stores takes LLVM many times as long as all the rest
    graph = ex.Graph()
    x = tuple(graph.symbol(f"x{i}") for i in range(700))
    out = (*x, ex.sin(x[0]), *(graph.one for _ in range(900)), x[3] * x[4], *reversed(x))
    program = ex.Program("passed on", (ex.InputGroup("x", x),), (), (ex.OutputGroup("out", out),))
    text = write_module([Part("kernel", program)], CodeOptions()).text
    assert max(function.count("store double") for function in text.split("define ")) <= 300
    numbers = np.linspace(0.5, 1.5, len(x))
    found = compile_native(program, cache=False).bind([])(numbers)[0]
    expected = [*numbers, math.sin(0.5), *[1.0] * 900, numbers[3] * numbers[4], *numbers[::-1]]
    assert found == pytest.approx(expected, rel=1e-15)
    numbers[600] = math.nan
    with pytest.raises(KernelEvaluationError, match=r"out\[600\]"):
        compile_native(program, cache=False).bind([])(numbers)


def test_many_threads_call_one_kernel_at_once():
    kernel = compile_native(long_program(600), cache=False).bind([0.3])
    starts = np.linspace(-1.0, 1.0, 8)
    expected = [kernel([x]) for x in starts]
    barrier = threading.Barrier(4)

    def work(number):
        barrier.wait()
        return all(kernel([starts[(k + number) % 8]]) == expected[(k + number) % 8] for k in range(400))

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(4) as threads:
            assert all(threads.map(work, range(4)))
    finally:
        sys.setswitchinterval(interval)


@pytest.mark.sample(16)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", SCENES)
def test_every_scene_agrees_with_the_python_back_end(name, form):
    plan = prepare(SCENES[name](), form).plan
    rng = np.random.default_rng(1)
    for program in (plan.program.residual, plan.program.jacobian):
        parameters = plan.values
        kernel = compile_native(program, cache=False).bind(parameters)
        reference = compile_program(program).bind(parameters)
        inputs = [rng.uniform(0.2, 1.2, len(group.symbols)) for group in program.inputs]
        [found], [expected] = kernel(*inputs), reference(*inputs)
        np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13 * np.abs(expected).max(initial=0.0))
