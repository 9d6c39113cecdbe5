"""benchmark-bicycle: two bodies, a steering hinge and two wheels that roll."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.rolling_disc import RollingDisc
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody

_BASE, _TRAIL, _TILT = 1.02, 0.08, math.pi / 10.0
_REAR, _FRONT = 0.3, 0.35
_STEERING = (-math.sin(_TILT), 0.0, math.cos(_TILT))
_HEIGHT = 0.9
_HEAD = (_BASE + _TRAIL - _HEIGHT * math.tan(_TILT), 0.0, _HEIGHT)
_AXLE = (0.0, 1.0, 0.0)


class BenchmarkBicycle(Scene):
    """A bicycle with its rider's trunk fixed to the rear frame, hands off the handlebar, on level ground.

    All figures are those of the benchmark (Meijaard, Papadopoulos, Ruina, Schwab, Proc. R. Soc. A 463, 2007, table 1);
    x points forward and z up, where the paper's z points down. It runs straight and is given a rate of lean. Between
    4.292 m/s (weave) and 6.024 m/s (capsize) it rights itself; `atwood.linearize` gives the eigenvalues of the paper's
    table 2.
    """

    speed: Number = parameter(4.6, unit="m/s", doc="Forward speed.")
    lean_rate: Number = parameter(0.1, unit="rad/s", doc="Rate at which it leans at the start.")
    space = "space"
    t_end = 5.0

    ground: Ground = Ground()
    frame: RigidBody = RigidBody(
        mass=85.0, center=(0.3, 0.0, 0.9 - _REAR), moments=(9.2, 11.0, 2.8), products=(0.0, -2.4, 0.0)
    )
    to_head: Weld = Weld(displacement=(_HEAD[0], 0.0, _HEAD[2] - _REAR))
    steer: Pivot = Pivot(axis=_STEERING)
    fork: RigidBody = RigidBody(
        mass=4.0,
        center=(0.9 - _HEAD[0], 0.0, 0.7 - _HEAD[2]),
        moments=(0.05892, 0.06, 0.00708),
        products=(0.0, 0.00756, 0.0),
    )
    to_front: Weld = Weld(displacement=(_BASE - _HEAD[0], 0.0, _FRONT - _HEAD[2]))
    rear_axle: Pivot = Pivot(axis=_AXLE)
    rear: RigidBody = RigidBody(mass=2.0, moments=(0.0603, 0.12, 0.0603))
    rear_contact: RollingDisc = RollingDisc(radius=_REAR, axis=_AXLE)
    front_axle: Pivot = Pivot(axis=_AXLE)
    front: RigidBody = RigidBody(mass=3.0, moments=(0.1405, 0.28, 0.1405))
    front_contact: RollingDisc = RollingDisc(radius=_FRONT, axis=_AXLE)
    connections = [
        connect(frame.frame, to_head.a),
        connect(to_head.b, steer.a),
        connect(steer.b, fork.frame),
        connect(steer.b, to_front.a),
        connect(frame.frame, rear_axle.a),
        connect(rear_axle.b, rear.frame),
        connect(ground.frame, rear_contact.a),
        connect(rear_contact.b, rear.frame),
        connect(to_front.b, front_axle.a),
        connect(front_axle.b, front.frame),
        connect(ground.frame, front_contact.a),
        connect(front_contact.b, front.frame),
    ]
    start = {
        "frame.x_axis.y": 0.0,
        "frame.y_axis.z": 0.0,
        "frame.spin.x": lean_rate,
        "frame.spin.z": 0.0,
        "rear_contact.displacement_1": 0.0,
        "rear_contact.displacement_2": 0.0,
        "rear_axle.angle": 0.0,
        "steer.angle": 0.0,
        "steer.angular_velocity": 0.0,
        "front_axle.angle": 0.0,
    }

    def build(self) -> None:
        """Set the rear wheel off at its speed."""
        self.start["rear_axle.angular_velocity"] = self.speed / _REAR
