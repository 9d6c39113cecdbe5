"""Consistent starts from any mix of what is fixed and guessed, and clear errors for what cannot be."""

import math
from collections.abc import Mapping

import numpy as np
import pytest

from atwood import Scene
from atwood.errors import ParameterError, StartError, UsageError
from atwood.pipeline import assemble, simulate
from atwood.simulation.initialization.start import Start, find_start
from atwood_library import Ground, Pivot, PositionSensor, RigidBody, Weld
from atwood_library.scenes import DoublePendulum, DrivenPendulum, FourBar, SimplePendulum, SliderCrank

from ..helpers.mechanisms import pendulum


def double(start: Mapping[str, float], guess: Mapping[str, float] | None = None) -> DoublePendulum:
    scene = DoublePendulum()
    scene.start.clear()
    scene.start.update(start)
    scene.guess.update(guess or {})
    return scene


def found(scene: Scene) -> tuple[dict[str, float], dict[str, float], Start]:
    assembly = assemble(scene)
    start = find_start(assembly)
    names = [one.name for one in assembly.reduced.names]
    return (
        dict(zip(names, start.coordinates.tolist(), strict=True)),
        dict(zip(names, start.speeds.tolist(), strict=True)),
        start,
    )


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_positions_and_velocities_of_points(form: str) -> None:
    fixed = {"bob2.position.x": 0.5, "bob1.position.z": -0.8, "bob2.velocity.x": 0.1, "bob1.velocity.z": 0.2}
    result = simulate(double(fixed), form=form, rtol=1e-6, t_end=0.1, outputs=2)
    for path, value in fixed.items():
        assert result.array(path)[0] == pytest.approx(value, abs=1e-12)


def test_guesses_choose_the_branch() -> None:
    fixed = {"bob2.position.x": 0.3, "bob1.position.z": -0.8}
    right = found(double(fixed, {"rod1.angle": 0.6}))[0]
    left = found(double(fixed, {"rod1.angle": -0.6, "rod2.angle": 1.0}))[0]
    assert right["rod1.angle"] == pytest.approx(math.acos(0.8), abs=1e-10)
    assert left["rod1.angle"] == pytest.approx(-math.acos(0.8), abs=1e-10)


def test_coordinates_mixed_with_points() -> None:
    at, rate, start = found(
        double({"rod1.angle": 0.3, "bob2.position.x": 0.0, "rod2.angular_velocity": 1.0, "bob1.velocity.x": 0.5})
    )
    assert at["rod1.angle"] == pytest.approx(0.3)
    assert at["rod2.angle"] == pytest.approx(-0.3)
    assert rate["rod1.angle"] == pytest.approx(0.5 / math.cos(0.3))
    assert start.free_coordinates == start.free_speeds == start.repeated == ()


def test_what_is_open_is_reported() -> None:
    _, _, start = found(double({"rod1.angle": 0.3}))
    assert start.free_coordinates == ("rod2.angle",)
    assert start.free_speeds == ("rod1.angle", "rod2.angle")


def test_consistent_repetition_is_accepted_and_reported() -> None:
    repeated = {"bob1.position.x": math.sin(0.3), "bob1.position.z": -math.cos(0.3), "bob1.velocity.x": math.cos(0.3)}
    _, rate, start = found(double({"rod1.angle": 0.3, "rod1.angular_velocity": 1.0, **repeated}))
    assert set(start.repeated) == set(repeated)
    assert rate["rod1.angle"] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("start", "named"),
    [
        ({"rod1.angle": 0.3, "bob1.position.x": 0.5}, ["rod1.angle", "bob1.position.x"]),
        ({"bob2.position.x": 2.5}, ["bob2.position.x"]),
        (
            {"rod1.angle": 0.3, "rod1.angular_velocity": 1.0, "bob1.velocity.x": 5.0},
            ["rod1.angular_velocity", "bob1.velocity.x"],
        ),
    ],
)
def test_contradictions_name_their_paths(start: dict[str, float], named: list[str]) -> None:
    with pytest.raises(StartError, match="contradict") as caught:
        found(double(start))
    assert all(path in str(caught.value) for path in named)
    assert "2 free coordinates" in str(caught.value)


def test_unknown_paths_have_near_matches() -> None:
    with pytest.raises(StartError, match=r"rod1\.angel.*Did you mean 'rod1\.angle'"):
        found(double({"rod1.angel": 0.3}))
    with pytest.raises(StartError, match=r"bob2\.position\.x"):
        found(double({"bob2.positon.x": 0.3}))


@pytest.mark.parametrize("path", ["bob2.acceleration.x", "rod1.tension", "ground.force.z"])
def test_accelerations_and_forces_cannot_be_chosen(path: str) -> None:
    with pytest.raises(StartError, match="follows from positions and speeds") as caught:
        found(double({path: 0.3}))
    assert caught.value.where == path


def test_what_is_quadratic_in_the_speeds_cannot_be_chosen() -> None:
    with pytest.raises(StartError, match="not linear in the speeds"):
        found(double({"bob1.kinetic_energy": 0.3}))


def test_energies_of_position_can_be_chosen() -> None:
    at, _, _ = found(double({"bob1.potential_energy": -5.0}, {"rod1.angle": 0.7}))
    assert -9.81 * math.cos(at["rod1.angle"]) == pytest.approx(-5.0)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_start_values_are_finite(value: float) -> None:
    with pytest.raises(StartError, match="not a finite number"):
        found(double({"rod1.angle": value}))


def probed(start: Mapping[str, float]) -> DrivenPendulum:
    scene = DrivenPendulum()
    probe = scene.add("probe", PositionSensor())
    scene.connect(probe.point, scene["drive"].b)
    scene.start.update(start)
    return scene


def test_speeds_of_driven_parts() -> None:
    # the drive moves at amplitude times angular frequency at t = 0
    _, _, start = found(probed({"probe.velocity.x": 0.1 * 2.5}))
    assert start.repeated == ("probe.velocity.x",)
    with pytest.raises(StartError, match=r"probe\.velocity\.x"):
        found(probed({"probe.velocity.x": 3.0}))
    with pytest.raises(StartError, match=r"drive\.displacement"):
        found(probed({"drive.displacement": 0.5}))


def test_speeds_of_fixed_parts() -> None:
    scene = pendulum()
    probe = scene.add("probe", PositionSensor())
    scene.connect(probe.point, scene["ground"].frame)
    scene.start["probe.velocity.x"] = 1.0
    with pytest.raises(StartError, match=r"probe\.velocity\.x"):
        found(scene)


def test_the_drive_is_counted_in_the_speed_of_what_hangs_on_it() -> None:
    scene = DrivenPendulum()
    scene.start.clear()
    scene.start.update({"rod.angle": 0.4, "bob.velocity.x": 1.0})
    _, rate, _ = found(scene)
    assert rate["rod.angle"] == pytest.approx((1.0 - 0.25) / math.cos(0.4))


def test_both_assembly_modes_of_the_four_bar() -> None:
    angles = []
    for coupler, rocker in ((0.4, 1.5), (-1.3, -2.2)):
        scene = FourBar()
        scene.guess.update({"coupler.angle": coupler, "rocker.angle": rocker})
        at, rate, start = found(scene)
        closing = [
            math.cos(1.0) + 2.5 * math.cos(at["coupler.angle"]) - 2.5 - 2.0 * math.cos(at["rocker.angle"]),
            math.sin(1.0) + 2.5 * math.sin(at["coupler.angle"]) - 2.0 * math.sin(at["rocker.angle"]),
        ]
        assert np.max(np.abs(closing)) < 1e-12
        assert rate["crank.angle"] == pytest.approx(2.0)
        assert start.free_coordinates == ()
        angles.append(at["coupler.angle"])
    # the two modes are mirror images about the line from the crank's end to the right pivot
    diagonal = math.atan2(-math.sin(1.0), 2.5 - math.cos(1.0))
    assert angles[0] + angles[1] == pytest.approx(2.0 * diagonal, abs=1e-10)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_loop_that_cannot_close_is_named(form: str) -> None:
    with pytest.raises(StartError, match="the loop cannot be closed") as caught:
        simulate(FourBar(frame_length=9.0), form=form)
    text = str(caught.value)
    assert all(part in text for part in ("crank", "coupler", "rocker", "pivot1", "pivot2", "pivot3", "pivot4"))
    assert "found is 3.5" in text  # 9 m less the 5.5 m of the links


def test_a_crank_angle_that_the_loop_cannot_reach() -> None:
    scene = FourBar(crank_length=2.2, coupler_length=1.0)
    scene.start["crank.angle"] = 3.1
    with pytest.raises(StartError, match=r"crank\.angle"):
        found(scene)


def test_loops_start_from_any_coordinate() -> None:
    scene = SliderCrank()
    scene.start.clear()
    scene.start.update({"guide.displacement": 1.8, "guide.speed": -0.5})
    scene.guess.update({"crank.angle": 0.7, "connecting_rod.angle": -0.3})
    for form in ("reduced", "dae"):
        result = simulate(scene, form=form, rtol=1e-6, t_end=0.05, outputs=2)
        assert result.array("guide.displacement")[0] == pytest.approx(1.8, abs=1e-12)
        assert result.array("guide.speed")[0] == pytest.approx(-0.5, abs=1e-12)
        assert result.array("crank.angle")[0] > 0.0


@pytest.mark.parametrize("t_end", [0.0, -1.0, math.nan, math.inf])
def test_the_end_is_after_the_start(t_end: float) -> None:
    with pytest.raises(UsageError, match=r"not after the start|t_end cannot"):
        simulate(SimplePendulum(), t_end=t_end)


@pytest.mark.parametrize("outputs", [1, [0.0, 2.0, 1.0], [0.0, math.nan], [0.0, 20.0], [-1.0, 1.0], []])
def test_output_times_make_sense(outputs: object) -> None:
    with pytest.raises(UsageError, match="output"):
        simulate(SimplePendulum(), outputs=outputs)


@pytest.mark.parametrize("rtol", [0.0, 1.0, -1e-3, math.nan])
def test_tolerances_make_sense(rtol: float) -> None:
    with pytest.raises(UsageError, match="tolerance"):
        simulate(SimplePendulum(), rtol=rtol)


def test_forms_and_levels_have_near_matches() -> None:
    with pytest.raises(UsageError, match="Did you mean 'reduced'"):
        assemble(SimplePendulum(), form="redcued")
    with pytest.raises(UsageError, match="Did you mean 'index1'"):
        assemble(SimplePendulum(), form="dae", level="index3")


def test_bad_parameters_leave_nothing_half_made() -> None:
    scene = SimplePendulum()
    for name, value in (("length", math.nan), ("mass", -1.0), ("length", 0.0)):
        with pytest.raises(ParameterError, match=name):
            setattr(scene, name, value)
    result = simulate(scene, rtol=1e-6, t_end=0.1, outputs=2)
    assert result.array("bob.position.z")[0] == pytest.approx(-math.cos(1.0))


def test_accelerations_and_multipliers_fit_before_the_first_step() -> None:
    result = simulate(SimplePendulum(), form="dae", rtol=1e-6, t_end=1e-6, outputs=2)
    assert result.array("rod.tension")[0] == pytest.approx(9.81 * math.cos(1.0), rel=1e-12)
    assert result.array("bob.acceleration.x")[0] == pytest.approx(-9.81 * math.sin(1.0) * math.cos(1.0), rel=1e-12)


# -- whole turns -------------------------------------------------------------------------------------------------------


def sprung_pair() -> Scene:
    """Return two bodies on hinges with springs, welded on at angles, so that no coordinate is a hinge's angle."""
    scene = Scene(gravity=0.0)
    ground = scene.add("ground", Ground())
    foot = scene.add("foot", Weld(angle=3.0))
    hinge = scene.add("hinge", Pivot(stiffness=1.0))
    arm = scene.add("arm", Weld(angle=2.0))
    body = scene.add("body", RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
    second = scene.add("second", Pivot(stiffness=1.0))
    end = scene.add("end", RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
    scene.connect(ground.frame, foot.a)
    scene.connect(foot.b, hinge.a)
    scene.connect(hinge.b, arm.a)
    scene.connect(arm.b, body.frame)
    scene.connect(arm.b, second.a)
    scene.connect(second.b, end.frame)
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(("first", "second"), [(7.0, -8.0), (-20.0, 0.3), (1.0, 13.0)])
def test_angles_start_with_the_whole_turns_that_are_said(form: str, first: float, second: float) -> None:
    scene = sprung_pair()
    scene.start.update({"hinge.angle": first, "second.angle": second})
    result = simulate(scene, form=form, t_end=0.1, outputs=3)
    assert result["hinge.angle"][0] == pytest.approx(first, abs=1e-9)
    assert result["hinge.potential_energy"][0] == pytest.approx(0.5 * first**2, rel=1e-9)
    assert result["second.potential_energy"][0] == pytest.approx(0.5 * second**2, rel=1e-9, abs=1e-12)


def test_angles_that_agree_but_for_a_turn_contradict_each_other_and_as_guesses_do_not() -> None:
    said = {"hinge.angle": -0.25, "body.angle": -0.25 + 5.0 - 2.0 * np.pi}
    scene = sprung_pair()
    scene.start.update(said)
    with pytest.raises(StartError, match="contradict each other"):
        simulate(scene, t_end=0.1)
    scene = sprung_pair()
    scene.guess.update(said)
    result = simulate(scene, t_end=0.1, outputs=3)
    turned = (result["hinge.angle"][0] + 0.25) / (2.0 * np.pi)
    assert turned == pytest.approx(round(turned), abs=1e-9)
    assert result["hinge.potential_energy"][0] == pytest.approx(0.5 * result["hinge.angle"][0] ** 2, rel=1e-9)


@pytest.mark.parametrize("name", ["lambda", "lambda[0]", "lambda:rod1.fixed_distance[0]", "mu:rod1.fixed_distance[0]"])
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_multipliers_are_no_start_values(name: str, form: str) -> None:
    """The error said that there is no such quantity."""
    with pytest.raises(StartError, match="a multiplier follows from positions and speeds") as caught:
        simulate(double({name: 1.0}), form=form, t_end=0.1)
    assert caught.value.where == name
