"""The native driver: what only it can do, and step-by-step agreement with scikit-sundae."""

import ctypes
import gc
import importlib.util
import math
import signal
import subprocess
import sys
import threading
import weakref
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from atwood.errors import UsageError
from atwood.integrators.ida import library as sundials_library, memory, native as ida_native
from atwood.integrators.ida.callbacks import Record, address, jacobian_function, residual_function, weight_function
from atwood.integrators.ida.native import NativeSession
from atwood.integrators.ida.setup import IdaTuning
from atwood.integrators.protocol import Budget, ImplicitProblem, NativeCallbacks, SolverOptions, Status
from atwood_library.scenes import DoublePendulum

from ..helpers import scikit_sundae
from ..helpers.runs import packed, prepare

pytestmark = pytest.mark.skipif(not sundials_library.available(), reason=sundials_library.why_not() or "available")

GRAVITY = 9.81
TIGHT = SolverOptions(relative_tolerance=1e-9, absolute_tolerances=1e-11)
AS_SUNDAE = IdaTuning(newton_coefficient=0.33, least_growth=2.0, jacobian_age=0.25)


def dense_pattern(size: int) -> tuple[Any, Any]:
    columns, rows = np.divmod(np.arange(size * size), size)
    return rows, columns


def oscillator(**more: Any) -> ImplicitProblem:
    return ImplicitProblem(
        size=2,
        residual=lambda t, y, yp: (yp[0] - y[1], yp[1] + y[0]),
        jacobian=lambda t, y, yp, cj: (cj, 1.0, -1.0, cj),
        pattern=dense_pattern(2),
        **more,
    )


def pendulum() -> ImplicitProblem:
    """The pendulum with its constraint at both levels; the multipliers are unknowns 4 and 5."""

    def residual(t: float, s: Any, sp: Any) -> tuple[float, ...]:
        x, z, u, w, force, push = s.tolist()
        a, b, c, d = sp.tolist()[:4]
        return (
            a - u + x * push,
            b - w + z * push,
            c + force * x,
            d + force * z + GRAVITY,
            x * u + z * w,
            0.5 * (x * x + z * z - 1.0),
        )

    def jacobian(t: float, s: Any, sp: Any, cj: float) -> Any:
        x, z, u, w, force, push = s
        matrix = np.diag([cj + push, cj + push, cj, cj, 0.0, 0.0])
        matrix[0, [2, 5]] = -1.0, x
        matrix[1, [3, 5]] = -1.0, z
        matrix[2, [0, 4]] = force, x
        matrix[3, [1, 4]] = force, z
        matrix[4, :4] = u, w, x, z
        matrix[5, :2] = x, z
        return matrix.ravel(order="F")

    return ImplicitProblem(6, residual, jacobian, dense_pattern(6), algebraic=(4, 5))


OSCILLATOR_START = np.array([1.0, 0]), np.array([0, -1.0])
PENDULUM_START = np.array([1.0, 0, 0, 0, 0, 0]), np.array([0, 0, 0, -GRAVITY, 0, 0])


def chain(size: int) -> tuple[ImplicitProblem, Any, Any]:
    """Stiff springs in a row, with few entries in the matrix."""
    columns = np.repeat(np.arange(size), 3)
    rows = columns + np.tile([-1, 0, 1], size)
    inside = (rows >= 0) & (rows < size)
    rows, columns = rows[inside], columns[inside]

    def rate(y: Any) -> Any:
        flow = 2 * y
        flow[1:] -= y[:-1]
        flow[:-1] -= y[1:]
        return -50.0 * flow

    problem = ImplicitProblem(
        size,
        lambda t, y, yp: yp - rate(y),
        lambda t, y, yp, cj: np.where(rows == columns, cj + 100.0, -50.0),
        (rows, columns),
    )
    y = np.sin(math.pi * (np.arange(size) + 1) / (size + 1))
    return problem, y, rate(y)


def turning() -> ImplicitProblem:
    """theta'' = -sin theta, fast enough to go round and round."""
    return ImplicitProblem(
        size=2,
        residual=lambda t, y, yp: (yp[0] - y[1], yp[1] + math.sin(y[0])),
        jacobian=lambda t, y, yp, cj: (cj, math.cos(y[0]), -1.0, cj),
        pattern=dense_pattern(2),
    )


EVENTS = ctypes.CFUNCTYPE(
    ctypes.c_int,
    ctypes.c_double,
    ctypes.c_void_p,
    ctypes.c_void_p,
    ctypes.POINTER(ctypes.c_double),
    ctypes.c_void_p,
)


def with_c_functions(problem: ImplicitProblem, record: Record, weights: bool = False) -> ImplicitProblem:
    """The same problem, handing over addresses of C functions."""
    sundials = sundials_library.library()

    def native(linear_solver: Any) -> NativeCallbacks:
        residual = residual_function(problem, record, sundials)
        jacobian = jacobian_function(problem, record, sundials, linear_solver)
        tables = np.zeros(problem.size), np.zeros(problem.size)
        own = weight_function(*tables, record, sundials)

        def find(t: float, y: int, yp: int, out: Any, _: Any) -> int:
            assert problem.events is not None
            state = [
                np.array((ctypes.c_double * problem.size).from_address(sundials.N_VGetArrayPointer(v))) for v in (y, yp)
            ]
            values = problem.events(t, *state)
            for k, value in enumerate(values):
                out[k] = value
            return int(not np.isfinite(values).all())

        def set_weights(relative: Any, absolute: Any) -> None:
            tables[0][:], tables[1][:] = relative, absolute

        events = EVENTS(find) if problem.events is not None else None
        return NativeCallbacks(
            address(residual),
            address(jacobian),
            events=address(events) if events is not None else 0,
            weights=address(own) if weights else 0,
            set_weights=set_weights if weights else None,
            undefined_values=lambda: record.undefined,
            keep=(residual, jacobian, own, events),
        )

    return replace(problem, native=native)


def resident_kilobytes() -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1])
    raise AssertionError


class TestLibrary:
    def test_it_is_found_without_importing_scikit_sundae(self) -> None:
        script = "from atwood.integrators.ida import library; print(library.available(), 'sksundae' in sys.modules)"
        path = str(Path(sundials_library.__file__).parents[3])
        done = subprocess.run(
            [sys.executable, "-c", f"import sys; sys.path.insert(0, {path!r}); {script}"],
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.split() == ["True", "False"]

    def test_it_says_what_it_is(self) -> None:
        found = sundials_library.library()
        assert found is sundials_library.library()
        assert found.version >= (7, 0, 0)
        assert found.index_type in (ctypes.c_int32, ctypes.c_int64)
        assert sundials_library.why_not() == ""

    def test_a_missing_package_is_a_reason_and_no_crash(self, monkeypatch: Any) -> None:
        monkeypatch.setattr(sundials_library, "_found", None)
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
        assert not sundials_library.available()
        assert "not installed" in sundials_library.why_not()
        with pytest.raises(sundials_library.SundialsMissing):
            ida_native.open_session(oscillator(), TIGHT, 0.0, np.zeros(2), np.zeros(2))

    def test_missing_and_broken_libraries_are_a_reason(self, monkeypatch: Any, tmp_path: Path) -> None:
        package = tmp_path / "sksundae"
        package.mkdir()
        monkeypatch.setattr(sundials_library, "_package_folder", lambda: package)
        monkeypatch.setattr(sundials_library.sys, "prefix", str(tmp_path))
        monkeypatch.setattr(sundials_library, "_found", None)
        assert "no SUNDIALS libraries" in sundials_library.why_not()
        for name in ("libsundials_core.so", "libsundials_ida.so"):
            (package / name).write_bytes(b"not a library")
        monkeypatch.setattr(sundials_library, "_found", None)
        assert "cannot be opened" in sundials_library.why_not()

    @pytest.mark.parametrize(
        ("folder", "names"),
        [
            ("scikit_sundae.libs", ("libsundials_core-943007ef.so.7.9.0", "libsundials_ida-16d992eb.so.7.9.0")),
            ("scikit_sundae.libs", ("sundials_core-0123456789abcdef.dll", "sundials_ida-fedcba9876543210.dll")),
            ("sksundae/.dylibs", ("libsundials_core.7.9.0.dylib", "libsundials_ida.7.9.0.dylib")),
            ("prefix/lib", ("libsundials_core.so.7", "libsundials_ida.so")),
        ],
    )
    def test_names_on_all_systems(self, monkeypatch: Any, tmp_path: Path, folder: str, names: tuple[str, str]) -> None:
        (tmp_path / "sksundae").mkdir()
        (tmp_path / folder).mkdir(parents=True)
        for name in (*names, names[1].replace("_ida", "_idas"), "README.txt"):
            (tmp_path / folder / name).touch()
        monkeypatch.setattr(sundials_library.sys, "prefix", str(tmp_path / "prefix"))
        files = sundials_library._library_files(tmp_path / "sksundae")
        assert (files["sundials_core"].name, files["sundials_ida"].name) == names

    def test_libraries_elsewhere_are_found_by_what_was_linked_with_them(self, monkeypatch: Any) -> None:
        monkeypatch.setattr(sundials_library, "_ENDINGS", "no such ending")
        monkeypatch.setattr(sundials_library, "_found", None)
        assert sundials_library.library().folder == sundials_library._package_folder()
        problem, y, yp = chain(80)
        for solver in ("dense", "sparse"):
            options = SolverOptions(1e-6, 1e-8, linear_solver=solver)
            found = ida_native.open_session(problem, options, 0.0, y, yp).advance(0.2)
            assert_allclose(found.y, scikit_sundae.open_session(problem, options, 0.0, y, yp).advance(0.2).y, atol=1e-4)


class TestAgreement:
    """Bit for bit, where the options agree."""

    @pytest.mark.parametrize("compiled", [False, True])
    def test_a_pendulum(self, compiled: bool) -> None:
        options = SolverOptions(1e-7, np.array([1e-7] * 4 + [1e3] * 2))
        problem = with_c_functions(pendulum(), Record()) if compiled else pendulum()
        native = ida_native.open_session(problem, options, 0.0, *PENDULUM_START, tuning=AS_SUNDAE)
        reference = scikit_sundae.open_session(pendulum(), options, 0.0, *PENDULUM_START)
        for t in np.linspace(0.0, 1.0, 11):
            mine, theirs = native.advance(t), reference.advance(t)
            assert_allclose(mine.y, theirs.y, rtol=1e-12, atol=1e-12)
            assert_allclose(mine.yp, theirs.yp, rtol=1e-9, atol=1e-9)
        mine, theirs = native.statistics, reference.statistics
        for name in ("steps", "residual_evaluations", "jacobian_evaluations"):
            assert getattr(mine, name) == getattr(theirs, name) > 0
        assert mine.error_test_failures is not None
        assert mine.error_test_failures > 0
        assert mine.convergence_failures == 0

    @pytest.mark.parametrize("order", [1, 3, 5])
    def test_a_sparse_chain(self, order: int) -> None:
        problem, y, yp = chain(80)
        options = SolverOptions(1e-6, 1e-8, max_order=order, linear_solver="sparse", first_step=1e-5, max_step=0.01)
        native = ida_native.open_session(problem, options, 0.0, y, yp, tuning=AS_SUNDAE)
        reference = scikit_sundae.open_session(problem, options, 0.0, y, yp)
        assert_allclose(native.advance(0.2).y, reference.advance(0.2).y, rtol=1e-12, atol=1e-14)
        assert native.statistics.steps == reference.statistics.steps
        assert native.counts.last_order <= order
        assert 0.0 < native.counts.last_step <= 0.01

    def test_one_step_at_a_time_or_many(self) -> None:
        """Polling in the middle of a run changes nothing."""
        plain = ida_native.open_session(oscillator(), TIGHT, 0.0, np.array([1.0, 0]), np.array([0, -1.0]))
        mixed = ida_native.open_session(oscillator(), TIGHT, 0.0, np.array([1.0, 0]), np.array([0, -1.0]))
        for k, t in enumerate(np.linspace(0.0, 3.0, 31)):
            mixed.budget = Budget(poll=lambda t: None) if k % 3 == 1 else Budget()
            assert_array_equal(mixed.advance(t).y, plain.advance(t).y)
        assert mixed.statistics.steps == plain.statistics.steps


class TestTuning:
    @pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8, 1e-10])
    def test_multipliers_out_of_the_error_test(self, tolerance: float) -> None:
        """Index 2 with the multipliers' tolerances as tight as the others."""
        options = SolverOptions(tolerance, tolerance)
        tuning = IdaTuning(suppress_algebraic=True)
        with ida_native.open_session(pendulum(), options, 0.0, *PENDULUM_START, tuning=tuning) as session:
            end = session.advance(1.0)
            assert end.status is Status.REACHED
            x, z, u, w, force, _ = end.y
            assert abs(math.hypot(x, z) - 1.0) < 10 * tolerance
            assert abs(x * u + z * w) < 100 * tolerance
            assert_allclose(0.5 * (u * u + w * w) + GRAVITY * z, 0.0, atol=2e3 * tolerance)
            assert_allclose(force, u * u + w * w - GRAVITY * z, rtol=max(1e3 * tolerance, 1e-4))
            assert session.statistics.steps < 2000

    def test_the_chosen_newton_coefficient_saves_steps_with_multipliers(self) -> None:
        options = SolverOptions(1e-8, np.array([1e-8] * 4 + [1e3] * 2))
        steps = []
        for tuning in (AS_SUNDAE, None):
            session = ida_native.open_session(pendulum(), options, 0.0, *PENDULUM_START, tuning=tuning)
            session.advance(2.0)
            steps.append((session.statistics.steps, session.statistics.residual_evaluations))
        assert steps[1][0] < 0.75 * steps[0][0]
        assert steps[1][1] < 1.1 * steps[0][1]

    @pytest.mark.parametrize("form", ["reduced", "dae"])
    def test_younger_jacobians_reach_the_same_error_with_fewer_residuals(self, form: str) -> None:
        prepared = prepare(DoublePendulum(), form)
        plan, n = prepared.plan, len(prepared.q)
        start = packed(prepared, prepared.q, prepared.u)

        def states(rtol: float, tuning: IdaTuning | None) -> tuple[Any, int]:
            options = SolverOptions(rtol, plan.tolerances(rtol, {}), horizon=5.0)
            with ida_native.open_session(plan.problem(), options, 0.0, *start, tuning=tuning) as session:
                found = [session.advance(float(t)).y[:n] for t in np.linspace(0.25, 5.0, 20)]
                return np.array(found), session.statistics.residual_evaluations

        exact, _ = states(1e-13, None)
        as_ida = IdaTuning(least_growth=2.0, jacobian_age=0.25)
        cost = []
        for tuning in (as_ida, None):
            found = [states(float(rtol), tuning) for rtol in np.geomspace(1e-4, 1e-9, 16)]
            errors = [np.sqrt(np.mean((y - exact) ** 2)) for y, _ in found]
            fit = np.polyfit(np.log(errors), np.log([count for _, count in found]), 1)
            cost.append(np.polyval(fit, np.log(1e-5)))
        assert np.exp(cost[1] - cost[0]) < 0.85

    @pytest.mark.parametrize("weights", ["constant", "python", "native"])
    def test_an_angle_that_goes_round_keeps_its_accuracy(self, weights: str) -> None:
        """Far away from zero the same motion must come out, but for the rounding of the angle itself."""
        record = Record()
        problem = turning()
        if weights == "native":
            problem = with_c_functions(problem, record, weights=True)
        options = SolverOptions(1e-7, 1e-9)
        tuning = IdaTuning(angle_like=(0, 1) if weights == "constant" else (0,), angle_size=np.float64(1.0))
        turns = 2 * math.pi * 1e4

        def end(start: float, tuning: IdaTuning) -> tuple[float, int]:
            session = ida_native.open_session(
                problem, options, 0.0, np.array([start, 3.0]), np.array([3.0, 0.0]), tuning=tuning
            )
            done = session.advance(10.0)
            assert done.status is Status.REACHED
            return done.y[0] - start, session.statistics.steps

        near, steps = end(0.0, tuning)
        far, far_steps = end(turns, tuning)
        lost, _ = end(turns, IdaTuning())
        assert abs(far - near) < 1e-5
        assert abs(far_steps - steps) < 0.05 * steps
        assert abs(lost - near) > 100 * abs(far - near)
        assert record.error is None

    def test_nothing_is_asked_beyond_the_stop_time(self) -> None:
        seen: list[float] = []

        def residual(t: float, y: Any, yp: Any) -> Any:
            seen.append(t)
            return yp[0] - y[1], yp[1] + y[0]

        problem = replace(oscillator(), residual=residual)
        start = np.array([1.0, 0]), np.array([0, -1.0])
        session = ida_native.open_session(problem, TIGHT, 0.0, *start, tuning=IdaTuning(stop_time=1.5))
        session.advance(1.0)
        end = session.advance(1.5)
        assert (end.status, end.t) == (Status.REACHED, 1.5)
        assert_allclose(end.y[0], math.cos(1.5), atol=1e-7)
        assert max(seen) <= 1.5
        with pytest.raises(UsageError, match="must stop"):
            session.advance(1.6)
        session.reinitialize(1.2, np.array([1.0, 0]), np.array([0, -1.0]))
        session.advance(1.5)
        assert max(seen) <= 1.5

    @pytest.mark.parametrize(
        "change",
        [
            {"newton_coefficient": 0.0},
            {"least_growth": 1.0},
            {"jacobian_age": 1.0},
            {"angle_size": -1.0},
            {"stop_time": math.nan},
            {"angle_like": (2,)},
        ],
    )
    def test_bad_tuning_is_refused(self, change: dict[str, Any]) -> None:
        with pytest.raises(UsageError):
            ida_native.open_session(
                oscillator(), TIGHT, 0.0, np.array([1.0, 0]), np.array([0, -1.0]), tuning=IdaTuning(**change)
            )


class TestCompiled:
    def test_missing_values_are_counted_and_explained(self) -> None:
        """A wall at x = 0.5 that C functions can only report by a number."""

        def residual(t: float, y: Any, yp: Any) -> Any:
            return yp[0] - y[1], yp[1] + (y[0] if y[0] > 0.5 else math.nan)

        record = Record()
        problem = with_c_functions(replace(oscillator(), residual=residual), record)
        session = ida_native.open_session(problem, TIGHT, 0.0, np.array([1.0, 0]), np.array([0, -1.0]))
        end = session.advance(3.0)
        assert end.status is Status.FAILED
        assert session.statistics.undefined_values == record.undefined > 0
        assert_allclose(end.t, math.pi / 3, atol=1e-3)
        assert_allclose(end.y[0], math.cos(end.t), atol=1e-6)
        assert "the residual of equation 1 is nan" in end.message
        assert end.equation == 1

    def test_machine_code_runs_without_the_interpreter(self) -> None:
        """The residual waits for another Python thread, which can only run if IDA does not hold it up."""
        compiled, keep = _machine_code()
        flags = np.zeros(3, dtype=np.int64)  # has begun, may go on, gave up
        problem = replace(
            oscillator(), native=lambda _: NativeCallbacks(*compiled, user_data=flags.ctypes.data, keep=keep)
        )
        start = np.array([1.0, 0]), np.array([0, -1.0])
        session = ida_native.open_session(problem, TIGHT, 0.0, *start, tuning=AS_SUNDAE)

        def release() -> None:
            while not flags[0]:
                pass
            flags[1] = 1

        helper = threading.Thread(target=release)
        helper.start()
        end = session.advance(5.0)
        helper.join()
        assert flags[2] == 0
        reference = scikit_sundae.open_session(oscillator(), TIGHT, 0.0, np.array([1.0, 0]), np.array([0, -1.0]))
        assert_allclose(end.y, reference.advance(5.0).y, rtol=1e-12)
        assert session.statistics.steps == reference.statistics.steps

    @pytest.mark.parametrize("polled", [False, True])
    @pytest.mark.parametrize("compiled", [False, True])
    @pytest.mark.parametrize("watched", [False, True])
    def test_what_is_read_from_a_step_is_what_single_advances_give(
        self, polled: bool, compiled: bool, watched: bool
    ) -> None:
        """Many outputs lie in one step: they are read at once, up to what may stop the run between them."""
        events = {"events": lambda t, y, yp: (y[0], y[1] - 0.9), "event_count": 2, "event_directions": (0, 1)}
        plain = oscillator(**(events if watched else {}))
        problem = with_c_functions(plain, Record()) if compiled else plain
        times, found, advances = np.linspace(0.0, 9.0, 2001).tolist(), [], []
        for reads in (False, True):
            session = ida_native.open_session(problem, TIGHT, 0.0, np.array([1.0, 0]), np.array([0, -1.0]))
            session.budget = Budget(poll=lambda t: None) if polled else Budget()
            states, done, asked = [], 0, 0
            while done < len(times):
                end, asked = session.advance(times[done]), asked + 1
                states.append((end.t, end.events if end.status is Status.EVENT else (), *end.y))
                if end.status is Status.EVENT:
                    session.reinitialize(end.t, end.y, end.yp)
                    continue
                done += 1
                rows = session.read_on(times, done, len(times)) if reads else []
                states += [(t, (), *row) for t, row in zip(times[done:], rows, strict=False)]
                done += len(rows)
            found.append(states)
            advances.append(asked)
            assert session.read_on(times, len(times), len(times)).shape == (0, 2)
        assert found[0] == found[1]
        assert len(found[0]) == 2001 + watched * 4
        assert advances[0] == len(found[0])
        assert advances[1] < 0.5 * advances[0]

    def test_what_is_read_changes_nothing_of_what_follows(self) -> None:
        """A state that is handed in after some have been read is taken up, and a closed session reads nothing."""
        sessions = [ida_native.open_session(oscillator(), TIGHT, 0.0, *OSCILLATOR_START) for _ in range(2)]
        for session in sessions:
            end = session.advance(1.0)
            session.reinitialize(end.t, 2.0 * end.y, 2.0 * end.yp)
            session.advance(1.2)
        times = np.linspace(1.2, 1.3, 1001).tolist()
        assert 0 < len(sessions[1].read_on(times, 1, 1001)) < 1000
        assert_array_equal(*(one.advance(2.0).y for one in sessions))
        assert sessions[0].statistics.steps == sessions[1].statistics.steps
        with sessions[1], pytest.raises(UsageError, match="cannot advance"):
            sessions[1].advance(1.5)
        with pytest.raises(UsageError, match="closed"):
            sessions[1].read_on([3.0], 0, 1)

    @pytest.mark.parametrize("polled", [False, True])
    @pytest.mark.parametrize("outputs", [2, 7, 200])
    def test_compiled_events_are_the_same_events(self, polled: bool, outputs: int) -> None:
        """IDA says in which steps something happens; the answers are those of looking at every step."""
        options = SolverOptions(1e-6, 1e-8)
        events = {
            "events": lambda t, y, yp: (y[0], y[1] - 0.9, y[0] - 0.3, y[0] + 0.1, 1.0),
            "event_count": 5,
            "event_directions": (0, 1, -1, 0, 0),
        }
        plain = oscillator(**events)
        found: list[list[Any]] = []
        evaluations = []
        for problem in (plain, with_c_functions(plain, Record())):
            session = ida_native.open_session(problem, options, 0.0, np.array([1.0, 0]), np.array([0, -1.0]))
            session.budget = Budget(poll=lambda t: None) if polled else Budget()
            ends = []
            for t in np.linspace(0.0, 15.0, outputs):
                while (end := session.advance(t)).status is Status.EVENT:
                    ends.append((end.t, end.events, *end.y))
                    if len(ends) % 4 == 0:
                        session.reinitialize(end.t, end.y, end.yp)
                assert (end.status, end.t) == (Status.REACHED, t)
            found.append(ends)
            evaluations.append(session.statistics.event_evaluations)
        assert [end[1] for end in found[0]] == [end[1] for end in found[1]]
        assert_allclose([end[0] for end in found[0]], [end[0] for end in found[1]], rtol=1e-12)
        assert len(found[0]) > 14
        if not polled and outputs == 2:
            assert evaluations[1] < 0.9 * evaluations[0]

    def test_a_compiled_event_without_a_value_ends_the_run(self) -> None:
        plain = oscillator(events=lambda t, y, yp: (math.nan if t > 1.0 else 1.0,), event_count=1)
        session = ida_native.open_session(
            with_c_functions(plain, Record()), TIGHT, 0.0, np.array([1.0, 0]), np.array([0, -1.0])
        )
        end = session.advance(5.0)
        assert end.status is Status.FAILED
        assert "event function" in end.message


def _machine_code() -> tuple[tuple[int, int], object]:
    """Compile an oscillator's residual, which waits for a flag, and its Jacobian."""
    binding = pytest.importorskip("llvmlite.binding")
    wide = sundials_library.library().index_type is ctypes.c_int64
    content = "{ i64, i64, ptr }" if wide else "{ i32, i32, ptr }"  # of a vector and of a dense matrix
    text = f"""
    define ptr @data(ptr %object, i64 %which) {{
      %content = load ptr, ptr %object
      %place = getelementptr {content}, ptr %content, i32 0, i32 2
      %data = load ptr, ptr %place
      %there = getelementptr double, ptr %data, i64 %which
      ret ptr %there
    }}
    define i32 @residual(double %t, ptr %y, ptr %yp, ptr %out, ptr %flags) {{
    start:
      store volatile i64 1, ptr %flags
      %go = getelementptr i64, ptr %flags, i64 1
      br label %wait
    wait:
      %count = phi i64 [ 0, %start ], [ %next, %again ]
      %flag = load volatile i64, ptr %go
      %may = icmp ne i64 %flag, 0
      br i1 %may, label %work, label %again
    again:
      %next = add i64 %count, 1
      %late = icmp sgt i64 %next, 3000000000
      br i1 %late, label %giveup, label %wait
    giveup:
      %place = getelementptr i64, ptr %flags, i64 2
      store volatile i64 1, ptr %place
      br label %work
    work:
      %y0p = call ptr @data(ptr %y, i64 0)
      %y1p = call ptr @data(ptr %y, i64 1)
      %d0p = call ptr @data(ptr %yp, i64 0)
      %d1p = call ptr @data(ptr %yp, i64 1)
      %r0p = call ptr @data(ptr %out, i64 0)
      %r1p = call ptr @data(ptr %out, i64 1)
      %y0 = load double, ptr %y0p
      %y1 = load double, ptr %y1p
      %d0 = load double, ptr %d0p
      %d1 = load double, ptr %d1p
      %r0 = fsub double %d0, %y1
      %r1 = fadd double %d1, %y0
      store double %r0, ptr %r0p
      store double %r1, ptr %r1p
      ret i32 0
    }}
    define i32 @jacobian(double %t, double %cj, ptr %y, ptr %yp, ptr %r, ptr %j, ptr %u, ptr %a, ptr %b, ptr %c) {{
      %p0 = call ptr @data(ptr %j, i64 0)
      %p1 = call ptr @data(ptr %j, i64 1)
      %p2 = call ptr @data(ptr %j, i64 2)
      %p3 = call ptr @data(ptr %j, i64 3)
      store double %cj, ptr %p0
      store double 1.0, ptr %p1
      store double -1.0, ptr %p2
      store double %cj, ptr %p3
      ret i32 0
    }}
    """
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    try:
        module = binding.parse_assembly(text)
    except RuntimeError:
        pytest.skip("this LLVM knows no opaque pointers")
    machine = binding.Target.from_default_triple().create_target_machine()
    engine = binding.create_mcjit_compiler(module, machine)
    engine.finalize_object()
    return (engine.get_function_address("residual"), engine.get_function_address("jacobian")), (engine, machine)


class TestLife:
    def open(self, k: float = 1.0, **more: Any) -> NativeSession:
        return ida_native.open_session(oscillator(), TIGHT, 0.0, np.array([k, 0]), np.array([0, -k]), **more)

    def test_what_nobody_uses_is_freed_with_the_next_and_not_in_a_finalizer(self) -> None:
        """Whatever a finalizer raises is lost, Ctrl-C too."""
        gc.collect()  # sessions of other tests
        memory._free_dead()
        freed: list[int] = []
        session = self.open()
        parts, before = session._memory._parts, len(memory._graves)
        free = parts.free
        parts.free = lambda: (freed.append(1), free())[1]  # type: ignore[method-assign]
        gone = weakref.ref(session._memory)
        del session
        gc.collect()
        assert gone() is None
        assert not freed
        with self.open():
            assert freed == [1]
            assert len(memory._graves) == before
        memory._free_dead()
        assert freed == [1]

    def test_closing(self) -> None:
        with self.open() as session:
            session.advance(1.0)
            before = session.statistics
        assert session.statistics == before
        session.close()
        assert session.statistics == before
        for use in (
            lambda: session.advance(2.0),
            lambda: session.reinitialize(1.0, np.zeros(2), np.zeros(2)),
            lambda: session.counts,
        ):
            with pytest.raises(UsageError, match="closed"):
                use()

    def test_a_session_goes_with_its_last_reference(self) -> None:
        session = self.open()
        session.advance(1.0)
        gone = weakref.ref(session._memory)
        gc.disable()
        try:
            del session
            assert gone() is None
        finally:
            gc.enable()

    @pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc")
    def test_thousands_of_sessions_leave_nothing_behind(self) -> None:
        problem, y, yp = chain(80)

        def some(count: int) -> None:
            for k in range(count):
                self.open().advance(0.01)
                if k % 20 == 0:
                    sparse = ida_native.open_session(problem, TIGHT, 0.0, y, yp)
                    for _ in range(k % 3):
                        sparse.advance(1e-6)
                        sparse.reinitialize(0.0, y, yp)

        some(300)
        before = resident_kilobytes()
        some(3000)
        # Kept sessions would take 30 megabytes, their sparse factors 15; the allocator's own share strays by a few.
        assert resident_kilobytes() - before < 20000

    def test_a_sparse_session_goes_on_from_other_states(self) -> None:
        problem, y, yp = chain(80)
        session = ida_native.open_session(problem, TIGHT, 0.0, y, yp)
        expected = session.advance(0.02).y
        for k in range(1, 20):
            session.reinitialize(0.0, k * y, k * yp)
            assert_allclose(session.advance(0.02).y / k, expected, rtol=1e-6)

    def test_a_sparse_session_that_never_had_a_matrix_can_be_closed(self) -> None:
        problem, y, yp = chain(80)
        ida_native.open_session(problem, TIGHT, 0.0, y, yp).close()
        wall = replace(problem, residual=lambda t, y, yp: np.full(80, math.nan))
        with ida_native.open_session(wall, TIGHT, 0.0, y, yp) as session:
            assert session.advance(1.0).status is Status.FAILED

    @pytest.mark.parametrize("linear_solver", ["dense", "sparse"])
    def test_threads_give_the_same_answers(self, linear_solver: Any) -> None:
        problem, y, yp = chain(40)
        options = replace(TIGHT, linear_solver=linear_solver)
        expected = ida_native.open_session(problem, options, 0.0, y, yp).advance(0.05).y
        ends: list[Any] = []

        def work() -> None:
            for _ in range(3):
                with ida_native.open_session(problem, options, 0.0, y, yp) as session:
                    ends.append(session.advance(0.05).y)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(ends) == 12
        for end in ends:
            assert_array_equal(end, expected)

    def test_restarts_count_on(self) -> None:
        session = self.open()
        total = 0
        for k in range(5):
            end = session.advance(k + 1.0)
            total += session.counts.steps
            session.reinitialize(end.t, end.y, end.yp)
        assert session.statistics.steps == total
        assert session.statistics.reinitializations == 5
        assert_allclose(session.advance(6.0).y[0], math.cos(6.0), atol=1e-6)

    def test_ctrl_c_has_its_own_handler_back(self) -> None:
        before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
        try:
            self.open().advance(1.0)
            assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        finally:
            signal.signal(signal.SIGINT, before)

    def test_an_interrupt_that_is_ignored_stays_ignored(self) -> None:
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            self.open().advance(1.0)
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        finally:
            signal.signal(signal.SIGINT, before)
