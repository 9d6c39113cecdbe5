"""Noise: one function of time for everything, of its standard deviation and bandwidth."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from atwood import ParameterError, Scene, simulate, sweep
from atwood_library import Force, Ground, Noise, PointMass, Slider
from atwood_library.sources.noise import _share


def pushed(**given: float) -> Scene:
    scene = Scene()
    ground, rail, bob = (
        scene.add("ground", Ground()),
        scene.add("rail", Slider()),
        scene.add("bob", PointMass(mass=1.0)),
    )
    push, noise = scene.add("push", Force()), scene.add("noise", Noise(**given))
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, bob.point)
    scene.connect(bob.point, push.point)
    scene.connect(noise.output("value"), push.input("value"))
    scene.start["rail.displacement"] = scene.start["rail.speed"] = 0.0
    return scene


def test_it_has_its_moments_and_its_bandwidth() -> None:
    times = np.linspace(0.0, 2000.0, 40001)
    given = {"standard_deviation": 2.0, "bandwidth": 3.0, "offset": 0.5, "terms": 64, "seed": 7}
    values = np.full_like(times, 0.5)
    for k in range(64):
        share, phase = _share(7, 2 * k), 2.0 * np.pi * _share(7, 2 * k + 1)
        values += 2.0 * np.sqrt(2.0 / 64) * np.cos(2.0 * np.pi * 3.0 * (k + share) / 64 * times + phase)
    assert np.mean(values) == pytest.approx(0.5, abs=0.01)
    assert np.std(values) == pytest.approx(2.0, rel=0.01)
    assert abs(np.mean(((values - 0.5) / 2.0) ** 4) - 3.0) < 0.2  # of a normal distribution
    power = np.abs(np.fft.rfft((values - 0.5) * np.hanning(len(times)))) ** 2
    assert np.sum(power[np.fft.rfftfreq(len(times), 0.05) > 3.01]) < 1e-6 * np.sum(power)
    found = simulate(pushed(**given), t_end=20.0, outputs=401)
    assert_allclose(found["noise.value"], values[:401], atol=1e-12)


def test_solvers_forms_and_sweeps_see_the_same_function() -> None:
    exact = simulate(pushed(seed=5), t_end=3.0, rtol=1e-12, solver="taylor")
    for options in ({"solver": "ida"}, {"solver": "explicit"}, {"form": "dae"}):
        found = simulate(pushed(seed=5), t_end=3.0, rtol=1e-9, **options)
        assert_array_equal(found["noise.value"], exact["noise.value"])
        assert_allclose(found["rail.displacement"], exact["rail.displacement"], atol=1e-6)
    seeds = {"noise.seed": [4, 5, 6]}
    many = [sweep(pushed(), seeds, t_end=3.0, threads=threads, rtol=1e-12) for threads in (1, 3)]
    assert_array_equal(many[0]["rail.displacement"], many[1]["rail.displacement"])
    assert many[0].end("rail.displacement")[1] == pytest.approx(exact["rail.displacement"][-1], abs=1e-9)
    assert len(set(many[0].end("rail.displacement"))) == 3


def test_seeds_give_numbers_that_are_spread_and_differ() -> None:
    drawn = np.array([[_share(seed, k) for k in range(200)] for seed in range(50)])
    assert np.unique(drawn).size == drawn.size
    assert np.abs(np.mean(drawn) - 0.5) < 0.01
    assert np.max(np.abs(np.corrcoef(drawn) - np.eye(50))) < 0.3
    assert _share(0, 0) == _share(0, 0)


@pytest.mark.parametrize("bad", [{"seed": -1}, {"bandwidth": 0.0}, {"standard_deviation": -1.0}, {"terms": 3}])
def test_what_is_no_noise_is_refused(bad: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match=next(iter(bad))):
        Noise(**bad)
