"""Blade: an edge that moves along itself and not sideways."""

from __future__ import annotations

from atwood import (
    Component,
    Frame,
    Outline,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    constraint,
    cross,
    dot,
    observable,
    parameter,
)
from atwood_library.interfaces.bearings import velocity_seen

_LENGTH = 0.1
"""m. How long it is drawn."""


class Blade(Component):
    """A blade on a surface: the point moves along the blade only, and turns freely; the foot of a sleigh.

    What it cannot do is a velocity, and not a position (Neimark and Fufaev, Dynamics of Nonholonomic Systems, chapter
    2). In space it cuts into the plane with the given normal, and nothing holds it on that plane.
    """

    synonyms = ("Knife edge", "Skate", "Ice skate")
    spaces = ("plane", "space")

    axis: Triple = parameter((1.0, 0.0, 0.0), direction=True, doc="Direction of the blade in its frame b.")
    normal: Triple = parameter(
        (0.0, 1.0, 0.0), turning=True, doc="Normal, in frame a, of the surface that it cuts into."
    )
    a: Frame = connector(Frame, "The frame that carries the surface.")
    b: Frame = connector(Frame, "The blade, at its point of contact.")

    def outline(self) -> Outline:
        """Return what it looks like: a thin edge along the blade, at its point of contact."""
        x, y = as_vector(self.axis), as_vector(self.normal)
        return Outline.box(_LENGTH, 0.1 * _LENGTH, 0.03 * _LENGTH).turned(x, y, cross(x, y)).on("b")

    def across(self) -> Vector:
        """Return the direction across the blade, in world axes."""
        sideways: Vector = cross(self.a.to_world(as_vector(self.normal)), self.along())
        return sideways

    def along(self) -> Vector:
        """Return the direction of the blade, in world axes."""
        return self.b.to_world(as_vector(self.axis))

    @constraint(
        reaction="side_force", unit="N", doc="Force on the blade, across it: normal x blade.", spaces=("plane", "space")
    )
    def edge(self) -> Scalar:
        """Return the velocity across the blade."""
        return dot(velocity_seen(self.a, self.b), self.across())

    @observable(unit="m/s", doc="Velocity along the blade.", spaces=("plane", "space"))
    def speed(self) -> Scalar:
        """Return the velocity along the blade."""
        return dot(velocity_seen(self.a, self.b), self.along())
