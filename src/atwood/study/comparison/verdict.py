"""What a comparison says, in one line."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

__all__ = ["cost_at", "judge"]


def judge(rows: Iterable[tuple[str, float | None, float | None]]) -> str:
    """Return which form is cheapest at an error that all reach, and by how much.

    Parameters
    ----------
    rows
        Label, error and time of each run.
    """
    curves: dict[str, list[tuple[float, float]]] = {}
    for label, error, wall in rows:
        if error is not None and wall:
            curves.setdefault(label, []).append((max(error, 1e-16), wall))
    if len(curves) < 2:
        return "There is nothing to compare." if not curves else f"Only {next(iter(curves))} gave an answer."
    span = _common_errors(curves)
    if span is None:
        return "The forms reach no error in common: look at the rows."
    target = 10.0 ** round(math.log10(span))
    found = ((cost_at(points, target), label) for label, points in curves.items())
    costs = sorted((cost, label) for cost, label in found if cost is not None)
    (least, best), (most, _worst) = costs[0], costs[-1]
    if most < 1.15 * least:
        return f"For an error of {target:.0e} all cost the same, {_said(least)}."
    rest = ", ".join(f"{label} {_said(cost)}" for cost, label in costs[1:])
    return f"For an error of {target:.0e}, {best} takes {_said(least)}; {rest}: up to {most / least:.1f} times as long."


def _common_errors(curves: dict[str, list[tuple[float, float]]]) -> float | None:
    """Return an error that as many curves as possible reach, at least two of them."""
    candidates = sorted({10.0 ** round(math.log10(error)) for points in curves.values() for error, _ in points})
    counted = [(sum(_reaches(points, error) for points in curves.values()), error) for error in candidates]
    most = max(count for count, _ in counted)
    if most < 2:
        return None
    shared = [error for count, error in counted if count == most]
    return shared[len(shared) // 2]


def _reaches(points: list[tuple[float, float]], error: float) -> bool:
    """Return whether an error lies between the smallest and the largest of a curve, or nearly so."""
    errors = [one for one, _ in points]
    return min(errors) / 3.0 <= error <= 3.0 * max(errors)


def cost_at(points: list[tuple[float, float]], error: float) -> float | None:
    """Return the time at an error, between the runs by logarithms; None if they do not come near it.

    Parameters
    ----------
    points
        Error and time of each run.
    error
        The error.
    """
    if not _reaches(points, error):
        return None
    ordered = sorted(points)
    errors, walls = (np.log([point[i] for point in ordered]) for i in (0, 1))
    return float(np.exp(np.interp(math.log(error), errors, walls)))


def _said(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if seconds < 1.0 else f"{seconds:.3g} s"
