"""Events that compiled functions look for, against the same events looked for in Python after every step."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from atwood import Component, Point, Result, Scalar, Scene, connector, parameter, simulate
from atwood.forms.quantities import to_maximal
from atwood.model.declare.laws import event
from atwood.pipeline import assemble
from atwood.simulation.events.modes import EventProbe
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.preparation import make_problem
from atwood_library import Ground, PointMass, Spring
from atwood_library.scenes import SCENES

from ..helpers.mechanisms import pendulum_on_a_string
from ..helpers.tethers import Tether

G = 9.81


class Gate(Component):
    """Watches a height, a vertical velocity and a vertical acceleration of a point."""

    height: float = parameter(-2.0, unit="m", doc="Where it stops the run.")
    speed: float = parameter(-99.0, unit="m/s", doc="At which vertical velocity it stops the run.")
    acceleration: float = parameter(999.0, unit="m/s^2", doc="At which vertical acceleration it stops the run.")
    point: Point = connector(Point, "What is watched.")

    @event(direction=-1, unit="m", target="stop", message="low")
    def is_low(self) -> Scalar:
        """Return the height above the gate."""
        return self.point.position.z - self.height

    @event(direction=0, unit="m/s", target="stop", message="fast")
    def is_fast(self) -> Scalar:
        """Return the velocity above the limit."""
        return self.point.velocity.z - self.speed

    @event(direction=1, unit="m/s^2", target="stop", message="pushed")
    def is_pushed(self) -> Scalar:
        """Return the acceleration above the limit."""
        return self.point.acceleration.z - self.acceleration


def bouncer(**gate: float) -> Scene:
    """Return 1 kg on a spring of 100 N/m that hangs at rest and is let go from its natural length: w = 10/s."""
    scene = Scene(t_end=3.0)
    ground, bob = scene.add("ground", Ground()), scene.add("bob", PointMass(mass=1.0))
    spring, watch = scene.add("spring", Spring(stiffness=100.0, natural_length=1.0)), scene.add("gate", Gate(**gate))
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, bob.point)
    scene.connect(watch.point, bob.point)
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": -1.0, "bob.velocity.x": 0.0, "bob.velocity.z": 0.0})
    return scene


def over_the_top() -> Scene:
    scene = pendulum_on_a_string(t_end=3.0, rope=Tether())
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": -1.0, "bob.velocity.x": math.sqrt(3.5 * G)})
    return scene


def in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(EventProbe, "compiled", lambda self, for_ida: None)


CASES: dict[str, tuple[Callable[[], Scene], str]] = {
    "rope over a pulley": (SCENES["atwood"], "stopped"),
    "ropes over pulleys": (SCENES["double-atwood"], "stopped"),
    "over the top": (over_the_top, "finished"),
    "height": (lambda: bouncer(height=-1.1), "stopped"),
    "velocity": (lambda: bouncer(speed=0.5), "stopped"),
    "never": (bouncer, "finished"),
}


@pytest.mark.sample(3)
@pytest.mark.parametrize("solver", ["ida", "auto"])
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("case", CASES)
def test_compiled_events_happen_when_those_in_python_do(
    case: str, form: str, solver: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    make, status = CASES[case]

    def run() -> Result:
        return simulate(make(), form=form, rtol=1e-9, t_end=3.0, outputs=61, solver=solver)

    compiled = run()
    in_python(monkeypatch)
    python = run()
    assert compiled.status == python.status == status
    assert [(one.part, one.law) for one in compiled.events] == [(one.part, one.law) for one in python.events]
    assert [one.time for one in compiled.events] == pytest.approx([one.time for one in python.events], abs=1e-12)
    assert compiled.time == pytest.approx(python.time, abs=1e-12)
    assert compiled.statistics.steps == python.statistics.steps
    for path in ("bob.position.z", "bob1.position.z", "left.position.z"):
        if path in compiled:
            assert compiled.array(path) == pytest.approx(python.array(path), abs=1e-10)


@pytest.mark.sample(1)
@pytest.mark.parametrize("solver", ["ida", "explicit"])
def test_no_python_looks_at_steps_in_which_nothing_happens(solver: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = bouncer()
    calm = simulate(scene, rtol=1e-11, t_end=30.0, solver=solver)
    assert calm.statistics.steps > 100
    # At the start and at the end of the first step; beyond an output, IDA itself has not looked yet.
    assert calm.statistics.event_evaluations < 12 + (401 if solver == "ida" else 0)
    in_python(monkeypatch)
    busy = simulate(scene, rtol=1e-11, t_end=30.0, solver=solver)
    assert busy.statistics.steps == calm.statistics.steps
    assert busy.statistics.event_evaluations > calm.statistics.steps


@pytest.mark.parametrize("solver", ["ida", "ida-sundae", "explicit", "taylor"])
def test_what_is_watched_may_be_an_acceleration(solver: str) -> None:
    # z = -1 - g/w^2 (1 - cos w t): the acceleration -g cos w t passes g/2 upwards at w t = 2 pi/3.
    result = simulate(bouncer(acceleration=0.5 * G), rtol=1e-10, solver=solver)
    assert (result.status, result.events[0].law) == ("stopped", "is_pushed")
    assert result.time[-1] == pytest.approx(2.0 * math.pi / 30.0, abs=1e-8)


@pytest.mark.parametrize("solver", ["ida", "explicit", "taylor"])
def test_both_directions_count_for_one_that_has_none(solver: str) -> None:
    # z' = -(g/w) sin w t passes -g/w/2 downwards at w t = pi/6.
    result = simulate(bouncer(speed=-0.5 * G / 10.0), rtol=1e-10, solver=solver)
    assert result.events[0].law == "is_fast"
    assert result.time[-1] == pytest.approx(math.pi / 60.0, abs=1e-8)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("make", [SCENES["atwood"], SCENES["double-atwood"], over_the_top])
def test_compiled_values_are_those_of_python(make: Callable[[], Scene], form: str) -> None:
    assembly = assemble(make(), form=form)
    start = find_start(assembly)
    kernel = assembly.kernel(to_maximal(assembly))
    q, u = start.coordinates, start.speeds
    if form == "dae":
        q, u = (np.asarray(one) for one in kernel([start.time], q, u))
    plan = make_problem(assembly, start.time, q, u, start.length, 1.0)
    probe = EventProbe(plan, start.time, q, u, 1e-8)
    found = probe.compiled(for_ida=True)
    assert found is not None
    y = np.concatenate([q, u])
    assert found.function()(start.time, y, y) == pytest.approx(probe.values(start.time, q, u), rel=1e-12, abs=1e-12)


def test_outputs_do_not_change_when_events_happen() -> None:
    scene = over_the_top()
    few, many = (simulate(scene, rtol=1e-8, outputs=count, samples=1) for count in (3, 1001))
    times = [[one.time for one in result.events] for result in (few, many)]
    assert times[0] == pytest.approx(times[1], abs=1e-12)
    assert few.statistics.steps == many.statistics.steps
