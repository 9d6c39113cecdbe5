"""strandbeest: two legs of Theo Jansen's beach animals on one crank."""

from __future__ import annotations

import math

from atwood import Number, Scene, parameter
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod

_BARS = {
    "pin-top": 50.0,
    "hip-top": 41.5,
    "hip-back": 40.1,
    "top-back": 55.8,
    "pin-knee": 61.9,
    "hip-knee": 39.3,
    "back-heel": 39.4,
    "knee-heel": 36.7,
    "heel-foot": 65.7,
    "knee-foot": 49.0,
}
"""Lengths of the bars of a leg, in hundredths of a metre (Jansen, The Great Pretender, 2007)."""

Place = tuple[float, float]


class Strandbeest(Scene):
    """Two of Jansen's legs, one the mirror image of the other, walk on one crank: one degree of freedom.

    Eleven bars for the first leg, the crank among them, and ten for the second, joined at eleven joints with a mass
    each. Where the joints are follows from the crank by intersections of circles, one after another.
    """

    scale: Number = parameter(0.01, unit="m", above=0.0, doc="Size: length of a bar of length one.")
    mass: Number = parameter(0.2, unit="kg", above=0.0, doc="Mass at each joint.")
    angle: Number = parameter(0.3, unit="rad", doc="Angle of the crank at the start.")
    rate: Number = parameter(12.0, unit="rad/s", doc="Rate of the crank at the start.")
    t_end = 1.0

    axle: Ground = Ground()

    def build(self) -> None:
        """Join the bars."""
        places = self.places(self.angle)
        pin = self.add("pin", PointMass(mass=self.mass))
        crank = self.add("crank", Rod(length=15.0 * self.scale))
        self.connect(self.axle.frame, crank.a)
        self.connect(crank.b, pin.point)
        for leg, side in (("left", -1.0), ("right", 1.0)):
            hip = self.add(f"{leg}_hip", Ground(position=(side * 38.0 * self.scale, 0.0, -7.8 * self.scale)))
            ends = {"hip": hip.frame, "pin": pin.point}
            for name in ("top", "back", "knee", "heel", "foot"):
                joint = self.add(f"{leg}_{name}", PointMass(mass=self.mass))
                ends[name] = joint.point
            for bar, length in _BARS.items():
                first, second = bar.split("-")
                rod = self.add(f"{leg}_{first}_{second}", Rod(length=length * self.scale))
                self.connect(rod.a, ends[first])
                self.connect(rod.b, ends[second])
                (x1, z1), (x2, z2) = (places[f"{leg}_{name}"] for name in (first, second))
                self.guess[f"{leg}_{first}_{second}.angle"] = math.atan2(x2 - x1, z1 - z2)
        # a rod at angle zero hangs down; the crank's angle is that from the x axis
        self.start.update({"crank.angle": self.angle + 0.5 * math.pi, "crank.angular_velocity": self.rate})

    def places(self, angle: float) -> dict[str, Place]:
        """Return where all joints are for an angle of the crank from the x axis, m; pin and hip of each leg, too."""
        found: dict[str, Place] = {}
        for leg, side in (("left", -1.0), ("right", 1.0)):
            # the left leg; the right one is its mirror image
            pin = (side * -15.0 * math.cos(angle), 15.0 * math.sin(angle))
            at = {"pin": pin, "hip": (-38.0, -7.8)}
            at["top"] = _meet(at, "hip", "pin", "top")
            at["back"] = _meet(at, "hip", "top", "back")
            at["knee"] = _meet(at, "pin", "hip", "knee")
            at["heel"] = _meet(at, "knee", "back", "heel")
            at["foot"] = _meet(at, "knee", "heel", "foot")
            for name, (x, z) in at.items():
                found[f"{leg}_{name}"] = (-side * x * self.scale, z * self.scale)
        return found


def _meet(at: dict[str, Place], first: str, second: str, third: str) -> Place:
    """Return where circles about two joints meet, to the left of the way from the first to the second."""

    def bar(name: str) -> float:
        return _BARS[f"{name}-{third}" if f"{name}-{third}" in _BARS else f"{third}-{name}"]

    (x1, z1), (x2, z2), r1, r2 = at[first], at[second], bar(first), bar(second)
    apart = math.hypot(x2 - x1, z2 - z1)
    along = (apart * apart + r1 * r1 - r2 * r2) / (2.0 * apart)
    across = math.sqrt(r1 * r1 - along * along)
    ex, ez = (x2 - x1) / apart, (z2 - z1) / apart
    return x1 + along * ex - across * ez, z1 + along * ez + across * ex
