"""Knots without mass follow from the balance of forces: against stiffness in series and in parallel."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import root

from atwood import AtwoodError, Scene, assemble, linearize, simulate
from atwood_library import (
    Bar,
    Damper,
    DistanceContact,
    Force,
    Gear,
    Ground,
    Inertia,
    Mass1D,
    PointMass,
    RotationalFriction,
    RotationalSpringDamper,
    Spherical,
    Spring,
    Table,
)

from ..helpers.runs import FORMS

SOLVERS = [("reduced", "explicit"), ("reduced", "ida"), ("dae", "explicit"), ("dae", "ida")]


def chain(stiffnesses: Any, space: str = "line", gravity: float = 0.0, axis: Any = (1.0, 0.0, 0.0)) -> Scene:
    """Springs of 1 m one after another from the ground, knots without mass between them, and 2 kg at the end."""
    line = {"line_axis": axis} if space == "line" else {}
    scene = Scene(space=space, gravity=gravity, gravity_direction=axis, **line)
    end = scene.add("ground", Ground()).frame
    along = {name: x for name, x in zip("xyz", axis, strict=True) if x or (space, name) in (("plane", "z"),)}
    for number, stiffness in enumerate(stiffnesses, start=1):
        spring = scene.add(f"spring_{number}", Spring(stiffness=stiffness, natural_length=1.0))
        scene.connect(end, spring.a)
        last = number == len(stiffnesses)
        name = "mass" if last else f"knot_{number}"
        point = scene.add(name, PointMass(mass=2.0 if last else 0.0))
        scene.connect(spring.b, point.point)
        end = point.point
        if not last:
            scene.guess.update({f"{name}.position.{one}": number * x for one, x in along.items()})
    scene.start.update({f"mass.velocity.{one}": 0.0 for one in along})
    return scene


@pytest.mark.parametrize(("form", "solver"), SOLVERS)
@pytest.mark.parametrize("stiffnesses", [(100.0, 200.0), (70.0, 1e5, 30.0, 400.0)])
def test_springs_in_series(form: str, solver: str, stiffnesses: tuple[float, ...]) -> None:
    scene = chain(stiffnesses)
    scene.start["mass.position.x"] = len(stiffnesses) + 0.2
    result = simulate(scene, t_end=2.0, form=form, solver=solver, rtol=1e-9, outputs=41)
    together = 1.0 / sum(1.0 / k for k in stiffnesses)
    stretched = 0.2 * np.cos(math.sqrt(together / 2.0) * result.time)
    assert_allclose(result["mass.position.x"], len(stiffnesses) + stretched, atol=1e-7)
    for number, k in enumerate(stiffnesses, start=1):
        assert_allclose(k * (result[f"spring_{number}.length"] - 1.0), together * stretched, atol=1e-5 * k)
    assert result.energy.max_drift < 1e-5
    if form == "reduced":
        assert assemble(scene).reduced.eliminated == tuple(f"knot_{i}.position.x" for i in range(1, len(stiffnesses)))


def test_the_frequency_of_springs_in_series_and_in_parallel() -> None:
    scene = chain((100.0, 200.0))
    scene.connect(scene["ground"].frame, scene.add("beside", Spring(stiffness=50.0, natural_length=2.0)).a)
    scene.connect(scene["beside"].b, scene["knot_1"].point)
    scene.start["mass.position.x"] = 2.0
    # 100 and 50 side by side, before 200; all at rest where the two hold the knot at (100*1 + 50*2)/150.
    scene.start["mass.position.x"] = 4.0 / 3.0 + 1.0
    together = 1.0 / (1.0 / 150.0 + 1.0 / 200.0)
    frequencies = np.abs(np.imag(np.linalg.eigvals(linearize(scene).A)))
    assert_allclose(frequencies, math.sqrt(together / 2.0), rtol=1e-10)


@pytest.mark.parametrize(("form", "solver"), SOLVERS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_pendulum_on_two_springs_with_a_knot_between(form: str, solver: str, space: str) -> None:
    scene = chain((100.0, 200.0), space, 9.81, (0.0, 0.0, -1.0))
    scene.guess["knot_1.position.x"] = 0.05
    scene.start.update({"mass.position.x": 0.4, "mass.position.z": -2.3, "mass.velocity.x": 0.5})
    if space == "space":
        scene.start.update({"mass.position.y": 0.0, "mass.velocity.y": 0.2})
    result = simulate(scene, t_end=1.5, form=form, solver=solver, rtol=1e-9, outputs=16)
    together = 1.0 / (1.0 / 100.0 + 1.0 / 200.0)

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        r = float(np.linalg.norm(y[:3]))
        return np.concatenate([y[3:], -together * (r - 2.0) / (2.0 * r) * y[:3] + [0.0, 0.0, -9.81]])

    begin = [0.4, 0.0, -2.3, 0.5, 0.2 if space == "space" else 0.0, 0.0]
    true = solve_ivp(rate, (0.0, 1.5), begin, method="DOP853", rtol=1e-12, atol=1e-13, t_eval=result.time).y
    for axis, expected in zip("xyz", true, strict=False):
        if space == "space" or axis != "y":
            assert_allclose(result[f"mass.position.{axis}"], expected, atol=3e-7)
    assert result.energy.max_drift < 1e-5
    assert float(np.max(result.error("mass.position.x"))) < 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_three_springs_that_meet_in_a_point_without_mass(form: str) -> None:
    """Two to the ceiling, one to a mass of 2 kg; the place of the knot by a root at each time."""
    anchors, stiffnesses, natural = np.array([[-1.0, 0.0], [1.2, 0.1]]), (300.0, 500.0, 200.0), (1.0, 1.1, 0.8)
    scene = Scene(gravity=9.81)
    knot, mass = scene.add("knot", PointMass(mass=0.0)), scene.add("mass", PointMass(mass=2.0))
    for number, (x, z) in enumerate(anchors):
        hook = scene.add(f"hook_{number}", Ground(position=(x, 0.0, z)))
        spring = scene.add(f"spring_{number}", Spring(stiffness=stiffnesses[number], natural_length=natural[number]))
        scene.connect(hook.frame, spring.a)
        scene.connect(spring.b, knot.point)
    spring = scene.add("spring_2", Spring(stiffness=stiffnesses[2], natural_length=natural[2]))
    scene.connect(knot.point, spring.a)
    scene.connect(spring.b, mass.point)
    scene.start.update(
        {"mass.position.x": 0.2, "mass.position.z": -1.9, "mass.velocity.x": 0.7, "mass.velocity.z": 0.0}
    )
    scene.guess.update({"knot.position.x": 0.1, "knot.position.z": -0.8})

    def pull(place: np.ndarray, end: np.ndarray, number: int) -> np.ndarray:
        apart = end - place
        return stiffnesses[number] * (1.0 - natural[number] / np.linalg.norm(apart)) * apart

    near = np.array([0.1, -0.8])

    def knotted(at: np.ndarray) -> np.ndarray:
        found = root(lambda p: pull(p, anchors[0], 0) + pull(p, anchors[1], 1) + pull(p, at, 2), near, tol=1e-12)
        assert np.max(np.abs(found.fun)) < 1e-8
        near[:] = found.x
        return near.copy()

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[2:], pull(y[:2], knotted(y[:2]), 2) / 2.0 + [0.0, -9.81]])

    result = simulate(scene, t_end=0.6, form=form, rtol=1e-9, outputs=7)
    true = solve_ivp(rate, (0.0, 0.6), [0.2, -1.9, 0.7, 0.0], rtol=1e-9, atol=1e-10, t_eval=result.time).y
    assert_allclose(result["mass.position.x"], true[0], atol=1e-7)
    assert_allclose(result["mass.position.z"], true[1], atol=1e-7)
    places = np.array([knotted(at) for at in true[:2].T])
    assert_allclose(result["knot.position.x"], places[:, 0], atol=1e-7)
    assert_allclose(result["knot.position.z"], places[:, 1], atol=1e-7)


@pytest.mark.parametrize(("form", "solver"), SOLVERS)
def test_a_spring_and_a_damper_in_series(form: str, solver: str) -> None:
    """Maxwell's element between the ground and 2 kg: the knot creeps, at a rate that the balance gives."""
    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0), gravity=0.0)
    ground, knot, mass = scene.add("ground", Ground()), scene.add("knot", PointMass(mass=0.0)), PointMass(mass=2.0)
    scene.add("mass", mass)
    spring, damper = Spring(stiffness=100.0, natural_length=1.0), scene.add("damper", Damper(damping=5.0))
    scene.add("spring", spring)
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, knot.point)
    scene.connect(knot.point, damper.a)
    scene.connect(damper.b, mass.point)
    scene.start.update({"knot.position.x": 1.0, "mass.position.x": 2.0, "mass.velocity.x": 0.4})
    result = simulate(scene, t_end=2.0, form=form, solver=solver, rtol=1e-9, outputs=21)

    def rate(_: float, y: np.ndarray) -> list[float]:
        pull = 100.0 * (y[0] - 1.0)
        return [y[2] - pull / 5.0, y[2], -pull / 2.0]

    true = solve_ivp(rate, (0.0, 2.0), [1.0, 2.0, 0.4], method="DOP853", rtol=1e-11, atol=1e-12, t_eval=result.time).y
    assert_allclose(result["knot.position.x"], true[0], atol=1e-6)
    assert_allclose(result["mass.position.x"], true[1], atol=1e-6)
    assert result.energy.max_drift < 1e-5


def drive_train(moment: float = 0.0, between: float = 2.0) -> Scene:
    """Two flywheels with a gear between two springs, on shafts of a moment that may be zero."""
    scene = Scene(gravity=0.0)
    first, second = scene.add("first", Inertia(moment=1.0)), scene.add("second", Inertia(moment=0.5))
    one, two = (scene.add(n, RotationalSpringDamper(stiffness=k)) for n, k in (("one", 10.0), ("two", 30.0)))
    a, b = scene.add("a", Inertia(moment=moment)), scene.add("b", Inertia(moment=moment))
    gear = scene.add("gear", Gear(ratio=between))
    for ends in ((first, one.a), (a, one.b), (a, gear.a), (b, gear.b), (b, two.a), (second, two.b)):
        scene.connect(ends[0].flange, ends[1])
    scene.start.update({"first.angle": 0.1, "second.angle": 0.0})
    scene.start.update({"first.angular_velocity": 0.0, "second.angular_velocity": 0.3})
    return scene


@pytest.mark.parametrize(("form", "solver"), SOLVERS)
def test_a_gear_straight_between_springs(form: str, solver: str) -> None:
    result = simulate(drive_train(), t_end=2.0, form=form, solver=solver, rtol=1e-9, outputs=21)
    # Seen from the first shaft, the second spring turns ratio times as far: stiffness over the ratio squared.
    together = 1.0 / (1.0 / 10.0 + 2.0**2 / 30.0)
    twist = solve_ivp(
        lambda _, y: [y[2], y[3], -together * (y[0] - 2.0 * y[1]), 2.0 * together * (y[0] - 2.0 * y[1]) / 0.5],
        (0.0, 2.0), [0.1, 0.0, 0.0, 0.3], method="DOP853", rtol=1e-12, atol=1e-13, t_eval=result.time,
    ).y  # fmt: skip
    assert_allclose(result["first.angle"], twist[0], atol=5e-7)
    assert_allclose(result["second.angle"], twist[1], atol=5e-7)
    assert_allclose(result["one.torque"], together * (2.0 * twist[1] - twist[0]), atol=1e-5)
    assert result.energy.max_drift < 1e-4


@pytest.mark.parametrize("form", FORMS)
def test_a_force_on_a_knot_by_a_table(form: str) -> None:
    scene = chain((100.0, 200.0))
    scene.start["mass.position.x"] = 2.0
    force, table = scene.add("force", Force()), scene.add("table", Table(table=[(0, 0), (0.5, 3), (1, -1), (2, 2)]))
    scene.connect(force.point, scene["knot_1"].point)
    scene.connect(table.output("value"), force.input("value"))
    result = simulate(scene, t_end=2.0, form=form, rtol=1e-9, outputs=21, solver="explicit")

    def rate(t: float, y: np.ndarray) -> list[float]:
        push = np.interp(t, [0.0, 0.5, 1.0, 2.0], [0.0, 3.0, -1.0, 2.0])
        knot = (100.0 * 1.0 + 200.0 * (y[0] - 1.0) + push) / 300.0
        return [y[1], -200.0 * (y[0] - knot - 1.0) / 2.0]

    times = np.unique(result.time)
    true = solve_ivp(rate, (0.0, 2.0), [2.0, 0.0], max_step=0.01, rtol=1e-10, atol=1e-12, t_eval=times).y[0]
    found = np.interp(times, result.time, result["mass.position.x"])
    assert_allclose(found, true, atol=2e-7)


def test_a_knot_that_nothing_holds_is_still_refused() -> None:
    scene = Scene()
    force, knot = scene.add("force", Force(value=1.0)), scene.add("knot", PointMass(mass=0.0))
    scene.connect(force.point, knot.point)
    scene.add("mass", PointMass())
    with pytest.raises(AtwoodError, match=r"knot.*mass|without inertia"):
        simulate(scene, t_end=1.0)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["line", "plane"])
def test_a_force_that_jumps_moves_a_knot_at_once_and_nothing_else(form: str, space: str) -> None:
    scene = chain((100.0, 200.0), space, 0.0 if space == "line" else 9.81, (1.0, 0.0, 0.0))
    rest = 0.0 if space == "line" else 2.0 * 9.81 * (1.0 / 100.0 + 1.0 / 200.0)
    scene.start["mass.position.x"] = 2.0 + rest
    push = scene.add("push", Force(direction=(1.0, 0.0, 0.0), value="select(t < 0.5, 0, 6)"))
    scene.connect(push.point, scene["knot_1"].point)
    result = simulate(scene, t_end=1.5, form=form, rtol=1e-9, outputs=16)
    # The knot gives 200/300 of the push on: a step of 4 N on 2 kg on the springs in series.
    omega = math.sqrt(1.0 / (1.0 / 100.0 + 1.0 / 200.0) / 2.0)
    since = np.maximum(result.time - 0.5, 0.0)
    assert_allclose(
        result["mass.position.x"], 2.0 + rest + 4.0 / 2.0 / omega**2 * (1.0 - np.cos(omega * since)), atol=1e-7
    )
    assert not result.events


@pytest.mark.parametrize("form", FORMS)
def test_a_damped_spin_without_inertia_is_none(form: str) -> None:
    """A slender bar of 1 m and 1 kg on a damped ball: its spin stops at once, and its axis swings as it would alone."""
    scene = Scene(space="space", gravity=9.81)
    ground, ball, bar = scene.add("ground", Ground()), scene.add("ball", Spherical(damping=0.1)), Bar()
    scene.add("bar", bar)
    scene.connect(ground.frame, ball.a)
    scene.connect(ball.b, bar.a)
    scene.start.update({"bar.position.x": 0.2, "bar.position.y": 0.1, "bar.velocity.x": 0.3, "bar.velocity.y": -0.4})
    scene.guess["bar.position.z"] = -0.45
    result = simulate(scene, t_end=1.0, form=form, rtol=1e-9, outputs=11)
    found = np.array([result[f"bar.position.{axis}"] for axis in "xyz"])
    speeds = np.array([result[f"bar.velocity.{axis}"] for axis in "xyz"])

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        n, v = y[:3], y[3:]
        g = np.array([0.0, 0.0, -9.81])
        return np.concatenate([v, -(v @ v) * n + 1.5 * (g - (g @ n) * n) - 0.3 * v])

    begin = np.concatenate([2.0 * found[:, 0], 2.0 * speeds[:, 0]])
    true = solve_ivp(rate, (0.0, 1.0), begin, method="DOP853", rtol=1e-11, atol=1e-12, t_eval=result.time).y
    assert_allclose(2.0 * found, true[:3], atol=1e-6)
    spins = [sum(result[f"bar.angular_velocity.{a}"][i] * found["xyz".index(a), i] for a in "xyz") for i in range(11)]
    assert_allclose(spins, 0.0, atol=1e-7)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("damping", [0.0, 5.0])
def test_a_buffer_without_mass_is_refused_by_name(form: str, damping: float) -> None:
    """Its place would be read from a force that is there while it touches: the error named a symbol."""
    scene = Scene(space="line")
    ground, pad, mass = scene.add("g", Ground()), scene.add("pad", Mass1D(mass=0.0)), scene.add("m", Mass1D(mass=1.0))
    touch = scene.add("c", DistanceContact(lower=0.2))
    for name, part in {"s": Spring(stiffness=100.0, natural_length=1.0), "d": Damper(damping=damping)}.items():
        added = scene.add(name, part)
        scene.connect(ground.frame, added.a)
        scene.connect(pad.flange, added.b)
    scene.connect(pad.flange, touch.a)
    scene.connect(mass.flange, touch.b)
    scene.start.update({"m.displacement": 2.0, "m.speed": -2.0})
    with pytest.raises(AtwoodError, match=r"^pad: it has no mass, and c\.above_lower acts on it.*Give it a mass"):
        simulate(scene, form=form, t_end=1.0)


@pytest.mark.parametrize("form", FORMS)
def test_a_shaft_without_inertia_before_a_clutch_is_refused_by_name(form: str) -> None:
    scene = Scene()
    motor, between, load = (scene.add(name, Inertia(moment=m)) for name, m in (("a", 1.0), ("b", 0.0), ("c", 2.0)))
    spring, clutch = scene.add("s", RotationalSpringDamper(stiffness=9.0)), scene.add("k", RotationalFriction())
    for one, other in ((motor, spring.a), (between, spring.b), (between, clutch.a), (load, clutch.b)):
        scene.connect(one.flange, other)
    scene.start.update({"a.angle": 0.0, "a.angular_velocity": 3.0, "c.angle": 0.0, "c.angular_velocity": 0.0})
    with pytest.raises(AtwoodError, match=r"^b: it has no mass, and k\.slip acts on it"):
        simulate(scene, form=form, t_end=1.0)
