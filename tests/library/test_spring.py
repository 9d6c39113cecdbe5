"""Springs of negative stiffness, where they are asked for."""

import numpy as np
import pytest

from atwood import ParameterError, Scene, simulate
from atwood_library import Ground, Mass1D, Spring

from ..helpers.runs import FORMS


@pytest.mark.parametrize("form", FORMS)
def test_a_negative_stiffness_on_request(form: str) -> None:
    scene = Scene(gravity=0.0, t_end=2.0, space="line")
    ground, mass = scene.add("ground", Ground()), scene.add("mass", Mass1D(mass=2.0))
    holds = scene.add("holds", Spring(stiffness=3.0, natural_length=1.0))
    pushes = scene.add("pushes", Spring(stiffness=5.0, natural_length=1.0, acts="repelling"))
    for spring in (holds, pushes):
        scene.connect(ground.frame, spring.a)
        scene.connect(spring.b, mass.flange)
    scene.start.update({"mass.displacement": 1.1, "mass.speed": 0.0})
    result = simulate(scene, form=form, rtol=1e-9, outputs=9)
    assert np.allclose(result["mass.displacement"], 1.0 + 0.1 * np.cosh(result.time), atol=1e-6)
    assert np.allclose(result["pushes.tension"], -5.0 * (result["mass.displacement"] - 1.0), atol=1e-9)
    assert result.energy.max_drift < 1e-5


def test_a_negative_number_is_refused() -> None:
    with pytest.raises(ParameterError, match="stiffness"):
        Spring(stiffness=-5.0)
