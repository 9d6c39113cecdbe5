"""DiscContacts: many discs of which any two may touch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from atwood import ContactGroup, Frame, Number, connector, parameter

__all__ = ["DiscContacts"]


class DiscContacts(ContactGroup):
    """Equal discs of which any two may touch, and walls in the world that none may pass; for time stepping.

    Connect `disc[0]`, `disc[1]` and so on to the frames of discs, and simulate with ``solver="moreau"``.
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Granular material", "Many bodies", "Sand", "Billiards")
    spaces: ClassVar[tuple[str, ...]] = ("plane",)
    member: ClassVar[str] = "disc"

    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Radius of each disc.")
    walls: Any = parameter(
        ((0.0, 0.0, 0.0, 1.0),),
        array=True,
        doc="Walls in the world: rows of a point x, z and of the normal into the room.",
    )
    disc: Sequence[Frame] = connector(Frame, "The discs.", count="count")
