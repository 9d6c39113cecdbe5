"""Resolved: measurements in the axes of the world or of any frame."""

from __future__ import annotations

from atwood import Component, Frame, Vector, connector, parameter


class Resolved(Component):
    """A sensor whose vectors are given in the axes of the world, or in those of a frame that may turn."""

    resolved_in: str = parameter("world", choices=("world", "frame"), doc="In whose axes vectors are given.")
    axes: Frame = connector(Frame, "The frame in whose axes vectors are given.", when={"resolved_in": ("frame",)})

    def resolved(self, vector: Vector) -> Vector:
        """Return a vector, given in world axes, in the axes that are asked for."""
        return vector if self.resolved_in == "world" else self.axes.to_frame(vector)
