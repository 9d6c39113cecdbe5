"""BoxContact: a box whose corners cannot pass a plane."""

from __future__ import annotations

from itertools import product

from atwood import Frame, Number, ParameterError, connector, parameter
from atwood_library.contacts.vertex_contact import VertexContact
from atwood_library.interfaces.cornered import Cornered, CornerInPlane

__all__ = ["BoxContact"]


class BoxContact(Cornered):
    """A box whose corners cannot pass a plane, with dry friction: four corners in a plane, eight in space.

    The corners are `corner[0]` and so on, with the signs of x (and y) before that of z.
    """

    synonyms = ("Rocking block", "Domino", "Block on floor", "Crate")

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length along x of the box's frame.")
    width: Number = parameter(1.0, unit="m", above=0.0, doc="Width along y; in a plane unused.")
    height: Number = parameter(1.0, unit="m", above=0.0, doc="Height along z.")
    corners: int = parameter(4, minimum=4, maximum=8, integer=True, doc="How many corners: 4 in a plane, 8 in space.")
    box: Frame = connector(Frame, "The frame of the box, at its middle.")

    def build(self) -> None:
        """Give each corner its contact."""
        if self.corners not in (4, 8):
            raise ParameterError(
                f"a box has no {self.corners} corners",
                where=f"{self.path or type(self).__name__}.corners",
                advice="Give 4 in a plane, 8 in space.",
            )
        half = 0.5 * self.length, 0.5 * self.width, 0.5 * self.height
        in_space = self.corners == 8
        signs = product((-1, 1), (-1, 1) if in_space else (0,), (-1, 1))
        places = (tuple(sign * one for sign, one in zip(some, half, strict=True)) for some in signs)
        self.add_corners(self.box, places, VertexContact if in_space else CornerInPlane)
