"""Sweeps elsewhere and with a store: the same bits, nothing lost, and gone on with."""

import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from atwood import AtwoodError, Scene, Sweep, UsageError, sweep
from atwood.study.sweeps import pieces
from atwood_library import Ground, PointMass, Rod
from atwood_library.scenes import DoublePendulum

STARTS = {"start": {"rod1.angle": np.linspace(0.1, 1.5, 300)}, "t_end": 3.0, "rtol": 1e-10}


class Deadly(PointMass):
    """A mass that ends its process where it is 13 kg, the first times or always."""

    def check_values(self) -> None:
        super().check_values()
        is_child = os.getpid() != int(os.environ.get("ATWOOD_TEST_PARENT", os.getpid()))
        flag = os.environ.get("ATWOOD_TEST_DIED", "")  # a file that is there once it has ended a process
        if self.mass == 13.0 and is_child and not (flag and Path(flag).exists()):
            if flag:
                Path(flag).write_text("")
            os.kill(os.getpid(), signal.SIGKILL)


def deadly() -> Scene:
    scene = Scene()
    ground, rod = scene.add("ground", Ground()), scene.add("rod", Rod(length=1.0))
    bob = scene.add("bob", Deadly(mass=1.0))
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.start["rod.angle"] = 0.4
    return scene


def assert_same(one: Sweep, other: Sweep) -> None:
    assert one.status == other.status
    assert_array_equal(one.steps, other.steps)
    for path in one.paths:
        assert_array_equal(one[path], other[path])


class Plain:
    """No executor of `concurrent.futures`, but one that takes work."""

    def __init__(self) -> None:
        self.pieces = 0

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.pieces += 1
        future.set_result(function(*arguments))
        return future


@pytest.fixture
def parent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ATWOOD_TEST_PARENT", str(os.getpid()))


def test_whatever_takes_work_is_an_executor() -> None:
    alone, plain = sweep(DoublePendulum(), **STARTS, threads=1), Plain()
    assert_same(alone, sweep(DoublePendulum(), **STARTS, executor=plain))
    assert 1 < plain.pieces < 16
    with ThreadPoolExecutor(2) as pool:
        assert_same(alone, sweep(DoublePendulum(), **STARTS, executor=pool))
    for bad in (3, Plain, object()):
        with pytest.raises(UsageError, match="executor"):
            sweep(DoublePendulum(), **STARTS, executor=bad)
    with pytest.raises(UsageError, match="takes no work"):
        sweep(DoublePendulum(), **STARTS, executor=pool)  # it is shut down


def test_conditions_go_along_to_an_executor() -> None:
    options = {"start": {"rod1.angle": [0.5, 1.0]}, "t_end": 3.0, "until": "rod1.angle crosses 0"}
    alone = sweep(DoublePendulum(), **options)
    assert alone.status == ("stopped", "stopped")
    assert_same(alone, sweep(DoublePendulum(), **options, executor=Plain()))


def test_a_piece_whose_first_runs_cannot_be_assembled_fails_as_by_itself() -> None:
    options = {"vary": {"bob.mass": [1.0, *[2.0] * 70]}, "start": {"rod.angle": [0.1] * 71}, "combine": "list"}
    assert_same(sweep(deadly(), **options, t_end=0.1), sweep(deadly(), **options, t_end=0.1, executor=Plain()))


def test_what_a_dead_worker_had_is_made_by_another_one(
    tmp_path: Path, parent: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ATWOOD_TEST_DIED", str(tmp_path / "died"))
    masses = [*np.linspace(1.0, 2.0, 150), 13.0, *np.linspace(2.0, 3.0, 50)]
    options = {"vary": {"bob.mass": masses}, "t_end": 0.1}
    alone = sweep(deadly(), **options)
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        found = sweep(deadly(), **options, executor=pool)
    assert (tmp_path / "died").exists()
    assert_same(alone, found)


def test_a_run_that_ends_every_worker_fails_and_no_other(parent: None) -> None:
    masses = [*np.linspace(1.0, 2.0, 20), 13.0, *np.linspace(2.0, 3.0, 10)]
    with ProcessPoolExecutor(1, mp_context=get_context("fork")) as pool:
        found = sweep(deadly(), {"bob.mass": masses}, t_end=0.1, executor=pool)
    assert found.failed == (20,)
    assert "worker that had it died" in found.messages[20]


class Elsewhere(Plain):
    """Work is done where a module cannot be imported."""

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        there = sys.modules.pop(__name__)
        sys.modules[__name__] = None  # type: ignore[assignment]
        try:
            return super().submit(function, *arguments)
        finally:
            sys.modules[__name__] = there


def test_a_worker_without_the_components_is_told(parent: None) -> None:
    with pytest.raises(UsageError, match="a worker lacks what the scene is made of"):
        sweep(deadly(), {"bob.mass": [1.0, 2.0]}, t_end=0.1, executor=Elsewhere())


# -- stores ------------------------------------------------------------------------------------------------------------


class Cut(Plain):
    """It is cut off after some pieces."""

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        if self.pieces == 6:
            raise KeyboardInterrupt
        return super().submit(function, *arguments)


def test_what_was_cut_off_goes_on_to_the_same_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pieces, "_LEAST_SECONDS", 0.0)
    whole, store = sweep(DoublePendulum(), **STARTS), tmp_path / "runs"
    cut = sweep(DoublePendulum(), **STARTS, store=store, executor=Cut())
    left = cut.status.count("interrupted")
    assert 0 < left < 300
    done: list[int] = []
    again = sweep(DoublePendulum(), **STARTS, store=store, progress=lambda now, of: done.append(now))
    assert_same(whole, again)
    assert done[0] >= 300 - left
    assert done[-1] == 300
    before = {one.name: one.stat().st_mtime_ns for one in store.glob("runs-*")}
    assert_same(whole, sweep(DoublePendulum(), **STARTS, store=store))
    assert before == {one.name: one.stat().st_mtime_ns for one in store.glob("runs-*")}


def test_a_store_is_read_from_disk_as_it_is_needed(tmp_path: Path) -> None:
    found = sweep(DoublePendulum(), **STARTS, store=tmp_path)
    assert isinstance(found["rod1.angle"], np.memmap)
    pytest.importorskip("xarray")
    data = found.to_xarray()["rod1.angle"]
    assert np.shares_memory(data.values, found["rod1.angle"])
    assert_array_equal(data.values.ravel(), found.end("rod1.angle"))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"t_end": 0.4}, "t_end"),
        ({"start": {"rod1.angle": np.linspace(0.1, 1.6, 300)}}, "rod1.angle"),
        ({"quantities": ["bob2.position.x"]}, "quantities"),
        ({"rtol": 1e-9}, "rtol"),
        ({"outputs": 3}, "outputs"),
        ({"until": "rod1.angle crosses 0"}, "condition"),
        ({"scene": DoublePendulum(mass1=2.0)}, "scene"),
    ],
)
def test_the_store_of_another_sweep_is_refused(tmp_path: Path, changed: dict[str, Any], said: str) -> None:
    scene = DoublePendulum()
    options = STARTS | {"start": {"rod1.angle": np.linspace(0.1, 1.5, 3)}}
    sweep(scene, **options, store=tmp_path)
    with pytest.raises(UsageError, match=said):
        sweep(**({"scene": scene} | options | changed), store=tmp_path)


def test_folders_that_are_no_store_are_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    options = {"start": {"rod1.angle": [0.1, 0.2]}, "t_end": 0.1}
    for folder in (tmp_path, tmp_path / "notes.txt"):
        with pytest.raises(AtwoodError, match=str(folder.name)):
            sweep(DoublePendulum(), **options, store=folder)
    store = tmp_path / "runs"
    found = sweep(DoublePendulum(), **options, store=store)
    found.quantities["rod1.angle"][0] += 1e-9  # on disk
    with pytest.raises(UsageError, match="not those that were written"):
        sweep(DoublePendulum(), **options, store=store)
    for one in store.glob("runs-*"):
        one.write_bytes(one.read_bytes()[:50])
    with pytest.raises(UsageError, match="made again"):
        sweep(DoublePendulum(), **options, store=store)
