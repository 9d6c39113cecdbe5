"""six-axis-arm: a robot's arm on a trajectory, each axis with its motor, gear and controller."""

from __future__ import annotations

from atwood import Number, Scene, parameter
from atwood_library.blocks.servo_controller import ServoController
from atwood_library.drives.inertia import Inertia
from atwood_library.drives.rotational_motion import RotationalMotion
from atwood_library.drives.rotational_source import RotationalSource
from atwood_library.joints.gear import Gear
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody
from atwood_library.sources.minimum_jerk import MinimumJerk

_AXES = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
"""Axes of the joints while all angles are zero: the upper arm stands upright, the forearm points along x."""

_TIPS = ((0.2, 0.0, 0.45), (0.0, 0.0, 0.6), (0.35, 0.0, 0.1), (0.3, 0.0, 0.0), (0.08, 0.0, 0.0), (0.1, 0.0, 0.0))
"""m. Where the next joint is, in the axes of the body that a joint carries."""

_MASSES = (40.0, 25.0, 15.0, 8.0, 3.0, 1.0)
_RADII = (0.15, 0.1, 0.09, 0.08, 0.06, 0.04)


class SixAxisArm(Scene):
    """An arm of six bodies on hinges follows a trajectory: each axis has a motor with inertia, a gear and a controller.

    Each angle goes its `travel` from rest to rest with least jerk, all in one time. A controller is a spring of
    stiffness ``ratio gain position_gain`` about its axis that is more than critically damped. So the errors, taken as
    one vector, stay below the largest vector of torques that the trajectory asks for, over that stiffness
    (`stiffness`). ``drives="ideal"`` prescribes the angles instead, and gives these torques (Siciliano et al.,
    Robotics, sections 7.2 and 8.3).
    """

    travel: tuple[float, float, float, float, float, float] = parameter(
        (1.2, 0.8, -0.6, 1.0, 0.9, -1.5), unit="rad", size=6, doc="How far each axis turns."
    )
    duration: Number = parameter(1.5, unit="s", above=0.0, doc="How long the motion takes.")
    load: Number = parameter(10.0, unit="kg", minimum=0.0, doc="Mass at the tip of the arm.")
    ratio: Number = parameter(100.0, above=0.0, doc="Turns of a motor for one of its axis.")
    rotor: Number = parameter(2e-3, unit="kg*m^2", above=0.0, doc="Moment of inertia of a motor.")
    position_gain: Number = parameter(20.0, unit="1/s", above=0.0, doc="Gain of the controllers of positions.")
    gain: Number = parameter(60.0, unit="N*m*s/rad", above=0.0, doc="Torque of a motor if its axis lags by 1 rad/s.")
    drives: str = parameter("controlled", choices=("controlled", "ideal"), doc="What turns the axes.")
    space = "space"
    t_end = 2.0

    def stiffness(self) -> float:
        """Return the torque about an axis for a constant error of its angle, N m/rad."""
        return self.ratio * self.gain * self.position_gain

    def build(self) -> None:
        """Set up the bodies from the ground on, each with what turns it."""
        carrier = self.add("ground", Ground()).frame
        for number in range(6):
            joint = self.add(f"axis{number + 1}", Pivot(axis=_AXES[number]))
            self.connect(carrier, joint.a)
            tip = _TIPS[number]
            body = self.add(f"body{number + 1}", self._body(number))
            self.connect(joint.b, body.frame)
            weld = self.add(f"tip{number + 1}", Weld(displacement=tip))
            self.connect(body.frame, weld.a)
            carrier = weld.b
            self._drive(number + 1, joint)
        self.connect(carrier, self.add("tool", RigidBody(mass=self.load)).frame)

    @staticmethod
    def _body(number: int) -> RigidBody:
        """Return a body with the inertia of a cylinder from its joint to the next one."""
        mass, radius, tip = _MASSES[number], _RADII[number], _TIPS[number]
        square = sum(one * one for one in tip)
        across = mass * (radius * radius / 4.0 + square / 12.0)
        along = mass * (radius * radius / 2.0)
        # J = across 1 + (along - across) n n with n along the axis of the cylinder
        share = (along - across) / square
        x, y, z = tip
        return RigidBody(
            mass=mass,
            center=(0.5 * x, 0.5 * y, 0.5 * z),
            moments=(across + share * x * x, across + share * y * y, across + share * z * z),
            products=(share * x * y, share * x * z, share * y * z),
        )

    def _drive(self, number: int, joint: Pivot) -> None:
        """Give an axis its trajectory, a motor with a gear, and what makes it follow."""
        path = self.add(f"path{number}", MinimumJerk(travel=self.travel[number - 1], duration=self.duration))
        motor = self.add(f"motor{number}", Inertia(moment=self.rotor))
        gear = self.add(f"gear{number}", Gear(ratio=self.ratio))
        self.connect(motor.flange, gear.a)
        self.connect(joint.shaft, gear.b)
        if self.drives == "ideal":
            motion = self.add(f"motion{number}", RotationalMotion())
            self.connect(joint.shaft, motion.b)
            self.connect(path.output("value"), motion.input("place"))
            return
        source = self.add(f"torque{number}", RotationalSource())
        control = self.add(f"control{number}", ServoController(position_gain=self.position_gain, gain=self.gain))
        self.connect(motor.flange, source.b)
        self.connect(path.output("value"), control.input("set_point"))
        self.connect(path.output("rate"), control.input("set_rate"))
        self.connect(joint.output("angle"), control.input("measurement"))
        self.connect(joint.output("angular_velocity"), control.input("measured_rate"))
        self.connect(control.output("y"), source.input("value"))
        self.start[f"axis{number}.angle"] = 0.0
        self.start[f"axis{number}.angular_velocity"] = 0.0
