"""Linear models in minimal coordinates: displacements and speeds that constraints leave free.

Displacements that meet the constraints are ``ds = S z``, and speeds ``du = U v + U_s z``: the columns of S and U belong
to independent coordinates and speeds, from which the others follow (coordinate partitioning; Wehage and Haug, J. Mech.
Design 104, 1982).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.late import dataclass
from atwood.simulation.dynamics.partitioning import choose_dependent_coordinates
from atwood.theory.linear.variations import Flow, LinearScene

__all__ = ["Minimal", "find_minimal"]


@dataclass(frozen=True, eq=False)
class Minimal:
    """What follows from minimal states: columns are z, v and inputs, in this order.

    Attributes
    ----------
    displacements, speeds
        Numbers of the independent ones.
    shift
        All displacements from them, shape (displacements, columns).
    speed
        All speeds, shape (speeds, columns).
    """

    displacements: tuple[int, ...]
    speeds: tuple[int, ...]
    shift: FloatArray
    speed: FloatArray

    @property
    def states(self) -> int:
        """Number of minimal states."""
        return len(self.displacements) + len(self.speeds)

    @property
    def state(self) -> FloatArray:
        """Displacements and speeds from them."""
        return np.concatenate([self.shift, self.speed])

    def reduced(self, field: FloatArray) -> FloatArray:
        """Return the rows of a field of displacements and speeds that belong to the minimal states."""
        rows = [*self.displacements, *(len(self.shift) + k for k in self.speeds)]
        return np.asarray(field[rows])


def find_minimal(scene: LinearScene, flow: Flow, kept: Sequence[int], like: Minimal | None = None) -> Minimal:
    """Choose minimal states.

    Parameters
    ----------
    scene, flow
        The scene, and its flow at the state.
    kept
        Independent constraints.
    like
        A choice that is to be made again.
    """
    now, inputs = flow.variation, len(scene.inputs)
    count, speeds = len(scene.tangents), len(scene.sizes)
    constraints = scene.equations.constraints
    holding = [i for i in kept if constraints[i].holonomic]
    by_s, _, _, by_w = (one[holding] for one in now.along("value"))
    rate_s, rate_u, _, rate_w = (one[list(kept)] for one in now.along("rate"))
    if like is not None:
        free, free_speeds = like.displacements, like.speeds
    else:
        chosen = choose_dependent_coordinates(by_s, scene.displacement_sizes) if holding else ()
        same = _same_speeds(scene, chosen) if len(holding) == len(kept) else None
        follow = same if same is not None else choose_dependent_coordinates(rate_u, scene.sizes) if len(kept) else ()
        free, free_speeds = _others(count, chosen), _others(speeds, follow)
    dependent, dependent_speeds = _others(count, free), _others(speeds, free_speeds)
    total = len(free) + len(free_speeds) + inputs
    shift, speed = np.zeros((count, total)), np.zeros((speeds, total))
    shift[list(free), range(len(free))] = 1.0
    columns = slice(total - inputs, total)
    if dependent:
        known = by_s[:, list(free)] @ shift[list(free)]
        known[:, columns] += by_w
        shift[list(dependent)] = -np.linalg.solve(by_s[:, list(dependent)], known)
    speed[list(free_speeds), range(len(free), len(free) + len(free_speeds))] = 1.0
    if dependent_speeds:
        known = rate_u[:, list(free_speeds)] @ speed[list(free_speeds)] + rate_s @ shift
        known[:, columns] += rate_w
        speed[list(dependent_speeds)] = -np.linalg.solve(rate_u[:, list(dependent_speeds)], known)
    return Minimal(free, free_speeds, shift, speed)


def _others(count: int, chosen: Sequence[int]) -> tuple[int, ...]:
    return tuple(k for k in range(count) if k not in set(chosen))


def _same_speeds(scene: LinearScene, dependent: Sequence[int]) -> tuple[int, ...] | None:
    """Return the speeds of dependent displacements, so that states come in pairs; None if these have none."""
    e = scene.equations
    number = {speed: i for i, speed in enumerate(e.speeds)}
    of = {k: number[e.rates[i]] for i, k in scene.tangents.plain if e.rates[i] in number}
    for orientation, numbers in scene.tangents.orientation_coordinates:
        of |= dict(zip(numbers, orientation.speeds, strict=False))
    return tuple(sorted(of[k] for k in dependent)) if all(k in of for k in dependent) else None
