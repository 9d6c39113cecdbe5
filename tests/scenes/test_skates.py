"""Constraints on velocities that are no constraints on positions: a body on a blade."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Component, Frame, Scalar, Scene, UnsupportedError, Vector, connector, constraint, dot, observable
from atwood.expr import sqrt
from atwood.pipeline import assemble, simulate
from atwood.reporting import report
from atwood_library import Link, Weld

from ..helpers.runs import FORMS, prepare

G = 9.81
MASS, LENGTH, SPIN = 2.0, 1.0, 2.0


class Skate(Component):
    """A blade: it moves along its x axis only, and turns freely."""

    frame: Frame = connector(Frame, "The blade.")

    @constraint(reaction="side_force", unit="N", sign=1.0, doc="Force on the frame, across the blade.")
    def edge(self) -> Scalar:
        """Return the velocity across the blade."""
        return dot(self.frame.velocity, self.frame.to_world(Vector(0.0, 0.0, 1.0)))

    @observable(unit="m/s", doc="Velocity along the blade.")
    def speed(self) -> Scalar:
        """Return the velocity along the blade."""
        return dot(self.frame.velocity, self.frame.to_world(Vector(1.0, 0.0, 0.0)))


def sleigh(place: float, **settings: float) -> Scene:
    """Return a link with a blade at a distance from its end a, seen from above; gravity pulls it down the slope."""
    scene = Scene(t_end=3.0, **settings)
    link, spot = (
        scene.add("sleigh", Link(length=LENGTH, mass=MASS)),
        scene.add("spot", Weld(displacement=(place, 0, 0))),
    )
    skate = scene.add("skate", Skate())
    scene.connect(link.a, spot.a)
    scene.connect(spot.b, skate.frame)
    return scene


def on_a_slope() -> Scene:
    """Return a sleigh on a blade below its centre of mass, which starts without speed, pointing down the slope."""
    scene = sleigh(0.5 * LENGTH)
    scene.start.update({"sleigh.position.x": 0.0, "sleigh.position.z": 0.0, "sleigh.angle": -0.5 * np.pi})
    scene.start.update({"sleigh.angular_velocity": SPIN, "skate.speed": 0.0})
    return scene


@pytest.mark.parametrize("solver", ["ida", "ida-sundae"])
@pytest.mark.parametrize(("form", "level"), [("reduced", "ggl"), ("dae", "ggl"), ("dae", "index1")])
def test_a_skate_on_a_slope_does_not_slide_down(form: str, level: str, solver: str) -> None:
    """It moves along a cycloid, across the slope (Neimark and Fufaev, Dynamics of Nonholonomic Systems, chapter 2).

    ``v' = g cos(w t)`` along the blade, which points down the slope at first and turns with w.
    """
    made = simulate(on_a_slope(), form=form, level=level, rtol=1e-9, outputs=61, solver=solver)
    turned = SPIN * made.time
    assert np.allclose(made.array("sleigh.angle"), turned - 0.5 * np.pi, atol=1e-9)
    across = G / (2.0 * SPIN**2) * (turned - 0.5 * np.sin(2.0 * turned))
    assert np.allclose(made.array("sleigh.position.x"), across, atol=2e-6)
    assert np.allclose(made.array("sleigh.position.z"), -G / (2.0 * SPIN**2) * np.sin(turned) ** 2, atol=2e-6)
    # The blade holds the centripetal force, and what of the weight acts across it.
    assert np.allclose(made.array("skate.side_force"), 2.0 * MASS * G * np.sin(turned), atol=2e-5)
    assert made.energy.max_drift < 3e-5
    if level != "index1":
        assert made.constraint_max["velocity"] < 1e-14


@pytest.mark.parametrize("form", FORMS)
def test_a_sleigh_comes_to_a_straight_course(form: str) -> None:
    """Chaplygin's sleigh: with the centre of mass before the blade, rotation turns into speed.

    ``v' = a w^2``, ``(J + m a^2) w' = -m a v w``: from ``w0`` without speed, ``w = w0 / cosh(k t)``,
    ``v = V tanh(k t)`` with ``V^2 = w0^2 (J + m a^2) / m`` and ``k = a w0^2 / V`` (Neimark and Fufaev, chapter 2).
    """
    scene = sleigh(0.0, gravity=0.0)
    scene.start.update({"sleigh.position.x": 0.5, "sleigh.position.z": 0.0, "sleigh.angle": 0.0})
    scene.start.update({"sleigh.angular_velocity": SPIN, "skate.speed": 0.0})
    made = simulate(scene, form=form, rtol=1e-9, outputs=61)
    about_blade = MASS * LENGTH**2 / 3.0
    fastest = SPIN * np.sqrt(about_blade / MASS)
    rate = 0.5 * LENGTH * SPIN**2 / fastest
    assert np.allclose(made.array("sleigh.angular_velocity"), SPIN / np.cosh(rate * made.time), atol=5e-7)
    assert np.allclose(made.array("skate.speed"), fastest * np.tanh(rate * made.time), atol=5e-7)
    assert made.energy.max_drift < 3e-5


def test_it_holds_velocities_and_no_positions() -> None:
    dae, reduced = prepare(on_a_slope(), "dae"), prepare(on_a_slope(), "reduced")
    program = dae.plan.program
    assert (program.coordinates, program.speeds, program.multipliers, program.extra) == (3, 3, 1, 0)
    assert reduced.plan.program.size == 6
    assert reduced.plan.dependent == ()
    assert len(reduced.plan.dependent_speeds) == 1
    assert reduced.plan.program.independent == (0, 1, 2)
    (one,) = dae.assembly.maximal.constraints
    assert not one.holonomic
    assert one.value is None
    assert dae.plan.balance.misses(0.0, dae.q + 1.0, 0.0 * dae.u, dae.plan.sizes) == (0.0, 0.0)
    found = report(on_a_slope())
    assert found.degrees_of_freedom == 2
    assert set(found.states.values()) == {6, 7}


def test_a_blade_at_each_end_leaves_one_way_to_move() -> None:
    """Two blades in line: the second keeps the link from turning, and the reactions share what one would take."""
    scene = sleigh(0.0)
    spot, skate = scene.add("far", Weld(displacement=(LENGTH, 0, 0))), scene.add("skate2", Skate())
    scene.connect(scene.sleigh.a, spot.a)
    scene.connect(spot.b, skate.frame)
    scene.start.update({"sleigh.position.x": 0.0, "sleigh.position.z": 0.0, "sleigh.angle": -0.5, "skate.speed": 0.0})
    for form in FORMS:
        made = simulate(scene, form=form, rtol=1e-9, outputs=11)
        along = 0.5 * G * np.sin(0.5) * made.time**2
        assert np.allclose(made.array("sleigh.position.x"), along * np.cos(0.5), atol=1e-7)
        for path in ("skate.side_force", "skate2.side_force"):
            assert np.allclose(made.array(path), 0.5 * MASS * G * np.cos(0.5), atol=1e-6)


def test_a_start_across_the_blade_is_refused_or_turned() -> None:
    scene = on_a_slope()
    scene.start.update({"sleigh.velocity.x": 1.0})
    with pytest.raises(Exception, match="contradict"):
        simulate(scene)


class Fast(Skate):
    """What is no constraint that d'Alembert's principle covers."""

    @constraint(reaction="side_force", unit="N", doc="None.")
    def edge(self) -> Scalar:
        """Return what is not affine in the velocities."""
        return sqrt(dot(self.frame.velocity, self.frame.velocity)) - 1.0


def test_what_is_not_affine_in_velocities_is_refused() -> None:
    scene = Scene()
    link, skate = scene.add("link", Link()), scene.add("skate", Fast())
    scene.connect(link.a, skate.frame)
    with pytest.raises(UnsupportedError, match="linear"):
        assemble(scene).reduced  # noqa: B018
