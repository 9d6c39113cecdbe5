"""IDA goes through outputs by itself, compiled, and stops where anything but their values is wanted."""

from __future__ import annotations

import ctypes
import gc
import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from atwood import Model, Result, SolveError, simulate
from atwood.integrators.ida import library as sundials_library, memory, native
from atwood.integrators.ida.memory import IdaMemory
from atwood.integrators.ida.native import NativeSession
from atwood.integrators.protocol import StepResult
from atwood_library.scenes import Bricard, DoublePendulum, FlyballGovernor, FourBar, SliderCrank

pytestmark = pytest.mark.skipif(not sundials_library.available(), reason=sundials_library.why_not() or "available")


@pytest.fixture
def advances(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The times that were asked for one by one."""
    asked: list[float] = []
    first = NativeSession.advance

    def counted(self: NativeSession, t_out: float) -> StepResult:
        asked.append(t_out)
        return first(self, t_out)

    monkeypatch.setattr(NativeSession, "advance", counted)
    return asked


def singular() -> Model:
    """A crank as long as its rod, which passes the position at which both lie in line with the slider."""
    return SliderCrank(crank_length=1.0, rod_length=1.0)


SCENES: dict[str, tuple[Callable[[], Model], dict[str, Any]]] = {
    "four-bar": (FourBar, {"solver": "ida"}),
    "four-bar in dae form": (FourBar, {"form": "dae", "solver": "ida"}),
    "slider-crank": (SliderCrank, {"t_end": 2.0, "rtol": 1e-5, "solver": "ida"}),
    "singular positions": (singular, {"t_end": 2.0, "form": "dae", "solver": "ida"}),
    "in space": (Bricard, {"t_end": 1.0, "solver": "ida"}),
    "a tree": (DoublePendulum, {"solver": "ida"}),
    "orientations": (FlyballGovernor, {"form": "dae"}),
    "with a limit": (FourBar, {"max_step": 1e-3, "form": "dae", "solver": "ida"}),
}


def made(name: str) -> Result:
    make, options = SCENES[name]
    return simulate(make(), **({"t_end": 1.0} | options))


def same(one: Result, other: Result) -> None:
    for path in [path for path in one.paths if path.endswith((".angle", ".position.x", ".tension"))]:
        assert_array_equal(one[path], other[path], err_msg=path)
    assert one.statistics.steps == other.statistics.steps
    assert one.statistics.residual_evaluations == other.statistics.residual_evaluations
    assert len(one.singular_crossings) == len(other.singular_crossings)
    assert (one.status, one.message) == (other.status, other.message)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("chunk", [1, 7, 500])
def test_filled_tables_are_what_single_advances_give(name: str, chunk: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """However few steps IDA is left alone for."""
    with monkeypatch.context() as patched:
        patched.setattr(NativeSession, "read_on", lambda self, times, first, past: np.empty((0, self._problem.size)))
        expected = made(name)
    monkeypatch.setattr(native, "first_chunk", lambda size: chunk)
    monkeypatch.setattr(native.Watchdog, "learn", lambda *_: None)
    same(made(name), expected)


def test_few_outputs_are_asked_for_one_by_one(advances: list[float]) -> None:
    result = simulate(FourBar(), form="dae", solver="ida", t_end=1.0, outputs=2001)
    assert len(result.time) == 2001
    assert len(advances) < 40


@pytest.mark.parametrize("steps", [5, 40, 77])
def test_a_limit_of_steps_is_kept_to_the_step(steps: int) -> None:
    result = simulate(FourBar(), form="dae", solver="ida", t_end=1.0, max_steps=steps)
    assert (result.status, result.statistics.steps) == ("step_limit", steps)


def test_where_it_fails_what_came_before_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """A table whose later rows are not finite ends where they begin."""
    fill = IdaMemory.fill

    def broken(self: IdaMemory, step_monitor: Any) -> Any:
        go = fill(self, step_monitor)

        def gone(times: Any, table: Any, filled: int, allowed: int) -> tuple[int, float, int]:
            flag, t, count = go(times, table, filled, allowed)
            table[times > 0.5] = np.nan
            return flag, t, count

        return gone

    expected = simulate(FourBar(), form="dae", solver="ida", t_end=1.0)
    monkeypatch.setattr(IdaMemory, "fill", broken)
    with pytest.raises(SolveError, match="no longer finite") as caught:
        simulate(FourBar(), form="dae", solver="ida", t_end=1.0)
    before: Result = Result(caught.value.run)  # type: ignore[attr-defined]
    count = len(before.time)
    assert before.time[-1] == pytest.approx(0.5, abs=0.006)
    assert_array_equal(before["crank.angle"], expected["crank.angle"][:count])


def test_what_machine_code_writes_to_lives_as_long_as_the_session(monkeypatch: pytest.MonkeyPatch) -> None:
    """An address alone keeps nothing: what was freed would be written to, and whatever stands there then."""
    taken: list[weakref.ref[Any]] = []
    open_fill, address = IdaMemory.fill, ctypes.addressof

    def watched(self: IdaMemory, step_monitor: Any) -> Any:
        def noted(one: Any) -> int:
            taken.append(weakref.ref(one))
            return address(one)

        with monkeypatch.context() as patch:
            patch.setattr(memory.ctypes, "addressof", noted)
            go = open_fill(self, step_monitor)
        gc.collect()
        assert all(one() is not None for one in taken)
        return go

    monkeypatch.setattr(IdaMemory, "fill", watched)
    simulate(FourBar(), solver="ida", t_end=0.2)
    assert len(taken) >= 3
