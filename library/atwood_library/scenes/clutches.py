"""clutches: four rotors, joined by three clutches that are pressed one after another."""

from __future__ import annotations

import math

from atwood import Number, Scene, parameter, select, sin
from atwood_library.contacts.rotational_friction import RotationalFriction
from atwood_library.drives.inertia import Inertia
from atwood_library.drives.rotational_source import RotationalSource

_TURN = 2.0 * math.pi


class Clutches(Scene):
    """A motor drives four rotors through three clutches, that slip, stick and let go again.

    It is `Modelica.Mechanics.Rotational.Examples.CoupledClutches` of the Modelica Standard Library.
    """

    moment: Number = parameter(1.0, unit="kg*m^2", above=0.0, doc="Moment of inertia of each rotor.")
    drive: Number = parameter(10.0, unit="N*m", doc="Amplitude of the motor's torque.")
    frequency: Number = parameter(5.0, unit="1/s", above=0.0, doc="Frequency of that torque.")
    rate: Number = parameter(10.0, unit="rad/s", doc="Rate of the first rotor at the start.")
    t_end = 1.2

    def build(self) -> None:
        """Join the rotors."""
        amplitude, angular = self.drive, _TURN * self.frequency
        rotors = [self.add(f"rotor{i + 1}", Inertia(moment=self.moment)) for i in range(4)]
        motor = self.add("motor", RotationalSource(value=lambda t: amplitude * sin(angular * t), against="ground"))
        self.connect(rotors[0].flange, motor.b)
        levels = (
            lambda t: sin(0.2 * _TURN * t + 0.5 * math.pi),
            lambda t: select(t < 0.4, 0.0, 1.0),
            lambda t: select(t < 0.9, 0.0, 1.0),
        )
        for i, level in enumerate(levels):
            clutch = self.add(f"clutch{i + 1}", RotationalFriction(sliding="10", peak=1.1, level=level))
            self.connect(rotors[i].flange, clutch.a)
            self.connect(rotors[i + 1].flange, clutch.b)
        for i in range(4):
            self.start[f"rotor{i + 1}.angle"] = 0.0
            self.start[f"rotor{i + 1}.angular_velocity"] = 0.0 if i else self.rate
