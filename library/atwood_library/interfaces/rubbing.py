"""Dry friction along a coordinate: how much a brake, a clutch or a bearing holds while it slips and sticks."""

from __future__ import annotations

from typing import Any, ClassVar

from atwood import Component, Scalar
from atwood_library.interfaces.along_coordinates import between

__all__ = ["Rubbing"]


class Rubbing(Component):
    """Dry friction between two coordinates of one kind, or from one to the ground.

    While it slips its size is ``level (sliding(v) + viscous v)``; while it sticks it bears `peak` times as much as it
    has just above rest. What inherits has the connectors, and the slip.
    """

    sliding: Any
    viscous: Any
    peak: Any
    level: Any
    slip_direction: ClassVar[Any]

    def largest(self) -> Scalar:
        """Return the friction while it slips."""
        speed = self.slip_direction * between(self)[1]
        return self.level * (self.sliding(speed) + self.viscous * speed)

    def largest_static(self) -> Scalar:
        """Return the largest friction while it sticks."""
        return self.level * self.peak * self.sliding(0.0)
