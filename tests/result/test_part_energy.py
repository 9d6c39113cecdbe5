"""The energy of each component: it balances, closed forms hold, and whatever feeds energy is named."""

from __future__ import annotations

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

import atwood
import atwood_library as lib
from atwood import (
    Component,
    Model,
    Point,
    Scalar,
    Scene,
    connect,
    connector,
    constraint,
    parameter,
    select,
    simulate,
    sin,
)
from atwood.errors import ResultError
from atwood.result.part_energy import PartEnergies
from atwood_library.scenes import SCENES
from atwood_library.scenes.atwood import Atwood
from atwood_library.scenes.double_pendulum import DoublePendulum
from atwood_library.scenes.rigid_bodies import RigidBodies

from ..helpers.lagrangians import LeakingBucket
from ..helpers.runs import FORMS


def check_balance(result: atwood.Result, bound: float = 1e-4) -> PartEnergies:
    """Check that components balance, add up to the whole, and that nothing is lost between them."""
    ledger, parts = result.energy, result.energy.parts
    size = max(ledger.exchanged, ledger.uncertainty)
    assert parts.max_error <= max(bound, 3.0 * ledger.max_drift), parts.describe()
    for name in ("kinetic", "potential"):
        total = np.sum([getattr(one, name) for one in parts.values()], axis=0)
        np.testing.assert_allclose(total, getattr(ledger, name), rtol=0.0, atol=1e-9 * size)
    given = np.sum([x.supplied - x.dissipated + x.constraints + x.impacts for x in parts.values()], axis=0)
    np.testing.assert_allclose(given, ledger.work, rtol=0.0, atol=max(bound * size, 2.0 * ledger.uncertainty))
    through = np.sum([w for one in parts.values() for w in one.work.values()], axis=0)
    np.testing.assert_allclose(through, 0.0, atol=1e-6 * size)
    return parts


@pytest.mark.sample(8)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", sorted(SCENES))
def test_components_of_all_scenes_balance(name, form):
    scene = SCENES[name]()
    result = simulate(scene, form=form, t_end=min(float(scene.t_end), 1.0))
    check_balance(result)


def swinging(**bob: float) -> Scene:
    scene = Scene(t_end=2.0)
    ground, rod = scene.add("ground", lib.Ground()), scene.add("rod", lib.Rod(length=0.8, **bob))
    mass = scene.add("bob", lib.PointMass(mass=1.5))
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, mass.point)
    scene.start.update({"rod.angle": 1.2, "rod.angular_velocity": 0.0})
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_rod_of_a_pendulum_hands_on_what_the_bob_gains(form):
    """A massless rod does no work on the bob; one with mass lifts it by what it loses itself."""
    light = check_balance(simulate(swinging(), form=form))
    assert np.max(np.abs(light["bob"].work["point"])) < 1e-6
    heavy = check_balance(simulate(swinging(mass=2.0), form=form, rtol=1e-10))
    gained = heavy["bob"].gained
    assert np.ptp(gained) > 1.0
    np.testing.assert_allclose(heavy["bob"].work["point"], gained, atol=1e-6)
    np.testing.assert_allclose(heavy["rod"].work["b"], -gained, atol=1e-6)
    np.testing.assert_allclose(heavy["rod"].work["a"], 0.0, atol=1e-9)
    # T of both together: 1/2 (m + M/3) l^2 w^2, of the bob alone: 1/2 m l^2 w^2
    np.testing.assert_allclose(heavy["rod"].kinetic, heavy["bob"].kinetic * 2.0 / 3.0 / 1.5, atol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_rope_of_atwoods_machine_carries_tension_times_way(form):
    result = simulate(Atwood(), form=form)
    parts, t = check_balance(result), result.time
    m1, m2, g = 2.0, 1.0, 9.81
    a, tension = (m1 - m2) / (m1 + m2) * g, 2.0 * m1 * m2 / (m1 + m2) * g
    carried = tension * 0.5 * a * t**2
    np.testing.assert_allclose(parts["m2"].work["point"], carried, atol=1e-7)
    np.testing.assert_allclose(parts["m1"].work["point"], -carried, atol=1e-7)
    np.testing.assert_allclose(parts["rope"].work["a"], carried, atol=1e-7)
    np.testing.assert_allclose(parts["rope"].work["b"], -carried, atol=1e-7)
    np.testing.assert_allclose(parts["rope"].constraints, 0.0, atol=1e-9)


def on_a_spring(damping: float) -> Scene:
    scene = Scene(space="line", gravity=0.0, t_end=3.0)
    ground, mass = scene.add("ground", lib.Ground()), scene.add("mass", lib.Mass1D(mass=1.0))
    spring = scene.add("spring", lib.Spring(stiffness=25.0, natural_length=1.0))
    damper = scene.add("damper", lib.Damper(damping=damping))
    for one in (spring, damper):
        scene.connect(ground.frame, one.a)
        scene.connect(one.b, mass.flange)
    scene.start.update({"mass.displacement": 1.3, "mass.speed": 0.0})
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_damper_of_an_oscillator_takes_what_the_closed_form_says(form):
    c, k, x0 = 0.8, 25.0, 0.3
    result = simulate(on_a_spring(c), form=form, rtol=1e-10)
    parts, t = check_balance(result), result.time
    decay, w = 0.5 * c, math.sqrt(k - 0.25 * c * c)
    x = x0 * np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t))
    v = -x0 * np.exp(-decay * t) * k / w * np.sin(w * t)
    np.testing.assert_allclose(parts["damper"].dissipated, 0.5 * k * x0**2 - 0.5 * (k * x**2 + v**2), atol=1e-6)
    np.testing.assert_allclose(parts["damper"].work["b"], parts["damper"].dissipated, atol=1e-9)
    np.testing.assert_allclose(parts["spring"].total, 0.5 * k * x**2, atol=1e-6)
    assert parts["damper"].dissipated[-1] > 0.5


@pytest.mark.parametrize("form", FORMS)
def test_drive_puts_in_what_it_lifts(form):
    """A pivot that is moved along a line puts in force times way."""
    scene = Scene(gravity=0.0, t_end=2.0)
    ground, mass = scene.add("ground", lib.Ground()), scene.add("mass", lib.PointMass(mass=2.0))
    drive = scene.add("drive", lib.Drive(motion=lambda t: 0.3 * sin(2.0 * t)))
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, mass.point)
    result = simulate(scene, form=form, rtol=1e-10)
    parts = check_balance(result)
    speed = 0.6 * np.cos(2.0 * result.time)
    np.testing.assert_allclose(parts["drive"].constraints, speed**2 - speed[0] ** 2, atol=1e-6)
    np.testing.assert_allclose(parts["mass"].work["point"], speed**2 - speed[0] ** 2, atol=1e-6)


class Escalator(Component):
    """A point that must move the faster, the farther out it is: a constraint on velocities that does work."""

    rate: float = parameter(0.5, unit="1/s", doc="Speed by place.")
    point: Point = connector(Point, "What it carries.")

    @constraint(reaction="push", unit="N", doc="Force on the point.")
    def carried(self) -> Scalar:
        """Ask for a speed in proportion to the place."""
        return self.point.velocity.x - self.rate * self.point.position.x


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_constraint_that_feeds_energy_is_named(form):
    scene = Scene(gravity=0.0, t_end=2.0)
    bob, feeder = scene.add("bob", lib.PointMass(mass=2.0)), scene.add("feeder", Escalator())
    scene.connect(bob.point, feeder.point)
    scene.start.update({"bob.position.x": 1.0, "bob.position.z": 0.0, "bob.velocity.z": 0.0})
    result = simulate(scene, form=form)
    parts = check_balance(result)
    np.testing.assert_allclose(parts["feeder"].constraints, 0.25 * np.expm1(result.time), rtol=1e-5, atol=1e-7)
    assert "feeder: 1.6 J come by its constraints" in parts.describe()
    assert "bob:" not in parts.describe()


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_impact_takes_energy_at_the_rope_that_comes_taut(form):
    """The ball falls straight below its rope: the plastic impact takes all of its kinetic energy, ``m g h``."""
    scene = Scene(t_end=0.6)
    ground, rope = (
        scene.add("ground", lib.Ground()),
        scene.add("rope", lib.Rope(length=1.0, starts="slack", when_slack="slack")),
    )
    ball = scene.add("ball", lib.PointMass(mass=2.0))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, ball.point)
    scene.start.update(
        {"ball.position.x": 0.0, "ball.position.z": -0.2, "ball.velocity.x": 0.0, "ball.velocity.z": 0.0}
    )
    result = simulate(scene, form=form)
    assert len(result.events) == 1
    parts = check_balance(result)
    lost = 2.0 * 9.81 * 0.8
    assert parts["rope"].impacts[-1] == pytest.approx(-lost, rel=1e-6)
    assert parts["rope"].work["b"][-1] == pytest.approx(lost, rel=1e-6)
    assert parts["ball"].impacts[-1] == 0.0
    assert f"rope: {lost:.3g} J go by impacts" in parts.describe()


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_mass_that_is_dropped_takes_its_energy_along(form):
    """Half of the mass goes at 0.5 s: with half of the kinetic energy ``m v^2 / 2`` and of that of its weight."""
    scene = Scene(t_end=1.0)
    bucket = scene.add("bucket", LeakingBucket(mass=lambda t: select(t < 0.5, 2.0, 1.0)))
    probe = scene.add("probe", lib.PointMass(mass=0.0))
    scene.connect(bucket.point, probe.point)
    scene.start.update({"probe.position.x": 0.0, "probe.position.z": 0.0})
    scene.start.update({"probe.velocity.x": 3.0, "probe.velocity.z": 1.0})
    parts = check_balance(simulate(scene, form=form))
    velocity, height = 1.0 - 0.5 * 9.81, 0.5 - 0.125 * 9.81
    gone = 0.5 * (9.0 + velocity**2) + 9.81 * height
    np.testing.assert_allclose(parts["bucket"].supplied[-1], -gone, atol=1e-6)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_gear_passes_power_between_the_shafts_that_it_holds(form):
    scene = Scene(gravity=0.0, t_end=1.0)
    ground = scene.add("ground", lib.Ground())
    wheels = []
    for name, mass in (("small", 1.0), ("large", 4.0)):
        hinge = scene.add(f"{name}_hinge", lib.Pivot())
        wheel = scene.add(name, lib.RigidBody(mass=mass, moments=(1.0, 0.5 * mass, 1.0)))
        scene.connect(ground.frame, hinge.a)
        scene.connect(hinge.b, wheel.frame)
        wheels.append(hinge)
    gear = scene.add("gear", lib.Gear(ratio=2.0))
    scene.connect(gear.a, wheels[0].shaft)
    scene.connect(gear.b, wheels[1].shaft)
    torque = scene.add("motor", lib.RotationalSource(value=3.0))
    scene.connect(torque.b, wheels[0].shaft)
    scene.start["small_hinge.angle"] = 0.0
    scene.start["small_hinge.angular_velocity"] = 0.0
    parts = check_balance(simulate(scene, form=form))
    gained = parts["large"].kinetic
    assert gained[-1] > 0.1
    np.testing.assert_allclose(parts["gear"].work["b"], -gained, atol=1e-6)
    np.testing.assert_allclose(parts["gear"].work["a"], gained, atol=1e-6)
    np.testing.assert_allclose(parts["large_hinge"].work["shaft"], gained, atol=1e-6)
    np.testing.assert_allclose(parts["motor"].supplied, gained + parts["small"].kinetic, atol=1e-6)


def test_redundant_constraints_are_named_where_they_leave_work_open():
    parts = check_balance(simulate(RigidBodies(), t_end=0.5))
    assert parts.undetermined
    assert all(path.startswith("frame.") for path in parts.undetermined)
    assert not parts["frame.rod01"].is_unique
    assert parts["cuboid"].is_unique
    assert "is not unique" in parts.describe()


class Arm(Model):
    """A rod with a mass at its end."""

    hub: Point = connector(Point, "Where it hangs.")
    tip: Point = connector(Point, "Its end.")
    rod: lib.Rod = lib.Rod(mass=0.5)
    bob: lib.PointMass = lib.PointMass(mass=1.0)
    connections = [connect(hub, rod.a), connect(rod.b, bob.point), connect(rod.b, tip)]


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_models_are_sums_with_connectors_of_their_own(form):
    scene = Scene(t_end=1.0)
    ground, upper, lower = scene.add("ground", lib.Ground()), scene.add("upper", Arm()), scene.add("lower", Arm())
    scene.connect(ground.frame, upper.hub)
    scene.connect(upper.tip, lower.hub)
    scene.start.update({"upper.rod.angle": 1.0, "lower.rod.angle": 2.0})
    scene.start.update({"upper.rod.angular_velocity": 0.0, "lower.rod.angular_velocity": 0.0})
    parts = check_balance(simulate(scene, form=form))
    assert parts.models == ("upper", "lower")
    assert list(parts["upper"].work) == ["hub", "tip"]
    assert list(parts["lower"].work) == ["hub"]
    np.testing.assert_allclose(parts["upper"].kinetic, parts["upper.rod"].kinetic + parts["upper.bob"].kinetic)
    np.testing.assert_allclose(parts["upper"].work["tip"], -parts["lower"].work["hub"], atol=1e-9)
    np.testing.assert_allclose(parts["lower"].error, 0.0, atol=1e-4 * parts.exchanged)
    assert np.ptp(parts["lower"].work["hub"]) > 0.1


def test_order_and_names_of_parts_and_the_place_of_a_scene_change_nothing():
    def made(names: tuple[str, ...], shift: float) -> Scene:
        scene = Scene(t_end=1.0)
        parts = {
            "rod": lib.Rod(mass=0.3),
            "bob": lib.PointMass(mass=1.0),
            "ground": lib.Ground(position=(shift, 0.0, -shift)),
        }
        for name in names:
            scene.add(f"{name}{shift:g}", parts[name])
        rod, bob, ground = (getattr(scene, f"{name}{shift:g}") for name in ("rod", "bob", "ground"))
        scene.connect(ground.frame, rod.a)
        scene.connect(rod.b, bob.point)
        scene.start.update({f"rod{shift:g}.angle": 1.0, f"rod{shift:g}.angular_velocity": 0.5})
        return scene

    one = simulate(made(("ground", "rod", "bob"), 0.0), rtol=1e-10).energy.parts["bob0"]
    two = simulate(made(("bob", "ground", "rod"), 7.0), rtol=1e-10).energy.parts["bob7"]
    np.testing.assert_allclose(one.work["point"], two.work["point"], atol=1e-7)


@pytest.mark.parametrize("form", FORMS)
def test_energies_count_from_the_start_whichever_outputs_are_asked_for(form):
    """Few outputs, none of them at the start: work is integrated within the steps, and gains are since the start."""
    every, few = (simulate(DoublePendulum(), form=form, outputs=one) for one in (201, [1.1, 2.9]))
    parts = check_balance(few)
    for name, values in every.energy.parts["bob2"].table().items():
        if name != "error":
            expected = np.interp([1.1, 2.9], every.time, values)
            np.testing.assert_allclose(parts["bob2"].table()[name], expected, atol=0.05)


def test_nothing_is_worked_out_before_it_is_asked_for(monkeypatch):
    import atwood.result.part_work as made

    asked = []
    monkeypatch.setattr(made, "find_part_energies", lambda *given: asked.append(given))
    ledger = simulate(DoublePendulum(), t_end=0.1).energy
    assert not asked
    assert ledger.parts is None
    assert len(asked) == 1


def test_missing_components_are_refused_with_near_matches():
    parts = simulate(DoublePendulum(), t_end=0.1).energy.parts
    with pytest.raises(ResultError, match="bob3") as caught:
        parts["bob3"]
    assert "bob2" in str(caught.value)
    assert "bob3" not in parts
    assert "rod1" in parts


def test_files_and_pictures_hold_all_energies(tmp_path):
    parts = simulate(DoublePendulum(), t_end=0.5).energy.parts
    parts.save(tmp_path / "energies.csv")
    read = atwood.load_result(tmp_path / "energies.csv")
    np.testing.assert_array_equal(read["bob2.energy.work.point"], parts["bob2"].work["point"])
    assert read.unit("bob2.energy.kinetic") == "J"
    figure = parts.plot(tmp_path / "energies.png")
    labels = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert "bob2, kinetic" in labels
    assert (tmp_path / "energies.png").stat().st_size > 10_000
    plt.close("all")


def test_stack_is_as_high_as_what_came_in():
    result = simulate(on_a_spring(0.8))
    figure = atwood.plot_energies(result)
    stack = figure.axes[0]
    heights = [np.max(path.vertices[:, 1]) for c in stack.collections for path in c.get_paths()]
    np.testing.assert_allclose(max(heights), stack.lines[0].get_ydata()[0], rtol=1e-5)
    assert figure.axes[0].get_title(loc="left") == "Scene"


class Thruster(Component):
    """A part whose Rayleigh function has a sign of its own."""

    strength: float = parameter(-1.0, unit="N*s/m", doc="Force against the velocity, for each metre a second.")
    point: Point = connector(Point, "Where it acts.")

    @atwood.dissipation
    def drag(self) -> Scalar:
        """Return half the power that is taken away."""
        return 0.5 * self.strength * atwood.dot(self.point.velocity, self.point.velocity)


@pytest.mark.parametrize("form", FORMS)
def test_a_dissipation_that_drives_is_said(form: str) -> None:
    """It was accounted as dissipated energy below zero without a word."""
    for strength in (-1.0, 1.0):
        scene = Scene(gravity=0.0)
        mass, part = scene.add("mass", lib.PointMass()), scene.add("thruster", Thruster(strength=strength))
        scene.connect(part.point, mass.point)
        scene.start["mass.velocity.x"] = 1.0
        result = simulate(scene, form=form, t_end=1.0, rtol=1e-9)
        if strength > 0.0:
            assert result.energy.parts["thruster"].dissipated[-1] == pytest.approx(
                0.5 * (1.0 - math.exp(-2.0)), rel=1e-6
            )
        else:
            with pytest.warns(
                UserWarning, match=r"thruster: its Rayleigh function drives: from t = 0 on it puts in 3\.19 J"
            ):
                _ = result.energy.parts
