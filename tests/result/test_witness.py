"""Errors are told of runs whose solver stepped over a narrow law: by other steps, and by the balance of energy."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import erf

import atwood
from atwood import Result, Scene, simulate
from atwood.result import accuracy as second_run
from atwood.result.accuracy import needed_error
from atwood.simulation.problem.options import RunOptions
from atwood_library import Force, Mass1D, Potential
from atwood_library.scenes import SCENES, FourBar, SimplePendulum

PULSE = 5.123


def hill(height: float = 0.45, width: float = 0.1) -> Scene:
    """Return a mass that moves at 1 m/s towards a hill, or a well, at 2 m."""
    scene = Scene(space="line", gravity=0.0, t_end=4.0)
    mass = scene.add("m", Mass1D(mass=1.0))
    law = scene.add("law", Potential(energy_function=f"{height}*exp(-((x-2)/{width})^2)"))
    scene.connect(mass.flange, law.point)
    scene.start.update({"m.displacement": 0.0, "m.speed": 1.0})
    return scene


@cache
def path_over_hill(height: float, width: float) -> Callable[[np.ndarray], np.ndarray]:
    def rates(_: float, y: np.ndarray) -> list[float]:
        s = (y[0] - 2.0) / width
        return [y[1], 2.0 * height * s / width * math.exp(-s * s)]

    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 0.5 * width, "dense_output": True}
    found: Callable[[np.ndarray], np.ndarray] = solve_ivp(rates, (0.0, 4.0), [0.0, 1.0], **options).sol
    return found


def tap(width: float) -> Scene:
    """Return a mass of 1 kg at rest that a pulse of 1 N s meets."""
    scene = Scene(space="line", gravity=0.0, t_end=10.0)
    mass = scene.add("m", Mass1D(mass=1.0))
    most = 1.0 / (width * math.sqrt(math.pi))
    law = scene.add("law", Force(value=lambda t: most * atwood.exp(-(((t - PULSE) / width) ** 2))))
    scene.connect(mass.flange, law.point)
    scene.start.update({"m.displacement": 0.0, "m.speed": 0.0})
    return scene


def after_tap(time: np.ndarray, width: float) -> np.ndarray:
    s = (time - PULSE) / width
    return 0.5 * width * (s * (1.0 + erf(s)) + np.exp(-s * s) / math.sqrt(math.pi))


def check(result: Result, exact: np.ndarray) -> None:
    true = float(np.max(np.abs(result["m.displacement"] - exact)))
    reached = result.accuracy.reached
    assert true < 1.5 * reached + 1e-12
    assert reached < 10.0 * true + 1e-12


WAYS: dict[str, dict[str, Any]] = {
    "auto": {},
    "tight": {"rtol": 1e-10},
    "loose": {"rtol": 1e-4},
    "taylor": {"solver": "taylor"},
    "ida": {"solver": "ida", "rtol": 1e-12},
    "gauss": {"solver": "gauss", "step": 0.01},
    "accuracy": {"accuracy": 1e-8},
}


@pytest.mark.filterwarnings("ignore:.*a law may change by more within a step")
@pytest.mark.parametrize("width", [0.1, 0.01])
@pytest.mark.parametrize("height", [0.45, -0.45])
@pytest.mark.parametrize("way", WAYS)
def test_the_error_of_a_run_that_missed_a_law_of_place_is_told(way: str, height: float, width: float) -> None:
    result = simulate(hill(height, width), **WAYS[way])
    check(result, path_over_hill(height, width)(result.time)[0])
    if way == "accuracy":
        assert result.accuracy.is_met


@pytest.mark.parametrize("width", [0.1, 0.01])
@pytest.mark.parametrize("way", [name for name in WAYS if name != "gauss"])
def test_the_error_of_a_run_that_missed_a_pulse_is_told(way: str, width: float) -> None:
    result = simulate(tap(width), **WAYS[way])
    check(result, after_tap(result.time, width))


def test_the_energy_needs_no_larger_error_than_there_is() -> None:
    scene = SimplePendulum()
    for solver, rtol in (("ida", 1e-4), ("ida", 1e-8), ("explicit", 1e-5)):
        result = simulate(scene, solver=solver, rtol=rtol)
        error = np.max(np.abs(result["rod.angle"] - scene.closed_form(result.time)["rod.angle"]))
        assert 0.01 * error < needed_error(result.run, 0.0) < 3.0 * error


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_the_energy_needs_none_where_runs_are_right(form: str) -> None:
    for scene in (SimplePendulum(), FourBar(), SCENES["quarter-car"](), SCENES["atwood"]()):
        assert needed_error(simulate(scene, form=form, rtol=1e-11, t_end=1.0).run, 0.0) < 1e-9


def test_a_second_solution_that_missed_a_law_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where all that can be solved steps over a hill, the error is not known, and not said to be small or large."""
    monkeypatch.setattr("atwood.simulation.problem.step_guard.find_curved", lambda *_: ())  # nothing watches
    monkeypatch.setattr(second_run, "_STEPS", 0.01)
    monkeypatch.setattr(second_run, "_SHORTER", (1.0,))
    missed = simulate(hill(0.45, 0.002), rtol=1e-10, solver="taylor", samples=4000)
    options: list[RunOptions] = []
    original = second_run.run

    def run(assembly: Any, start: Any, given: RunOptions, other: Any) -> Any:
        options.append(atwood.lazy_dataclasses.replace(given, solver="taylor"))
        return original(assembly, start, options[-1], other)

    monkeypatch.setattr(second_run, "run", run)
    right = simulate(hill(), rtol=1e-12, solver="ida")
    for result in (missed, right):
        assert math.isinf(result.accuracy.reached)
        assert not result.accuracy.path
        assert "not known" in result.accuracy.describe()
        assert result.accuracy.to_data()["reached"] is None
    assert options


def test_a_second_solution_takes_other_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("atwood.simulation.problem.step_guard.find_curved", lambda *_: ())  # nothing watches
    result = simulate(hill(), solver="taylor", rtol=1e-10)
    assert result.statistics.steps < 5
    assert result.second.statistics.steps > 90


def test_a_second_solution_differs_where_steps_are_bounded() -> None:
    """With the same longest step both would take the same steps, and their errors be the same."""
    scene = SimplePendulum()
    result = simulate(scene, rtol=1e-3, max_step=0.3)
    error = np.max(np.abs(result["rod.angle"] - scene.closed_form(result.time)["rod.angle"]))
    assert 0.3 * error < np.max(result.error("rod.angle")) < 3.0 * error
