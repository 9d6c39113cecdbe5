"""Mechanisms whose loops are solved by formulas, against geometry, energy and the numeric loop."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import make_interp_spline

from atwood import Result, Scene, assemble, compare, simulate
from atwood.arrays import FloatArray
from atwood.forms.loops.closed_form import closed_form
from atwood.integrators.ida import library as sundials_library
from atwood.simulation.initialization.start import find_start, own_state
from atwood.simulation.problem import closed_loops
from atwood.simulation.problem.closed_loops import Solved, solve_at
from atwood.simulation.problem.preparation import make_problem
from atwood_library import Ground, Link, Pivot
from atwood_library.scenes import AndrewsSqueezer, Bricard, FourBar, FourBarRow, SliderCrank, Strandbeest

from ..references.pendulum import PlanePendulum
from ..scenes import test_turned_mechanisms as turned

needs_sundials = pytest.mark.skipif(not sundials_library.available(), reason="the SUNDIALS libraries are not here")

Point = complex
Chain = list[tuple[float, Point, Point, Point, Point]]
"""Of each uniform link its mass, and its ends with their derivatives by the angle of the crank."""


def solved(scene: Scene) -> Solved | None:
    """Return how the loops of a scene are solved at its start."""
    assembly = assemble(scene)
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    return solve_at(make_problem(assembly, start.time, q, u, start.length, 1.0), start.time, q, u)


def by_formulas(result: Result) -> bool:
    """Return whether formulas solved the loops of a run from its start to its end."""
    return all(one.solver in ("explicit", "taylor") for one in result.run.choices)


def states(result: Result) -> FloatArray:
    """Return all coordinates and speeds of a run."""
    parts = [np.concatenate([one.coordinates, one.speeds]) for one in result.run.segments]
    return np.concatenate(parts, axis=1)


# -- known answers ------------------------------------------------------------------------------------------------


def four_bar_links(angle: float, side: float = 1.0) -> Chain:
    """Return the links of the library's four-bar, from the intersection of two circles."""
    crank, coupler, rocker, frame = 1.0, 2.5, 2.0, 2.5
    b, db = crank * np.exp(1j * angle), 1j * crank * np.exp(1j * angle)
    d = complex(frame) - b
    along = (coupler**2 - rocker**2 + abs(d) ** 2) / (2.0 * abs(d))
    c = b + d / abs(d) * (along + side * 1j * math.sqrt(coupler**2 - along**2))
    # the joint keeps its distances from both ends
    one, other = c - b, c - frame
    rows = np.array([[one.real, one.imag], [other.real, other.imag]])
    x, y = np.linalg.solve(rows, [one.real * db.real + one.imag * db.imag, 0.0])
    dc = complex(x, y)
    return [(0.1, 0j, b, 0j, db), (0.25, b, c, db, dc), (0.2, c, complex(frame), dc, 0j)]


def slider_crank_links(angle: float) -> Chain:
    """Return the links of the library's slider-crank; the piston is two masses that move as its pin does."""
    crank, rod = 0.5, 1.5
    b, db = crank * np.exp(1j * angle), 1j * crank * np.exp(1j * angle)
    reach = math.sqrt(rod**2 - b.imag**2)
    c, dc = complex(b.real + reach), complex(db.real - b.imag * db.imag / reach)
    return [(0.25, 0j, b, 0j, db), (0.5, b, c, db, dc), (0.5, c, c, dc, dc)]


def inertia_and_potential(links: Chain) -> tuple[float, float]:
    """Return the inertia that the crank feels, and the potential energy."""

    def dot(a: Point, b: Point) -> float:
        return (a * b.conjugate()).real

    inertia = sum(m / 3.0 * (dot(da, da) + dot(da, db) + dot(db, db)) for m, _, _, da, db in links)
    return inertia, sum(9.81 * m * (a.imag + b.imag) / 2.0 for m, a, b, _, _ in links)


@pytest.mark.parametrize(
    ("scene", "links"), [(FourBar, four_bar_links), (SliderCrank, slider_crank_links)], ids=["four-bar", "slider-crank"]
)
@pytest.mark.parametrize("solver", ["explicit", "taylor"])
def test_the_crank_takes_the_time_that_its_energy_tells(
    scene: Callable[[], Scene], links: Callable[[float], Chain], solver: str
) -> None:
    made = scene()
    made.start["crank.angular_velocity"] = 9.0  # so that it turns on
    result = simulate(made, solver=solver, rtol=1e-13, t_end=1.5, outputs=16)
    angle = result["crank.angle"]
    inertia, potential = inertia_and_potential(links(angle[0]))
    energy = 0.5 * inertia * 9.0**2 + potential

    def slowness(at: float) -> float:
        inertia, potential = inertia_and_potential(links(at))
        return math.sqrt(0.5 * inertia / (energy - potential))

    nodes, weights = np.polynomial.legendre.leggauss(40)
    assert np.all(np.diff(angle) > 0.3)
    assert angle[-1] - angle[0] > math.tau
    taken = [
        0.5
        * (b - a)
        * sum(w * slowness(0.5 * (a + b) + 0.5 * (b - a) * x) for x, w in zip(nodes, weights, strict=True))
        for a, b in itertools.pairwise(angle)
    ]
    assert_allclose(np.cumsum(taken), result.time[1:], atol=1e-11)


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("scene", "unknowns", "operations"),
    [(FourBar, 2, 125), (SliderCrank, 2, 55), (AndrewsSqueezer, 2, 380), (Strandbeest, 2, 900)],
    ids=["four-bar", "slider-crank", "andrews", "strandbeest"],
)
def test_what_is_integrated_is_one_angle_and_its_rate(
    scene: Callable[[], Scene], unknowns: int, operations: int
) -> None:
    found = solved(scene())
    assert found is not None
    program = found.form.accelerations.program
    assert sum(len(group.symbols) for group in program.inputs[1:]) == unknowns
    assert sum(program.operations.values()) <= operations
    assert program.operations["sin"] == program.operations["cos"] == 1
    assert "atan2" not in program.operations
    assert "solve" not in program.operations


@needs_sundials
@pytest.mark.sample(1)
@pytest.mark.parametrize("scene", [FourBar, SliderCrank, AndrewsSqueezer, Strandbeest])
def test_runs_are_those_of_the_numeric_loop(scene: Callable[[], Scene]) -> None:
    end = min(scene().t_end, 1.0)
    result, numeric = (simulate(scene(), t_end=end, rtol=1e-10, solver=one) for one in ("auto", "ida"))
    assert by_formulas(result)
    assert "formulas solve its closed loops" in result.solver
    assert result.run.statistics.steps < 0.2 * numeric.run.statistics.steps
    assert result.paths == numeric.paths
    one, other = states(result), states(numeric)
    sizes = np.max(np.abs(other), axis=1, keepdims=True) + 1e-9
    assert np.max(np.abs(one - other) / sizes) < 1e-6
    for path in [path for path in result.paths if ".force" in path or ".tension" in path][:6]:
        size = np.max(np.abs(numeric[path])) + 1e-6
        assert np.max(np.abs(result[path] - numeric[path])) < 1e-4 * size, path


# -- whichever way it is put ---------------------------------------------------------------------------------------


@pytest.mark.sample(1)
@pytest.mark.parametrize("scene", [FourBar, SliderCrank])
@pytest.mark.parametrize("base", [*turned.BASES, (1.0, (1.0, 1.0, 1.0), (1e3, 0.0, 0.0))])
def test_loops_in_any_plane_of_space_are_solved(
    scene: Callable[..., Scene],
    base: tuple[float, tuple[float, ...], tuple[float, ...]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def upright() -> Scene:
        made = scene(space="space")
        made.start = {"pivot1.angle": 1.0, "pivot1.angular_velocity": 3.0}
        made.guess = {"pivot2.angle": -0.7, "pivot4.angle": 1.9} if scene is FourBar else {"pivot2.angle": -1.2}
        return made

    monkeypatch.setitem(turned.MAKE, "loop", (upright, {}))
    result = simulate(turned.stands_on("loop", *base), rtol=1e-11, t_end=1.0)
    still = scene()
    still.gravity = 0.0
    still.start = {"crank.angle": 1.0, "crank.angular_velocity": 3.0}
    flat = simulate(still, rtol=1e-12, t_end=1.0)
    assert by_formulas(result)
    assert_allclose(result["pivot1.angle"], flat["crank.angle"], atol=1e-9)
    assert result.energy.max_drift < 1e-9


def linkage(backwards: bool, size: float = 1.0, on_swing: bool = False) -> Scene:
    """Return a four-bar with its parts in one order or the other, under names whose order is as well."""
    scene = Scene(t_end=1.0 * math.sqrt(size))
    names = ["left", "crank", "coupler", "rocker", "right", "one", "two", "three", "four"]
    parts = [
        Ground(),
        Link(length=1.0 * size, mass=0.1),
        Link(length=2.5 * size, mass=0.25),
        Link(length=2.0 * size, mass=0.2),
        Ground(position=(2.4 * size, 0.0, 0.3 * size)),
        *(Pivot() for _ in range(4)),
    ]
    title = {name: f"{'zyxwvutsr'[i]}_{name}" if backwards else name for i, name in enumerate(names)}
    made = dict(zip(names, parts, strict=True))
    added = {name: scene.add(title[name], made[name]) for name in (reversed(names) if backwards else names)}
    pairs = [
        (added["one"].b, added["crank"].a),
        (added["crank"].b, added["two"].a),
        (added["two"].b, added["coupler"].a),
        (added["coupler"].b, added["three"].a),
        (added["three"].b, added["rocker"].b),
        (added["rocker"].a, added["four"].b),
    ]
    if on_swing:
        swing, hinge = scene.add("swing", Link(length=2.4, mass=3.0)), scene.add("hinge", Pivot())
        pairs += [(added["left"].frame, hinge.a), (hinge.b, swing.a)]
        pairs += [(swing.a, added["one"].a), (swing.b, added["four"].a)]
        scene.start.update({"swing.angle": -0.5, "swing.angular_velocity": 1.0})
    else:
        pairs += [(added["left"].frame, added["one"].a), (added["four"].a, added["right"].frame)]
    for a, b in reversed(pairs) if backwards else pairs:
        scene.connect(*((b, a) if backwards else (a, b)))
    scene.start.update({f"{title['crank']}.angle": 1.0, f"{title['crank']}.angular_velocity": 4.0 / math.sqrt(size)})
    scene.guess.update({f"{title['coupler']}.angle": 0.3, f"{title['rocker']}.angle": 1.9})
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize(("backwards", "size"), [(True, 1.0), (False, 1e-6), (True, 1e5)])
def test_order_names_and_size_change_nothing(backwards: bool, size: float) -> None:
    plain, other = simulate(linkage(False), rtol=1e-12), simulate(linkage(backwards, size), rtol=1e-12)
    assert by_formulas(plain)
    assert by_formulas(other)
    for name, letter in (("crank", "y"), ("coupler", "x"), ("rocker", "w")):
        path = f"{letter}_{name}.angle" if backwards else f"{name}.angle"
        assert_allclose(other[path], plain[f"{name}.angle"], atol=1e-9)


@needs_sundials
@pytest.mark.parametrize("start", ["other branch", "dependent"])
def test_starts_choose_the_branch(start: str) -> None:
    def scene() -> Scene:
        made = FourBar()
        if start == "other branch":
            made.guess = {"coupler.angle": -1.4, "rocker.angle": -2.0}
        else:
            made.start = {"rocker.angle": 1.7, "rocker.angular_velocity": 1.5}
            made.guess = {"crank.angle": 1.0, "coupler.angle": 0.3}
        return made

    result, numeric = (simulate(scene(), rtol=1e-10, t_end=1.5, solver=one) for one in ("auto", "ida"))
    assert by_formulas(result)
    assert_allclose(states(result), states(numeric), atol=2e-6)
    if start == "other branch":
        assert np.max(result["rocker.angle"]) < 0.0


# -- dead centres and turns ----------------------------------------------------------------------------------------


def rocking(**values: float) -> FourBar:
    """Return a four-bar none of whose links can turn fully."""
    return FourBar(crank_length=1.0, coupler_length=1.2, rocker_length=1.0, frame_length=2.2, **values)


@needs_sundials
def test_dead_centres_in_each_swing_are_passed() -> None:
    loose, tight = (simulate(rocking(), t_end=5.0, rtol=rtol) for rtol in (1e-10, 1e-13))
    numeric = simulate(rocking(), t_end=5.0, rtol=1e-11, solver="ida")
    assert by_formulas(tight)
    assert tight.run.statistics.reinitializations >= 4  # other coordinates took over
    assert not tight.singular_crossings
    assert_allclose(states(loose), states(tight), atol=1e-5)
    assert_allclose(states(numeric), states(tight), atol=1e-4)
    assert loose.energy.max_drift < 1e-7
    assert tight.energy.max_drift < 1e-9


def test_swings_over_dead_centres_are_right_to_rounding() -> None:
    result = simulate(rocking(), t_end=3.0, rtol=1e-14, outputs=3001)
    assert by_formulas(result)
    assert result.run.statistics.reinitializations >= 4
    assert result.energy.max_drift < 1e-12
    # Where energy and lengths are kept, only the course of time is left: displacements are integrals of speeds.
    angle = result["rocker.angle"]
    moved = make_interp_spline(result.time, result["rocker.angular_velocity"], k=9).antiderivative()
    assert np.ptp(angle) > 0.5
    assert_allclose(angle[0] + moved(result.time), angle, atol=1e-11)
    assert_allclose(states(simulate(rocking(), t_end=3.0, rtol=1e-13, outputs=3001)), states(result), atol=1e-9)


@needs_sundials
def test_angles_of_links_that_all_turn_go_on_without_jumps() -> None:
    def drag_link() -> FourBar:
        scene = FourBar(crank_length=2.0, coupler_length=2.2, rocker_length=2.1, frame_length=1.0)
        scene.start = {"crank.angle": 1.0, "crank.angular_velocity": 12.0}
        scene.guess = {"coupler.angle": -0.3, "rocker.angle": 1.2}
        return scene

    result, numeric = (simulate(drag_link(), rtol=1e-10, t_end=2.0, solver=one) for one in ("auto", "ida"))
    assert by_formulas(result)
    assert result["rocker.angle"][-1] > 2.0 * math.tau
    assert_allclose(states(result), states(numeric), atol=1e-5)


def five_bar() -> Scene:
    """Return two heavy cranks that turn alike, joined by two links that are longer than neither: two freedoms."""
    scene = Scene(t_end=1.0, gravity=0.0)
    left, right = scene.add("left", Ground()), scene.add("right", Ground(position=(0.5, 0.0, 0.0)))
    one, other = (scene.add(name, Link(length=1.0, mass=100.0)) for name in ("one", "other"))
    first, second = (scene.add(name, Link(length=1.4, mass=0.01)) for name in ("first", "second"))
    for name, a, b in (
        ("p1", left.frame, one.a),
        ("p2", right.frame, other.a),
        ("p3", one.b, first.a),
        ("p4", other.b, second.a),
        ("p5", first.b, second.b),
    ):
        pivot = scene.add(name, Pivot())
        scene.connect(a, pivot.a)
        scene.connect(pivot.b, b)
    scene.start = {"one.angle": 0.0, "other.angle": 1.5, "one.angular_velocity": 9.0, "other.angular_velocity": 9.0}
    scene.guess = {"first.angle": 1.4, "second.angle": 0.6}
    return scene


@needs_sundials
def test_directions_that_may_turn_either_way_are_counted() -> None:
    result, numeric = (simulate(five_bar(), rtol=1e-10, solver=one) for one in ("auto", "ida"))
    found = solved(five_bar())
    assert found is not None
    assert found.form.loops.counted
    assert by_formulas(result)
    assert np.ptp(result["one.angle"]) > math.tau
    assert_allclose(states(result), states(numeric), atol=1e-5)


@needs_sundials
def test_a_loop_on_a_base_that_moves() -> None:
    result, numeric = (simulate(linkage(False, on_swing=True), rtol=1e-10, solver=one) for one in ("auto", "ida"))
    assert by_formulas(result)
    assert_allclose(states(result), states(numeric), atol=1e-6)
    assert result.energy.max_drift < 1e-8


@needs_sundials
def test_events_happen_when_they_do_in_the_numeric_loop() -> None:
    watched = {"until": "rocker.angle falls below 1.5", "record": "coupler.angle crosses 0.7"}
    result, numeric = (simulate(FourBar(), rtol=1e-11, solver=one, **watched) for one in ("auto", "ida"))
    assert by_formulas(result)
    assert len(result.events) == len(numeric.events) > 1
    for one, other in zip(result.events, numeric.events, strict=True):
        assert one.time == pytest.approx(other.time, abs=1e-7)


# -- where formulas end --------------------------------------------------------------------------------------------


def test_what_no_group_solves_is_left_to_the_numeric_loop() -> None:
    assert solved(Bricard()) is None
    assert "closed loops leave constraints" in simulate(Bricard(), t_end=0.05).solver


def parallelogram(angle: float = 1.0) -> FourBar:
    scene = FourBar(crank_length=1.0, coupler_length=2.0, rocker_length=1.0, frame_length=2.0)
    scene.start = {"crank.angle": angle, "crank.angular_velocity": 8.0}
    scene.guess = {"coupler.angle": 0.0, "rocker.angle": angle}
    return scene


def parallelogram_angle(t: FloatArray) -> FloatArray:
    """Return the crank's angle of `parallelogram`, which is a compound pendulum."""
    crank, coupler, rocker = 0.1, 0.25, 0.2
    kappa = 9.81 * (0.5 * (crank + rocker) + coupler) / ((crank + rocker) / 3.0 + coupler)
    return PlanePendulum(kappa, 1.0 + 0.5 * math.pi, 8.0).angle(t) - 0.5 * math.pi


@pytest.mark.sample(2)
@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_steps_on_constraints_go_on_over_a_singular_position_as_exactly(rtol: float) -> None:
    result = simulate(parallelogram(), t_end=1.5, rtol=rtol)
    assert [(one.solver, one.keeps_constraints) for one in result.run.choices] == [
        ("taylor" if rtol < 1e-10 else "explicit", False),
        ("explicit", True),
    ]
    assert "a dead centre" in result.solver
    assert len(result.singular_crossings) == 4
    assert_allclose(result["rocker.angle"], result["crank.angle"], atol=1e-9)
    # 5 to 44 times; with IDA, which it was left to before, up to 1,100 times
    assert np.max(np.abs(result["crank.angle"] - parallelogram_angle(result.time))) < 200.0 * rtol
    assert result.energy.max_drift < 300.0 * rtol


@needs_sundials
def test_two_links_that_fold_on_each_other_are_near_a_dead_centre() -> None:
    """What joins two unknowns vanishes where links of one length fold: the angle between them then says nothing."""
    flat, spatial = (
        simulate(FourBarRow(windows=1, space=space), rtol=1e-10, t_end=1.6, max_steps=20_000)
        for space in ("plane", "space")
    )
    assert spatial.status == "finished"
    for path in ("crank[0].position.x", "crank[1].position.z"):
        assert_allclose(spatial[path], flat[path], atol=1e-7)


def test_outputs_do_not_tell_when_formulas_end() -> None:
    few, many = (simulate(parallelogram(), t_end=1.5, rtol=1e-8, outputs=outputs) for outputs in (2, 400))
    assert len(few.run.choices) == len(many.run.choices) == 2
    for one, other in zip(few.run.choices, many.run.choices, strict=True):
        assert (one.solver, one.time) == (other.solver, pytest.approx(other.time, rel=1e-12))
    assert_allclose(few["crank.angle"][-1], many["crank.angle"][-1], atol=1e-10)


def test_a_run_that_begins_at_a_dead_centre_keeps_constraints() -> None:
    result = simulate(parallelogram(0.1), t_end=0.35, rtol=1e-9)
    assert [(one.solver, one.keeps_constraints) for one in result.run.choices] == [("explicit", True)]
    assert_allclose(result["rocker.angle"], result["crank.angle"], atol=1e-9)


def test_of_many_coordinates_few_choices_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []
    monkeypatch.setattr(closed_loops, "closed_form", lambda *given: made.append(1) or closed_form(*given))
    assert solved(FourBarRow(windows=10)) is not None
    assert len(made) <= 5  # each of eleven cranks before


def test_a_row_of_one_freedom_has_formulas_however_long_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(closed_loops, "_LARGEST", 0)
    assert solved(FourBarRow(windows=3)) is not None
    monkeypatch.setattr(closed_loops, "_FEW_FREEDOMS", 0)
    assert solved(FourBarRow(windows=3)) is None


def test_other_values_and_starts_use_the_same_programs() -> None:
    assembly = assemble(FourBar())
    first = simulate(assembly, t_end=0.2)
    other = assembly.with_values({"coupler_length": 2.6}, start={"crank.angle": 0.7})
    again = simulate(other, t_end=0.2)
    assert not other.why_new
    assert by_formulas(first)
    assert by_formulas(again)
    scene = FourBar(coupler_length=2.6)
    scene.start["crank.angle"] = 0.7
    assert_allclose(states(again), states(simulate(scene, t_end=0.2)), atol=1e-9)


def test_branches_of_many_values_are_worked_out_together() -> None:
    assembly = assemble(FourBar())
    lengths, angles = (2.4, 2.5, 2.7, 2.9), (0.4, 1.0, 2.0, 5.0)
    single, values, places = [], [], []
    for length, angle in zip(lengths, angles, strict=True):
        other = assembly.with_values({"coupler_length": length}, start={"crank.angle": angle})
        assert not other.why_new
        start = find_start(other)
        q, u = own_state(other, start)
        found = solve_at(make_problem(other, start.time, q, u, start.length, 1.0), start.time, q, u)
        assert found is not None
        single.append(found)
        values.append(other.parameter_values)
        places.append(q)
    assert all(one.form is single[0].form for one in single)
    kernel = assembly.with_rows(np.array(values).T).kernel(single[0].form.branches, vectorized=True)
    found_values, conditions = kernel([0.0], np.array(places).T)
    expected = [[one.branches[symbol] for one in single] for symbol in single[0].form.loops.branches]
    assert_allclose(found_values, expected, atol=1e-14)
    assert np.all(conditions > 0.0)


def test_states_from_formulas_need_no_projection(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: object) -> None:
        raise AssertionError("a state was projected")

    monkeypatch.setattr("atwood.simulation.problem.projection._least_norm", refuse)
    result = simulate(FourBar(), t_end=0.5)
    assert by_formulas(result)
    assert max(float(np.max(one.held)) for one in result.run.segments) < 1e-13


def test_comparisons_show_both_ways_to_close_the_loop() -> None:
    found = compare(SliderCrank(t_end=0.3), rtols=(1e-5, 1e-7), forms=("reduced",))
    assert {row.label for row in found.rows} == {"reduced, IDA", "reduced, explicit"}
    tight = {row.label: row for row in found.rows if row.rtol == 1e-7}
    numeric, closed = (tight[label] for label in ("reduced, IDA", "reduced, explicit"))
    assert closed.steps is not None
    assert numeric.steps is not None
    assert closed.steps < 0.3 * numeric.steps
    assert closed.error is not None
    assert closed.error < 1e-4
