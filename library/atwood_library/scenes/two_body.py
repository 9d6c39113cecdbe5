"""two-body: two masses that attract each other."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.fields.pair_potential import PairPotential
from atwood_library.parts.point_mass import PointMass


class TwoBody(Scene):
    """Two masses that attract each other by gravity, each on an ellipse about their common centre of mass.

    They start where they are nearest, with the centre of mass at rest at the origin (Goldstein, sections 3.1 and 3.7).
    Any other interaction comes with ``scene.set("force.law", "function")`` and its energy as a function of distance.
    """

    mass1: Number = parameter(2.0, unit="kg", above=0.0, doc="Mass of the first body.")
    mass2: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the second body.")
    constant: Number = parameter(1.0, unit="m^3/(kg*s^2)", above=0.0, doc="Constant of gravitation.")
    semi_major_axis: Number = parameter(1.0, unit="m", above=0.0, doc="Of the ellipse of one body about the other.")
    eccentricity: Number = parameter(0.5, minimum=0.0, maximum=0.99, doc="Eccentricity of the ellipses.")
    space = "space"
    gravity = 0.0
    t_end = 5.0

    force: PairPotential = PairPotential(gravitational_constant=constant)
    body1: PointMass = PointMass(mass=mass1)
    body2: PointMass = PointMass(mass=mass2)
    connections = [connect(force.a, body1.point), connect(force.b, body2.point)]

    def build(self) -> None:
        """Put them where they are nearest, and let them go across, upwards and downwards."""
        whole = self.mass1 + self.mass2
        a, e = self.semi_major_axis, self.eccentricity
        distance, speed = a * (1.0 - e), math.sqrt(self.constant * whole / a * (1.0 + e) / (1.0 - e))
        for name, share in (("body1", -self.mass2 / whole), ("body2", self.mass1 / whole)):
            self.start.update(
                {
                    f"{name}.position.x": share * distance,
                    f"{name}.position.z": 0.0,
                    f"{name}.velocity.x": 0.0,
                    f"{name}.velocity.z": share * speed,
                }
            )
            if self.space == "space":
                self.start.update({f"{name}.position.y": 0.0, f"{name}.velocity.y": 0.0})
