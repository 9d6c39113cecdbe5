"""How many steps a run takes does not depend on the size of its scene, at any level: all scales are the scene's own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from atwood import (
    Component,
    DeclarationError,
    Load,
    Point,
    Scalar,
    Scene,
    Vector,
    assemble,
    connector,
    discrete_state,
    event,
    exp,
    force,
    parameter,
    simulate,
    sin,
    sweep,
    update,
)
from atwood.simulation.dynamics.scales import scene_length
from atwood_library import (
    Box,
    BoxContact,
    Force,
    Ground,
    Link,
    Mass1D,
    Pivot,
    PointMass,
    PointOnCurve,
    PointOnLevelSurface,
    Potential,
    RigidBody,
    Spring,
    SurfaceContact,
    Weld,
)

from ...helpers.runs import FORMS


def four_bar(size: float) -> Scene:
    """Return a four-bar linkage of some size and density one, with the same motion in its own time."""
    scene = Scene()
    links = [
        scene.add(f"link{i}", Link(length=size * length, mass=size**3)) for i, length in enumerate((1.0, 2.5, 2.0))
    ]
    pivots = [scene.add(f"pivot{i}", Pivot()) for i in range(4)]
    left, right = scene.add("left", Ground()), scene.add("right", Ground(position=(2.5 * size, 0.0, 0.0)))
    ends = left.frame, links[0].a, links[0].b, links[1].a, links[1].b, links[2].b, right.frame, links[2].a
    for pivot, a, b in zip(pivots, ends[::2], ends[1::2], strict=True):
        scene.connect(a, pivot.a)
        scene.connect(pivot.b, b)
    scene.start["pivot0.angle"], scene.start["pivot0.angular_velocity"] = 1.0, 3.0 / np.sqrt(size)
    scene.guess["pivot3.angle"] = 1.4
    return scene


@pytest.mark.sample(1)
@pytest.mark.parametrize(("level", "size"), [("index1-projected", 1e-3), ("ggl", 1e-7)])
def test_steps_do_not_depend_on_the_size_of_the_scene(level: str, size: float) -> None:
    steps, ends = [], []
    for one in (1.0, size):
        result = simulate(
            four_bar(one), form="dae", level=level, t_end=2.0 * np.sqrt(one), rtol=1e-8, outputs=3, max_steps=2000
        )
        assert result.status == "finished"
        ends.append(float(result["pivot0.angle"][-1]))
        steps.append(result.statistics.steps)
    assert ends[1] == pytest.approx(ends[0], abs=1e-4)
    assert 0.8 * steps[0] < steps[1] < 1.25 * steps[0]


def bounces_in_bowl(size: float, form: str) -> tuple[list[tuple[str, float]], float]:
    """Return events in units of the time of fall, and where the ball is then; the size is in the formula alone."""
    scene = Scene()
    ground, ball = scene.add("ground", Ground()), scene.add("ball", PointMass(mass=1.0))
    bowl = scene.add("bowl", SurfaceContact(function=f"z - {0.5 / size!r}*x**2", restitution=0.5, friction=0.1))
    scene.connect(ground.frame, bowl.a)
    scene.connect(ball.point, bowl.b)
    scene.start.update({"ball.position.x": 0.1 * size, "ball.position.z": 0.5 * size})
    scene.start.update({"ball.velocity.x": 0.0, "ball.velocity.z": 0.0})
    run = simulate(scene, t_end=1.5 * size**0.5, rtol=1e-6, form=form)
    return [(e.kind, e.time / size**0.5) for e in run.events], float(run["ball.position.x"][-1]) / size


@pytest.mark.parametrize("form", FORMS)
def test_a_length_in_a_formula_alone_does_not_count_as_a_metre(form: str) -> None:
    whole, at = bounces_in_bowl(1.0, form)
    for size in (1e-3, 1e3):
        events, place = bounces_in_bowl(size, form)
        assert [kind for kind, _ in events] == [kind for kind, _ in whole]
        np.testing.assert_allclose([when for _, when in events], [when for _, when in whole], rtol=1e-9)
        np.testing.assert_allclose(place, at, rtol=1e-9)


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_a_unit_of_a_curve_that_is_not_said_does_not_count_as_a_metre(size: float) -> None:
    lengths = []
    for one in (1.0, size):
        scene = Scene()
        ground, bead = scene.add("ground", Ground()), scene.add("bead", PointMass(mass=1.0))
        wire = scene.add("wire", PointOnCurve(curve=(f"{one!r}*sin(p)", 0.0, f"{0.5 * one!r}*p**2")))
        scene.connect(ground.frame, wire.a)
        scene.connect(bead.point, wire.b)
        scene.start.update({"bead.position.x": 0.5 * one, "bead.velocity.x": 0.0})
        lengths.append(scene_length(assemble(scene)))
    assert lengths[1] == pytest.approx(size * lengths[0])


def two_masses(place: float, space: str) -> Scene:
    """Return two masses on guides, with a spring between them, somewhere in the world."""
    scene = Scene(t_end=10.0, gravity=0.0, space=space, **({"line_axis": (1.0, 0.0, 0.0)} if space == "line" else {}))
    masses = [scene.add(f"mass{i}", Mass1D(origin=(place + i, 0.0, 0.0))) for i in range(2)]
    spring = scene.add("spring", Spring(stiffness=100.0, natural_length=1.0))
    scene.connect(masses[0].flange, spring.a)
    scene.connect(masses[1].flange, spring.b)
    scene.start["mass0.displacement"] = 0.1
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("space", ["line", "plane"])
def test_where_a_scene_stands_says_nothing_of_its_size(space: str, form: str) -> None:
    near, far = (simulate(two_masses(place, space), form=form) for place in (0.0, 1e6))
    np.testing.assert_allclose(near["mass0.displacement"][-1], 0.05 * (1.0 + np.cos(np.sqrt(200.0) * 10.0)), atol=1e-6)
    np.testing.assert_allclose(far["mass0.displacement"], near["mass0.displacement"], atol=1e-6)
    assert far.energy.max_drift < 1e-3


def test_the_size_of_a_scene_in_a_sweep_is_that_of_a_run() -> None:
    scene = Scene(t_end=5.0)
    ground, pivot, body = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("body", RigidBody())
    weld = scene.add("weld", Weld(displacement=(30.0, 0.0, 40.0)))
    for a, b in ((ground.frame, pivot.a), (pivot.b, weld.a), (weld.b, body.frame)):
        scene.connect(a, b)
    many = sweep(scene, {"body.mass": [1.0, 2.0]}, quantities=["pivot.angle"], outputs=11, solver="explicit")
    scene["body"].mass = 2.0
    alone = simulate(scene, outputs=11, solver="explicit")
    # Tolerances follow from the size; with another one steps would differ.
    np.testing.assert_allclose(many["pivot.angle"][1], alone["pivot.angle"], rtol=1e-12)


def test_a_unit_of_length_counts_in_a_sweep_as_in_a_run() -> None:
    scene = Scene(t_end=2.0)
    ground, bead = scene.add("ground", Ground()), scene.add("bead", PointMass(mass=1.0))
    bowl = scene.add("bowl", PointOnLevelSurface(function="z - 3.0*x**2"))
    scene.connect(ground.frame, bowl.a)
    scene.connect(bead.point, bowl.b)
    scene.start.update({"bead.position.x": 0.05, "bead.velocity.x": 0.1})
    many = sweep(scene, {"bowl.scale": [1.0, 20.0]}, quantities=["bead.position.x"], outputs=11, solver="explicit")
    for place, scale in enumerate((1.0, 20.0)):
        scene["bowl"].scale = scale
        alone = simulate(scene, outputs=11, solver="explicit")
        np.testing.assert_allclose(many["bead.position.x"][place], alone["bead.position.x"], rtol=1e-11)


def test_a_place_is_in_metres() -> None:
    with pytest.raises(DeclarationError, match="a place in the world is in metres"):
        parameter(1.0, unit="rad", place=True, doc="An angle.")
    with pytest.raises(DeclarationError, match="a unit of length is in metres"):
        parameter(1.0, unit="rad", unit_length=True, doc="An angle.")


def block(size: float, **given: float) -> Scene:
    """Return a block on its edge, in a plane, as large as is said."""
    scene = Scene()
    ground, box = scene.add("ground", Ground()), scene.add("box", Box(length_x=size, length_z=2.0 * size, **given))
    floor = scene.add("floor", BoxContact(length=size, height=2.0 * size, friction=2.0))
    scene.connect(ground.frame, floor.plane)
    scene.connect(box.frame, floor.box)
    return scene


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_a_thickness_that_a_plane_does_not_read_is_no_size(size: float) -> None:
    assert scene_length(assemble(block(size, mass=1.0))) == 2.0 * size
    assert scene_length(assemble(block(size, mass=1.0, length_y=7e4))) == 2.0 * size
    thick = scene_length(assemble(block(size, density=1.0, length_y=7e4)))  # its mass depends on it
    assert thick == 7e4


class Trap(Component):
    """A point that is caught at a place, which its event alone knows."""

    reach = parameter(3.0, unit="m", doc="Where it is caught.")
    a = connector(Point, "The point.")

    @event(unit="m", target="stop", message="caught")
    def caught(self) -> Scalar:
        """Return how far it is from there."""
        return self.a.position.x - self.reach


def test_a_length_that_an_event_alone_reads_is_a_size() -> None:
    scene = Scene()
    bead, trap = scene.add("bead", PointMass(mass=1.0)), scene.add("trap", Trap())
    scene.connect(bead.point, trap.a)
    assert scene_length(assemble(scene)) == 3.0


def alone(speed: float, stiffness: float = 0.0, place: float = 0.0) -> Scene:
    """Return one mass of 1 kg without lengths, free or on a spring that pulls it to the origin, for ten seconds."""
    scene = Scene(space="line", gravity=0.0, t_end=10.0)
    mass = scene.add("mass", Mass1D(mass=1.0))
    if stiffness:
        field = scene.add("field", Potential(energy_function=f"{0.5 * stiffness!r}*x^2"))
        scene.connect(field.point, mass.flange)
    scene.start.update({"mass.displacement": place, "mass.speed": speed})
    return scene


@pytest.mark.parametrize("solver", ["explicit", "taylor", "ida"])
@pytest.mark.parametrize("form", FORMS)
def test_a_small_scene_without_lengths_is_as_large_as_its_way(form: str, solver: str) -> None:
    for speed in (1e-3, 1e-9):
        run = simulate(alone(speed, 49.0), solver=solver, form=form, outputs=2)
        exact = speed / 7.0 * np.sin(70.0)
        assert run["mass.displacement"][-1] == pytest.approx(exact, rel=1e-4)
    swept = sweep(alone(1e-9, 49.0), start={"mass.speed": [1e-9, 1e-3]}, solver=solver, form=form, outputs=2)
    ends = np.array([swept["mass.displacement"][k, -1] / speed for k, speed in enumerate((1e-9, 1e-3))])
    np.testing.assert_allclose(ends, np.sin(70.0) / 7.0, rtol=1e-4)


@pytest.mark.parametrize("solver", ["explicit", "taylor", "ida"])
def test_where_a_single_body_floats_says_nothing_of_its_size(solver: str) -> None:
    scene = Scene(gravity=0.0, t_end=10.0)
    mass = scene.add("mass", PointMass(mass=1.0))
    push = scene.add("push", Force(direction=(1.0, 0.0, 0.0), value=lambda t: 100.0 * exp(-((100.0 * (t - 5.0)) ** 2))))
    scene.connect(push.point, mass.point)
    scene.start.update(
        {"mass.position.x": 1e6, "mass.position.z": -1e6, "mass.velocity.x": 0.0, "mass.velocity.z": 0.0}
    )
    run = simulate(scene, solver=solver, outputs=2)
    assert run["mass.velocity.x"][-1] == pytest.approx(np.sqrt(np.pi), rel=1e-5)


AMPLITUDES = {
    "sine": (lambda t: sin(3 * t), lambda t: math.sin(3 * t)),
    "pulse": (lambda t: exp(-(((t - 5) / 0.1) ** 2)), lambda t: math.exp(-(((t - 5) / 0.1) ** 2))),
}
"""Forces of time that are nothing at the start, for the equations and as numbers."""


@pytest.mark.parametrize("solver", ["explicit", "taylor", "ida"])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("law", AMPLITUDES)
def test_a_scene_without_lengths_that_a_force_moves_from_rest_is_as_large_as_its_motion(
    law: str, form: str, solver: str
) -> None:
    symbolic, number = AMPLITUDES[law]
    exact = quad(lambda t: number(t) * math.sin(7 * (10 - t)) / 7, 0, 10, points=[4.5, 5, 5.5], limit=200)[0]
    for size in (1e-2, 1e-9):
        scene = alone(0.0, 49.0)
        push = scene.add("push", Force(direction=(1.0, 0.0, 0.0), value=lambda t, f=size: f * symbolic(t)))
        scene.connect(push.point, scene.parts["mass"].flange)
        run = simulate(scene, solver=solver, form=form, outputs=2)
        assert run["mass.displacement"][-1] == pytest.approx(size * exact, rel=1e-4)
        assert 0.0 < run.start.length < size


class Push(Component):
    """A force of time that varies with a parameter."""

    point: Point = connector(Point, "What it pushes.")
    size: float = parameter(1.0, unit="N", doc="Its largest value.")

    @force
    def push(self) -> list[Load]:
        """Return the force."""
        return [Load(self.point, force=Vector(self.size * sin(3.0 * self.time), 0.0, 0.0))]


def pushed(size: float = 1.0) -> Scene:
    """Return 1 kg at rest in a plane without lengths, which a force moves."""
    scene = Scene(gravity=0.0, t_end=10.0)
    mass, push = scene.add("mass", PointMass(mass=1.0)), scene.add("push", Push(size=size))
    scene.connect(push.point, mass.point)
    scene.start.update({f"mass.{kind}.{axis}": 0.0 for kind in ("position", "velocity") for axis in "xz"})
    return scene


@pytest.mark.parametrize("until", [None, "mass.velocity.z crosses 1"])
@pytest.mark.parametrize("outputs", [2, 50])
def test_runs_of_a_sweep_without_lengths_are_each_as_large_as_their_motion(until: str | None, outputs: int) -> None:
    sizes = [1.0, 1e-3, 1e-6, 1e-9] * 2
    options = {"outputs": outputs} | ({"until": until} if until else {})
    swept = sweep(pushed(), vary={"push.size": sizes}, quantities=["mass.position.x"], **options)
    exact = 10.0 / 3.0 - math.sin(30.0) / 9.0
    found = swept.quantities["mass.position.x"]
    np.testing.assert_allclose(found[:, -1] / sizes, exact, rtol=1e-7)
    np.testing.assert_array_equal(found[3], simulate(pushed(1e-9), **options)["mass.position.x"])


def test_what_moves_little_under_updates_that_are_not_asked_twice_is_told() -> None:
    class Kept(Component):
        """Holds a force that was there at its last sample."""

        point: Point = connector(Point, "What it pushes.")
        held: float = discrete_state(0.0, unit="N", doc="The force.")

        @update(every=1.0, sets=("held",))
        def sample(self) -> float:
            return 1e-9

        @force
        def push(self) -> list[Load]:
            return [Load(self.point, force=Vector(self.held, 0.0, 0.0))]

    scene = Scene(gravity=0.0, t_end=10.0)
    mass, kept = scene.add("mass", PointMass(mass=1.0)), scene.add("kept", Kept())
    scene.connect(kept.point, mass.point)
    scene.start.update({f"mass.{kind}.{axis}": 0.0 for kind in ("position", "velocity") for axis in "xz"})
    with pytest.warns(UserWarning, match="without lengths it counts as 1 m large, and moves by 5e-08 m"):
        simulate(scene)
    assert simulate(scene, nominal={"mass.position.x": 5e-8}).status == "finished"
