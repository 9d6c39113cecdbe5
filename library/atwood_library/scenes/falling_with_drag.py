"""falling-with-drag: a ball that is thrown and falls through air, which may move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.forces.drag import Drag
from atwood_library.parts.point_mass import PointMass


class FallingWithDrag(Scene):
    """A ball falls through air with a drag that is linear in the speed, or, dropped from rest, quadratic.

    By the linear law it may be thrown, and there may be a wind, whose velocity it takes up: seen from the air it is the
    same motion (Goldstein, section 1.5). By the quadratic law it comes to ``sqrt(m g/k)``.
    """

    mass: Number = parameter(0.4, unit="kg", above=0.0, doc="Mass of the ball.")
    law: str = parameter("linear", choices=("linear", "quadratic"), doc="Law of the drag.")
    coefficient: Number = parameter(0.3, above=0.0, unit="any", doc="N s/m by the linear law, N s^2/m^2 by the other.")
    wind: Number = parameter(3.0, unit="m/s", doc="Wind along x, by the linear law.")
    speed: Number = parameter(2.0, unit="m/s", doc="Speed along x at the start, by the linear law.")
    t_end = 3.0

    air: Drag = Drag()
    ball: PointMass = PointMass(mass=mass)
    connections = [connect(air.point, ball.point)]

    def build(self) -> None:
        """Choose the law, and throw the ball."""
        is_linear = self.law == "linear"
        self.set("air.linear", self.coefficient if is_linear else 0.0)
        self.set("air.quadratic", 0.0 if is_linear else self.coefficient)
        self.set("air.wind", (self.wind if is_linear else 0.0, 0.0, 0.0))
        self.start.update({"ball.position.x": 0.0, "ball.position.z": 0.0, "ball.velocity.z": 0.0})
        self.start["ball.velocity.x"] = self.speed if is_linear else 0.0

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the fall."""
        m, g, k = self.mass, self.gravity, self.coefficient
        if self.law == "quadratic":
            last = np.sqrt(m * g / k)
            fall = last**2 / g * np.log(np.cosh(g * t / last))
            return {"ball.position.z": -fall, "ball.velocity.z": -last * np.tanh(g * t / last)}
        rate = k / m
        gone, last = (1.0 - np.exp(-rate * t)) / rate, g / rate
        return {
            "ball.position.x": self.wind * t + (self.speed - self.wind) * gone,
            "ball.position.z": -last * t + last * gone,
            "ball.velocity.x": self.wind + (self.speed - self.wind) * np.exp(-rate * t),
        }
