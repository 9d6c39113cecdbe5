"""rolling-disc: a coin, a hoop or Euler's disc that rolls on a table."""

from __future__ import annotations

import math

from atwood import Number, ParameterError, Scene, connect, parameter
from atwood_library.joints.rolling_disc import RollingDisc as RollingContact
from atwood_library.parts.disc import Disc
from atwood_library.parts.ground import Ground


class RollingDisc(Scene):
    """A coin, a hoop or Euler's disc rolls on a level table without slipping.

    Its motion (Routh, Advanced Rigid Dynamics, art. 244) begins in one of four ways. ``steady``: it leans at a constant
    angle and rolls along a circle about the origin. ``wobble``: it is set off like that, but falling at first, so that
    it leans more and less in turn. ``coin``: the centre is at rest and the contact runs round it, as with Euler's disc;
    this motion has a rate of precession of its own. ``straight``: it rolls upright along a line, which wobbles and
    turns if it is slow.
    """

    radius: Number = parameter(0.1, unit="m", above=0.0, doc="Radius.", symbol="r")
    hole: Number = parameter(0.0, unit="m", minimum=0.0, doc="Radius of its hole: a hoop, if it is the radius.")
    mass: Number = parameter(0.5, unit="kg", above=0.0, doc="Mass.")
    inclination: Number = parameter(math.radians(60.0), unit="rad", doc="Angle of its axis from the vertical at first.")
    precession: Number = parameter(6.0, unit="rad/s", doc="Rate at which its axis turns about the vertical at first.")
    fall: Number = parameter(2.0, unit="rad/s", doc="For 'wobble': rate at which the inclination grows at first.")
    speed: Number = parameter(1.0, unit="m/s", doc="For 'straight': speed of its centre.")
    motion: str = parameter("wobble", choices=("steady", "wobble", "coin", "straight"), doc="Which motion it begins.")
    space = "space"
    t_end = 4.0

    ground: Ground = Ground()
    contact: RollingContact = RollingContact(radius=radius, axis=(0.0, 0.0, 1.0))
    disc: Disc = Disc(radius=radius, inner_radius=hole, mass=mass, axis="z")
    connections = [connect(ground.frame, contact.a), connect(contact.b, disc.frame)]

    def across(self) -> float:
        """Return the moment of inertia about a diameter, half of that about the axis, kg m^2."""
        return 0.25 * self.mass * (self.radius**2 + self.hole**2)

    def steady_spin(self, precession: float) -> float:
        """Return the angular velocity about its axis with which it leans at a constant angle, rad/s."""
        square, weight = self.mass * self.radius**2, self.mass * self.gravity * self.radius
        sine, cosine = math.sin(self.inclination), math.cos(self.inclination)
        torque = cosine * (self.across() * precession**2 * sine - weight)
        return torque / ((2.0 * self.across() + square) * precession * sine)

    def build(self) -> None:
        """Set the disc off."""
        inclination, precession, fall, spin = self.inclination, self.precession, 0.0, 0.0
        where = self.path or type(self).__name__
        if self.motion == "straight":
            inclination, precession, spin = 0.5 * math.pi, 0.0, self.speed / self.radius
        elif not 0.0 < inclination < math.pi:
            raise ParameterError(
                "a disc that lies flat has no contact point",
                where=f"{where}.inclination",
                advice="Give an angle between zero and pi; pi/2 is upright.",
            )
        elif self.motion == "coin":
            precession = math.sqrt(self.mass * self.gravity * self.radius / (self.across() * math.sin(inclination)))
        elif precession == 0.0:
            raise ParameterError(
                "it falls over unless its axis turns",
                where=f"{where}.precession",
                advice="Give a rate other than zero, or the motion 'straight'.",
            )
        else:
            spin, fall = self.steady_spin(precession), self.fall if self.motion == "wobble" else 0.0
        self.start["disc.phi"], self.start["disc.theta"], self.start["disc.psi"] = 0.0, inclination, 0.0
        self.start["disc.spin.x"] = -precession * math.sin(inclination)
        self.start["disc.spin.y"], self.start["disc.spin.z"] = fall, spin
        self.start["contact.displacement_1"] = -self.radius * spin / precession if precession else 0.0
        self.start["contact.displacement_2"] = 0.0
