"""Linear models and modes in one set of contacts, against closed forms: what is held, what sticks, what slips."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.helpers.contact_scenes import rough_pendulum

import atwood as aw
from atwood import Scene, UsageError, linearize, normal_modes, simulate
from atwood_library import (
    BallContact,
    Box,
    BoxContact,
    Drive,
    Ground,
    Inertia,
    Link,
    PointContact,
    PointMass,
    PointOnLine,
    RigidBody,
    RotationalFriction,
    RotationalMotion,
    RotationalSpringDamper,
    Sphere,
    Spring,
    VertexContact,
)

G = 9.81
FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])
PLACES = pytest.mark.parametrize(("size", "turn", "aside"), [(1.0, 0.0, 0.0), (1e3, 0.7, 3.0), (1e-3, -2.0, -40.0)])


def sprung_block(x: float, size: float = 1.0, turn: float = 0.0, aside: float = 0.0, friction: float = 0.3) -> Scene:
    """Return a block of 2 kg on a floor, `x` sizes to the right of where its spring of 50 N a size lets it be."""
    right, up = (math.cos(turn), 0.0, math.sin(turn)), (-math.sin(turn), 0.0, math.cos(turn))
    scene = Scene(gravity_direction=tuple(-c for c in up))
    ground = scene.add("ground", Ground(position=(aside * size, 0.0, 2.0 * aside * size)))
    m, c = scene.add("m", PointMass(mass=2.0)), scene.add("c", PointContact(normal=up, friction=friction))
    spring = scene.add("spring", Spring(stiffness=50.0 / size))
    for ends in ((ground.frame, c.plane), (m.point, c.point), (ground.frame, spring.a), (m.point, spring.b)):
        scene.connect(*ends)
    place = (aside * size + x * size * right[0], 2.0 * aside * size + x * size * right[2])
    scene.start.update({"m.position.x": place[0], "m.position.z": place[1], "m.velocity.x": 0.0, "m.velocity.z": 0.0})
    return scene


@FORMS
@PLACES
def test_a_block_sticks_slips_and_is_lifted(form: str, size: float, turn: float, aside: float) -> None:
    """Where it sticks its place stays, and friction follows the spring; where it slips it swings elsewhere."""
    place = size, turn, aside
    sticks = linearize(sprung_block(0.05, *place), form=form, outputs=["c.friction_force", "c.normal_force"])
    assert sticks.contacts == {"c.gap": "closed", "c.slip": "sticks"}
    assert sticks.eigenvalues.tolist() == [0.0]
    right = math.cos(turn) if sticks.states[0].startswith("m.position.x") else math.sin(turn)
    assert sticks.C[:, 0] == pytest.approx([50.0 / size / right, 0.0], rel=1e-9, abs=1e-8 / size)
    scene = sprung_block(1.0, *place)
    result = simulate(scene, t_end=0.3 * math.sqrt(size), rtol=1e-10)
    slips = linearize(scene, at=(result, float(result.time[-1])), form=form)
    assert slips.contacts == {"c.gap": "closed", "c.slip": "slips backwards"}
    assert slips.eigenvalues == pytest.approx(np.array([5j, -5j]) / math.sqrt(size), abs=1e-8 / math.sqrt(size))
    smooth = normal_modes(sprung_block(0.0, *place, friction=0.0))
    assert smooth.contacts == {"c.gap": "closed"}
    assert smooth.angular_frequencies == pytest.approx([5.0 / math.sqrt(size)], rel=1e-9)
    scene.start["m.position.z"] += size * math.cos(turn)
    scene.start["m.position.x"] -= size * math.sin(turn)
    result = simulate(scene, t_end=0.1 * math.sqrt(size), rtol=1e-10)
    lifted = linearize(scene, at=(result, float(result.time[-1])), form=form)
    assert lifted.contacts == {"c.gap": "open", "c.slip": "loose"}
    assert np.sort(np.abs(lifted.eigenvalues)) == pytest.approx(np.full(4, 5.0 / math.sqrt(size)), rel=1e-7)


@pytest.mark.parametrize(
    ("x", "law", "what"),
    [
        (0.3 * 2.0 * G / 50.0, "c.slip", "what friction could hold besides is at its border"),
        (0.2, "c.slip", "its speed is at its border"),
    ],
)
def test_borders_of_sets_are_refused_by_name(x: float, law: str, what: str) -> None:
    with pytest.raises(UsageError, match=what) as told:
        linearize(sprung_block(x))
    assert told.value.where == law


def test_gaps_at_their_border_and_impacts_are_refused() -> None:
    scene = sprung_block(0.0)
    for speed, what in ((1.0, "the gap is at its border, 0 m"), (-1.0, "something collides here")):
        scene.start["m.velocity.z"] = speed
        with pytest.raises(UsageError, match=what):
            linearize(scene)


@FORMS
def test_a_ball_rolls_evenly(form: str) -> None:
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", Sphere(mass=1.0, radius=0.1))
    c = scene.add("c", BallContact(friction=0.2, radius=0.1))
    scene.connect(ground.frame, c.plane)
    scene.connect(m.frame, c.ball)
    scene.start.update({"m.position.x": 0.0, "c.gap": 0.0, "m.velocity.x": 0.7, "c.slip": 0.0})
    model = linearize(scene, form=form)
    assert (model.about, model.contacts["c.slip"]) == ("steady motion", "sticks")
    assert model.eigenvalues.tolist() == [0.0, 0.0, 0.0]  # place, turn, and how fast it rolls


@FORMS
def test_a_rod_on_two_supports_carries_a_mass_on_a_spring(form: str) -> None:
    """The rod is held, both of its ends stick, and friction of one of them follows from that of the other."""
    scene = Scene()
    m, bob = scene.add("m", Link(length=1.0, mass=2.0)), scene.add("bob", PointMass(mass=1.0))
    for name, end, place in (("c1", m.a, 0.0), ("c2", m.b, 1.0)):
        ground = scene.add(f"ground_{name}", Ground(position=(place, 0.0, 0.0)))
        contact = scene.add(name, VertexContact(friction=0.3))
        scene.connect(ground.frame, contact.plane)
        scene.connect(end, contact.body)
    rail = scene.add("rail", PointOnLine(axis=(0, 0, 1)))
    spring = scene.add("spring", Spring(stiffness=40.0, natural_length=0.5))
    for ends in ((m.a, rail.a), (bob.point, rail.b), (m.a, spring.a), (spring.b, bob.point)):
        scene.connect(*ends)
    scene.start.update({"m.angle": 0.0, "c1.gap": 0.0, "m.position.x": 0.0, "rail.displacement": 0.5 - G / 40.0})
    found = linearize(scene, form=form)
    assert found.eigenvalues == pytest.approx(np.array([1j, -1j, 0.0]) * math.sqrt(40.0), abs=1e-9)
    assert normal_modes(scene).angular_frequencies == pytest.approx([0.0, math.sqrt(40.0)], rel=1e-10)


def test_a_box_is_held_by_its_corners() -> None:
    """Of four rows of two corners that stick three are independent; the spring swings it where nothing rubs."""
    for friction, known in ((0.3, [0.0]), (0.0, [2.0])):
        scene = Scene()
        ground, m = scene.add("ground", Ground()), scene.add("m", Box(length_x=1.0, length_z=0.2, mass=3.0))
        c = scene.add("c", BoxContact(length=1.0, height=0.2, friction=friction))
        spring = scene.add("spring", Spring(stiffness=12.0))
        for ends in ((ground.frame, c.plane), (m.frame, c.box), (ground.frame, spring.a), (m.frame, spring.b)):
            scene.connect(*ends)
        scene.start.update({"m.position.x": 0.0, "m.position.z": 0.1, "m.angle": 0.0})
        assert normal_modes(scene).angular_frequencies == pytest.approx(known, rel=1e-10)


@FORMS
def test_a_ladder_leans_as_long_as_friction_holds_it(form: str) -> None:
    """At a smooth wall and a rough floor friction is half the weight times the tangent of the lean."""
    scene = Scene()
    ground, m = scene.add("ground", Ground()), scene.add("m", Link(length=2.0, mass=1.0))
    for name, normal, end, rough in (("floor", (0, 0, 1), m.a, 0.5), ("wall", (1, 0, 0), m.b, 0.0)):
        contact = scene.add(name, VertexContact(normal=normal, friction=rough))
        scene.connect(ground.frame, contact.plane)
        scene.connect(end, contact.body)
    scene.start.update({"m.angle": 0.5 * math.pi + 0.3, "m.angular_velocity": 0.0, "floor.gap": 0.0, "wall.gap": 0.0})
    model = linearize(scene, form=form, outputs=["wall.normal_force"])
    assert model.eigenvalues.tolist() == [0.0]
    assert model.C[0] == pytest.approx([0.5 * G / math.cos(0.3) ** 2])
    with pytest.raises(UsageError, match="what friction could hold besides is at its border"):
        linearize(aw.assemble(scene).with_values({"floor.friction": 0.5 * math.tan(0.3)}))


@FORMS
def test_a_pendulum_with_friction_in_its_hinge(form: str) -> None:
    model = linearize(rough_pendulum(0.02), form=form)
    assert (model.contacts, model.eigenvalues.tolist()) == ({"rub.slip": "sticks"}, [0.0])
    result = simulate(rough_pendulum(1.5), t_end=0.1, rtol=1e-10)
    slips = linearize(rough_pendulum(1.5), at=(result, 0.1), form=form)
    pull = G * math.cos(float(result["pivot.angle"][-1]) + 0.5 * math.pi)
    assert slips.eigenvalues**2 == pytest.approx(np.full(2, -pull), rel=1e-9)


@FORMS
def test_friction_that_falls_with_speed_makes_oscillations_grow(form: str) -> None:
    """A rotor at a disc that turns (a squealing brake): J s^2 + dF/dv s + k = 0 with F = 4 (1 + exp(-10 v))."""
    scene = Scene()
    m, disc = scene.add("m", Inertia(moment=2.0)), scene.add("disc", Inertia(moment=1.0))
    drive = scene.add("drive", RotationalMotion(follows="speed", speed=0.2))
    rub = scene.add("rub", RotationalFriction(sliding="4*(1 + exp(-10*v))"))
    spring = scene.add("spring", RotationalSpringDamper(stiffness=100.0, against="ground"))
    for ends in ((m.flange, rub.b), (disc.flange, rub.a), (disc.flange, drive.b), (m.flange, spring.b)):
        scene.connect(*ends)
    at_rest = 0.04 * (1.0 + math.exp(-2.0))
    scene.start.update({"m.angle": at_rest, "m.angular_velocity": 0.0, "disc.angle": 0.0})
    model = linearize(scene, form=form)
    assert (model.contacts, model.is_stable) == ({"rub.slip": "slips backwards"}, False)
    known = np.roots([2.0, -40.0 * math.exp(-2.0), 100.0])
    assert np.sort_complex(model.eigenvalues[:2]) == pytest.approx(np.sort_complex(known), rel=1e-9)
    assert "contacts     rub.slip slips backwards" in str(model)
    assert model.to_data()["contacts"] == {"rub.slip": "slips backwards"}


@FORMS
@pytest.mark.parametrize("time", [0.1, 0.8])
def test_a_plate_that_is_driven_and_turns_with_nothing_has_no_angle_where_the_gap_is_open(
    form: str, time: float
) -> None:
    """The maximal coordinates of that set are fewer than those of the scene; a spring beside the gap oscillates."""
    scene = Scene()
    ground, drive, plate = scene.add("ground", Ground()), scene.add("drive", Drive(axis=(0, 0, 1))), RigidBody(mass=1.0)
    drive.motion = "0.02*sin(9*t)"
    scene.add("plate", plate)
    mass, touch = scene.add("m", PointMass(mass=2.0)), scene.add("c", PointContact(restitution=0.5))
    guide, spring = scene.add("guide", PointOnLine(axis=(0, 0, 1))), scene.add("spring", Spring(stiffness=50.0))
    for ends in (
        (ground.frame, drive.a),
        (drive.b, plate.frame),
        (plate.frame, touch.plane),
        (mass.point, touch.point),
        (ground.frame, guide.a),
        (mass.point, guide.b),
        (ground.frame, spring.a),
        (mass.point, spring.b),
    ):
        scene.connect(*ends)
    scene.start.update({"m.position.z": 1.0, "m.velocity.z": 0.0})
    model = linearize(scene, form=form, at=(simulate(scene, t_end=1.0), time))
    assert model.contacts == {"c.gap": "open"}
    assert np.abs(model.eigenvalues) == pytest.approx([5.0, 5.0], rel=1e-9)
