"""elastic-pendulum: a mass that swings on a spring."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.forces.spring import Spring
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass


class ElasticPendulum(Scene):
    """A mass hangs on a spring and swings in a plane; with ``k/m = 4 g/l`` springing goes over into swinging and back.

    Its energy is kept, and nothing else (Vitt and Gorelik, 1933).
    """

    stiffness: Number = parameter(39.24, unit="N/m", above=0.0, doc="Stiffness of the spring.")
    natural_length: Number = parameter(0.75, unit="m", minimum=0.0, doc="Length of the spring without force.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass.")
    down: Number = parameter(1.2, unit="m", doc="Distance below the pivot at the start.")
    aside: Number = parameter(0.05, unit="m", doc="Distance aside at the start.")
    t_end = 10.0

    ground: Ground = Ground()
    spring: Spring = Spring(stiffness=stiffness, natural_length=natural_length)
    bob: PointMass = PointMass(mass=mass)
    connections = [connect(ground.frame, spring.a), connect(spring.b, bob.point)]
    start = {
        "bob.position.x": aside,
        "bob.position.z": -down,
        "bob.velocity.x": 0.0,
        "bob.velocity.z": 0.0,
    }
