"""Ratchets, brakes, stops with friction and a gear shift, against formulas and equations solved piece by piece."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import atwood as aw
from atwood import Scene, simulate
from atwood_library import (
    Inertia,
    Mass1D,
    PlanetaryGear,
    Ratchet,
    RotationalFriction,
    RotationalResistance,
    RotationalSource,
    TranslationalFriction,
    TranslationalSource,
    TranslationalStop,
)

FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])


def run(scene: Scene, form: str, end: float) -> aw.Result:
    return simulate(scene, form=form, t_end=end, rtol=1e-10, outputs=[0.0, end])


def kinds(result: aw.Result) -> list[str]:
    return [one.kind for one in result.events]


@FORMS
def test_a_ratchet_holds_the_last_tooth(form: str) -> None:
    """Thrown forwards at 2 rad/s against 1 N m, a wheel turns by 2 rad, past 3 of 10 teeth, and falls back to one."""
    scene = Scene()
    wheel, pawl = scene.add("wheel", Inertia(moment=1.0)), scene.add("pawl", Ratchet(teeth=10, against="ground"))
    load = scene.add("load", RotationalSource(value=-1.0, against="ground"))
    scene.connect(wheel.flange, pawl.b)
    scene.connect(wheel.flange, load.b)
    scene.start.update({"wheel.angle": 0.0, "wheel.angular_velocity": 2.0})
    result = run(scene, form, 4.0)
    pitch = 0.2 * math.pi
    assert result["pawl.passed"][-1] == 3.0
    assert result["wheel.angle"][-1] == pytest.approx(3.0 * pitch, abs=1e-10)
    assert result["pawl.pawl_torque"][-1] == pytest.approx(1.0)
    (met,) = [one.time for one in result.events if one.kind == "impact"]
    assert met == pytest.approx(2.0 + math.sqrt(2.0 * (2.0 - 3.0 * pitch)), abs=1e-9)


@FORMS
def test_modelica_s_translational_brake(form: str) -> None:
    """Modelica.Mechanics.Translational.Examples.Brake: with 1 N from 0.1 s on, 1 kg stops a second later, and stays."""
    scene = Scene()
    mass = scene.add("mass", Mass1D(mass=1.0))
    level = lambda t: aw.select(t < 0.1, 0.0, 2.0)  # noqa: E731
    brake = scene.add("brake", TranslationalFriction(sliding="0.5", against="ground", level=level))
    scene.connect(mass.slide, brake.b)
    scene.start.update({"mass.displacement": 0.0, "mass.speed": 1.0})
    result = run(scene, form, 2.0)
    assert result.events[-1].kind == "sticks"
    assert result.events[-1].time == pytest.approx(1.1, abs=1e-11)
    assert result["mass.displacement"][-1] == pytest.approx(0.6, abs=1e-11)


def stribeck_by_hand(
    end: float, coulomb: float, peak: float, stiff: float, force: float, start: list[float], ends: float
):
    """Return the displacement of a mass of 1 kg with friction, a spring or a force, and plastic stops."""

    def friction(v: float) -> float:
        return v + coulomb + peak * math.exp(-2.0 * v)

    def pull(t: float, x: float) -> float:
        return force * math.sin(0.5 * math.pi * t) - stiff * (x + 0.25)

    t, x, v = 0.0, *start
    while t < end:
        way = math.copysign(1.0, v) if v else 0.0
        if not way:
            grid = np.linspace(t, end, 20001)
            over = [s for s in grid if abs(pull(s, x)) > friction(0.0)]
            if not over:
                return x
            low, high = max(t, over[0] - (grid[1] - grid[0])), over[0]
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if abs(pull(middle, x)) > friction(0.0) else (middle, high)
            t, way = high, math.copysign(1.0, pull(high, x))
        begin = t
        stops = lambda s, y: way * y[1] if s > begin + 1e-7 else 1.0  # noqa: B023, E731
        hits = lambda s, y: ends - way * y[0]  # noqa: B023, E731
        stops.terminal = hits.terminal = True  # type: ignore[attr-defined]
        law = lambda s, y: [y[1], pull(s, y[0]) - way * friction(way * y[1])]  # noqa: B023, E731
        piece = solve_ivp(law, (t, end), [x, v], events=[stops, hits], rtol=1e-13, atol=1e-14, method="DOP853")
        t, x, v = float(piece.t[-1]), float(piece.y[0, -1]), 0.0
        if len(piece.t_events[1]):
            x = way * ends
    return x


@FORMS
def test_modelica_s_translational_friction_of_a_mass_that_is_pushed(form: str) -> None:
    """Modelica.Mechanics.Translational.Examples.Friction, stop1: Stribeck's friction as a function of the speed."""
    scene = Scene()
    mass = scene.add("mass", Mass1D(mass=1.0))
    rub = scene.add("rub", TranslationalFriction(sliding="v + 5 + 10*exp(-2*v)", against="ground"))
    push = scene.add("push", TranslationalSource(value=lambda t: 25.0 * aw.sin(0.5 * math.pi * t), against="ground"))
    scene.connect(mass.slide, rub.b)
    scene.connect(mass.slide, push.b)
    scene.start.update({"mass.displacement": 0.0, "mass.speed": 0.0})
    result = run(scene, form, 5.0)
    known = stribeck_by_hand(5.0, 5.0, 10.0, 0.0, 25.0, [0.0, 0.0], 25.0)
    assert result["mass.displacement"][-1] == pytest.approx(known, abs=1e-9)


@pytest.mark.parametrize("space", ["line", "plane"])
@FORMS
def test_modelica_s_translational_friction_of_a_mass_between_stops(form: str, space: str) -> None:
    """The same, stop2: a mass on a spring runs into a stop, goes back and stays where friction holds it."""
    scene = Scene(space=space)
    mass = scene.add("mass", Mass1D(mass=1.0))
    rub = scene.add("rub", TranslationalFriction(sliding="v + 3 + 5*exp(-2*v)", against="ground"))
    law = TranslationalSource(value=0.0, against="ground", law=lambda x: -500.0 * (x + 0.25))
    spring, stop = (
        scene.add("spring", law),
        scene.add("stop", TranslationalStop(lower=-0.4, upper=0.4, against="ground")),
    )
    for end in (rub.b, spring.b, stop.b):
        scene.connect(mass.slide, end)
    scene.start.update({"mass.displacement": 0.0, "mass.speed": -5.0})
    result = run(scene, form, 5.0)
    known = stribeck_by_hand(5.0, 3.0, 5.0, 500.0, 0.0, [0.0, -5.0], 0.4)
    assert kinds(result).count("impact") == 1
    assert result["mass.displacement"][-1] == pytest.approx(known, abs=1e-9)
    assert abs(500.0 * (known + 0.25)) < 8.0


@FORMS
def test_modelica_s_simple_gear_shift(form: str) -> None:
    """Modelica.Mechanics.Rotational.Examples.SimpleGearShift: before and after the shift speeds have formulas."""
    nominal = 10.471975511966
    scene = Scene()
    engine, load, ring = (
        scene.add(name, Inertia(moment=m)) for name, m in (("engine", 1.0), ("load", 10.0), ("ring", 0.0))
    )
    gear = scene.add("gear", PlanetaryGear(ratio=1.5))
    rise = lambda t: aw.select(t < 2.0, 0.0, aw.select(t < 2.1, 10.0 * (t - 2.0), 1.0))  # noqa: E731
    clutch = scene.add("clutch", RotationalFriction(sliding="100", level=rise))
    brake = scene.add("brake", RotationalFriction(sliding="100", against="ground", level=lambda t: 1.0 - rise(t)))
    push = scene.add("push", RotationalSource(value=lambda t: aw.select(t < 0.5, 0.0, 20.0), against="ground"))
    drag = scene.add("drag", RotationalResistance(quadratic=20.0 / nominal**2))
    for rotor, end in (
        (engine, gear.sun),
        (load, gear.carrier),
        (ring, gear.ring),
        (engine, clutch.a),
        (ring, clutch.b),
        (ring, brake.b),
        (engine, push.b),
        (load, drag.b),
    ):
        scene.connect(rotor.flange, end)
    for name in ("load", "engine"):
        scene.start.update({f"{name}.angle": 0.0, f"{name}.angular_velocity": 0.0})
    result = simulate(scene, form=form, t_end=5.0, rtol=1e-10, outputs=[0.0, 2.0, 4.0, 5.0])
    final, moment = nominal * math.sqrt(2.5), 10.0 + 2.5**2
    first = final * math.tanh(50.0 * 1.5 / (moment * final))
    assert result["load.angular_velocity"][1] == pytest.approx(first, abs=1e-9)
    assert result["engine.angular_velocity"][1] == pytest.approx(2.5 * first, abs=1e-9)
    assert result["engine.angular_velocity"][-1] == pytest.approx(float(result["load.angular_velocity"][-1]), abs=1e-9)
    before, after = (float(result["load.angular_velocity"][k]) / nominal for k in (2, 3))
    slope = 20.0 / (11.0 * nominal)  # w' = slope (1 - w^2), in units of the nominal speed
    assert (after - 1.0) / (after + 1.0) == pytest.approx(
        (before - 1.0) / (before + 1.0) * math.exp(-2.0 * slope), abs=1e-9
    )
