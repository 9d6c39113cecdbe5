"""The mechanisms that are timed, with what each program needs to know of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from atwood import Model
from atwood.arrays import FloatArray
from atwood_library.scenes import Chain, DoublePendulum, SimplePendulum

__all__ = ["GRAVITY", "Mechanism", "chain", "double_pendulum", "pendulum"]

GRAVITY = 9.81


@dataclass(frozen=True, eq=False)
class Mechanism:
    """Equal links in a row, released at rest.

    Attributes
    ----------
    name, scene
        What it is called, and Atwood's scene.
    links, length, mass
        The number of links, and the length (m) and the mass (kg) of one.
    t_end
        How long it moves, s.
    by_angles
        Whether its error is that of the angles, in rad, and not that of the tip, in m.
    start
        The angle of all links at the start, rad.
    """

    name: str
    scene: Model
    links: int
    length: float
    mass: float
    t_end: float
    by_angles: bool = False
    start: float = np.pi / 2.0

    def angles_at_start(self) -> FloatArray:
        """Return the angles from the vertical."""
        return np.full(self.links, self.start)

    def from_angles(self, angles: Sequence[float] | FloatArray) -> FloatArray:
        """Return what is compared at the end, from the absolute angles of the links."""
        angles = np.asarray(angles, dtype=float)[: self.links]
        if self.by_angles:
            return angles
        return self.length * np.array([np.sum(np.sin(angles)), -np.sum(np.cos(angles))])

    def from_positions(self, positions: Sequence[float] | FloatArray) -> FloatArray:
        """Return what is compared at the end, from the positions x, z of the bobs, one after the other."""
        places = np.asarray(positions, dtype=float)[: 2 * self.links].reshape(self.links, 2)
        if not self.by_angles:
            return places[-1].copy()
        apart = np.diff(places, axis=0, prepend=np.zeros((1, 2)))
        return np.arctan2(apart[:, 0], -apart[:, 1])

    def error(self, values: FloatArray, reference: FloatArray) -> float:
        """Return the largest difference; whole turns are none."""
        difference = np.asarray(values) - reference
        if self.by_angles:
            difference = (difference + np.pi) % (2.0 * np.pi) - np.pi
        return float(np.max(np.abs(difference)))


def pendulum() -> Mechanism:
    """Return the library's simple pendulum for 10 s, as it starts there."""
    return Mechanism("pendulum", SimplePendulum(), 1, 1.0, 1.0, 10.0, by_angles=True, start=1.0)


def double_pendulum() -> Mechanism:
    """Return the double pendulum with m = l = 1, both links released horizontally, for 10 s."""
    return Mechanism("double pendulum", DoublePendulum(), 2, 1.0, 1.0, 10.0, by_angles=True)


def chain(links: int) -> Mechanism:
    """Return a chain of links of length and mass 1/N, released horizontally, for 1 s."""
    return Mechanism(f"chain of {links}", Chain(links=links, mass=1.0 / links), links, 1.0 / links, 1.0 / links, 1.0)
