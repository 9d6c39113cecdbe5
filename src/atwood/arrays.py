"""Types of arrays; shapes are said where they are used."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["BoolArray", "ComplexArray", "FloatArray", "IndexArray", "IntArray"]

FloatArray: TypeAlias = NDArray[np.float64]
"""Numbers."""

ComplexArray: TypeAlias = NDArray[np.complex128]
"""Complex numbers."""

BoolArray: TypeAlias = NDArray[np.bool_]
"""Truth values."""

IndexArray: TypeAlias = NDArray[np.intp]
"""Positions in other arrays."""

IntArray: TypeAlias = NDArray[np.int64]
"""Whole numbers of 64 bits, as compiled code reads them."""
