"""trebuchet: a beam with a counterweight throws a stone from a sling that lets go."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.link import Link
from atwood_library.parts.point_mass import PointMass
from atwood_library.ropes.rope import Rope
from atwood_library.sensors.angle_sensor import AngleSensor


class Trebuchet(Scene):
    """A heavy weight falls on the short arm of a beam, whose long arm throws a stone from a sling.

    The sling is a rope that lets go of the stone when the beam has turned to a given angle. Energy is kept, and from
    there the stone flies along a parabola. The beam's angle is zero where the long arm points to the right.
    """

    short_arm: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the arm with the weight.")
    long_arm: Number = parameter(4.0, unit="m", above=0.0, doc="Length of the arm with the sling.")
    sling: Number = parameter(3.5, unit="m", above=0.0, doc="Length of the sling.")
    height: Number = parameter(3.0, unit="m", above=0.0, doc="Height of the axle above the ground.")
    weight: Number = parameter(1000.0, unit="kg", above=0.0, doc="Mass of the counterweight.")
    stone: Number = parameter(10.0, unit="kg", above=0.0, doc="Mass of the stone.")
    beam: Number = parameter(50.0, unit="kg", minimum=0.0, doc="Mass of the beam.")
    start_angle: Number = parameter(math.radians(-45.0), unit="rad", doc="Angle of the beam at the start.")
    sling_angle: Number = parameter(
        math.radians(-70.0), unit="rad", doc="Angle of the sling from straight down at the start; negative inwards."
    )
    release: Number = parameter(math.radians(80.0), unit="rad", doc="Angle of the beam at which the sling lets go.")
    t_end = 3.0

    ground: Ground = Ground()
    axle: Pivot = Pivot()
    arm: Link = Link(length=long_arm, mass=beam * long_arm / (short_arm + long_arm))
    tail: Link = Link(length=short_arm, mass=beam * short_arm / (short_arm + long_arm))
    load: PointMass = PointMass(mass=weight)
    rope: Rope = Rope(length=sling, when_slack="slack")
    ball: PointMass = PointMass(mass=stone)
    mark: Weld = Weld(angle=release)
    trigger: AngleSensor = AngleSensor(axis=(0.0, 1.0, 0.0))
    connections = [
        connect(ground.frame, axle.a),
        connect(axle.b, arm.a),
        connect(tail.b, axle.b),
        connect(tail.a, load.point),
        connect(arm.b, rope.a),
        connect(rope.b, ball.point),
        connect(ground.frame, mark.a),
        connect(mark.b, trigger.a),
        connect(trigger.b, arm.a),
        connect(trigger.output("angle"), rope.input("release")),
    ]
    start = {"axle.angle": start_angle, "axle.angular_velocity": 0.0, "ball.velocity.x": 0.0}

    def build(self) -> None:
        """Lay the stone into the sling."""
        self.set("ground.position", (0.0, 0.0, self.height))
        x = self.long_arm * math.cos(self.start_angle) + self.sling * math.sin(self.sling_angle)
        z = self.height + self.long_arm * math.sin(self.start_angle) - self.sling * math.cos(self.sling_angle)
        self.start["ball.position.x"] = x
        self.guess["ball.position.z"], self.guess["ball.velocity.z"] = z, 0.0

    def flight(self, x: float, z: float, vx: float, vz: float) -> float:
        """Return how far from the axle a stone lands that is let go at a place with a velocity, m."""
        g = self.gravity
        return x + vx * (vz + math.sqrt(vz * vz + 2.0 * g * z)) / g
