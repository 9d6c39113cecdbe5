"""BallContact: a ball, or a disc, that cannot pass a plane, and that friction makes roll."""

from __future__ import annotations

from typing import ClassVar

from atwood import Frame, Number, Scalar, Vector, connector, cross, dot, parameter
from atwood_library.interfaces.on_plane import OnPlane

__all__ = ["BallContact"]


class BallContact(OnPlane):
    """A ball, or in a plane a disc, that cannot pass a plane; friction acts on its spin, until it rolls."""

    synonyms: ClassVar[tuple[str, ...]] = ("Billiard ball", "Ball on table", "Bouncing ball", "Slipping wheel")

    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Radius.")
    ball: Frame = connector(Frame, "The frame of the ball, at its centre.")

    def apart(self) -> Scalar:
        """Return the distance of ball and plane."""
        return dot(self.ball.position - self.plane.position, self.normal_in_world()) - self.radius

    def material_slip(self) -> Vector:
        """Return the velocity of the ball's material at the contact past the surface."""
        arm = self.normal_in_world() * -self.radius
        of_ball = self.ball.velocity + cross(self.ball.angular_velocity, arm)
        return of_ball - self.surface_at(self.ball.position + arm)
