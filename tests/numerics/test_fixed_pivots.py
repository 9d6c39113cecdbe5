"""Elimination with fixed pivots: what it costs, in which order it goes, and that its lists do what they say."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood import Scene, assemble
from atwood.numerics.body_order import elimination_stages
from atwood.numerics.fixed_pivots import FixedPivots, fix_pivots
from atwood.simulation.problem.implicit_scene import pivots_of
from atwood_library import Ground, PointMass, Rod, scenes

RNG = np.random.default_rng(3)


def pivots_for(scene: Any, level: str = "ggl") -> FixedPivots:
    assembly = assemble(scene, form="dae", level=level)
    found = pivots_of(assembly.own_equations, assembly.form_program())
    assert found is not None
    return found


def tree(parents: list[int], order: list[int]) -> Scene:
    """Return point masses on rods, each on the one with the number given or on the world, added in some order."""
    scene = Scene()
    ground = scene.add("ground", Ground())
    rods = {i: scene.add(f"rod{i}", Rod(length=0.1)) for i in order}
    bobs = {i: scene.add(f"bob{i}", PointMass(mass=1.0)) for i in reversed(order)}
    for i in sorted(order, key=lambda i: (i * 7) % 5):
        parent = parents[i]
        scene.connect(ground.frame if parent < 0 else bobs[parent].point, rods[i].a)
        scene.connect(rods[i].b, bobs[i].point)
    return scene


def solution(pivots: FixedPivots, entries: Any, right: Any) -> Any:
    """Return the solution of a system, place by place as the lists say."""
    values = np.zeros(pivots.room)
    values[pivots.positions] = entries
    work = right[pivots.rows]
    for k in range(pivots.size):
        start, middle, end = pivots.starts[k], pivots.middles[k], pivots.starts[k + 1]
        targets = iter(pivots.targets[pivots.target_starts[k] : pivots.target_starts[k + 1]])
        for i in range(middle, end):
            values[i] /= values[start]
            for j in range(start + 1, middle):
                values[next(targets)] -= values[i] * values[j]
            work[pivots.indices[i]] -= values[i] * work[k]
    for k in reversed(range(pivots.size)):
        start, middle = pivots.starts[k], pivots.middles[k]
        work[k] -= values[start + 1 : middle] @ work[pivots.indices[start + 1 : middle]]
        work[k] /= values[start]
    found = np.empty(pivots.size)
    found[pivots.columns] = work
    return found


def test_a_link_of_a_chain_costs_the_same_wherever_it_is():
    for links in (2, 5, 12, 30):
        pivots = pivots_for(scenes.Chain(links=links))
        assert pivots.operations == {"factorise": 148 * links - 144, "solve": 59 * links - 40}
        assert pivots.room == 59 * links - 40


def test_index_1_costs_less_than_the_stabilised_form():
    ggl, index1 = (pivots_for(scenes.Chain(links=8), level).operations for level in ("ggl", "index1"))
    assert all(index1[key] < ggl[key] for key in ggl)


PARENTS = {
    "chain": [-1, 0, 1, 2, 3, 4],
    "star": [-1, 0, 0, 0, 0],
    "tree": [-1, 0, 0, 1, 1, 2, 2],
    "two": [-1, 0, -1, 2],
}


@pytest.mark.parametrize("kind", PARENTS)
def test_the_order_of_the_parts_does_not_matter(kind: str) -> None:
    parents = PARENTS[kind]
    numbers = list(range(len(parents)))
    first = pivots_for(tree(parents, numbers)).operations
    for _ in range(3):
        assert pivots_for(tree(parents, RNG.permutation(numbers).tolist())).operations == first


@pytest.mark.parametrize("name", ["Chain", "FourBar", "HeavyTop", "CarAxis", "RollingDisc", "QuarterCar"])
def test_the_lists_solve_what_has_this_pattern(name: str) -> None:
    assembly = assemble(getattr(scenes, name)(), form="dae")
    program = assembly.form_program()
    pivots = pivots_of(assembly.own_equations, program)
    assert pivots is not None
    entries = RNG.uniform(0.5, 1.0, len(program.rows)) * RNG.choice([-1.0, 1.0], len(program.rows))
    full = np.zeros((program.size, program.size))
    full[program.rows, program.columns] = entries
    right = RNG.normal(size=program.size)
    found = solution(pivots, entries, right)
    assert_allclose(full @ found, right, atol=1e-6 * np.max(np.abs(full) @ np.abs(found)))
    by_row = np.zeros_like(full)
    rows = np.repeat(np.arange(program.size), np.diff(pivots.row_starts))
    by_row[rows, pivots.row_columns] = entries[pivots.by_row]
    assert np.array_equal(by_row, full)


def test_a_constraint_goes_after_the_body_that_hangs_on_it():
    links = 6
    pivots = pivots_for(scenes.Chain(links=links))
    when = np.empty(pivots.size, dtype=int)
    when[pivots.columns] = np.arange(pivots.size)
    places, speeds = when[: 2 * links].reshape(links, 2), when[2 * links : 4 * links].reshape(links, 2)
    for multipliers in (when[4 * links : 5 * links], when[5 * links :]):
        assert np.all(multipliers > np.maximum(places, speeds).max(axis=1))
        assert np.all(np.diff(multipliers) < 0)  # from the end of the chain on


def test_what_closes_a_loop_goes_after_all_its_bodies():
    # Three bodies of two unknowns in a row, with the world at both ends and a constraint of two rows between each.
    pairs = [(-1, 0), (0, 1), (1, 2), (2, -1)]
    bodies = np.array([0, 0, 1, 1, 2, 2, *[-1] * 8])
    places = {(i, i) for i in range(6)} | {(0, 1), (1, 0)}
    for joint, ends in enumerate(pairs):
        for row in (6 + 2 * joint, 7 + 2 * joint):
            places |= {place for body in ends if body >= 0 for k in (0, 1) for place in ((row, 2 * body + k),)}
    places |= {(column, row) for row, column in places}
    rows, columns = (np.array(one) for one in zip(*sorted(places, key=lambda place: place[::-1]), strict=True))
    stages = elimination_stages(rows, columns, np.arange(14), bodies)
    closing = {12, 13}
    assert next(k for k, stage in enumerate(stages) if closing & set(stage.constraints)) == 2
    assert fix_pivots(rows, columns, np.arange(14), stages) is None  # there are more constraints than unknowns


def test_a_pattern_that_is_singular_has_no_pivots():
    rows, columns = np.array([0, 0]), np.array([0, 1])
    stages = elimination_stages(rows, columns, np.arange(2), np.array([0, 1]))
    assert fix_pivots(rows, columns, np.arange(2), stages) is None


def test_what_has_no_pivot_in_its_own_row_takes_another():
    rows, columns = np.array([1, 2, 0]), np.array([0, 1, 2])
    stages = elimination_stages(rows, columns, np.arange(3), np.array([0, 1, 2]))
    pivots = fix_pivots(rows, columns, np.arange(3), stages)
    assert pivots is not None
    assert_allclose(solution(pivots, np.array([2.0, 4.0, 5.0]), np.array([5.0, 2.0, 8.0])), [1.0, 2.0, 1.0])
