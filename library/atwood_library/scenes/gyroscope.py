"""gyroscope: a rotor in two gimbals."""

from __future__ import annotations

from atwood import Number, Scene, Triple, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class Gyroscope(Scene):
    """A rotor in an inner and an outer gimbal: three angles, each about the axis of its own bearing.

    The rotor's axis is along z when the gimbals are square to each other, at the inner angle zero. Where the inner
    gimbal has turned by a quarter turn, the axes of rotor and outer gimbal are parallel (gimbal lock); the gimbals'
    own inertia carries the motion through. A weight on the inner gimbal makes it precess.
    """

    rotor_moments: Triple = parameter(
        (0.002, 0.002, 0.004), unit="kg*m^2", size=3, doc="Moments of inertia of the rotor; the last is about its axis."
    )
    gimbal_moments: Triple = parameter(
        (0.0006, 0.0006, 0.0009), unit="kg*m^2", size=3, doc="Moments of inertia of each gimbal."
    )
    weight: Number = parameter(0.05, unit="kg", above=0.0, doc="Mass of the inner gimbal with its weight.")
    offset: Number = parameter(0.02, unit="m", doc="Distance of the weight from the centre, along the rotor's axis.")
    spin: Number = parameter(100.0, unit="rad/s", doc="Angular velocity of the rotor.")
    inclination: Number = parameter(1.0, unit="rad", doc="Angle of the inner gimbal at the start.")
    space = "space"
    t_end = 3.0

    ground: Ground = Ground()
    outer_bearing: Pivot = Pivot(axis=(0.0, 0.0, 1.0))
    outer: RigidBody = RigidBody(mass=0.1, moments=gimbal_moments)
    inner_bearing: Pivot = Pivot(axis=(1.0, 0.0, 0.0))
    inner: RigidBody = RigidBody(mass=weight, moments=gimbal_moments)
    rotor_bearing: Pivot = Pivot(axis=(0.0, 0.0, 1.0))
    rotor: RigidBody = RigidBody(mass=0.2, moments=rotor_moments)
    connections = [
        connect(ground.frame, outer_bearing.a),
        connect(outer_bearing.b, outer.frame),
        connect(outer.frame, inner_bearing.a),
        connect(inner_bearing.b, inner.frame),
        connect(inner.frame, rotor_bearing.a),
        connect(rotor_bearing.b, rotor.frame),
    ]
    start = {
        "outer_bearing.angle": 0.0,
        "inner_bearing.angle": inclination,
        "rotor_bearing.angle": 0.0,
        "outer_bearing.angular_velocity": 0.0,
        "inner_bearing.angular_velocity": 0.0,
        "rotor_bearing.angular_velocity": spin,
    }

    def build(self) -> None:
        """Hang the weight on the inner gimbal."""
        self.inner.center = (0.0, 0.0, self.offset)
