"""swinging-atwood: Atwood's machine whose one mass swings."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.slide_gear import SlideGear
from atwood_library.joints.slider import Slider
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass


class SwingingAtwood(Scene):
    """Two masses on a rope over pulleys: one goes up and down, the other also swings in the plane.

    With the mass ratio 3 there is a second integral besides the energy (Tufillaro, American Journal of Physics 54,
    1986). The rope is two guides whose displacements a gear ties, so that its length on the side that swings, and its
    angle, are the coordinates: ``(m + M) r'' = m r theta'^2 + g (m cos theta - M)``.
    """

    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass m that swings.")
    ratio: Number = parameter(3.0, above=0.0, doc="Mass M of the other one over m.")
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the side that swings at the start.")
    angle: Number = parameter(math.pi / 2.0, unit="rad", doc="Angle from the downward vertical at the start.")
    t_end = 3.0

    ground: Ground = Ground()
    post: Ground = Ground(position=(-1.0, 0.0, 0.0))
    hinge: Pivot = Pivot()
    swing: Slider = Slider(axis=(0.0, 0.0, -1.0))
    other: Slider = Slider(axis=(0.0, 0.0, -1.0))
    rope: SlideGear = SlideGear(ratio=-1.0, offset=2.0)
    bob: PointMass = PointMass(mass=mass)
    weight: PointMass = PointMass(mass=ratio * mass)
    connections = [
        connect(ground.frame, hinge.a),
        connect(hinge.b, swing.a),
        connect(swing.b, bob.point),
        connect(post.frame, other.a),
        connect(other.b, weight.point),
        connect(rope.a, other.carriage),
        connect(rope.b, swing.carriage),
    ]
    start = {"swing.displacement": length, "swing.speed": 0.0, "hinge.angle": angle, "hinge.angular_velocity": 0.0}
