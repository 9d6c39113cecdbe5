"""Deviations from motions: against closed forms and runs beside, their volumes, and what has none."""

import math

import numpy as np
import pytest

import atwood
from atwood import Scene, UsageError, simulate, tangent_flow
from atwood_library import Drag, Ground, PointMass
from atwood_library.scenes import (
    DoublePendulum,
    FourBar,
    FourBarRow,
    FreeBody,
    LagrangeTop,
    Oscillators,
    RollingDisc,
    SimplePendulum,
)

from ...helpers.tethers import Tether


def tethered() -> Scene:
    """Return a ball that is thrown on a slack rope, which stops it."""
    scene = Scene()
    ground, ball = scene.add("ground", Ground()), scene.add("ball", PointMass())
    rope = scene.add("rope", Tether(starts="slack"))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, ball.point)
    scene.start.update({"ball.position.x": 0.3, "ball.position.z": 0.0, "ball.velocity.x": 1.0})
    return scene


def oscillation(kind: str) -> np.ndarray:
    flow = tangent_flow(Oscillators(kind=kind), t_end=2.0, outputs=[0.0, 1.1, 2.0], rtol=1e-12)
    assert flow.start_names == flow.names
    return flow.matrices[:, :, :]


def test_linear_oscillators_have_their_closed_forms() -> None:
    t, w = np.array([0.0, 1.1, 2.0]), 2.0
    cos, sin = np.cos(w * t), np.sin(w * t)
    assert oscillation("harmonic") == pytest.approx(
        np.moveaxis(np.array([[cos, sin / w], [-w * sin, cos]]), -1, 0), abs=1e-11
    )
    cos, sin = np.cosh(w * t), np.sinh(w * t)
    assert oscillation("inverted") == pytest.approx(
        np.moveaxis(np.array([[cos, sin / w], [w * sin, cos]]), -1, 0), rel=1e-11, abs=1e-11
    )
    assert oscillation("free")[-1] == pytest.approx(np.array([[1.0, 2.0], [0.0, 1.0]]), abs=1e-12)


@pytest.mark.sample(1)
@pytest.mark.parametrize("solver", ["explicit", "taylor", "ida"])
def test_neighbours_of_a_double_pendulum_move_as_it_says(solver: str) -> None:
    scene, t_end, eps = DoublePendulum(), 3.0, 1e-5
    paths = ("rod1.angle", "rod2.angle", "rod1.angular_velocity", "rod2.angular_velocity")
    flow = tangent_flow(scene, t_end=t_end, outputs=2, rtol=1e-11, solver=solver)
    for k, path in enumerate(paths):
        ends = []
        for sign in (1.0, -1.0):
            own = scene.copy()
            own.start[path] = scene.start[path] + sign * eps
            result = simulate(own, t_end=t_end, rtol=1e-13, outputs=2)
            ends.append([result[one][-1] for one in paths])
        beside = (np.array(ends[0]) - np.array(ends[1])) / (2.0 * eps)
        assert flow.matrices[-1][:, k] == pytest.approx(beside, rel=1e-6, abs=1e-6 * np.max(np.abs(beside)))


def test_volume_is_kept_while_errors_grow() -> None:
    """Ten seconds of the double pendulum, in which the largest error grows by 5.3 e-foldings."""
    flow = tangent_flow(DoublePendulum(), t_end=10.0, rtol=1e-11)
    assert math.log(flow.growth[-1]) == pytest.approx(5.28, abs=0.3)
    assert flow.volume == pytest.approx(1.0, abs=1e-10)
    assert flow.density == pytest.approx(1.0, abs=1e-10)
    assert 1.0 < flow.horizon(1e-1) < flow.horizon(1e-2) <= 10.0
    assert flow.horizon(1e-30) == math.inf


def test_friction_shrinks_volumes_at_its_rate() -> None:
    scene = SimplePendulum(mass=0.7, length=1.3)
    drag = scene.add("drag", Drag(linear=0.3))
    scene.connect(drag.point, scene.bob.point)
    flow = tangent_flow(scene, rtol=1e-11)
    assert flow.volume == pytest.approx(np.exp(-0.3 / 0.7 * flow.time), rel=1e-9)
    assert flow.density * flow.volume == pytest.approx(1.0)


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    "scene",
    [FourBar(), FourBarRow(windows=1, space="space"), FreeBody(), LagrangeTop()],
    ids=["closed loop", "closed loop in space", "free body", "top"],
)
def test_volume_is_kept_in_loops_and_in_space(scene: Scene) -> None:
    flow = tangent_flow(scene, t_end=0.5, rtol=1e-11, outputs=21)
    assert flow.volume == pytest.approx(1.0, abs=1e-8)


def test_deviations_of_a_closed_loop_meet_its_constraints() -> None:
    scene = FourBar()
    flow = tangent_flow(scene, t_end=0.8, outputs=2, rtol=1e-11)
    assert flow.start_names == ("crank.angle", "crank.angle'")
    ends, eps = [], 1e-5
    for sign in (1.0, -1.0):
        own = scene.copy()
        own.start["crank.angle"] = atwood.assemble(scene).flat.start["crank.angle"] + sign * eps
        result = simulate(own, t_end=0.8, rtol=1e-12, outputs=2)
        ends.append([result[f"{one}.angle"][-1] for one in ("crank", "rocker", "coupler")])
    beside = (np.array(ends[0]) - np.array(ends[1])) / (2.0 * eps)
    assert flow.matrices[-1][:3, 0] == pytest.approx(beside, rel=1e-5)


def test_what_has_no_volume_or_flow_is_said() -> None:
    flow = tangent_flow(RollingDisc(), t_end=0.3, outputs=3)
    with pytest.raises(UsageError, match="RollingDisc: it has no momenta that belong to coordinates"):
        _ = flow.volume
    with pytest.raises(UsageError, match="this assembly is of the dae form"):
        tangent_flow(atwood.assemble(DoublePendulum(), form="dae"))
    with pytest.raises(UsageError, match=r"do not move smoothly beside this one: at t = .*rope.*t_end below"):
        tangent_flow(tethered(), t_end=3.0)
