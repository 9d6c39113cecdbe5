"""What a scene is does not hang on digits that rounding made: in directions that were computed, in constant rows."""

from __future__ import annotations

import math

import numpy as np
import pytest

from atwood import Component, Frame, Point, Scalar, Scene, connector, constraint, parameter, simulate
from atwood.pipeline import assemble
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.initialization.start import find_start, own_state
from atwood.simulation.problem.preparation import make_problem
from atwood_library import Cylindrical, Ground, Link, Pivot, PointMass, PointOnPlane, RigidBody, Rod, Weld
from atwood_library.scenes import FourBar

FORMS = ("reduced", "dae")


class Balance(Component):
    """Says that three times a tenth is three tenths; where its point is hardly matters, a row of 1e-30."""

    at: Point = connector(Point, "Any point.")
    a: Frame = connector(Frame, "Any frame.")
    tenth: float = parameter(0.1, unit="m", doc="A tenth.")
    whole: float = parameter(0.3, unit="m", doc="Three tenths.")

    @constraint(reaction="nothing", unit="N", doc="Force of nothing.")
    def holds(self) -> Scalar:
        """Return what is left."""
        return 3.0 * self.tenth - self.whole + 1e-30 * (self.at.position.z - self.a.position.z)


def freedom(scene: Scene, form: str) -> int:
    assembly = assemble(scene, form=form)
    start = find_start(assembly)
    plan = make_problem(assembly, start.time, *own_state(assembly, start), start.length, 1.0)
    return len(plan.sizes) - plan.finding.rank


def test_a_row_that_says_nothing_of_the_place_hides_no_other_row() -> None:
    """What is left of its constant does not locate the place, so that other rows are as well known as without it."""
    scene = Scene(space="plane")
    ground, rod = scene.add("ground", Ground()), scene.add("rod", Rod(length=1.0, mass=0.0))
    bob, balance = scene.add("bob", PointMass(mass=1.0)), scene.add("balance", Balance())
    joins = [(ground.frame, rod.a), (rod.b, bob.point), (bob.point, balance.at), (ground.frame, balance.a)]
    for one, other in joins:
        scene.connect(one, other)
    scene.start["rod.angle"] = 0.5
    assert freedom(scene, "dae") == 1
    found = simulate(scene, form="dae", t_end=0.2, outputs=2, rtol=1e-9)
    assert math.hypot(found["bob.position.x"][-1], found["bob.position.z"][-1]) == pytest.approx(1.0, abs=1e-9)


def test_errors_that_were_being_learned_when_ctrl_c_came_are_learned_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was kept of it would be half of it, and what came before Ctrl-C is still projected with it."""
    assembly = assemble(FourBar(), form="dae")
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    plan = make_problem(assembly, start.time, q, u, start.length, 1.0)
    expected, errors = (balance_of(assemble(FourBar(), form="dae"), "dae").errors for _ in range(2))

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(errors, "_learn", interrupted)
        with pytest.raises(KeyboardInterrupt):
            errors.near(0.0, q, plan.sizes)
    np.testing.assert_allclose(errors.near(0.0, q, plan.sizes), expected.near(0.0, q, plan.sizes))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("slant", [math.cos(math.pi / 2.0), -1e-15, 3e-14])
def test_an_axis_that_was_computed_is_the_axis(slant: float, form: str) -> None:
    """A four-bar with pivots along y, of which cosines of right angles are left in other directions, turns."""
    scene = Scene(space="space", gravity=0.0)
    ground, far = scene.add("ground", Ground()), scene.add("far", Weld(displacement=(2.5, 0.0, 0.0)))
    scene.connect(ground.frame, far.a)
    lengths = {"crank": 1.0, "coupler": 2.5, "rocker": 2.0}
    bars = [scene.add(name, Link(length=size, mass=size, axial_moment=1e-3)) for name, size in lengths.items()]
    joins = [(ground.frame, bars[0].a), (bars[0].b, bars[1].a), (bars[1].b, bars[2].b), (far.b, bars[2].a)]
    for i, (one, other) in enumerate(joins):
        pivot = scene.add(f"pivot{i}", Pivot(axis=(slant * (i - 1.4), -1.0, slant * (0.6 - i))))
        scene.connect(one, pivot.a)
        scene.connect(pivot.b, other)
    scene.start.update({"pivot0.angle": 1.0, "pivot0.angular_velocity": 2.0})
    scene.guess.update({"pivot1.angle": -0.7, "pivot3.angle": 1.9})
    assert freedom(scene, form) == 1


def test_in_a_plane_an_axis_that_was_computed_is_the_normal() -> None:
    assert Pivot(axis=(math.cos(math.pi / 2.0), -1.0, 0.0)).axis == (0.0, -1.0, 0.0)


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("angle", [0.3, 0.7, 1.1, 1.9])
def test_a_plane_along_an_axis_holds_nothing_along_it(angle: float, form: str) -> None:
    """The normal is at a right angle to the axis but for rounding, which nothing is solved for."""
    scene = Scene(space="space", gravity=0.0)
    ground, body = scene.add("ground", Ground()), scene.add("body", RigidBody(mass=1.0, moments=(1.0, 1.0, 1.0)))
    tilt = scene.add("tilt", Weld(angle=angle, axis=(1.0, 2.0, -0.5)))
    back = scene.add("back", Weld(angle=-angle, axis=(1.0, 2.0, -0.5)))
    guide, plane = scene.add("guide", Cylindrical(axis=(1.0, 0.0, 0.0))), scene.add("plane", PointOnPlane(axis="z"))
    scene.connect(ground.frame, tilt.a)
    scene.connect(tilt.b, guide.a)
    scene.connect(guide.b, body.frame)
    scene.connect(tilt.b, back.a)
    second = scene.add("second", Weld(angle=angle, axis=(1.0, 2.0, -0.5)))
    scene.connect(back.b, second.a)
    scene.connect(second.b, plane.a)
    scene.connect(body.frame, plane.b)
    scene.start.update({"guide.displacement": 0.2, "guide.speed": 0.3, "guide.angular_velocity": 0.4})
    assert freedom(scene, form) == 2
    found = simulate(scene, form=form, t_end=1.0, outputs=2)
    assert found["guide.displacement"][-1] == pytest.approx(0.5, abs=1e-6)
