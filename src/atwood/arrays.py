"""Types of arrays; shapes are said where they are used."""

from __future__ import annotations

import ctypes
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["BoolArray", "ComplexArray", "FloatArray", "IndexArray", "IntArray", "address_of", "uneven"]

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

_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
"""The angle whose multiples are spread most evenly."""

_AS_BUFFER: Any = (ctypes.c_char * 0).from_buffer


def address_of(array: NDArray[Any]) -> int:
    """Return where an array is in memory; `array.ctypes` takes five times as long, which runs of 0.1 ms feel."""
    try:
        return ctypes.addressof(_AS_BUFFER(array))
    except (TypeError, ValueError, BufferError):  # it is not to be written to, or not in one piece
        return int(array.ctypes.data)


def uneven(count: int, turn: int = 1, shift: float = 0.0) -> FloatArray:
    """Return numbers between -1 and 1 that no symmetry singles out; others for each number of turns."""
    return np.asarray(np.sin(turn * _GOLDEN * np.arange(1.0, count + 1.0) + shift))
