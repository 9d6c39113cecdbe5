"""Loops in space that formulas solve, against geometry and the numeric loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from atwood import Scene, assemble, simulate
from atwood.arrays import FloatArray
from atwood.integrators.ida import library as sundials_library
from atwood.simulation.initialization.start import find_start, own_state
from atwood.simulation.problem.closed_loops import solve_at
from atwood.simulation.problem.preparation import make_problem
from atwood.simulation.problem.projection import misses_of
from atwood_library import Ground, Pivot, RigidBody, Slider, Spherical, Universal, Weld
from atwood_library.scenes import SpatialSliderCrank, StewartPlatform

from .test_closed_loops import by_formulas, solved, states

needs_sundials = pytest.mark.skipif(not sundials_library.available(), reason="the SUNDIALS libraries are not here")


def test_the_spatial_slider_crank_has_one_angle_and_its_rate() -> None:
    found = solved(SpatialSliderCrank())
    assert found is not None
    program = found.form.accelerations.program
    assert sum(len(group.symbols) for group in program.inputs[1:]) == 2
    assert sum(program.operations.values()) <= 150
    assert "solve" not in program.operations
    assert "atan2" not in program.operations


@pytest.mark.sample(1)
@pytest.mark.parametrize("solver", ["explicit", "taylor"])
def test_the_spatial_slider_crank_is_where_its_rod_puts_it(solver: str) -> None:
    result = simulate(SpatialSliderCrank(), solver=solver, rtol=1e-11, t_end=2.0)
    assert by_formulas(result)
    angle, crank, rod = result["bearing.angle"], 0.08, 0.3
    y, z = 0.1 + crank * np.cos(angle), 0.12 + crank * np.sin(angle)
    assert np.ptp(angle) > 4.0
    assert_allclose(result["guide.displacement"], np.sqrt(rod**2 - y**2 - z**2), atol=1e-14)
    assert result.energy.max_drift < 1e-8


@needs_sundials
def test_the_spatial_slider_crank_moves_as_its_numeric_loop() -> None:
    result, numeric = (simulate(SpatialSliderCrank(), rtol=1e-12, t_end=1.0, solver=one) for one in ("auto", "ida"))
    assert by_formulas(result)
    sizes = np.max(np.abs(states(numeric)), axis=1, keepdims=True)
    assert np.max(np.abs(states(result) - states(numeric)) / sizes) < 1e-7


@needs_sundials
def test_the_legs_of_a_stewart_platform_follow_from_where_it_is() -> None:
    assembly = assemble(StewartPlatform())
    result, numeric = (simulate(assembly, rtol=1e-10, t_end=0.5, outputs=20, solver=one) for one in ("auto", "ida"))
    assert by_formulas(result)
    found = solved(StewartPlatform())
    assert found is not None
    assert [len(group.symbols) for group in found.form.accelerations.program.inputs] == [1, 7, 6]
    one, other = states(result), states(numeric)
    assert np.max(np.abs(one - other)) < 1e-6
    assert max(float(np.max(segment.held)) for segment in result.run.segments) < 1e-12
    assert result.run.statistics.steps < 0.2 * numeric.run.statistics.steps


# -- random assemblies of a cross and a ball, closed by construction ------------------------------------------------


class Assembled:
    """A scene that is put together at random on a base that stands anywhere and is turned in any way."""

    def __init__(self, seed: int, size: float) -> None:
        self.random, self.size, self.scene = np.random.default_rng(seed), size, Scene(space="space")
        world = self.scene.add("world", Ground(position=tuple(size * self.random.normal(size=3))))
        self.base = self.mounted(world.frame, np.zeros(3), self.turned())

    def direction(self) -> FloatArray:
        """Return any direction."""
        found = self.random.normal(size=3)
        return np.asarray(found / np.linalg.norm(found))

    def near(self, direction: FloatArray) -> FloatArray:
        """Return a direction near another one."""
        found = direction + 0.3 * self.direction()
        return np.asarray(found / np.linalg.norm(found))

    def length(self, least: float, most: float) -> float:
        """Return a length of a share of the scene's size."""
        return self.size * float(self.random.uniform(least, most))

    def turned(self) -> FloatArray:
        """Return any rotation."""
        return rotation(self.direction(), float(self.random.uniform(0.0, 6.0)))

    def mounted(self, frame: Any, displacement: FloatArray, turn: FloatArray | None = None) -> Any:
        """Return a frame that is fixed to another one."""
        vector = np.zeros(3) if turn is None else Rotation.from_matrix(turn).as_rotvec()
        angle = float(np.linalg.norm(vector))
        axis = tuple(vector / angle) if angle else (0.0, 0.0, 1.0)
        weld = self.scene.add(
            f"weld{len(self.scene.parts)}", Weld(displacement=tuple(displacement), angle=angle, axis=axis)
        )
        self.scene.connect(frame, weld.a)
        return weld.b

    def body(self, name: str) -> Any:
        """Return the frame of a new body."""
        mass = float(self.random.uniform(0.2, 2.0))
        moments = 0.1 * mass * self.size**2 * self.random.uniform(0.8, 1.2, size=3)
        center = 0.2 * self.size * self.random.normal(size=3)
        return self.scene.add(name, RigidBody(mass=mass, moments=tuple(moments), center=tuple(center))).frame

    def joint(self, name: str, part: Any, a: Any, b: Any) -> None:
        """Add a joint between two frames."""
        joint = self.scene.add(name, part)
        self.scene.connect(a, joint.a)
        self.scene.connect(joint.b, b)

    def driver(self) -> tuple[Any, FloatArray]:
        """Return a body that turns about a hinge on the base, and how it stands in the base; it leaves its place."""
        axis, angle, place = (
            self.direction(),
            float(self.random.uniform(-3.0, 3.0)),
            self.length(0.1, 0.5) * self.direction(),
        )
        frame = self.body("crank")
        self.joint("bearing", Pivot(axis=tuple(axis)), self.mounted(self.base, place), frame)
        side = float(self.random.choice([-1.0, 1.0]))
        self.scene.start.update({"bearing.angle": angle, "bearing.angular_velocity": 3.0 * side / math.sqrt(self.size)})
        self.place = place
        return frame, rotation(axis, angle)


def rotation(axis: FloatArray, angle: float) -> FloatArray:
    """Return the matrix of a turn."""
    return np.asarray(Rotation.from_rotvec(angle * np.asarray(axis)).as_matrix())


def cross_of(made: Assembled) -> tuple[Universal, FloatArray, FloatArray]:
    """Return a cross, how it is turned, and the direction square to both axes."""
    first = made.direction()
    second = np.cross(first, made.direction())
    second /= np.linalg.norm(second)
    angles = made.random.uniform(-1.0, 1.0), made.random.uniform(-0.7, 0.7)
    made.scene.guess.update({"cross.angle_a": float(angles[0]), "cross.angle_b": float(angles[1])})
    turn = rotation(first, angles[0]) @ rotation(second, angles[1])
    return Universal(axis_a=tuple(first), axis_b=tuple(second)), turn, np.cross(first, second)


def rod_on_a_crank(seed: int, size: float, ends: str) -> Scene:
    """Return a crank and a rod between a cross and a ball, which is on a rocker (USR) or on a slide (USP)."""
    made = Assembled(seed, size)
    crank, stand = made.driver()
    pin, mount, rod = made.length(0.15, 0.4) * made.direction(), made.turned(), made.body("rod")
    cross, turn, along = cross_of(made)
    made.joint("cross", cross, made.mounted(crank, pin, mount), rod)
    arm = made.length(0.8, 1.5) * made.near(along)
    ball = made.place + stand @ (pin + mount @ turn @ arm)
    axis, other = made.direction(), made.body("other")
    if ends == "rocker":
        angle, rocker = float(made.random.uniform(-3.0, 3.0)), made.length(0.5, 1.2) * made.direction()
        made.joint(
            "end", Pivot(axis=tuple(axis)), made.mounted(made.base, ball - rotation(axis, angle) @ rocker), other
        )
        made.scene.guess["end.angle"] = angle
    else:
        way, rocker = made.length(-0.5, 0.5), made.length(0.0, 0.3) * made.direction()
        made.joint("end", Slider(axis=tuple(axis)), made.mounted(made.base, ball - way * axis - rocker), other)
        made.scene.guess["end.displacement"] = way
    made.joint("ball", Spherical(), made.mounted(rod, arm), made.mounted(other, rocker))
    return made.scene


def leg_on_an_arm(seed: int, size: float) -> Scene:
    """Return an arm on a leg that stands on a cross and stretches (UPS): as a strut, or a cylinder on a boom."""
    made = Assembled(seed, size)
    arm, stand = made.driver()
    eye, mount = made.length(0.3, 0.8) * made.direction(), made.turned()
    cross, turn, along = cross_of(made)
    way, axis = made.length(0.2, 0.8), made.near(along)
    low, high = made.length(0.0, 0.3) * made.direction(), made.length(0.0, 0.3) * made.direction()
    foot = made.place + stand @ eye - mount @ turn @ (low + high + way * axis)
    lower, upper = made.body("lower"), made.body("upper")
    made.joint("cross", cross, made.mounted(made.base, foot, mount), lower)
    made.joint("leg", Slider(axis=tuple(axis)), made.mounted(lower, low), upper)
    made.joint("ball", Spherical(), made.mounted(upper, high), made.mounted(arm, eye))
    made.scene.guess["leg.displacement"] = way
    return made.scene


KINDS: dict[str, Callable[[int, float], Scene]] = {
    "USR": lambda seed, size: rod_on_a_crank(seed, size, "rocker"),
    "USP": lambda seed, size: rod_on_a_crank(seed, size, "slide"),
    "UPS": leg_on_an_arm,
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("kind", KINDS)
def test_random_assemblies_of_a_cross_and_a_ball_close(kind: str, seed: int) -> None:
    size = 10.0 ** (seed % 5 - 2)
    assembly = assemble(KINDS[kind](seed, size))
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    plan = make_problem(assembly, start.time, q, u, start.length, 1.0)
    found = solve_at(plan, start.time, q, u)
    if found is None:  # it starts near a dead centre, or a cross that is folded
        return
    assert len(found.independent) == 1
    y = found.reduced(np.concatenate([q, u]))
    for step in np.linspace(-0.1, 0.1, 5):
        moved = y.copy()
        moved[0] += step * plan.coordinate_sizes[found.independent[0]]
        full = found.state(start.time, moved)
        misses = misses_of(plan, np.array([start.time]), full[: len(q), None], full[len(q) :, None])
        assert np.max(misses) < 1e-12


@needs_sundials
@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", KINDS)
def test_random_assemblies_move_as_their_numeric_loops(kind: str) -> None:
    seed = next(seed for seed in range(1, 20) if solved(KINDS[kind](seed, 1.0)) is not None)
    assembly = assemble(KINDS[kind](seed, 1.0))
    result, numeric = (simulate(assembly, rtol=1e-11, t_end=0.3, solver=one) for one in ("auto", "ida"))
    assert result.run.choices[0].solver in ("explicit", "taylor")
    sizes = np.max(np.abs(states(numeric)), axis=1, keepdims=True)
    assert np.max(np.abs(states(result) - states(numeric)) / sizes) < 1e-6
