"""The problem of one coordinate: its inertia and its effective potential, where the others are ignorable."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, jacobian_by_rows, jvp, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Lagrangian
from atwood.lazy_dataclasses import dataclass


class Parts(NamedTuple):
    """The parts of a Lagrangian at places, with their derivatives by one coordinate.

    Attributes
    ----------
    mass, linear, potential
        M, shape (n, n, places), b, shape (n, places), and U, shape (places,).
    mass_slope, linear_slope, potential_slope
        Their derivatives.
    """

    mass: FloatArray
    linear: FloatArray
    potential: FloatArray
    mass_slope: FloatArray
    linear_slope: FloatArray
    potential_slope: FloatArray


PartsAt: TypeAlias = Callable[[FloatArray], Parts]
"""Gives the parts at places, shape (n, places)."""


def parts_of(assembly: Assembly, found: Lagrangian, along: int) -> Callable[[FloatArray, float], Parts]:
    """Return what gives the parts of a scene's Lagrangian at places and a time."""
    n = len(found.velocities)
    still: dict[Expression, Expression | float] = dict.fromkeys(found.velocities, 0.0)
    mass = jacobian_by_rows(found.momenta, found.velocities)
    if depends_on(mass, found.velocities):
        raise UnsupportedError(
            "its Lagrangian is no polynomial of second degree in the velocities",
            where=assembly.flat.name,
            advice="Simulate it.",
        )
    linear = substitute(list(found.momenta), still)
    potential = [-one for one in substitute([found.lagrangian], still)]
    every = [*mass, *linear, *potential]
    slopes = jvp(every, {found.coordinates[along]: 1.0})
    inputs = InputGroup("t", (found.time,)), InputGroup("q", found.coordinates)
    outputs = OutputGroup("parts", tuple(every)), OutputGroup("slopes", tuple(slopes))
    program = Program(f"{assembly.flat.name} reduced", inputs, assembly.parameters, outputs)
    kernel = assembly.kernel(program, vectorized=True)

    def at(q: FloatArray, t: float) -> Parts:
        q = np.ascontiguousarray(q, dtype=float)
        count = q.shape[1]
        made: list[FloatArray] = []
        for values in kernel(np.full((1, count), t), q):
            whole = np.broadcast_to(np.asarray(values, dtype=float), (n * n + n + 1, count))
            made += [whole[: n * n].reshape(n, n, count), whole[n * n : -1], whole[-1]]
        return Parts(*made)

    return at


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
