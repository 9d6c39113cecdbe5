"""Motions of one coordinate by quadrature: turning points, period, advance, and the motion itself, to rounding.

Between turning points a and b the substitution ``s = (a + b)/2 - (b - a)/2 cos(phi)`` takes the roots out of
``dt = ds sqrt(mu/(2 (E - U)))``: what is left is a smooth periodic function of phi, whose mean value over evenly
spaced points converges faster than any power (Gauss and Chebyshev's rule). Its Fourier series gives the time at every
phi, and Newton's method phi at every time. Near turning points, and where an amplitude is small, ``E - U`` is the
integral of the slope of U from the turning point on, so that no digits cancel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeAlias

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import SolveError, UnsupportedError
from atwood.lazy_dataclasses import dataclass
from atwood.theory.dynamics.one_coordinate import RadialAt

FULL_TURN = 2.0 * np.pi
_LEGENDRE = 24
_CLOSE = 0.02
"""Relative to the size of U: where E - U is less, it is an integral of the slope."""

_MOST = 1 << 15
_CONVERGED = 2e-15
"""Relative to their mean: the last Fourier coefficients."""

_STILL = 1e-10
"""Relative to the steepest slope near by: where the coordinate starts at rest, as far as starts are solved."""

_SMALL = 1e-4
"""Relative to U: where it differs by less from its value at the start, that is an integral of the slope."""

_TOUCHES = 1e-12
"""Relative to the kinetic energy at the start: what is left of it on top of U is none."""

_GRID = 4000
_SINGULAR = 1e-3
"""Of the determinant of the ignorable inertia: places where it has a minimum below this are looked at closely."""


class OneCoordinate(Protocol):
    """The problem of one coordinate; see `Radial`."""

    def at(self, s: FloatArray | Sequence[float]) -> RadialAt:
        """Return what there is at places."""


Place: TypeAlias = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Gives the coordinate and its derivative by phi."""


@dataclass(frozen=True, eq=False)
class Path:
    """The motion of one coordinate, and of the ignorable ones along it.

    Attributes
    ----------
    kind
        ``"libration"``, ``"rotation"``, ``"rest"``, or ``"unbounded"``.
    low, high
        Turning points; infinite where there is none. Of a rotation, the whole range of an angle.
    period
        s; infinite where the motion does not come back.
    advance
        How far the ignorable coordinates go in a period.
    action
        The integral of ``mu s'`` over s in a period.
    error
        Estimated relative error of the period.
    at
        Gives the coordinate and the ignorable ones, less their starts, at times after the start.
    time_at
        Gives the time since phi was zero: at the lower turning point, or, of a rotation, at the start.
    """

    kind: str
    low: float
    high: float
    period: float
    advance: FloatArray
    action: float
    error: float
    at: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    time_at: Callable[[FloatArray], FloatArray] = np.zeros_like


def find_path(radial: OneCoordinate, s: float, rate: float, turn: float | None, scale: float, name: str) -> Path:
    """Find the motion of one coordinate from its start."""
    start = radial.at([s])
    if not np.isfinite(start.potential[0]):
        raise UnsupportedError("it starts where its coordinates are singular", where=name, advice="Simulate it.")
    kinetic = 0.5 * float(start.inertia[0]) * rate**2
    energy = float(start.potential[0]) + kinetic
    grid = [np.r_[s, one] for one in _outward(radial, s, turn, scale)]
    beside = radial.at(s + scale * np.array([-1e-4, 1e-4])).slope
    steepest = 1e4 * float(np.max(np.abs(beside)))  # what the slope comes to in a whole size, as it begins
    if abs(float(start.slope[0])) <= _STILL * steepest and kinetic <= _STILL**2 * steepest * scale:
        return _rest(radial, s, scale)
    high, low = (_first_root(radial, kinetic, places, name) for places in grid)
    if np.isfinite(low) and np.isfinite(high):
        return _libration(radial, energy, (low, high), (s, rate), scale, name)
    if turn and not np.isfinite(low) and not np.isfinite(high):
        return _rotation(radial, energy, s, rate, turn, name)
    if turn:
        raise on_separatrix("it is on a separatrix as near as numbers tell", name)
    return Path("unbounded", low, high, np.inf, np.full(len(start.rates), np.nan), np.inf, 0.0, _nowhere(name))


def on_separatrix(what: str, name: str) -> SolveError:
    """Return the error that a motion has no period."""
    return SolveError(what, where=name, advice="Take a start with a little more or less energy, or simulate it.")


def _nowhere(name: str) -> Callable[[FloatArray], tuple[FloatArray, FloatArray]]:
    def at(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        raise UnsupportedError("the motion does not come back, and has no period", where=name, advice="Simulate it.")

    return at


# -- turning points ---------------------------------------------------------------------------------------------------


def _outward(radial: OneCoordinate, s: float, turn: float | None, scale: float) -> tuple[FloatArray, FloatArray]:
    """Return places above and below a start at which E - U is looked at; of an angle within a turn."""
    if turn:
        steps = np.linspace(0.0, turn, _GRID)[1:]
        sides = s + steps, s - steps
    else:
        made: list[list[float]] = [[], []]
        for side, sign in zip(made, (1.0, -1.0), strict=True):
            place = s
            for _ in range(_GRID):
                place += sign * 0.01 * (min(abs(place), abs(place - s)) + 0.01 * scale)
                side.append(place)
                if abs(place) > 1e8 * (abs(s) + scale):
                    break
        sides = np.array(made[0]), np.array(made[1])
    tiny = scale * 2.0 ** -np.arange(10.0, 50.0)  # motions can be small
    grown: list[FloatArray] = []
    for places, sign in zip(sides, (1.0, -1.0), strict=True):
        ordered = np.sort(places)
        more = np.r_[s + sign * tiny, _near_singular(radial, ordered), _tops(radial, ordered)]
        grown.append(np.sort(np.r_[places, more[(more - s) * sign > 0.0]]))
    return grown[0], grown[1][::-1]


def _tops(radial: OneCoordinate, places: FloatArray) -> FloatArray:
    """Return the maxima of U between places, where a barrier can just be high enough."""
    levels = radial.at(places).potential
    with np.errstate(invalid="ignore"):
        inner = np.flatnonzero((levels[1:-1] >= levels[:-2]) & (levels[1:-1] >= levels[2:])) + 1
    found = []
    for k in inner[:64]:
        low, high = float(places[k - 1]), float(places[k + 1])
        for _ in range(60):  # where the slope changes its sign
            middle = 0.5 * (low + high)
            if float(radial.at([middle]).slope[0]) > 0.0:
                low = middle
            else:
                high = middle
        found.append(low)
    return np.array(found)


def _near_singular(radial: OneCoordinate, places: FloatArray) -> FloatArray:
    """Return places around minima of the ignorable inertia, where a barrier can be narrow."""
    found = np.abs(radial.at(places).determinant)
    found = np.where(np.isfinite(found), found, 0.0)
    inner = np.flatnonzero((found[1:-1] <= found[:-2]) & (found[1:-1] <= found[2:])) + 1
    added: list[float] = []
    for k in inner[found[inner] <= _SINGULAR * np.max(found)]:
        low, high = sorted((places[k - 1], places[k + 1]))
        for _ in range(80):
            inside = np.linspace(low, high, 9)
            values = np.abs(radial.at(inside).determinant)
            best = int(np.argmin(np.where(np.isfinite(values), values, 0.0)))
            low, high = inside[max(best - 1, 0)], inside[min(best + 1, 8)]
        middle, width = 0.5 * (low + high), abs(places[k + 1] - places[k - 1])
        reach = width * 2.0 ** -np.arange(1.0, 40.0)
        added += [*(middle - reach), *(middle + reach)]
    return np.array(added)


def _first_root(radial: OneCoordinate, kinetic: float, places: FloatArray, name: str) -> float:
    """Return the first place at which U has risen by the kinetic energy of the start; infinite if there is none."""
    risen = _risen(radial, places)
    is_top = (risen[1:-1] >= risen[:-2]) & (risen[1:-1] >= risen[2:])
    is_touched = is_top & (np.abs(risen[1:-1] - kinetic) <= _TOUCHES * kinetic)
    closed = np.flatnonzero(~(risen[1:] < kinetic)) + 1
    if np.any(is_touched[: closed[0] if len(closed) else None]):
        raise on_separatrix("its energy is that of a separatrix: it comes to rest on top of its potential", name)
    if not len(closed):
        return float(np.inf if places[-1] > places[0] else -np.inf)
    k = int(closed[0])
    inside, outside, before = float(places[k - 1]), float(places[k]), float(risen[k - 1])
    base = float(radial.at([places[0]]).potential[0])
    for _ in range(200):
        middle = 0.5 * (inside + outside)
        if middle in (inside, outside):
            break
        direct = float(radial.at([middle]).potential[0]) - base
        step = float(_mean_slope(radial, np.array([inside]), np.array([middle]))[0]) * (middle - inside)
        value = direct if abs(direct) > _SMALL * abs(base) else before + step
        if value < kinetic:
            inside, before = middle, value
        else:
            outside = middle
    if not np.isfinite(radial.at([outside]).potential[0]) and before < 0.5 * kinetic:
        raise UnsupportedError(
            f"it passes {inside:.6g}, where its coordinates are singular", where=name, advice="Simulate it."
        )
    return inside


def _risen(radial: OneCoordinate, places: FloatArray) -> FloatArray:
    """Return by how much U has risen since the first place, without loss of digits where that is little."""
    levels = radial.at(places).potential
    direct = levels - levels[0]
    steps = _mean_slope(radial, places[:-1], places[1:], 6) * np.diff(places)
    with np.errstate(invalid="ignore"):
        summed = np.r_[0.0, np.cumsum(steps)]
    small = np.abs(direct) <= _SMALL * abs(float(levels[0]))
    return np.asarray(np.where(small & np.isfinite(summed), summed, direct))


# -- quadratures ------------------------------------------------------------------------------------------------------


def _rest(radial: OneCoordinate, s: float, scale: float) -> Path:
    """Return a motion that stays where it is, with the period of small oscillations about it."""
    now = radial.at([s])
    step = 1e-3 * scale
    slopes = radial.at(s + step * np.array([-2.0, -1.0, 1.0, 2.0])).slope
    stiffness = float(slopes @ [1.0, -8.0, 8.0, -1.0]) / (12.0 * step)  # of fourth order
    period = float(FULL_TURN * np.sqrt(now.inertia[0] / stiffness)) if stiffness > 0.0 else np.inf
    rates = now.rates[:, 0]

    def at(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.full(len(t), s), rates[:, None] * t

    advance = np.multiply(rates, period, out=np.zeros(len(rates)), where=rates != 0.0)
    return Path("rest", s, s, period, advance, 0.0, 1e-10, at)


def _libration(
    radial: OneCoordinate, energy: float, ends: tuple[float, float], start: tuple[float, float], scale: float, name: str
) -> Path:
    low, high = ends
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    if half <= 4.0 * np.spacing(abs(middle)):
        return _rest(radial, middle, scale)
    cosine = np.clip((middle - start[0]) / half, -1.0, 1.0)
    # From the nearer end, where the cosine has lost its digits.
    sine_half = np.sqrt(np.clip(min(start[0] - low, high - start[0]) / (2.0 * half), 0.0, 1.0))
    phase = 2.0 * float(np.arcsin(sine_half)) if cosine > 0.0 else float(np.pi - 2.0 * np.arcsin(sine_half))
    phase = phase if start[1] >= 0.0 else FULL_TURN - phase

    def place(phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        # Distances from both ends without cancellation.
        return low + 2.0 * half * np.sin(0.5 * phi) ** 2, half * np.sin(phi)

    def pace(phi: FloatArray, s: FloatArray) -> FloatArray:
        """Return dt/dphi."""
        now = radial.at(s)
        from_low, from_high = 2.0 * half * np.sin(0.5 * phi) ** 2, 2.0 * half * np.cos(0.5 * phi) ** 2
        is_low = from_low <= from_high
        near, far = np.where(is_low, from_low, from_high), np.where(is_low, from_high, from_low)
        end, sign = np.where(is_low, low, high), np.where(is_low, 1.0, -1.0)
        direct = energy - now.potential
        with np.errstate(all="ignore"):
            ratio = direct / near
        close = direct < _CLOSE * np.maximum(np.abs(now.potential), abs(energy))
        if np.any(close):
            ratio[close] = -sign[close] * _mean_slope(radial, end[close], s[close])
        with np.errstate(all="ignore"):
            found = np.sqrt(now.inertia * far / (2.0 * ratio))
        return np.asarray(found)

    return _made("libration", radial, (low, high), place, pace, phase, name)


def _mean_slope(radial: OneCoordinate, first: FloatArray, last: FloatArray, nodes_each: int = _LEGENDRE) -> FloatArray:
    """Return the mean of dU/ds between places."""
    nodes, weights = np.polynomial.legendre.leggauss(nodes_each)
    places = first[:, None] + 0.5 * (nodes + 1.0) * (last - first)[:, None]
    slopes = radial.at(places.ravel()).slope.reshape(places.shape)
    return np.asarray(0.5 * slopes @ weights)


def _rotation(radial: OneCoordinate, energy: float, s: float, rate: float, turn: float, name: str) -> Path:
    across = float(np.sign(rate)) * turn / FULL_TURN

    def place(phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        return s + across * phi, np.full_like(phi, across)

    def pace(phi: FloatArray, places: FloatArray) -> FloatArray:
        now = radial.at(places)
        with np.errstate(all="ignore"):
            found = abs(across) * np.sqrt(now.inertia / (2.0 * (energy - now.potential)))
        return np.asarray(found)

    return _made("rotation", radial, (-np.inf, np.inf), place, pace, 0.0, name)


def _integrated(
    radial: OneCoordinate, place: Place, pace: Callable[[FloatArray, FloatArray], FloatArray], name: str
) -> tuple[FloatArray, Callable[[FloatArray], FloatArray], float]:
    """Return the means over phi of dt/dphi, the action and ignorable coordinates, their integrals, and the error."""
    count = 32
    while True:
        phi = FULL_TURN * np.arange(count) / count
        s, across = place(phi)
        dt = pace(phi, s)
        now = radial.at(s)
        with np.errstate(all="ignore"):
            rows = np.concatenate([[dt, now.inertia * across**2 / dt], now.rates * dt - now.coupling * across])
        if not np.all(np.isfinite(rows)):
            raise on_separatrix("it is on a separatrix, or its effective potential has no value on the way", name)
        series = np.fft.rfft(rows, axis=1) / count
        tail = np.max(np.abs(series[:, -max(2, count // 16) :]), axis=1) / np.max(np.abs(rows), axis=1, initial=1e-300)
        if np.all(tail <= _CONVERGED) or count >= _MOST:
            break
        count *= 2
    error = float(tail[0])
    if error > 1e-10:
        raise on_separatrix("it is so near to a separatrix that its period does not converge", name)
    mean = series[:, 0].real
    orders = np.arange(1, series.shape[1])
    # The last coefficient of an even number of points stands for half of two.
    shares = np.where(orders == count // 2, 1.0, 2.0)
    kept = shares * series[:, 1:] / (1j * orders)
    least = np.abs(kept) > 1e-18 * np.max(np.abs(mean))
    last = int(np.max(np.flatnonzero(np.any(least, axis=0)), initial=0)) + 1
    orders, kept = orders[:last], kept[:, :last]

    def integrals(phi: FloatArray) -> FloatArray:
        waves = np.exp(1j * np.outer(orders, phi))
        return np.asarray(mean[:, None] * phi + (kept @ waves).real)

    return mean, integrals, error


def _made(
    kind: str,
    radial: OneCoordinate,
    ends: tuple[float, float],
    place: Place,
    pace: Callable[[FloatArray, FloatArray], FloatArray],
    phase: float,
    name: str,
) -> Path:
    """Return the path whose time, and ignorable coordinates, are Fourier series in phi."""
    mean, integrals, error = _integrated(radial, place, pace, name)
    begun = integrals(np.array([phase]))
    period = float(FULL_TURN * mean[0])

    def at(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        wanted = np.asarray(t, dtype=float) + begun[0]
        turns = np.floor((wanted - begun[0]) / period)
        rest = wanted - turns * period
        angle = phase + (rest - begun[0]) / mean[0]
        low, high = np.full_like(angle, phase - 1e-9), np.full_like(angle, phase + FULL_TURN + 1e-9)
        for _ in range(60):
            now = integrals(angle)[0]
            over = now > rest
            high, low = np.where(over, angle, high), np.where(over, low, angle)
            wrapped = np.mod(angle, FULL_TURN)
            step = (now - rest) / pace(wrapped, place(wrapped)[0])
            new = angle - step
            new = np.where((new > low) & (new < high), new, 0.5 * (low + high))
            done = np.max(np.abs(new - angle), initial=0.0) <= 1e-15 * FULL_TURN
            angle = new
            if done:
                break
        moved = integrals(angle)[2:] - begun[2:] + turns * (FULL_TURN * mean[2:, None])
        s = place(angle)[0]
        return (s + turns * FULL_TURN * place(angle)[1] if kind == "rotation" else s), moved

    def time_at(phi: FloatArray) -> FloatArray:
        return np.asarray(integrals(phi)[0] - integrals(np.zeros(1))[0])

    return Path(kind, *ends, period, FULL_TURN * mean[2:], float(FULL_TURN * mean[1]), error, at, time_at)
