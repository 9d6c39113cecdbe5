"""What cannot hold is refused, and what is reported is what was asked for."""

import numpy as np
import pytest

from atwood import ConnectError, ParameterError, Scene, SolveError, StartError, TopologyError, select, simulate
from atwood_library import (
    Drive,
    Force,
    ForceSensor,
    Ground,
    Link,
    Mass1D,
    Pivot,
    PointMass,
    Rod,
    Rope,
    RotaryDrive,
    Slider,
    Spring,
)
from atwood_library.scenes import FourBar

FORMS = ("reduced", "dae")


@pytest.mark.parametrize("form", FORMS)
def test_a_rope_holds_nothing_up(form: str) -> None:
    scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0))
    ground, rope = scene.add("ground", Ground()), scene.add("rope", Rope(starts="slack", when_slack="slack"))
    mass = scene.add("m", PointMass())
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, mass.point)
    scene.start.update({"m.position.z": 0.5, "m.velocity.z": 10.0})
    result = simulate(scene, form=form, t_end=0.4, rtol=1e-10)
    arrives = (10.0 - np.sqrt(100.0 - 2.0 * 9.81 * 0.5)) / 9.81  # at z = 1, where it stops dead and falls
    assert result["m.position.z"][-1] == pytest.approx(1.0 - 0.5 * 9.81 * (0.4 - arrives) ** 2, abs=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_two_drives_that_part_ways_are_refused(form: str) -> None:
    scene = Scene()
    ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass())
    still = scene.add("still", Drive())
    late = scene.add("late", Drive(motion=lambda t: select(t > 2.0, (t - 2.0) ** 4, 0.0 * t)))
    for drive in (still, late):
        scene.connect(ground.frame, drive.a)
    scene.connect(still.b, mass.point)
    scene.connect(still.b, late.b)
    with pytest.raises((SolveError, StartError, TopologyError), match=r"cannot (all )?be satisfied|hold"):
        simulate(scene, form=form, t_end=5.0)


@pytest.mark.parametrize("form", FORMS)
def test_a_loop_with_two_drives_that_disagree_is_refused(form: str) -> None:
    scene = FourBar(crank_length=1.0, rocker_length=1.0, coupler_length=2.0, frame_length=2.0)
    scene.start.clear()
    scene.guess.update({"crank.angle": 1.0, "rocker.angle": 1.0, "coupler.angle": 0.0})
    scene.add("motor1", RotaryDrive(rotation=lambda t: 1.0 + t**3))
    scene.add("motor2", RotaryDrive(rotation=lambda t: 1.0 + t**4))
    scene.connect(scene["left"].frame, scene["motor1"].a)
    scene.connect(scene["motor1"].b, scene["crank"].a)
    scene.connect(scene["right"].frame, scene["motor2"].a)
    scene.connect(scene["motor2"].b, scene["rocker"].a)
    with pytest.raises((SolveError, StartError, TopologyError)):
        simulate(scene, form=form, t_end=1.0)


def test_frames_that_meet_through_a_point_only_are_refused() -> None:
    scene = Scene()
    ground, bob, link = scene.add("ground", Ground()), scene.add("bob", PointMass()), scene.add("link", Link())
    scene.connect(ground.frame, bob.point)
    scene.connect(bob.point, link.a)
    with pytest.raises(ConnectError, match="through a point only") as caught:
        simulate(scene, t_end=1.0)
    assert "Pivot" in caught.value.advice


@pytest.mark.parametrize("form", FORMS)
def test_directions_need_not_be_unit_vectors(form: str) -> None:
    scene = Scene()
    ground, rail, cart = scene.add("ground", Ground()), scene.add("rail", Slider(axis=(1, 0, 1))), PointMass(mass=2.0)
    scene.add("cart", cart)
    push = scene.add("push", Force(direction=(3.0, 0.0, 4.0), value=1.0))
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, cart.point)
    scene.connect(cart.point, push.point)
    scene.start["rail.displacement"] = 1.0
    result = simulate(scene, form=form, t_end=0.1)
    assert result["rail.displacement"][0] == pytest.approx(1.0)
    assert result["push.force"][0] == 1.0
    along = (0.6 + 0.8) / np.sqrt(2.0)
    assert result["cart.acceleration.x"][0] == pytest.approx((along - 2.0 * 9.81 / np.sqrt(2.0)) / 2.0 / np.sqrt(2.0))


def test_a_direction_that_means_nothing_is_refused() -> None:
    with pytest.raises(ParameterError, match="cannot be zero"):
        Slider(axis=(0.0, 0.0, 0.0))
    scene = Scene()
    ground, mass = scene.add("ground", Ground()), scene.add("mass", Mass1D(axis=(0.0, 1.0, 0.0)))
    spring = scene.add("spring", Spring())
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, mass.flange)
    with pytest.raises(ParameterError, match="out of the plane"):
        simulate(scene, t_end=1.0)


@pytest.mark.parametrize("form", FORMS)
def test_fast_turns_are_counted(form: str) -> None:
    scene = Scene(gravity=0.0)
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod()), scene.add("bob", PointMass())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.start.update({"rod.angle": 0.0, "rod.angular_velocity": 500.0})
    result = simulate(scene, form=form, t_end=5.0, outputs=3)
    assert result["rod.angle"][-1] == pytest.approx(2500.0, abs=1.0)


def test_what_parallel_rigid_connections_share_is_not_known() -> None:
    scene = Scene()
    ground, link = scene.add("ground", Ground()), scene.add("link", Link(mass=2.0))
    for name in ("one", "other"):
        sensor = scene.add(name, ForceSensor())
        scene.connect(ground.frame, sensor.a)
        scene.connect(sensor.b, link.a)
    result = simulate(scene, t_end=0.1)
    known = [not np.any(np.isnan(result[f"{name}.force.z"])) for name in ("one", "other")]
    assert not all(known)


def test_a_small_speed_that_is_impossible_is_not_lost_beside_a_large_one() -> None:
    scene = Scene()
    ground, rail, cart = scene.add("ground", Ground()), scene.add("rail", Slider()), scene.add("cart", PointMass())
    scene.add("fast", PointMass())
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, cart.point)
    scene.start.update({"fast.velocity.x": 1e7, "cart.velocity.z": 1e-3})
    with pytest.raises(StartError, match=r"cart\.velocity\.z"):
        simulate(scene, t_end=1.0)


@pytest.mark.parametrize("form", FORMS)
def test_a_rope_that_starts_beyond_its_length_is_refused(form: str) -> None:
    scene = Scene()
    ground, rope = scene.add("ground", Ground()), scene.add("rope", Rope(starts="slack", when_slack="slack"))
    mass = scene.add("m", PointMass())
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, mass.point)
    scene.start.update({"m.position.x": 0.0, "m.position.z": -2.0})
    with pytest.raises(StartError, match=r"rope: it starts inside, by 1\.5 m"):
        simulate(scene, form=form, t_end=1.0)


def test_what_the_ground_is_far_from_does_not_matter() -> None:
    answers = []
    for far in (None, 1e6):
        scene = Scene(gravity=0.0)
        ground, rail, mass = scene.add("ground", Ground()), scene.add("rail", Slider()), scene.add("m", PointMass())
        spring = scene.add("spring", Spring(stiffness=1.0))
        scene.connect(ground.frame, rail.a)
        scene.connect(rail.b, mass.point)
        scene.connect(ground.frame, spring.a)
        scene.connect(spring.b, mass.point)
        if far is not None:
            scene.add("far", Ground(position=(far, 0.0, 0.0)))
        scene.start["rail.displacement"] = 1e-3
        answers.append(simulate(scene, t_end=5.0)["m.position.x"][-1])
    assert answers[0] == answers[1] == pytest.approx(1e-3 * np.cos(5.0), abs=1e-9)


def test_a_pivot_keeps_frames_apart() -> None:
    scene = Scene()
    ground, pivot, link = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("link", Link())
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, link.a)
    assert len(simulate(scene, t_end=0.1).assembly.reduced.names) == 1


@pytest.mark.parametrize("solver", ["ida", "ida-sundae", "explicit"])
@pytest.mark.parametrize("width", [0.5, 0.01, 1e-4])
def test_a_pulse_in_time_is_not_passed_over(width: float, solver: str) -> None:
    scene = Scene(gravity=0.0)
    mass = scene.add("m", PointMass())
    push = scene.add("push", Force(value=lambda t: select((t > 5.0) & (t < 5.0 + width), 2.0, 0.0)))
    scene.connect(push.point, mass.point)
    result = simulate(scene, t_end=10.0, rtol=1e-9, solver=solver)
    assert result["m.velocity.x"][-1] == pytest.approx(2.0 * width, rel=1e-4)
    assert result["m.position.x"][-1] == pytest.approx(width**2 + 2.0 * width * (5.0 - width), rel=1e-4)
    assert len(result.time) == 201


def test_sides_on_a_line_follow_from_the_start_itself() -> None:
    scene = Scene(space="line")
    wall, spring = scene.add("wall", Ground(position=(3.0, 0.0, 0.0))), scene.add("spring", Spring(natural_length=1.0))
    mass = scene.add("m", Mass1D(origin=(5.0, 0.0, 0.0)))
    scene.connect(wall.frame, spring.a)
    scene.connect(spring.b, mass.flange)
    scene.start.update({"m.displacement": 0.5, "m.speed": 0.0})
    result = simulate(scene, t_end=1.0, rtol=1e-10)
    assert result["spring.length"][0] == pytest.approx(2.5)
    assert result["m.position.x"][-1] == pytest.approx(4.0 + 1.5 * np.cos(1.0), abs=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_a_rope_on_a_line_comes_taut_on_the_other_side_too(form: str) -> None:
    scene = Scene(space="line", gravity=0.0)
    ground, rope = scene.add("ground", Ground()), scene.add("rope", Rope(starts="slack", when_slack="slack"))
    mass = scene.add("m", PointMass())
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, mass.point)
    scene.start.update({"m.position.x": -0.5, "m.velocity.x": 10.0})
    result = simulate(scene, form=form, t_end=0.3)
    assert [one.law for one in result.events][:1] == ["comes_taut"]
    assert result.events[0].time == pytest.approx(0.15, abs=1e-6)
    assert np.max(np.abs(result["m.position.x"])) < 1.0 + 1e-6
