"""What people write that is nearly right, and what they expect of calls: told, or done."""

import warnings
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood import AtwoodError, Scene, StartError, TopologyError, UsageError, assemble, plot, simulate, sweep
from atwood_library import Ground, Link, Pivot, PointMass, RigidBody, Rod
from atwood_library.scenes import SimplePendulum, StewartPlatform

from ..helpers.runs import FORMS


def pendulum(mass: float = 1.0) -> Scene:
    scene = Scene(gravity=9.81, t_end=2.0)
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod(length=1.0)), PointMass(mass=mass)
    scene.add("bob", bob)
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.start["rod.angle"] = 0.3
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_a_bob_without_mass_is_named(form: str) -> None:
    with pytest.raises(StartError, match=r"bob: its mass is zero.*Give it a mass"):
        simulate(pendulum(mass=0.0), form=form)


@pytest.mark.parametrize("space", ["plane", "space"])
@pytest.mark.parametrize("form", FORMS)
def test_a_body_without_moment_on_a_pivot_is_told_so(space: str, form: str) -> None:
    def turning(**body: Any) -> Scene:
        scene = Scene(space=space, t_end=0.5)
        ground, pivot, rigid = scene.add("ground", Ground()), scene.add("pivot", Pivot()), RigidBody(mass=1.0, **body)
        scene.add("body", rigid)
        scene.connect(ground.frame, pivot.a)
        scene.connect(pivot.b, rigid.frame)
        return scene

    with pytest.raises(TopologyError, match="body: it could only turn at pivot, and has no moment of inertia"):
        simulate(turning(), form=form)
    scene = turning(center=(0.0, 0.0, -0.5))  # a point at an arm: m l^2
    scene.start["pivot.angle"] = 0.01
    found = simulate(scene, form=form, rtol=1e-9, outputs=6)
    assert_allclose(found["pivot.angle"], 0.01 * np.cos(np.sqrt(9.81 / 0.5) * found.time), atol=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_a_run_that_ends_before_its_start_has_no_solver(form: str) -> None:
    result = simulate(StewartPlatform(), form=form, max_seconds=1e-6)
    assert result.status == "time_limit"
    assert result.solver == "none: the run ended before one was chosen"
    assert "time limit" in repr(result)


def test_a_start_in_degrees_without_their_unit_is_doubted() -> None:
    scene = pendulum()
    scene.start["rod.angle"] = 90
    said = r"rod\.angle: the start 90 is taken as radians, 14\.3 turns.*'90 deg' or '90 rad'"
    with pytest.warns(UserWarning, match=said):
        assemble(scene)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for sound in ("90 deg", 3.0, 6.28, "90 rad", 47.1238898038469):  # the last one as another run has left it
            scene.start["rod.angle"] = sound
            assemble(scene)


def test_each_run_of_a_sweep_stops_at_a_condition() -> None:
    lengths = [0.5, 1.0, 2.0]
    found = sweep(pendulum(), {"rod.length": lengths}, until="rod.angle falls below 0", quantities=["rod.angle"])
    assert found.status == ("stopped",) * 3
    expected = [simulate(one, until="rod.angle falls below 0").time[-1] for one in map(of_length, lengths)]
    assert_allclose(found.end_time, expected, rtol=1e-9)
    assert_allclose(found["rod.angle"][:, -1], 0.0, atol=1e-9)
    assert found.statistics.batched == 3
    assert not found.statistics.why_single
    with pytest.raises(AtwoodError, match=r"rod\.angel.*rod\.angle"):
        sweep(pendulum(), {"rod.length": lengths}, until="rod.angel falls below 0")


def of_length(length: float) -> Scene:
    scene = pendulum()
    scene.set("rod.length", length)
    return scene


def test_quantities_are_plotted_over_another_one() -> None:
    result = simulate(SimplePendulum(), t_end=1.0, outputs=21)
    angle = next(path for path in result.paths if path.endswith(".angle"))
    rate = next(path for path in result.paths if path.endswith("angular_velocity"))
    for figure in (plot(result, [rate], x=angle), result.plot([rate], x=angle)):
        (axes,) = figure.axes
        assert axes.get_xlabel() == f"{angle}, rad"
        (line,) = axes.get_lines()
        assert_allclose(line.get_xdata(), result[angle])
        assert_allclose(line.get_ydata(), result[rate])
        plt.close(figure)
    with pytest.raises(AtwoodError, match=angle):
        plot(result, [rate], x=angle[:-1] + "x")
    with pytest.raises(UsageError, match="x"):
        plot(result, [rate], x=3)


def test_a_link_without_mass_is_named() -> None:
    scene = Scene()
    ground, pivot, link = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("link", Link(mass=0.0))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, link.a)
    with pytest.raises(StartError, match="link: its mass is zero"):
        simulate(scene, t_end=1.0)
