"""wilberforce-pendulum: a body on a coil spring that goes over from springing into twisting and back."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.fields.coordinate_lagrangian import CoordinateLagrangian
from atwood_library.joints.cylindrical import Cylindrical
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class WilberforcePendulum(Scene):
    """A body hangs on a coil spring whose stretching and twisting are coupled by the energy ``e z theta/2``.

    Tuned so that both go at one rate w, its modes have the rates ``w^2 -+ e/(2 sqrt(m I))``, and it goes over from
    springing up and down into twisting and back in the beat of both (Berg and Marshall, American Journal of Physics 59,
    1991). Displacement and angle are those from where it hangs at rest.
    """

    mass: Number = parameter(0.5, unit="kg", above=0.0, doc="Mass of the body.")
    inertia: Number = parameter(1.4e-4, unit="kg*m^2", above=0.0, doc="Moment of inertia about the vertical.")
    rate: Number = parameter(2.3, unit="rad/s", above=0.0, doc="Rate w of either motion without the other.")
    coupling: Number = parameter(9.3e-3, unit="N", doc="Coupling e.", symbol="e")
    lift: Number = parameter(0.1, unit="m", doc="Height above rest at the start.")
    space = "space"
    gravity = 0.0
    t_end = 40.0

    ground: Ground = Ground()
    coil: Cylindrical = Cylindrical(axis=(0.0, 0.0, 1.0))
    body: RigidBody = RigidBody(mass=mass)
    twist: CoordinateLagrangian = CoordinateLagrangian(shafts=1, slides=1)
    connections = [connect(ground.frame, coil.a), connect(coil.b, body.frame)]
    start = {"coil.displacement": lift, "coil.speed": 0.0, "coil.angle": 0.0, "coil.angular_velocity": 0.0}

    def build(self) -> None:
        """Tune the spring, and couple its motions."""
        square = self.rate**2
        self.set("body.moments", (self.inertia, self.inertia, self.inertia))
        self.set("coil.stiffness", self.mass * square)
        self.set("coil.torsional_stiffness", self.inertia * square)
        self.set(
            "twist.function", lambda angle_1, displacement_1, *, coupling: -0.5 * coupling * angle_1 * displacement_1
        )
        self.connect(self.coil.shaft, self.twist.shaft[0])
        self.connect(self.coil.carriage, self.twist.slide[0])

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the beat."""
        share = 0.5 * self.coupling / math.sqrt(self.mass * self.inertia)
        low, high = (np.cos(np.sqrt(self.rate**2 + side * share) * t) for side in (-1.0, 1.0))
        size = self.lift * math.sqrt(self.mass / self.inertia)
        return {"coil.displacement": 0.5 * self.lift * (high + low), "coil.angle": 0.5 * size * (high - low)}
