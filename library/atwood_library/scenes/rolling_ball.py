"""rolling-ball: a ball that rolls on a turning table."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.rolling_sphere import RollingSphere
from atwood_library.joints.rotary_drive import RotaryDrive
from atwood_library.parts.ground import Ground
from atwood_library.parts.sphere import Sphere
from atwood_library.sources.ramp import Ramp


class RollingBall(Scene):
    """A ball rolls without slipping on a level table that turns at a constant rate.

    Seen from outside its centre moves in a circle, wherever it starts, at 2/7 of the table's rate if it is solid
    (Earnshaw, Dynamics, 1844; Weltner, American Journal of Physics 47, 1979). Hollow it circles faster, at up to 2/5.
    """

    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Radius of the ball.")
    cavity: Number = parameter(0.0, unit="m", minimum=0.0, doc="Radius of its cavity.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the ball.")
    rate: Number = parameter(3.0, unit="rad/s", doc="Rate of the table.")
    away: Number = parameter(0.5, unit="m", doc="Distance of the ball from the middle of the table at the start.")
    speed: Number = parameter(0.3, unit="m/s", doc="Speed of the ball across that distance at the start.")
    spin: Number = parameter(0.0, unit="rad/s", doc="Angular velocity of the ball about the vertical.")
    space = "space"
    t_end = 10.0

    ground: Ground = Ground()
    clock: Ramp = Ramp(slope=rate)
    table: RotaryDrive = RotaryDrive(axis=(0.0, 0.0, 1.0))
    contact: RollingSphere = RollingSphere(radius=radius)
    ball: Sphere = Sphere(radius=radius, inner_radius=cavity, mass=mass)
    connections = [
        connect(clock.output("value"), table.input("rotation")),
        connect(ground.frame, table.a),
        connect(table.b, contact.a),
        connect(contact.b, ball.frame),
    ]
    start = {
        "ball.phi": 0.0,
        "ball.theta": 0.0,
        "ball.psi": 0.0,
        "ball.position.x": away,
        "ball.position.y": 0.0,
        "ball.velocity.x": 0.0,
        "ball.velocity.y": speed,
        "ball.angular_velocity.z": spin,
    }
