"""Scenes in space: states as few as they can be, and what is known of each is met."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from atwood import ParameterError, Result, Scene, report, simulate
from atwood_library.scenes import (
    SCENES,
    Bricard,
    FlyballGovernor,
    FoucaultPendulum,
    FourBarRow,
    FreeBody,
    LagrangeTop,
    SpatialSliderCrank,
    SphericalPendulum,
    UniversalShaft,
)

from ..helpers.smooth import SMOOTH
from ..references.bricard import Bricard as ExactBricard
from ..references.foucault import PolarFoucault
from ..references.free_body import FreeBody as ExactBody, PlateSeparatrix
from ..references.governor import StiffGovernor
from ..references.linkages import SpatialSliderCrank as ExactSliderCrank, universal_joint
from ..references.pendulum import FourBarRow as ExactRow
from ..references.spherical_pendulum import SphericalPendulum as ExactPendulum
from ..references.top import LagrangeTop as ExactTop

FORMS = ("reduced", "dae")

# Scene: coordinates, speeds, constraints and degrees of freedom of the reduced form.
SIZES = {
    "bricard": (5, 5, 6, 1),
    "double-pendulum-3d": (4, 4, 0, 4),
    "flyball-governor": (4, 4, 0, 4),
    "foucault-pendulum": (3, 3, 1, 2),
    "free-body": (7, 6, 0, 6),
    "gyroscope": (3, 3, 0, 3),
    "heavy-top": (4, 3, 0, 3),
    "intermediate-axis": (7, 6, 0, 6),
    "lagrange-top": (4, 3, 0, 3),
    "rolling-ball": (6, 3, 0, 3),
    "rolling-disc": (6, 3, 0, 3),
    "spatial-slider-crank": (4, 4, 3, 1),
    "spherical-pendulum": (3, 3, 1, 2),
    "stewart-platform": (22, 21, 15, 6),
    "universal-shaft": (2, 2, 2, 1),
    "rotating-hoop-driven": (1, 1, 0, 1),
    "rotating-hoop-free": (2, 2, 0, 2),
    "two-body": (6, 6, 0, 6),
    "n-body": (9, 9, 0, 9),
    "bead-on-wire": (1, 1, 0, 1),
    "bead-on-surface": (2, 2, 0, 2),
    "rotating-frame": (2, 2, 0, 2),
    "benchmark-bicycle": (9, 8, 5, 3),
    "furuta-pendulum": (2, 2, 0, 2),
    "free-symmetric-body": (7, 6, 0, 6),
    "rigid-bodies": (29, 27, 10, 18),
    "wilberforce-pendulum": (2, 2, 0, 2),
    "rattleback": (6, 3, 0, 3),
    "ball-in-shell": (7, 6, 3, 3),
    "double-cardan-twice": (7, 7, 8, 1),
    "six-axis-arm": (12, 6, 0, 6),
}


def vector(result: Result, path: str) -> Any:
    return np.stack([result[f"{path}.{axis}"] for axis in "xyz"], axis=-1)


def axes(result: Result, body: str) -> Any:
    """Return R_WB along a run."""
    return np.stack([vector(result, f"{body}.{axis}_axis") for axis in "xyz"], axis=-1)


def test_every_scene_in_space_is_here() -> None:
    assert set(SIZES) == {name for name, make in SMOOTH.items() if make().space == "space"}


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", SIZES)
def test_as_few_states_as_by_hand(name: str) -> None:
    coordinates, speeds, _, freedom = SIZES[name]
    equations = simulate(SCENES[name](), t_end=1e-3, outputs=2).assembly.reduced
    assert (len(equations.coordinates), len(equations.speeds)) == (coordinates, speeds)
    assert report(SCENES[name]()).degrees_of_freedom == freedom


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("spin", [(1.0, 0.0, 1.0), (1.73205, 0.0, 1.0)])
def test_free_body_is_jacobis(form: str, spin: tuple[float, float, float]) -> None:
    exact = ExactBody((1.0, 2.0, 3.0), spin)
    result = simulate(FreeBody(spin=spin), form=form, solver="explicit" if form == "reduced" else "ida", rtol=1e-11)
    loose = 1.0 if form == "reduced" else 100.0
    assert np.max(np.abs(vector(result, "body.spin") - exact.omega(result.time))) < 1e-10 * loose
    assert np.max(np.abs(axes(result, "body") - exact.orientation(result.time))) < 1e-9 * loose


def test_free_body_on_the_separatrix() -> None:
    exact = PlateSeparatrix(3.0, 5.0, 2.0)
    scene = FreeBody(moments=(3.0, 5.0, 8.0), spin=(2.0, 0.0, 1.0))
    result = simulate(scene, t_end=15.0, rtol=1e-13)
    room = np.maximum(1e-11, 1e-14 * np.exp(exact.rate * result.time))  # what errors grow to by themselves
    assert np.all(np.max(np.abs(vector(result, "body.spin") - exact.omega(result.time)), axis=1) < room)


def test_free_body_keeps_energy_and_angular_momentum() -> None:
    result = simulate(FreeBody(), t_end=100.0, rtol=1e-14, outputs=101)
    momentum = vector(result, "body.angular_momentum")
    size = np.linalg.norm(momentum[0])
    assert result.energy.max_drift < 1e-12 * float(result.energy.total[0])
    assert np.max(np.abs(np.linalg.norm(momentum, axis=1) - size)) < 1e-12 * size


@pytest.mark.parametrize("motion", ["cusps", "loops", "waves", "steady"])
def test_lagrange_top(motion: str) -> None:
    scene = LagrangeTop(motion=motion)
    result = simulate(scene, rtol=1e-13)
    theta, precession = float(scene.inclination), float(result["top.phi_rate"][0])
    rates = (precession, 0.0, float(scene.spin) - precession * np.cos(theta))
    exact = ExactTop(0.025, 0.01, 0.981, (0.0, theta, 0.0), rates)
    assert np.max(np.abs(np.cos(result["top.theta"]) - exact.cos_theta(result.time))) < 1e-9
    assert np.max(np.abs(vector(result, "top.z_axis") - exact.axis(result.time))) < 1e-9


def test_a_top_too_slow_to_precess_steadily_is_refused() -> None:
    with pytest.raises(ParameterError, match="spins too slowly") as caught:
        LagrangeTop(motion="steady", spin=5.0)
    assert "spin" in caught.value.where


def test_a_top_that_starts_upright_runs() -> None:
    result = simulate(LagrangeTop(inclination=0.0, spin=5.0), t_end=2.0, rtol=1e-10)
    assert result.status == "finished"
    assert result.energy.max_drift < 1e-9


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("inclination", "rate"), [(np.pi / 3, 2.0), (np.pi / 2, 0.05), (np.pi / 4, 3.8)])
def test_spherical_pendulum(form: str, inclination: float, rate: float) -> None:
    result = simulate(SphericalPendulum(inclination=inclination, azimuth_rate=rate), form=form, rtol=1e-11, t_end=5.0)
    start = vector(result, "bob.position")[0], vector(result, "bob.velocity")[0]
    exact = ExactPendulum(1.0, 9.81, *start)
    assert np.max(np.abs(vector(result, "bob.position") - exact.position(result.time))) < 1e-7
    assert np.max(np.abs(result["rod.tension"] - exact.tension(result.time, 1.0))) < 1e-5


def test_foucault_pendulum_turns_with_its_platform() -> None:
    rate = 0.05
    result = simulate(FoucaultPendulum(length=1.0, amplitude=0.1, rate=rate), t_end=20.0, rtol=1e-10)
    place, velocity = vector(result, "view.position"), vector(result, "view.velocity")
    exact = PolarFoucault(1.0, 9.81, rate, place[0], velocity[0])
    assert np.max(np.abs(place - exact.position(result.time))) < 1e-6


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_bricard_moves_as_it_should(form: str) -> None:
    result = simulate(Bricard(), form=form, rtol=1e-9)
    exact = ExactBricard().motion(result.time)
    assert np.max(np.abs(result["hinge1.angle"] - np.asarray(exact)[:, 0])) < 2e-5
    assert np.max(np.abs(result["hinge2.angle"] - np.asarray(exact)[:, 1])) < 2e-5
    assert result.energy.max_drift < 1e-6 * 29.43
    found = report(Bricard())
    assert found.degrees_of_freedom == 1
    assert len(found.redundant) == 1


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_stiff_governor(form: str) -> None:
    result = simulate(FlyballGovernor(), form=form, rtol=1e-9, t_end=0.5, outputs=6)
    slide, beta, _, _, rate = np.asarray(StiffGovernor().motion(result.time)).T
    assert np.max(np.abs(result["guide.displacement"] - slide)) < 1e-6
    assert np.max(np.abs(result["right_hinge.angle"] - beta)) < 1e-6
    assert np.max(np.abs(result["left_hinge.angle"] - beta)) < 1e-6
    assert np.max(np.abs(result["bearing.angular_velocity"] - rate)) < 1e-5


@pytest.mark.parametrize("form", FORMS)
def test_spatial_slider_crank_closes(form: str) -> None:
    result = simulate(SpatialSliderCrank(), form=form, rtol=1e-9, t_end=1.0)
    exact = ExactSliderCrank((0.0, 0.1, 0.12), (1, 0, 0), (0, 1, 0), 0.08, 0.3, (0, 0, 0), (1, 0, 0))
    place = exact.slider(result["bearing.angle"])[0]
    assert np.max(np.abs(result["guide.displacement"] - place)) < 1e-11


@pytest.mark.parametrize("form", FORMS)
def test_universal_joint_turns_unevenly(form: str) -> None:
    result = simulate(UniversalShaft(), form=form, rtol=1e-10)
    driving, driven = result["bearing1.angle"], result["bearing2.angle"]
    _, ratio, _ = universal_joint(driving, float(UniversalShaft().bend))
    other = universal_joint(driving + np.pi / 2, float(UniversalShaft().bend))[1]
    speeds = result["bearing2.angular_velocity"] / result["bearing1.angular_velocity"]
    assert min(np.max(np.abs(speeds - ratio)), np.max(np.abs(speeds - other))) < 1e-10
    assert np.max(np.abs(np.round((driven - driving) / np.pi))) < 1.0


@pytest.mark.parametrize("form", FORMS)
def test_four_bars_pass_through_line(form: str) -> None:
    result = simulate(FourBarRow(), form=form, rtol=1e-8)
    exact = ExactRow(2)
    angle = 0.5 * np.pi - result["foot[0].angle"]
    assert np.max(np.abs(angle - exact.crank_angle(result.time))) < 1e-3
    assert result.energy.max_drift < 1e-6 * 39.24


def test_a_planar_scene_of_these_parts_is_what_it_was() -> None:
    flat, deep = (simulate(Scene.copy(FourBarRow(space=space)), t_end=0.5, rtol=1e-9) for space in ("plane", "space"))
    assert np.max(np.abs(flat["foot[0].angle"] - deep["foot[0].angle"])) < 1e-6
