"""andrews-squeezer: seven bodies in three loops, driven by a motor against a spring."""

from __future__ import annotations

import math

from atwood import Number, Scene, connect, parameter
from atwood_library.forces.spring import Spring
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.link import Link
from atwood_library.parts.rigid_body import RigidBody

_START = {
    "beta": -0.06171389001427645,
    "gamma": 0.45527981916307037,
    "Phi": 0.22266839016588588,
    "delta": 0.48736497954384256,
    "Omega": -0.22266839016588588,
    "epsilon": 1.2305474445498212,
}


class AndrewsSqueezer(Scene):
    """Andrews' squeezing mechanism: seven plane bodies, ten hinges, three loops, one degree of freedom.

    A constant torque speeds its crank up from rest to two and a half turns in 30 ms (Hairer and Wanner, Solving
    Ordinary Differential Equations II, section VII.7; Schiehlen, Multibody Systems Handbook, 1990). The angles of the
    literature are those of bodies here: beta that of `k1`, beta + Theta of `k2`, gamma of `k3`, Phi + delta of `k4`
    plus a quarter turn, delta of `k5`, Omega + epsilon of `k6`, epsilon of `k7`.
    """

    torque: Number = parameter(0.033, unit="N*m", doc="Torque of the motor on the crank.")
    stiffness: Number = parameter(4530.0, unit="N/m", minimum=0.0, doc="Stiffness of the spring.")
    natural_length: Number = parameter(0.07785, unit="m", doc="Length of the spring without force.")
    gravity = 0.0
    t_end = 0.03

    base_o: Ground = Ground()
    base_a: Ground = Ground(position=(-0.06934, 0.0, -0.00227))
    base_b: Ground = Ground(position=(-0.03635, 0.0, 0.03273))
    base_c: Ground = Ground(position=(0.014, 0.0, 0.072))
    k1: Link = Link(length=0.007, mass=0.04325, center=0.00092, moment=2.194e-6)
    k2: Link = Link(length=0.028, mass=0.00365, center=0.028 - 0.0115, moment=4.41e-7)
    k3: RigidBody = RigidBody(mass=0.02373, center=(0.01043, 0.0, -0.01874), moments=(0.0, 5.255e-6, 0.0))
    k4: Link = Link(length=0.02, mass=0.00706, center=0.02 - 0.01421, moment=5.667e-7)
    k5: RigidBody = RigidBody(mass=0.0705, center=(0.02308, 0.0, 0.00916), moments=(0.0, 1.169e-5, 0.0))
    k6: Link = Link(length=0.02, mass=0.00706, center=0.02 - 0.01421, moment=5.667e-7)
    k7: RigidBody = RigidBody(mass=0.05498, center=(-0.00449, 0.0, -0.01228), moments=(0.0, 1.912e-5, 0.0))
    at_e: Weld = Weld(displacement=(0.0, 0.0, -0.035))
    at_d: Weld = Weld(displacement=(0.02, 0.0, -0.018))
    at_g: Weld = Weld(displacement=(0.04, 0.0, 0.0))
    at_h: Weld = Weld(displacement=(0.0, 0.0, -0.04))
    motor: Pivot = Pivot(motor=torque)
    hinge_f: Pivot = Pivot()
    hinge_b: Pivot = Pivot()
    hinge_e2: Pivot = Pivot()
    hinge_e4: Pivot = Pivot()
    hinge_e6: Pivot = Pivot()
    hinge_g: Pivot = Pivot()
    hinge_h: Pivot = Pivot()
    hinge_a5: Pivot = Pivot()
    hinge_a7: Pivot = Pivot()
    spring: Spring = Spring(stiffness=stiffness, natural_length=natural_length)
    connections = [
        connect(base_o.frame, motor.a),
        connect(motor.b, k1.a),
        connect(k1.b, hinge_f.a),
        connect(hinge_f.b, k2.b),
        connect(base_b.frame, hinge_b.a),
        connect(hinge_b.b, k3.frame),
        connect(k3.frame, at_e.a),
        connect(k3.frame, at_d.a),
        connect(at_e.b, hinge_e2.a),
        connect(hinge_e2.b, k2.a),
        connect(at_e.b, hinge_e4.a),
        connect(hinge_e4.b, k4.b),
        connect(at_e.b, hinge_e6.a),
        connect(hinge_e6.b, k6.b),
        connect(base_a.frame, hinge_a5.a),
        connect(hinge_a5.b, k5.frame),
        connect(k5.frame, at_g.a),
        connect(at_g.b, hinge_g.a),
        connect(hinge_g.b, k4.a),
        connect(base_a.frame, hinge_a7.a),
        connect(hinge_a7.b, k7.frame),
        connect(k7.frame, at_h.a),
        connect(at_h.b, hinge_h.a),
        connect(hinge_h.b, k6.a),
        connect(spring.a, at_d.b),
        connect(spring.b, base_c.frame),
    ]
    start = {"k1.angle": _START["beta"], "k1.angular_velocity": 0.0}
    guess = {
        "k2.angle": _START["beta"],
        "k3.angle": _START["gamma"],
        "k4.angle": _START["Phi"] + _START["delta"] - 0.5 * math.pi,
        "k5.angle": _START["delta"],
        "k6.angle": _START["Omega"] + _START["epsilon"],
        "k7.angle": _START["epsilon"],
    }
