"""Clutches, brakes, freewheels and lossy gears: examples of the Modelica Standard Library, and answers by hand."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import atwood as aw
from atwood import Component, Scalar, Scene, Shaft, connector, simulate, unilateral
from atwood_library import (
    Inertia,
    LossyGear,
    OneWayClutch,
    RotationalFriction,
    RotationalSource,
    RotationalStop,
)

FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])
TURN = 2.0 * math.pi


def run(scene: Scene, form: str, end: float, **options: object) -> aw.Result:
    return simulate(scene, form=form, t_end=end, rtol=1e-10, outputs=[0.0, end], **options)


def times(result: aw.Result, *kinds: str) -> list[float]:
    return [one.time for one in result.events if one.kind in kinds]


def train(speeds: dict[str, float], moments: dict[str, float]) -> Scene:
    """Return a scene with rotors at angle zero."""
    scene = Scene()
    for name, moment in moments.items():
        scene.add(name, Inertia(moment=moment))
    for name, speed in speeds.items():
        scene.start.update({f"{name}.angle": 0.0, f"{name}.angular_velocity": speed})
    return scene


def push(scene: Scene, name: str, rotor: str, torque: object) -> None:
    source = scene.add(name, RotationalSource(value=torque, against="ground"))
    scene.connect(getattr(scene, rotor).flange, source.b)


def lossy_train(bearing: bool) -> Scene:
    scene = train({"J2": 0.0}, {"J1": 1.0, "J2": 1.5})
    gear = scene.add("gear", LossyGear(ratio=2.0, efficiency_a="0.5", efficiency_b="0.5"))
    scene.connect(scene.J1.flange, gear.a)
    scene.connect(scene.J2.flange, gear.b)
    push(scene, "drive", "J1", lambda t: 10.0 * aw.sin(TURN * t))
    push(scene, "load", "J2", lambda t: -10.0 + 2.5 * t)
    if bearing:
        rub = scene.add("bearing", RotationalFriction(sliding="0.5 + 0.5*v", against="ground"))
        scene.connect(scene.J1.flange, rub.b)
    return scene


@FORMS
def test_modelica_s_lossy_gear_locks_itself(form: str) -> None:
    """Modelica.Mechanics.Rotational.Examples.LossyGearDemo1."""
    result = run(lossy_train(False), form, 0.5)
    assert times(result, "sticks", "slips") == pytest.approx(
        [0.0804771339, 0.1995199008, 0.3713427780, 0.4645394616], abs=1e-10
    )
    assert result["gear.input_torque"][-1] == pytest.approx(0.25 * float(result["gear.torque_b"][-1]))


def by_one_equation(end: float) -> tuple[list[float], float]:
    """Return when the rotors of LossyGearDemo2 stop and go, and the angle of the first: one speed, piece by piece."""

    def drive(t: float) -> float:
        return 10.0 * math.sin(TURN * t)

    def load(t: float) -> float:
        return -10.0 + 2.5 * t

    def rate(t: float, w: float, way: int) -> float:
        for share in (2.0, 0.5):  # the torque of a, over that which is passed on: where a drives, and where b does
            a = (drive(t) - way * (0.5 + 0.5 * abs(w)) + 0.5 * share * load(t)) / (1.0 + 0.375 * share)
            if (way * (0.75 * a - load(t)) > 0.0) == (share == 2.0):
                return a
        raise AssertionError("one of both drives")

    def pushed(t: float, way: int) -> float:
        return way * (drive(t) + (1.0 if way > 0 else 0.25) * load(t)) - 0.5

    t, way, angle, found = 0.0, -1, 0.0, []
    while True:
        begin = t
        stops: Callable[[float, np.ndarray], float] = lambda t, y: way * y[1] if t > begin + 1e-6 else 1.0  # noqa: B023, E731
        stops.terminal = True  # type: ignore[attr-defined]
        law = lambda t, y: [y[1], rate(t, y[1], way)]  # noqa: B023, E731
        piece = solve_ivp(law, (t, end), [angle, 0.0], events=stops, rtol=1e-13, atol=1e-15, method="DOP853")
        angle = float(piece.y[0, -1])
        if not len(piece.t_events[0]):
            return found, angle
        t = float(piece.t_events[0][0])
        grid = np.linspace(t, end, 501)
        goes = [
            (brentq(pushed, low, high, args=(side,), xtol=1e-15), side)
            for side in (1, -1)
            for low, high in pairwise(grid)
            if pushed(low, side) < 0.0 <= pushed(high, side)
        ]
        found.append(t)
        t, way = min(goes)
        found.append(t)


@FORMS
def test_modelica_s_lossy_gear_with_a_bearing_that_sticks_too(form: str) -> None:
    """Modelica.Mechanics.Rotational.Examples.LossyGearDemo2: how two that stick share a torque is not determined."""
    known, angle = by_one_equation(0.5)
    result = run(lossy_train(True), form, 0.5)
    found = np.array(times(result, "sticks", "slips"))
    assert len(known) == 4
    for one in known:
        assert np.min(np.abs(found - one)) < 1e-10
    assert result["J1.angle"][-1] == pytest.approx(angle, abs=1e-11)


@FORMS
def test_modelica_s_lossy_gear_of_which_no_side_drives_for_sure(form: str) -> None:
    """Modelica.Mechanics.Rotational.Examples.LossyGearDemo3: bearings rub with 0.625 and 2.5 N m."""
    scene = train({"b": 10.0}, {"a": 1e-3, "b": 1e-3})
    losses = {"efficiency_a": "0.25", "efficiency_b": "0.25", "bearing_a": "0.625", "bearing_b": "2.5"}
    gear = scene.add("gear", LossyGear(ratio=1.0, **losses))
    scene.connect(scene.a.flange, gear.a)
    scene.connect(scene.b.flange, gear.b)
    push(scene, "load", "b", lambda t: aw.select(t < 0.5, 0.0, 1.0))
    result = run(scene, form, 1.0)
    # Both slow down alike: with the torque T of a, 4 (T - bearing) is not what goes on but T/4 - 2.5 = -T.
    slowing = (2.0 - 1.0) * 0.5 / 1e-3
    assert times(result, "sticks", "slips") == pytest.approx([10.0 / slowing], abs=1e-12)
    assert result["b.angle"][-1] == pytest.approx(50.0 / slowing, abs=1e-12)


def one_way(engaged: bool) -> Scene:
    scene = train({"a": -0.5, "b": 0.0}, {"a": 1.0, "b": 1.0})
    if engaged:
        push(scene, "motor", "a", lambda t: 10.0 * aw.sin(3.0 * TURN * t))
        level = lambda t: aw.select(t < 0.3, 0.0, aw.select(t < 0.95, 1.0, aw.select(t < 1.6, 0.0, 1.0)))  # noqa: E731
        clutch = scene.add("clutch", OneWayClutch(sliding="1.5", peak=25.0, level=level))
    else:
        push(scene, "motor", "a", lambda t: 0.3 + 10.0 * aw.sin(2.0 * TURN * t))
        push(scene, "load", "b", -0.3)
        clutch = scene.add("clutch", OneWayClutch())
    scene.connect(scene.a.flange, clutch.a)
    scene.connect(scene.b.flange, clutch.b)
    return scene


@FORMS
def test_modelica_s_freewheel(form: str) -> None:
    """Modelica.Mechanics.Rotational.Examples.OneWayClutchDisengaged; the torques and speeds have formulas."""
    w = 2.0 * TURN

    def ahead(t: float, begin: float, speed: float) -> float:  # the speed of b past a, in free running
        return speed - 0.6 * (t - begin) + 10.0 / w * (math.cos(w * t) - math.cos(w * begin))

    opens = [(math.pi - math.asin(-0.06)) / w + 0.5 * i for i in range(4)]  # where 0.6 + 10 sin(w t) falls through zero
    closes = [brentq(ahead, 0.0, 0.2, args=(0.0, 0.5), xtol=1e-15)]
    closes += [brentq(ahead, begin + 0.3, begin + 0.49, args=(begin, 0.0), xtol=1e-15) for begin in opens[:3]]
    result = run(one_way(False), form, 2.0)
    assert times(result, "closes") == pytest.approx(closes, abs=1e-10)
    assert times(result, "opens") == pytest.approx(opens, abs=1e-10)


@FORMS
def test_modelica_s_one_way_clutch(form: str) -> None:
    """Modelica.Mechanics.Rotational.Examples.OneWayClutch: a clutch beside the freewheel that holds while engaged."""
    w = 3.0 * TURN

    def ahead(t: float, begin: float, speed: float, rubs: float) -> float:
        return speed - 2.0 * rubs * (t - begin) + 10.0 / w * (math.cos(w * t) - math.cos(w * begin))

    first = brentq(ahead, 0.0, 0.15, args=(0.0, 0.5, 0.0), xtol=1e-15)
    at = ahead(0.3, 1.0 / 6.0, 0.0, 0.0)
    second = brentq(ahead, 0.31, 0.49, args=(0.3, at, 1.5), xtol=1e-15)
    third = brentq(ahead, 0.96, 1.1, args=(0.95, 0.0, 0.0), xtol=1e-15)
    at = ahead(1.6, 7.0 / 6.0, 0.0, 0.0)
    fourth = brentq(ahead, 1.61, 1.9, args=(1.6, at, 1.5), xtol=1e-15)
    result = run(one_way(True), form, 2.0)
    assert times(result, "closes") == pytest.approx([first, second, third, fourth], abs=1e-10)
    assert times(result, "opens") == pytest.approx([1.0 / 6.0, 0.95, 7.0 / 6.0], abs=1e-10)
    assert result["a.angular_velocity"][-1] == pytest.approx(-0.25, abs=1e-9)  # the impulse of a sine is none


@FORMS
def test_a_freewheel_takes_part_in_impacts(form: str) -> None:
    """A stop throws the driven rotor back, and the freewheel takes the driving one along: both have one speed then."""
    scene = train({"a": 1.0, "b": 1.0}, {"a": 3.0, "b": 2.0})
    clutch, stop = (
        scene.add("clutch", OneWayClutch()),
        scene.add("stop", RotationalStop(upper=0.5, restitution=0.8, against="ground")),
    )
    for rotor, end in ((scene.a, clutch.a), (scene.b, clutch.b), (scene.b, stop.b)):
        scene.connect(rotor.flange, end)
    result = run(scene, form, 1.0)
    assert times(result, "impact")[0] == pytest.approx(0.5)
    assert [float(result[f"{one}.angular_velocity"][-1]) for one in "ab"] == pytest.approx([-0.8, -0.8])
    assert [float(result[f"{one}.angle"][-1]) for one in "ab"] == pytest.approx([0.1, 0.1])


@FORMS
def test_a_peak_lets_go_late(form: str) -> None:
    """Pulled ahead by 4 t the clutch holds until twice its friction, and then rubs with the friction alone."""
    scene = train({"a": 0.0, "b": 0.0}, {"a": 1e6, "b": 2.0})
    clutch = scene.add("clutch", OneWayClutch(sliding="1.0", peak=2.0))
    scene.connect(scene.a.flange, clutch.a)
    scene.connect(scene.b.flange, clutch.b)
    push(scene, "pull", "b", lambda t: 4.0 * t)
    result = run(scene, form, 1.0)
    assert times(result, "opens") == pytest.approx([0.5 * (1.0 + 2e-6)], abs=1e-9)
    speed = (2.0 * (1.0 - 0.25) - 0.5) / 2.0
    assert result["b.angular_velocity"][-1] == pytest.approx(speed, abs=1e-5)


@FORMS
def test_two_brakes_on_one_shaft_hold_it_together(form: str) -> None:
    scene = train({"J": 1.0}, {"J": 1.0})
    push(scene, "motor", "J", lambda t: 1.4 * aw.sin(2.0 * t))
    for name, size in (("f", 0.5), ("g", 1.0)):
        brake = scene.add(name, RotationalFriction(sliding=str(size), against="ground"))
        scene.connect(scene.J.flange, brake.b)
    result = run(scene, form, 4.0)
    stop = brentq(lambda t: 1.0 - 1.5 * t + 0.7 * (1.0 - math.cos(2.0 * t)), 1.0, 2.0, xtol=1e-15)
    angle = stop - 0.75 * stop**2 + 0.7 * stop - 0.35 * math.sin(2.0 * stop)
    assert times(result, "sticks")[:1] == pytest.approx([stop], abs=1e-9)
    assert result["J.angle"][-1] == pytest.approx(angle, abs=1e-9)
    assert result["f.torque"][-1] + result["g.torque"][-1] == pytest.approx(-1.4 * math.sin(8.0), abs=1e-8)


@pytest.mark.parametrize(("moment", "pace"), [(1e-6, 1e3), (1e6, 1e-3)])
def test_a_freewheel_of_another_size(moment: float, pace: float) -> None:
    """Moments and times scaled by the same laws: all times are those of the freewheel of size one."""
    scene = train({"b": 0.0, "a": -0.5 * pace}, {"b": moment, "a": moment})  # and in another order
    unit = moment * pace * pace
    push(scene, "load", "b", -0.3 * unit)
    push(scene, "motor", "a", lambda t: unit * (0.3 + 10.0 * aw.sin(2.0 * TURN * pace * t)))
    clutch = scene.add("another_name", OneWayClutch())
    scene.connect(scene.a.flange, clutch.a)
    scene.connect(scene.b.flange, clutch.b)
    result = run(scene, "reduced", 1.0 / pace)
    opens = [(math.pi - math.asin(-0.06)) / (2.0 * TURN) + 0.5 * i for i in range(2)]
    assert [pace * one for one in times(result, "opens")] == pytest.approx(opens, abs=1e-9)


def test_a_freewheel_that_starts_the_wrong_way_is_refused() -> None:
    scene = one_way(False)
    scene.start["a.angular_velocity"] = 0.5
    with pytest.raises(aw.StartError, match=r"clutch: it starts the way that is locked, at 0\.5 rad/s"):
        simulate(scene, t_end=1.0)


def test_a_gap_that_is_no_affine_function_of_velocities_is_refused() -> None:
    class Curved(Component):
        """A gap that reads the square of a speed."""

        b: Shaft = connector(Shaft, "The angle.")

        @unilateral(reaction="torque", unit="N*m", level="velocity", doc="Its torque.")
        def ahead(self) -> Scalar:
            """Its speed, squared."""
            return self.b.rate * self.b.rate - 1.0

    scene = train({"a": 2.0}, {"a": 1.0})
    curved = scene.add("curved", Curved())
    scene.connect(scene.a.flange, curved.b)
    with pytest.raises(aw.AtwoodError, match=r"curved\.ahead.*linear in the velocities|linear in the velocities"):
        simulate(scene, t_end=1.0)
