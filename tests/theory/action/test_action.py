"""The action of motions and paths, and Hamilton's principal function."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import (
    Scene,
    SolveError,
    UnsupportedError,
    UsageError,
    action,
    boundary_value_motions,
    connect,
    hamiltonian,
    simulate,
)
from atwood_library import Ground, Mass1D, Spring
from atwood_library.scenes import (
    ChargedParticle,
    DoublePendulum,
    DrivenPendulum,
    ElasticPendulum,
    FallingWithDrag,
    FourBar,
    LagrangeTop,
    Oscillators,
    SimplePendulum,
)


def pendulum(angle: float = 0.0, rate: float = 1.5) -> SimplePendulum:
    """Return a pendulum with m = l = g = 1."""
    scene = SimplePendulum(gravity=1.0)
    scene.start["rod.angle"], scene.start["rod.angular_velocity"] = angle, rate
    return scene


def test_the_principal_function_of_the_pendulum():
    """Reference values by quadrature with 30 digits: S, dS/dtheta = p and dS/dt = -H."""
    found = action(pendulum(), t_end=3.0)
    assert found.value == pytest.approx(1.97834953618, abs=1e-11)
    assert found.gradient["rod.angle"] == pytest.approx(-1.06959647936, abs=1e-10)
    assert found.time_derivative == pytest.approx(-0.125, abs=1e-11)
    assert found.initial_gradient["rod.angle"] == pytest.approx(-1.5, abs=1e-12)
    assert found.initial_time_derivative == pytest.approx(0.125, abs=1e-12)
    assert found.error < 1e-10


def test_derivatives_of_s_are_momentum_and_energy():
    """Differences of S between ends that motions join."""
    end, step = float(simulate(pendulum(), t_end=3.0, rtol=1e-12)["rod.angle"][-1]), 1e-3

    def value(angle, t):
        (motion,) = boundary_value_motions(pendulum(), {"rod.angle": angle}, t_end=t)
        return motion.action.value

    by_angle = (value(end + step, 3.0) - value(end - step, 3.0)) / (2.0 * step)
    by_time = (value(end, 3.0 + step) - value(end, 3.0 - step)) / (2.0 * step)
    assert by_angle == pytest.approx(-1.06959647936, abs=1e-5)
    assert by_time == pytest.approx(-0.125, abs=1e-5)


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    "scene",
    [pendulum(), DoublePendulum(), ElasticPendulum(), ChargedParticle(), DrivenPendulum()],
    ids=["one", "two", "spring", "magnetic", "driven"],
)
def test_the_first_variation_is_zero_on_motions(scene):
    found = action(scene, t_end=2.0).variation()
    assert found.largest < 1e-10
    assert len(found.names) == 8 * len(action(scene, t_end=0.1).coordinates)


def test_the_first_variation_is_zero_in_a_direction_of_ones_own():
    found = action(pendulum(), t_end=3.0)
    assert found.variation({"rod.angle": "t*(3 - t)*exp(-t)"}).largest < 1e-11
    assert found.variation({"rod.angle": lambda t: t * (3.0 - t) ** 2}).largest < 1e-11
    with pytest.raises(UsageError, match="does not vanish at both ends"):
        found.variation({"rod.angle": "t"})


def test_a_path_that_is_no_motion_has_a_first_variation():
    """Along theta = t/2: S by hand, and ``delta S = -integral of sin(theta) eta``."""
    found = action(pendulum(), {"rod.angle": "t/2"}, t_end=3.0)
    assert found.value == pytest.approx(0.125 * 3.0 + 2.0 * np.sin(1.5), rel=1e-13)
    t = (np.arange(200_000) + 0.5) * 3.0 / 200_000
    expected = -np.mean(np.sin(0.5 * t) * np.sin(np.pi * t / 3.0)) * 3.0
    assert found.variation().values[0] == pytest.approx(expected, rel=1e-8)
    waving = action(pendulum(), {"rod.angle": "cos(7*t)"}, t_end=3.0)
    assert waving.gradient["rod.angle"] == pytest.approx(-7.0 * np.sin(21.0), rel=1e-14)
    sampled = action(pendulum(), {"rod.angle": lambda t: 0.5 * t}, t_end=3.0)
    assert sampled.value == pytest.approx(found.value, rel=1e-12)
    assert sampled.gradient["rod.angle"] == pytest.approx(0.5, rel=1e-9)


def test_the_action_of_a_motion_is_less_than_that_of_its_neighbours():
    """As long as no conjugate point lies between: here S of the motion and of paths beside it."""
    (motion,) = boundary_value_motions(pendulum(), {"rod.angle": 1.0}, t_end=1.5)
    assert motion.is_minimum
    t, angle = motion.result.time, motion.result["rod.angle"]
    curve = np.polynomial.Polynomial.fit(t, angle, 16)
    least = action(pendulum(), {"rod.angle": curve}, t_end=1.5).value
    assert least == pytest.approx(motion.action.value, abs=1e-9)
    for size in (0.1, -0.1):
        beside = action(pendulum(), {"rod.angle": lambda t, a=size: curve(t) + a * t * (1.5 - t)}, t_end=1.5)
        assert beside.value > motion.action.value + 1e-3


def test_other_forms_and_bodies_in_space_have_an_action():
    reduced = action(simulate(FourBar(), t_end=0.5, rtol=1e-11))
    maximal = action(simulate(FourBar(), t_end=0.5, rtol=1e-11, form="dae"))
    assert reduced.value == pytest.approx(maximal.value, rel=1e-7)
    top = action(LagrangeTop(), t_end=0.5)
    turned = action(simulate(LagrangeTop(), t_end=0.5, rtol=1e-12, orientation="euler-zyz"))
    assert top.value == pytest.approx(turned.value, rel=1e-9)
    with pytest.raises(UnsupportedError, match="no derivatives of its coordinates"):
        _ = top.gradient


def test_forces_beside_l_leave_a_first_variation():
    assert action(FallingWithDrag(), t_end=0.5).variation().largest > 1e-4


def test_wrong_paths_are_named():
    with pytest.raises(UsageError, match=r"leaves out rod2\.angle"):
        action(DoublePendulum(), {"rod1.angle": "t"}, t_end=1.0)
    with pytest.raises(UsageError, match="is no function of time"):
        action(pendulum(), {"rod.angle": "a*t"}, t_end=1.0)
    with pytest.raises(UsageError, match="has its motion and its end"):
        action(simulate(pendulum(), t_end=0.1), t_end=1.0)


def test_several_motions_join_two_places():
    """A pendulum that has time for it swings over, once or twice, or waits; each has its conjugate points."""
    found = boundary_value_motions(pendulum(), {"rod.angle": 0.3}, t_end=12.0)
    assert len(found) >= 5
    assert [one.action.value for one in found] == sorted(one.action.value for one in found)
    for one in found:
        assert one.result["rod.angle"][-1] == pytest.approx(0.3, abs=1e-7)
        assert one.action.variation().largest < 1e-8
    assert {len(one.conjugate_times) for one in found} >= {0, 1, 2}
    assert found[0].is_minimum


def test_conjugate_points_of_the_small_pendulum():
    """Neighbours from the lowest place meet there again after half a period each."""
    (motion,) = boundary_value_motions(
        pendulum(), {"rod.angle": 1e-4 * np.sin(7.0)}, t_end=7.0, start={"rod.angle": 0.0}
    )[:1]
    slow = min(
        boundary_value_motions(pendulum(), {"rod.angle": 1e-4 * np.sin(7.0)}, t_end=7.0),
        key=lambda one: abs(one.velocities["rod.angle"]),
    )
    assert motion.action.value <= slow.action.value
    np.testing.assert_allclose(slow.conjugate_times, [np.pi, 2.0 * np.pi], rtol=1e-5)


class Oscillator(Scene):
    """A mass on a spring: its place of rest is 1 m, its period pi s."""

    space = "line"
    gravity = 0.0
    ground: Ground = Ground()
    spring: Spring = Spring(stiffness=4.0, natural_length=1.0)
    mass: Mass1D = Mass1D(mass=1.0)
    connections = [connect(ground.frame, spring.a), connect(spring.b, mass.flange)]
    start = {"mass.displacement": 1.5, "mass.speed": 0.0}


def test_ends_that_no_motion_joins_are_one_error():
    """An oscillator comes to the mirror image of its start after half a period, whatever its velocity."""
    path = "mass.displacement"
    with pytest.raises(
        SolveError, match=r"no motion was found that joins these ends in 1\.5708 s: of 4\d\d that were tried"
    ):
        boundary_value_motions(Oscillator(), {path: 1.3}, t_end=0.5 * np.pi)
    with pytest.raises(SolveError, match="they are conjugate points"):
        boundary_value_motions(Oscillator(), {path: 0.5}, t_end=0.5 * np.pi)
    (motion,) = boundary_value_motions(Oscillator(), {path: 1.3}, t_end=0.4 * np.pi)
    assert motion.is_minimum
    (later,) = boundary_value_motions(Oscillator(), {path: 1.3}, t_end=1.2 * np.pi)
    np.testing.assert_allclose(later.conjugate_times, [0.5 * np.pi, np.pi], rtol=1e-6)


def test_the_principal_function_of_the_oscillator():
    """``S = m w ((a^2 + b^2) cos(w T) - 2 a b)/(2 sin(w T))`` from a to b (Landau and Lifshitz, section 43)."""
    (motion,) = boundary_value_motions(Oscillator(), {"mass.displacement": 1.3}, t_end=1.0)
    a, b, w = 0.5, 0.3, 2.0
    value = w * ((a * a + b * b) * np.cos(w) - 2.0 * a * b) / (2.0 * np.sin(w))
    assert motion.action.value == pytest.approx(value, rel=1e-10)


def test_ends_are_coordinates_of_the_scene():
    with pytest.raises(UsageError, match=r"leaves out bob\.position\.z"):
        boundary_value_motions(ElasticPendulum(), {"bob.position.x": 0.1}, t_end=1.0)
    with pytest.raises(UsageError, match=r"Did you mean 'rod\.angle'"):
        boundary_value_motions(pendulum(), {"rod.angel": 0.1}, t_end=1.0)
    with pytest.raises(UnsupportedError, match="not those of free coordinates"):
        boundary_value_motions(LagrangeTop(), {"top.theta": 0.1}, t_end=1.0)
    (motion,) = boundary_value_motions(pendulum(), {"rod.angle": "30 deg"}, t_end=1.0)
    assert motion.result["rod.angle"][-1] == pytest.approx(np.pi / 6.0, abs=1e-9)


@pytest.mark.parametrize(("turns", "index"), [(0.4, 0), (0.75, 1), (1.25, 2)])
def test_the_second_variation_has_as_many_directions_as_conjugate_points(turns, index):
    """Of the oscillator with k/m = 4, points conjugate to the start come each half turn (Morse)."""
    scene, end = Oscillators(kind="harmonic"), turns * np.pi
    [motion] = boundary_value_motions(scene, {"track.parameter": 0.7}, t_end=end)
    found = motion.action.second_variation()
    assert found.index == index == len(motion.conjugate_times)
    k = np.arange(1, 9)
    # The form is diagonal on sines: m a^2 ((k pi/T)^2 - 4) T/2.
    assert found.matrix == pytest.approx(np.diag(((k * np.pi / end) ** 2 - 4.0) * end / 2.0), abs=1e-8)


def test_the_second_variation_is_that_of_s_along_a_path():
    """Differences of S on paths beside one, for a scene with mass that moves and two coordinates."""
    path = {"rod1.angle": "sin(t)", "rod2.angle": "t**2/2"}
    eta = {"rod1.angle": "t*(1 - t)", "rod2.angle": "sin(3.141592653589793*t)"}

    def value(size):
        return action(DoublePendulum(), {one: f"{path[one]} + {size}*({eta[one]})" for one in path}, t_end=1.0).value

    form = action(DoublePendulum(), path, t_end=1.0).second_variation(eta).matrix[0, 0]
    assert form == pytest.approx((value(1e-3) - 2.0 * value(0.0) + value(-1e-3)) / 1e-6, rel=1e-5)


def test_paths_in_phase_space_are_varied_in_q_and_p_on_their_own():
    """``dS = integral of (q' - dH/dp) xi + p eta' - dH/dq eta``: zero on motions, whatever xi is at the ends."""
    scene = Oscillators(kind="harmonic")  # m = a = 1, k = 4
    motion = {"track.parameter": "cos(2*t)", "p:track.parameter": "-2*sin(2*t)"}
    found = action(scene, motion, t_end=0.6)
    assert found.value == pytest.approx(action(scene, {"track.parameter": "cos(2*t)"}, t_end=0.6).value, rel=1e-12)
    either = {"track.parameter": "t*(0.6 - t)", "p:track.parameter": "1 + t**2"}
    assert found.variation(either).largest < 1e-12
    other = action(scene, {"track.parameter": "0", "p:track.parameter": "t"}, t_end=0.6)
    assert other.variation({"p:track.parameter": "1"}).values[0] == pytest.approx(-0.18, rel=1e-12)
    assert other.value == pytest.approx(-(0.6**3) / 6.0, rel=1e-12)
    with pytest.raises(UsageError, match="does not vanish"):
        found.variation({"track.parameter": "t"})
    with pytest.raises(UnsupportedError, match="phase space"):
        found.second_variation()
    with pytest.raises(UsageError, match="leaves out p:track"):
        action(scene, {"track.parameter": "0", "p:nothing": "1"})
    driven = action(DrivenPendulum(), {"rod.angle": "0", "p:rod.angle": "1"}, t_end=0.3)
    h = hamiltonian(DrivenPendulum())
    assert driven.time_derivative == pytest.approx(-float(h([0.0], [1.0], 0.3)), rel=1e-12)
