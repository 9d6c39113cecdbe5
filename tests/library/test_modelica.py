"""Examples of the Modelica Standard Library 4.1.0 from library parts, against its published reference trajectories.

The figures are those of Dymola at a tolerance of 1e-6 or less (modelica/MAP-LIB_ReferenceResults, branch v4.1.0): some
times, the range of each signal over the whole run, and by how much of it a run at 1e-10 here differs at most at any
published time, which `docs/modelica.md` has.

All of them, in both forms: ``python -m pytest tests/library/test_modelica.py --all``.
"""

from __future__ import annotations

import json
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from atwood import Result, simulate

from ..references.modelica.building import Example
from ..references.modelica.rotational import compare_braking_torque
from ..references.modelica.translational import compare_braking_force

ROOT = Path(__file__).parents[2]
DOMAINS = ("elementary", "springs", "constraints", "loops", "rotors", "robot", "rotational", "translational")
EXAMPLES: dict[str, Example] = {}
REFERENCE: dict[str, Any] = {}
for domain in DOMAINS:
    found = import_module(f"..references.modelica.{domain}", __package__).EXAMPLES
    EXAMPLES |= {f"{domain}.{name}": example for name, example in found.items()}
    text = (ROOT / "tests" / "references" / "modelica" / f"{domain}.json").read_text()
    REFERENCE |= {f"{domain}.{name}": figures for name, figures in json.loads(text).items()}

SAME = 1e-4
"""Of the range of a signal: what is within it is the same."""


EXACT = ("springDamper.w_rel", "axis.gear.spring.phi_rel", "axis.gear.spring.w_rel")
"""Signals in which the reference errs by more than that before a fifth of the run; here the exact solution is met."""


def errs(name: str) -> list[str]:
    """Return the signals of an example in which the reference errs by more than that."""
    return [path for path, known in REFERENCE[name]["signals"].items() if known["differs"] > SAME]


def run(name: str, form: str, rtol: float) -> Result:
    """Return the run of an example, with the times of the reference among its own."""
    example, figures = EXAMPLES[name], REFERENCE[name]
    return simulate(
        example.make(), t_end=figures["end"], form=form, rtol=rtol, outputs=figures["times"], **example.options
    )


def differences(name: str, result: Result) -> dict[str, np.ndarray]:
    """Return, for each signal, by how much it differs at the times of the reference, over its range."""
    figures = REFERENCE[name]
    at = np.searchsorted(result.time, figures["times"])
    assert result.time[at] == pytest.approx(figures["times"], abs=1e-12)
    return {
        path: np.abs(EXAMPLES[name].signal(path).read(result)[at] - known["values"]) / known["range"]
        for path, known in figures["signals"].items()
    }


@pytest.mark.sample(3)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", [name for name, example in EXAMPLES.items() if not example.long])
def test_trajectories_meet_those_of_modelica(name: str, form: str) -> None:
    early = np.array(REFERENCE[name]["times"]) <= 0.2 * REFERENCE[name]["end"]
    for path, off in differences(name, run(name, form, 1e-9)).items():
        if path not in errs(name):
            assert max(off) < SAME, path
            continue
        assert max(off) < 1.1 * REFERENCE[name]["signals"][path]["differs"], path
        assert max(off[early]) < SAME or path in EXACT, path


def test_loops_whose_formulas_would_divide_by_an_exact_zero_run() -> None:
    """A loop in space of a ball, a guide and a universal joint, beside a hinge that is parallel to one of its axes."""
    test_trajectories_meet_those_of_modelica("springs.LineForceWithTwoMasses", "reduced")


@pytest.mark.sample(0)
@pytest.mark.parametrize("name", [name for name, example in EXAMPLES.items() if example.long])
def test_long_trajectories_meet_those_of_modelica(name: str) -> None:
    test_trajectories_meet_those_of_modelica(name, "reduced")


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", [name for name in EXAMPLES if errs(name) and not EXAMPLES[name].long])
def test_where_they_differ_later_the_reference_errs(name: str) -> None:
    """What they differ by is many times what a tolerance a thousand times smaller changes here."""
    coarse, fine = (run(name, "reduced", rtol) for rtol in (1e-8, 1e-11))
    times = REFERENCE[name]["times"]
    for path in errs(name):
        a, b = (EXAMPLES[name].signal(path).read(r)[np.searchsorted(r.time, times)] for r in (coarse, fine))
        known = REFERENCE[name]["signals"][path]
        assert max(abs(a - b)) / known["range"] < 0.25 * known["differs"]


def driven(stiffness: np.ndarray, damping: np.ndarray, push: np.ndarray, frequency: float, end: float) -> np.ndarray:
    """Return places and speeds from rest, pushed by ``push sin(frequency t)``: the exponential of a matrix."""
    n = len(push)
    linear = np.zeros((2 * n + 2, 2 * n + 2))
    linear[:n, n : 2 * n] = np.eye(n)
    linear[n : 2 * n, :n], linear[n : 2 * n, n : 2 * n], linear[n : 2 * n, 2 * n] = -stiffness, -damping, push
    linear[2 * n, 2 * n + 1], linear[2 * n + 1, 2 * n] = frequency, -frequency
    state: np.ndarray = expm(linear * end)[:, -1]
    return state[: 2 * n]


def test_where_they_differ_most_the_exact_solution_is_met() -> None:
    """Linear examples, in which the reference is off by more than 1e-4 before a fifth of the run, too."""
    for example, frame, pair in (("translational", "mass", "displacement"), ("rotational", "inertia", "angle")):
        rate = {"displacement": "speed", "angle": "angular_velocity"}[pair]
        result = run(f"{example}.GenerationOfFMUs", "reduced", 1e-11)
        spring = np.array([[1e4 / 1.1, -1e4 / 1.1], [-1e4 / 2.2, 1e4 / 2.2]])
        exact = driven(spring, 0.0 * spring, np.array([10.0 / 1.1, 0.0]), 4.0 * np.pi, result.time[-1])
        found = [result[f"{frame}3{side}.{what}"][-1] for what in (pair, rate) for side in "ab"]
        assert found == pytest.approx(exact, abs=1e-9)
    # The shaft, the housing and the load of the elastic bearing, for as long as the torque rises.
    result = simulate(EXAMPLES["rotational.ElasticBearing"].make(), t_end=2.0, rtol=1e-11, atol=1e-14)
    gear, inertia = np.array([1.0 / 3.0, 2.0 / 3.0, -1.0]), np.array([1.0, 5.0, 50.0])
    stiffness = 1e3 * np.outer(gear, gear) + np.diag([0.0, 1e5, 0.0])
    linear = np.zeros((8, 8))
    linear[:3, 3:6] = np.eye(3)
    linear[3:6, :3], linear[4, 4], linear[3, 6], linear[6, 7] = -stiffness / inertia[:, None], -5.0 / 5.0, 20.0, 1.0
    exact = expm(2.0 * linear)[:, 7]
    found = [
        result[f"{name}.{what}"][-1] for what in ("angle", "angular_velocity") for name in ("shaft", "housing", "load")
    ]
    assert found == pytest.approx(exact[:6], rel=1e-9, abs=1e-11)
    result, frequency = run("translational.Oscillator", "reduced", 1e-11), 2.0 * np.pi * 15.9155
    for mass, damping in (("mass1", 0.0), ("mass2", 10.0)):
        place, speed = driven(np.full((1, 1), 1e4), np.full((1, 1), damping), np.ones(1), frequency, result.time[-1])
        assert result[f"{mass}.displacement"][-1] == pytest.approx(place - 0.5, abs=1e-10)
        assert result[f"{mass}.speed"][-1] == pytest.approx(speed, abs=1e-8)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(
    ("scene", "rate"), [(compare_braking_force(), "speed"), (compare_braking_torque(), "angular_velocity")]
)
def test_brakes_without_published_trajectories_meet_closed_forms(scene, rate: str, form: str) -> None:
    """`CompareBrakingForce` and `CompareBrakingTorque`: from a speed of 100 at a deceleration of 100."""
    times = np.array([0.1, 0.25, 0.4, 0.6, 0.9, 1.0])
    result = simulate(scene, t_end=1.0, form=form, rtol=1e-9, outputs=times)
    at = np.searchsorted(result.time, times)
    exact = {
        "sign": np.where(times < 0.99, 100.0 - 100.0 * times, np.exp(-100.0 * (times - 0.99))),
        "linear": 100.0 * np.exp(-times),
        "quadratic": 100.0 / (1.0 + times),
        "inverse": 100.0 * np.sqrt(np.maximum(1.0 - 2.0 * times, 0.0)),
    }
    for name, speed in exact.items():
        assert result[f"{name}.{rate}"][at] == pytest.approx(speed, abs=1e-4), name


def test_each_example_has_figures_and_stands_in_the_table() -> None:
    assert EXAMPLES.keys() == REFERENCE.keys()
    table = (ROOT / "docs" / "modelica.md").read_text()
    for name, example in EXAMPLES.items():
        signals = REFERENCE[name]["signals"]
        assert signals.keys() <= example.signals.keys()
        largest = max(known["differs"] for known in signals.values())
        figure = f"{largest:.0e}".replace("e-0", "e-").replace("0e+00", "0")
        assert re.search(rf"\| `(\w+\.)*{name.partition('.')[2]}` \|.*\| {figure}\b", table), name
