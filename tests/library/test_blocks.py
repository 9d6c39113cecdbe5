"""Blocks against closed forms and against scipy's linear systems."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import signal as systems

from atwood import Component, ParameterError, Scene, load_scene, save_scene, simulate
from atwood_library import (
    PI,
    PID,
    Add,
    DeadZone,
    FirstOrder,
    Gain,
    Integrator,
    Limiter,
    SampleAndHold,
    SampleDelay,
    SecondOrder,
    Sine,
    StateSpace,
    TransferFunction,
)

ANY = [("reduced", "explicit"), ("reduced", "taylor"), ("reduced", "ida"), ("dae", "ida")]


def driven(block: Component, source: Component | None = None, name: str = "u") -> Scene:
    """Return a block that a sine, or another source, drives."""
    scene = Scene()
    part = scene.add("block", block)
    drive = scene.add("drive", source or Sine(angular_frequency=2.0, phase=0.3))
    scene.connect(drive.output("value"), part.input(name))
    return scene


def response(system: Any, t: np.ndarray) -> np.ndarray:
    """Return what a linear system makes of the same sine, from rest: by its own modes, to rounding."""
    fine = np.linspace(0.0, t[-1], 20 * (len(t) - 1) + 1)
    _, y, _ = systems.lsim(system, np.sin(2.0 * fine + 0.3), fine)
    return np.asarray(y)[::20]


LINEAR: dict[str, tuple[Component, Any]] = {
    "integrator": (Integrator(gain=3.0), ([3.0], [1.0, 0.0])),
    "first order": (FirstOrder(gain=2.0, time_constant=0.4), ([2.0], [0.4, 1.0])),
    "second order": (SecondOrder(gain=1.5, angular_frequency=3.0, damping=0.2), ([13.5], [1.0, 1.2, 9.0])),
    "PI": (PI(gain=2.0, integral_time=0.5), ([2.0, 4.0], [1.0, 0.0])),
    "PID": (
        PID(gain=2.0, integral_time=0.5, derivative_time=0.2, filter_ratio=4.0, derivative_weight=1.0),
        ([10.0 * 0.05, 2.0 + 0.2, 4.0], [0.05, 1.0, 0.0]),
    ),
    "transfer function": (
        TransferFunction(numerator=(1.0, 2.0, 3.0), denominator=(2.0, 1.0, 4.0, 1.0)),
        ([1.0, 2.0, 3.0], [2.0, 1.0, 4.0, 1.0]),
    ),
    "one that passes through": (
        TransferFunction(numerator=(3.0, 1.0), denominator=(2.0, 5.0)),
        ([3.0, 1.0], [2.0, 5.0]),
    ),
    "state space": (
        StateSpace(a=((0.0, 1.0), (-4.0, -0.3)), b=(0.0, 2.0), c=(1.0, 0.5), d=0.25),
        ([[0.0, 1.0], [-4.0, -0.3]], [[0.0], [2.0]], [[1.0, 0.5]], [[0.25]]),
    ),
}


@pytest.mark.parametrize("name", LINEAR)
@pytest.mark.parametrize(("form", "solver"), ANY)
def test_linear_blocks_are_the_systems_that_they_are_said_to_be(name: str, form: str, solver: str) -> None:
    block, system = LINEAR[name]
    scene = driven(block.copy(), name="set_point" if isinstance(block, PID) else "u")
    result = simulate(scene, t_end=3.0, rtol=1e-9, outputs=61, form=form, solver=solver)
    assert_allclose(result["block.y"], response(system, result.time), atol=5e-5 * np.ptp(result["block.y"]))


def test_a_filter_reaches_its_order() -> None:
    """A step comes to 63 % in a time constant; a critically damped filter to 1 - 2/e in 1/w."""
    scene = Scene()
    scene.add("lag", FirstOrder(time_constant=0.5, u=1.0, start=0.2))
    scene.add("second", SecondOrder(angular_frequency=2.0, damping=1.0, u=1.0))
    result = simulate(scene, t_end=1.0, rtol=1e-11, outputs=[0.5])
    assert result["lag.y"][0] == pytest.approx(1.0 - 0.8 * np.exp(-1.0), rel=1e-9)
    assert result["second.y"][0] == pytest.approx(1.0 - 2.0 * np.exp(-1.0), rel=1e-9)


def test_limits_and_dead_zones() -> None:
    scene = Scene()
    drive = scene.add("drive", Sine(amplitude=3.0))
    for name, block in (("limiter", Limiter(lower=-1.0, upper=2.0)), ("dead", DeadZone(lower=-1.0, upper=2.0))):
        scene.connect(drive.output("value"), scene.add(name, block).input("u"))
    sum_ = scene.add("both", Add())
    scene.connect(scene["limiter"].output("y"), sum_.input("u_1"))
    scene.connect(scene["dead"].output("y"), sum_.input("u_2"))
    twice = scene.add("twice", Gain(gain=2.0, offset=1.0))
    scene.connect(sum_.output("y"), twice.input("u"))
    scene.add("lag", FirstOrder())
    result = simulate(scene, t_end=7.0)
    wave = 3.0 * np.sin(result.time)
    assert_allclose(result["limiter.y"], np.clip(wave, -1.0, 2.0), atol=1e-12)
    assert_allclose(result["dead.y"], np.maximum(wave - 2.0, 0.0) + np.minimum(wave + 1.0, 0.0), atol=1e-12)
    assert_allclose(result["twice.y"], 2.0 * wave + 1.0, atol=1e-12)


def test_anti_windup_keeps_the_integral_small_and_the_command_within_its_limits() -> None:
    """A plant 1/s that is to go farther than its limited input allows at once."""
    overshoot = {}
    for anti_windup in (0.5, 1e6):
        scene = Scene()
        control = PID(
            gain=4.0, integral_time=0.5, derivative_time=0.0, output_minimum=-1.0, output_maximum=1.0,
            anti_windup=anti_windup, set_point=3.0,
        )  # fmt: skip
        scene.add("control", control)
        plant = scene.add("plant", Integrator())
        scene.connect(control.output("y"), plant.input("u"))
        scene.connect(plant.output("y"), control.input("measurement"))
        result = simulate(scene, t_end=20.0)
        assert np.max(np.abs(result["control.y"])) <= 1.0
        overshoot[anti_windup] = np.max(result["plant.y"]) - 3.0
    assert overshoot[0.5] < 0.5 < 1.0 < overshoot[1e6]


@pytest.mark.parametrize("samples", [1, 3])
def test_samples_are_held_and_come_late(samples: int) -> None:
    scene = Scene()
    drive = scene.add("drive", Sine())
    hold, delay = (
        scene.add("hold", SampleAndHold(period=0.25)),
        scene.add("delay", SampleDelay(samples=samples, start=9.0)),
    )
    delay.period = 0.25
    scene.connect(drive.output("value"), hold.input("u"))
    scene.connect(hold.output("y"), delay.input("u"))
    result = simulate(scene, t_end=3.0, outputs=np.arange(0.1, 3.0, 0.25))
    taken = np.sin(np.arange(12) * 0.25)
    assert_allclose(result["hold.y"], taken, atol=1e-12)
    assert_allclose(result["delay.y"], [*[9.0] * samples, *taken[: 12 - samples]], atol=1e-12)


def test_blocks_are_saved_with_their_arrays(tmp_path: Any) -> None:
    scene = driven(TransferFunction(numerator=np.array([1.0, 2.0]), denominator=[1.0, 3.0, 2.0]))
    save_scene(scene, tmp_path / "scene.json")
    again = load_scene(tmp_path / "scene.json")
    before, after = (simulate(one, t_end=1.0)["block.y"] for one in (scene, again))
    assert_allclose(before, after, rtol=0, atol=0)


@pytest.mark.parametrize(
    ("block", "said"),
    [
        (lambda: TransferFunction(numerator=(1.0, 2.0, 3.0), denominator=(1.0, 1.0)), r"block\.numerator: its degree"),
        (lambda: TransferFunction(denominator=(0.0, 1.0)), r"block\.denominator: its first coefficient is zero"),
        (lambda: TransferFunction(denominator=[float("nan"), 1.0]), "nan in it is not a finite number"),
        (lambda: StateSpace(a=((1.0, 2.0),), b=(1.0,), c=(1.0,)), r"block\.a: it is no square matrix"),
        (lambda: StateSpace(a=((1.0, 2.0), (3.0,))), "its rows are not equally long"),
        (lambda: StateSpace(b=(1.0, 2.0)), r"block\.b: it has 2 numbers, and the system 1 states"),
        (lambda: Limiter(lower=2.0, upper=1.0), r"block\.lower: the least value 2 is above"),
        (lambda: SampleDelay(period=0.0), r"block\.period: its sample time is 0 s"),
    ],
)
def test_what_makes_no_block_is_refused(block: Any, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        simulate(driven(block()), t_end=1.0)
