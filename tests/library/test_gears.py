"""Gears between joints: exact motions, reactions, turns, states saved, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

import atwood_library as lib
from atwood import (
    AtwoodError,
    Component,
    Load,
    Model,
    Scalar,
    Scene,
    Shaft,
    assemble,
    connect,
    connector,
    dissipation,
    force,
    from_data,
    observable,
    potential,
    report,
    simulate,
    to_data,
)

from ..helpers.runs import FORMS

PLANE, SPACE = (0.0, -1.0, 0.0), (0.3, 1.0, -0.2)
SPACES = [("plane", PLANE), ("space", SPACE)]


def wheels(
    space: str, axis: tuple[float, float, float], *, ratio: float = -0.3, geared: bool = True, **hinge: Any
) -> Scene:
    """Return two wheels on hinges, of moments 2 and 0.5 about them, geared to each other."""
    scene = Scene(space=space, gravity=0.0)
    ground = scene.add("ground", lib.Ground())
    hinges = []
    for number, (name, moment) in enumerate((("one", 2.0), ("two", 0.5))):
        joint = scene.add(f"hinge_{name}", lib.Pivot(axis=axis, **(hinge if number == 0 else {})))
        wheel = scene.add(name, lib.RigidBody(moments=(moment, moment, moment)))
        scene.connect(ground.frame, joint.a)
        scene.connect(joint.b, wheel.frame)
        hinges.append(joint)
    if not geared:
        return scene
    gear = scene.add("gear", lib.Gear(ratio=ratio))
    scene.connect(hinges[0].shaft, gear.a)
    scene.connect(hinges[1].shaft, gear.b)
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("space", "axis"), SPACES)
def test_two_wheels_speed_up_as_one(space: str, axis: tuple[float, float, float], form: str) -> None:
    scene = wheels(space, axis, motor=1.5)
    result = simulate(scene, form=form, t_end=10.0, rtol=1e-10, outputs=5)
    moment = 2.0 + 0.5 / 0.3**2
    exact = 0.75 * result.time**2 / moment
    assert np.allclose(result["hinge_one.angle"], exact, atol=1e-7)
    assert np.allclose(result["hinge_two.angle"], -exact / 0.3, atol=1e-6)
    assert np.allclose(result["gear.torque_a"], 2.0 * 1.5 / moment - 1.5, atol=1e-8)
    assert np.allclose(result["gear.torque_b"], 0.5 * (-1.5 / moment / 0.3), atol=1e-8)
    # The ground takes what changes the angular momentum: the gear's torques do not add up, its carrier takes the rest.
    taken = 2.0 * 1.5 / moment - 0.5 * 1.5 / moment / 0.3
    if space == "space":
        n = np.array(axis) / np.linalg.norm(axis)
        found = sum(result[f"ground.torque.{k}"] * n[i] for i, k in enumerate("xyz"))
    else:
        found = result["ground.torque"]
    assert np.allclose(found, taken, atol=1e-8)
    assert result.energy.max_drift < 1e-8


@pytest.mark.parametrize(("space", "axis"), SPACES)
def test_a_gear_saves_a_state_and_leaves_no_constraint(space: str, axis: tuple[float, float, float]) -> None:
    reduced = assemble(wheels(space, axis)).reduced
    assert len(reduced.coordinates) == len(reduced.speeds) == 1
    assert not reduced.constraints
    assert len(reduced.eliminated) == 1
    found = report(wheels(space, axis))
    assert found.degrees_of_freedom == 1


@pytest.mark.parametrize("form", FORMS)
def test_turns_are_counted(form: str) -> None:
    """A spring on a hinge that is wound up by many turns through a gear whose ratio is no fraction."""
    ratio = 1.0 / math.pi
    scene = wheels("space", SPACE, ratio=ratio, stiffness=0.02)
    scene.start.update({"hinge_one.angle": 0.0, "hinge_one.angular_velocity": 6.0})
    result = simulate(scene, form=form, t_end=30.0, rtol=1e-10, outputs=31)
    moment = 2.0 + 0.5 / ratio**2
    n = math.sqrt(0.02 / moment)
    exact = 6.0 / n * np.sin(n * result.time)
    assert np.max(exact) > 100.0
    assert np.allclose(result["hinge_one.angle"], exact, atol=1e-5)
    assert np.allclose(result["hinge_two.angle"], exact * math.pi, atol=4e-5)
    assert result.energy.max_drift < 1e-7


def four_bar(space: str, geared: str) -> Scene:
    """Return a four-bar linkage in the x-z plane with a flywheel that is geared to one of its hinges."""
    scene = Scene(space=space)
    lengths = {"crank": 1.0, "coupler": 2.5, "rocker": 2.0}
    links = {name: scene.add(name, lib.Link(length=length, mass=1.0)) for name, length in lengths.items()}
    left, right = scene.add("left", lib.Ground()), scene.add("right", lib.Ground(position=(2.5, 0.0, 0.0)))
    ends = [
        (left.frame, links["crank"].a),
        (links["crank"].b, links["coupler"].a),
        (links["coupler"].b, links["rocker"].b),
        (right.frame, links["rocker"].a),
    ]
    hinges = {}
    for number, (a, b) in enumerate(ends):
        hinges[f"hinge{number}"] = scene.add(f"hinge{number}", lib.Pivot())
        scene.connect(a, hinges[f"hinge{number}"].a)
        scene.connect(hinges[f"hinge{number}"].b, b)
    own, wheel = scene.add("own", lib.Pivot()), scene.add("wheel", lib.RigidBody(moments=(0.3, 0.3, 0.3)))
    gear = scene.add("gear", lib.Gear(ratio=0.4))
    scene.connect(left.frame, own.a)
    scene.connect(own.b, wheel.frame)
    scene.connect(hinges[geared].shaft, gear.a)
    scene.connect(gear.b, own.shaft)
    angles = {"hinge0.angle": 1.0, "hinge1.angle": -0.7, "hinge3.angle": 1.9}
    scene.start.update({"hinge0.angle": 1.0, "hinge0.angular_velocity": 1.0})
    scene.guess.update({name: value for name, value in angles.items() if name != "hinge0.angle"})
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("geared", [f"hinge{number}" for number in range(4)])
def test_a_gear_on_any_hinge_of_a_loop(geared: str) -> None:
    """Whichever hinge closes the loop: the same motion in a plane and in space, in both forms."""
    runs = [
        simulate(four_bar(space, geared), form=form, t_end=1.0, rtol=1e-9, outputs=6)
        for space in ("plane", "space")
        for form in FORMS
    ]
    for one in runs:
        assert one.energy.max_drift < 2e-5
        for path in ("hinge0.angle", "own.angle", "gear.torque_a", "gear.torque_b"):
            wanted = runs[0][path]
            # The angle of a hinge is within one turn at the start, and the gear's other one follows.
            turns = 2.0 * math.pi * (np.round((one[path][0] - wanted[0]) / (2.0 * math.pi)) if "angle" in path else 0.0)
            scale = max(1.0, float(np.max(np.abs(wanted))))
            if path != "own.angle":
                assert np.allclose(one[path] - turns, wanted, atol=1e-6 * scale), path
            else:
                assert np.allclose(one[path] - one[path][0], wanted - wanted[0], atol=1e-6 * scale), path


# -- epicyclic gears --------------------------------------------------------------------------------------------------

SUN, PLANET = 24, 18
RING = SUN + 2 * PLANET
MOMENTS = {"sun": 0.02, "carrier": 0.05, "planet": 0.004}
PLANET_MASS, ARM, COUNT = 0.3, 0.21, 3


def epicyclic(space: str, axis: tuple[float, float, float]) -> Scene:
    """Return a sun, a carrier and three planets in a ring that stands still; a motor turns the sun.

    Seen from the carrier, the ring's hinge is the one that carries the carrier, walked the other way.
    """
    scene = Scene(space=space, gravity=0.0)
    ground, ring = scene.add("ground", lib.Ground()), scene.add("ring_hinge", lib.Pivot(axis=axis))
    carrier = scene.add("carrier", lib.RigidBody(mass=1.0, moments=(MOMENTS["carrier"],) * 3))
    sun_hinge = scene.add("sun_hinge", lib.Pivot(axis=axis))
    sun = scene.add("sun", lib.RigidBody(mass=1.0, moments=(MOMENTS["sun"],) * 3))
    drive = scene.add("drive", lib.Torque(axis=axis, value=0.4))
    scene.connect(carrier.frame, ring.a)
    scene.connect(ring.b, ground.frame)
    scene.connect(carrier.frame, sun_hinge.a)
    scene.connect(sun_hinge.b, sun.frame)
    scene.connect(drive.frame, sun.frame)
    n = np.array(axis) / np.linalg.norm(axis)
    first = np.cross(n, (0.0, 1.0, 0.0) if abs(n[1]) < 0.5 else (0.0, 0.0, 1.0))
    first /= np.linalg.norm(first)
    for number in range(COUNT):
        angle = 2.0 * math.pi * number / COUNT
        place = ARM * (math.cos(angle) * first + math.sin(angle) * np.cross(n, first))
        arm = scene.add(f"arm{number}", lib.Weld(displacement=tuple(place)))
        hinge = scene.add(f"hinge{number}", lib.Pivot(axis=axis))
        planet = scene.add(f"planet{number}", lib.RigidBody(mass=PLANET_MASS, moments=(MOMENTS["planet"],) * 3))
        scene.connect(carrier.frame, arm.a)
        scene.connect(arm.b, hinge.a)
        scene.connect(hinge.b, planet.frame)
        inner = scene.add(f"inner{number}", lib.Gear(ratio=-SUN / PLANET))
        scene.connect(inner.a, hinge.shaft)
        scene.connect(inner.b, sun_hinge.shaft)
        if number == 0:  # the other planets' meshes with the ring follow
            outer = scene.add("outer", lib.Gear(ratio=RING / PLANET))
            scene.connect(outer.a, hinge.shaft)
            scene.connect(outer.b, ring.shaft)
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("space", "axis"), SPACES)
def test_an_epicyclic_gear_with_planets(space: str, axis: tuple[float, float, float], form: str) -> None:
    result = simulate(epicyclic(space, axis), form=form, t_end=4.0, rtol=1e-10, outputs=9)
    step_up = 1.0 + RING / SUN
    planets = COUNT * (PLANET_MASS * ARM**2 + MOMENTS["planet"] * (1.0 - RING / PLANET) ** 2)
    moment = MOMENTS["carrier"] + planets + MOMENTS["sun"] * step_up**2
    carrier = 0.5 * 0.4 * step_up / moment * result.time**2
    assert carrier[-1] > 10.0
    assert np.allclose(-result["ring_hinge.angle"], carrier, atol=1e-6)
    assert np.allclose(result["sun_hinge.angle"], (step_up - 1.0) * carrier, atol=1e-6)
    assert np.allclose(result["hinge2.angle"], -RING / PLANET * carrier, atol=1e-6)
    assert result.energy.max_drift < 1e-8
    if form == "reduced":
        assert len(result.assembly.reduced.speeds) == 1
        assert not result.assembly.reduced.constraints


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("space", "axis"), SPACES)
def test_a_planetary_gear_splits_torques(space: str, axis: tuple[float, float, float], form: str) -> None:
    scene = Scene(space=space, gravity=0.0)
    ground = scene.add("ground", lib.Ground())
    gear = scene.add("gear", lib.PlanetaryGear(ratio=2.5))
    moments = {"sun": 0.3, "carrier": 0.7, "ring": 1.1}
    for name, moment in moments.items():
        hinge = scene.add(f"{name}_hinge", lib.Pivot(axis=axis, motor=1.0 if name == "carrier" else 0.0))
        wheel = scene.add(name, lib.RigidBody(moments=(moment,) * 3))
        scene.connect(ground.frame, hinge.a)
        scene.connect(hinge.b, wheel.frame)
        scene.connect(hinge.shaft, getattr(gear, name))
    result = simulate(scene, form=form, t_end=3.0, rtol=1e-10, outputs=4)
    # With T on the sun: J_s s'' = T, J_r r'' = rho T, J_c c'' = 1 - (1 + rho) T and s + rho r = (1 + rho) c.
    rho = 2.5
    torque = (1.0 + rho) / 0.7 / (1.0 / 0.3 + rho**2 / 1.1 + (1.0 + rho) ** 2 / 0.7)
    assert np.allclose(result["gear.sun_torque"], torque, atol=1e-9)
    assert np.allclose(result["gear.ring_torque"], rho * torque, atol=1e-9)
    assert np.allclose(result["gear.carrier_torque"], -(1.0 + rho) * torque, atol=1e-9)
    assert np.allclose(result["sun_hinge.angle"], torque / 0.6 * result.time**2, atol=1e-7)


# -- slides -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_rack_falls_and_turns_its_pinion(space: str, form: str) -> None:
    scene = Scene(space=space)
    ground, slider = scene.add("ground", lib.Ground()), scene.add("slider", lib.Slider(axis=(0.6, 0.0, -0.8)))
    hinge, rack = scene.add("hinge", lib.Pivot()), scene.add("rack", lib.PointMass(mass=3.0))
    wheel = scene.add("wheel", lib.RigidBody(mass=1.0, moments=(0.2, 0.2, 0.2)))
    teeth = scene.add("teeth", lib.RackAndPinion(radius=-0.05))
    for a, b in [(ground.frame, slider.a), (slider.b, rack.point), (ground.frame, hinge.a), (hinge.b, wheel.frame)]:
        scene.connect(a, b)
    scene.connect(teeth.rack, slider.carriage)
    scene.connect(teeth.pinion, hinge.shaft)
    result = simulate(scene, form=form, t_end=4.0, rtol=1e-10, outputs=9)
    rate = 3.0 * 9.81 * 0.8 / (3.0 + 0.2 / 0.05**2)
    assert np.allclose(result["slider.displacement"], 0.5 * rate * result.time**2, atol=1e-7)
    assert np.allclose(result["hinge.angle"], -0.5 * rate * result.time**2 / 0.05, atol=2e-6)
    assert np.allclose(result["teeth.force"], 3.0 * rate - 3.0 * 9.81 * 0.8, atol=1e-7)
    assert np.allclose(result["teeth.torque"], -0.2 * rate / 0.05, atol=1e-7)
    if form == "reduced":
        assert len(result.assembly.reduced.speeds) == 1
        assert not result.assembly.reduced.constraints


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["line", "plane", "space"])
def test_two_slides_on_one_pipe(space: str, form: str) -> None:
    scene = Scene(space=space, gravity=0.0, **({"line_axis": (1.0, 0.0, 0.0)} if space == "line" else {}))
    ground, gear = scene.add("ground", lib.Ground()), scene.add("gear", lib.SlideGear(ratio=-0.25, offset=0.4))
    for name, mass, end in (("small", 1.0, gear.b), ("large", 4.0, gear.a)):
        slider = scene.add(name, lib.Slider(actuator=2.0 if name == "small" else 0.0))
        block = scene.add(f"{name}_block", lib.PointMass(mass=mass))
        scene.connect(ground.frame, slider.a)
        scene.connect(slider.b, block.point)
        scene.connect(slider.carriage, end)
    scene.start["small.displacement"] = 0.0
    result = simulate(scene, form=form, t_end=2.0, rtol=1e-10, outputs=5)
    rate = 2.0 / (1.0 + 4.0 / 16.0)
    assert np.allclose(result["small.displacement"], 0.5 * rate * result.time**2, atol=1e-8)
    assert np.allclose(result["large.displacement"], 0.4 - 0.125 * rate * result.time**2, atol=1e-8)
    assert np.allclose(result["gear.force_a"], -4.0 * 0.25 * rate, atol=1e-8)


def test_a_screw_jack_through_a_gear() -> None:
    """A motor's wheel turns a screw on a slide's nut: a shaft of any joint."""
    scene = Scene(space="space")
    ground, screw = scene.add("ground", lib.Ground()), scene.add("screw", lib.Screw(axis=(0.0, 0.0, 1.0), pitch=0.01))
    load = scene.add("load", lib.RigidBody(mass=10.0, moments=(0.1, 0.1, 0.02)))
    hinge = scene.add("hinge", lib.Pivot(axis=(1.0, 0.0, 0.0), motor=0.5))
    wheel, gear = scene.add("wheel", lib.RigidBody(moments=(0.001, 0.1, 0.1))), scene.add("gear", lib.Gear(ratio=0.2))
    for a, b in [(ground.frame, screw.a), (screw.b, load.frame), (ground.frame, hinge.a), (hinge.b, wheel.frame)]:
        scene.connect(a, b)
    scene.connect(gear.a, screw.shaft)
    scene.connect(gear.b, hinge.shaft)
    lead = 0.01 / (2.0 * math.pi)
    moment = 0.001 + 0.2**2 * (0.02 + 10.0 * lead**2)
    rate = (0.5 - 10.0 * 9.81 * lead * 0.2) / moment
    for form in FORMS:
        result = simulate(scene, form=form, t_end=1.0, rtol=1e-10, outputs=3)
        assert np.allclose(result["hinge.angle"], 0.5 * rate * result.time**2, rtol=1e-7, atol=1e-9)
        assert np.allclose(result["load.position.z"], 0.1 * rate * result.time**2 * lead, rtol=1e-7, atol=1e-9)


# -- models, files, errors --------------------------------------------------------------------------------------------


class Motor(Model):
    """A motor: a rotor on a hinge whose shaft is offered."""

    shaft: Shaft = connector(Shaft, "The shaft of the rotor.")
    ground: lib.Ground = lib.Ground()
    hinge: lib.Pivot = lib.Pivot(motor=2.0)
    rotor: lib.RigidBody = lib.RigidBody(moments=(0.1, 0.1, 0.1))
    connections = [connect(ground.frame, hinge.a), connect(hinge.b, rotor.frame), connect(shaft, hinge.shaft)]


def test_a_shaft_of_a_model_and_a_scene_from_a_file() -> None:
    scene = Scene(gravity=0.0)
    motor, gear, ground = (
        scene.add("motor", Motor()),
        scene.add("gear", lib.Gear(ratio=4.0)),
        scene.add("g", lib.Ground()),
    )
    hinge, load = scene.add("hinge", lib.Pivot()), scene.add("load", lib.RigidBody(moments=(3.2, 3.2, 3.2)))
    scene.connect(ground.frame, hinge.a)
    scene.connect(hinge.b, load.frame)
    scene.connect(motor.shaft, gear.a)
    scene.connect(gear.b, hinge.shaft)
    result = simulate(scene, t_end=1.0, outputs=3, rtol=1e-9)
    assert result["hinge.angle"][-1] == pytest.approx(0.5 * 8.0 / (3.2 + 0.1 * 16.0), rel=1e-8)
    again = simulate(from_data(to_data(wheels("space", SPACE, motor=1.5))), t_end=1.0, outputs=3, rtol=1e-9)
    assert again["hinge_one.angle"][-1] == pytest.approx(0.75 / (2.0 + 0.5 / 0.09), rel=1e-7)


def test_what_cannot_be_geared_is_refused() -> None:
    scene = Scene()
    gear, hinge, other = scene.add("gear", lib.Gear()), scene.add("hinge", lib.Pivot()), scene.add("other", lib.Pivot())
    slider = scene.add("slider", lib.Slider())
    with pytest.raises(AtwoodError, match=r"Slide.*Shaft.*unlike"):
        scene.connect(slider.carriage, gear.a)
    with pytest.raises(AtwoodError, match="unlike"):
        scene.connect(hinge.b, gear.a)
    scene.connect(hinge.shaft, gear.a)
    with pytest.raises(AtwoodError, match=r"gear\.b: it is connected to no joint.*like hinge\.shaft"):
        assemble(scene)
    scene.connect(other.shaft, gear.b)
    scene.connect(hinge.shaft, other.shaft)
    with pytest.raises(AtwoodError, match=r"joints hinge and other are connected to each other.*gear with ratio 1"):
        assemble(scene)


def test_nothing_turns_on_a_line() -> None:
    scene = wheels("plane", PLANE)
    scene.space = "line"
    with pytest.raises(AtwoodError, match=r"gear\.a: on a line the joint hinge_one has no angle"):
        assemble(scene)


@pytest.mark.parametrize("form", FORMS)
def test_two_gears_of_one_ratio_are_one_too_many(form: str) -> None:
    scene = with_a_second_gear(-0.3)
    found = simulate(scene, form=form, t_end=1.0, outputs=3, rtol=1e-9)
    assert found["hinge_one.angle"][-1] == pytest.approx(0.5 / (2.0 + 0.5 / 0.09), rel=1e-7)
    # Only the sum of their torques is told by the motion.
    total = found["gear.torque_a"] + found["second.torque_a"]
    assert np.allclose(total, 2.0 / (2.0 + 0.5 / 0.09) - 1.0, atol=1e-8)


@pytest.mark.parametrize("form", FORMS)
def test_two_gears_of_different_ratios_lock(form: str) -> None:
    with pytest.raises(AtwoodError, match=r"nothing can move.*if one let go: gear \(1\), second \(1\)"):
        simulate(with_a_second_gear(0.5), form=form, t_end=1.0, outputs=3)


def with_a_second_gear(ratio: float) -> Scene:
    """Return two wheels with two gears between them, one of them of a ratio of -0.3."""
    scene = wheels("plane", PLANE, motor=1.0)
    second = scene.add("second", lib.Gear(ratio=ratio))
    scene.connect(second.a, scene.hinge_one.shaft)
    scene.connect(second.b, scene.hinge_two.shaft)
    return scene


def test_every_solver_takes_a_gear_and_other_ratios_compile_nothing() -> None:
    assembly = assemble(wheels("space", SPACE, motor=1.5))
    for solver in ("ida", "explicit", "taylor"):
        result = simulate(assembly, solver=solver, t_end=1.0, outputs=2, rtol=1e-9)
        assert result["hinge_two.angle"][-1] == pytest.approx(-0.75 / (2.0 + 0.5 / 0.09) / 0.3, rel=1e-7)
    for ratio in (-0.5, 0.2, 3.0):
        result = simulate(assembly.with_values({"gear.ratio": ratio}), t_end=1.0, outputs=2, rtol=1e-9)
        assert result["hinge_one.angle"][-1] == pytest.approx(0.75 / (2.0 + 0.5 / ratio**2), rel=1e-7)


def test_a_gear_through_a_change_of_mode() -> None:
    """A rope on a wheel's rim goes slack and comes taut with a jerk; turns pass from mode to mode."""
    runs = []
    for form in FORMS:
        scene = wheels("space", PLANE, stiffness=0.5)
        rim, far = scene.add("rim", lib.Weld(displacement=(0.3, 0.0, 0.0))), scene.add("far", lib.Ground())
        far.position = (0.3, 0.0, -0.5)
        rope = scene.add("rope", lib.Rope(length=0.7, starts="slack", when_slack="slack"))
        scene.connect(scene.one.frame, rim.a)
        scene.connect(rim.b, rope.a)
        scene.connect(far.frame, rope.b)
        scene.start.update({"hinge_one.angle": 0.0, "hinge_one.angular_velocity": 3.0})
        runs.append(simulate(scene, form=form, t_end=3.0, rtol=1e-10, outputs=7))
    assert [one.law for one in runs[0].events][:2] == ["comes_taut", "goes_slack"]
    for path in ("hinge_one.angle", "hinge_two.angle"):
        assert np.allclose(runs[0][path], runs[1][path], atol=1e-5)


class Coupling(Component):
    """A soft shaft with a damper between two joints."""

    a: Shaft = connector(Shaft, "One end of the shaft.")
    b: Shaft = connector(Shaft, "The other end of the shaft.")

    @potential
    def energy(self) -> Scalar:
        """Return the energy of the twist."""
        return 0.5 * 0.3 * (self.b.value - self.a.value) ** 2

    @dissipation
    def loss(self) -> Scalar:
        """Return half the dissipated power."""
        return 0.5 * 0.02 * (self.b.rate - self.a.rate) ** 2

    @observable(unit="rad", doc="Twist of the shaft.")
    def twist(self) -> Scalar:
        """Return the twist."""
        return self.b.value - self.a.value


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("space", "axis"), SPACES)
def test_a_soft_shaft_counts_turns_too(space: str, axis: tuple[float, float, float], form: str) -> None:
    """Two wheels of moments 2 and 0.5, the second spun up: the twist swings and dies away, beyond half a turn."""
    scene = wheels(space, axis, geared=False)
    shaft = scene.add("shaft", Coupling())
    scene.connect(scene.hinge_one.shaft, shaft.a)
    scene.connect(shaft.b, scene.hinge_two.shaft)
    scene.start.update({"hinge_one.angular_velocity": 0.0, "hinge_two.angular_velocity": 9.0})
    result = simulate(scene, form=form, t_end=12.0, rtol=1e-10, outputs=25)
    moment = 2.0 * 0.5 / 2.5
    decay, n = 0.02 / (2.0 * moment), math.sqrt(0.3 / moment - (0.02 / (2.0 * moment)) ** 2)
    exact = 9.0 / n * np.exp(-decay * result.time) * np.sin(n * result.time)
    assert np.max(exact) > 2.0 * math.pi
    assert np.allclose(result["shaft.twist"], exact, atol=1e-5)
    assert result.energy.max_drift < 1e-7


def test_a_load_on_a_shaft_is_refused() -> None:
    class Wrong(Component):
        """A part that pushes where nothing can be pushed."""

        a: Shaft = connector(Shaft, "The shaft.")

        @force
        def push(self) -> Iterable[Load]:
            """Return a load."""
            yield Load(self.a)

    scene = wheels("plane", PLANE)
    wrong = scene.add("wrong", Wrong())
    scene.connect(wrong.a, scene.hinge_one.shaft)
    with pytest.raises(AtwoodError, match=r"wrong\.push: a load acts on a point or a frame"):
        assemble(scene)
