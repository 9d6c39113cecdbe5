"""stewart-platform: a platform on six legs that stretch."""

from __future__ import annotations

import math
from collections.abc import Callable

from atwood import Number, Scalar, Scene, cos, maximum, minimum, parameter, sin, sqrt
from atwood_library.blocks.servo_controller import ServoController
from atwood_library.drives.translational_motion import TranslationalMotion
from atwood_library.joints.slider import Slider
from atwood_library.joints.spherical import Spherical
from atwood_library.joints.universal import Universal
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody
from atwood_library.sources.time_function import TimeFunction


class StewartPlatform(Scene):
    """A platform on six legs (Gough, Stewart): each leg stands on a universal joint, stretches, and ends in a ball.

    The legs carry a spring and a damper each; the platform is let go aside from its rest and bobs. Six degrees of
    freedom, five loops. With ``legs="controlled"`` each leg has an actuator and a controller of its length, and the
    platform follows a lap: its centre goes once round a circle of radius `aside`, from rest to rest with least jerk,
    while it turns by `yaw` and back. The controllers are springs of stiffness `leg_stiffness` that are more than
    critically damped, so that the errors of the lengths, taken as one vector, stay below the largest vector of forces
    that the lap asks for, over that stiffness. ``legs="ideal"`` prescribes the lengths instead, and gives these forces.
    """

    base_radius: Number = parameter(1.0, unit="m", above=0.0, doc="Radius of the circle of the feet.")
    platform_radius: Number = parameter(0.6, unit="m", above=0.0, doc="Radius of the circle of the balls.")
    height: Number = parameter(1.0, unit="m", above=0.0, doc="Height of the platform without load.")
    platform_mass: Number = parameter(20.0, unit="kg", above=0.0, doc="Mass of the platform, a disc.")
    leg_mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of each half of a leg.")
    stiffness: Number = parameter(4000.0, unit="N/m", minimum=0.0, doc="Stiffness of each leg.")
    damping: Number = parameter(40.0, unit="N*s/m", minimum=0.0, doc="Damping of each leg.")
    aside: Number = parameter(0.1, unit="m", doc="Displacement of the platform along x at the start.")
    legs: str = parameter("sprung", choices=("sprung", "controlled", "ideal"), doc="What acts along the legs.")
    yaw: Number = parameter(0.2, unit="rad", doc="How far the platform turns on its lap.")
    lap: Number = parameter(2.0, unit="s", above=0.0, doc="How long the lap takes.")
    position_gain: Number = parameter(20.0, unit="1/s", above=0.0, doc="Gain of the controllers of positions.")
    gain: Number = parameter(3000.0, unit="N*s/m", above=0.0, doc="Force of an actuator for a leg that lags by 1 m/s.")
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
        if self.legs == "ideal":
            self.guess["platform.position.x"], self.guess["platform.position.z"] = 0.0, self.height
            return
        self.start["platform.position.x"] = self.aside if self.legs == "sprung" else 0.0
        for name in ("position.y", "phi", "velocity.x", "velocity.y", "velocity.z", "spin.x", "spin.y", "spin.z"):
            self.start[f"platform.{name}"] = 0.0
        self.start["platform.position.z"] = self.height

    def leg_stiffness(self) -> float:
        """Return the force of a controlled leg for a constant error of its length, N/m."""
        return self.gain * self.position_gain

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
        slider = self.add(f"leg{leg}", Slider(axis=(0.0, 0.0, 1.0)))
        if self.legs == "sprung":
            slider.stiffness, slider.natural_length, slider.damping = self.stiffness, 0.5 * length, self.damping
        else:
            self._drive(leg, slider, self._wanted(foot, ball, 0.5 * length))
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

    def _wanted(self, foot: tuple[float, float], ball: tuple[float, float], upper: float) -> Callable[[Scalar], Scalar]:
        """Return by how much a leg stretches on the lap, m, as a function of time."""

        def stretched(t: Scalar) -> Scalar:
            s = minimum(maximum(t / self.lap, 0.0), 1.0)
            way = 2.0 * math.pi * s * s * s * (10.0 + s * (6.0 * s - 15.0))
            turned = self.yaw * sin(way)
            x = self.aside * (1.0 - cos(way)) + ball[0] * cos(turned) - ball[1] * sin(turned) - foot[0]
            y = self.aside * sin(way) + ball[0] * sin(turned) + ball[1] * cos(turned) - foot[1]
            return sqrt(x * x + y * y + self.height * self.height) - upper

        return stretched

    def _drive(self, leg: int, slider: Slider, wanted: Callable[[Scalar], Scalar]) -> None:
        """Make a leg follow, exactly or by a controller."""
        path = self.add(f"path{leg}", TimeFunction(function=wanted))
        if self.legs == "ideal":
            motion = self.add(f"motion{leg}", TranslationalMotion())
            self.connect(slider.carriage, motion.b)
            self.connect(path.output("value"), motion.input("place"))
            return
        control = self.add(f"control{leg}", ServoController(position_gain=self.position_gain, gain=self.gain))
        self.connect(path.output("value"), control.input("set_point"))
        self.connect(path.output("rate"), control.input("set_rate"))
        self.connect(slider.output("displacement"), control.input("measurement"))
        self.connect(slider.output("speed"), control.input("measured_rate"))
        self.connect(control.output("y"), slider.input("actuator"))
