"""Checks of states of a run with IDA."""

from __future__ import annotations

from math import isfinite

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import StartError, UsageError
from atwood.integrators.protocol import State

_FEW = 64
"""So many numbers are added up before NumPy has begun."""


def checked_state(size: int, t: float, y: FloatArray, yp: FloatArray | None) -> State:
    """Return a state to start from, with its own arrays."""
    state = (float(t), np.array(y, dtype=np.float64), np.array(yp, dtype=np.float64))
    for part in state[1:]:
        if part.shape != (size,):
            raise UsageError(f"the state has {size} unknowns, but was given values of shape {part.shape}")
    if not (isfinite(t) and np.isfinite(state[1]).all() and np.isfinite(state[2]).all()):
        raise StartError(f"the start values at t = {t} are not all finite numbers")
    return state


def is_finite(y: FloatArray, yp: FloatArray) -> bool:
    """Tell whether all values are finite; of few a sum says so quickly, unless it overflows."""
    if y.size <= _FEW and isfinite(sum(y.tolist()) + sum(yp.tolist())):
        return True
    return bool(np.isfinite(y).all() and np.isfinite(yp).all())
