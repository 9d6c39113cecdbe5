"""bouncing-ball: a ball that bounces until it rests."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.contacts.point_contact import PointContact
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass


class BouncingBall(Scene):
    """A ball is dropped, and each bounce leaves a share of its speed: infinitely many take a finite time.

    With the height h and restitution e it rests after ``sqrt(2 h/g) (1 + e)/(1 - e)``.
    """

    height: Number = parameter(1.0, unit="m", above=0.0, doc="Height at the start.")
    restitution: Number = parameter(0.9, minimum=0.0, maximum=1.0, doc="Share of the speed that a bounce leaves.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the ball.")
    t_end = 10.0

    ground: Ground = Ground()
    ball: PointMass = PointMass(mass=mass)
    floor: PointContact = PointContact(restitution=restitution)
    connections = [connect(ground.frame, floor.plane), connect(ball.point, floor.point)]
    start = {"ball.position.x": 0.0, "ball.position.z": height, "ball.velocity.x": 0.0, "ball.velocity.z": 0.0}
