"""Products of many steps: growth rates without overflow."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray

__all__ = ["orthonormal_growth"]


def orthonormal_growth(propagators: FloatArray, basis: FloatArray) -> FloatArray:
    """Return the logarithms by which the axes of a volume grow in each step, shape (steps, columns).

    The volume is spanned anew by orthonormal vectors after each step (Benettin, Galgani, Giorgilli and Strelcyn,
    Meccanica 15, 1980).

    Parameters
    ----------
    propagators
        What each step does, shape (steps, m, m), in the scale in which lengths are measured.
    basis
        The vectors at the start, shape (m, columns).
    """
    frame = np.linalg.qr(basis)[0]
    found = np.empty((len(propagators), basis.shape[1]))
    with np.errstate(divide="ignore"):
        for k, step in enumerate(propagators):
            frame, triangle = np.linalg.qr(step @ frame)
            found[k] = np.log(np.abs(np.diagonal(triangle)))
    return found
