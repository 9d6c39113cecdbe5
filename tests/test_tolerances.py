"""Every tolerance of rank and consistency: what it may be, and a scene that comes out wrong beyond either end."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import atwood_library as lib
from atwood import (
    AtwoodError,
    Component,
    Point,
    Scalar,
    Scene,
    Vector,
    assemble,
    connector,
    constraint,
    event,
    parameter,
    select,
    simulate,
)
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import to_maximal
from atwood.integrators.ida import library as sundials_library
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.preparation import make_problem
from atwood.tolerances import INTERVALS, tolerances
from atwood_library.scenes import SCENES, Bricard, FourBar, HeavyTop, RollingBall, SimplePendulum

from .helpers.runs import FORMS
from .scenes.test_integrable import wheel_on_a_slope

needs_sundials = pytest.mark.skipif(not sundials_library.available(), reason="the SUNDIALS libraries are not here")

NAMES = tuple(INTERVALS)


def decisions(assembly: Assembly) -> tuple[Any, ...]:
    """Return what is decided by tolerances when a scene is assembled, and its start; or what is refused."""
    try:
        start = find_start(assembly)
        q, u = start.coordinates, start.speeds
        if assembly.form == "dae":
            q, u = (np.asarray(x, dtype=float) for x in assembly.kernel(to_maximal(assembly))([start.time], q, u))
        plan = make_problem(assembly, start.time, q, u, start.length, assembly.flat.t_end - start.time)
        plan.check_held(start.time, q, u)
    except AtwoodError as error:
        return (type(error).__name__, error.where)
    names = (start.free_coordinates, start.free_speeds, start.repeated)
    return (plan.finding, names, tuple(np.round(q, 7)), tuple(np.round(u, 7)))


@pytest.fixture(scope="module")
def library(request: pytest.FixtureRequest) -> list[tuple[Assembly, tuple[Any, ...]]]:
    """Return scenes of the library with what is decided about them: with --all every one in both forms."""
    every = request.config.getoption("--all")
    scenes = [(make, form) for make in SCENES.values() for form in FORMS]
    scenes = scenes if every else scenes[::5]
    assemblies = [assemble(make(), form=form) for make, form in scenes]
    return [(assembly, decisions(assembly)) for assembly in assemblies]


@pytest.mark.sample(10)
@pytest.mark.parametrize("factor", [0.1, 10.0])
@pytest.mark.parametrize("name", NAMES)
def test_library_scenes_are_the_same_with_ten_times_and_a_tenth(
    library: list[tuple[Assembly, tuple[Any, ...]]], name: str, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    low, high = INTERVALS[name]
    value = factor * getattr(tolerances, name)
    assert low <= value <= high
    monkeypatch.setattr(tolerances, name, value)
    assert [assembly.flat.name for assembly, before in library if decisions(assembly) != before] == []


@pytest.mark.sample(1)
@pytest.mark.parametrize("factor", [0.1, 10.0])
@pytest.mark.parametrize("name", ["CLOSED", "RANK", "SAME"])
def test_what_is_decided_before_the_start_is_the_same_too(
    name: str, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes = ("rolling-ball", "rolling-disc", "double-atwood")
    before = [decisions(assemble(SCENES[one]())) for one in scenes]
    monkeypatch.setattr(tolerances, name, factor * getattr(tolerances, name))
    assert [decisions(assemble(SCENES[one]())) for one in scenes] == before


def pendulum(**start: float) -> Scene:
    """Return a pendulum of 1 m with a start of its own."""
    scene = SimplePendulum()
    scene.start.clear()
    scene.start.update({path.replace("__", "."): value for path, value in start.items()})
    return scene


def turned(error: float) -> dict[str, float]:
    """Return the speed of a pendulum's rod, and one of its bob that differs from it by a share."""
    return {"rod__angle": 0.6, "rod__angular_velocity": 1.3, "bob__velocity__x": 1.3 * math.cos(0.6) * (1.0 + error)}


def two_grounds(apart: float) -> Scene:
    """Return a plate that is welded to two grounds, which are off by some metres."""
    scene = Scene(t_end=1.0)
    parts = [scene.add("left", lib.Ground()), scene.add("right", lib.Ground(position=(0.3 + apart, 0.0, 0.0)))]
    welds = [scene.add(f"weld{i}", lib.Weld(displacement=(x, 0.0, 0.0))) for i, x in enumerate((0.1, 0.2))]
    scene.connect(parts[0].frame, welds[0].a)
    scene.connect(welds[0].b, welds[1].a)
    scene.connect(welds[1].b, parts[1].frame)
    bob = scene.add("bob", lib.PointMass(mass=1.0))
    rod = scene.add("rod", lib.Rod(length=1.0))
    scene.connect(welds[0].b, rod.a)
    scene.connect(rod.b, bob.point)
    return scene


def wedge(angle: float) -> Scene:
    """Return a mass on two rods whose directions differ by an angle: together they hold it, however small that is."""
    scene = Scene(t_end=1.0)
    bob = scene.add("bob", lib.PointMass(mass=1.0))
    for i, turn in enumerate((0.0, angle)):
        ground = scene.add(f"ground{i}", lib.Ground(position=(math.sin(turn), 0.0, math.cos(turn))))
        rod = scene.add(f"rod{i}", lib.Rod(length=1.0))
        scene.connect(ground.frame, rod.a)
        scene.connect(rod.b, bob.point)
    scene.guess.update({"bob.position.x": 0.0, "bob.position.z": 0.0})
    return scene


def parallelogram(angle: float, longer: float = 0.0) -> FourBar:
    """Return a parallelogram at an angle of its cranks, whose coupler is longer by a share."""
    scene = FourBar(crank_length=1.0, coupler_length=2.0 * (1.0 + longer), rocker_length=1.0, frame_length=2.0)
    scene.start.clear()
    scene.start.update({"crank.angle": angle, "crank.angular_velocity": 6.0})
    scene.guess.update({"coupler.angle": 0.0, "rocker.angle": angle})
    return scene


def driven(jump: float) -> Scene:
    """Return a pendulum whose pivot is moved, and jumps at 0.5 s by some metres."""
    scene = Scene(t_end=0.6)
    ground = scene.add("ground", lib.Ground())
    drive = scene.add("drive", lib.Drive(motion=lambda t: select(t < 0.5, 0.3 * t, 0.15 + jump)))
    rod, bob = scene.add("rod", lib.Rod()), scene.add("bob", lib.PointMass())
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, rod.a)
    scene.connect(rod.b, bob.point)
    scene.start.update({"rod.angle": 0.3, "rod.angular_velocity": 0.0})
    return scene


def parting() -> Scene:
    """Return a mass on two drives, one of which goes away from the other from 0.2 s on, very slowly at first."""
    scene = Scene()
    ground, mass = scene.add("ground", lib.Ground()), scene.add("mass", lib.PointMass())
    late = lib.Drive(motion=lambda t: select(t > 0.2, (t - 0.2) ** 4, 0.0 * t))
    drives = [scene.add("still", lib.Drive()), scene.add("late", late)]
    for drive in drives:
        scene.connect(ground.frame, drive.a)
    scene.connect(drives[0].b, mass.point)
    scene.connect(drives[0].b, drives[1].b)
    return scene


class Catch(Component):
    """Lets go of a mass at first, and holds it at a place from 0.3 s on."""

    place: float = parameter(0.0, unit="m", doc="Where it holds the mass.")
    at: Point = connector(Point, "The mass.")
    modes = ("free", "held")

    @constraint(reaction="force", unit="N", doc="Force on the mass.", modes=("held",))
    def hold(self) -> Vector:
        """Return how far the mass is from where it is held."""
        return self.at.position - Vector(self.place, 0.0, 0.0)

    @event(target="held", direction=1, unit="s", message="it is caught", modes=("free",), impact=True)
    def catch(self) -> Scalar:
        """Return the time since it is caught."""
        return self.time - 0.3


def caught(apart: float) -> Scene:
    """Return a mass at rest that is caught at a place some metres from where it is."""
    scene = Scene(gravity=0.0, t_end=0.6)
    bob, other = scene.add("bob", lib.PointMass(mass=1.0)), scene.add("other", lib.PointMass(mass=1.0))
    catch, spring = (
        scene.add("catch", Catch(place=apart)),
        scene.add("spring", lib.Spring(stiffness=1.0, natural_length=1.0)),
    )
    scene.connect(catch.at, bob.point)
    scene.connect(bob.point, spring.a)
    scene.connect(spring.b, other.point)
    scene.start.update({f"{part}.velocity.{axis}": 0.0 for part in ("bob", "other") for axis in "xz"})
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": 0.0, "other.position.x": 1.0, "other.position.z": 0.0})
    return scene


def outcome(make: Callable[[], Scene], form: str) -> tuple[Any, ...]:
    """Return what is decided about a scene, or what is refused."""
    try:
        return decisions(assemble(make(), form=form))
    except AtwoodError as error:
        return (type(error).__name__, error.where)


def run(make: Callable[[], Scene], form: str) -> tuple[Any, ...]:
    """Return how a run ended, and what it met on its way."""
    try:
        result = simulate(make(), form=form, t_end=0.6, rtol=1e-8)
    except AtwoodError as error:
        return (type(error).__name__, error.where)
    return (result.status, len(result.singular_crossings), len(result.events))


ENDS: dict[tuple[str, str], tuple[float, str, Callable[[], Scene], str]] = {
    ("CERTAIN", "low"): (3e-3, "reduced", Bricard, "assemble"),
    ("CERTAIN", "high"): (3e10, "dae", lambda: wedge(1e-4), "assemble"),
    ("TRUSTED", "high"): (1e19, "dae", FourBar, "assemble"),
    ("RANK", "high"): (0.1, "reduced", RollingBall, "assemble"),
    ("KNOWN", "high"): (1e3, "dae", parting, "run"),
    ("CLEAR", "low"): (1e-12, "dae", lambda: parallelogram(1e-9), "assemble"),
    ("SINGULAR", "low"): (1e-10, "dae", lambda: parallelogram(1e-9), "assemble"),
    ("SINGULAR", "high"): (1.0, "dae", Bricard, "assemble"),
    ("FREE", "high"): (0.5, "reduced", Bricard, "assemble"),
    ("MET", "low"): (1e-16, "reduced", HeavyTop, "assemble"),
    ("MET", "high"): (
        1e-6,
        "reduced",
        lambda: pendulum(bob__position__x=0.6, bob__position__z=-0.8 * (1.0 + 1e-7)),
        "assemble",
    ),
    ("MET_SPEEDS", "low"): (1e-13, "reduced", lambda: pendulum(**turned(1e-12)), "assemble"),
    ("MET_SPEEDS", "high"): (1e-5, "reduced", lambda: pendulum(**turned(1e-6)), "assemble"),
    ("CLOSED", "low"): (1e-18, "reduced", lambda: two_grounds(0.0), "assemble"),
    ("CLOSED", "high"): (1e-5, "reduced", lambda: two_grounds(1e-6), "assemble"),
    ("NEARLY_FITS", "low"): (1e-13, "dae", lambda: parallelogram(1.0, 2e-11), "run"),
    ("HELD", "low"): (1e-16, "dae", lambda: driven(1e-14), "run"),
    ("HELD", "high"): (1e-5, "dae", lambda: driven(1e-6), "run"),
    ("IN_PLACE", "low"): (1e-12, "reduced", lambda: caught(1e-9), "run"),
    ("IN_PLACE", "high"): (1e-2, "reduced", lambda: caught(1e-3), "run"),
    ("SAME", "low"): (1e-17, "reduced", RollingBall, "assemble"),
    ("SAME", "high"): (1.0, "reduced", lambda: wheel_on_a_slope(), "assemble"),
}
"""For each end of an interval: a value beyond it, and what then comes out otherwise, assembled or run in one form."""


def test_every_end_has_a_scene() -> None:
    for name, (low, high) in INTERVALS.items():
        assert 0.0 <= low < getattr(tolerances, name) < high
        assert (low > 0.0) == ((name, "low") in ENDS)
        assert math.isfinite(high) == ((name, "high") in ENDS)
        for end in ("low", "high"):
            value = ENDS.get((name, end), (0.0,))[0]
            assert value < low or end == "high" or not low
            assert value > high or end == "low" or math.isinf(high)


@needs_sundials
@pytest.mark.sample(5)
@pytest.mark.parametrize(("name", "end"), ENDS)
def test_a_scene_comes_out_wrong_beyond_the_end(name: str, end: str, monkeypatch: pytest.MonkeyPatch) -> None:
    value, form, make, how = ENDS[name, end]
    look = outcome if how == "assemble" else run
    right = look(make, form)
    monkeypatch.setattr(tolerances, name, value)
    assert look(make, form) != right
