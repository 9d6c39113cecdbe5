"""The explicit method of order 8(5,3): its coefficients, its orders, its steps, and the session around it."""

import gc
import math
import signal
import sys
import weakref
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import DOP853
from scipy.special import ellipj, ellipk

from atwood.codegen.llvm import build
from atwood.errors import KernelEvaluationError, StartError, UsageError
from atwood.forms.quantities import energy_program
from atwood.integrators import explicit_session
from atwood.integrators.embedded.stepper import CompiledStepper
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.methods.dormand_prince import TABLEAU
from atwood.integrators.protocol import Budget, ExplicitProblem, SolverOptions, Status
from atwood.pipeline import assemble, simulate
from atwood.simulation.initialization.start import find_start, settle
from atwood.simulation.problem.explicit_scene import (
    explicit_problem,
    own_rates_on_constraints,
    values_on_constraints,
)
from atwood.simulation.problem.preparation import make_problem
from atwood_library.scenes import SCENES, Chain

from .embedded_reference import ReferenceStepper

Kind = Literal["compiled", "reference"]
FloatArray = Any


@pytest.fixture(params=["reference", "compiled"])
def kind(request: Any) -> Kind:
    """Each test runs with each stepper."""
    return request.param


def pendulum(t: float, y: FloatArray) -> list[float]:
    return [y[1], -math.sin(y[0])]


def rotation(t: float, y: FloatArray) -> list[float]:
    return [y[1], -y[0]]


def fixed(h: float) -> SolverOptions:
    """Return options that make every step of one length."""
    return SolverOptions(0.5, 1e6, first_step=h, max_step=h)


def tight(tolerance: float, horizon: float = 10.0, **options: Any) -> SolverOptions:
    return SolverOptions(tolerance, tolerance, horizon=horizon, **options)


def open_explicit(
    problem: ExplicitProblem,
    options: SolverOptions,
    t: float,
    y: FloatArray,
    budget: Budget | None = None,
    kind: Kind = "compiled",
) -> ExplicitSession:
    stepper = (CompiledStepper if kind == "compiled" else ReferenceStepper)(problem, options, TABLEAU)
    return ExplicitSession(problem, options, stepper, t, y, budget)


def start(kind: Kind, rates: Callable[..., Any], options: SolverOptions, y: Any, **more: Any) -> ExplicitSession:
    budget = more.pop("budget", None)
    y = np.array(y, dtype=float)
    return open_explicit(ExplicitProblem(len(y), rates, **more), options, 0.0, y, budget, kind)


# -- the method ---------------------------------------------------------------------------------------------------


def time_dependent(t: float, y: FloatArray) -> list[float]:
    return [y[1] + math.cos(t), -y[0] * y[1] * math.exp(-t), math.sin(y[0] * t)]


def test_observed_orders(kind: Kind) -> None:
    errors = []
    for steps in (6, 12, 24):
        found = start(kind, rotation, fixed(8.0 / steps), [1.0, 0.0]).advance(8.0)
        errors.append(max(abs(found.y[0] - math.cos(8.0)), abs(found.y[1] + math.sin(8.0))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((orders > 7.7) & (orders < 8.6)), orders


def test_dense_output_has_order_seven(kind: Kind) -> None:
    # within one step an error of order p grows as h^(p + 1)
    errors = []
    for h in (0.8, 0.4):
        session = start(kind, rotation, fixed(h), [0.3, 1.0])
        worst = 0.0
        for share in np.linspace(0.05, 0.95, 19):
            t = share * h
            found = session.advance(t).y
            worst = max(worst, abs(found[0] - 0.3 * math.cos(t) - math.sin(t)))
        errors.append(worst)
    assert 7.6 < math.log2(errors[0] / errors[1]) < 8.6


def test_errors_follow_the_tolerance(kind: Kind) -> None:
    exact = start("reference", pendulum, tight(1e-14), [2.0, 0.0]).advance(10.0).y
    tolerances = np.array([1e-5, 1e-7, 1e-9, 1e-11])
    errors = [
        float(np.max(np.abs(start(kind, pendulum, tight(x), [2.0, 0.0]).advance(10.0).y - exact))) for x in tolerances
    ]
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.85 < slope < 1.2
    assert all(error < 50 * tolerance for error, tolerance in zip(errors, tolerances, strict=True))


def test_pendulum_swings_as_elliptic_functions_say(kind: Kind) -> None:
    k = math.sin(1.0)
    session = start(kind, pendulum, tight(2e-14), [2.0, 0.0])
    for t in np.linspace(0.3, 12.0, 14):
        sn, cn, *_ = ellipj(ellipk(k * k) + t, k * k)
        angle, rate = 2.0 * math.asin(k * sn), 2.0 * k * cn
        found = session.advance(float(t))
        assert_allclose(found.y, [angle, rate], rtol=0.0, atol=1e-12)
        assert_allclose(found.yp, pendulum(t, found.y), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("tolerance", [1e-5, 1e-8, 1e-11])
def test_steps_are_as_many_as_those_of_another_implementation(kind: Kind, tolerance: float) -> None:
    session = start(kind, pendulum, tight(tolerance, 60.0), [2.0, 0.0])
    session.advance(60.0)
    other, steps = DOP853(pendulum, 0.0, [2.0, 0.0], 60.0, rtol=tolerance, atol=tolerance), 0
    while other.status == "running":
        other.step()
        steps += 1
    assert 0.8 * steps <= session.statistics.steps <= 1.2 * steps
    assert 0.8 * other.nfev <= session.statistics.residual_evaluations <= 1.2 * other.nfev


def test_both_steppers_take_the_same_steps() -> None:
    sessions = [start(kind, time_dependent, tight(1e-9), [1.0, 0.5, 0.2]) for kind in ("reference", "compiled")]
    found = [session.advance(5.0) for session in sessions]
    assert_allclose(found[0].y, found[1].y, rtol=1e-12, atol=1e-13)
    a, b = (session.statistics for session in sessions)
    assert (a.steps, a.residual_evaluations, a.error_test_failures) == (
        b.steps,
        b.residual_evaluations,
        b.error_test_failures,
    )


@pytest.mark.parametrize("size", [1, 3, 4, 5, 9])
def test_any_number_of_unknowns(kind: Kind, size: int) -> None:
    rates = np.arange(1.0, size + 1.0)
    found = start(kind, lambda t, y: -rates * y, tight(1e-12), np.ones(size)).advance(1.0)
    assert_allclose(found.y, np.exp(-rates), rtol=0.0, atol=1e-11)


def test_unknowns_at_rest_without_absolute_tolerance(kind: Kind) -> None:
    options = SolverOptions(1e-9, 0.0)
    found = start(kind, lambda t, y: [-y[0], 0.0], options, [1.0, 0.0]).advance(1.0)
    assert found.status is Status.REACHED
    assert_allclose(found.y, [math.exp(-1.0), 0.0], rtol=2e-9)


# -- the session --------------------------------------------------------------------------------------------------


def test_outputs_never_change_the_solution(kind: Kind) -> None:
    few, many = (start(kind, pendulum, tight(1e-8), [2.0, 0.0]) for _ in range(2))
    for t in np.linspace(0.0, 10.0, 101):
        last = many.advance(float(t))
        assert last.t == t
    assert_array_equal(last.y, few.advance(10.0).y)
    assert few.statistics.steps == many.statistics.steps


def test_samples_are_what_single_advances_give(kind: Kind) -> None:
    times = np.linspace(0.0, 10.0, 57)
    one, all_ = (start(kind, pendulum, tight(1e-8), [2.0, 0.0]) for _ in range(2))
    values, rates, last = all_.sample(times)
    assert last.status is Status.REACHED
    assert last.t == 10.0
    for t, y, yp in zip(times, values, rates, strict=True):
        found = one.advance(float(t))
        assert_array_equal(found.y, y)
        assert_array_equal(found.yp, yp)
    more, _, last = all_.sample(np.array([10.0, 10.01, 13.0]))
    assert_array_equal(more[1], one.advance(10.01).y)
    assert_array_equal(last.y, one.advance(13.0).y)
    with pytest.raises(UsageError):
        all_.sample(np.array([12.0]))


def test_looking_at_limits_changes_nothing(kind: Kind, monkeypatch: Any) -> None:
    times = np.linspace(0.0, 10.0, 57)
    usual = start(kind, pendulum, tight(1e-8), [2.0, 0.0])
    monkeypatch.setattr(explicit_session, "FIRST_CHUNK", 1)
    often = start(kind, pendulum, tight(1e-8), [2.0, 0.0], budget=Budget(wall_seconds=100.0))
    assert_array_equal(often.sample(times)[0], usual.sample(times)[0])
    assert often.statistics.steps == usual.statistics.steps
    assert_array_equal(often.advance(15.0).y, usual.advance(15.0).y)


def test_events_are_found_on_the_dense_output(kind: Kind) -> None:
    session = start(
        kind,
        rotation,
        tight(1e-13),
        [1.0, 0.0],
        events=lambda t, y, yp: (y[0], y[0] - 0.5, t - 2.5),
        event_count=3,
        event_directions=(0, 1, 0),
    )
    found, events = [], []
    for _ in range(4):
        found.append(session.advance(10.0))
        events.append(found[-1].events)
    assert all(one.status is Status.EVENT for one in found)
    expected = [math.pi / 2.0, 2.5, 1.5 * math.pi, 5.0 * math.pi / 3.0]
    assert_allclose([one.t for one in found], expected, rtol=0.0, atol=1e-10)
    assert events == [(-1, 0, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0)]
    assert session.advance(6.0).status is Status.REACHED
    assert session.statistics.event_evaluations > 0
    values, _, last = start(
        kind, rotation, tight(1e-10), [1.0, 0.0], events=lambda t, y, yp: (y[0],), event_count=1
    ).sample(np.linspace(0.0, 3.0, 31))
    assert last.status is Status.EVENT
    assert len(values) == 16


def test_going_on_after_an_event(kind: Kind) -> None:
    # a ball that bounces: exact times, each half the one before
    session = start(
        kind,
        lambda t, y: [y[1], -10.0],
        tight(1e-10),
        [5.0, 0.0],
        events=lambda t, y, yp: (y[0],),
        event_count=1,
        event_directions=(-1,),
    )
    expected, flight = 1.0, 1.0
    for _ in range(4):
        found = session.advance(10.0)
        assert found.status is Status.EVENT
        assert found.t == pytest.approx(expected, abs=1e-10)
        session.reinitialize(found.t, np.array([0.0, -0.5 * found.y[1]]))
        expected, flight = expected + flight, 0.5 * flight
    assert session.statistics.reinitializations == 4


def test_statistics_count_calls(kind: Kind) -> None:
    calls = 0

    def counted(t: float, y: FloatArray) -> list[float]:
        nonlocal calls
        calls += 1
        return pendulum(t, y)

    session = start(kind, counted, tight(1e-9), [2.0, 0.0])
    for t in (1.0, 2.0, 3.3):
        session.advance(t)
    statistics = session.statistics
    assert statistics.residual_evaluations == calls
    assert statistics.steps > 3
    assert statistics.undefined_values == 0
    assert statistics.seconds > 0.0
    failures = statistics.error_test_failures
    assert failures is not None
    # a step takes 12, a failed one 11, a start 2; dense output takes 3 in a step and 1 at a time
    assert calls == 12 * statistics.steps + 11 * failures + 2 + 3 * 3 + 3


def test_limits_stop_where_they_are_reached(kind: Kind) -> None:
    session = start(kind, pendulum, tight(1e-9), [2.0, 0.0], budget=Budget(max_steps=7))
    found = session.advance(50.0)
    assert found.status is Status.STEP_LIMIT
    assert session.statistics.steps == 7
    assert 0.0 < found.t < 50.0
    values, _, last = start(kind, pendulum, tight(1e-9), [2.0, 0.0], budget=Budget(max_steps=7)).sample(
        np.linspace(0.0, 50.0, 501)
    )
    assert last.status is Status.STEP_LIMIT
    assert last.t == found.t
    assert len(values) == math.floor(found.t / 0.1) + 1
    assert_array_equal(last.y, found.y)
    found = start(kind, pendulum, tight(1e-9), [2.0, 0.0], budget=Budget(wall_seconds=0.0)).advance(1.0)
    assert found.status is Status.TIME_LIMIT


@pytest.mark.parametrize("sampled", [False, True])
def test_ctrl_c_just_as_compiled_steps_call_python_is_not_lost(sampled: bool) -> None:
    """The exception would arise in the function of Python before its `try`, where ctypes swallows it."""
    sent = 0

    def send(frame: Any, event: str, _: Any) -> None:
        nonlocal sent
        if event == "call" and frame.f_code.co_name == "call" and frame.f_code.co_filename.endswith("python_calls.py"):
            sent += 1
            if sent == 200:
                signal.raise_signal(signal.SIGINT)

    session = start("compiled", pendulum, tight(1e-9), [2.0, 0.0])
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    tracing = sys.gettrace()
    try:
        sys.settrace(send)
        found = session.sample(np.linspace(0.0, 5.0, 6))[2] if sampled else session.advance(5.0)
    finally:
        sys.settrace(tracing)
        handler = signal.signal(signal.SIGINT, before)
    assert handler is signal.default_int_handler
    assert found is not None
    assert found.status is Status.INTERRUPTED
    assert 0.0 <= found.t < 5.0
    assert_allclose(found.y, start("reference", pendulum, tight(1e-12), [2.0, 0.0]).advance(found.t).y, atol=1e-8)
    assert session.advance(5.0).status is Status.REACHED


def test_interruption_loses_nothing(kind: Kind) -> None:
    seen = []

    def poll(t: float) -> None:
        seen.append(t)
        if len(seen) == 5:
            raise KeyboardInterrupt

    session = start(kind, pendulum, tight(1e-9), [2.0, 0.0], budget=Budget(poll=poll))
    found = session.advance(5.0)
    assert found.status is Status.INTERRUPTED
    assert found.t == seen[-1] > 0.0
    assert_allclose(found.y, start("reference", pendulum, tight(1e-12), [2.0, 0.0]).advance(found.t).y, atol=1e-8)
    assert session.advance(5.0).status is Status.REACHED

    calls = 0

    def interrupted(t: float, y: FloatArray) -> list[float]:
        nonlocal calls
        calls += 1
        if calls == 100:
            raise KeyboardInterrupt
        return pendulum(t, y)

    for sampled in (False, True):
        calls = 0
        session = start(kind, interrupted, tight(1e-9), [2.0, 0.0])
        found = session.sample(np.linspace(0.0, 5.0, 6))[2] if sampled else session.advance(5.0)
        assert found.status is Status.INTERRUPTED
        assert_allclose(
            session.advance(5.0).y, start("reference", pendulum, tight(1e-12), [2.0, 0.0]).advance(5.0).y, atol=1e-7
        )


def test_errors_of_the_user_come_through(kind: Kind) -> None:
    def wrong(t: float, y: FloatArray) -> list[float]:
        if t > 1.0:
            raise RuntimeError("no")
        return pendulum(t, y)

    with pytest.raises(RuntimeError, match="no"):
        start(kind, wrong, tight(1e-9), [2.0, 0.0]).advance(3.0)


def test_where_there_is_no_value_steps_are_shorter(kind: Kind) -> None:
    # y' = -sqrt(y): trial values below zero have no rate, the solution (1 - t/2)^2 stays above until t = 2
    def falling(t: float, y: FloatArray) -> list[float]:
        if y[0] < 0.0:
            raise KernelEvaluationError("the root of a negative number")
        return [-math.sqrt(y[0])]

    session = start(kind, falling, SolverOptions(1e-6, 1e-9, first_step=3.0), [1.0])
    found = session.advance(1.5)
    assert found.status is Status.REACHED
    assert found.y[0] == pytest.approx(0.0625, rel=1e-4)
    assert session.statistics.undefined_values > 0


def test_growth_without_bound_ends_with_the_last_good_state(kind: Kind) -> None:
    session = start(kind, lambda t, y: [y[0] * y[0]], tight(1e-9), [1.0])
    found = session.advance(2.0)
    assert found.status is Status.FAILED
    assert found.t == pytest.approx(1.0, abs=1e-6)
    assert np.isfinite(found.y).all()
    assert "t = " in found.message


def test_bad_starts_are_refused(kind: Kind) -> None:
    with pytest.raises(StartError, match="not all finite"):
        start(kind, pendulum, tight(1e-9), [math.nan, 0.0])
    with pytest.raises(StartError, match="no finite value"):
        start(kind, lambda t, y: [math.inf, 0.0], tight(1e-9), [1.0, 0.0])
    session = start(kind, pendulum, tight(1e-9), [2.0, 0.0])
    session.advance(1.0)
    with pytest.raises(UsageError, match="cannot advance"):
        session.advance(0.5)
    with pytest.raises(UsageError, match="unknowns"):
        session.reinitialize(1.0, np.zeros(3))
    with pytest.raises(UsageError, match="tolerance"):
        start(kind, pendulum, SolverOptions(1e-6, np.ones(3)), [2.0, 0.0])
    with pytest.raises(UsageError, match="at least one unknown"):
        ExplicitProblem(0, pendulum)
    with pytest.raises(UsageError, match="directions"):
        ExplicitProblem(2, pendulum, events=lambda t, y, yp: (y[0],), event_count=1, event_directions=(1, 1))


def test_longest_steps_are_kept_to(kind: Kind) -> None:
    session = start(kind, pendulum, tight(1e-4, max_step=0.01), [2.0, 0.0])
    session.advance(1.0)
    assert session.statistics.steps >= 99


def test_stiffness_is_noticed(kind: Kind) -> None:
    def stiff(t: float, y: FloatArray) -> list[float]:
        return [-1000.0 * (y[0] - math.cos(t)), -y[1]]

    session = start(kind, stiff, tight(1e-6), [1.0, 1.0])
    session.advance(2.0)
    assert session.seems_stiff
    other = start("compiled" if kind == "reference" else "reference", stiff, tight(1e-6), [1.0, 1.0])
    other.advance(2.0)
    assert other.statistics.steps == session.statistics.steps
    smooth = start(kind, pendulum, tight(1e-4, 100.0), [2.0, 0.0])
    smooth.advance(100.0)
    assert not smooth.seems_stiff


# -- scenes -------------------------------------------------------------------------------------------------------


def scene_problem(scene: Any) -> tuple[Any, ExplicitProblem, FloatArray]:
    assembly = assemble(scene)
    problem, begin = explicit_problem(assembly), find_start(assembly)
    assert problem is not None
    assert problem.compiled is not None
    return assembly, problem, np.concatenate([begin.coordinates, begin.speeds])


@pytest.mark.parametrize("name", ["double-pendulum", "chain", "pendulum-on-cart", "driven-pendulum", "double-atwood"])
def test_scenes_run_alike_on_compiled_and_plain_rates(name: str) -> None:
    scene = Chain(links=4) if name == "chain" else SCENES[name]()
    _, problem, y = scene_problem(scene)
    found = [
        open_explicit(problem, tight(1e-10, 1.0), 0.0, y, kind=kind).advance(0.7) for kind in ("reference", "compiled")
    ]
    assert_allclose(found[0].y, found[1].y, rtol=1e-9, atol=1e-9)
    assert found[1].status is Status.REACHED


def test_double_pendulum_keeps_its_energy() -> None:
    assembly, problem, _ = scene_problem(SCENES["double-pendulum"]())
    energies = assembly.kernel(energy_program(assembly))
    y = np.array([2.0, 1.5, 0.3, -0.2])
    session = open_explicit(problem, tight(1e-12, 10.0), 0.0, y)

    def energy(y: FloatArray) -> float:
        reactions = np.zeros(len(assembly.reactions))
        return float(sum(energies([0.0], y[:2], y[2:], np.zeros(2), reactions)[0]))

    values, _, last = session.sample(np.linspace(0.0, 10.0, 101))
    assert last.status is Status.REACHED
    size = max(abs(energy(y)), 10.0)
    assert max(abs(energy(row) - energy(y)) for row in values) < 1e-10 * size


def test_sessions_with_compiled_rates_share_nothing() -> None:
    _, problem, y = scene_problem(SCENES["double-pendulum"]())
    alone = open_explicit(problem, tight(1e-9), 0.0, y).advance(3.0)
    a, b = (open_explicit(problem, tight(1e-9), 0.0, y) for _ in range(2))
    for t in np.linspace(0.0, 3.0, 20):
        last = a.advance(float(t)), b.advance(float(t))
    assert_array_equal(last[0].y, alone.y)
    assert_array_equal(last[1].y, alone.y)


@pytest.mark.parametrize("name", ["four-bar", "chain"])
def test_tapes_are_left_at_any_step(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tapes and machine code give the same bits, after any step."""
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    assembly = assemble(SCENES[name](), form="dae")
    start = find_start(assembly)
    assembly, q, u = settle(assembly, start, assembly.other_mode)
    plan, y = make_problem(assembly, 0.0, q, u, start.length, 1.0), np.concatenate([q, u])
    made = own_rates_on_constraints(plan, 0.0, y)
    assert made is not None
    code, _ = made
    tiers = code.tiers
    quick, better = tiers.now, tiers._better
    assert better is not None
    best, values = better(), values_on_constraints(plan)

    def ended(before: float) -> list[Any]:
        tiers.now, tiers._better, tiers._left = quick, lambda: best, math.inf
        problem = ExplicitProblem(len(y), pendulum, compiled=code.bind(values))
        stepper = CompiledStepper(problem, tight(1e-8), TABLEAU)
        assert stepper.start(0.0, y)
        function = stepper._count("function")
        for step in range(55):
            tiers._left = math.inf if step < before else 0.0
            stepper.run(math.inf, 1)
        assert (stepper._count("function") == function) == (before == math.inf)
        return [stepper.state()[0], *stepper.state()[1]]

    alone = ended(math.inf)
    assert all(ended(before) == alone for before in range(50))


def test_what_starts_often_gets_the_code_that_runs_faster(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    assembly = assemble(SCENES["four-bar"](), form="dae")
    levels: list[int] = []
    compiled = build.compile_text
    monkeypatch.setattr(
        build, "compile_text", lambda *given, **named: (levels.append(given[1]), compiled(*given, **named))[1]
    )
    found = []
    for _ in range(12):
        found.append(simulate(assembly, t_end=0.01, outputs=3)["crank.angle"].tolist())
        if len(found) == 4:
            few = levels.count(1)
    assert levels.count(1) == few + 2  # accelerations, and constraints that are looked at
    assert all(one == found[0] for one in found)


def test_code_that_is_replaced_is_called_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sessions that were opened before go on with the functions that were theirs, new ones with those there are."""
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    assembly = assemble(SCENES["four-bar"](), form="dae")
    start = find_start(assembly)
    assembly, q, u = settle(assembly, start, assembly.other_mode)
    plan = make_problem(assembly, 0.0, q, u, start.length, 1.0)
    made = own_rates_on_constraints(plan, 0.0, np.concatenate([q, u]))
    assert made is not None
    code, before = made[0], made[0].open()
    code.fill(before, values_on_constraints(plan))
    quick = weakref.ref(code.tiers.now.code)
    code.at_its_best()
    del made
    gc.collect()
    assert quick() is not None  # its prologues are still called
    code.fill(before, values_on_constraints(plan))
    better, still = before.rates.faster(0.0), quick()
    assert better is not None
    assert better.function != before.rates.function
    del before, still
    gc.collect()
    assert quick() is not None  # the arrays that it filled are still read
    del better
    gc.collect()
    assert quick() is None
    after = code.open()
    assert set(after.prologues) <= set(code.tiers.now.code.addresses.values())
    code.fill(after, values_on_constraints(plan))


def test_scenes_with_constraints_left_have_no_explicit_problem() -> None:
    assert explicit_problem(assemble(SCENES["four-bar"]())) is None


def test_events_of_a_scene() -> None:
    # the pendulum passes its lowest point after a quarter of its period
    assembly = assemble(SCENES["simple-pendulum"]())
    problem = explicit_problem(assembly, lambda t, y, yp: (y[0],), (0,))
    assert problem is not None
    found = open_explicit(problem, tight(1e-12), 0.0, np.array([2.0, 0.0])).advance(10.0)
    assert found.status is Status.EVENT
    length = dict(zip([p.name for p in assembly.parameters], assembly.parameter_values, strict=True))["rod.length"]
    assert found.t == pytest.approx(math.sqrt(length / 9.81) * ellipk(math.sin(1.0) ** 2), abs=1e-10)
