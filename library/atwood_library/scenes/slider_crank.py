"""slider-crank: a crank and a connecting rod that move a piston."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.slider import Slider
from atwood_library.parts.ground import Ground
from atwood_library.parts.link import Link
from atwood_library.parts.point_mass import PointMass


class SliderCrank(Scene):
    """A crank and a connecting rod, both uniform, and a piston on a horizontal guide."""

    crank_length: Number = parameter(0.5, unit="m", above=0.0, doc="Length of the crank.")
    rod_length: Number = parameter(1.5, unit="m", above=0.0, doc="Length of the connecting rod.")
    piston_mass: Number = parameter(0.5, unit="kg", above=0.0, doc="Mass of the piston.")
    t_end = 2.0

    ground: Ground = Ground()
    pivot1: Pivot = Pivot()
    crank: Link = Link(length=crank_length, mass=0.25)
    pivot2: Pivot = Pivot()
    connecting_rod: Link = Link(length=rod_length, mass=0.5)
    pivot3: Pivot = Pivot()
    piston: PointMass = PointMass(mass=piston_mass)
    guide: Slider = Slider()
    connections = [
        connect(ground.frame, pivot1.a),
        connect(pivot1.b, crank.a),
        connect(crank.b, pivot2.a),
        connect(pivot2.b, connecting_rod.a),
        connect(connecting_rod.b, pivot3.a),
        connect(pivot3.b, guide.b),
        connect(guide.b, piston.point),
        connect(guide.a, ground.frame),
    ]
    start = {"crank.angle": 0.5, "crank.angular_velocity": 3.0}
    guess = {"connecting_rod.angle": -0.2}
