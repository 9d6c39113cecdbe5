"""Tether: a rope of one straight piece that is a state machine, and not a gap as `Rope` is."""

from atwood import Component, Number, Point, Scalar, connector, constraint, dot, event, parameter, sqrt


class Tether(Component):
    """A rope from a to b, with a mode each for taut and slack."""

    modes = ("taut", "slack")
    mode_parameter = "starts"

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Its length.")
    starts: str = parameter("taut", choices=("taut", "slack"), doc="Whether it is taut or slack at the start.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @constraint(reaction="tension", unit="N", sign=-1.0, modes=("taut",), doc="Tension; zero when slack.")
    def fixed_length(self) -> Scalar:
        """Return by how much it is longer, where that is little."""
        r = self.b.position - self.a.position
        return dot(r, r) * (0.5 / self.length) - 0.5 * self.length

    @event(modes=("taut",), direction=-1, unit="N", target="slack", message="it has gone slack")
    def goes_slack(self) -> Scalar:
        """Return the tension."""
        return self.reaction("tension")

    @event(modes=("slack",), direction=-1, unit="m", target="taut", message="it has come taut", impact=True)
    def comes_taut(self) -> Scalar:
        """Return how much there is to spare."""
        r = self.b.position - self.a.position
        return self.length - sqrt(dot(r, r))
