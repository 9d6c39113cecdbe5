"""PointOnLevelSurface: a point on the surface, or the curve, where a function of its place is zero."""

from __future__ import annotations

from atwood import Outline, Scalar, Vector, constraint, observable
from atwood_library.interfaces.level_surface import LevelSurface


class PointOnLevelSurface(LevelSurface):
    """A point that stays where ``f(x, y, z) = 0``, with its place in the axes of a frame that may move.

    In space that is a surface, in a plane a curve, ``f(x, 0, z) = 0``. Lengths are in units of `scale`. It is a
    constraint without coordinates of its own, and so takes no state away; its force is along the gradient of f.
    """

    synonyms = ("Implicit surface", "Implicit curve")
    spaces = ("plane", "space")

    def outline(self) -> Outline:
        """Return what it looks like: the way of the point on the surface."""
        return Outline.path("b")

    @constraint(
        reaction="normal_force",
        unit="N",
        doc="Force on the point towards where the function is positive.",
        spaces=("plane", "space"),
    )
    def on_surface(self) -> Scalar:
        """Return the function over the size of its gradient, whose slope on the surface is one."""
        return self.height()

    @observable(unit="1", doc="Normal of the surface at the point, in world axes.", spaces=("plane", "space"))
    def normal(self) -> Vector:
        """Return the normal."""
        return self.unit_normal()
