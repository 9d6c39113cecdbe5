"""Slender bodies that joints leave free to spin: along a guide, about a hinge, on a cross, in legs of two halves."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from atwood import (
    Component,
    Frame,
    Scalar,
    Scene,
    StartError,
    assemble,
    connector,
    dot,
    minimum,
    potential,
    report,
    simulate,
    sqrt,
    sweep,
)
from atwood_library import (
    Bar,
    Cylindrical,
    Force,
    Ground,
    Link,
    Pivot,
    Planar,
    PointMass,
    Slider,
    Spherical,
    Spring,
    Torque,
    Universal,
    Weld,
)

EVERY = [("reduced", "explicit"), ("reduced", "ida"), ("reduced", "taylor"), ("dae", "ida"), ("dae", "explicit")]
GUIDES = {"slider": Slider, "cylindrical": Cylindrical}


def leg(guide: str, turned: float = 0.0, axial: float = 0.0) -> Scene:
    """Return a leg of two halves on a ball, which slide in each other against a spring, with a mass at its end."""
    scene = Scene(space="space")
    ground, stand = scene.add("ground", Ground()), scene.add("stand", Weld(angle=turned, axis=(0.3, 1.0, 0.2)))
    ball, slide = scene.add("ball", Spherical()), scene.add("guide", GUIDES[guide](axis=(1.0, 0.0, 0.0)))
    lower = scene.add("lower", Link(length=0.6, mass=1.0, axial_moment=axial))
    upper = scene.add("upper", Link(length=0.5, mass=0.7, axial_moment=axial))
    spring, mass = scene.add("spring", Spring(stiffness=200.0, natural_length=0.7)), scene.add("mass", PointMass())
    joined = [(ground.frame, stand.a), (stand.b, ball.a), (ball.b, lower.a), (lower.b, slide.a), (slide.b, upper.a)]
    for a, b in (*joined, (lower.a, spring.a), (upper.b, spring.b), (upper.b, mass.point)):
        scene.connect(a, b)
    scene.start.update({"guide.displacement": 0.1, "mass.velocity.y": 0.7})
    scene.guess["mass.position.x"] = 1.0
    return scene


QUANTITIES = ("guide.displacement", "mass.velocity.x", "mass.velocity.y", "mass.velocity.z")


def motion(scene: Scene, **options: Any) -> np.ndarray:
    result = simulate(scene, t_end=0.5, rtol=1e-8, outputs=6, **options)
    assert result.energy.max_drift < 1e-4
    return np.array([result.array(name) for name in QUANTITIES])


@cache
def round_leg(guide: str, turned: float) -> np.ndarray:
    """Return the motion of a leg that has inertia about itself, which makes no difference while it does not spin."""
    return motion(leg(guide, turned, 1e-3))


@pytest.mark.sample(4)
@pytest.mark.parametrize(("form", "solver"), EVERY)
@pytest.mark.parametrize(("guide", "turned"), [("slider", 0.0), ("cylindrical", 0.7)])
def test_a_slender_leg_moves_as_a_round_one_that_does_not_spin(
    guide: str, turned: float, form: str, solver: str
) -> None:
    """It was refused: something without inertia is free to move."""
    found = motion(leg(guide, turned), form=form, solver=solver)
    np.testing.assert_allclose(found, round_leg(guide, turned), atol=1e-4)


def test_halves_that_spin_together_are_said_once() -> None:
    assert len(report(leg("slider")).idle_spins) == 1
    assert len(report(leg("cylindrical")).idle_spins) == 2
    assert not report(leg("slider", axial=1e-3)).idle_spins


def bar_on(joint: Component) -> Scene:
    """Return a slender bar, whose axis is z, on a joint."""
    scene = Scene(space="space")
    ground, bar = scene.add("ground", Ground()), scene.add("bar", Bar(length=1.0, mass=2.0))
    scene.add("joint", joint)
    scene.connect(ground.frame, joint.connectors()["a"])
    scene.connect(joint.connectors()["b"], bar.frame)
    return scene


@pytest.mark.parametrize(
    ("joint", "coordinate"),
    [
        (Cylindrical(axis=(0.0, 0.0, 1.0)), "joint.displacement"),
        (Cylindrical(axis=(0.0, 0.0, -1.0)), "joint.displacement"),
        (Planar(), "bar.position.x"),
        (Universal(axis_a=(1.0, 0.0, 0.0), axis_b=(0.0, 0.0, 1.0)), "joint.angle_a"),
    ],
)
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_bar_about_itself(joint: Component, coordinate: str, form: str) -> None:
    scene = bar_on(joint.copy())
    scene.start[coordinate] = 0.2
    result = simulate(scene, form=form, t_end=0.5, rtol=1e-9, outputs=3)
    assert result.array("bar.spin.z") == pytest.approx(0.0, abs=1e-9)
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("value", [1.0, "sin(3*t)", "t^3"])
def test_what_acts_on_such_a_spin_is_refused(value: float | str) -> None:
    """A torque that was zero at the start only was overlooked, and the bar did not follow it."""
    scene = bar_on(Cylindrical(axis=(0.0, 0.0, 1.0)))
    torque, part = Torque(value=value, axis=(0.0, 0.0, 1.0)), scene._children()["bar"]
    scene.add("torque", torque)
    scene.connect(part.connectors()["frame"], torque.connectors()["frame"])
    with pytest.raises(StartError, match="without inertia"):
        simulate(scene, t_end=0.1)


@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_a_force_whose_lever_turns_with_such_a_spin_is_refused(direction: tuple[float, float, float]) -> None:
    """Along the bar it has no moment about it, but which way it bends the bar depends on how far this has turned."""
    scene = bar_on(Spherical())
    arm, force = scene.add("arm", Weld(displacement=(0.3, 0.0, 0.0))), Force(direction=direction, resolved_in="body")
    scene.add("force", force)
    force.value = 5.0
    scene.connect(scene._children()["bar"].connectors()["frame"], arm.a)
    scene.connect(arm.b, force.frame)
    with pytest.raises(StartError, match="without inertia"):
        simulate(scene, t_end=0.1)


class FarStop(Component):
    """A stop that is met after most of half a turn only."""

    a: Frame = connector(Frame, "What stands.")
    b: Frame = connector(Frame, "What it stops.")

    @potential
    def energy(self) -> Scalar:
        """Return the energy."""
        below = minimum(dot(self.a.axes[0], self.b.axes[0]) + 0.98, 0.0)
        return 50.0 * below * below


def test_a_stop_that_is_rarely_met_is_not_overlooked() -> None:
    scene = bar_on(Cylindrical(axis=(0.0, 0.0, 1.0)))
    stop = scene.add("stop", FarStop())
    scene.connect(scene._children()["ground"].connectors()["frame"], stop.a)
    scene.connect(scene._children()["bar"].connectors()["frame"], stop.b)
    assert not assemble(scene).mechanism.idle_spins


class Notch(Component):
    """A potential that has a value near one angle only."""

    frame: Frame = connector(Frame, "What it turns.")

    @potential
    def energy(self) -> Scalar:
        """Return the energy."""
        return sqrt(self.frame.axes[0].x - 0.95)


def test_a_law_without_a_value_at_random_places_is_not_overlooked() -> None:
    scene = bar_on(Cylindrical(axis=(0.0, 0.0, 1.0)))
    scene.connect(scene.add("notch", Notch()).frame, scene._children()["bar"].connectors()["frame"])
    assert not assemble(scene).mechanism.idle_spins


def test_a_hinge_across_keeps_a_link_from_spinning() -> None:
    scene = Scene(space="space")
    ground, last = scene.add("ground", Ground()), None
    for i in range(3):
        pivot, link = scene.add(f"pivot{i}", Pivot()), scene.add(f"link{i}", Link())
        scene.connect(ground.frame if last is None else last.b, pivot.a)
        scene.connect(pivot.b, link.a)
        last = link
    assert not report(scene).idle_spins


def test_a_sweep_over_a_moment_from_zero_on() -> None:
    """Runs of another structure ended in a bare ValueError."""
    moments = [0.0, 1e-3, 0.0]
    swept = sweep(leg("slider"), vary={"lower.axial_moment": moments}, t_end=0.2, quantities=["guide.displacement"])
    found = np.array([np.ravel(one)[-1] for one in swept["guide.displacement"]])
    np.testing.assert_allclose(found, found[0], atol=1e-6)
