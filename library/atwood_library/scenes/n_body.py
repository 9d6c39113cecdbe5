"""n-body: three equal masses that chase each other along a figure eight."""

from __future__ import annotations

from atwood import Number, Scene, parameter
from atwood_library.fields.mutual_potential import MutualPotential
from atwood_library.parts.point_mass import PointMass

_START = ((0.97000435669734, -0.24308753153583), (-0.97000435669734, 0.24308753153583), (0.0, 0.0))
_LAST = (-0.93240737144104, -0.86473146092102)


class NBody(Scene):
    """Three equal masses attract each other and follow one another along a figure eight.

    Chenciner and Montgomery, Annals of Mathematics 152 (2000); start values of C. Simo, for unit masses and a unit
    constant of gravitation, with the period 6.32591398292621. The masses move in the x-z plane. Any number of masses
    takes the same part, `MutualPotential`.
    """

    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of each body.")
    scale: Number = parameter(1.0, unit="m", above=0.0, doc="Unit of length of the figure.")
    constant: Number = parameter(1.0, unit="m^3/(kg*s^2)", above=0.0, doc="Constant of gravitation.")
    space = "space"
    gravity = 0.0
    t_end = 6.32591398292621

    force: MutualPotential = MutualPotential(count=3, gravitational_constant=constant)
    body1: PointMass = PointMass(mass=mass)
    body2: PointMass = PointMass(mass=mass)
    body3: PointMass = PointMass(mass=mass)

    def build(self) -> None:
        """Join them, and start them on the figure."""
        speed = (self.constant * self.mass / self.scale) ** 0.5
        for number, place in enumerate(_START):
            name, share = f"body{number + 1}", 1.0 if number == 2 else -0.5
            self.connect(self.force.point[number], self[name].point)
            for axis, where, last in zip("xz", place, _LAST, strict=True):
                self.start[f"{name}.position.{axis}"] = where * self.scale
                self.start[f"{name}.velocity.{axis}"] = share * last * speed
            if self.space == "space":
                self.start[f"{name}.position.y"], self.start[f"{name}.velocity.y"] = 0.0, 0.0
