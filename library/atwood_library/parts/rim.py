"""Rim: the turning part of a wheel."""

from __future__ import annotations

from atwood import Number, Outline, Triple, parameter
from atwood_library.parts.rigid_body import RigidBody


class Rim(RigidBody):
    """A rigid body that looks like a wheel: its inertia is what it is given, its radius is for pictures only."""

    synonyms = ("Rotor",)

    radius: Number = parameter(0.3, unit="m", above=0.0, doc="Radius.")
    axis: Triple = parameter((0.0, 1.0, 0.0), turning=True, doc="Axis in the frame.")

    def outline(self) -> Outline | None:
        """Return a thin disc, where the axis is along one of the frame's."""
        sizes = [abs(component) for component in self.axis]
        along = sizes.index(max(sizes))
        if sum(sizes) - sizes[along] > 1e-9 * sizes[along]:
            return None
        half = 0.06 * self.radius
        return Outline.revolved(((0.0, -half), (self.radius, -half), (self.radius, half), (0.0, half)), "xyz"[along])
