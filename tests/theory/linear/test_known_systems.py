"""Linear models of library scenes against closed forms, and of mechanisms against differences."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import scipy.optimize

from atwood import Scene, linearize, simulate, trim
from atwood.simulation.dynamics.balance import balance_of
from atwood.theory.linear.displacements import find_minimal
from atwood.theory.linear.operating_point import find_operating_point
from atwood_library import Ground, Pivot, RigidBody, Weld
from atwood_library.scenes import AndrewsSqueezer, CartPole, FlyballGovernor, QuarterCar, StewartPlatform


def arm() -> Scene:
    """Return an arm of six hinges, each across or along the link before it, with bodies of unequal inertia."""
    scene = Scene(space="space", gravity=9.81)
    frame = scene.add("ground", Ground()).frame
    axes = [(0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0)]
    lengths = [0.3, 0.6, 0.5, 0.2, 0.2, 0.1]
    for k, (axis, length) in enumerate(zip(axes, lengths, strict=True)):
        joint = scene.add(f"joint{k}", Pivot(axis=axis))
        body = scene.add(
            f"link{k}",
            RigidBody(
                mass=3.0 / (k + 1),
                center=(0.5 * length, 0.01 * k, 0.02),
                moments=(0.010 / (k + 1), 0.013 / (k + 1), 0.015 / (k + 1)),
                products=(0.001 / (k + 1), -0.0005 / (k + 1), 0.0002),
            ),
        )
        end = scene.add(f"end{k}", Weld(displacement=(length, 0.0, 0.0)))
        scene.connect(frame, joint.a)
        scene.connect(joint.b, body.frame)
        scene.connect(joint.b, end.a)
        frame = end.b
        scene.start[f"joint{k}.angle"] = 0.4 - 0.3 * k
        scene.start[f"joint{k}.angular_velocity"] = 0.5 + 0.2 * k
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("make", "time", "drives"),
    [
        (arm, 0.05, ["joint1.motor", "joint4.motor"]),
        (AndrewsSqueezer, 0.005, []),
        (StewartPlatform, 0.01, ["leg0.actuator"]),
    ],
)
def test_mechanisms_against_differences(make: Callable[[], Scene], time: float, drives: list[str]) -> None:
    scene = make()
    result = simulate(scene, t_end=time, outputs=2, rtol=1e-10)
    model = linearize(scene, at=(result, time), inputs=drives)
    point = find_operating_point(scene, (result, time), drives)
    own = point.scene
    minimal = find_minimal(own, own.flow(point.t, point.q, point.u, point.kept), point.kept)
    count, n = len(own.tangents), len(minimal.displacements)
    balance = balance_of(point.assembly, "reduced")

    def accelerations(column: int, step: float) -> np.ndarray:
        found = []
        for sign in (1.0, -1.0):
            change = sign * step * minimal.state[:, column]
            q, u = own.tangents.moved(point.q, change[:count]), point.u + change[count:]
            q, u = balance.project(point.t, q, u, own.sizes)
            found.append(own.flow(point.t, q, u, point.kept).variation.a[list(minimal.speeds)])
        return (found[0] - found[1]) / (2.0 * step)

    kept = linearize(scene, at=(result, time), inputs=drives, form="dae")
    for one, other in zip(model.matrices, kept.matrices, strict=True):
        assert np.max(np.abs(one - other), initial=0.0) <= 1e-9 * max(1.0, float(np.max(np.abs(one), initial=0.0)))
    size = float(np.max(np.abs(model.A[n:])))
    fast = max(1.0, float(np.max(np.abs(point.u))))
    for column in range(minimal.states):
        step = 1e-4 * (fast if column >= n else 1.0)
        # Richardson's extrapolation of two central differences.
        expected = (4.0 * accelerations(column, 0.5 * step) - accelerations(column, step)) / 3.0
        assert np.max(np.abs(expected - model.A[n:, column])) < 1e-7 * size
    for k, path in enumerate(drives):  # accelerations are linear in torques
        name = next(symbol.name for symbol in own.inputs if symbol.name.startswith(path))
        pushed = own.with_inputs({name: 1.0}).flow(point.t, point.q, point.u, point.kept).variation.a
        still = own.flow(point.t, point.q, point.u, point.kept).variation.a
        assert np.allclose((pushed - still)[list(minimal.speeds)], model.B[n:, k], rtol=1e-9, atol=1e-9)


def test_a_cart_and_pole_has_the_model_that_its_regulator_was_made_for() -> None:
    scene = CartPole()
    model = linearize(scene, at={"rail.displacement": 0.0, "hinge.angle": 0.5 * math.pi}, inputs=["push.value"])
    a, b = scene.linear_model()
    assert np.max(np.abs(model.A - a)) < 1e-12 * np.max(np.abs(a))
    assert np.max(np.abs(model.B - b)) < 1e-12

    class Read(CartPole):
        def linear_model(self) -> tuple[np.ndarray, np.ndarray]:
            return model.A, model.B

    # The regulator of the sampled model, from this one: the same gains.
    assert np.allclose(Read().gains(), scene.gains(), rtol=1e-9)


def test_a_quarter_of_a_car_has_its_transfer_function() -> None:
    scene = QuarterCar(height=0.0)
    model = linearize(scene, inputs=["road.motion"], outputs=["body.position.z"])
    assert model.inputs == ("road.motion''",)
    omega = np.array([0.5, 8.0, 30.0, 200.0])
    s = 1j * omega
    suspension = scene.spring_stiffness + scene.damping * s
    body, wheel = scene.body_mass * s**2 + suspension, scene.wheel_mass * s**2 + suspension + scene.tyre_stiffness
    known = scene.tyre_stiffness * suspension / (body * wheel - suspension**2)
    assert np.allclose(model.frequency_response(omega)[:, 0, 0] * s**2, known, rtol=1e-10)
    assert model.is_stable is True or model.spectrum.zeros == 2


@pytest.mark.parametrize("rate", [3.0, 5.0, 8.0])
def test_a_governor_stands_as_high_as_its_speed_says(rate: float) -> None:
    scene = FlyballGovernor()
    paths = ["guide.displacement", "right_hinge.angle", "left_hinge.angle"]
    found = trim(scene, at={"bearing.angular_velocity": rate}, free=paths).values
    g, along, across = 9.81, 1e-4 / 6.0, (1.0 + 1e-4) / 12.0

    def slopes(unknowns: np.ndarray) -> list[float]:
        """Return the derivatives of the potential in the turning frame by sleeve and arm angle, by hand."""
        s, phi = unknowns
        c, sine = math.cos(phi), math.sin(phi)
        dx, dz = 0.5 * c, 1.0 - 0.5 * sine - s  # from the eye to the middle of the arm
        length = math.hypot(dx, dz)
        pull = scene.stiffness * (length - 0.5) / length
        ball, bar = scene.ball_mass, scene.arm_mass
        by_s = scene.sleeve_mass * g - 2.0 * pull * dz
        weight = -g * (ball * c + 0.5 * bar * c)
        spring = pull * (-0.5 * sine * dx - 0.5 * c * dz)
        inertia = -2.0 * ball * (0.05 + c) * sine - bar * (0.05 + 0.5 * c) * sine
        inertia += 2.0 * bar * (along - across) * sine * c
        return [by_s, 2.0 * (weight + spring - 0.5 * rate**2 * inertia)]

    guess = [found["guide.displacement"] + 1e-3, found["right_hinge.angle"] + 1e-3]
    sleeve, angle = scipy.optimize.fsolve(slopes, guess, xtol=1e-11)
    assert found["guide.displacement"] == pytest.approx(sleeve, abs=1e-9)
    assert found["right_hinge.angle"] == pytest.approx(angle, abs=1e-9)
    assert found["left_hinge.angle"] == pytest.approx(angle, abs=1e-9)
