"""Momenta of coordinates in place of velocities: in starts, and as quantities along a run."""

import math

import numpy as np
import pytest

from atwood import ParameterError, Scene, StartError, conserved, reduced, simulate
from atwood_library import Charge, PointMass
from atwood_library.scenes import SCENES


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_momentum_in_place_of_a_speed(form: str) -> None:
    scene = SCENES["pendulum-on-cart"]()
    del scene.start["rail.speed"]
    scene.start["p:rail.displacement"] = 2.4
    scene.start["rod.angular_velocity"] = 0.5
    result = simulate(scene, form=form, t_end=0.5, rtol=1e-10, monitor=conserved(scene))
    rate = (2.4 - 1.0 * 1.0 * math.cos(1.0) * 0.5) / 3.0  # (M + m) x' + m l theta' cos(theta)
    assert result["rail.speed"][0] == pytest.approx(rate, rel=1e-12)
    assert result.conserved["p:rail.displacement"].values == pytest.approx(np.full(len(result.time), 2.4), rel=1e-7)
    if form == "reduced":
        assert result["p:rail.displacement"] == pytest.approx(np.full(len(result.time), 2.4), rel=1e-7)


def test_all_momenta_at_once() -> None:
    scene = SCENES["double-pendulum"]()
    for path in ("rod1", "rod2"):
        del scene.start[f"{path}.angular_velocity"]
    scene.start["p:rod1.angle"], scene.start["p:rod2.angle"] = 0.3, "-0.2 kg*m^2/s"
    result = simulate(scene, t_end=0.1)
    assert result["p:rod1.angle"][0] == pytest.approx(0.3, rel=1e-10)
    assert result["p:rod2.angle"][0] == pytest.approx(-0.2, rel=1e-10)


def test_canonical_momenta_have_the_vector_potential() -> None:
    scene = Scene(gravity=0.0)
    charge, body = scene.add("charge", Charge(charge=2.0)), scene.add("body", PointMass(mass=0.5))
    scene.connect(charge.point, body.point)
    scene.set("charge.vector_potential", lambda x, y, z, t: (3.0 * z, 0.0, 0.0))
    scene.start.update({"body.position.x": 0.0, "body.position.z": 0.1})
    scene.start.update({"p:body.position.x": 1.0, "p:body.position.z": 0.0})
    result = simulate(scene, t_end=0.2)
    assert result["body.velocity.x"][0] == pytest.approx((1.0 - 2.0 * 3.0 * 0.1) / 0.5, rel=1e-10)


def test_what_has_no_momentum_or_contradicts_is_refused() -> None:
    scene = SCENES["pendulum-on-cart"]()
    scene.start["p:rail.position"] = 1.0
    with pytest.raises(StartError, match="no such quantity"):
        simulate(scene, t_end=0.1)
    scene = SCENES["pendulum-on-cart"]()
    scene.start["p:rail.displacement"] = 1.0  # and its speeds are said, too
    with pytest.raises(StartError):
        simulate(scene, t_end=0.1)


def test_a_top_from_its_momenta() -> None:
    scene = SCENES["lagrange-top"](motion="momentum", inclination=0.6, spin=40.0, vertical_momentum=0.35)
    found = reduced(scene)
    assert found.momenta["top.euler.phi"] == pytest.approx(0.35, rel=1e-10)
    assert found.momenta["top.euler.psi"] == pytest.approx(0.4, rel=1e-10)
    assert min(abs(one - 0.6) for one in found.turning_points) < 1e-9
    with pytest.raises(ParameterError, match="upright"):
        simulate(SCENES["lagrange-top"](motion="momentum", inclination=0.0))
