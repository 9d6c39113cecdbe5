"""Scenes turned and moved: what a mechanism is does not depend on where it stands.

A four-bar in space has three constraints too many, whichever way its plane lies. As many orientations and places as one
likes are tried by a command, `python -m tests.scenes.test_turned 200`; on a plate that a drive turns, or on a shaft
that is free to turn, by `python -m tests.scenes.test_turned 200 driven` or `governor`; `--anywhere` turns their axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from atwood import Component, Frame, Scalar, Scene, StartError, connector, constraint, simulate, sqrt
from atwood.pipeline import assemble
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.initialization.start import find_start, own_state
from atwood.simulation.problem.preparation import make_problem
from atwood.simulation.problem.problem import SceneProblem
from atwood_library import Ground, Link, Pivot, RigidBody, Rod, Spherical, Weld

from ..helpers.four_bars import (
    UPRIGHT,
    Seen,
    Stand,
    apart,
    driven,
    governor,
    plates,
    run,
    seen,
    standing,
    stands,
    turned,
)

FORMS = ("reduced", "dae")

KNOWN = 1e-10
"""How accurately a start is known, relative to its size, wherever it is."""


# -- at the start -----------------------------------------------------------------------------------------------------


EXACT = tuple(Stand(math.radians(degrees)) for degrees in (math.degrees(1e-6), 1.0, 10.0, 30.0, 45.0, 90.0, 180.0))
SCALED = tuple(Stand(0.3, (1.0, -2.0, 0.5), length=10.0**a, mass=10.0**b) for a, b in ((-3, 6), (6, -6)))


ASKEW = Stand(0.4, (1.0, 2.0, 3.0))


@pytest.fixture(scope="module")
def askew() -> dict[str, Seen]:
    return {form: seen(standing(ASKEW), form) for form in FORMS}


def differs(found: Seen, expected: Seen, stand: Stand) -> float:
    """Return by how much more than can be known; infinite where it is another mechanism."""
    if (found.freedom, found.redundant) != (1, expected.redundant):
        return math.inf
    straight = turned(-ASKEW.angle, ASKEW.axis, expected.forces)
    forces = turned(stand.angle, stand.axis, straight) * stand.mass * stand.length
    gaps = [np.max(np.abs(found.forces - forces)) / np.max(np.abs(forces))]
    gaps += [np.max(np.abs(found.acceleration - expected.acceleration), initial=0.0) / 10.0]
    return float(max(gaps))


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("stand", [*EXACT[::2], *stands(4), *SCALED, Stand(0.3, pivot=(0.0, -0.6, 0.8))], ids=str)
def test_a_turned_four_bar_is_the_same(askew: dict[str, Seen], stand: Stand, form: str) -> None:
    found = seen(standing(stand), form)
    if stand.pivot == UPRIGHT.pivot:
        assert differs(found, askew[form], stand) < KNOWN
    assert (found.freedom, len(found.redundant)) == (1, 3)


@pytest.mark.parametrize("drift", [1e-10, 1e-8, 1e-6])
def test_a_state_that_has_drifted_off_its_constraints_has_no_more_of_them(drift: float) -> None:
    """Without projection redundant constraints miss each other by what the motion has drifted: that is no rank."""
    assembly = assemble(standing(ASKEW), form="dae")
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    at = np.array([start.time]), q[:, None], u[:, None]
    known = ReactionSolver(assembly, start.time, q, u)
    off = q + drift * np.random.default_rng(3).standard_normal(len(q))
    found = ReactionSolver(assembly, start.time, off, u)
    assert found.finding.rank == known.finding.rank
    gap = np.abs(found.at(at[0], off[:, None], at[2])[0] - known.at(*at)[0])
    assert np.nanmax(gap) < 1e3 * drift


def test_the_order_of_parts_is_no_matter(askew: dict[str, Seen]) -> None:
    for order in ((3, 2, 1, 0), (1, 3, 0, 2)):
        found = seen(standing(ASKEW, order), "dae")
        assert (found.freedom, len(found.redundant)) == (1, 3)
        np.testing.assert_allclose(found.forces, askew["dae"].forces, atol=1e-12)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_rod_beside_a_link_is_one_constraint_too_many(form: str) -> None:
    scene = Scene(space="space", t_end=0.2)
    ground, ball = scene.add("ground", Ground()), scene.add("ball", Spherical())
    link, rod = scene.add("link", Link(axial_moment=0.01)), scene.add("rod", Rod(mass=0.0))
    for one, other in ((ground.frame, ball.a), (ball.b, link.a), (link.a, rod.a), (link.b, rod.b)):
        scene.connect(one, other)
    found = simulate(scene, form=form, rtol=1e-10, outputs=3)
    assert found.status == "finished"
    assert len(found.run.segments[0].plan.finding.redundant) == 1
    alone = Scene(space="space", t_end=0.2)
    ground, ball, link = (
        alone.add("ground", Ground()),
        alone.add("ball", Spherical()),
        alone.add("link", Link(axial_moment=0.01)),
    )
    alone.connect(ground.frame, ball.a)
    alone.connect(ball.b, link.a)
    expected = simulate(alone, form=form, rtol=1e-10, outputs=3).array("link.position.z")
    np.testing.assert_allclose(found.array("link.position.z"), expected, atol=1e-7)


class Flat(Component):
    """A point in the plane x-z: what a link in that plane is anyway. Its law has values for x > 0 alone."""

    a: Frame = connector(Frame, "The ground.")
    b: Frame = connector(Frame, "What stays in the plane.")

    @constraint(reaction="side_force", unit="N", spaces=("space",), doc="Force along y.")
    def flatness(self) -> Scalar:
        """Hold the point in the plane."""
        way = self.b.position - self.a.position
        return way.y * (1.0 + sqrt(way.x))


@pytest.mark.parametrize("form", FORMS)
def test_a_place_near_by_where_a_law_has_no_value_says_nothing(form: str) -> None:
    scene = Scene(space="space", gravity=0.0)
    ground, hinge = scene.add("ground", Ground()), scene.add("hinge", Pivot(axis=(0.0, -1.0, 0.0)))
    link, flat = scene.add("link", Link(axial_moment=0.01)), scene.add("flat", Flat())
    joined = ((ground.frame, hinge.a), (hinge.b, link.a), (ground.frame, flat.a), (link.b, flat.b))
    for one, other in joined:
        scene.connect(one, other)
    scene.start.update({"hinge.angle": 0.5 * math.pi - 1e-3, "hinge.angular_velocity": 0.0})
    assembly = assemble(scene, form=form)
    start = find_start(assembly)
    plan = make_problem(assembly, start.time, *own_state(assembly, start), start.length, 1.0)
    assert len(plan.sizes) - plan.finding.rank == 1


def door(length: float) -> Scene:
    """Return a door that hangs on two hinges, one above the other; it has five constraints too many."""
    scene = Scene(space="space", t_end=length**0.5)
    ground, high = scene.add("ground", Ground()), scene.add("high", Weld(displacement=(0.0, 0.0, 2.0 * length)))
    moments = tuple(length**2 * one for one in (0.3, 0.4, 0.1))
    leaf = scene.add("leaf", RigidBody(mass=1.0, center=(0.5 * length, 0.0, length), moments=moments))
    up = scene.add("up", Weld(displacement=(0.0, 0.0, 2.0 * length)))
    scene.connect(ground.frame, high.a)
    scene.connect(leaf.frame, up.a)
    for name, (a, b) in {"low": (ground.frame, leaf.frame), "top": (high.b, up.b)}.items():
        hinge = scene.add(name, Pivot(axis=(0.0, 0.0, 1.0)))
        scene.connect(a, hinge.a)
        scene.connect(hinge.b, b)
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_shares_that_are_open_do_not_depend_on_the_unit_of_length(form: str) -> None:
    """The weight's moment goes into the hinges' moments and into a couple of their forces, in some proportion."""

    def shares(length: float) -> list[float]:
        assembly = assemble(door(length), form=form)
        start = find_start(assembly)
        q, u = own_state(assembly, start)
        found = ReactionSolver(assembly, 0.0, q, u).at(np.array([0.0]), q[:, None], u[:, None])[0][:, 0]
        values = dict(zip((one.path for one in assembly.reactions), found, strict=True))
        moment = math.hypot(values["top.bearing_1"], values["top.bearing_2"]) / length
        return [values["top.force.x"], values["top.force.z"], moment]

    for length in (1e-6, 1e6):
        np.testing.assert_allclose(shares(length), shares(1.0), rtol=1e-9, atol=1e-9)


# -- on what turns ----------------------------------------------------------------------------------------------------


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("stand", [Stand(-2.1, (0.3, -1.2, 0.7), (2e5, -7e5, 3e5)), *stands(3, seed=9)], ids=str)
def test_a_run_far_away_is_as_accurate_as_one_near_by(stand: Stand, form: str) -> None:
    motion, forces = apart(run(standing(stand), form), run(standing(), form), stand)
    assert motion < 1e-9
    assert forces < 1e-8


@pytest.mark.sample(1)
@pytest.mark.parametrize("stand", [Stand(0.7), Stand(1.3, whole=2.2, about=(0.4, -1.0, 0.7))], ids=str)
@pytest.mark.parametrize("make", [driven, governor])
@pytest.mark.parametrize("form", FORMS)
def test_what_is_redundant_changes_as_a_plate_turns(make: Callable[[Stand], Scene], form: str, stand: Stand) -> None:
    """The plane of the four-bar turns through coordinate planes, so that other components follow from the rest."""
    found, expected = run(make(stand), form, 1e-13), run(make(UPRIGHT), form, 1e-13)
    motion, forces = apart(found, expected, stand)
    assert motion < 1e-9
    assert forces < 1e-9
    assert max(found.energy.max_drift, expected.energy.max_drift) < 1e-7


@pytest.mark.sample(1)
@pytest.mark.parametrize("number", [4, 10])
def test_what_rounding_makes_of_constraints_is_asked_where_they_are(number: int) -> None:
    """Bearings of a loop in a coordinate plane are exactly alike at the start; as it turns away, they round."""
    found = simulate(driven(list(plates(11))[number]), rtol=1e-10, outputs=20)
    plan = found.run.segments[0].plan
    constraints, names = plan.assembly.own_equations.constraints, plan.assembly.own_equations.names
    ways = np.stack([found.array(one.name) for one in names])
    for t, q in zip(found.time, ways.T, strict=True):
        kept = (plan.better_kept(t, q) or plan.finding).kept
        assert {constraints[i].key[1] for i in kept} == {"coincidence"}, t


@pytest.mark.sample(1)
@pytest.mark.parametrize("reviews", [True, False])
@pytest.mark.parametrize("make", [driven, governor])
def test_steps_do_not_shrink_where_what_is_kept_becomes_redundant(
    make: Callable[[Stand], Scene], reviews: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fifth of a radian after its start a component that was kept says nothing any more.

    Others are kept from the start; and where they are not, many short steps are reason enough to look.
    """
    if not reviews:
        monkeypatch.setattr(SceneProblem, "keep_better", lambda *_: None)
    found = simulate(make(Stand(1.360841402195895)), form="dae", rtol=1e-13, outputs=13, max_steps=200)
    assert found.status == "finished"


@pytest.mark.sample(2)
@pytest.mark.parametrize("angle", [1.6e-10, 2.1242e-4, 1.5926, -2.74, 4.1e-9])
@pytest.mark.parametrize("form", FORMS)
def test_a_shaft_that_nothing_is_said_of_starts_where_it_is(form: str, angle: float) -> None:
    """While a loop closes, the shaft that it is on seems to matter a little, less and less; rounding must not count."""
    found = simulate(governor(Stand(angle, place=(0.3, -2.0, 0.1))), form=form, t_end=1e-3, outputs=2)
    assert abs(found.array("bearing.angle")[0]) < 1e-11


@pytest.mark.sample(1)
@pytest.mark.parametrize("angle", [2e-5, -1e-7, 1e-4, 1e-6, -3e-5])
@pytest.mark.parametrize("form", FORMS)
def test_a_plate_that_turns_may_stand_a_little_turned(form: str, angle: float) -> None:
    """What a drive prescribes rounds also in rows that hold nothing: that is no contradiction of speeds."""
    found = seen(driven(Stand(angle)), form)
    assert (found.freedom, len(found.redundant)) == (1, 3 if form == "dae" else len(found.redundant))


@pytest.mark.sample(2)
@pytest.mark.parametrize("angle", [5.899870841674139e-09, -3e-7, 1.4930834352789646e-11, 2.8886809636387453e-12])
def test_starts_on_a_plate_that_is_turned_by_next_to_nothing_meet_their_speeds(angle: float) -> None:
    """Rows that are a billionth of others are known no better than what the drive prescribes in them rounds."""
    assembly = assemble(driven(Stand(angle)))
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    plan = make_problem(assembly, start.time, q, u, start.length, 1.0)
    assert max(plan.balance.misses(start.time, q, u, plan.sizes)) < 1e-12


def test_speeds_that_contradict_a_drive_are_refused() -> None:
    scene = driven(Stand(2e-5))
    scene.start["pivot1.angular_velocity"] = 0.5
    with pytest.raises(StartError, match=r"angular_velocity.*contradict"):
        seen(scene, "reduced")


def test_speeds_that_contradict_each_other_are_named() -> None:
    scene = standing(EXACT[3])
    scene.start["pivot1.angular_velocity"] = 5.0
    with pytest.raises(StartError, match=r"pivot1.angular_velocity = 5.*1 free coordinate"):
        find_start(assemble(scene))


if __name__ == "__main__":
    from .turned_many import main

    main()
