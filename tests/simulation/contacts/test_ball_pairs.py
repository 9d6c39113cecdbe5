"""Two balls or discs that touch, from outside and from inside, against laws of impact and of rolling by hand."""

from __future__ import annotations

import math
from typing import Any

import pytest
from scipy.special import ellipk

import atwood as aw
from atwood import Scene, simulate
from atwood_library import (
    BallContact,
    BallPairContact,
    Ground,
    Link,
    Pivot,
    PointContact,
    RigidBody,
    RoughPulley,
    Slider,
    Sphere,
)

FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])


def pair(
    space: str,
    places: list[tuple[float, float, float]],
    velocities: list[tuple[float, float, float]],
    spins: list[tuple[float, float, float]],
    size: float = 1.0,
    **contact: object,
) -> Scene:
    """Return two balls, a and b, of 0.05 and 0.1 sizes and masses in the ratio 1 to 3."""
    scene = Scene(space=space, gravity=0.0)
    touch = scene.add("c", BallPairContact(radius_a=0.05 * size, radius_b=0.1 * size, **contact))
    for name, radius, mass, place, velocity, spin in zip(
        "ab", (0.05, 0.1), (1.0, 3.0), places, velocities, spins, strict=True
    ):
        ball = scene.add(name, Sphere(mass=mass, radius=radius * size))
        scene.connect(ball.frame, getattr(touch, name))
        axes = "xyz" if space == "space" else "xz"
        for axis, x, v in zip("xyz", place, velocity, strict=True):
            if axis in axes:
                scene.start.update({f"{name}.position.{axis}": x * size, f"{name}.velocity.{axis}": v * size})
        if space == "space":
            scene.start.update({f"{name}.{angle}": 0.0 for angle in ("phi", "theta", "psi")})
            scene.start.update({f"{name}.angular_velocity.{axis}": w for axis, w in zip("xyz", spin, strict=True)})
        else:
            scene.start.update({f"{name}.angle": 0.0, f"{name}.angular_velocity.y": spin[1]})
    return scene


def run(scene: Scene, form: str, end: float) -> aw.Result:
    return simulate(scene, form=form, t_end=end, rtol=1e-10, outputs=[0.0, end])


def velocity(result: aw.Result, name: str) -> list[float]:
    return [float(result[f"{name}.velocity.{axis}"][-1]) for axis in "xz"]


@FORMS
@pytest.mark.parametrize(("friction", "size"), [(0.05, 1.0), (10.0, 1.0), (0.05, 1e3), (10.0, 1e-3)])
def test_an_oblique_impact(form: str, friction: float, size: float) -> None:
    """Ball a meets b at 45 degrees: the normal speed becomes -0.8 of itself, friction is Coulomb's."""
    root = math.sqrt(0.5)
    far = 0.15 * root
    none = (0.0, 0.0, 0.0)
    scene = pair(
        "plane",
        [(-1.0, 0.0, 0.0), (far, 0.0, far)],
        [(2.0, 0.0, 0.0), none],
        [none, none],
        size,
        restitution=0.8,
        friction=friction,
    )
    result = run(scene, form, 0.6)
    assert [one.time for one in result.events] == [pytest.approx(0.5, abs=1e-10)]
    normal, tangent = 1.8 * 2.0 * root / (1.0 + 1.0 / 3.0), 2.0 * root / (3.5 * (1.0 + 1.0 / 3.0))
    across = min(friction * normal, tangent)  # along (1, -1), what a loses
    assert velocity(result, "a") == pytest.approx(
        [size * (2.0 - root * (normal + across)), size * -root * (normal - across)], rel=1e-9
    )
    assert velocity(result, "b") == pytest.approx(
        [size * root * (normal + across) / 3.0, size * root * (normal - across) / 3.0], rel=1e-9
    )
    turns = [float(result[f"{name}.angular_velocity.y"][-1]) for name in "ab"]
    assert abs(turns[0]) == pytest.approx(across / (0.4 * 0.05))
    assert turns[1] == pytest.approx(turns[0] * 0.05 / (3.0 * 0.1))  # both are turned the same way


@FORMS
def test_the_impact_is_the_same_in_space(form: str) -> None:
    """Turned into another plane, through the balls' centres: normal and tangent are those of the plane."""
    root = math.sqrt(0.5)
    far, none = 0.15 * root, (0.0, 0.0, 0.0)
    turn = (0.36, 0.48, 0.8), (0.8, -0.6, 0.0)  # two directions that are square to each other

    def turned(x: float, z: float) -> tuple[float, float, float]:
        return tuple(x * e + z * f for e, f in zip(*turn, strict=True))  # type: ignore[return-value]

    places, speeds = [turned(-1.0, 0.0), turned(far, far)], [turned(2.0, 0.0), none]
    result = run(pair("space", places, speeds, [none, none], restitution=0.8, friction=0.05), form, 0.6)
    normal = 1.8 * 2.0 * root / (1.0 + 1.0 / 3.0)
    known = turned(root * 1.05 * normal / 3.0, root * 0.95 * normal / 3.0)
    assert [float(result[f"b.velocity.{axis}"][-1]) for axis in "xyz"] == pytest.approx(known, rel=1e-9)


@FORMS
def test_a_ball_rolls_to_and_fro_in_a_round_bowl(form: str) -> None:
    """It is a pendulum of the length 7/5 (R - r), however far it swings (Landau and Lifshitz, Mechanics, 11)."""
    scene, swing = Scene(), 1.0
    ground, ball = scene.add("ground", Ground()), scene.add("ball", Sphere(mass=2.0, radius=0.1))
    bowl = scene.add("bowl", BallPairContact(radius_a=0.6, radius_b=0.1, touches="inside", friction=5.0))
    scene.connect(ground.frame, bowl.a)
    scene.connect(ball.frame, bowl.b)
    scene.start.update({"ball.position.x": 0.5 * math.sin(swing), "ball.position.z": -0.5 * math.cos(swing)})
    scene.start.update({f"ball.velocity.{axis}": 0.0 for axis in "xz"})
    scene.start.update({"ball.angle": 0.0, "ball.angular_velocity.y": 0.0})
    period = 4.0 * math.sqrt(1.4 * 0.5 / 9.81) * ellipk(math.sin(0.5 * swing) ** 2)
    result = run(scene, form, period)
    assert not result.events
    assert result["ball.position.x"][-1] == pytest.approx(0.5 * math.sin(swing), abs=1e-9)
    assert result["ball.angle"][-1] == pytest.approx(0.0, abs=1e-8)


def test_balls_of_wrong_sizes_are_refused() -> None:
    with pytest.raises(aw.ParameterError, match=r"a ball of 0\.2 m has no room in a hole of 0\.1 m"):
        simulate_inside(0.1, 0.2)


def simulate_inside(hole: float, ball: float) -> None:
    scene = Scene()
    ground, b = scene.add("ground", Ground()), scene.add("b", Sphere(radius=0.1))
    touch = scene.add("c", BallPairContact(radius_a=hole, radius_b=ball, touches="inside"))
    scene.connect(ground.frame, touch.a)
    scene.connect(b.frame, touch.b)
    simulate(scene, t_end=0.1)


def slider_crank_with_clearance(friction: float) -> Scene:
    """Return a slider-crank whose rod ends in a pin of 20 mm that has 1 mm of room all around, in its middle."""
    scene = Scene(space="plane")
    ground, piston = scene.add("ground", Ground()), scene.add("piston", RigidBody(mass=1.0, moments=(0.0, 0.01, 0.0)))
    crank, rod = scene.add("crank", Link(length=0.1)), scene.add("rod", Link(length=0.3))
    main, big_end, guide = scene.add("main", Pivot()), scene.add("big_end", Pivot()), scene.add("guide", Slider())
    pin = BallPairContact(radius_a=0.021, radius_b=0.02, touches="inside", restitution=0.5, friction=friction)
    scene.add("pin", pin)
    for a, b in (
        (ground.frame, main.a),
        (main.b, crank.a),
        (crank.b, big_end.a),
        (big_end.b, rod.a),
        (ground.frame, guide.a),
        (guide.b, piston.frame),
        (piston.frame, pin.a),
        (rod.b, pin.b),
    ):
        scene.connect(a, b)
    angle, speed = 0.5, 20.0
    lean = math.asin(math.sin(angle) / 3.0)
    scene.start.update({"crank.angle": angle, "crank.angular_velocity": speed, "rod.angle": -lean})
    scene.start["rod.angular_velocity"] = -speed * math.cos(angle) / (3.0 * math.cos(lean))
    scene.start["guide.displacement"] = 0.1 * math.cos(angle) + 0.3 * math.cos(lean)
    return scene


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_a_pin_with_clearance(friction: float) -> None:
    """Impacts accumulate, and the pin lets go where the load turns, in both forms alike; it starts in the middle."""
    scene = slider_crank_with_clearance(friction)
    found = [simulate(scene, form=form, t_end=0.09, rtol=1e-9) for form in ("reduced", "dae")]
    for result in found:
        assert result.impacts[0].before == pytest.approx(-1.26046968, rel=1e-3)
        assert "rests" in {event.kind for event in result.events}
        assert result.energy.max_drift < 1e-7 + result.energy.uncertainty
    assert [event.kind for event in found[0].events] == [event.kind for event in found[1].events]
    for one, other in zip(found[0].events, found[1].events, strict=True):
        assert one.time == pytest.approx(other.time, abs=1e-9)
    for path in ("crank.angle", "guide.displacement", "rod.angle"):
        assert float(found[0][path][-1]) == pytest.approx(float(found[1][path][-1]), abs=1e-9)


@pytest.mark.parametrize("part", [PointContact, BallContact, BallPairContact, RoughPulley])
def test_static_friction_below_that_of_slipping_is_refused(part: Any) -> None:
    """What slips would stop and could not stay: it would creep in ever shorter steps."""
    made = part(friction=0.4, static_friction=0.3)
    with pytest.raises(aw.ParameterError, match=r"while it sticks, 0\.3, is below that while it slips, 0\.4"):
        made.check_values()
