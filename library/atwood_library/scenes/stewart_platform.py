"""stewart-platform: a platform on six legs that stretch."""

from __future__ import annotations

import math

from atwood import Scene, parameter
from atwood_library.joints.slider import Slider
from atwood_library.joints.spherical import Spherical
from atwood_library.joints.universal import Universal
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class StewartPlatform(Scene):
    """A platform on six legs (Gough, Stewart): each leg stands on a universal joint, stretches, and ends in a ball.

    The legs carry a spring and a damper each; the platform is let go aside from its rest and bobs. Six degrees of
    freedom, five loops.
    """

    base_radius: float = parameter(1.0, unit="m", above=0.0, doc="Radius of the circle of the feet.")
    platform_radius: float = parameter(0.6, unit="m", above=0.0, doc="Radius of the circle of the balls.")
    height: float = parameter(1.0, unit="m", above=0.0, doc="Height of the platform without load.")
    platform_mass: float = parameter(20.0, unit="kg", above=0.0, doc="Mass of the platform, a disc.")
    leg_mass: float = parameter(1.0, unit="kg", above=0.0, doc="Mass of each half of a leg.")
    stiffness: float = parameter(4000.0, unit="N/m", minimum=0.0, doc="Stiffness of each leg.")
    damping: float = parameter(40.0, unit="N*s/m", minimum=0.0, doc="Damping of each leg.")
    aside: float = parameter(0.1, unit="m", doc="Displacement of the platform along x at the start.")
    space = "space"
    t_end = 2.0

    platform: RigidBody = RigidBody(mass=platform_mass)

    def build(self) -> None:
        """Set up the legs, two and two close together at the feet, and the other two at the balls."""
        disc = 0.25 * self.platform_mass * self.platform_radius**2
        self.platform.moments = (disc, disc, 2.0 * disc)
        for leg in range(6):
            side = 1.0 if leg % 2 else -1.0
            corner = 2.0 * math.pi * (leg // 2) / 3.0
            foot = self._on_circle(self.base_radius, corner + side * 0.2)
            ball = self._on_circle(self.platform_radius, corner + side * (math.pi / 3.0 - 0.2))
            self._add_leg(leg, foot, ball)
        self.start["platform.position.x"] = self.aside
        for name in ("position.y", "phi", "velocity.x", "velocity.y", "velocity.z", "spin.x", "spin.y", "spin.z"):
            self.start[f"platform.{name}"] = 0.0
        self.start["platform.position.z"] = self.height

    @staticmethod
    def _on_circle(radius: float, angle: float) -> tuple[float, float]:
        return radius * math.cos(angle), radius * math.sin(angle)

    def _add_leg(self, leg: int, foot: tuple[float, float], ball: tuple[float, float]) -> None:
        """Add one leg, stretched between foot and ball while the platform is at its height above the feet."""
        dx, dy = ball[0] - foot[0], ball[1] - foot[1]
        length = math.hypot(dx, dy, self.height)
        # The lower half stands along z, turned about x and then about its own y.
        first = math.atan2(-dy, self.height)
        second = math.asin(dx / length)
        ground = self.add(f"ground{leg}", Ground(position=(*foot, 0.0)))
        universal = self.add(f"universal{leg}", Universal(axis_a=(1.0, 0.0, 0.0), axis_b=(0.0, 1.0, 0.0)))
        thin, slender = 1e-3 * self.leg_mass, self.leg_mass * length**2 / 48.0
        mass, moments, middle = self.leg_mass, (slender, slender, thin), (0.0, 0.0, 0.25 * length)
        lower = self.add(f"lower{leg}", RigidBody(mass=mass, moments=moments, center=middle))
        slider = self.add(
            f"leg{leg}",
            Slider(axis=(0.0, 0.0, 1.0), stiffness=self.stiffness, natural_length=0.5 * length, damping=self.damping),
        )
        upper = self.add(f"upper{leg}", RigidBody(mass=mass, moments=moments, center=middle))
        tip = self.add(f"tip{leg}", Weld(displacement=(0.0, 0.0, 0.5 * length)))
        socket = self.add(f"ball{leg}", Spherical())
        corner = self.add(f"corner{leg}", Weld(displacement=(*ball, 0.0)))
        self.connect(ground.frame, universal.a)
        self.connect(universal.b, lower.frame)
        self.connect(lower.frame, slider.a)
        self.connect(slider.b, upper.frame)
        self.connect(upper.frame, tip.a)
        self.connect(tip.b, socket.a)
        self.connect(socket.b, corner.b)
        self.connect(corner.a, self.platform.frame)
        self.guess[f"universal{leg}.angle_a"], self.guess[f"universal{leg}.angle_b"] = first, second
        self.guess[f"leg{leg}.displacement"] = 0.5 * length
