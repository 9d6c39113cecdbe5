"""The rank of matrices that are known to within errors, and the spaces that follow from it."""

from __future__ import annotations

import numpy as np
import pytest

from atwood.numerics.rank import (
    decompose,
    is_clear,
    lost_rank,
    null_space,
    open_directions,
    rank,
    ranks,
    singular_values,
    span,
)

RANDOM = np.random.default_rng(3)


def product(rows: int, columns: int, wanted: int) -> np.ndarray:
    """A matrix of a given rank."""
    return RANDOM.standard_normal((rows, wanted)) @ RANDOM.standard_normal((wanted, columns))


@pytest.mark.parametrize(("rows", "columns", "wanted"), [(6, 9, 4), (9, 6, 4), (5, 5, 5), (4, 7, 0), (7, 7, 1)])
def test_products_have_the_rank_of_their_factors_and_spaces_of_its_size(rows: int, columns: int, wanted: int) -> None:
    matrix = product(rows, columns, wanted)
    found = decompose(matrix)
    assert found.rank == rank(matrix) == wanted
    assert null_space(matrix).shape == (columns, columns - wanted)
    assert np.allclose(matrix @ found.null_space, 0.0, atol=1e-13)
    assert np.allclose(found.left_null_space.T @ matrix, 0.0, atol=1e-13)
    assert np.allclose(found.range @ (found.range.T @ matrix), matrix)
    assert np.allclose((matrix @ found.row_space) @ found.row_space.T, matrix)
    assert np.allclose(span(matrix) @ span(matrix).T, found.range @ found.range.T)


def test_what_errors_account_for_is_no_direction() -> None:
    """Weyl: no singular value moves by more than the norm of the error, and this bound is attained."""
    matrix = np.diag([1.0, 1e-3, 1e-6])
    assert rank(matrix) == 3
    assert rank(matrix, 1e-4) == 2
    assert rank(matrix, 1e-2) == 1
    per_row = np.array([0.0, 0.0, 2e-6])
    assert rank(matrix, per_row) == 2
    assert rank(matrix, np.diag(per_row)) == 2  # the same entry by entry
    assert rank(matrix, np.full(3, 1e-7)) == 3


@pytest.mark.parametrize("size", [1e-9, 1e-3])
def test_errors_of_the_size_that_is_said_never_add_a_rank(size: float) -> None:
    for _ in range(50):
        errors = size * RANDOM.uniform(0.1, 1.0, 6)
        noise = RANDOM.standard_normal((6, 8))
        noise *= (errors / np.linalg.norm(noise, axis=1))[:, None]
        assert rank(product(6, 8, 3) + noise, errors) == 3


def test_a_small_matrix_has_its_rank_and_rounding_alone_has_none_where_its_size_is_said() -> None:
    small = 1e-20 * product(4, 6, 3)
    assert rank(small) == 3
    assert rank(small, 1e-15) == 0


def test_a_matrix_without_rows_leaves_everything_open() -> None:
    assert null_space(np.zeros((0, 3))).shape == (3, 3)
    assert rank(np.zeros((0, 3))) == rank(np.zeros((3, 0))) == 0
    assert null_space(np.zeros((2, 3))).shape == (3, 3)


def test_a_rank_that_is_decided_already_is_taken() -> None:
    matrix = product(4, 6, 4)
    assert decompose(matrix, rank=2).null_space.shape == (6, 4)


def test_stacks_are_treated_one_by_one() -> None:
    matrices = np.array([product(4, 6, k) for k in (4, 2, 0)])
    assert ranks(matrices).tolist() == [rank(one) for one in matrices] == [4, 2, 0]
    full = np.array([product(3, 5, 3) for _ in range(4)])
    found = null_space(full, rank=3)
    assert found.shape == (4, 5, 2)
    assert np.allclose(full @ found, 0.0)
    assert np.allclose(singular_values(full), [singular_values(one) for one in full])


def test_what_is_clear_and_what_is_lost_near_a_singular_position() -> None:
    assert is_clear(np.eye(3))
    assert not is_clear(np.diag([1.0, 1e-7]))
    values = singular_values(np.diag([1.0, 1e-3, 1e-9]))
    assert lost_rank(values, 1e-2) == 1
    assert lost_rank(values, 1e-5) == 0


def test_open_directions_do_not_depend_on_the_units_of_rows() -> None:
    rows = product(3, 6, 3)
    scaled = np.array([1e-12, 1.0, 1e9])[:, None] * rows
    found = open_directions(scaled)
    assert found.shape == (3, 6)
    assert np.allclose(rows @ found.T, 0.0, atol=1e-12)
    nearly = np.vstack([rows, rows[0] + 1e-9 * rows[1]])
    assert open_directions(nearly, 1e-6).shape == (3, 6)


def test_entries_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        decompose(np.array([[1.0, np.nan], [0.0, 1.0]]))
