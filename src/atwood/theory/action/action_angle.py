"""Action and angle of one degree of freedom: turning points, the integral of p, and the time, by quadrature.

Where H is quadratic in p, ``H = A p^2 + B p + C``, the momentum at the energy E is ``(-B +- sqrt(D))/(2 A)`` with
``D = B^2 - 4 A (C - E)``, and ``dp/dE = +-1/sqrt(D)`` is the time (Landau and Lifshitz, Mechanics, section 49). With
``q = m - r cos(x)`` between the turning points both integrands are smooth and periodic in x, so that the rule of
equal steps converges faster than any power.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import instance, takes
from atwood.arrays import FloatArray
from atwood.display import data_of
from atwood.errors import SolveError, UnsupportedError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy, sympy
from atwood.model.compose.composite import Model
from atwood.simulation.initialization.start import find_start
from atwood.theory.action.complete_integral import complete_integral
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
        """The relative error of period and action, as estimated: amplitudes far below the scene's size lose digits."""
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
    q, p = h.start()
    angle = h.assembly.reduced.names[0].unit == "rad"
    size = 1.0 if angle else find_start(h.assembly).length

    def energy(places: FloatArray, momenta: FloatArray) -> FloatArray:
        return h(places[:, None], momenta[:, None])

    level = level_through(energy, float(q[0]), float(p[0]), size, 2.0 * math.pi if angle else None, h.paths[0])
    return ActionAngle(h.paths[0], h, level)


Energy = Callable[[FloatArray, FloatArray], FloatArray]
"""H of arrays of q and p."""

Coefficients = Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
"""A, B and C of places."""

_SHORTEST, _CHANGE, _RISING = 1e-9, 0.1, 1.5
"""The first step changes the discriminant by no more than such a share; or twice the way such a multiple."""

_FIRST, _STEEPER, _FARTHEST, _LONGEST = 1e-3, 1.05, 1e6, 0.01
"""Turning points are sought in steps that begin with this share of a size and grow so, up to so many sizes.

Where the coordinate has a period, no step is longer than the last share of it.
"""

_POINTS, _MOST, _SAME, _NOISE = 16, 2**15, 3e-14, 2e-14
"""Points at first and at most; the share that halved steps may change, and its part that goes with cancellation."""

_ENOUGH, _KNOWN = 128, 1e-6
"""Points from which on it is looked whether more make it worse, and the least accuracy of what is given."""

_QUADRATIC = 1e-9
"""Relative: a polynomial of second degree through three momenta agrees so well with the energy at a fourth."""

_ROUNDING = 64.0 * float(np.finfo(float).eps)
"""Of the terms of a discriminant: what is less is zero."""

_TOUCHES = 1e-12
"""Of the largest discriminant on the way: one that falls to less comes to zero, as places are rounded, too."""

_BESIDE, _CLEAR, _STEEP = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1), 100.0, 3.0
"""So near to its ends, in shares of the way, a root of first order is looked for, where digits are left first.

From half as far on, such a one doubles the discriminant; one of second order makes it fourfold.
"""


@dataclass(frozen=True, eq=False)
class Level:
    """The closed curve of a coordinate and its momentum on a level of H.

    Attributes
    ----------
    kind
        ``"libration"`` between two turning points, or ``"rotation"``, through all of a periodic coordinate.
    energy
        E, J.
    ends
        The turning points, or the begin and the end of the period.
    action
        The integral of p dq over one turn, J s.
    period
        The derivative of that by E, s.
    error
        Of both, as a share of them: what halving the steps changed at last.
    """

    kind: str
    energy: float
    ends: tuple[float, float]
    action: float
    period: float
    error: float
    _coefficients: Coefficients

    def momentum(self, q: FloatArray, sign: float = 1.0) -> FloatArray:
        """Return the momentum at places, on the branch where the coordinate rises (1) or falls (-1); nan beyond."""
        a, b, c = self._coefficients(np.asarray(q, dtype=float))
        with np.errstate(invalid="ignore"):
            root = np.sqrt(b * b - 4.0 * a * (c - self.energy))
        return np.asarray((-b + np.sign(sign) * np.sign(a) * root) / (2.0 * a))

    def time_to(self, q: float) -> float:
        """Return the time from the first of the ends to a place, on the branch where the coordinate rises, s."""
        low, high = self.ends
        points, weights = np.polynomial.legendre.leggauss(200)
        if self.kind == "rotation":
            places = low + 0.5 * (q - low) * (1.0 + points)
            return float(0.5 * (q - low) * np.sum(weights / self._root(places)))
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        x = 0.5 * np.arccos(np.clip((middle - q) / half, -1.0, 1.0)) * (1.0 + points)
        if not x[-1] > 0.0:
            return 0.0
        width = 0.5 * np.arccos(np.clip((middle - q) / half, -1.0, 1.0))
        return float(width * np.sum(weights * half * np.sin(x) / self._root(middle - half * np.cos(x))))

    def _root(self, q: FloatArray) -> FloatArray:
        a, b, c = self._coefficients(q)
        return np.asarray(np.sqrt(np.abs(b * b - 4.0 * a * (c - self.energy))))


def level_through(
    energy: Energy, q: float, p: float, size: float, turn: float | None = None, name: str = "it"
) -> Level:
    """Return the level of H through a state of one coordinate and its momentum."""
    total = float(energy(np.array([q]), np.array([p]))[0])
    unit = _unit(energy, q, p, total)
    here = max(abs(total), abs(float(energy(np.array([q]), np.zeros(1))[0])), 1e-300)

    def coefficients(places: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        none = energy(places, np.zeros(places.shape))
        units = unit * np.sqrt(np.maximum(np.abs(none) / here, 1.0))  # so large that their energy is no rounding there
        up, down = energy(places, units), energy(places, -units)
        return (up + down - 2.0 * none) / (2.0 * units**2), (up - down) / (2.0 * units), none

    a, b, c = coefficients(np.array([q]))
    twice = float(energy(np.array([q]), np.array([2.0 * unit]))[0])
    there = float((a * 4.0 * unit**2 + 2.0 * b * unit + c)[0])
    if not abs(twice - there) <= _QUADRATIC * (abs(twice) + abs(there) + abs(total)):
        raise UnsupportedError(
            f"H of {name} is not quadratic in the momentum",
            where=name,
            advice="Its motion has a period all the same: `simulate` with a condition finds it.",
        )

    def discriminant(place: float) -> float:
        a, b, c = (float(one[0]) for one in coefficients(np.array([place])))
        return b * b - 4.0 * a * (c - total)

    def rounding(place: float) -> float:
        a, _, c = (float(one[0]) for one in coefficients(np.array([place])))
        return _ROUNDING * abs(a) * (abs(c) + abs(total))

    if not discriminant(q) > 0.0 and all(_way_inside(discriminant, q, sign, _FIRST * size) for sign in (-1.0, 1.0)):
        raise _takes_for_ever(name)  # at rest on top of its potential
    ends = [_turning_point(discriminant, rounding, q, sign, size, turn) for sign in (-1.0, 1.0)]
    if ends[0] is not None and ends[1] is not None:
        kind, low, high = "libration", ends[0], ends[1]
        if not high - low > 1e-7 * size:
            raise SolveError(f"{name} is at rest there", where=name, advice="Take a start with more energy.")
        if _is_separatrix(coefficients, total, low, high):
            raise _takes_for_ever(name)
    elif turn is not None and ends[0] is None and ends[1] is None:
        kind, low, high = "rotation", q, q + turn
    else:
        raise SolveError(f"{name} comes back to no turning point: its motion has no period", where=name)
    action, period, error = _integrals(coefficients, total, kind, low, high, name)
    return Level(kind, total, (low, high), action, period, error, coefficients)


def _is_separatrix(coefficients: Coefficients, total: float, low: float, high: float) -> bool:
    """Return whether the discriminant has a root of higher order at an end, to which no motion comes in finite time."""
    ends = np.array([low, high])
    inward = np.array([high - low, low - high])

    def below(share: float) -> tuple[FloatArray, FloatArray]:
        a, b, c = coefficients(ends + share * inward)
        rounding = _ROUNDING * np.abs(a) * (np.abs(c) + abs(total))
        return b * b - 4.0 * a * (c - total), rounding

    open_ends = np.ones(2, dtype=bool)
    for share in _BESIDE:
        (whole, rounding), (half, _) = below(share), below(0.5 * share)
        clear = open_ends & (whole > _CLEAR * rounding)
        if np.any(whole[clear] > _STEEP * np.abs(half[clear])):
            return True
        open_ends &= ~clear
    return False


def _takes_for_ever(name: str) -> SolveError:
    return SolveError(
        f"{name} takes for ever to come back: its energy is that of a separatrix",
        where=name,
        advice="Take a start with a little more or less energy.",
    )


def _unit(energy: Energy, q: float, p: float, total: float) -> float:
    """Return a momentum with which the terms of H are as large as H."""
    unit = abs(p) or 1.0
    for _ in range(8):
        up, none, down = (float(energy(np.array([q]), np.array([k * unit]))[0]) for k in (1.0, 0.0, -1.0))
        kinetic = 0.5 * abs(up + down - 2.0 * none)
        wanted = max(abs(total), abs(none), 1e-300)
        if 0.1 * wanted <= kinetic <= 10.0 * wanted or not kinetic > 0.0 or not np.isfinite(kinetic):
            break
        unit *= float(np.sqrt(wanted / kinetic))
    return unit


def _turning_point(
    discriminant: Callable[[float], float],
    rounding: Callable[[float], float],
    q: float,
    sign: float,
    size: float,
    turn: float | None,
) -> float | None:
    """Return where the discriminant comes to zero first, on one side; None where it does not."""
    step = _FIRST * size
    places, values = [q], [discriminant(q)]
    if values[0] <= 0.0:  # at a turning point itself: is the motion on this side?
        step = _way_inside(discriminant, q, sign, step)
        if step == 0.0:
            return q
        places, values = [q + sign * step], [discriminant(q + sign * step)]
    else:  # no step passes over a hill
        while step > _SHORTEST * size:
            beside = [discriminant(q + sign * share * step) for share in (0.4, 0.7, 1.0)]
            if max(abs(one - values[0]) for one in beside) <= _CHANGE * values[0]:
                break
            step *= 0.5
    farthest = turn if turn is not None else _FARTHEST * size
    longest = np.inf if turn is None else _LONGEST * turn
    while abs(places[-1] - q) < farthest:
        places.append(places[-1] + sign * step)
        values.append(discriminant(places[-1]))
        if not np.isfinite(values[-1]):
            return None
        if not values[-1] > 0.0:
            return float(scipy.optimize.brentq(discriminant, places[-2], places[-1], xtol=1e-15 * size, rtol=1e-15))
        if len(values) > 2 and values[-2] < min(values[-1], values[-3]):  # it may dip below zero between two steps
            lowest = _lowest(discriminant, places[-3], places[-1])
            dip = discriminant(lowest)
            if not dip > 0.0:
                return float(scipy.optimize.brentq(discriminant, places[-3], lowest, xtol=1e-15 * size, rtol=1e-15))
            if dip <= rounding(lowest) + _TOUCHES * max(values):
                return lowest
        step = min(step * _STEEPER, longest)
    return None


def _lowest(discriminant: Callable[[float], float], one: float, other: float) -> float:
    way = other - one  # shares of it are known to more digits than places are
    found = scipy.optimize.minimize_scalar(
        lambda share: discriminant(one + share * way), bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-12}
    )
    return float(one + found.x * way)


def _way_inside(discriminant: Callable[[float], float], q: float, sign: float, step: float) -> float:
    """Return a small way from a turning point to where the motion is; zero if it is not on that side."""
    for _ in range(30):
        there, before = discriminant(q + sign * step), discriminant(q + 0.5 * sign * step)
        if there > _RISING * before > 0.0:  # it rises from there evenly
            return step
        step *= 0.5
    return 0.0


def _integrals(
    coefficients: Coefficients,
    total: float,
    kind: str,
    low: float,
    high: float,
    name: str,
) -> tuple[float, float, float]:
    """Return the integral of p over one turn, that of dp/dE, and the share that the last halving of steps changed."""
    before: tuple[float, float] | None = None
    best, count = ((0.0, 0.0), np.inf), _POINTS
    while count <= _MOST:
        x = np.pi * (np.arange(count) + 0.5) / count
        if kind == "libration":
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            places, weights = middle - half * np.cos(x), half * np.sin(x) * np.pi / count
        else:
            places, weights = low + (high - low) * x / np.pi, np.full(count, (high - low) / count)
        a, b, c = coefficients(places)
        root = np.sqrt(np.abs(b * b - 4.0 * a * (c - total)))
        if not np.all(root > 0.0):
            raise _takes_for_ever(name)
        if kind == "libration":
            found = float(np.sum(weights * root / np.abs(a))), float(2.0 * np.sum(weights / root))
        else:
            found = float(np.sum(weights * (root - b) / (2.0 * np.abs(a)))), float(np.sum(weights / root))
        # Where H is far larger than what the motion exchanges, less is known of the difference.
        lost = float(np.max(np.abs(c)) + abs(total)) / max(float(np.max(np.abs(c - total))), 1e-300)
        if before is not None:
            change = max(abs(n - o) / abs(n) for n, o in zip(found, before, strict=True))
            if change < best[1]:
                best = found, change
            # Beyond some number of points all that is added is rounding close to the turning points.
            if change <= _SAME + _NOISE * lost or (count > _ENOUGH and change > 4.0 * best[1]):
                break
        before, count = found, 2 * count
    if best[1] <= _KNOWN:
        return *best[0], best[1]
    raise _takes_for_ever(name)
