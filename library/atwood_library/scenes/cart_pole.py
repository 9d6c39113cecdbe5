"""cart-pole: a pendulum that a sampled regulator keeps upright on a cart."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scene, connect, parameter
from atwood_library.blocks.sampled_feedback import SampledFeedback
from atwood_library.forces.force import Force
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.slider import Slider
from atwood_library.parts.ground import Ground
from atwood_library.parts.link import Link
from atwood_library.parts.point_mass import PointMass


class CartPole(Scene):
    """A bob on a light pole, hinged on a cart, which a sampled linear-quadratic regulator keeps upright.

    The regulator measures place and angle with their rates at sample times and holds the force between them. Its gains
    are those that cost ``x^2 + 10 phi^2 + F^2/100`` least, of the linear model about the upright (`linear_model`).
    """

    cart_mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the cart.")
    bob_mass: Number = parameter(0.2, unit="kg", above=0.0, doc="Mass of the bob.")
    length: Number = parameter(0.5, unit="m", above=0.0, doc="Length of the pole.")
    period: Number = parameter(0.02, unit="s", above=0.0, doc="Sample time of the regulator.")
    lean: Number = parameter(0.2, unit="rad", doc="How far it leans at the start.")
    t_end = 6.0

    ground: Ground = Ground()
    rail: Slider = Slider()
    cart: PointMass = PointMass(mass=cart_mass)
    hinge: Pivot = Pivot()
    pole: Link = Link(length=length, mass=bob_mass, center=length, moment=0.0)
    push: Force = Force()
    regulator: SampledFeedback = SampledFeedback(period=period)
    connections = [
        connect(ground.frame, rail.a),
        connect(rail.b, cart.point),
        connect(rail.b, hinge.a),
        connect(hinge.b, pole.a),
        connect(cart.point, push.point),
    ]
    start = {
        "rail.displacement": 0.0,
        "hinge.angle": 0.5 * math.pi + lean,
        "rail.speed": 0.0,
        "hinge.angular_velocity": 0.0,
    }

    def build(self) -> None:
        """Close the loop with the gains of the regulator."""
        self.regulator.gains = tuple(self.gains())
        self.regulator.targets = (0.0, 0.5 * math.pi)
        measured = (
            self.rail.output("displacement"),
            self.hinge.output("angle"),
            self.rail.output("speed"),
            self.hinge.output("angular_velocity"),
        )
        for number, output in enumerate(measured, start=1):
            self.connect(output, self.regulator.input(f"u_{number}"))
        self.connect(self.regulator.output("y"), self.push.input("value"))

    def linear_model(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return A and B of ``z' = A z + B F`` about the upright, with z the place, the lean, and their rates.

        With the lean phi counter-clockwise the bob is at ``x - l sin(phi)``, so that ``M x'' = F + m g phi`` and
        ``l phi'' = g phi + x''``.
        """
        m, l, g = self.bob_mass / self.cart_mass, self.length, self.gravity
        a, b = np.zeros((4, 4)), np.zeros((4, 1))
        a[0, 2] = a[1, 3] = 1.0
        a[2, 1], a[3, 1] = m * g, (1.0 + m) * g / l
        b[2, 0], b[3, 0] = 1.0 / self.cart_mass, 1.0 / (self.cart_mass * l)
        return a, b

    def gains(self) -> NDArray[np.float64]:
        """Return the gains of the regulator, from the discrete algebraic Riccati equation of the sampled model."""
        from scipy.linalg import expm, solve_discrete_are

        a, b = self.linear_model()
        both = expm(self.period * np.block([[a, b], [np.zeros((1, 5))]]))
        phi, gamma = both[:4, :4], both[:4, 4:]
        weights, cost = np.diag([1.0, 10.0, 0.0, 0.0]), np.array([[0.01]])
        p = solve_discrete_are(phi, gamma, weights, cost)
        found: NDArray[np.float64] = np.linalg.solve(cost + gamma.T @ p @ gamma, gamma.T @ p @ phi)[0]
        return found
