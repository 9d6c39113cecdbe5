import numpy as np
from hypothesis import given

from atwood import expr as ex
from atwood.expr.simplify.collect import cost
from atwood.expr.simplify.factors import join_known_factors

from . import graphs


def symbols(text):
    graph = ex.Graph()
    return [graph.symbol(name) for name in text.split()]


def test_factors_that_follow_each_other_are_one():
    p, q, r, x, y = symbols("p q r x y")
    first = q * (r * (x + y))
    found = join_known_factors([0.5 * (p * first), first - y], [p, q, r])
    assert ex.count_operations(found, [p, q, r]) == {"add": 1, "mul": 2, "sub": 1}


def test_multiples_of_a_value_and_of_its_opposite_are_one():
    """As the force of a spring, half of which is k (x - l) and half of which is -k (l - x)."""
    k, l, x = symbols("k l x")
    force = k * (x - l) - k * (l - x)
    [found] = join_known_factors([force], [k, l])
    assert ex.count_operations([force], [k, l]) == {"mul": 2, "sub": 3}
    assert ex.count_operations([found], [k, l]) == {"mul": 1, "sub": 1}
    at = {k: 3.0, l: 0.5, x: 2.25}
    assert ex.evaluate([found], at) == ex.evaluate([force], at) == [10.5]


def test_other_sums_cancel_as_before():
    """What friction balances is taken from the force before both are multiplied: nothing is multiplied out."""
    p, q, x, y = symbols("p q x y")
    values = [p * (q * (x - y) + p * y)]
    assert join_known_factors(values, [p, q]) == values


@given(graphs.recipes, graphs.values)
def test_random_expressions_keep_their_values(recipe, values):
    names, outputs = graphs.build(recipe)
    for known in (names[:1], names[1:], []):
        joined, at = join_known_factors(outputs, known), dict(zip(names, values, strict=True))
        np.testing.assert_allclose(ex.evaluate(joined, at), ex.evaluate(outputs, at), rtol=1e-9, atol=1e-9)
        assert cost(joined, known) <= cost(outputs, known)
