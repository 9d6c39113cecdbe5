import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from atwood import expr as ex
from atwood.codegen import compile_program
from atwood.codegen.python import backend
from atwood.codegen.python.walk import WALKS
from atwood.errors import KernelEvaluationError

_OPERATIONS = (
    lambda a, b: a + b,
    lambda a, b: a - b * 2,
    lambda a, b: a * b,
    lambda a, b: a / (b * b + 1.25),
    lambda a, b: ex.minimum(a, b) - ex.maximum(a, 0.5 * b),
    lambda a, b: ex.select(a < b, ex.sin(a), ex.cos(b)),
    lambda a, b: ex.select((a <= b) & ~(b < 0), a, 1.0),
    lambda a, b: ex.absolute(a) * ex.sign(b) + (a > b) * 2,
    lambda a, b: ex.atan2(a, b),
    lambda a, b: ex.tanh(a) + ex.exp(ex.sin(b)) - ex.cosh(ex.cos(a)),
    lambda a, b: ex.sqrt(a * a + 1) ** 0.7 + ex.log(b * b + 2),
    lambda a, b: (
        ex.asin(0.5 * ex.sin(a)) + ex.acos(0.5 * ex.sin(b)) * ex.atan(a) - ex.tan(ex.sin(b)) + ex.sinh(ex.sin(a))
    ),
    lambda a, b: ex.solve([[3.0, ex.sin(a)], [ex.cos(b), 4.0]], [a, b])[1],
    lambda a, b: sum(
        ex.solve([[4.0 if i == j else ex.sin(a * i + j) for j in range(5)] for i in range(5)], [a, b, 1, 0, 2])
    ),
    lambda a, b: ex.external(ex.ExternalFunction("mean", _mean), a, b),
)


def _mean(a, b):
    return 0.5 * (a + b)


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


@settings(derandomize=True, max_examples=100, deadline=None)
@given(st.lists(_step, min_size=1, max_size=14), st.lists(_numbers, min_size=3, max_size=3))
def test_kernels_agree_with_the_interpreter(recipe, samples):
    program = build(recipe)
    table = np.array(samples).T
    t, x, y = table[:3]
    p, q = table[3:, 0]
    scalar = compile_program(program).bind([p, q])
    several = compile_program(program, vectorized=True).bind([p, q])
    arrays = several(t[None], np.array([x, y]), np.empty((0, 3)))
    given = t[None], np.array([x, y]), np.empty((0, 3))
    with np.errstate(all="ignore"):
        generated = several.compiled.main(several.prologue_values, *given)
    for walked, compiled in zip(arrays, generated, strict=True):
        for row, value in zip(walked, compiled, strict=True):
            np.testing.assert_array_equal(row, value)
    for k in range(3):
        at = {"t": t[k], "x": x[k], "y": y[k], "p": p, "q": q}
        expected = ex.evaluate(program.results, at)
        if not np.all(np.isfinite(expected)):
            continue
        first, second = scalar([float(t[k])], np.array([x[k], y[k]]), ())
        assert (first, second) == scalar.compiled.main(scalar.prologue_values, [t[k]], [x[k], y[k]], [])
        np.testing.assert_allclose([*first, *second], expected, rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(np.concatenate(arrays)[:, k], expected, rtol=1e-9, atol=1e-10)


def make(function, size=1, **options):
    graph = ex.Graph()
    x = [graph.symbol(f"x{i}") for i in range(size)]
    p = graph.symbol("p")
    results = tuple(graph.convert(value) for value in function(*x, p))
    program = ex.Program("demo", (ex.InputGroup("x", tuple(x)),), (p,), (ex.OutputGroup("out", results),))
    return compile_program(program, **options)


@pytest.mark.parametrize(
    ("function", "value"),
    [
        (lambda x, p: [1 / x], 0.0),
        (lambda x, p: [ex.sqrt(x)], -1.0),
        (lambda x, p: [ex.exp(x * 1000)], 1.0),
        (lambda x, p: [p, ex.log(x)], 0.0),
        (lambda x, p: [x ** (p / 2)], -1.0),
        (lambda x, p: ex.solve([[x, 1], [x, 1]], [1, p]), 1.0),
        (lambda x, p: [ex.sqrt(p - 10) * x], 1.0),
    ],
)
def test_domain_errors_name_the_program_and_the_operation(function, value):
    kernel = make(function).bind([1.0])
    with pytest.raises(KernelEvaluationError, match=r"demo: the output out\[\d\] has no finite value: "):
        kernel([value])


def test_what_select_leaves_out_may_be_undefined():
    for options in ({}, {"vectorized": True}):
        shared = make(lambda x, p: [ex.select(x > 0, ex.sqrt(x), 0) + ex.select(x > 1, ex.sqrt(x), 1)], **options).bind(
            [1.0]
        )
        assert np.asarray(shared([-1.0])[0]).ravel() == [1.0]
        assert np.asarray(shared([4.0])[0]).ravel() == [4.0]
        fixed = make(lambda x, p: [ex.select(p > 0, ex.sqrt(p), 0) * x], **options).bind([-1.0])
        assert np.asarray(fixed([2.0])[0]).ravel() == [0.0]


def test_vectorized_domain_errors_stay_in_their_sample():
    kernel = make(lambda x, p: [ex.sqrt(x), *ex.solve([[x, 1], [1, x]], [1, p])], vectorized=True).bind([1.0])
    [found] = kernel(np.array([[4.0, 1.0, -4.0]]))
    np.testing.assert_array_equal(np.isnan(found), [[False, False, True], [False, True, False], [False, True, False]])


def test_vectorized_parameters_and_shared_samples():
    compiled = make(lambda x, y, p: [x * p + y, 3.0], size=2, vectorized=True)
    [found] = compiled.bind([[1.0, 2.0, 3.0]])(np.array([10.0, 1.0]))
    np.testing.assert_array_equal(found, [[11.0, 21.0, 31.0], [3.0, 3.0, 3.0]])
    [found] = compiled.bind([2.0])(np.array([10.0, 1.0]))
    np.testing.assert_array_equal(found, [[21.0], [3.0]])


def test_wrong_sizes_are_explained():
    compiled = make(lambda x, y, p: [x * y * p], size=2)
    with pytest.raises(KernelEvaluationError, match="needs 1 parameter values"):
        compiled.bind([1.0, 2.0])
    kernel = compiled.bind([1.0])
    for groups in ([[1.0]], [[1.0, 2.0, 3.0]], [], [[1.0, 2.0], [1.0]]):
        with pytest.raises(KernelEvaluationError, match="takes the groups x of 2"):
            kernel(*groups)


def test_external_functions_are_called_with_floats_and_their_failure_is_reported():
    def table(value):
        assert type(value) is float
        if value > 5:
            raise ValueError("beyond the table")
        return value * value

    function = ex.ExternalFunction("table", table)
    kernel = make(lambda x, p: [ex.external(function, x) * p]).bind([2.0])
    assert kernel([3.0]) == ([18.0],)
    with pytest.raises(KernelEvaluationError, match="demo: an external function failed: beyond the table"):
        kernel([6.0])
    several = make(lambda x, p: [ex.external(function, x) * p], vectorized=True).bind([2.0])
    np.testing.assert_array_equal(several(np.array([[1.0, 2.0]]))[0], [[2.0, 8.0]])


def test_prologue_runs_once_for_each_binding():
    calls = []

    def expensive(value):
        calls.append(value)
        return math.sqrt(value)

    function = ex.ExternalFunction("expensive", expensive)
    kernel = make(lambda x, p: [ex.external(function, p) * x]).bind([4.0])
    assert [kernel([1.0]), kernel([2.0])] == [([2.0],), ([4.0],)]
    assert calls == [4.0]


@pytest.mark.parametrize("vectorized", [False, True])
def test_code_is_written_for_what_runs_more_than_a_few_times(vectorized, monkeypatch):
    written = []
    execute = backend._execute
    monkeypatch.setattr(backend, "_execute", lambda *given: (written.append(given[0]), execute(*given))[1])
    graph = ex.Graph()
    x, p = graph.symbol("x"), graph.symbol("p")
    outputs = (ex.OutputGroup("value", (ex.sin(x) * ex.exp(p),)),)
    program = ex.Program("often", (ex.InputGroup("x", (x,)),), (p,), outputs)
    kernel = compile_program(program, vectorized=vectorized).bind([0.3])
    found = [kernel(np.array([0.7]))[0][0] for _ in range(WALKS)]
    assert not written
    found += [kernel(np.array([0.7]))[0][0] for _ in range(2)]
    assert written == ["kernel"]
    assert len({np.asarray(one).item() for one in found}) == 1


def test_a_long_and_deep_program_compiles():
    def long(x, p):
        value = x
        for _ in range(10_000):
            value = 0.5 * ex.sin(value + p) + x * 0.25
        return [value]

    compiled = make(long)
    kernel = compiled.bind([0.3])
    expected = ex.evaluate(compiled.program.results, {"x0": 0.2, "p": 0.3})
    assert kernel([0.2])[0] == pytest.approx(expected, rel=1e-12)


def test_values_used_once_are_written_where_they_are_used():
    source = make(lambda x, p: [(x + p) * (x - p), ex.minimum(x * p, 2.0)]).source
    assert source.count(" = ") == 3
