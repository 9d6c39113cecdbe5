import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings

from atwood import expr as ex
from atwood.errors import AtwoodError

from . import graphs


def central_difference(outputs, symbols, values, direction, step=1e-5):
    ends = []
    for side in (step, -step):
        moved = [v + side * d for v, d in zip(values, direction, strict=True)]
        ends.append(np.array(ex.evaluate(outputs, dict(zip(symbols, moved, strict=True)))))
    return (ends[0] - ends[1]) / (2 * step)


@settings(derandomize=True, max_examples=120, deadline=None)
@given(graphs.recipes, graphs.values, graphs.values)
def test_forward_reverse_and_differences_agree(recipe, values, direction):
    symbols, outputs = graphs.build(recipe)
    at = dict(zip(symbols, values, strict=True))
    forward = ex.evaluate(ex.jvp(outputs, dict(zip(symbols, direction, strict=True))), at)
    weights = [0.7, -1.3][: len(outputs)]
    reverse = ex.evaluate(ex.vjp(outputs, weights, symbols), at)
    assert np.dot(weights, forward) == pytest.approx(np.dot(reverse, direction), rel=1e-8, abs=1e-8)
    sparse = ex.jacobian(outputs, symbols)
    dense = np.zeros((len(outputs), len(symbols)))
    dense[list(sparse.rows), list(sparse.columns)] = ex.evaluate(sparse.entries, at)
    np.testing.assert_allclose(dense @ direction, forward, rtol=1e-8, atol=1e-8)
    differences = central_difference(outputs, symbols, values, direction)
    scale = 1e-5 * (1 + np.abs(forward) + np.abs(ex.evaluate(outputs, at)))
    second = ex.jvp(
        ex.jvp(outputs, dict(zip(symbols, direction, strict=True))), dict(zip(symbols, direction, strict=True))
    )
    third = ex.jvp(second, dict(zip(symbols, direction, strict=True)))
    curvature = 1e-9 * np.abs(ex.evaluate(third, at))
    assert np.all(np.abs(differences - forward) <= scale + curvature)


@pytest.mark.parametrize(
    ("function", "point"),
    [
        (lambda a, b: ex.minimum(a, b * b), (0.5, 2.0)),
        (lambda a, b: ex.minimum(a, b * b), (5.0, 2.0)),
        (lambda a, b: ex.maximum(a * b, b), (0.5, 2.0)),
        (lambda a, b: ex.maximum(a * b, b), (5.0, 2.0)),
        (lambda a, b: ex.absolute(a * b), (-0.5, 2.0)),
        (lambda a, b: ex.sign(a) * b, (-0.5, 2.0)),
        (lambda a, b: ex.select(a < b, a * b, a - b), (-0.5, 2.0)),
        (lambda a, b: ex.select(a < b, a * b, a - b), (3.0, 2.0)),
        (lambda a, b: ex.select((a < b) & (b < 3), a * b, b), (3.0, 2.0)),
        (lambda a, b: a**b, (3.0, 2.5)),
        (lambda a, b: a**1.5 + 2**b, (3.0, 2.5)),
        (lambda a, b: ex.tan(a) / b, (0.3, 2.0)),
        (lambda a, b: ex.solve([[a, b], [b, -a]], [a * b, 1.0])[1], (1.2, 0.7)),
    ],
)
def test_rules_of_single_operations(function, point):
    graph = ex.Graph()
    symbols = [graph.symbol("a"), graph.symbol("b")]
    at = dict(zip(symbols, point, strict=True))
    output = function(*symbols)
    differences = [central_difference([output], symbols, point, unit)[0] for unit in ((1, 0), (0, 1))]
    forward = [ex.evaluate(ex.jvp([output], {symbol: 1.0}), at)[0] for symbol in symbols]
    reverse = ex.evaluate(ex.vjp([output], [1.0], symbols), at)
    np.testing.assert_allclose(forward, differences, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(reverse, differences, rtol=1e-7, atol=1e-9)


def test_derivatives_that_are_zero_are_structural():
    graph = ex.Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    outputs = [y * y, ex.sign(x), x < y, graph.constant(3.0), 2.0, x - x]
    assert all(value.is_zero for value in ex.jvp(outputs, {x: 1.0}))
    assert ex.vjp(outputs, [1.0] * 6, [x])[0].is_zero
    assert ex.jvp([x * y], {x: 0.0})[0].is_zero
    assert ex.jacobian([x + y, x, y, x], [y, x]) == ((0, 2, 0, 1, 3), (0, 0, 1, 1, 1), (graph.one,) * 5)


def test_jacobian_along_directions():
    graph = ex.Graph()
    y, rate, c = graph.symbol("y"), graph.symbol("rate"), graph.symbol("c")
    found = ex.jacobian([rate * 3 - y * y], [{y: 1.0, rate: c}])
    assert found.entries == (3 * c - 2 * y,)


def test_solve_keeps_its_matrix_in_the_forward_derivative():
    graph = ex.Graph()
    a, b, c = (graph.symbol(name) for name in "abc")
    solution = ex.solve([[a, 1.0], [1.0, b]], [c, 0.0])
    derivative = ex.jvp(solution, {c: 1.0})
    [node] = {node for node in ex.live(derivative) if node.operation == "solve"}
    assert node.arguments[:4] == (a, graph.one, graph.one, b)
    assert node.arguments[4:] == (graph.one, graph.zero)


def test_external_functions_use_the_derivatives_they_are_given():
    cosine = ex.ExternalFunction("cosine", math.cos)
    sine = ex.ExternalFunction("sine", math.sin, (cosine,))
    graph = ex.Graph()
    x = graph.symbol("x")
    [derivative] = ex.jvp([ex.external(sine, 2 * x)], {x: 1.0})
    assert ex.evaluate([derivative], {x: 0.3})[0] == pytest.approx(2 * math.cos(0.6))
    assert ex.evaluate(ex.vjp([ex.external(sine, 2 * x)], [1.0], [x]), {x: 0.3})[0] == pytest.approx(2 * math.cos(0.6))
    assert ex.external(sine, 0.3) == math.sin(0.3)
    assert ex.external(sine, graph.one).value == math.sin(1.0)
    with pytest.raises(AtwoodError, match="cosine: the derivative"):
        ex.jvp([derivative], {x: 1.0})


def chain_rows(count):
    """Return the equations of a planar chain of point masses, by two forward sweeps and one reverse sweep."""
    graph = ex.Graph()
    q, u, a, m, l = ([graph.symbol(f"{name}{i}") for i in range(count)] for name in "quaml")
    x, z = 0.0, 0.0
    positions = []
    for i in range(count):
        x, z = x + l[i] * ex.sin(q[i]), z - l[i] * ex.cos(q[i])
        positions += [x, z]
    rates = dict(zip(q, u, strict=True))
    velocities = ex.jvp(positions, rates)
    accelerations = ex.jvp(velocities, rates | dict(zip(u, a, strict=True)))
    forces = []
    for i in range(count):
        forces += [m[i] * accelerations[2 * i], m[i] * (accelerations[2 * i + 1] + 9.81)]
    return ex.vjp(velocities, forces, u), (q, u, a, m, l)


def test_deriving_a_chain_is_linear_in_its_length():
    sizes = []
    graph_sizes = []
    for count in (10, 20, 40):
        rows, (*_, m, l) = chain_rows(count)
        operations = ex.count_operations(rows, [*m, *l])
        assert operations["sin"] == operations["cos"] == count
        sizes.append(sum(operations.values()))
        graph_sizes.append(len(rows[0].graph))
    assert sizes[2] - sizes[1] == 2 * (sizes[1] - sizes[0])
    assert graph_sizes[2] - graph_sizes[1] == 2 * (graph_sizes[1] - graph_sizes[0])


def test_reverse_sweep_visits_only_what_depends_on_the_variables():
    graph = ex.Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    heavy = y
    for _ in range(50):
        heavy = ex.sin(heavy)
    outputs = [heavy * x]
    before = len(graph)
    assert ex.vjp(outputs, [1.0], [x]) == [heavy]
    assert len(graph) == before


@pytest.mark.parametrize("x", [-2000.0, -3.0, 0.0, 0.4, 2000.0])
def test_a_quotient_by_what_grows_beyond_all_numbers_has_derivatives(x: float) -> None:
    graph = ex.Graph()
    s, k = graph.symbol("s"), graph.symbol("k")
    laws = (
        (1.0 / ex.cosh(s), lambda s: 1 / mpmath.cosh(s)),
        (s / ex.cosh(k * s) ** 2, lambda s: s / mpmath.cosh(2 * s) ** 2),
        (k / (1.0 + ex.exp(-k * s)), lambda s: 2 / (1 + mpmath.exp(-2 * s))),
        (ex.exp(-s * s) * ex.exp(40 * s), lambda s: mpmath.exp(-s * s + 40 * s)),
    )
    for law, exact in laws:
        (forward,), (back,) = ex.jvp([law], {s: 1.0}), ex.vjp([law], [1.0], [s])
        (second,) = ex.jvp([back], {s: 1.0})
        with mpmath.workdps(40):
            expected = [float(mpmath.diff(exact, mpmath.mpf(x), n)) for n in (1, 1, 2)]
        found = ex.evaluate([forward, back, second], {s: x, k: 2.0})
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-12)
