"""The shortest and the best solutions of linear systems."""

from __future__ import annotations

import numpy as np
import pytest

from atwood.numerics.matrices import least_norm, least_squares

RANDOM = np.random.default_rng(5)


def test_the_shortest_of_many_solutions() -> None:
    matrix = RANDOM.standard_normal((3, 6))
    right = RANDOM.standard_normal(3)
    found = least_norm(matrix, right)
    assert np.allclose(matrix @ found, right)
    assert np.allclose(found, matrix.T @ np.linalg.solve(matrix @ matrix.T, right))


def test_of_redundant_and_contradicting_rows_the_best() -> None:
    rows = RANDOM.standard_normal((2, 4))
    found = least_norm(np.vstack([rows, rows]), np.array([1.0, 2.0, 3.0, 4.0]))
    assert np.allclose(rows @ found, [2.0, 3.0])


@pytest.mark.parametrize(("errors", "expected"), [(None, 0.0), (1e-12, 1e10), (1e-3, 0.0)])
def test_directions_that_are_errors_are_not_followed(errors: float | None, expected: float) -> None:
    found = least_norm(np.diag([1.0, 1e-10]), np.ones(2), errors=errors)
    assert found == pytest.approx([1.0, expected])


def test_where_a_place_misses_by_much_less_is_believed() -> None:
    matrix = np.diag([1.0, 1e-6])
    assert least_norm(matrix, np.full(2, 1e-5), 1.0, 1e-5) == pytest.approx([1e-5, 0.0])
    assert least_norm(matrix, np.full(2, 1e-5), 1.0, 0.0) == pytest.approx([1e-5, 10.0])
    # Far away derivatives say nothing so fine: all directions help.
    assert least_norm(matrix, np.full(2, 1e-2), 1.0, 1e-2) == pytest.approx([1e-2, 1e4])


def test_rows_that_are_rounding_beside_their_unit_move_nothing() -> None:
    assert np.all(least_norm(1e-12 * np.eye(2), np.ones(2), 1.0) == 0.0)
    assert least_norm(1e-12 * np.eye(2), np.ones(2)) == pytest.approx([1e12, 1e12])


def test_stacks_are_solved_one_by_one() -> None:
    matrices, right = RANDOM.standard_normal((5, 2, 4)), RANDOM.standard_normal((5, 2, 1))
    each = [least_norm(one, b[:, 0]) for one, b in zip(matrices, right, strict=True)]
    assert np.allclose(least_norm(matrices, right)[:, :, 0], each)


def test_least_squares_takes_real_and_complex_numbers() -> None:
    columns, weights = RANDOM.standard_normal((9, 3)), np.array([1.0, -2.0, 1e-9])
    assert np.allclose(least_squares(columns, columns @ weights), weights)
    turned = columns + 1j * RANDOM.standard_normal((9, 3))
    assert np.allclose(least_squares(turned, turned @ (weights + 1j)), weights + 1j)


@pytest.mark.parametrize("solve", [least_norm, least_squares])
def test_numbers_that_are_not_finite_are_refused(solve) -> None:
    with pytest.raises(np.linalg.LinAlgError, match="not finite"):
        solve(np.array([[1.0, np.inf]]), np.ones(1))
