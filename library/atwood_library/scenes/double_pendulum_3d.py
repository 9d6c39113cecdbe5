"""double-pendulum-3d: two solid rods, hung on universal joints."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.universal import Universal
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class DoublePendulum3D(Scene):
    """Two equal solid rods that hang on universal joints: four degrees of freedom."""

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of each rod.")
    radius: Number = parameter(0.05, unit="m", above=0.0, doc="Radius of each rod.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of each rod.")
    space = "space"
    t_end = 5.0

    ground: Ground = Ground()
    joint1: Universal = Universal()
    rod1: RigidBody = RigidBody(mass=mass)
    end1: Weld = Weld()
    joint2: Universal = Universal()
    rod2: RigidBody = RigidBody(mass=mass)
    connections = [
        connect(ground.frame, joint1.a),
        connect(joint1.b, rod1.frame),
        connect(rod1.frame, end1.a),
        connect(end1.b, joint2.a),
        connect(joint2.b, rod2.frame),
    ]
    start = {
        "joint1.angle_a": 0.5,
        "joint1.angle_b": 1.0,
        "joint2.angle_a": -0.3,
        "joint2.angle_b": 0.4,
        "joint1.rate_a": 0.0,
        "joint1.rate_b": 1.0,
        "joint2.rate_a": 2.0,
        "joint2.rate_b": 0.0,
    }

    def build(self) -> None:
        """Give the rods the inertia of solid cylinders."""
        across = self.mass * (3.0 * self.radius**2 + self.length**2) / 12.0
        along = 0.5 * self.mass * self.radius**2
        self.end1.displacement = (0.0, 0.0, -self.length)
        for rod in (self.rod1, self.rod2):
            rod.center = (0.0, 0.0, -0.5 * self.length)
            rod.moments = (across, across, along)
