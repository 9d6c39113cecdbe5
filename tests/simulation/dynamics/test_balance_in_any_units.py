"""The balance of forces is solved as well in one unit of length and of mass as in another."""

from __future__ import annotations

import math

import numpy as np
import pytest

from atwood import Scene, assemble
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.initialization.start import find_start, own_state
from atwood_library import Gear, Ground, Pivot, RigidBody, Torque, Weld


def planetary(length: float, mass: float) -> Scene:
    """Return a sun and two planets on a carrier, each in mesh with the sun and with a ring that is fixed.

    In space turns are counted by coordinates that have no inertia of their own, and one mesh is too many.
    """
    scene = Scene(space="space", gravity=0.0)
    moment = mass * length**2
    carrier = scene.add("carrier", RigidBody(mass=mass, moments=(0.3 * moment, 0.4 * moment, 0.2 * moment)))
    axle = scene.add("axle", Pivot())
    scene.connect(scene.add("ground", Ground()).frame, axle.a)
    scene.connect(axle.b, carrier.frame)
    shafts = [axle.shaft]
    for i, angle in enumerate((None, 0.0, 2.0)):
        where = (0.0, 0.0, 0.0)
        if angle is not None:
            where = (1.5 * length * math.cos(angle), 0.0, 1.5 * length * math.sin(angle))
        arm, bearing = scene.add(f"arm{i}", Weld(displacement=where)), scene.add(f"bearing{i}", Pivot())
        wheel = scene.add(f"wheel{i}", RigidBody(mass=mass, moments=(0.1 * moment, 0.2 * moment, 0.1 * moment)))
        for a, b in ((carrier.frame, arm.a), (arm.b, bearing.a), (bearing.b, wheel.frame)):
            scene.connect(a, b)
        shafts.append(bearing.shaft)
    ring, sun, *planets = shafts
    for i, planet in enumerate(planets):
        for name, other, ratio in (("inner", sun, -0.5), ("outer", ring, -0.25)):
            mesh = scene.add(f"{name}{i}", Gear(ratio=ratio))
            scene.connect(other, mesh.a)
            scene.connect(planet, mesh.b)
    load = scene.add("load", Torque(value=moment, axis=(0.3, -0.8, 0.52)))
    scene.connect(scene["wheel1"].frame, load.frame)
    scene.start.update({"axle.angle": 0.0, "axle.angular_velocity": 0.5})
    return scene


def balance(length: float, mass: float, form: str) -> tuple[np.ndarray, np.ndarray]:
    """Return angular accelerations, and the torques that meshes pass on over the unit of moments."""
    assembly = assemble(planetary(length, mass), form=form)
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    solver = ReactionSolver(assembly, 0.0, q, u)
    found = solver.balance_along(np.array([0.0]), q[:, None], u[:, None])
    values = solver.at(np.array([0.0]), q[:, None], u[:, None])[0][:, 0]
    torques = [v for one, v in zip(assembly.reactions, values, strict=True) if one.path.endswith("torque_b")]
    turning = [i for i, one in enumerate(assembly.maximal.speed_names) if one.name.endswith("angle'")]
    return found.accelerations[turning, 0], np.array(torques) / (mass * length**2)


@pytest.mark.sample(2)
@pytest.mark.parametrize(("length", "mass"), [(1e-6, 1.0), (1e6, 1e-6), (1e-3, 1e6)])
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_planetary_gear_of_any_size(form: str, length: float, mass: float) -> None:
    expected, found = balance(1.0, 1.0, form), balance(length, mass, form)
    assert len(expected[0]) >= 4
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-9)
    np.testing.assert_allclose(found[1], expected[1], rtol=1e-9, atol=1e-11)
