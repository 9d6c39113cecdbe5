"""The C signatures of the functions that IDA calls."""

from __future__ import annotations

from ctypes import CFUNCTYPE, c_double, c_int, c_void_p

__all__ = ["JACOBIAN", "RESIDUAL", "WEIGHTS"]

RESIDUAL = CFUNCTYPE(c_int, c_double, *[c_void_p] * 4)
"""Time, y, y', the result, the user's data."""

JACOBIAN = CFUNCTYPE(c_int, c_double, c_double, *[c_void_p] * 8)
"""Time, cj, y, y', the residual, the matrix, the user's data, three vectors."""

WEIGHTS = CFUNCTYPE(c_int, *[c_void_p] * 3)
"""The vector y, the weights, the user's data."""
