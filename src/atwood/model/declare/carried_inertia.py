"""The inertia of the body that a connector is on, which laws may read.

Which parts make a body is known only when all parts have said what they join. So laws are evaluated on symbols first,
which note what is asked for, and then on what the body has.
"""

from __future__ import annotations

from typing import Any, Protocol

from atwood.expr import Graph, Scalar
from atwood.model.values.rotation import Axes
from atwood.model.values.vector import Vector

__all__ = ["Asked", "Carried"]


class Carried(Protocol):
    """Mass, centre of mass and inertia tensor of a body, in the axes of one of its frames."""

    @property
    def mass(self) -> Scalar:
        """Mass, kg."""

    @property
    def center_of_mass(self) -> Vector:
        """Centre of mass, m."""

    @property
    def inertia(self) -> Axes:
        """Inertia tensor about the centre of mass, kg m^2."""


class Asked:
    """Stands for the inertia of a body that is not known yet, and notes whether somebody asks for it.

    Parameters
    ----------
    graph
        Where its symbols live.
    path
        Path of the connector.
    """

    def __init__(self, graph: Graph, path: str) -> None:
        self._graph, self._path = graph, path
        self.is_read = False

    @property
    def mass(self) -> Any:
        """A symbol for the mass."""
        return self._symbol("mass")

    @property
    def center_of_mass(self) -> Vector:
        """Symbols for the centre of mass."""
        return Vector(*(self._symbol(f"center.{axis}") for axis in "xyz"))

    @property
    def inertia(self) -> Axes:
        """Symbols for the inertia tensor."""
        x, y, z = (Vector(*(self._symbol(f"inertia.{row}{column}") for column in "xyz")) for row in "xyz")
        return x, y, z

    def _symbol(self, name: str) -> Scalar:
        self.is_read = True
        return self._graph.parameter(f"{self._path} {name} of body")
