"""Charts by themselves: axes, quaternions and rates belong together, in expressions and in numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from atwood.expr import Graph, evaluate, jvp
from atwood.mechanics.kinematics.orientation import (
    BASES,
    orientation_axes,
    orientation_margin,
    orientation_quaternion,
    orientation_rates,
)
from atwood.simulation.dynamics.orientation_coordinates import _coordinates, _matrix, _quaternion
from atwood.topology.orientation_coordinates import ORIENTATIONS, OrientationCoordinates, check_orientation

from ..references.rotations import about, cross_matrix, from_quaternion

EULER = [kind for kind in ORIENTATIONS if kind.startswith("euler-")]
SPIN = np.array([0.7, -1.1, 0.4])


def chart_of(kind: str, base: int = 0) -> OrientationCoordinates:
    count = 4 if kind == "quaternion" else 3
    return OrientationCoordinates(kind, tuple(range(count)), (0, 1, 2), "body", base)


def places(kind: str) -> list[list[float]]:
    """Return coordinates to look at: some, and those of no rotation or a long one, where they are regular."""
    if kind == "quaternion":
        return [[0.5, -0.7, 0.3, 0.4]]
    return [[0.4, 1.1, -0.8], [2.5, 0.6 if kind[6] == kind[8] else -0.3, 3.0]]


def numbers(kind: str, base: int, at: list[float]) -> dict[str, Any]:
    """Return everything that a chart gives at a place, with the derivative of the axes along the rates."""
    graph = Graph()
    symbols = [graph.symbol(f"c{i}") for i in range(len(at))]
    spins = [graph.symbol(f"w{i}") for i in range(3)]
    chart = chart_of(kind, base)
    axes = [graph.convert(axis[i]) for axis in orientation_axes(chart, symbols) for i in range(3)]
    quaternion = [graph.convert(part) for part in orientation_quaternion(chart, symbols)]
    rates = [graph.convert(rate) for rate in orientation_rates(chart, symbols, spins)]
    moving = jvp(axes, dict(zip(symbols, rates, strict=True)))
    values = {**dict(zip(symbols, at, strict=True)), **dict(zip(spins, SPIN, strict=True))}
    found = np.array(evaluate([*axes, *moving, *quaternion], values))
    return {"axes": found[:9].reshape(3, 3).T, "moving": found[9:18].reshape(3, 3).T, "quaternion": found[18:]}


@pytest.mark.parametrize("base", [0, 1])
@pytest.mark.parametrize("kind", ORIENTATIONS)
def test_axes_turn_with_the_angular_velocity_in_the_axes_of_the_body(kind: str, base: int) -> None:
    for at in places(kind):
        found = numbers(kind, base, at)
        axes = found["axes"]
        assert np.allclose(axes.T @ axes, np.eye(3), atol=1e-14)
        assert np.allclose(found["moving"], axes @ cross_matrix(SPIN), atol=1e-14)
        unit = found["quaternion"] / np.linalg.norm(found["quaternion"])
        assert np.allclose(from_quaternion(unit), axes, atol=1e-14)


@pytest.mark.parametrize("base", [0, 1])
@pytest.mark.parametrize("kind", ORIENTATIONS)
def test_numbers_and_expressions_agree_and_lead_back(kind: str, base: int) -> None:
    chart = chart_of(kind, base)
    for at in places(kind):
        quaternion = _quaternion(chart, np.array(at))
        axes = numbers(kind, base, at)["axes"]
        assert np.allclose(_matrix(0, quaternion), axes, atol=1e-14)
        again = _quaternion(chart, _coordinates(chart, quaternion))
        assert abs(again @ quaternion) == pytest.approx(1.0, abs=1e-14)
        assert np.allclose(_coordinates(chart, -quaternion), _coordinates(chart, quaternion), atol=1e-14) or (
            kind == "quaternion"
        )


@pytest.mark.parametrize("kind", EULER)
def test_euler_angles_are_turns_about_axes_that_have_turned(kind: str) -> None:
    angles = places(kind)[0]
    turned = np.eye(3)
    for letter, angle in zip(kind[6:], angles, strict=True):
        turned = turned @ about(np.eye(3)["xyz".index(letter)], angle)
    assert np.allclose(numbers(kind, 0, angles)["axes"], turned, atol=1e-15)
    base = np.array([[axis[i] for axis in BASES[1]] for i in range(3)], dtype=float)
    assert np.allclose(numbers(kind, 1, angles)["axes"], base @ turned, atol=1e-15)


@pytest.mark.parametrize("kind", ORIENTATIONS)
def test_every_chart_tells_before_it_is_singular(kind: str) -> None:
    graph = Graph()
    symbols = [graph.symbol(f"c{i}") for i in range(4 if kind == "quaternion" else 3)]
    margin = orientation_margin(chart_of(kind), symbols)
    if kind == "quaternion":
        assert margin is None
        return

    def at(*values: float) -> float:
        assert margin is not None
        return float(evaluate([margin], dict(zip(symbols, values, strict=True)))[0])

    singular = 0.0 if kind[6] == kind[8] else np.pi / 2.0
    assert at(0.0, singular, 0.0) > 0.0
    assert at(0.0, singular + 0.4, 0.0) > 0.0
    assert at(0.0, singular + 0.5, 0.0) < 0.0


def test_what_there_is_not_is_refused_with_what_is_near() -> None:
    from atwood import UsageError

    with pytest.raises(UsageError, match="euler-zzy") as caught:
        check_orientation("euler-zzy", "reduced", "space")
    assert "euler-zyz" in str(caught.value)
    with pytest.raises(UsageError, match="quaternions"):
        check_orientation("euler-zyz", "dae", "space")
    for kind in ("rodrigues", "rotation-vector"):
        with pytest.raises(UsageError, match="euler-zyz"):
            check_orientation(kind, "reduced", "space")
    assert len(ORIENTATIONS) == 13
