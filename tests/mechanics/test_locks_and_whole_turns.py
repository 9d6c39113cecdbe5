"""Locks in a plane between frames whose mounts differ by whole turns: they hold the same direction twice."""

from __future__ import annotations

import math

import numpy as np
import pytest

from atwood import (
    AtwoodError,
    Component,
    Frame,
    Scalar,
    Scene,
    StartError,
    TopologyError,
    assemble,
    connector,
    constraint,
    simulate,
)
from atwood_library import Ground, Pivot, RigidBody, Slider, Spring, Weld


def guided(first: str, second: str, on_arm: bool) -> Scene:
    """Return a body on two parallel guides, mounted at two angles, on the ground or on an arm that swings."""
    scene = Scene(space="plane", t_end=0.3)
    ground, body = scene.add("ground", Ground()), scene.add("body", RigidBody(mass=1.0, moments=(0.0, 0.1, 0.0)))
    base = ground.frame
    if on_arm:
        pivot = scene.add("pivot", Pivot())
        arm = scene.add("arm", RigidBody(mass=1.0, moments=(0.0, 0.1, 0.0), center=(0.3, 0.0, 0.0)))
        scene.connect(ground.frame, pivot.a)
        scene.connect(pivot.b, arm.frame)
        scene.start["pivot.angle"] = 0.4
        base = arm.frame
    for name, angle in (("one", first), ("other", second)):
        guide, mount = scene.add(name, Slider()), scene.add(f"{name}_mount", Weld(angle=angle))
        scene.connect(base, guide.a)
        scene.connect(guide.b, mount.a)
        scene.connect(mount.b, body.frame)
    spring = scene.add("spring", Spring(stiffness=20.0, natural_length=0.3))
    fixed = scene.add("fixed", Weld(displacement=(0.5, 0.0, 0.0)))
    scene.connect(base, fixed.a)
    scene.connect(fixed.b, spring.a)
    scene.connect(spring.b, body.frame)
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("on_arm", [False, True])
@pytest.mark.parametrize("angles", [("200 deg", "-160 deg"), ("-160 deg", "200 deg"), ("30 deg", "750 deg")])
def test_a_whole_turn_between_two_mounts_is_no_contradiction(angles: tuple[str, str], on_arm: bool, form: str) -> None:
    alike = simulate(guided(angles[0], angles[0], on_arm), form=form, rtol=1e-10, outputs=4)
    turned = simulate(guided(*angles, on_arm), form=form, rtol=1e-10, outputs=4)
    for path in ("body.position.x", "body.position.z", "body.angle", "spring.tension"):
        np.testing.assert_allclose(turned.array(path), alike.array(path), atol=1e-8)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_half_a_turn_is_one(form: str) -> None:
    with pytest.raises((TopologyError, StartError)):
        simulate(guided("30 deg", "210 deg", on_arm=False), form=form)


def test_other_angles_are_decided_anew() -> None:
    assembly = assemble(guided("200 deg", "-160 deg", on_arm=True))
    other = assembly.with_values({"one_mount.angle": "-160 deg"})
    expected = simulate(guided("-160 deg", "-160 deg", on_arm=True), outputs=3).array("body.position.x")
    np.testing.assert_allclose(simulate(other, outputs=3).array("body.position.x"), expected, atol=1e-9)


class Undefined(Component):
    """A constraint that has no value."""

    a: Frame = connector(Frame, "Where it acts.")

    @constraint(reaction="lock", unit="N*m", doc="Torque.")
    def nowhere(self) -> Scalar:
        """Return what is no number."""
        return math.nan


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_lock_that_has_no_value_is_named(form: str) -> None:
    scene = Scene()
    part = scene.add("part", Undefined())
    scene.connect(scene.add("ground", Ground()).frame, part.a)
    with pytest.raises(AtwoodError, match="nowhere"):
        simulate(scene, form=form, t_end=0.1, structure=True)
