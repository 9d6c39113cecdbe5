"""Full matrices column by column, from programs that give their product with a direction."""

from __future__ import annotations

from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel
from atwood.forms.assembly import Assembly, FormName

__all__ = ["columns_of", "mass_at", "masses_at"]


_CHUNK = 128
"""Columns that are worked on at once."""


def columns_of(kernel: BoundKernel, size: int, *groups: Any) -> FloatArray:
    """Return the matrix of which a program gives the product with a direction, its last input.

    Parameters
    ----------
    kernel
        The program, vectorized.
    size
        Number of columns.
    *groups
        Its other inputs, for one state.
    """
    state = [np.asarray(group, dtype=float)[:, None] for group in groups]
    unit = np.eye(size)
    parts = [kernel(*state, unit[:, i : i + _CHUNK])[0] for i in range(0, size, _CHUNK)]
    return np.concatenate(parts, axis=1)


def mass_at(assembly: Assembly, form: FormName, t: float, q: FloatArray, u: FloatArray) -> FloatArray:
    """Return a mass matrix that is not written out, at one state."""
    program = assembly.balance(form)
    assert program.mass_product is not None
    return columns_of(assembly.kernel(program.mass_product, vectorized=True), program.speeds, [t], q, u)


def masses_at(assembly: Assembly, t: FloatArray, q: FloatArray, u: FloatArray, values: FloatArray) -> FloatArray:
    """Return mass matrices in generalized coordinates that are not written out, shape (states, number, number).

    Parameters
    ----------
    assembly
        The scene.
    t, q, u
        States, of shape (1 or states,) and (states, number).
    values
        Values of the parameters, of shape (parameters,), or (parameters, states) where they differ.
    """
    program = assembly.balance("reduced")
    assert program.mass_product is not None
    code = assembly.compiled(program.mass_product, vectorized=True)
    times = np.broadcast_to(np.ravel(t), (len(q),))
    found = np.empty((len(q), program.speeds, program.speeds))
    for i in range(len(q)):
        kernel = code.bind(values if values.ndim == 1 else values[:, i])
        found[i] = columns_of(kernel, program.speeds, times[i : i + 1], q[i], u[i])
    return found
