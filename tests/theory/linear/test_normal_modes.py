"""Normal modes and equilibria against hand-written answers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.theory.linear.scenes import bicycle, hoop

from atwood import ParameterError, Scene, SolveError, UsageError, equilibria, normal_modes, root_locus, trim
from atwood_library import Damper, Ground, Mass1D, Spring, Weld
from atwood_library.scenes import DoublePendulum, DrivenPendulum, FourBar, PendulumOnCart, SphericalPendulum


def chain(count: int, ends: bool = True, damping: float = 0.0) -> Scene:
    """Return equal masses between equal springs, held at both ends unless told otherwise."""
    scene = Scene(space="line", gravity=0.0)
    ground = scene.add("ground", Ground())
    places = [scene.add(f"m{i}", Mass1D(mass=0.5)) for i in range(count)]
    before = ground.frame if ends else None
    for i, one in enumerate(places):
        if before is not None:
            spring = scene.add(f"s{i}", Spring(stiffness=80.0, natural_length=1.0))
            scene.connect(before, spring.a)
            scene.connect(spring.b, one.flange)
            if damping:
                damper = scene.add(f"d{i}", Damper(damping=damping))
                scene.connect(before, damper.a)
                scene.connect(damper.b, one.flange)
        before = one.flange
        scene.start[f"m{i}.displacement"] = 1.0 + i
    if ends:
        wall = scene.add("wall", Weld(displacement=(count + 1.0, 0.0, 0.0)))
        last = scene.add("last", Spring(stiffness=80.0, natural_length=1.0))
        scene.connect(ground.frame, wall.a)
        scene.connect(places[-1].flange, last.a)
        scene.connect(last.b, wall.b)
    return scene


@pytest.mark.parametrize("count", [1, 2, 7])
def test_masses_between_springs(count: int) -> None:
    found = normal_modes(chain(count))
    number = np.arange(1, count + 1)
    known = 2.0 * math.sqrt(80.0 / 0.5) * np.sin(number * np.pi / (2.0 * (count + 1)))
    assert np.allclose(found.angular_frequencies, known, rtol=1e-13)
    assert np.all(found.growth_rates == 0.0)
    for j, shape in enumerate(found.matrix().T.real):
        expected = np.sin((j + 1) * number * np.pi / (count + 1))
        expected /= expected[np.argmax(np.abs(expected) > 0.999 * np.max(np.abs(expected)))]
        assert np.allclose(shape, expected, atol=1e-10)


def test_free_masses_have_a_mode_of_frequency_zero() -> None:
    found = normal_modes(chain(3, ends=False))
    assert found.angular_frequencies[0] == 0.0
    assert np.allclose(found.angular_frequencies[1:], math.sqrt(160.0) * np.array([1.0, math.sqrt(3.0)]), rtol=1e-13)
    assert np.allclose(found.matrix()[:, 0], 1.0)


def test_damped_masses_have_complex_eigenvalues() -> None:
    found = normal_modes(chain(1, damping=2.0))
    # x'' + c/m x' + 2k/m x = 0 with a damper on one side
    known = np.roots([0.5, 2.0, 160.0])
    assert found.eigenvalues[0] == pytest.approx(known[np.argmax(known.imag)], rel=1e-13)
    over = normal_modes(chain(1, damping=40.0))
    assert np.allclose(sorted(over.growth_rates), sorted(np.roots([0.5, 40.0, 160.0]).real), rtol=1e-12)
    assert np.all(over.angular_frequencies == 0.0)


def test_a_double_pendulum() -> None:
    scene = DoublePendulum(length1=0.9, length2=0.9, mass1=0.4, mass2=0.4)
    found = normal_modes(scene, at={"rod1.angle": 0.0, "rod2.angle": 0.0})
    square = 9.81 / 0.9 * np.array([2.0 - math.sqrt(2.0), 2.0 + math.sqrt(2.0)])
    assert np.allclose(found.angular_frequencies, np.sqrt(square), rtol=1e-13)
    shapes = found.matrix().real
    ratio = shapes[1] / shapes[0]
    assert np.allclose(ratio, [math.sqrt(2.0), -math.sqrt(2.0)], rtol=1e-12)
    upright = normal_modes(scene, at={"rod1.angle": math.pi, "rod2.angle": math.pi})
    assert np.allclose(sorted(upright.growth_rates), np.sqrt(square), rtol=1e-12)
    assert np.all(upright.angular_frequencies == 0.0)


def test_a_pendulum_on_a_cart() -> None:
    scene = PendulumOnCart(cart_mass=2.0, bob_mass=1.0, length=0.7)
    found = normal_modes(scene, at={"rod.angle": 0.0})
    assert found.angular_frequencies[0] == 0.0
    assert found.angular_frequencies[1] == pytest.approx(4.58491314764, abs=1e-11)


def test_equal_eigenvalues_are_one_space() -> None:
    at = {"bob.position.x": 0.0, "bob.position.y": 0.0, "bob.position.z": -1.0}
    found = normal_modes(SphericalPendulum(), at=at)
    assert found.spaces == ((0, 1),)
    assert np.allclose(found.angular_frequencies, math.sqrt(9.81), rtol=1e-13)


def test_many_masses() -> None:
    found = normal_modes(chain(200))
    known = 2.0 * math.sqrt(160.0) * np.sin(np.arange(1, 201) * np.pi / 402.0)
    assert np.allclose(found.angular_frequencies, known, rtol=1e-11)


def test_equilibria_of_pendulums() -> None:
    found = equilibria(DoublePendulum())
    assert len(found) == 4
    assert [one.stable for one in found].count(True) == 1
    for one in found:
        assert all(abs(math.sin(value)) < 1e-12 for value in one.values.values())
        assert one.stable == all(abs(value) < 1e-9 for value in one.values.values())
    part = equilibria(DoublePendulum(), region={"rod1.angle": (-1.0, 1.0)})
    assert len(part) == 2
    cart = equilibria(PendulumOnCart())
    assert len(cart) == 2
    assert all(one.values["rail.displacement"] == 0.0 for one in cart)


@pytest.mark.parametrize("rate", [2.0, 5.0])
def test_equilibria_on_a_driven_hoop(rate: float) -> None:
    radius = 0.8
    found = equilibria(hoop(rate, radius))
    off = 9.81 / (rate**2 * radius)
    angles = sorted(abs(one.values["pivot.angle"]) for one in found)
    expected = [0.0, math.pi] if off >= 1.0 else [0.0, math.acos(off), math.acos(off), math.pi]
    assert np.allclose(angles, expected, atol=1e-10)
    for one in found:
        angle = one.values["pivot.angle"]
        square = 9.81 / radius * math.cos(angle) - rate**2 * math.cos(2.0 * angle)
        assert one.stable == (square > 0.0)
        mode = one.modes.angular_frequencies[0] if square > 0.0 else one.modes.growth_rates[0]
        assert mode == pytest.approx(math.sqrt(abs(square)), rel=1e-9)


def test_closed_loops_have_equilibria() -> None:
    found = equilibria(FourBar())
    assert [one.stable for one in found].count(True) == 2
    assert len(found) == 4


def test_trim_finds_inputs_that_hold_a_state() -> None:
    scene = DoublePendulum()
    found = trim(hoop(0.5), at={"pivot.angle": 0.4}, inputs=["pivot.motor"])
    torque = 0.3 * (9.81 * 0.8 * math.sin(0.4) - 0.5**2 * 0.8**2 * math.sin(0.4) * math.cos(0.4))
    assert found.inputs["pivot.motor"] == pytest.approx(torque, rel=1e-10)
    with pytest.raises(SolveError, match="hold the state"):
        trim(scene, at={"rod1.angle": 0.3, "rod2.angle": 0.0})
    free = trim(scene, at={"rod1.angle": 0.3, "rod2.angle": 0.1}, free=["rod1.angle", "rod2.angle"])
    assert abs(free.values["rod1.angle"]) < 1e-12


def test_a_root_locus_follows_eigenvalues() -> None:
    found = root_locus(bicycle(), "rear_axle.angular_velocity", np.linspace(4.0, 6.5, 11) / 0.3)
    crossings = [value * 0.3 for value in found.crossings()]
    assert any(abs(value - 4.292382536) < 0.02 for value in crossings)
    assert any(abs(value - 6.024262015) < 0.02 for value in crossings)


def test_questions_without_an_answer() -> None:
    with pytest.raises(UsageError, match="no equilibrium in the region"):
        equilibria(DoublePendulum(), region={"rod1.angle": (0.3, 1.0)})
    with pytest.raises(UsageError, match="depend on time"):
        equilibria(DrivenPendulum())
    with pytest.raises(ParameterError, match="no such coordinate"):
        equilibria(DoublePendulum(), region={"rod1.angel": (0.3, 1.0)})
    with pytest.raises(UsageError, match="region cannot be"):
        equilibria(DoublePendulum(), region={"rod1.angle": (1.0, 0.3)})
    with pytest.raises(UsageError, match="steady"):
        normal_modes(DoublePendulum(), at={"rod1.angle": 0.3, "rod2.angle": 0.0})
