"""PolygonContact: a polygon, or a polyhedron, whose corners cannot pass a plane."""

from __future__ import annotations

from typing import Any

import numpy as np

from atwood import Frame, ParameterError, connector, parameter
from atwood_library.interfaces.cornered import Cornered

__all__ = ["PolygonContact"]


class PolygonContact(Cornered):
    """A convex polygon, in space a polyhedron, whose corners cannot pass a plane, with dry friction.

    The corners are `corner[0]` and so on, in the order of `vertices`. Those inside of the others never touch.
    """

    synonyms = ("Polyhedron on plane", "Rimless wheel", "Die", "Convex contact")

    vertices: Any = parameter(
        ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)),
        array=True,
        doc="Its corners in the axes of the body's frame, m: rows of x and z in a plane, of x, y and z in space.",
    )
    body: Frame = connector(Frame, "The frame of the body.")

    def build(self) -> None:
        """Give each corner its contact."""
        places = np.asarray(self.vertices, dtype=float)
        if places.ndim != 2 or places.shape[1] not in (2, 3) or not np.all(np.isfinite(places)):
            raise ParameterError(
                "its corners are rows of two or of three numbers",
                where=f"{self.path}.vertices",
                advice="Give ((x, z), ...) in a plane and ((x, y, z), ...) in space, in metres.",
            )
        if places.shape[1] == 2:
            places = np.insert(places, 1, 0.0, axis=1)
        self.add_corners(self.body, (tuple(map(float, place)) for place in places))
