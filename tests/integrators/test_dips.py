"""Event functions that pass zero and come back within one step of the integrator."""

import math

import numpy as np
import pytest

from atwood import Component, Point, Scalar, Scene, connector, event, parameter, simulate
from atwood.integrators.event_location import EventLocator, Root
from atwood.integrators.protocol import ExplicitProblem
from atwood_library import Ground, Pivot, PointMass, RigidBody, Spring, TorsionSpring

from ..helpers.runs import FORMS

NEARLY_HALF_A_TURN = 0.999 * math.pi
WAYS = [("reduced", one) for one in ("ida", "ida-sundae", "explicit", "taylor")] + [
    ("dae", "ida"),
    ("dae", "ida-sundae"),
]


def spinning(stiffness: float, rate: float) -> Scene:
    """Return a body that turns on a torsion spring, which knows its angle within half a turn."""
    scene = Scene(space="space", gravity=0.0, t_end=1.5)
    ground, pivot = scene.add("ground", Ground()), scene.add("pivot", Pivot())
    body, spring = scene.add("body", RigidBody(moments=(1.0, 1.0, 1.0))), scene.add("spring", TorsionSpring())
    spring.stiffness = stiffness
    for a, b in ((ground, pivot.a), (ground, spring.a)):
        scene.connect(a.frame, b)
    for b in (pivot.b, spring.b):
        scene.connect(b, body.frame)
    scene.start["pivot.angular_velocity"] = rate
    return scene


class Stop(Component):
    """Ends the run where a point comes too low."""

    height: float = parameter(0.0, unit="m", doc="Where it stops the run.")
    point: Point = connector(Point, "What is watched.")

    @event(direction=-1, unit="m", target="stop", message="low")
    def is_low(self) -> Scalar:
        """Return the height above the stop."""
        return self.point.position.z - self.height


def bouncer(depth: float) -> Scene:
    """Return 1 kg on a spring that swings with amplitude 1 and w = 10/s, above a stop that it passes by a depth."""
    scene = Scene(t_end=3.0, gravity=0.0)
    ground, bob = scene.add("ground", Ground()), scene.add("bob", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=100.0, natural_length=2.0))
    stop = scene.add("stop", Stop(height=depth - 3.0))
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, bob.point)
    scene.connect(stop.point, bob.point)
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": -1.0, "bob.velocity.x": 0.0, "bob.velocity.z": 0.0})
    return scene


@pytest.mark.parametrize(("form", "solver"), WAYS)
@pytest.mark.parametrize(("stiffness", "rate"), [(100.0, 60.0), (0.1, 10.0), (1e-4, 10.0), (1e-4, -300.0)])
def test_half_a_turn_is_seen_within_a_step(stiffness: float, rate: float, form: str, solver: str) -> None:
    result = simulate(spinning(stiffness, rate), form=form, solver=solver, rtol=1e-4)
    w = math.sqrt(stiffness)
    assert result.status == "stopped"
    assert result.time[-1] == pytest.approx(math.asin(NEARLY_HALF_A_TURN * w / abs(rate)) / w, rel=5e-3)
    assert abs(result.array("spring.angle")[-1]) == pytest.approx(NEARLY_HALF_A_TURN, abs=1e-6)


@pytest.mark.parametrize(("form", "solver"), WAYS)
def test_a_stop_that_is_just_passed_at_the_lowest_place(form: str, solver: str) -> None:
    passed = simulate(bouncer(depth=1e-4), form=form, solver=solver, rtol=1e-8)
    assert (passed.status, passed.events[0].law) == ("stopped", "is_low")
    # -2 + cos w t = -3 + depth
    assert passed.time[-1] == pytest.approx(0.1 * math.acos(1e-4 - 1.0), abs=1e-5)
    missed = simulate(bouncer(depth=-1e-4), form=form, solver=solver, rtol=1e-8)
    assert missed.status == "finished"


@pytest.mark.parametrize("form", FORMS)
def test_looking_for_dips_costs_little(form: str) -> None:
    result = simulate(bouncer(depth=-0.1), form=form, rtol=1e-8, outputs=11)
    assert result.status == "finished"
    assert result.statistics.event_evaluations < 2 * result.statistics.steps + 20


def dips(t: float, *_: object) -> list[float]:
    """Return two dips of one function, and one that touches nothing."""
    bumps = [(0.3, 0.05), (0.8, 0.01)]
    return [1.0 - sum(1.001 * math.exp(-(((t - c) / w) ** 2)) for c, w in bumps), 2.0]


def root_between(begin: float, end: float, rough: tuple[int, ...] = ()) -> Root | None:
    problem = ExplicitProblem(1, lambda t, y: [0.0], events=dips, event_count=2, event_rough=rough)
    locator = EventLocator(problem, horizon=1.0)
    locator.restart((begin, np.zeros(1), np.zeros(1)))
    return locator.search(begin, end, lambda t: (t, np.zeros(1), np.zeros(1)))


@pytest.mark.parametrize(("begin", "end", "dip"), [(0.2, 0.36, 0.3), (0.78, 0.815, 0.8), (0.31, 0.78, None)])
def test_a_narrow_dip_is_found_from_its_slopes(begin: float, end: float, dip: float | None) -> None:
    found = root_between(begin, end)
    assert (found is None) == (dip is None)
    if found is not None:
        assert found.events == (-1, 0)
        assert found.state[0] == pytest.approx(dip, abs=0.02)
        assert abs(dips(found.state[0])[0]) < 1e-12
    assert root_between(begin, end, rough=(0,)) is None
