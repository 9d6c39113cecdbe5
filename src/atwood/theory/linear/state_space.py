"""The matrices of a linear model about a state, with what rounding may have done to them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.rounding import ROUGHNESS
from atwood.late import dataclass
from atwood.theory.linear.minimal import Minimal, find_minimal
from atwood.theory.linear.steady import Steady, pace_of
from atwood.theory.linear.variations import Flow, LinearScene
from atwood.tolerances import tolerances

__all__ = ["StateSpace", "find_state_space"]


_DISTURBANCES = 3
"""How often everything is disturbed to see what rounding can do."""


@dataclass(frozen=True, eq=False)
class StateSpace:
    """How minimal states change: ``x' = A x + B w``.

    Attributes
    ----------
    minimal
        The minimal states.
    matrix
        A and B side by side, shape (states, states and inputs).
    error
        How far rounding can have taken each entry.
    sizes
        What is large for each state: the scene's sizes, and for speeds the rate at which these change fastest.
    """

    minimal: Minimal
    matrix: FloatArray
    error: FloatArray
    sizes: FloatArray


def find_state_space(scene: LinearScene, flow: Flow, steady: Steady, kept: Sequence[int]) -> StateSpace:
    """Return the linear model about a state in minimal states.

    Parameters
    ----------
    scene, flow, steady
        The scene, its flow at the state, and what that moves along.
    kept
        Independent constraints.
    """
    minimal = find_minimal(scene, flow, kept)
    matrix = _matrix(scene, flow, steady, minimal)
    random, largest = np.random.default_rng(1974), np.zeros_like(matrix)
    now = flow.variation
    pace = pace_of(scene, flow)
    for _ in range(_DISTURBANCES):
        other = scene.disturbed(random)
        by = ROUGHNESS * scene.displacement_sizes * random.uniform(-1.0, 1.0, len(scene.tangents))
        faster = ROUGHNESS * pace * scene.sizes * random.uniform(-1.0, 1.0, len(now.u))
        found = other.flow(now.t, scene.tangents.moved(now.q, by), now.u + faster, kept)
        near = _matrix(other, found, steady, find_minimal(other, found, kept, minimal))
        largest = np.maximum(largest, np.abs(near - matrix))
    n = len(minimal.displacements)
    own = scene.displacement_sizes[list(minimal.displacements)], scene.sizes[list(minimal.speeds)]
    fastest = np.sqrt(np.max(np.abs(matrix[n:, :n] * own[0] / own[1][:, None]), initial=0.0))
    fastest = max(float(fastest), float(np.max(np.abs(matrix[n:, n : minimal.states]), initial=0.0))) or 1.0
    sizes = np.concatenate([own[0], own[1] * fastest])
    return StateSpace(minimal, matrix, tolerances.CERTAIN * largest, sizes)


def _matrix(scene: LinearScene, flow: Flow, steady: Steady, minimal: Minimal) -> FloatArray:
    size = len(flow.field)
    moved = (flow.matrix[:, :size] - steady.moving) @ minimal.state
    moved[:, minimal.states :] += flow.matrix[:, size + 1 :]
    return minimal.reduced(moved)
