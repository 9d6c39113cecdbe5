"""Parts of a user's own whose laws hold in some of their modes only."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    Load,
    Point,
    Scalar,
    Vector,
    connector,
    constraint,
    dissipation,
    event,
    force,
    parameter,
    potential,
)

from .stick_slip import StickSlip


class DryContact(StickSlip):
    """Dry friction of a given size between two points, along x."""

    limit: float = parameter(1.0, unit="N", minimum=0.0, doc="Size of the friction.")
    a: Point = connector(Point, "One side.")
    b: Point = connector(Point, "The other side.")

    def slip(self) -> Scalar:
        """Return how fast b slides over a."""
        return self.b.velocity.x - self.a.velocity.x

    def most(self) -> Scalar:
        """Return the size of the friction."""
        return self.limit

    def rub(self, push: Scalar) -> Iterable[Load]:
        """Return a force on b along x, and its reaction."""
        return [Load(self.b, Vector(push, 0.0, 0.0)), Load(self.a, Vector(-push, 0.0, 0.0))]

    @constraint(reaction="grip", unit="N", doc="Force on b along x.", modes=("sticks",))
    def hold(self) -> Scalar:
        """Return the slip."""
        return self.slip()

    @force(modes=("slips_ahead",))
    def rub_ahead(self) -> Iterable[Load]:
        """Return the friction on what slides ahead."""
        return self.rub(-self.limit)

    @force(modes=("slips_back",))
    def rub_back(self) -> Iterable[Load]:
        """Return the friction on what slides back."""
        return self.rub(self.limit)


class Cushion(Component):
    """An elastic and a viscous wall at x = place, which is touched from the left."""

    modes = ("apart", "touching")

    stiffness: float = parameter(100.0, unit="N/m", minimum=0.0, doc="Force for each metre that it is pressed in.")
    damping: float = parameter(0.0, unit="N*s/m", minimum=0.0, doc="Force for each metre a second, while touched.")
    preload: float = parameter(0.0, unit="N", minimum=0.0, doc="Force of the first touch.")
    store: float = parameter(0.0, unit="J", doc="Energy that the first touch sets free, or takes.")
    place: float = parameter(1.0, unit="m", doc="Where it is.")
    b: Point = connector(Point, "What touches it.")

    def depth(self) -> Scalar:
        """Return how far it is pressed in."""
        return self.b.position.x - self.place

    @potential(modes=("touching",))
    def pressed(self) -> Scalar:
        """Return the energy of the wall."""
        return 0.5 * self.stiffness * self.depth() * self.depth() + self.preload * self.depth() + self.store

    @dissipation(modes=["touching"])
    def damped(self) -> Scalar:
        """Return half the power that is lost."""
        return 0.5 * self.damping * self.b.velocity.x * self.b.velocity.x

    @event(modes=("apart",), direction=1, unit="m", target="touching", message="it touches")
    def touches(self) -> Scalar:
        """Return the depth."""
        return self.depth()

    @event(modes=("touching",), direction=-1, unit="m", target="apart", message="it lets go")
    def lets_go(self) -> Scalar:
        """Return the depth."""
        return self.depth()
