"""OneWayClutch: an angle that turns one way past another, and not back: a freewheel, with a clutch beside it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

from atwood import (
    Component,
    CoordinateLoad,
    Number,
    Scalar,
    Shaft,
    connector,
    force,
    maximum,
    observable,
    parameter,
    signal,
    unilateral,
)
from atwood_library.interfaces.along_coordinates import between, push

__all__ = ["OneWayClutch"]


class OneWayClutch(Component):
    """Shaft b overruns shaft a, or the ground, and is carried along where a would be faster.

    A clutch beside the freewheel rubs against the overrun with ``level sliding(v)``, and once at rest lets go where
    b is pulled ahead by `peak` times as much as it rubs with just above rest; without it (a level of zero or less) b
    runs free. Both together exert one torque (F. Pfeiffer and C. Glocker, *Multibody Dynamics with Unilateral
    Contacts*, 1996, section 5.4).
    """

    synonyms: ClassVar[tuple[str, ...]] = (
        *("Freewheel", "Overrunning clutch", "Sprag clutch", "Backstop", "Bicycle hub"),
        "Rotational.Components.OneWayClutch",
    )
    spaces: ClassVar[tuple[str, ...]] = ("plane", "space")

    sliding: Any = parameter(
        "0.0",
        unit="N*m",
        function_of={"v": "rad/s"},
        doc="Friction of the clutch at a speed v of b past a, at level 1.",
    )
    peak: Number = parameter(1.0, minimum=1.0, doc="What the clutch bears at rest, over what it has just above rest.")
    level: Number = signal(1.0, doc="How far the clutch is pressed.")
    against: str = parameter("flange", choices=("flange", "ground"), doc="What b cannot fall behind.")
    a: Shaft = connector(Shaft, "The angle that drives.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that is driven, and overruns.")

    @unilateral(
        reaction="locking_torque",
        unit="N*m",
        level="velocity",
        adhesion="bite",
        doc="Torque on b that keeps the speeds equal, besides the friction of the clutch.",
    )
    def overrun(self) -> Scalar:
        """Speed of b past a."""
        return between(self)[1]

    def pressed(self) -> Scalar:
        """Return how far the clutch is pressed, at least zero."""
        return maximum(self.level, 0.0)

    def rubbing(self) -> Scalar:
        """Return the friction against the overrun."""
        return self.pressed() * self.sliding(between(self)[1])

    def bite(self) -> Scalar:
        """Return by how much more the clutch bears at rest."""
        return self.pressed() * (self.peak - 1.0) * self.sliding(0.0)

    @force
    def rub(self) -> Iterable[CoordinateLoad]:
        """Return the friction of the clutch."""
        yield from push(self, -self.rubbing())

    @observable(unit="N*m", doc="Torque on b: of the freewheel and of the clutch.", spaces=("plane", "space"))
    def torque(self) -> Scalar:
        """Return the torque."""
        return self.reaction("locking_torque") - self.rubbing()
