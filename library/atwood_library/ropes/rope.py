"""Rope: inextensible, over any number of pulleys."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from atwood import (
    Component,
    Groove,
    Number,
    Point,
    Scalar,
    absolute,
    connector,
    constraint,
    dot,
    event,
    is_zero,
    lagrangian,
    minimum,
    observable,
    parameter,
    signal,
    unilateral,
)
from atwood_library.interfaces.spans import rate_of_span


class Rope(Component):
    """An inextensible, massless rope from a to b over any number of ideal pulleys.

    Its tension is the same everywhere, and cannot be negative. When it becomes so, the run stops there and says so,
    or, with ``when_slack="slack"``, the rope goes slack and comes taut again, with a jerk, when it is stretched out.
    Its length is a gap then, `spare`, which explicit methods solve; where it is on what moves and has no mass, as a
    pulley that hangs, it is a constraint with modes.

    A winch that lets it out or hauls it in is its input `paid_out`. Where the input `release` falls through zero, it
    lets go for good, as a sling does. Pulleys with inertia are taken up on the side of a, where the tension is then
    `tension_a`.
    """

    modes = ("taut", "slack", "released")
    mode_parameter = "starts"

    pulleys: int = parameter(0, minimum=0, integer=True, doc="How many pulleys it passes.")
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length from a to b.")
    when_slack: str = parameter(
        "stop", choices=("stop", "slack"), doc="What happens when the tension becomes negative."
    )
    pulley_inertia: Number = parameter(
        0.0,
        unit="kg",
        minimum=0.0,
        doc="Moment of inertia of each pulley it passes, over the square of its radius.",
        symbol="M",
    )
    paid_out: Number = signal(0.0, unit="m", doc="Length that is let out besides, a function of time.")
    release: Number = signal(1.0, unit="any", doc="The rope lets go where this falls through zero.")
    starts: str = parameter("taut", choices=("taut", "slack"), doc="Whether it is taut or slack at the start.")
    a: Point = connector(Point, "One end.")
    over: Sequence[Groove] = connector(Groove, "The pulleys it passes, in order from a to b.", count="pulleys")
    b: Point = connector(Point, "The other end.")

    def spans(self) -> list[Scalar]:
        """Return the lengths of the straight pieces, from a to b."""
        stops = [self.a, *self.over, self.b]
        return [self.distance(p, q, side=None) for p, q in pairwise(stops)]

    def is_gap(self) -> bool:
        """Return whether it may be slack, and all that it touches has mass: its length is a gap then.

        Else it is a constraint. What has no mass is where forces balance while a rope is slack, which is another
        equation, and another mode.
        """
        ends = (self.a, *self.over, self.b)
        return "slack" in (self.when_slack, self.starts) and not any(one.is_light for one in ends)

    @constraint(reaction="tension", unit="N", sign=-1.0, modes=("taut",), doc="Tension; zero when slack.")
    def fixed_length(self) -> Scalar:
        """Return the length less the rope's own; nothing where it is a gap."""
        return 0.0 if self.is_gap() else -self.to_spare()

    @unilateral(
        reaction="tension",
        unit="N",
        modes=("taut", "slack"),
        given=("is_gap",),
        starts="starts",
        closes=("comes_taut", "taut", "the rope has come taut"),
        opens=("goes_slack", "when_slack", "the rope has gone slack"),
        doc="Tension; zero when slack.",
    )
    def spare(self) -> Scalar:
        """Length that it has to spare; for a single straight piece ``(l^2 - r^2)/(2 l)``."""
        return self.to_spare()

    def to_spare(self) -> Scalar:
        """Return the length less that of the path; a single straight piece needs no root."""
        if self.pulleys:
            return self.whole_length() - self.sum_of_spans()
        r, length = self.b.position - self.a.position, self.whole_length()
        if self.on_a_line and not self.is_gap():
            return length - self.sum_of_spans()
        return 0.5 * length - dot(r, r) * (0.5 / length)

    def whole_length(self) -> Scalar:
        """Return the length from a to b with what has been let out."""
        return self.length + self.paid_out

    @lagrangian
    def turning_pulleys(self) -> Scalar:
        """Return the kinetic energy of the pulleys, over which the rope runs without slipping."""
        if is_zero(self.pulley_inertia) or not self.pulleys:
            return 0.0
        speeds = [self.speed_at(number) for number in range(self.pulleys)]
        return 0.5 * self.pulley_inertia * sum((v * v for v in speeds[1:]), speeds[0] * speeds[0])

    def speed_at(self, number: int) -> Scalar:
        """Return how fast the rope runs over a pulley, towards the side of a."""
        stops = [self.a, *self.over, self.b]
        return sum_up([rate_of_span(self, p, q) for p, q in pairwise(stops[: number + 2])])

    @event(modes=("taut",), direction=-1, unit="N", target="when_slack", message="the rope has gone slack")
    def goes_slack(self) -> Scalar:
        """Return the tension; nothing where it is a gap, which is watched by itself."""
        return 0.0 if self.is_gap() else self.reaction("tension")

    @event(modes=("slack",), direction=-1, unit="m", target="taut", message="the rope has come taut", impact=True)
    def comes_taut(self) -> Scalar:
        """Return how much rope is to spare; nothing where it is a gap."""
        return 0.0 if self.is_gap() else self.whole_length() - self.reach()

    @event(modes=("taut", "slack"), direction=-1, target="released", message="the rope has been let go")
    def lets_go(self) -> Scalar:
        """Return the input."""
        return self.release

    @event(
        modes=("taut", "slack"),
        direction=-1,
        unit="m",
        target="stop",
        message="an end of the rope has reached a pulley",
    )
    def reaches_pulley(self) -> Scalar:
        """Return the shortest piece; on a line, where the sides would change, it must stay positive."""
        if not self.pulleys:
            return self.length
        shortest, *others = self.spans()
        for span in others:
            shortest = minimum(shortest, span)
        return shortest

    @observable(unit="m", doc="Length along the straight pieces from a to b.")
    def reach(self) -> Scalar:
        """Return the length of the path from a to b."""
        # On a line a rope without pulleys can come taut on either side.
        if self.on_a_line and not self.pulleys:
            return absolute(dot(self.b.position - self.a.position, self.line))
        return self.sum_of_spans()

    def sum_of_spans(self) -> Scalar:
        """Return the sum of the straight pieces; on a line, signed as they start."""
        return sum_up(self.spans())

    @observable(unit="N", doc="Tension at a, where pulleys have inertia.", spaces=("line",))
    def tension_a(self) -> Scalar:
        """Return the tension at b, and what speeds the pulleys up."""
        stops = [self.a, *self.over, self.b]
        rates = [
            sum_up([rate_of_span(self, p, q, "acceleration") for p, q in pairwise(stops[: number + 2])])
            for number in range(self.pulleys)
        ]
        return self.reaction("tension") + (self.pulley_inertia * sum_up(rates) if rates else 0.0)


def sum_up(values: Sequence[Scalar]) -> Scalar:
    """Return a sum of one value or more."""
    total = values[0]
    for value in values[1:]:
        total = total + value
    return total
