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
    RollingDisc,
    RotaryDrive,
    Weld,
)
from atwood_library.scenes import BenchmarkBicycle


def bicycle(heading: float = 0.0, place: Sequence[float] = (0.0, 0.0)) -> Scene:
    """Return the benchmark bicycle, which may stand anywhere and head anywhere."""
    scene = BenchmarkBicycle()
    del scene.start["frame.x_axis.y"], scene.start["frame.y_axis.z"]
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
