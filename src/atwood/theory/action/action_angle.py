"""Action and angle of one degree of freedom: the integral of p over a turn, and its share at a state, by quadrature.

Where H is quadratic in p, ``H = (p - a)^2/(2 mu) + U``, the momentum at the energy E is ``a +- sqrt(2 mu (E - U))``,
and ``dp/dE`` is the time (Landau and Lifshitz, Mechanics, section 49).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import instance, takes
from atwood.arrays import FloatArray
from atwood.display import data_of
from atwood.errors import SolveError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.model.compose.composite import Model
from atwood.simulation.initialization.start import find_start
from atwood.theory.action.complete_integral import complete_integral
from atwood.theory.dynamics.one_coordinate import RadialAt, parts_of
from atwood.theory.dynamics.quadrature import FULL_TURN, Path, find_path, on_separatrix
from atwood.theory.formulas.described import Described
from atwood.theory.formulas.printers import Sympy
from atwood.theory.hamiltonian.closed_forms import Quadrature
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, hamiltonian


@dataclass(frozen=True, eq=False)
class ActionAngle(Described):
    """Action and angle variables of one degree of freedom (Goldstein, section 10.6).

    The action variable J is the integral of p dq over one turn, the angle w rises by one in it: ``dH/dJ`` is the
    frequency with which it turns, and its inverse the period. J/2 pi and 2 pi w are those of Landau and Lifshitz.

    Attributes
    ----------
    coordinate
        Path of the coordinate.
    hamiltonian
        H.
    level
        The closed curve.
    """

    coordinate: str
    hamiltonian: Hamiltonian
    level: Level

    @property
    def kind(self) -> str:
        """``"libration"``, to and fro between two turning points, or ``"rotation"``."""
        return self.level.kind

    @property
    def energy(self) -> float:
        """H, J."""
        return self.level.energy

    @property
    def action(self) -> float:
        """J, the integral of p dq over one turn, J s."""
        return self.level.action

    @property
    def period(self) -> float:
        """``dJ/dH``, s: the integral of dp/dE over one turn."""
        return self.level.period

    @property
    def frequency(self) -> float:
        """``dH/dJ``, Hz."""
        return 1.0 / self.level.period

    @property
    def error(self) -> float:
        """The relative error of the period, as estimated."""
        return self.level.error

    @property
    def turning_points(self) -> tuple[float, float] | None:
        """Between which coordinates it swings; None where it goes round."""
        return self.level.ends if self.kind == "libration" else None

    @property
    def action_formula(self) -> Sympy | None:
        """J of the energy E, where the integral is closed; K(m) and E(m) are Legendre's of ``m = k^2``."""
        return None if self._quadrature is None else self._quadrature.turn()

    @property
    def period_formula(self) -> Sympy | None:
        """The period ``dJ/dE`` likewise."""
        return None if self._quadrature is None else self._quadrature.turn(sympy.Symbol("E"))

    @cached_property
    def _quadrature(self) -> Quadrature | None:
        """The integral of p in symbols, where H is short."""
        h, [q], [p] = self.hamiltonian, self.hamiltonian.coordinates, self.hamiltonian.momenta
        if not h.is_short:
            return None
        plain = {one: sympy.Symbol(one.func.__name__) for one in (q, p)}
        state = {plain[one]: float(value[0]) for one, value in zip((q, p), h.start(), strict=True)}
        made = complete_integral(h.expression.xreplace(plain), [(*plain.values(),)], h.values, state, h.name)
        return made.parts[0].quadrature if made.parts else None

    def angle(self, q: float, p: float) -> float:
        """Return the angle variable w of a state on this level, between 0 and 1: the share of a turn since its begin.

        A turn begins at the lower turning point; where it goes round, at the start of the scene.

        Parameters
        ----------
        q, p
            A state of the same energy.

        Raises
        ------
        UsageError
            If its energy is another one.
        """
        there = float(self.hamiltonian([q], [p]))
        scale = max(abs(self.energy), abs(there), abs(p * self.frequency * (self.level.ends[1] - self.level.ends[0])))
        if abs(there - self.energy) > 1e-6 * scale:
            raise UsageError(
                f"its energy is {there:.9g} J, that of the level {self.energy:.9g} J", where=self.coordinate
            )
        falls = float(self.hamiltonian.velocities_at([q], [p])[0]) < 0.0
        if self.kind == "rotation":
            low, high = self.level.ends
            share = self.level.time_to(low + (q - low) % (high - low)) / self.period
            return share if not falls else (1.0 - share) % 1.0
        share = self.level.time_to(q) / self.period
        return 1.0 - share if falls else share

    def curve(self, count: int = 201) -> tuple[FloatArray, FloatArray]:
        """Return coordinates and momenta along the closed curve, in the order in which it is gone through."""
        low, high = self.level.ends
        if self.kind == "rotation":
            q = np.linspace(low, high, count)
            return q, self.level.momentum(q)
        x = np.linspace(0.0, 2.0 * np.pi, count)
        q = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(x)
        p = np.where(x <= np.pi, self.level.momentum(q, 1.0), self.level.momentum(q, -1.0))
        still = self.hamiltonian.momenta_at(q[:, None], np.zeros((count, 1)))[:, 0]
        return q, np.where(np.isfinite(p), p, still)

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return data_of(self, "coordinate", "kind", "energy", "action", "period") | {"ends": list(self.level.ends)}

    def __repr__(self) -> str:
        return (
            f"<ActionAngle of {self.coordinate}: {self.kind}, J = {self.action:.9g} J s, dH/dJ = {self.frequency:.9g} "
            f"Hz, period {self.period:.9g} s>"
        )


@takes(scene=instance("a scene, an assembly of one, or a Hamiltonian", Model, Assembly, Hamiltonian))
def action_angle(scene: Model | Assembly | Hamiltonian) -> ActionAngle:
    """Return action and angle variables of a scene with one degree of freedom, on the level of H of its start.

    Parameters
    ----------
    scene
        The scene, or its Hamiltonian.

    Returns
    -------
    ActionAngle
        J, the frequency dH/dJ, the period, turning points, and the angle of states.

    Raises
    ------
    UsageError
        If it has more than one degree of freedom, or H changes.
    UnsupportedError
        If it has no Hamiltonian, or one that is not quadratic in the momentum.
    SolveError
        If its motion has no period: it is at rest, on a separatrix, or never comes back.
    """
    h = scene if isinstance(scene, Hamiltonian) else hamiltonian(scene)
    if len(h.paths) != 1:
        raise UsageError(
            f"it has {len(h.paths)} degrees of freedom",
            where=h.name,
            advice="`separation` has the action variables of coordinates that separate.",
        )
    if not h.is_conserved:
        raise UsageError(f"it has no level of H that it stays on: {h.sentence}", where=h.name)
    [q], [p] = h.start()
    begun = find_start(h.assembly)
    level = level_through(curves_of(h)(begun.time), q, p, *extents_of(h, begun.length), h.paths[0])
    return ActionAngle(h.paths[0], h, level)


Terms = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""mu, a, U and dU/dq of ``H = (p - a)^2/(2 mu) + U`` at places."""


@dataclass(frozen=True, eq=False)
class Curves:
    """The curves of a coordinate and its momentum, one for each value of ``H = (p - a)^2/(2 mu) + U``.

    Attributes
    ----------
    terms
        Gives mu, a, U and its derivative at places.
    """

    terms: Callable[[FloatArray], Terms]

    def at(self, s: FloatArray | Sequence[float]) -> RadialAt:
        """Return what there is at places; a, which the momentum has besides ``mu q'``, is coupled to the coordinate."""
        places = np.asarray(s, dtype=float)
        inertia, shift, potential, slope = self.terms(places)
        still = np.zeros((1, len(places)))
        return RadialAt(inertia, potential, slope, still, -shift[None], np.ones(len(places)))


def curves_of(h: Hamiltonian) -> Callable[[float], Curves]:
    """Return what gives the curves of a Hamiltonian of one coordinate at a time."""
    parts = parts_of(h.assembly, h.formulas.expressions, 0)

    def at(t: float) -> Curves:
        def terms(places: FloatArray) -> Terms:
            now = parts(places[None], t)
            return now.mass[0, 0], now.linear[0], now.potential, now.potential_slope

        return Curves(terms)

    return at


def extents_of(h: Hamiltonian, length: float) -> tuple[float, float | None]:
    """Return the size of the coordinate of H in a scene of a size, and its period where it is an angle."""
    return (1.0, FULL_TURN) if h.assembly.reduced.names[0].unit == "rad" else (length, None)


@dataclass(frozen=True, eq=False)
class Level:
    """The closed curve of a coordinate and its momentum on a level of H.

    Attributes
    ----------
    kind
        ``"libration"`` between two turning points, or ``"rotation"``, through all of a periodic coordinate.
    energy
        H.
    ends
        Turning points, or the begin and the end of a period.
    action, period
        The integral of p dq over a turn, and the time that it takes.
    error
        Of the period, relative, as estimated.
    curves, path
        Of what it is one, and the motion along it.
    """

    kind: str
    energy: float
    ends: tuple[float, float]
    action: float
    period: float
    error: float
    curves: Curves
    path: Path

    def momentum(self, q: FloatArray, sign: float = 1.0) -> FloatArray:
        """Return the momentum at places, on the branch where the coordinate rises (1) or falls (-1); nan beyond."""
        inertia, shift, potential, _ = self.curves.terms(np.ravel(q).astype(float))
        with np.errstate(invalid="ignore"):
            found = shift + np.sign(sign) * np.sqrt(2.0 * inertia * (self.energy - potential))
        return np.asarray(found.reshape(np.shape(q)))

    def time_to(self, q: float) -> float:
        """Return the time from the first of the ends to a place, on the branch where the coordinate rises, s."""
        share = np.clip((q - self.ends[0]) / (self.ends[1] - self.ends[0]), 0.0, 1.0)
        phi = FULL_TURN * share if self.kind == "rotation" else 2.0 * np.arcsin(np.sqrt(share))
        return float(self.path.time_at(np.array([phi]))[0])


def level_through(curves: Curves, q: float, p: float, size: float, turn: float | None, name: str) -> Level:
    """Return the level of H through a state of one coordinate and its momentum."""
    (inertia,), (shift,), (potential,), _ = curves.terms(np.array([float(q)]))
    rate = float((p - shift) / inertia)
    path = find_path(curves, float(q), rate, turn, size, name)
    if path.kind == "unbounded":
        raise SolveError(f"{name} comes back to no turning point: its motion has no period", where=name)
    if path.kind == "rest" and not np.isfinite(path.period):
        raise on_separatrix(f"{name} rests on top of its potential, where a separatrix ends", name)
    if path.kind == "rest":
        raise SolveError(f"{name} is at rest there", where=name, advice="Take a start with more energy.")
    ends = (path.low, path.high) if path.kind == "libration" else (float(q), float(q + (turn or 0.0)))
    energy, action = float(potential + 0.5 * inertia * rate**2), path.action + float(path.advance[0])
    return Level(path.kind, energy, ends, action, path.period, path.error, curves, path)
