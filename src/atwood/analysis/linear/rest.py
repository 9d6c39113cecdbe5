"""States of rest: Newton's method on the accelerations of a scene whose speeds are zero.

At rest ``a(q) = 0`` on the constraints. With accelerations instead of forces every equation has the size of what would
happen, and the derivative is that of the linear model (`LinearScene.flow`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.analysis.linear.minimal import Minimal, find_minimal
from atwood.analysis.linear.variations import Flow, LinearScene
from atwood.arrays import FloatArray
from atwood.errors import AtwoodError
from atwood.late import dataclass
from atwood.simulation.dynamics.balance import Balance

__all__ = ["Rest", "is_at_rest", "same_rest", "seek_rest", "slopes_at"]


_FAR = 0.5
"""A step moves nothing by more of its size; an angle by so many radians."""

_STEPS = 40

_PATIENCE = 12
"""So many steps that lead no nearer end the search."""

_MET = 1e-11
"""Relative to the accelerations that a displacement of the scene's size makes: what is left is rounding."""

_FLAT = 1e-9
"""Relative: singular values of the stiffness below it belong to directions along which nothing changes."""

_WALK, _BACK = 40, 10
"""So many steps lead from one state to another along directions in which nothing changes, each followed by so many of
Newton's method at most."""

_SAME = 1e-6
"""Displacements, relative to the scene's sizes, by which states that count as one may differ."""


@dataclass(frozen=True, eq=False)
class Rest:
    """A state of rest.

    Attributes
    ----------
    q
        Coordinates.
    flow, minimal
        The flow there, and minimal states.
    slopes
        Derivatives of the independent accelerations by independent displacements, scaled: rows in units of the largest
        acceleration, columns in the scene's sizes.
    missed
        What is left of the accelerations in these units.
    """

    q: FloatArray
    flow: Flow
    minimal: Minimal
    slopes: FloatArray
    missed: float


def slopes_at(scene: LinearScene, flow: Flow, kept: Sequence[int]) -> tuple[Minimal, FloatArray, FloatArray]:
    """Return minimal states, independent accelerations scaled, and their derivatives by displacements scaled."""
    minimal = find_minimal(scene, flow, kept)
    count, n = len(scene.tangents), len(minimal.displacements)
    by = (flow.acceleration[:, :count] @ minimal.shift[:, :n])[list(minimal.speeds)]
    own = scene.sizes[list(minimal.speeds)]
    columns = scene.displacement_sizes[list(minimal.displacements)]
    slopes = by * columns / own[:, None]
    accelerations = flow.variation.a[list(minimal.speeds)] / own
    # States of parts, such as that of a controller, must keep still as well.
    alone = [k for i, k in scene.tangents.plain if i >= scene.equations.placing]
    slopes = np.vstack([slopes, (flow.shift[alone, :count] @ minimal.shift[:, :n]) * columns])
    return minimal, np.concatenate([accelerations, flow.variation.displacement_rates[alone]]), slopes


def seek_rest(
    scene: LinearScene, balance: Balance, t: float, q: FloatArray, kept: Sequence[int], steps: int = _STEPS
) -> Rest | None:
    """Return a state of rest near a place; None if Newton's method finds none.

    Parameters
    ----------
    scene, balance
        The scene, and its balance of forces, which puts places back on the constraints.
    t, q
        Time, and where to begin.
    kept
        Independent constraints.
    steps
        The largest number of steps.
    """
    still = np.zeros(len(scene.sizes))
    best, waiting = np.inf, 0
    for _ in range(steps):
        try:
            q, _ = balance.project(t, q, still, scene.sizes)
            if balance.misses(t, q, still, scene.sizes)[0] > 1e-9:
                return None
            flow = scene.flow(t, q, still, kept)
            minimal, a, slopes = slopes_at(scene, flow, kept)
        except (AtwoodError, ArithmeticError, np.linalg.LinAlgError):
            return None
        if not (np.all(np.isfinite(a)) and np.all(np.isfinite(slopes))):
            return None
        size = float(np.max(np.abs(slopes), initial=0.0)) + float(np.max(np.abs(a), initial=0.0)) or 1.0
        missed = float(np.max(np.abs(a), initial=0.0)) / size
        if missed <= _MET and not 0.0 < missed < 0.3 * best:  # as long as it gets better it goes on
            return Rest(q, flow, minimal, slopes / size, missed)
        waiting = 0 if missed < 0.9 * best else waiting + 1
        if waiting > _PATIENCE:
            return None
        best = min(best, missed)
        step = -np.linalg.lstsq(slopes, a, rcond=_FLAT)[0]
        step *= min(1.0, _FAR / max(float(np.max(np.abs(step), initial=0.0)), 1e-300))
        moved = minimal.shift[:, : len(step)] @ (step * scene.displacement_sizes[list(minimal.displacements)])
        largest = float(np.max(np.abs(moved) / scene.displacement_sizes, initial=0.0))
        q = scene.tangents.moved(q, moved * min(1.0, 2.0 * _FAR / max(largest, 1e-300)))
    return None


def is_at_rest(scene: LinearScene, rest: Rest, t: float, kept: Sequence[int], later: Sequence[float]) -> bool:
    """Return whether a state stays at rest at other times: whether nothing that matters depends on time."""
    still = np.zeros(len(scene.sizes))
    size = float(np.max(np.abs(slopes_at(scene, rest.flow, kept)[2]), initial=0.0)) or 1.0
    for time in later:
        flow = scene.flow(t + time, rest.q, still, kept)
        a = flow.variation.a / scene.sizes
        if float(np.max(np.abs(a), initial=0.0)) > 1e-8 * size or np.any(
            np.abs(flow.variation.displacement_rates) > 1e-9 * scene.displacement_sizes
        ):
            return False
    return True


def same_rest(scene: LinearScene, one: Rest, other: Rest, t: float, kept: Sequence[int], balance: Balance) -> bool:
    """Return whether two states are one: apart by turns, or along directions in which nothing changes.

    Parameters
    ----------
    scene, balance, t, kept
        See `seek_rest`.
    one, other
        The states.
    """
    q, slopes, minimal = one.q, one.slopes, one.minimal
    for _ in range(_WALK):
        apart = _wrapped(scene, difference(scene, q, other.q))
        scaled = apart[list(minimal.displacements)] / scene.displacement_sizes[list(minimal.displacements)]
        if float(np.max(np.abs(scaled), initial=0.0)) < _SAME:
            return True
        _, sizes, directions = np.linalg.svd(slopes)
        flat = directions[int(np.sum(sizes > _FLAT)) :]
        step = flat.T @ (flat @ scaled)
        if float(np.max(np.abs(step), initial=0.0)) < _SAME:
            return False
        step *= min(1.0, 0.5 * _FAR / float(np.max(np.abs(step))))
        # Along directions in which nothing changes, which need not be straight: a disc may stand at any heading.
        moved = minimal.shift[:, : len(step)] @ (step * scene.displacement_sizes[list(minimal.displacements)])
        there = seek_rest(scene, balance, t, scene.tangents.moved(q, moved), kept, _BACK)
        if there is None:
            return False
        q, slopes, minimal = there.q, there.slopes, there.minimal
    return False


def _wrapped(scene: LinearScene, apart: FloatArray) -> FloatArray:
    for i, k in scene.tangents.plain:
        if scene.tangents.units[k] == "rad" and i < scene.equations.placing:
            apart[k] = (apart[k] + np.pi) % (2.0 * np.pi) - np.pi
    return apart


def difference(scene: LinearScene, first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the displacement from one place to another; of orientations the rotation vector in the body's axes."""
    found = np.zeros(len(scene.tangents))
    for i, k in scene.tangents.plain:
        found[k] = second[i] - first[i]
    for orientation, numbers in scene.tangents.orientation_coordinates:
        a, b = first[list(orientation.coordinates)], second[list(orientation.coordinates)]
        if len(a) == 2:
            found[numbers[0]] = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)
            continue
        w, v = float(a @ b), a[0] * b[1:] - b[0] * a[1:] - np.cross(a[1:], b[1:])
        if w < 0.0:
            w, v = -w, -v
        size = float(np.linalg.norm(v))
        found[list(numbers)] = (2.0 * np.arctan2(size, w) / size if size else 2.0 / max(w, 1e-300)) * v
    return found
