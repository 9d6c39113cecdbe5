import math

import numpy as np
import pytest
import sympy
from hypothesis import given, settings

from atwood import expr as ex
from atwood.errors import AtwoodError
from atwood.expr.sympy_bridge import from_sympy

from . import graphs
from .to_sympy import to_sympy, to_sympy_shared


@settings(derandomize=True, max_examples=25, deadline=None)
@given(graphs.recipes.filter(lambda recipe: len(recipe) <= 7), graphs.values)
def test_round_trip_keeps_values(recipe, values):
    symbols, outputs = graphs.build(recipe)
    at = dict(zip(symbols, values, strict=True))
    back = [from_sympy(item, symbols[0].graph) for item in to_sympy(outputs)]
    np.testing.assert_allclose(ex.evaluate(back, at), ex.evaluate(outputs, at), rtol=1e-8, atol=1e-8)
    names, items = to_sympy_shared(outputs)
    known = {}
    for name, item in names:
        known[name.name] = from_sympy(item, symbols[0].graph, known)
    back = [from_sympy(item, symbols[0].graph, known) for item in items]
    np.testing.assert_allclose(ex.evaluate(back, at), ex.evaluate(outputs, at), rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("point", [(0.4, 1.3), (-1.4, 0.3), (2.0, 2.0)])
def test_round_trip_of_piecewise_functions(point):
    graph = ex.Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    outputs = [
        ex.select(x < y, x, y * 2),
        ex.select((x < y) & ~(y < 1) | (x > 1), x, y),
        ex.select(x, 1, y),
        ex.minimum(x, y) + ex.maximum(x, 2) - ex.absolute(x) * ex.sign(y),
        ex.atan2(x, y),
        3 * (x <= y),
        x / (2 * ex.sqrt(y)),
        ex.solve([[x, 1], [2, y]], [y, 1])[1],
    ]
    back = [from_sympy(item, graph) for item in to_sympy(outputs)]
    at = dict(zip((x, y), point, strict=True))
    np.testing.assert_allclose(ex.evaluate(back, at), ex.evaluate(outputs, at), rtol=1e-12)


def test_numbers_read_as_people_write_them():
    graph = ex.Graph()
    x = graph.symbol("x")
    half, third, gravity, pi = to_sympy([x * 0.5, x / 3, 9.81, math.pi / 2])
    real = sympy.Symbol("x", real=True)
    assert (half, third, pi) == (real / 2, real / 3, sympy.pi / 2)
    assert gravity == sympy.Float(9.81)


def test_shared_values_get_names():
    graph = ex.Graph()
    x = graph.symbol("x0")
    replacements, [first, second] = to_sympy_shared([ex.sin(x) + 1, ex.sin(x) * 2])
    [(name, item)] = replacements
    assert name.name == "x0_"
    assert item == sympy.sin(sympy.Symbol("x0", real=True))
    assert (first, second) == (name + 1, 2 * name)


def test_mapping_and_functions():
    graph = ex.Graph()
    angle = graph.symbol("angle")
    t = sympy.Symbol("t")
    q = sympy.Function("q")(t)
    assert to_sympy([2 * angle], {angle: q}) == [2 * q]
    assert from_sympy(sympy.sin(q) * t, graph, {q: angle, "t": 2.0}) is 2 * ex.sin(angle)
    curve = ex.ExternalFunction("curve", lambda s: s * s)
    node = ex.external(curve, angle)
    [item] = to_sympy([node])
    assert from_sympy(item, graph, functions={"curve": curve}) is node
    with pytest.raises(AtwoodError, match="curve has no counterpart"):
        from_sympy(item, graph)


def test_laws_written_with_the_functions_take_sympy_objects():
    x, y = sympy.symbols("x y", positive=True)
    assert ex.sin(x) == sympy.sin(x)
    assert ex.absolute(-x) == x
    assert ex.hypot(x, y) == sympy.sqrt(x**2 + y**2)
    assert ex.atan2(y, 1) == sympy.atan2(y, 1)
    assert ex.minimum(x, y) == sympy.Min(x, y)
    assert ex.select(x < y, x, y) == sympy.Piecewise((x, x < y), (y, True))
    assert ex.solve([[x, 0], [0, y]], [1, 2]) == [1 / x, 2 / y]


def test_sympy_functions_without_a_node_of_their_own():
    graph = ex.Graph()
    x = sympy.Symbol("x")
    items = [sympy.sec(x), sympy.cot(x), sympy.exp(-x) / x**2, sympy.pi * x, sympy.Heaviside(x), sympy.Rational(1, 3)]
    found = ex.evaluate([from_sympy(item, graph) for item in items], {"x": 0.7})
    np.testing.assert_allclose(found, [float(item.subs(x, 0.7)) for item in items], rtol=1e-14)
