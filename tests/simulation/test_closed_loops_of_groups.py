"""Linkages of each group of two bodies that formulas solve, in the plane and in space, against their geometry."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood import Result, Scene, simulate
from atwood.arrays import FloatArray
from atwood_library import Ground, Pivot, PointOnLine, RigidBody, Rod, Slider, Weld

from .test_closed_loops import by_formulas, solved

SPACES = ("plane", "space")


def scene_of(
    space: str, parts: Mapping[str, Any], pairs: Sequence[tuple[str, str]], start: Mapping[str, float], **guess: float
) -> Scene:
    """Return a scene of parts that are connected by the paths of their frames."""
    scene = Scene(space=space, t_end=1.0)
    made = {name: scene.add(name, part) for name, part in parts.items()}

    def end(path: str) -> Any:
        name, _, frame = path.partition(".")
        return getattr(made[name], frame)

    for one, other in pairs:
        scene.connect(end(one), end(other))
    scene.start.update(start)
    scene.guess.update({f"{name}.{'displacement' if 'slide' in name else 'angle'}": at for name, at in guess.items()})
    return scene


def block(mass: float = 0.3) -> RigidBody:
    return RigidBody(mass=mass, moments=(0.01, 0.01, 0.01))


def bar(length: float, mass: float) -> RigidBody:
    """Return a rigid bar along x, which is one in space as well."""
    inertia = mass * length**2 / 12.0
    return RigidBody(mass=mass, moments=(0.1 * inertia, inertia, inertia), center=(0.5 * length, 0.0, 0.0))


def swinging_block(space: str, ground: tuple[float, float], offset: float, guess: float, order: int = 1) -> Scene:
    """Return a crank of 0.4 m whose pin carries a block that slides on a rocker about another point (RPR)."""
    parts = {
        "left": Ground(),
        "right": Ground(position=(ground[0], 0.0, ground[1])),
        "crank": bar(0.4, 1.0),
        "pin": Weld(displacement=(0.4, 0.0, 0.0)),
        "rocker": bar(2.0, 2.0),
        "block": block(),
        "eye": Weld(displacement=(0.0, 0.0, offset)),
        **{name: Pivot() for name in ("one", "two", "four")},
        "slide": Slider(),
    }
    pairs = [
        ("left.frame", "one.a"),
        ("one.b", "crank.frame"),
        ("crank.frame", "pin.a"),
        ("pin.b", "two.a"),
        ("two.b", "eye.b"),
        ("eye.a", "block.frame"),
        ("right.frame", "four.a"),
        ("four.b", "rocker.frame"),
        ("rocker.frame", "slide.a"),
        ("slide.b", "block.frame"),
    ]
    parts = {name: parts[name] for name in list(parts)[::order]}
    return scene_of(space, parts, pairs, {"one.angle": 0.7, "one.angular_velocity": 5.0}, four=guess)


def check_swinging_block(result: Result, ground: tuple[float, float], offset: float) -> None:
    """The rocker points at the pin, but for the offset."""
    pin = 0.4 * np.exp(1j * result["one.angle"]) - complex(*ground)
    aside = np.arctan2(offset, np.sqrt(np.abs(pin) ** 2 - offset**2))
    turned = np.exp(1j * result["four.angle"]) / np.exp(1j * (np.angle(pin) - aside))
    assert_allclose(turned, 1.0, atol=1e-13)


@pytest.mark.sample(2)
@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize(
    ("ground", "offset", "guess"), [((1.0, 0.2), 0.0, 2.9), ((1.0, 0.2), 0.15, 2.9), ((0.0, -0.15), 0.0, 0.9)]
)
def test_a_swinging_block_and_a_quick_return(
    space: str, ground: tuple[float, float], offset: float, guess: float
) -> None:
    result = simulate(swinging_block(space, ground, offset, guess), rtol=1e-11)
    assert by_formulas(result)
    check_swinging_block(result, ground, offset)
    assert result.energy.max_drift < 1e-8
    assert np.ptp(result["one.angle"]) > 2.0
    if ground[0] == 0.0:  # Whitworth's: the second crank turns as the first does
        assert np.ptp(result["four.angle"]) > 2.0


def test_a_slide_that_a_body_hangs_on_is_solved_with_its_angle() -> None:
    scene = swinging_block("space", (1.0, 0.2), 0.15, 2.9, order=-1)
    found = solved(scene)
    assert found is not None
    assert "slide.displacement" in [one.name for one in found.assembly.reduced.names]
    result = simulate(scene, rtol=1e-11)
    assert by_formulas(result)
    check_swinging_block(result, (1.0, 0.2), 0.15)
    assert result.energy.max_drift < 1e-8


@pytest.mark.parametrize("space", SPACES)
def test_a_scotch_yoke_moves_as_a_cosine(space: str) -> None:
    parts = {
        "ground": Ground(),
        "crank": bar(0.5, 1.0),
        "pin": Weld(displacement=(0.5, 0.0, 0.0)),
        "hinge": Pivot(),
        "yoke": block(2.0),
        "slide": Slider(),
        "slot": PointOnLine(axis=(0.0, 0.0, 1.0)),
    }
    pairs = [
        ("ground.frame", "hinge.a"),
        ("hinge.b", "crank.frame"),
        ("crank.frame", "pin.a"),
        ("ground.frame", "slide.a"),
        ("slide.b", "yoke.frame"),
        ("yoke.frame", "slot.a"),
        ("slot.b", "pin.b"),
    ]
    scene = scene_of(space, parts, pairs, {"hinge.angle": 0.7, "hinge.angular_velocity": 5.0})
    result = simulate(scene, rtol=1e-11)
    assert by_formulas(result)
    assert_allclose(result["slide.displacement"], 0.5 * np.cos(result["hinge.angle"]), atol=1e-14)
    assert result.energy.max_drift < 1e-9


@pytest.mark.parametrize("space", SPACES)
def test_an_elliptic_trammel_draws_ellipses(space: str) -> None:
    parts = {
        "ground": Ground(),
        "bar": bar(1.0, 1.0),
        "tip": Weld(displacement=(1.0, 0.0, 0.0)),
        "slide": Slider(),
        "slide2": Slider(axis=(0.0, 0.0, 1.0)),
        **{name: block() for name in ("first", "second")},
        **{name: Pivot() for name in ("one", "two")},
    }
    pairs = [
        ("ground.frame", "slide.a"),
        ("ground.frame", "slide2.a"),
        ("slide.b", "first.frame"),
        ("slide2.b", "second.frame"),
        ("first.frame", "one.a"),
        ("one.b", "bar.frame"),
        ("bar.frame", "tip.a"),
        ("tip.b", "two.a"),
        ("two.b", "second.frame"),
    ]
    scene = scene_of(space, parts, pairs, {"one.angle": 2.0, "one.angular_velocity": 3.0})
    result = simulate(scene, rtol=1e-11)
    assert by_formulas(result)
    angle = result["one.angle"]
    assert_allclose(result["slide.displacement"], -np.cos(angle), atol=1e-13)
    assert_allclose(result["slide2.displacement"], np.sin(angle), atol=1e-13)
    assert result.energy.max_drift < 1e-9


@pytest.mark.parametrize("space", SPACES)
def test_the_shafts_of_an_oldham_coupling_turn_alike(space: str) -> None:
    parts = {
        "left": Ground(),
        "right": Ground(position=(0.1, 0.0, 0.05)),
        **{name: block(1.0) for name in ("first", "second", "disc")},
        **{name: Pivot() for name in ("one", "two")},
        "slide": Slider(),
        "slide2": Slider(axis=(0.0, 0.0, 1.0)),
    }
    pairs = [
        ("left.frame", "one.a"),
        ("one.b", "first.frame"),
        ("right.frame", "two.a"),
        ("two.b", "second.frame"),
        ("first.frame", "slide.a"),
        ("slide.b", "disc.frame"),
        ("second.frame", "slide2.a"),
        ("slide2.b", "disc.frame"),
    ]
    result = simulate(scene_of(space, parts, pairs, {"one.angle": 0.3, "one.angular_velocity": 4.0}), rtol=1e-11)
    assert by_formulas(result)
    angle = result["one.angle"]
    assert_allclose(result["two.angle"], angle, atol=1e-13)
    assert_allclose(result["slide.displacement"], 0.1 * np.cos(angle) + 0.05 * np.sin(angle), atol=1e-13)
    assert result.energy.max_drift < 1e-9


# -- rods of two balls ----------------------------------------------------------------------------------------------


def rod_of_two_balls(end: str) -> Scene:
    """Return a crank about x and a rod to a rocker about y, or to a block that slides along x."""
    parts: dict[str, Any] = {
        "ground": Ground(),
        "other": Ground(position=(1.0, 0.3, 0.2)),
        "crank": block(1.0),
        "hinge": Pivot(axis=(1.0, 0.0, 0.0)),
        "pin": Weld(displacement=(0.0, 0.25, 0.0)),
        "rod": Rod(length=1.1, mass=0.5),
        "driven": block(0.7),
    }
    pairs = [
        ("ground.frame", "hinge.a"),
        ("hinge.b", "crank.frame"),
        ("crank.frame", "pin.a"),
        ("pin.b", "rod.a"),
        ("other.frame", f"{end}.a"),
        (f"{end}.b", "driven.frame"),
    ]
    parts[end] = Pivot(axis=(0.0, 1.0, 0.0)) if end == "hinge2" else Slider(axis=(1.0, 0.0, 0.0))
    if end == "hinge2":
        parts["tip"] = Weld(displacement=(0.0, 0.0, 0.6))
        pairs += [("driven.frame", "tip.a"), ("tip.b", "rod.b")]
    else:
        pairs.append(("driven.frame", "rod.b"))
    guess = {end: 0.1 if end == "hinge2" else 0.3}
    return scene_of("space", parts, pairs, {"hinge.angle": 0.4, "hinge.angular_velocity": 6.0}, **guess)


@pytest.mark.parametrize("end", ["hinge2", "slide"])
def test_a_rod_of_two_balls_leaves_one_angle(end: str) -> None:
    found = solved(rod_of_two_balls(end))
    assert found is not None
    assert [len(group.symbols) for group in found.form.accelerations.program.inputs] == [1, 1, 1]
    result = simulate(rod_of_two_balls(end), rtol=1e-11)
    assert by_formulas(result)
    angle, way = result["hinge.angle"], result[f"{end}.{'angle' if end == 'hinge2' else 'displacement'}"]
    pin = np.array([0.0 * angle, 0.25 * np.cos(angle), 0.25 * np.sin(angle)])
    along: Callable[[FloatArray], list[FloatArray]] = {
        "hinge2": lambda turn: [0.6 * np.sin(turn), 0.0 * turn, 0.6 * np.cos(turn)],
        "slide": lambda way: [way, 0.0 * way, 0.0 * way],
    }[end]
    tip = np.array(along(way)) + np.array([[1.0], [0.3], [0.2]])
    assert_allclose(np.linalg.norm(tip - pin, axis=0), 1.1, atol=1e-14)
    assert result.energy.max_drift < 1e-8
