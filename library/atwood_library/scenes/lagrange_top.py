"""lagrange-top: a symmetric top with a fixed point."""

from __future__ import annotations

import math

from atwood import Number, ParameterError, Scene, connect, parameter
from atwood_library.joints.spherical import Spherical
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class LagrangeTop(Scene):
    """A symmetric top on a fixed tip (Goldstein, section 5.7), in one of its four motions.

    ``cusps``: released at rest but for its spin. ``loops``: thrown against its precession. ``waves``: thrown along with
    it, but slower than it would go steadily. ``steady``: thrown just as fast as it goes on. A spin that is too slow
    for a steady precession is refused there. ``momentum``: with the given angular momentum about the vertical, p_phi,
    its axis neither rising nor falling: the constants that its motion is found from (Goldstein, equations 5.54 to
    5.57).
    """

    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass.")
    height: Number = parameter(0.1, unit="m", above=0.0, doc="Distance of the centre of mass from the tip.")
    transverse: Number = parameter(
        0.015, unit="kg*m^2", above=0.0, doc="Moment of inertia across its axis, about the centre of mass."
    )
    axial: Number = parameter(0.01, unit="kg*m^2", above=0.0, doc="Moment of inertia about its axis.")
    inclination: Number = parameter(math.pi / 6.0, unit="rad", doc="Angle of the axis from the vertical at the start.")
    spin: Number = parameter(50.0, unit="rad/s", doc="Angular velocity about its own axis.")
    motion: str = parameter(
        "cusps",
        choices=("cusps", "loops", "waves", "steady", "momentum"),
        doc="Which of the four motions it begins, or by its momentum.",
    )
    vertical_momentum: Number = parameter(
        0.0, unit="kg*m^2/s", doc="Angular momentum about the vertical, for the motion from it."
    )
    space = "space"
    t_end = 2.0

    ground: Ground = Ground()
    tip: Spherical = Spherical()
    top: RigidBody = RigidBody(mass=mass)
    connections = [connect(ground.frame, tip.a), connect(tip.b, top.frame)]

    def steady_precession(self) -> float:
        """Return the slower rate of steady precession, rad/s: ``A cos(theta) w^2 - C s w + m g h = 0``.

        Goldstein, equation 5.76.
        """
        about_tip = self.transverse + self.mass * self.height**2
        a, b, c = about_tip * math.cos(self.inclination), self.axial * self.spin, self.mass * self.gravity * self.height
        if a == 0.0:
            return c / b
        root = b * b - 4.0 * a * c
        if root < 0.0:
            fast = 2.0 * math.sqrt(a * c) / self.axial
            raise ParameterError(
                "at this angle the top cannot precess steadily, since it spins too slowly",
                where=f"{self.path or type(self).__name__}.spin",
                advice=f"Give it at least {fast:.4g} rad/s, or another motion.",
            )
        return 2.0 * c / (b + math.copysign(math.sqrt(root), b))

    def precession_of(self, momentum: float) -> float:
        """Return the rate of precession at the start that an angular momentum about the vertical belongs to, rad/s.

        ``p_phi = A phi' sin(theta)^2 + C s cos(theta)`` (Goldstein, equation 5.56).
        """
        about_tip = self.transverse + self.mass * self.height**2
        across = about_tip * math.sin(self.inclination) ** 2
        if across == 0.0:
            raise ParameterError(
                "upright, its angular momentum about the vertical is that of its spin",
                where=f"{self.path or type(self).__name__}.vertical_momentum",
                advice="Incline its axis.",
            )
        return (momentum - self.axial * self.spin * math.cos(self.inclination)) / across

    def build(self) -> None:
        """Shape the top and set it off."""
        self.top.center = (0.0, 0.0, self.height)
        self.top.moments = (self.transverse, self.transverse, self.axial)
        share = {"cusps": 0.0, "loops": -1.0, "waves": 0.5, "steady": 1.0, "momentum": 0.0}[self.motion]
        precession = share * self.steady_precession() if share else 0.0
        if self.motion == "momentum":
            precession = self.precession_of(self.vertical_momentum)
        self.start["top.phi"], self.start["top.theta"], self.start["top.psi"] = 0.0, self.inclination, 0.0
        self.start["top.spin.x"] = -precession * math.sin(self.inclination)
        self.start["top.spin.y"] = 0.0
        self.start["top.spin.z"] = self.spin
