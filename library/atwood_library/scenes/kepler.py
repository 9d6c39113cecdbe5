"""kepler: a body that is attracted, or repelled, by a fixed centre."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.fields.pair_potential import PairPotential
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass


class Kepler(Scene):
    """A body in the potential ``-k/r`` of a fixed centre: Kepler's problem, in the plane (Goldstein, section 3.7).

    With k > 0 it starts at the pericentre of an orbit of the given eccentricity: ``a (1 - e)`` away from the centre, on
    a hyperbola ``a (e - 1)``. With k < 0 it is repelled, and starts at the vertex of a hyperbola, ``a (e + 1)`` away.
    From there it turns by ``asin(1/e)``, half the angle of scattering.
    """

    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the body.")
    strength: Number = parameter(1.0, unit="N*m^2", doc="k; negative to repel.")
    semi_major_axis: Number = parameter(1.0, unit="m", above=0.0, doc="Semi-major axis a, of a hyperbola without sign.")
    eccentricity: Number = parameter(0.5, minimum=0.0, doc="Eccentricity e; not 1.")
    gravity = 0.0
    t_end = 2.0 * math.pi

    ground: Ground = Ground()
    force: PairPotential = PairPotential(law="coulomb", coulomb_constant=1.0, charge_a=1.0)
    body: PointMass = PointMass(mass=mass)
    connections = [connect(force.a, ground.frame), connect(force.b, body.point)]

    def build(self) -> None:
        """Put it where it is nearest to the centre."""
        self.set("force.charge_b", -self.strength)
        a, e = self.semi_major_axis, self.eccentricity
        attracted = self.strength > 0.0
        distance = a * abs(1.0 - e) if attracted else a * (e + 1.0)
        # Energy is -k/(2 a) on an ellipse and |k|/(2 a) on a hyperbola, of either branch.
        energy = (-1.0 if attracted and e < 1.0 else 1.0) * abs(self.strength) / (2.0 * a)
        square = 2.0 * (energy + self.strength / distance) / self.mass
        self.start.update(
            {
                "body.position.x": distance,
                "body.position.z": 0.0,
                "body.velocity.x": 0.0,
                "body.velocity.z": math.sqrt(max(square, 0.0)),
            }
        )
