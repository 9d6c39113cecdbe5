"""Newton's method: where it leads, when it ends, and what a shortened step is for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from atwood.numerics.newton import Missing, largest, newton

ONE = np.ones(1)


def counted(
    value: Callable[[np.ndarray], np.ndarray], slopes: Callable[[np.ndarray], np.ndarray]
) -> tuple[Callable[[np.ndarray], Missing], list[np.ndarray]]:
    """What is missing by a formula and its derivatives, with the places that were asked for."""
    asked: list[np.ndarray] = []

    def look(place: np.ndarray) -> Missing:
        asked.append(place)
        found = value(place)
        return Missing(found, np.ones(len(found)), lambda: slopes(place))

    return look, asked


def test_a_square_root_to_the_last_digit_in_as_many_steps_as_digits_double() -> None:
    look, asked = counted(lambda x: x**2 - 2.0, lambda x: np.diag(2.0 * x))
    found, left = newton(look, np.add, np.array([1.5]), ONE, steps=20, met=1e-9)
    assert found[0] == pytest.approx(np.sqrt(2.0), abs=3e-16)
    assert left.miss < 1e-15
    assert len(asked) <= 7


def test_what_is_not_determined_stays_and_the_nearest_place_is_found() -> None:
    look, _ = counted(lambda x: np.array([x[0] ** 2 + x[1] ** 2 - 1.0]), lambda x: np.array([[*(2.0 * x[:2]), 0.0]]))
    found, _ = newton(look, np.add, np.array([3.0, 4.0, 7.0]), np.ones(3), steps=20, met=1e-12)
    assert found == pytest.approx([0.6, 0.8, 7.0])


def test_scales_say_which_of_many_solutions_is_the_shortest() -> None:
    look, _ = counted(lambda x: np.array([x[0] + x[1] - 1.0]), lambda _: np.ones((1, 2)))
    found, _ = newton(look, np.add, np.zeros(2), np.array([1.0, 1e3]), steps=3)
    assert found == pytest.approx([1e-6, 1.0], rel=1e-5)


def test_a_step_that_leads_away_is_halved() -> None:
    look, _ = counted(lambda x: np.arctan(x), lambda x: np.diag(1.0 / (1.0 + x**2)))
    far, _ = newton(look, np.add, np.array([3.0]), ONE, steps=5)
    assert abs(far[0]) > 1e6  # full steps lead away from beyond 1.39
    near, left = newton(look, np.add, np.array([3.0]), ONE, steps=20, met=1e-12, halvings=8)
    assert left.miss == largest(near) < 1e-12


def test_halved_steps_ask_for_no_slopes_where_what_is_missing_is_known_without() -> None:
    look, asked = counted(lambda x: np.arctan(x), lambda x: np.diag(1.0 / (1.0 + x**2)))
    told = {"steps": 20, "met": 1e-12, "halvings": 8}
    plain, _ = newton(look, np.add, np.array([3.0]), ONE, **told)
    many, missed = len(asked), list[np.ndarray]()
    asked.clear()

    def value(place: np.ndarray) -> np.ndarray:
        missed.append(place)
        return np.arctan(place)

    found, left = newton(look, np.add, np.array([3.0]), ONE, missed=value, **told)
    assert found == plain
    assert left.miss < 1e-12
    assert len(missed) == many - 1
    assert len(asked) < many


def test_no_step_is_longer_than_allowed() -> None:
    look, asked = counted(lambda x: x - 10.0, lambda _: np.eye(1))
    newton(look, np.add, np.zeros(1), ONE, steps=4, longest=0.5, halvings=1)
    assert np.ravel(asked) == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0])


def test_a_place_without_values_shortens_a_step() -> None:
    def value(x: np.ndarray) -> np.ndarray:
        if x[0] <= 0.0:
            raise ArithmeticError
        return np.log(x)

    look, _ = counted(value, lambda x: np.diag(1.0 / x))
    found, _ = newton(look, np.add, np.array([9.0]), ONE, steps=30, met=1e-12, halvings=9, refused=(ArithmeticError,))
    assert found[0] == pytest.approx(1.0)
    with pytest.raises(ArithmeticError):
        newton(look, np.add, np.array([9.0]), ONE, steps=30, halvings=9)


def test_where_no_step_leads_nearer_it_ends_with_the_nearest_place() -> None:
    look, asked = counted(lambda x: x**2 + 1.0, lambda x: np.diag(2.0 * x))
    found, left = newton(look, np.add, np.array([1e-8]), ONE, steps=50, met=2.0, halvings=4)
    assert len(asked) < 40
    assert left.miss == pytest.approx(1.0)
    assert found[0] == 1e-8


def test_it_ends_at_once_where_what_is_missing_is_small_enough_or_a_step_is() -> None:
    look, asked = counted(lambda x: x**2 - 2.0, lambda x: np.diag(2.0 * x))
    newton(look, np.add, np.array([1.5]), ONE, steps=20, exact=1e-2)
    assert len(asked) == 2
    asked.clear()
    found, _ = newton(look, np.add, np.array([1.5]), ONE, steps=20, still=1e-3)
    assert len(asked) == 3  # the third step was short, and nothing is asked behind it
    assert found[0] == pytest.approx(np.sqrt(2.0), abs=1e-10)


def test_places_need_be_no_vectors() -> None:
    def look(angle: complex) -> Missing:
        return Missing(np.array([np.angle(angle) - 1.0]), ONE, lambda: np.eye(1))

    found, _ = newton(look, lambda z, step: z * np.exp(1j * step[0]), 1.0 + 0.0j, ONE, steps=5, met=1e-12)
    assert found == pytest.approx(np.exp(1j))


def test_an_unknown_whose_scale_is_zero_is_held() -> None:
    look, _ = counted(lambda x: np.array([x[0] * x[1] - 6.0]), lambda x: np.array([[x[1], x[0]]]))
    with np.errstate(all="raise"):
        found, left = newton(look, np.add, np.array([1.0, 3.0]), np.array([1.0, 0.0]), steps=9, met=1e-12, longest=0.5)
    assert found == pytest.approx([2.0, 3.0])
    assert found[1] == 3.0
    assert left.miss < 1e-12
