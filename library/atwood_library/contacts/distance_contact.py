"""DistanceContact: two points that come no nearer, and go no farther, than some distance."""

from __future__ import annotations

from typing import ClassVar

from atwood import Component, Number, ParameterError, Point, Scalar, connector, observable, parameter, unilateral

__all__ = ["DistanceContact"]


class DistanceContact(Component):
    """Two points whose distance stays between two bounds: a slack rope, a rod with play, two smooth balls.

    On a line the distance has the sign that it starts with.
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Buffer", "Coupling with slack", "Newton's cradle", "Bumper")

    lower: Number = parameter(0.0, unit="m", minimum=0.0, doc="The smallest distance.")
    upper: Number = parameter(1.0, unit="m", above=0.0, doc="The largest distance.")
    ends: str = parameter("lower", choices=("both", "upper", "lower"), doc="Which of the two bounds there are.")
    restitution: Number = parameter(
        0.0, minimum=0.0, maximum=1.0, doc="Share of the speed with which a bound is reached that is left after it."
    )
    a: Point = connector(Point, "One point.")
    b: Point = connector(Point, "The other point.")

    def check_values(self) -> None:
        """Refuse bounds the wrong way round."""
        if self.ends == "both" and not self.lower < self.upper:
            raise ParameterError(
                f"the upper bound {self.upper:g} is not above the lower one, {self.lower:g}", where=f"{self.path}.upper"
            )

    @observable(unit="m", doc="Distance of the two points.")
    def length(self) -> Scalar:
        """Return the distance."""
        return self.distance(self.a, self.b)

    @unilateral(reaction="pressure", restitution="restitution", doc="Force that pushes the points apart.")
    def above_lower(self) -> Scalar:
        """Distance above the lower bound; a length that never changes where there is none."""
        return 1.0 * self.upper if self.ends == "upper" else self.distance(self.a, self.b) - self.lower

    @unilateral(reaction="tension", restitution="restitution", doc="Force that pulls the points together.")
    def below_upper(self) -> Scalar:
        """Distance below the upper bound; a length that never changes where there is none."""
        return 1.0 * self.upper if self.ends == "lower" else self.upper - self.distance(self.a, self.b)
