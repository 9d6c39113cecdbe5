"""Rolling without slipping: both scenes are exact, both forms agree, forces at the contact are right."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import atwood_library as lib
from atwood import AtwoodError, ParameterError, Result, Scene, StartError, report, simulate
from atwood.pipeline import assemble
from atwood_library.scenes import RollingBall, RollingDisc as RollingDiscScene

from ..references.rolling import RollingDisc as ExactDisc, TurntableBall, hoop, uniform_disc

G = 9.81
ANGLES, RATES = (0.4, 1.0, 0.2), (2.0, 0.3, 3.0)
"""Of a tumbling disc: phi, theta, psi, and their rates."""


def vector(result: Result, path: str) -> Any:
    return np.stack([result[f"{path}.{axis}"] for axis in "xyz"], axis=-1)


def axes(result: Result, body: str) -> Any:
    return np.stack([vector(result, f"{body}.{axis}_axis") for axis in "xyz"], axis=-1)


def tumbling(radius: float = 0.5, mass: float = 2.0, hole: float = 0.0) -> Scene:
    """Return a disc on the ground with given Euler angles and rates."""
    scene = Scene(space="space", t_end=3.0)
    ground, contact = scene.add("ground", lib.Ground()), scene.add("contact", lib.RollingDisc(axis=(0.0, 0.0, 1.0)))
    contact.radius = radius
    disc = scene.add("disc", lib.Disc(radius=radius, inner_radius=hole, mass=mass, axis="z"))
    scene.connect(ground.frame, contact.a)
    scene.connect(contact.b, disc.frame)
    scene.start.update(zip(("disc.phi", "disc.theta", "disc.psi"), ANGLES, strict=True))
    scene.start.update(zip(("disc.phi_rate", "disc.theta_rate", "disc.psi_rate"), RATES, strict=True))
    scene.start.update({"contact.displacement_1": 0.1, "contact.displacement_2": -0.2})
    return scene


def force_of(disc: ExactDisc, motion: Any) -> Any:
    """Return the force at the contact, from the centre's acceleration along an exact motion."""
    step = 3e-4  # the fourth-order difference of the exact velocity is good to 1e-8

    def velocity(state: Any) -> Any:
        rates = disc.rates(state)
        return np.array([rates[6], rates[7], disc.radius * np.cos(state[0]) * rates[0]])

    found = []
    for state in motion.states.T:
        near = []
        for shift in (-2, -1, 1, 2):
            end = disc.motion([0.0, shift * step], (state[4], state[0], state[5]), _rates(state), state[6:8]).states[
                :, -1
            ]
            near.append(velocity(end))
        found.append((near[0] - 8.0 * near[1] + 8.0 * near[2] - near[3]) / (12.0 * step))
    return disc.mass * (np.array(found) + np.array([0.0, 0.0, disc.gravity]))


def _rates(state: Any) -> tuple[float, float, float]:
    return state[2], state[1], state[3] - state[2] * np.cos(state[0])


# -- the disc ------------------------------------------------------------------------------------------------------


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("form", "solver", "rtol", "error"),
    [
        ("reduced", "taylor", 1e-13, 1e-11),
        ("reduced", "explicit", 1e-12, 1e-9),
        ("reduced", "ida", 1e-13, 1e-8),
        ("dae", "ida", 1e-14, 1e-9),
    ],
)
@pytest.mark.parametrize("hole", [0.0, 0.5])
def test_a_tumbling_disc_is_exact(form: str, solver: str, rtol: float, error: float, hole: float) -> None:
    exact = hoop(0.5, 2.0) if hole else uniform_disc(0.5, 2.0)
    made = simulate(tumbling(hole=hole), form=form, solver=solver, rtol=rtol, outputs=31)
    motion = exact.motion(made.time, ANGLES, RATES, (0.1, -0.2))
    assert np.max(np.abs(vector(made, "disc.position") - motion.centre)) < error
    assert np.max(np.abs(vector(made, "contact.contact") - motion.contact)) < error
    assert np.max(np.abs(axes(made, "disc") - motion.orientation)) < 5.0 * error
    assert np.max(np.abs(vector(made, "disc.spin") - motion.omega)) < 30.0 * error
    assert made.energy.max_drift < 10.0 * error
    if form == "dae":
        assert made.constraint_max["velocity"] < 1e-12


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_forces_at_the_contact_of_a_disc(form: str) -> None:
    made = simulate(tumbling(), form=form, rtol=1e-13, outputs=7)
    exact = uniform_disc(0.5, 2.0)
    expected = force_of(exact, exact.motion(made.time, ANGLES, RATES))
    assert np.max(np.abs(vector(made, "contact.force") - expected)) < 2e-7
    assert np.max(np.abs(made["contact.normal_force"] - expected[:, 2])) < 2e-7
    assert np.max(np.abs(made["contact.friction_1"] - expected[:, 0])) < 2e-7
    assert np.max(np.abs(made["contact.friction_2"] - expected[:, 1])) < 2e-7
    assert np.max(np.abs(vector(made, "ground.force") - expected)) < 2e-7
    assert np.min(made["contact.normal_force"]) > 0.0


def test_index_1_drifts_and_projection_does_not() -> None:
    exact = uniform_disc(0.5, 2.0)
    for level in ("index1", "index1-projected"):
        made = simulate(tumbling(), form="dae", level=level, rtol=1e-9, outputs=11)
        motion = exact.motion(made.time, ANGLES, RATES, (0.1, -0.2))
        assert np.max(np.abs(vector(made, "disc.position") - motion.centre)) < 1e-5
        drift = made.constraint_max["velocity"]
        assert 1e-9 < drift < 1e-6 if level == "index1" else drift < 1e-13


@pytest.mark.parametrize("precession", [6.0, 15.0])
def test_steady_motion_leans_evenly_and_closes_its_circle(precession: float) -> None:
    made = simulate(RollingDiscScene(motion="steady", precession=precession), rtol=1e-12, t_end=2.0)
    exact = uniform_disc(0.1, 0.5)
    theta = made["disc.theta"][0]
    centre, contact = exact.circle(theta, precession)
    assert np.max(np.abs(made["disc.theta"] - theta)) < 1e-9
    assert np.max(np.abs(made["disc.phi"] - precession * made.time)) < 1e-8
    assert np.max(np.abs(np.hypot(made["disc.position.x"], made["disc.position.y"]) - centre)) < 1e-10
    assert np.max(np.abs(np.hypot(made["contact.contact.x"], made["contact.contact.y"]) - contact)) < 1e-10
    # Friction is the centripetal force, and the normal force the weight.
    assert np.max(np.abs(made["contact.normal_force"] - 0.5 * G)) < 1e-7
    inwards = np.hypot(made["contact.friction_1"], made["contact.friction_2"])
    assert np.max(np.abs(inwards - 0.5 * precession**2 * centre)) < 1e-7


def test_small_wobble_has_the_frequency_of_the_linear_theory() -> None:
    made = simulate(RollingDiscScene(fall=1e-4, t_end=3.0), rtol=1e-12, outputs=3001)
    exact = uniform_disc(0.1, 0.5)
    square = exact.lean_frequency_squared(np.radians(60.0), 6.0, made["disc.spin.z"][0])
    swing = made["disc.theta"] - np.radians(60.0)
    up = np.flatnonzero((swing[:-1] < 0.0) & (swing[1:] >= 0.0))
    at = made.time[up] - swing[up] * (made.time[1] - made.time[0]) / (swing[up + 1] - swing[up])
    period = np.mean(np.diff(at))
    assert abs(period * np.sqrt(square) / (2.0 * np.pi) - 1.0) < 1e-5


def test_eulers_disc_keeps_its_centre_at_rest() -> None:
    made = simulate(RollingDiscScene(motion="coin"), rtol=1e-12, t_end=1.0)
    assert np.max(np.abs(vector(made, "disc.position") - vector(made, "disc.position")[0])) < 1e-10
    assert abs(made["disc.phi_rate"][-1] ** 2 - 4.0 * G / (0.1 * np.sin(np.radians(60.0)))) < 1e-6


def test_a_wobbling_disc_is_not_a_steady_one() -> None:
    steady, wobbling = (simulate(RollingDiscScene(motion=motion)) for motion in ("steady", "wobble"))
    assert np.ptp(steady["disc.theta"]) < 1e-6
    assert np.ptp(wobbling["disc.theta"]) > 0.2


@pytest.mark.parametrize(("share", "is_stable"), [(1.1, True), (0.8, False)])
def test_upright_rolling_is_stable_when_it_is_fast(share: float, is_stable: bool) -> None:
    speed = share * 0.1 * uniform_disc(0.1, 0.5).upright_rolling_threshold()
    scene = RollingDiscScene(motion="straight", speed=speed)
    scene.start["disc.spin.y"] = 1e-6
    made = simulate(scene, rtol=1e-11, t_end=3.0)
    away = np.max(np.abs(made["disc.theta"] - 0.5 * np.pi))
    assert away < 1e-5 if is_stable else away > 1e-3


# -- the ball ------------------------------------------------------------------------------------------------------


@pytest.mark.sample(1)
@pytest.mark.parametrize(("form", "rtol", "error"), [("reduced", 1e-12, 1e-10), ("dae", 1e-12, 2e-9)])
def test_a_ball_on_a_turntable_goes_round_at_two_sevenths(form: str, rtol: float, error: float) -> None:
    made = simulate(RollingBall(spin=0.7), form=form, rtol=rtol, t_end=6.0)
    exact = TurntableBall(0.1, 1.0, 0.4 * 0.01, 3.0, (0.5, 0.0), (0.0, 0.3), spin=0.7)
    assert exact.circling == pytest.approx(6.0 / 7.0)
    flat = np.stack([made["ball.position.x"], made["ball.position.y"]], axis=-1)
    moving = np.stack([made["ball.velocity.x"], made["ball.velocity.y"]], axis=-1)
    assert np.max(np.abs(flat - exact.position(made.time))) < error
    assert np.max(np.abs(moving - exact.velocity(made.time))) < error
    assert np.max(np.abs(vector(made, "ball.angular_velocity") - exact.omega_world(made.time))) < 20.0 * error
    # The force at the contact turns with the velocity: m v' = m O_b e_z x v.
    v = exact.velocity(made.time)
    expected = exact.circling * np.stack([-v[:, 1], v[:, 0]], axis=-1)
    assert np.max(np.abs(vector(made, "contact.force")[:, :2] - expected)) < 1e-7
    assert np.max(np.abs(made["contact.normal_force"] - G)) < 1e-7


def test_a_hollow_ball_goes_round_faster() -> None:
    made = simulate(RollingBall(cavity=0.1), rtol=1e-12, t_end=4.0)
    exact = TurntableBall(0.1, 1.0, 2.0 / 3.0 * 0.01, 3.0, (0.5, 0.0), (0.0, 0.3))
    assert exact.circling == pytest.approx(6.0 / 5.0)
    assert np.max(np.abs(made["ball.position.x"] - exact.position(made.time)[:, 0])) < 1e-9


@pytest.mark.parametrize("name", ["rolling-disc", "rolling-ball"])
def test_states_and_speeds_are_as_few_as_rolling_leaves(name: str) -> None:
    from atwood_library.scenes import SCENES

    found = report(SCENES[name]())
    assert found.degrees_of_freedom == 3
    assert found.states["reduced"] == 2 + 4 + 3  # two displacements, a quaternion, the angular velocity


# -- rolling on what moves -----------------------------------------------------------------------------------------


def on_a_raft(part: Any, rolling: Any) -> Scene:
    """Return something that rolls on a heavy plate, which hangs in a ball joint and swings under it."""
    scene = Scene(space="space", t_end=1.0)
    ground, joint = scene.add("ground", lib.Ground()), scene.add("joint", lib.Spherical())
    raft = scene.add("raft", lib.RigidBody(mass=20.0, center=(0.0, 0.0, -0.5), moments=(2.0, 2.5, 3.0)))
    body, contact = scene.add("body", part), scene.add("contact", rolling)
    scene.connect(ground.frame, joint.a)
    scene.connect(joint.b, raft.frame)
    scene.connect(raft.frame, contact.a)
    scene.connect(contact.b, body.frame)
    scene.start.update({"raft.spin.x": 0.4, "raft.spin.y": -0.2, "raft.spin.z": 0.5})
    scene.start.update({"contact.displacement_1": 0.1, "contact.displacement_2": 0.05})
    scene.start.update({"body.phi": 0.3, "body.theta": 1.2, "body.psi": 0.0})
    scene.start.update({"body.spin.x": 2.0, "body.spin.y": 1.0, "body.spin.z": 3.0})
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", ["disc", "ball"])
def test_both_forms_agree_on_a_plane_that_swings(kind: str) -> None:
    def build() -> Scene:
        if kind == "ball":
            return on_a_raft(lib.Sphere(radius=0.1, mass=1.0), lib.RollingSphere(radius=0.1))
        return on_a_raft(lib.Disc(radius=0.2, mass=1.0, axis="z"), lib.RollingDisc(radius=0.2, axis=(0.0, 0.0, 1.0)))

    reduced, dae = (simulate(build(), form=form, rtol=1e-11, outputs=6) for form in ("reduced", "dae"))
    assert len(reduced.assembly.reduced.speeds) == 6
    assert not reduced.assembly.reduced.constraints
    assert reduced.energy.max_drift < 1e-8
    for path in reduced.paths:
        if path.endswith((".phi", ".psi", "_rate")):
            continue  # of the plate, which is level at first, they mean nothing
        size = max(1.0, float(np.max(np.abs(reduced[path]))))
        assert np.max(np.abs(reduced[path] - dae[path])) < 2e-7 * size, path


# -- bad input -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("radius", [0.0, -1.0, "2 kg"])
def test_a_radius_is_positive(radius: Any) -> None:
    for part in (lib.RollingDisc, lib.RollingSphere, lib.Wheel):
        with pytest.raises(ParameterError, match="radius"):
            part(radius=radius)


def test_a_disc_that_lies_flat_is_refused() -> None:
    with pytest.raises(ParameterError, match="inclination"):
        RollingDiscScene(inclination=0.0)
    with pytest.raises(ParameterError, match="precession"):
        RollingDiscScene(precession=0.0)


def test_what_has_no_orientation_cannot_roll() -> None:
    scene = Scene(space="space")
    ground, contact = scene.add("ground", lib.Ground()), scene.add("contact", lib.RollingSphere())
    mass = scene.add("mass", lib.PointMass())
    scene.connect(ground.frame, contact.a)
    scene.connect(contact.b, mass.point)
    for form in ("reduced", "dae"):
        with pytest.raises(AtwoodError, match=r"mass|contact"):
            simulate(scene, form=form)


def test_a_wheel_that_cannot_touch_is_refused() -> None:
    scene = Scene(space="space")
    ground, high = scene.add("ground", lib.Ground()), scene.add("high", lib.Ground(position=(0.0, 0.0, 2.0)))
    wheel = scene.add("wheel", lib.Wheel(radius=0.5, axial=0.1, transverse=0.05))
    scene.connect(ground.frame, wheel.ground)
    scene.connect(high.frame, wheel.axle)
    for form in ("reduced", "dae"):
        with pytest.raises((StartError, AtwoodError), match=r"wheel\.contact"):
            simulate(scene, form=form)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_disc_that_starts_flat_is_named(form: str) -> None:
    scene = Scene(space="space")
    ground, contact = scene.add("ground", lib.Ground()), scene.add("contact", lib.RollingDisc(axis=(0.0, 0.0, 1.0)))
    disc = scene.add("disc", lib.Disc(axis="z"))
    scene.connect(ground.frame, contact.a)
    scene.connect(contact.b, disc.frame)
    with pytest.raises(StartError, match=r"contact: the law 'rolling' has no value"):
        simulate(scene, form=form)


@pytest.mark.sample(1)
@pytest.mark.parametrize("orientation", ["euler-yxz", "euler-zyz"])
def test_three_coordinates_of_orientation_do_as_well(orientation: str) -> None:
    made = simulate(assemble(tumbling(), orientation=orientation), rtol=1e-12, outputs=11)
    motion = uniform_disc(0.5, 2.0).motion(made.time, ANGLES, RATES, (0.1, -0.2))
    assert len(made.assembly.reduced.coordinates) == 5
    assert np.max(np.abs(vector(made, "disc.position") - motion.centre)) < 1e-10


# -- wheels --------------------------------------------------------------------------------------------------------


def cart(lead: float) -> Scene:
    """Return a cart on two wheels on one axle, its centre of mass before the axle, its nose sliding on the ground."""
    scene = Scene(space="space", t_end=2.0)
    ground = scene.add("ground", lib.Ground())
    body = scene.add("cart", lib.RigidBody(mass=5.0, center=(lead, 0.0, 0.0), moments=(0.2, 0.3, 0.4)))
    for name, place in (("left", 0.3), ("right", -0.3)):
        wheel = scene.add(name, lib.Wheel(radius=0.2, mass=0.5, axial=0.01, transverse=0.005))
        end = scene.add(f"{name}_end", lib.Weld(displacement=(0.0, place, 0.0)))
        scene.connect(body.frame, end.a)
        scene.connect(end.b, wheel.axle)
        scene.connect(ground.frame, wheel.ground)
    nose, skid = scene.add("nose", lib.Weld(displacement=(0.5, 0.0, -0.2))), scene.add("skid", lib.PointOnPlane())
    scene.connect(body.frame, nose.a)
    scene.connect(nose.b, skid.b)
    scene.connect(ground.frame, skid.a)
    scene.guess["cart.position.z"] = 0.2
    scene.start.update({"left.bearing.angular_velocity": 5.0, "right.bearing.angular_velocity": 4.0})
    return scene


@pytest.mark.sample(0)
def test_a_cart_on_two_wheels_goes_round_when_it_is_balanced() -> None:
    """Both wheels keep their rates, as they must in a circle: v = r (w_l + w_r)/2, W = r (w_r - w_l)/(2 b)."""
    for form in ("reduced", "dae"):
        made = simulate(cart(0.0), form=form, rtol=1e-11, outputs=11)
        speed, turning = 0.2 * 4.5, 0.2 * (4.0 - 5.0) / 0.6
        x, y = made["cart.position.x"], made["cart.position.y"]
        way = turning * made.time + np.arctan2(made["cart.velocity.y"][0], made["cart.velocity.x"][0])
        assert np.max(np.abs(made["cart.velocity.x"] - speed * np.cos(way))) < 1e-7
        assert (
            np.max(
                np.abs(np.hypot(x - x[0], y - y[0]) - abs(2.0 * speed / turning * np.sin(0.5 * turning * made.time)))
            )
            < 1e-7
        )
        sideways = made["left.contact.friction_1"] + made["right.contact.friction_1"]
        assert np.max(np.abs(sideways + 6.0 * speed * turning * np.sin(way))) < 1e-6
        weight = sum(made[f"{name}.contact.normal_force"] for name in ("left", "right")) + made["skid.normal_force"]
        assert np.max(np.abs(weight - 6.0 * G)) < 1e-7
    found = report(cart(0.0))
    assert found.degrees_of_freedom == 2
    assert found.integrated == ()


def test_a_cart_straightens_like_a_sleigh() -> None:
    """With its centre of mass before the axle it is Chaplygin's sleigh: ``M v' = m a W^2``, ``J W' = -m a v W``."""
    from scipy.integrate import solve_ivp

    lead, wheels = 0.1, 2.0 * (0.5 + 0.01 / 0.2**2)
    inertia = 0.4 + 5.0 * lead**2 + 2.0 * 0.005 + wheels * 0.3**2
    start = (0.2 * 4.5, 0.2 * (4.0 - 5.0) / 0.6)

    def rates(_: float, y: Any) -> tuple[float, float]:
        return 5.0 * lead * y[1] ** 2 / (5.0 + wheels), -5.0 * lead * y[0] * y[1] / inertia

    made = simulate(cart(lead), rtol=1e-11, outputs=11)
    exact = solve_ivp(rates, (0.0, 2.0), start, method="DOP853", t_eval=made.time, rtol=1e-12, atol=1e-13).y
    assert np.max(np.abs(made["cart.angular_velocity.z"] - exact[1])) < 1e-7
    forward = 0.1 * (made["left.bearing.angular_velocity"] + made["right.bearing.angular_velocity"])
    assert np.max(np.abs(forward - exact[0])) < 1e-7


@pytest.mark.parametrize("level", ["ggl", "index1-projected"])
def test_a_wheel_that_rolls_on_a_body_and_is_pinned_to_it_turns_with_it(level: str) -> None:
    """Contact, rolling and pin hold the wheel four ways; which of them are better kept changes as all turns."""
    scene = Scene(space="plane")
    base, wheel = (scene.add(name, lib.RigidBody(mass=1.0, moments=(0.3, 0.3, 0.3))) for name in ("base", "wheel"))
    contact, pin = scene.add("contact", lib.RollingDisc(radius=0.5)), scene.add("pin", lib.Pivot())
    on_base = scene.add("on_base", lib.Weld(displacement=(0.3, 0.0, 0.9)))
    on_wheel = scene.add("on_wheel", lib.Weld(displacement=(0.3, 0.0, 0.4)))
    ends: list[tuple[Any, Any]] = [
        (base, contact.a),
        (contact.b, wheel),
        (base, on_base.a),
        (wheel, on_wheel.a),
        (on_base.b, pin.a),
    ]
    for a, b in [*ends, (on_wheel.b, pin.b)]:
        scene.connect(getattr(a, "frame", a), getattr(b, "frame", b))
    scene.guess["wheel.position.z"] = 0.5
    scene.start["base.angular_speed"] = 3.0
    result = simulate(scene, form="dae", level=level, t_end=2.0, outputs=21, rtol=1e-8)
    for body in ("base", "wheel"):
        assert np.max(np.abs(result.array(f"{body}.angle") - 3.0 * result.time)) < 1e-5
