"""Many round bodies of which any two may touch, as one component."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from atwood.model.declare.component import Component
from atwood.model.declare.connectors import Frame, connector
from atwood.model.declare.field_functions import Number, parameter


class ContactGroup(Component):
    """Discs of which any two may touch, and walls that none may pass.

    Their contacts are no gaps of their own: pairs are sought in every step of a solver that looks for no event, the
    only one that takes them. The discs move freely but for forces; each frame is at the centre of a disc.
    """

    spaces: ClassVar[tuple[str, ...]] = ("plane",)

    count: int = parameter(2, minimum=1, integer=True, doc="How many discs.")
    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Radius of each disc.")
    walls: Any = parameter(
        ((0.0, 0.0, 0.0, 1.0),),
        array=True,
        doc="Walls in the world: rows of a point x, z and of the normal into the room.",
    )
    restitution: Number = parameter(
        0.0, minimum=0.0, maximum=1.0, doc="Share of the speed of approach after an impact."
    )
    friction: Number = parameter(0.0, minimum=0.0, doc="Coefficient of friction.")
    disc: Sequence[Frame] = connector(Frame, "The discs.", count="count")
