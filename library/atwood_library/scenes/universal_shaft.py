"""universal-shaft: two shafts at an angle, joined by a universal joint."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.universal import Universal
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class UniversalShaft(Scene):
    """A driving shaft along x and a driven shaft bent away from it in the x-z plane, each in its own bearing.

    The driven shaft turns unevenly: with the bend b it is between ``cos b`` and ``1 / cos b`` times as fast as the
    driving one, twice in each turn. The bearings carry the couple that bends the cross.
    """

    bend: Number = parameter(math.radians(30.0), unit="rad", doc="Angle between the shafts.")
    driving_moment: Number = parameter(0.01, unit="kg*m^2", above=0.0, doc="Moment of inertia of the driving shaft.")
    driven_moment: Number = parameter(0.02, unit="kg*m^2", above=0.0, doc="Moment of inertia of the driven shaft.")
    rate: Number = parameter(10.0, unit="rad/s", doc="Rate of the driving shaft at the start.")
    space = "space"
    gravity = 0.0
    t_end = 2.0

    ground: Ground = Ground()
    bearing1: Pivot = Pivot(axis=(1.0, 0.0, 0.0))
    shaft1: RigidBody = RigidBody(mass=1.0)
    cross: Universal = Universal(axis_a=(0.0, 1.0, 0.0), axis_b=(0.0, 0.0, 1.0))
    shaft2: RigidBody = RigidBody(mass=1.0)
    bearing2: Pivot = Pivot(axis=(1.0, 0.0, 0.0))
    mount: Ground = Ground()
    connections = [
        connect(ground.frame, bearing1.a),
        connect(bearing1.b, shaft1.frame),
        connect(shaft1.frame, cross.a),
        connect(cross.b, shaft2.frame),
        connect(shaft2.frame, bearing2.b),
        connect(bearing2.a, mount.frame),
    ]
    start = {"bearing1.angle": 0.0, "bearing1.angular_velocity": rate}

    def build(self) -> None:
        """Bend the second bearing and give the shafts their inertia."""
        self.mount.angle = self.bend
        for shaft, moment in ((self.shaft1, self.driving_moment), (self.shaft2, self.driven_moment)):
            shaft.moments = (moment, 0.6 * moment, 0.6 * moment)
        self.guess["cross.angle_a"] = -self.bend
