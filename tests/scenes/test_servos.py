"""Machines that follow a trajectory: a platform on six controlled legs, and an arm with six axes."""

from typing import Any

import numpy as np
import pytest

from atwood import Result, assemble, report, simulate
from atwood_library.scenes import SCENES

CASES = {
    "stewart-platform": ("legs", "motion{}.force", range(6)),
    "six-axis-arm": ("drives", "motion{}.torque", range(1, 7)),
}


def length(result: Result, paths: list[str]) -> Any:
    return np.sqrt(sum(result.array(path) ** 2 for path in paths))


def errors(name: str, **settings: object) -> Any:
    """Return the root of the sum of the squared errors along a run."""
    choice, _, numbers = CASES[name]
    result = simulate(SCENES[name](**{choice: "controlled"}, **settings), rtol=1e-9)
    return length(result, [f"control{i}.error" for i in numbers])


def stiffness(name: str) -> float:
    scene: Any = SCENES[name]()
    found: float = scene.leg_stiffness() if name == "stewart-platform" else scene.stiffness()
    return found


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", CASES)
def test_the_error_stays_below_the_force_over_the_stiffness(name: str) -> None:
    choice, load, numbers = CASES[name]
    ideal = simulate(SCENES[name](**{choice: "ideal"}), rtol=1e-9)
    bound = float(np.max(length(ideal, [load.format(i) for i in numbers]))) / stiffness(name)
    largest = float(np.max(errors(name)))
    assert 0.8 * bound < largest < 1.02 * bound
    assert largest < 5e-3  # of an angle in rad, and of a leg in m


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", CASES)
def test_controllers_twice_as_stiff_leave_half_the_error(name: str) -> None:
    scene: Any = SCENES[name]()
    twice = errors(name, gain=2.0 * scene.gain)
    assert np.max(twice) == pytest.approx(0.5 * np.max(errors(name)), rel=0.02)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", CASES)
def test_both_forms_follow_alike(name: str) -> None:
    choice, _, numbers = CASES[name]
    scene = SCENES[name](**{choice: "controlled"})
    reduced = simulate(scene.copy(), t_end=0.2, outputs=5, rtol=1e-9)
    dae = simulate(scene, t_end=0.2, outputs=5, rtol=1e-8, form="dae")
    for number in numbers:
        path = f"control{number}.error"
        assert dae.array(path) == pytest.approx(reduced.array(path), abs=1e-8)


def test_the_platform_makes_its_lap() -> None:
    result = simulate(SCENES["stewart-platform"](legs="ideal", aside=0.12, yaw=0.3), rtol=1e-9)
    x, y, z = (result.array(f"platform.position.{axis}") for axis in "xyz")
    assert np.hypot(x - 0.12, y) == pytest.approx(0.12, abs=1e-8)
    assert z == pytest.approx(1.0, abs=1e-8)
    assert np.max(result.array("platform.x_axis.y")) == pytest.approx(np.sin(0.3), abs=1e-3)
    assert (x[-1], y[-1]) == pytest.approx((0.0, 0.0), abs=1e-8)


def test_what_can_move() -> None:
    equations = assemble(SCENES["six-axis-arm"]()).reduced
    assert (len(equations.speeds), len(equations.constraints)) == (6, 0)
    held = report(SCENES["stewart-platform"](legs="ideal"))
    assert (held.degrees_of_freedom, held.redundant) == (0, ())
