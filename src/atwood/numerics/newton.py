"""Newton's method for systems that need not be square: steps of least norm, shortened where they lead no nearer.

Of all solutions of the linear system each step takes the shortest, so that what nothing determines stays as it is (the
method of Gauss and Newton; P. Deuflhard, *Newton Methods for Nonlinear Problems*, 2004, sections 3.2 and 4.4). Unknowns
need be no vector: a step is a displacement, and the caller says where it leads.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Any, TypeVar

import numpy as np

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import Matrix, least_norm, scaled

_Place = TypeVar("_Place")

_MUCH = 0.5
"""A step that leaves more than this share of what was missing is rounding if that had met its tolerance."""

_SHORT = 1e-9
"""In units of the scales: a shorter step is not halved."""

_NO_WAY = 1e-11
"""In units of the scales: where a step halved to this is still no nearer, none is."""


@dataclass(frozen=True, eq=False)
class Missing:
    """What is missing at a place.

    Attributes
    ----------
    value
        By how much each equation is missed.
    units
        The size of each, in which what is missing is measured.
    slopes
        Gives the derivatives by displacements.
    even
        The sizes by which rows are divided to be solved, unless these are the units.
    """

    value: FloatArray
    units: FloatArray
    slopes: Callable[[], Matrix]
    even: FloatArray | None = None

    @property
    def miss(self) -> float:
        """The most that an equation is missed by, in its unit."""
        return largest(self.value / self.units)


def largest(values: FloatArray) -> float:
    """Return the largest absolute value, zero for none."""
    return float(np.abs(values).max(initial=0.0))


def newton(
    look: Callable[[_Place], Missing],
    moved: Callable[[_Place, FloatArray], _Place],
    place: _Place,
    scales: FloatArray,
    *,
    steps: int,
    met: float = 0.0,
    exact: float = 0.0,
    still: float = 0.0,
    longest: float | FloatArray = inf,
    halvings: int = 0,
    is_even: bool = False,
    refused: tuple[type[Exception], ...] = (),
    missed: Callable[[_Place], FloatArray] | None = None,
) -> tuple[_Place, Missing]:
    """Return the place near by at which nothing is missing, or that to which so many steps have led.

    `missed` gives no more than by how much equations are missed, where that takes less than a look.
    """
    now = there = look(place)
    last = inf

    def value(trial: _Place) -> FloatArray:
        nonlocal there
        there = look(trial)
        return there.value

    for _ in range(steps):
        miss = now.miss
        if miss <= exact or (not halvings and miss < met and miss >= _MUCH * last):
            break
        rows = now.units if now.even is None else now.even
        matrix, right = scaled(now.slopes(), scales, rows), now.value / rows
        for off in (largest(right), 0.0) if is_even else (0.0,):
            units = least_norm(matrix, right, float(is_even), off)  # of the scales, some of which may be zero
            far, over = largest(units), max(1.0, largest(units / longest))
            step = scales * units * np.where(np.isinf(longest), 1.0, 1.0 / over)
            if not halvings:
                break
            trial, left = _nearer(missed or value, moved, place, step, now, far / over, halvings, refused)
            if left < _MUCH * miss:
                break
        if halvings:
            if left >= miss and (miss < met or left == inf):
                break
            place, now, last = trial, there if missed is None else look(trial), miss
            continue
        place = moved(place, -step)
        if far <= still:
            break
        now, last = look(place), miss
    return place, now


def _nearer(
    missed: Callable[[Any], FloatArray],
    moved: Callable[[Any, FloatArray], Any],
    place: Any,
    step: FloatArray,
    now: Missing,
    far: float,
    halvings: int,
    refused: tuple[type[Exception], ...],
) -> tuple[Any, float]:
    """Return where a step leads, halved until less is missing in today's units, and how much.

    It is infinitely much if no step leads nearer.
    """
    trial, left, is_short = place, inf, far < _SHORT
    for _ in range(halvings):
        try:
            trial = moved(place, -step)
            left = largest(missed(trial) / now.units)
        except refused:
            left = inf
        if left < now.miss or is_short:
            break
        step, far = 0.5 * step, 0.5 * far
    return trial, inf if left >= now.miss and far < _NO_WAY else left
