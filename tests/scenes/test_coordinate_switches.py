"""Orientations in every kind of coordinates: through all singular places, and nobody who reads results can tell."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import atwood_library as lib
from atwood import Component, Result, Scalar, Scene, discrete_state, report, simulate, sweep, update
from atwood.pipeline import assemble
from atwood.topology.orientation_coordinates import ORIENTATIONS
from atwood_library.scenes import SCENES, FreeBody, LagrangeTop

from ..references.free_body import FreeBody as ExactBody
from ..references.rotations import about, about_x, angle_between
from .test_orientations import caught, linkage, top

OTHERS = ORIENTATIONS[1:]
FEW = ("euler-zyz", "euler-yxz")
MOMENTS = (1.0, 2.0, 3.0)


def vector(result: Result, path: str) -> Any:
    return np.stack([result[f"{path}.{axis}"] for axis in "xyz"], axis=-1)


def axes(result: Result, body: str = "body") -> Any:
    """Return R_WB along a run."""
    return np.stack([vector(result, f"{body}.{axis}_axis") for axis in "xyz"], axis=-1)


def free_body(spin: tuple[float, ...], orientation: Any) -> Scene:
    """Return the free body with an orientation at its start."""
    scene = FreeBody(moments=MOMENTS, spin=spin)
    for j, name in enumerate("xyz"):
        for i, part in enumerate("xyz"):
            scene.start[f"body.{name}_axis.{part}"] = float(orientation[i, j])
    return scene


@cache
def poles() -> tuple[ExactBody, ExactBody]:
    """Return motions that begin with the body's axes along the world's, and that reach a half turn about x at t = 3."""
    spin = (2.0, 0.3, 0.2)
    turned = ExactBody(MOMENTS, spin).orientation(3.0)
    return ExactBody(MOMENTS, spin), ExactBody(MOMENTS, spin, about_x(np.pi) @ turned.T)


@pytest.mark.sample(2)
@pytest.mark.parametrize("kind", ORIENTATIONS)
def test_the_free_body_passes_every_singular_place(kind: str) -> None:
    """At the start theta is zero, or at t = 3 it is pi: the other kinds are at their worst on the way."""
    for exact in poles():
        scene = free_body(tuple(exact.given[1]), exact.orientation(0.0))
        for rtol in (1e-6, 1e-8, 1e-11):
            solver = "auto" if kind != "quaternion" else "taylor"
            result = simulate(scene, orientation=kind, rtol=rtol, solver=solver, t_end=6.0, outputs=25)
            assert result.solver.startswith("Taylor series")
            assert np.max(angle_between(axes(result), exact.orientation(result.time))) < 10.0 * rtol
            assert np.allclose(result.time, np.linspace(0.0, 6.0, 25), atol=1e-12)
            assert result.assembly.orientation.kind == kind


class Counter(Component):
    """What counts the tenths of a second."""

    count: Scalar = discrete_state(doc="How many.")

    @update(every=0.1, sets="count")
    def step(self) -> float:
        return self.count + 1.0


def test_samples_of_a_control_are_outputs_after_a_switch_too() -> None:
    scene = FreeBody(moments=MOMENTS, spin=(2.0, 0.3, 0.2))
    scene.add("counter", Counter())
    result = simulate(scene, orientation="euler-yxz", t_end=6.0, outputs=3)
    assert result.coordinate_switches
    np.testing.assert_allclose(np.unique(result.time), np.linspace(0.0, 6.0, 61), atol=1e-12)


@pytest.mark.sample(3)
@pytest.mark.parametrize("kind", ORIENTATIONS)
@pytest.mark.parametrize(("solver", "rtol"), [("taylor", 1e-14), ("explicit", 1e-13)])
def test_energy_and_momentum_stay_while_charts_change(kind: str, solver: str, rtol: float) -> None:
    settings: dict[str, Any] = {"orientation": kind, "solver": solver, "rtol": rtol, "t_end": 15.0}
    result = simulate(FreeBody(moments=MOMENTS, spin=(1.5, 0.7, -1.0)), **settings)
    assert result.energy.max_drift < 3e-12
    momentum = vector(result, "body.angular_momentum")
    size = np.linalg.norm(momentum, axis=-1)
    assert np.max(np.abs(size - size[0])) < 1e-12 * size[0]
    assert np.max(np.abs(momentum - momentum[0])) < 1e-11 * size[0]
    if kind == "euler-zyz":
        assert len(result.coordinate_switches) > 2
        assert all(one.body == "body" for one in result.coordinate_switches)
        assert np.all(np.diff([one.time for one in result.coordinate_switches]) > 0.0)
    elif kind == "quaternion":
        assert result.coordinate_switches == ()


@pytest.mark.sample(2)
@pytest.mark.parametrize("kind", ORIENTATIONS)
def test_as_few_states_as_regular_coordinates_can_have(kind: str) -> None:
    more = int(kind == "quaternion")
    assert report(FreeBody(), orientation=kind).states["reduced"] == 12 + more
    found = report(LagrangeTop(inclination=0.0), orientation=kind)
    assert found.states["reduced"] == 6 + more
    assert found.degrees_of_freedom == 3
    assert (kind == "quaternion") == any("quaternion" in name for name in found.coordinates + found.free_coordinates)


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", OTHERS)
def test_uniform_turns_are_followed_although_their_coordinates_hardly_change(kind: str) -> None:
    """They are straight lines in some coordinates, and pass poles exactly in others."""
    for k, spin in enumerate(np.diag([2.0, 2.0, 2.0])):
        for solver, rtol in (("explicit", 1e-8), ("taylor", 1e-10), ("ida", 1e-8)):
            result = simulate(
                FreeBody(spin=tuple(spin)), orientation=kind, t_end=30.0, solver=solver, rtol=rtol, outputs=31
            )
            error = angle_between(axes(result), about(np.eye(3)[k], 2.0 * result.time))
            assert np.max(error) < (100.0 if solver != "ida" else 2000.0) * rtol


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", OTHERS)
def test_a_top_that_starts_upright_runs(kind: str) -> None:
    """Exactly upright it sleeps, and pushed a little when it spins too slowly it falls and comes up again."""
    asleep = simulate(LagrangeTop(inclination=0.0, spin=5.0), orientation=kind, t_end=1.0, rtol=1e-10, outputs=11)
    assert np.max(angle_between(axes(asleep, "top"), about([0.0, 0.0, 1.0], 5.0 * asleep.time))) < 1e-9
    scene = LagrangeTop(inclination=0.0, spin=5.0)
    scene.start["top.spin.x"] = 0.3
    exact, falling = (simulate(scene, orientation=one, t_end=2.0, rtol=1e-11) for one in ("quaternion", kind))
    assert np.min(exact["top.theta"]) == 0.0
    assert np.max(exact["top.theta"]) > 1.0
    assert np.max(angle_between(axes(exact, "top"), axes(falling, "top"))) < 1e-9
    assert falling.energy.max_drift < 1e-10


def pendulum(*spin: float) -> Scene:
    """Return a body on a ball joint that swings down, straight if not spun: its z axis is against the world's there."""
    scene = Scene(space="space", t_end=3.0)
    ground, ball = scene.add("ground", lib.Ground()), scene.add("ball", lib.Spherical())
    body = scene.add("body", lib.RigidBody(mass=1.0, center=(0.0, 0.0, 0.5), moments=(0.2, 0.2, 0.1)))
    scene.connect(ground.frame, ball.a)
    scene.connect(ball.b, body.frame)
    scene.start.update({"body.phi": 0.4, "body.theta": 2.0, "body.psi": 0.3})
    scene.start.update({f"body.spin.{axis}": value for axis, value in zip("xyz", spin or (0.0,) * 3, strict=True)})
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", OTHERS)
def test_no_quantity_shows_its_coordinates(kind: str) -> None:
    """Positions, axes, Euler angles that count their turns, velocities, forces, energies."""
    exact, other = (simulate(pendulum(1.0, 0.5, 2.0), orientation=one, rtol=1e-11, t_end=4.0, outputs=41)
                    for one in ("quaternion", kind))  # fmt: skip
    assert other.coordinate_switches
    assert other.paths == exact.paths
    for path in exact.paths:
        assert np.allclose(other.array(path), exact.array(path), rtol=0.0, atol=1e-7, equal_nan=True), path


@pytest.mark.sample(2)
@pytest.mark.parametrize("kind", OTHERS)
def test_a_pendulum_swings_through_its_pole(kind: str) -> None:
    exact, other = (simulate(pendulum(), orientation=one, rtol=1e-11) for one in ("quaternion", kind))
    assert np.max(exact["body.theta"]) > 3.1
    assert np.max(angle_between(axes(exact), axes(other))) < 1e-10
    assert np.allclose(exact["ball.force.z"], other["ball.force.z"], atol=1e-8)


def test_a_gyroscope_goes_through_gimbal_lock() -> None:
    """Its own three angles pass the place where two axes are parallel; a rotor on a ball joint has any coordinates."""
    from atwood_library.scenes import Gyroscope

    scene = Gyroscope(inclination=1.5, spin=20.0)
    scene.start["inner_bearing.angular_velocity"] = 3.0
    lock = simulate(scene, rtol=1e-11, t_end=1.0)
    assert np.min(lock["inner_bearing.angle"]) < 1.51 < np.pi / 2.0 < np.max(lock["inner_bearing.angle"])
    dae = simulate(scene, form="dae", rtol=1e-11, t_end=1.0)
    assert np.max(angle_between(axes(lock, "rotor"), axes(dae, "rotor"))) < 1e-7
    assert lock.energy.max_drift < 1e-8


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", FEW)
def test_every_method_passes_changes_of_chart(kind: str) -> None:
    spin = (1.0, 0.5, 2.0)
    exact = simulate(pendulum(*spin), rtol=1e-13, outputs=21, t_end=4.0, solver="taylor")
    for solver in ("taylor", "explicit", "ida", "ida-sundae"):
        made = simulate(pendulum(*spin), orientation=kind, rtol=1e-10, outputs=21, t_end=4.0, solver=solver)
        assert made.coordinate_switches
        for path in ("body.position.x", "body.x_axis.y", "body.spin.z", "ball.force.x", "body.kinetic_energy"):
            assert np.allclose(made[path], exact[path], atol=2e-6)


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", FEW)
def test_loops_and_modes_have_any_coordinates(kind: str) -> None:
    for make, paths in (
        (linkage, ("coupler.position.x", "coupler.position.z", "p2.angle", "coupler.x_axis.y")),
        (caught, ("body.position.x", "body.z_axis.x", "body.x_axis.y")),
    ):
        exact, other = (simulate(make(), orientation=one, rtol=1e-9, outputs=16) for one in ("quaternion", kind))
        assert [one.law for one in other.events] == [one.law for one in exact.events]
        for path in paths:
            assert np.allclose(other[path][-5:], exact[path][-5:], atol=2e-6)
        assert np.allclose(other.time, exact.time, atol=1e-6)
        assert other.energy.max_drift < 1e-5


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", FEW)
@pytest.mark.parametrize("name", ["rolling-ball", "rolling-disc", "stewart-platform"])
def test_scenes_that_roll_and_stand_on_legs_have_any_coordinates(name: str, kind: str) -> None:
    exact, other = (
        simulate(SCENES[name](), orientation=one, rtol=1e-9, t_end=0.7, outputs=5) for one in ("quaternion", kind)
    )
    assert len(other.assembly.reduced.coordinates) == len(exact.assembly.reduced.coordinates) - 1
    for path in exact.paths:
        if "position" in path or "_axis" in path:
            assert np.allclose(other[path], exact[path], atol=1e-6)


@pytest.mark.parametrize("kind", ["euler-xyz", "euler-zyz"])
def test_other_values_and_sweeps_keep_the_coordinates(kind: str) -> None:
    masses, path = [0.5, 1.0, 2.0], "body.x_axis.y"
    assembly = assemble(top(), orientation=kind)
    swept = sweep(assembly, {"body.mass": masses}, quantities=[path], rtol=1e-9, t_end=3.0, outputs=5)
    for k, mass in enumerate(masses):
        alone = simulate(assembly.with_values({"body.mass": mass}), rtol=1e-9, t_end=3.0, outputs=5)
        assert alone.assembly.orientation.kind == kind
        assert len(alone.assembly.own_equations.coordinates) == 3
        assert np.allclose(swept[path][k], alone[path], atol=1e-9)


def test_an_output_at_a_change_of_chart_is_there_once() -> None:
    scene = FreeBody(spin=(0.1, 2.0, 0.1))
    when = simulate(scene, orientation="euler-zyz", t_end=2.0).coordinate_switches[0].time
    for times in ([0.0, when, 2.0], [0.0, np.nextafter(when, 0.0), np.nextafter(when, 3.0), 2.0]):
        result = simulate(scene, orientation="euler-zyz", t_end=2.0, outputs=np.array(times))
        assert result.time.tolist() == times
        exact = ExactBody((1.0, 2.0, 3.0), (0.1, 2.0, 0.1)).orientation(result.time)
        assert np.max(angle_between(axes(result), exact)) < 1e-7
