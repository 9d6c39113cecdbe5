"""Bodies whose corners cannot pass a plane: what boxes and polygons have in common."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from atwood import Frame, Model, Number, Triple, connector, parameter
from atwood_library.contacts.vertex_contact import VertexContact

__all__ = ["CornerInPlane", "Cornered"]


class CornerInPlane(VertexContact):
    """A corner of a body in a plane, which stands for the edge behind it; in space there are more of them."""

    spaces: ClassVar[tuple[str, ...]] = ("plane",)


class Cornered(Model):
    """Corners of a body that cannot pass a plane, with dry friction; they are `corner[0]` and so on."""

    normal: Triple = parameter(
        (0.0, 0.0, 1.0), direction=True, doc="Normal of the plane in its frame, towards the body."
    )
    restitution: Number = parameter(0.0, minimum=0.0, maximum=1.0, doc="Of each corner; see VertexContact.")
    impact_law: str = parameter("newton", choices=("newton", "poisson"), doc="Of each corner; see VertexContact.")
    friction: Number = parameter(0.0, minimum=0.0, doc="Coefficient of friction while a corner slips.")
    static_friction: Number = parameter(None, minimum=0.0, doc="The same while it sticks.")
    stiffness: Number = parameter(None, unit="N/m", above=0.0, doc="How corners share a load; see VertexContact.")
    surface_velocity: Number = parameter(0.0, unit="m/s", doc="Velocity of the surface over the plane.")
    plane: Frame = connector(Frame, "The frame that carries the plane; its origin is in it.")

    def add_corners(
        self, body: Frame, places: Iterable[tuple[float, ...]], kind: type[VertexContact] = VertexContact
    ) -> None:
        """Give each corner its contact.

        Parameters
        ----------
        body
            The frame of the body.
        places
            Where its corners are, in the axes of that frame, m.
        kind
            What they are.
        """
        names = "normal", "restitution", "impact_law", "friction", "static_friction", "stiffness", "surface_velocity"
        common = {name: getattr(self, name) for name in names}
        for one in self.add("corner", [kind(place=place, **common) for place in places]):
            self.connect(self.plane, one.plane)
            self.connect(body, one.body)
