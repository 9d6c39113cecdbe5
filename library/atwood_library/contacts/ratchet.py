"""Ratchet: a toothed wheel that a pawl lets turn one way, tooth by tooth."""

from __future__ import annotations

import math
from typing import ClassVar

from atwood import Component, Number, Scalar, Shaft, connector, discrete_state, event, parameter, unilateral, update
from atwood_library.interfaces.along_coordinates import between

__all__ = ["Ratchet"]


class Ratchet(Component):
    """Angle b turns ahead of angle a, or of the ground, and falls back by less than a tooth: then a pawl holds it.

    Unlike a freewheel, which holds anywhere, it has play: what turns back meets the last tooth with a speed.
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Pawl", "Ratchet wheel", "Winch pawl", "Cable tie")
    spaces: ClassVar[tuple[str, ...]] = ("plane", "space")

    teeth: int = parameter(12, minimum=1, integer=True, doc="Number of teeth of the whole wheel.")
    restitution: Number = parameter(
        0.0, minimum=0.0, maximum=1.0, doc="Share of the speed with which a tooth is met that is left after it."
    )
    against: str = parameter("flange", choices=("flange", "ground"), doc="What it acts against.")
    a: Shaft = connector(Shaft, "The angle that carries the pawl.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle of the wheel.")
    passed: Scalar = discrete_state(doc="How many teeth have passed the pawl.")

    def pitch(self) -> float:
        """Return the angle from tooth to tooth."""
        return 2.0 * math.pi / self.teeth

    @unilateral(reaction="pawl_torque", unit="N*m", restitution="restitution", doc="Torque of the pawl on b.")
    def play(self) -> Scalar:
        """By how much b is ahead of the last tooth that has passed."""
        return between(self)[0] - self.passed * self.pitch()

    @event(direction=1, unit="rad", message="a tooth passes the pawl")
    def passes(self) -> Scalar:
        """Return by how much b is ahead of the next tooth."""
        return between(self)[0] - (self.passed + 1.0) * self.pitch()

    @update(at="passes", sets="passed", pure=True)
    def count(self) -> Scalar:
        """Return how many teeth have passed then."""
        return self.passed + 1.0
