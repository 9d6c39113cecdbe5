"""Matrices kept by their entries give the same answers as arrays."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from atwood import Scene, StartError, simulate
from atwood.numerics import matrices
from atwood.numerics.matrices import from_entries, least_norm
from atwood.numerics.rank import independent_rows
from atwood.numerics.sparse import csr_of, free_columns, smallest_direction, solve_bordered
from atwood.numerics.sparse_batch import Borders, Elimination, Normal, Pattern
from atwood.pipeline import assemble
from atwood.simulation.dynamics import balance
from atwood.simulation.initialization.start import Start, find_start
from atwood_library import Ground, PointMass, Rod, Sphere
from atwood_library.scenes.chain import Chain
from atwood_library.scenes.four_bar import FourBar
from atwood_library.scenes.mass_spring_chain import MassSpringChain
from atwood_library.scenes.pendulum_on_cart import PendulumOnCart


@pytest.fixture
def by_entries(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Treat the smallest scenes as the largest."""
    with monkeypatch.context() as patch:
        patch.setattr(matrices, "LARGEST_FULL", 0)
        patch.setattr(matrices, "LARGEST_FULL_OF_MANY", 0)
        patch.setattr(matrices, "_DENSE", 2.0)
        patch.setattr(matrices, "_DENSE_OF_MANY", 2.0)
        yield


class TwoRodsForOne(Scene):
    """A pendulum that hangs on two equal rods side by side: one constraint follows from the other."""

    ground: Ground = Ground()
    first: Rod = Rod(length=1.0)
    second: Rod = Rod(length=1.0)
    bob: PointMass = PointMass(mass=2.0)
    t_end = 1.0
    start = {"first.angle": 1.0, "first.angular_velocity": 0.3}

    def build(self) -> None:
        for rod in (self.first, self.second):
            self.connect(self.ground.frame, rod.a)
            self.connect(rod.b, self.bob.point)


SCENES = {
    "chain": lambda: Chain(links=6),
    "four-bar": FourBar,
    "cart": PendulumOnCart,
    "springs": MassSpringChain,
    "redundant": TwoRodsForOne,
}


@pytest.mark.sample(3)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", SCENES)
def test_same_motion_and_forces(name: str, form: str, request: pytest.FixtureRequest) -> None:
    expected = simulate(SCENES[name](), form=form, t_end=0.5, outputs=6, rtol=1e-9, solver="ida").table()
    request.getfixturevalue("by_entries")
    result = simulate(SCENES[name](), form=form, t_end=0.5, outputs=6, rtol=1e-9, solver="ida")
    found = result.table()
    assert result.constraint_max["position"] < 1e-11
    for path, values in expected.items():
        scale = max(1.0, float(np.max(np.abs(values))))
        np.testing.assert_allclose(found[path], values, rtol=0, atol=1e-7 * scale, err_msg=path)


def test_start_says_the_same(by_entries: None) -> None:
    scene = Chain(links=5)
    scene.start = {"rod[1].angle": 0.4, "bob[4].position.x": 0.3, "rod[0].angular_velocity": 0.0}
    start = find_start(assemble(scene))
    assert set(start.free_coordinates) == {f"rod[{i}].angle" for i in (0, 2, 3, 4)}
    assert set(start.free_speeds) == {f"rod[{i}].angle" for i in (1, 2, 3, 4)}


def test_free_bodies_in_space_start_alike(request: pytest.FixtureRequest) -> None:
    def start(joined: bool) -> Start:
        scene = Scene(space="space")
        first, other = scene.add("a", Sphere()), scene.add("b", Sphere())
        told = {"a.position.x": 0.2, "a.psi": 0.4, "a.theta": 0.3, "a.phi": 0.1, "b.position.z": -1.0}
        scene.start.update(told)
        if joined:
            rod = scene.add("rod", Rod(length=1.0))
            scene.connect(rod.a, first.frame)
            scene.connect(rod.b, other.frame)
        return find_start(assemble(scene))

    expected = [start(False), start(True)]
    request.getfixturevalue("by_entries")
    for one, other in zip([start(False), start(True)], expected, strict=True):
        assert (one.free_coordinates, one.free_speeds) == (other.free_coordinates, other.free_speeds)
        np.testing.assert_allclose(one.coordinates, other.coordinates, rtol=0.0, atol=1e-10)


def test_a_full_mass_matrix_of_many_bodies_is_never_made(monkeypatch: pytest.MonkeyPatch) -> None:
    how = {"t_end": 1e-3, "outputs": 2, "solver": "explicit"}
    expected = simulate(Chain(links=100), **how).table()

    def refused(*_: object) -> None:
        raise AssertionError("a matrix of all bodies was made")

    monkeypatch.setattr(balance, "LARGEST_FULL", 50)
    monkeypatch.setattr(balance, "columns_of", refused)
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    found = simulate(assemble(Chain(links=100)), **how).table()
    np.testing.assert_allclose(found["bob[99].position.z"], expected["bob[99].position.z"], rtol=1e-7)


def test_something_without_mass_is_named(by_entries: None) -> None:
    scene = Scene()
    ground, rod = scene.add("ground", Ground()), scene.add("rod", Rod())
    scene.connect(ground.frame, rod.a)
    with pytest.raises(StartError, match="without inertia"):
        simulate(scene, form="dae", t_end=0.1)


# -- linear algebra -----------------------------------------------------------------------------------------------


def _local_matrix(rows: int, columns: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    at_rows, at_columns = [], []
    for row in range(rows):
        near = np.arange(2 * row, min(columns, 2 * row + 6))
        at_rows += [row] * 3
        at_columns += random.choice(near, 3, replace=False).tolist()
    return np.array(at_rows), np.array(at_columns), random.standard_normal(len(at_rows))


@pytest.mark.parametrize("tall", [False, True])
def test_least_norm(tall: bool) -> None:
    rows, columns, entries = _local_matrix(40, 90, 1)
    matrix = csr_of(rows, columns, entries, (40, 90))
    matrix = matrix.T.tocsr() if tall else matrix
    right = np.random.default_rng(2).standard_normal(matrix.shape[0])
    expected = np.linalg.lstsq(matrix.toarray(), right, rcond=None)[0]
    np.testing.assert_allclose(least_norm(matrix, right), expected, atol=1e-12)


def test_least_norm_of_dependent_rows() -> None:
    rows, columns, entries = _local_matrix(30, 70, 3)
    twice = csr_of(np.concatenate([rows, rows + 30]), np.concatenate([columns, columns]), np.tile(entries, 2), (60, 70))
    right = np.random.default_rng(4).standard_normal(60)  # the two say different things
    expected = np.linalg.lstsq(twice.toarray(), right, rcond=1e-9)[0]
    np.testing.assert_allclose(least_norm(twice, right), expected, atol=1e-5)


def test_independent_rows() -> None:
    exact = np.zeros(30)
    rows, columns, entries = _local_matrix(30, 70, 5)
    assert independent_rows(csr_of(rows, columns, entries, (30, 70)), exact) == list(range(30))
    full = csr_of(rows, columns, entries, (30, 70)).toarray()
    full[17] = 2.0 * full[3] - full[11]
    at = np.nonzero(full)
    assert independent_rows(csr_of(*at, full[at], full.shape), exact) == [i for i in range(30) if i != 17]
    full[17] = 1e-5 * np.eye(70)[60] + full[3]  # nearly, and still independent
    at = np.nonzero(full)
    assert independent_rows(csr_of(*at, full[at], full.shape), exact) == list(range(30))


@pytest.mark.parametrize("seed", range(5))
def test_independent_rows_of_parts_that_share_nothing(seed: int) -> None:
    """Rows in any order, of parts whose ranks are those of products of random factors."""
    random = np.random.default_rng(seed)
    whole, rank, at = np.zeros((420, 500)), 0, np.zeros(2, dtype=int)
    order = random.permutation(420), random.permutation(500)
    while np.all(at + 7 < whole.shape):
        size, own = random.integers(1, 7, 2), int(random.integers(0, 4))
        part = random.standard_normal((size[0], own)) @ random.standard_normal((own, size[1]))
        whole[np.ix_(order[0][at[0] : at[0] + size[0]], order[1][at[1] : at[1] + size[1]])] = part
        rank, at = rank + min(own, *size.tolist()), at + size
    places = np.nonzero(whole)
    first = random.uniform(size=420) < 0.3
    errors = 1e-14 * np.linalg.norm(whole, axis=1)
    kept = independent_rows(csr_of(*places, whole[places], whole.shape), errors, first=first)
    assert len(kept) == rank == np.linalg.matrix_rank(whole[kept])
    assert np.sum(first[kept]) == np.linalg.matrix_rank(whole[first])  # those that come first are kept first


def test_free_columns() -> None:
    matrix = np.zeros((4, 7))
    matrix[0, 0], matrix[1, 1], matrix[1, 2] = 2.0, 1.0, 0.0  # the first two are given by themselves
    matrix[2, 3], matrix[2, 4], matrix[3, 3], matrix[3, 4] = 1.0, 2.0, 1.0, -1.0  # a pair that is determined together
    at = ([0, 1, 1, 2, 2, 3, 3], [0, 1, 2, 3, 4, 3, 4])
    assert free_columns(csr_of(*at, matrix[at], matrix.shape)).tolist() == [
        False,
        False,
        True,
        False,
        False,
        True,
        True,
    ]


def test_smallest_direction() -> None:
    random = np.random.default_rng(6)
    rotation, _ = np.linalg.qr(random.standard_normal((12, 12)))
    sizes = np.array([1e-8, *np.linspace(0.5, 1.0, 11)])
    square = rotation @ np.diag(sizes) @ rotation.T
    at = np.nonzero(np.ones((12, 12)))
    value, vector = smallest_direction(csr_of(*at, square[at], square.shape))
    assert value * np.max(np.diag(square)) == pytest.approx(1e-8, rel=1e-3)
    assert abs(vector @ rotation[:, 0]) == pytest.approx(1.0, abs=1e-6)


def test_elimination_adds_little_along_a_chain() -> None:
    chain = Elimination(1000, [(i, i + 1) for i in range(999)])
    assert len(chain.number) == 1999
    ring = Elimination(1000, [(i, (i + 1) % 1000) for i in range(1000)])
    assert len(ring.number) < 3000


def test_many_states_at_once() -> None:
    n, m, states = 90, 40, 5
    rows, columns, _ = _local_matrix(m, n, 7)
    random = np.random.default_rng(8)
    entries, right = random.standard_normal((len(rows), states)), random.standard_normal((m, states))
    held = Pattern(rows, columns, (m, n))
    kept = [i for i in range(m) if i % 7]
    found = Normal(held, kept).factorised(entries)(right[kept])
    at = Pattern(np.array([*range(n), 0, 1]), np.array([*range(n), 1, 0]), (n, n))
    masses = np.concatenate([random.uniform(1.0, 2.0, (n, states)), np.full((2, states), 0.25)])
    bias = random.standard_normal((n, states))
    a, multipliers, good = Borders(at, held).solve(masses, entries, bias, right)
    assert good.all()
    for k in range(states):
        slope = csr_of(rows, columns, entries[:, k], (m, n))
        expected = np.linalg.lstsq(slope.toarray()[kept], right[kept, k], rcond=None)[0]
        np.testing.assert_allclose(found[:, k], expected, atol=1e-11)
        solved = solve_bordered(csr_of(at.rows, at.columns, masses[:, k], (n, n)), slope, bias[:, k], right[:, k])
        assert solved is not None
        np.testing.assert_allclose(a[:, k], solved[0], atol=1e-11)
        np.testing.assert_allclose(multipliers[:, k], solved[1], atol=1e-11)


def test_multipliers_of_least_size_for_many_states_at_once() -> None:
    m, n, states = 40, 90, 5
    rows, columns, _ = _local_matrix(m, n, 7)
    entries = np.random.default_rng(9).standard_normal((len(rows), states))
    # three more rows, each a combination of two others, and one that is another in other units
    full = np.stack([csr_of(rows, columns, entries[:, k], (m, n)).toarray() for k in range(states)])
    made = [full[:, 3] - 2.0 * full[:, 4], full[:, 5] + full[:, 30], 1e6 * full[:, 7]]
    every = np.concatenate([full, np.stack(made, axis=1)], axis=1)
    places = np.nonzero(np.any(every != 0.0, axis=0))
    whole = Pattern(*places, (m + 3, n))
    multipliers = np.random.default_rng(10).standard_normal((m, states))
    found = Normal(whole, range(m)).least_size(every[:, *places].T, multipliers)
    for k in range(states):
        expected = np.linalg.pinv(every[k].T, rcond=1e-12) @ (full[k].T @ multipliers[:, k])
        np.testing.assert_allclose(found[:, k], expected, atol=1e-10)


def test_what_has_no_mass_of_its_own_is_reported_as_not_solved() -> None:
    at, held = Pattern(np.array([1]), np.array([1]), (2, 2)), Pattern(np.array([0, 0]), np.array([0, 1]), (1, 2))
    *_, good = Borders(at, held).solve(
        np.ones((1, 1)), np.array([[1.0], [-1.0]]), np.array([[0.5], [1.0]]), np.zeros((1, 1))
    )
    assert not good.any()


def test_full_and_sparse_are_chosen_by_size() -> None:
    assert isinstance(from_entries([0], [0], [1.0], (100, 100)), np.ndarray)
    assert not isinstance(from_entries([0], [0], [1.0], (1000, 1000)), np.ndarray)
    full = np.nonzero(np.ones((300, 300)))
    assert isinstance(from_entries(*full, np.ones(90_000), (300, 300)), np.ndarray)
