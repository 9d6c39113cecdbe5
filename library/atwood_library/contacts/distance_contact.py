"""DistanceContact: two points that come no nearer, and go no farther, than some distance."""

from __future__ import annotations

from typing import ClassVar

from atwood import Number, Point, Scalar, connector, observable, parameter, unilateral
from atwood_library.interfaces.bounds import Bounded

__all__ = ["DistanceContact"]


class DistanceContact(Bounded):
    """Two points whose distance stays between two bounds: a slack rope, a rod with play, two smooth balls.

    On a line the distance has the sign that it starts with.
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Buffer", "Coupling with slack", "Newton's cradle", "Bumper")

    lower: Number = parameter(None, unit="m", minimum=0.0, doc="The smallest distance; none if not given.")
    upper: Number = parameter(None, unit="m", above=0.0, doc="The largest distance; none if not given.")
    restitution: Number = parameter(
        0.0, minimum=0.0, maximum=1.0, doc="Share of the speed with which a bound is reached that is left after it."
    )
    impact_law: str = parameter(
        "newton", choices=("newton", "poisson"), doc="Whether restitution is a share of the speed, or of the impulse."
    )
    a: Point = connector(Point, "One point.")
    b: Point = connector(Point, "The other point.")

    @observable(unit="m", doc="Distance of the two points.")
    def length(self) -> Scalar:
        """Return the distance."""
        return self.distance(self.a, self.b)

    @unilateral(
        reaction="pressure",
        restitution="restitution",
        impact_law="impact_law",
        given=["lower"],
        doc="Force that pushes the points apart.",
    )
    def above_lower(self) -> Scalar:
        """Distance above the lower bound."""
        return self.distance(self.a, self.b) - self.lower

    @unilateral(
        reaction="tension",
        restitution="restitution",
        impact_law="impact_law",
        given=["upper"],
        doc="Force that pulls the points together.",
    )
    def below_upper(self) -> Scalar:
        """Distance below the upper bound."""
        return self.upper - self.distance(self.a, self.b)
