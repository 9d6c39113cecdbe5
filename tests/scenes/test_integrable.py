"""Constraints on velocities that are ones on positions: found, integrated, and eliminated where they are linear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import atwood_library as lib
from atwood import (
    Component,
    Frame,
    Point,
    Scalar,
    Scene,
    StartError,
    connector,
    constraint,
    parameter,
    report,
    select,
    simulate,
    sweep,
)
from atwood.pipeline import assemble
from atwood.simulation.initialization.start import find_start

from ..helpers.runs import FORMS

G = 9.81


def wheel_on_a_slope(slope: float = 0.3, **more: float) -> Scene:
    """Return a disc that rolls down a slope in the plane."""
    scene = Scene(t_end=2.0, **more)
    ground, contact = scene.add("ground", lib.Ground(angle=-slope)), scene.add("contact", lib.RollingDisc(radius=0.5))
    wheel = scene.add("wheel", lib.Disc(radius=0.5, mass=2.0))
    scene.connect(ground.frame, contact.a)
    scene.connect(contact.b, wheel.frame)
    scene.start.update({"contact.displacement": 0.3, "wheel.angle": 0.2, "contact.speed": 0.2})
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_a_wheel_on_a_slope(form: str) -> None:
    made = simulate(wheel_on_a_slope(), form=form, rtol=1e-11)
    pull = G * np.sin(0.3) / 1.5
    run = 0.3 + 0.2 * made.time + 0.5 * pull * made.time**2
    assert np.max(np.abs(made["contact.displacement"] - run)) < 1e-9
    assert np.max(np.abs(made["wheel.angle"] - 0.2 + (run - 0.3) / 0.5)) < 1e-9
    assert np.max(np.abs(made["contact.friction"] + 2.0 * G * np.sin(0.3) / 3.0)) < 1e-8
    assert np.max(np.abs(made["contact.normal_force"] - 2.0 * G * np.cos(0.3))) < 1e-8
    equations = made.assembly.own_equations
    (integral,) = equations.integrals
    assert integral.keys == (("contact", "rolling_on_line", 0),)
    assert all(one.holonomic for one in equations.constraints)


def test_a_wheel_in_the_plane_has_the_states_of_a_hand_count() -> None:
    found = report(wheel_on_a_slope())
    assert found.degrees_of_freedom == 1
    assert found.states["reduced"] == 2
    assert found.states["dae"] == 6 + 2 * 2  # three coordinates, and two constraints that both hold positions
    assert sum(found.operations["reduced"].values()) <= 4
    assert found.integrated == ("contact.rolling_on_line",)
    assert "contact.rolling_on_line" in str(found)


def test_a_wheel_on_a_seesaw_keeps_two_freedoms() -> None:
    """The line itself turns: the integral is linear in the joint's own coordinate, and not in the world's."""
    scene = Scene(t_end=0.5)
    ground, pivot = scene.add("ground", lib.Ground()), scene.add("pivot", lib.Pivot())
    beam = scene.add("beam", lib.RigidBody(mass=3.0, moments=(0.2, 0.4, 0.2)))
    wheel, contact = (
        scene.add("wheel", lib.Disc(radius=0.2, mass=1.0)),
        scene.add("contact", lib.RollingDisc(radius=0.2)),
    )
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, beam.frame)
    scene.connect(beam.frame, contact.a)
    scene.connect(contact.b, wheel.frame)
    scene.start.update({"pivot.angle": 0.1, "contact.displacement": 0.3})
    reduced, dae = (simulate(scene, form=form, rtol=1e-11, outputs=6) for form in FORMS)
    assert report(scene).states["reduced"] == 4
    assert reduced.energy.max_drift < 1e-9
    for path in reduced.paths:
        assert np.max(np.abs(reduced[path] - dae[path])) < 1e-6, path


@pytest.mark.parametrize("size", [1.0, 1e-7])
def test_an_assembly_is_for_the_start_that_gave_its_constants(size: float) -> None:
    scene = wheel_on_a_slope()
    for name in ("contact", "wheel"):
        scene[name].radius = 0.5 * size
    scene.start.update({"contact.displacement": 0.3 * size, "contact.speed": 0.2 * size})
    made = assemble(scene)
    find_start(made)
    start = {**made.flat.start, "contact.displacement": (0.3 + 1e-4) * size}
    with pytest.raises(StartError, match="made for another start"):
        find_start(replace(made, flat=replace(made.flat, start=start)))


def upright() -> Scene:
    """Return a disc in space that a plate keeps upright and on a line."""
    scene = Scene(space="space", t_end=1.0)
    ground, guide = scene.add("ground", lib.Ground(angle=0.2)), scene.add("guide", lib.Planar(axis=(0.0, 1.0, 0.0)))
    disc, contact = scene.add("disc", lib.Disc(radius=0.5, mass=2.0)), scene.add("contact", lib.RollingDisc(radius=0.5))
    for joint in (guide, contact):
        scene.connect(ground.frame, joint.a)
        scene.connect(joint.b, disc.frame)
    scene.start["disc.spin.y"] = 1.0
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_disc_that_is_kept_upright_has_one_freedom(form: str) -> None:
    made = simulate(upright(), form=form, rtol=1e-11)
    assert report(upright()).states["reduced"] == 2
    assert report(upright()).integrated == ("contact.rolling",)
    run = np.hypot(
        made["disc.position.x"] - made["disc.position.x"][0], made["disc.position.z"] - made["disc.position.z"][0]
    )
    assert np.max(np.abs(run - np.abs(0.5 * made.time - 0.5 * G * np.sin(0.2) / 1.5 * made.time**2))) < 1e-8


class Blade(Component):
    """It moves along its x axis only."""

    frame: Frame = connector(Frame, "The blade.")

    @constraint(reaction="side_force", unit="N", doc="Force on the frame, across the blade.")
    def edge(self) -> Scalar:
        """Return the velocity across the blade."""
        z = self.frame.axes[2]
        return self.frame.velocity.x * z.x + self.frame.velocity.z * z.z


def on_blades(count: int) -> Scene:
    """Return a link with a blade at one end or at both: together they keep it from turning."""
    scene = Scene(t_end=1.0)
    link = scene.add("link", lib.Link(length=1.0, mass=2.0))
    for number, end in enumerate((link.a, link.b)[:count]):
        blade = scene.add(f"blade{number}", Blade())
        scene.connect(end, blade.frame)
    scene.start.update({"link.position.x": 0.0, "link.position.z": 0.0, "link.angle": -0.5, "link.velocity.x": 0.0})
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_constraints_can_be_integrable_together_only(form: str) -> None:
    made = simulate(on_blades(2), form=form, rtol=1e-10)
    along = 0.5 * G * np.sin(0.5) * made.time**2
    assert np.max(np.abs(made["link.position.x"] - along * np.cos(0.5))) < 1e-8
    assert np.max(np.abs(made["link.angle"] + 0.5)) < 1e-12
    for path in ("blade0.side_force", "blade1.side_force"):
        assert np.max(np.abs(made[path] - G * np.cos(0.5))) < 1e-8
    assert report(on_blades(2)).states["reduced"] == 2


def test_one_blade_is_not_integrable() -> None:
    found = report(on_blades(1))
    assert found.integrated == ()
    assert found.degrees_of_freedom == 2


@pytest.mark.parametrize("form", FORMS)
def test_other_values_and_another_start_give_other_constants(form: str) -> None:
    first = assemble(wheel_on_a_slope(), form=form)
    for values, start in (({"contact.radius": 0.4, "wheel.radius": 0.4}, {}), ({}, {"wheel.angle": 1.7})):
        again = simulate(first.with_values(values, start=start), rtol=1e-10)
        radius = values.get("contact.radius", 0.5)
        turned = again["wheel.angle"] - start.get("wheel.angle", 0.2)
        assert np.max(np.abs(radius * turned + again["contact.displacement"] - 0.3)) < 1e-9
        assert np.ptp(again["wheel.angle"]) > 1.0


def test_a_sweep_takes_each_start_by_itself() -> None:
    angles = [0.2, 0.9, 1.6]
    found = sweep(
        wheel_on_a_slope(), start={"wheel.angle": angles}, rtol=1e-10, outputs=3, quantities=["wheel", "contact"]
    )
    alone = simulate(wheel_on_a_slope(), rtol=1e-10, outputs=3)
    turned = alone["wheel.angle"] - 0.2
    assert np.max(np.abs(found["wheel.angle"] - np.array(angles)[:, None] - turned)) < 1e-9
    assert np.max(np.abs(found["contact.displacement"] - alone["contact.displacement"])) < 1e-9
    wide = sweep(wheel_on_a_slope(), {"wheel.mass": [1.0, 4.0]}, rtol=1e-10, outputs=3, quantities=["contact"])
    assert np.max(np.abs(wide["contact.displacement"] - alone["contact.displacement"])) < 1e-9


def test_a_constant_that_is_zero_is_another_start_too() -> None:
    scene = wheel_on_a_slope()
    scene.start.update({"contact.displacement": 0.0, "wheel.angle": 0.0})
    again = simulate(assemble(scene).with_values(start={"wheel.angle": 1.0}), outputs=3)
    assert abs(again["wheel.angle"][0] - 1.0) < 1e-12
    assert abs(again["contact.displacement"][0]) < 1e-12


class Radial(Component):
    """A point moves towards the world's origin or away from it only: ``x z' - z x' = 0``, so that z/x is constant."""

    point: Point = connector(Point, "The point.")
    kinematic_map: float = parameter(1.0, unit="1", doc="Share of the first term: with 1 it is integrable.")

    @constraint(reaction="across", unit="N/m", doc="Multiplier.")
    def straight(self) -> Scalar:
        """Return the rate of the area that is swept."""
        p, v = self.point.position, self.point.velocity
        return p.x * v.z - self.kinematic_map * p.z * v.x


class Contact(Component):
    """The contact form ``z' - y x' = 0``, which is the textbook's case of what cannot be integrated."""

    point: Point = connector(Point, "The point.")
    twist: float = parameter(1.0, unit="1/m", doc="Factor of y; zero makes it integrable.")

    @constraint(reaction="force", unit="N", doc="Multiplier.", spaces=("space",))
    def form(self) -> Scalar:
        """Return the form along the velocity."""
        v = self.point.velocity
        return v.z - self.twist * self.point.position.y * v.x


def held_point(part: Component, space: str) -> Scene:
    scene = Scene(space=space, t_end=0.5)
    mass, held = scene.add("mass", lib.PointMass()), scene.add("held", part)
    scene.connect(mass.point, held.point)
    scene.start.update({"mass.position.x": 1.0, "mass.position.z": -0.5})
    return scene


def test_what_is_integrable_without_a_simple_integral_is_said() -> None:
    scene = held_point(Radial(), "plane")
    found = report(scene)
    assert found.on_surfaces == ("held.straight",)
    assert "stay on surfaces" in str(found)
    assert found.integrated == ()
    for form in FORMS:
        made = simulate(scene, form=form, rtol=1e-10)
        assert np.max(np.abs(made["mass.position.z"] / made["mass.position.x"] + 0.5)) < 1e-8
    # In space one form in three coordinates, times a function, is a differential only if it is radial.
    assert report(held_point(Radial(), "space")).on_surfaces == ("held.straight",)
    assert report(held_point(Contact(), "space")).on_surfaces == ()
    assert report(held_point(Contact(twist=0.0), "space")).integrated == ("held.form",)


def test_rolling_is_not_integrable() -> None:
    """Neither a disc's rolling nor a ball's is, with orientations as coordinates."""
    from atwood.forms.other_values import starting
    from atwood.mechanics.constraints.pfaffian import integrable_together
    from atwood_library.scenes import RollingBall, RollingDisc as RollingDiscScene

    for scene, expected in ((RollingDiscScene(), False), (RollingBall(), False), (on_blades(1), False)):
        made = starting(assemble(scene))
        assert integrable_together(made.mechanism, made.reduced) is expected
    tiny = starting(assemble(RollingDiscScene(radius=1e-10, motion="straight", speed=1e-10)))
    assert integrable_together(tiny.mechanism, tiny.reduced) is False  # sizes are compared with those of the scene
    for scene in (wheel_on_a_slope(), upright(), on_blades(2)):
        made = starting(assemble(scene))
        assert integrable_together(made.mechanism, made.reduced) is True


def test_two_wheels_keep_a_cart_level_and_leave_one_freedom() -> None:
    """A cart in the plane on two wheels: both contacts, both rollings and its angle come down to one coordinate."""
    scene = Scene(t_end=1.0)
    ground, cart = (
        scene.add("ground", lib.Ground(angle=-0.2)),
        scene.add("cart", lib.Box(length_x=1.0, length_z=0.2, mass=5.0)),
    )
    for name, place in (("back", -0.4), ("front", 0.4)):
        wheel = scene.add(name, lib.Wheel(radius=0.2, mass=0.5, axial=0.01, transverse=0.005))
        end = scene.add(f"{name}_end", lib.Weld(displacement=(place, 0.0, 0.0)))
        scene.connect(cart.frame, end.a)
        scene.connect(end.b, wheel.axle)
        scene.connect(ground.frame, wheel.ground)
    scene.start.update({"back.contact.displacement": 0.0, "back.contact.speed": 0.3, "back.bearing.angle": 0.0})
    scene.start["front.bearing.angle"] = 0.0
    assert report(scene).states["reduced"] == 2
    pull = 6.0 * G * np.sin(0.2) / (6.0 + 2.0 * 0.01 / 0.2**2)
    for form in FORMS:
        made = simulate(scene, form=form, rtol=1e-11)
        run = 0.3 * made.time + 0.5 * pull * made.time**2
        assert np.max(np.abs(made["front.contact.displacement"] - 0.8 - run)) < 1e-9
        assert np.max(np.abs(made["front.bearing.angle"] - run / 0.2)) < 2e-8
        assert np.max(np.abs(made["front.contact.friction"] + 0.01 / 0.2**2 * pull)) < 1e-8
        weight = made["front.contact.normal_force"] + made["back.contact.normal_force"]
        assert np.max(np.abs(weight - 6.0 * G * np.cos(0.2))) < 1e-8


class Towed(Component):
    """A point is towed along x at a given speed, by a share that may depend on where it is."""

    point: Point = connector(Point, "The point.")
    speed: float = parameter(0.7, unit="m/s", doc="Speed.")
    beyond: float = parameter(1e3, unit="m", doc="From where on it is let go.")

    @constraint(reaction="pull", unit="N", doc="Force on the point along x.")
    def tow(self) -> Scalar:
        """Return the velocity less the speed of towing."""
        return self.point.velocity.x - self.speed


class LetGo(Towed):
    """The same, but slower where it has come far; near the start nothing shows it."""

    @constraint(reaction="pull", unit="N", doc="Force on the point along x.")
    def tow(self) -> Scalar:
        """Return the velocity less the speed of towing there."""
        past = self.point.position.x - self.beyond
        return self.point.velocity.x - self.speed * select(past < 0.0, 1.0, 1.0 - past)


@pytest.mark.parametrize("form", FORMS)
def test_what_is_towed_is_a_function_of_time(form: str) -> None:
    made = simulate(held_point(Towed(), "plane"), form=form, rtol=1e-10)
    assert np.max(np.abs(made["mass.position.x"] - 1.0 - 0.7 * made.time)) < 1e-10
    assert len(made.assembly.reduced.coordinates) == 1
    assert np.max(np.abs(made["held.pull"])) < 1e-9


@pytest.mark.parametrize("form", FORMS)
def test_what_switches_is_not_integrated_from_a_few_places(form: str) -> None:
    scene = held_point(LetGo(beyond=1.1), "plane")
    far = held_point(LetGo(), "plane")
    for one in (scene, far):
        assert report(one).integrated == ()
    made = simulate(scene, form=form, rtol=1e-9, t_end=0.5)
    past = 0.7 * made.time - 0.1
    ahead = np.where(past < 0.0, 0.1 + past, 1.1 - np.exp(-past))
    assert np.max(np.abs(made["mass.position.x"] - 1.0 - ahead)) < 1e-7


def test_a_small_constraint_is_not_taken_for_rounding() -> None:
    """Units of what somebody writes are nobody's business: a millionth of a millionth of a velocity holds as well."""

    class Faint(Towed):
        @constraint(reaction="pull", unit="N", doc="Multiplier.")
        def tow(self) -> Scalar:
            return 1e-13 * (self.point.velocity.x - self.speed)

    made = simulate(held_point(Faint(), "plane"), rtol=1e-10)
    assert np.max(np.abs(made["mass.position.x"] - 1.0 - 0.7 * made.time)) < 1e-10
