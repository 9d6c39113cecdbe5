"""The Lagrangian of a scene against its equations of motion, at random states."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from atwood import Component, Frame, Scalar, Scene, UsageError, assemble, connector, dissipation, signal
from atwood.expr import Expression, evaluate, jvp, substitute, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Lagrangian, lagrangian_of
from atwood.model.compose.composite import Model
from atwood_library import Damper, Force, Ground, Link, Pivot, PointMass, RigidBody, Rod, Slider, Spherical, Spring

from ..helpers.lagrangians import BurningBody, CrankInertia, LagrangianBody, LagrangianPoint, LeakingBucket, PumpedPoint
from ..helpers.smooth import SMOOTH as SCENES


class Brake(Component):
    """A torque against turning whose strength another part says."""

    strength: float = signal(1.0, unit="rad/s", doc="What it grows with.")
    frame: Frame = connector(Frame, "What turns.")

    @dissipation
    def loss(self) -> Scalar:
        """Return the Rayleigh function."""
        w = self.frame.angular_velocity
        return 0.5 * self.strength * (w.x * w.x + w.y * w.y + w.z * w.z)


def leaking(space: str) -> Scene:
    scene = Scene(space=space)
    bucket = scene.add("bucket", LeakingBucket(mass=lambda t: 2.0 - 0.5 * t))
    rope, ground = scene.add("rope", Rod(length=0.7)), scene.add("ground", Ground())
    push = scene.add("push", Force(value=20.0, direction=(1.0, 0.0, 2.0)))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bucket.point)
    scene.connect(bucket.point, push.point)
    return scene


def burning(space: str) -> Scene:
    scene = Scene(space=space)
    ground, pivot = scene.add("ground", Ground()), scene.add("pivot", Pivot())
    body = scene.add("body", BurningBody(share=lambda t: 1.0 - 0.3 * t))
    extra, brake = scene.add("extra", CrankInertia()), scene.add("brake", Brake())
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, body.frame)
    scene.connect(body.frame, brake.frame)
    scene.connect(pivot.shaft, extra.a)
    scene.connect(pivot.output("angular_velocity"), brake.input("strength"))
    return scene


def charged(space: str) -> Scene:
    scene = Scene(space=space)
    charge, pumped = (
        scene.add("charge", LagrangianPoint(charge=0.5, field=8.0)),
        scene.add("pumped", PumpedPoint()),
    )
    spring, damper = scene.add("spring", Spring(stiffness=3.0)), scene.add("damper", Damper(damping=0.4))
    for part in (spring, damper):
        scene.connect(charge.point, part.a)
        scene.connect(part.b, pumped.point)
    return scene


def body_of_mine(space: str) -> Scene:
    scene = Scene(space=space)
    body = scene.add("body", LagrangianBody())
    bob, rail, more = scene.add("bob", PointMass()), scene.add("rail", Slider()), scene.add("more", RigidBody())
    scene.connect(body.frame, rail.a)
    scene.connect(rail.b, bob.point)
    scene.connect(body.frame, more.frame)
    return scene


def slender() -> Scene:
    """Return a rod on a ball joint, whose spin has no inertia and is held."""
    scene = Scene(space="space")
    ground, ball, rod = scene.add("ground", Ground()), scene.add("ball", Spherical()), scene.add("rod", Link())
    scene.connect(ground.frame, ball.a)
    scene.connect(ball.b, rod.a)
    return scene


def state(assembly: Assembly, found: Lagrangian, seed: int = 3) -> dict[Expression, float]:
    random = np.random.default_rng(seed)
    symbols = (*found.coordinates, *found.velocities, *found.accelerations)
    values = dict(zip(assembly.parameters, assembly.parameter_values.tolist(), strict=True))
    return {**values, found.time: 0.37} | {symbol: float(random.uniform(0.3, 0.9)) for symbol in symbols}


def lagranges_rows(found: Lagrangian) -> dict[int, Expression]:
    """Return ``d/dt dL/dq' - dL/dq + dR/dq' - Q`` for each velocity that is the derivative of a coordinate."""
    along: dict[Any, Any] = dict(zip(found.coordinates, found.rates, strict=True))
    along |= {found.time: 1.0, **dict(zip(found.velocities, found.accelerations, strict=True))}
    rates = jvp(list(found.momenta), along)
    slopes = vjp([found.lagrangian], [found.graph.one], list(found.coordinates))
    losses = vjp([found.rayleigh], [found.graph.one], list(found.velocities))
    return {
        k: rates[k] - slopes[place] + losses[k] - found.forces[k]
        for k, place in enumerate(found.moves)
        if place is not None
    }


OWN: list[Callable[[str], Scene]] = [leaking, burning, charged, body_of_mine]
CASES = [
    *((name, form, "quaternion") for name in SCENES for form in ("reduced", "dae")),
    *((name, "reduced", "euler-zxz") for name in ("free-body", "heavy-top", "lagrange-top", "stewart-platform")),
    ("heavy-top", "reduced", "euler-xyz"),
]


def check(scene: Model, form: str, orientation: str) -> None:
    assembly = assemble(scene, form=form, orientation=orientation)
    found = lagrangian_of(assembly)
    values = state(assembly, found)
    rows = {} if found.is_restricted else lagranges_rows(found)
    for k, row in rows.items():
        mine, expected = evaluate([row, found.rows[k]], values)
        assert mine == pytest.approx(expected, rel=1e-12, abs=1e-11 * max(1.0, abs(expected)))
    # and T is the quadratic form of the mass matrix where nothing moves as prescribed
    matrix = np.zeros((len(found.velocities),) * 2)
    entries = found.mass_matrix
    for i, j, value in zip(entries.rows, entries.columns, evaluate(list(entries.entries), values), strict=True):
        matrix[i, j] = value
    assert np.max(np.abs(matrix - matrix.T)) <= 1e-13 * np.max(np.abs(matrix))
    inertial = evaluate(list(found.inertial), values)
    a = np.array([values[symbol] for symbol in found.accelerations])
    assert matrix @ a + evaluate(list(found.velocity_terms), values) == pytest.approx(inertial, rel=1e-11, abs=1e-11)


@pytest.mark.sample(16)
@pytest.mark.parametrize(("name", "form", "orientation"), CASES)
def test_lagranges_equations_are_the_equations_of_motion(name: str, form: str, orientation: str) -> None:
    check(SCENES[name](), form, orientation)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("space", ["plane", "space"])
@pytest.mark.parametrize("make", OWN)
def test_of_laws_of_ones_own_too(make: Callable[[str], Scene], space: str, form: str) -> None:
    check(make(space), form, "quaternion")


def test_each_part_has_its_share() -> None:
    assembly = assemble(charged("plane"))
    found = lagrangian_of(assembly)
    values, parts = state(assembly, found), {one.path: one for one in found.parts}
    assert set(parts) == {"charge", "pumped", "spring", "damper"}
    assert not parts["damper"].rayleigh.is_zero
    assert parts["damper"].lagrangian.is_zero
    total = sum(evaluate([one.lagrangian for one in found.parts], values))
    assert total == pytest.approx(evaluate([found.lagrangian], values)[0], rel=1e-14)
    # the charge's L is T - V and a term q A . v, which is no energy
    one = parts["charge"]
    linear = one.lagrangian - one.kinetic + one.potential
    at_rest = substitute([linear], dict.fromkeys(found.velocities, 0.0))[0]
    assert evaluate([at_rest], values)[0] == pytest.approx(0.0, abs=1e-14)
    assert abs(evaluate([linear], values)[0]) > 1e-3


def test_angles_without_derivatives_of_their_own_are_refused() -> None:
    with pytest.raises(UsageError, match="no derivatives of their own") as caught:
        lagrangian_of(assemble(slender(), orientation="euler-zxz"))
    assert "dae form" in caught.value.advice
