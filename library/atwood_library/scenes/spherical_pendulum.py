"""spherical-pendulum: a bob on a massless rod that swings in every direction."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.point_on_surface import PointOnSurface
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod


class SphericalPendulum(Scene):
    """A bob on a massless rod, free to swing in every direction (Landau and Lifshitz, Mechanics, section 14).

    Its state is the bob's place and velocity in space, with the rod as a constraint: nothing is singular anywhere, not
    straight below the pivot either. With ``coordinates="angles"`` it is the inclination and the azimuth,
    `parameter_1` and `parameter_2` of the rod, without a constraint; these have no rates straight below the pivot.
    """

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the rod.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the bob.")
    inclination: Number = parameter(math.pi / 3.0, unit="rad", doc="Angle from the downward vertical at the start.")
    coordinates: str = parameter(
        "places", choices=("places", "angles"), doc="States: place and constraint, or the angles theta and phi."
    )
    azimuth_rate: Number = parameter(2.0, unit="rad/s", doc="Rate at which it goes round at the start.")
    space = "space"
    t_end = 10.0

    ground: Ground = Ground()
    rod: Rod = Rod(length=length)
    bob: PointMass = PointMass(mass=mass)
    connections = [connect(ground.frame, rod.a), connect(rod.b, bob.point)]

    def build(self) -> None:
        """Put the bob aside and throw it across."""
        if self.coordinates == "angles":
            sphere = ("sin(p)*cos(q)", "sin(p)*sin(q)", "-cos(p)")
            self.replace("rod", PointOnSurface(surface=sphere, scale=self.length))
            self.symbols.update({"rod.parameter_1": "theta", "rod.parameter_2": "phi"})
            self.start.update({"rod.parameter_1": self.inclination, "rod.parameter_2": 0.0})
            self.start.update({"rod.rate_1": 0.0, "rod.rate_2": self.azimuth_rate})
            return
        sine, cosine = math.sin(self.inclination), math.cos(self.inclination)
        place = (self.length * sine, 0.0, -self.length * cosine)
        self.start["bob.position.x"], self.start["bob.position.y"] = place[0], 0.0
        self.guess["bob.position.z"] = place[2]
        self.start["bob.velocity.y"] = self.azimuth_rate * place[0]
        self.guess["bob.velocity.x"], self.guess["bob.velocity.z"] = 0.0, 0.0
