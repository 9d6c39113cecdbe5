"""BoxContact: a box whose corners cannot pass a plane."""

from __future__ import annotations

from itertools import product

from atwood import Frame, Number, connector, parameter
from atwood_library.interfaces.cornered import Cornered

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
        half = 0.5 * self.length, 0.5 * self.width, 0.5 * self.height
        signs = product((-1, 1), (-1, 1) if self.corners == 8 else (0,), (-1, 1))
        self.add_corners(self.box, (tuple(sign * one for sign, one in zip(some, half, strict=True)) for some in signs))
