"""foucault-pendulum: a pendulum whose support turns with the Earth."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.rotary_drive import RotaryDrive
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod
from atwood_library.sensors.frame_sensor import FrameSensor
from atwood_library.sources.ramp import Ramp


class FoucaultPendulum(Scene):
    """A long pendulum on a platform that turns about the vertical, as the ground does by the sine of the latitude.

    In the platform's axes, in which it is released at rest, its plane of swing turns against the platform at minus that
    rate (Landau and Lifshitz, Mechanics, section 39). The rest of the Earth's motion, its horizontal turning and its
    centrifugal force, is left out.
    """

    length: Number = parameter(67.0, unit="m", above=0.0, doc="Length of the wire; as in the Pantheon unless given.")
    mass: Number = parameter(28.0, unit="kg", above=0.0, doc="Mass of the bob.")
    amplitude: Number = parameter(3.0, unit="m", above=0.0, doc="Horizontal distance at which it is released.")
    rate: Number = parameter(
        5.490550562345950e-5, unit="rad/s", doc="Rate of the platform: of the Earth, times the sine of the latitude."
    )
    space = "space"
    t_end = 100.0

    ground: Ground = Ground()
    clock: Ramp = Ramp(slope=rate)
    turning: RotaryDrive = RotaryDrive(axis=(0.0, 0.0, 1.0))
    rod: Rod = Rod(length=length)
    bob: PointMass = PointMass(mass=mass)
    view: FrameSensor = FrameSensor()
    connections = [
        connect(clock.output("value"), turning.input("rotation")),
        connect(ground.frame, turning.a),
        connect(turning.b, rod.a),
        connect(rod.b, bob.point),
        connect(view.frame, turning.b),
        connect(view.point, bob.point),
    ]

    def build(self) -> None:
        """Let the bob go at rest as seen from the platform."""
        self.start["bob.position.x"], self.start["bob.position.y"] = self.amplitude, 0.0
        self.guess["bob.position.z"] = -((self.length**2 - self.amplitude**2) ** 0.5)
        self.start["bob.velocity.x"], self.start["bob.velocity.y"] = 0.0, self.rate * self.amplitude
