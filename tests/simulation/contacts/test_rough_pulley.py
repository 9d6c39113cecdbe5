"""A rope over a rough pulley, against Euler's formula for the tensions at both of its ends."""

from __future__ import annotations

import math

import pytest

import atwood as aw
from atwood import Scene, simulate
from atwood_library import Ground, Inertia, PointMass, Pulley, RoughPulley

G = 9.81
FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])


def capstan(
    masses: tuple[float, float], speed: float = 0.0, space: str = "line", size: float = 1.0, **rope: object
) -> Scene:
    """Return two masses that hang on a rope, 1 and 2 sizes below a pulley, and move with a speed, b downwards."""
    scene = Scene(space="line", line_axis=(0, 0, 1)) if space == "line" else Scene(space=space)
    ground, pulley = scene.add("ground", Ground()), scene.add("pulley", Pulley())
    line = scene.add("rope", RoughPulley(length=3.0 * size, **rope))
    scene.connect(ground.frame, pulley.center)
    scene.connect(pulley.groove, line.over)
    for name, mass, depth, way in (("a", masses[0], 1.0, 1.0), ("b", masses[1], 2.0, -1.0)):
        one = scene.add(name, PointMass(mass=mass))
        scene.connect(one.point, getattr(line, name))
        scene.start.update({f"{name}.position.z": -depth * size, f"{name}.velocity.z": way * speed})
        for axis in "xy"[: {"line": 0, "plane": 1, "space": 2}[space]]:
            scene.start.update({f"{name}.position.{axis}": 0.0, f"{name}.velocity.{axis}": 0.0})
    return scene


def run(scene: Scene, form: str, end: float) -> aw.Result:
    return simulate(scene, form=form, t_end=end, rtol=1e-10, outputs=[0.0, end])


@FORMS
@pytest.mark.parametrize("space", ["line", "plane", "space"])
def test_a_capstan_slips(form: str, space: str) -> None:
    result = run(capstan((1.0, 3.0), space=space, friction=0.2), form, 0.5)
    assert -result["b.velocity.z"][-1] == pytest.approx(0.5 * 2.2651934046, abs=1e-9)
    ends = [float(result[f"rope.tension_{one}"][-1]) for one in "ab"]
    assert ends == pytest.approx([G + 2.2651934046, 3.0 * (G - 2.2651934046)])
    assert ends[1] / ends[0] == pytest.approx(math.exp(0.2 * math.pi))
    assert result["rope.slip_state"][-1] == 1.0


@FORMS
def test_a_capstan_holds_within_its_static_limit(form: str) -> None:
    """A ratio of 3 is within exp(0.4 pi) = 3.51 and beyond exp(0.3 pi) = 2.57."""
    result = run(capstan((1.0, 3.0), friction=0.2, static_friction=0.4), form, 0.5)
    assert not result.events
    assert result["b.velocity.z"][-1] == 0.0
    assert [float(result[f"rope.tension_{one}"][-1]) for one in "ab"] == pytest.approx([G, 3.0 * G])
    moved = run(capstan((1.0, 3.0), friction=0.2, static_friction=0.3), form, 0.5)
    assert -moved["b.velocity.z"][-1] == pytest.approx(0.5 * 2.2651934046, abs=1e-9)


@FORMS
@pytest.mark.parametrize("size", [1.0, 1e-3, 1e3])
def test_a_capstan_brings_masses_to_rest(form: str, size: float) -> None:
    """Masses of 1 and 1.5 kg that move towards the lighter one stop, and stay: 1.5 is within exp(0.2 pi)."""
    speed = math.sqrt(size)
    result = run(capstan((1.0, 1.5), speed=-speed, friction=0.2, size=size), form, 0.5 * speed)
    share = 1.5 * math.exp(0.2 * math.pi)
    slowing = G * (share - 1.0) / (share + 1.0)
    assert [one.kind for one in result.events] == ["sticks"]
    assert result.events[0].time == pytest.approx(speed / slowing, abs=1e-9 * speed)
    assert result["b.position.z"][-1] == pytest.approx(size * (0.5 / slowing - 2.0), abs=1e-9 * size)


@FORMS
def test_a_slack_rope_does_not_rub(form: str) -> None:
    """Both are thrown up, b faster: the rope goes slack at once, and no force is left."""
    scene = capstan((1.0, 3.0), friction=0.2)
    scene.start.update({"a.velocity.z": 1.0, "b.velocity.z": 2.0})
    result = run(scene, form, 0.1)
    assert result["a.position.z"][-1] == pytest.approx(-1.0 + 0.1 - 0.005 * G, abs=1e-11)
    assert result["b.position.z"][-1] == pytest.approx(-2.0 + 0.2 - 0.005 * G, abs=1e-11)
    assert result["rope.tension"][-1] == 0.0


@FORMS
def test_a_rope_comes_taut_with_a_jerk(form: str) -> None:
    """With b at rest and a thrown down at 1 m/s, impulses at both ends are as exp(0.2 pi), and speeds are equal."""
    scene = capstan((1.0, 3.0), friction=0.2)
    scene.start.update({"a.velocity.z": -1.0, "b.velocity.z": 0.0})
    result = run(scene, form, 1e-6)
    share = math.exp(0.2 * math.pi)
    # a loses P_a, b gains P_b = P_a/share over 3 kg, and both then move as one: 1 - P_a = P_a/(3 share).
    after = 1.0 - 1.0 / (1.0 + 1.0 / (3.0 * share))
    assert [one.kind for one in result.events][:1] == ["impact"]
    assert result["b.velocity.z"][-1] == pytest.approx(after, abs=2e-5)


@FORMS
@pytest.mark.parametrize(("friction", "slips"), [(0.5, False), (0.05, True)])
def test_a_pulley_that_turns(form: str, friction: float, slips: bool) -> None:
    """With much friction it is Atwood's machine with a heavy pulley; with little the rope slips over it."""
    moment, radius = 0.05, 0.1
    scene = capstan((1.0, 3.0), space="plane", friction=friction, turns="shaft", radius=radius)
    wheel = scene.add("wheel", Inertia(moment=moment))
    scene.connect(wheel.flange, scene.rope.shaft)
    scene.start.update({"wheel.angle": 0.0, "wheel.angular_velocity": 0.0})
    result = run(scene, form, 0.5)
    share = math.exp(friction * math.pi)
    if slips:
        down = G * (3.0 - share) / (3.0 + share)
        spin = radius * ((3.0 * (G - down)) - (G + down)) / moment
    else:
        down = G * 2.0 / (4.0 + moment / radius**2)
        spin = down / radius
    assert -result["b.velocity.z"][-1] == pytest.approx(0.5 * down, abs=1e-9)
    assert result["wheel.angular_velocity"][-1] == pytest.approx(0.5 * spin, abs=1e-8)


def test_an_end_that_reaches_the_pulley_ends_the_run() -> None:
    result = simulate(capstan((1.0, 3.0), speed=2.0, friction=0.2), t_end=5.0)
    assert result.events[-1].message == "an end of the rope has reached the pulley"
    assert result["a.position.z"][-1] == pytest.approx(0.0, abs=1e-5)


@FORMS
def test_a_free_pulley_without_mass_is_named(form: str) -> None:
    """It was said that the rope's reaction has no value, and to look whether points coincide."""
    scene = Scene(space="plane")
    pulley, rope = scene.add("pulley", Pulley()), scene.add("rope", RoughPulley(length=3.0))
    scene.connect(pulley.groove, rope.over)
    scene.guess.update({"pulley.position.x": 0.0, "pulley.position.z": -1.0})
    for name, end, depth in (("a", rope.a, -2.0), ("b", rope.b, -3.0)):
        scene.connect(scene.add(name, PointMass(mass=1.0)).point, end)
        scene.guess.update({f"{name}.position.x": 0.0, f"{name}.position.z": depth})
    with pytest.raises(aw.StartError, match=r"^pulley: something without inertia .* along pulley\.position\.x"):
        simulate(scene, form=form, t_end=0.1)
