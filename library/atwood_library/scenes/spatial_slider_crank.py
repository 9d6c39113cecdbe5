"""spatial-slider-crank: a crank, a rod between a ball and a universal joint, and a slider across."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.slider import Slider
from atwood_library.joints.spherical import Spherical
from atwood_library.joints.universal import Universal
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class SpatialSliderCrank(Scene):
    """A crank that turns about x, a connecting rod, and a block that slides along x on the floor.

    The rod hangs on the crank pin by a ball and on the block by a universal joint, so that it does not spin about
    itself. With the crank at angle a above y, the pin is at ``(0, d + r cos a, h + r sin a)``.
    """

    crank_length: Number = parameter(0.08, unit="m", above=0.0, doc="Length of the crank, r.")
    rod_length: Number = parameter(0.3, unit="m", above=0.0, doc="Length of the connecting rod.")
    depth: Number = parameter(0.1, unit="m", doc="Distance of the crank's bearing behind the slider's line, d.")
    height: Number = parameter(0.12, unit="m", doc="Height of the crank's bearing above the slider's line, h.")
    crank_rate: Number = parameter(6.0, unit="rad/s", doc="Rate of the crank at the start.")
    space = "space"
    t_end = 5.0

    bearing_block: Ground = Ground()
    bearing: Pivot = Pivot(axis=(1.0, 0.0, 0.0))
    crank: RigidBody = RigidBody(mass=0.12, moments=(1e-4, 1e-5, 1e-4))
    pin: Weld = Weld()
    ball: Spherical = Spherical()
    rod: RigidBody = RigidBody(mass=0.5, moments=(4e-4, 4e-3, 4e-3))
    rod_end: Weld = Weld()
    cross: Universal = Universal(axis_a=(0.0, 1.0, 0.0), axis_b=(0.0, 0.0, 1.0))
    block: RigidBody = RigidBody(mass=2.0, moments=(1e-4, 1e-4, 1e-4))
    floor: Ground = Ground()
    guide: Slider = Slider(axis=(1.0, 0.0, 0.0))
    connections = [
        connect(bearing_block.frame, bearing.a),
        connect(bearing.b, crank.frame),
        connect(crank.frame, pin.a),
        connect(pin.b, ball.a),
        connect(floor.frame, guide.a),
        connect(guide.b, block.frame),
        connect(block.frame, cross.a),
        connect(cross.b, rod.frame),
        connect(rod.frame, rod_end.a),
        connect(rod_end.b, ball.b),
    ]
    start = {"bearing.angle": 0.0, "bearing.angular_velocity": crank_rate}

    def build(self) -> None:
        """Put the bearing in its place and the rod roughly between pin and block."""
        self.bearing_block.position = (0.0, self.depth, self.height)
        self.pin.displacement = (0.0, self.crank_length, 0.0)
        self.crank.center = (0.0, 0.5 * self.crank_length, 0.0)
        self.rod.center = (-0.5 * self.rod_length, 0.0, 0.0)
        self.rod_end.displacement = (-self.rod_length, 0.0, 0.0)
        y, z = self.depth + self.crank_length, self.height
        self.guess["guide.displacement"] = max(self.rod_length**2 - y * y - z * z, 0.0) ** 0.5
