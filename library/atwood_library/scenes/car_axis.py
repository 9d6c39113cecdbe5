"""car-axis: half a car's axis on a bumpy road."""

from __future__ import annotations

from atwood import Number, Scene, asin, connect, parameter, sin
from atwood_library.forces.spring import Spring
from atwood_library.joints.point_on_line import PointOnLine
from atwood_library.joints.rotary_drive import RotaryDrive
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod


class CarAxis(Scene):
    """Two wheels' hubs joined by a rod ride on springs above an axis whose one end goes up and down.

    The left spring stands square to the axis (Test Set for Initial Value Problem Solvers, problem `caraxis`; Schneider,
    1999). Two degrees of freedom, driven.
    """

    mass: Number = parameter(5e-4, unit="kg", above=0.0, doc="Mass of each hub.")
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the axis, and of the rod.")
    spring_length: Number = parameter(0.5, unit="m", above=0.0, doc="Length of the springs without force.")
    stiffness: Number = parameter(1.0, unit="N/m", minimum=0.0, doc="Stiffness of the springs.")
    height: Number = parameter(0.1, unit="m", doc="By how much the right end goes up and down.")
    rate: Number = parameter(10.0, unit="rad/s", doc="How fast the road comes up and down.")
    gravity = 1.0
    t_end = 3.0

    road: Ground = Ground()
    axis: RotaryDrive = RotaryDrive()
    far: Weld = Weld()
    guide: PointOnLine = PointOnLine(axis=(0.0, 0.0, 1.0))
    left: PointMass = PointMass(mass=mass)
    right: PointMass = PointMass(mass=mass)
    rod: Rod = Rod(length=length)
    left_spring: Spring = Spring(stiffness=stiffness, natural_length=spring_length)
    right_spring: Spring = Spring(stiffness=stiffness, natural_length=spring_length)
    connections = [
        connect(road.frame, axis.a),
        connect(axis.b, far.a),
        connect(axis.b, guide.a),
        connect(guide.b, left.point),
        connect(rod.a, left.point),
        connect(rod.b, right.point),
        connect(left_spring.a, road.frame),
        connect(left_spring.b, left.point),
        connect(right_spring.a, far.b),
        connect(right_spring.b, right.point),
    ]

    def build(self) -> None:
        """Drive the axis, and start with the springs at their length."""
        self.set("axis.rotation", lambda t, *, height, length, rate: asin(height / length * sin(rate * t)))
        self.set("far.displacement", (self.length, 0.0, 0.0))
        self.start.update({"guide.displacement": self.spring_length, "guide.speed": 0.0})
        self.start.update({"right.position.z": self.spring_length, "right.velocity.z": 0.0})
        self.guess["right.position.x"] = self.length
