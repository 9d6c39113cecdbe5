"""Rope: inextensible, over any number of pulleys."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from atwood import (
    Component,
    Groove,
    Point,
    Scalar,
    absolute,
    connector,
    constraint,
    dot,
    event,
    minimum,
    observable,
    parameter,
)


class Rope(Component):
    """An inextensible, massless rope from a to b over any number of ideal pulleys.

    Its tension is the same everywhere, and cannot be negative. When it becomes so, the run stops there and says so,
    or, with ``when_slack="slack"``, the rope goes slack and comes taut again, with a jerk, when it is stretched out.
    """

    modes = ("taut", "slack")
    mode_parameter = "starts"

    pulleys: int = parameter(0, minimum=0, integer=True, doc="How many pulleys it passes.")
    length: float = parameter(1.0, unit="m", above=0.0, doc="Length from a to b.")
    when_slack: str = parameter(
        "stop", choices=("stop", "slack"), doc="What happens when the tension becomes negative."
    )
    starts: str = parameter("taut", choices=("taut", "slack"), doc="Whether it is taut or slack at the start.")
    a: Point = connector(Point, "One end.")
    over: Sequence[Groove] = connector(Groove, "The pulleys it passes, in order from a to b.", count="pulleys")
    b: Point = connector(Point, "The other end.")

    def spans(self) -> list[Scalar]:
        """Return the lengths of the straight pieces, from a to b."""
        stops = [self.a, *self.over, self.b]
        return [self.distance(p, q, side=None) for p, q in pairwise(stops)]

    @constraint(reaction="tension", unit="N", sign=-1.0, modes=("taut",), doc="Tension; zero when slack.")
    def fixed_length(self) -> Scalar:
        """Return the length less the rope's own; for a single straight piece ``(r^2 - l^2)/(2 l)``."""
        if self.on_a_line or self.pulleys:
            return self.sum_of_spans() - self.length
        r = self.b.position - self.a.position
        return dot(r, r) * (0.5 / self.length) - 0.5 * self.length

    @event(modes=("taut",), direction=-1, unit="N", target="when_slack", message="the rope has gone slack")
    def goes_slack(self) -> Scalar:
        """Return the tension."""
        return self.reaction("tension")

    @event(modes=("slack",), direction=-1, unit="m", target="taut", message="the rope has come taut", impact=True)
    def comes_taut(self) -> Scalar:
        """Return how much rope is to spare."""
        return self.length - self.reach()

    @event(direction=-1, unit="m", target="stop", message="an end of the rope has reached a pulley")
    def reaches_pulley(self) -> Scalar:
        """Return the shortest piece; on a line, where the sides would change, it must stay positive."""
        spans = self.spans()
        shortest = spans[0]
        for span in spans[1:]:
            shortest = minimum(shortest, span)
        return shortest if self.pulleys else self.length

    @observable(unit="m", doc="Length along the straight pieces from a to b.")
    def reach(self) -> Scalar:
        """Return the length of the path from a to b."""
        # On a line a rope without pulleys can come taut on either side.
        return absolute(self.sum_of_spans()) if self.on_a_line and not self.pulleys else self.sum_of_spans()

    def sum_of_spans(self) -> Scalar:
        """Return the sum of the straight pieces; on a line, signed as they start."""
        total = self.spans()[0]
        for span in self.spans()[1:]:
            total = total + span
        return total
