"""bead-on-surface: a bead on a sphere, a cone, a bowl or a torus."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.point_on_surface import PointOnSurface
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass

_SHAPES = {
    "sphere": ("sin(p)*cos(q)", "sin(p)*sin(q)", "-cos(p)"),
    "cone": ("p*cos(q)", "p*sin(q)", "p"),
    "bowl": ("p*cos(q)", "p*sin(q)", "0.5*p**2"),
    "torus": ("(2 + cos(p))*cos(q)", "(2 + cos(p))*sin(q)", "sin(p)"),
}


class BeadOnSurface(Scene):
    """A bead slides without friction on a surface of revolution about the vertical.

    Its angular momentum about the axis is kept. On a sphere it is a spherical pendulum, with p the angle from the
    downward vertical and q the azimuth; on a cone of half angle 45 degrees p is the distance from the axis
    (Landau and Lifshitz, Mechanics, section 14).
    """

    shape: str = parameter("sphere", choices=tuple(_SHAPES), doc="Shape of the surface.")
    scale: Number = parameter(1.0, unit="m", above=0.0, doc="Size of the surface: radius of the sphere.", symbol="a")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the bead.")
    away: Number = parameter(1.0, unit="rad", doc="First parameter at the start: angle, or distance over size.")
    azimuth_rate: Number = parameter(2.0, unit="rad/s", doc="Rate of the azimuth at the start.")
    space = "space"
    t_end = 5.0

    ground: Ground = Ground()
    surface: PointOnSurface = PointOnSurface(scale=scale)
    bead: PointMass = PointMass(mass=mass)
    connections = [connect(ground.frame, surface.a), connect(surface.b, bead.point)]
    start = {
        "surface.parameter_1": away,
        "surface.parameter_2": 0.0,
        "surface.rate_1": 0.0,
        "surface.rate_2": azimuth_rate,
    }

    def build(self) -> None:
        """Bend the surface."""
        self.set("surface.surface", _SHAPES[self.shape])
        first = {"sphere": "theta", "torus": "theta"}.get(self.shape, "rho")
        self.symbols.update({"surface.parameter_1": first, "surface.parameter_2": "phi"})
