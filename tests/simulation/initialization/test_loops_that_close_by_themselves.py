"""Loops that close wherever their bodies are: the rows of their constraints are rounding and say nothing of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from atwood import Scene, TopologyError, assemble, simulate
from atwood.simulation.initialization.start import find_start
from atwood_library import Ground, Link, Pivot, RigidBody, RotaryDrive, Slider, Weld

FORMS = ("reduced", "dae")
ASKEW = (0.3, -1.2, 0.7)


def door(hinges: int, place: tuple[float, float, float]) -> Scene:
    """Return a door on hinges, one above the other, whose posts and leaf stand askew, so that no number is exact."""
    scene = Scene(space="space", gravity=0.0)
    post = scene.add("post", Weld(angle=2.1, axis=ASKEW))
    scene.connect(scene.add("ground", Ground(position=place)).frame, post.a)
    leaf = scene.add("leaf", RigidBody(mass=1.0, center=(0.5, 0.0, 1.0), moments=(0.3, 0.4, 0.2)))
    for i in range(hinges):
        hinge = scene.add(f"hinge{i}", Pivot(axis=(0.0, 0.6, 0.8)))
        for name, frame, end in (("low", post.b, hinge.a), ("high", leaf.frame, hinge.b)):
            arm = scene.add(f"{name}{i}", Weld(displacement=(0.0, 0.6 * i, 0.8 * i), angle=0.4, axis=(0.0, 0.6, 0.8)))
            scene.connect(frame, arm.a)
            scene.connect(arm.b, end)
    return scene


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (3e3, -7e3, 1e3)])
@pytest.mark.parametrize("hinges", [2, 3])
@pytest.mark.parametrize("form", FORMS)
def test_a_door_starts_where_it_is_guessed(form: str, hinges: int, place: tuple[float, float, float]) -> None:
    scene = door(hinges, place)
    scene.guess["hinge1.angle"] = 0.7
    start = find_start(assemble(scene, form=form))
    assert start.coordinates[:1] == pytest.approx(0.7, abs=1e-9)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_door_goes_on_as_it_is_pushed(form: str) -> None:
    scene = door(2, (0.0, 0.0, 0.0))
    scene.start.update({"hinge0.angle": 0.7, "hinge0.angular_velocity": 2.0})
    found = simulate(scene, form=form, t_end=0.5, outputs=3, rtol=1e-10).array("hinge0.angle")
    np.testing.assert_allclose(found, [0.7, 1.2, 1.7], atol=1e-8)


# -- how large a miss may be -------------------------------------------------------------------------------------------


def tables(size: float) -> Scene:
    """Return a table on two stages, each of a slide along x and one along y, in either order; two stages are too many.

    Its guides do not turn, so that their locks join what is fixed.
    """
    scene = Scene(space="space", gravity=0.0)
    ground = scene.add("ground", Ground())
    table = scene.add("table", RigidBody(mass=1.0, moments=(size**2, size**2, size**2)))
    for name, axes in (("one", ("x", "y")), ("other", ("y", "x"))):
        at = ground.frame
        for k, axis in enumerate(axes):
            turn = scene.add(f"{name}_turn{k}", Weld(angle=0.9 + k, axis=ASKEW))
            n = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0)}[axis]
            c, s, e = math.cos(0.9 + k), math.sin(0.9 + k), np.array(ASKEW) / np.linalg.norm(ASKEW)
            own = c * np.array(n) - s * np.cross(e, n) + (1.0 - c) * (e @ n) * e
            slider = scene.add(f"{name}_slide{k}", Slider(axis=tuple(own.tolist())))
            back = scene.add(f"{name}_back{k}", Weld(angle=-0.9 - k, axis=ASKEW))
            scene.connect(at, turn.a)
            scene.connect(turn.b, slider.a)
            scene.connect(slider.b, back.a)
            at = back.b
            if k == 0:
                stage = scene.add(f"{name}_stage", RigidBody(mass=1.0, moments=(size**2, size**2, size**2)))
                scene.connect(at, stage.frame)
        scene.connect(at, table.frame)
    reach = scene.add("reach", Weld(displacement=(size, 0.0, 0.0)))
    tip = scene.add("tip", RigidBody(mass=1.0, moments=(size**2, size**2, size**2)))
    scene.connect(table.frame, reach.a)
    scene.connect(reach.b, tip.frame)
    return scene


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e6])
@pytest.mark.parametrize("form", FORMS)
def test_directions_are_no_lengths(form: str, size: float) -> None:
    """What a lock misses by rounding is 1e-16 rad, however small a scene is."""
    found = assemble(tables(size), form=form)
    assert len(find_start(found).speeds) == 2 if form == "reduced" else found


def turned_twice(size: float, off: float) -> Scene:
    """Return a link that two drives turn, one of them ahead of the other."""
    scene = Scene(t_end=1.0, gravity=0.0)
    ground, link = scene.add("ground", Ground()), scene.add("link", Link(length=size))
    for name, ahead in (("one", 0.0), ("other", off)):
        drive = scene.add(name, RotaryDrive(rotation=lambda t, ahead=ahead: t + ahead * t * t))
        scene.connect(ground.frame, drive.a)
        scene.connect(drive.b, link.a)
    return scene


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_drives_that_turn_a_link_differently_are_refused_however_long_it_is(size: float) -> None:
    with pytest.raises(TopologyError, match="contradicts"):
        simulate(turned_twice(size, 1e-4), outputs=3)
    assert simulate(turned_twice(size, 0.0), outputs=3).status == "finished"


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_welds_that_turn_a_link_differently_are_refused_however_long_it_is(size: float) -> None:
    scene = Scene(gravity=0.0)
    ground, link, body = scene.add("ground", Ground()), scene.add("link", Link(length=size)), scene.add("body", Link())
    scene.connect(ground.frame, link.a)
    slider = scene.add("slider", Slider())
    scene.connect(link.b, slider.a)
    scene.connect(slider.b, body.a)
    again = scene.add("again", Slider(axis=(math.cos(1e-5), 0.0, math.sin(1e-5))))
    turn = scene.add("turn", Weld(angle=1e-5))
    scene.connect(link.b, again.a)
    scene.connect(again.b, turn.a)
    scene.connect(turn.b, body.a)
    with pytest.raises(TopologyError, match="lock"):
        simulate(scene, outputs=3)
