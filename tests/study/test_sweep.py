"""Sweeps: the same answers as runs one by one, whatever way they are made; nothing is lost, nothing compiles twice."""

import csv
import json
import subprocess
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.io import netcdf_file

from atwood import (
    ParameterError,
    ResultError,
    Scene,
    StartError,
    UsageError,
    assemble,
    simulate,
    sweep,
)
from atwood.simulation.problem.options import RunOptions
from atwood.study.sweeps import batch as sweep_batch, runs as sweep_runs
from atwood.study.sweeps.cases import make_cases
from atwood_library import Damper, Ground, PointMass, Rod, Rope, Spring
from atwood_library.scenes import SCENES, Chain, DoublePendulum, FourBar, SliderCrank


def one_by_one(monkeypatch: pytest.MonkeyPatch, *arguments: Any, **options: Any) -> Any:
    """Return a sweep all of whose runs are made by themselves."""
    with monkeypatch.context() as patch:
        patch.setattr(sys.modules["atwood.study.sweeps.pieces"], "why_not_batched", lambda order: "a test wants it so")
        found = sweep(*arguments, **options)
    assert found.statistics.batched == 0
    return found


def assert_same(batched: Any, single: Any, tolerance: float = 1e-12) -> None:
    """Check that all runs of a sweep were made many at a time, and equal those of another sweep."""
    assert batched.statistics.batched == len(batched) == len(single)
    assert batched.status == single.status
    assert_array_equal(batched.steps, single.steps)
    assert_allclose(batched.end_time, single.end_time, rtol=1e-14)  # events are located to rounding
    for path in single.paths:
        assert_allclose(batched[path], single[path], rtol=tolerance, atol=tolerance * 20.0, err_msg=path)


RANDOM = np.random.default_rng(12).uniform(-1.5, 1.5, (4, 12))

CASES = {
    "starts": {"start": {"rod1.angle": RANDOM[0], "rod2.angle": RANDOM[1]}, "combine": "list"},
    "speeds": {"start": {"rod1.angle": RANDOM[0], "rod2.angular_velocity": 3.0 * RANDOM[1]}, "combine": "list"},
    "parts": {"vary": {"bob1.mass": [0.5, 1.0, 2.5], "rod2.length": ["30 cm", "1 m"]}},
    "bound": {
        "vary": {"length1": [0.5, 2.0], "mass2": [0.1, 3.0]},
        "start": {"rod1.angle": ["40 deg", 2.0]},
    },
    "gravity": {"vary": {"gravity": [1.6, 3.7, 9.8]}},
    "forces": {
        "vary": {"bob1.mass": [0.5, 2.0]},
        "start": {"rod1.angle": [0.3, 1.0]},
        "quantities": ["rod1.tension", "bob2"],
    },
    "outputs": {"vary": {"bob1.mass": [0.5, 2.0]}, "outputs": 7, "quantities": ["bob2", "rod1.tension"]},
}


LOOPS = {
    "speeds": (FourBar, {"start": {"crank.angular_velocity": [2.0, 5.0, 12.0]}}),
    "places": (FourBar, {"start": {"crank.angle": [0.1, 2.0, 6.0, -3.0]}}),
    "lengths": (FourBar, {"vary": {"coupler_length": [2.2, 2.5, 3.0]}, "outputs": 7, "quantities": ["rocker"]}),
    "forces": (FourBar, {"vary": {"crank.mass": [0.1, 0.3]}, "outputs": 5, "quantities": ["pivot1", "coupler"]}),
    "explicit": (FourBar, {"vary": {"crank.mass": [0.1, 0.3]}, "solver": "explicit"}),
    "slider": (SliderCrank, {"start": {"crank.angle": [0.2, 1.0, 2.5]}, "vary": {"piston.mass": [0.5, 2.0]}}),
}


@pytest.mark.parametrize("name", CASES)
def test_many_at_a_time_is_one_by_one(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    options = {"t_end": 1.0, "threads": 1, **CASES[name]}
    assert_same(sweep(DoublePendulum(), **options), one_by_one(monkeypatch, DoublePendulum(), **options))


def test_starts_that_are_no_coordinates(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = DoublePendulum()
    scene.start.clear()
    scene.guess["rod1.angle"] = 0.5
    options = {"start": {"bob1.position.x": [0.1, 0.4, 0.8]}, "t_end": 0.5, "threads": 1}
    assert_same(sweep(scene, **options), one_by_one(monkeypatch, scene, **options))


def test_each_run_is_that_of_simulate() -> None:
    found = sweep(DoublePendulum(), {"mass2": [0.5, 2.0]}, start={"rod1.angle": [0.3, 1.0]}, t_end=1.0, outputs=5)
    assert found.shape == (2, 2)
    for run in range(4):
        scene = DoublePendulum(mass2=found.parameters["mass2"][run])
        scene.start["rod1.angle"] = found.start["rod1.angle"][run]
        alone = simulate(scene, t_end=1.0, outputs=5)
        assert_array_equal(alone.time, found.time)
        assert_allclose(found["rod2.angle"][run], alone["rod2.angle"], rtol=1e-12, atol=1e-12)
        assert found.steps[run] == alone.statistics.steps


@pytest.mark.parametrize("scene", ["double-pendulum", "pendulum-on-cart", "chain", "mass-spring-chain"])
def test_scenes_of_the_library(scene: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made = SCENES[scene]()
    path = next(iter(assemble(made).flat.start or assemble(made).flat.guess), "")
    value = assemble(made).flat.start.get(path, 0.1)
    options = {"start": {path: [value, value + 1e-3]}, "t_end": 0.3, "threads": 1}
    found, single = sweep(made, **options), one_by_one(monkeypatch, made, **options)
    assert found.status == single.status
    for one in single.paths:
        assert_allclose(found[one], single[one], rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("name", LOOPS)
def test_closed_loops_that_formulas_solve(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, given = LOOPS[name]
    options = {"t_end": 1.0, "threads": 1, **given}
    assert_same(sweep(scene(), **options), one_by_one(monkeypatch, scene(), **options))


def test_closed_loops_near_a_dead_centre_are_made_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Crank and frame are together longer than coupler and rocker in some runs, which cannot turn fully."""
    options = {"vary": {"frame_length": [2.5, 3.6, 2.6]}, "t_end": 1.0, "threads": 1}
    found, single = sweep(FourBar(), **options), one_by_one(monkeypatch, FourBar(), **options)
    assert found.statistics.batched == 2
    assert found.status == single.status == ("finished",) * 3
    for path in single.paths:
        assert_allclose(found[path], single[path], rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("rtol", [1e-8, 1e-12])
def test_taylor_series_many_at_a_time(rtol: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Series are what ``"auto"`` takes at tight tolerances."""
    solver = "taylor" if rtol > 1e-10 else "auto"
    options = {**CASES["outputs"], "rtol": rtol, "solver": solver, "t_end": 1.0, "threads": 1}
    assert_same(sweep(DoublePendulum(), **options), one_by_one(monkeypatch, DoublePendulum(), **options))


def hanging(damping: float = 1.0) -> Scene:
    """Return a mass on a spring and a damper."""
    scene = Scene(t_end=2.0)
    ground, bob = scene.add("ground", Ground()), scene.add("bob", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=100.0, natural_length=1.0))
    damper = scene.add("damper", Damper(damping=damping))
    for part in (spring, damper):
        scene.connect(ground.frame, part.a)
        scene.connect(part.b, bob.point)
    scene.start.update({"bob.position.x": 0.3, "bob.position.z": -1.0, "bob.velocity.x": 0.0, "bob.velocity.z": 0.0})
    return scene


def far(space: str = "plane") -> Scene:
    """Return a mass on a spring that hangs a kilometre from the origin."""
    scene = Scene(t_end=1.0, space=space)
    ground, bob = scene.add("ground", Ground(position=(1e3, 0.0, 0.0))), scene.add("bob", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=100.0, natural_length=1.0))
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, bob.point)
    scene.start.update({"bob.position.x": 1e3, "bob.position.z": -1.0, "bob.velocity.x": 0.5, "bob.velocity.z": 0.0})
    return scene


@pytest.mark.parametrize("varied", [{"start": {"bob.position.z": [-0.8, -1.5]}}, {"vary": {"bob.mass": [0.5, 2.0]}}])
def test_far_from_the_origin(varied: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Positions are counted from where it hangs, and so are the sizes that tolerances are relative to."""
    options = {"outputs": 4, "threads": 1, **varied}
    assert_same(sweep(far(), **options), one_by_one(monkeypatch, far(), **options))


def test_damped_scenes_many_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    options = {"vary": {"damper.damping": [0.1, 1.0, 20.0]}, "outputs": 5, "threads": 1}
    assert_same(sweep(hanging(), **options), one_by_one(monkeypatch, hanging(), **options))


def test_stiff_runs_are_made_by_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    options = {"vary": {"damper.damping": [1.0, 1e5, 2.0]}, "threads": 1}
    found, single = sweep(hanging(), **options), one_by_one(monkeypatch, hanging(), **options)
    assert found.statistics.batched == 2
    assert found.status == single.status
    for path in single.paths:
        assert_allclose(found[path], single[path], rtol=1e-11, atol=1e-11)


def test_each_run_is_as_accurate_as_was_asked() -> None:
    """The reference is far more accurate; one of the runs is chaotic, and says what it reached."""
    options = {"start": {"rod1.angle": [0.2, 0.4]}, "t_end": 5.0, "quantities": ["rod1.angle", "rod2.angle"]}
    asked, exact = sweep(DoublePendulum(), accuracy=1e-7, **options), sweep(DoublePendulum(), rtol=1e-13, **options)
    assert "accuracy" in asked.statistics.why_single
    assert not asked.messages
    for path in exact.paths:
        assert np.max(np.abs(asked[path] - exact[path])) < 1e-6
    chaotic = sweep(DoublePendulum(), start={"rod1.angle": [2.5]}, t_end=60.0, accuracy=1e-9)
    assert chaotic.status == ("finished",)
    assert "was asked for" in chaotic.messages[0]


@pytest.mark.parametrize("scene", [DoublePendulum, FourBar])
def test_tolerances_below_rounding_are_said_once(scene: type[Scene]) -> None:
    with pytest.warns(UserWarning, match="below what rounding allows") as said:
        found = sweep(scene(), {"gravity": [1.6, 9.8]}, t_end=0.2, rtol=1e-17)
    least = sweep(scene(), {"gravity": [1.6, 9.8]}, t_end=0.2, rtol=1e-15)
    assert len(said) == 1
    assert_array_equal(found.steps, least.steps)


def test_threads_change_nothing() -> None:
    options = {**CASES["starts"], "t_end": 1.0}
    alone, together = (sweep(DoublePendulum(), **options, threads=n) for n in (1, 3))
    for path in alone.paths:
        assert_array_equal(alone[path], together[path])
    loops = [sweep(FourBar(), {"crank_length": [0.2, 0.25, 0.3]}, t_end=0.2, threads=n) for n in (1, 3)]
    assert [one.statistics.batched for one in loops] == [3, 3]
    for path in loops[0].paths:
        assert_array_equal(loops[0][path], loops[1][path])


def test_processes_change_nothing() -> None:
    options = {**CASES["bound"], "t_end": 0.5}
    alone = sweep(DoublePendulum(), **options, threads=1)
    with ProcessPoolExecutor(1) as pool:
        sent = sweep(DoublePendulum(), **options, executor=pool)
    for path in alone.paths:
        assert_array_equal(alone[path], sent[path])
    assert (sent.status, sent.statistics.batched) == (alone.status, len(alone))


@pytest.mark.parametrize("solver", ["explicit", "taylor", "ida"])
def test_threads_of_a_fresh_process(solver: str) -> None:
    """Code that two threads ask for at the same time for the first time is made once, and stays."""
    code = f"""
import sys
sys.path[:0] = {[entry for entry in sys.path if entry]!r}
from atwood import sweep
from atwood_library.scenes import DoublePendulum
found = sweep(DoublePendulum(), {{"mass1": [1.0, 1.5, 2.0, 2.5]}}, t_end=0.2, threads=4, solver={solver!r})
print(set(found.status))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout.strip()) == (0, "{'finished'}"), done.stderr


# -- combining -----------------------------------------------------------------------------------------------------


def test_a_grid_has_every_value_with_every_other() -> None:
    found = sweep(DoublePendulum(), {"mass1": [1.0, 2.0]}, start={"rod1.angle": ["10 deg", 0.5, 1.0]}, t_end=0.1)
    assert (len(found), found.shape) == (6, (2, 3))
    assert_array_equal(found.parameters["mass1"], [1, 1, 1, 2, 2, 2])
    assert_allclose(found.axis("rod1.angle"), [np.pi / 18, 0.5, 1.0])
    assert_array_equal(found.axis("mass1"), [1.0, 2.0])
    assert_array_equal(found.grid("rod2.angle"), found.end("rod2.angle").reshape(2, 3))
    assert found.units["mass1"] == "kg"
    assert found.units["rod1.angle"] == "rad"


def test_a_list_takes_values_together() -> None:
    found = sweep(DoublePendulum(), {"mass1": [1.0, 2.0]}, start={"rod1.angle": [0.5, 1.0]}, combine="list", t_end=0.1)
    assert found.shape == (2,)
    assert_array_equal(found.start["rod1.angle"], [0.5, 1.0])
    with pytest.raises(UsageError, match="differ in length: mass1 has 2, mass2 has 3"):
        sweep(DoublePendulum(), {"mass1": [1.0, 2.0], "mass2": [1.0, 2.0, 3.0]}, combine="list")


# -- bad input -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "kind", "message"),
    [
        ({"vary": {"mas1": [1.0]}}, ParameterError, "mass1"),
        ({"vary": {"bob3.mass": [1.0]}}, UsageError, "bob1"),
        ({"vary": {"mass1": ["1 m"]}}, ParameterError, "kg"),
        ({"vary": {"mass1": [-1.0]}}, ParameterError, "mass1"),
        ({"vary": {"mass1": 1.0}}, UsageError, "list of values"),
        ({"vary": {"mass1": []}}, UsageError, "no values"),
        ({"vary": {"mass1": np.ones((2, 2))}}, UsageError, "one dimension"),
        ({"vary": {"t_end": [1.0]}}, UsageError, "same for all runs"),
        ({"start": {"rod1.angel": [1.0]}}, StartError, "rod1.angle"),
        ({"start": {"rod1.angle": ["1 kg"]}}, StartError, "rad"),
        ({"vary": {"mass1": [1.0]}, "quantities": ["rod1.angel"]}, ResultError, "rod1.angle"),
        ({"vary": {"mass1": [1.0]}, "combine": "gird"}, UsageError, "grid"),
        ({"vary": {"mass1": [1.0]}, "threads": 0}, UsageError, "thread"),
        ({"vary": {"mass1": [1.0]}, "t_end": -1.0}, UsageError, "after the start"),
        ({"vary": {"mass1": [1.0]}, "solver": "explict"}, UsageError, "explicit"),
        ({"vary": {"mass1": [1.0]}, "solver": "gauss", "form": "dae"}, UsageError, "reduced form"),
        ({"vary": {"mass1": [1.0]}, "rtol": 2.0}, UsageError, "between 0 and 1"),
        ({"vary": {"mass1": [1.0]}, "rtol": 1e-6, "accuracy": 1e-6}, UsageError, "two things"),
        ({}, UsageError, "nothing is varied"),
    ],
)
def test_bad_input_is_said_at_once(given: Any, kind: Any, message: str) -> None:
    with pytest.raises(kind, match=message) as caught:
        sweep(DoublePendulum(), **given)
    assert message in f"{caught.value}"


def contradicting() -> Scene:
    """Return a pendulum whose start is fixed twice over."""
    scene = Scene()
    scene.add("ground", Ground())
    scene.add("rod", Rod(length=1.0))
    scene.add("bob", PointMass(mass=1.0))
    scene.connect(scene["ground"].frame, scene["rod"].a)
    scene.connect(scene["rod"].b, scene["bob"].point)
    scene.start["rod.angle"] = 0.0
    return scene


@pytest.mark.parametrize("solver", ["auto", "ida"])
def test_runs_that_fail_are_reported(solver: str) -> None:
    found = sweep(contradicting(), start={"bob.position.x": [0.0, 0.5, 0.0]}, t_end=0.2, solver=solver)
    assert found.status == ("finished", "failed", "finished")
    assert found.failed == (1,)
    assert "contradict" in found.messages[1]
    assert np.isnan(found["rod.angle"][1]).all()
    assert np.isfinite(found["rod.angle"][[0, 2]]).all()
    assert found.statistics.failed == 1


def test_limits_are_those_of_each_run() -> None:
    options = {"start": {"rod1.angle": [0.0, 2.0, 0.0]}, "t_end": 5.0, "solver": "explicit"}
    scene = DoublePendulum()
    scene.start["rod2.angle"] = 0.0
    free = sweep(scene, **options)
    found = sweep(scene, **options, max_steps=int(np.max(free.steps)) - 1)
    assert found.status == ("finished", "step_limit", "finished")
    assert_array_equal(np.isnan(found.end("rod1.angle")), [False, True, False])
    assert 0.0 < found.end_time[1] < 5.0
    assert "steps" in found.messages[1]


# -- structure -----------------------------------------------------------------------------------------------------


def test_values_that_shape_the_equations_are_assembled_anew() -> None:
    found = sweep(Chain(), {"links": [2, 3]}, start={"rod[0].angle": [0.1, 0.2]}, t_end=0.2)
    assert set(found.status) == {"finished"}
    assert set(found.statistics.reassembled.values()) == {"it has other parts"}
    assert len(found.statistics.reassembled) == 1  # the other run with three links takes what was made
    for run, links in enumerate((2, 2, 3, 3)):
        scene = Chain(links=links)
        scene.start["rod[0].angle"] = found.start["rod[0].angle"][run]
        alone = simulate(scene, t_end=0.2, outputs=2)
        assert_allclose(found.end("rod[0].angle")[run], alone.array("rod[0].angle")[-1], rtol=1e-10)


def test_a_mass_of_zero_is_another_scene() -> None:
    scene = contradicting()
    found = sweep(scene, {"rod.mass": [0.5, 0.0, 1.0]}, t_end=0.2, start={"rod.angle": [0.3]})
    assert set(found.status) == {"finished"}
    assert list(found.statistics.reassembled) == [1]
    assert "rod.mass" in found.statistics.reassembled[1]
    for run, mass in enumerate((0.5, 0.0, 1.0)):
        scene["rod"].mass = mass
        scene.start["rod.angle"] = 0.3
        assert_allclose(found.end("rod.angle")[run], simulate(scene, t_end=0.2).array("rod.angle")[-1], rtol=1e-9)


def test_events_and_modes() -> None:
    scene = Scene()
    scene.add("ground", Ground())
    scene.add("rope", Rope(length=1.0))
    scene.add("bob", PointMass(mass=1.0))
    scene.connect(scene["ground"].frame, scene["rope"].a)
    scene.connect(scene["rope"].b, scene["bob"].point)
    scene.start["bob.position.x"] = 0.0
    scene.start["bob.position.z"] = -1.0
    found = sweep(scene, start={"bob.velocity.x": [1.0, 5.5]}, t_end=1.0, quantities=["bob.position"])
    assert found.statistics.why_single
    for run, speed in enumerate((1.0, 5.5)):
        scene.start["bob.velocity.x"] = speed
        alone = simulate(scene, t_end=1.0, outputs=2)
        assert found.status[run] == alone.status
        assert_allclose(found.end("bob.position.z")[run], alone.array("bob.position.z")[-1], rtol=1e-9)


def test_the_dae_form() -> None:
    found = sweep(DoublePendulum(), {"mass1": [1.0, 2.0]}, t_end=0.3, form="dae", quantities=["rod1.tension"])
    assert found.statistics.why_single == "the dae form keeps constraints"
    reduced = sweep(DoublePendulum(), {"mass1": [1.0, 2.0]}, t_end=0.3, quantities=["rod1.tension"])
    assert_allclose(found["rod1.tension"], reduced["rod1.tension"], rtol=1e-5)


# -- interruption and progress -------------------------------------------------------------------------------------


def test_progress_counts_to_the_end() -> None:
    seen: list[tuple[int, int]] = []
    sweep(
        DoublePendulum(), start={"rod1.angle": RANDOM[0]}, t_end=0.2, progress=lambda done, of: seen.append((done, of))
    )
    assert seen[-1] == (12, 12)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


@pytest.mark.parametrize("threads", [1, 2])
def test_what_an_interruption_leaves_is_said(threads: int) -> None:
    def interrupt(done: int, of: int) -> None:
        raise KeyboardInterrupt

    found = sweep(
        FourBar(), {"crank_length": np.linspace(0.2, 0.3, 60)}, t_end=1.0, threads=threads, progress=interrupt
    )
    assert "finished" in found.status
    assert "interrupted" in found.status
    lost = [run for run, status in enumerate(found.status) if status == "interrupted"]
    assert np.isnan(found.end(found.paths[0])[lost]).all()
    assert threading.active_count() < 20


# -- files ---------------------------------------------------------------------------------------------------------


def made_for_files() -> Any:
    return sweep(contradicting(), start={"bob.position.x": [0.0, 0.5]}, t_end=0.2, outputs=3, quantities=["bob"])


def test_csv(tmp_path: Any) -> None:
    found = made_for_files()
    with found.save(tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    assert [row["status"] for row in rows] == ["finished"] * 3 + ["failed"] * 3
    assert float(rows[2]["bob.position.z [m]"]) == found["bob.position.z"][0, 2]
    assert rows[3]["bob.position.z [m]"] == ""


def test_json(tmp_path: Any) -> None:
    found = made_for_files()
    data = json.loads(found.save(tmp_path / "a.json").read_text())
    assert data["quantities"]["bob.position.z"][0] == found["bob.position.z"][0].tolist()
    assert data["quantities"]["bob.position.z"][1] == [None] * 3
    assert data["messages"]["1"] == found.messages[1]


def test_netcdf(tmp_path: Any) -> None:
    found = made_for_files()
    with netcdf_file(str(found.save(tmp_path / "a.nc")), mmap=False) as data:
        for path in found.paths:
            variable = data.variables[path]
            assert variable.dimensions == ("start.bob.position.x", "time")
            assert variable.units.decode() == found.units[path]
            assert_array_equal(variable[:], found[path])
        assert_array_equal(data.variables["start.bob.position.x"][:], found.start["bob.position.x"])
        status = [row.tobytes().rstrip(b"\0") for row in data.variables["status"][:]]
    assert status == [b"finished", b"failed"]


def test_unknown_files_are_refused(tmp_path: Any) -> None:
    with pytest.raises(UsageError, match="suffix"):
        made_for_files().save(tmp_path / "a.xyz")
    with pytest.raises(ResultError, match="bob"):
        made_for_files()["bob.position.y2"]


def order_of(options: RunOptions, scene: Any = None, form: str = "reduced") -> sweep_runs.SweepRequest:
    assembly = assemble(scene or DoublePendulum(), form=form)
    cases = make_cases(scene or DoublePendulum(), {"gravity": [1.0]}, None, "grid")
    paths = ("rod1.angle",) if scene is None else ()
    return sweep_runs.SweepRequest(assembly, cases, paths, np.array([1.0]), True, options)


def test_nothing_is_batched_by_mistake() -> None:
    """Whatever the shortcuts of `sweep_batch` assume is asked for before."""
    why = sweep_batch.why_not_batched
    assert why(order_of(RunOptions(1.0))) == ""
    assert "ida" in why(order_of(RunOptions(1.0, solver="ida")))
    assert "time" in why(order_of(RunOptions(1.0, max_seconds=1.0)))
    assert "dae" in why(order_of(RunOptions(1.0), form="dae"))
    assert why(order_of(RunOptions(1.0), SCENES["slider-crank"]())) == ""
    assert "no formulas" in why(order_of(RunOptions(1.0), SCENES["bricard"]()))
    assert "dead centres" in why(order_of(RunOptions(1.0), FourBar(frame_length=3.6)))
