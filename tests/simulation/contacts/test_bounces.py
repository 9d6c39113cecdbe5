"""Impacts that are made without Python, against the same impacts made in Python."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from tests.helpers.contact_scenes import box_of_walls

import atwood as aw
from atwood import Component, Point, Scalar, Scene, connector, cos, dry_friction, parameter, simulate, unilateral
from atwood.integrators.explicit_session import ExplicitSession
from atwood.simulation.contacts import changes, compiled
from atwood.simulation.events.modes import EventProbe
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.preparation import problem_of_run
from atwood.simulation.run import session
from atwood.simulation.run.run import Walk
from atwood_library import (
    Box,
    BoxContact,
    DistanceContact,
    Force,
    Ground,
    Inertia,
    Link,
    PointContact,
    PointMass,
    RotationalFriction,
    RotationalSource,
    RotationalStop,
    SurfaceContact,
    VertexContact,
)
from atwood_library.scenes import SCENES


def in_a_box() -> tuple[Scene, float]:
    return box_of_walls(0.95, 0.1, 2.0, 1.5), 6.0


def in_a_circle() -> tuple[Scene, float]:
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
    contact = scene.add("c", SurfaceContact(function="0.25 - x**2 - z**2", restitution=0.99))
    scene.connect(ground.frame, contact.a)
    scene.connect(m.point, contact.b)
    scene.start.update({"m.position.x": 0.1, "m.position.z": 0.0, "m.velocity.x": 0.3, "m.velocity.z": 0.0})
    return scene, 4.0


def with_play() -> tuple[Scene, float]:
    scene = Scene()
    a, b = scene.add("a", Inertia(moment=1.0)), scene.add("b", Inertia(moment=2.0))
    play = scene.add("play", RotationalStop(lower=-0.1, upper=0.1, restitution=0.9))
    scene.connect(a.flange, play.a)
    scene.connect(b.flange, play.b)
    scene.start.update({"a.angle": 0.0, "b.angle": 0.0, "a.angular_velocity": 5.0, "b.angular_velocity": 0.0})
    return scene, 1.0


def on_a_floor() -> tuple[Scene, float]:
    """It comes to rest after 1.1 s, by the series of its impacts."""
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=2.0))
    floor = scene.add("floor", PointContact(restitution=0.5))
    scene.connect(ground.frame, floor.plane)
    scene.connect(m.point, floor.point)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.6, "m.velocity.x": 0.0, "m.velocity.z": 0.0})
    return scene, 2.0


def on_a_rough_floor() -> tuple[Scene, float]:
    """It bounces with friction, and comes to rest after 4.2 s."""
    scene, end = on_a_floor()
    scene["floor"].friction, scene["floor"].restitution = 0.1, 0.8
    scene.start["m.velocity.x"] = 0.5
    return scene, 2.0 * end


def on_a_belt() -> tuple[Scene, float]:
    """It sticks and slips."""
    return SCENES["stick-slip"](), 10.0


def between_walls() -> tuple[Scene, float]:
    """It slips to and fro on a floor, sticks, and bounces against walls."""
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.5))
    floor = scene.add("floor", PointContact(friction=0.3))
    push = scene.add("push", Force(value=lambda t: 9.0 * cos(4.0 * t)))
    scene.connect(ground.frame, floor.plane)
    scene.connect(m.point, floor.point)
    scene.connect(m.point, push.point)
    for name, side in (("left", 1.0), ("right", -1.0)):
        carrier = scene.add(f"at_{name}", Ground(position=(-0.1 * side, 0.0, 0.0)))
        wall = scene.add(name, PointContact(normal=(side, 0.0, 0.0), restitution=0.6, friction=0.1))
        scene.connect(carrier.frame, wall.plane)
        scene.connect(m.point, wall.point)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.0, "m.velocity.x": 0.4, "m.velocity.z": 0.0})
    return scene, 6.0


def clutched() -> tuple[Scene, float]:
    """Rotors between clutches that slip and stick in turn, as torques say."""
    scene = Scene()
    rotors = [scene.add(f"r{i}", Inertia(moment=1.0 + i)) for i in range(3)]
    for i, torque in enumerate((lambda t: 8.0 * cos(3.0 * t), lambda t: 3.0 * cos(7.0 * t + 1.0))):
        source = scene.add(f"s{i}", RotationalSource(value=torque, against="ground"))
        scene.connect(rotors[i].flange, source.b)
        clutch = scene.add(f"c{i}", RotationalFriction(sliding=str(1.5 + i), peak=1.2))
        scene.connect(rotors[i].flange, clutch.a)
        scene.connect(rotors[i + 1].flange, clutch.b)
    scene.start.update({f"r{i}.angle": 0.0 for i in range(3)} | {f"r{i}.angular_velocity": 1.0 * i for i in range(3)})
    return scene, 8.0


class Falling(Component):
    """A floor that falls away at first, and comes back."""

    p: Point = connector(Point, "What touches it.")
    restitution: float = parameter(0.5, doc="Share of the speed that is left.")

    @unilateral(reaction="force", unit="N", restitution="restitution", doc="Force of the floor.")
    def gap(self) -> Scalar:
        """Height above the floor."""
        return self.p.position.z - 0.3 * (cos(6.0 * self.time) - 1.0)


def test_an_impact_of_what_began_at_zero_has_no_margin(monkeypatch: pytest.MonkeyPatch) -> None:
    """It rests on the floor, is left behind once a turn, and falls: a margin would make that impact late by 1e-5 s."""
    scene = Scene()
    scene.connect(scene.add("m", PointMass(mass=1.0)).point, scene.add("falling", Falling()).p)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.0, "m.velocity.x": 0.0, "m.velocity.z": 0.0})

    def impacts() -> list[float]:
        events = simulate(scene, t_end=1.5, rtol=1e-6).events
        assert [one.kind for one in events].count("opens") == 1
        return [one.time for one in events if one.kind == "impact"]

    quick = impacts()
    monkeypatch.setattr(session, "_MANY_IMPACTS", math.inf)
    assert quick == pytest.approx(impacts(), abs=1e-9)


class RoughFalling(Falling):
    """The same floor, and it rubs."""

    @dry_friction(at="gap", reaction="friction", unit="N", limit="most", doc="Friction of the floor.")
    def slip(self) -> Scalar:
        """Speed along the floor."""
        return self.p.velocity.x

    def most(self) -> Scalar:
        """Limit of friction."""
        return 0.1 * self.reaction("force")


@pytest.mark.parametrize(
    ("form", "solver", "floor", "one_by_one"),
    [
        ("reduced", "explicit", RoughFalling, False),
        ("dae", "explicit", RoughFalling, True),
        ("reduced", "explicit", Falling, False),
        ("reduced", "taylor", RoughFalling, False),
        ("dae", "ida", RoughFalling, False),
    ],
)
def test_samples_just_behind_an_impact_are_those_after_it(
    form: str, solver: str, floor: type[Falling], one_by_one: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its event has a margin, and is seen late: until then nothing says that a sample is one of the step before."""
    if one_by_one:  # as near a limit of steps
        monkeypatch.setattr(ExplicitSession, "_sample_quickly", lambda *given: (0, None))
    scene = Scene()
    scene.connect(scene.add("m", PointMass(mass=1.0)).point, scene.add("floor", floor()).p)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.0, "m.velocity.x": 1.0, "m.velocity.z": 0.0})

    def ran(outputs: Sequence[float]) -> aw.Result:
        return simulate(scene, form=form, solver=solver, t_end=0.3, rtol=1e-6, outputs=outputs)

    impact = ran([0.0, 0.3]).impacts[0]
    behind = ran([0.0, *(impact.time + np.array([1e-7, 1e-6, 4e-6])), 0.3])
    at = [int(np.searchsorted(behind.time, impact.time + late - 1e-9)) for late in (1e-7, 1e-6, 4e-6)]
    assert behind.impacts[0].time == pytest.approx(impact.time, abs=1e-12)
    assert behind["floor.gap"][at] == pytest.approx(impact.after * (behind.time[at] - impact.time), rel=1e-3)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(
    "make", [in_a_box, in_a_circle, with_play, on_a_floor, on_a_rough_floor, on_a_belt, between_walls, clutched]
)
def test_impacts_without_python_are_those_with_it(
    make: Callable[[], tuple[Scene, float]], form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, end = make()
    calls = list[float]()
    resolve = changes.resolve
    monkeypatch.setattr(changes, "resolve", lambda *given: (calls.append(given[1][0]), resolve(*given))[1])

    def run() -> tuple[aw.Result, int]:
        calls.clear()
        result = simulate(scene, form=form, t_end=end, rtol=1e-10, outputs=np.linspace(0.0, end, 7))
        return result, len(calls)

    quick, few = run()
    monkeypatch.setattr(session, "_MANY_IMPACTS", math.inf)
    monkeypatch.setattr(session, "MANY_CHANGES", math.inf)
    monkeypatch.setattr(compiled, "FEW_ROWS", 0)
    slow, many = run()
    assert [(one.part, one.kind) for one in quick.events] == [(one.part, one.kind) for one in slow.events]
    assert [one.time for one in quick.events] == pytest.approx([one.time for one in slow.events], abs=1e-11)
    assert quick.statistics.steps == pytest.approx(slow.statistics.steps, rel=0.02, abs=1)  # at the same tolerance
    assert len(quick.impacts) == len(slow.impacts)
    assert len(quick.events) > 6
    for one, other in zip(quick.impacts, slow.impacts, strict=True):
        assert (one.impulse, one.before, one.after, one.loss) == pytest.approx(
            (other.impulse, other.before, other.after, other.loss), abs=1e-9
        )
    # Bodies that are held are looked at at each impact.
    assert few < 0.7 * many or (make is with_play and form == "dae")
    if make in (in_a_box, on_a_rough_floor, on_a_belt, clutched):
        assert few == 1  # the start
    assert len(quick.run.segments) == len(slow.run.segments)
    for one, other in zip(quick.run.segments, slow.run.segments, strict=True):
        assert (one.impact, len(one.time)) == (other.impact, len(other.time))
        assert one.coordinates == pytest.approx(other.coordinates, abs=1e-10)
        assert one.speeds == pytest.approx(other.speeds, abs=1e-10)


@pytest.mark.parametrize("make", [in_a_box, on_a_rough_floor, on_a_belt])
def test_events_that_are_made_when_asked_for_are_those_of_their_run(make: Callable[[], tuple[Scene, float]]) -> None:
    """An assembly goes on with its sessions, whose memory the next run overwrites."""
    scene, end = make()
    assembly = aw.assemble(scene)
    first = simulate(assembly, t_end=end, outputs=5, rtol=1e-10)
    again = simulate(assembly, t_end=0.7 * end, outputs=5, rtol=1e-10)
    loaded = pickle.loads(pickle.dumps(simulate(assembly, t_end=end, outputs=5, rtol=1e-10)))
    alone = simulate(make()[0], t_end=end, outputs=5, rtol=1e-10)
    for one in (first, loaded):
        assert one.events == alone.events
        assert len(one.run.segments) == len(alone.run.segments)
        assert all(np.array_equal(one[name], alone[name]) for name in alone)
    before = [event for event in alone.events if event.time <= 0.7 * end]
    assert [event.kind for event in again.events] == [event.kind for event in before]
    assert [event.time for event in again.events] == pytest.approx([event.time for event in before], abs=1e-11)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_where_a_second_end_comes_to_touch_both_rest(form: str) -> None:
    """Forces along the rod are shared in many ways, by some of which neither end slips: one did, at no speed."""
    scene, c, s = Scene(), math.cos(0.1), math.sin(0.1)
    ground, rod = scene.add("ground", Ground()), scene.add("rod", Link(length=0.5, mass=1.0))
    for end, frame in (("a", rod.a), ("b", rod.b)):
        contact = scene.add(f"on_{end}", VertexContact(normal=(-s, 0.0, c), friction=0.3))
        scene.connect(ground.frame, contact.plane)
        scene.connect(frame, contact.body)
    places = {"rod.position.x": 0.0, "rod.position.z": 0.37, "rod.angle": 0.01}
    scene.start.update(places | {"rod.velocity.x": -0.5, "rod.velocity.z": 0.0, "rod.angular_velocity": -0.28})
    result = simulate(scene, form=form, t_end=0.6, rtol=1e-9)
    assert [(one.part, one.kind) for one in result.events][-2:] == [("on_a", "sticks"), ("on_b", "sticks")]
    assert [result[f"on_{end}.slip_state"][-1] for end in "ab"] == [2.0, 2.0]


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_what_is_given_back_where_impacts_have_accumulated_is_in_the_ledger(form: str) -> None:
    """One mass comes to rest as another still rises, which has rubbed too much so far: its energy grows.

    In all, each is pressed by what its weight and its first speed ask for, and has rubbed as much.
    """
    e, mu, fast, high, g, scene = 0.6, 0.2, 6.0, 0.3, 9.81, Scene()
    rest = math.sqrt(2.0 * high / g) * (1.0 + e) / (1.0 - e)
    ground, thrown = scene.add("ground", Ground()), 1.00117872 * g * rest * (1.0 - e) / 2.0
    for name, (z, up) in {"a": (high, 0.0), "b": (0.0, thrown)}.items():
        mass = scene.add(name, PointMass(mass=1.0))
        floor = scene.add(f"under_{name}", PointContact(restitution=e, friction=mu))
        scene.connect(ground.frame, floor.plane)
        scene.connect(mass.point, floor.point)
        scene.start.update({f"{name}.position.x": 0.0, f"{name}.position.z": z})
        scene.start.update({f"{name}.velocity.x": fast, f"{name}.velocity.z": up})
    end = rest + 0.1
    result = simulate(scene, form=form, t_end=end, rtol=1e-9, outputs=5)
    assert any(one.kind == "rests" for one in result.events)
    for name, up in (("a", 0.0), ("b", thrown)):
        assert result[f"{name}.velocity.x"][-1] == pytest.approx(fast - mu * (g * end - up), rel=1e-12)
    assert result.energy.max_drift < 1e-7


def test_rounding_closes_no_gap_that_opens() -> None:
    """A gap that opens at zero is there to rounding, and closed again by it in each of thousands of moments."""
    chance = np.random.default_rng(1)
    for _ in range(20):
        scene, lean, along = Scene(), chance.uniform(0.1, 1.4), chance.uniform(0.5, 3.0)
        c, s = math.cos(lean), math.sin(lean)
        ground, mass = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
        floor = scene.add("floor", PointContact(normal=(-s, 0.0, c), restitution=0.3))
        scene.connect(ground.frame, floor.plane)
        scene.connect(mass.point, floor.point)
        scene.start.update({"m.position.x": along * c, "m.position.z": along * s})
        scene.start.update({"m.velocity.x": -1e-6 * s, "m.velocity.z": 1e-6 * c})
        assembly = aw.assemble(scene)
        start = find_start(assembly)
        q, u = start.coordinates, start.speeds
        plan = problem_of_run(assembly, 0.0, q, u, start.length, 1.0)
        probe = EventProbe(plan, 0.0, q, u, 1e-9)
        for _ in range(10):
            near = q * (1.0 + chance.choice([-2.0, 0.0, 2.0], len(q)) * np.finfo(float).eps)
            assert np.all(probe.values(0.0, near, u) > 0.0)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(("away", "speed"), [(1e-8, 1e-3), (-1e-7, 1e-3), (0.0, 1e-3), (1e-7, 0.5)])
def test_what_only_passes_near_by_does_not_rest_where_impacts_accumulate(form: str, away: float, speed: float) -> None:
    """A ball comes to rest on a floor with e 1/2. A wall that it meets a moment before or later throws it back."""
    fall = math.sqrt(2.0 / 9.81)
    rest = 3.0 * fall
    scene = Scene()
    ground, m, far = (
        scene.add("ground", Ground()),
        scene.add("m", PointMass(mass=1.0)),
        scene.add("far", Ground(position=(speed * rest + away, 0.0, 0.0))),
    )
    floor = scene.add("floor", PointContact(restitution=0.5))
    wall = scene.add("wall", PointContact(normal=(-1.0, 0.0, 0.0), restitution=0.5))
    for ends in ((ground.frame, floor.plane), (m.point, floor.point), (far.frame, wall.plane), (m.point, wall.point)):
        scene.connect(*ends)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 1.0, "m.velocity.x": speed, "m.velocity.z": 0.0})
    result = simulate(scene, form=form, t_end=rest + 0.2, rtol=1e-10, outputs=[0.0, rest + 0.2])
    told = {(one.part, one.kind): one.time for one in result.events if (one.part, one.kind) != ("floor", "impact")}
    assert set(told) == {("floor", "rests"), ("floor", "closes"), ("wall", "impact")}
    assert told["wall", "impact"] == pytest.approx(rest + away / speed, abs=1e-10)
    assert result["m.velocity.x"][-1] == pytest.approx(-0.5 * speed, rel=1e-9)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_what_time_events_make_of_a_set_is_the_same_by_the_routine_and_in_python(
    form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A start is looked at once, and its first session finds what follows each of two switches without Python."""
    in_python, plain = [], changes.resolve

    def counted(*given: object) -> changes.Changed:
        in_python.append(given)
        return plain(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(changes, "resolve", counted)
    assembly, found = aw.assemble(SCENES["clutches"](), form=form), []
    for counts in (1, 0, 2):
        in_python.clear()
        found.append([one for one in simulate(assembly, t_end=1.2, rtol=1e-10).events if one.kind != "event"])
        assert len(in_python) == counts
        if counts == 0:
            monkeypatch.setattr(compiled, "resolved", lambda *_: None)
            monkeypatch.setattr(Walk, "passes_moments", False)
    assert len(found[0]) == 8
    for other in found[1:]:
        assert [(one.part, one.kind) for one in other] == [(one.part, one.kind) for one in found[0]]
        assert [one.time for one in other] == pytest.approx([one.time for one in found[0]], abs=1e-12)


def squeezed_impacts(restitution: float, ratio: float, heights: tuple[float, float], end: float) -> list[float]:
    """Return when a light ball meets the floor, and a heavy one that falls upon it, by the formulas of free fall."""
    t, z, v, found = 0.0, list(heights), [0.0, 0.0], list[float]()
    while True:
        rate, gap = v[1] - v[0], z[1] - z[0] - 0.2
        on_floor = (v[0] + math.sqrt(v[0] ** 2 + 2.0 * 9.81 * z[0])) / 9.81
        together = max(-gap / rate, 0.0) if rate < 0.0 else math.inf
        step = min(on_floor, together)
        if t + step > end:
            return found
        t, z = t + step, [a + b * step - 0.5 * 9.81 * step**2 for a, b in zip(z, v, strict=True)]
        v = [b - 9.81 * step for b in v]
        if on_floor < together:
            z[0], v[0] = 0.0, -restitution * v[0]
        else:
            push = -(1.0 + restitution) * (v[1] - v[0]) / (1.0 + 1.0 / ratio)
            v = [v[0] - push, v[1] + push / ratio]
        found.append(t)


def squeezed(restitution: float, ratio: float) -> Scene:
    """Return a light ball that a heavy one falls upon."""
    scene = Scene(gravity=9.81)
    ground, a = scene.add("ground", Ground()), scene.add("a", PointMass(mass=1.0))
    b = scene.add("b", PointMass(mass=ratio))
    floor = scene.add("floor", PointContact(restitution=restitution))
    between = scene.add("between", DistanceContact(lower=0.2, restitution=restitution))
    for first, second in ((ground.frame, floor.plane), (a.point, floor.point), (a.point, between.a)):
        scene.connect(first, second)
    scene.connect(b.point, between.b)
    for name, height in (("a", 1.0), ("b", 1.5)):
        scene.start.update({f"{name}.position.x": 0.0, f"{name}.velocity.x": 0.0})
        scene.start.update({f"{name}.position.z": height, f"{name}.velocity.z": 0.0})
    return scene


def in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have impacts worked out in Python alone."""
    monkeypatch.setattr(session, "_MANY_IMPACTS", math.inf)
    monkeypatch.setattr(session, "MANY_CHANGES", math.inf)
    monkeypatch.setattr(compiled, "FEW_ROWS", 0)


@pytest.mark.parametrize("by", ["routine", "python"])
@pytest.mark.parametrize(
    ("restitution", "ratio", "rtol"), [(1.0, 100.0, 1e-6), (1.0, 1e4, 1e-6), (1.0, 1e5, 1e-10), (0.9, 100.0, 1e-10)]
)
def test_what_is_squeezed_by_what_is_heavy_bounces_on(
    restitution: float, ratio: float, rtol: float, by: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Intervals shrink while the heavy ball comes down, and grow as it rises again: the light one never rests."""
    if by == "python":
        in_python(monkeypatch)
        ratio = min(ratio, 1000.0)
    scene = squeezed(restitution, ratio)
    wanted = squeezed_impacts(restitution, ratio, (1.0, 1.5), 0.53)
    run = simulate(scene, t_end=0.53, rtol=rtol)
    assert len(run.impacts) == len(wanted) > 25
    assert not [one for one in run.events if one.kind == "rests"]
    np.testing.assert_allclose([one.time for one in run.impacts], wanted, rtol=1e-9)


@pytest.mark.parametrize(
    ("restitution", "ratio", "end", "by"),
    [
        (0.5, 10.0, 0.521831137414763, "python"),
        (0.5, 10.0, 0.521831137414763, "routine"),
        (0.9, 1e3, 0.515321972960409, "python"),
        (0.9, 1e3, 0.515321972960409, "routine"),
        (0.98, 1e5, 0.514841472467928, "routine"),
    ],
)
def test_what_is_squeezed_rests_when_its_impacts_have_ended(
    restitution: float, ratio: float, end: float, by: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Intervals shrink with the gap while the heavy ball has hardly lost speed; ends are sums of 9,000 in 60 digits."""
    if by == "python":
        in_python(monkeypatch)
    run = simulate(squeezed(restitution, ratio), t_end=0.6, rtol=1e-10)
    assert [one.time for one in run.events if one.kind == "rests"][:1] == pytest.approx([end], abs=3e-9)
    assert abs(run["b.velocity.z"][-1]) < 1e-9
    assert run["b.position.z"][-1] == pytest.approx(0.2, abs=1e-8)


@pytest.mark.parametrize(
    ("restitution", "mass", "known", "doubt"),
    [(0.95, 1e3, 0.533826055763, 4e-5), (0.98, 1e4, 0.515246397423, 4e-6), (0.9, 1e3, 0.515321972960, 0.0)],
)
def test_a_time_of_rest_says_by_how_much_it_may_be_off(
    restitution: float, mass: float, known: float, doubt: float
) -> None:
    """What a heavy body squeezes against the floor; known from 6,000 impacts in 60 digits."""
    scene = Scene()
    ground, floor = scene.add("ground", Ground()), scene.add("floor", PointContact(restitution=restitution))
    light, heavy = scene.add("light", PointMass(mass=1.0)), scene.add("heavy", PointMass(mass=mass))
    between = scene.add("between", DistanceContact(lower=0.2, restitution=restitution))
    ends = ((ground.frame, floor.plane), (light.point, floor.point), (light.point, between.a), (heavy.point, between.b))
    for one, other in ends:
        scene.connect(one, other)
    for name, height in (("light", 1.0), ("heavy", 1.5)):
        scene.start.update({f"{name}.position.x": 0.0, f"{name}.position.z": height})
        scene.start.update({f"{name}.velocity.{axis}": 0.0 for axis in "xz"})
    (rest,) = (one for one in simulate(scene, t_end=0.7, rtol=1e-10).events if one.kind == "rests")
    said = f", at a time that may be off by {doubt:.1g} s" if doubt else ""
    assert rest.message == f"impacts have accumulated: it rests{said}"
    assert rest.time == pytest.approx(known, rel=0.0, abs=doubt or 1e-9)


def dropped(restitution: tuple[float, float], mass: float, height: float) -> Scene:
    """Return a ball of 1 kg that falls from 1 m, and one above it."""
    scene = Scene()
    ground, floor = scene.add("ground", Ground()), scene.add("floor", PointContact(restitution=restitution[0]))
    below, above = scene.add("below", PointMass(mass=1.0)), scene.add("above", PointMass(mass=mass))
    between = scene.add("between", DistanceContact(lower=0.1, restitution=restitution[1]))
    ends = ((ground.frame, floor.plane), (below.point, floor.point), (below.point, between.a), (above.point, between.b))
    for one, other in ends:
        scene.connect(one, other)
    for name, z in (("below", 1.0), ("above", height)):
        scene.start.update({f"{name}.position.x": 0.0, f"{name}.position.z": z})
        scene.start.update({f"{name}.velocity.{axis}": 0.0 for axis in "xz"})
    return scene


@pytest.mark.parametrize("by", ["routine", "python"])
@pytest.mark.parametrize(
    ("restitution", "mass", "height", "known", "off"),
    [
        ((0.22, 0.37), 3.934, 1.544, 0.5468227739428173, 1e-10),
        ((0.27, 0.22), 4.694, 1.561, 0.5497453145222659, 1e-10),
        ((0.44, 0.4), 5.43, 1.724, 0.5896403517925674, 2e-5),
        ((0.6, 0.32), 5.44, 2.075, 0.6611587689524885, 2e-5),
        ((0.75, 0.77), 5.921, 1.853, 1.2287772744073808, 2e-4),
    ],
)
def test_two_gaps_whose_impacts_accumulate_in_turn_rest_at_once(
    restitution: tuple[float, float],
    mass: float,
    height: float,
    known: float,
    off: float,
    by: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two balls fall on each other; intervals of both alternate, or swing for ever; known from impacts in 60 digits."""
    if by == "python":
        in_python(monkeypatch)
    result = simulate(dropped(restitution, mass, height), t_end=known + 0.1, rtol=1e-10)
    *_, rest = (one for one in result.events if one.kind == "rests")
    assert rest.time == pytest.approx(known, rel=0.0, abs=off)
    _, _, doubt = rest.message.partition("may be off by ")
    assert abs(rest.time - known) <= max(1e-10, float(doubt.removesuffix(" s") or 0.0))
    assert result["above.position.z"][-1] == pytest.approx(0.1, abs=1e-7)
    assert not np.any(result["floor.gap"] < -1e-8)


def tilted_box() -> Scene:
    """Return a box that falls on a corner; the second comes to rest beside one that has."""
    scene = Scene()
    ground, box = (
        scene.add("ground", Ground()),
        scene.add("box", Box(mass=1.0, length_x=0.3, length_y=0.1, length_z=0.2)),
    )
    floor = scene.add("floor", BoxContact(length=0.3, width=0.1, height=0.2, friction=0.3, restitution=0.3))
    scene.connect(ground.frame, floor.plane)
    scene.connect(box.frame, floor.box)
    scene.start.update({"box.position.x": 0.0, "box.position.z": 0.4, "box.angle": 0.3, "box.angular_speed": 0.0})
    scene.start.update({"box.velocity.x": 0.0, "box.velocity.z": 0.0})
    return scene


@pytest.mark.parametrize("solver", ["explicit", "taylor"])
def test_a_rest_is_told_of_what_bounced(solver: str) -> None:
    """The rest of the second corner was told as one more of the first, with its old doubts."""
    events = simulate(tilted_box(), t_end=0.5, solver=solver).events
    rests = [one for one in events if one.kind == "rests"]
    assert [one.part for one in rests] == ["floor.corner[0]", "floor.corner[2]"]
    last = [max(each.time for each in events if each.kind == "impact" and each.part == one.part) for one in rests]
    assert all(0.0 < one.time - before < 1e-4 for one, before in zip(rests, last, strict=True))
    assert "may be off" in rests[0].message
    assert "may be off" not in rests[1].message
    told = [one.time for one in events]  # a rest is known ahead: it came before what happens until then
    assert told == sorted(told)
