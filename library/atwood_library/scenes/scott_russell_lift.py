"""scott-russell-lift: a linkage that goes straight up, with a load that swings below it."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.point_on_line import PointOnLine
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.link import Link
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod


class ScottRussellLift(Scene):
    """The Scott Russell linkage: a beam with its foot on the floor and its middle on a crank half as long.

    Its top moves exactly on the vertical through the crank's axle, up to twice the crank's length. A load hangs from it
    on a rope, and swings: two degrees of freedom. The foot is pushed in by an actuator.
    """

    crank: Number = parameter(0.5, unit="m", above=0.0, doc="Length of the crank, half that of the beam.")
    beam_mass: Number = parameter(4.0, unit="kg", above=0.0, doc="Mass of the beam.")
    crank_mass: Number = parameter(1.5, unit="kg", above=0.0, doc="Mass of the crank.")
    load_mass: Number = parameter(10.0, unit="kg", above=0.0, doc="Mass of the load.")
    rope_length: Number = parameter(0.3, unit="m", above=0.0, doc="Length of the rope of the load.")
    push: Number = parameter(-150.0, unit="N", doc="Force of the actuator on the foot, outwards.")
    angle: Number = parameter(math.radians(35.0), unit="rad", doc="Angle of the crank above the floor at the start.")
    sway: Number = parameter(0.2, unit="rad", doc="Angle of the rope from the vertical at the start.")
    t_end = 0.4

    floor: Ground = Ground()
    axle: Pivot = Pivot()
    arm: Link = Link(length=crank, mass=crank_mass)
    track: PointOnLine = PointOnLine(actuator=push)
    beam: Link = Link(length=2.0 * crank, mass=beam_mass)
    middle: Weld = Weld()
    hinge: Pivot = Pivot()
    rope: Rod = Rod(length=rope_length)
    load: PointMass = PointMass(mass=load_mass)
    connections = [
        connect(floor.frame, axle.a),
        connect(axle.b, arm.a),
        connect(floor.frame, track.a),
        connect(track.b, beam.a),
        connect(beam.a, middle.a),
        connect(middle.b, hinge.a),
        connect(hinge.b, arm.b),
        connect(beam.b, rope.a),
        connect(rope.b, load.point),
    ]
    start = {"arm.angle": angle, "arm.angular_velocity": 0.0, "rope.angle": sway, "rope.angular_velocity": 0.0}

    def build(self) -> None:
        """Hold the beam by its middle; its foot is outwards, its top above the axle."""
        self.set("middle.displacement", (self.crank, 0.0, 0.0))
        self.guess["beam.angle"] = math.pi - self.angle
        self.guess["track.displacement"] = 2.0 * self.crank * math.cos(self.angle)
