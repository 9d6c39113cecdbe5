"""Loop closure by the method of Levenberg and Marquardt: on functions whose least places are known."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

import atwood
from atwood.errors import KernelEvaluationError
from atwood.numerics.matrices import LARGEST_FULL
from atwood.simulation.initialization import loop_closure
from atwood.simulation.initialization.loop_closure import Nearest, closest, closest_of_all, places_around, units_of_rows
from atwood.simulation.initialization.system import System, sort_targets
from atwood_library.scenes import DoublePendulum, FourBar, UniversalShaft

Function = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


class Conditions:
    """Conditions on numbers in place of a scene's; counts how often they are evaluated."""

    def __init__(self, function: Function, names: tuple[str, ...] = ()) -> None:
        self.function, self.speed_names, self.seen = function, names, []
        self.kinematic_map = SimpleNamespace(moved=lambda t, q, displacement: q + displacement)

    def at(self, t: float, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.seen.append(q.copy())
        residual, jacobian = self.function(q)
        return np.asarray(residual, dtype=float), np.asarray(jacobian, dtype=float)


def found(function: Function, start: list[float], units: float = 1.0, scale: float = 1.0, **options: int) -> Nearest:
    q = np.array(start, dtype=float)
    rows = len(function(q)[0])
    return closest(Conditions(function), np.full(rows, units), np.full(len(q), scale), 0.0, q, **options)


def line(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.array([2.0 * q[0] - 1.0]), np.array([[2.0]])


def bowl(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Never zero; least at (1, -2), where it is 3."""
    return np.array([3.0, q[0] - 1.0, q[1] + 2.0]), np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


def valley(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rosenbrock's curved valley; zero at (1, 1)."""
    return np.array([10.0 * (q[1] - q[0] ** 2), 1.0 - q[0]]), np.array([[-20.0 * q[0], 10.0], [-1.0, 0.0]])


def apart(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two circles that are 0.5 apart: the pins of two bars that are too short to meet."""
    a, b = q
    tip = np.array([np.cos(a), np.sin(a)]) - np.array([2.5 + np.cos(b), np.sin(b)])
    return tip, np.array([[-np.sin(a), np.sin(b)], [np.cos(a), -np.cos(b)]])


# -- one place ---------------------------------------------------------------------------------------------------------


def test_a_linear_condition_is_met() -> None:
    one = found(line, [0.7])
    assert one.coordinates == pytest.approx([0.5], abs=1e-15)
    assert one.size < 1e-15


@pytest.mark.parametrize("start", [[1.5, -2.2], [40.0, 30.0], [-7.0, 0.0]])
def test_what_cannot_be_met_is_missed_least(start: list[float]) -> None:
    one = found(bowl, start)
    assert one.coordinates == pytest.approx([1.0, -2.0], abs=1e-9)
    assert one.size == pytest.approx(3.0, abs=1e-12)
    assert one.residual == pytest.approx([3.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("start", [[-1.2, 1.0], [0.0, 0.0], [3.0, -4.0], [-2.0, -2.0]])
def test_a_curved_valley_is_followed(start: list[float]) -> None:
    one = found(valley, start)
    assert one.coordinates == pytest.approx([1.0, 1.0], abs=1e-12)
    assert one.size < 1e-12


@pytest.mark.parametrize("start", [[0.4, 2.5], [-1.0, 4.0]])
def test_bars_that_are_too_short_point_at_each_other(start: list[float]) -> None:
    one = found(apart, start)
    assert np.cos(one.coordinates) == pytest.approx([1.0, -1.0], abs=1e-12)
    assert one.size == pytest.approx(0.5, abs=1e-12)
    assert abs(one.residual[0]) == pytest.approx(0.5, abs=1e-12)


def test_what_is_missed_is_in_the_units_of_the_row_and_its_size_is_not() -> None:
    one = found(bowl, [0.0, 0.0], units=10.0)
    assert one.residual == pytest.approx([3.0, 0.0, 0.0], abs=1e-8)
    assert one.size == pytest.approx(0.3, abs=1e-10)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_the_unit_of_coordinates_decides_nothing(scale: float) -> None:
    """The same bars with angles counted in other units take the same steps."""

    def restated(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        residual, jacobian = apart(q / scale)
        return residual, jacobian / scale

    plain = found(apart, [0.4, 2.5], iterations=4)
    one = found(restated, [0.4 * scale, 2.5 * scale], scale=scale, iterations=4)
    assert one.coordinates / scale == pytest.approx(plain.coordinates, abs=1e-12)


def test_steps_are_bounded_by_half_the_size_of_a_coordinate() -> None:
    conditions = Conditions(bowl)
    closest(conditions, np.ones(3), np.array([1.0, 4.0]), 0.0, np.array([50.0, 200.0]))
    moves = np.abs(np.diff(np.array(conditions.seen), axis=0)) / np.array([1.0, 4.0])
    assert np.max(moves) == pytest.approx(0.5, abs=1e-12)
    assert np.sum(np.max(moves, axis=1) > 0.4999) > 50


def test_a_step_below_the_bound_is_taken_whole() -> None:
    one = found(line, [0.05], iterations=1)
    assert one.coordinates == pytest.approx([0.5], abs=5e-3)


def test_the_number_of_steps_is_bounded() -> None:
    conditions = Conditions(valley)
    closest(conditions, np.ones(2), np.ones(2), 0.0, np.array([-1.2, 1.0]), 3)
    assert len(conditions.seen) == 4
    conditions = Conditions(valley)
    closest(conditions, np.ones(2), np.ones(2), 0.0, np.array([-1.2, 1.0]))
    assert len(conditions.seen) < 60


def test_where_it_is_met_already_nothing_is_tried() -> None:
    for function, start in ((line, [0.5]), (bowl, [1.0, -2.0])):
        conditions = Conditions(function)
        closest(conditions, np.ones(len(function(np.array(start))[0])), np.ones(len(start)), 0.0, np.array(start))
        assert len(conditions.seen) == 1


def test_it_ends_where_nothing_more_is_gained() -> None:
    conditions = Conditions(apart)
    closest(conditions, np.ones(2), np.ones(2), 0.0, np.array([0.4, 2.5]))
    assert len(conditions.seen) < 40


def test_steps_to_where_something_has_no_value_are_made_shorter() -> None:
    def logarithm(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if q[0] <= 0.0:
            raise KernelEvaluationError("the logarithm of a negative number")
        return np.array([np.log(q[0]) + 4.0]), np.array([[1.0 / q[0]]])

    assert found(logarithm, [0.3]).coordinates == pytest.approx([np.exp(-4.0)], rel=1e-9)
    with pytest.raises(KernelEvaluationError):
        closest(Conditions(logarithm), np.ones(1), np.ones(1), 0.0, np.array([-1.0]))


def test_a_coordinate_that_nothing_depends_on_stays() -> None:
    def first(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.array([q[0] - 1.0]), np.array([[1.0, 0.0]])

    one = found(first, [0.0, 7.0])
    assert one.coordinates == pytest.approx([1.0, 7.0], abs=1e-12)


# -- several places ----------------------------------------------------------------------------------------------------


def around(names: tuple[str, ...], hangs: bool = False, scale: float = 1.0) -> list[np.ndarray]:
    conditions = Conditions(line, names)
    return list(places_around(conditions, np.full(len(names), scale), 0.0, np.ones(len(names)), hangs))


def test_the_first_place_is_the_guess_and_the_others_move_away() -> None:
    first, *others = around(("a", "b", "c"))
    assert loop_closure._SHIFTS[:5] == (0.1, 0.2, 0.3, 0.5, 0.5)  # near ones first: the nearest branch is meant mostly
    assert np.array_equal(first, np.ones(3))
    moves = [float(np.max(np.abs(one - 1.0))) for one in others]
    assert len(others) == 15
    for move, bound in zip(moves, loop_closure._SHIFTS, strict=True):
        assert 0.2 * bound < move <= bound
    assert 2.0 < max(moves) <= 3.1
    assert any(np.any(one < 1.0) for one in others)
    assert any(np.any(one > 1.0) for one in others)


def test_they_are_the_same_each_time_and_of_the_size_of_the_coordinates() -> None:
    once, again, large = (around(("a", "b"), scale=scale) for scale in (1.0, 1.0, 10.0))
    assert np.array_equal(once, again)
    assert np.allclose((np.array(large) - 1.0) / 10.0, np.array(once) - 1.0)


def test_a_large_scene_is_tried_from_the_guess_alone() -> None:
    assert len(around(("a",) * LARGEST_FULL)) == 16
    assert len(around(("a",) * (LARGEST_FULL + 1))) == 1


def test_free_points_hang_lower_one_after_the_other() -> None:
    names = ("p.position.x'", "p.position.z'", "q.position.x'", "q.position.z'", "hinge.angle'")
    first, lowered, *_ = around(names, hangs=True, scale=2.0)
    assert lowered - first == pytest.approx([0.0, -0.6, 0.0, -0.9, 0.0])
    assert len(around(names, hangs=True)) == len(around(names)) + 1


def test_points_hang_only_where_that_is_asked_for() -> None:
    names = ("p.position.x'", "p.position.z'")
    assert not any(np.allclose(one - 1.0, [0.0, -0.3]) for one in around(names))
    assert np.allclose(around(names, hangs=True)[1] - 1.0, [0.0, -0.3])


def of_all(function: Function, start: list[float], **options: object) -> tuple[Nearest | None, Conditions]:
    conditions = Conditions(function)
    q = np.array(start, dtype=float)
    scales = np.ones(len(q))
    best = closest_of_all(conditions, np.ones(options.pop("rows", 1)), scales, 0.0, q, **options)
    return best, conditions


def test_it_ends_as_soon_as_one_is_enough() -> None:
    best, conditions = of_all(line, [0.4])
    assert best is not None
    few = len(conditions.seen)
    _, conditions = of_all(line, [0.4], is_enough=lambda one: False)
    assert len(conditions.seen) > 2 * few


def test_it_ends_where_several_places_lead_to_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[float] = []
    sizes = iter([2.0, 2.0, 1.0, 1.0, 3.0, 1.0, 1.0 + 1e-8, 0.5])

    def one(*_: object) -> Nearest:
        calls.append(next(sizes))
        return Nearest(np.array([float(len(calls))]), np.zeros(1), calls[-1])

    monkeypatch.setattr(loop_closure, "closest", one)
    best, _ = of_all(line, [0.0])
    assert calls == [2.0, 2.0, 1.0, 1.0, 3.0, 1.0, 1.0 + 1e-8]  # the third that misses as much ends it
    assert best is not None
    assert best.coordinates[0] == 3.0  # of places that miss alike the first


@pytest.mark.parametrize(("second", "taken"), [(1.0 - 2e-6, 2.0), (1.0 - 1e-7, 1.0)])
def test_what_is_hardly_better_is_not_better(monkeypatch: pytest.MonkeyPatch, second: float, taken: float) -> None:
    sizes = iter([1.0, second, *[9.0] * 20])
    places = iter(range(1, 30))
    made = lambda *_: Nearest(np.array([float(next(places))]), np.zeros(1), next(sizes))  # noqa: E731
    monkeypatch.setattr(loop_closure, "closest", made)
    best, _ = of_all(line, [0.0])
    assert best is not None
    assert best.coordinates[0] == taken


def test_places_without_a_value_are_left_out() -> None:
    def right(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if q[0] < 0.0:
            raise KernelEvaluationError("no value")
        return line(q)

    best, _ = of_all(right, [-0.05])
    assert best is not None
    assert best.coordinates == pytest.approx([0.5], abs=1e-12)

    def nowhere(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        raise KernelEvaluationError("no value")

    assert of_all(nowhere, [0.0])[0] is None


# -- units of a scene --------------------------------------------------------------------------------------------------


def units(scene: atwood.Scene, length: float, constrained: bool = True) -> list[float]:
    assembly = atwood.assemble(scene)
    fixed = sort_targets(assembly, assembly.regular)[0].fixed
    system = System(assembly, assembly.regular, fixed, constrained)
    found_units = units_of_rows(assembly, assembly.regular, system, length).tolist()
    assert len(found_units) == len(fixed) + (len(assembly.regular.constraints) if constrained else 0)
    return found_units


def test_lengths_count_by_the_extent_of_the_scene_and_angles_by_themselves() -> None:
    assert units(FourBar(), 7.0) == [7.0, 7.0, 1.0]  # the loop misses by metres, the crank by an angle
    scene = DoublePendulum()
    scene.start.clear()
    scene.start.update({"bob1.position.x": 0.1, "rod2.angle": 0.3})
    assert sorted(units(scene, 7.0)) == [1.0, 7.0]


def test_without_constraints_only_what_is_fixed_has_a_unit() -> None:
    assert units(FourBar(), 7.0, constrained=False) == [1.0]


def test_constraints_on_directions_are_no_lengths() -> None:
    assert 1.0 in units(UniversalShaft(), 7.0)[:-1]
