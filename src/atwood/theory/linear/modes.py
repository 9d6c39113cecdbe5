"""Normal modes: oscillations about rest, from stiffness and mass, or from the eigenvalues of a linear model.

Without velocity terms ``M z'' + K z = 0`` with M symmetric and positive and K symmetric: the generalized eigenvalue
problem ``K v = omega^2 M v`` (Goldstein, section 6.2). With damping or gyroscopic terms the eigenvalues are those of
``x' = A x``.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import ComplexArray, FloatArray
from atwood.late import dataclass
from atwood.numerics.rank import null_space
from atwood.theory.linear.spectrum import find_spectrum, rounding
from atwood.theory.linear.state_space import StateSpace
from atwood.theory.linear.variations import Flow

__all__ = ["ModeValues", "find_modes"]


_NO_VELOCITY = 1e-11
"""Relative to the accelerations that it belongs to: a velocity term that is smaller is rounding."""

_LIKE = 1e-9
"""Relative: eigenvalues that differ by less belong to one space of shapes."""


@dataclass(frozen=True, eq=False)
class ModeValues:
    """Modes of a linear model.

    Attributes
    ----------
    angular_frequencies
        rad/s, ascending; zero for those that do not oscillate.
    growth_rates
        Real parts of the eigenvalues, 1/s.
    eigenvalues
        Of each mode, that with the positive imaginary part.
    shapes
        Displacements of all coordinates, shape (displacements, modes); complex where velocity terms shift phases.
    spaces
        Numbers of modes that belong together, since their eigenvalues are equal: any combination is a mode as well.
    """

    angular_frequencies: FloatArray
    growth_rates: FloatArray
    eigenvalues: ComplexArray
    shapes: ComplexArray
    spaces: tuple[tuple[int, ...], ...]


def find_modes(flow: Flow, space: StateSpace) -> ModeValues:
    """Return the modes about a state.

    Parameters
    ----------
    flow, space
        The flow at the state, and the linear model there.
    """
    minimal = space.minimal
    n, m = len(minimal.displacements), len(minimal.speeds)
    a, error = space.matrix[:, : n + m], space.error[:, : n + m]
    by_speed = a[n:, n:]
    # What a speed does in the time in which a displacement does as much as it: both in units of accelerations.
    rows = np.sqrt(np.abs(np.diag(a[n:, :n]))) if n == m else np.zeros(m)
    bound = np.maximum(error[n:, n:], _NO_VELOCITY * np.sqrt(np.outer(rows, rows)))
    plain = n == m and np.array_equal(a[:n, n:], np.eye(n)) and not np.any(a[:n, :n])
    if plain and np.all(np.abs(by_speed) <= bound):
        found = _undamped(flow, space)
        if found is not None:
            return found
    return _damped(space, n)


def _undamped(flow: Flow, space: StateSpace) -> ModeValues | None:
    """Return modes of a symmetric stiffness; None if it is not symmetric, as with follower forces."""
    minimal = space.minimal
    n = len(minimal.displacements)
    u = minimal.speed[:, n : 2 * n]
    mass = u.T @ flow.variation.by["force", "a"] @ u
    mass = 0.5 * (mass + mass.T)
    stiffness = -mass @ space.matrix[n:, :n]
    size = np.sqrt(np.outer(np.diag(mass), np.diag(mass)))
    error = np.abs(mass) @ space.error[n:, :n] + 1e-12 * np.max(np.abs(stiffness / size), initial=0.0) * size
    if np.any(np.abs(stiffness - stiffness.T) > error + error.T):
        return None
    from scipy.linalg import eigh  # a fifth of a second

    try:
        squares, vectors = eigh(0.5 * (stiffness + stiffness.T), mass)
    except np.linalg.LinAlgError:  # the mass matrix is not positive: something without mass is free
        return None
    noise = np.sqrt(np.sum((error / size) ** 2))
    squares = np.where(np.abs(squares) <= noise, 0.0, squares)
    frequencies = np.sqrt(np.maximum(squares, 0.0))
    growth = np.sqrt(np.maximum(-squares, 0.0))
    order = np.argsort(frequencies, kind="stable")
    shapes = (minimal.shift[:, :n] @ vectors)[:, order]
    frequencies, growth = frequencies[order], growth[order]
    return ModeValues(
        frequencies, growth, growth + 1j * frequencies, _scaled(shapes), _spaces(growth + 1j * frequencies)
    )


def _damped(space: StateSpace, n: int) -> ModeValues:
    minimal = space.minimal
    matrix, error = space.matrix[:, : minimal.states], space.error[:, : minimal.states]
    spectrum = find_spectrum(matrix, error, space.sizes)
    size = float(np.max(np.abs(spectrum.others), initial=0.0))
    upper = [k for k, value in enumerate(spectrum.others) if value.imag >= -1e-9 * size]
    values = spectrum.others[upper]
    values = np.where(np.abs(values.imag) <= 1e-9 * np.abs(values), values.real + 0j, values)
    values = np.where(np.abs(values.real) <= 1e-13 * size, 1j * values.imag, values)
    shapes = minimal.shift[:, :n] @ spectrum.vectors[:n, upper]
    # A coordinate that nothing depends on, with its speed: one mode with a double zero.
    zeros = (spectrum.zeros + 1) // 2
    free = np.zeros((len(shapes), zeros), dtype=complex)
    null = null_space(matrix, rounding(matrix, error))
    count = min(zeros, null.shape[1])
    free[:, :count] = minimal.shift[:, :n] @ null[:n, :count]
    values = np.concatenate([np.zeros(zeros, dtype=complex), values])
    shapes = np.hstack([free, shapes])
    order = np.lexsort((-values.real, np.round(values.imag, 12)))
    values = values[order]
    return ModeValues(values.imag, values.real, values, _scaled(shapes[:, order]), _spaces(values))


def _scaled(shapes: FloatArray | ComplexArray) -> ComplexArray:
    """Return shapes whose largest displacement is one, and real and positive."""
    found = np.array(shapes, dtype=complex)
    for k in range(found.shape[1]):
        sizes = np.abs(found[:, k])
        if np.max(sizes, initial=0.0) > 0.0:
            # The first of those that are nearly the largest, so that rounding does not choose the sign.
            found[:, k] /= found[int(np.argmax(sizes > 0.999 * np.max(sizes))), k]
    return found


def _spaces(values: ComplexArray) -> tuple[tuple[int, ...], ...]:
    groups: list[list[int]] = []
    size = float(np.max(np.abs(values), initial=0.0))
    for k, value in enumerate(values):
        if groups and abs(value - values[groups[-1][0]]) <= _LIKE * max(abs(value), 1e-3 * size):
            groups[-1].append(k)
        else:
            groups.append([k])
    return tuple(tuple(one) for one in groups)
