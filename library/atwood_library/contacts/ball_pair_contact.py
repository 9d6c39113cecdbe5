"""BallPairContact: two balls, or discs, that touch from outside, or of which one is in the other."""

from __future__ import annotations

from typing import ClassVar

from atwood import Frame, Number, ParameterError, Scalar, Vector, connector, cross, dot, norm, parameter
from atwood_library.interfaces.touching import Touching, across

__all__ = ["BallPairContact"]


class BallPairContact(Touching):
    """Two balls, in a plane two discs, that cannot pass each other; friction acts on their spins.

    Outside of each other they are billiard balls or the discs of a friction drive, inside a ball in a shell, a roller
    in its race, or a pin with clearance in its hole. Forces are those on b.
    """

    synonyms: ClassVar[tuple[str, ...]] = ("Billiard balls", "Joint with clearance", "Ball in shell", "Friction wheels")

    radius_a: Number = parameter(0.1, unit="m", minimum=0.0, doc="Radius of ball a, or of the hole in it.")
    radius_b: Number = parameter(0.1, unit="m", minimum=0.0, doc="Radius of ball b.")
    touches: str = parameter("outside", choices=("outside", "inside"), doc="From where ball b touches ball a.")
    a: Frame = connector(Frame, "The frame of ball a, at its centre.")
    b: Frame = connector(Frame, "The frame of ball b, at its centre.")

    def check_values(self) -> None:
        """Refuse balls of no size, what does not fit into the other, and what Touching refuses."""
        super().check_values()
        if self.touches == "inside" and not self.radius_b < self.radius_a:
            raise ParameterError(
                f"a ball of {self.radius_b:g} m has no room in a hole of {self.radius_a:g} m",
                where=f"{self.path}.radius_b",
                advice="Give a ball inside a smaller radius.",
            )
        if self.radius_a + self.radius_b <= 0.0:
            raise ParameterError("both are points", where=self.path, advice="Give at least one of them a radius.")

    def between(self) -> Vector:
        """Return the way from centre to centre."""
        between: Vector = self.b.position - self.a.position
        return between

    def outwards(self) -> float:
        """Return +1 where b is outside."""
        return 1.0 if self.touches == "outside" else -1.0

    def normal_in_world(self) -> Vector:
        """Return the normal towards b, or towards the middle of the hole that b is in; there it has no length."""
        between = self.between()
        # Where they touch, the distance in a hole is the room; a pin may be in the middle, where there is no direction.
        far = norm(between) if self.touches == "outside" else self.radius_a - self.radius_b
        normal: Vector = between * (self.outwards() / far)
        return normal

    def directions_in_world(self) -> tuple[Vector, Vector]:
        """Return two directions across the normal, in world axes."""
        n = self.normal_in_world()
        return across(n) if self.in_space else (Vector(n.z, 0.0, -n.x), Vector(0.0, 1.0, 0.0))

    def apart(self) -> Scalar:
        """Return the distance of the balls."""
        between = self.between()
        if self.touches == "outside":
            return norm(between) - (self.radius_a + self.radius_b)
        room = self.radius_a - self.radius_b  # the root of a square has no slope where both are in one place
        return 0.5 * (room - dot(between, between) / room)

    def material_slip(self) -> Vector:
        """Return the velocity of the material of b at the contact past that of a."""
        n = self.normal_in_world()
        of_b = self.b.velocity + cross(self.b.angular_velocity, n * -self.radius_b)
        return of_b - self.a.velocity - cross(self.a.angular_velocity, n * (self.outwards() * self.radius_a))
