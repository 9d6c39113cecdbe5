"""BoxContact: a box whose corners cannot pass a plane."""

from __future__ import annotations

from itertools import product

from atwood import Frame, Model, Number, Triple, connector, parameter
from atwood_library.contacts.vertex_contact import VertexContact

__all__ = ["BoxContact"]


class BoxContact(Model):
    """A box whose corners cannot pass a plane, with dry friction: four corners in a plane, eight in space.

    The corners are `corner[0]` and so on, with the signs of x (and y) before that of z.
    """

    synonyms = ("Rocking block", "Domino", "Block on floor", "Crate")

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length along x of the box's frame.")
    width: Number = parameter(1.0, unit="m", above=0.0, doc="Width along y; in a plane unused.")
    height: Number = parameter(1.0, unit="m", above=0.0, doc="Height along z.")
    corners: int = parameter(4, minimum=4, maximum=8, integer=True, doc="How many corners: 4 in a plane, 8 in space.")
    normal: Triple = parameter(
        (0.0, 0.0, 1.0), direction=True, doc="Normal of the plane in its frame, towards the box."
    )
    restitution: Number = parameter(0.0, minimum=0.0, maximum=1.0, doc="Of each corner; see VertexContact.")
    friction: Number = parameter(0.0, minimum=0.0, doc="Coefficient of friction while a corner slips.")
    static_friction: Number = parameter(None, minimum=0.0, doc="The same while it sticks.")
    surface_velocity: Number = parameter(0.0, unit="m/s", doc="Velocity of the surface over the plane.")
    plane: Frame = connector(Frame, "The frame that carries the plane; its origin is in it.")
    box: Frame = connector(Frame, "The frame of the box, at its middle.")

    def build(self) -> None:
        """Give each corner its contact."""
        half = 0.5 * self.length, 0.5 * self.width, 0.5 * self.height
        signs = product((-1, 1), (-1, 1) if self.corners == 8 else (0,), (-1, 1))
        common = {
            name: getattr(self, name) for name in ("restitution", "friction", "static_friction", "surface_velocity")
        }
        corners = [
            VertexContact(
                place=tuple(sign * one for sign, one in zip(some, half, strict=True)), normal=self.normal, **common
            )
            for some in signs
        ]
        for one in self.add("corner", corners):
            self.connect(self.plane, one.plane)
            self.connect(self.box, one.body)
