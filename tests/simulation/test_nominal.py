"""Nominal sizes: what is small beside them counts as small, in tolerances and in the accuracy of a motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

import atwood_library as lib
from atwood import Scene, simulate
from atwood.errors import UsageError
from atwood_library.scenes.simple_pendulum import SimplePendulum

from ..helpers.runs import FORMS


def trembling(amplitude: float = 1e-3, far: float = 1e3) -> Scene:
    """Return a mass that trembles by a millimetre, on a scene of a kilometre."""
    scene = Scene(space="line", gravity=0.0, t_end=10.0)
    mass = scene.add("mass", lib.Mass1D(mass=1.0))
    rest = scene.add("rest", lib.Ground(position=(far, 0.0, 0.0)))
    spring = scene.add("spring", lib.Spring(stiffness=4.0, natural_length=far))
    scene.connect(spring.a, rest.frame)
    scene.connect(spring.b, mass.flange)
    scene.start.update({"mass.displacement": amplitude, "mass.speed": 0.0})
    return scene


def error_of(form: str, **options: object) -> float:
    result = simulate(trembling(), form=form, rtol=1e-7, **options)
    return float(np.max(np.abs(result["mass.displacement"] - 1e-3 * np.cos(2.0 * result.time)))) / 1e-3


@pytest.mark.parametrize("form", FORMS)
def test_errors_are_relative_to_the_size_that_is_given(form):
    """Beside a kilometre a millimetre is nothing; with its own size it is as accurate as the tolerance."""
    own, given = error_of(form), error_of(form, nominal={"mass.displacement": "1 mm"})
    assert own > 100.0 * given
    assert given < 3e-5


def test_rates_go_with_their_coordinates_and_can_be_given_by_themselves():
    loose, tight = (
        simulate(trembling(), nominal={"mass.displacement": 1.0, "mass.speed": size}).statistics.steps
        for size in ("1 km/s", "1 mm/s")
    )
    assert tight > loose


def test_accuracy_counts_quantities_with_a_nominal_size():
    plain = simulate(SimplePendulum(), accuracy=1e-4)
    given = simulate(SimplePendulum(), accuracy=1e-4, nominal={"rod.tension": 1e-3})
    assert given.accuracy.path == "rod.tension"
    assert given.accuracy.is_met
    assert np.max(given.error("rod.tension")) <= 1e-7
    assert np.max(plain.error("rod.tension")) > 1e-7
    assert math.isclose(given.accuracy.reached, 3.0 * np.max(given.error("rod.tension")) / 1e-3)


@pytest.mark.parametrize(
    ("nominal", "said"),
    [
        ({"bob.positoin.x": 1.0}, "bob.position.x"),
        ({"rod.angle": "1 mm"}, "rad"),
        ({"rod.angle": 0.0}, "above 0"),
        ({"rod.angle": float("nan")}, "above 0"),
        ("rod.angle", "sizes by the path"),
    ],
)
def test_sizes_that_make_no_sense_are_refused(nominal, said):
    with pytest.raises(UsageError, match=said):
        simulate(SimplePendulum(), nominal=nominal)
