"""four-bar: a crank, a coupler and a rocker, joined in a loop."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.parts.ground import Ground
from atwood_library.parts.link import Link


class FourBar(Scene):
    """A four-bar linkage of uniform links: a crank that turns fully, a coupler and a rocker."""

    crank_length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the crank.")
    coupler_length: Number = parameter(2.5, unit="m", above=0.0, doc="Length of the coupler.")
    rocker_length: Number = parameter(2.0, unit="m", above=0.0, doc="Length of the rocker.")
    frame_length: Number = parameter(2.5, unit="m", above=0.0, doc="Distance of the fixed pivots.")
    t_end = 2.0

    left: Ground = Ground()
    right: Ground = Ground()
    pivot1: Pivot = Pivot()
    crank: Link = Link(length=crank_length, mass=0.1)
    pivot2: Pivot = Pivot()
    coupler: Link = Link(length=coupler_length, mass=0.25)
    pivot3: Pivot = Pivot()
    rocker: Link = Link(length=rocker_length, mass=0.2)
    pivot4: Pivot = Pivot()
    connections = [
        connect(left.frame, pivot1.a),
        connect(pivot1.b, crank.a),
        connect(crank.b, pivot2.a),
        connect(pivot2.b, coupler.a),
        connect(coupler.b, pivot3.a),
        connect(pivot3.b, rocker.b),
        connect(rocker.a, pivot4.b),
        connect(pivot4.a, right.frame),
    ]
    start = {"crank.angle": 1.0, "crank.angular_velocity": 2.0}
    guess = {"coupler.angle": 0.3, "rocker.angle": 1.9}

    def build(self) -> None:
        """Put the right pivot at its distance."""
        self.right.position = (self.frame_length, 0.0, 0.0)
