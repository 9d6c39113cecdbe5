"""Independence of rows, group by group."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from atwood.numerics.rank import independent_by_groups
from atwood.tolerances import tolerances

RNG = np.random.default_rng(8)


def tree(bodies: int, rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return rows of joints, each on its own body and on an earlier one, in any order, with the joint of each."""
    matrix = np.zeros((bodies * rows, bodies * columns))
    for body in range(bodies):
        here = slice(rows * body, rows * (body + 1))
        for other in {body, int(RNG.integers(0, body + 1))}:
            matrix[here, columns * other : columns * (other + 1)] = RNG.normal(size=(rows, columns))
    order = RNG.permutation(len(matrix))
    return matrix[order][:, RNG.permutation(matrix.shape[1])], np.repeat(np.arange(bodies), rows)[order]


@pytest.mark.parametrize(("rows", "columns"), [(1, 2), (2, 3), (5, 6), (3, 3)])
def test_trees_hang_together(rows: int, columns: int) -> None:
    for _ in range(5):
        matrix, groups = tree(12, rows, columns)
        assert independent_by_groups(csr_array(matrix), groups)
        assert np.linalg.matrix_rank(matrix) == len(matrix)


def test_what_depends_on_others_does_not():
    matrix, groups = tree(6, 2, 3)
    for twice in (matrix[:1], 2.0 * matrix[3:4] - matrix[5:6], np.zeros((1, matrix.shape[1]))):
        more = csr_array(np.concatenate([matrix, twice]))
        for group in (99, groups[0], groups[3]):
            assert not independent_by_groups(more, np.append(groups, group))


@pytest.mark.parametrize(("clear", "expected"), [(1e-5, True), (1e-3, False)])
def test_how_independent_a_group_must_be_counts(clear: float, expected: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tolerances, "CLEAR", clear)
    nearly = csr_array(np.array([[1.0, 0.0, 0.0], [1.0, 1e-4, 0.0]]))
    assert independent_by_groups(nearly, np.array([0, 0])) == expected


def test_a_long_chain_is_as_good_as_a_short_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tolerances, "CLEAR", 0.5)
    # Its smallest singular value falls with its length, and none of its joints is any worse.
    links = 400
    chain = np.eye(links) - np.eye(links, k=-1)
    assert np.linalg.svd(chain, compute_uv=False)[-1] < 5e-3
    assert independent_by_groups(csr_array(chain), np.arange(links))
