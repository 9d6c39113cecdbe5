"""Scenes of a course on small oscillations."""

from __future__ import annotations

from itertools import pairwise

from atwood import Scene
from atwood_library import (
    Damper,
    Ground,
    Mass1D,
    PointMass,
    PointOnCircle,
    Ramp,
    RigidBody,
    Rod,
    RotaryDrive,
    Slider,
    Spring,
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
