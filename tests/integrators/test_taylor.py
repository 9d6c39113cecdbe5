"""The Taylor-series method: its order, its steps, its rounding, and runs of scenes with it."""

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ellipj, ellipk

from atwood import Component, Point, Scalar, Scene, connector, expr as ex, parameter, potential, simulate
from atwood.errors import StartError, UnsupportedError
from atwood.expr.series.taylor import taylor_programs
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.protocol import Budget, ExplicitProblem, SolverOptions, Status
from atwood.integrators.taylor.stepper import (
    FACTOR,
    HIGHEST,
    LOWEST,
    CompiledRecurrences,
    CompiledStepper,
    TaylorProblem,
    choose_order,
    logarithm,
)
from atwood.pipeline import assemble
from atwood.simulation.problem.taylor_scene import recurrences
from atwood_library import Force, Ground, PointMass, Slider, Spring
from atwood_library.scenes import Atwood, Chain, DoublePendulum

from ..helpers.smooth import SMOOTH as SCENES
from .taylor_reference import ReferenceStepper, power_of_two

Kind = Literal["compiled", "reference"]
Scalars = Sequence[Any]


@pytest.fixture(params=["reference", "compiled"])
def kind(request: Any) -> Kind:
    """Each test runs with each stepper."""
    return request.param


def system(rates: Callable[[Any, Scalars], Scalars], size: int, **more: Any) -> TaylorProblem:
    graph = ex.Graph()
    time, states = graph.symbol("t"), [graph.symbol(f"x{i}") for i in range(size)]
    values = [graph.convert(value) for value in rates(time, states)]
    programs = taylor_programs("system", time, states, values, (), lanes=8)
    code = CompiledRecurrences(programs)
    return TaylorProblem(programs, np.zeros(0), compiled=lambda: (code, code.bind([])), **more)


def start(
    kind: Kind, problem: TaylorProblem, options: SolverOptions, y: Any, order: int | None = None, **more: Any
) -> ExplicitSession:
    stepper = (CompiledStepper if kind == "compiled" else ReferenceStepper)(problem, options, order)
    budget = more.pop("budget", None)
    size = len(problem.programs.start.inputs[1].symbols)
    return ExplicitSession(
        ExplicitProblem(size, lambda t, y: y, **more), options, stepper, 0.0, np.array(y, dtype=float), budget
    )


def pendulum(t: Any, x: Scalars) -> Scalars:
    return [x[1], -ex.sin(x[0])]


def rotation(t: Any, x: Scalars) -> Scalars:
    return [x[1], -x[0]]


def forced(t: Any, x: Scalars) -> Scalars:
    return [x[1] + ex.cos(t), -x[0] * x[1] * ex.exp(-t) / (1.0 + x[2] * x[2]), ex.sin(x[0] * t)]


def tight(tolerance: float, horizon: float = 10.0, **options: Any) -> SolverOptions:
    return SolverOptions(tolerance, tolerance, horizon=horizon, **options)


def fixed(h: float) -> SolverOptions:
    """Return options that make every step of one length."""
    return SolverOptions(0.5, 1e6, first_step=h, max_step=h)


# -- the method ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [5, 8, 13])
def test_observed_orders(kind: Kind, order: int) -> None:
    problem = system(rotation, 2)
    errors = []
    for steps in (4, 8):
        found = start(kind, problem, fixed(8.0 / steps), [1.0, 0.0], order).advance(8.0)
        errors.append(max(abs(found.y[0] - math.cos(8.0)), abs(found.y[1] + math.sin(8.0))))
    assert order - 0.5 < math.log2(errors[0] / errors[1]) < order + 1.5


@pytest.mark.parametrize("rates", [pendulum, forced])
def test_tapes_are_left_at_any_step(rates: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tapes and machine code give the same bits, after any step."""
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    size = 2 if rates is pendulum else 3
    problem = system(rates, size)
    tiers = problem.compiled()[0].tiers
    assert tiers is not None
    quick, better = tiers.now, tiers._better
    assert better is not None
    best = better()

    def ended(before: float) -> list[float]:
        tiers.now, tiers._better, tiers._left = quick, lambda: best, math.inf
        stepper = CompiledStepper(problem, tight(1e-6))
        assert stepper.start(0.0, np.array([1.0, 0.5, 0.2][:size]))
        for step in range(55):
            tiers._left = math.inf if step < before else 0.0
            stepper.run(math.inf, 1)
        assert (stepper._count("recurrence") == quick.code.addresses["order"]) == (before == math.inf)
        return [stepper.state()[0], *stepper.state()[1]]

    alone = ended(math.inf)
    assert all(ended(before) == alone for before in range(50))


def test_orders_follow_the_tolerance() -> None:
    assert [choose_order(tight(10.0**-k)) for k in (1, 6, 16)] == [LOWEST, 1 + math.ceil(FACTOR * 6 * math.log(10)), 25]
    assert choose_order(tight(1e-300)) == HIGHEST


def test_logarithms_are_good_enough_for_steps() -> None:
    for value in np.logspace(-300, 300, 601):
        assert logarithm(float(value)) == pytest.approx(math.log2(value), abs=0.087)
    assert logarithm(0.0) == -1023.0
    for power in np.linspace(-30.0, 30.0, 601):
        assert power_of_two(float(power)) == pytest.approx(2.0**power, rel=3e-3)


def test_errors_follow_the_tolerance(kind: Kind) -> None:
    problem = system(pendulum, 2)
    exact = start("reference", problem, tight(1e-16), [2.0, 0.0]).advance(10.0).y
    for tolerance in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
        found = start(kind, problem, tight(tolerance), [2.0, 0.0]).advance(10.0).y
        assert np.max(np.abs(found - exact)) < 50.0 * tolerance


def test_pendulum_swings_as_elliptic_functions_say(kind: Kind) -> None:
    k = math.sin(1.0)
    session = start(kind, system(pendulum, 2), tight(1e-15), [2.0, 0.0])
    for t in np.linspace(0.3, 12.0, 14):
        sn, cn, *_ = ellipj(ellipk(k * k) + t, k * k)
        found = session.advance(float(t))
        assert_allclose(found.y, [2.0 * math.asin(k * sn), 2.0 * k * cn], rtol=0.0, atol=1e-13)
        assert_allclose(found.yp, [found.y[1], -math.sin(found.y[0])], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-9, 1e-14])
def test_both_steppers_take_the_same_steps(tolerance: float) -> None:
    problem = system(forced, 3)
    found, statistics = [], []
    for kind in ("reference", "compiled"):
        session = start(kind, problem, tight(tolerance), [1.0, 0.5, 0.2])
        found.append(session.advance(5.0))
        statistics.append(session.statistics)
    assert_allclose(found[0].y, found[1].y, rtol=1e-12, atol=1e-13)
    for name in ("steps", "residual_evaluations", "error_test_failures", "undefined_values"):
        assert getattr(statistics[0], name) == getattr(statistics[1], name)


@pytest.mark.parametrize("size", [1, 3, 4, 5, 9, 20])
def test_any_number_of_unknowns(kind: Kind, size: int) -> None:
    def rates(t: Any, x: Scalars) -> Scalars:
        return [-(i + 1.0) * one * one for i, one in enumerate(x)]  # the squares fill blocks of their own from 9 on

    found = start(kind, system(rates, size), tight(1e-13), np.ones(size)).advance(1.0)
    assert_allclose(found.y, 1.0 / (2.0 + np.arange(size)), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("order", [8, 12, 16])
def test_a_start_at_which_most_coefficients_vanish(kind: Kind, order: int) -> None:
    """From rest where the force is odd, only every fourth coefficient of each unknown is there.

    The last two that are looked at in the usual choice of a step are then zero at these orders, for both unknowns.
    """
    problem = system(lambda t, x: [x[1], -ex.cos(x[0])], 2)  # a pendulum from the horizontal
    exact = start("reference", problem, tight(1e-15), [0.0, 0.0], 19).advance(3.0).y
    session = start(kind, problem, tight(1e-10), [0.0, 0.0], order)
    assert_allclose(session.advance(3.0).y, exact, rtol=0.0, atol=1e-8)
    assert session.statistics.steps > 3


def test_rounding_does_not_add_up_over_many_steps(kind: Kind) -> None:
    problem = system(rotation, 2)
    t = 600.0 if kind == "compiled" else 60.0
    found = start(kind, problem, tight(1e-16, t, max_step=0.05), [1.0, 0.0]).advance(t)
    assert_allclose(found.y, [math.cos(t), -math.sin(t)], rtol=0.0, atol=4e-15)


def test_steps_far_from_the_unit_of_time_do_not_overflow(kind: Kind) -> None:
    # a wave of 1e-15 s in a system whose first rates say nothing about it
    problem = system(lambda t, x: [x[1], -1e30 * x[0] + 0.0 * t], 2)
    absolute = np.array([1e-12, 1e3])
    session = start(kind, problem, SolverOptions(1e-12, absolute, horizon=1.0), [1.0, 0.0])
    t = 20e-15
    assert_allclose(session.advance(t).y, [math.cos(20.0), -1e15 * math.sin(20.0)], rtol=1e-9)


def test_polynomials_are_exact_in_one_step(kind: Kind) -> None:
    session = start(kind, system(lambda t, x: [x[1], -9.81], 2, stop_time=5.0), tight(1e-10), [0.0, 3.0])
    assert_allclose(session.advance(5.0).y, [15.0 - 0.5 * 9.81 * 25.0, 3.0 - 9.81 * 5.0], rtol=1e-14)
    assert session.statistics.steps <= 2


# -- what coefficients do not show --------------------------------------------------------------------------------


def test_no_step_goes_beyond_the_stop_time(kind: Kind) -> None:
    def rates(t: Any, x: Scalars) -> Scalars:
        return [ex.select(t < 1.0, 1.0, 1.0 / (t - 1.0))]

    session = start(kind, system(rates, 1, stop_time=0.999), tight(1e-10), [0.0])
    found = session.advance(0.999)
    assert (found.status, found.t) == (Status.REACHED, 0.999)
    assert found.y[0] == pytest.approx(0.999, abs=1e-15)


def test_a_rate_that_changes_within_a_step_is_seen(kind: Kind) -> None:
    """Nobody said that the law changes at t = 1; the end of the step shows it."""
    session = start(kind, system(lambda t, x: [ex.select(t < 1.0, 1.0, 2.0)], 1), tight(1e-8), [0.0])
    found = session.advance(3.0)
    if found.status is Status.REACHED:
        assert found.y[0] == pytest.approx(5.0, abs=1e-4)
    assert session.statistics.error_test_failures > 10


def test_a_solution_that_ends_is_a_failure(kind: Kind) -> None:
    session = start(kind, system(lambda t, x: [x[0] * x[0]], 1), tight(1e-8), [1.0])
    found = session.advance(2.0)
    assert found.status is Status.FAILED
    assert found.t == pytest.approx(1.0, abs=1e-6)
    assert "too small" in found.message
    again = session.advance(2.0)  # from the last good state, without a crash
    assert again.status is Status.FAILED


def test_coefficients_without_a_value_are_a_failure(kind: Kind) -> None:
    """The rate is there at the start, but none of its derivatives."""
    session = start(kind, system(lambda t, x: [1.0 + ex.sqrt(x[0])], 1), tight(1e-8), [0.0])
    found = session.advance(1.0)
    assert (found.status, found.t) == (Status.FAILED, 0.0)
    assert session.statistics.undefined_values > 0


def test_a_start_without_a_value_is_refused(kind: Kind) -> None:
    with pytest.raises(StartError, match="no finite value"):
        start(kind, system(lambda t, x: [1.0 / x[0]], 1), tight(1e-8), [0.0])


# -- the session --------------------------------------------------------------------------------------------------


def test_outputs_do_not_change_the_solution(kind: Kind) -> None:
    problem = system(pendulum, 2)
    plain = start(kind, problem, tight(1e-10), [2.0, 0.0])
    many = start(kind, problem, tight(1e-10), [2.0, 0.0])
    times = np.linspace(0.0, 10.0, 201)
    values, rates, last = many.sample(times)
    assert last.status is Status.REACHED
    assert np.array_equal(plain.advance(10.0).y, values[-1])
    assert plain.statistics.steps == many.statistics.steps
    exact = start(kind, problem, tight(1e-15), [2.0, 0.0]).sample(times)[0]
    assert_allclose(values, exact, rtol=0.0, atol=1e-8)
    assert_allclose(rates[:, 0], values[:, 1], rtol=0.0, atol=1e-15)


def test_limits(kind: Kind) -> None:
    problem = system(pendulum, 2)
    session = start(kind, problem, tight(1e-10), [2.0, 0.0], budget=Budget(max_steps=5))
    assert session.advance(1e3).status is Status.STEP_LIMIT
    assert session.statistics.steps == 5
    short = start(kind, problem, tight(1e-10, max_step=0.01), [2.0, 0.0])
    short.advance(1.0)
    assert 100 <= short.statistics.steps <= 102


def test_events_are_where_they_are(kind: Kind) -> None:
    k = math.sin(1.0)
    quarter = float(ellipk(k * k))
    problem = system(pendulum, 2, reach=0.5)
    options = tight(1e-13, 30.0)
    session = start(
        kind, problem, options, [2.0, 0.0], events=lambda t, y, yp: [y[0]], event_count=1, event_directions=(-1,)
    )
    found = [session.advance(30.0) for _ in range(3)]
    assert [one.status for one in found] == [Status.EVENT] * 3
    assert_allclose([one.t for one in found], [quarter, 5 * quarter, 9 * quarter], rtol=1e-12)


def test_an_event_that_comes_and_goes_is_not_passed_over(kind: Kind) -> None:
    """A ball thrown up: its path is one polynomial, for which a single step would do."""
    problem = system(lambda t, x: [x[1], -10.0], 2, reach=0.5)
    session = start(kind, problem, tight(1e-10), [0.0, 10.0], events=lambda t, y, yp: [y[0] - 4.9], event_count=1)
    found = session.advance(2.0)
    assert (found.status, found.events) == (Status.EVENT, (1,))
    assert found.t == pytest.approx(1.0 - math.sqrt(0.02), rel=1e-12)


# -- scenes -------------------------------------------------------------------------------------------------------

SMOOTH = [name for name, scene in SCENES.items() if not assemble(scene()).reduced.constraints]


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", SMOOTH)
def test_scenes_agree_with_the_other_explicit_method(name: str) -> None:
    one, other = (simulate(SCENES[name](), solver=solver, rtol=1e-12, outputs=11) for solver in ("taylor", "explicit"))
    assert one.status == other.status == "finished"
    for path in one.paths:
        a, b = np.atleast_1d(one.array(path)), np.atleast_1d(other.array(path))
        assert_allclose(a, b, rtol=0.0, atol=1e-6 * max(1.0, float(np.max(np.abs(b)))), err_msg=path)


def test_double_pendulum_to_rounding() -> None:
    angles = [f"rod{i}.angle" for i in (1, 2)]
    found = {
        (solver, rtol): np.array(
            [simulate(DoublePendulum(), t_end=5.0, solver=solver, rtol=rtol, outputs=2).array(p)[-1] for p in angles]
        )
        for solver, rtol in (("taylor", 1e-15), ("taylor", 3e-15), ("taylor", 1e-12), ("explicit", 3e-15))
    }
    best = found["taylor", 1e-15]
    assert_allclose(found["taylor", 3e-15], best, rtol=0.0, atol=1e-13)
    assert_allclose(found["explicit", 3e-15], best, rtol=0.0, atol=1e-12)
    assert_allclose(found["taylor", 1e-12], best, rtol=0.0, atol=1e-11)


def test_energy_stays_over_long_runs() -> None:
    result = simulate(DoublePendulum(), t_end=500.0, solver="taylor", rtol=1e-15, outputs=101, samples=1)
    total = result.energy.total
    assert np.max(np.abs(total - total[0])) < 2e-13 * 3.0 * 9.81


def test_a_mass_runs_into_the_pulley_at_the_same_time() -> None:
    one, other = (
        simulate(Atwood(), t_end=5.0, solver=solver, rtol=1e-12, outputs=31) for solver in ("taylor", "explicit")
    )
    assert one.status == other.status == "stopped"
    assert one.message == other.message
    assert one.time[-1] == pytest.approx(other.time[-1], rel=1e-12)


def cart(*extra: tuple[str, Component]) -> Scene:
    scene = Scene(t_end=3.0)
    ground, rail, body = scene.add("ground", Ground()), scene.add("rail", Slider()), scene.add("cart", PointMass())
    for name, part in extra:
        scene.add(name, part)
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, body.point)
    return scene


def test_pulses_by_the_clock_are_met() -> None:
    scene = cart(("push", Force(value=lambda t: ex.select((t > 1.0) & (t < 1.5), 2.0, 0.0))))
    scene.connect(scene["cart"].point, scene["push"].point)
    scene.start["rail.displacement"] = 0.0
    scene.start["cart.velocity.x"] = 0.0
    result = simulate(scene, solver="taylor", rtol=1e-12, outputs=[0.0, 1.0, 1.5, 3.0])
    assert result.status == "finished"
    assert_allclose(result.array("cart.position.x"), [0.0, 0.0, 0.25, 1.75], rtol=0.0, atol=1e-11)


def test_another_mass_compiles_nothing() -> None:
    one, other = (recurrences(assemble(Chain(links=5, mass=mass))) for mass in (1.0, 2.5))
    assert (one.start.digest, one.order.digest) == (other.start.digest, other.order.digest)


def test_operations_of_an_order_grow_with_the_number_of_links() -> None:
    counts = {}
    for links in (10, 20, 40):
        found = recurrences(assemble(Chain(links=links)))
        counts[links] = sum(found.order.operations.values()), found.pairs + found.squares
    assert counts[40][0] <= 50 * 40
    assert counts[40][1] <= 10 * 40
    for i in (0, 1):
        assert counts[40][i] - counts[20][i] == 2 * (counts[20][i] - counts[10][i])
    pair = recurrences(assemble(DoublePendulum()))
    assert sum(pair.order.operations.values()) <= 62
    assert pair.pairs + pair.squares <= 12


class Buffer(Component):
    """Pushes back with a stiffness that begins at a gap."""

    point: Point = connector(Point, "What is stopped.")
    stiffness: float = parameter(1.0, unit="N/m", doc="Stiffness.")

    @potential
    def stored(self) -> Scalar:
        """Return what is stored beyond the gap."""
        beyond = ex.maximum(self.point.position[0] - 0.3, 0.0)
        return 0.5 * self.stiffness * beyond * beyond


class Contact(Buffer):
    """Pushes back as balls do, of which there is no value before they touch."""

    @potential
    def stored(self) -> Scalar:
        """Return what is stored beyond the gap."""
        return 0.4 * self.stiffness * ex.maximum(self.point.position[0] - 0.3, 0.0) ** 2.5


def test_laws_that_switch_with_the_motion_are_refused_where_they_have_no_value_behind() -> None:
    scene = cart(("buffer", Contact()))
    scene.connect(scene["cart"].point, scene["buffer"].point)
    scene.start["cart.velocity.x"] = 1.0
    with pytest.raises(UnsupportedError, match="switches with the motion") as refused:
        simulate(scene, solver="taylor")
    assert refused.value.where == "rail.displacement"


def test_stiff_springs_are_slow_but_right() -> None:
    scene = cart(("spring", Spring(stiffness=1e8)))
    scene.connect(scene["ground"].frame, scene["spring"].a)
    scene.connect(scene["cart"].point, scene["spring"].b)
    scene.start["rail.displacement"] = 0.1
    scene.start["cart.velocity.x"] = 0.0
    result = simulate(scene, t_end=0.01, solver="taylor", rtol=1e-12, outputs=3)
    assert_allclose(result.array("cart.position.x"), 0.1 * np.cos(1e4 * result.time), rtol=0.0, atol=1e-9)
