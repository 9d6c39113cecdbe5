"""flyball-governor: two balls that a turning shaft flings out against stiff springs."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.forces.damper import Damper
from atwood_library.forces.spring import Spring
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.slider import Slider
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rigid_body import RigidBody

_BAR = 1e-4 / 6.0
"""Moment of inertia of a square bar of 0.01 m about its own axis, over its mass, m^2."""


class FlyballGovernor(Scene):
    """The stiff flyball governor, IFToMM benchmark A05.

    A shaft that spins freely about the vertical carries two arms with balls on hinges at its top, and a sleeve that
    slides along it. A stiff spring and a strong damper join the middle of each arm to the sleeve. The springs relax ten
    thousand times faster than the governor swings.
    """

    stiffness: Number = parameter(8e5, unit="N/m", above=0.0, doc="Stiffness of each spring.")
    damping: Number = parameter(4e4, unit="N*s/m", minimum=0.0, doc="Damping of each damper.")
    ball_mass: Number = parameter(5.0, unit="kg", above=0.0, doc="Mass of each ball.")
    arm_mass: Number = parameter(0.3, unit="kg", above=0.0, doc="Mass of each arm.")
    sleeve_mass: Number = parameter(3.0, unit="kg", above=0.0, doc="Mass of the sleeve.")
    rate: Number = parameter(2.0 * math.pi, unit="rad/s", doc="Rate of the shaft at the start.")
    space = "space"
    t_end = 10.0

    ground: Ground = Ground()
    bearing: Pivot = Pivot(axis=(0.0, 0.0, 1.0))
    shaft: RigidBody = RigidBody(mass=0.3, center=(0.0, 0.0, 0.5))
    guide: Slider = Slider(axis=(0.0, 0.0, 1.0))
    sleeve: RigidBody = RigidBody(mass=sleeve_mass)
    right_top: Weld = Weld(displacement=(0.05, 0.0, 1.0))
    left_top: Weld = Weld(displacement=(-0.05, 0.0, 1.0))
    right_hinge: Pivot = Pivot(axis=(0.0, 1.0, 0.0))
    left_hinge: Pivot = Pivot(axis=(0.0, -1.0, 0.0))
    right_arm: RigidBody = RigidBody(mass=arm_mass, center=(0.5, 0.0, 0.0))
    left_arm: RigidBody = RigidBody(mass=arm_mass, center=(-0.5, 0.0, 0.0))
    right_end: Weld = Weld(displacement=(1.0, 0.0, 0.0))
    left_end: Weld = Weld(displacement=(-1.0, 0.0, 0.0))
    right_ball: PointMass = PointMass(mass=ball_mass)
    left_ball: PointMass = PointMass(mass=ball_mass)
    right_middle: Weld = Weld(displacement=(0.5, 0.0, 0.0))
    left_middle: Weld = Weld(displacement=(-0.5, 0.0, 0.0))
    right_eye: Weld = Weld(displacement=(0.05, 0.0, 0.0))
    left_eye: Weld = Weld(displacement=(-0.05, 0.0, 0.0))
    right_spring: Spring = Spring(stiffness=stiffness, natural_length=0.5)
    left_spring: Spring = Spring(stiffness=stiffness, natural_length=0.5)
    right_damper: Damper = Damper(damping=damping)
    left_damper: Damper = Damper(damping=damping)
    connections = [
        connect(ground.frame, bearing.a),
        connect(bearing.b, shaft.frame),
        connect(shaft.frame, guide.a),
        connect(guide.b, sleeve.frame),
        connect(shaft.frame, right_top.a),
        connect(right_top.b, right_hinge.a),
        connect(right_hinge.b, right_arm.frame),
        connect(right_arm.frame, right_end.a),
        connect(right_end.b, right_ball.point),
        connect(right_arm.frame, right_middle.a),
        connect(sleeve.frame, right_eye.a),
        connect(right_middle.b, right_spring.a),
        connect(right_spring.b, right_eye.b),
        connect(right_middle.b, right_damper.a),
        connect(right_damper.b, right_eye.b),
        connect(shaft.frame, left_top.a),
        connect(left_top.b, left_hinge.a),
        connect(left_hinge.b, left_arm.frame),
        connect(left_arm.frame, left_end.a),
        connect(left_end.b, left_ball.point),
        connect(left_arm.frame, left_middle.a),
        connect(sleeve.frame, left_eye.a),
        connect(left_middle.b, left_spring.a),
        connect(left_spring.b, left_eye.b),
        connect(left_middle.b, left_damper.a),
        connect(left_damper.b, left_eye.b),
    ]
    start = {
        "bearing.angle": 0.0,
        "bearing.angular_velocity": rate,
        "guide.displacement": 0.5,
        "guide.speed": 0.0,
        "right_hinge.angle": math.pi / 6.0,
        "right_hinge.angular_velocity": 0.0,
        "left_hinge.angle": math.pi / 6.0,
        "left_hinge.angular_velocity": 0.0,
    }

    def build(self) -> None:
        """Give the bars and the sleeve their inertia: square bars of 0.01 m, a cube of 0.1 m."""
        along, across = _BAR, (1.0 + 1e-4) / 12.0
        self.shaft.moments = (0.3 * across, 0.3 * across, 0.3 * along)
        for arm in (self.right_arm, self.left_arm):
            arm.moments = (self.arm_mass * along, self.arm_mass * across, self.arm_mass * across)
        cube = self.sleeve_mass * 0.01 / 6.0
        self.sleeve.moments = (cube, cube, cube)
