"""Derivatives over events: against formulas, and against differences of runs."""

import numpy as np
import pytest

from atwood import (
    Component,
    Load,
    Point,
    Scene,
    SolveError,
    UnsupportedError,
    assemble,
    connector,
    force,
    parameter,
    select,
    sensitivities,
    simulate,
)
from atwood_library import Force, Ground, PointContact, PointMass, Pulse, Rod, Rope, Sine
from atwood_library.scenes import BouncingBall, CartPole, Clutches, NewtonsCradle, RockingBlock, StickSlip, Woodpecker


def slack_rope():
    """A bob on a rope that goes slack at 0.487 s and comes taut with a jerk at 1.108 s."""
    scene = Scene(t_end=2.0)
    ground, rope = scene.add("ground", Ground()), scene.add("rope", Rope(length=1.0, when_slack="slack"))
    bob = scene.add("bob", PointMass(mass=1.0))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    scene.guess["bob.position.z"] = -1.0
    scene.start.update({"bob.position.x": 0.0, "bob.velocity.x": 5.2})
    return scene


def pushed():
    """A pendulum that is pushed for a while again and again."""
    scene = Scene()
    ground, rod = scene.add("ground", Ground()), scene.add("rod", Rod(length=1.0))
    bob, push = scene.add("bob", PointMass(mass=1.0)), scene.add("push", Force())
    source = scene.add("source", Pulse(amplitude=3.0, start_time=0.2, period=0.7, width=0.4))
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.connect(push.point, bob.point)
    scene.connect(source.output("value"), push.input("value"))
    scene.start["rod.angle"] = 0.4
    return scene


class Wind(Component):
    """Pushes beyond a place."""

    point: Point = connector(Point, "Where it pushes.")
    place = parameter(0.3, unit="m", doc="From where on it pushes.")
    size = parameter(2.0, unit="N", doc="How much.")

    @force
    def push(self):
        yield Load(self.point, (select(self.point.position.x > self.place, self.size, 0.0), 0.0, 0.0))


def in_wind():
    scene = Scene()
    bob, wind = scene.add("bob", PointMass(mass=1.0)), scene.add("wind", Wind())
    scene.connect(bob.point, wind.point)
    scene.start.update({"bob.position.x": 0.0, "bob.velocity.x": 0.5, "bob.position.z": 0.0})
    return scene


def sliding(speed=(0.0, 0.0), static=None, pushes=()):
    """A body on a rough floor in space, with a speed and with pushes: direction, size, angular frequency and phase."""
    scene = Scene(space="space")
    ground, bob = scene.add("ground", Ground()), scene.add("bob", PointMass(mass=1.0))
    floor = scene.add("floor", PointContact(friction=0.3, static_friction=static))
    scene.connect(ground.frame, floor.plane)
    scene.connect(floor.point, bob.point)
    for k, (direction, size, frequency, phase) in enumerate(pushes):
        push = scene.add(f"push{k}", Force(direction=direction))
        source = scene.add(f"source{k}", Sine(amplitude=size, angular_frequency=frequency, phase=phase))
        scene.connect(push.point, bob.point)
        scene.connect(source.output("value"), push.input("value"))
    for axis, one in zip("xyz", (*speed, 0.0), strict=True):
        scene.start.update({f"bob.position.{axis}": 0.0, f"bob.velocity.{axis}": one})
    return scene


def stops():
    return sliding((0.6, 0.3), pushes=[((1.0, 0.0, 0.0), 1.0, 2.0, 0.5)])


def yields():
    return sliding(pushes=[((1.0, 0.0, 0.0), 5.0, 3.0, 0.0), ((0.0, 1.0, 0.0), 3.0, 4.4, 0.3)])


def breaks_away():
    return sliding(static=0.4, pushes=[((1.0, 0.0, 0.0), 5.0, 3.0, 0.0), ((0.0, 1.0, 0.0), 3.0, 4.4, 0.3)])


CASES = [
    (BouncingBall, "ball.position.z", "height", None, False, 0.8),
    (StickSlip, "body.position.x", "belt_speed", None, False, 3.0),
    (RockingBlock, "block.angle", "tilt", None, False, 1.0),
    (CartPole, "rail.displacement", "lean", None, False, 0.3),
    (NewtonsCradle, "rod5.angle", "ball5.mass", "ball5.mass", False, 0.8),
    (Woodpecker, "sleeve.position.z", "hinge.angular_velocity", -10.5, True, 0.15),
    (slack_rope, "bob.position.x", "rope.length", 1.0, False, 1.5),
    (slack_rope, "bob.position.z", "bob.velocity.x", 5.2, True, 1.5),
    (pushed, "bob.position.x", "source.start_time", 0.2, False, 1.0),
    (pushed, "bob.position.x", "source.width", 0.4, False, 1.0),
    (in_wind, "bob.position.x", "wind.place", 0.3, False, 1.0),
    (stops, "bob.position.y", "bob.velocity.x", 0.6, True, 1.0),
    (stops, "bob.position.x", "floor.friction", 0.3, False, 1.0),
    (yields, "bob.position.x", "floor.friction", 0.3, False, 0.8),
    (breaks_away, "bob.position.y", "floor.friction", 0.3, False, 0.8),
    (breaks_away, "bob.position.x", "source0.amplitude", 5.0, False, 2.0),
]


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(("make", "quantity", "path", "value", "is_start", "t_end"), CASES)
def test_meets_differences(make, quantity, path, value, is_start, t_end, form):
    scene = make()
    if not isinstance(value, float):
        owner, _, name = path.rpartition(".")
        value = (scene[owner] if owner else scene)._value(name)
    given = {"start" if is_start else "parameters": [path]}
    outputs = [0.5 * t_end, t_end]
    found = sensitivities(scene, [quantity], **given, t_end=t_end, outputs=outputs, form=form, rtol=1e-11)
    assembly = assemble(scene, form=form)

    def at(change):
        values = {path: value + change}
        other = assembly.with_values({}, start=values) if is_start else assembly.with_values(values)
        return simulate(other, t_end=t_end, outputs=outputs, rtol=1e-13)[quantity]

    h = 2e-4
    slopes = [(at(one) - at(-one)) / (2.0 * one) for one in (h, h / 2.0)]
    near = (4.0 * slopes[1] - slopes[0]) / 3.0
    assert np.max(np.abs(near)) > 1e-3
    assert found[quantity, path] == pytest.approx(near, abs=1e-7 * max(1.0, np.max(np.abs(near))))


def test_slips_in_two_directions_that_begin_are_not_gone_back_over():
    about = {"parameters": ["floor.friction"], "t_end": 0.8, "outputs": [0.8]}
    with pytest.raises(UnsupportedError, match=r"floor: at t = 0\.1.* a slip in two directions begins"):
        sensitivities(breaks_away(), ["bob.position.x"], mode="adjoint", **about)
    found = sensitivities(breaks_away(), ["bob.position.x"], inputs={}, **about)
    assert found.derivatives.shape == (1, 1, 1)


def test_of_a_bounce():
    """From a height h down in sqrt(2 h / g), then up again with a share e of the speed."""
    scene = BouncingBall()
    found = sensitivities(scene, ["ball.velocity.z"], parameters=["height"], t_end=0.8, outputs=[0.8])
    impacts = [one for one in found.result.events if one.kind == "impact"]
    assert len(impacts) == 1
    gravity, time = found.result.assembly.flat.gravity, impacts[0].time
    restitution = -impacts[0].struck.after / impacts[0].struck.before
    by_height = 1.0 / (gravity * time)  # of the time of the impact
    assert found["ball.velocity.z", "height"][-1] == pytest.approx((1.0 + restitution) * gravity * by_height, rel=1e-9)


@pytest.mark.parametrize(
    ("make", "given", "t_end", "said"),
    [
        (BouncingBall, {"parameters": ["height"]}, 20.0, "impacts have accumulated"),
        (NewtonsCradle, {"start": ["rod5.angular_velocity"]}, 1.0, "touch4: at t = 0 s it touches"),
    ],
)
def test_where_there_are_none(make, given, t_end, said):
    with pytest.raises(SolveError, match=said):
        sensitivities(make(), **given, t_end=t_end)


def test_functions_that_a_scene_makes_anew_do_not_shape_its_equations():
    """A library scene whose torques are functions was refused: each time it is built they are other objects."""
    paths = [f"rotor{i}.angular_velocity" for i in (1, 4)]
    found = sensitivities(Clutches(), paths, parameters=["moment"], t_end=2.0)
    runs = [simulate(Clutches(moment=1.0 + by), t_end=2.0, rtol=1e-12, outputs=[0.0, 2.0]) for by in (1e-6, -1e-6)]
    for path in paths:
        known = (runs[0][path][-1] - runs[1][path][-1]) / 2e-6
        assert found[path, "moment"][-1] == pytest.approx(known, abs=1e-7)
    other = assemble(Clutches()).with_values({"drive": 11.0})  # which one of these functions reads
    assert "motor.value is a function" in other.why_new
    assert simulate(other, t_end=0.3)["rotor1.angular_velocity"][-1] != pytest.approx(
        simulate(Clutches(), t_end=0.3)["rotor1.angular_velocity"][-1], abs=1e-3
    )
