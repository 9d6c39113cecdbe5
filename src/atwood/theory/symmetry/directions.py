"""Axes of total momenta: which translations and rotations a space of rigid motions consists of."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from atwood.arrays import FloatArray
from atwood.numerics.rank import null_space, span
from atwood.numerics.solutions import least_norm
from atwood.theory.symmetry.invariance import readable_basis

__all__ = ["axis_name", "axis_text", "planar_point", "rotations_of", "straight_of"]

_NOTHING = 1e-8
"""Relative: rotations this small are none."""


def straight_of(kept: FloatArray, count: int) -> FloatArray:
    """Return the translations among rigid motions, as columns.

    Parameters
    ----------
    kept
        Rigid motions as columns: a velocity of the origin of so many components, then an angular velocity.
    count
        Number of components of the velocity.
    """
    turning = kept[count:]
    if not turning.size:
        return readable_basis(kept[:count])
    moved = kept[:count] @ null_space(turning, _NOTHING * float(np.max(np.abs(kept))))
    return readable_basis(moved) if moved.shape[1] else moved


def rotations_of(kept: FloatArray, count: int, straight: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the rotations among rigid motions: the angular velocity, and the velocity of the origin.

    Of these there is one for each direction that a rotation can have; translations are taken out of them.

    Parameters
    ----------
    kept, count
        See `straight_of`.
    straight
        The translations among them.
    """
    turning = kept[count:]
    if not turning.size:
        return
    axes = span(turning, _NOTHING * float(np.max(np.abs(kept))))
    if not axes.shape[1]:
        return
    flat = np.linalg.qr(straight)[0] if straight.shape[1] else straight
    for axis in readable_basis(axes).T:
        weights = least_norm(turning, axis, errors=_NOTHING)
        about = kept[:count] @ weights
        about = about - flat @ (flat.T @ about)
        size = float(np.max(np.abs(kept[:count] @ np.diag(weights)), initial=0.0))
        yield axis, np.where(np.abs(about) > _NOTHING * size, about, 0.0)


def planar_point(axis: FloatArray, about: FloatArray) -> FloatArray:
    """Return the point of the plane x, z that a rotation leaves where it is, with y = 0."""
    # Counter-clockwise as seen on the page: x' = -w (z - p_z), z' = w (x - p_x).
    return np.array([-about[1] / axis[0], 0.0, about[0] / axis[0]])


def axis_name(axis: FloatArray) -> str:
    """Return ``.x`` and the like for an axis of the world, else its components in brackets."""
    values = [*map(float, axis)]
    if sum(map(bool, values)) == 1 and max(values) == 1.0:
        return "." + "xyz"[values.index(1.0)]
    return f"[{','.join(f'{value:.4g}' for value in values)}]"


def axis_text(axis: FloatArray) -> str:
    """Return x, y or z for an axis of the world, else its components in brackets."""
    name = axis_name(axis)
    return name[1:] if name.startswith(".") else f"({', '.join(f'{value:.6g}' for value in axis)})"
