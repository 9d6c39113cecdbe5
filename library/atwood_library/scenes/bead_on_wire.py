"""bead-on-wire: a bead on a wire of some shape, which may be turned."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.point_on_curve import PointOnCurve
from atwood_library.joints.rotary_drive import RotaryDrive
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.sources.ramp import Ramp

_SHAPES: dict[str, tuple[str | float, str | float, str | float]] = {
    "parabola": ("p", 0.0, "0.5*p**2"),
    "cycloid": ("p + sin(p)", 0.0, "-cos(p)"),
    "circle": ("sin(p)", 0.0, "-cos(p)"),
    "helix": ("cos(p)", "sin(p)", "0.25*p"),
}


class BeadOnWire(Scene):
    """A bead slides without friction on a wire: a parabola, a cycloid, a circle or a helix, which may be turned.

    On a cycloid that hangs down, half the arc length from its lowest point is ``2 a sin(p/2)`` and swings harmonically,
    with ``omega^2 = g/(4 a)`` at every amplitude (Huygens; Goldstein, section 2.2). A wire that is turned about the
    vertical keeps Jacobi's integral and not the energy; turned about the horizontal x axis, under gravity, it keeps
    neither.
    """

    shape: str = parameter("cycloid", choices=tuple(_SHAPES), doc="Shape of the wire.")
    scale: Number = parameter(1.0, unit="m", above=0.0, doc="Size a of the wire.", symbol="a")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the bead.")
    turning: str = parameter("z", choices=("z", "x"), doc="Axis about which the wire is turned.")
    rate: Number = parameter(0.0, unit="rad/s", doc="Rate at which it is turned.", symbol="omega")
    away: Number = parameter(1.0, unit="rad", doc="Parameter of the bead at the start, where it rests on the wire.")
    space = "space"
    t_end = 5.0

    ground: Ground = Ground()
    clock: Ramp = Ramp(slope=rate)
    drive: RotaryDrive = RotaryDrive(axis=(0.0, 0.0, 1.0))
    wire: PointOnCurve = PointOnCurve(scale=scale)
    bead: PointMass = PointMass(mass=mass)
    connections = [
        connect(clock.output("value"), drive.input("rotation")),
        connect(ground.frame, drive.a),
        connect(drive.b, wire.a),
        connect(wire.b, bead.point),
    ]
    start = {"wire.parameter": away, "wire.rate": 0.0}

    def build(self) -> None:
        """Bend the wire; a cycloid ends at its cusps."""
        self.set("wire.curve", _SHAPES[self.shape])
        self.set("drive.axis", self.turning)
        if self.shape == "cycloid":
            self.set("wire.lower_end", -math.pi)
            self.set("wire.upper_end", math.pi)

    def tautochrone(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the parameter on a cycloid that is not turned, at given times."""
        swing = np.sin(0.5 * self.away) * np.cos(0.5 * np.sqrt(self.gravity / self.scale) * t)
        return np.asarray(2.0 * np.arcsin(swing))
