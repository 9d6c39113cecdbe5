"""Time events that steps pass with their changes of sets of contacts: what comes out is what single stretches give."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from atwood import (
    Component,
    Number,
    Point,
    Result,
    Scalar,
    Scene,
    assemble,
    connector,
    dry_friction,
    parameter,
    select,
    signal,
    simulate,
    unilateral,
)
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.set_jumps import SetJumps
from atwood.simulation.run.choice import Stiffness, turned_stiff
from atwood.simulation.run.run import Walk
from atwood.simulation.run.segment import _Runner
from atwood_library import Force, Ground, PointContact, PointMass
from atwood_library.scenes import Clutches


class Lift(Component):
    """A rough floor that moves up and along."""

    restitution: float = parameter(0.0, minimum=0.0, maximum=1.0, doc="Restitution.")
    friction: float = parameter(0.3, minimum=0.0, doc="Friction over pressure.")
    p: Point = connector(Point, "What stands on it.")
    height: Number = signal(0.0, unit="m", doc="Height.")
    speed: Number = signal(0.0, unit="m/s", doc="Speed along x.")

    @unilateral(reaction="normal_force", unit="N", restitution="restitution", doc="What presses.")
    def gap(self) -> Scalar:
        """Return the gap."""
        return self.p.position.z - self.height

    @dry_friction(at="gap", reaction="friction_force", unit="N", limit="most", doc="What rubs.")
    def slip(self) -> Scalar:
        """Return the slip."""
        return self.p.velocity.x - self.speed

    def most(self) -> Scalar:
        """Return the limit of friction."""
        return self.friction * self.reaction("normal_force")


def pushed(push: Any, direction: tuple[float, float, float], speed: float, restitution: float = 0.0) -> Scene:
    """Return a mass on a rough floor with a force that the clock switches."""
    scene = Scene(t_end=3.0)
    ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass())
    force = scene.add("force", Force(direction=direction, value=push))
    floor = scene.add("floor", PointContact(normal=(0.0, 0.0, 1.0), friction=0.3, restitution=restitution))
    scene.connect(ground.frame, floor.plane)
    scene.connect(mass.point, floor.point)
    scene.connect(force.point, mass.point)
    scene.start.update({"mass.position.x": 0.3, "mass.position.z": 0.0})
    scene.start.update({"mass.velocity.x": speed, "mass.velocity.z": 0.0})
    return scene


def sticking() -> Scene:
    """Return one that sticks and slips."""

    def push(t: Scalar) -> Scalar:
        return sum((select(t > 0.21 * (k + 1), 5.0 - 13.0 * (k % 2), 0.0) for k in range(10)), 1.0)

    return pushed(push, (1.0, 0.0, 0.0), 0.0)


def hopping() -> Scene:
    """Return one that is lifted and let fall."""
    return pushed(
        lambda t: select(t > 0.5, select(t > 0.7, select(t > 1.5, 0.0, -3.0), 15.0), 0.0), (0.3, 0.0, 1.0), 1.0, 0.5
    )


def lifted() -> Scene:
    """Return a mass on a floor that begins to rise, and stops; impacts come at the clock."""
    scene = Scene(t_end=2.0)
    mass = scene.add("mass", PointMass())
    lift = Lift(
        restitution=0.2,
        height=lambda t: select(t > 0.4, select(t > 0.9, 0.5, t - 0.4), 0.0),
        speed=lambda t: select(t > 0.6, select(t > 1.3, -0.4, 0.9), 0.2),
    )
    scene.connect(mass.point, scene.add("lift", lift).p)
    scene.start.update({"mass.position.x": 0.3, "mass.position.z": 0.0})
    scene.start.update({"mass.velocity.x": 1.0, "mass.velocity.z": 0.0})
    return scene


SCENES = {"sticking": sticking, "hopping": hopping, "lifted": lifted, "clutches": Clutches}


def in_both_ways(monkeypatch: pytest.MonkeyPatch, name: str, form: str, **told: Any) -> tuple[Result, Result]:
    """Return a run whose steps pass the time events, and one that stops at each; steps have been compiled before."""
    assembly, found = assemble(SCENES[name](), form=form), []
    for passes in (False, True):
        monkeypatch.setattr(Walk, "passes_moments", passes)
        found.append([simulate(assembly, **told) for _ in range(2)][-1])
    return found[1], found[0]


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", SCENES)
def test_all_is_as_in_single_stretches(monkeypatch: pytest.MonkeyPatch, name: str, form: str) -> None:
    one, other = in_both_ways(monkeypatch, name, form, rtol=1e-9)
    assert len(one.run.stretches) < len(other.run.stretches)
    assert len(one.run.segments) == len(other.run.segments)
    for made, wanted in zip(one.run.segments, other.run.segments, strict=True):
        assert_array_equal(made.shown, wanted.shown)
        assert_allclose(made.time, wanted.time, rtol=0.0, atol=1e-12)
        assert_allclose(made.coordinates, wanted.coordinates, rtol=0.0, atol=1e-12)
        assert (made.impact, made.after_time_event) == (wanted.impact, wanted.after_time_event)
        assert_array_equal(made.assembly.parameter_values, wanted.assembly.parameter_values)
    told = [[(event.part, event.law, event.kind) for event in run.events] for run in (one, other)]
    assert told[0] == told[1]
    for what in ("kinetic", "potential", "work"):
        both = (getattr(run.energy, what) for run in (one, other))
        assert_allclose(*both, rtol=0.0, atol=1e-11)


def test_times_that_were_asked_for_are_those_after_the_clock_switches(monkeypatch: pytest.MonkeyPatch) -> None:
    one, other = in_both_ways(monkeypatch, "sticking", "reduced", outputs=[0.0, 0.21, 0.42, 1.0, 2.5])
    assert_array_equal(one.time, other.time)
    assert_array_equal(one["mass.velocity.x"], other["mass.velocity.x"])
    assert_array_equal(one["force.force"], other["force.force"])


def test_what_steps_leave_goes_on_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """The log is full after one entry, so that events and time events come back in turn."""
    init = SetJumps.__init__

    def small(jumps: SetJumps, *given: Any) -> None:
        init(jumps, *given)
        jumps._put("own", {"capacity": 1})

    monkeypatch.setattr(SetJumps, "__init__", small)
    for name in ("sticking", "clutches"):
        one, other = in_both_ways(monkeypatch, name, "reduced", rtol=1e-9)
        assert len(one.run.segments) == len(other.run.segments)
        for made, wanted in zip(one.run.segments, other.run.segments, strict=True):
            assert_array_equal(made.shown, wanted.shown)
            assert_allclose(made.coordinates, wanted.coordinates, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_another_solver_stops_at_each_time_event(monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    assembly = assemble(Clutches(), form=form)
    wanted = simulate(assembly, rtol=1e-9)
    leaves, allowed = ExplicitSession._leaves, ExplicitSession._allowed

    def is_left(session: ExplicitSession) -> bool:
        if session._newest[0] > 0.5 and session._on_stiff is not None and not session._is_left:
            session._is_left = session._on_stiff(*session._newest[:2])
        return leaves(session)

    def is_stiff(runner: _Runner, t: float, y: np.ndarray) -> bool:
        if runner.session is not None and (made := runner._take_jumps(runner.session)) is not None:
            runner.jumped.append(made)
        runner.choices.append(turned_stiff(t, Stiffness(1.0, 1e3, 1.0)))
        return True

    monkeypatch.setattr(ExplicitSession, "_leaves", is_left)
    monkeypatch.setattr(ExplicitSession, "_allowed", lambda session: min(3, allowed(session)))
    monkeypatch.setattr(_Runner, "_is_stiff", is_stiff)
    found = simulate(assembly, rtol=1e-9)
    assert [one.solver for one in found.run.choices] == ["explicit", "ida"]
    assert len(found.run.segments) == len(wanted.run.segments)
    ends = [run.run.segments[-1].coordinates[:, -1] for run in (found, wanted)]
    assert_allclose(*ends, rtol=0.0, atol=1e-7)


def test_values_end_and_outputs_of_another_run_are_its_own() -> None:
    assembly = assemble(sticking())
    for told in ({"t_end": 3.0}, {"t_end": 1.0}, {"t_end": 1.0, "outputs": [0.0, 0.5, 1.0]}, {"t_end": 3.0}):
        made, wanted = simulate(assembly, **told), simulate(assemble(sticking()), **told)
        assert_array_equal(made.time, wanted.time)
        assert_array_equal(made["mass.position.x"], wanted["mass.position.x"])
    other = assembly.with_values({"floor.friction": 0.2})
    scene = sticking()
    scene.set("floor.friction", 0.2)
    assert_array_equal(simulate(other)["mass.position.x"], simulate(assemble(scene))["mass.position.x"])
