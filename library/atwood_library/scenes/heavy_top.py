"""heavy-top: an asymmetric body with a fixed point, under its weight."""

from __future__ import annotations

from atwood import Number, Scene, Triple, connect, parameter
from atwood_library.joints.spherical import Spherical
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class HeavyTop(Scene):
    """An asymmetric rigid body on a fixed point: no closed form, energy and vertical angular momentum are kept."""

    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass.")
    center: Triple = parameter(
        (0.05, 0.02, 0.3), unit="m", size=3, doc="Centre of mass from the fixed point, in the axes of the body."
    )
    moments: Triple = parameter(
        (0.02, 0.03, 0.04), unit="kg*m^2", size=3, doc="Moments of inertia about the centre of mass."
    )
    space = "space"
    t_end = 5.0

    ground: Ground = Ground()
    pivot: Spherical = Spherical()
    top: RigidBody = RigidBody(mass=mass, center=center, moments=moments)
    connections = [connect(ground.frame, pivot.a), connect(pivot.b, top.frame)]
    start = {
        "top.phi": 0.0,
        "top.theta": 0.6,
        "top.psi": 0.3,
        "top.spin.x": 0.5,
        "top.spin.y": -1.0,
        "top.spin.z": 12.0,
    }
