"""Scenes with curves, surfaces, fields and pairs against their stated answers, in every form."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from atwood import Result, Scene, simulate
from atwood.pipeline import assemble
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS

TIGHT = 1e-12


def states(scene: Scene) -> tuple[int, int]:
    """Return the states of the reduced form, and the constraints that are left in it."""
    equations = assemble(scene).reduced
    return len(equations.coordinates) + len(equations.speeds), len(equations.constraints)


def run(name: str, form: str, **settings: object) -> Result:
    return simulate(SCENES[name](**settings), form=form, rtol=TIGHT)


def gap(a: object, b: object) -> float:
    return float(np.max(np.abs(np.asarray(a) - np.asarray(b))))


STATES = {
    "bead-on-wire": 2,
    "bead-on-surface": 4,
    "rotating-hoop-driven": 2,
    "rotating-hoop-free": 4,
    "charged-particle": 4,
    "two-body": 12,
    "kepler": 4,
    "n-body": 18,
}


@pytest.mark.parametrize("name", STATES)
def test_states(name: str) -> None:
    assert states(SCENES[name]()) == (STATES[name], 0)


def test_states_of_variants() -> None:
    assert states(SCENES["two-body"](space="plane")) == (8, 0)
    assert states(SCENES["spherical-pendulum"](coordinates="angles")) == (4, 0)
    assert states(SCENES["bead-on-wire"](shape="helix", rate=2.0)) == (2, 0)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("away", [0.01, 1.5, 3.0])
def test_a_cycloid_has_one_period_for_every_amplitude(form: str, away: float) -> None:
    scene = SCENES["bead-on-wire"](away=away)
    result = simulate(scene, form=form, rtol=TIGHT)
    exact = scene.tautochrone(result.time)  # type: ignore[attr-defined]
    assert gap(np.sin(0.5 * result.array("wire.parameter")), np.sin(0.5 * exact)) < 1e-8
    assert np.ptp(exact) > 1.9 * away


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_circle_is_a_pendulum_and_a_helix_an_incline(form: str) -> None:
    circle = run("bead-on-wire", form, shape="circle", away=1.2)
    pendulum = SCENES["simple-pendulum"](t_end=5.0)
    pendulum.start.update({"rod.angle": 1.2, "rod.angular_velocity": 0.0})
    assert gap(circle.array("wire.parameter"), simulate(pendulum, form=form, rtol=TIGHT).array("rod.angle")) < 1e-8
    helix = run("bead-on-wire", form, shape="helix")
    fall = 0.25 * 9.81 / (1.0 + 0.25**2)
    assert gap(helix.array("wire.parameter"), 1.0 - 0.5 * fall * helix.time**2) < 1e-8 * 0.5 * fall * 25.0


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_wire_that_turns_about_the_vertical_keeps_its_jacobi_integral(form: str) -> None:
    result = run("bead-on-wire", form, shape="parabola", rate=2.5)
    p, rate = result.array("wire.parameter"), result.array("wire.rate")
    jacobi = 0.5 * (1.0 + p**2) * rate**2 + 9.81 * 0.5 * p**2 - 0.5 * 2.5**2 * p**2
    assert np.ptp(jacobi) < 1e-8
    assert np.ptp(result.energy.kinetic + result.energy.potential) > 0.1


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_wire_that_turns_about_the_horizontal_keeps_neither(form: str) -> None:
    # H = T2 - T0 + V with V = m g z cos(omega t) for z up in the wire's frame: dH/dt = dV/dt explicitly
    w = 1.5
    result = run("bead-on-wire", form, shape="parabola", turning="x", rate=w, away=0.3)
    t, p, rate = result.time, result.array("wire.parameter"), result.array("wire.rate")
    z = 0.5 * p**2
    h = 0.5 * (1.0 + p**2) * rate**2 - 0.5 * w**2 * z**2 + 9.81 * z * np.cos(w * t)
    fine = simulate(
        SCENES["bead-on-wire"](shape="parabola", turning="x", rate=w, away=0.3), form=form, rtol=TIGHT, outputs=20001
    )
    q = fine.array("wire.parameter")
    push = -9.81 * 0.5 * q**2 * w * np.sin(w * fine.time)
    step = fine.time[1] - fine.time[0]
    whole = step / 3.0 * float(push[0] + push[-1] + 4.0 * np.sum(push[1:-1:2]) + 2.0 * np.sum(push[2:-1:2]))
    assert h[-1] - h[0] == pytest.approx(whole, rel=5e-8)  # it is thrown out, and errors grow along
    assert np.ptp(h) > 0.1
    assert np.ptp(result.energy.kinetic + result.energy.potential) > 0.1


@pytest.mark.parametrize("form", FORMS)
def test_a_sphere_is_a_spherical_pendulum_and_a_cone_keeps_its_angular_momentum(form: str) -> None:
    bead = run("bead-on-surface", form)
    pendulum = SCENES["spherical-pendulum"](inclination=1.0, t_end=5.0)
    rod = simulate(pendulum, form=form, rtol=TIGHT)
    for axis in "xyz":
        assert gap(bead.array(f"bead.position.{axis}"), rod.array(f"bob.position.{axis}")) < 2e-8
    cone = run("bead-on-surface", form, shape="cone")
    x, y, vx, vy = (cone.array(f"bead.{name}") for name in ("position.x", "position.y", "velocity.x", "velocity.y"))
    assert np.ptp(x * vy - y * vx) < 1e-8
    assert np.ptp(cone.array("surface.parameter_1")) > 0.1


@pytest.mark.parametrize("form", FORMS)
def test_angles_of_the_spherical_pendulum_on_request(form: str) -> None:
    angles = simulate(SCENES["spherical-pendulum"](coordinates="angles"), form=form, rtol=TIGHT, t_end=5.0)
    places = simulate(SCENES["spherical-pendulum"](), form=form, rtol=TIGHT, t_end=5.0)
    for axis in "xyz":
        assert gap(angles.array(f"bob.position.{axis}"), places.array(f"bob.position.{axis}")) < 1e-8


@pytest.mark.parametrize("form", FORMS)
def test_a_driven_hoop_keeps_its_jacobi_integral(form: str) -> None:
    result = run("rotating-hoop-driven", form, radius=0.8, mass=1.3, inclination=1.2)
    angle, rate = result.array("hoop.angle"), result.array("hoop.angular_velocity")
    whole = 0.5 * 1.3 * 0.8**2 * (rate**2 - 25.0 * np.sin(angle) ** 2) + 1.3 * 9.81 * 0.8 * np.cos(angle)
    assert np.ptp(whole) < 3e-8
    assert np.ptp(angle) > 0.5
    assert np.ptp(result.energy.kinetic + result.energy.potential) > 0.1


@pytest.mark.parametrize("form", FORMS)
def test_a_free_hoop_without_mass_is_a_spherical_pendulum(form: str) -> None:
    hoop = run("rotating-hoop-free", form)
    pendulum = simulate(SCENES["spherical-pendulum"](t_end=5.0), form=form, rtol=TIGHT)
    for axis in "xyz":
        assert gap(hoop.array(f"bead.position.{axis}"), pendulum.array(f"bob.position.{axis}")) < 1e-8
    heavy = run("rotating-hoop-free", form, inertia=0.7)
    spin = (0.7 + np.sin(heavy.array("hoop.angle")) ** 2) * heavy.array("axle.angular_velocity")
    assert np.ptp(spin) < 1e-8
    assert heavy.energy.max_drift < 1e-7


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("gauge", ["symmetric", "x", "z"])
def test_a_charge_goes_round_and_drifts(form: str, gauge: str) -> None:
    scene = SCENES["charged-particle"](gauge=gauge, charge=-0.8, mass=0.5, electric_x=0.3)
    result = simulate(scene, form=form, rtol=TIGHT)
    for path, values in scene.closed_form(result.time).items():  # type: ignore[attr-defined]
        assert gap(result.array(path), values) < 1e-8, path
    drift = result.array("particle.position.x")[-1] / result.time[-1]
    assert drift == pytest.approx(-0.25, abs=0.1)


def test_the_canonical_momentum_depends_on_the_gauge() -> None:
    x = run("charged-particle", "reduced", gauge="x")
    momentum = x.array("source.canonical_momentum.x")
    assert np.ptp(momentum) < 1e-12  # x is cyclic: neither potential depends on it
    assert gap(momentum, x.array("particle.velocity.x") + 2.0 * x.array("particle.position.z")) < 1e-12
    assert np.ptp(run("charged-particle", "reduced").array("source.canonical_momentum.x")) > 0.1


def anomaly(mean: float, e: float) -> float:
    """Return the eccentric anomaly of Kepler's equation."""
    return float(brentq(lambda x: x - e * math.sin(x) - mean, mean - 1.1, mean + 1.1, xtol=1e-15, rtol=1e-15))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("e", [0.5, 0.9, 0.99])
def test_kepler_equation(form: str, e: float) -> None:
    result = run("kepler", form, eccentricity=e, strength=1.7, semi_major_axis=1.2, mass=0.9)
    n = math.sqrt(1.7 / 0.9 / 1.2**3)
    x = np.array([anomaly(n * t, e) for t in result.time])
    # an early error grows with the time, and with the ratio of speeds near the centre
    growth = 2.0 * math.pi * (1.0 + e) / (1.0 - e)
    assert gap(result.array("body.position.x"), 1.2 * (np.cos(x) - e)) < 1e-8 * growth
    assert gap(result.array("body.position.z"), 1.2 * math.sqrt(1.0 - e * e) * np.sin(x)) < 1e-8 * growth
    # A = p x L - m k r/r, in the plane with L = z px - x pz about y
    px, pz = 0.9 * result.array("body.velocity.x"), 0.9 * result.array("body.velocity.z")
    rx, rz = result.array("body.position.x"), result.array("body.position.z")
    turn, r = rz * px - rx * pz, np.hypot(rx, rz)
    a_x, a_z = -pz * turn - 0.9 * 1.7 * rx / r, px * turn - 0.9 * 1.7 * rz / r
    assert gap(a_x, 0.9 * 1.7 * e) < 1e-8 * growth
    assert gap(a_z, 0.0) < 1e-8 * growth


@pytest.mark.parametrize("form", FORMS)
def test_the_angle_of_repulsive_scattering(form: str) -> None:
    e = 1.8
    scene = SCENES["kepler"](strength=-1.0, eccentricity=e, t_end=200.0)
    result = simulate(scene, form=form, rtol=TIGHT, outputs=[0.0, 100.0, 200.0])
    # the hyperbola r = p/(e cos phi - 1) opens to the right; its asymptote is at acos(1/e)
    x, z = result["body.position.x"][-1], result["body.position.z"][-1]
    p = e * e - 1.0
    assert e * x / math.hypot(x, z) - 1.0 == pytest.approx(p / math.hypot(x, z), abs=1e-9)
    vx, vz = result["body.velocity.x"][-1], result["body.velocity.z"][-1]
    energy, spin = 0.5 * (vx**2 + vz**2) + 1.0 / math.hypot(x, z), abs(x * vz - z * vx)
    assert energy == pytest.approx(0.5, abs=1e-9)
    # scattering: cot(theta/2) = 2 E b/|k| with the impact parameter b (Goldstein, eq. 3.100)
    b = spin / math.sqrt(2.0 * energy)
    assert 2.0 * math.atan(1.0 / (2.0 * energy * b)) == pytest.approx(2.0 * math.asin(1.0 / e), abs=1e-9)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_two_bodies_are_one_about_the_other(form: str, space: str) -> None:
    scene = SCENES["two-body"](space=space, mass1=1.5, mass2=0.7, constant=1.1, semi_major_axis=0.9, eccentricity=0.6)
    result = simulate(scene, form=form, rtol=TIGHT)
    n = math.sqrt(1.1 * 2.2 / 0.9**3)
    x = np.array([anomaly(n * t, 0.6) for t in result.time])
    apart = result.array("body2.position.x") - result.array("body1.position.x")
    assert gap(apart, 0.9 * (np.cos(x) - 0.6)) < 1e-8 * n * 5.0 * 4.0
    center = 1.5 * result.array("body1.position.z") + 0.7 * result.array("body2.position.z")
    assert gap(center, 0.0) < 1e-10


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_the_figure_eight_returns(form: str, scale: float) -> None:
    scene = SCENES["n-body"](scale=scale, t_end=6.32591398292621 * scale**1.5)
    result = simulate(scene, form=form, rtol=TIGHT, outputs=[0.0, scene.t_end])
    for body in ("body1", "body2", "body3"):
        for axis in "xz":
            first, last = result[f"{body}.position.{axis}"]
            assert last == pytest.approx(first, abs=scale * (1e-10 if form == "reduced" else 1e-8))
