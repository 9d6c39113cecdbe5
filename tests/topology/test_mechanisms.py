"""What can be made of parts, and what cannot: merged, redundant, singular and broken mechanisms."""

import math

import numpy as np
import pytest

from atwood import AtwoodError, Component, Model, Scene, connect, parameter
from atwood.errors import ConnectError, StartError, TopologyError
from atwood.pipeline import assemble, simulate
from atwood_library import (
    EnergySensor,
    Ground,
    Link,
    Pivot,
    PointMass,
    Pulley,
    Rod,
    RotaryDrive,
    Slider,
    Spring,
    Torque,
    Weld,
)

from ..helpers.mechanisms import parallel_four_bar, pendulum
from ..helpers.runs import FORMS, assert_agree, prepare, run_both


def two_grounds(kind: str) -> Scene:
    scene = Scene()
    one, two = scene.add("one", Ground()), scene.add("two", Ground(position=(1.0, 0.0, 0.0)))
    scene.add("mass", PointMass())
    if kind == "directly":
        scene.connect(one.frame, two.frame)
        return scene
    between = scene.add("between", Weld(displacement=(2.0, 0.0, 0.0)) if kind == "weld" else Rod(length=2.0))
    scene.connect(one.frame, between.a)
    scene.connect(between.b, two.frame)
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("kind", "where"), [("directly", "two"), ("weld", "between"), ("rod", "between")])
def test_two_grounds_that_fight(kind: str, where: str, form: str) -> None:
    with pytest.raises(TopologyError, match=r"(?i)fixed parts contradict each other") as caught:
        simulate(two_grounds(kind), form=form)
    assert caught.value.where.startswith(where)
    assert caught.value.advice


@pytest.mark.parametrize("form", FORMS)
def test_a_rod_that_fits_between_two_grounds_does_no_harm(form: str) -> None:
    scene = two_grounds("rod")
    scene["between"].length = 1.0
    assert simulate(scene, form=form, rtol=1e-6, t_end=1.0).array("mass.position.z")[-1] == pytest.approx(-4.905)


def test_a_connector_joined_to_itself() -> None:
    scene = Scene()
    ground = scene.add("ground", Ground())
    with pytest.raises(ConnectError, match="itself"):
        scene.connect(ground.frame, ground.frame)


@pytest.mark.parametrize("make", [Weld, Pivot, Slider, Rod, Link])
def test_a_part_whose_ends_are_joined_to_each_other(make: type) -> None:
    scene = pendulum()
    part = scene.add("part", make())
    scene.connect(part.a, part.b)
    with pytest.raises(ConnectError, match="joined to each other") as caught:
        assemble(scene)
    assert caught.value.where == "part"


def weld_loop(reach: float) -> Scene:
    scene = Scene(t_end=0.5)
    ground, pivot = scene.add("ground", Ground()), scene.add("pivot", Pivot())
    link, weld = scene.add("link", Link(length=1.0)), scene.add("weld", Weld(displacement=(reach, 0.0, 0.0)))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, link.a)
    scene.connect(weld.a, link.a)
    scene.connect(weld.b, link.b)
    scene.start.update({"link.angle": 0.0, "link.angular_velocity": 0.0})
    return scene


def test_weld_loops_fit_or_are_refused() -> None:
    reduced, dae = run_both(lambda: weld_loop(1.0), rtol=1e-10, outputs=5)
    assert_agree(reduced, dae, 1e-6)
    assert np.all(np.isnan(reduced.array("weld.torque")))  # the link shares the load, and nobody knows how
    with pytest.raises(TopologyError, match="do not fit together") as caught:
        assemble(weld_loop(1.5))
    assert caught.value.where.startswith("weld")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", [Spring, Pivot, Slider, Weld, Pulley, Rod, PointMass])
def test_a_part_in_no_connection_that_has_no_mass(kind: type[Component], form: str) -> None:
    scene = pendulum()
    scene.add("stray", kind(mass=0.0) if kind is PointMass else kind())
    scene.start["rod.angle"] = 0.3
    with pytest.raises(AtwoodError, match="without bound") as caught:
        simulate(scene, form=form)
    assert caught.value.where.startswith("stray")
    assert caught.value.advice


@pytest.mark.parametrize("form", FORMS)
def test_a_part_in_no_connection_that_has_mass_falls(form: str) -> None:
    scene = pendulum()
    scene.add("stone", PointMass())
    scene.add("stick", Link())
    scene.add("sensor", EnergySensor())
    scene.start.update({"rod.angle": 0.3, "stone.velocity.x": 2.0, "stick.angular_velocity": 3.0})
    result = simulate(scene, form=form, rtol=1e-8, t_end=1.0)
    assert result.array("stone.position.z")[-1] == pytest.approx(-4.905)
    assert result.array("stone.position.x")[-1] == pytest.approx(2.0)
    assert result.array("stick.angle")[-1] == pytest.approx(3.0)
    assert np.ptp(result.array("sensor.total")) < 1e-5


@pytest.mark.parametrize("form", FORMS)
def test_massless_parts_that_a_force_would_accelerate(form: str) -> None:
    hanging = Scene()
    ground, rod = hanging.add("ground", Ground()), hanging.add("rod", Rod())
    hanging.connect(ground.frame, rod.a)
    with pytest.raises(StartError, match="without inertia") as caught:
        simulate(hanging, form=form)
    assert caught.value.where == "rod" if form == "reduced" else caught.value.where
    turned = pendulum()
    torque = turned.add("torque", Torque(value=1.0))
    turned.connect(torque.frame, turned["bob"].point)
    with pytest.raises(StartError, match=r"without inertia.*bob\.angle"):
        simulate(turned, form=form)


def floating() -> Scene:
    scene = Scene(gravity=0.0, t_end=1.0)
    one, pivot, two = (
        scene.add("one", Link(mass=1.0)),
        scene.add("pivot", Pivot()),
        scene.add("two", Link(length=2.0, mass=2.0)),
    )
    scene.connect(one.b, pivot.a)
    scene.connect(pivot.b, two.a)
    scene.start.update({"one.angle": 0.2, "two.angle": 1.0, "one.angular_velocity": 1.0, "two.angular_velocity": -0.5})
    scene.start.update({"one.position.x": 0.0, "one.position.z": 0.0, "one.velocity.x": 0.3, "one.velocity.z": 0.0})
    return scene


def test_a_mechanism_without_ground_floats() -> None:
    reduced, dae = run_both(floating, rtol=1e-11, outputs=11)
    assert len(reduced.assembly.reduced.coordinates) == 4
    assert_agree(reduced, dae, 1e-7)
    for axis in "xz":
        momentum = reduced.array(f"one.velocity.{axis}") + 2.0 * reduced.array(f"two.velocity.{axis}")
        assert np.ptp(momentum) < 1e-8


def freedom(scene: Scene, form: str) -> tuple[int, int]:
    """Return degrees of freedom, and the number of redundant constraints."""
    prepared = prepare(scene, form)
    finding = prepared.plan.finding
    return len(prepared.q) - finding.rank, len(finding.redundant)


def test_a_third_parallel_crank_is_redundant() -> None:
    for form in FORMS:
        assert freedom(parallel_four_bar(2), form) == (1, 0)
        assert freedom(parallel_four_bar(3), form) == (1, 1)
    prepared = prepare(parallel_four_bar(3), "dae")
    redundant = [prepared.assembly.maximal.constraints[i].key[0] for i in prepared.plan.finding.redundant]
    assert redundant in (["high1"], ["high2"], ["low1"], ["low2"])
    reduced, dae = run_both(lambda: parallel_four_bar(3), rtol=1e-10, outputs=11)
    assert_agree(reduced, dae, 1e-6)
    # the motion is that of two cranks with the third one's mass: one degree of freedom, by energy
    # T = (3 * 0.3/3 + 1) w^2/2, V = (3 * 0.3/2 + 1) g sin(angle)
    angle, rate = reduced.array("crank0.angle"), reduced.array("crank0.angular_velocity")
    energy = 0.5 * 1.3 * rate**2 + 1.45 * 9.81 * np.sin(angle)
    assert np.max(np.abs(energy - energy[0])) < 1e-7
    # reactions are those of least size: the three cranks share alike along themselves
    for axis in "xz":
        forces = [reduced.array(f"high{i}.force.{axis}") for i in range(3)]
        # whatever the shares, together they carry the coupler
        inertia = np.gradient(reduced.array(f"coupler.velocity.{axis}"), reduced.time, edge_order=2)
        carried = sum(forces) - (9.81 if axis == "z" else 0.0)
        assert np.max(np.abs(carried - inertia)[2:-2]) < 0.2


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("cranks", [2, 3])
def test_a_singular_start_is_refused_by_name(form: str, cranks: int) -> None:
    with pytest.raises(StartError, match="singular position") as caught:
        simulate(parallel_four_bar(cranks, angle=0.0), form=form)
    assert "coincidence" in str(caught.value)
    assert "Start at a small distance" in caught.value.advice


def test_near_a_singular_position_the_freedom_stays_one() -> None:
    for form in FORMS:
        assert freedom(parallel_four_bar(2, angle=1e-3), form) == (1, 0)


def test_passing_near_a_singular_position() -> None:
    # swings through the lined-up position; between samples, the solver sees it only from both sides
    results = run_both(lambda: parallel_four_bar(2, angle=0.5, rate=-6.0), rtol=1e-9, t_end=0.15, outputs=7)
    assert results[0].array("crank0.angle")[-1] < -0.3
    assert_agree(*results, 1e-4)


def test_two_parallel_sliders_are_redundant() -> None:
    def make() -> Scene:
        scene = Scene(t_end=1.0)
        ground, link = scene.add("ground", Ground()), scene.add("link", Link(mass=1.0))
        low, high = scene.add("low", Slider()), scene.add("high", Slider())
        up, down = (
            scene.add("up", Weld(displacement=(0.0, 0.0, 0.5))),
            scene.add("down", Weld(displacement=(0.0, 0.0, 0.5))),
        )
        scene.connect(ground.frame, low.a)
        scene.connect(low.b, link.a)
        scene.connect(ground.frame, up.a)
        scene.connect(up.b, high.a)
        scene.connect(link.a, down.a)
        scene.connect(down.b, high.b)
        scene.start.update({"low.displacement": 0.0, "low.speed": 1.0})
        return scene

    for form in FORMS:
        assert freedom(make(), form)[0] == 1
    results = run_both(make, rtol=1e-8, outputs=5)
    assert_agree(*results, 1e-7)
    for result in results:
        assert result.array("low.displacement")[-1] == pytest.approx(1.0)
        assert np.allclose(result.array("low.side_force") + result.array("high.side_force"), 9.81)
        assert np.allclose(result.array("low.side_force"), result.array("high.side_force"))  # least size: shared


def scotch_yoke() -> Scene:
    scene = Scene(t_end=0.8)
    ground, pivot = scene.add("ground", Ground()), scene.add("pivot", Pivot())
    crank, pin = scene.add("crank", Link(length=0.5, mass=1.0)), scene.add("pin", Pivot())
    slot, rail = scene.add("slot", Slider(axis=(0.0, 0.0, 1.0))), scene.add("rail", Slider())
    yoke = scene.add("yoke", Link(length=1.0, mass=2.0))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, crank.a)
    scene.connect(crank.b, pin.a)
    scene.connect(pin.b, slot.b)
    scene.connect(slot.a, yoke.a)
    scene.connect(rail.b, yoke.a)
    scene.connect(ground.frame, rail.a)
    scene.start.update({"crank.angle": 0.3, "crank.angular_velocity": 4.0})
    return scene


def test_a_loop_with_two_sliders() -> None:
    for form in FORMS:
        assert freedom(scotch_yoke(), form) == (1, 0)
    reduced, dae = run_both(scotch_yoke, rtol=1e-11, outputs=9)
    assert_agree(reduced, dae, 1e-6)
    angle, rate = reduced.array("crank.angle"), reduced.array("crank.angular_velocity")
    assert np.max(np.abs(reduced.array("rail.displacement") - 0.5 * np.cos(angle))) < 1e-12
    # T = 1/2 (m l^2/3) w^2 + 1/2 M (l sin w)^2, V = m g l/2 sin
    energy = 0.5 * (0.25 / 3.0) * rate**2 + (0.5 * np.sin(angle) * rate) ** 2 + 9.81 * 0.25 * np.sin(angle)
    assert np.max(np.abs(energy - energy[0])) < 1e-8


class Arm(Model):
    """A pendulum as a part."""

    reach: float = parameter(1.0, unit="m", above=0.0, doc="Length.")
    rod: Rod = Rod(length=reach)
    bob: PointMass = PointMass()
    connections = [connect(rod.b, bob.point)]


def test_nested_models_are_the_same_mechanism() -> None:
    scene = Scene(t_end=1.0)
    ground, one, two = scene.add("ground", Ground()), scene.add("one", Arm()), scene.add("two", Arm(reach=2.0))
    scene.connect(ground.frame, one["rod"].a)
    scene.connect(one["bob"].point, two["rod"].a)
    scene.start.update({"one.rod.angle": 0.3, "two.rod.angle": 0.2})
    assembly = assemble(scene)
    assert [one.name for one in assembly.reduced.names] == ["one.rod.angle", "two.rod.angle"]
    assert_agree(*run_both(lambda: scene, rtol=1e-10, outputs=5), 1e-6)


def test_graph_and_bodies_of_the_parallel_four_bar() -> None:
    mechanism = assemble(parallel_four_bar(3)).mechanism
    names = {body.name for body in mechanism.bodies.bodies}
    assert names == {"world", "crank0", "crank1", "crank2", "coupler"}
    assert assemble(parallel_four_bar(3)).reduced.forest.loops == 2
    assert mechanism.graph.network.number_of_edges() == len(mechanism.graph.joints)


def test_a_failed_scene_can_be_mended() -> None:
    scene = two_grounds("rod")
    with pytest.raises(TopologyError):
        simulate(scene)
    scene["two"].position = (2.0, 0.0, 0.0)
    assert assemble(scene).reduced.coordinates
    assert math.isfinite(simulate(scene, t_end=0.1, outputs=2).array("mass.position.z")[-1])


def truss(reach: float, rods: int = 2) -> Scene:
    scene = Scene(t_end=0.5)
    mass = scene.add("mass", PointMass(mass=2.0))
    for i in range(rods):
        ground = scene.add(f"ground{i}", Ground(position=(i * 1.0, 0.0, 0.0)))
        length = reach if i < 2 else math.hypot(1.5, math.sqrt(0.75))
        rod = scene.add(f"rod{i}", Rod(length=length))
        scene.connect(ground.frame, rod.a)
        scene.connect(rod.b, mass.point)
    scene.guess.update({"mass.position.x": 0.5, "mass.position.z": -0.8 if reach > 0.5 else 0.0})
    return scene


@pytest.mark.parametrize("rods", [2, 3])
def test_a_truss_cannot_move_and_carries_its_load(rods: int) -> None:
    with pytest.raises(TopologyError, match="nothing can move"):
        simulate(truss(1.0, rods))
    results = run_both(lambda: truss(1.0, rods), outputs=3, structure=True)
    assert_agree(*results, 1e-9)
    for form in FORMS:
        assert freedom(truss(1.0, rods), form) == (0, rods - 2)
    end = results[0].at(-1)
    assert sum(end[f"ground{i}.force.z"] for i in range(rods)) == pytest.approx(2.0 * 9.81)
    if rods == 2:
        assert end["rod0.tension"] == pytest.approx(9.81 / math.sqrt(0.75))


def test_a_truss_in_line_is_a_singular_position() -> None:
    # it closes, its constraints lose rank, and still it cannot move: no freedom is made of that
    with pytest.raises(StartError, match="singular position"):
        simulate(truss(0.5), form="dae")


def test_a_motor_beside_a_pivot_is_redundant() -> None:
    def make() -> Scene:
        scene = Scene(t_end=1.0)
        ground, pivot, link = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("link", Link())
        motor = scene.add("motor", RotaryDrive(rotation=lambda t: t))
        for joint in (pivot, motor):
            scene.connect(ground.frame, joint.a)
            scene.connect(joint.b, link.a)
        return scene

    reduced, dae = run_both(make, outputs=5)
    assert_agree(reduced, dae, 1e-8)
    assert np.allclose(reduced.array("motor.torque"), 0.5 * 9.81 * np.cos(reduced.time))
    assert np.allclose(reduced.array("motor.force.z"), reduced.array("pivot.force.z"))
    scene = make()
    other = scene.add("other", RotaryDrive(rotation=lambda t: 2.0 * t))
    scene.connect(scene["ground"].frame, other.a)
    scene.connect(other.b, scene["link"].a)
    with pytest.raises(TopologyError, match="cannot be satisfied"):
        simulate(scene)
