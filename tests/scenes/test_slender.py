"""Slender bodies on balls: the spin about their own line has no inertia, is held, and changes nothing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from atwood import Component, Scene, StartError, assemble, report, simulate
from atwood_library import Bar, Ground, Link, Pivot, PointMass, Rod, Spherical, TorsionSpring, Weld

from ..helpers.runs import FORMS


def hang(body: Component, weld: dict[str, object] | None = None) -> Scene:
    """A body on a ball joint, level along y at the start, with two speeds."""
    scene = Scene(space="space", t_end=1.0)
    ground, ball, rod = scene.add("ground", Ground()), scene.add("ball", Spherical()), scene.add("rod", body)
    scene.connect(ground.frame, ball.a)
    if weld is None:
        scene.connect(ball.b, rod.a)
    else:
        turn = scene.add("turn", Weld(**weld))
        scene.connect(ball.b, turn.a)
        scene.connect(turn.b, rod.a)
    return scene


def spun(scene: Scene) -> Scene:
    """The same, started level and sideways."""
    scene.start.update({"rod.position.x": 0.3, "rod.position.z": 0.1})
    scene.guess["rod.position.y"] = 0.4
    scene.start.update({"rod.velocity.x": -0.8, "rod.velocity.z": 0.5})
    return scene


def along(result: object, path: str) -> np.ndarray:
    return np.array([result[f"{path}.{axis}"] for axis in "xyz"])  # type: ignore[index]


WELDS = [None, {"angle": "37 deg", "axis": (0.3, -0.5, 0.8)}]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("weld", WELDS)
def test_a_slender_rod_swings_as_two_masses_on_a_line_do(form: str, weld: dict[str, object] | None) -> None:
    result = simulate(spun(hang(Link(length=1.0, mass=2.0), weld)), form=form, rtol=1e-10, outputs=11)
    # The direction e of two masses at d1 and d2: sum m d^2 e'' = (projection of sum m d g) - sum m d^2 e'^2 e.
    from scipy.integrate import solve_ivp

    moment, weight = 2.0 / 3.0, 2.0 * 0.5 * 9.81

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        e, v = y[:3], y[3:]
        pull = np.array([0.0, 0.0, -weight / moment])
        return np.concatenate([v, pull - (pull @ e) * e - (v @ v) * e])

    middle, speed = along(result, "rod.position"), along(result, "rod.velocity")
    start = np.concatenate([middle[:, 0], speed[:, 0]]) / 0.5
    known = solve_ivp(rate, (0.0, 1.0), start, "DOP853", result.time, rtol=1e-12, atol=1e-12).y
    assert np.max(np.abs(middle - 0.5 * known[:3])) < 1e-7
    assert result.energy.max_drift < 1e-6


def linkage(coupler: Component) -> Scene:
    """A crank and a rocker about skew axes; what joins them has ball joints at both ends, or is a rod of points."""
    scene = Scene(space="space", t_end=0.6)
    grounds = scene.add("left", Ground()), scene.add("right", Ground(position=(2.0, 0.3, 0.2)))
    pivots = scene.add("p1", Pivot(axis=(0.0, 1.0, 0.0))), scene.add("p2", Pivot(axis=(0.3, 1.0, 0.2)))
    links = scene.add("crank", Link(length=0.5)), scene.add("rocker", Link(length=1.0))
    middle = scene.add("coupler", coupler)
    for i, (ground, pivot, link, end) in enumerate(zip(grounds, pivots, links, (middle.a, middle.b), strict=True)):
        scene.connect(ground.frame, pivot.a)
        scene.connect(pivot.b, link.a)
        if isinstance(coupler, Rod):
            scene.connect(link.b, end)
            continue
        ball = scene.add(f"ball{i}", Spherical())
        scene.connect(link.b, ball.a)
        scene.connect(ball.b, end)
    scene.start["p1.angle"] = 0.7
    scene.guess["p2.angle"] = 1.5
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("make", [lambda: Link(length=2.0, mass=3.0), lambda: Bar(length=2.0, mass=3.0, axis="z")])
def test_a_slender_coupler_on_two_balls_moves_as_a_rod_of_points(form: str, make: Callable[[], Component]) -> None:
    options = {"rtol": 1e-10, "outputs": 7}
    rod = simulate(linkage(Rod(length=2.0, mass=3.0)), **options)
    slender = simulate(linkage(make()), form=form, **options)
    for path in ("p1.angle", "p2.angle"):
        assert np.max(np.abs(slender[path] - rod[path])) < 1e-7
    for axis in "xyz":
        assert np.max(np.abs(slender[f"p1.force.{axis}"] - rod[f"p1.force.{axis}"])) < 1e-5


def test_the_report_drops_the_spin_from_the_freedom() -> None:
    found = report(linkage(Link(length=2.0)))
    assert found.degrees_of_freedom == 1
    assert found.idle_spins == ("coupler",)
    assert not found.redundant
    assert "the spin of coupler about its own axis" in str(found)
    alone = report(hang(Bar(length=2.0), {"angle": "1 rad", "axis": (1.0, 2.0, -0.4)}))
    assert alone.degrees_of_freedom == 2
    assert alone.idle_spins == ("rod",)
    assert alone.solved_speeds == ()
    assert alone.states == {"reduced": 6, "dae": 20}


@pytest.mark.sample(2)
@pytest.mark.parametrize("solver", ["explicit", "taylor"])
@pytest.mark.parametrize("orientation", ["quaternion", "euler-xyz", "euler-zyx"])
def test_no_constraint_is_left_where_there_is_no_loop(solver: str, orientation: str) -> None:
    scene = spun(hang(Link(length=1.0, mass=2.0), WELDS[1]))
    ida = simulate(scene, rtol=1e-10, outputs=5, solver="ida")
    other = simulate(scene, rtol=1e-10, outputs=5, solver=solver, orientation=orientation)
    assert np.max(np.abs(along(ida, "rod.position") - along(other, "rod.position"))) < 1e-7


def test_a_weight_at_the_end_of_a_link_without_mass() -> None:
    scene = Scene(space="space", t_end=0.5)
    ground, ball, link = (
        scene.add("ground", Ground()),
        scene.add("ball", Spherical()),
        scene.add("link", Link(mass=0.0)),
    )
    bob = scene.add("bob", PointMass(mass=1.5))
    scene.connect(ground.frame, ball.a)
    scene.connect(ball.b, link.a)
    scene.connect(link.b, bob.point)
    assert report(scene).degrees_of_freedom == 2
    assert simulate(scene, rtol=1e-9).energy.max_drift < 1e-6


def test_other_values_bring_the_spin_back() -> None:
    made = assemble(hang(Link(length=1.0, mass=2.0, axial_moment=1e-3)))
    assert len(made.own_equations.speeds) == 3
    slender = made.with_values({"rod.axial_moment": 0.0})
    assert len(slender.own_equations.speeds) == 2
    longer = slender.with_values({"rod.length": 1.5})
    assert longer.why_new == ""
    assert len(slender.with_values({"rod.axial_moment": 1e-3}).own_equations.speeds) == 3


@pytest.mark.parametrize("form", FORMS)
def test_damping_stops_a_spin_that_nothing_else_resists(form: str) -> None:
    """The damper's torque along the bar is zero, so the bar does not turn along its line."""
    damped = hang(Bar(axis="x"))
    damped["ball"].damping = 0.1
    result = simulate(damped, form=form, rtol=1e-10, outputs=11)
    np.testing.assert_allclose(result.array("rod.spin.x"), 0.0, atol=1e-9)
    assert result.energy.max_drift < 1e-7
    assert result.energy.work[-1] < -0.01


@pytest.mark.parametrize("form", FORMS)
def test_a_spring_on_such_a_spin_is_refused_by_name(form: str) -> None:
    sprung = hang(Link())
    spring = sprung.add("spring", TorsionSpring(axis=(1.0, 0.0, 0.0)))
    sprung.connect(spring.a, sprung["ground"].frame)
    sprung.connect(spring.b, sprung["rod"].a)
    with pytest.raises(StartError, match="without inertia") as caught:
        simulate(sprung, form=form)
    assert caught.value.where == "rod"
