"""Steps change sets by themselves where all opens and closes again, too; while all is open, by shorter programs."""

from __future__ import annotations

from typing import Any

import pytest
from numpy.testing import assert_allclose

from atwood import Result, Scene, UnsupportedError, assemble, select, simulate
from atwood.integrators.set_jumps import SetJumps
from atwood.simulation.contacts import changes, compiled
from atwood.simulation.run import run as runs
from atwood_library import Force, Ground, Pivot, PointContact, PointMass, RigidBody, Torque, VertexContact
from atwood_library.scenes import RockingBlock, Woodpecker

FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])


def thrown() -> Scene:
    """Return a mass on a rough floor that bounces and slides, under a force that the clock switches."""
    scene = Scene(t_end=2.0)
    ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass())
    push = Force(direction=(1.0, 0.0, 0.2), value=lambda t: select(t > 0.5, select(t > 0.8, 3.0, -2.0), 1.0))
    force, floor = scene.add("force", push), scene.add("floor", PointContact(friction=0.3, restitution=0.6))
    scene.connect(ground.frame, floor.plane)
    scene.connect(mass.point, floor.point)
    scene.connect(force.point, mass.point)
    scene.start.update({"mass.position.x": 0.0, "mass.position.z": 0.4})
    scene.start.update({"mass.velocity.x": 1.0, "mass.velocity.z": 0.0})
    return scene


def counted(monkeypatch: pytest.MonkeyPatch, module: Any, name: str) -> list[None]:
    """Count the calls of a function."""
    made, function = list[None](), getattr(module, name)

    def call(*given: Any, **more: Any) -> Any:
        made.append(None)
        return function(*given, **more)

    monkeypatch.setattr(module, name, call)
    return made


def alike(one: Result, other: Result, tolerance: float) -> None:
    assert [(e.part, e.law, e.kind) for e in one.events] == [(e.part, e.law, e.kind) for e in other.events]
    assert_allclose([e.time for e in one.events], [e.time for e in other.events], rtol=0.0, atol=tolerance)
    for made, wanted in zip(one.run.segments[-1:], other.run.segments[-1:], strict=True):
        assert_allclose(made.coordinates[:, -1], wanted.coordinates[:, -1], rtol=tolerance, atol=tolerance)


@FORMS
@pytest.mark.parametrize(("make", "end", "events"), [(Woodpecker, 1.0, 61), (RockingBlock, 2.0, 8)])
def test_a_run_comes_back_to_python_for_no_change(
    monkeypatch: pytest.MonkeyPatch, make: type[Scene], end: float, events: int, form: str
) -> None:
    """It came back 32 times within a second of the woodpecker, at each opening of all and at each closing after it."""
    assembly = assemble(make(), form=form)
    simulate(assembly, t_end=end)
    stretches, in_python = counted(monkeypatch, runs, "run_segment"), counted(monkeypatch, changes, "resolve")
    result = simulate(assembly, t_end=end)
    assert len(result.events) == events
    assert len(stretches) == 1
    assert not in_python


@FORMS
def test_shorter_programs_give_what_those_for_all_sets_give(monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    found = []
    for short in (0, 10**9):
        monkeypatch.setattr(compiled, "_SHORT", short)
        found.append(simulate(Woodpecker(), form=form, t_end=0.4, rtol=1e-9))
    assert len(found[0].events) > 20
    alike(*found, 1e-9)


@FORMS
def test_shorter_programs_take_what_the_clock_switches(monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    """The force switches in flight, where these programs are taken, and all their parameters with it."""
    made, found = list[bool](), []
    init = SetJumps.__init__

    def note(self: SetJumps, *given: Any) -> None:
        made.append(given[-1] is not None)
        init(self, *given)

    monkeypatch.setattr(SetJumps, "__init__", note)
    for short in (0, 10**9):
        monkeypatch.setattr(compiled, "_SHORT", short)
        assembly = assemble(thrown(), form=form)
        found.append([simulate(assembly, rtol=1e-9) for _ in range(2)][-1])
    assert made == [True, False]
    assert len(found[0].events) > 6
    alike(*found, 1e-12)
    assert_allclose(found[0]["mass.position.x"], found[1]["mass.position.x"], rtol=0.0, atol=1e-12)


def test_forces_of_a_set_that_has_opened_again_by_the_end_are_compared_too() -> None:
    """They are 59 % too small while a place next to a hinge bears the body, until a torque lifts it again."""
    scene = Scene()
    body = scene.add("body", RigidBody(mass=1.0, moments=(0.1,) * 3, center=(0.5, 0.0, 0.0)))
    ground, hinge = scene.add("ground", Ground()), scene.add("hinge", Pivot())
    floor = scene.add("floor", Ground(position=(1e-5, 0.0, -1.0)))
    place = scene.add("place", VertexContact(place=(1e-5, 0.0, -1.0)))
    torque = scene.add("torque", Torque(value=lambda t: 100.0 * t))
    for one, other in ((ground.frame, hinge.a), (hinge.b, body.frame), (floor.frame, place.plane)):
        scene.connect(one, other)
    scene.connect(body.frame, place.body)
    scene.connect(torque.frame, body.frame)
    scene.start.update({"hinge.angle": 1e-3, "body.angular_velocity.y": 0.0})
    with pytest.raises(UnsupportedError, match="and formulas give"):
        simulate(scene, form="dae", t_end=0.1)
    result = simulate(scene, t_end=0.1)
    assert {"closes", "opens"} <= {one.kind for one in result.events}
    assert result["place.gap"][-1] > 0.0
