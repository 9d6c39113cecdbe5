"""Scenes of which one coordinate is left: its effective potential and inertia, in the scene's coordinates or in others.

``L = q'.M q'/2 + b.q' - U`` (Goldstein, section 1.6). With momenta p of the ignorable coordinates c, and the coordinate
s that is left,

    c' = C^-1 (p - b_c - m s'),    U_eff = U + (p - b_c).C^-1 (p - b_c)/2,    mu = M_ss - m.C^-1 m,

where C and m are the blocks ``M_cc`` and ``M_cs`` (Goldstein, section 8.3: Routh's procedure). Then
``mu s'^2/2 + U_eff = h``; terms of L that are linear in s' change nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import StartError, UnsupportedError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, jacobian, jvp, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import lagrangian_of
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy, sympy
from atwood.simulation.dynamics.orientation_coordinates import from_regular
from atwood.simulation.initialization.start import find_start
from atwood.theory.hamiltonian.transformations import PointTransformation


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


def parts_of(assembly: Assembly, along: int, t: float) -> PartsAt:
    """Return what gives the parts of a scene's Lagrangian at places."""
    found = lagrangian_of(assembly, "reduced")
    graph, n = found.graph, len(found.velocities)
    still: dict[Expression, Expression | float] = dict.fromkeys(found.velocities, 0.0)
    mass = [graph.zero] * (n * n)
    slope = jacobian(list(found.momenta), list(found.velocities))
    for row, column, entry in zip(slope.rows, slope.columns, slope.entries, strict=True):
        mass[row * n + column] = entry
    if any(depends_on(one, found.velocities) for one in mass):
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

    def at(q: FloatArray) -> Parts:
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


_TRIALS = 60
"""Starts of Newton's method for the new coordinates."""


def transformed_parts(given: PointTransformation, along: int) -> PartsAt:
    """Return what gives the parts of a Lagrangian in new coordinates at places; see `parts_of`."""
    name = given.source.name
    whole = given.lagrangian.xreplace(given.source.values)
    if whole.has(sympy.Symbol("t")):
        raise UnsupportedError("its Lagrangian depends on time in these coordinates", where=name)
    still = dict.fromkeys(given.velocities, sympy.Integer(0))
    momenta = [whole.diff(one) for one in given.velocities]
    mass = [one.diff(other) for one in momenta for other in given.velocities]
    if any(one.has(*given.velocities) for one in mass):
        raise UnsupportedError("its Lagrangian is of higher degree in the velocities", where=name)
    values = [*mass, *(one.xreplace(still) for one in momenta), -whole.xreplace(still)]
    slopes = [one.diff(given.coordinates[along]) for one in values]
    function = sympy.lambdify(given.coordinates, [*values, *slopes], "numpy")
    n = len(given.coordinates)

    def at(q: FloatArray) -> Parts:
        with np.errstate(all="ignore"):
            found = [np.broadcast_to(np.asarray(one, dtype=float), q.shape[1]) for one in function(*q)]
        rows = np.array(found).reshape(2, n * n + n + 1, -1)
        made = [(one[: n * n].reshape(n, n, -1), one[n * n : -1], one[-1]) for one in rows]
        return Parts(*made[0], *made[1])

    return at


def start_in(given: PointTransformation) -> tuple[float, FloatArray, FloatArray]:
    """Return time, new coordinates and their derivatives where a scene starts."""
    h = given.source
    start = find_start(h.assembly)
    q = from_regular(h.assembly, start.coordinates)
    v = h.velocities_at(q, h.start()[1], start.time)
    t = sympy.Symbol("t")
    old = [one.xreplace(h.values) for one in given.old.values()]
    by_new = [[one.diff(x) for x in given.coordinates] for one in old]
    symbols = (*given.coordinates, t)
    place, slope, explicit = (
        sympy.lambdify(symbols, what, "numpy") for what in (old, by_new, [one.diff(t) for one in old])
    )

    def missing(x: Any) -> FloatArray:
        return np.asarray(place(*x, start.time), dtype=float) - q

    random = np.random.default_rng(11)
    for trial in range(_TRIALS):
        guess = start.length * random.uniform(0.1, 2.0, len(q)) if trial else np.abs(q) + 0.1 * start.length
        with np.errstate(all="ignore"):
            found = scipy.optimize.least_squares(missing, guess, xtol=3e-16, ftol=3e-16, gtol=3e-16)
        is_met = np.max(np.abs(found.fun)) <= 1e-13 * (np.max(np.abs(q)) + start.length)
        if is_met and all(x > 0.0 or not one.is_positive for x, one in zip(found.x, given.coordinates, strict=True)):
            matrix = np.array(slope(*found.x, start.time), dtype=float)
            own = np.asarray(explicit(*found.x, start.time), dtype=float)
            return start.time, found.x, np.linalg.solve(matrix, v - own)
    raise StartError("its start is at no values of the new coordinates that are found", where=h.name)
