"""double-cardan-twice: two double Cardan shafts one after the other."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.universal import Universal
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class DoubleCardanTwice(Scene):
    """Three parallel shafts in bearings, joined by two slanting ones with a universal joint at each end.

    The forks of a slanting shaft are in one plane, so that its unevenness at one end is undone at the other: the last
    shaft turns exactly as the first (Dubbel, Taschenbuch fuer den Maschinenbau). By counting nothing could move; each
    slanting shaft has one constraint that follows from the others, which the report names.
    """

    bend: Number = parameter(math.radians(25.0), unit="rad", doc="Angle of the slanting shafts.")
    length: Number = parameter(0.6, unit="m", above=0.0, doc="Length of each shaft.")
    moment: Number = parameter(0.01, unit="kg*m^2", above=0.0, doc="Moment of inertia of each shaft about its axis.")
    rate: Number = parameter(10.0, unit="rad/s", doc="Rate of the first shaft at the start.")
    space = "space"
    gravity = 0.0
    t_end = 1.0

    ground1: Ground = Ground()
    bearing1: Pivot = Pivot(axis=(1.0, 0.0, 0.0))
    shaft1: RigidBody = RigidBody(mass=1.0)
    cross1: Universal = Universal(axis_a=(0.0, 1.0, 0.0), axis_b=(0.0, 0.0, 1.0))
    slant1: RigidBody = RigidBody(mass=1.0)
    end1: Weld = Weld()
    cross2: Universal = Universal(axis_a=(0.0, 0.0, 1.0), axis_b=(0.0, 1.0, 0.0))
    shaft2: RigidBody = RigidBody(mass=1.0)
    bearing2: Pivot = Pivot(axis=(1.0, 0.0, 0.0))
    ground2: Ground = Ground()
    end2: Weld = Weld()
    cross3: Universal = Universal(axis_a=(0.0, 1.0, 0.0), axis_b=(0.0, 0.0, 1.0))
    slant2: RigidBody = RigidBody(mass=1.0)
    end3: Weld = Weld()
    cross4: Universal = Universal(axis_a=(0.0, 0.0, 1.0), axis_b=(0.0, 1.0, 0.0))
    shaft3: RigidBody = RigidBody(mass=1.0)
    bearing3: Pivot = Pivot(axis=(1.0, 0.0, 0.0))
    ground3: Ground = Ground()
    connections = [
        connect(ground1.frame, bearing1.a),
        connect(bearing1.b, shaft1.frame),
        connect(shaft1.frame, cross1.a),
        connect(cross1.b, slant1.frame),
        connect(slant1.frame, end1.a),
        connect(end1.b, cross2.a),
        connect(cross2.b, shaft2.frame),
        connect(ground2.frame, bearing2.a),
        connect(bearing2.b, shaft2.frame),
        connect(shaft2.frame, end2.a),
        connect(end2.b, cross3.a),
        connect(cross3.b, slant2.frame),
        connect(slant2.frame, end3.a),
        connect(end3.b, cross4.a),
        connect(cross4.b, shaft3.frame),
        connect(ground3.frame, bearing3.a),
        connect(bearing3.b, shaft3.frame),
    ]
    start = {"bearing1.angle": 0.0, "bearing1.angular_velocity": rate}
    guess = {"bearing2.angle": 0.0, "bearing3.angle": 0.0}

    def build(self) -> None:
        """Put the bearings where the slanting shafts end."""
        along, up = self.length * math.cos(self.bend), self.length * math.sin(self.bend)
        self.set("ground2.position", (along, 0.0, up))
        self.set("ground3.position", (2.0 * along + self.length, 0.0, 0.0))
        for name in ("end1", "end2", "end3"):
            self.set(f"{name}.displacement", (self.length, 0.0, 0.0))
        for name in ("shaft1", "slant1", "shaft2", "slant2", "shaft3"):
            self.set(f"{name}.moments", (self.moment, 0.6 * self.moment, 0.6 * self.moment))
        self.guess.update({"cross1.angle_a": -self.bend, "cross2.angle_b": self.bend})
        self.guess.update({"cross3.angle_a": self.bend, "cross4.angle_b": -self.bend})
