"""Linear models against hand-written ones, differences, and each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.optimize
from tests.theory.linear.scenes import bicycle, bicycle_matrix, disc, hoop

import atwood
from atwood import ParameterError, Scene, StartError, UsageError, absolute, linearize, simulate
from atwood.model.local.flatten import flatten
from atwood.simulation.dynamics.balance import balance_of
from atwood.theory.linear.displacements import find_minimal
from atwood.theory.linear.operating_point import OperatingPoint, find_operating_point
from atwood.theory.linear.variations import Flow
from atwood_library import (
    Damper,
    Drive,
    Ground,
    Mass1D,
    Spring,
)
from atwood_library.scenes import (
    BenchmarkBicycle,
    FourBarRow,
    FreeBody,
    LagrangeTop,
    PendulumOnCart,
    SliderCrank,
    StewartPlatform,
)


def four(model: atwood.LinearModel) -> np.ndarray:
    return model.spectrum.others


@pytest.mark.sample(1)
@pytest.mark.parametrize("heading", [0.0, 0.7, -2.9])
def test_the_benchmark_bicycle_has_its_published_eigenvalues(heading: float) -> None:
    assembly = atwood.assemble(bicycle(heading, (1.3, -0.4)))
    for speed in range(11):
        model = linearize(assembly, at={"rear_axle.angular_velocity": speed / 0.3})
        known = np.linalg.eigvals(bicycle_matrix(float(speed)))
        assert model.spectrum.zeros == len(model.states) - 4
        found = model.spectrum.others
        for value in known:
            assert np.min(np.abs(found - value)) < 1e-12 * np.max(np.abs(known)) * (10.0 if heading else 1.0)


def test_a_small_deviation_of_the_bicycle_moves_as_its_linear_model_says() -> None:
    scene = BenchmarkBicycle(lean_rate=1e-3, t_end=2.0)
    result = simulate(scene, rtol=1e-11, outputs=9)
    at = {"rear_axle.angular_velocity": scene.speed / 0.3}
    model = linearize(scene, at=at, outputs=["steer.angle"])
    values = result.array("steer.angle")
    # Every linear model fulfils its own recurrence (Cayley and Hamilton): here of the four motions that are not zero.
    poles = np.exp(model.spectrum.others * 0.25)
    recurrence = np.real(np.poly(np.append(poles, 1.0)))
    left = np.convolve(values, recurrence, mode="valid")
    assert np.max(np.abs(left)) < 1e-5 * np.max(np.abs(values)) * np.sum(np.abs(recurrence))


def test_weave_and_capsize_speeds_of_the_bicycle() -> None:
    assembly = atwood.assemble(bicycle())

    def largest(speed: float, oscillating: bool) -> float:
        values = four(linearize(assembly, at={"rear_axle.angular_velocity": speed / 0.3}))
        own = values[np.abs(values.imag) > 1.0] if oscillating else values[np.abs(values.imag) < 1e-6]
        return float(np.max(own.real))

    weave = scipy.optimize.brentq(lambda v: largest(v, True), 4.2, 4.4, xtol=1e-11)
    capsize = scipy.optimize.brentq(lambda v: largest(v, False), 5.8, 6.2, xtol=1e-11)
    assert weave == pytest.approx(4.292382536, abs=1e-9)
    assert capsize == pytest.approx(6.024262015, abs=1e-9)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("hole", "factor"), [(0.0, 1.0 / 3.0), (0.2, 0.25)])
@pytest.mark.parametrize("heading", [0.0, 1.1])
def test_a_disc_that_rolls_falls_below_its_critical_speed(hole: float, factor: float, heading: float) -> None:
    critical = math.sqrt(factor * 9.81 * 0.2)
    for share in (0.99, 1.01):
        model = linearize(disc(0.2, hole, heading), at={"disc.spin.z": share * critical / 0.2})
        assert model.about == "steady motion"
        assert model.is_stable is (share > 1.0)
        assert model.spectrum.zeros == 6


def test_bodies_about_their_principal_axes() -> None:
    moments = FreeBody().moments
    j1, j2, j3 = sorted(moments)
    numbers = dict(zip(moments, "xyz", strict=True))
    for moment, others in ((j1, (j2, j3)), (j2, (j1, j3)), (j3, (j1, j2))):
        model = linearize(FreeBody(), at={f"body.spin.{numbers[moment]}": 1.7})
        square = 1.7**2 * (moment - others[0]) * (others[1] - moment) / (others[0] * others[1])
        expected = complex(square) ** 0.5
        assert np.min(np.abs(model.spectrum.others - expected)) < 1e-13 * 1.7
        assert model.is_stable is (square < 0.0)


def test_a_sleeping_top_is_stable_when_it_is_fast() -> None:
    top = LagrangeTop()

    # p_psi^2 > 4 I1 M g l (Goldstein, section 5.7), of the scene's own moments.
    def eigenvalues(spin: float) -> atwood.LinearModel:
        return linearize(top, at={"top.phi": 0.0, "top.theta": 0.0, "top.psi": 0.0, "top.spin.z": spin})

    across, axial = top_moments(top)
    critical = math.sqrt(4.0 * across * top.mass * top.gravity * top.height) / axial
    assert eigenvalues(1.001 * critical).is_stable
    assert not eigenvalues(0.999 * critical).is_stable


def top_moments(top: LagrangeTop) -> tuple[float, float]:
    """Return the moments about the tip, across and about the axis."""
    return top.transverse + top.mass * top.height**2, top.axial


def test_a_top_that_precesses_steadily_is_a_steady_motion() -> None:
    top = LagrangeTop()
    across, axial = top_moments(top)
    theta, spin = 0.6, 60.0
    # I1 phi'^2 cos(theta) - I3 w3 phi' + M g l = 0 (Goldstein, equation 5.73)
    roots = np.roots([across * math.cos(theta), -axial * spin, top.mass * top.gravity * top.height])
    rate = float(np.min(np.abs(roots)))
    at = {
        "top.phi": 0.3,
        "top.theta": theta,
        "top.psi": 0.9,
        "top.phi_rate": rate,
        "top.theta_rate": 0.0,
        "top.psi_rate": spin - rate * math.cos(theta),
    }
    model = linearize(top, at=at)
    assert model.about == "steady motion"
    # Nutation about steady precession, from the second derivative of the effective potential.
    p_psi, p_phi = axial * spin, across * rate * math.sin(theta) ** 2 + axial * spin * math.cos(theta)

    def slope(x: float) -> float:
        u = math.cos(x)
        lift = p_phi - p_psi * u
        force = lift * (p_psi - p_phi * u) / (across * math.sin(x) ** 3)
        return force - top.mass * top.gravity * top.height * math.sin(x)

    step = 1e-5
    square = (slope(theta + step) - slope(theta - step)) / (2.0 * step) / across
    oscillating = model.spectrum.others[np.abs(model.spectrum.others) > 1e-6]
    assert np.min(np.abs(oscillating - 1j * math.sqrt(square))) < 1e-6 * math.sqrt(square)


@pytest.mark.parametrize("rate", [2.0, 5.0])
def test_a_bead_on_a_driven_hoop(rate: float) -> None:
    radius = 0.8
    bottom = linearize(hoop(rate, radius), at={"pivot.angle": 0.0})
    square = 9.81 / radius - rate**2
    assert np.min(np.abs(bottom.eigenvalues - 1j * complex(square) ** 0.5)) < 1e-13 * rate
    assert bottom.about == "rest"


@pytest.mark.sample(0)
def test_forms_agree_and_reactions_are_outputs() -> None:
    scenes = [
        (PendulumOnCart(), {"rod.angle": math.pi}, ["rail.actuator"], ["rod.tension", "bob.position.x"]),
        (bicycle(0.4), {"rear_axle.angular_velocity": 12.0}, ["steer.motor"], ["frame.position.y"]),
        (disc(0.2, 0.05, 0.3), {"disc.spin.z": 20.0}, [], ["disc.position.x"]),
        (hoop(4.0), {"pivot.angle": 0.0}, ["pivot.motor"], ["bead.position.z"]),
    ]
    for scene, at, inputs, outputs in scenes:
        reduced, dae = (linearize(scene, at=at, inputs=inputs, outputs=outputs, form=f) for f in ("reduced", "dae"))
        for one, other in zip(reduced.matrices, dae.matrices, strict=True):
            assert np.max(np.abs(one - other), initial=0.0) <= 1e-9 * max(1.0, float(np.max(np.abs(one), initial=0.0)))
    # The rod of a pendulum at rest carries the weight: no first order change with the angle; the cart's push does none.
    model = linearize(PendulumOnCart(), at={"rod.angle": 0.0}, outputs=["rod.tension"])
    assert np.max(np.abs(model.C)) < 1e-12


def test_of_a_drive_the_acceleration_is_the_input() -> None:
    scene = Scene(space="line", gravity=0.0)
    ground, drive = scene.add("ground", Ground()), scene.add("drive", Drive())
    mass, spring = scene.add("mass", Mass1D(mass=2.0)), scene.add("spring", Spring(stiffness=50.0, natural_length=1.0))
    damper = scene.add("damper", Damper(damping=3.0))
    scene.connect(ground.frame, drive.a)
    for one in (spring, damper):
        scene.connect(drive.b, one.a)
        scene.connect(one.b, mass.flange)
    scene.start["mass.displacement"] = 1.0
    model = linearize(scene, inputs=["drive.motion"], outputs=["mass.displacement"])
    assert model.inputs == ("drive.motion''",)
    assert model.states[-2:] == ("drive.motion", "drive.motion'")
    omega = np.array([0.3, 5.0, 40.0])
    known = (50.0 + 3j * omega) / (50.0 + 3j * omega - 2.0 * omega**2) / (-(omega**2))
    assert np.allclose(model.frequency_response(omega)[:, 0, 0], known, rtol=1e-12)
    assert model.B[-1, 0] == 1.0


@pytest.mark.sample(0)
def test_closed_loops_in_space_against_differences() -> None:
    """Of the platform on six legs, driven accelerations are compared with differences of them, leg by leg."""
    platform = StewartPlatform()
    inputs = [path for path in input_names(platform) if path.endswith("actuator")][:2]
    result = simulate(platform, t_end=0.01, outputs=2)
    model = linearize(platform, at=(result, 0.01), inputs=inputs)
    point = find_operating_point(platform, (result, 0.01), inputs)
    scene, minimal = point.scene, find_minimal(point.scene, flow_at(point), point.kept)
    step = 1e-6
    n = len(minimal.displacements)
    for column in range(minimal.states):
        moved = []
        for sign in (1.0, -1.0):
            change = sign * step * minimal.state[:, column]
            q = scene.tangents.moved(point.q, change[: len(scene.tangents)])
            u = point.u + change[len(scene.tangents) :]
            q, u = balance_of(point.assembly, "reduced").project(point.t, q, u, scene.sizes)
            flow = scene.flow(point.t, q, u, point.kept)
            moved.append(flow.variation.a[list(minimal.speeds)])
        found = (moved[0] - moved[1]) / (2.0 * step)
        own = model.A[n:, column]
        assert np.max(np.abs(found - own)) < 1e-6 * max(1.0, float(np.max(np.abs(model.A[n:]))))


def flow_at(point: OperatingPoint) -> Flow:
    return point.scene.flow(point.t, point.q, point.u, point.kept)


def input_names(scene: Scene) -> list[str]:
    flat = flatten(scene)
    return [f"{path}.{name}" for path, part in flat.parts.items() for name in part.signals]


def test_singular_positions_have_no_linear_model() -> None:
    with pytest.raises(StartError, match="singular position"):
        linearize(FourBarRow(windows=1), at={"crank[0].angle": math.pi})
    beside = linearize(FourBarRow(windows=1), at={"crank[0].angle": 0.5 * math.pi})
    assert len(beside.states) == 2


def test_a_state_of_a_run_is_linearised_in_its_own_frame() -> None:
    scene = SliderCrank()
    result = simulate(scene, t_end=0.4, outputs=5)
    model = linearize(scene, at=(result, float(result.time[2])))
    assert model.about == "motion"
    assert len(model.states) == 2
    with pytest.raises(UsageError, match="no output"):
        linearize(scene, at=(result, 0.1234567))


def test_questions_without_an_answer() -> None:
    with pytest.raises(UsageError, match="neither at rest nor a steady motion"):
        linearize(PendulumOnCart(), at={"rod.angle": 0.3})
    with pytest.raises(ParameterError, match="no such input"):
        linearize(PendulumOnCart(), at={"rod.angle": 0.0}, inputs=["rail.actuatr"])
    with pytest.raises(ParameterError, match="no such quantity"):
        linearize(PendulumOnCart(), at={"rod.angle": 0.0}, outputs=["rod.angel"])
    with pytest.raises(StartError):
        linearize(PendulumOnCart(), at={"rod.angel": 0.0})
    with pytest.raises(UsageError):
        linearize(PendulumOnCart(), at=3)
    with pytest.raises(UsageError, match="as many"):
        linearize(PendulumOnCart(), at={"rod.angle": 0.0}).zeros()


class Rubbing(atwood.Component):
    """A force against the velocity of a point, with a corner at rest."""

    power: int = atwood.parameter(1, integer=True, doc="Power of the speed.")
    point: atwood.Point = atwood.connector(atwood.Point, "What is held back.")

    @atwood.force
    def push(self) -> list[atwood.Load]:
        """Return the force."""
        v = self.point.velocity
        size = absolute(v.x)
        # |v| has a corner at rest, |v| v has none.
        return [atwood.Load(self.point, v * (-size) if self.power == 2 else atwood.Vector(-size, 0.0, 0.0))]


@pytest.mark.parametrize("power", [1, 2])
def test_a_switch_is_refused_where_derivatives_jump_and_nowhere_else(power: int) -> None:
    scene = Scene(space="line", gravity=0.0)
    mass, rubbing = scene.add("mass", Mass1D(mass=1.0)), scene.add("rubbing", Rubbing(power=power))
    scene.connect(rubbing.point, mass.flange)
    if power == 2:
        assert linearize(scene).spectrum.zeros == 2
    else:
        with pytest.raises(UsageError, match="switches here"):
            linearize(scene)
