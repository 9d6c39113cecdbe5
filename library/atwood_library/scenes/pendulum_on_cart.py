"""pendulum-on-cart: a pendulum whose support slides freely on a rail."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.joints.slider import Slider
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass
from atwood_library.parts.rod import Rod


class PendulumOnCart(Scene):
    """A cart that slides freely on a horizontal rail, with a pendulum on it, released at rest."""

    cart_mass: Number = parameter(2.0, unit="kg", above=0.0, doc="Mass of the cart.")
    bob_mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the bob.")
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the rod.")
    t_end = 5.0

    ground: Ground = Ground()
    rail: Slider = Slider()
    cart: PointMass = PointMass(mass=cart_mass)
    rod: Rod = Rod(length=length)
    bob: PointMass = PointMass(mass=bob_mass)
    connections = [
        connect(ground.frame, rail.a),
        connect(rail.b, cart.point),
        connect(cart.point, rod.a),
        connect(rod.b, bob.point),
    ]
    start = {"rail.displacement": 0.0, "rod.angle": 1.0, "rail.speed": 0.0, "rod.angular_velocity": 0.0}
