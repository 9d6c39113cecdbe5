"""Outputs that inputs are linked to: components of vectors, in a plane and in space, and names that mean nothing."""

import pytest

from atwood import DeclarationError, Scene, UsageError, simulate
from atwood_library import Ground, Pivot, RigidBody, SignalFunction, Sine, Weld


def swinging(space: str = "plane") -> Scene:
    scene = Scene(space=space)
    ground, pivot, arm = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("arm", Weld())
    body = scene.add("body", RigidBody(moments=(0.1, 0.1, 0.1)))
    arm.displacement = (0.5, 0.0, 0.0)
    for a, b in ((ground.frame, pivot.a), (pivot.b, arm.a), (arm.b, body.frame)):
        scene.connect(a, b)
    scene.start.update({"pivot.angle": 0.3, "pivot.angular_velocity": 2.0})
    return scene


def hearing(part: str, output: str, space: str = "plane") -> Scene:
    """Return the scene with a block that hands on an output of a part."""
    scene = swinging(space)
    block = scene.add("block", SignalFunction(function="u_1"))
    scene.connect(scene[part].output(output), block.input("u_1"))
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_an_angular_velocity_in_a_plane_is_about_its_normal(form: str) -> None:
    """The one component that there is was left out, and two were shown that are always zero."""
    result = simulate(hearing("body", "angular_velocity.y"), form=form, t_end=0.5, outputs=6)
    assert [name for name in result if name.startswith("body.angular_velocity")] == ["body.angular_velocity.y"]
    expected = -result.array("pivot.angular_velocity")
    assert abs(expected[-1]) > 0.5
    assert result.array("body.angular_velocity.y") == pytest.approx(expected, rel=1e-12)
    assert result.array("block.y") == pytest.approx(expected, rel=1e-12)


def test_it_can_be_started_so() -> None:
    scene = swinging()
    del scene.start["pivot.angular_velocity"]
    scene.start["body.angular_velocity.y"] = -3.0
    assert simulate(scene, t_end=0.1)["pivot.angular_velocity"][0] == pytest.approx(3.0, rel=1e-12)


@pytest.mark.parametrize(
    ("part", "output", "space", "words"),
    [
        ("pivot", "angular_velocity.x", "plane", "a number and no vector. Connect angular_velocity"),
        ("pivot", "angle.y", "space", "a number and no vector. Connect angle"),
        ("body", "angular_velocity", "plane", "it is a vector. Connect angular_velocity.y"),
        ("body", "position", "plane", "Connect position.x or position.z"),
        ("body", "velocity.w", "space", "no component 'w'. Connect velocity.x, velocity.y or velocity.z"),
        ("body", "angular_speed", "space", "no meaning in space"),
        ("body", "spin.y", "plane", "no meaning in a plane"),
        ("pivot", "force", "plane", "'force'. Did you mean 'force.z'"),
    ],
)
def test_what_is_no_output_is_refused_by_name(part: str, output: str, space: str, words: str) -> None:
    """A component of a number was taken for the number, and a quantity of the plane was read in space."""
    with pytest.raises((DeclarationError, UsageError), match=words):
        simulate(hearing(part, output, space), t_end=0.1)


def test_a_component_of_a_source_is_refused_by_name() -> None:
    """This ended in a bare StopIteration."""
    scene = swinging()
    sine, block = scene.add("sine", Sine()), scene.add("block", SignalFunction(function="u_1"))
    scene.connect(sine.output("value.x"), block.input("u_1"))
    with pytest.raises(DeclarationError, match=r"sine.value.x: value is a number and no vector"):
        simulate(scene, t_end=0.1)


def test_what_acts_across_a_plane_is_zero() -> None:
    """A part for both, plane and space, may read all three components of a reaction."""
    result = simulate(hearing("pivot", "force.y"), t_end=0.2, outputs=3)
    assert result.array("block.y") == pytest.approx(0.0, abs=0.0)
