"""Gaps and slips by IDA and by Taylor series: known answers, the events of the explicit method, and refusals."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from tests.helpers.contact_scenes import rough_pendulum

import atwood as aw
from atwood import Scene, UsageError, simulate
from atwood.integrators.python_calls import PythonCalls
from atwood.simulation.contacts import changes, compiled
from atwood_library import (
    BallContact,
    Damper,
    Ground,
    Inertia,
    Link,
    PointContact,
    PointMass,
    Rope,
    RotationalFriction,
    RotationalSource,
    Sphere,
    Spring,
    SurfaceContact,
    VertexContact,
)
from atwood_library.scenes import Clutches, FourBar, StickSlip

from .test_known_answers import FORMS, G, along, on_plane, on_slope, start_at, times

METHODS = pytest.mark.parametrize("solver", ["ida", "taylor"])


def run(scene: Scene, solver: str, form: str, end: float, rtol: float = 1e-10) -> aw.Result:
    return simulate(scene, solver=solver, form=form, t_end=end, rtol=rtol, outputs=[0.0, end])


@METHODS
@FORMS
def test_a_block_slides_up_a_slope_and_stays(solver: str, form: str) -> None:
    """Nothing creeps: it stays for 10,000 s."""
    result = run(on_slope(0.3, 1.0), solver, form, 1e4)
    slowing = G * (math.sin(0.3) + 0.4 * math.cos(0.3))
    assert times(result, "sticks") == [pytest.approx(1.0 / slowing, abs=1e-9)]
    assert along(result, 0.3, "position") == pytest.approx(0.5 / slowing, abs=1e-12)
    assert result["c.friction_force"][-1] == pytest.approx(2.0 * G * math.sin(0.3))


@METHODS
@FORMS
def test_a_ball_bounces_and_comes_to_rest(solver: str, form: str) -> None:
    scene = on_plane(PointMass(mass=2.0), PointContact(restitution=0.9))
    start_at(scene, 0.0, 1.0, 0.0, 0.0)
    result = run(scene, solver, form, 10.0)
    assert times(result, "impact")[9] == pytest.approx(5.4302180026, abs=1e-9)
    assert times(result, "rests")[-1] == pytest.approx(8.5789491787, abs=1e-9)
    assert result["m.position.z"][-1] == pytest.approx(0.0, abs=1e-12)


def stick() -> Scene:
    scene = on_plane(Link(length=1.0, mass=1.0), VertexContact(friction=0.25))
    scene.start.update({"m.angle": 0.5 * math.pi + 0.1, "m.angular_velocity": 0.0, "c.gap": 0.0, "c.slip": 0.0})
    return scene


def bead() -> Scene:
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
    contact = scene.add("c", SurfaceContact(function="x**2 + z**2 - 1"))
    scene.connect(ground.frame, contact.a)
    scene.connect(m.point, contact.b)
    start_at(scene, 0.0, 1.0, 0.5, 0.0)
    return scene


def cue_ball() -> Scene:
    scene = on_plane(Sphere(mass=1.0, radius=0.0286), BallContact(friction=0.25, radius=0.0286), space="space")
    start_at(scene, 0.0, 0.0286, 2.0, 0.0)
    scene.start.update({"m.position.y": 0.0, "m.velocity.y": 0.0})
    scene.start.update({f"m.angular_velocity.{axis}": value for axis, value in zip("xyz", (30, 40, 10), strict=True)})
    return scene


@METHODS
@FORMS
@pytest.mark.parametrize(
    ("make", "kind", "time"),
    [(stick, "slips", 0.4962296185), (bead, "opens", 0.7542388380), (cue_ball, "sticks", 0.1411949146)],
)
def test_times_of_events_are_known(make: Callable[[], Scene], kind: str, time: float, solver: str, form: str) -> None:
    assert times(run(make(), solver, form, time + 0.1), kind)[0] == pytest.approx(time, abs=1e-9)


@METHODS
def test_a_pendulum_with_friction_in_its_hinge_stays(solver: str) -> None:
    result = run(rough_pendulum(1.5), solver, "reduced", 15.0)
    assert (result.events[-1].kind, result.events[-1].time) == ("sticks", pytest.approx(13.6445534015, abs=1e-9))


def four_bar() -> Scene:
    """Return a four-bar whose crank strikes a floor under its pivot."""
    scene = FourBar()
    low = scene.add("low", Ground(position=(0.0, 0.0, -0.5)))
    floor = scene.add("floor", VertexContact(friction=0.2, restitution=0.1))
    scene.connect(low.frame, floor.plane)
    scene.connect(scene.crank.b, floor.body)
    scene.start["crank.angular_velocity"] = -2.0
    return scene


@METHODS
@pytest.mark.parametrize("make", [StickSlip, Clutches, four_bar])
def test_events_are_those_of_the_explicit_method(make: Callable[[], Scene], solver: str) -> None:
    runs = [simulate(make(), solver=one, rtol=1e-9, t_end=1.0) for one in ("explicit", solver)]
    told = [[(one.part, one.law, one.kind) for one in each.events] for each in runs]
    assert told[0] == told[1]
    assert [one.time for one in runs[1].events] == pytest.approx([one.time for one in runs[0].events], abs=2e-6)


@METHODS
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_sets_are_found_by_the_routine_of_explicit_steps(
    form: str, solver: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python finds the set of the start alone, and no zero."""
    in_python, plain, found = [], changes.resolve, []

    def counted(*given: object) -> changes.Changed:
        in_python.append(given)
        return plain(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(changes, "resolve", counted)
    monkeypatch.setattr(PythonCalls, "address", lambda *_: pytest.fail("an event is looked for in Python"))
    for counts in (1, 6):
        in_python.clear()
        found.append(simulate(StickSlip(), solver=solver, form=form, t_end=2.0, rtol=1e-8).events)
        assert len(in_python) == counts
        monkeypatch.setattr(compiled, "resolved", lambda *_: None)
    assert [(one.kind, one.law) for one in found[0]] == [(one.kind, one.law) for one in found[1]]
    assert [one.time for one in found[0]] == pytest.approx([one.time for one in found[1]], abs=1e-12)


@METHODS
@FORMS
def test_a_rope_goes_slack_and_comes_taut(solver: str, form: str) -> None:
    """Thrown from beside its hook at 1 m/s, a mass flies straight for .8 m, and what goes along the rope is lost."""
    scene = Scene(gravity=0.0)
    ground, rope, mass = (
        scene.add("ground", Ground()),
        scene.add("rope", Rope(starts="slack", when_slack="slack")),
        scene.add("mass", PointMass(mass=3.0)),
    )
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, mass.point)
    scene.start.update({"mass.position.x": 0.0, "mass.position.z": 0.6, "mass.velocity.x": 1.0, "mass.velocity.z": 0.0})
    result = run(scene, solver, form, 2.0)
    assert [(one.law, one.time) for one in result.events] == [("comes_taut", pytest.approx(0.8, abs=1e-9))]
    assert result.energy.kinetic[-1] == pytest.approx(1.5 * 0.36, abs=1e-9)
    assert result["rope.tension"][-1] == pytest.approx(3.0 * 0.36, abs=1e-8)


@METHODS
def test_accuracy_is_reached(solver: str) -> None:
    known = simulate(StickSlip(), rtol=1e-12, t_end=3.0, outputs=[3.0])["body.position.x"][-1]
    result = simulate(StickSlip(), accuracy=1e-8, solver=solver, t_end=3.0, outputs=[3.0])
    assert result["body.position.x"][-1] == pytest.approx(known, abs=1e-8)


def damped(form: str, **options: object) -> aw.Result:
    """Return the run of a gram that a spring presses to the floor through a damper: 1e4 N s/m and 1e4 N/m."""
    scene = on_plane(PointMass(mass=1e-3), PointContact(restitution=0.5))
    top = scene.add("top", Ground(position=(0.0, 0.0, 3.0)))
    for part in (Damper(damping=1e4), Spring(stiffness=1e4, natural_length=3.5)):
        name = type(part).__name__
        scene.add(name, part)
        scene.connect(top.frame, scene[name].a)
        scene.connect(scene.m.point, scene[name].b)
    start_at(scene, 0.0, 1.0, 0.0, 0.0)
    return simulate(scene, form=form, t_end=2.0, **options)


@FORMS
def test_what_is_stiff_is_given_to_ida(form: str) -> None:
    """An explicit method takes three million steps: it comes down as ``3/2 exp(-t) - 1/2``, and touches at log(3)."""
    result = damped(form)
    assert result.solver.startswith("SUNDIALS IDA: it is stiff")
    assert result.statistics.steps < 1000
    assert times(result, "impact")[0] == pytest.approx(math.log(3.0), abs=1e-5)
    assert result["m.position.z"][-1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("solver", ["gauss", "composition"])
def test_symplectic_methods_say_what_to_do(solver: str) -> None:
    with pytest.raises(UsageError, match=r"belt: .* gaps that are closed .*'explicit' or 'taylor' or 'ida'"):
        simulate(StickSlip(), solver=solver)


def test_what_turns_out_stiff_when_something_slips_is_given_to_ida() -> None:
    """A shaft that slips under 2 t N m from 0.5 s on follows ``1 + 100 w = 2 t`` but for what is gone in 10 us."""
    scene = Scene()
    shaft = scene.add("shaft", Inertia(moment=1e-3))
    brake = scene.add("brake", RotationalFriction(sliding="1", viscous=100.0, against="ground"))
    motor = scene.add("motor", RotationalSource(value=lambda t: 2.0 * t, against="ground"))
    scene.connect(motor.b, shaft.flange)
    scene.connect(brake.b, shaft.flange)
    scene.start.update({"shaft.angle": 0.0, "shaft.angular_velocity": 0.0})
    result = simulate(scene, t_end=20.0)
    assert "SUNDIALS IDA: it has turned out stiff" in result.solver
    assert times(result, "slips") == [pytest.approx(0.5, abs=1e-9)]
    assert result["shaft.angular_velocity"][-1] == pytest.approx(0.39 - 2e-7, abs=1e-9)
    assert result.statistics.steps < 1000
