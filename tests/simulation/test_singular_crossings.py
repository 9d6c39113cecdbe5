"""Singular positions: passed through smoothly, told apart from what only comes close, and said."""

from __future__ import annotations

import json
import math
import warnings
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from atwood import Component, Frame, Point, Scalar, Scene, Vector, connector, event, observable, parameter, simulate
from atwood.cli.app import main
from atwood.errors import SolveError
from atwood.forms.quantities import observer
from atwood.integrators.ida import library as sundials_library
from atwood.result.about import describe_run
from atwood.simulation.singular.arc_routine import Sweeps
from atwood.simulation.singular.collocation import find_arc
from atwood_library.scenes import Bricard, FourBar, FourBarRow, RollingDisc, SimplePendulum, SliderCrank

from ..helpers.mechanisms import double_four_bar, parallel_four_bar
from ..helpers.runs import FORMS, prepare
from ..references.pendulum import FourBarRow as ExactRow, PlanePendulum

needs_sundials = pytest.mark.skipif(not sundials_library.available(), reason="the SUNDIALS libraries are not here")

PUBLISHED = {1.0: 3.33787080310509773, 2.0: 6.34103336131233161, 5.0: 16.6543534866534826, 10.0: 31.7505971869861018}
"""IFToMM benchmark A02 with two windows: time, and angle of the cranks from upright, clockwise."""


ERROR = {1e-4: 1.5, 1e-6: 1e-2, 1e-8: 3e-4, 1e-9: 1e-4, 1e-10: 2e-5, 1e-11: 4e-6}
"""What may come of a tolerance: errors grow, since the row nearly stops on top in each turn."""


WAYS = (("reduced", "auto"), ("dae", "auto"), ("dae", "ida"))
"""Forms with what solves them: IDA takes part where an explicit method would be chosen, too."""


def quiet(scene: Scene, **options: Any) -> Any:
    """Return a run in which nothing may be warned of."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return simulate(scene, **options)


def four_bar(longer: float = 0.0, crossed: bool = False, rate: float = 6.0) -> FourBar:
    """Return a parallelogram with sides of 1 and 2, whose coupler is longer by a share; or the same crossed."""
    scene = FourBar(crank_length=1.0, coupler_length=2.0 * (1.0 + longer), rocker_length=1.0, frame_length=2.0)
    scene.start.update({"crank.angle": 1.0, "crank.angular_velocity": rate})
    scene.guess.update({"coupler.angle": -0.6, "rocker.angle": -1.7} if crossed else {})
    if not crossed:
        scene.guess.update({"coupler.angle": 0.0, "rocker.angle": 1.0})
    return scene


def equal_slider_crank(longer: float = 0.0) -> SliderCrank:
    """Return a slider-crank whose rod is as long as its crank, or longer by a share."""
    scene = SliderCrank(crank_length=0.5, rod_length=0.5 * (1.0 + longer))
    scene.guess["connecting_rod.angle"] = -0.5
    return scene


# -- rows of four-bars -------------------------------------------------------------------------------------------------


@pytest.mark.sample(2)
@needs_sundials
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-11])
def test_a_row_meets_the_published_values_at_every_tolerance(form: str, rtol: float) -> None:
    times = np.array(sorted(PUBLISHED))
    result = quiet(double_four_bar(), form=form, t_end=10.0, rtol=rtol, solver="ida", outputs=times)
    turned = np.pi / 2.0 - result.array("crank0.angle")
    assert np.max(np.abs(turned - [PUBLISHED[t] for t in times])) < ERROR[rtol]
    assert len(result.singular_crossings) == 10
    assert {one.ways for one in result.singular_crossings} == {2}
    for name in ("crank1", "crank2"):
        assert np.allclose(result.array(f"{name}.angle"), result.array("crank0.angle"), rtol=0.0, atol=1e-9)
    assert np.allclose(result.array("coupler1.angle"), 0.0, atol=1e-9)
    if rtol <= 1e-8:
        assert result.energy.max_drift < max(1e4 * rtol, 3e-7)
    assert np.max(list(result.constraint_max.values())[:2]) < 1e-10


@pytest.mark.sample(2)
@needs_sundials
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("windows", "space", "rtol"), [(1, "plane", 1e-11), (1, "space", 1e-9), (10, "plane", 1e-10)])
def test_rows_of_other_lengths_and_in_space(form: str, windows: int, space: str, rtol: float) -> None:
    exact = ExactRow(windows)
    result = quiet(FourBarRow(windows=windows, space=space), form=form, t_end=1.6, rtol=rtol)
    angle = 0.5 * np.pi - result["foot[0].angle"]
    assert np.max(np.abs(angle - exact.crank_angle(result.time))) < 3e4 * rtol
    assert [one.ways for one in result.singular_crossings] == [windows, windows]
    passed = exact.crank_angle(np.array([one.time for one in result.singular_crossings]))
    assert np.max(np.abs(passed - [0.5 * np.pi, 1.5 * np.pi])) < 1e5 * rtol


@pytest.mark.sample(1)
@needs_sundials
@pytest.mark.parametrize("windows", [1, 2])
@pytest.mark.parametrize("rtol", [1e-5, 1e-6, 1e-8])
def test_drift_that_is_projected_away_does_no_harm(windows: int, rtol: float) -> None:
    # at index 1 the solver leaps into folded positions more readily
    result = quiet(FourBarRow(windows=windows), form="dae", level="index1-projected", t_end=10.0, rtol=rtol)
    angle = 0.5 * np.pi - result["foot[0].angle"]
    assert np.max(np.abs(angle - ExactRow(windows).crank_angle(result.time))) < 1e4 * rtol**0.9
    assert [one.ways for one in result.singular_crossings] == 10 * [windows]


@pytest.mark.sample(0)
@needs_sundials
def test_a_row_of_forty() -> None:
    result = quiet(FourBarRow(windows=40), t_end=0.9, rtol=1e-11, outputs=3)
    assert abs(0.5 * np.pi - result["foot[0].angle"][-1] - ExactRow(40).crank_angle(0.9)) < 1e-7
    assert [one.ways for one in result.singular_crossings] == [40]


# -- which way it goes -------------------------------------------------------------------------------------------------


@pytest.mark.sample(2)
@needs_sundials
@pytest.mark.parametrize(("form", "solver"), WAYS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10])
def test_a_parallelogram_stays_one_and_a_crossed_one_stays_crossed(form: str, solver: str, rtol: float) -> None:
    straight = quiet(four_bar(), form=form, solver=solver, rtol=rtol, t_end=1.0)
    assert len(straight.singular_crossings) == 2
    assert np.max(np.abs(straight["coupler.angle"])) < 1e-9
    assert np.max(np.abs(straight["crank.angle"] - straight["rocker.angle"])) < 1e-9
    crossed = quiet(four_bar(crossed=True), form=form, solver=solver, rtol=rtol, t_end=1.0)
    assert len(crossed.singular_crossings) == 2
    # its diagonals are parallel, so that tan(crank/2) : tan(rocker/2) stays what it is, 1 - 2 to 1 + 2
    one, other = 0.5 * crossed["crank.angle"], 0.5 * crossed["rocker.angle"]
    assert np.max(np.abs(3.0 * np.sin(one) * np.cos(other) + np.cos(one) * np.sin(other))) < 1e-9


@needs_sundials
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10])
def test_a_piston_passes_the_shaft_of_its_crank(form: str, rtol: float) -> None:
    # crank and rod lie on each other, and could go on together with the piston at rest
    result = quiet(equal_slider_crank(), form=form, rtol=rtol, t_end=3.0)
    crank = result["crank.angle"]
    assert crank[-1] > 1.5 * np.pi
    assert len(result.singular_crossings) == 2
    assert np.max(np.abs(result["piston.position.x"] - np.cos(crank))) < 1e-9
    # one degree of freedom, by energy: both bars are uniform, the piston moves by cos(crank)
    rate = result["crank.angular_velocity"]
    third = 0.5**2 / 3.0
    kinetic = 0.25 * third + 0.5 * (third + 0.25 * 2.0 * np.sin(crank) ** 2) + 0.5 * np.sin(crank) ** 2
    energy = 0.5 * kinetic * rate**2 + (0.25 + 0.5) * 9.81 * 0.25 * np.sin(crank)
    assert np.max(np.abs(energy - energy[0])) < 3e3 * rtol


@pytest.mark.sample(1)
@needs_sundials
@pytest.mark.parametrize(("form", "solver"), WAYS)
@pytest.mark.parametrize("longer", [1e-3, -1e-7, 4e-9])
def test_links_that_nearly_fit_turn_away(form: str, solver: str, longer: float) -> None:
    # Parallelogram and crossed four-bar come close to each other and do not meet: one motion turns into the other.
    runs = [quiet(four_bar(longer), form=form, solver=solver, rtol=rtol, t_end=0.6) for rtol in (1e-5, 1e-9)]
    for rtol, result in zip((1e-5, 1e-9), runs, strict=True):
        assert not result.singular_crossings
        assert abs(result["crank.angle"][-1] - result["rocker.angle"][-1]) > 1.0
        # IDA turns sharply within the last micrometres: 1e2 to 1.1e3 times, whatever it comes from
        assert result.energy.max_drift < 3e3 * rtol
    assert np.max(np.abs(runs[0]["crank.angle"] - runs[1]["crank.angle"])) < 1e-2


@needs_sundials
@pytest.mark.parametrize("form", FORMS)
def test_lengths_that_fit_within_rounding_are_taken_for_exact_and_this_is_said(form: str) -> None:
    result = quiet(four_bar(2e-11), form=form, rtol=1e-8, t_end=0.6)
    assert np.max(np.abs(result["crank.angle"] - result["rocker.angle"])) < 1e-4
    assert "lengths fit there to" in result.singular_crossings[0].describe()


@needs_sundials
def test_both_forms_and_drivers_pass_alike() -> None:
    runs = [
        quiet(parallel_four_bar(3, angle=0.5, rate=-6.0), form=form, rtol=1e-10, t_end=0.3, solver=solver)
        for form in FORMS
        for solver in ("ida", "ida-sundae")
    ]
    for result in runs:
        assert len(result.singular_crossings) == 1
        assert abs(result["crank0.angle"][-1] - runs[0]["crank0.angle"][-1]) < 1e-7


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("windows", "space"), [(1, "plane"), (2, "plane"), (3, "plane"), (1, "space")])
@pytest.mark.parametrize("rtol", [1e-13, 1e-10, 1e-8, 1e-4])
def test_steps_do_not_come_near_the_place(windows: int, space: str, form: str, rtol: float) -> None:
    """It is passed before a solver is there: steps of 1e-13 s lie there, and other ways to move."""
    result = quiet(FourBarRow(windows=windows, space=space), form=form, rtol=rtol)
    exact = ExactRow(windows)
    angle = 0.5 * np.pi - result["foot[0].angle"]
    assert np.max(np.abs(angle - exact.crank_angle(result.time))) < max(5e3 * rtol, 1e-9)
    assert [one.ways for one in result.singular_crossings] == 10 * [windows]
    assert result.statistics.steps < 2000  # 220,000 before


@pytest.mark.sample(4)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rtol", [1e-8, 1e-10, 1e-11, 1e-13])
@pytest.mark.parametrize("angle", [1.0, 2.86, 2.5])
def test_a_crossed_four_bar_stays_crossed_wherever_it_begins(form: str, rtol: float, angle: float) -> None:
    scene = four_bar(crossed=True)
    scene.start["crank.angle"] = angle
    other = -2.0 * math.atan(3.0 * math.tan(0.5 * angle))
    height, width = math.sin(other) - math.sin(angle), 2.0 + math.cos(other) - math.cos(angle)
    scene.guess.update({"rocker.angle": other, "coupler.angle": math.atan2(height, width)})
    result = quiet(scene, form=form, rtol=rtol, t_end=0.6)
    half, across = 0.5 * result["crank.angle"], 0.5 * result["rocker.angle"]
    assert np.max(np.abs(3.0 * np.sin(half) * np.cos(across) + np.cos(half) * np.sin(across))) < 1e-9
    assert result.energy.max_drift < 1e3 * rtol  # 4.85 at 1e-10 before: it had leapt into the parallelogram
    assert result.statistics.steps < 1000


def test_what_lies_behind_the_end_is_not_told() -> None:
    for end in (0.6, 0.7, 0.708, 0.709):
        result = quiet(FourBarRow(windows=1), rtol=1e-9, t_end=end)
        assert len(result.singular_crossings) == (end > 0.70845)


@pytest.mark.sample(2)
@pytest.mark.parametrize("outputs", [11, 201, 2001])
def test_no_output_on_the_way_is_lost(outputs: int) -> None:
    for rtol in (1e-6, 1e-10):
        result = quiet(FourBarRow(windows=1, space="space"), rtol=rtol, t_end=1.6, outputs=outputs)
        assert np.allclose(result.time, np.linspace(0.0, 1.6, outputs), rtol=0.0, atol=1e-12)


# -- near it -----------------------------------------------------------------------------------------------------------


def parallelogram_speed(start: float, turn: float) -> float:
    """Return the rate with which `parallel_four_bar` comes from one angle to rest at another."""
    return math.sqrt(2.0 * 1.3 * 9.81 * (math.sin(turn) - math.sin(start)) / 1.2)


@pytest.mark.sample(4)
@needs_sundials
@pytest.mark.parametrize(("form", "solver"), WAYS)
@pytest.mark.parametrize("angle", [1e-2, 1e-3, 1e-5, -1e-4])
@pytest.mark.parametrize("rtol", [1e-5, 1e-10])
def test_a_start_near_the_place(form: str, solver: str, angle: float, rtol: float) -> None:
    result = quiet(parallel_four_bar(2, angle=angle, rate=-2.0), form=form, solver=solver, rtol=rtol, t_end=0.2)
    one, other = result["crank0.angle"], result["crank1.angle"]
    assert np.max(np.abs(one - other)) < 1e-9
    energy = 0.5 * 1.2 * result["crank0.angular_velocity"] ** 2 + 1.3 * 9.81 * np.sin(one)
    assert np.max(np.abs(energy - energy[0])) < 1e3 * rtol


@pytest.mark.sample(4)
@pytest.mark.parametrize("rtol", [1e-8, 1e-10])
@pytest.mark.parametrize("t_end", [0.002, 0.02, 0.1])
@pytest.mark.parametrize("angle", [1e-4, 1e-6, -1e-6, -1e-3])
def test_a_short_run_beside_the_place(angle: float, t_end: float, rtol: float) -> None:
    """How far the way on from a start is looked for does not depend on how long the run is."""
    scene = FourBar(crank_length=1.0, coupler_length=2.0, rocker_length=1.0, frame_length=2.0)
    scene.start = {"crank.angle": angle, "crank.angular_velocity": 2.0}
    scene.guess = {"coupler.angle": 0.0, "rocker.angle": angle}
    found = simulate(scene, form="dae", t_end=t_end, rtol=rtol, outputs=5)
    assert found.status == "finished"
    np.testing.assert_allclose(found["rocker.angle"], found["crank.angle"], atol=1e-9)


@pytest.mark.sample(4)
@needs_sundials
@pytest.mark.parametrize(("form", "solver"), WAYS)
@pytest.mark.parametrize(("short", "rtol"), [(0.1, 1e-5), (0.01, 1e-5), (1e-2, 1e-9), (1e-4, 1e-9)])
def test_turning_back_short_of_the_place(form: str, solver: str, short: float, rtol: float) -> None:
    scene = parallel_four_bar(2, angle=-1.0, rate=parallelogram_speed(-1.0, -short))
    result = quiet(scene, form=form, solver=solver, rtol=rtol, t_end=0.8)
    assert not result.singular_crossings
    assert result["crank0.angle"][-1] < -0.6
    assert np.max(np.abs(result["crank0.angle"] - result["crank1.angle"])) < 1e-8
    assert np.max(result["crank0.angle"]) < 0.0


@needs_sundials
@pytest.mark.parametrize("form", FORMS)
def test_what_nearly_stops_at_the_place_is_not_told_as_if_it_were_known(form: str) -> None:
    # With the errors of a loose run it could come to rest there, or fold either way.
    scene = parallel_four_bar(2, angle=-1.0, rate=parallelogram_speed(-1.0, -1e-6))
    with pytest.warns(UserWarning, match="do not rely on what comes after"):
        result = simulate(scene, form=form, rtol=1e-4, t_end=0.8, solver="ida")
    assert [one.ways for one in result.singular_crossings] == [0]
    assert "coincidence" in result.singular_crossings[0].describe()
    shown = [one["what"] for one in describe_run(result)["singular_positions"]]
    assert "could not be told" in shown[0]


@needs_sundials
def test_what_comes_to_rest_there_is_never_told_without_saying_where_it_is() -> None:
    # The mechanism just reaches the singular position. Whether the solver fails there or gets past is decided by
    # rounding, and so differs between machines; either way the place is named.
    scene = parallel_four_bar(2, angle=-1.0, rate=parallelogram_speed(-1.0, 0.0))
    told: list[str] = []
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            simulate(scene, form="dae", rtol=1e-10, t_end=0.8, solver="ida")
        except SolveError as error:
            told = [str(error)] if error.run.segments else []
    told += [str(one.message) for one in warned]
    assert "singular position, where low" in told[0] or "singular position, where high" in told[0]
    assert "coincidence" in told[0]


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10, 1e-13])
@pytest.mark.parametrize("solver", ["auto", "ida"])
def test_what_just_comes_to_rest_there_is_not_told_as_if_it_were_known(form: str, rtol: float, solver: str) -> None:
    # Its energy is that of the singular position: it could turn back, or fold either way.
    scene = parallel_four_bar(2, angle=-1.0, rate=parallelogram_speed(-1.0, 0.0))
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            simulate(scene, form=form, rtol=rtol, t_end=0.8, solver=solver)
            told = [str(one.message) for one in warned]
        except SolveError as error:
            told = [str(error)]
    assert any("singular position" in one for one in told)  # nothing was said at 1e-4 before


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rate", [1e-6, 0.01, 1e3])
def test_a_slow_motion_without_forces_passes(form: str, rate: float) -> None:
    # Slow beside nothing: it never comes to rest.
    scene = four_bar(rate=rate)
    scene.gravity = 0.0
    result = quiet(scene, form=form, rtol=1e-4, t_end=3.0 / rate)
    assert [one.ways for one in result.singular_crossings] == [1]
    assert np.max(np.abs(result["crank.angle"] - 1.0 - rate * result.time)) < 1e-2


# -- what is recorded --------------------------------------------------------------------------------------------------


class Gauge(Component):
    """Tells the acceleration of a point."""

    point: Point = connector(Point, "What moves.")

    @observable(unit="m/s^2", doc="Acceleration of the point.")
    def acceleration(self) -> Vector:
        """Return the acceleration."""
        return self.point.acceleration


@pytest.mark.sample(1)
@needs_sundials
@pytest.mark.parametrize("form", FORMS)
def test_a_sample_at_the_very_place_is_a_good_one(form: str) -> None:
    crossing = quiet(double_four_bar(), form=form, t_end=1.0, rtol=1e-10).singular_crossings[0]
    exact = ExactRow(2)
    times = np.array([crossing.time - 1e-3, crossing.time, crossing.time + 1e-3])
    scene = double_four_bar()
    gauge = scene.add("gauge", Gauge())
    scene.connect(scene["crank1"].b, gauge.point)
    result = quiet(scene, form=form, t_end=1.0, rtol=1e-10, outputs=times)
    assert np.max(np.abs(0.5 * np.pi - result["crank1.angle"] - exact.crank_angle(times))) < 1e-6
    assert np.max(np.abs(result["crank1.angular_velocity"] + exact.rate(times))) < 1e-5
    # Accelerations go on smoothly; which reactions there are is not determined there, and is not made up.
    angle, rate = exact.crank_angle(times), exact.rate(times)
    expected = exact.kappa * np.sin(angle) * np.cos(angle) - rate**2 * np.sin(angle)
    assert np.max(np.abs(result["gauge.acceleration.x"] - expected)) < 1e-4
    forces = result["left1.force.x"]
    assert np.isnan(forces[1])
    assert np.all(np.isfinite(forces[[0, 2]]))


@needs_sundials
def test_outputs_do_not_change_what_is_passed_through() -> None:
    few, many = (quiet(double_four_bar(), t_end=3.0, rtol=1e-9, outputs=number) for number in (2, 1501))
    assert [one.time for one in few.singular_crossings] == [one.time for one in many.singular_crossings]
    assert few["crank0.angle"][-1] == many["crank0.angle"][-1]


@needs_sundials
def test_what_was_passed_is_said() -> None:
    result = quiet(double_four_bar(), t_end=1.0)
    said = result.singular_crossings[0].describe()
    assert "passed through a singular position" in said
    assert "2 more ways to move" in said
    assert "coincidence" in said
    kept = json.loads(json.dumps(describe_run(result)))["singular_positions"]
    assert kept[0]["ways"] == 2
    assert kept[0]["parts"]
    shown = CliRunner().invoke(main, ["run", "four-bar-row", "--t-end", "3"])
    assert shown.exit_code == 0
    assert "passed through a singular position" in " ".join(shown.output.split())
    assert "and again at t = 1.228" in " ".join(shown.output.split())


class Trip(Component):
    """Ends the run when a frame has turned to an angle."""

    angle: float = parameter(0.0, unit="rad", doc="Where it ends.")
    frame: Frame = connector(Frame, "What turns.")

    @event(target="stop", message="turned far enough")
    def turned(self) -> Scalar:
        """Return by how much it has not turned yet."""
        return self.frame.angle - self.angle


@pytest.mark.sample(2)
@needs_sundials
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("ahead", [0.05, -0.05, 0.2])
def test_events_on_the_way_over_are_found(form: str, ahead: float) -> None:
    scene = double_four_bar()
    trip = scene.add("trip", Trip(angle=ahead))
    scene.connect(scene["crank0"].a, trip.frame)
    result = quiet(scene, form=form, rtol=1e-10)
    assert result.status == "stopped"
    assert abs(float(ExactRow(2).crank_angle(result.time[-1])) - (0.5 * math.pi - ahead)) < 1e-7


# -- arcs --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
def test_an_arc_is_the_motion_to_rounding(form: str) -> None:
    prepared = prepare(SimplePendulum(), form)
    plan = prepared.plan
    length, angle = float(SimplePendulum().length), simulate(SimplePendulum(), t_end=1e-3)["rod.angle"][0]
    exact, times = PlanePendulum(9.81 / length, angle, 0.0), np.array([0.05, 0.1])
    arc = find_arc(plan, 0.0, prepared.q, prepared.u, 0.1)
    assert arc is not None
    assert arc.error < 1e-11
    q, u, a = arc.at(times)
    kernel = plan.assembly.kernel(observer(plan.assembly, ("rod.angle",)), vectorized=True)
    found = kernel(times[None, :], q, u, a, np.zeros((len(plan.assembly.reactions), 2)))[0][0]
    assert np.max(np.abs(found - exact.angle(times))) < 1e-13


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("scene", [FourBarRow(), RollingDisc(), Bricard()])
def test_arcs_of_machine_code_are_those_of_numpy(scene: Any, form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    prepared = prepare(scene, form)
    plan, swept = prepared.plan, [0]
    sweep = Sweeps.__call__

    def counted(self: Sweeps) -> int:
        swept[0] += 1
        return sweep(self)

    monkeypatch.setattr(Sweeps, "__call__", counted)
    found = []
    for plan.has_rates in (False, True):
        before = swept[0]
        found.append(find_arc(plan, 0.0, prepared.q, prepared.u, 0.05))
        assert (swept[0] > before) == plan.has_rates
    plain, compiled = found
    assert plain is not None
    assert compiled is not None
    times = np.linspace(0.0, 0.05, 7)
    for one, other in zip(plain.at(times), compiled.at(times), strict=True):
        assert np.allclose(one, other, rtol=1e-9, atol=1e-9 * np.max(np.abs(one)))
