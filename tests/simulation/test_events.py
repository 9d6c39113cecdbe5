"""Events and modes: ropes that go slack and come taut, limits, interruptions."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from atwood import Result, Scene, clock, pipeline
from atwood.pipeline import simulate
from atwood.simulation.events.modes import EventProbe
from atwood.simulation.run import run
from atwood_library import Force, Ground, PointMass, Rope, Sine, Spring
from atwood_library.scenes import Atwood, DoublePendulum

from ..helpers.mechanisms import pendulum_on_a_string
from ..helpers.runs import FORMS

G = 9.81
SPEED = math.sqrt(3.5 * G)
"""At the bottom of a string of 1 m: more than sqrt(2 g), which stays below, less than sqrt(5 g), which goes round."""


def over_the_top(when_slack: str) -> Scene:
    scene = pendulum_on_a_string(t_end=3.0, rope={"when_slack": when_slack})
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": -1.0, "bob.velocity.x": SPEED})
    return scene


def slack_time() -> float:
    """Return when the tension vanishes: m v^2 = -m g cos(theta), v^2 = 3.5 g - 2 g (1 - cos): cos(theta) = -1/2."""
    from scipy.integrate import quad

    return float(
        quad(lambda theta: 1.0 / math.sqrt(3.5 * G - 2.0 * G * (1.0 - math.cos(theta))), 0.0, 2.0 * math.pi / 3.0)[0]
    )


@pytest.mark.parametrize("form", FORMS)
def test_a_rope_without_tension_stops_the_run(form: str) -> None:
    result = simulate(over_the_top("stop"), form=form, rtol=1e-10, outputs=31)
    assert result.status == "stopped"
    assert "rope: the rope has gone slack" in result.message
    assert result.time[-1] == pytest.approx(slack_time(), abs=1e-7)
    assert result.array("bob.position.x")[-1] == pytest.approx(math.sin(2.0 * math.pi / 3.0), abs=1e-7)
    assert result.array("bob.position.z")[-1] == pytest.approx(0.5, abs=1e-7)
    assert result.array("rope.tension")[-1] == pytest.approx(0.0, abs=1e-6)
    assert np.all(result.array("rope.tension")[:-1] > 0.0)
    (happening,) = result.events
    assert (happening.part, happening.law, happening.target) == ("rope", "goes_slack", "stop")


@pytest.mark.parametrize("form", FORMS)
def test_a_slack_rope_lets_the_bob_fly_and_jerks(form: str) -> None:
    result = simulate(over_the_top("slack"), form=form, rtol=1e-10, outputs=601)
    assert result.status == "finished"
    slack, taut = result.events[:2]
    assert (slack.law, slack.target, taut.law, taut.target) == ("goes_slack", "slack", "comes_taut", "taut")
    assert not slack.impact
    assert taut.impact
    # The parabola from the point at 120 degrees, with v = sqrt(g/2) along the circle.
    x0, z0, v = math.sin(2.0 * math.pi / 3.0), 0.5, math.sqrt(0.5 * G)
    vx, vz = v * math.cos(2.0 * math.pi / 3.0), v * math.sin(2.0 * math.pi / 3.0)
    assert slack.time == pytest.approx(slack_time(), abs=1e-7)
    # |r|^2 = 1 again: t^2 (g^2 t^2/4 - g vz t + v^2 - g z0) = 0 with x0 vx + z0 vz = 0
    roots = np.roots([G * G / 4.0, -G * vz, v * v - G * z0])
    flight = float(max(root.real for root in roots if abs(root.imag) < 1e-9))
    assert taut.time - slack.time == pytest.approx(flight, abs=1e-7)
    t = result.time
    flying = (t > slack.time) & (t < taut.time)
    s = t[flying] - slack.time
    assert np.max(np.abs(result.array("bob.position.x")[flying] - (x0 + vx * s))) < 1e-6
    assert np.max(np.abs(result.array("bob.position.z")[flying] - (z0 + vz * s - 0.5 * G * s * s))) < 1e-6
    assert np.max(np.abs(result.array("rope.tension")[flying])) == 0.0
    # The jerk takes the velocity along the rope, and with it its energy; the ledger counts it as work.
    x, z = x0 + vx * flight, z0 + vz * flight - 0.5 * G * flight**2
    along = vx * x + (vz - G * flight) * z
    across = vx * -z + (vz - G * flight) * x
    after = np.flatnonzero(t > taut.time)[0]
    assert result.energy.work[-1] == pytest.approx(-0.5 * along**2, abs=1e-6)
    assert result.energy.max_drift < 1e-8
    energy = result.energy.total[after]
    assert energy == pytest.approx(0.5 * across**2 + G * z, abs=1e-6)
    assert result.constraint_max["position"] < 1e-12
    radius = np.hypot(result.array("bob.position.x"), result.array("bob.position.z"))
    assert np.max(radius) < 1.0 + 1e-7


def test_event_times_agree_between_forms() -> None:
    times = [[one.time for one in simulate(over_the_top("slack"), form=form, rtol=1e-10).events] for form in FORMS]
    assert times[0] == pytest.approx(times[1], abs=1e-7)


def upside_down(when_slack: str) -> Scene:
    scene = pendulum_on_a_string(t_end=0.5, rope={"when_slack": when_slack})
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": 1.0, "bob.velocity.x": 0.5})
    scene.guess["bob.position.z"] = 1.0
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_a_rope_that_would_push_from_the_outset(form: str) -> None:
    stopped = simulate(upside_down("stop"), form=form, rtol=1e-8)
    assert (stopped.status, stopped.time[-1]) == ("stopped", 0.0)
    assert "rope" in stopped.message
    free = simulate(upside_down("slack"), form=form, rtol=1e-9)
    assert free.events[0].time == 0.0
    assert free.array("bob.position.z")[-1] == pytest.approx(1.0 - 0.5 * G * 0.25, abs=1e-7)
    assert free.array("bob.position.x")[-1] == pytest.approx(0.25, abs=1e-7)


@pytest.mark.parametrize("form", FORMS)
def test_two_bodies_on_a_rope_keep_their_momentum_in_the_jerk(form: str) -> None:
    scene = Scene(space="line", gravity=0.0, t_end=2.0)
    scene.add("one", PointMass(mass=1.0))
    scene.add("two", PointMass(mass=3.0))
    rope = scene.add("rope", Rope(length=1.0, when_slack="slack"))
    push, wave = (
        scene.add("push", Force()),
        scene.add("wave", Sine(amplitude=4.0, angular_frequency=5.0, phase=0.5 - math.pi / 2.0)),
    )
    scene.connect(rope.a, scene["one"].point)
    scene.connect(rope.b, scene["two"].point)
    scene.connect(push.point, scene["two"].point)
    scene.connect(wave.output("value"), push.input("value"))
    # stretched out; the force -4 cos(5 t + 0.5) first pushes the ends together, and later apart
    scene.start.update({"one.position.x": 0.0, "two.position.x": 1.0, "one.velocity.x": 0.2, "two.velocity.x": 0.2})
    result = simulate(scene, form=form, rtol=1e-10, outputs=101)
    assert [one.law for one in result.events[:2]] == ["goes_slack", "comes_taut"]
    momentum = result.array("one.velocity.x") + 3.0 * result.array("two.velocity.x")
    expected = 0.8 - 0.8 * (np.sin(5.0 * result.time + 0.5) - math.sin(0.5))
    assert np.max(np.abs(momentum - expected)) < 1e-7
    assert np.max(result.array("two.position.x") - result.array("one.position.x")) < 1.0 + 1e-7
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("form", FORMS)
def test_a_mass_that_runs_into_the_pulley_stops_the_run(form: str) -> None:
    result = simulate(Atwood(t_end=5.0), form=form, rtol=1e-9)
    assert result.status == "stopped"
    assert "rope: an end of the rope has reached a pulley" in result.message
    assert result.time[-1] == pytest.approx(math.sqrt(2.0 * 2.0 / (G / 3.0)), abs=1e-8)
    assert result.array("m2.position.z")[-1] == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("limit", "status"),
    [({"max_steps": 60}, "step_limit"), ({"max_seconds": 1e-9}, "time_limit"), ({"max_steps": 1}, "step_limit")],
)
def test_limits_return_what_is_done(
    form: str, limit: dict[str, float], status: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (clock, pipeline, run):  # enough to find a start on a machine that has much else to do
        monkeypatch.setattr(module, "GRACE", 30.0)
    result = simulate(DoublePendulum(), form=form, t_end=50.0, **limit)
    assert result.status == status
    assert "limit" in result.message
    assert result.time[-1] < 50.0
    assert len(result.array("bob2.position.x")) == len(result.time) >= 1
    assert result.array("rod1.tension").shape == result.time.shape
    assert result.energy.max_drift < 1e-4


def interrupting(after: float) -> Callable[[float], None]:
    def progress(t: float) -> None:
        if t > after:
            raise KeyboardInterrupt

    return progress


@pytest.mark.parametrize("form", FORMS)
def test_an_interruption_returns_what_is_done(form: str) -> None:
    whole: Result = simulate(DoublePendulum(), form=form, rtol=1e-8, outputs=31)
    result = simulate(DoublePendulum(), form=form, rtol=1e-8, outputs=31, progress=interrupting(1.0))
    assert result.status == "interrupted"
    assert "interrupted" in result.message
    assert 1.0 < result.time[-1] < 1.1
    assert np.array_equal(result.array("rod2.angle")[:11], whole.array("rod2.angle")[:11])


def test_progress_rises_and_other_errors_pass_through() -> None:
    seen: list[float] = []
    simulate(DoublePendulum(), rtol=1e-6, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(3.0)

    def broken(t: float) -> None:
        raise ValueError("mine")

    with pytest.raises(ValueError, match="mine"):
        simulate(DoublePendulum(), rtol=1e-6, progress=broken)


@pytest.mark.parametrize("form", FORMS)
def test_a_hanging_rope_carries_the_weight_and_the_spring(form: str) -> None:
    scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0), t_end=1.0)
    ceiling, floor = scene.add("ceiling", Ground()), scene.add("floor", Ground(position=(0.0, 0.0, -2.0)))
    rope, mass = scene.add("rope", Rope(length=1.0)), scene.add("mass", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=100.0, natural_length=0.5))
    scene.connect(ceiling.frame, rope.a)
    scene.connect(rope.b, mass.point)
    scene.connect(mass.point, spring.a)
    scene.connect(spring.b, floor.frame)
    scene.start["mass.position.z"] = -1.0
    result = simulate(scene, form=form, rtol=1e-8)
    assert result.status == "finished"
    assert np.allclose(result.array("rope.tension"), 9.81 + 50.0)


@pytest.mark.parametrize(("share", "happens"), [(0.5, False), (0.95, True), (1.1, True)])
def test_what_has_passed_nearly_all_of_its_margin_at_a_start_happens_there(share: float, happens: bool) -> None:
    """Equal ropes pass their margins together: one of them ends the mode, and the others are at the end of theirs."""
    scene = pendulum_on_a_string()
    scene.start.update({"bob.position.x": math.sin(2.0), "bob.velocity.x": 3.0 * math.cos(2.0)})
    scene.guess.update({"bob.position.z": -math.cos(2.0), "bob.velocity.z": 3.0 * math.sin(2.0)})
    (segment, *_) = simulate(scene, t_end=1e-3, outputs=2).run.segments
    rtol, plan = 1e-9, segment.plan
    tension = -share * 10.0 * rtol * plan.scales.of("N")
    speed = math.sqrt(tension - 9.81 * math.cos(2.0))  # m v^2 / l = T - m g cos
    q = segment.coordinates[:, 0]
    probe = EventProbe(plan, 0.0, q, speed * np.array([math.cos(2.0), math.sin(2.0)]), rtol)
    names = [one.message for one in probe.event_functions]
    which = names.index("the rope has gone slack")
    assert (probe.broken is not None) == happens
    if not happens:
        assert probe.values(0.0, q, speed * np.array([math.cos(2.0), math.sin(2.0)]))[which] > 0.0
