"""Ropes that may be slack: known motions, wherever and however large they are, and the same as by modes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from atwood import Component, Point, Result, Scene, StartError, UsageError, assemble, linearize, sensitivities, simulate
from atwood_library import Ground, PointMass, Pulley, Rope, Spring
from atwood_library.scenes import DoubleAtwood

from ..helpers.runs import FORMS
from ..helpers.tethers import Caught, Loose, Tether

G = 9.81


def swung(
    part: Component | None = None, size: float = 1.0, angle: float = 0.0, place: float = 0.0, **start: float
) -> Scene:
    """Return a bob that is swung from the bottom of a rope, faster than it swings and slower than it goes round."""
    down, along = (math.sin(angle), 0.0, -math.cos(angle)), (math.cos(angle), 0.0, math.sin(angle))
    scene = Scene(t_end=2.0 * math.sqrt(size), gravity_direction=down)
    ground = scene.add("ground", Ground(position=(place, 0.0, -place)))
    rope = scene.add("rope", part or Rope(length=size, when_slack="slack"))
    bob = scene.add("bob", PointMass(mass=2.0))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    speed = start.get("speed", math.sqrt(3.5 * G * size))
    for i, axis in ((0, "x"), (2, "z")):
        origin = place if axis == "x" else -place
        scene.start[f"bob.position.{axis}"] = origin + size * down[i]
        scene.start[f"bob.velocity.{axis}"] = speed * along[i]
    return scene


def answers(size: float) -> tuple[float, float]:
    """Return when a bob with ``v^2 = 3.5 g l`` at the bottom goes slack, at cos = -1/2, and comes taut, s.

    It rises along the circle for the integral of ``dx / sqrt(v^2 - 2 g l (1 - cos x))`` to 2 pi/3, then flies from
    there with ``v^2 = g l / 2`` along a parabola, which meets the circle again after ``4 sin(pi/3) v / g``.
    """
    from scipy.integrate import quad

    rises = quad(lambda x: 1.0 / math.sqrt(1.5 + 2.0 * math.cos(x)), 0.0, 2.0 * math.pi / 3.0, epsabs=1e-13)[0]
    flies = 4.0 * math.sin(math.pi / 3.0) * math.sqrt(0.5)
    return rises * math.sqrt(size / G), (rises + flies) * math.sqrt(size / G)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("size", "angle", "place"), [(1.0, 0.0, 0.0), (1.0, 0.7, 0.0), (1.0, 0.0, 30.0), (1e-3, 2.0, 0.0), (1e3, 0.3, 7.0)]
)
def test_a_string_goes_slack_at_a_known_angle(size: float, angle: float, place: float, form: str) -> None:
    result = simulate(swung(size=size, angle=angle, place=place), form=form, rtol=1e-10)
    said = [(one.law, one.target, one.impact, one.kind) for one in result.events[:2]]
    assert said == [("goes_slack", "slack", False, "opens"), ("comes_taut", "taut", True, "impact")]
    times = answers(size)
    assert [one.time for one in result.events[:2]] == pytest.approx(times, rel=1e-9)
    flown = (result.time > times[0] * (1.0 + 1e-6)) & (result.time < times[1] * (1.0 - 1e-6))
    assert np.all(result["rope.tension"][flown] == 0.0)
    assert np.all(result["rope.spare_state"][flown] == 0.0)
    assert result["rope.tension"][0] == pytest.approx(2.0 * 4.5 * G, rel=1e-9)
    # The jerk takes what goes along the rope: v^2 = g l / 2, with -2 sin(pi/3) g t along the vertical since.
    (struck,) = [one.struck for one in result.events[:2] if one.struck is not None]
    assert result.energy.max_drift < 1e-7 * G * size
    assert struck.loss == pytest.approx(0.5 * struck.impulse**2 / 2.0, rel=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_it_moves_as_by_modes(form: str) -> None:
    runs = [simulate(swung(one, speed=5.2), form=form, rtol=1e-11) for one in (None, Tether())]
    assert [(one.law, one.target) for one in runs[0].events] == [(one.law, one.target) for one in runs[1].events]
    assert [one.time for one in runs[0].events] == pytest.approx([one.time for one in runs[1].events], abs=1e-9)
    for path in ("bob.position.x", "bob.position.z", "rope.tension", "total_energy"):
        np.testing.assert_allclose(runs[0][path][-50:], runs[1][path][-50:], atol=1e-7)
    names = {one for one in runs[1] if one.startswith("rope.")}
    assert names < set(runs[0])


def thrown(space: str, **rope: Any) -> Scene:
    """Return a mass that is thrown from beside a hook, on a rope that is slack."""
    scene = Scene(space=space, gravity=0.0, t_end=2.0)
    ground, part = scene.add("ground", Ground()), scene.add("rope", Rope(starts="slack", **rope))
    mass = scene.add("mass", PointMass(mass=3.0))
    scene.connect(ground.frame, part.a)
    scene.connect(part.b, mass.point)
    axes = {"line": "x", "plane": "xz", "space": "xyz"}[space]
    place, speed = {"x": 0.0, "y": 0.0, "z": 0.6 * (space != "line")}, {"x": 1.0, "y": 0.0, "z": 0.0}
    for axis in axes:
        scene.start.update({f"mass.position.{axis}": place[axis], f"mass.velocity.{axis}": speed[axis]})
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["line", "plane", "space"])
def test_a_mass_that_is_thrown_is_caught(space: str, form: str) -> None:
    """It flies straight; the rope takes away what goes along it, and what is left goes round, or nothing is."""
    result = simulate(thrown(space, when_slack="slack"), form=form, rtol=1e-10)
    caught = 1.0 if space == "line" else 0.8
    assert (result.events[0].law, result.events[0].time) == ("comes_taut", pytest.approx(caught, abs=1e-9))
    left = 0.0 if space == "line" else 0.6
    assert result.energy.kinetic[-1] == pytest.approx(1.5 * left**2, abs=1e-9)
    assert result.events[0].struck.loss == pytest.approx(1.5 * (1.0 - left**2), abs=1e-9)
    assert len(result.impacts) == 1
    assert result["rope.tension"][-1] == pytest.approx(3.0 * left**2, abs=1e-8)


def thrown_up() -> Scene:
    """Return a mass whose rope, which may not be slack again, comes taut as it rises; it falls at once."""
    scene = thrown("line", when_slack="stop")
    scene.gravity, scene.line_axis = G, (0.0, 0.0, 1.0)
    scene.start.clear()
    scene.start.update({"mass.position.z": 0.0, "mass.velocity.z": 6.0})
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("part", "told"),
    [
        (Loose, [("goes_slack", "opens"), ("spare", "impact"), ("spare", "closes")]),
        (Caught, [("spare", "opens"), ("comes_taut", "impact")]),
    ],
)
def test_what_a_gap_has_no_word_for_is_told_of_as_of_any(part: Any, told: list[tuple[str, str]], form: str) -> None:
    scene = swung(part())
    result = simulate(scene, form=form, rtol=1e-9, t_end=1.6)
    assert [(one.law, one.kind) for one in result.events] == told
    assert len(result.impacts) == 1


@pytest.mark.parametrize("form", FORMS)
def test_one_that_may_not_be_slack_again_stops_the_run(form: str) -> None:
    result = simulate(thrown_up(), form=form, rtol=1e-10)
    arrives = (6.0 - math.sqrt(36.0 - 2.0 * G)) / G
    assert [(one.law, one.target) for one in result.events] == [("comes_taut", "taut"), ("goes_slack", "stop")]
    assert [one.time for one in result.events] == pytest.approx([arrives, arrives], abs=1e-9)
    assert (result.status, result.time[-1]) == ("stopped", pytest.approx(arrives, abs=1e-9))


def row(order: tuple[int, ...] = (0, 1)) -> Scene:
    """Return two masses, one on a rope at a hook and one on a rope at the other, in a plane."""
    scene = Scene(t_end=2.0)
    ground = scene.add("ground", Ground())
    for k in order:
        scene.add(f"rope{k}", Rope(when_slack="slack"))
        scene.add(f"mass{k}", PointMass())
    for k in (0, 1):
        hook: Point = ground.frame if k == 0 else scene["mass0"].point
        scene.connect(hook, scene[f"rope{k}"].a)
        scene.connect(scene[f"rope{k}"].b, scene[f"mass{k}"].point)
        scene.guess[f"mass{k}.position.z"] = -1.0 - k
        scene.start.update({f"mass{k}.position.x": 0.0, f"mass{k}.velocity.x": 4.0 + k})
    return scene


def test_two_in_a_row_open_and_close_each_other_in_any_order() -> None:
    """An impact of one that opens the other was refused by modes."""
    runs = [
        simulate(row(order), form=form, rtol=1e-10, t_end=5.0) for order, form in (((0, 1), "reduced"), ((1, 0), "dae"))
    ]
    # The jerks come ever faster, and the last ones are too near to each other for their number to be known.
    told = [
        [(one.part, one.law) for one in result.events if one.time < result.events[-1].time - 1e-6] for result in runs
    ]
    assert len(told[0]) > 8
    assert told[0] == told[1]
    times = [[one.time for one in result.events] for result in runs]
    assert times[0][: len(told[0])] == pytest.approx(times[1][: len(told[0])], abs=1e-7)
    assert times[0][-1] == pytest.approx(times[1][-1], abs=1e-6)
    for path in ("mass0.position.x", "mass1.position.x", "mass1.velocity.z"):
        assert runs[0][path][-1] == pytest.approx(runs[1][path][-1], abs=1e-8)
    for result in runs:
        assert result.energy.max_drift < 1e-6
        for k, (a, b) in enumerate((("mass0", None), ("mass1", "mass0"))):
            apart = [result[f"{a}.position.{x}"] - (0.0 if b is None else result[f"{b}.position.{x}"]) for x in "xz"]
            assert np.max(np.hypot(*apart)) < 1.0 + 1e-9
            assert np.min(result[f"rope{k}.tension"]) > -1e-8


@pytest.mark.parametrize("form", FORMS)
def test_one_on_what_has_no_mass_keeps_its_modes(form: str) -> None:
    """A pulley without mass between two ropes, and a knot between a spring and a rope."""
    machine = DoubleAtwood()
    machine.rope1.when_slack = machine.rope2.when_slack = "slack"
    assert "rope1.spare" not in assemble(machine).observables
    ends = [simulate(one, form=form, t_end=1.0)["m1.position.z"][-1] for one in (machine, DoubleAtwood())]
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
    scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0), t_end=1.0)
    ground, spring = scene.add("ground", Ground()), scene.add("spring", Spring(stiffness=100.0, natural_length=0.5))
    knot, rope = scene.add("knot", Pulley()), scene.add("rope", Rope(when_slack="slack"))
    mass = scene.add("mass", PointMass())
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, knot.center)
    scene.connect(knot.center, rope.a)
    scene.connect(rope.b, mass.point)
    scene.start.update({"mass.position.z": -1.7, "mass.velocity.z": 0.0})
    scene.guess["knot.position.z"] = -0.7
    result = simulate(scene, form=form, rtol=1e-10)
    # From .2 m of stretch it swings about m g / k, until there is none, and then falls.
    rest, swing = G / 100.0, 0.2 - G / 100.0
    slack = math.acos(-rest / swing) / 10.0
    flies = 2.0 * swing * math.sin(10.0 * slack) * 10.0 / G
    assert [one.time for one in result.events[:2]] == pytest.approx([slack, slack + flies], abs=1e-8)


def test_gaps_and_modes_go_together() -> None:
    """Of two ropes in a row one is on a knot without mass and the other is let go: and no jerk is there."""
    ends = []
    for form in FORMS:
        scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0), t_end=2.0)
        ground, spring = scene.add("ground", Ground()), scene.add("spring", Spring(stiffness=100.0, natural_length=0.5))
        knot, rope = scene.add("knot", Pulley()), scene.add("rope", Rope(when_slack="slack"))
        under = scene.add("under", Rope(length=0.8, when_slack="slack", starts="slack", release="1.5 - t"))
        one, two = scene.add("one", PointMass()), scene.add("two", PointMass())
        scene.connect(ground.frame, spring.a)
        scene.connect(spring.b, knot.center)
        scene.connect(knot.center, rope.a)
        scene.connect(rope.b, one.point)
        scene.connect(one.point, under.a)
        scene.connect(under.b, two.point)
        scene.start.update(
            {"one.position.z": -1.7, "one.velocity.z": 0.0, "two.position.z": -1.8, "two.velocity.z": 0.0}
        )
        scene.guess["knot.position.z"] = -0.7
        result = simulate(scene, form=form, rtol=1e-10)
        assert ("under", "released", pytest.approx(1.5)) in [(e.part, e.target, e.time) for e in result.events]
        assert result.energy.max_drift < 1e-7
        ends.append(result["two.position.z"][-1])
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)


def test_what_is_said_of_it() -> None:
    scene = swung()
    assert assemble(scene).modes == {"rope": "taut"}
    far = swung()
    far.start["bob.position.z"] = -1.5
    with pytest.raises(StartError, match=r"stays open by .*it can also start slack"):
        simulate(far)
    with pytest.raises(UsageError, match="Gauss, symplectic does not end its steps on gaps"):
        simulate(scene, solver="gauss")
    still = swung(speed=0.0)
    assert linearize(still).contacts == {"rope.spare": "closed"}
    assert max(linearize(still).eigenvalues.imag) == pytest.approx(math.sqrt(G), rel=1e-9)


def test_derivatives_go_over_both_events() -> None:
    def ended(speed: float) -> Result:
        return simulate(swung(speed=speed), t_end=1.5, outputs=[0.0, 1.5], rtol=1e-13)

    found = sensitivities(
        swung(speed=5.2), ["bob.position.x"], start=["bob.velocity.x"], t_end=1.5, outputs=[1.5], rtol=1e-11
    )
    slopes = [
        (ended(5.2 + h)["bob.position.x"][-1] - ended(5.2 - h)["bob.position.x"][-1]) / (2.0 * h) for h in (2e-4, 1e-4)
    ]
    near = (4.0 * slopes[1] - slopes[0]) / 3.0
    assert found["bob.position.x", "bob.velocity.x"][-1] == pytest.approx(near, abs=1e-8)
