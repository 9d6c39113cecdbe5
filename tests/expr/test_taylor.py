"""Taylor coefficients: every operation against known series, and random programs against their own values."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.testing import assert_allclose

from atwood import expr as ex
from atwood.codegen.python.backend import compile_program
from atwood.errors import UnsupportedError
from atwood.expr.series.taylor import TaylorPrograms, taylor_programs

from .graphs import follow, recipes

Scalars = Sequence[Any]


def programs_of(
    rates: Callable[[Any, Scalars, Scalars], Scalars], size: int, parameters: int = 0, **options: Any
) -> TaylorPrograms:
    """Return the recurrences of a system given as a function of (t, x, p)."""
    graph = ex.Graph()
    time = graph.symbol("t")
    states = [graph.symbol(f"q:x{i}.value") for i in range(size)]
    fixed = [graph.parameter(f"p{i}") for i in range(parameters)]
    values = [graph.convert(value) for value in rates(time, states, fixed)]
    return taylor_programs("system", time, states, values, fixed, **options)


def expand(
    programs: TaylorPrograms, t: float, x: Sequence[float], order: int, p: Sequence[float] = (), unit: float = 1.0
) -> Any:
    """Return the coefficients of the state up to an order, one row each."""
    rates, known = compile_program(programs.start).bind(p)([t], x)
    kernel = compile_program(programs.order).bind(known)
    series = np.zeros((order + 1, len(x)))
    series[0], series[1] = x, unit * np.array(rates)
    left, right = np.zeros((order, programs.pairs)), np.zeros((order, programs.pairs))
    squares = np.zeros((order, programs.squares))
    for k in range(1, order):
        sums = [sum(a[j] * b[k - j] for j in range(1, k)) + 0.0 * a[0] for a, b in ((left, right), (squares, squares))]
        numbers = [k, 1.0 / k, unit / (k + 1), unit if k == 1 else 0.0]
        left[k], right[k], squares[k], series[k + 1] = kernel(*sums, numbers, series[k])
    return series


def series_of(function: Callable[[Any], Any], t: float, order: int) -> Any:
    """Return the coefficients of a function of time around a time."""
    found = expand(programs_of(lambda time, x, p: [function(time)], 1), t, [0.0], order + 1)[1:, 0]
    return found * np.arange(1.0, order + 2.0)  # those of x, whose rate it is


def binomial(power: float, order: int) -> Any:
    """Return the coefficients of (1 + t)^power."""
    return np.cumprod([1.0, *((power - k) / (k + 1) for k in range(order))])


K = np.arange(13)
ARCSINE = np.array([0, 1, 0, 1 / 6, 0, 3 / 40, 0, 15 / 336, 0, 105 / 3456, 0, 945 / 42240, 0])
FACTORIALS = np.array([math.factorial(int(k)) for k in K], dtype=float)
KNOWN = {
    "exp": (ex.exp, 0.0, 1.0 / FACTORIALS),
    "sin": (ex.sin, 0.0, np.where(K % 2, np.where(K % 4 == 1, 1.0, -1.0), 0.0) / FACTORIALS),
    "cos": (ex.cos, 0.0, np.where(K % 2, 0.0, np.where(K % 4 == 0, 1.0, -1.0)) / FACTORIALS),
    "sinh": (ex.sinh, 0.0, (K % 2) / FACTORIALS),
    "cosh": (ex.cosh, 0.0, (1 - K % 2) / FACTORIALS),
    "log": (ex.log, 1.0, np.array([0.0, *(-((-1.0) ** k) / k for k in range(1, 13))])),
    "atan": (ex.atan, 0.0, np.array([math.sin(k * math.pi / 2) / max(k, 1) for k in range(13)])),
    "asin": (ex.asin, 0.0, ARCSINE),
    "acos": (ex.acos, 0.0, (K == 0) * math.pi / 2 - ARCSINE),
    "tan": (ex.tan, 0.0, np.array([0, 1, 0, 1 / 3, 0, 2 / 15, 0, 17 / 315, 0, 62 / 2835, 0, 1382 / 155925, 0])),
    "tanh": (ex.tanh, 0.0, np.array([0, 1, 0, -1 / 3, 0, 2 / 15, 0, -17 / 315, 0, 62 / 2835, 0, -1382 / 155925, 0])),
    "sqrt": (ex.sqrt, 1.0, binomial(0.5, 12)),
    "a power": (lambda t: t**1.7, 1.0, binomial(1.7, 12)),
    "a negative power": (lambda t: t**-3, 1.0, binomial(-3.0, 12)),
    "a root below": (lambda t: t**-0.5, 1.0, binomial(-0.5, 12)),
    "a quotient": (lambda t: t / (1.0 + t), 0.0, np.array([0.0, *(-((-1.0) ** k) for k in range(1, 13))])),
    "a reciprocal": (lambda t: 3.0 / (1.0 + t), 0.0, 3.0 * (-1.0) ** K),
    "a square": (lambda t: (1.0 + 2.0 * t) ** 2, 0.0, np.array([1.0, 4.0, 4.0, *[0.0] * 10])),
    "a variable power": (lambda t: ex.exp(t) ** t, 0.0, np.array([(1 - k % 2) / math.gamma(k / 2 + 1) for k in K])),
    "an angle": (lambda t: ex.atan2(t, 1.0), 0.0, np.array([math.sin(k * math.pi / 2) / max(k, 1) for k in range(13)])),
    "another angle": (lambda t: ex.atan2(2.0 * ex.sin(t), 2.0 * ex.cos(t)), 0.3, np.array([0.3, 1.0, *[0.0] * 11])),
}  # fmt: skip


@pytest.mark.parametrize("name", KNOWN)
def test_known_series(name: str) -> None:
    function, t, expected = KNOWN[name]
    assert_allclose(series_of(function, t, 12), expected, rtol=1e-13, atol=1e-14)


def test_a_sum_of_squares_of_sine_and_cosine_is_one() -> None:
    def function(t: Any) -> Any:
        inner = 0.4 + 0.7 * t - 0.2 * t * t
        return ex.sin(inner) * ex.sin(inner) + ex.cos(inner) * ex.cos(inner)

    assert_allclose(series_of(function, 0.9, 12), [1.0, *[0.0] * 12], atol=1e-14)


def test_linear_systems() -> None:
    def function(t: Any, x: Scalars, p: Scalars) -> Scalars:
        matrix = [[2.0 + t, ex.sin(t), 0.0], [1.0, 3.0, ex.exp(t)], [t * t, 0.0, 4.0]]
        right = [ex.cos(t), 1.0, t]
        a = ex.solve(matrix, right)
        # what is left over is zero at every order
        rest = [
            sum((m * v for m, v in zip(row, a, strict=True)), start=-b) for row, b in zip(matrix, right, strict=True)
        ]
        return [*a, *rest]

    series = expand(programs_of(function, 6), 0.4, [0.0] * 6, 12)
    assert_allclose(series[1:, 3:], 0.0, atol=1e-13)
    h = 0.05
    slopes = sum(k * series[k, :3] * h ** (k - 1) for k in range(1, 13))
    t = 0.4 + h
    matrix = np.array([[2.0 + t, math.sin(t), 0.0], [1.0, 3.0, math.exp(t)], [t * t, 0.0, 4.0]])
    assert_allclose(slopes, np.linalg.solve(matrix, [math.cos(t), 1.0, t]), rtol=1e-13)


@settings(max_examples=150, deadline=None)
@given(recipes)
def test_random_programs(recipe: list[tuple[int, int, int]]) -> None:
    """The series of what a program gives along a path is what it gives on the path."""
    path = [lambda t: 0.3 + t, lambda t: 0.8 - 0.5 * t, lambda t: 0.2 + 0.1 * t * t]
    programs = programs_of(lambda t, x, p: follow(recipe, [one(t) for one in path]), 2)
    h, order = 0.01, 14
    series = expand(programs, 0.0, [0.0, 0.0], order)
    slopes = sum(k * series[k] * h ** (k - 1) for k in range(1, order + 1))
    exact = follow(recipe, [one(h) for one in path])
    largest = max(abs(k * series[k, i]) * h ** (k - 1) for k in range(1, order + 1) for i in (0, 1))
    last = np.max(np.abs(series[-3:]) * h ** np.arange(order - 2, order + 1)[:, None]) * 1e3
    assert_allclose(slopes, exact, rtol=0.0, atol=1e-11 * max(largest, 1.0) + last)


def test_the_unit_of_time_only_scales() -> None:
    programs = programs_of(lambda t, x, p: [x[1], -p[0] * ex.sin(x[0]) + ex.cos(t)], 2, 1)
    one, other = (expand(programs, 0.2, [1.0, 0.5], 10, [9.81], unit) for unit in (1.0, 1e-3))
    assert_allclose(other, one * 1e-3 ** np.arange(11)[:, None], rtol=1e-12)


def test_factors_that_do_not_change_cost_no_convolution() -> None:
    def rates(t: Any, x: Scalars, p: Scalars) -> Scalars:
        s = ex.sin(x[0])
        return [p[0] * s * (p[1] * x[1]) - x[1] * (3.0 * s), (p[0] * x[1]) * (-x[1]) + x[1] * x[1] / p[1]]

    programs = programs_of(rates, 2, 2)
    # sine and cosine, sine times x1, the square of x1
    assert (programs.pairs, programs.squares) == (3, 1)
    alone = programs_of(rates, 2, 2, lanes=4)
    assert (alone.pairs, alone.squares) == (4, 0)


def test_a_division_by_what_many_divide_by_is_one_convolution_each() -> None:
    def rates(t: Any, x: Scalars, p: Scalars) -> Scalars:
        inverse = 1.0 / x[0]
        return [inverse * x[1], inverse * x[2], 1.0]

    assert programs_of(rates, 3).pairs == 2


SMOOTH_IN_TIME: dict[str, Callable[[Any], Any]] = {
    "select": lambda t: ex.select(t > 1.0, ex.sin(t), t),
    "minimum": lambda t: ex.minimum(ex.sin(t), 2.0 * t),
    "maximum": lambda t: ex.maximum(ex.cos(t), 0.0),
    "absolute": lambda t: abs(t - 1.0) * t,
    "sign": lambda t: ex.sign(t - 1.0) * t,
}


@pytest.mark.parametrize("name", SMOOTH_IN_TIME)
@pytest.mark.parametrize("t", [0.3, 1.3])
def test_what_switches_by_the_clock_is_smooth_between(name: str, t: float) -> None:
    function = SMOOTH_IN_TIME[name]
    series, h = series_of(function, t, 14), 0.05
    assert sum(c * h**k for k, c in enumerate(series)) == pytest.approx(function(t + h), rel=1e-13)


SWITCHES: dict[str, Callable[[Any], Any]] = {
    "a condition": lambda x: ex.select(x > 1.0, x, 2.0),
    "smaller": lambda x: ex.minimum(x, 2.0),
    "larger": lambda x: ex.maximum(2.0, x),
    "absolute": lambda x: abs(x),
    "sign": lambda x: ex.sign(x) * x,
}


@pytest.mark.parametrize("words", SWITCHES)
def test_what_switches_with_the_motion_is_refused(words: str) -> None:
    with pytest.raises(UnsupportedError, match=words) as refused:
        programs_of(lambda t, x, p: [SWITCHES[words](x[0])], 1)
    assert refused.value.where == "x0.value"


def test_what_switches_with_parameters_is_not() -> None:
    programs = programs_of(lambda t, x, p: [ex.select(p[0] > 0.0, x[0], -x[0] * x[0])], 1, 1)
    assert_allclose(expand(programs, 0.0, [1.0], 6, [1.0])[:, 0], 1.0 / FACTORIALS[:7], rtol=1e-14)
    assert_allclose(expand(programs, 0.0, [1.0], 6, [-1.0])[:, 0], (-1.0) ** np.arange(7), rtol=1e-14)


def test_functions_that_the_graph_does_not_look_into_are_refused() -> None:
    drag = ex.ExternalFunction("drag curve", lambda v: v * v)
    with pytest.raises(UnsupportedError, match="drag curve"):
        programs_of(lambda t, x, p: [ex.external(drag, x[0])], 1)
