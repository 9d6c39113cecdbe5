"""Positions of a mechanism far from the world's origin are counted from near by; nothing that is read shows it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from atwood import (
    Component,
    Frame,
    Scalar,
    Scene,
    Vector,
    assemble,
    connector,
    conserved,
    cos,
    parameter,
    potential,
    simulate,
    unilateral,
)
from atwood.expr import depends_on
from atwood_library import Box, Ground, Link, Pivot, PointMass, Rod, Rope, Weld

PLACE = (3.0e5, -1.0e5, 2.0e5)
FORMS = ("reduced", "dae")


class Washboard(Component):
    """A potential along a line of the world: its law reads a position as it is there."""

    a: Frame = connector(Frame, "What is pulled.")
    wave: float = parameter(0.5, unit="m", above=0.0, doc="Length of a wave.")

    @potential
    def bumps(self) -> Scalar:
        """Rise and fall along x."""
        return 0.2 * cos(2.0 * math.pi / self.wave * self.a.position.x)


def two_links(place: tuple[float, float, float], space: str = "plane") -> Scene:
    """Return two links on a pivot, with a ball on a rod beside them, on a washboard."""
    scene = Scene(space=space, t_end=0.5)
    ground, base = scene.add("ground", Ground(position=place)), scene.add("base", Weld(displacement=(1.0, 0.0, 0.0)))
    shoulder, elbow = scene.add("shoulder", Pivot()), scene.add("elbow", Pivot())
    upper = scene.add("upper", Link(length=1.0, mass=1.0, axial_moment=0.01))
    lower = scene.add("lower", Link(length=0.7, mass=0.5, axial_moment=0.01))
    rod, bob = scene.add("rod", Rod(length=0.8)), scene.add("bob", PointMass(mass=0.3))
    board = scene.add("board", Washboard())
    joined = (
        (ground.frame, base.a),
        (base.b, shoulder.a),
        (shoulder.b, upper.a),
        (upper.b, elbow.a),
        (elbow.b, lower.a),
        (ground.frame, rod.a),
        (rod.b, bob.point),
        (lower.b, board.a),
    )
    for one, other in joined:
        scene.connect(one, other)
    scene.start.update({"shoulder.angle": 0.4, "elbow.angle": -0.3, "elbow.angular_velocity": 1.0, "rod.angle": 0.5})
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_what_is_read_is_where_it_is_in_the_world(form: str) -> None:
    near, far = (simulate(two_links(place), form=form, rtol=1e-11, outputs=5) for place in ((0.0, 0.0, 0.0), PLACE))
    assert far.assembly.mechanism.origin is not None
    place = dict(zip("xyz", PLACE, strict=True))
    for path in near:
        expected = np.array(near[path])
        size = max(1.0, float(np.max(np.abs(expected))))
        if path.endswith((".position.x", ".position.z", "center_of_mass.x", "center_of_mass.z")):
            expected = expected + place[path[-1]]
        elif "angular_momentum" in path or "energy" in path:
            continue  # these are about the world's origin; see below
        np.testing.assert_allclose(far[path], expected, rtol=1e-14, atol=1e-8 * size, err_msg=path)


@pytest.mark.parametrize("form", FORMS)
def test_energies_and_momenta_are_about_the_worlds_origin(form: str) -> None:
    near, far = (simulate(two_links(place), form=form, rtol=1e-11, outputs=5) for place in ((0.0, 0.0, 0.0), PLACE))
    weight = 9.81 * PLACE[2] * far["mass"]
    np.testing.assert_allclose(far["potential_energy"] - weight, near["potential_energy"], atol=1e-7)
    x, z = PLACE[0], PLACE[2]
    shift = x * far["momentum.z"] - z * far["momentum.x"]
    np.testing.assert_allclose(far["angular_momentum"] - shift, near["angular_momentum"], atol=1e-7)


def test_other_places_are_other_values_of_one_structure_or_another_origin() -> None:
    far = assemble(two_links(PLACE))
    other = far.with_values({"ground.position": (2.0e5, -1.0e5, -3.0e5)})
    assert other.shared is far.shared
    found = simulate(other, rtol=1e-10, outputs=2)
    expected = simulate(two_links((2.0e5, -1.0e5, -3.0e5)), rtol=1e-10, outputs=2)
    np.testing.assert_allclose(found["lower.position.x"], expected["lower.position.x"], rtol=1e-14)
    near = far.with_values({"ground.position": (1.0, 0.0, 2.0)})
    assert near.mechanism.origin is None
    assert near.shared is not far.shared


def test_coordinates_that_are_counted_from_elsewhere_say_so() -> None:
    names = [one.name for one in assemble(two_links(PLACE), form="dae").own_equations.names]
    assert "bob.position.x from ground.frame" in names
    assert "upper.angle" in names
    assert "bob.position.x" in [
        one.name for one in assemble(two_links((1.0, 0.0, 0.0)), form="dae").own_equations.names
    ]


@pytest.mark.parametrize("form", FORMS)
def test_other_modes_count_from_the_same_place(form: str) -> None:
    """A ball on a rope that goes slack and comes taut again, far away."""

    def thrown(place: tuple[float, float, float]) -> Scene:
        scene = Scene(space="plane", t_end=1.2)
        ground, rope = scene.add("ground", Ground(position=place)), scene.add("rope", Rope(when_slack="slack"))
        bob = scene.add("bob", PointMass(mass=1.0))
        scene.connect(ground.frame, rope.a)
        scene.connect(rope.b, bob.point)
        scene.start["bob.position.x"], scene.start["bob.velocity.z"] = place[0] + 1.0, 3.0
        scene.guess["bob.position.z"] = place[2]
        return scene

    near, far = (simulate(thrown(place), form=form, outputs=7) for place in ((0.0, 0.0, 0.0), PLACE))
    assert [one.law for one in far.events] == [one.law for one in near.events]
    np.testing.assert_allclose(far["bob.position.z"] - PLACE[2], near["bob.position.z"], atol=1e-6)


def test_conserved_momenta_are_about_the_worlds_origin() -> None:
    scene = Scene(space="plane", gravity=0.0)
    ground, rod = scene.add("ground", Ground(position=PLACE)), scene.add("rod", Rod(length=1.0))
    bob = scene.add("bob", PointMass(mass=2.0))
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.start.update({"rod.angle": 0.3, "rod.angular_velocity": 1.5})
    told = str(conserved(scene))
    assert "300000" in told, told


class Floor(Component):
    """A floor whose gap is written in one of several orders."""

    order: int = parameter(0, integer=True, minimum=0, maximum=8, doc="Which.")
    radius: float = parameter(0.1, unit="m", doc="Of the ball at the end of the arm.")
    body: Frame = connector(Frame, "What cannot pass.")
    plane: Frame = connector(Frame, "The floor.")

    @unilateral(reaction="normal_force", unit="N", doc="Force on the ball.")
    def gap(self) -> Scalar:
        """Distance of the ball."""
        p, o, r = self.body.position.z, self.plane.position.z, self.radius
        arm = self.body.to_world(Vector(0.3, 0.0, 0.2)).z
        written = (
            p + arm - r - o,
            p - r + arm - o,
            p - r - o + arm,
            -(o - p - arm + r),
            arm + p - (o + r),
            p - (o - arm) - r,
            arm - r + p - o,
            (p + 0.5 * arm) + (0.5 * arm - r) - o,
            p - (r - arm) - o,
        )
        return written[self.order]


@pytest.mark.parametrize("order", range(9))
def test_the_difference_of_two_places_far_away_is_without_what_both_have(order: int) -> None:
    scene = Scene()
    ground, box = scene.add("ground", Ground(position=PLACE)), scene.add("box", Box(mass=1.0))
    floor = scene.add("floor", Floor(order=order))
    scene.connect(ground.frame, floor.plane)
    scene.connect(box.frame, floor.body)
    scene.start.update({"box.position.x": PLACE[0], "box.position.z": PLACE[2] + 2.0, "box.angle": 0.3})
    assembly = assemble(scene)
    gap = assembly.maximal.contacts[0].row.value
    assert assembly.mechanism.origin is not None
    assert not depends_on(gap, list(assembly.mechanism.table.origin))
