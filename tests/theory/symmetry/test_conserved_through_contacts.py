"""What every set of contacts and every impact keeps, and the equations of one set."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy

import atwood as aw
from atwood import Scene, UsageError, conserved, equations, simulate
from atwood_library import BallContact, Ground, PointContact, PointMass, Slider, Sphere, Spring
from atwood_library.scenes import NewtonsCradle


def ball(turn: float = 0.0, gravity: float = 9.81, **contact: float) -> Scene:
    """Return a ball above a floor that is turned against gravity."""
    normal = (-math.sin(turn), 0.0, math.cos(turn))
    scene = Scene(gravity=gravity)
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=2.0))
    c = scene.add("c", PointContact(normal=normal, **contact))
    scene.connect(ground.frame, c.plane)
    scene.connect(m.point, c.point)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 1.0, "m.velocity.x": 0.3, "m.velocity.z": -1.0})
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(
    ("scene", "names"),
    [
        (ball(restitution=1.0), ["h", "p:m.position.x", "K.x"]),
        (ball(restitution=0.9), ["p:m.position.x", "K.x"]),
        (ball(restitution=1.0, friction=0.1), []),
        (ball(turn=0.3, restitution=1.0), ["h"]),
        (ball(turn=0.5 * math.pi, gravity=0.0, restitution=0.5), ["p:m.position.z", "K.z"]),
    ],
)
def test_what_a_bouncing_ball_keeps(scene: Scene, names: list[str], form: str) -> None:
    """Momentum along a smooth floor; energy where nothing is lost; the rest is kept between impacts alone."""
    kept = conserved(scene)
    assert list(kept.names) == names
    assert "in every set of contacts, and through impacts" in kept.notes
    assert any("conserved between events alone" in note for note in kept.notes) == ("h" not in names)
    result = simulate(scene, form=form, t_end=2.0, rtol=1e-10, monitor=kept)
    assert result.impacts
    assert all(one.max_drift < 1e-10 for one in result.conserved.values())


def test_momentum_along_a_floor_that_lies_askew() -> None:
    """Neither of the momenta along x and z is kept, the one along the floor is, and the angular one about a ball."""
    scene = ball(turn=0.3, gravity=0.0, restitution=0.5)
    kept = conserved(scene)
    [momentum] = [one for one in kept if one.kind == "linear momentum"]
    along = np.array(momentum.direction)[[0, 2]]
    assert abs(along @ [math.cos(0.3), math.sin(0.3)]) == pytest.approx(1.0, abs=1e-12)
    spins = Scene()
    ground, m, c = (
        spins.add("ground", Ground()),
        spins.add("m", Sphere(mass=1.0, radius=0.1)),
        spins.add("c", BallContact(radius=0.1, restitution=0.5)),
    )
    spins.connect(ground.frame, c.plane)
    spins.connect(m.frame, c.ball)
    spins.start.update({"m.position.x": 0.0, "m.position.z": 1.0, "m.angle": 0.0})
    assert {"p:m.position.x", "p:m.angle"} <= set(conserved(spins).names)


def test_walls_that_move_and_several_impacts_take_energy() -> None:
    scene = Scene()
    ground, rail = scene.add("ground", Ground()), scene.add("rail", Slider(axis=(0, 0, 1)))
    m, c = scene.add("m", PointMass(mass=1.0)), scene.add("c", PointContact(restitution=1.0))
    drive = scene.add("drive", aw_drive())
    for ends in ((ground.frame, rail.a), (rail.b, c.plane), (m.point, c.point), (rail.carriage, drive.b)):
        scene.connect(*ends)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 1.0})
    found = conserved(scene)
    assert "h" not in found
    assert "h" in conserved(NewtonsCradle(restitution=1.0))


def aw_drive() -> aw.Component:
    from atwood_library import TranslationalMotion

    return TranslationalMotion(place=lambda t: 0.1 * aw.sin(5.0 * t))


def block(x: float) -> Scene:
    scene = ball(friction=0.3)
    spring = scene.add("spring", Spring(stiffness=50.0))
    scene.connect(scene.ground.frame, spring.a)
    scene.connect(scene.m.point, spring.b)
    scene.start.update({"m.position.x": x, "m.position.z": 0.0, "m.velocity.x": 0.0, "m.velocity.z": 0.0})
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_equations_are_those_of_the_set_at_the_start_or_of_one_that_is_named(form: str) -> None:
    m, g, k, mu = sympy.symbols("m g k mu", positive=True)
    slips = equations(block(1.0), form="reduced")
    x, ddx = slips.coordinates[0], slips.accelerations[0]
    letters = {slips.symbol(path): to for path, to in (("m.mass", m), ("gravity", g), ("c.friction", mu))}
    letters[slips.symbol("spring.stiffness")] = k
    [row] = slips.rows
    assert sympy.simplify(row.subs(letters) - (m * ddx + k * x - mu * m * g)) == 0
    assert "Contacts: c.gap closed, c.slip slips backwards." in slips.text()
    other = {"c.gap": "closed", "c.slip": "slips forwards"}
    [row] = equations(block(1.0), contacts=other).rows
    assert sympy.simplify(row.subs(letters) - (m * ddx + k * x + mu * m * g)) == 0
    held = equations(block(0.01), form=form)
    assert held.to_dict()["contacts"] == {"c.gap": "closed", "c.slip": "sticks"}
    assert len(held.constraints) == (1 if form == "reduced" else 2)
    assert len(equations(block(0.01), contacts={}, form=form).rows) == 2


@pytest.mark.parametrize(
    ("contacts", "what"),
    [
        ({"c.gap": "closed"}, "c.slip: nothing says whether it slips"),
        ({"c.slip": "sticks"}, "c.slip: it cannot be 'sticks'.*c.gap closed"),
        ({"c.gap": "shut"}, "c.gap: it cannot be 'shut'. Choose of open, closed"),
        ({"c.gop": "open"}, "c.gop: it is no gap and no slip. Did you mean 'c.gap'"),
    ],
)
def test_sets_that_mean_nothing_are_refused(contacts: dict[str, str], what: str) -> None:
    with pytest.raises(UsageError, match=what):
        equations(block(1.0), contacts=contacts)
