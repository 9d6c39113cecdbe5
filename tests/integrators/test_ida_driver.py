"""The driver of IDA, and scikit-sundae: right answers, exact times, and no way to lose a state."""

import math
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from atwood.errors import KernelEvaluationError, StartError, UsageError
from atwood.integrators.ida import library as sundials_library, native as ida_native
from atwood.integrators.protocol import (
    Budget,
    ImplicitProblem,
    SolverOptions,
    Statistics,
    Status,
    choose_linear_solver,
)

from ..helpers import scikit_sundae

TIGHT = SolverOptions(relative_tolerance=1e-9, absolute_tolerances=1e-11)
LOOSE = SolverOptions(relative_tolerance=1e-5, absolute_tolerances=1e-7)

DRIVERS: dict[str, Any] = {"scikit-sundae": scikit_sundae.open_session, "native": ida_native.open_session}
open_session = DRIVERS["scikit-sundae"]


@pytest.fixture(autouse=True, params=DRIVERS)
def driver(request: Any, monkeypatch: Any) -> str:
    """Each test runs with each driver."""
    if request.param == "native" and not sundials_library.available():
        pytest.skip(sundials_library.why_not())
    monkeypatch.setitem(globals(), "open_session", DRIVERS[request.param])
    return str(request.param)


def dense_pattern(size: int) -> tuple[Any, Any]:
    columns, rows = np.divmod(np.arange(size * size), size)
    return rows, columns


def oscillator(**events: Any) -> ImplicitProblem:
    """x'' = -x as two equations of first order."""
    return ImplicitProblem(
        size=2,
        residual=lambda t, y, yp: (yp[0] - y[1], yp[1] + y[0]),
        jacobian=lambda t, y, yp, cj: (cj, 1.0, -1.0, cj),
        pattern=dense_pattern(2),
        **events,
    )


def falling(gravity: float = 10.0, direction: int = -1) -> ImplicitProblem:
    """A body in free fall, with an event at the ground."""
    return ImplicitProblem(
        size=2,
        residual=lambda t, y, yp: (yp[0] - y[1], yp[1] + gravity),
        jacobian=lambda t, y, yp, cj: (cj, -1.0, cj),
        pattern=(np.array([0, 0, 1]), np.array([0, 1, 1])),
        events=lambda t, y, yp: (y[0],),
        event_count=1,
        event_directions=(direction,),
    )


Rate = Callable[[float, float], float]


def scalar(rate: Rate, slope: Rate) -> ImplicitProblem:
    """y' = rate(t, y), with slope = d rate / dy."""
    return ImplicitProblem(
        size=1,
        residual=lambda t, y, yp: (yp[0] - rate(t, float(y[0])),),
        jacobian=lambda t, y, yp, cj: (cj - slope(t, float(y[0])),),
        pattern=dense_pattern(1),
    )


def start(problem: ImplicitProblem, options: SolverOptions, y: Any, yp: Any, **more: Any) -> Any:
    return open_session(problem, options, 0.0, np.array(y, dtype=float), np.array(yp, dtype=float), **more)


class TestAnswers:
    def test_robertson(self) -> None:
        def residual(t: float, y: Any, yp: Any) -> tuple[float, ...]:
            slow = 0.04 * y[0] - 1e4 * y[1] * y[2]
            return yp[0] + slow, yp[1] - slow + 3e7 * y[1] ** 2, y[0] + y[1] + y[2] - 1.0

        def jacobian(t: float, y: Any, yp: Any, cj: float) -> tuple[float, ...]:
            a, b = 1e4 * y[2], 1e4 * y[1]
            return cj + 0.04, -0.04, 1.0, -a, cj + a + 6e7 * y[1], 1.0, -b, b, 1.0

        problem = ImplicitProblem(3, residual, jacobian, dense_pattern(3), algebraic=(2,))
        options = SolverOptions(1e-8, np.array([1e-10, 1e-14, 1e-10]))
        session = start(problem, options, [1, 0, 0], [-0.04, 0.04, 0])
        # The values that SUNDIALS prints for this example at rtol 1e-4 are these to about four digits.
        for t, y0 in [(0.4, 0.98517), (4.0, 0.90553), (40.0, 0.71583), (4e4, 0.03898), (4e7, 5.203e-5)]:
            end = session.advance(t)
            assert (end.status, end.t) == (Status.REACHED, t)
            assert_allclose(end.y[0], y0, rtol=2e-3)
            assert_allclose(end.y.sum(), 1.0, atol=1e-12)

    def test_the_error_follows_the_tolerance(self) -> None:
        errors = []
        for tolerance in (1e-4, 1e-6, 1e-8, 1e-10):
            session = start(oscillator(), SolverOptions(tolerance, tolerance), [1, 0], [0, -1])
            end = session.advance(5.0)
            errors.append(abs(end.y[0] - math.cos(5.0)))
        slope = np.polyfit([-4, -6, -8, -10], np.log10(errors), 1)[0]
        assert 0.7 < slope < 1.2
        assert errors[-1] < 1e-7

    def test_the_order_of_the_method_shows_in_its_steps(self) -> None:
        """At order k the number of steps grows as tolerance^(-1/(k+1))."""
        for order in (1, 2):
            steps = []
            for tolerance in (1e-5, 1e-7):
                session = start(oscillator(), SolverOptions(tolerance, tolerance, max_order=order), [1, 0], [0, -1])
                session.advance(2.0)
                steps.append(session.statistics.steps)
            observed = math.log(steps[1] / steps[0]) / math.log(100)
            assert observed == pytest.approx(1 / (order + 1), rel=0.2)

    def test_a_pendulum_with_its_constraint_at_velocity_level(self) -> None:
        """Index 2: the multiplier stays out of the error test by its absolute tolerance."""
        g = 9.81

        def residual(t: float, s: Any, sp: Any) -> tuple[float, ...]:
            x, z, u, w, force = s
            return sp[0] - u, sp[1] - w, sp[2] + force * x, sp[3] + force * z + g, x * u + z * w

        def jacobian(t: float, s: Any, sp: Any, cj: float) -> Any:
            x, z, u, w, force = s
            matrix = np.diag([cj, cj, cj, cj, 0.0])
            matrix[0, 2] = matrix[1, 3] = -1.0
            matrix[2, [0, 4]] = force, x
            matrix[3, [1, 4]] = force, z
            matrix[4, :4] = u, w, x, z
            return matrix.ravel(order="F")

        problem = ImplicitProblem(5, residual, jacobian, dense_pattern(5), algebraic=(4,))
        options = SolverOptions(1e-8, np.array([1e-8, 1e-8, 1e-8, 1e-8, 1e3]))
        session = start(problem, options, [1, 0, 0, 0, 0], [0, 0, 0, -g, 0])
        end = session.advance(2.0)
        x, z, u, w, force = end.y
        assert_allclose(math.hypot(x, z), 1.0, atol=1e-6)
        assert_allclose(0.5 * (u * u + w * w) + g * z, 0.0, atol=1e-5)
        assert_allclose(force, u * u + w * w - g * z, rtol=1e-3)

    @pytest.mark.parametrize("size", [5, 100])
    def test_sparse_equals_dense(self, size: int) -> None:
        """Heat in a rod: a tridiagonal matrix."""
        columns = np.repeat(np.arange(size), 3)
        rows = columns + np.tile([-1, 0, 1], size)
        inside = (rows >= 0) & (rows < size)
        rows, columns = rows[inside], columns[inside]
        stiffness = 50.0

        def residual(t: float, y: Any, yp: Any) -> Any:
            flow = 2 * y
            flow[1:] -= y[:-1]
            flow[:-1] -= y[1:]
            return yp + stiffness * flow

        def jacobian(t: float, y: Any, yp: Any, cj: float) -> Any:
            return np.where(rows == columns, cj + 2 * stiffness, -stiffness)

        problem = ImplicitProblem(size, residual, jacobian, (rows, columns))
        y0 = np.sin(math.pi * (np.arange(size) + 1) / (size + 1))
        ends = []
        for linear_solver in ("dense", "sparse"):
            session = start(problem, replace(LOOSE, linear_solver=linear_solver), y0, -residual(0, y0, 0 * y0))
            ends.append((session.advance(0.1).y, session.statistics.jacobian_evaluations))
        assert_allclose(ends[0][0], ends[1][0], rtol=1e-9, atol=1e-12)
        assert ends[0][1] == ends[1][1] > 0
        rate = 4 * stiffness * math.sin(math.pi / (2 * (size + 1))) ** 2
        assert_allclose(ends[0][0], y0 * math.exp(-0.1 * rate), rtol=1e-3)
        assert choose_linear_solver(problem, LOOSE) == ("sparse" if size >= 60 else "dense")

    def test_outputs_do_not_change_the_solution(self) -> None:
        times = np.linspace(0.0, 10.0, 1001)
        fine = start(oscillator(), LOOSE, [1, 0], [0, -1])
        coarse = start(oscillator(), LOOSE, [1, 0], [0, -1])
        fine_values = [fine.advance(t).y for t in times]
        coarse_values = [coarse.advance(t).y for t in times[::250]]
        assert_array_equal(fine_values[::250], coarse_values)
        assert replace(fine.statistics, seconds=0.0) == replace(coarse.statistics, seconds=0.0)
        assert 50 < fine.statistics.steps < 500

    def test_the_answer_is_exactly_at_the_time_and_belongs_to_the_caller(self) -> None:
        session = start(oscillator(), LOOSE, [1, 0], [0, -1])
        first = session.advance(0.0)
        assert_array_equal(first.y, [1, 0])
        one = session.advance(0.7)
        one.y[:] = 99.0
        again = session.advance(0.7)
        assert again.t == 0.7
        assert_allclose(again.y, [math.cos(0.7), -math.sin(0.7)], atol=1e-3)
        assert_allclose(again.yp, [-math.sin(0.7), -math.cos(0.7)], atol=1e-2)

    def test_time_does_not_run_backwards(self) -> None:
        session = start(oscillator(), LOOSE, [1, 0], [0, -1])
        session.advance(1.0)
        for t in (0.5, math.nan, math.inf):
            with pytest.raises(UsageError, match="cannot advance"):
                session.advance(t)


class TestEvents:
    def test_a_bouncing_body(self) -> None:
        """Dropped from 5 m at 10 m/s^2, restitution 0.8: impacts are known in closed form."""
        session = start(falling(), TIGHT, [5, 0], [0, -10])
        expected, speed = 1.0, 10.0
        for _ in range(8):
            hit = session.advance(100.0)
            assert hit.status is Status.EVENT
            assert hit.events == (-1,)
            assert abs(hit.t - expected) < 1e-9
            assert abs(hit.y[0]) < 1e-8
            assert_allclose(hit.y[1], -speed, rtol=1e-8)
            speed *= 0.8
            session.reinitialize(hit.t, np.array([hit.y[0], speed]), np.array([speed, -10.0]))
            expected = hit.t + 2 * speed / 10
        assert session.statistics.reinitializations == 8

    @pytest.mark.parametrize("offset", [1e-16, -1e-16, 0.0])
    @pytest.mark.parametrize("direction", [-1, 0])
    def test_a_restart_at_the_root_leaves_it(self, offset: float, direction: int) -> None:
        session = start(falling(direction=direction), TIGHT, [5, 0], [0, -10])
        hit = session.advance(9.0)
        session.reinitialize(hit.t, np.array([offset, 5.0]), np.array([5.0, -10.0]))
        later = session.advance(9.0)
        assert_allclose(later.t, hit.t + 1.0, atol=1e-8)

    @pytest.mark.parametrize("offset", [1e-17, -1e-17, 0.0])
    def test_a_start_within_rounding_of_a_root_leaves_it(self, offset: float) -> None:
        session = start(falling(direction=0), TIGHT, [offset, 5], [5, -10])
        assert_allclose(session.advance(9.0).t, 1.0, atol=1e-8)

    def test_going_on_without_a_restart_passes_the_root(self) -> None:
        problem = oscillator(events=lambda t, y, yp: (y[0], y[1]), event_count=2, event_directions=(0, 1))
        session = start(problem, TIGHT, [1, 0], [0, -1])
        found = []
        while (end := session.advance(10.0)).status is Status.EVENT:
            found.append((round(end.t / (math.pi / 2), 6), end.events))
        # x passes zero at every odd quarter, the speed rises through zero at x = -1 only.
        assert found == [(1, (-1, 0)), (2, (0, 1)), (3, (1, 0)), (5, (-1, 0)), (6, (0, 1))]
        assert end.t == 10.0

    def test_a_root_beyond_the_output_waits(self) -> None:
        plain = start(oscillator(), LOOSE, [1, 0], [0, -1])
        watched = start(oscillator(events=lambda t, y, yp: (y[0],), event_count=1), LOOSE, [1, 0], [0, -1])
        events = []
        for t in np.linspace(0.0, 6.0, 601):
            while (end := watched.advance(t)).status is Status.EVENT:
                assert not events or end.t > events[-1]
                events.append(end.t)
            assert end.t == t
            assert_array_equal(end.y, plain.advance(t).y)
        assert_allclose(events, [math.pi / 2, 3 * math.pi / 2], atol=1e-3)
        assert watched.statistics.steps == plain.statistics.steps

    def test_an_event_at_the_very_output_time_comes_first(self) -> None:
        problem = falling()
        hit = start(problem, TIGHT, [5, 0], [0, -10]).advance(2.0)
        session = start(problem, TIGHT, [5, 0], [0, -10])
        assert session.advance(hit.t).status is Status.EVENT
        assert session.advance(hit.t).status is Status.REACHED

    def test_events_at_one_moment_come_together(self) -> None:
        problem = oscillator(events=lambda t, y, yp: (y[0], 3.0 * y[0], y[0] + 1.0, -y[0]), event_count=4)
        session = start(problem, TIGHT, [1, 0], [0, -1])
        assert session.advance(10.0).events == (-1, -1, 0, 1)
        assert session.advance(10.0).t > 3.0

    def test_two_roots_in_one_step_come_in_order(self) -> None:
        """The steps of a free fall are long, so that several levels are passed in one."""
        levels = (1.0, 3.0, 2.0)
        problem = replace(
            falling(),
            events=lambda t, y, yp: tuple(y[0] - level for level in levels),
            event_count=3,
            event_directions=(-1, -1, -1),
        )
        session = start(problem, TIGHT, [5, 0], [0, -10])
        ends = [session.advance(1.0) for _ in range(3)]
        assert [end.events.index(-1) for end in ends] == [1, 2, 0]
        assert_allclose([end.t for end in ends], np.sqrt(np.array([2, 3, 4]) / 5), atol=1e-9)

    def test_an_event_value_that_is_zero_all_along_never_happens(self) -> None:
        problem = oscillator(events=lambda t, y, yp: (0.0, max(t - 1.0, 0.0)), event_count=2)
        session = start(problem, LOOSE, [1, 0], [0, -1])
        assert session.advance(5.0).status is Status.REACHED

    def test_a_jump_is_located(self) -> None:
        problem = oscillator(events=lambda t, y, yp: (math.inf if t >= 1.0 else -1.0,), event_count=1)
        end = start(problem, LOOSE, [1, 0], [0, -1]).advance(5.0)
        assert end.events == (1,)
        assert 0 <= end.t - 1.0 < 1e-12

    def test_an_event_without_a_value_is_a_failure(self) -> None:
        problem = oscillator(events=lambda t, y, yp: (math.nan if t > 1.0 else 1.0,), event_count=1)
        end = start(problem, LOOSE, [1, 0], [0, -1]).advance(5.0)
        assert end.status is Status.FAILED
        assert "event function 0 has no value" in end.message
        assert end.t <= 1.0


class TestLimits:
    def test_steps(self) -> None:
        session = start(oscillator(), LOOSE, [1, 0], [0, -1], budget=Budget(max_steps=20))
        end = session.advance(100.0)
        assert end.status is Status.STEP_LIMIT
        assert "20 steps" in end.message
        assert session.statistics.steps == 20
        assert 0.0 < end.t < 100.0
        assert_allclose(end.y[0], math.cos(end.t), atol=1e-3)
        session.budget = Budget()
        assert_allclose(session.advance(10.0).y, start(oscillator(), LOOSE, [1, 0], [0, -1]).advance(10.0).y, rtol=0)

    def test_time(self) -> None:
        session = start(oscillator(), LOOSE, [1, 0], [0, -1], budget=Budget(wall_seconds=0.02))
        end = session.advance(1e9)
        assert end.status is Status.TIME_LIMIT
        assert 0.02 <= session.statistics.seconds < 2.0

    def test_poll_sees_the_time_and_can_interrupt(self) -> None:
        seen: list[float] = []

        def poll(t: float) -> None:
            seen.append(t)
            if len(seen) == 30:
                raise KeyboardInterrupt

        session = start(oscillator(), LOOSE, [1, 0], [0, -1], budget=Budget(poll=poll))
        end = session.advance(100.0)
        assert end.status is Status.INTERRUPTED
        assert seen == sorted(seen)
        assert end.t == seen[-1] > 0.0
        assert_allclose(session.advance(10.0).y[0], math.cos(10.0), atol=5e-3)

    @pytest.mark.parametrize("place", ["residual", "jacobian", "events"])
    def test_an_interrupt_inside_a_callback_keeps_the_state(self, place: str, capfd: Any) -> None:
        armed = [True]

        def trap(function: Any) -> Any:
            def wrapped(t: float, *rest: Any) -> Any:
                if armed[0] and t > 0.05:
                    armed[0] = False
                    raise KeyboardInterrupt
                return function(t, *rest)

            return wrapped

        problem = oscillator(events=lambda t, y, yp: (2.0,), event_count=1)
        session = start(replace(problem, **{place: trap(getattr(problem, place))}), TIGHT, [1, 0], [0, -1])
        end = session.advance(10.0)
        assert end.status is Status.INTERRUPTED
        assert 0.0 < end.t < 1.0
        assert_allclose(end.y, [math.cos(end.t), -math.sin(end.t)], atol=1e-7)
        assert_allclose(session.advance(10.0).y[0], math.cos(10.0), atol=1e-6)
        assert capfd.readouterr() == ("", "")

    @pytest.mark.skipif(os.name == "nt", reason="signals differ")
    def test_ctrl_c_ends_a_run_in_another_process(self, driver: str) -> None:
        here = Path(__file__).resolve()
        script = (
            "import os, signal, sys, threading; sys.path.insert(0, sys.argv[1])\n"
            "import tests.integrators.test_ida_driver as tests\n"
            "signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it\n"
            "tests.open_session = tests.DRIVERS[sys.argv[2]]\n"
            "session = tests.start(tests.oscillator(), tests.LOOSE, [1, 0], [0, -1])\n"
            "session.advance(1.0)\n"
            f"threading.Timer(0.1, os.kill, (os.getpid(), {int(signal.SIGINT)})).start()\n"
            "end = session.advance(1e9)\n"
            "print(end.status.value, end.t > 1.0, abs(end.y[0]) < 10)\n"
        )
        path = os.pathsep.join(str(here.parents[2] / part) for part in ("src", "library"))
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", script, str(here.parents[2]), driver],
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert (done.stdout.split(), done.stderr) == (["interrupted", "True", "True"], "")

    def test_an_error_in_the_users_function_comes_out_unchanged(self) -> None:
        armed = [True]

        def residual(t: float, y: Any, yp: Any) -> Any:
            if t > 1.0 and armed[0]:
                raise LookupError("no such table")
            return yp[0] - y[1], yp[1] + y[0]

        session = start(replace(oscillator(), residual=residual), LOOSE, [1, 0], [0, -1])
        with pytest.raises(LookupError, match="no such table"):
            session.advance(10.0)
        armed[0] = False
        assert_allclose(session.advance(2.0).y[0], math.cos(2.0), atol=1e-3)


def root_of(how: str) -> Rate:
    """sqrt(y), and three ways of having no value below zero."""

    def rate(t: float, y: float) -> float:
        if y >= 0.0:
            return -math.sqrt(y)
        if how == "raise":
            raise KernelEvaluationError("square root of a negative number")
        if how == "divide":
            return 1 / 0
        return math.nan

    return rate


class TestMissingValues:
    @pytest.mark.parametrize("how", ["raise", "divide", "nan"])
    def test_smaller_steps_stay_where_there_are_values(self, how: str, capfd: Any) -> None:
        """y' = -sqrt(y) from 1: y = (1 - t/2)^2, which predictors overshoot near t = 2."""
        problem = scalar(root_of(how), lambda t, y: -0.5 / math.sqrt(y) if y > 0.0 else math.nan)
        session = start(problem, SolverOptions(1e-6, 1e-12), [1], [-1])
        end = session.advance(1.99)
        assert end.status is Status.REACHED
        assert_allclose(end.y, [0.005**2], rtol=1e-2)
        end = session.advance(3.0)
        assert session.statistics.undefined_values > 0
        assert end.status is Status.FAILED
        assert 1.99 < end.t < 2.01
        assert end.y[0] >= -1e-9
        assert end.message
        assert capfd.readouterr() == ("", "")

    def test_a_recoverable_gap_is_stepped_over(self) -> None:
        """The residual complains once for a while, and a smaller step then succeeds."""
        complaints = [0]

        def rate(t: float, y: float) -> float:
            if t > 1.0 and complaints[0] < 3:
                complaints[0] += 1
                raise KernelEvaluationError("not now")
            return -y

        session = start(scalar(rate, lambda t, y: -1.0), LOOSE, [1], [-1])
        end = session.advance(2.0)
        assert end.status is Status.REACHED
        assert_allclose(end.y, [math.exp(-2.0)], rtol=1e-3)
        assert session.statistics.undefined_values == 3

    def test_a_wall_ends_the_run_with_the_equation_and_the_time(self, capfd: Any) -> None:
        problem = ImplicitProblem(
            size=2,
            residual=lambda t, y, yp: (yp[0] - 1.0, yp[1] - (math.nan if t > 1.0 else 2.0)),
            jacobian=lambda t, y, yp, cj: (cj, cj),
            pattern=(np.array([0, 1]), np.array([0, 1])),
        )
        end = start(problem, LOOSE, [0, 0], [1, 2]).advance(2.0)
        assert end.status is Status.FAILED
        assert end.equation == 1
        assert "the residual of equation 1 is nan" in end.message
        assert 0.5 < end.t <= 1.0
        assert_allclose(end.y, [end.t, 2 * end.t], rtol=1e-6)
        assert capfd.readouterr() == ("", "")

    def test_a_start_without_a_value_is_a_failure_with_its_reason(self) -> None:
        def rate(t: float, y: float) -> float:
            raise KernelEvaluationError("logarithm of zero")

        end = start(scalar(rate, lambda t, y: 0.0), LOOSE, [1], [-1]).advance(1.0)
        assert (end.status, end.t) == (Status.FAILED, 0.0)
        assert "logarithm of zero" in end.message

    @pytest.mark.parametrize("linear_solver", ["dense", "sparse"])
    @pytest.mark.parametrize("how", ["raise", "nan"])
    def test_a_jacobian_without_a_value_is_recoverable(self, how: str, linear_solver: Any) -> None:
        calls = [0]

        def jacobian(t: float, y: Any, yp: Any, cj: float) -> Any:
            calls[0] += 1
            if calls[0] in (4, 5):
                if how == "raise":
                    raise KernelEvaluationError("no slope")
                return cj, math.nan, -1.0, cj
            return cj, 1.0, -1.0, cj

        problem = replace(oscillator(), jacobian=jacobian)
        session = start(problem, replace(TIGHT, linear_solver=linear_solver), [1, 0], [0, -1])
        end = session.advance(3.0)
        assert end.status is Status.REACHED
        assert_allclose(end.y[0], math.cos(3.0), atol=1e-6)
        assert session.statistics.undefined_values == 2

    def test_a_solution_that_blows_up_is_a_failure(self, capfd: Any) -> None:
        """y' = y^2 from 1 has no solution past t = 1."""
        end = start(scalar(lambda t, y: y * y, lambda t, y: 2 * y), LOOSE, [1], [1]).advance(2.0)
        assert end.status is Status.FAILED
        assert_allclose(end.t, 1.0, rtol=1e-3)
        assert end.message
        assert capfd.readouterr() == ("", "")


class TestSession:
    def test_statistics_accumulate_over_restarts(self) -> None:
        session = start(oscillator(), LOOSE, [1, 0], [0, -1])
        end = session.advance(3.0)
        before = session.statistics
        session.reinitialize(end.t, end.y, end.yp)
        assert_allclose(session.advance(6.0).y[0], math.cos(6.0), atol=1e-3)
        after = session.statistics
        for name in ("steps", "residual_evaluations", "jacobian_evaluations", "seconds"):
            assert getattr(after, name) > getattr(before, name) > 0
        assert (before.reinitializations, after.reinitializations) == (0, 1)
        assert after.residual_evaluations >= after.steps

    def test_statistics_add(self) -> None:
        total = Statistics(steps=2, error_test_failures=1) + Statistics(steps=3, error_test_failures=4)
        assert (total.steps, total.error_test_failures) == (5, 5)
        assert (total + Statistics()).error_test_failures is None

    def test_a_jump_of_the_state_is_taken_as_it_is(self) -> None:
        session = start(oscillator(), LOOSE, [1, 0], [0, -1])
        session.advance(1.0)
        session.reinitialize(1.0, np.array([2.0, 0.0]), np.array([0.0, -2.0]))
        assert_array_equal(session.advance(1.0).y, [2.0, 0.0])
        assert_allclose(session.advance(2.0).y[0], 2.0 * math.cos(1.0), atol=1e-3)

    def test_sessions_run_side_by_side_in_threads(self) -> None:
        ends: dict[int, float] = {}
        stdout = sys.stdout

        def work(k: int) -> None:
            ends[k] = float(start(oscillator(), LOOSE, [k, 0], [0, -k]).advance(5.0).y[0])

        threads = [threading.Thread(target=work, args=(k,)) for k in range(1, 5)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert_allclose([ends[k] / k for k in range(1, 5)], math.cos(5.0), atol=1e-3)
        assert sys.stdout is stdout

    def test_the_users_own_output_passes_through(self, capsys: Any) -> None:
        session = start(oscillator(), LOOSE, [1, 0], [0, -1], budget=Budget(poll=lambda t: print("tick"), max_steps=2))
        session.advance(1.0)
        assert capsys.readouterr().out == "tick\n" * 3

    def test_bad_starts_are_refused(self) -> None:
        with pytest.raises(UsageError, match="2 unknowns"):
            start(oscillator(), LOOSE, [1], [0])
        with pytest.raises(StartError, match="finite"):
            start(oscillator(), LOOSE, [1, math.nan], [0, 0])
        with pytest.raises(UsageError, match="absolute tolerance"):
            start(oscillator(), replace(LOOSE, absolute_tolerances=np.ones(3)), [1, 0], [0, -1])

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            ({"pattern": (np.array([1, 0]), np.array([0, 0]))}, "by column"),
            ({"pattern": (np.array([0, 0]), np.array([0, 0]))}, "once"),
            ({"pattern": (np.array([0, 2]), np.array([0, 0]))}, "outside"),
            ({"pattern": (np.array([0]), np.array([0, 1]))}, "one row"),
            ({"algebraic": (2,)}, "algebraic"),
            ({"event_count": 1}, "both"),
            ({"size": 0}, "at least one"),
        ],
    )
    def test_bad_problems_are_refused(self, change: dict[str, Any], words: str) -> None:
        with pytest.raises(UsageError, match=words):
            replace(oscillator(), **change)

    @pytest.mark.parametrize(
        "change",
        [
            {"relative_tolerance": 0.0},
            {"absolute_tolerances": -1.0},
            {"first_step": -1.0},
            {"max_step": math.nan},
            {"max_order": 6},
            {"linear_solver": "banded"},
        ],
    )
    def test_bad_options_are_refused(self, change: dict[str, Any]) -> None:
        with pytest.raises(UsageError):
            replace(LOOSE, **change)

    def test_first_and_largest_step_are_kept(self) -> None:
        times: list[float] = []
        options = replace(LOOSE, first_step=1e-3, max_step=0.01)
        start(oscillator(), options, [1, 0], [0, -1], budget=Budget(poll=times.append)).advance(0.5)
        steps = np.diff(times)
        assert steps[0] == pytest.approx(1e-3)
        assert steps.max() == pytest.approx(0.01)
