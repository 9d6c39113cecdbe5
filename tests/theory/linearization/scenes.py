"""Scenes with known linear models."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from atwood import Scene
from atwood_library import (
    Disc,
    Ground,
    Pivot,
    PointMass,
    RigidBody,
    RollingDisc,
    RotaryDrive,
    Weld,
)


def bicycle(heading: float = 0.0, place: Sequence[float] = (0.0, 0.0)) -> Scene:
    """Return the benchmark bicycle (Meijaard, Papadopoulos, Ruina, Schwab, Proc. R. Soc. A 463, 2007, table 1).

    Its axes are x forward and z up, the paper's x forward and z down; the whole can head anywhere.
    """
    base, trail, tilt = 1.02, 0.08, math.pi / 10.0
    rear_radius, front_radius = 0.3, 0.35
    steering = np.array([-math.sin(tilt), 0.0, math.cos(tilt)])
    head = np.array([base + trail, 0.0, 0.0]) + 0.9 / math.cos(tilt) * steering
    rear, front = np.array([0.0, 0.0, rear_radius]), np.array([base, 0.0, front_radius])
    scene = Scene(space="space", gravity=9.81)
    ground = scene.add("ground", Ground())
    frame = scene.add(
        "frame",
        RigidBody(
            mass=85.0,
            center=tuple(np.array([0.3, 0.0, 0.9]) - rear),
            moments=(9.2, 11.0, 2.8),
            products=(0.0, -2.4, 0.0),
        ),
    )
    to_head = scene.add("to_head", Weld(displacement=tuple(head - rear)))
    steer = scene.add("steer", Pivot(axis=tuple(steering)))
    fork_end = scene.add("fork_end", Weld(displacement=tuple(front - head)))
    fork = scene.add(
        "fork",
        RigidBody(
            mass=4.0,
            center=tuple(np.array([0.9, 0.0, 0.7]) - head),
            moments=(0.05892, 0.06, 0.00708),
            products=(0.0, 0.00756, 0.0),
        ),
    )
    scene.connect(frame.frame, to_head.a)
    scene.connect(to_head.b, steer.a)
    scene.connect(steer.b, fork.frame)
    scene.connect(steer.b, fork_end.a)
    axis = (0.0, 1.0, 0.0)
    wheels = (
        ("rear", frame.frame, 2.0, 0.0603, 0.12, rear_radius),
        ("front", fork_end.b, 3.0, 0.1405, 0.28, front_radius),
    )
    for name, carrier, mass, across, axial, radius in wheels:
        wheel = scene.add(name, RigidBody(mass=mass, moments=(across, axial, across)))
        axle = scene.add(f"{name}_axle", Pivot(axis=axis))
        contact = scene.add(f"{name}_contact", RollingDisc(radius=radius, axis=axis))
        scene.connect(carrier, axle.a)
        scene.connect(axle.b, wheel.frame)
        scene.connect(ground.frame, contact.a)
        scene.connect(contact.b, wheel.frame)
    scene.start["frame.phi"], scene.start["frame.theta"], scene.start["frame.psi"] = heading, 0.0, 0.0
    scene.start["rear_contact.displacement_1"], scene.start["rear_contact.displacement_2"] = place
    return scene


def bicycle_matrix(speed: float) -> np.ndarray:
    """Return the matrix of the linearised equations of the bicycle, by the paper's appendix A."""
    w, c, tilt, g = 1.02, 0.08, math.pi / 10.0, 9.81
    rear, front = 0.3, 0.35
    mass_r, mass_b, mass_h, mass_f = 2.0, 85.0, 4.0, 3.0
    xb, zb, xh, zh = 0.3, -0.9, 0.9, -0.7
    rxx, ryy, fxx, fyy = 0.0603, 0.12, 0.1405, 0.28
    sine, cosine = math.sin(tilt), math.cos(tilt)
    mt = mass_r + mass_b + mass_h + mass_f
    xt = (xb * mass_b + xh * mass_h + w * mass_f) / mt
    zt = (-rear * mass_r + zb * mass_b + zh * mass_h - front * mass_f) / mt
    txx = rxx + 9.2 + 0.05892 + fxx + mass_r * rear**2 + mass_b * zb**2 + mass_h * zh**2 + mass_f * front**2
    txz = 2.4 - 0.00756 - mass_b * xb * zb - mass_h * xh * zh + mass_f * w * front
    tzz = rxx + 2.8 + 0.00708 + fxx + mass_b * xb**2 + mass_h * xh**2 + mass_f * w**2
    ma = mass_h + mass_f
    xa, za = (xh * mass_h + w * mass_f) / ma, (zh * mass_h - front * mass_f) / ma
    axx = 0.05892 + fxx + mass_h * (zh - za) ** 2 + mass_f * (front + za) ** 2
    axz = -0.00756 - mass_h * (xh - xa) * (zh - za) + mass_f * (w - xa) * (front + za)
    azz = 0.00708 + fxx + mass_h * (xh - xa) ** 2 + mass_f * (w - xa) ** 2
    ua = (xa - w - c) * cosine - za * sine
    all_ = ma * ua**2 + axx * sine**2 + 2.0 * axz * sine * cosine + azz * cosine**2
    alx, alz = -ma * ua * za + axx * sine + axz * cosine, ma * ua * xa + axz * sine + azz * cosine
    mu = c / w * cosine
    sr, sf = ryy / rear, fyy / front
    st, sa = sr + sf, ma * ua + mu * mt * xt
    mass = np.array([[txx, alx + mu * txz], [alx + mu * txz, all_ + 2.0 * mu * alz + mu**2 * tzz]])
    k0 = np.array([[mt * zt, -sa], [-sa, -sa * sine]])
    k2 = np.array([[0.0, (st - mt * zt) / w * cosine], [0.0, (sa + sf * sine) / w * cosine]])
    turning = mu * st + sf * cosine
    c1 = np.array(
        [
            [0.0, turning + txz / w * cosine - mu * mt * zt],
            [-turning, alz / w * cosine + mu * (sa + tzz / w * cosine)],
        ]
    )
    below = -np.linalg.solve(mass, np.hstack([g * k0 + speed**2 * k2, speed * c1]))
    return np.vstack([np.hstack([np.zeros((2, 2)), np.eye(2)]), below])


def hoop(rate: float, radius: float = 0.8) -> Scene:
    """Return a bead on a hoop that a motor turns about the vertical; its angle is measured from below."""
    scene = Scene(space="space", gravity=9.81)
    ground = scene.add("ground", Ground())
    motor = scene.add("motor", RotaryDrive(axis=(0.0, 0.0, 1.0), rotation=lambda t: rate * t))
    pivot = scene.add("pivot", Pivot(axis=(0.0, 1.0, 0.0)))
    arm = scene.add("arm", Weld(displacement=(0.0, 0.0, -radius)))
    bead = scene.add("bead", PointMass(mass=0.3))
    scene.connect(ground.frame, motor.a)
    scene.connect(motor.b, pivot.a)
    scene.connect(pivot.b, arm.a)
    scene.connect(arm.b, bead.point)
    return scene


def disc(radius: float, hole: float, heading: float = 0.0) -> Scene:
    """Return a disc, or a hoop if the hole is as large, that rolls on a table."""
    scene = Scene(space="space", gravity=9.81)
    ground, contact = scene.add("ground", Ground()), scene.add("contact", RollingDisc(radius=radius, axis=(0, 0, 1)))
    body = scene.add("disc", Disc(radius=radius, inner_radius=hole, mass=0.7, axis="z"))
    scene.connect(ground.frame, contact.a)
    scene.connect(contact.b, body.frame)
    scene.start["disc.phi"], scene.start["disc.theta"], scene.start["disc.psi"] = heading, math.pi / 2.0, 0.4
    return scene
