"""What constraints on velocities leave free does not depend on units, places, directions, or names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from atwood import Scene, report
from atwood_library import Blade, Disc, Ground, RigidBody, RollingDisc, RollingSphere, Sphere, Weld


@dataclass(frozen=True)
class Said:
    """A scene said in another way: in another unit of length, of mass, turned, moved, and with other names."""

    length: float = 1.0
    mass: float = 1.0
    angle: float = 0.0
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    prefix: str = ""

    def base(self, scene: Scene, axis: tuple[float, float, float]) -> Any:
        """Return the frame that everything stands on."""
        ground = scene.add(f"{self.prefix}ground", Ground(position=tuple(self.length * x for x in self.place)))
        base = scene.add(f"{self.prefix}base", Weld(angle=self.angle, axis=axis))
        scene.connect(ground.frame, base.a)
        return base.b


OTHERS = (
    Said(length=1e-6),
    Said(length=1e6),
    Said(length=1e-3, mass=1e6),
    Said(mass=1e-6),
    Said(angle=0.7, place=(3.0, -2.0, 5.0)),
    Said(angle=1e-7, place=(300.0, 0.0, -500.0)),
    Said(prefix="z_"),
)


def disc(said: Said) -> Scene:
    """Return a disc that rolls on a plane: three constraints, of which no integral is known, and none there is."""
    scene = Scene(space="space")
    base = said.base(scene, (0.3, 1.0, 0.2))
    roll = scene.add(f"{said.prefix}roll", RollingDisc(radius=0.3 * said.length))
    body = scene.add(f"{said.prefix}disc", Disc(mass=said.mass, radius=0.3 * said.length))
    scene.connect(base, roll.a)
    scene.connect(roll.b, body.frame)
    return scene


def ball(said: Said) -> Scene:
    """Return a ball that rolls in a plane: its rolling can be integrated."""
    scene = Scene(space="plane")
    base = said.base(scene, (0.0, -1.0, 0.0))
    roll = scene.add(f"{said.prefix}roll", RollingSphere(radius=0.2 * said.length))
    body = scene.add(f"{said.prefix}ball", Sphere(mass=said.mass, radius=0.2 * said.length))
    scene.connect(base, roll.a)
    scene.connect(roll.b, body.frame)
    return scene


def sleigh(blades: int, said: Said) -> Scene:
    """Return a sleigh on parallel blades that hold its angle only together, or on one, which holds none."""
    scene = Scene(space="plane", gravity=0.0)
    base = said.base(scene, (0.0, -1.0, 0.0))
    moment = 0.5 * said.mass * said.length**2
    body = scene.add(f"{said.prefix}body", RigidBody(mass=said.mass, moments=(0.0, moment, 0.0)))
    for k in range(blades):
        blade = scene.add(f"{said.prefix}blade{k}", Blade())
        at = scene.add(f"{said.prefix}at{k}", Weld(displacement=((0.4 + 0.5 * k) * said.length, 0.0, 0.0)))
        scene.connect(base, blade.a)
        scene.connect(body.frame, at.a)
        scene.connect(at.b, blade.b)
    return scene


def decided(scene: Scene) -> tuple[object, ...]:
    """Return what was decided: states of both forms, freedoms, and what was integrated how."""
    found = report(scene).to_dict()
    kinds = [one["kind"] if isinstance(one, dict) and "kind" in one else "" for one in found["integrated"]]
    return found["states"], found["degrees_of_freedom"], len(found["integrated"]), kinds


@pytest.mark.sample(4)
@pytest.mark.parametrize("said", OTHERS, ids=range(len(OTHERS)))
@pytest.mark.parametrize("name", ["disc", "ball", "one blade", "two blades"])
def test_what_rolls_is_the_same_however_it_is_said(name: str, said: Said) -> None:
    make = {
        "disc": disc,
        "ball": ball,
        "one blade": lambda said: sleigh(1, said),
        "two blades": lambda said: sleigh(2, said),
    }[name]
    assert decided(make(said)) == decided(make(Said()))


def test_the_examples_are_of_each_kind() -> None:
    integrated = [decided(scene)[2] for scene in (disc(Said()), ball(Said()), sleigh(1, Said()), sleigh(2, Said()))]
    assert integrated[0] == 0
    assert integrated[1] > 0
    assert integrated[2] == 0
    assert integrated[3] > 0
