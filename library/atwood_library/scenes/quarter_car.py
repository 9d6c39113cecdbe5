"""quarter-car: a quarter of a car on a wavy road."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.forces.damper import Damper
from atwood_library.forces.spring import Spring
from atwood_library.joints.drive import Drive
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.sources.sine import Sine


class QuarterCar(Scene):
    """A quarter of a car: a body on a spring and a damper, a wheel on an elastic tyre, and a wavy road under it.

    It starts on its steady motion, in which everything moves at the frequency of the road (`steady_motion`).
    """

    body_mass: Number = parameter(300.0, unit="kg", above=0.0, doc="Mass of the body.")
    wheel_mass: Number = parameter(40.0, unit="kg", above=0.0, doc="Mass of the wheel.")
    spring_stiffness: Number = parameter(16e3, unit="N/m", above=0.0, doc="Stiffness of the suspension.")
    damping: Number = parameter(1.2e3, unit="N*s/m", minimum=0.0, doc="Damping of the suspension.")
    tyre_stiffness: Number = parameter(160e3, unit="N/m", above=0.0, doc="Stiffness of the tyre.")
    height: Number = parameter(0.02, unit="m", doc="Height of the waves above the mean.")
    angular_frequency: Number = parameter(8.0, unit="rad/s", above=0.0, doc="Angular frequency at which waves come.")
    space = "line"
    line_axis = (0.0, 0.0, 1.0)
    t_end = 5.0

    ground: Ground = Ground()
    road: Drive = Drive(axis=(0.0, 0.0, 1.0))
    waves: Sine = Sine(amplitude=height, angular_frequency=angular_frequency)
    tyre: Spring = Spring(stiffness=tyre_stiffness, natural_length=0.3)
    wheel: PointMass = PointMass(mass=wheel_mass)
    spring: Spring = Spring(stiffness=spring_stiffness, natural_length=0.4)
    damper: Damper = Damper(damping=damping)
    body: PointMass = PointMass(mass=body_mass)
    connections = [
        connect(ground.frame, road.a),
        connect(road.b, tyre.a),
        connect(tyre.b, wheel.point),
        connect(wheel.point, spring.a),
        connect(spring.b, body.point),
        connect(wheel.point, damper.a),
        connect(damper.b, body.point),
    ]

    def build(self) -> None:
        """Drive the road, and start on the steady motion."""
        self.connect(self.waves.output("value"), self.road.input("motion"))
        at_start = self.steady_motion(np.array([0.0]))
        self.start.update({path: float(value[0]) for path, value in at_start.items()})

    def steady_motion(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the steady motion: the weight's deflection, and the complex amplitudes of a sine.

        Parameters
        ----------
        t
            Times, s.
        """
        w, k, tyre = self.angular_frequency, self.spring_stiffness, self.tyre_stiffness
        between = k + 1j * w * self.damping
        matrix = np.array(
            [
                [tyre + between - w * w * self.wheel_mass, -between],
                [-between, between - w * w * self.body_mass],
            ]
        )
        amplitudes = np.linalg.solve(matrix, np.array([tyre * self.height, 0.0]))
        wave = amplitudes[:, None] * np.exp(1j * w * t)
        wheel = 0.3 - (self.wheel_mass + self.body_mass) * self.gravity / tyre
        body = wheel + 0.4 - self.body_mass * self.gravity / k
        return {
            "wheel.position.z": wheel + wave[0].imag,
            "body.position.z": body + wave[1].imag,
            "wheel.velocity.z": (1j * w * wave[0]).imag,
            "body.velocity.z": (1j * w * wave[1]).imag,
        }
