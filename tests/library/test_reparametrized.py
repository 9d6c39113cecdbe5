"""Curves by their arc length, or by a coordinate."""

import math

import numpy as np
import pytest

import atwood_library as lib
from atwood import ParameterError, Scene, assemble, simulate


def bead(wire: lib.PointOnCurve, **start: float) -> Scene:
    scene = Scene()
    ground, mass = scene.add("ground", lib.Ground()), scene.add("bead", lib.PointMass())
    scene.add("wire", wire)
    scene.connect(ground.frame, wire.a)
    scene.connect(wire.b, mass.point)
    scene.start.update({f"wire.{name}": value for name, value in start.items()})
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_cycloid_by_its_arc_length_is_a_harmonic_oscillator(form: str) -> None:
    """The force along a cycloid is as the arc length from its lowest place: ``s'' = -g s/(4 a)`` (Huygens)."""
    cycloid = lib.reparametrized(("p + sin(p)", 0, "-cos(p)"), -2.0, 2.0)
    wire = lib.PointOnCurve(curve=cycloid, scale=0.5, lower_end=-3.3, upper_end=3.3)
    result = simulate(bead(wire, parameter=2.5, rate=0.0), t_end=3.0, form=form, rtol=1e-10)
    exact = 2.5 * np.cos(math.sqrt(9.81 / 2.0) * result.time)
    assert np.max(np.abs(result["wire.parameter"] - exact)) < 2e-7
    assert np.max(np.abs(result["wire.speed"] - 0.5 * result["wire.rate"])) < 1e-10  # of size one by metres


@pytest.mark.sample(0)
def test_a_closed_curve_by_its_arc_length_goes_on_counting() -> None:
    ellipse = lib.reparametrized(("2*cos(p)", 0, "sin(p)"), 0.0, 2.0 * math.pi)
    scene = bead(lib.PointOnCurve(curve=ellipse), parameter=0.0, rate=9.0)
    scene.gravity = 0.0
    result = simulate(scene, t_end=3.0, rtol=1e-10)
    assert result["wire.parameter"] == pytest.approx(9.0 * result.time, abs=1e-7)  # evenly, for nothing pushes
    x, z = result["bead.position.x"], result["bead.position.z"]
    assert (0.5 * x) ** 2 + z**2 == pytest.approx(1.0, abs=1e-12)
    whole = 9.688448220547675  # circumference: 8 E(3/4)
    at = lib.PointOnCurve(curve=ellipse).curve(whole)
    assert (at.x, at.z) == pytest.approx((2.0, 0.0), abs=1e-11)


def test_a_coordinate_in_place_of_the_parameter() -> None:
    curve = lib.reparametrized(("sinh(p)", 0, "cosh(p)"), -1.0, 2.0, by="x")
    catenary = lib.PointOnCurve(curve=curve, lower_end=-1.1, upper_end=3.5)
    for x in (-1.1, 0.3, 3.5):
        place = catenary.curve(x)
        assert (place.x, place.z) == pytest.approx((x, math.hypot(1.0, x)), abs=1e-12)
    assert assemble(bead(catenary)).reduced.constraints == ()
    falling = lib.PointOnCurve(curve=lib.reparametrized(("1 - p", 0, "p**3"), 0.5, 2.0, by="x"))
    assert falling.curve(-0.5).z == pytest.approx(1.5**3, abs=1e-12)


@pytest.mark.parametrize(
    ("curve", "ends", "by", "said"),
    [
        (("p", 0, "p**2"), (-1.0, 1.0), "z", "does not grow, or fall"),
        (("p", 0, "p**2"), (1.0, -1.0), "x", "not beyond its lower end"),
        (("p", 0, "p**2"), (0.0, 1.0), "length", "no coordinate of a curve"),
        (("p", 0, "abs(p)"), (-1.0, 1.0), "arc length", "corner at p = 0"),
    ],
)
def test_what_has_no_such_coordinate_is_refused(curve: object, ends: tuple[float, float], by: str, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        lib.reparametrized(curve, *ends, by=by)
