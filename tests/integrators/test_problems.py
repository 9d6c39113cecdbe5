"""Every method on one file of problems: exact solutions, accuracy, events, outputs between steps, limits, sweeps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import ellipj, ellipk

from atwood import Scene, UnsupportedError, UsageError, simulate, sweep
from atwood.integrators.methods import METHODS, Method
from atwood_library import Ground, PointMass, Spring
from atwood_library.scenes import SCENES, FourBar, SimplePendulum

STIFFNESS, LENGTH, STRETCH = 40.0, 1.0, 0.1
RATE = math.sqrt(STIFFNESS)


@pytest.fixture(params=[key for key, one in METHODS.items() if one.looks_for_events])
def method(request: Any) -> Method:
    """Each test runs with each method: one that is added to the registry is tested here without a line more."""
    return METHODS[request.param]


def solved(scene: Scene, method: Method, rtol: float = 1e-10, **more: Any) -> Any:
    """Return a run; where steps are equal, with short ones."""
    step = {"step": 2e-3} if method.has_equal_steps else {}
    return simulate(scene, solver=method.key, rtol=rtol, **step, **more)


def oscillator() -> Scene:
    """Return 1 kg on a spring that swings about 1 m below the ground."""
    scene = Scene(gravity=0.0)
    ground, mass = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=STIFFNESS, natural_length=LENGTH))
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, mass.point)
    still = {"m.position.x": 0.0, "m.velocity.x": 0.0, "m.velocity.z": 0.0}
    scene.start.update({**still, "m.position.z": -LENGTH - STRETCH})
    return scene


def pendulum() -> Scene:
    """Return a pendulum of 1 m that swings by 2 rad."""
    scene = SimplePendulum(length=1.0)
    scene.start.update({"rod.angle": 2.0, "rod.angular_velocity": 0.0})
    return scene


def test_an_oscillator_moves_as_a_cosine(method: Method) -> None:
    result = solved(oscillator(), method, t_end=3.0, outputs=31)
    exact = -LENGTH - STRETCH * np.cos(RATE * result.time)
    assert_allclose(result["m.position.z"], exact, atol=2e-7)
    assert_allclose(result["m.velocity.z"], STRETCH * RATE * np.sin(RATE * result.time), atol=2e-6)


def test_a_pendulum_swings_as_elliptic_functions_say(method: Method) -> None:
    result = solved(pendulum(), method, t_end=3.0, outputs=16)
    k = math.sin(1.0)
    sn, *_ = ellipj(ellipk(k * k) + math.sqrt(9.81) * result.time, k * k)
    assert_allclose(result["rod.angle"], 2.0 * np.arcsin(k * sn), atol=2e-6)


def test_smaller_tolerances_make_smaller_errors(method: Method) -> None:
    ways: list[dict[str, Any]] = [{"rtol": 1e-4}, {"rtol": 1e-8}]
    if method.has_equal_steps:
        ways = [{"order": 4, "step": 0.04}, {"order": 4, "step": 0.02}]
    errors = []
    for way in ways:
        result = simulate(oscillator(), solver=method.key, t_end=3.0, outputs=4, **way)
        errors.append(abs(result["m.position.z"][-1] + LENGTH + STRETCH * math.cos(RATE * 3.0)))
    assert errors[1] < 0.15 * errors[0] or errors[0] < 1e-9


def test_outputs_do_not_change_the_motion(method: Method) -> None:
    """What lies between two steps is read, or made by a step of its own; steps are those of the run without it."""
    few, many = (solved(pendulum(), method, t_end=1.0, outputs=count) for count in (3, 41))
    assert_array_equal(few["rod.angle"], many["rod.angle"][::20])
    assert few.statistics.steps == many.statistics.steps


def test_each_passing_is_noted_once_and_in_time(method: Method) -> None:
    level = -LENGTH - 0.5 * STRETCH
    result = solved(oscillator(), method, t_end=2.0, record=f"m.position.z crosses {level!r}")
    first = [math.acos(0.5), 2.0 * math.pi - math.acos(0.5)]
    exact = [(one + 2.0 * math.pi * turn) / RATE for turn in range(4) for one in first]
    assert [one.time for one in result.events] == pytest.approx([one for one in exact if one < 2.0], abs=2e-6)


def test_a_run_stops_where_it_is_asked_to(method: Method) -> None:
    result = solved(oscillator(), method, t_end=2.0, until=f"m.position.z crosses {-LENGTH!r}")
    assert result.status == "stopped"
    assert result.time[-1] == pytest.approx(0.5 * math.pi / RATE, abs=2e-6)


def test_limits_of_steps_are_said(method: Method) -> None:
    result = solved(pendulum(), method, t_end=100.0, max_steps=20)
    assert result.status == "step_limit"
    assert "20 steps" in result.message


def test_constraints_are_kept_or_refused(method: Method) -> None:
    if not method.keeps_constraints:
        with pytest.raises((UsageError, UnsupportedError)):
            simulate(FourBar(), form="dae", solver=method.key, t_end=0.2)
        return
    own, other = (
        simulate(FourBar(), form=form, solver=method.key, t_end=0.2, outputs=3) for form in ("dae", "reduced")
    )
    assert_allclose(own["coupler.angle"], other["coupler.angle"], atol=1e-6)


def test_loops_that_formulas_solve_are_for_every_method_that_has_their_equations(method: Method) -> None:
    try:
        result = simulate(SCENES["four-bar"](), solver=method.key, t_end=0.2, outputs=3, rtol=1e-8)
    except UnsupportedError:
        assert method.kind == "hamiltonian"  # its H is not T(p) + V(q)
        return
    expected = simulate(SCENES["four-bar"](), t_end=0.2, outputs=3, rtol=1e-10)
    for path, values in expected.table().items():
        if path.endswith(".angle"):
            assert_allclose(result[path], values, atol=1e-5)


def test_runs_of_a_sweep_are_runs_by_themselves(method: Method) -> None:
    angles = [0.5, 1.5]
    found = sweep(
        pendulum(), start={"rod.angle": angles}, quantities=["rod.angle"], solver=method.key, t_end=0.5, outputs=3
    )
    for angle, values in zip(angles, found["rod.angle"], strict=True):
        scene = pendulum()
        scene.start["rod.angle"] = angle
        alone = simulate(scene, solver=method.key, t_end=0.5, outputs=3)
        assert_allclose(alone["rod.angle"], values, atol=1e-9)
