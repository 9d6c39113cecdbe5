"""RoughPulley: a rope over a pulley, a drum or a post that it rubs on, and that may hold it."""

from __future__ import annotations

import math
from typing import ClassVar

from atwood import (
    Component,
    Groove,
    Number,
    Point,
    Scalar,
    Shaft,
    connector,
    dry_friction,
    event,
    minimum,
    observable,
    parameter,
    tanh,
    unilateral,
)
from atwood_library.interfaces.bounds import check_static_friction
from atwood_library.interfaces.spans import rate_of_span

__all__ = ["RoughPulley"]


class RoughPulley(Component):
    """A massless, inextensible rope from a to b over a small pulley on which it rubs: a capstan, a bollard, a belt.

    Where it slips the tensions are as ``exp(friction wrap)``, the larger one ahead; where it sticks they are anything
    between (Euler 1769; Eytelwein 1808; Goldstein, Poole and Safko do not have it, but see L. Meriam and L. Kraige,
    *Statics*, section 6/8). The rope only pulls: it goes slack, and comes taut again with a jerk. The pulley is fixed
    to what its groove is on, or turns with a shaft, a turn of which takes the rope from a to b.
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Capstan", "Bollard", "Belt friction", "Euler-Eytelwein", "Winch that slips")
    spaces: ClassVar[tuple[str, ...]] = ("line", "plane", "space")

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the rope from a to b.")
    friction: Number = parameter(0.2, minimum=0.0, doc="Coefficient of friction while the rope slips.")
    static_friction: Number = parameter(
        None, minimum=0.0, doc="Coefficient of friction while it sticks; that of slipping if not given."
    )
    wrap: Number = parameter(
        math.pi, unit="rad", above=0.0, doc="Angle along which the rope lies on the pulley, all turns together."
    )
    turns: str = parameter("fixed", choices=("fixed", "shaft"), doc="Whether the pulley turns with a shaft.")
    radius: Number = parameter(
        0.1, unit="m", doc="Radius of a pulley that turns; negative where a turn takes the rope from b to a."
    )
    a: Point = connector(Point, "One end of the rope.")
    over: Groove = connector(Groove, "The pulley.")
    b: Point = connector(Point, "The other end of the rope.")
    shaft: Shaft = connector(Shaft, "The angle of the pulley.", when={"turns": ("shaft",)})

    def check_values(self) -> None:
        """Refuse static friction below that of slipping."""
        check_static_friction(self.static_friction, self.friction, self.path)

    @unilateral(reaction="tension", unit="N", doc="Mean of the tensions at both ends.")
    def slack(self) -> Scalar:
        """Length of the rope less that of its straight pieces."""
        return self.length - self.distance(self.a, self.over, side=None) - self.distance(self.over, self.b, side=None)

    @dry_friction(
        at="slack",
        reaction="friction_force",
        unit="N",
        limit="largest",
        static_limit="largest_static",
        doc="Force of the pulley on the rope, from a towards b.",
    )
    def slip(self) -> Scalar:
        """Speed of the rope past the pulley, from a towards b."""
        to_a, to_b = rate_of_span(self, self.a, self.over), rate_of_span(self, self.over, self.b)
        rope = 0.5 * (to_b - to_a)
        return rope if self.turns == "fixed" else rope - self.radius * self.shaft.rate

    @event(direction=-1, unit="m", target="stop", message="an end of the rope has reached the pulley")
    def reaches_pulley(self) -> Scalar:
        """Return the shorter of both straight pieces, less what is as good as nothing."""
        to_a, to_b = (self.distance(p, q, side=None) for p, q in ((self.a, self.over), (self.over, self.b)))
        return minimum(to_a, to_b) - 1e-6 * self.length

    def share(self, friction: Scalar) -> Scalar:
        """Return the difference of the tensions over their mean where one is ``exp(friction wrap)`` of the other."""
        return 2.0 * tanh(0.5 * friction * self.wrap)

    def largest(self) -> Scalar:
        """Return the largest friction while the rope slips."""
        return self.share(self.friction) * self.reaction("tension")

    def largest_static(self) -> Scalar:
        """Return the largest friction while the rope sticks."""
        return self.share(self.friction if self.static_friction is None else self.static_friction) * self.reaction(
            "tension"
        )

    @observable(unit="N", doc="Tension at a.")
    def tension_a(self) -> Scalar:
        """Return the tension."""
        return self.reaction("tension") + 0.5 * self.reaction("friction_force")

    @observable(unit="N", doc="Tension at b.")
    def tension_b(self) -> Scalar:
        """Return the tension."""
        return self.reaction("tension") - 0.5 * self.reaction("friction_force")
