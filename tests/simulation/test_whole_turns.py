"""Angles of joints in space count their turns for whatever reads them, in both forms, and begin with none too many."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Load, Scalar, Scene, Vector, assemble, event, force, signal, simulate
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.initialization.positions import unwound
from atwood.simulation.initialization.start import find_start
from atwood_library import Gear, Ground, Pivot, RigidBody

FORMS = ("reduced", "dae")

STILL = Vector(0.0, 0.0, 0.0)


class Wound(Pivot):
    """A hinge with a spring of 1 N m/rad that is written as a load."""

    @force
    def twisting(self) -> list[Load]:
        """Return the torque on both frames."""
        torque = self.axis_in_world() * -self.angle()
        return [Load(self.b, STILL, torque), Load(self.a, STILL, -torque)]


class Follower(Pivot):
    """A hinge with a torque of 1 N m for each radian of an input."""

    angle_read: float = signal(0.0, unit="rad", doc="Some angle.")

    @force
    def pushing(self) -> list[Load]:
        """Return the torque on frame b."""
        return [Load(self.b, STILL, self.axis_in_world() * self.angle_read)]


class Counter(Pivot):
    """A hinge that ends the run when it has turned by 4 rad."""

    @event(target="stop", direction=1, message="it has turned far", unit="rad")
    def turned_far(self) -> Scalar:
        """Return how far it has turned beyond that."""
        return self.angle() - 4.0


def chain(*hinges: Pivot) -> Scene:
    """Return a scene of hinges one after another, each with a body, called hinge0, body0, ..."""
    scene = Scene(space="space", gravity=0.0)
    at = scene.add("ground", Ground()).frame
    for i, hinge in enumerate(hinges):
        scene.add(f"hinge{i}", hinge)
        body = scene.add(f"body{i}", RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
        scene.connect(at, hinge.a)
        scene.connect(hinge.b, body.frame)
        at = body.frame
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", ["potential", "load"])
@pytest.mark.parametrize(("angle", "speed"), [(4.0, 0.0), (2.0, 3.0), (-9.0, 1.0)])
def test_a_spring_on_a_hinge_is_wound_by_whole_turns(form: str, kind: str, angle: float, speed: float) -> None:
    scene = chain(Pivot(stiffness=1.0, axis=(0.6, 0.0, 0.8)) if kind == "potential" else Wound(axis=(0.6, 0.0, 0.8)))
    scene.start.update({"hinge0.angle": angle, "hinge0.angular_velocity": speed})
    result = simulate(scene, form=form, t_end=7.0, outputs=15, rtol=1e-9)
    exact = angle * np.cos(result.time) + speed * np.sin(result.time)
    assert np.max(np.abs(result.array("hinge0.angle") - exact)) < 1e-6
    assert result.energy.max_drift < 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_an_input_linked_to_an_angle_reads_its_turns(form: str) -> None:
    scene = Scene(space="space", gravity=0.0)
    ground = scene.add("ground", Ground())
    for name, kind in (("read", Pivot), ("driven", Follower)):
        hinge, body = scene.add(name, kind()), scene.add(f"{name}_body", RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
        scene.connect(ground.frame, hinge.a)
        scene.connect(hinge.b, body.frame)
    scene.connect(scene["driven"].input("angle_read"), scene["read"].output("angle"))
    scene.start.update({"read.angle": 0.0, "read.angular_velocity": 3.0})
    result = simulate(scene, form=form, t_end=3.0, outputs=7, rtol=1e-9)
    assert np.max(np.abs(result.array("driven.angle") - 0.5 * result.time**3)) < 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_an_event_of_a_hinge_counts_its_turns(form: str) -> None:
    scene = chain(Counter())
    scene.start["hinge0.angular_velocity"] = 3.0
    result = simulate(scene, form=form, t_end=3.0, rtol=1e-9)
    assert result.status == "stopped"
    assert result.time[-1] == pytest.approx(4.0 / 3.0, abs=1e-7)


def test_the_way_to_a_start_winds_no_springs() -> None:
    scene = chain(Pivot(axis=(0.0, 0.0, 1.0), stiffness=1.0), Pivot(axis=(0.0, 0.0, 1.0), stiffness=1.0))
    angle = 0.0
    for i, turned in enumerate((1.94227548, 2.55908458)):  # Newton's method from zero goes round the other way
        angle += turned
        for name, axis in (("x", (np.cos(angle), np.sin(angle), 0.0)), ("y", (-np.sin(angle), np.cos(angle), 0.0))):
            scene.guess.update({f"body{i}.{name}_axis.{a}": c for a, c in zip("xyz", axis, strict=True)})
        scene.guess.update({f"body{i}.z_axis.{a}": c for a, c in zip("xyz", (0.0, 0.0, 1.0), strict=True)})
    start = find_start(assemble(scene))
    assert start.coordinates == pytest.approx([1.94227548, 2.55908458], abs=1e-8)


@pytest.mark.parametrize("form", FORMS)
def test_turns_that_are_said_stay(form: str) -> None:
    scene = chain(Pivot(stiffness=1.0), Pivot(stiffness=1.0))
    scene.start["hinge0.angle"] = 7.0
    scene.guess["hinge1.angle"] = -11.0
    result = simulate(scene, form=form, t_end=0.01, outputs=2)
    assert result.at(0)["hinge0.angle"] == pytest.approx(7.0)
    assert result.at(0)["hinge1.angle"] == pytest.approx(-11.0)


@pytest.mark.parametrize(("ratio", "turns"), [(-2.0, 9.0), (-0.5, 9.0 - 2.0 * np.pi)])
def test_a_turn_that_moves_another_body_stays(ratio: float, turns: float) -> None:
    scene = Scene(space="space", gravity=0.0)
    ground = scene.add("ground", Ground())
    gear = scene.add("gear", Gear(ratio=ratio))
    for name, shaft in (("hinge_a", gear.a), ("hinge_b", gear.b)):
        hinge, body = scene.add(name, Pivot()), scene.add(f"{name}_body", RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
        scene.connect(ground.frame, hinge.a)
        scene.connect(hinge.b, body.frame)
        scene.connect(hinge.shaft, shaft)
    assembly = assemble(scene)
    equations = assembly.regular
    assert [one.name for one in equations.names] == ["hinge_a.angle"]
    scales = motion_scales(equations, 1.0)
    found = unwound(assembly, equations, [], True, scales, 1.0, 0.0, np.zeros(1), np.array([9.0]))
    assert found == pytest.approx([turns])
