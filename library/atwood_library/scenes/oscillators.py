"""oscillators: one degree of freedom that is free, swings harmonically, falls away, or is a pendulum."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.fields.potential import Potential
from atwood_library.joints.point_on_curve import PointOnCurve
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass


class Oscillators(Scene):
    """A mass with one degree of freedom in the potential zero, ``k x^2/2``, ``-k x^2/2`` or ``k a^2 (1 - cos(x/a))``.

    It is free, a harmonic oscillator, an inverted one, or a pendulum on a circle of radius a, with k x the force on it
    for small x (Goldstein, section 6.1; Arnold, Mathematical Methods of Classical Mechanics, section 4).
    """

    kind: str = parameter("harmonic", choices=("free", "harmonic", "inverted", "pendulum"), doc="The potential.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass.")
    stiffness: Number = parameter(4.0, unit="N/m", above=0.0, doc="Size k of the potential.", symbol="k")
    radius: Number = parameter(
        1.0, unit="m", above=0.0, doc="Radius a of the pendulum, and unit of the displacement.", symbol="a"
    )
    away: Number = parameter(0.5, unit="rad", doc="Displacement at the start, over a.")
    rate: Number = parameter(0.3, unit="rad/s", doc="Its rate at the start.")
    gravity = 0.0
    t_end = 5.0

    ground: Ground = Ground()
    track: PointOnCurve = PointOnCurve(scale=radius)
    field: Potential = Potential()
    ball: PointMass = PointMass(mass=mass)
    connections = [connect(ground.frame, track.a), connect(track.b, ball.point), connect(field.point, ball.point)]
    start = {"track.parameter": away, "track.rate": rate}

    def build(self) -> None:
        """Bend the track, and give it its potential."""
        self.set("track.curve", ("sin(p)", 0.0, "-cos(p)") if self.kind == "pendulum" else ("p", 0.0, 0.0))
        energies = {
            "free": 0.0,
            "harmonic": lambda x, *, stiffness: 0.5 * stiffness * x**2,
            "inverted": lambda x, *, stiffness: -0.5 * stiffness * x**2,
            "pendulum": lambda z, *, stiffness, radius: stiffness * radius * z,
        }
        self.set("field.energy_function", energies[self.kind])

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the displacement over a; for a pendulum nothing that is elementary."""
        w, p, v = math.sqrt(self.stiffness / self.mass), self.away, self.rate
        found = {
            "free": p + v * t,
            "harmonic": p * np.cos(w * t) + v / w * np.sin(w * t),
            "inverted": p * np.cosh(w * t) + v / w * np.sinh(w * t),
        }
        return {"track.parameter": found[self.kind]} if self.kind in found else {}
