"""More coordinates than speeds: planar scenes with two coordinates for each angle, against the ordinary ones."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest

from atwood import Result, Scene
from atwood.forms.assembly import Assembly
from atwood.mechanics.dynamics.equations import Equations
from atwood.pipeline import assemble, assemble_flat, simulate
from atwood.reporting import report
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of, reference_coordinates
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.initialization.start import Start, find_start, own_state
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.problem.preparation import make_problem, pack_state
from atwood.simulation.run.run import run
from atwood_library import Ground, Link, Pivot, PointMass, Rod
from atwood_library.scenes import SCENES, FourBar

from ..helpers.directions import turn_directed, with_directions
from ..helpers.runs import EVERY_FORM, FORMS, difference_quotient
from ..helpers.tethers import Tether

NAMES = ("simple-pendulum", "double-pendulum", "pendulum-on-cart", "four-bar", "slider-crank")
LOOPS = ("four-bar", "slider-crank")


def gaps(one: Result, other: Result) -> dict[str, float]:
    """Return how far two runs are apart, where angles are the same after whole turns."""
    found = {}
    for path, values in one.table().items():
        gap = values - other.array(path)
        if one.unit(path) == "rad":
            gap = np.remainder(gap + math.pi, 2.0 * math.pi) - math.pi
        found[path] = float(np.max(np.abs(gap))) / max(1.0, float(np.max(np.abs(values))))
    return found


def assert_alike(one: Result, other: Result, tolerance: float) -> None:
    assert set(one.paths) == set(other.paths)
    worst = {path: gap for path, gap in gaps(one, other).items() if not gap <= tolerance}
    assert not worst


@pytest.mark.sample(2)
@pytest.mark.parametrize("solver", ["ida", "ida-sundae"])
@pytest.mark.parametrize(("form", "level"), EVERY_FORM)
@pytest.mark.parametrize("name", NAMES)
def test_runs_are_the_same(name: str, form: str, level: str, solver: str) -> None:
    settings = {"t_end": 1.0, "rtol": 1e-8, "outputs": 21}
    ordinary = simulate(SCENES[name](), form=form, level=level, **settings)
    turned = simulate(with_directions(SCENES[name](), form, level), solver=solver, **settings)
    assert_alike(ordinary, turned, 4e-5)
    assert turned.energy.max_drift < 1e-4
    if level != "index1":
        assert turned.constraint_max["position"] < 1e-13


@pytest.mark.parametrize("name", [name for name in NAMES if name not in LOOPS])
def test_explicit_runs_are_the_same(name: str) -> None:
    settings = {"t_end": 2.0, "rtol": 1e-11, "outputs": 21, "solver": "explicit"}
    assert_alike(simulate(SCENES[name](), **settings), simulate(with_directions(SCENES[name]()), **settings), 1e-8)


def test_states_are_coordinates_and_speeds() -> None:
    found = {
        form: [make(form).program for make in (_plan_of("double-pendulum"), _plan_of("four-bar"))] for form in FORMS
    }
    counts = {form: [(p.coordinates, p.speeds, p.multipliers, p.extra, p.size) for p in found[form]] for form in FORMS}
    assert counts["reduced"] == [(4, 2, 0, 0, 6), (6, 3, 0, 0, 9)]
    assert counts["dae"] == [(4, 4, 2, 2, 12), (12, 9, 8, 8, 37)]


def _plan_of(name: str):  # type: ignore[no-untyped-def]
    def make(form: str):  # type: ignore[no-untyped-def]
        assembly = with_directions(SCENES[name](), form)
        start = find_start(assembly)
        return make_problem(assembly, start.time, *own_state(assembly, start), start.length, 1.0)

    return make


def rocking_four_bar() -> FourBar:
    """Return a four-bar in which nothing turns fully, so that every choice of coordinates fails somewhere."""
    scene = FourBar(crank_length=1.6, coupler_length=1.2, rocker_length=1.6, frame_length=2.6)
    scene.start = {"crank.angle": 1.2, "crank.angular_velocity": 0.0}
    return scene


def test_dependent_coordinates_and_speeds_change_on_the_way() -> None:
    settings = {"t_end": 4.0, "rtol": 1e-10, "outputs": 41, "solver": "ida"}
    ordinary, turned = (
        simulate(scene, **settings) for scene in (rocking_four_bar(), with_directions(rocking_four_bar()))
    )
    for path in ("coupler.position.x", "coupler.position.z", "rocker.position.x"):
        assert np.allclose(turned.array(path), ordinary.array(path), atol=1e-5)
    plan = turned.run.segments[0].plan
    assert plan.switches > 2
    assert len(plan.dependent) == len(plan.dependent_speeds) == 2
    assert turned.energy.max_drift < 1e-6


# -- how coordinates move ---------------------------------------------------------------------------------------------


def states(name: str, form: str) -> tuple[Assembly, float, np.ndarray, np.ndarray]:
    assembly = with_directions(SCENES[name](), form)
    start = find_start(assembly)
    return (assembly, start.time, *own_state(assembly, start))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", NAMES)
def test_slopes_are_derivatives_along_the_speeds(name: str, form: str) -> None:
    assembly, t, q, u = states(name, form)
    equations = assembly.reduced if form == "reduced" else assembly.maximal
    balance = balance_of(assembly, assembly.form)
    kinematic_map = balance.kinematic_map
    tangent = difference_quotient(lambda d: kinematic_map.moved(t, q, d), np.zeros_like(u))
    assert np.allclose(tangent, kinematic_map.matrix(t, q), atol=1e-8)
    assert np.allclose(kinematic_map.rates(t, q, u), kinematic_map.matrix(t, q) @ u, atol=1e-12)
    if equations.constraints:
        along = difference_quotient(lambda d: balance.at(t, kinematic_map.moved(t, q, d), u).value, np.zeros_like(u))
        assert np.allclose(along, balance.at(t, q, u).jacobian, atol=1e-8)


def test_a_difference_leads_from_place_to_place() -> None:
    assembly, t, q, _ = states("double-pendulum", "reduced")
    kinematic_map = kinematic_map_of(assembly, "reduced")
    step = np.array([1e-5, -2e-5])
    there = kinematic_map.moved(t, q, step)
    assert np.allclose(kinematic_map.difference(t, q, there), step, atol=1e-13)
    # The same place with coordinates of another size.
    assert np.allclose(kinematic_map.difference(t, q, 3.0 * there), step, atol=1e-13)


def test_orientations_are_brought_back_to_size_one() -> None:
    assembly, t, q, _ = states("pendulum-on-cart", "reduced")
    kinematic_map = kinematic_map_of(assembly, "reduced")
    assert reference_coordinates(assembly.reduced).tolist() == [0.0, 1.0, 0.0]
    many = np.array([q * [1.0, 3.0, 3.0], q * [1.0, 0.2, 0.2]]).T
    assert np.allclose(kinematic_map.normalized(many), np.array([q, q]).T, atol=1e-15)
    assert not kinematic_map.needs_normalization(q)
    assert kinematic_map.needs_normalization(q * 3.0)
    assert kinematic_map.needs_normalization(q * 0.3)
    plain = kinematic_map_of(assemble(SCENES["pendulum-on-cart"]()), "reduced")
    assert plain.is_plain
    assert np.array_equal(plain.moved(t, q[:2], q[:2]), 2.0 * q[:2])


def test_a_run_goes_on_from_size_one_where_coordinates_have_strayed() -> None:
    """At a rough tolerance the size of (c, s) shrinks; the run restarts before it means something else."""
    assembly = with_directions(SCENES["simple-pendulum"]())
    scene_start = find_start(assembly)
    far = Start(**{**vars(scene_start), "coordinates": 2.5 * scene_start.coordinates})
    ordinary = simulate(SCENES["simple-pendulum"](), t_end=2.0, outputs=21)
    made = run(assembly, far, RunOptions(t_end=2.0, outputs=21), lambda modes, line_signs: assembly)
    assert_alike(ordinary, Result(made), 3e-6)
    sizes = np.sum(made.segments[0].coordinates ** 2, axis=0)
    assert np.allclose(sizes, 1.0, atol=1e-14)


# -- projection, start ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
def test_projection_finds_the_nearest_state(form: str) -> None:
    assembly, t, q, u = states("four-bar", form)
    balance = balance_of(assembly, assembly.form)
    sizes = motion_scales(assembly.own_equations, 1.0)
    step = 1e-4 * np.random.default_rng(7).standard_normal(len(u))
    moved = balance.kinematic_map.moved(t, q, step)
    met, speeds = balance.project(t, moved, u, sizes)
    assert max(balance.misses(t, met, speeds, sizes)) < 1e-13
    slope = balance.at(t, q, u).jacobian
    across = np.linalg.pinv(slope) @ slope @ step  # what the nearest place is away by, to first order
    assert np.allclose(balance.kinematic_map.difference(t, met, moved), across, atol=2e-7)


def test_a_start_is_found_from_what_is_said_of_places_and_velocities() -> None:
    scene = SCENES["double-pendulum"]()
    scene.start = {"bob1.position.x": 0.6, "bob2.position.x": 0.0, "bob2.velocity.z": 0.5}
    scene.guess = {"rod1.angle": 0.5, "rod2.angle": -0.5}
    ordinary, turned = find_start(assemble(scene)), find_start(with_directions(scene))
    pairs = turned.coordinates.reshape(2, 2)
    assert np.allclose(np.arctan2(pairs[:, 1], pairs[:, 0]), ordinary.coordinates, atol=1e-11)
    assert np.allclose(turned.speeds, ordinary.speeds, atol=1e-10)
    assert turned.free_coordinates == ()
    assert turned.free_speeds == ("rod1.angle'", "rod2.angle'")


def test_what_nothing_fixes_is_named_by_its_coordinates() -> None:
    scene = SCENES["double-pendulum"]()
    scene.start = {"rod1.angle": 0.3, "rod2.angular_velocity": 1.0}
    found = find_start(with_directions(scene))
    assert found.free_coordinates == ("rod2.angle.c", "rod2.angle.s")
    assert found.free_speeds == ("rod1.angle'",)


def test_freedom_counts_speeds(monkeypatch: pytest.MonkeyPatch) -> None:
    import atwood.reporting.mechanism as mechanism

    monkeypatch.setattr(mechanism, "assemble_flat", lambda *args, **kw: turn_directed(assemble_flat(*args, **kw)))
    found = report(SCENES["four-bar"]())
    assert found.degrees_of_freedom == 1
    assert len(found.coordinates) == 6
    assert found.states == {"reduced": 9, "dae": 37}


def test_consistent_rates_of_coordinates_are_packed() -> None:
    assembly, t, q, u = states("four-bar", "dae")
    plan = make_problem(assembly, t, q, u, 1.0, 1.0)
    y, yp = pack_state(plan, t, q, u)
    residual = assembly.compiled(plan.program.residual).bind(plan.values)([t], y, yp)[0]
    assert np.max(np.abs(residual)) < 1e-12


# -- modes ------------------------------------------------------------------------------------------------------------


def rod_on_a_rope() -> Scene:
    """Return a pendulum whose bob is caught by a rope, and a link that swings beside it on the way."""
    scene = Scene(t_end=1.5)
    ground, far = scene.add("ground", Ground()), scene.add("far", Ground(position=(-0.9, 0.0, 0.3)))
    rod, bob = scene.add("rod", Rod()), scene.add("bob", PointMass())
    pivot, link = scene.add("pivot", Pivot()), scene.add("link", Link(length=0.7, mass=0.5))
    rope = scene.add("rope", Tether(length=1.9, starts="slack"))
    scene.connect(ground.frame, rod.a)
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, link.a)
    scene.connect(rod.b, bob.point)
    scene.connect(far.frame, rope.a)
    scene.connect(rope.b, bob.point)
    scene.start.update({"rod.angle": -0.6, "rod.angular_velocity": 2.5})
    scene.start.update({"link.angle": 0.4, "link.angular_velocity": 0.0})
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_states_pass_between_modes(form: str) -> None:
    ordinary = simulate(rod_on_a_rope(), form=form, rtol=1e-9, outputs=31)
    assert [one.law for one in ordinary.events][:2] == ["comes_taut", "goes_slack"]
    assembly = with_directions(rod_on_a_rope(), form)

    def reassemble(modes: Mapping[str, str], line_signs: Mapping[tuple[str, str, str], float], _: object) -> Assembly:
        return turn_directed(assemble_flat(assembly.flat, form=form, modes=modes, line_signs=line_signs))

    options = RunOptions(t_end=1.5, relative_tolerance=1e-9, outputs=31)
    turned = Result(run(assembly, find_start(assembly), options, reassemble))
    assert [one.law for one in turned.events] == [one.law for one in ordinary.events]
    assert np.allclose(turned.time, ordinary.time, rtol=0.0, atol=1e-7)
    for path in ("bob.position.x", "link.position.x", "link.position.z"):
        assert np.allclose(turned.array(path), ordinary.array(path), atol=1e-6)


def test_the_helper_leaves_no_angle() -> None:
    """Otherwise the tests above would compare the ordinary equations with themselves."""
    assembly = with_directions(SCENES["four-bar"]())
    every: tuple[Equations, ...] = (assembly.reduced, assembly.maximal)
    for equations in every:
        assert equations.orientation_coordinates
        assert not {one.unit for one in equations.names} & {"rad"}
        assert len(equations.coordinates) == len(equations.speeds) + len(equations.orientation_coordinates)
