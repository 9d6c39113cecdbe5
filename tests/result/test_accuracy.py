"""Estimated errors against true ones, and motions that are as accurate as was asked."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

import atwood
from atwood import Component, Scene, UsageError, discrete_state, simulate, update
from atwood.result.accuracy import difference
from atwood_library import Ground, Mass1D, RotationalSource, Rotor
from atwood_library.scenes import (
    ChaplyginSleigh,
    DoublePendulum,
    FourBar,
    Kepler,
    Oscillators,
    SimplePendulum,
)

KNOWN = {
    "pendulum": lambda: SimplePendulum(release_angle=2.5, length=0.7),
    "oscillator": lambda: Oscillators(kind="harmonic"),
    "sleigh": ChaplyginSleigh,
}
"""Scenes with closed forms."""


class Counting(Component):
    """It counts how often it was called."""

    y: float = discrete_state(0.0, doc="A count.")

    @update(every=0.1, sets="y", reads=())
    def count(self) -> float:
        """Return one more."""
        return self.y + 1.0


def counted() -> Scene:
    scene = SimplePendulum()
    scene.add("counter", Counting())
    return scene


ASKED = (1e-4, 1e-6, 1e-8, 1e-10)


def true_errors(scene: Scene, result: atwood.Result) -> dict[str, np.ndarray]:
    exact = scene.closed_form(result.time)
    return {path: np.abs(result[path] - values) for path, values in exact.items() if path in result}


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", KNOWN)
def test_the_error_is_below_what_was_asked(name: str, form: str) -> None:
    for asked in ASKED:
        scene = KNOWN[name]()
        result = simulate(scene, form=form, accuracy=asked)
        assert result.accuracy.is_met
        assert result.accuracy.asked == asked
        for path, error in true_errors(scene, result).items():
            if result.unit(path) in ("m", "rad"):
                assert np.max(error) < 10.0 * asked


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("name", KNOWN)
def test_estimates_are_right_within_a_factor_of_ten(name: str, rtol: float, form: str) -> None:
    scene = KNOWN[name]()
    result = simulate(scene, form=form, rtol=rtol)
    for path, error in true_errors(scene, result).items():
        largest = float(np.max(error))
        if largest > 1e-11 * max(1.0, float(np.max(np.abs(result[path])))):
            assert 0.1 * largest < float(np.max(result.error(path))) < 10.0 * largest


def test_a_run_says_until_when_it_tells_of_chaos() -> None:
    result = simulate(DoublePendulum(), t_end=60.0, outputs=601)
    assert result.accuracy.reached > 0.1
    assert 10.0 < result.accuracy.until < 40.0
    early = result.time < 0.8 * result.accuracy.until
    assert np.max(result.error("rod2.angle")[early]) < 0.1
    assert "it tells little of the motion after" in result.accuracy.describe()
    with pytest.warns(UserWarning, match=r"1e-08 was asked for, and holds until t = 2\d"):
        asked = simulate(DoublePendulum(), t_end=60.0, accuracy=1e-8)
    assert not asked.accuracy.is_met
    assert asked.accuracy.until > 15.0


def test_closed_loops_have_estimates_in_both_forms() -> None:
    exact = simulate(FourBar(), rtol=1e-13, t_end=2.0)
    for form in ("reduced", "dae"):
        result = simulate(FourBar(), form=form, t_end=2.0, accuracy=1e-7)
        miss = np.max(np.abs(result["crank.angle"] - exact["crank.angle"]))
        assert miss < 1e-6
        assert result.accuracy.reached <= 1e-7


def test_events_and_reactions_have_estimates() -> None:
    result = simulate(SimplePendulum(), rtol=1e-5, record="rod.angle crosses 0")
    k = math.sin(0.5)
    quarter = math.sqrt(1.0 / 9.81) * 2.0 * float(atwood_ellipk(k * k)) / 2.0
    missed = abs(result.events[0].time - quarter)
    assert 0.1 * missed < result.accuracy.events[0] < 10.0 * missed
    scene = SimplePendulum()
    tension = scene.closed_form(result.time)["rod.tension"]
    largest = np.max(np.abs(result["rod.tension"] - tension))
    assert 0.1 * largest < np.max(result.error("rod.tension")) < 10.0 * largest


def atwood_ellipk(m: float) -> float:
    from scipy.special import ellipk

    return float(ellipk(m))


def test_times_at_events_take_the_error_beside_them() -> None:
    time, other = np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0])
    found = difference(time, np.array([0.0, 5.0, 9.0, 1.0]), other, np.array([0.1, 7.0, 1.2]))
    assert found == pytest.approx([0.1, 0.2, 0.2, 0.2])


def test_what_was_asked_for_is_kept_and_asked_for_once() -> None:
    result = simulate(Kepler(), t_end=3.0, accuracy=1e-7)
    again = pickle.loads(pickle.dumps(result))
    assert again.accuracy.reached == result.accuracy.reached
    with pytest.raises(UsageError, match="ask for two things"):
        simulate(Kepler(), accuracy=1e-7, rtol=1e-5)
    with pytest.raises(UsageError, match="an error between"):
        simulate(Kepler(), accuracy=0.0)
    with pytest.raises(UsageError, match="functions at sample times"):
        simulate(counted(), t_end=0.2, accuracy=1e-6)


def test_shafts_that_carry_no_body_are_compared_by_their_angles() -> None:
    """The frame of a rotor has a coordinate of its own that is no quantity: nothing was compared."""
    scene = Scene(gravity=0.0)
    ground, rotor = scene.add("ground", Ground()), scene.add("rotor", Rotor(moment=0.5))
    spring = scene.add("spring", RotationalSource(law="-20*sin(x)"))
    scene.connect(ground.frame, rotor.a)
    scene.connect(rotor.shaft, spring.b)
    scene.start.update({"rotor.angle": 1.0, "rotor.angular_velocity": 0.0})
    result = simulate(scene, t_end=5.0, accuracy=1e-6, outputs=np.linspace(0.0, 5.0, 51))
    exact = simulate(scene, t_end=5.0, rtol=1e-13, solver="taylor", outputs=np.linspace(0.0, 5.0, 51))
    error = float(np.max(np.abs(result["rotor.angle"] - exact["rotor.angle"])))
    assert result.accuracy.path == "rotor.angle"
    assert error <= result.accuracy.reached <= 1e-6


def test_what_does_not_move_has_no_error() -> None:
    scene = Scene(space="line", gravity=0.0)
    scene.add("ground", Ground())
    scene.add("mass", Mass1D())
    assert simulate(scene, t_end=1.0).accuracy.reached < 1e-15


def test_closed_loops_begin_with_the_tolerance_of_the_method_that_solves_them() -> None:
    """What solves a scene is asked for, and not guessed: formulas solve a four-bar's loop, and series integrate it."""
    tolerances = []
    for form, solver in (("reduced", "auto"), ("dae", "auto"), ("dae", "ida")):
        result = simulate(FourBar(), form=form, t_end=1.0, accuracy=1e-6, solver=solver)
        assert result.accuracy.is_met
        tolerances.append(result.run.options.relative_tolerance)
    assert tolerances[0] == pytest.approx(3e-7)
    assert tolerances[1] > 1e-8 >= tolerances[2]


def test_an_accuracy_that_cannot_be_told_is_refused_before_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []
    monkeypatch.setattr("atwood.pipeline.run", lambda *_: asked.append(1.0))
    with pytest.raises(UsageError, match="sample times"):
        simulate(counted(), accuracy=1e-6)
    assert not asked
