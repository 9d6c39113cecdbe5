"""Central gravity: Kepler's orbits, two bodies, and the gravity gradient on a satellite."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

import atwood_library as lib
from atwood import Result, Scene, TopologyError, assemble, simulate

from ..helpers.runs import FORMS


def kepler(e: float, t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return position and velocity on an orbit with mu = a = 1 from perihelion (Goldstein, section 3.8)."""
    anomaly = t + e * np.sin(t)
    for _ in range(60):
        anomaly = anomaly - (anomaly - e * np.sin(anomaly) - t) / (1.0 - e * np.cos(anomaly))
    b, r = math.sqrt(1.0 - e * e), 1.0 - e * np.cos(anomaly)
    return np.stack([np.cos(anomaly) - e, b * np.sin(anomaly), -np.sin(anomaly) / r, b * np.cos(anomaly) / r], axis=1)


def orbit(e: float, space: str = "space") -> Scene:
    """Return a planet at its perihelion, in the x-y plane in space and in the x-z plane in a plane."""
    scene = Scene(space=space, gravity=0.0)
    sun, planet = scene.add("sun", lib.Ground()), scene.add("planet", lib.PointMass(mass=2.5))
    pull = scene.add("pull", lib.CentralGravity(gravitational_parameter=1.0))
    scene.connect(sun.frame, pull.source)
    scene.connect(pull.point, planet.point)
    up = "y" if space == "space" else "z"
    scene.start.update({"planet.position.x": 1.0 - e, f"planet.velocity.{up}": math.sqrt((1.0 + e) / (1.0 - e))})
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("space", "e"), [("space", 0.5), ("space", 0.9), ("plane", 0.5)])
def test_kepler(space: str, e: float, form: str) -> None:
    result = simulate(orbit(e, space), form=form, t_end=20.0, rtol=1e-12, outputs=41)
    up = "y" if space == "space" else "z"
    found = np.stack([result[f"planet.{p}.{k}"] for p in ("position", "velocity") for k in ("x", up)], axis=1)
    exact = kepler(e, result.time)
    assert np.max(np.abs(found[:, :2] - exact[:, :2])) < (5e-8 if e < 0.8 else 1e-6)
    assert result.energy.max_drift < (1e-8 if e < 0.8 else 1e-7)
    momentum = found[:, 0] * found[:, 3] - found[:, 1] * found[:, 2]
    assert np.allclose(momentum, math.sqrt(1.0 - e * e), atol=1e-9)
    assert np.allclose(result["pull.distance_apart"] ** 2 * result["pull.pull"], 1.0, atol=1e-12)
    distance = np.linalg.norm(found[:, :2], axis=1)
    assert np.allclose(result["sun.force.x"], -2.5 * found[:, 0] / distance**3, rtol=1e-9)


def test_two_bodies_go_round_their_centre_of_mass() -> None:
    """Masses M and m with mu = G M attract each other; the distance moves as with mu (1 + m/M)."""
    heavy, light = 3.0, 1.0
    scene = Scene(space="space", gravity=0.0)
    one, other = scene.add("one", lib.PointMass(mass=heavy)), scene.add("other", lib.PointMass(mass=light))
    pull = scene.add("pull", lib.CentralGravity(gravitational_parameter=heavy / (heavy + light)))
    scene.connect(one.point, pull.source)
    scene.connect(pull.point, other.point)
    e = 0.3
    speed = math.sqrt((1.0 + e) / (1.0 - e))
    scene.start.update({"one.position.x": 0.0, "other.position.x": 1.0 - e, "other.velocity.y": speed})
    result = simulate(scene, t_end=10.0, rtol=1e-11, outputs=21)
    exact = kepler(e, result.time)
    for number, axis in enumerate("xy"):
        apart = result[f"other.position.{axis}"] - result[f"one.position.{axis}"]
        assert np.allclose(apart, exact[:, number], atol=1e-8)
        momentum = heavy * result[f"one.velocity.{axis}"] + light * result[f"other.velocity.{axis}"]
        assert np.allclose(momentum, momentum[0], atol=1e-11)


# -- the gravity gradient ---------------------------------------------------------------------------------------------

MU, RADIUS = 1.0, 1.0
SIZE = 1e-4
"""Of the satellite, over the radius: squares of it are the effect of its size on its orbit."""
MASS = 1.0
PITCH, ROLL, YAW = 2.0, 1.8, 0.9
"""Moments about the orbit's normal, the way of flight and the vertical, in units of mass times size squared."""


def satellite(space: str, attracts: str = "body", **start: float) -> Scene:
    """Return a satellite on a circular orbit; its x axis is away from the earth, y along its way (z in a plane).

    In space it goes round in the x-y plane, in a plane in the x-z plane, counter-clockwise.
    """
    unit = MASS * SIZE**2
    across = (YAW * unit, ROLL * unit, PITCH * unit) if space == "space" else (YAW * unit, PITCH * unit, ROLL * unit)
    scene = Scene(space=space, gravity=0.0)
    earth = scene.add("earth", lib.Ground())
    craft = scene.add("craft", lib.RigidBody(mass=MASS, moments=across))
    pull = scene.add("pull", lib.CentralGravity(gravitational_parameter=MU, attracts=attracts))
    scene.connect(earth.frame, pull.source)
    scene.connect(pull.frame if attracts == "body" else pull.point, craft.frame)
    way = "y" if space == "space" else "z"
    scene.start.update({"craft.position.x": RADIUS, f"craft.velocity.{way}": math.sqrt(MU / RADIUS), **start})
    return scene


def crossings(t: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the times of upward crossings of zero, by a straight line between samples."""
    at = np.nonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))[0]
    return t[at] - values[at] * (t[at + 1] - t[at]) / (values[at + 1] - values[at])


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_pitch_librates_with_the_frequency_of_a_textbook(space: str, form: str) -> None:
    """``n sqrt(3 (J_roll - J_yaw)/J_pitch)`` (Hughes, Spacecraft Attitude Dynamics, section 9.3)."""
    swing = 1e-3
    spin = {"craft.spin.z": 1.0 + swing} if space == "space" else {"craft.angular_speed": 1.0 + swing}
    result = simulate(satellite(space, **spin), form=form, t_end=40.0, rtol=1e-11, outputs=801)
    if space == "space":
        heading = np.unwrap(np.arctan2(result["craft.x_axis.y"], result["craft.x_axis.x"]))
        place = np.unwrap(np.arctan2(result["craft.position.y"], result["craft.position.x"]))
    else:
        heading = result["craft.angle"]
        place = np.unwrap(np.arctan2(result["craft.position.z"], result["craft.position.x"]))
    wanted = math.sqrt(3.0 * (ROLL - YAW) / PITCH)
    pitch = heading - place
    assert np.max(np.abs(pitch - swing / wanted * np.sin(wanted * result.time))) < 2e-6 * swing / 1e-3
    times = crossings(result.time, pitch)
    period = (times[-1] - times[0]) / (len(times) - 1)
    assert 2.0 * math.pi / period == pytest.approx(wanted, rel=1e-5)


def momenta(result: Result) -> NDArray[np.float64]:
    def vector(path: str) -> NDArray[np.float64]:
        return np.stack([result[f"{path}.{axis}"] for axis in "xyz"], axis=1)

    orbital = MASS * np.cross(vector("craft.position"), vector("craft.velocity"))
    return np.asarray(orbital + vector("craft.angular_momentum"))


@pytest.mark.parametrize("form", FORMS)
def test_a_large_body_keeps_energy_and_angular_momentum(form: str) -> None:
    """A body of a fifth of its distance, tumbling: spin and orbit exchange both, and the sums stay."""
    scene = Scene(space="space", gravity=0.0)
    moments, products, center = (0.03, 0.05, 0.04), (0.004, -0.003, 0.002), (0.02, -0.05, 0.1)
    earth = scene.add("earth", lib.Ground())
    craft = scene.add("craft", lib.RigidBody(mass=MASS, moments=moments, products=products, center=center))
    pull = scene.add("pull", lib.CentralGravity(gravitational_parameter=MU, attracts="body"))
    scene.connect(earth.frame, pull.source)
    scene.connect(pull.frame, craft.frame)
    scene.start.update({"craft.position.x": 1.0, "craft.velocity.y": 1.1, "craft.spin.x": 0.5, "craft.spin.y": -0.8})
    result = simulate(scene, form=form, t_end=12.0, rtol=1e-11, outputs=25)
    assert result.energy.max_drift < 1e-8
    total = momenta(result)
    assert np.allclose(total, total[0], atol=1e-8)
    turning = np.stack([result[f"craft.angular_momentum.{axis}"] for axis in "xyz"], axis=1)
    assert np.max(np.abs(turning - turning[0])) > 0.01


def test_the_torque_is_three_mu_over_r_cubed_e_cross_j_e() -> None:
    scene = satellite("space", **{"craft.phi": 0.4, "craft.theta": 0.7, "craft.psi": -0.3})
    result = simulate(scene, t_end=1e-6, outputs=2, rtol=1e-12)
    axes = np.array([[result[f"craft.{name}_axis.{k}"][0] for name in "xyz"] for k in "xyz"])
    tensor = axes @ np.diag(np.array([YAW, ROLL, PITCH]) * MASS * SIZE**2) @ axes.T
    e = np.array([1.0, 0.0, 0.0])
    wanted = 3.0 * MU / RADIUS**3 * np.cross(e, tensor @ e)
    rate = [(result[f"craft.angular_momentum.{k}"][1] - result[f"craft.angular_momentum.{k}"][0]) / 1e-6 for k in "xyz"]
    assert np.allclose(rate, wanted, rtol=1e-4, atol=1e-5 * np.max(np.abs(wanted)))


def test_a_point_feels_no_gradient() -> None:
    scene = satellite("space", attracts="point", **{"craft.spin.z": 0.0, "craft.theta": 0.5})
    result = simulate(scene, t_end=5.0, rtol=1e-10, outputs=6)
    assert np.allclose(result["craft.x_axis.z"], result["craft.x_axis.z"][0], atol=1e-12)


# Closed form evaluated with many digits (shared/reference/kepler.json).
VALUES = [
    (0.5, 20.0, (-0.57804329530353612, 0.863384000919419280, -0.95950837303807273, -0.06504915126712090)),
    (0.5, 100.0, (0.095804130837071883, -0.69553078886423927, 1.143899927350798790, 0.734913873934409964)),
    (0.9, 20.0, (-1.29526625098757436, 0.400393896379232152, -0.67753909247075658, -0.12708381542786861)),
    (0.9, 100.0, (-0.75063333302964519, -0.43100002757732133, 1.142347674435413689, 0.075219128096267149)),
    (0.99, 20.0, (-1.43813249315433711, 0.126109585855824743, -0.61924041729991485, -0.04378957260582536)),
    (0.99, 100.0, (-0.93889732733174077, -0.14088304186536646, 1.051911330418050984, 0.007593064755590507)),
]


@pytest.mark.parametrize(("e", "t", "values"), VALUES)
def test_the_exact_orbit_meets_the_reference_values(e: float, t: float, values: tuple[float, ...]) -> None:
    assert np.allclose(kepler(e, np.array([t]))[0], values, rtol=1e-11, atol=1e-11)


def test_a_satellite_is_small_beside_its_orbit() -> None:
    """In metres and kilogrammes: its moments are nothing beside those of the orbit, and yet it turns."""
    mu, radius = 3.986004418e14, 6.878e6
    scene = Scene(space="plane", gravity=0.0)
    earth = scene.add("earth", lib.Ground())
    craft = scene.add("craft", lib.RigidBody(mass=4.0, moments=(0.01, 0.03, 0.035)))
    pull = scene.add("pull", lib.CentralGravity(attracts="body"))
    scene.connect(earth.frame, pull.source)
    scene.connect(pull.frame, craft.frame)
    rate = math.sqrt(mu / radius**3)
    scene.start.update({"craft.position.x": radius, "craft.velocity.z": rate * radius})
    scene.start.update({"craft.angle": 0.01, "craft.angular_speed": rate})
    result = simulate(scene, t_end=2.0 * math.pi / rate, rtol=1e-11, outputs=41)
    pitch = result["craft.angle"] - np.unwrap(np.arctan2(result["craft.position.z"], result["craft.position.x"]))
    wanted = 0.01 * np.cos(rate * math.sqrt(3.0 * (0.035 - 0.01) / 0.03) * result.time)
    assert np.allclose(pitch, wanted, atol=2e-6)


# -- what is attracted belongs to the body ----------------------------------------------------------------------------


def falling(space: str, form: str, *, attracts: str) -> Result:
    """Let a body fall that is made of two welded ones, of 5 kg in all, one of them off the frame."""
    scene = Scene(space=space, gravity=0.0)
    earth = scene.add("earth", lib.Ground())
    craft = scene.add("craft", lib.RigidBody(mass=3.0, moments=(0.3, 0.5, 0.4), center=(0.1, 0.0, 0.05)))
    weld = scene.add("weld", lib.Weld(displacement=(0.4, 0.0, 0.2), angle=0.6))
    box = scene.add("box", lib.RigidBody(mass=2.0, moments=(0.1, 0.2, 0.15), center=(0.0, 0.0, -0.1)))
    pull = scene.add("pull", lib.CentralGravity(gravitational_parameter=MU, attracts=attracts))
    scene.connect(earth.frame, pull.source)
    scene.connect(pull.frame if attracts == "body" else pull.point, craft.frame)
    scene.connect(craft.frame, weld.a)
    scene.connect(weld.b, box.frame)
    scene.start.update({"craft.position.x": 4.0, "craft.position.z": 1.0})
    scene.start.update({"craft.angle" if space == "plane" else "craft.theta": 0.3})
    return simulate(scene, form=form, t_end=1.0, rtol=1e-11, outputs=5)


def as_one(result: Result) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Return mass, centre of mass and tensor of the two bodies, in the axes of the first, by hand."""
    turn = 0.6  # counter-clockwise, that is about -y
    c, s = math.cos(turn), math.sin(turn)
    axes = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    centers = [np.array([0.1, 0.0, 0.05]), np.array([0.4, 0.0, 0.2]) + axes @ np.array([0.0, 0.0, -0.1])]
    tensors = [np.diag([0.3, 0.5, 0.4]), axes @ np.diag([0.1, 0.2, 0.15]) @ axes.T]
    masses = [3.0, 2.0]
    center = (3.0 * centers[0] + 2.0 * centers[1]) / 5.0
    total = np.zeros((3, 3))
    for m, at, tensor in zip(masses, centers, tensors, strict=True):
        r = at - center
        total += tensor + m * (r @ r * np.eye(3) - np.outer(r, r))
    return 5.0, center, total


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_mass_and_inertia_are_those_of_all_that_is_welded_together(space: str, form: str) -> None:
    result = falling(space, form, attracts="body")
    mass, center, tensor = as_one(result)
    axes = {
        "plane": lambda i: np.array(
            [
                [math.cos(result["craft.angle"][i]), 0.0, -math.sin(result["craft.angle"][i])],
                [0.0, 1.0, 0.0],
                [math.sin(result["craft.angle"][i]), 0.0, math.cos(result["craft.angle"][i])],
            ]
        ),
        "space": lambda i: np.array([[result[f"craft.{n}_axis.{k}"][i] for n in "xyz"] for k in "xyz"]),
    }[space](0)
    place = np.array([4.0, 0.0, 1.0]) + axes @ (center - np.array([0.1, 0.0, 0.05]))
    r = float(np.linalg.norm(place))
    e = place / r
    turned = axes @ tensor @ axes.T
    wanted = -MU * mass / r - 0.5 * MU / r**3 * (np.trace(tensor) - 3.0 * e @ turned @ e)
    assert result["pull.potential_energy"][0] == pytest.approx(wanted, rel=1e-12)
    assert result["pull.distance_apart"][0] == pytest.approx(r, rel=1e-12)
    assert result.energy.max_drift < 1e-5


@pytest.mark.parametrize("space", ["line", "plane", "space"])
def test_a_body_falls_as_it_should_whatever_its_mass(space: str) -> None:
    for mass in (0.2, 1.0, 5.0):
        scene = Scene(space=space, gravity=0.0)
        earth, bob = scene.add("earth", lib.Ground()), scene.add("bob", lib.PointMass(mass=mass))
        pull = scene.add("pull", lib.CentralGravity(gravitational_parameter=2.0))
        scene.connect(earth.frame, pull.source)
        scene.connect(pull.point, bob.point)
        scene.start["bob.position.x"] = 2.0
        result = simulate(scene, t_end=0.1, outputs=2)
        assert result["bob.acceleration.x"][0] == pytest.approx(-0.5, rel=1e-9)


def test_other_values_of_the_mass_are_followed() -> None:
    scene = orbit(0.5)
    made = assemble(scene).with_values({"planet.mass": 10.0})
    result = simulate(made, t_end=1.0, outputs=3)
    assert np.allclose(result["planet.position.x"], kepler(0.5, result.time)[:, 0], atol=1e-7)


def test_what_has_no_mass_of_its_own_is_refused() -> None:
    scene = orbit(0.5)
    ground = scene.add("rock", lib.Ground(position=(3.0, 0.0, 0.0)))
    pull = scene.add("other", lib.CentralGravity())
    scene.connect(scene.sun.frame, pull.source)
    scene.connect(pull.point, ground.frame)
    with pytest.raises(TopologyError, match=r"other\.point: .* fixed to the world"):
        assemble(scene)
    scene = orbit(0.5, "plane")
    rod = scene.add("rod", lib.Rod(length=1.0, mass=0.5))
    far = scene.add("far", lib.PointMass())
    scene.connect(scene.planet.point, rod.a)
    scene.connect(rod.b, far.point)
    with pytest.raises(TopologyError, match=r"pull\.point: .* that of rod is spread between points"):
        assemble(scene)
