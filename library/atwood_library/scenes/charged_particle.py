"""charged-particle: a charge in uniform electric and magnetic fields."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from atwood import Number, Scalar, Scene, connect, parameter
from atwood_library.fields.charge import Charge
from atwood_library.parts.point_mass import PointMass


class ChargedParticle(Scene):
    """A charged particle in a uniform magnetic field, along y, and a uniform electric field across it.

    It goes round with the rate ``omega = q B/m`` and drifts with the velocity ``E x B/B^2`` (Jackson, Classical
    Electrodynamics, section 12.3). The fields are given by potentials, so that the momentum is ``m v + q A`` and
    depends on the gauge, and the motion does not. The gauge ``"x"`` keeps the canonical momentum along x where the
    electric field has no component along it, ``"z"`` that along z.
    """

    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass.")
    charge: Number = parameter(1.0, unit="C", doc="Charge.", symbol="q")
    magnetic: Number = parameter(2.0, unit="T", doc="Magnetic field along y.", symbol="B")
    electric_x: Number = parameter(0.0, unit="V/m", doc="Electric field along x.", symbol="E_x")
    electric_z: Number = parameter(0.5, unit="V/m", doc="Electric field along z.", symbol="E_z")
    speed: Number = parameter(1.0, unit="m/s", doc="Speed along x at the start.")
    gauge: str = parameter("symmetric", choices=("symmetric", "x", "z"), doc="Gauge of the vector potential.")
    gravity = 0.0
    t_end = 10.0

    source: Charge = Charge(charge=charge)
    particle: PointMass = PointMass(mass=mass)
    connections = [connect(source.point, particle.point)]
    start = {
        "particle.position.x": 0.0,
        "particle.position.z": 0.0,
        "particle.velocity.x": speed,
        "particle.velocity.z": 0.0,
    }

    def build(self) -> None:
        """Give the fields their potentials."""
        share = {"symmetric": 0.5, "x": 1.0, "z": 0.0}[self.gauge]

        def energy(x: Scalar, z: Scalar, *, electric_x: Scalar, electric_z: Scalar) -> Scalar:
            return -(electric_x * x + electric_z * z)

        def potential(x: Scalar, z: Scalar, *, magnetic: Scalar) -> Sequence[Scalar]:
            return share * magnetic * z, 0.0, (share - 1.0) * magnetic * x

        self.set("source.scalar_potential", energy)
        self.set("source.vector_potential", potential)

    def closed_form(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the circle that drifts; for a magnetic field that is not zero."""
        w, b = self.charge * self.magnetic / self.mass, self.magnetic
        drift_x, drift_z = -self.electric_z / b, self.electric_x / b  # E x B / B^2, with B along y
        vx, vz = self.speed - drift_x, -drift_z
        # v x B turns the velocity from z towards x: vx' = -w vz, vz' = w vx
        sine, cosine = np.sin(w * t), np.cos(w * t)
        return {
            "particle.position.x": drift_x * t + (vx * sine - vz * (1.0 - cosine)) / w,
            "particle.position.z": drift_z * t + (vz * sine + vx * (1.0 - cosine)) / w,
            "particle.velocity.x": drift_x + vx * cosine - vz * sine,
            "particle.velocity.z": drift_z + vz * cosine + vx * sine,
        }

    def period(self) -> float:
        """Return the time for one turn, s."""
        period: float = 2.0 * math.pi * self.mass / abs(self.charge * self.magnetic)
        return period
