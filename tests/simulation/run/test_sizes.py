"""How many steps a run takes does not depend on the size of its scene, at any level: all scales are the scene's own."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Scene, simulate
from atwood_library import Ground, Link, Pivot


def four_bar(size: float) -> Scene:
    """Return a four-bar linkage of some size and density one, with the same motion in its own time."""
    scene = Scene()
    links = [
        scene.add(f"link{i}", Link(length=size * length, mass=size**3)) for i, length in enumerate((1.0, 2.5, 2.0))
    ]
    pivots = [scene.add(f"pivot{i}", Pivot()) for i in range(4)]
    left, right = scene.add("left", Ground()), scene.add("right", Ground(position=(2.5 * size, 0.0, 0.0)))
    ends = left.frame, links[0].a, links[0].b, links[1].a, links[1].b, links[2].b, right.frame, links[2].a
    for pivot, a, b in zip(pivots, ends[::2], ends[1::2], strict=True):
        scene.connect(a, pivot.a)
        scene.connect(pivot.b, b)
    scene.start["pivot0.angle"], scene.start["pivot0.angular_velocity"] = 1.0, 3.0 / np.sqrt(size)
    scene.guess["pivot3.angle"] = 1.4
    return scene


@pytest.mark.parametrize(("level", "size"), [("index1-projected", 1e-3), ("ggl", 1e-7)])
def test_steps_do_not_depend_on_the_size_of_the_scene(level: str, size: float) -> None:
    steps, ends = [], []
    for one in (1.0, size):
        result = simulate(
            four_bar(one), form="dae", level=level, t_end=2.0 * np.sqrt(one), rtol=1e-8, outputs=3, max_steps=2000
        )
        assert result.status == "finished"
        ends.append(float(result["pivot0.angle"][-1]))
        steps.append(result.statistics.steps)
    assert ends[1] == pytest.approx(ends[0], abs=1e-4)
    assert 0.8 * steps[0] < steps[1] < 1.25 * steps[0]
