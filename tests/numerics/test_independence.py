"""Rank by propagated errors: what rounding made does not count, what is small but known does."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import StartError, simulate
from atwood.codegen.rounding import ROUGHNESS, WAYS, RoughProgram, roughly
from atwood.expr import Graph, InputGroup, OutputGroup, Program, cos, sin
from atwood.numerics.matrices import least_norm, least_size
from atwood.numerics.rank import certain, independent_rows, open_directions, review_rows, row_scales
from atwood.numerics.sparse import csr_of
from atwood_library.scenes import FourBar

EPS = float(np.finfo(float).eps)
EXACT = np.zeros(3)


def random_rows(rows: int, columns: int, rank: int, seed: int = 7) -> np.ndarray:
    random = np.random.default_rng(seed)
    return random.standard_normal((rows, rank)) @ random.standard_normal((rank, columns))


# -- rows that are independent ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("rank", [1, 4, 6])
def test_products_have_the_rank_of_their_factors(rank: int) -> None:
    rows = random_rows(9, 8, rank)
    errors = 16.0 * EPS * np.linalg.norm(rows, axis=1)
    kept = independent_rows(rows, errors)
    assert kept == list(range(rank))  # the first ones; those after them follow
    assert np.linalg.matrix_rank(rows[kept]) == rank


def test_rows_that_are_rounding_count_as_zero_whatever_their_size() -> None:
    rows = np.array([[1.0, 2.0, 0.0], [3e-17, -1e-17, 2e-17], [0.0, 1.0, 1.0]])
    assert independent_rows(rows, np.array([4e-15, 4e-16, 4e-15])) == [0, 2]
    far = 1e6 * rows  # the same in other units
    assert independent_rows(far, 1e6 * np.array([4e-15, 4e-16, 4e-15])) == [0, 2]


def test_rows_that_are_small_and_known_are_independent() -> None:
    rows = np.array([[1.0, 2.0, 0.0], [3e-17, -1e-17, 2e-17], [0.0, 1.0, 1.0]])
    assert independent_rows(rows, EXACT) == [0, 1, 2]
    assert independent_rows(rows, np.array([4e-15, 4e-31, 4e-15])) == [0, 1, 2]


@pytest.mark.parametrize(("share", "expected"), [(1.2, [0]), (1.7, [0, 1])])
def test_what_counts_is_what_errors_do_not_account_for(share: float, expected: list[int]) -> None:
    """Both rows are off by as much, so what is left of the second may be off by the root of two as much."""
    error = 1e-6
    left = share * certain(np.array([error]), np.array([1.0]))[0]
    assert independent_rows(np.array([[1.0, 0.0], [1.0, left]]), np.array([error, error])) == expected


def test_errors_of_the_rows_before_count() -> None:
    """A row that all but follows from two small ones has their errors many times."""
    rows = np.array([[1.0, 1e-3, 0.0], [1.0, -1e-3, 0.0], [0.0, 1.0, 1e-9]])
    known = np.full(3, 1e-14)
    assert independent_rows(rows, known) == [0, 1, 2]
    assert len(independent_rows(rows, np.array([1e-12, 1e-12, 1e-14]))) == 2


def test_columns_of_any_scale() -> None:
    rows = random_rows(5, 6, 4, seed=3) * np.logspace(-5, 5, 6)
    errors = 16.0 * EPS * np.linalg.norm(rows, axis=1)
    assert len(independent_rows(rows[:4], errors[:4])) == 4
    assert independent_rows(rows, errors) == [0, 1, 2, 3]


def test_rank_does_not_depend_on_the_order_of_rows() -> None:
    random = np.random.default_rng(11)
    rows = np.vstack([random_rows(4, 8, 4), 1e-9 * random_rows(2, 8, 2, seed=8), 1e-16 * random_rows(3, 8, 3, seed=9)])
    rows[3] = rows[0] + 1e-7 * rows[1] - rows[2]
    errors = np.array([1e-15] * 4 + [1e-20] * 2 + [1e-15] * 3)
    for _ in range(20):
        order = random.permutation(len(rows))
        assert len(independent_rows(rows[order], errors[order])) == 5


def test_the_first_are_kept_but_not_those_that_hardly_change() -> None:
    strong = np.array([[1.0, 0.0], [0.9, 0.0], [0.0, 1.0]])
    assert independent_rows(strong, 1e-15 * np.ones(3)) == [0, 2]
    weak = np.array([[1e-6, 0.0], [1.0, 0.0], [0.0, 1.0]])  # all three from terms of size one
    assert independent_rows(weak, 4e-15 * np.ones(3)) == [1, 2]
    assert independent_rows(weak, 4e-15 * np.ones(3), first=np.array([True, False, False])) == [0, 2]


def test_no_more_than_asked_for() -> None:
    assert independent_rows(np.diag([1.0, 0.5, 1e-8]), 1e-15 * np.ones(3), most=2) == [0, 1]
    assert independent_rows(np.diag([1e-8, 0.5, 1.0]), 1e-15 * np.ones(3), most=2) == [1, 2]
    assert independent_rows(np.zeros((2, 3)), np.zeros(2)) == []
    assert independent_rows(np.zeros((0, 3)), np.zeros(0)) == []


def test_large_matrices_are_decided_alike() -> None:
    rows = np.array([[1.0, 2.0, 0.0], [3e-17, -1e-17, 2e-17], [0.0, 1.0, 1.0]])
    at = np.nonzero(rows)
    matrix = csr_of(*at, rows[at], rows.shape)
    assert independent_rows(matrix, np.array([4e-15, 4e-16, 4e-15])) == [0, 2]


# -- sizes and directions ---------------------------------------------------------------------------------------------


def test_rows_are_measured_by_their_size_if_it_is_known() -> None:
    slope, scales = np.array([[2.0, 4.0], [1e-17, 0.0], [0.0, 0.0]]), np.array([1.0, 0.5])
    found = row_scales(slope, scales, np.array([1e-15, 1e-15, 0.0]))
    assert found == pytest.approx([2.0, 1e-4, 1.0])


def test_what_rounding_leaves_moves_nothing() -> None:
    """A row of rounding with a value of rounding would ask for a displacement of size one."""
    slope, value = np.array([[1.0, 1.0], [2e-17, -1e-17]]), np.array([1e-3, 1e-17])
    rows = row_scales(slope, np.ones(2), np.array([4e-15, 4e-16]))
    step = least_norm(slope / rows[:, None], value / rows)
    np.testing.assert_allclose(step, [5e-4, 5e-4], atol=1e-12)


def test_open_directions() -> None:
    rows = np.array([[1e-8, 0.0, 0.0], [0.0, 1e4, 1e4]])
    np.testing.assert_allclose(np.abs(open_directions(rows)), [[0.0, 0.5**0.5, 0.5**0.5]], atol=1e-15)
    near = np.array([[1.0, 0.0], [1.0, 1e-9]])
    assert len(open_directions(near)) == 0
    assert len(open_directions(near, 1e-6)) == 1
    assert len(open_directions(np.zeros((0, 3)))) == 3


# -- which rows are kept ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("angle", "kept"), [(0.0, [0, 2]), (1.1, [0, 2]), (1.4, [1, 2]), (1.5707963267948966, [1, 2])])
@pytest.mark.parametrize("sparse", [False, True])
def test_other_rows_are_kept_where_a_choice_has_become_poor(angle: float, kept: list[int], sparse: bool) -> None:
    """A component along a direction that turns away, by more than three times the other one at 1.25 rad."""
    rows = np.array([[np.cos(angle), 0.0, 0.0], [np.sin(angle), 0.0, 0.0], [0.0, 1.0, 1.0]])
    at = np.nonzero(rows)
    matrix = csr_of(*at, rows[at], rows.shape) if sparse else rows
    assert review_rows(matrix, 4e-15 * np.ones(3), [0, 2]) == kept


def test_rounding_is_never_kept_in_place_of_a_row() -> None:
    rows = np.array([[1.0, 0.0], [1e-17, 3e-17], [0.0, 1.0]])
    assert review_rows(rows, 4e-15 * np.ones(3), [0, 2]) == [0, 2]
    assert review_rows(rows[[0, 2]], 4e-15 * np.ones(2), [0, 1]) == [0, 1]


def test_multipliers_of_least_size() -> None:
    random = np.random.default_rng(2)
    slope = np.stack([random_rows(7, 9, 4, seed) for seed in (1, 2, 3)])
    kept, found = np.array([0, 2, 3, 6]), random.standard_normal((3, 4))
    every = least_size(slope, kept, found)
    for rows, some, all_ in zip(slope, found, every, strict=True):
        expected = np.linalg.lstsq(rows.T, rows[kept].T @ some, rcond=1e-9)[0]
        np.testing.assert_allclose(all_, expected, atol=1e-11)
    assert least_size(slope, np.zeros(0, dtype=np.intp), np.zeros((3, 0))) == pytest.approx(np.zeros((3, 7)))


def test_a_row_that_changes_a_tenth_as_much_comes_first_still() -> None:
    rows = np.array([[0.1, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert independent_rows(rows, 4e-15 * np.ones(3)) == [0, 2]
    rows[0, 0] = 0.01
    assert independent_rows(rows, 4e-15 * np.ones(3)) == [1, 2]


@pytest.mark.parametrize(("weight", "share", "kept"), [(0.5, 1.05, 1), (0.5, 1.2, 2), (2.0, 2.1, 1), (2.0, 2.4, 2)])
def test_errors_of_other_rows_count_as_often_as_these_are_in_a_row(weight: float, share: float, kept: int) -> None:
    """What is left is off by the root of 1 + weight^2."""
    error = 1e-6
    left = share * certain(np.array([error]), np.array([1.0]))[0]
    rows = np.array([[1.0, 0.0], [weight, left]])
    assert len(independent_rows(rows, np.array([error, error]), first=np.array([True, False]))) == kept


def test_once_a_choice_is_poor_it_is_improved_as_far_as_it_goes() -> None:
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [4.0, 0.0], [0.0, 2.0]])
    assert review_rows(rows, 4e-15 * np.ones(4), [0, 1]) == [2, 3]
    rows[2, 0] = 2.9
    assert review_rows(rows, 4e-15 * np.ones(4), [0, 1]) == [0, 1]
    rows[3, 1] = 1.4
    rows[2, 0] = 3.1
    assert review_rows(rows, 4e-15 * np.ones(4), [0, 1]) == [1, 2]


def test_rows_are_weighed_by_the_terms_that_they_are_computed_from() -> None:
    """In other units the same row is a thousand times as large, and so is its error."""
    rows = np.array([[1e-3, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert review_rows(rows, np.array([4e-18, 4e-15, 4e-15]), [0, 2]) == [0, 2]
    assert review_rows(rows, np.array([4e-15, 4e-15, 4e-15]), [0, 2]) == [1, 2]


def test_rows_of_large_matrices_that_are_all_independent() -> None:
    rows = np.hstack([np.eye(3), 0.5 * np.eye(3)])
    at = np.nonzero(rows)
    assert independent_rows(csr_of(*at, rows[at], rows.shape), 1e-15 * np.ones(3)) == [0, 1, 2]
    assert independent_rows(csr_of(*at, rows[at], rows.shape), 1e-15 * np.ones(3), most=2) == [0, 1]


def test_rows_of_any_size_leave_the_same_directions_open() -> None:
    rows = np.array([[1e-9, 0.0, 0.0], [0.0, 1.0, 0.0]])
    for least in (0.0, 1e-6):
        np.testing.assert_allclose(np.abs(open_directions(rows, least)), [[0.0, 0.0, 1.0]], atol=1e-15)
    assert len(open_directions(np.array([[0.0, 0.0], [0.0, 1.0]]), 1e-6)) == 1


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_system_that_is_not_finite_is_refused(bad: float) -> None:
    matrix, right = np.eye(2), np.ones(2)
    np.testing.assert_allclose(least_norm(matrix, right), right)
    for wrong, other in ((matrix + np.diag([bad, 0.0]), right), (matrix, np.array([1.0, bad]))):
        with pytest.raises(np.linalg.LinAlgError):
            least_norm(wrong, other)


def test_units_of_columns_change_no_multiplier() -> None:
    slope = random_rows(5, 6, 3)[None]
    kept, found = np.array([0, 1, 2]), np.array([[1.0, -2.0, 0.5]])
    plain = least_size(slope, kept, found)
    units = 10.0 ** np.array([-9.0, 9.0, 0.0, 5.0, -5.0, 2.0])
    np.testing.assert_allclose(least_size(slope * units, kept, found), plain, atol=1e-10)
    silent = np.concatenate([slope, np.zeros((1, 5, 1))], axis=2)  # a coordinate that no constraint depends on
    np.testing.assert_allclose(least_size(silent, kept, found), plain, atol=1e-12)


# -- rough arithmetic -------------------------------------------------------------------------------------------------


def spread_of(make, value: float) -> np.ndarray:  # type: ignore[no-untyped-def]
    graph = Graph()
    x, p = graph.symbol("x"), graph.symbol("p")
    results = make(x, p)
    program = Program("rough", (InputGroup("x", (x,)),), (p,), (OutputGroup("results", tuple(results)),))
    found = RoughProgram((program.parameters, *(one.symbols for one in program.inputs)), results)(
        np.array([3.0]), value * roughly(1)
    )
    assert found.shape == (len(results), WAYS)
    return np.ptp(found, axis=1)


def test_what_cancels_is_off_by_its_terms() -> None:
    far, near = spread_of(lambda x, p: (x - p, x + p), 3.0 + 1e-9)
    assert 2.0 * ROUGHNESS < far < 40.0 * ROUGHNESS  # terms of size three
    assert 2.0 * ROUGHNESS < near < 80.0 * ROUGHNESS
    (one,) = spread_of(lambda x, p: (sin(x) * sin(x) + cos(x) * cos(x) - 1.0,), 0.7)
    assert 0.1 * ROUGHNESS < one < 10.0 * ROUGHNESS


def test_what_is_exact_stays_exact() -> None:
    zero, half = spread_of(lambda x, p: (x * 0.0 + 0.5 * (p - p), x.graph.convert(0.5)), 2.0)
    assert zero == half == 0.0
    third = spread_of(lambda x, p: (x.graph.convert(1.0 / 3.0) + 0.0 * x,), 2.0)[0]
    assert 0.0 < third < 4.0 * ROUGHNESS  # no number of the machine's is a third


def test_ways_of_rounding_are_the_same_each_time_and_differ() -> None:
    factors = roughly(200)
    np.testing.assert_array_equal(factors, roughly(200))
    assert set(np.unique(factors)) == {1.0 - ROUGHNESS, 1.0 + ROUGHNESS}
    signs = np.sign(factors - 1.0)
    assert np.all(np.abs(np.mean(signs, axis=0)) < 0.3)
    alike = np.abs(signs.T @ signs) / len(signs) - np.eye(WAYS)
    assert np.max(alike) < 0.4


def test_a_constraint_on_velocities_takes_no_place_of_one_on_positions() -> None:
    """The second row takes the first ten times, but may not: a position that is not held would drift."""
    rows, exact = np.array([[0.1, 0.0], [1.0, 0.0], [0.0, 1.0]]), 4e-15 * np.ones(3)
    positions = np.array([True, False, False])
    assert review_rows(rows, exact, [0, 2]) == [1, 2]
    assert review_rows(rows, exact, [0, 2], positions) == [0, 2]
    assert independent_rows(rows, exact, first=positions) == [0, 2]


@pytest.mark.parametrize(("angle", "is_singular"), [(1e-12, True), (1e-9, True), (1e-8, True), (1e-6, False)])
def test_both_forms_call_the_same_starts_singular(angle: float, is_singular: bool) -> None:
    """Of a parallelogram in line: a row of the reduced form vanishes there, one of the dae form follows from others."""
    for form in ("reduced", "dae"):
        scene = FourBar(crank_length=1.0, coupler_length=2.0, rocker_length=1.0, frame_length=2.0)
        scene.start["crank.angle"] = angle
        scene.guess["coupler.angle"] = 0.0
        scene.guess["rocker.angle"] = angle
        if is_singular:
            with pytest.raises(StartError, match="the start is a singular position"):
                simulate(scene, form=form)
        else:
            assert simulate(scene, form=form, t_end=0.3, outputs=2).status == "finished"
