"""double-pendulum: a pendulum that hangs on a pendulum."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod


class DoublePendulum(Scene):
    """Two bobs on massless rods, one below the other, both released horizontally at rest."""

    length1: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the upper rod.")
    length2: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the lower rod.")
    mass1: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the upper bob.")
    mass2: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the lower bob.")
    t_end = 3.0

    ground: Ground = Ground()
    rod1: Rod = Rod(length=length1)
    bob1: PointMass = PointMass(mass=mass1)
    rod2: Rod = Rod(length=length2)
    bob2: PointMass = PointMass(mass=mass2)
    connections = [
        connect(ground.frame, rod1.a),
        connect(rod1.b, bob1.point),
        connect(bob1.point, rod2.a),
        connect(rod2.b, bob2.point),
    ]
    start = {
        "rod1.angle": math.pi / 2.0,
        "rod2.angle": math.pi / 2.0,
        "rod1.angular_velocity": 0.0,
        "rod2.angular_velocity": 0.0,
    }
