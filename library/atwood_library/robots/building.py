"""A scene from a robot's file: its parts by names, none twice, and what readers of both formats put in."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from atwood import Component, Scene, UsageError
from atwood_library.contacts.rotational_friction import RotationalFriction
from atwood_library.contacts.translational_friction import TranslationalFriction
from atwood_library.fields.coordinate_lagrangian import CoordinateLagrangian
from atwood_library.joints.gear import Gear
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.rack_and_pinion import RackAndPinion
from atwood_library.joints.slide_gear import SlideGear
from atwood_library.joints.slider import Slider

__all__ = ["Building", "add_armature", "add_friction", "add_gear", "choice", "existing_file"]

_P = TypeVar("_P", bound=Component)


@dataclass(frozen=True)
class Building:
    """A scene as it is put together from a file.

    Parameters
    ----------
    file
        The file.
    scene
        The scene, in space.
    """

    file: Path
    scene: Scene = field(default_factory=lambda: Scene(space="space"))

    def add(self, name: str, part: _P) -> _P:
        """Add a part under a name of the file: what Python has not in names becomes ``_``, and so does what is taken.

        Parameters
        ----------
        name
            Such as ``"left-arm/elbow"``, which becomes ``left_arm_elbow``.
        part
            The part.
        """
        plain = re.sub(r"\W", "_", name, flags=re.ASCII).lstrip("_")
        plain = plain if plain[:1].isalpha() else f"part_{plain}"
        while plain in self.scene.parts or hasattr(Scene, plain):
            plain += "_"
        return self.scene.add(plain, part)


def add_friction(building: Building, name: str, joint: Pivot | Slider, friction: float) -> None:
    """Add dry friction of a joint, N m or N, of one size at all speeds."""
    if isinstance(joint, Pivot):
        turning = building.add(f"{name}_friction", RotationalFriction(sliding=friction, against="ground"))
        building.scene.connect(joint.shaft, turning.b)
    else:
        sliding = building.add(f"{name}_friction", TranslationalFriction(sliding=friction, against="ground"))
        building.scene.connect(joint.carriage, sliding.b)


def add_armature(building: Building, name: str, joint: Pivot | Slider, inertia: float) -> None:
    """Add the inertia, kg m^2 or kg, of what turns with a joint's coordinate alone: a rotor behind a reduction."""
    turns = isinstance(joint, Pivot)
    rate = "rate_1" if turns else "speed_1"
    function = f"{0.5 * inertia!r}*{rate}**2"
    armature = CoordinateLagrangian(shafts=int(turns), slides=int(not turns), function=function)
    building.add(f"{name}_armature", armature)
    if isinstance(joint, Pivot):
        building.scene.connect(joint.shaft, armature.shaft[0])
    else:
        building.scene.connect(joint.carriage, armature.slide[0])


def add_gear(
    building: Building, name: str, part: Pivot | Slider, master: Pivot | Slider, law: tuple[float, float]
) -> None:
    """Add what makes the coordinate of a joint ``ratio * master + offset``, with the two numbers of `law`."""
    ratio, offset = law
    scene = building.scene
    if isinstance(part, Pivot) and isinstance(master, Pivot):
        gear = building.add(name, Gear(ratio=ratio, offset=offset))
        scene.connect(part.shaft, gear.a)
        scene.connect(master.shaft, gear.b)
    elif isinstance(part, Slider) and isinstance(master, Slider):
        slides = building.add(name, SlideGear(ratio=ratio, offset=offset))
        scene.connect(part.carriage, slides.a)
        scene.connect(master.carriage, slides.b)
    elif isinstance(part, Slider) and isinstance(master, Pivot):
        rack = building.add(name, RackAndPinion(radius=ratio, offset=offset))
        scene.connect(part.carriage, rack.rack)
        scene.connect(master.shaft, rack.pinion)
    elif isinstance(part, Pivot) and isinstance(master, Slider):  # solved for the displacement
        if ratio == 0.0:
            raise UsageError("a joint that turns follows one that slides with the ratio 0", where=name)
        rack = building.add(name, RackAndPinion(radius=1.0 / ratio, offset=-offset / ratio))
        scene.connect(master.carriage, rack.rack)
        scene.connect(part.shaft, rack.pinion)


def choice(value: Any, choices: tuple[str, ...], name: str, where: str) -> str:
    """Return an option that is one of some words, or refuse it."""
    if value not in choices:
        listed = ", ".join(map(repr, choices))
        raise UsageError(f"{name} cannot be {value!r}", where=where, advice=f"Give one of {listed}.")
    return str(value)


def existing_file(file: Any, where: str) -> Path:
    """Return the path of a file that is there, or refuse it."""
    try:
        path = Path(file)
        if path.is_file():
            return path
    except (TypeError, ValueError, OSError):
        pass
    raise UsageError("there is no such file", where=str(file)[:200] or where, advice="Give the path of a file.")
