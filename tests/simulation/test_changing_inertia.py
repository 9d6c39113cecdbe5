"""Inertia that changes with time or coordinates, and Lagrangians: against closed forms and against library parts."""

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest

from atwood import (
    Component,
    DeclarationError,
    Point,
    PointInertia,
    Scene,
    UnsupportedError,
    connector,
    inertia,
    lagrangian,
    select,
    signal,
    simulate,
)
from atwood.pipeline import assemble
from atwood_library import Force, Ground, Pivot, PointMass, RigidBody, Rod, Spherical

from ..helpers.lagrangians import (
    BurningBody,
    CrankInertia,
    Drum,
    LagrangianBody,
    LagrangianPoint,
    LeakingBucket,
    PumpedPoint,
)
from ..helpers.runs import FORMS, free_scene

G = 9.81
CASES = [(form, space) for form in FORMS for space in ("plane", "space")]


def falling(space: str = "plane") -> Scene:
    """Return a leaking bucket that is drawn up with 20 N."""
    scene = Scene(space=space)
    bucket = scene.add("bucket", LeakingBucket(mass=lambda t: 2.0 - 0.5 * t))
    rope = scene.add("rope", Force(value=20.0, direction=(0.0, 0.0, 1.0)))
    probe = scene.add("probe", PointMass(mass=0.0))
    scene.connect(bucket.point, rope.point)
    scene.connect(bucket.point, probe.point)
    scene.start.update({"probe.position.x": 0.0, "probe.position.z": 0.0, "probe.velocity.x": 1.0})
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_what_leaks_out_takes_its_momentum_along(space: str, form: str) -> None:
    result = simulate(falling(space), form=form, t_end=2.0, rtol=1e-11, outputs=21)
    t = result.time
    # m(t) v' = F - m(t) g, and nothing along x
    v = -20.0 / 0.5 * np.log(1.0 - 0.25 * t) - G * t
    assert np.max(np.abs(result.array("probe.velocity.z") - v)) < 1e-8
    assert np.max(np.abs(result.array("probe.velocity.x") - 1.0)) < 1e-12
    assert result.energy.max_drift < 1e-8


def swinging(share: Any, space: str, part: type[Component] = BurningBody) -> Scene:
    """Return a compound pendulum whose inertia is scaled."""
    scene = Scene(space=space)
    ground, pivot = scene.add("ground", Ground()), scene.add("pivot", Pivot())
    body = scene.add("body", part(share=share) if part is BurningBody else part())
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, body.frame)
    scene.start.update({"pivot.angle": 0.4, "pivot.angular_velocity": 1.0})
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("form", "space"), [("reduced", "plane"), ("dae", "plane"), ("reduced", "space"), ("dae", "space")]
)
def test_a_burning_pendulum_swings_as_one_that_does_not(form: str, space: str) -> None:
    kept = simulate(swinging(1.0, space), form=form, t_end=1.0, rtol=1e-11, outputs=11)
    burnt = simulate(swinging(lambda t: 1.0 - 0.6 * t, space), form=form, t_end=1.0, rtol=1e-11, outputs=11)
    assert np.max(np.abs(kept.array("pivot.angle") - burnt.array("pivot.angle"))) < 1e-8
    forces = [one.array("pivot.force.z") for one in (kept, burnt)]
    assert np.allclose(forces[1], forces[0] * (1.0 - 0.6 * kept.time), atol=1e-6)
    assert burnt.energy.max_drift < 1e-8


def pendulum(part: Callable[[], Component], space: str) -> Scene:
    scene = Scene(space=space)
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod(length=0.8)), scene.add("bob", part())
    probe = scene.add("probe", PointMass(mass=0.0))
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.connect(rod.b, probe.point)
    scene.start.update({"probe.position.x": 0.5, "probe.velocity.x": 0.4})
    scene.guess["probe.position.z"] = -0.6
    if space == "space":
        scene.start.update({"probe.position.y": 0.1, "probe.velocity.y": 0.7})
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_lagrangian_of_a_point_is_a_point_mass(space: str, form: str) -> None:
    runs = [
        simulate(pendulum(part, space), form=form, t_end=1.0, rtol=1e-11, outputs=11)
        for part in (PointMass, LagrangianPoint)
    ]
    for path in ("probe.position.x", "probe.velocity.z", "rod.tension", "bob.kinetic_energy", "bob.potential_energy"):
        assert np.max(np.abs(runs[0].array(path) - runs[1].array(path))) < 1e-7, path
    assert runs[1].energy.max_drift < 1e-8


@pytest.mark.parametrize("form", FORMS)
def test_a_charge_in_a_magnetic_field_goes_round(form: str) -> None:
    scene = Scene(space="space")
    charge = scene.add("charge", LagrangianPoint(mass=2.0, gravity=0.0, charge=0.5, field=8.0))
    probe = scene.add("probe", PointMass(mass=0.0))
    scene.connect(charge.point, probe.point)
    places = {f"probe.position.{axis}": 0.0 for axis in "xyz"}
    scene.start.update({**places, "probe.velocity.x": 3.0, "probe.velocity.y": 0.5, "probe.velocity.z": 0.0})
    result = simulate(scene, form=form, t_end=2.0, rtol=1e-11, outputs=21)
    w = 0.5 * 8.0 / 2.0  # m v' = q v x B, with B along y
    assert np.max(np.abs(result.array("probe.position.x") - 3.0 / w * np.sin(w * result.time))) < 1e-8
    assert np.max(np.abs(result.array("probe.position.z") - 3.0 / w * (1.0 - np.cos(w * result.time)))) < 1e-8
    assert np.max(np.abs(result.array("probe.position.y") - 0.5 * result.time)) < 1e-9
    assert np.allclose(result.energy.kinetic, 9.25, rtol=1e-8)
    assert result.energy.max_drift < 1e-8


def body_on_a_ball(part: Callable[[], Component]) -> Scene:
    scene = Scene(space="space")
    ground, ball, body = scene.add("ground", Ground()), scene.add("ball", Spherical()), scene.add("body", part())
    scene.connect(ground.frame, ball.a)
    scene.connect(ball.b, body.frame)
    scene.start.update(dict(zip((f"body.angular_velocity.{axis}" for axis in "xyz"), (1.0, 2.0, 5.0), strict=True)))
    return scene


def rigid() -> Component:
    return RigidBody(mass=2.0, center=(0.3, 0.0, 0.0), moments=(0.16, 0.2, 0.3))


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_lagrangian_of_a_body_is_a_rigid_body(form: str) -> None:
    runs = [
        simulate(body_on_a_ball(part), form=form, t_end=1.0, rtol=1e-11, outputs=11) for part in (rigid, LagrangianBody)
    ]
    for path in ("body.angular_velocity.x", "body.angular_velocity.z", "ball.force.x", "ball.force.z"):
        assert np.max(np.abs(runs[0].array(path) - runs[1].array(path))) < 1e-6, path
    assert runs[1].energy.max_drift < 1e-8


def wheel(part: Callable[[], Component], space: str, speed: float) -> Scene:
    scene = free_scene(space=space)
    ground, pivot, extra = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("extra", part())
    body = scene.add("body", BurningBody(share=1.0, arm=0.0))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, body.frame)
    scene.connect(pivot.shaft, extra.a)
    scene.start.update({"pivot.angle": 0.0, "pivot.angular_velocity": speed})
    return scene


@pytest.mark.sample(3)
@pytest.mark.parametrize(("form", "space"), CASES)
def test_a_moment_of_inertia_that_depends_on_the_angle(form: str, space: str) -> None:
    result = simulate(wheel(CrankInertia, space, 2.0), form=form, t_end=3.0, rtol=1e-11, outputs=31)
    angle, speed = result.array("pivot.angle"), result.array("pivot.angular_velocity")
    own = 0.1  # of the body, about y
    energy = 0.5 * (own + 0.5 + 0.2 * np.cos(2.0 * angle)) * speed**2
    assert np.ptp(speed) > 0.5
    assert np.max(np.abs(energy / energy[0] - 1.0)) < 1e-8
    assert np.allclose(result.energy.kinetic, energy, rtol=1e-8)


@pytest.mark.parametrize(("form", "space"), CASES)
def test_a_moment_of_inertia_that_counts_turns(form: str, space: str) -> None:
    result = simulate(wheel(Drum, space, 10.0), form=form, t_end=3.0, rtol=1e-11, outputs=31)
    # J phi'^2 is kept: with J = J_0 + g phi, J^(3/2) grows evenly.
    start, growth = 0.6, 0.01
    rate = 1.5 * growth * 10.0 * math.sqrt(start)
    angle = ((start**1.5 + rate * result.time) ** (2.0 / 3.0) - start) / growth
    assert angle[-1] > 4.0 * math.pi
    assert np.max(np.abs(result.array("pivot.angle") - angle)) < 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_a_lagrangian_that_depends_on_time_keeps_its_momentum(form: str) -> None:
    scene = free_scene()
    pumped, probe = scene.add("pumped", PumpedPoint()), scene.add("probe", PointMass(mass=0.0))
    scene.connect(pumped.point, probe.point)
    scene.start.update({"probe.position.x": 0.0, "probe.position.z": 0.0, "probe.velocity.x": 2.0})
    result = simulate(scene, form=form, t_end=2.0, rtol=1e-11, outputs=21)
    mass = 1.0 + 0.5 * np.sin(result.time)
    assert np.max(np.abs(result.array("probe.velocity.x") * mass - 2.0)) < 1e-8
    assert np.allclose(result.energy.work, 2.0 / mass - 2.0, atol=1e-8)
    assert result.energy.max_drift < 1e-8


class _Feeding(Component):
    point: Point = connector(Point, "The point.")
    way: float = signal(0.0, unit="m", doc="A way.")

    @lagrangian
    def motion(self) -> Any:
        """Return a Lagrangian of an input."""
        return self.way * self.point.velocity.x


class _Stretched(Component):
    point: Point = connector(Point, "The point.")

    @inertia
    def matter(self) -> Iterable[PointInertia]:
        """Return a mass that depends on the place."""
        return [PointInertia([self.point], [[1.0 + self.point.position.x]])]


def _alone(part: Component) -> Scene:
    scene = Scene()
    scene.add("part", part)
    mass = scene.add("mass", PointMass())
    scene.connect(scene._children()["part"].point, mass.point)
    return scene


def test_what_is_refused_is_named() -> None:
    with pytest.raises(DeclarationError, match="parameters and time alone") as caught:
        assemble(_alone(_Stretched()))
    assert caught.value.where == "part"
    assert "@lagrangian" in caught.value.advice

    with pytest.raises(UnsupportedError, match="switch by the clock") as refused:
        assemble(_alone(_Feeding(way=lambda t: select(t < 1.0, 1.0, 2.0))))
    assert refused.value.where == "part"

    scene = _alone(_Feeding())
    parts = scene._children()
    scene.connect(parts["mass"].output("position.x"), parts["part"].input("way"))
    with pytest.raises(UnsupportedError, match="follows the output of another component") as linked:
        assemble(scene)
    assert linked.value.where == "part"


def test_mass_that_is_dropped_at_once_changes_no_speed() -> None:
    scene = falling()
    scene.set("bucket.mass", lambda t: select(t < 0.5, 2.0, 1.0))
    for form in FORMS:
        result = simulate(scene, form=form, t_end=1.0, rtol=1e-11, outputs=11)
        assert result.array("probe.velocity.z")[-1] == pytest.approx((10.0 - G) * 0.5 + (20.0 - G) * 0.5, abs=1e-9)
