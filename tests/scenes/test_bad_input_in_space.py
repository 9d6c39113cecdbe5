"""Scenes in space that cannot be: each is one clear error with its path, or is said to be what it is."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from atwood import Component, Scene, sin
from atwood.errors import AtwoodError, ParameterError, SolveError, StartError, TopologyError
from atwood.pipeline import assemble, simulate
from atwood.reporting import report
from atwood.simulation.initialization.mobility import Immobile
from atwood_library import (
    Bar,
    Cylindrical,
    Drive,
    Force,
    Ground,
    Pivot,
    PointMass,
    RigidBody,
    Rod,
    RollingSphere,
    Slider,
    Sphere,
    Spherical,
    Spring,
    Torque,
    Universal,
    Weld,
)
from atwood_library.scenes import Bricard, SphericalPendulum

FORMS = ("reduced", "dae")


def lone(start: Mapping[str, float] | None = None, **settings: Any) -> Scene:
    """Return a body that floats."""
    scene = Scene(space="space", gravity=0.0)
    scene.add("body", RigidBody(**{"mass": 1.0, "moments": (1.0, 1.0, 1.0), **settings}))
    scene.start.update(start or {})
    return scene


def hung(joint: Component, start: Mapping[str, float] | None = None) -> Scene:
    """Return a body that hangs on a joint."""
    scene = lone(start)
    ground = scene.add("ground", Ground())
    scene.add("joint", joint)
    scene.connect(ground.frame, joint.a)
    scene.connect(joint.b, scene["body"].frame)
    return scene


def refused(scene: Scene, form: str = "reduced") -> AtwoodError:
    with pytest.raises(AtwoodError) as caught:
        simulate(scene, form=form, t_end=0.01, outputs=2)
    assert caught.value.advice
    return caught.value


# -- inertia --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"moments": (1.0, 1.0, 3.0)}, "the largest, 3, is greater than the sum of the other two"),
        ({"products": (2.0, 0.0, 0.0)}, "negative principal moment"),
        ({"moments": (1.0, 1.0, 1.0), "products": (0.9, 0.9, -0.9)}, "no body|negative principal"),
    ],
)
@pytest.mark.parametrize("form", FORMS)
def test_an_inertia_that_no_body_can_have(settings: dict[str, Any], text: str, form: str) -> None:
    with pytest.raises(ParameterError, match=text) as caught:
        simulate(lone(**settings), form=form)
    assert caught.value.where == "body"


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("joint", [Spherical, Pivot])
def test_a_frame_without_mass_that_a_spring_pulls(form: str, joint: type[Component]) -> None:
    scene = Scene(space="space")
    ground, top = scene.add("ground", Ground()), scene.add("top", Ground(position=(0.0, 0.0, 2.0)))
    held, arm = scene.add("held", joint()), scene.add("arm", Weld(displacement=(1.0, 0.0, 0.0)))
    spring = scene.add("spring", Spring(stiffness=1.0, natural_length=0.5))
    scene.connect(ground.frame, held.a)
    scene.connect(held.b, arm.a)
    scene.connect(arm.b, spring.a)
    scene.connect(spring.b, top.frame)
    error = refused(scene, form)
    assert "without inertia" in error.message
    assert error.where in ("held", "held.b")
    assert "as spring would" in error.message


@pytest.mark.parametrize("form", FORMS)
def test_a_frame_without_mass_that_is_pushed(form: str) -> None:
    scene = Scene(space="space")
    arm, push = scene.add("arm", Weld(displacement=(1.0, 0.0, 0.0))), scene.add("push", Force())
    scene.connect(arm.b, push.point)
    error = refused(scene, form)
    assert isinstance(error, TopologyError)
    assert error.where == "arm.a"
    assert "no mass" in error.message


@pytest.mark.parametrize("form", FORMS)
def test_a_point_mass_that_is_turned(form: str) -> None:
    scene = lone(moments=(0.0, 0.0, 0.0))
    torque = scene.add("torque", Torque(value=1.0))
    scene.connect(torque.frame, scene["body"].frame)
    error = refused(scene, form)
    assert error.where == "body"
    assert "without inertia" in error.message


# -- joints ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [Pivot, Slider, Cylindrical])
@pytest.mark.parametrize("axis", [(0.0, 0.0, 0.0), (math.nan, 0.0, 0.0)])
def test_an_axis_without_length(kind: type[Component], axis: tuple[float, float, float]) -> None:
    with pytest.raises(ParameterError, match=r"cannot be zero|not a finite number") as caught:
        kind(axis=axis)
    assert caught.value.where.endswith(".axis")


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (1.0, 1.0, 0.0)])
@pytest.mark.parametrize("form", FORMS)
def test_axes_of_a_universal_joint_are_square(axis: tuple[float, float, float], form: str) -> None:
    error = refused(hung(Universal(axis_a=(1.0, 0.0, 0.0), axis_b=axis)), form)
    assert error.where == "joint.axis_b"
    assert ("parallel" in error.message) == (axis[1] == 0.0)
    simulate(hung(Universal(axis_a=(1.0, 1.0, 0.0), axis_b=(-1.0, 1.0, 0.0))), form=form, t_end=0.01, outputs=2)


def crossed(start: Mapping[str, float] | None = None) -> Scene:
    """Return a body on two hinges whose axes cross."""
    scene = hung(Pivot(axis=(1.0, 0.0, 0.0)), start)
    other = scene.add("other", Pivot(axis=(0.0, 0.0, 1.0)))
    scene.connect(scene["ground"].frame, other.a)
    scene.connect(other.b, scene["body"].frame)
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_joints_that_let_nothing_move_are_named(form: str) -> None:
    spare = r"joint\.bearing: nothing can move.*4 of their constraints to spare"
    with pytest.raises(TopologyError, match=spare) as caught:
        simulate(crossed(), form=form, t_end=0.01, outputs=2)
    assert caught.value.where == "joint.bearing"
    assert "structure=True" in caught.value.advice
    result = simulate(crossed(), form=form, t_end=0.01, outputs=2, structure=True)
    assert result.immobile is not None
    assert result.immobile.surplus == 4
    assert dict(result.immobile.freed) == {"joint.bearing": 1, "other.bearing": 1}
    assert "nothing can move" in str(report(crossed()))
    assert report(crossed()).to_dict()["immobile"]["freed"][0]["degrees_of_freedom"] == 1
    assert refused(crossed({"joint.angle": 1.0}), form).message.endswith("other stays open by 57.3 deg at least")
    error = refused(crossed({"body.angular_velocity.x": 1.0}), form)
    assert error.where == "body.angular_velocity.x"
    assert "Nothing in the mechanism can move" in error.advice


def tripod(rods: int, space: str = "space") -> Scene:
    """Return a mass on rods of equal length."""
    scene = Scene(space=space)
    mass = scene.add("mass", PointMass(mass=3.0))
    for i in range(rods):
        angle = 2.0 * math.pi * i / rods
        y = math.sin(angle) if space == "space" else 0.0
        ground = scene.add(f"ground{i}", Ground(position=(math.cos(angle), y, 0.0)))
        rod = scene.add(f"rod{i}", Rod(length=math.sqrt(2.0)))
        scene.connect(ground.frame, rod.a)
        scene.connect(rod.b, mass.point)
    scene.guess.update({"mass.position.x": 0.1, "mass.position.z": -0.8})
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("rods", "space"), [(3, "space"), (4, "space"), (2, "plane")])
def test_a_structure_carries_its_load_and_says_that_it_is_one(form: str, rods: int, space: str) -> None:
    result = simulate(tripod(rods, space), form=form, t_end=0.01, outputs=2, structure=True)
    assert result.immobile is not None
    assert result.immobile.surplus == (1 if rods == 4 else 0)
    assert result.immobile.freed == (() if rods == 4 else tuple((f"rod{i}", 1) for i in range(rods)))
    tension = 3.0 * 9.81 * math.sqrt(2.0) / rods  # each carries its share at 45 degrees
    for i in range(rods):
        assert result.array(f"rod{i}.tension")[0] == pytest.approx(tension, rel=1e-9)


@pytest.mark.parametrize("size", [1e-9, 1e9])
@pytest.mark.parametrize("form", FORMS)
def test_slender_bars_on_hinges_have_inertia_at_any_size(size: float, form: str) -> None:
    """What a hinge holds does not turn, however long the bar is beside a radian."""
    scene = Scene(space="space", gravity=9.81 * size)
    ground, hinge = scene.add("ground", Ground()), scene.add("hinge", Pivot())
    bar = scene.add("bar", Bar(length=size, axis="x"))
    scene.connect(ground.frame, hinge.a)
    scene.connect(hinge.b, bar.a)
    made = simulate(scene, form=form, t_end=0.1, outputs=2)
    assert made["hinge.angle"][-1] == pytest.approx(-0.5 * 1.5 * 9.81 * 0.1**2, rel=1e-3)


def test_what_was_not_tried_is_not_claimed() -> None:
    assert "it is not tried what would happen" in Immobile(None, 0).describe()
    assert Immobile(None, 0).to_dict() == {"freed": None, "surplus": 0}
    assert "it takes more than one of them" in Immobile((), 1).describe()


def test_nothing_rolls_on_a_line() -> None:
    scene = Scene(space="line")
    ground, contact = scene.add("ground", Ground()), scene.add("contact", RollingSphere())
    ball = scene.add("ball", Sphere())
    scene.connect(ground.frame, contact.a)
    scene.connect(contact.b, ball.frame)
    with pytest.raises(AtwoodError, match="contact: RollingSphere exists in a plane and in space only"):
        assemble(scene)


def test_a_cone_that_is_no_stop() -> None:
    with pytest.raises(AtwoodError, match="bend_stop"):
        Spherical(bend_stop=math.pi)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"bend_stop": 0.3}, "ball: its stops are neither elastic nor rigid"),
        (
            {"bend_stop": 0.3, "stop_restitution": 0.0, "stop_stiffness": 10.0},
            "ball: its stops cannot be elastic and rigid",
        ),
        ({"stop_restitution": 0.0}, "ball: its rigid stops are nowhere"),
    ],
)
def test_stops_that_hold_nothing(values: dict[str, float], text: str) -> None:
    scene = Scene(space="space")
    ground, ball, body = scene.add("ground", Ground()), scene.add("ball", Spherical(**values)), Sphere()
    scene.add("body", body)
    scene.connect(ground.frame, ball.a)
    scene.connect(ball.b, body.frame)
    with pytest.raises(AtwoodError, match=text):
        assemble(scene)


def test_what_moves_is_not_called_immobile() -> None:
    scene = SphericalPendulum()
    assert report(scene).immobile is None
    assert simulate(scene, t_end=0.01, outputs=2).immobile is None


@pytest.mark.sample(0)
def test_a_bent_bricard_is_a_structure() -> None:
    scene = Bricard()
    scene.set("end3.displacement", (0.0, -1.0, 0.1))
    with pytest.raises(TopologyError, match="nothing can move"):
        simulate(scene, t_end=0.01, outputs=2)
    result = simulate(scene, t_end=0.01, outputs=2, structure=True)
    assert result.immobile is not None
    assert len(result.immobile.freed) == 12
    assert np.ptp(result.array("hinge1.angle")) < 1e-9


# -- starts ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("start", "where", "text"),
    [
        ({"body.x_axis.x": 1.0, "body.x_axis.y": 1.0}, "body.x_axis.x", "nearest there is has body.x_axis.x = 0.7071"),
        ({f"body.x_axis.{c}": 0.0 for c in "xyz"}, "body.x_axis.x", "cannot all hold"),
        ({"body.theta": 0.5, "body.z_axis.z": 0.1}, "body.z_axis.z", "theta = 0.5 makes it 0.877583"),
        ({"body.quaternion.w": 0.0}, "body.quaternion.w", "no such quantity"),
    ],
)
def test_orientations_and_places_that_mean_nothing(start: dict[str, float], where: str, text: str, form: str) -> None:
    error = refused(lone(start), form)
    assert isinstance(error, StartError)
    assert error.where == where
    assert text in error.message


@pytest.mark.parametrize(("path", "value"), [("body.theta", math.nan), ("body.x_axis.x", math.inf)])
def test_orientations_are_finite(path: str, value: float) -> None:
    with pytest.raises(StartError, match="not a finite number") as caught:
        lone({path: value})
    assert caught.value.where == path


@pytest.mark.parametrize("form", FORMS)
def test_velocities_that_joints_do_not_let_through(form: str) -> None:
    error = refused(hung(Pivot(axis=(0.0, 0.0, 1.0)), {"body.angular_velocity.x": 1.0}), form)
    assert error.where == "body.angular_velocity.x"
    assert "1 free coordinate" in error.advice
    scene = SphericalPendulum()
    scene.start.update({"bob.velocity.x": 1.0, "bob.velocity.y": 2.0, "bob.velocity.z": 3.0})
    error = refused(scene, form)
    assert error.where.startswith("bob.velocity")
    assert "2 free coordinates" in error.advice


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_drive_of_what_a_ball_joint_holds(form: str) -> None:
    # Not even the start can be projected: its places fit, its speeds do not.
    scene = Scene(space="space")
    ground, body = scene.add("ground", Ground()), scene.add("body", RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
    drive, ball = scene.add("drive", Drive(motion=lambda t: 0.3 * sin(2.0 * t))), scene.add("ball", Spherical())
    for joint in (drive, ball):
        scene.connect(ground.frame, joint.a)
        scene.connect(joint.b, body.frame)
    with pytest.raises((SolveError, TopologyError), match=r"cannot (all )?be satisfied"):
        simulate(scene, t_end=0.25, form=form)


@pytest.mark.parametrize("form", FORMS)
def test_a_rod_that_would_be_torn(form: str) -> None:
    scene = Scene(space="space", gravity=0.0)
    one, two = scene.add("one", PointMass()), scene.add("two", PointMass())
    rod = scene.add("rod", Rod(length=2.0))
    scene.connect(one.point, rod.a)
    scene.connect(rod.b, two.point)
    scene.start.update({f"one.position.{c}": 0.0 for c in "xyz"})
    scene.start["two.position.x"] = 2.0
    scene.start.update({"one.velocity.x": 1.0, "two.velocity.x": -1.0})
    error = refused(scene, form)
    assert "one.velocity.x = 1, two.velocity.x = -1 cannot all hold" in error.message


def test_fixed_values_of_both_ends_of_a_joint() -> None:
    error = refused(hung(Pivot(axis=(0.0, 0.0, 1.0)), {"joint.angle": 0.3, "body.x_axis.x": 0.0}))
    assert "joint.angle = 0.3" in error.message
    assert "body.x_axis.x = 0" in error.message


def test_rods_without_a_guess_find_a_place() -> None:
    # both ends begin at the same point, where the rod has no direction
    scene = Scene(space="space", gravity=0.0)
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod()), scene.add("bob", PointMass())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    result = simulate(scene, t_end=0.01, outputs=2)
    place = [float(result.array(f"bob.position.{c}")[0]) for c in "xyz"]
    assert math.hypot(*place) == pytest.approx(1.0, rel=1e-12)
    assert assemble(scene).reduced.constraints


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("joint.rate", "joint can start with angle, angular_velocity."),
        ("joint", "joint can start with angle, angular_velocity."),
        ("joint.angl", "Did you mean 'joint.angle'?"),
        ("joit.angle", "Did you mean 'joint.angle' or 'joint.angular_velocity'?"),
        ("body.position", "It is a vector: give body.position.x and body.position.y and body.position.z"),
        ("body.quaternion.w", "body can start with position.x/y/z, velocity.x/y/z"),
    ],
)
def test_a_start_of_nothing_names_what_the_part_can_start_with(path, expected):
    with pytest.raises(StartError) as caught:
        simulate(hung(Pivot(), {path: 1.0}), t_end=0.1)
    assert caught.value.where == path
    assert expected in str(caught.value)
    assert "force" not in str(caught.value)


def test_a_vector_as_a_start_is_refused_with_its_components():
    with pytest.raises(StartError, match=r"Give its components, body\.position\.x and so on"):
        lone({"body.position": (0.0, 0.0, 1.0)})


@pytest.mark.parametrize(
    ("word", "axis"), [("z", (0.0, 0.0, 1.0)), ("-x", (-1.0, 0.0, 0.0)), (" +y ", (0.0, 1.0, 0.0))]
)
def test_a_direction_may_be_an_axis(word, axis):
    assert Pivot(axis=word).axis == axis


@pytest.mark.parametrize("axis", ["w", "xy", "--x", "", (0, 1)])
def test_a_direction_that_is_none_is_refused(axis):
    with pytest.raises(ParameterError, match=r"not 3 numbers.*or one of x, y, z"):
        Pivot(axis=axis)


def test_words_are_directions_only():
    with pytest.raises(ParameterError, match="not 3 numbers"):
        Weld(displacement="x")


@pytest.mark.parametrize("form", FORMS)
def test_a_contradiction_is_told_in_the_angles_that_were_given(form: str) -> None:
    error = refused(hung(Pivot(axis=(0.0, 0.0, 1.0)), {"body.theta": 0.5, "body.phi": 0.1}), form)
    assert error.where == "body.theta"
    assert "body.theta = 0.5, body.phi = 0.1 cannot all hold" in error.message


@pytest.mark.parametrize("form", FORMS)
def test_in_a_plane_the_moment_about_its_normal_is_enough(form: str) -> None:
    scene = Scene(space="plane", gravity=0.0, t_end=1.0)
    scene.add("body", RigidBody(mass=1.0, moments=(0.0, 0.3, 0.0)))
    scene.start["body.angular_speed"] = 2.0
    result = simulate(scene, form=form, outputs=3)
    assert result["body.angle"][-1] == pytest.approx(2.0)
    refused = Scene(space="plane", gravity=0.0, t_end=1.0)
    refused.add("body", RigidBody(mass=1.0, moments=(0.1, 0.3, 0.1)))
    with pytest.raises(ParameterError, match="greater than the"):
        simulate(refused, form=form)
