"""overhead-crane: a load on a rope that is hauled in, under a trolley that is driven."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.drive import Drive
from atwood_library.joints.pivot import Pivot
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass


class OverheadCrane(Scene):
    """A load hangs on a rope from a trolley, which starts evenly; the hoist lets the rope out at a constant speed.

    Small sways obey ``l theta'' + 2 l' theta' + g theta = -a``, with the solution ``(A J1(s) + B Y1(s))/sqrt(l)`` in
    Bessel functions of ``s = 2 sqrt(g l)/l'`` for a trolley that stands.
    """

    mass: Number = parameter(500.0, unit="kg", above=0.0, doc="Mass of the load.")
    length: Number = parameter(4.0, unit="m", above=0.0, doc="Length of the rope at the start.", symbol="l_0")
    hoist: Number = parameter(
        0.5, unit="m/s", doc="Speed at which the rope is let out; negative to haul the load up.", symbol="v"
    )
    acceleration: Number = parameter(0.0, unit="m/s^2", doc="Acceleration of the trolley along x, from rest.")
    sway: Number = parameter(1e-3, unit="rad", doc="Angle of the rope at the start.")
    t_end = 10.0

    ground: Ground = Ground()
    trolley: Drive = Drive()
    hook: Pivot = Pivot()
    rope: Drive = Drive(axis=(0.0, 0.0, -1.0))
    load: PointMass = PointMass(mass=mass)
    connections = [
        connect(ground.frame, trolley.a),
        connect(trolley.b, hook.a),
        connect(hook.b, rope.a),
        connect(rope.b, load.point),
    ]
    start = {"hook.angle": sway, "hook.angular_velocity": 0.0}

    def build(self) -> None:
        """Drive the trolley and the hoist."""
        self.set("trolley.motion", lambda t, *, acceleration: 0.5 * acceleration * t**2)
        self.set("rope.motion", lambda t, *, length, hoist: length + hoist * t)
