"""Records of methods, and the coefficients and steps of every embedded pair."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ellipj, ellipk

from atwood import simulate
from atwood.errors import UsageError
from atwood.integrators.embedded.stepper import CompiledStepper
from atwood.integrators.embedded.tableau import Tableau
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.methods import METHODS, Method
from atwood.integrators.protocol import Budget, ExplicitProblem, SolverOptions, Status
from atwood.integrators.symplectic.composition import ORDERS as COMPOSITIONS
from atwood.integrators.symplectic.gauss import ORDERS
from atwood.integrators.taylor.stepper import HIGHEST, LOWEST
from atwood_library.scenes import SCENES

from .embedded_reference import ReferenceStepper, matrix

FloatArray = Any
PAIRS = {key: one.tableau for key, one in METHODS.items() if one.tableau is not None}


@pytest.fixture(params=METHODS)
def method(request: Any) -> Method:
    """Each test runs with each method."""
    return METHODS[request.param]


@pytest.fixture(params=PAIRS)
def pair(request: Any) -> Tableau:
    """Each test runs with each embedded pair."""
    return PAIRS[request.param]


# -- records ------------------------------------------------------------------------------------------------------


def test_records_are_whole(method: Method) -> None:
    assert METHODS[method.key] is method
    assert method.citation
    assert method.title
    assert method.orders == tuple(sorted(method.orders))
    assert 0.0 < method.steps_seen < method.steps_unseen
    assert 0.0 < method.least_tolerance <= method.loosest_tolerance <= 1.0


def test_orders_of_records_are_those_that_the_methods_have() -> None:
    assert METHODS["taylor"].orders == tuple(range(LOWEST, HIGHEST + 1))
    assert METHODS["gauss"].orders == ORDERS
    assert METHODS["composition"].orders == COMPOSITIONS


def test_a_name_that_is_nearly_one_leads_to_it(method: Method) -> None:
    with pytest.raises(UsageError, match=f"Did you mean '{method.key}'|{method.key}"):
        simulate(SCENES["simple-pendulum"](), solver=f"{method.key}x")


# -- coefficients -------------------------------------------------------------------------------------------------


def trees(order: int) -> list[tuple[Any, ...]]:
    """Return the rooted trees of an order, as sorted tuples of their branches."""
    if order == 1:
        return [()]
    found = set()
    for parts in partitions(order - 1):
        found |= {tuple(sorted(one)) for one in product(*(trees(part) for part in parts))}
    return sorted(found)


def partitions(total: int, largest: int | None = None) -> list[list[int]]:
    """Return the ways to write a number as a sum of others."""
    if total == 0:
        return [[]]
    first = range(min(total, largest or total), 0, -1)
    return [[one, *rest] for one in first for rest in partitions(total - one, one)]


def size_of(tree: tuple[Any, ...]) -> int:
    return 1 + sum(map(size_of, tree))


def density(tree: tuple[Any, ...]) -> int:
    return size_of(tree) * math.prod(map(density, tree))


def elementary(tree: tuple[Any, ...], weights: FloatArray) -> FloatArray:
    """Return the elementary weights of a tree at each stage."""
    return math.prod((weights @ elementary(branch, weights) for branch in tree), start=np.ones(len(weights)))


def test_pairs_fulfil_the_conditions_of_their_orders(pair: Tableau) -> None:
    """Of all rooted trees up to the order; Butcher's theorem."""
    stages = len(pair.nodes)
    weights = matrix(({}, *pair.stages), stages)
    assert_allclose(weights.sum(axis=1), pair.nodes, atol=3e-14)
    own = weights[pair.end]
    for order in range(1, pair.order + 1):
        for tree in trees(order):
            assert own @ elementary(tree, weights) == pytest.approx(1.0 / density(tree), abs=3e-13), tree


def test_estimates_have_lower_orders(pair: Tableau) -> None:
    stages = len(pair.nodes)
    weights, nodes = matrix(({}, *pair.stages), stages), np.array(pair.nodes)
    for errors in matrix(pair.errors, stages):
        assert abs(errors.sum()) < 1e-14
        order = next(k for k in range(1, pair.order + 1) if abs(errors @ nodes**k) > 1e-6)
        assert order in (3, 4, 5)
        for lower in range(1, order + 1):
            for tree in trees(lower):
                assert errors @ elementary(tree, weights) == pytest.approx(0.0, abs=1e-13), tree


def test_dense_output_fulfils_the_conditions_of_its_order(pair: Tableau) -> None:
    stages = len(pair.nodes)
    weights = matrix(({}, *pair.stages), stages)
    begin, end = np.eye(stages)[0], np.eye(stages)[pair.end]
    step = weights[pair.end]
    rows = [step, begin - step, 2.0 * step - begin - end, *matrix(pair.dense, stages)]
    for share in (0.2, 0.5, 0.9):
        found = np.zeros(stages)
        for power in reversed(range(len(rows))):
            found = (found + rows[power]) * (1.0 - share if power % 2 else share)
        for order in range(1, pair.dense_order + 1):
            for tree in trees(order):
                expected = share**order / density(tree)
                assert found @ elementary(tree, weights) == pytest.approx(expected, abs=2e-12), tree


def test_pairs_are_stable_up_to_their_edge(pair: Tableau) -> None:
    """On ``y' = -z y`` with a step of one; a little beyond, they are not."""
    weights = matrix(({}, *pair.stages), len(pair.nodes))

    def growth(z: float) -> float:
        slopes = np.zeros(pair.end)
        for stage in range(pair.end):
            slopes[stage] = -z * (1.0 + weights[stage, :stage] @ slopes[:stage])
        return float(abs(1.0 + weights[pair.end, : pair.end] @ slopes))

    assert all(growth(z) <= 1.0 + 1e-12 for z in np.linspace(0.01, pair.edge, 200))
    assert growth(1.1 * pair.edge) > 1.0


# -- embedded pairs -----------------------------------------------------------------------------------------------


def time_dependent(t: float, y: FloatArray) -> list[float]:
    return [y[1] + math.cos(t), -y[0] * y[1] * math.exp(-t), math.sin(y[0] * t)]


def opened(
    pair: Tableau, rates: Any, options: SolverOptions, y: list[float], reference: bool = False
) -> ExplicitSession:
    problem, kind = ExplicitProblem(len(y), rates), ReferenceStepper if reference else CompiledStepper
    return ExplicitSession(problem, options, kind(problem, options, pair), 0.0, np.array(y))


def test_observed_orders_of_steps_and_of_dense_output(pair: Tableau) -> None:
    ends, between = [], []
    for steps in (8, 16, 32):
        h = 8.0 / steps
        options = SolverOptions(0.5, 1e6, first_step=h, max_step=h)
        session = opened(pair, lambda t, y: [y[1], -y[0]], options, [1.0, 0.0])
        first = [session.advance(share * h).y[0] - math.cos(share * h) for share in (0.3, 0.5, 0.8)]
        between.append(max(map(abs, first)))
        found = session.advance(8.0).y
        ends.append(math.hypot(found[0] - math.cos(8.0), found[1] + math.sin(8.0)))
    orders = np.log2(np.array(ends[:-1]) / ends[1:])
    assert np.all((orders > pair.order - 0.4) & (orders < pair.order + 1.2)), orders
    assert math.log2(between[0] / between[1]) > pair.dense_order + 0.5  # within one step, h^(p + 1)


def test_compiled_steps_are_those_of_the_reference(pair: Tableau) -> None:
    options = SolverOptions(1e-8, 1e-8, horizon=6.0)
    one, other = (opened(pair, time_dependent, options, [1.0, 0.5, 0.2], kind) for kind in (False, True))
    for t in np.linspace(0.5, 6.0, 12):
        assert_allclose(one.advance(float(t)).y, other.advance(float(t)).y, atol=2e-10)
    assert abs(one.statistics.steps - other.statistics.steps) <= 0.02 * other.statistics.steps + 1


def test_errors_follow_the_tolerance(pair: Tableau) -> None:
    k, errors, tolerances = math.sin(1.0), [], [1e-4, 1e-6, 1e-8]
    sn, *_ = ellipj(ellipk(k * k) + 9.0, k * k)
    for tolerance in tolerances:
        session = opened(pair, lambda t, y: [y[1], -math.sin(y[0])], SolverOptions(tolerance, tolerance), [2.0, 0.0])
        errors.append(abs(session.advance(9.0).y[0] - 2.0 * math.asin(k * sn)))
    assert all(error < 300.0 * tolerance for error, tolerance in zip(errors, tolerances, strict=True))
    assert errors[0] > 1e3 * errors[2]


def test_stiffness_is_noticed(pair: Tableau) -> None:
    def stiff(t: float, y: FloatArray) -> list[float]:
        return [-2000.0 * (y[0] - math.cos(t)), -y[1]]

    left = []
    options = SolverOptions(1e-6, 1e-6)
    problem = ExplicitProblem(2, stiff)
    stepper = CompiledStepper(problem, options, pair)
    session = ExplicitSession(
        problem, options, stepper, 0.0, np.ones(2), Budget(), on_stiff=lambda t, y: bool(left.append(t) or True)
    )
    assert session.advance(10.0).status is Status.STIFF
    assert left[0] < 1.0
