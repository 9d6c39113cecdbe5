"""billiards: a cue ball that meets another one on a table."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.contacts.ball_contact import BallContact
from atwood_library.contacts.ball_pair_contact import BallPairContact
from atwood_library.parts.ground import Ground
from atwood_library.parts.sphere import Sphere


class Billiards(Scene):
    """A cue ball slides, then rolls, on a cloth, and meets another ball off its middle.

    Friction turns both balls' slips into rolling: first where the balls meet, then on the cloth, on which paths are
    parabolas until the balls roll (G. Coriolis, *Theorie mathematique des effets du jeu de billard*, 1835).
    """

    radius: Number = parameter(0.0286, unit="m", above=0.0, doc="Radius of the balls.")
    mass: Number = parameter(0.17, unit="kg", above=0.0, doc="Mass of each ball.")
    cloth: Number = parameter(0.2, minimum=0.0, doc="Coefficient of friction of balls and cloth.")
    friction: Number = parameter(0.05, minimum=0.0, doc="Coefficient of friction of ball and ball.")
    restitution: Number = parameter(0.95, minimum=0.0, maximum=1.0, doc="Share of the speed that an impact leaves.")
    speed: Number = parameter(2.0, unit="m/s", above=0.0, doc="Speed of the cue ball at the start.")
    spin: Number = parameter(-30.0, unit="rad/s", doc="Its spin across its way: positive rolls forwards.")
    away: Number = parameter(0.3, unit="m", above=0.0, doc="How far away the other ball is.")
    aside: Number = parameter(0.02, unit="m", doc="How far the other ball is beside the cue ball's way.")
    space = "space"
    t_end = 1.0

    ground: Ground = Ground()
    cue: Sphere = Sphere(mass=mass, radius=radius)
    ball: Sphere = Sphere(mass=mass, radius=radius)
    below_cue: BallContact = BallContact(radius=radius, friction=cloth)
    below_ball: BallContact = BallContact(radius=radius, friction=cloth)
    pair: BallPairContact = BallPairContact(
        radius_a=radius, radius_b=radius, friction=friction, restitution=restitution
    )
    connections = [
        connect(ground.frame, below_cue.plane),
        connect(cue.frame, below_cue.ball),
        connect(ground.frame, below_ball.plane),
        connect(ball.frame, below_ball.ball),
        connect(cue.frame, pair.a),
        connect(ball.frame, pair.b),
    ]

    def build(self) -> None:
        """Place both balls on the cloth."""
        places = {"cue": (0.0, 0.0, self.radius), "ball": (self.away, self.aside, self.radius)}
        for name, place in places.items():
            moves = self.speed if name == "cue" else 0.0
            turns = self.spin if name == "cue" else 0.0
            for axis, where in zip("xyz", place, strict=True):
                self.start[f"{name}.position.{axis}"] = where
                self.start[f"{name}.velocity.{axis}"] = moves if axis == "x" else 0.0
                self.start[f"{name}.angular_velocity.{axis}"] = turns if axis == "y" else 0.0
            self.start.update({f"{name}.{angle}": 0.0 for angle in ("phi", "theta", "psi")})
