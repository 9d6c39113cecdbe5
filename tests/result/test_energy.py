"""The balance of energy warns where a motion is wrong and nowhere else, and work is as accurate as the solver."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import atwood_library as lib
from atwood import Component, Point, Result, Scalar, Scene, connector, external, potential, select, simulate, sin
from atwood.clock import check_time
from atwood.errors import ResultError
from atwood.expr import ExternalFunction
from atwood.result.energy import EnergyLedger
from atwood.result.work import integral_in_steps, integral_of_samples, nodes_between
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.run_record import Run, run_again, times_of_steps
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS


def orbit(e: float) -> Scene:
    """Return a planet with mu = a = 1 at its perihelion."""
    scene = Scene(gravity=0.0, t_end=20.0)
    sun, planet = scene.add("sun", lib.Ground()), scene.add("planet", lib.PointMass(mass=2.5))
    pull = scene.add("pull", lib.CentralGravity(gravitational_parameter=1.0))
    scene.connect(sun.frame, pull.source)
    scene.connect(pull.point, planet.point)
    scene.start.update({"planet.position.x": 1.0 - e, "planet.position.z": 0.0, "planet.velocity.x": 0.0})
    scene.start["planet.velocity.z"] = math.sqrt((1.0 + e) / (1.0 - e))
    return scene


def flying(speed: float, tilt: float = 0.3) -> Scene:
    scene = Scene(gravity=0.0, t_end=10.0)
    scene.add("bob", lib.PointMass(mass=2.0))
    scene.start.update({"bob.position.x": 1.0, "bob.position.z": 2.0})
    scene.start.update({"bob.velocity.x": speed, "bob.velocity.z": tilt * speed})
    return scene


def sprung_pair(speed: float) -> Scene:
    """Return two masses on a spring, seen by somebody who moves."""
    scene = Scene(gravity=0.0, t_end=4.0)
    one, two = scene.add("one", lib.PointMass(mass=2.0)), scene.add("two", lib.PointMass(mass=1.0))
    spring = scene.add("spring", lib.Spring(stiffness=5.0, natural_length=0.7))
    scene.connect(spring.a, one.point)
    scene.connect(spring.b, two.point)
    scene.start.update({"one.position.x": 0.0, "one.position.z": 0.0, "two.position.x": 1.0, "two.position.z": 0.2})
    scene.start.update({"one.velocity.x": 0.1 + speed, "one.velocity.z": -0.5})
    scene.start.update({"two.velocity.x": 0.3 + speed, "two.velocity.z": 1.4})
    return scene


def hanging(angle: float) -> Scene:
    scene = Scene(t_end=10.0)
    ground, rod = scene.add("ground", lib.Ground()), scene.add("rod", lib.Rod())
    bob = scene.add("bob", lib.PointMass(mass=1000.0))
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.start.update({"rod.angle": angle, "rod.angular_velocity": 0.0})
    return scene


def sprung(*parts: Component, stiffness: float = 50.0, start: float = 1.3) -> Scene:
    """Return a mass on a spring, with other parts between the same two points, or on the mass alone."""
    scene = Scene(gravity=0.0, t_end=4.0)
    ground, mass = scene.add("ground", lib.Ground()), scene.add("mass", lib.Mass1D(mass=1.0))
    for number, part in enumerate((lib.Spring(stiffness=stiffness, natural_length=1.0), *parts)):
        added = scene.add(f"part{number}", part)
        if hasattr(type(part), "a"):
            scene.connect(ground.frame, added.a)
            scene.connect(added.b, mass.flange)
        else:
            scene.connect(added.point, mass.flange)
    scene.start.update({"mass.displacement": start, "mass.speed": 0.0})
    return scene


def misses(result: Result, exact: Result, paths: tuple[str, ...]) -> float:
    """Return the largest error, relative to the range of each quantity."""
    return max(float(np.max(np.abs(result[path] - exact[path])) / np.ptp(exact[path])) for path in paths)


# -- it warns ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("solver", "rtol"), [("ida", 1e-6), ("explicit", 1e-6), ("ida", 1e-4)])
def test_a_comet_that_is_wrong_does_not_balance(solver: str, rtol: float) -> None:
    exact = simulate(orbit(0.99), rtol=1e-12, outputs=41)
    result = simulate(orbit(0.99), rtol=rtol, outputs=41, solver=solver)
    error = misses(result, exact, ("planet.position.x",))
    assert error > 1e-3
    assert result.energy.max_drift > 0.03 * error
    assert exact.energy.max_drift < 1e-8


@pytest.mark.parametrize("rtol", [1e-4, 1e-7])
@pytest.mark.parametrize(
    ("name", "path"),
    [("lagrange-top", "top.position.z"), ("slider-crank", "crank.angle"), ("driven-pendulum", "bob.position.x")],
)
def test_the_drift_is_of_the_size_of_the_error(name: str, path: str, rtol: float) -> None:
    """A top's spin, which is constant, does not hide what its axis does."""
    exact, result = (simulate(SCENES[name](), rtol=r, outputs=41) for r in (1e-12, rtol))
    error = misses(result, exact, (path,))
    assert 0.1 * error < result.energy.max_drift < 100.0 * error


@pytest.mark.parametrize("form", FORMS)
def test_the_drift_is_the_same_for_one_who_moves(form: str) -> None:
    drifts = [simulate(sprung_pair(v), rtol=1e-6, form=form, outputs=5).energy.max_drift for v in (0.0, 30.0)]
    assert 0.03 < drifts[1] / drifts[0] < 30.0


# -- and nowhere else --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-10])
@pytest.mark.parametrize(
    "scene",
    [
        flying(1000.0),
        flying(1e-3),
        hanging(0.0),
        SCENES["atwood"](),
        sprung(start=1.0),
        sprung(stiffness=1e9, start=1.0),
    ],
    ids=["fast", "slow", "at rest", "atwood", "unstrained", "stiff"],
)
def test_what_is_exact_balances(scene: Scene, rtol: float, form: str) -> None:
    energy = simulate(scene, form=form, rtol=rtol, outputs=11).energy
    assert energy.max_drift < 0.1 * rtol


@pytest.mark.parametrize("form", FORMS)
def test_swings_that_rounding_hides_are_no_alarm_and_are_said(form: str) -> None:
    """Of a tonne on a rod, with 1e-8 rad: 5e-13 J of some 10,000 J."""
    energy = simulate(hanging(1e-8), form=form, rtol=1e-11, outputs=11).energy
    assert energy.max_drift == 0.0
    assert energy.uncertainty > energy.exchanged
    assert "which rounding leaves open" in repr(energy)
    assert simulate(hanging(1e-3), rtol=1e-3, outputs=11, solver="explicit").energy.max_drift > 0.01


@pytest.mark.parametrize("form", FORMS)
def test_a_round_orbit_exchanges_nothing_and_is_no_alarm(form: str) -> None:
    """Kinetic and potential energy are constant; what its velocity turns is what its error is measured by."""
    exact, result = simulate(orbit(0.0), rtol=1e-12, outputs=41), simulate(orbit(0.0), form=form, rtol=1e-6, outputs=41)
    assert result.energy.max_drift < 3.0 * misses(result, exact, ("planet.position.x",))


def test_a_constant_of_the_potential_does_not_matter() -> None:
    class Lifted(lib.Spring):
        """A spring whose energy counts from elsewhere."""

        @potential
        def elsewhere(self) -> Scalar:
            """Return a constant."""
            return 1e3

    one, other = (simulate(sprung(part), rtol=1e-6) for part in (lib.Spring(stiffness=1.0), Lifted(stiffness=1.0)))
    assert np.ptp(other.energy.potential - one.energy.potential) < 1e-9
    assert other.energy.max_drift == pytest.approx(one.energy.max_drift, rel=1e-3)


# -- work --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("frequency", [30.0, 150.0])
def test_the_work_of_a_fast_drive_is_right(frequency: float, form: str) -> None:
    """Hundreds of turns between few outputs, with the work known: it is that of the force on the exact motion."""
    allowed = 3e-5 if form == "reduced" else 5e-4
    force, turn, spring = 100.0, 2.0 * math.pi * frequency, 50.0
    scene = sprung(lib.Force(value=lambda t: force * sin(turn * t)), start=1.0)
    result = simulate(scene, form=form, rtol=1e-9, t_end=1.0, outputs=11, samples=40)
    assert len(result.time) == 11
    own = math.sqrt(spring)
    size = force / (spring - turn**2)
    speed = size * turn * (np.cos(turn * result.time) - np.cos(own * result.time))
    place = size * (np.sin(turn * result.time) - turn / own * np.sin(own * result.time))
    work = 0.5 * speed**2 + 0.5 * spring * place**2
    assert np.allclose(result.energy.work, work, rtol=0.0, atol=allowed * np.max(work))
    assert result.energy.uncertainty < 1e-4 * result.energy.exchanged
    assert result.energy.max_drift < allowed


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("turns", [397, 400])
def test_what_a_drive_gives_and_takes_between_samples_is_exchanged(turns: int, form: str) -> None:
    """Where it has their period, samples show nothing of it, and errors beside it were an alarm of 3 per cent."""
    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0), gravity=0.0, t_end=1.0)
    ground, drive = scene.add("ground", lib.Ground()), scene.add("drive", lib.Drive())
    drive.motion = lambda t: 0.01 * sin(2.0 * math.pi * turns * t)
    spring, bob = (
        scene.add("spring", lib.Spring(stiffness=100.0, natural_length=1.0)),
        scene.add("bob", lib.PointMass()),
    )
    for a, b in ((ground.frame, drive.a), (drive.b, spring.a), (spring.b, bob.point)):
        scene.connect(a, b)
    scene.start.update({"bob.position.x": 1.0, "bob.velocity.x": 0.0})
    energy = simulate(scene, form=form).energy
    assert energy.exchanged == pytest.approx(0.005, rel=0.1)
    assert energy.max_drift < 1e-5


def test_the_work_of_a_damper_follows_the_tolerance() -> None:
    """A floor of 1e-6 was left by splines through 400 samples, with errors of 1e-10."""
    for rtol, drift in ((1e-5, 1e-3), (1e-8, 1e-6), (1e-11, 1e-9)):
        energy = simulate(sprung(lib.Damper(damping=2.0), stiffness=900.0), rtol=rtol, t_end=8.0).energy
        assert energy.max_drift < drift
        assert energy.work[-1] == pytest.approx(-0.5 * 900.0 * 0.09, rel=max(drift, 1e-6))


@pytest.mark.parametrize("form", FORMS)
def test_work_is_not_integrated_across_a_switch(form: str) -> None:
    scene = sprung(lib.Force(value=lambda t: select(sin(2.0 * math.pi * 3.0 * t) > 0.0, 20.0, -20.0)), start=1.0)
    energy = simulate(scene, form=form, rtol=1e-9, t_end=2.0, outputs=7).energy
    assert np.ptp(energy.work) > 1.0
    assert energy.max_drift < 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_who_switches_a_potential_does_work(form: str) -> None:
    """A field that is switched on gives its energy to what is there."""

    class Field(Component):
        """A field along z."""

        point: Point = connector(Point, "What feels it.")

        @potential
        def energy(self) -> Scalar:
            """Return the energy: 5 J/m from t = 1 s on."""
            return select(self.time < 1.0, 0.0, 5.0 * self.point.position.z + 3.0)

    scene = Scene(gravity=0.0, t_end=2.0)
    bob, field = scene.add("bob", lib.PointMass()), scene.add("field", Field())
    scene.connect(field.point, bob.point)
    scene.start.update({"bob.position.z": 2.0, "bob.position.x": 0.0, "bob.velocity.z": 1.0, "bob.velocity.x": 0.0})
    energy = simulate(scene, form=form, rtol=1e-9, outputs=11).energy
    assert energy.work[-1] == pytest.approx(5.0 * 3.0 + 3.0, abs=1e-6)
    assert energy.max_drift < 1e-7


# -- the same run again ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "form", "solver"),
    [
        ("double-pendulum", "reduced", "explicit"),
        ("double-pendulum", "reduced", "taylor"),
        ("rolling-ball", "dae", "ida"),
        ("four-bar-row", "reduced", "ida"),
        ("free-body", "reduced", "explicit"),
    ],
)
def test_a_run_comes_out_the_same_with_more_samples(name: str, form: str, solver: str) -> None:
    run = simulate(SCENES[name](), form=form, solver=solver, rtol=1e-6, t_end=2.0, outputs=5, samples=20).run
    again = run_again(run, np.linspace(run.start.time, 2.0, 173) if run.start else np.zeros(0))
    assert again is not None
    assert again.statistics.steps == run.statistics.steps
    assert sum(len(one.time) for one in again.segments) > 150
    steps = times_of_steps(run)
    # Steps that a solver has taken beyond where a way over a singular position begins are taken back.
    passed_over = any(one.path is not None for segment in run.segments for one in segment.singular_crossings)
    assert passed_over == (name == "four-bar-row")
    assert len(steps) >= (0.5 if passed_over else 1.0) * run.statistics.steps
    assert steps[0] == 0.0


def test_a_run_that_was_stopped_is_made_again_up_to_there() -> None:
    scene = sprung(lib.Damper(damping=0.1), stiffness=1e4)
    result = simulate(scene, rtol=1e-8, max_steps=300, t_end=50.0, samples=10, outputs=11)
    assert result.status == "step_limit"
    assert result.energy.max_drift < 1e-5
    again = run_again(replace(result.run, status="interrupted"), np.zeros(0))
    assert again is not None
    assert again.statistics.steps == 300


def test_integrals_and_their_errors() -> None:
    t = np.linspace(0.0, 1.0, 41)
    smooth, error = integral_of_samples(t, np.exp(t))
    assert abs(smooth[-1] - math.expm1(1.0)) < 1e-12
    assert error < 1e-9
    kink, error = integral_of_samples(t, np.abs(t - 0.31))
    assert abs(kink[-1] - 0.5 * (0.31**2 + 0.69**2)) < 3.0 * error
    grid = np.array([0.0, 0.1, 0.31, 1.0])
    for count in (3, 7):
        parts, error = integral_in_steps(grid, np.exp(nodes_between(grid, count)).reshape(-1, count))
        assert abs(parts[-1] - math.expm1(1.0)) < max(error, 1e-15)


@pytest.mark.filterwarnings("ignore::UserWarning")  # a function in Python is slow
def test_power_that_has_no_value_at_a_sample_is_an_error_and_no_drift_of_zero() -> None:
    gap = ExternalFunction("gap", lambda t: math.nan if t == 0.7125 else 1.0, (None,))
    scene = flying(1.0)
    push = scene.add("push", lib.Force(value=lambda t: external(gap, t)))
    scene.connect(push.point, scene["bob"].point)
    result = simulate(scene, t_end=1.0, solver="ida")
    with pytest.raises(ResultError, match="has no value"):
        _ = result.energy


def test_what_leaves_a_balance_open_is_said_with_the_error_of_the_work() -> None:
    """Rounding was said to leave open what the integral of a work does."""
    flat, end = np.zeros(2), np.array([0.0, 0.1])
    told = "which rounding and the estimated error of the work leave open by 4.0e-03 J"
    assert told in EnergyLedger(flat, flat, end, 1.7e-9, 7.0, 4e-3).describe()


def test_the_limit_of_a_run_holds_for_making_it_again() -> None:
    """The ledger is then that of the samples, and says how uncertain it is; with time left it is that of the steps."""
    result = simulate(SCENES["driven-pendulum"](), rtol=1e-9, samples=10, outputs=5, max_seconds=60.0)
    run, made = result.run, []

    def again(options: RunOptions, between: np.ndarray) -> Run:
        made.append(options)
        while True:  # a run that looks at the clock, and takes longer than it did
            check_time()

    assert run.again is not None
    whole = Result(run).energy
    for used, times in ((59.8, 1), (61.0, 0)):
        made.clear()
        energy = Result(replace(run, again=again, timings={"integration": used})).energy
        assert len(made) == times
        assert energy.uncertainty > whole.uncertainty
        assert energy.max_drift > 0.1 > 1e-6 > whole.max_drift  # the drift is that of five outputs, which is said
        assert energy.uncertainty > 1.2 * energy.max_drift * energy.exchanged
        assert "the estimated error of the work leave open by" in energy.describe()


@pytest.mark.parametrize("number", range(9, 60, 3))
def test_samples_that_are_too_few_leave_the_whole_work_open(number: int) -> None:
    """The error was taken to fall by half from 7 to 13 samples, and told as a third of what it was; at 9 as 1/40."""
    t = np.linspace(0.0, 2.0, number)
    work, error = integral_of_samples(t, np.sin(20.0 * t) * np.exp(-t))
    fine = np.linspace(0.0, 2.0, 20 * (number - 1) + 1)
    known, _ = integral_of_samples(fine, np.sin(20.0 * fine) * np.exp(-fine))
    assert np.max(np.abs(work - known[::20])) <= error + 1e-12


@pytest.mark.parametrize("name", ["clutches", "stick-slip"])
def test_ledgers_of_ida_follow_its_steps_through_events(name: str) -> None:
    """An event was seen 1e-16 s later with more samples; clutches drifted by 1.5e-6, or 4.6e-8, as outputs had it."""
    few, many = (
        simulate(SCENES[name](), form="dae", solver="ida", t_end=1.0, outputs=count).energy for count in (3, 200)
    )
    assert few.max_drift == pytest.approx(many.max_drift, rel=0.05)
    assert max(one.uncertainty / one.exchanged for one in (few, many)) < 1e-7
