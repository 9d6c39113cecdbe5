"""furuta-pendulum: a pendulum at the end of an arm that turns about the vertical."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.parts.ground import Ground
from atwood_library.parts.link import Link
from atwood_library.parts.rigid_body import RigidBody


class FurutaPendulum(Scene):
    """A pendulum at the end of an arm that turns about the vertical; both are slender bars (Furuta's pendulum).

    The arm's hinge can carry a motor, `motor.motor`; the pendulum swings across the arm.
    """

    arm_length: Number = parameter(0.3, unit="m", above=0.0, doc="Length of the arm.")
    arm_mass: Number = parameter(0.2, unit="kg", above=0.0, doc="Mass of the arm.")
    pendulum_length: Number = parameter(0.4, unit="m", above=0.0, doc="Length of the pendulum.")
    pendulum_mass: Number = parameter(0.1, unit="kg", above=0.0, doc="Mass of the pendulum.")
    space = "space"
    t_end = 5.0

    ground: Ground = Ground()
    motor: Pivot = Pivot(axis=(0.0, 0.0, 1.0))
    arm: Link = Link(length=arm_length, mass=arm_mass)
    hinge: Pivot = Pivot(axis=(1.0, 0.0, 0.0))
    pendulum: RigidBody = RigidBody(mass=pendulum_mass)
    connections = [
        connect(ground.frame, motor.a),
        connect(motor.b, arm.a),
        connect(arm.b, hinge.a),
        connect(hinge.b, pendulum.frame),
    ]
    start = {"motor.angle": 0.0, "motor.angular_velocity": 2.0, "hinge.angle": 1.0, "hinge.angular_velocity": 0.0}

    def build(self) -> None:
        """Let the pendulum hang from the hinge: a slender bar down its own z axis."""
        self.pendulum.center = (0.0, 0.0, -0.5 * self.pendulum_length)
        across = self.pendulum_mass * self.pendulum_length**2 / 12.0
        self.pendulum.moments = (across, across, 0.0)
