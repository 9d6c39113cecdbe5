"""newtons-cradle: five pendulums side by side, of which the first falls on the others."""

from __future__ import annotations

import math

from atwood import Number, Scene, parameter
from atwood_library.contacts.distance_contact import DistanceContact
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod


class NewtonsCradle(Scene):
    """Five balls on rods hang side by side, and the first falls on the others.

    One by one, each ball hands its speed on to the next, and the last swings out (``impacts="one_by_one"``). Together,
    as bodies that are rigid and touch, the first goes back and the others move on as one.
    """

    balls: int = parameter(5, minimum=2, integer=True, doc="Number of balls.")
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the rods.")
    radius: Number = parameter(0.05, unit="m", above=0.0, doc="Radius of the balls.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of each ball.")
    restitution: Number = parameter(1.0, minimum=0.0, maximum=1.0, doc="Share of the speed that an impact leaves.")
    release_angle: Number = parameter(-0.5, unit="rad", doc="Angle of the first rod at the start.")
    t_end = 1.5

    def build(self) -> None:
        """Hang them side by side, each touching the next."""
        for i in range(self.balls):
            hook = self.add(f"hook{i + 1}", Ground(position=(2.0 * i * self.radius, 0.0, 0.0)))
            rod = self.add(f"rod{i + 1}", Rod(length=self.length))
            ball = self.add(f"ball{i + 1}", PointMass(mass=self.mass))
            self.connect(hook.frame, rod.a)
            self.connect(rod.b, ball.point)
            self.start.update({f"rod{i + 1}.angle": 0.0 if i else self.release_angle})
            self.start.update({f"rod{i + 1}.angular_velocity": 0.0})
        for i in range(1, self.balls):
            touch = self.add(f"touch{i}", DistanceContact(lower=2.0 * self.radius, restitution=self.restitution))
            self.connect(self[f"ball{i}"].point, touch.a)
            self.connect(self[f"ball{i + 1}"].point, touch.b)

    def first_impact(self) -> float:
        """Return when the first ball meets the second one, s: a quarter of a swing of the pendulum."""
        from scipy.special import ellipk

        return float(math.sqrt(self.length / self.gravity) * ellipk(math.sin(0.5 * self.release_angle) ** 2))
