"""The woodpecker toy (C. Glocker, *Dynamik von Starrkoerpersystemen mit Reibung und Stoessen*, 1995, section 10.2)."""

from __future__ import annotations

from itertools import pairwise

import pytest

from atwood import (
    Component,
    Scalar,
    Scene,
    Shaft,
    Slide,
    connector,
    dry_friction,
    lagrangian,
    parameter,
    simulate,
    unilateral,
)
from atwood_library import Inertia, Mass1D

G = 9.81
BIRD, SLEEVE_ARM, BIRD_ARM, STIFFNESS = 0.0045, 0.010, 0.015, 0.0056
POLE, HOLE, HALF_HEIGHT, BEAK, BEAK_ARM = 0.0025, 0.0031, 0.0058, 0.02, 0.0201
TILT = (HOLE - POLE) / HALF_HEIGHT


class Woodpecker(Component):
    """What acts between a sleeve on a pole, its tilt and a bird on a spring, with angles taken as small."""

    size: float = parameter(1.0, unit="m", above=0.0, doc="Longer than Glocker's by so much; masses stay.")
    y: Slide = connector(Slide, "The height of the sleeve.")
    sleeve: Shaft = connector(Shaft, "The tilt of the sleeve.")
    bird: Shaft = connector(Shaft, "The tilt of the bird.")

    def along(self, sleeve: float, bird: float = 0.0) -> Scalar:
        """Return the speed of a place at some arms from the sleeve and from the bird."""
        return self.y.rate + self.size * (sleeve * self.sleeve.rate + bird * self.bird.rate)

    @lagrangian
    def of_bird(self) -> Scalar:
        """Energy of the bird's mass and of the spring, and weights."""
        rate = self.along(SLEEVE_ARM, BIRD_ARM)
        height = self.y.value + self.size * (SLEEVE_ARM * self.sleeve.value + BIRD_ARM * self.bird.value)
        twist = self.sleeve.value - self.bird.value
        spring = 0.5 * STIFFNESS * self.size * twist * twist
        return 0.5 * BIRD * (rate * rate - 2.0 * G * height) - spring - 3e-4 * G * self.y.value

    @unilateral(reaction="of_beak", unit="N*m", restitution=0.5, doc="Torque of the pole on the bird.")
    def beak(self) -> Scalar:
        """Distance of the beak from the pole, as an angle."""
        return (SLEEVE_ARM + BIRD_ARM - BEAK_ARM - POLE) / BEAK - self.bird.value

    @unilateral(reaction="of_lower", unit="N*m", doc="Torque of the pole on the sleeve.")
    def lower(self) -> Scalar:
        """How far the sleeve can still tilt."""
        return TILT + self.sleeve.value

    @unilateral(reaction="of_upper", unit="N*m", doc="Torque of the pole on the sleeve.")
    def upper(self) -> Scalar:
        """How far the sleeve can still tilt the other way."""
        return TILT - self.sleeve.value

    @dry_friction(at="beak", reaction="rub_beak", limit="most_beak", doc="Friction of the beak.")
    def slip_beak(self) -> Scalar:
        """Speed of the beak along the pole."""
        return self.along(SLEEVE_ARM, BIRD_ARM - BEAK_ARM)

    @dry_friction(at="lower", reaction="rub_lower", limit="most_lower", doc="Friction of the sleeve.")
    def slip_lower(self) -> Scalar:
        """Speed of the sleeve along the pole."""
        return self.along(HOLE)

    @dry_friction(at="upper", reaction="rub_upper", limit="most_upper", doc="Friction of the sleeve.")
    def slip_upper(self) -> Scalar:
        """Speed of the sleeve along the pole."""
        return self.along(HOLE)

    def most_beak(self) -> Scalar:
        """Return the largest friction."""
        return 0.3 / (BEAK * self.size) * self.reaction("of_beak")

    def most_lower(self) -> Scalar:
        """Return the largest friction."""
        return 0.3 / (HALF_HEIGHT * self.size) * self.reaction("of_lower")

    def most_upper(self) -> Scalar:
        """Return the largest friction."""
        return 0.3 / (HALF_HEIGHT * self.size) * self.reaction("of_upper")


def woodpecker(start: dict[str, float]) -> Scene:
    scene = Scene(gravity=0.0)  # weights are those of the part
    sleeve = scene.add("sleeve", Mass1D(mass=3e-4, axis=(0, 0, 1)))
    tilt, bird = scene.add("tilt", Inertia(moment=5e-9)), scene.add("bird", Inertia(moment=7e-7))
    toy = scene.add("toy", Woodpecker())
    scene.connect(sleeve.slide, toy.y)
    scene.connect(tilt.flange, toy.sleeve)
    scene.connect(bird.flange, toy.bird)
    scene.start.update({"sleeve.displacement": 0.0, "toy.lower": 0.0, "tilt.angular_velocity": 0.0, **start})
    return scene


ON_THE_CYCLE = {"sleeve.speed": 0.0, "bird.angle": -0.4686515939283477, "bird.angular_velocity": -10.503799294709363}


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_woodpecker_comes_down_in_a_cycle(form: str) -> None:
    """From where the sleeve sticks, a period later it sticks again, further down, with the bird as it was."""
    result = simulate(woodpecker(ON_THE_CYCLE), form=form, t_end=0.146, rtol=1e-11)
    (again,) = [one.time for one in result.events if (one.law, one.kind) == ("slip_lower", "sticks")]
    assert again == pytest.approx(0.1459760651, abs=1e-10)
    assert result["sleeve.displacement"][-1] == pytest.approx(-0.0194453793, abs=1e-10)
    told = [(one.law, one.kind) for one in result.events if one.kind in ("impact", "opens") or one.law == "slip_lower"]
    assert told == [
        ("slip_lower", "slips"),
        ("lower", "opens"),
        ("upper", "impact"),
        ("beak", "impact"),
        ("upper", "impact"),
        ("upper", "opens"),
        ("lower", "impact"),
        ("lower", "impact"),
        ("slip_lower", "slips"),
        ("slip_lower", "sticks"),
    ]


def test_a_woodpecker_draws_near_to_its_cycle() -> None:
    """From Glocker's start periods differ by shares of some 0.85 each, with changing sign."""
    start = {"sleeve.speed": -0.3411, "bird.angle": -0.2788, "bird.angular_velocity": -7.4583}
    result = simulate(woodpecker(start), t_end=0.5, rtol=1e-9, outputs=[0.0, 0.5])
    hits = [one.time for one in result.events if (one.law, one.kind) == ("beak", "impact")]
    far = [after - before - 0.1459760651 for before, after in pairwise(hits)]
    assert far[0] < -1e-4
    assert 1e-4 < far[1] < -far[0]
