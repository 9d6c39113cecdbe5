"""CompliantContact: an elastic ball on an elastic plane, with smooth laws of force and friction."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from atwood import (
    Component,
    Frame,
    Load,
    Number,
    ParameterError,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    cross,
    dot,
    force,
    maximum,
    observable,
    parameter,
    sqrt,
)

__all__ = ["CompliantContact"]

_FLAT = 1e-16
"""In radii: where what is pressed in is less, the root of it has no slope."""


class CompliantContact(Component):
    """A ball that presses into a plane, with forces that are smooth: for what is soft, and where that is asked for.

    Hertz's force ``4/3 E sqrt(R) d^(3/2)`` of the depth d (Landau and Lifshitz, *Theory of Elasticity*, section 9),
    times ``1 + k d'`` for what is lost. With the restitution e at the speed of impact v, k is ``3 (1 - e)/(2 v)`` by K.
    Hunt and F. Crossley (J. Applied Mechanics 42, 1975), which holds for e near 1, and ``8 (1 - e)/(5 e v)`` by P.
    Flores, M. Machado, M. Silva and J. Martins (Multibody System Dynamics 25, 2011) for all e. Friction is
    ``mu N u/sqrt(u^2 + w^2)`` against the slip u: below the speed w it creeps. Rigid bodies with dry friction that
    sticks have `BallContact`.
    """

    synonyms: ClassVar[tuple[str, ...]] = (
        *("Hertz contact", "Hunt-Crossley", "Flores", "Penalty contact", "Elastic contact"),
        *("Regularised friction", "Soft contact", "ElastoGap in space"),
    )
    spaces: ClassVar[tuple[str, ...]] = ("plane", "space")

    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Radius of the ball.")
    modulus: Number = parameter(
        1e6, unit="Pa", above=0.0, doc="Effective modulus: 1/E is the sum of (1 - nu^2)/E of both.", symbol="E"
    )
    law: str = parameter("hunt-crossley", choices=("hunt-crossley", "flores"), doc="How much an impact loses.")
    restitution: Number = parameter(1.0, minimum=0.0, maximum=1.0, doc="Share of the speed that an impact leaves.")
    impact_speed: Number = parameter(1.0, unit="m/s", above=0.0, doc="Speed of the impact that the restitution is of.")
    friction: Number = parameter(0.0, minimum=0.0, doc="Coefficient of friction.")
    creep_speed: Number = parameter(1e-3, unit="m/s", above=0.0, doc="Slip below which friction fades.")
    normal: Triple = parameter(
        (0.0, 0.0, 1.0), direction=True, doc="Normal of the plane in its frame, towards the ball."
    )
    plane: Frame = connector(Frame, "The frame that carries the plane; its origin is in it.")
    ball: Frame = connector(Frame, "The frame of the ball, at its centre.")

    def check_values(self) -> None:
        """Refuse what the law of Flores would lose without bound."""
        if self.law == "flores" and self.restitution == 0.0:
            raise ParameterError(
                "with this law no finite force leaves nothing",
                where=f"{self.path}.restitution",
                advice="Give a restitution above zero, or law='hunt-crossley'.",
            )

    def normal_in_world(self) -> Vector:
        """Return the normal of the plane in world axes."""
        return self.plane.to_world(as_vector(self.normal))

    def loss(self) -> Scalar:
        """Return k of the law, s/m."""
        lost = 1.0 - self.restitution
        if self.law == "flores":
            return 8.0 * lost / (5.0 * self.restitution * self.impact_speed)
        return 1.5 * lost / self.impact_speed

    def slip(self) -> Vector:
        """Return the velocity of the ball's material at the contact past the plane's, in world axes."""
        arm = self.normal_in_world() * -self.radius
        place = self.ball.position + arm - self.plane.position
        of_plane = self.plane.velocity + cross(self.plane.angular_velocity, place)
        return self.ball.velocity + cross(self.ball.angular_velocity, arm) - of_plane

    @observable(unit="m", doc="How deep the ball is pressed in.")
    def depth(self) -> Scalar:
        """Return the depth."""
        return maximum(self.radius - dot(self.ball.position - self.plane.position, self.normal_in_world()), 0.0)

    @observable(unit="N", doc="Force along the normal; it only pushes.")
    def normal_force(self) -> Scalar:
        """Return the force."""
        depth, speed = self.depth(), -dot(self.slip(), self.normal_in_world())
        elastic = 4.0 / 3.0 * self.modulus * sqrt(self.radius) * depth * sqrt(maximum(depth, _FLAT * self.radius))
        return elastic * maximum(1.0 + self.loss() * speed, 0.0)

    @observable(unit="N", doc="Force of the contact on the ball, in world axes.")
    def push(self) -> Vector:
        """Return the normal force and friction."""
        n, pressure, slip = self.normal_in_world(), self.normal_force(), self.slip()
        along = slip - n * dot(slip, n)
        speed = sqrt(dot(along, along) + self.creep_speed * self.creep_speed)
        total: Vector = n * pressure - along * (self.friction * pressure / speed)
        return total

    @force
    def press(self) -> Iterable[Load]:
        """Return the force on both, at the place where they touch."""
        push, arm = self.push(), self.normal_in_world() * -self.radius
        place = self.ball.position + arm - self.plane.position
        yield Load(self.ball, force=push, torque=cross(arm, push))
        yield Load(self.plane, force=-push, torque=cross(place, -push))
