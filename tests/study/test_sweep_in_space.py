"""Sweeps over scenes in space give, run by run, what a run by itself gives."""

import numpy as np
import pytest

from atwood import assemble, simulate, sweep
from atwood_library.scenes import SCENES

VARIED = {
    "intermediate-axis": "deviation",
    "lagrange-top": "spin",
    "heavy-top": "mass",
    "gyroscope": "inclination",
    "double-pendulum-3d": "mass",
    "rolling-ball": "speed",
    "universal-shaft": "rate",
    "spatial-slider-crank": "crank_rate",
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", VARIED)
def test_each_run_is_that_of_a_scene_made_so(name: str) -> None:
    scene, varied = SCENES[name](), VARIED[name]
    values = [getattr(scene, varied) * factor for factor in (0.9, 1.0, 1.07)]
    paths = list(assemble(scene).observables)
    found = sweep(scene, vary={varied: values}, quantities=paths, t_end=0.5, rtol=1e-8)
    for i, value in enumerate(values):
        alone = simulate(SCENES[name](**{varied: value}), t_end=0.5, rtol=1e-8, outputs=2)
        for path in paths:
            np.testing.assert_allclose(np.ravel(found[path])[i], alone[path][-1], rtol=1e-13, atol=1e-13, err_msg=path)
