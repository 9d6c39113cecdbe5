"""Branches of equilibria against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from atwood import Scene, UsageError, connect, equilibrium_branches, parameter
from atwood.theory.linear.branches import Problem, Residual, branch_directions, follow
from atwood_library import Ground, Mass1D, Pivot, PointMass, Ramp, RotaryDrive, Spring, Weld


class Hoop(Scene):
    """A bead on a hoop that turns about the vertical."""

    rate: float = parameter(3.0, unit="rad/s", doc="Rate of the hoop.")
    space = "space"
    ground: Ground = Ground()
    ramp: Ramp = Ramp(slope=rate)
    motor: RotaryDrive = RotaryDrive(axis=(0, 0, 1))
    pivot: Pivot = Pivot(axis=(0, 1, 0))
    arm: Weld = Weld(displacement=(0, 0, -0.8))
    bead: PointMass = PointMass(mass=0.3)
    connections = [
        connect(ground.frame, motor.a),
        connect(motor.b, pivot.a),
        connect(pivot.b, arm.a),
        connect(arm.b, bead.point),
        connect(ramp.output("value"), motor.input("rotation")),
    ]


@pytest.mark.sample(0)
def test_a_bead_leaves_the_bottom_of_its_hoop() -> None:
    found = equilibrium_branches(Hoop(), "rate", (1.0, 6.0))
    (crossing,) = found.crossings
    assert crossing.parameter == pytest.approx(math.sqrt(9.81 / 0.8), rel=1e-10)
    assert abs(crossing.values["pivot.angle"]) < 1e-6
    assert len(found.branches) == 3
    for branch in found.branches:
        angle, rate = branch.values["pivot.angle"], branch.parameter
        off = np.abs(np.sin(angle)) > 1e-3
        assert np.allclose(np.cos(angle[off]), 9.81 / (rate[off] ** 2 * 0.8), rtol=1e-9)
        square = 9.81 / 0.8 * np.cos(angle) - rate**2 * np.cos(2.0 * angle)
        sure = np.abs(square) > 1e-6
        assert np.array_equal(branch.stable[sure], square[sure] > 0.0)


def test_arc_length_passes_folds_and_finds_branch_points() -> None:
    """The normal forms of a fold, p = x^3 - x, and of a pitchfork, x (p - x^2) = 0."""

    def cubic(x: np.ndarray, p: float, _: object = None) -> Residual:
        return Residual(x**3 - x - (4.0 * p - 2.0), np.diag(3.0 * x**2 - 1.0), np.array([-4.0]))

    problem = Problem(cubic, 0.0, 1.0)
    start = float(np.roots([1.0, 0.0, -1.0, 2.0])[0].real)
    curve = follow(problem, np.array([start]), 0.0, np.array([0.0, 1.0]))
    assert curve.p[-1] == 1.0
    folds = sorted(4.0 * p - 2.0 for _, p in curve.folds)
    assert np.allclose(folds, [-2.0 / math.sqrt(27.0), 2.0 / math.sqrt(27.0)], atol=1e-10)

    def fork(x: np.ndarray, p: float, _: object = None) -> Residual:
        q = p - 0.4
        return Residual(x * (q - x**2), np.diag(q - 3.0 * x**2), x.copy())

    problem = Problem(fork, 0.0, 1.0)
    curve = follow(problem, np.zeros(1), 0.0, np.array([0.0, 1.0]))
    ((x, p),) = curve.crossings
    assert p == pytest.approx(0.4, abs=1e-12)
    beside = branch_directions(problem, x, p)
    ends = [follow(problem, *one).x[-1, 0] for one in beside]
    assert sorted(ends) == pytest.approx([-math.sqrt(0.6), math.sqrt(0.6)], rel=1e-9)


def test_questions_without_an_answer() -> None:
    scene = Scene(space="line", gravity=9.81)
    ground, mass = scene.add("ground", Ground()), scene.add("mass", Mass1D())
    spring = scene.add("spring", Spring(stiffness=10.0, natural_length=1.0))
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, mass.flange)
    scene.start["mass.displacement"] = 1.0
    with pytest.raises(UsageError):
        equilibrium_branches(scene, "spring.stiffness", (20.0, 10.0))
    with pytest.raises(UsageError, match="no equilibrium"):
        equilibrium_branches(scene, "spring.stiffness", (10.0, 20.0), region={"mass.displacement": (5.0, 6.0)})
