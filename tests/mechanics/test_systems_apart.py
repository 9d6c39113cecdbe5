"""Systems whose unknowns fall into groups that share nothing."""

from __future__ import annotations

import numpy as np
import pytest

from atwood.expr import Graph, evaluate
from atwood.mechanics.constraints.read_multipliers import _solve_apart

UNDETERMINED = {
    "one": {},
    "a column": {(0, 1): 1.0, (1, 1): 3.0},
    "a row": {(0, 0): 1.0, (0, 1): 2.0},
    "numbers that repeat each other": {(0, 0): 1.0, (0, 1): -1.0, (1, 0): -1.0, (1, 1): 1.0},
}


@pytest.mark.parametrize("name", UNDETERMINED)
@pytest.mark.parametrize("right", [(1.0, 2.0, 1.0), (0.0, 1.0, 1.0)])
def test_what_nothing_determines_beside_others_is_no_value(name: str, right: tuple[float, ...]) -> None:
    graph = Graph()
    stiffness = graph.symbol("stiffness")
    matrix = {place: graph.constant(value) for place, value in UNDETERMINED[name].items()} | {(2, 2): stiffness}
    found = evaluate(_solve_apart(matrix, [graph.constant(one) for one in right]), {stiffness: 2.0})
    assert np.all(np.isnan(found))


def test_groups_have_the_solution_of_the_whole() -> None:
    graph = Graph()
    stiffness = graph.symbol("stiffness")
    entries = {(0, 2): 1.0, (2, 0): 3.0, (2, 2): 1.0, (1, 1): 4.0}
    matrix = {place: graph.constant(value) for place, value in entries.items()} | {(3, 1): stiffness, (3, 3): stiffness}
    found = evaluate(_solve_apart(matrix, [graph.constant(one) for one in (1.0, 2.0, 3.0, 4.0)]), {stiffness: 2.0})
    whole = np.zeros((4, 4))
    for place, value in {**entries, (3, 1): 2.0, (3, 3): 2.0}.items():
        whole[place] = value
    np.testing.assert_allclose(found, np.linalg.solve(whole, [1.0, 2.0, 3.0, 4.0]), rtol=1e-14)
