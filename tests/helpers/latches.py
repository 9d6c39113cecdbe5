"""Parts of a user's own whose modes add a constraint by an impact: it holds both ways, or one way only."""

from __future__ import annotations

from atwood import Component, Point, Scalar, connector, constraint, event, parameter


class Latch(Component):
    """Hooks two points together along x when b passes a; it may break, and may hold in one direction only."""

    modes = ("open", "shut")

    limit: float = parameter(1e3, unit="N", above=0.0, doc="Push on b at which it opens again.")
    bears: str = parameter("both", choices=("both", "pull", "push"), doc="Which forces it bears.")
    a: Point = connector(Point, "One side.")
    b: Point = connector(Point, "The other side.")

    def gap(self) -> Scalar:
        """Return how far b is ahead of a."""
        return self.b.position.x - self.a.position.x

    @constraint(reaction="hold", unit="N", doc="Force on b along x.", modes=("shut",))
    def hooked(self) -> Scalar:
        """Return the gap."""
        return self.gap()

    @event(modes=("open",), direction=0, unit="m", target="shut", message="it latches", impact=True)
    def meets(self) -> Scalar:
        """Return the gap."""
        return self.gap()

    @event(modes=("shut",), direction=1, unit="N", target="open", message="it breaks")
    def breaks(self) -> Scalar:
        """Return by how much b is pushed too hard."""
        return self.reaction("hold") - self.limit

    @event(modes=("shut",), direction=-1, unit="N", target="open", message="it lets go")
    def lets_go(self) -> Scalar:
        """Return the force in the direction that it bears."""
        return {"both": 1.0, "pull": -self.reaction("hold"), "push": self.reaction("hold")}[self.bears]
