"""Ropes of one straight piece that are told of otherwise than `Rope`: one by modes, and gaps with one word."""

from atwood import (
    Component,
    Number,
    Point,
    Scalar,
    connector,
    constraint,
    dot,
    event,
    parameter,
    signal,
    sqrt,
    unilateral,
)


class Tether(Component):
    """A rope from a to b, with a mode each for taut and slack."""

    modes = ("taut", "slack")
    mode_parameter = "starts"

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Its length.")
    starts: str = parameter("taut", choices=("taut", "slack"), doc="Whether it is taut or slack at the start.")
    paid_out: Number = signal(0.0, unit="m", doc="Length that is let out besides, a function of time.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @constraint(reaction="tension", unit="N", sign=-1.0, modes=("taut",), doc="Tension; zero when slack.")
    def fixed_length(self) -> Scalar:
        """Return by how much it is longer, where that is little."""
        r = self.b.position - self.a.position
        return dot(r, r) * (0.5 / self.whole_length()) - 0.5 * self.whole_length()

    @event(modes=("taut",), direction=-1, unit="N", target="slack", message="it has gone slack")
    def goes_slack(self) -> Scalar:
        """Return the tension."""
        return self.reaction("tension")

    @event(modes=("slack",), direction=-1, unit="m", target="taut", message="it has come taut", impact=True)
    def comes_taut(self) -> Scalar:
        """Return how much there is to spare."""
        r = self.b.position - self.a.position
        return self.whole_length() - sqrt(dot(r, r))

    def whole_length(self) -> Scalar:
        """Return the length with what has been let out."""
        return self.length + self.paid_out


class Loose(Component):
    """A string that has a word for where it goes slack."""

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Its length.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @unilateral(reaction="tension", doc="Tension.", opens=("goes_slack", "slack", "it has gone slack"))
    def spare(self) -> Scalar:
        """Length to spare, where that is little."""
        r = self.b.position - self.a.position
        return 0.5 * self.length - dot(r, r) * (0.5 / self.length)


class Caught(Loose):
    """A string that has a word for where it comes taut."""

    @unilateral(reaction="tension", doc="Tension.", closes=("comes_taut", "taut", "it has come taut"))
    def spare(self) -> Scalar:
        """Length to spare, where that is little."""
        r = self.b.position - self.a.position
        return 0.5 * self.length - dot(r, r) * (0.5 / self.length)
