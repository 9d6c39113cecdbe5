"""Bodies in space through the whole chain: loops, modes, methods and comparisons with more coordinates than speeds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import atwood_library as lib
from atwood import Scene, compare, report, simulate, sweep
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.initialization.start import find_start

from ..helpers.runs import FORMS, prepare
from ..helpers.tethers import Tether


def linkage() -> Scene:
    """Return a crank and a rocker about axes that cross, with a coupler on ball joints between them."""
    scene = Scene(space="space", t_end=1.5)
    g1, g2 = scene.add("g1", lib.Ground()), scene.add("g2", lib.Ground(position=(2.0, 1.0, 0.0)))
    p1, p2 = scene.add("p1", lib.Pivot(axis=(0.0, 1.0, 0.0))), scene.add("p2", lib.Pivot(axis=(1.0, 0.0, 0.0)))
    crank = scene.add("crank", lib.RigidBody(mass=0.5, center=(0.25, 0.0, 0.0), moments=(0.001, 0.02, 0.02)))
    rocker = scene.add("rocker", lib.RigidBody(mass=0.8, center=(0.0, 0.0, 0.6), moments=(0.05, 0.05, 0.002)))
    coupler = scene.add("coupler", lib.RigidBody(mass=0.6, center=(1.0, 0.0, 0.0), moments=(0.002, 0.2, 0.2)))
    s1, s2 = scene.add("s1", lib.Spherical()), scene.add("s2", lib.Spherical())
    w1, w2 = scene.add("w1", lib.Weld(displacement=(0.5, 0, 0))), scene.add("w2", lib.Weld(displacement=(2.0, 0, 0)))
    w3 = scene.add("w3", lib.Weld(displacement=(0, 0, 1.2)))
    pairs = [(g1.frame, p1.a), (p1.b, crank.frame), (crank.frame, w1.a), (w1.b, s1.a), (s1.b, coupler.frame)]
    pairs += [(coupler.frame, w2.a), (w2.b, s2.a), (g2.frame, p2.a), (p2.b, rocker.frame), (rocker.frame, w3.a)]
    for a, b in [*pairs, (w3.b, s2.b)]:
        scene.connect(a, b)
    scene.start.update({"p1.angle": 0.4, "p1.angular_velocity": 3.0, "coupler.spin.x": 0.0})
    scene.guess.update({"p2.angle": 0.3})
    return scene


def test_a_loop_in_space_runs_in_both_forms() -> None:
    runs = [simulate(linkage(), form=form, rtol=1e-9, outputs=16, solver="ida") for form in FORMS]
    reduced, dae = runs
    plan = reduced.run.segments[0].plan
    assert (plan.program.coordinates, plan.program.speeds) == (6, 5)
    assert len(plan.dependent) == len(plan.dependent_speeds) == 3
    assert plan.switches > 0
    for path in ("coupler.position.x", "coupler.position.z", "p2.angle", "coupler.x_axis.y"):
        assert np.allclose(reduced.array(path), dae.array(path), atol=2e-6)
    assert np.allclose(reduced.array("s2.force.x"), dae.array("s2.force.x"), atol=1e-3)
    for one in runs:
        assert one.energy.max_drift < 1e-5
        assert one.constraint_max["position"] < 1e-13
        assert one.constraint_max["velocity"] < 1e-13
    # The coupler can turn about its own axis: one freedom beside that of the crank.
    found = report(linkage())
    assert found.degrees_of_freedom == 2
    assert found.states == {"reduced": 11, "dae": 71}


def caught() -> Scene:
    """Return a body on a ball joint, whose tip a rope catches with a jerk."""
    scene = Scene(space="space", t_end=2.0)
    ground, far = scene.add("ground", lib.Ground()), scene.add("far", lib.Ground(position=(-1.0, 0.3, 0.2)))
    ball, tip = scene.add("ball", lib.Spherical()), scene.add("tip", lib.Weld(displacement=(0.0, 0.0, -1.0)))
    body = scene.add("body", lib.RigidBody(mass=1.0, center=(0.05, 0.0, -0.5), moments=(0.1, 0.12, 0.03)))
    rope = scene.add("rope", Tether(length=1.75, starts="slack"))
    for a, b in [(ground.frame, ball.a), (ball.b, body.frame), (body.frame, tip.a), (far.frame, rope.a)]:
        scene.connect(a, b)
    scene.connect(tip.b, rope.b)
    scene.start.update({"body.spin.x": 0.7, "body.spin.y": -2.5, "body.spin.z": 3.0})
    return scene


def test_orientations_pass_between_modes() -> None:
    ways = [("reduced", "ida"), ("reduced", "explicit"), ("dae", "ida")]
    runs = [simulate(caught(), form=form, solver=solver, rtol=1e-9, outputs=21) for form, solver in ways]
    laws = [one.law for one in runs[0].events]
    assert laws[:2] == ["comes_taut", "goes_slack"]
    for one in runs:
        assert [happening.law for happening in one.events] == laws
        assert one.energy.max_drift < 1e-5
        for path in ("body.position.x", "body.position.y", "body.z_axis.x", "body.x_axis.y"):
            assert np.allclose(one.array(path)[-5:], runs[0].array(path)[-5:], atol=2e-5)


def top(**settings: float) -> Scene:
    """Return an unsymmetric body on a ball joint."""
    scene = Scene(space="space", t_end=1.0, **settings)
    ground, ball = scene.add("ground", lib.Ground()), scene.add("ball", lib.Spherical())
    body = scene.add("body", lib.RigidBody(mass=1.0, center=(0.1, 0.0, 0.5), moments=(0.2, 0.25, 0.1)))
    scene.connect(ground.frame, ball.a)
    scene.connect(ball.b, body.frame)
    scene.start.update({"body.spin.x": 2.0, "body.spin.y": 0.0, "body.spin.z": 5.0})
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize("solver", ["ida", "ida-sundae", "explicit"])
def test_every_method_agrees_with_taylor_series(solver: str) -> None:
    paths = ("body.position.x", "body.x_axis.y", "body.spin.z", "body.kinetic_energy", "ball.force.x")
    exact = simulate(top(), rtol=1e-13, outputs=11, solver="taylor")
    other = simulate(top(), rtol=1e-10, outputs=11, solver=solver)
    for path in paths:
        assert np.allclose(other.array(path), exact.array(path), atol=1e-6)


def test_sweeps_with_orientations_are_those_of_single_runs() -> None:
    masses, paths = [0.5, 1.0, 2.0], ["body.position.x", "body.x_axis.y", "body.spin.z", "ball.force.x"]
    settings = {"rtol": 1e-9, "outputs": 5, "solver": "explicit"}
    swept = sweep(top(), {"body.mass": masses}, quantities=paths, **settings)
    assert swept.statistics.batched == len(masses)
    for k, mass in enumerate(masses):
        scene = top()
        scene.set("body.mass", mass)
        alone = simulate(scene, **settings)
        for path in paths:
            assert np.allclose(swept[path][k], alone.array(path), atol=1e-9)


def test_orientations_are_compared_by_their_axes() -> None:
    found = compare(top(), rtols=(1e-5, 1e-7), levels=("ggl",))
    assert "body.x_axis.y" in found.reference.quantities
    assert not any("quaternion" in path for path in found.reference.quantities)
    for row in found.rows:
        assert row.error is not None
        assert row.error < 1e4 * row.rtol
    assert {row.label for row in found.rows} >= {"reduced, IDA", "reduced, explicit", "dae (ggl), IDA"}


@pytest.mark.parametrize("form", FORMS)
def test_a_rough_run_goes_on_although_coordinates_shrink(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The size of a quaternion means nothing: one that has strayed is put back, and the motion goes on."""
    from atwood.simulation.dynamics.kinematic_map import KinematicMap

    strayed: list[bool] = []
    needs_normalization = KinematicMap.needs_normalization
    monkeypatch.setattr(
        KinematicMap, "needs_normalization", lambda self, q: strayed.append(needs_normalization(self, q)) or strayed[-1]
    )
    made = simulate(top(gravity=0.0), form=form, solver="ida", rtol=1e-3, t_end=600.0, outputs=31)
    assert made.status == "finished"
    assert any(strayed)
    for segment in made.run.segments:
        chart = list(made.assembly.own_equations.orientation_coordinates[0].coordinates)
        assert np.allclose(np.sum(segment.coordinates[chart] ** 2, axis=0), 1.0, atol=1e-14)


def test_the_size_of_a_quaternion_changes_nothing() -> None:
    prepared = prepare(top(), "reduced")
    kernel = prepared.assembly.kernel(prepared.plan.balance.program.program)
    q = np.array([0.5, -0.3, 0.7, 0.1])
    one, other = kernel([0.0], q, prepared.u), kernel([0.0], -3.0 * q, prepared.u)
    for group, again in zip(one, other, strict=True):
        assert np.allclose(group, again, rtol=1e-13, atol=1e-13)
    turning = kinematic_map_of(prepared.assembly, "reduced")
    step = np.array([1e-6, -2e-6, 3e-6])
    moved = turning.moved(0.0, turning.normalized(q), step)
    # Either sign of a quaternion is the same orientation.
    for there in (moved, -2.0 * moved):
        assert np.allclose(turning.difference(0.0, turning.normalized(q), there), step, atol=1e-15)
    assert find_start(prepared.assembly).coordinates.tolist() == [1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("form", FORMS)
def test_steps_go_back_to_where_an_orientation_has_strayed(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Outputs are asked for at once; those behind a place where coordinates are put right are worked out again."""
    from atwood.simulation.dynamics.kinematic_map import KinematicMap

    expected = simulate(top(gravity=0.0), form=form, solver="explicit", rtol=1e-9, t_end=20.0, outputs=31)
    asked: list[bool] = []

    def strays(self: KinematicMap, q: Any) -> Any:
        """Say so of the second of several states, and, when that is put right, of the third."""
        found = np.zeros(q.shape[1:], dtype=bool)
        if found.size > 2 and len(asked) < 2:
            found[1 + len(asked)] = True
            asked.append(True)
        return found

    monkeypatch.setattr(KinematicMap, "needs_normalization", strays)
    made = simulate(top(gravity=0.0), form=form, solver="explicit", rtol=1e-9, t_end=20.0, outputs=31)
    assert made.status == "finished"
    assert made.statistics.reinitializations - expected.statistics.reinitializations == len(asked) == 2
    assert np.array_equal(made.time, expected.time)
    assert np.allclose(made["body.x_axis.y"], expected["body.x_axis.y"], atol=1e-6)
