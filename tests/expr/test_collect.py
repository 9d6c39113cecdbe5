import random

import numpy as np
import pytest
from hypothesis import given, settings

from atwood import expr as ex
from atwood.expr.simplify.collect import collect, cost

from . import graphs
from .to_sympy import to_sympy

_TRIGONOMETRIC = ("sin", "cos", "tan")


def symbols(text):
    graph = ex.Graph()
    return [graph.symbol(name) for name in text.split()]


def pendulum_chain(count, relative=False):
    """Return the rows of a chain of pendulums, its angles and its parameters, from the recursion."""
    graph = ex.Graph()
    q, u, a, l, m = ([graph.symbol(f"{name}{i}") for i in range(count)] for name in "qualm")
    gravity = graph.symbol("g")
    positions = []
    x, z, angle = 0.0, 0.0, 0.0
    for i in range(count):
        angle = angle + q[i] if relative else q[i]
        x, z = x + l[i] * ex.sin(angle), z - l[i] * ex.cos(angle)
        positions += [x, z]
    rates = dict(zip(q, u, strict=True))
    velocities = ex.jvp(positions, rates)
    accelerations = ex.jvp(velocities, rates | dict(zip(u, a, strict=True)))
    forces = []
    for i in range(count):
        forces += [m[i] * accelerations[2 * i], m[i] * (accelerations[2 * i + 1] + gravity)]
    return ex.vjp(velocities, forces, u), q, [*l, *m, gravity]


def counts(rows, parameters):
    """Return the numbers of trigonometric functions, of additions and multiplications, and of everything else."""
    found = ex.count_operations(rows, parameters)
    trigonometric = sum(found.pop(kind, 0) for kind in _TRIGONOMETRIC)
    simple = sum(found.pop(kind, 0) for kind in ("add", "sub", "mul"))
    return trigonometric, simple, sum(found.values())


def assert_same_values(rows, collected, low=0.4, high=2.0):
    names = [node for node in ex.live(rows) if node.is_symbol]
    generator = random.Random(7)
    for _ in range(10):
        at = {name: generator.uniform(low, high) for name in names}
        expected = np.array(ex.evaluate(rows, at))
        np.testing.assert_allclose(
            ex.evaluate(collected, at), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max()
        )


def test_simple_pendulum_is_the_textbook_equation():
    rows, angles, parameters = pendulum_chain(1)
    collected = collect(rows, angles, parameters)
    assert counts(collected, parameters) == (1, 3, 0)
    assert_same_values(rows, collected)


def test_double_pendulum_costs_what_an_expert_writes():
    rows, angles, parameters = pendulum_chain(2)
    collected = collect(rows, angles, parameters)
    trigonometric, simple, other = counts(collected, parameters)
    assert trigonometric <= 4
    assert simple <= 18 + 1
    assert other == 0
    assert_same_values(rows, collected)


@pytest.mark.parametrize("count", [2, 3, 5, 12])
@pytest.mark.parametrize("relative", [False, True])
def test_collecting_never_costs_more(count, relative):
    rows, angles, parameters = pendulum_chain(count, relative)
    collected = collect(rows, angles, parameters)
    assert cost(collected, parameters) <= cost(rows, parameters)
    assert_same_values(rows, collected)


def test_cart_and_pendulum():
    x, v, b, q, u, a, big, m, l, g = symbols("x v b q u a M m l g")
    positions = [x, x + l * ex.sin(q), -l * ex.cos(q)]
    velocities = ex.jvp(positions, {x: v, q: u})
    accelerations = ex.jvp(velocities, {x: v, q: u, v: b, u: a})
    forces = [big * accelerations[0], m * accelerations[1], m * (accelerations[2] + g)]
    rows = ex.vjp(velocities, forces, [v, u])
    collected = collect(rows, [q], [big, m, l, g])
    assert counts(collected, [big, m, l, g]) == (2, 13, 0)
    assert_same_values(rows, collected)


def test_spherical_pendulum():
    tilt, turn, p, w, a, b, m, l, g = symbols("tilt turn p w a b m l g")
    s = ex.sin(tilt)
    positions = [l * s * ex.cos(turn), l * s * ex.sin(turn), -l * ex.cos(tilt)]
    rates = {tilt: p, turn: w}
    velocities = ex.jvp(positions, rates)
    accelerations = ex.jvp(velocities, {**rates, p: a, w: b})
    forces = [m * accelerations[0], m * accelerations[1], m * (accelerations[2] + g)]
    rows = ex.vjp(velocities, forces, [p, w])
    collected = collect(rows, [tilt, turn], [m, l, g])
    trigonometric, simple, _ = counts(collected, [m, l, g])
    assert trigonometric == 2
    assert simple <= 16
    assert not any(ex.depends_on(row, [turn]) for row in collected)
    assert_same_values(rows, collected)


def test_linear_systems_get_combined_constants():
    x, y, a, b, m, n, k, c = symbols("x y a b m n k c")
    rows = [m * a + k * x - c * (y - x) + n * a, n * b + c * (y - x) - c * y * 0.5]
    collected = collect(rows, [], [m, n, k, c])
    assert counts(collected, [m, n, k, c]) == (0, 10, 0)
    assert_same_values(rows, collected)


def test_terms_that_cancel_disappear():
    q, r, u, p, s = symbols("q r u p s")
    rows = [
        (p + s) * u - p * u - u * s,
        ex.sin(q) * ex.cos(r) - ex.cos(q) * ex.sin(r) - ex.sin(q - r),
        u * ex.cos(q) ** 2 + u * ex.sin(q) ** 2 - u,
        ex.sin(2 * q) - 2 * ex.sin(q) * ex.cos(q),
        0.3 * u * (0.7 * p) - 0.7 * (u * 0.3) * p,
    ]
    assert all(row.is_zero for row in collect(rows, [q, r], [p, s]))


def test_squares_of_other_arguments_are_joined():
    t, u, p = symbols("t u p")
    wave = p * t
    [row] = collect([u * ex.cos(wave) ** 2 + u * ex.sin(wave) ** 2], [], [p])
    assert row is u


def test_differences_of_angles_are_recognised_on_input():
    q, r, u = symbols("q r u")
    [row] = collect([ex.cos(q - r) * u + (ex.cos(q) * ex.cos(r) + ex.sin(q) * ex.sin(r)) * u], [q, r], [])
    assert counts([row], []) == (1, 3, 0)
    assert_same_values([ex.cos(q - r) * u * 2], [row])


def test_divisors_stay_what_they_were():
    x, y, u, p = symbols("x y u p")
    length = ex.sqrt(x * x + y * y)
    rows = [p * x / length + p * 2 * u / length, x / (p + 1) + u / (p + 1), ex.select(x < y, x, y) * p + x * p]
    collected = collect(rows, [], [p])
    divisors = {node.arguments[1] for node in ex.live(collected) if node.operation == "div"}
    assert divisors <= {length, p + 1}
    assert cost(collected, [p]) < cost(rows, [p])
    assert_same_values(rows, collected)


def test_what_is_too_large_or_not_finite_is_left_alone():
    q, u, p = symbols("q u p")
    rows = [(q + u + p) ** 8 * (u - 1) ** 3, q * float("inf") + u]
    assert collect(rows, [q], [p], limit=20) == rows
    assert collect([], [q], [p]) == []


def test_the_outcome_is_the_same_every_time():
    first, second = (to_sympy(collect(*pendulum_chain(3, relative=True))) for _ in range(2))
    assert first == second


@settings(derandomize=True, max_examples=60, deadline=None)
@given(graphs.recipes, graphs.values)
def test_random_expressions_keep_their_values(recipe, values):
    names, outputs = graphs.build(recipe)
    collected = collect(outputs, names[:1], names[2:])
    at = dict(zip(names, values, strict=True))
    np.testing.assert_allclose(ex.evaluate(collected, at), ex.evaluate(outputs, at), rtol=1e-9, atol=1e-9)
    assert cost(collected, names[2:]) <= cost(outputs, names[2:])


def test_a_parameter_times_an_angle_is_no_multiple_of_it():
    """As where a gear turns a wheel: neither whole nor known, so the cosine stays as it is."""
    graph = ex.Graph()
    a, b, u, ratio, length = (graph.symbol(name) for name in ("a", "b", "u", "ratio", "length"))
    geared = a + ratio * b
    rows = [
        (length * ex.cos(geared) * u) * ex.cos(a) + (length * ex.sin(geared) * u) * ex.sin(a) + ex.sin(ratio * b),
        ex.cos(ratio * b) * u - ex.cos(2.0 * b + a) * ex.cos(ratio * a + ratio * b),
    ]
    collected = collect(rows, [a, b], [ratio, length])
    assert_same_values(rows, collected)
