"""rotating-frame: what moves freely, as seen from a table that turns and is carried along."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.drive import Drive
from atwood_library.joints.point_on_plane import PointOnPlane
from atwood_library.joints.rotary_drive import RotaryDrive
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.sensors.frame_sensor import FrameSensor


class RotatingFrame(Scene):
    """A puck slides freely on a level table that turns ever faster and is carried along ever faster.

    Its coordinates are those on the table, so that its equations have the translational, Euler's, the Coriolis and the
    centrifugal force (Goldstein, section 4.10), which the `observer` measures one by one. Seen from outside it moves
    straight on.
    """

    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the puck.")
    rate: Number = parameter(1.5, unit="rad/s", doc="Rate of the table at the start.", symbol="omega")
    speed_up: Number = parameter(0.4, unit="rad/s^2", doc="Angular acceleration of the table.", symbol="alpha")
    acceleration: Number = parameter(0.3, unit="m/s^2", doc="Acceleration of the table's middle along x, from rest.")
    away: Number = parameter(0.5, unit="m", doc="Distance of the puck from the middle at the start, along x.")
    speed: Number = parameter(0.2, unit="m/s", doc="Speed of the puck on the table at the start, along y.")
    space = "space"
    gravity = 0.0
    t_end = 5.0

    ground: Ground = Ground()
    carriage: Drive = Drive()
    turntable: RotaryDrive = RotaryDrive(axis=(0.0, 0.0, 1.0))
    table: PointOnPlane = PointOnPlane()
    puck: PointMass = PointMass(mass=mass)
    observer: FrameSensor = FrameSensor()
    connections = [
        connect(ground.frame, carriage.a),
        connect(carriage.b, turntable.a),
        connect(turntable.b, table.a),
        connect(table.b, puck.point),
        connect(observer.frame, turntable.b),
        connect(observer.point, puck.point),
    ]
    start = {
        "table.displacement_1": away,
        "table.displacement_2": 0.0,
        "table.speed_1": 0.0,
        "table.speed_2": speed,
    }

    def build(self) -> None:
        """Say how the table moves."""
        self.set("carriage.motion", lambda t, *, acceleration: 0.5 * acceleration * t**2)
        self.set("turntable.rotation", lambda t, *, rate, speed_up: rate * t + 0.5 * speed_up * t**2)

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the straight motion, seen from outside and on the table."""
        y = (self.speed + self.rate * self.away) * t
        x = self.away - 0.5 * self.acceleration * t**2
        turn = self.rate * t + 0.5 * self.speed_up * t**2
        return {
            "puck.position.x": np.full_like(t, self.away),
            "puck.position.y": y,
            "table.displacement_1": x * np.cos(turn) + y * np.sin(turn),
            "table.displacement_2": y * np.cos(turn) - x * np.sin(turn),
        }
