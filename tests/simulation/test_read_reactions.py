"""Forces that depend on constraint forces: Coulomb friction against closed forms, in both forms."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from atwood import DeclarationError, Load, Scene, StartError, UnsupportedError, Vector, force, simulate
from atwood.pipeline import assemble
from atwood_library import Disc, Force, Ground, Link, PointMass, RigidBody, Slider, Weld

from ..helpers.friction import (
    Capstan,
    JournalBearing,
    RoughHoop,
    RoughPad,
    RoughPlane,
    RoughSlope,
    WrongPotential,
)
from ..helpers.runs import FORMS, apart, run_both

G, MU, SLOPE, MASS = 9.81, 0.3, 0.6, 2.0
DAE = ("dae", "ida")
WAYS = [("reduced", "ida"), ("reduced", "explicit"), ("reduced", "taylor"), DAE]


def on_a_slope(starts: str = "slips_ahead", speed: float = 0.0, pull: Any = 0.0, friction: float = MU) -> Scene:
    scene = Scene()
    ground, block = scene.add("ground", Ground()), scene.add("block", PointMass(mass=MASS))
    slope = scene.add("slope", RoughSlope(angle=SLOPE, friction=friction, starts=starts))
    force = scene.add("force", Force(value=pull, direction=(math.cos(SLOPE), 0.0, math.sin(SLOPE))))
    scene.connect(ground.frame, slope.a)
    scene.connect(slope.b, block.point)
    scene.connect(force.point, block.point)
    scene.start["slope.way"] = 0.0
    if starts != "sticks":
        scene.start["block.velocity.x"] = speed * math.cos(SLOPE)
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_a_block_slides_down_a_slope(form: str) -> None:
    result = simulate(on_a_slope("slips_back"), form=form, t_end=2.0, rtol=1e-11, outputs=21)
    assert not result.events
    a = -G * (math.sin(SLOPE) - MU * math.cos(SLOPE))
    assert np.max(np.abs(result.array("slope.way") - 0.5 * a * result.time**2)) < 1e-8
    assert np.allclose(result.array("slope.normal"), MASS * G * math.cos(SLOPE), rtol=1e-12)
    assert result.energy.max_drift < 1e-8


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("friction", [0.3, 1.0])  # less and more than the tangent of the slope
def test_thrown_up_it_stays_or_comes_back(friction: float, form: str) -> None:
    result = simulate(on_a_slope(speed=3.0, friction=friction), form=form, t_end=2.0, rtol=1e-11, outputs=21)
    up = G * (math.sin(SLOPE) + friction * math.cos(SLOPE))
    stop, highest = 3.0 / up, 4.5 / up
    assert result.events[0].time == pytest.approx(stop, abs=1e-8)
    laws = [one.law for one in result.events]
    if friction > math.tan(SLOPE):
        assert laws == ["stops_ahead"]
        assert result.array("slope.way")[-1] == pytest.approx(highest, abs=1e-8)
        assert result.array("slope.grip")[-1] == pytest.approx(MASS * G * math.sin(SLOPE), rel=1e-9)
    else:
        assert laws == ["stops_ahead", "lets_go_back"]
        down = G * (math.sin(SLOPE) - friction * math.cos(SLOPE))
        assert result.array("slope.way")[-1] == pytest.approx(highest - 0.5 * down * (2.0 - stop) ** 2, abs=1e-7)


@pytest.mark.parametrize("form", FORMS)
def test_it_slips_when_the_reaction_is_more_than_friction_can_hold(form: str) -> None:
    scene = on_a_slope("sticks", pull=lambda t: 20.0 * t, friction=0.8)
    result = simulate(scene, form=form, t_end=2.0, rtol=1e-11, outputs=21)
    (slips,) = result.events
    limit = MASS * G * (math.sin(SLOPE) + 0.8 * math.cos(SLOPE))
    assert slips.law == "lets_go_ahead"
    assert slips.time == pytest.approx(limit / 20.0, abs=1e-9)
    since = 2.0 - limit / 20.0
    assert result.array("slope.way")[-1] == pytest.approx(20.0 * since**3 / 6.0 / MASS, abs=1e-8)


def bead(rule: str) -> Scene:
    """Return a bead that starts at the left of a rough ring at 2 m/s downwards."""
    scene = Scene()
    ground, mass = scene.add("ground", Ground()), scene.add("bead", PointMass(mass=MASS))
    ring = scene.add("ring", RoughHoop(radius=0.8, friction=MU, rule=rule))
    scene.connect(ground.frame, ring.a)
    scene.connect(ring.b, mass.point)
    scene.start.update({"ring.angle": math.pi, "bead.velocity.z": -2.0})
    return scene


def speed_squared(phi: np.ndarray) -> np.ndarray:
    """Return v^2 where the bead has come round by phi: ``w' + 2 mu w = 2 g R (cos phi - mu sin phi)``, w = 4 at 0."""
    k, drive = 2.0 * MU, 2.0 * G * 0.8
    a, b = np.linalg.solve([[k, 1.0], [-1.0, k]], [drive, -drive * MU])
    return np.asarray(a * np.cos(phi) + b * np.sin(phi) + (4.0 - a) * np.exp(-k * phi))


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("rule", "form", "solver"), [("size", "reduced", "explicit"), *(("inwards", *way) for way in WAYS), ("size", *DAE)]
)
def test_a_bead_on_a_rough_ring(rule: str, form: str, solver: str) -> None:
    result = simulate(bead(rule), form=form, solver=solver, t_end=0.5, rtol=1e-12, outputs=11)
    phi = result.array("ring.angle") - math.pi
    v2 = result.array("bead.velocity.x") ** 2 + result.array("bead.velocity.z") ** 2
    assert phi[-1] > 1.5
    assert np.max(np.abs(v2 - speed_squared(phi))) < 1e-8
    assert np.allclose(result.array("ring.normal"), MASS * (v2 / 0.8 + G * np.sin(phi)), atol=1e-7)
    assert result.energy.max_drift < 1e-8


def test_what_has_no_series_is_refused_by_name() -> None:
    with pytest.raises(UnsupportedError, match="no Taylor series"):
        simulate(bead("size"), solver="taylor", t_end=0.5)


def wedge(friction: float = MU) -> Scene:
    """Return a block on a rough wedge that slides on the ground without friction."""
    scene = Scene()
    ground, cart = scene.add("ground", Ground()), scene.add("cart", PointMass(mass=3.0))
    rail, block = scene.add("rail", Slider()), scene.add("block", PointMass(mass=MASS))
    slope = scene.add("slope", RoughSlope(angle=SLOPE, friction=friction, starts="slips_back"))
    for a, b in ((ground.frame, rail.a), (rail.b, slope.a), (slope.b, block.point), (rail.b, cart.point)):
        scene.connect(a, b)
    scene.start.update({"rail.displacement": 0.0, "rail.speed": 0.0, "slope.way": 0.0})
    scene.start["block.velocity.x"] = 0.0
    return scene


def turning() -> Scene:
    """Return a link on a journal bearing, whose friction depends on both components of its force."""
    scene = Scene()
    ground, link = scene.add("ground", Ground()), scene.add("link", Link(length=0.7, mass=1.5))
    bearing, disc = scene.add("bearing", JournalBearing(friction=0.4)), scene.add("bob", PointMass(mass=0.5))
    scene.connect(ground.frame, bearing.a)
    scene.connect(bearing.b, link.a)
    scene.connect(link.b, disc.point)
    scene.start.update({"link.angle": 0.3, "link.angular_velocity": 9.0})
    return scene


def on_a_plane() -> Scene:
    scene = Scene(space="space")
    plane = scene.add("plane", RoughPlane(normal=(0.3, -0.2, 1.0)))
    block = scene.add("block", PointMass(mass=MASS))
    scene.connect(plane.b, block.point)
    scene.start.update({"block.position.x": 0.0, "block.position.y": 0.0, "block.velocity.x": 2.0})
    scene.start["block.velocity.y"] = 1.0
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize("make", [wedge, turning, on_a_plane, lambda: bead("smooth")])
def test_both_forms_are_alike(make: Callable[[], Scene]) -> None:
    reduced, dae = run_both(make, t_end=0.4, rtol=1e-12, outputs=9)
    gaps = apart(reduced.table(), dae.table())
    assert {path: gap for path, gap in gaps.items() if not gap < 1e-8} == {}
    assert max(reduced.energy.max_drift, dae.energy.max_drift) < 1e-8


def test_friction_inside_a_scene_moves_no_momentum() -> None:
    result = simulate(wedge(), t_end=0.4, rtol=1e-11, outputs=9)
    momentum = 3.0 * result.array("cart.velocity.x") + MASS * result.array("block.velocity.x")
    assert np.max(np.abs(result.array("cart.velocity.x"))) > 0.1
    assert np.max(np.abs(momentum)) < 1e-12
    # By hand: N (1 + m s (s - mu c) / M) = m g c, with the wedge's acceleration N (s - mu c) / M.
    s, c = math.sin(SLOPE), math.cos(SLOPE)
    normal = MASS * G * c / (1.0 + MASS * s * (s - MU * c) / 3.0)
    assert np.allclose(result.array("slope.normal"), normal, rtol=1e-10)


@pytest.mark.parametrize("form", FORMS)
def test_the_tension_of_a_rope_grows_round_a_post(form: str) -> None:
    scene = Scene()
    ground, rope = scene.add("ground", Ground()), scene.add("rope", Capstan(friction=0.2))
    left, right = scene.add("left", PointMass(mass=1.0)), scene.add("right", PointMass(mass=3.0))
    scene.connect(ground.frame, rope.post)
    scene.connect(rope.a, left.point)
    scene.connect(rope.b, right.point)
    still = {f"{one}.{what}.x": 0.0 for one in ("left", "right") for what in ("position", "velocity")}
    scene.start.update({**still, "left.position.z": -1.0, "right.velocity.z": 0.0})
    scene.guess["right.position.z"] = -1.0
    result = simulate(scene, form=form, t_end=0.3, rtol=1e-11, outputs=7)
    k = math.exp(0.2 * math.pi)
    a = G * (3.0 - k) / (3.0 + k)
    assert np.max(np.abs(result.array("right.position.z") + 1.0 + 0.5 * a * result.time**2)) < 1e-8
    assert np.allclose(result.array("rope.tension"), 1.0 * (G + a), rtol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_a_force_reads_the_reaction_of_another_part(form: str) -> None:
    scene = Scene()
    ground, rail = scene.add("ground", Ground()), scene.add("rail", Slider())
    block, pad = scene.add("block", PointMass(mass=MASS)), scene.add("pad", RoughPad(friction=MU))
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, block.point)
    scene.connect(block.point, pad.b)
    scene.connect(rail.output("side_force"), pad.input("load"))
    scene.start.update({"block.position.x": 0.0, "block.velocity.x": 2.0})
    result = simulate(scene, form=form, t_end=0.5, rtol=1e-11, outputs=6)
    assert np.max(np.abs(result.array("block.velocity.x") - 2.0 + MU * G * result.time)) < 1e-9
    assert result.energy.max_drift < 1e-8


def test_reactions_that_nothing_determines_are_refused_by_name() -> None:
    scene = on_a_slope("slips_back")
    scene.add("second", Slider(axis=(math.cos(SLOPE), 0.0, math.sin(SLOPE))))
    parts = scene._children()
    scene.connect(parts["ground"].frame, parts["second"].a)
    scene.connect(parts["second"].b, parts["block"].point)
    with pytest.raises(UnsupportedError, match="redundant constraints share the load") as caught:
        simulate(scene, t_end=0.1)
    assert caught.value.where == "slope"

    fixed = Scene()
    first, second, bob = fixed.add("first", Ground()), fixed.add("second", Ground()), fixed.add("bob", PointMass())
    rail, pad = fixed.add("rail", Slider()), fixed.add("pad", RoughPad())
    for one, other in ((first.frame, rail.a), (second.frame, rail.b), (bob.point, pad.b)):
        fixed.connect(one, other)
    fixed.connect(rail.output("side_force"), pad.input("load"))
    with pytest.raises(UnsupportedError, match="is not determined") as caught:
        simulate(fixed, t_end=0.1)
    assert caught.value.where == "rail.guide"


def test_a_reaction_that_no_friction_agrees_with_is_an_error() -> None:
    # N (1 + m s (s - mu c)/M) = m g c has no positive solution for N any more, and none for -N either.
    with pytest.raises(StartError, match="no reaction agrees with the forces that it causes") as caught:
        simulate(wedge(friction=5.0), t_end=0.1)
    assert caught.value.where == "slope"


def test_a_potential_may_not_read_a_reaction() -> None:
    scene = Scene()
    ground, ring = scene.add("ground", Ground()), scene.add("ring", WrongPotential())
    mass = scene.add("bead", PointMass())
    scene.connect(ground.frame, ring.a)
    scene.connect(ring.b, mass.point)
    with pytest.raises(DeclarationError, match="may not read the reaction 'normal'") as caught:
        assemble(scene)
    assert caught.value.where == "ring"


def test_scenes_whose_forces_read_no_reactions_have_nothing_of_it() -> None:
    scene = Scene()
    ground, link, disc = scene.add("ground", Ground()), scene.add("link", Link()), scene.add("disc", Disc())
    scene.connect(ground.frame, link.a)
    scene.connect(link.b, disc.frame)
    assembly = assemble(scene, form="dae")
    assert not assembly.maximal.read
    assert not assembly.maximal.rows_with_multipliers


def weightless(pull: Any) -> Scene:
    """Return a link at rest on a journal bearing, without weight, that is drawn across at its end."""
    scene = Scene(gravity=0.0)
    ground, bearing = scene.add("ground", Ground()), scene.add("bearing", JournalBearing(friction=0.3))
    link, force = scene.add("link", Link()), scene.add("force", Force(value=pull, direction=(0.0, 0.0, 1.0)))
    for a, b in ((ground.frame, bearing.a), (bearing.b, link.a), (link.b, force.point)):
        scene.connect(a, b)
    scene.start.update({"link.angle": 0.0, "link.angular_velocity": 0.0})
    return scene


def test_where_nothing_presses_a_force_has_a_size_and_no_slope() -> None:
    result = simulate(weightless(lambda t: t), t_end=0.4, rtol=1e-10, outputs=5)
    assert result.array("bearing.force_z")[0] == 0.0
    assert np.all(np.abs(result.array("bearing.force_z")[1:]) > 0.01)

    balanced = Scene(gravity=0.0)  # nothing ever presses on a bearing at the centre of a disc
    ground, bearing = balanced.add("ground", Ground()), balanced.add("bearing", JournalBearing())
    disc = balanced.add("disc", RigidBody())
    balanced.connect(ground.frame, bearing.a)
    balanced.connect(bearing.b, disc.frame)
    with pytest.raises(UnsupportedError, match="has no derivative") as caught:
        simulate(balanced, t_end=0.1)
    assert caught.value.where == "bearing.bearing"


class _GlueThatTears(Weld):
    @force
    def pull(self) -> list[Load]:
        """Return a force that reads what a rigid connection carries."""
        return [Load(self.b, Vector(self.reaction("force.x"), 0.0, 0.0))]


def test_what_a_rigid_connection_carries_cannot_be_read() -> None:
    scene = Scene()
    ground, glue, body = scene.add("ground", Ground()), scene.add("glue", _GlueThatTears()), scene.add("body", Link())
    scene.connect(ground.frame, glue.a)
    scene.connect(glue.b, body.a)
    with pytest.raises(DeclarationError, match="may not read the reaction") as caught:
        assemble(scene)
    assert caught.value.where == "glue"
    assert "rigid connection" in caught.value.advice
