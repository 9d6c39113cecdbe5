"""One coordinate that is left: its effective potential and inertia, and the rates of the ignorable ones.

With momenta p of the ignorable coordinates c, and the coordinate s that is left,

    c' = C^-1 (p - b_c - m s'),    U_eff = U + (p - b_c).C^-1 (p - b_c)/2,    mu = M_ss - m.C^-1 m,

where C and m are the blocks ``M_cc`` and ``M_cs`` (Goldstein, section 8.3: Routh's procedure). Then
``mu s'^2/2 + U_eff = h``; terms of L that are linear in s' change nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from atwood.arrays import FloatArray
from atwood.late import dataclass
from atwood.theory.reduction.parts import PartsAt

__all__ = ["Radial", "RadialAt"]


class RadialAt(NamedTuple):
    """What there is at places of the coordinate that is left.

    Attributes
    ----------
    inertia, potential, slope
        mu, U_eff and its derivative, shape (places,).
    rates
        ``C^-1 (p - b_c)``: the rates of the ignorable coordinates where s' is zero, shape (ignorable, places).
    coupling
        ``C^-1 m``: what the rate s' takes off these, shape (ignorable, places).
    determinant
        Of C, scaled to one at its largest; where it is zero, coordinates are singular.
    """

    inertia: FloatArray
    potential: FloatArray
    slope: FloatArray
    rates: FloatArray
    coupling: FloatArray
    determinant: FloatArray


@dataclass(frozen=True, eq=False)
class Radial:
    """The problem of one coordinate.

    Attributes
    ----------
    parts
        Gives the parts of the Lagrangian.
    left, ignorable
        Numbers of the coordinate that is left, and of the ignorable ones.
    momenta
        Values of their momenta.
    place
        Where the other coordinates are, which makes no difference.
    """

    parts: PartsAt
    left: int
    ignorable: tuple[int, ...]
    momenta: FloatArray
    place: FloatArray

    def at(self, s: FloatArray | Sequence[float]) -> RadialAt:
        """Return what there is at places s."""
        s = np.atleast_1d(np.asarray(s, dtype=float))
        q = np.repeat(self.place[:, None], len(s), axis=1)
        q[self.left] = s
        now, own = self.parts(q), list(self.ignorable)
        if not own:
            empty = np.zeros((0, len(s)))
            one = np.ones(len(s))
            return RadialAt(now.mass[self.left, self.left], now.potential, now.potential_slope, empty, empty, one)
        c = np.moveaxis(now.mass[np.ix_(own, own)], -1, 0)
        m = now.mass[own, self.left].T
        free = self.momenta - now.linear[own].T
        with np.errstate(all="ignore"):
            solved = _solved(c, np.stack([free, m], axis=2))
        w, coupling = solved[:, :, 0], solved[:, :, 1]
        inertia = now.mass[self.left, self.left] - np.sum(m * coupling, axis=1)
        potential = now.potential + 0.5 * np.sum(free * w, axis=1)
        turned = np.einsum("ki,kij,kj->k", w, np.moveaxis(now.mass_slope[np.ix_(own, own)], -1, 0), w)
        slope = now.potential_slope - np.sum(now.linear_slope[own].T * w, axis=1) - 0.5 * turned
        sizes = np.sqrt(np.abs(np.einsum("kii->ki", c)))
        scale = np.maximum(np.max(sizes, axis=0), 1e-300)
        return RadialAt(inertia, potential, slope, w.T, coupling.T, np.linalg.det(c / scale[:, None] / scale))


def _solved(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Return solutions, not known (nan) where a matrix is singular."""
    try:
        return np.asarray(np.linalg.solve(matrices, right))
    except np.linalg.LinAlgError:
        found = np.full_like(right, np.nan)
        for k, (matrix, one) in enumerate(zip(matrices, right, strict=True)):
            try:
                found[k] = np.linalg.solve(matrix, one)
            except np.linalg.LinAlgError:
                continue
        return found
