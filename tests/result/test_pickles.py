"""Scenes, assemblies and results are copied, pickled, and sent to other processes and back."""

import copy
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

import atwood
from atwood import AtwoodError, Component, Load, Point, Result, Scene, Vector, connector, force, select, simulate
from atwood.forms.other_values import starting
from atwood_library import PointMass
from atwood_library.scenes import (
    DoubleAtwood,
    DoublePendulum,
    FourBar,
    HeavyTop,
    IntermediateAxis,
    RollingDisc,
    SliderCrank,
    UniversalShaft,
)

from ..helpers.mechanisms import pendulum_on_a_string


class Kick(Component):
    """A force that acts in the first tenth of a second."""

    point: Point = connector(Point, "What it acts on.")

    @force
    def push(self) -> list[Load]:
        """The force."""
        return [Load(self.point, force=Vector(select(self.time < 0.1, 1.0, -2.0), 0.0, 0.0))]


def kicked() -> Scene:
    scene = Scene(gravity=0.0)
    bob, kick = scene.add("bob", PointMass(mass=2.0)), scene.add("kick", Kick())
    scene.connect(kick.point, bob.point)
    return scene


def string() -> Scene:
    """A bob on a string that goes slack and comes taut."""
    scene = pendulum_on_a_string(t_end=3.0, rope={"when_slack": "slack"})
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": -1.0, "bob.velocity.x": (3.5 * 9.81) ** 0.5})
    return scene


RUNS = {
    "a tree": (DoublePendulum, {"t_end": 0.5}),
    "a loop": (FourBar, {"t_end": 0.3}),
    "a loop with multipliers": (SliderCrank, {"t_end": 0.3, "form": "dae"}),
    "on a line": (DoubleAtwood, {"t_end": 0.5}),
    "quaternions": (HeavyTop, {"t_end": 0.3}),
    "switches of coordinates": (IntermediateAxis, {"t_end": 3.0, "orientation": "euler-zyx"}),
    "constants of integration": (RollingDisc, {"t_end": 0.3}),
    "joints in space": (UniversalShaft, {"t_end": 0.3, "form": "dae"}),
    "modes": (string, {"t_end": 3.0}),
    "time events": (kicked, {"t_end": 0.5}),
}


def assert_alike(one: Result, other: Result) -> None:
    """States are the same to the bit; what is worked out from them may be added up in another order."""
    assert (other.paths, other.status, repr(other)) == (one.paths, one.status, repr(one))
    assert np.array_equal(one.time, other.time)
    for mine, theirs in zip(one.run.segments, other.run.segments, strict=True):
        assert np.array_equal(mine.coordinates, theirs.coordinates)
        assert np.array_equal(mine.speeds, theirs.speeds)
    for path, values in one.items():
        scale = 1.0 + np.max(np.abs(values[np.isfinite(values)]), initial=0.0)
        assert np.allclose(values / scale, other[path] / scale, rtol=0.0, atol=1e-9, equal_nan=True), path
    assert other.energy.max_drift == pytest.approx(one.energy.max_drift, abs=1e-9)
    assert [event.time for event in other.events] == [event.time for event in one.events]
    assert one.start.length == other.start.length


@pytest.mark.parametrize("name", RUNS)
def test_a_result_comes_back_from_a_pickle(name: str) -> None:
    scene, options = RUNS[name]
    result = simulate(scene(), outputs=21, **options)
    back = pickle.loads(pickle.dumps(result))
    assert_alike(result, back)
    if name == "switches of coordinates":
        assert result.coordinate_switches
    if name == "modes":
        assert len(result.events) > 1


def test_assemblies_that_share_their_programs_do_so_in_a_pickle() -> None:
    result = simulate(kicked(), t_end=0.5)
    one, *others = (segment.assembly for segment in pickle.loads(pickle.dumps(result)).run.segments)
    assert others
    assert all(other.shared is one.shared for other in others)
    first = atwood.assemble(DoublePendulum())
    second = first.with_values({"rod1.length": 2.0})
    mine, theirs = pickle.loads(pickle.dumps((first, second)))
    assert mine.shared is theirs.shared
    assert simulate(theirs, t_end=0.1)["rod1.angle"][-1] == simulate(second, t_end=0.1)["rod1.angle"][-1]


def test_nothing_that_was_compiled_is_in_a_pickle() -> None:
    assembly = atwood.assemble(FourBar())
    before = pickle.dumps(assembly)
    simulate(assembly, t_end=0.1)["right.force.x"]
    assert len(pickle.dumps(assembly)) == len(before) < 60_000


def test_other_values_and_another_name_come_along() -> None:
    assembly = atwood.assemble(DoublePendulum(), form="dae", level="index1-projected", name="wrist")
    moved = assembly.with_values({"bob1.mass": 3.0}, start={"rod1.angle": 0.25})
    back = pickle.loads(pickle.dumps(moved))
    assert (back.flat.name, back.form, back.level, back.why_new) == ("wrist", "dae", "index1-projected", "")
    assert back.flat.start == moved.flat.start
    assert np.array_equal(back.parameter_values, moved.parameter_values)
    again = back.with_values({"bob1.mass": 4.0})  # the scene is still known
    assert again.shared is back.shared


@pytest.mark.parametrize("how", [copy.copy, copy.deepcopy])
def test_copies(how) -> None:
    assembly = atwood.assemble(DoublePendulum())
    assert how(assembly) is assembly  # nobody can change it
    result = simulate(assembly, t_end=0.2)
    twin = how(result)
    assert twin is not result
    assert_alike(result, twin)
    scene = DoublePendulum()
    other = how(scene)
    other.set("rod1.length", 7.0)
    assert scene["rod1"].length == 1.0
    assert other["rod1"].length == 7.0


def test_a_sweep_a_comparison_and_a_report_come_back() -> None:
    for made in (
        atwood.sweep(DoublePendulum(), {"rod1.length": [1.0, 2.0]}, t_end=0.1),
        atwood.compare(DoublePendulum(), t_end=0.1, rtols=[1e-6]),
        atwood.report(DoublePendulum()),
    ):
        for back in (pickle.loads(pickle.dumps(made)), copy.deepcopy(made)):
            assert repr(back) == repr(made)
            assert repr(back.to_dict()) == repr(made.to_dict())


def test_what_is_no_scene_by_itself_says_so() -> None:
    inner = starting(atwood.assemble(RollingDisc()))
    with pytest.raises(AtwoodError, match="cannot be pickled"):
        pickle.dumps(inner)


def test_a_watched_run_can_be_pickled() -> None:
    result = simulate(DoublePendulum(), t_end=0.2, progress=lambda t: None)
    assert_alike(result, pickle.loads(pickle.dumps(result)))


def test_functions_that_a_run_was_watched_for_stay_behind() -> None:
    result = simulate(DoublePendulum(), t_end=1.0, until=lambda q: q["bob2.position.z"] + 1.0)
    back = pickle.loads(pickle.dumps(result))
    assert_alike(result, back)
    assert back.status == "stopped"


def test_a_process_that_begins_anew_takes_an_assembly_and_gives_a_result() -> None:
    assembly = atwood.assemble(DoublePendulum())
    expected = simulate(assembly, t_end=0.5, outputs=21)
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert_alike(expected, pool.submit(simulate, assembly, t_end=0.5, outputs=21).result(timeout=120))
