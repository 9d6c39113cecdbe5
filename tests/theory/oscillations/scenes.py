"""Scenes of a course on small oscillations."""

from __future__ import annotations

from itertools import pairwise

from atwood import Scene
from atwood_library import (
    Damper,
    Drag,
    Ground,
    Link,
    LorentzForce,
    Mass1D,
    Pivot,
    PointMass,
    PointOnCircle,
    PointOnCurve,
    PointOnPlane,
    Potential,
    Ramp,
    RigidBody,
    Rod,
    RotaryDrive,
    Slider,
    Spring,
    Torque,
)


def chain(
    count: int, mass: float = 1.0, stiffness: float = 10.0, free_end: bool = False, order: int = 1, damping: float = 0.0
) -> Scene:
    """Return equal masses on a line between walls, joined by equal springs, and perhaps by dampers."""
    scene = Scene(space="line", gravity=0.0)
    left = scene.add("left", Ground())
    ends = [left.frame]
    masses = {}
    for k in range(count)[::order]:
        masses[k] = scene.add(f"m{k + 1}", Mass1D(mass=mass))
        scene.start[f"m{k + 1}.displacement"], scene.start[f"m{k + 1}.speed"] = 1.0 * (k + 1), 0.0
    ends += [masses[k].flange for k in range(count)]
    if not free_end:
        ends.append(scene.add("right", Ground(position=(1.0 * (count + 1), 0.0, 0.0))).frame)
    for k, (a, b) in enumerate(pairwise(ends)):
        spring = scene.add(f"spring{k + 1}", Spring(stiffness=stiffness, natural_length=1.0))
        scene.connect(a, spring.a)
        scene.connect(spring.b, b)
        if damping:
            damper = scene.add(f"damper{k + 1}", Damper(damping=damping))
            scene.connect(a, damper.a)
            scene.connect(damper.b, b)
    scene.symbols.update(dict.fromkeys((f"m{k + 1}.mass" for k in range(count)), "m"))
    scene.symbols.update(dict.fromkeys((f"spring{k + 1}.stiffness" for k in range(len(ends) - 1)), "k"))
    if damping:
        scene.symbols.update(dict.fromkeys((f"damper{k + 1}.damping" for k in range(len(ends) - 1)), "c"))
    return scene


def governor(rate: float = 6.0, ball: float = 0.7, sleeve: float = 1.3, length: float = 0.4) -> Scene:
    """Return Watt's governor: a ball on an arm that a motor turns, and a rod from the ball to a sleeve on the shaft.

    The angle is that of the arm from the upward vertical, the displacement that of the sleeve below the arm's hinge.
    """
    scene = Scene(space="space", gravity=9.81)
    ground, clock = scene.add("ground", Ground()), scene.add("clock", Ramp(slope=rate))
    motor = scene.add("motor", RotaryDrive(axis=(0.0, 0.0, 1.0)))
    arm = scene.add("arm", PointOnCircle(axis=(0.0, 1.0, 0.0), radius=length))
    bob = scene.add("ball", PointMass(mass=ball))
    guide = scene.add("guide", Slider(axis=(0.0, 0.0, -1.0)))
    collar = scene.add("sleeve", RigidBody(mass=sleeve))
    link = scene.add("link", Rod(length=length))
    scene.connect(clock.output("value"), motor.input("rotation"))
    scene.connect(ground.frame, motor.a)
    scene.connect(motor.b, arm.a)
    scene.connect(arm.b, bob.point)
    scene.connect(motor.b, guide.a)
    scene.connect(guide.b, collar.frame)
    scene.connect(bob.point, link.a)
    scene.connect(link.b, collar.frame)
    scene.start["arm.angle"] = 2.4
    scene.guess["guide.displacement"] = 0.6
    scene.symbols.update({"arm.radius": "l", "link.length": "l", "clock.slope": "omega"})
    scene.symbols.update({"ball.mass": "m", "sleeve.mass": "M", "arm.angle": "theta"})
    return scene


def turning_rod(scale: float = 1.0) -> Scene:
    """Return a bead on a rod that turns about the vertical, held to the axle by a spring."""
    scene = Scene(space="space", gravity=0.0)
    ground, clock = scene.add("ground", Ground()), scene.add("clock", Ramp(slope=2.0))
    motor = scene.add("motor", RotaryDrive(axis=(0.0, 0.0, 1.0)))
    rail = scene.add("rail", Slider(axis=(0.6, 0.8, 0.0)))
    coil = scene.add("coil", Spring(stiffness=9.0, natural_length=0.5 * scale))
    bead = scene.add("bead", PointMass())
    scene.connect(clock.output("value"), motor.input("rotation"))
    scene.connect(ground.frame, motor.a)
    scene.connect(motor.b, rail.a)
    scene.connect(rail.b, bead.point)
    scene.connect(motor.b, coil.a)
    scene.connect(coil.b, bead.point)
    scene.start["rail.displacement"] = 0.8 * scale
    scene.symbols.update({"clock.slope": "Omega", "coil.natural_length": "l", "coil.stiffness": "k", "bead.mass": "m"})
    return scene


def hanging(names: tuple[str, str] = ("upper", "lower"), turn: tuple[float, float] | None = None) -> Scene:
    """Return a double pendulum whose parts have names of their own, perhaps with gravity in another direction."""
    scene = Scene() if turn is None else Scene(gravity=turn)
    ground = scene.add("ground", Ground())
    point = ground.frame
    for name in names:
        rod, bob = scene.add(f"{name}_rod", Rod(length=0.8)), scene.add(f"{name}_bob", PointMass(mass=1.4))
        scene.connect(point, rod.a)
        scene.connect(rod.b, bob.point)
        point = bob.point
        scene.symbols.update({f"{name}_rod.length": "l", f"{name}_bob.mass": "m"})
    return scene


def torqued(torque: float = 2.0) -> Scene:
    """Return a uniform link on a hinge under a steady torque."""
    scene = Scene()
    ground, hinge = scene.add("ground", Ground()), scene.add("hinge", Pivot())
    link, load = scene.add("link", Link(length=0.8, mass=1.0)), scene.add("load", Torque(value=torque))
    scene.connect(ground.frame, hinge.a)
    scene.connect(hinge.b, link.a)
    scene.connect(load.frame, link.a)
    scene.symbols["load.value"] = "tau"
    return scene


def wire(height: str, rate: float = 3.0) -> Scene:
    """Return a bead on a wire that turns evenly about the vertical."""
    scene = Scene(space="space")
    ground, clock = scene.add("ground", Ground()), scene.add("clock", Ramp(slope=rate))
    motor = scene.add("motor", RotaryDrive(axis=(0.0, 0.0, 1.0)))
    curve, bead = scene.add("wire", PointOnCurve(curve=("p", 0, height))), scene.add("bead", PointMass(mass=1.0))
    scene.connect(clock.output("value"), motor.input("rotation"))
    scene.connect(ground.frame, motor.a)
    scene.connect(motor.b, curve.a)
    scene.connect(curve.b, bead.point)
    scene.symbols.update({"clock.slope": "omega", "wire.scale": "a"})
    return scene


def rotor(rate: float = 1.0) -> Scene:
    """Return a disc on a round shaft that turns evenly, with friction inside the shaft and in the bearing."""
    scene = Scene(space="space", gravity=0.0)
    ground, clock = scene.add("ground", Ground()), scene.add("clock", Ramp(slope=rate))
    motor = scene.add("motor", RotaryDrive(axis=(0.0, 0.0, 1.0)))
    shaft, disc = scene.add("shaft", PointOnPlane(stiffness=4.0, damping=0.2)), scene.add("disc", PointMass(mass=1.3))
    bearing = scene.add("bearing", Drag(linear=0.3))
    scene.connect(clock.output("value"), motor.input("rotation"))
    scene.connect(ground.frame, motor.a)
    scene.connect(motor.b, shaft.a)
    scene.connect(shaft.b, disc.point)
    scene.connect(bearing.point, disc.point)
    letters = {"bearing.linear": "b", "shaft.damping": "c", "shaft.stiffness": "k", "clock.slope": "Omega"}
    scene.symbols.update(letters)
    return scene


def trap(first: float = 3.0, second: float = 5.0, field: float = 2.0) -> Scene:
    """Return a charge in a uniform magnetic field, held by springs along both axes, or on a hill."""
    scene = Scene(gravity=0.0)
    body, charge = scene.add("body", PointMass(mass=1.3)), scene.add("charge", LorentzForce(charge=0.7))
    scene.connect(charge.point, body.point)
    scene.set("charge.magnetic_field", lambda x, y, z, t: (0.0, field, 0.0))
    springs = scene.add("field", Potential())
    scene.connect(springs.point, body.point)
    scene.set("field.energy_function", lambda x, y, z, t: 0.5 * first * x * x + 0.5 * second * z * z)
    return scene
