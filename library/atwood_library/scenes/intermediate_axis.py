"""intermediate-axis: a body that is set spinning about its middle axis, and tumbles."""

from __future__ import annotations

from atwood import Number, Scene, Triple, parameter
from atwood_library.parts.rigid_body import RigidBody


class IntermediateAxis(Scene):
    """A free body that spins almost about its axis of middle inertia, and turns over again and again.

    Rotation about the middle axis is unstable (Landau and Lifshitz, Mechanics, section 37): the deviation grows as
    ``exp(w t sqrt((J2 - J1)(J3 - J2)/(J1 J3)))``.
    """

    moments: Triple = parameter((1.0, 2.0, 3.0), unit="kg*m^2", size=3, doc="Principal moments of inertia, rising.")
    rate: Number = parameter(1.0, unit="rad/s", doc="Angular velocity about the middle axis.")
    deviation: Number = parameter(1e-3, unit="rad/s", doc="Angular velocity about the axis of least inertia.")
    space = "space"
    gravity = 0.0
    t_end = 60.0

    body: RigidBody = RigidBody(moments=moments)
    start = {"body.spin.x": deviation, "body.spin.y": rate, "body.spin.z": 0.0}
