"""A part that counts what passes."""

from __future__ import annotations

from atwood import Component, Point, Scalar, connector, discrete_state, event, parameter, update


class Counter(Component):
    """Counts how often a coordinate passes a level, both ways."""

    level: float = parameter(0.0, unit="m", doc="The level.")
    axis: int = parameter(0, integer=True, doc="Which coordinate.")
    point: Point = connector(Point, "What is counted.")
    passed: Scalar = discrete_state(doc="How often.")

    @event(direction=0, unit="m", message="it passes")
    def passes(self) -> Scalar:
        """Return how far behind the level it is."""
        return self.point.position[self.axis] - self.level

    @update(at="passes", sets="passed")
    def count(self) -> Scalar:
        """Return one more."""
        return self.passed + 1.0
