"""Many bodies of which any two may touch, as one component."""

from __future__ import annotations

from typing import Any, ClassVar

from atwood.errors import ParameterError
from atwood.model.declare.component import Component
from atwood.model.declare.field_functions import Number, parameter


class ContactGroup(Component):
    """Bodies of which any two may touch, and walls that none may pass.

    Their contacts are no gaps of their own: pairs are sought in every step of a solver that looks for no event, the
    only one that takes them. The bodies move freely but for forces; each frame is at the centre of mass of one.
    Subclasses say what shapes they have, and name the connector of the bodies.
    """

    member: ClassVar[str] = ""
    """Name of the connector of the bodies."""
    axes: ClassVar[int] = 2
    """Of a plane, or of space."""

    count: int = parameter(2, minimum=1, integer=True, doc="How many bodies.")
    walls: Any = parameter(None, array=True, doc="Walls in the world: rows of a point and of the normal into the room.")
    restitution: Number = parameter(
        0.0, minimum=0.0, maximum=1.0, doc="Share of the speed of approach after an impact."
    )
    friction: Number = parameter(0.0, minimum=0.0, doc="Coefficient of friction.")

    def check_values(self) -> None:
        """Refuse walls that are none."""
        wide, rows = 2 * self.axes, self.walls or ()
        if not all(isinstance(row, tuple) and len(row) == wide and any(row[self.axes :]) for row in rows):
            raise ParameterError(
                f"a wall is a row of {wide} numbers: a point, and a normal that is not zero",
                where=f"{self.path or type(self).__name__}.walls",
                advice="Give rows such as ((0, 0, 0, 1),) in a plane and ((0, 0, 0, 0, 0, 1),) in space.",
            )
