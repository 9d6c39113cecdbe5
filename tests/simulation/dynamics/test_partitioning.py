"""Coordinate partitioning: which coordinates follow from the others, and when another choice takes over."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from atwood.simulation.dynamics import redundancy as partitioning
from atwood.simulation.dynamics.redundancy import POOR, choose_dependent_coordinates, review_partitioning

ONES = np.ones(3)


def row(*entries: float) -> np.ndarray:
    return np.array([entries], dtype=float)


# -- the first choice --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("largest", range(4))
def test_one_constraint_takes_what_moves_it_most(largest: int) -> None:
    jacobian = row(*(3.0 if i == largest else -1.0 - 0.1 * i for i in range(4)))
    assert choose_dependent_coordinates(jacobian, np.ones(4)) == (largest,)
    assert choose_dependent_coordinates(-jacobian, np.ones(4)) == (largest,)


def test_coordinates_are_measured_by_their_sizes() -> None:
    assert choose_dependent_coordinates(row(1.0, 2.0, 3.0), np.array([10.0, 1.0, 1.0])) == (0,)
    assert choose_dependent_coordinates(row(10.0, 2.0, 3.0), np.array([0.1, 1.0, 1.0])) == (2,)


@pytest.mark.parametrize("units", [(1.0, 1.0), (1e-6, 1e6), (1e6, 1e-6), (1e-6, 1.0), (-1.0, 20.0)])
@pytest.mark.parametrize("scales", [(1.0, 1.0, 1.0), (10.0, 1.0, 0.1)])
def test_the_unit_of_a_constraint_decides_nothing(units: tuple[float, ...], scales: tuple[float, ...]) -> None:
    """The middle column is large in both rows, each by its largest entry; in the larger row alone it is not."""
    jacobian = np.array([[5.0, 4.0, 0.0], [0.0, 4.0, 5.0]]) / np.array(scales)
    assert choose_dependent_coordinates(jacobian * np.array(units)[:, None], np.array(scales)) == (0, 1)


def test_each_choice_is_taken_away_from_what_is_left_however_small_it_is() -> None:
    """After the first column two thirds of a unit are left of the others, of which two say the same."""
    columns = [(1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    assert choose_dependent_coordinates(np.array(columns).T, np.ones(4)) == (0, 1, 3)


def test_what_is_already_said_by_a_chosen_column_does_not_count_again() -> None:
    """The second column is the largest after the first and says the same; what is left of it is nothing."""
    jacobian = np.array([[2.0, 1.9, 0.0], [2.0, 1.9, 0.1]])
    assert choose_dependent_coordinates(jacobian, ONES) == (0, 2)


def test_columns_that_differ_by_little_are_told_apart() -> None:
    """After two columns that agree to 1e-7 what is left of a third is known to 1e-9 only if it is taken away twice."""
    close = 1e-7
    jacobian = np.array([[1.0, 1.0, 1.0], [0.0, close, 0.0], [0.0, 0.0, close**2]])
    jacobian = np.column_stack([jacobian, jacobian[:, 1] + [0.0, 0.0, 0.5 * close**2]])
    chosen = choose_dependent_coordinates(jacobian, np.ones(4))
    assert np.linalg.matrix_rank(jacobian[:, chosen] / np.array([1.0, close, close**2])[:, None]) == 3


def test_each_constraint_has_a_coordinate_even_where_one_says_nothing() -> None:
    assert choose_dependent_coordinates(np.zeros((1, 3)), ONES) == (0,)
    assert choose_dependent_coordinates(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]]), ONES) == (0, 2)
    assert choose_dependent_coordinates(np.zeros((0, 3)), ONES) == ()


def test_the_choice_is_in_order() -> None:
    assert choose_dependent_coordinates(np.array([[0.0, 0.0, 5.0], [4.0, 0.0, 0.0]]), ONES) == (0, 2)


# -- the review --------------------------------------------------------------------------------------------------------


def test_a_choice_stays_until_it_is_poor() -> None:
    for entry in (0.5, 1.0, 0.99 * POOR, -0.99 * POOR, POOR):
        assert review_partitioning(row(1.0, entry, 0.0), ONES, (0,)) == (0,)
    for entry in (1.01 * POOR, -1.01 * POOR, 100.0):
        assert review_partitioning(row(1.0, entry, 0.0), ONES, (0,)) == (1,)


def test_once_it_is_poor_it_becomes_as_good_as_can_be() -> None:
    """The exchange that was due leaves another entry above one, which by itself would not have been a reason."""
    jacobian = np.array([[1.0, 0.0, 2.0, 0.0], [0.0, 1.0, 0.0, 1.2]])
    assert review_partitioning(jacobian, np.ones(4), (0, 1)) == (2, 3)
    jacobian[0, 2] = 1.4
    assert review_partitioning(jacobian, np.ones(4), (0, 1)) == (0, 1)


def test_exchanges_end_where_they_gain_nothing() -> None:
    """An entry of just one and a hundredth would be exchanged back and forth for ever below that bound."""
    jacobian = np.array([[1.0, 0.0, 2.0, 0.0], [0.0, 1.0, 0.0, 1.009]])
    assert review_partitioning(jacobian, np.ones(4), (0, 1)) == (1, 2)


def test_sizes_of_coordinates_count_in_a_review() -> None:
    assert review_partitioning(row(1.0, 1.0, 1.0), np.array([1.0, 1.0, 4.0]), (0,)) == (2,)
    assert review_partitioning(row(1.0, 4.0, 1.0), np.array([1.0, 0.25, 1.0]), (0,)) == (0,)


def test_the_largest_entry_changes_places_first() -> None:
    assert review_partitioning(row(1.0, 2.0, 5.0), ONES, (0,)) == (2,)
    jacobian = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, 9.0]])
    assert review_partitioning(jacobian, ONES, (0, 1)) == (0, 2)


def test_a_choice_that_says_nothing_is_made_anew() -> None:
    assert review_partitioning(row(0.0, 1.0, 3.0), ONES, (0,)) == (2,)
    twice = np.array([[1.0, 1.0, 0.0, 0.2], [1.0, 1.0, 1.0, 0.0]])
    assert review_partitioning(twice, np.ones(4), (0, 1)) == (0, 2)


def test_where_no_choice_can_be_solved_the_first_best_is_left() -> None:
    assert review_partitioning(np.zeros((1, 3)), ONES, (0,)) == (0,)
    assert review_partitioning(np.zeros((1, 3)), ONES, (2,)) == (0,)
    unknown = row(np.nan, 1.0, 1.0)
    assert review_partitioning(unknown, ONES, (0,)) == choose_dependent_coordinates(unknown, ONES)


def test_without_a_free_coordinate_nothing_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    assert review_partitioning(np.array([[1e-3, 5.0], [1.0, 1.0]]), np.ones(2), (0, 1)) == (0, 1)
    assert review_partitioning(np.zeros((0, 2)), np.ones(2), ()) == ()
    monkeypatch.setattr(partitioning, "_weights", lambda *_: pytest.fail("nothing was to be weighed"))
    assert review_partitioning(np.array([[1e-3, 5.0], [1.0, 1.0]]), np.ones(2), (1, 0)) == (0, 1)


@pytest.mark.parametrize("seed", range(12))
def test_no_exchange_of_two_coordinates_would_be_better(seed: int) -> None:
    """Of all choices the best volume is not always reached, but none that one exchange leads to is larger."""
    random = np.random.default_rng(seed)
    jacobian, scales = random.standard_normal((3, 6)), random.uniform(0.5, 2.0, 6)
    worst = min(itertools.combinations(range(6), 3), key=lambda one: volume(jacobian, scales, one))
    found = review_partitioning(jacobian, scales, worst)
    assert len(set(found)) == 3
    free = [i for i in range(6) if i not in found]
    weights = np.abs(np.linalg.solve((jacobian * scales)[:, found], (jacobian * scales)[:, free]))
    assert np.max(weights) <= 1.01
    assert review_partitioning(jacobian, scales, found) == found


def volume(jacobian: np.ndarray, scales: np.ndarray, chosen: tuple[int, ...]) -> float:
    return abs(float(np.linalg.det((jacobian * scales)[:, chosen])))


def test_many_exchanges_in_a_row_are_made() -> None:
    """Each of many constraints has to change its coordinate; the number of exchanges is not bounded by their number."""
    count = 12
    jacobian = np.hstack([np.eye(count), 2.0 * np.eye(count), 4.0 * np.eye(count)])
    expected = tuple(range(2 * count, 3 * count))
    assert review_partitioning(jacobian, np.ones(3 * count), tuple(range(count))) == expected


def test_how_much_a_free_coordinate_moves_a_dependent_one() -> None:
    scaled = np.array([[2.0, 1.0, 0.0], [0.0, 4.0, -8.0]])
    weights = partitioning._weights(scaled, [0, 1], [2])
    assert weights is not None
    assert weights == pytest.approx(np.array([[1.0], [2.0]]))
    assert partitioning._weights(np.array([[0.0, 1.0]]), [0], [1]) is None
    assert partitioning._weights(np.array([[1.0, np.inf]]), [0], [1]) is None
    assert partitioning._weights(np.array([[1.0, np.inf, 1.0]]), [0], [1, 2]) is None
