"""driven-pendulum: a pendulum whose pivot moves as prescribed."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.drive import Drive
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod
from atwood_library.sources.sine import Sine


class DrivenPendulum(Scene):
    """A pendulum whose pivot is moved to and fro, horizontally and harmonically."""

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the rod.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the bob.")
    amplitude: Number = parameter(0.1, unit="m", doc="Amplitude of the pivot's motion.")
    angular_frequency: Number = parameter(2.5, unit="rad/s", doc="Angular frequency of the pivot's motion.")
    t_end = 5.0

    ground: Ground = Ground()
    motion: Sine = Sine(amplitude=amplitude, angular_frequency=angular_frequency)
    drive: Drive = Drive(axis=(1.0, 0.0, 0.0))
    rod: Rod = Rod(length=length)
    bob: PointMass = PointMass(mass=mass)
    connections = [
        connect(ground.frame, drive.a),
        connect(motion.output("value"), drive.input("motion")),
        connect(drive.b, rod.a),
        connect(rod.b, bob.point),
    ]
    start = {"rod.angle": 0.5, "rod.angular_velocity": 0.0}
