"""What walls that close on it squeeze: its impacts follow each other ever faster, and never come to rest."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Component, Point, Scalar, Scene, SolveError, connector, parameter, simulate, unilateral
from atwood.simulation.run import run
from atwood_library import PointMass


class Closing(Component):
    """A wall that moves inwards at 1 m/s and throws back all."""

    way: float = parameter(1.0, doc="1 for the left one, -1 for the right one.")
    at: float = parameter(0.0, unit="m", doc="Where it starts.")
    p: Point = connector(Point, "What is between.")

    @unilateral(reaction="force", unit="N", restitution=1.0, doc="Force of the wall.")
    def gap(self) -> Scalar:
        """Distance from the wall."""
        return self.way * (self.p.position.x - self.at) - self.time


def test_what_closing_walls_squeeze_is_followed_until_no_time_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each impact adds twice the walls' speed, so that times follow by hand; they accumulate without rest."""
    monkeypatch.setattr(run, "_MOST_CONTACTS", 100)
    scene = Scene(gravity=0.0)
    m = scene.add("m", PointMass(mass=1.0))
    for name, way, at in (("a", 1.0, 0.0), ("b", -1.0, 1.0)):
        scene.connect(m.point, scene.add(name, Closing(way=way, at=at)).p)
    scene.start.update({"m.position.x": 0.4, "m.velocity.x": 0.3, "m.position.z": 0.0, "m.velocity.z": 0.0})
    with pytest.raises(SolveError, match=r"impacts of a, b follow each other ever faster at t = 0\.4999") as caught:
        simulate(scene, t_end=1.0, rtol=1e-8)
    times = [one.time for one in caught.value.run.events if one.kind == "impact"]
    t, x, speed, known = 0.0, 0.4, 0.3, []
    for i in range(40):
        lasts = ((1.0 - t - x) / (speed + 1.0)) if i % 2 == 0 else ((x - t) / (speed + 1.0))
        t, x = t + lasts, x + (lasts * speed if i % 2 == 0 else -lasts * speed)
        speed += 2.0
        known.append(t)
    np.testing.assert_allclose(times[:40], known, rtol=0.0, atol=1e-9)
