"""Proofs that quantities are conserved: identities between their rates and the equations of motion.

``dC/dt - sum w_k (row_k - G^T lambda)_k = 0`` in all coordinates, velocities, accelerations and multipliers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, count_operations, jvp, substitute
from atwood.late import dataclass
from atwood.mechanics.outputs.observables import add_up
from atwood.numerics.solutions import least_norm, least_squares
from atwood.simulation.dynamics.scales import motion_scales, scene_length
from atwood.theory.formulas.notation import Notation
from atwood.theory.symmetry.identities import is_proven_zero
from atwood.theory.symmetry.quantities import Quantities
from atwood.theory.symmetry.states import State

__all__ = ["Generator", "Prover"]

Generator: TypeAlias = "Mapping[int, Expression] | None"
"""Displacements along speeds by number; None where they are not known as formulas."""

_COORDINATES, _OPERATIONS = 12, 1_500
"""Beyond either nothing is proven on the graph."""

_FITTED = 1e-9
"""Relative: how well displacements must be what was fitted to them."""

_SHARES = 64
"""Coefficients of displacements are multiples of one over this, where they are as near to them as that."""


@dataclass(frozen=True, eq=False)
class Prover:
    """Proves identities of one scene.

    Attributes
    ----------
    quantities
        The quantities of the scene.
    notation
        Says which parameters are equal.
    """

    quantities: Quantities
    notation: Notation

    @cached_property
    def is_small(self) -> bool:
        """Whether the scene is small enough for proofs."""
        found = self.quantities.found
        many = sum(count_operations(list(found.rows), self.quantities.assembly.parameters).values())
        return len(found.coordinates) <= _COORDINATES and many <= _OPERATIONS

    @property
    def why_not(self) -> str:
        """Why something is not proven."""
        return "no proof was found" if self.is_small else "too large to be proven on the graph"

    @cached_property
    def _angles(self) -> tuple[Expression, ...]:
        found = self.quantities.found
        return tuple(q for q, one in zip(found.coordinates, found.names, strict=True) if one.unit == "rad")

    def is_zero(self, value: Expression) -> bool:
        """Return whether an expression is proven to be zero: for all parameters, or for those of the scene."""
        if value.is_zero:
            return True
        if not self.is_small:
            return False
        merged: dict[Expression, Expression | float] = dict(self.notation.merged)
        if is_proven_zero(substitute([value], merged)[0] if merged else value, self._angles):
            return True
        numbers: dict[Expression, Expression | float] = dict(self.quantities.assembly.mechanism.table.values)
        return is_proven_zero(substitute([value], numbers)[0], self._angles)

    def along(self, value: Expression, generator: Generator, with_rates: bool = False) -> bool:
        """Return whether a quantity is proven to be conserved.

        Parameters
        ----------
        value
            The quantity, on the symbols of the Lagrangian.
        generator
            The displacements along its velocities.
        with_rates
            Whether the work of constraints is that of their rates, which are zero along motions.
        """
        if generator is None:
            return False
        found = self.quantities.found
        along: dict[Expression, Expression | float] = {found.time: 1.0}
        along |= dict(zip(found.coordinates, found.rates, strict=True))
        along |= dict(zip(found.velocities, found.accelerations, strict=True))
        terms = [jvp([value], along)[0]]
        terms += [w * (found.constraint_rows[k] - found.rows[k]) for k, w in generator.items()]
        if with_rates:
            terms += [-(one.multiplier * one.rate) for one in found.constraints]
        return self.is_zero(add_up(terms))

    def of_motion(self, value: Expression, generator: Generator) -> bool:
        """Return whether a quantity is proven to be conserved, with displacements along the speeds of states."""
        if generator is None or not self.is_small:
            return False
        e = self.quantities.found.equations
        [value] = self.quantities.on_speeds([value])
        along: dict[Expression, Expression | float] = {e.time: 1.0}
        along |= dict(zip(e.coordinates, e.rates, strict=True))
        along |= dict(zip(e.speeds, e.accelerations, strict=True))
        rows = e.rows_with_multipliers or e.rows
        pairs = [
            (w, rows[k], e.constraint_rows[k] if e.constraint_rows else e.graph.zero) for k, w in generator.items()
        ]
        return self.is_zero(add_up([jvp([value], along)[0], *(w * (held - row) for w, row, held in pairs)]))

    # -- displacements as formulas ------------------------------------------------------------------------------------

    def fitted(self, states: Sequence[State], moved: Sequence[FloatArray]) -> Generator:
        """Return displacements as formulas: affine in coordinates, and of orientations a rotation about an axis.

        Parameters
        ----------
        states
            Where they are known.
        moved
            What they are there, along the speeds.
        """
        e = self.quantities.found.equations
        if not self.is_small:
            return None
        turned = {i for one in e.orientation_coordinates for i in one.coordinates}
        plain = [i for i in range(e.placing) if i not in turned]
        if len(states) < len(plain) + 3:
            return None
        affine = np.array([[1.0, *(one.q[i] for i in plain)] for one in states])
        symbols = [e.graph.one, *(e.coordinates[i] for i in plain)]
        spins = {k for one in e.orientation_coordinates for k in one.speeds}
        sizes = motion_scales(e, scene_length(self.quantities.assembly))
        largest = max(float(np.max(np.abs(one) / sizes, initial=0.0)) for one in moved)
        found: dict[int, Expression] = {}
        for k in range(len(e.speeds)):
            if k not in spins:
                values = np.array([one[k] for one in moved])
                made = _fit(affine, values, symbols, largest * sizes[k])
                if made is None:
                    return None
                found[k] = made
        for orientation in e.orientation_coordinates:
            if orientation.kind != "quaternion" or len(orientation.speeds) != 3:
                return None
            own = list(orientation.coordinates)
            basis = [np.array([_in_body(list(one.q[own]), axis) for axis in _AXES]).T for one in states]
            values = np.concatenate([one[list(orientation.speeds)] for one in moved])
            weights = least_squares(np.concatenate(basis), values)
            if np.max(np.abs(np.concatenate(basis) @ weights - values)) > _FITTED * largest:
                return None
            axis = [_share(w) for w in weights]
            turn = _in_body([e.coordinates[i] for i in own], axis)
            found |= {k: e.graph.convert(w) for k, w in zip(orientation.speeds, turn, strict=True)}
        return {k: w for k, w in found.items() if not w.is_zero}


_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _fit(rows: FloatArray, values: FloatArray, symbols: Sequence[Expression], size: float) -> Expression | None:
    """Return values as a combination of symbols; None if they are none to so small a share of a size."""
    scales = np.max(np.abs(rows), axis=0)
    scales = np.where(scales > 0.0, scales, 1.0)
    weights = least_norm(rows / scales, values) / scales
    if np.max(np.abs(rows @ weights - values), initial=0.0) > _FITTED * size:
        return None
    weights = np.where(np.abs(weights) * scales > _FITTED * size, weights, 0.0)
    return add_up([symbols[0].graph.zero, *(_share(w) * one for w, one in zip(weights, symbols, strict=True) if w)])


def _share(value: float) -> float:
    near = round(float(value) * _SHARES) / _SHARES
    return near if abs(value - near) <= _FITTED * max(abs(near), 1.0 / _SHARES) else float(value)


def _in_body(quaternion: Sequence[Any], axis: Sequence[float]) -> list[Any]:
    """Return an axis of the space in the axes of a body, from its quaternion: of numbers, or of expressions."""
    w, v = quaternion[0], quaternion[1:]
    along = v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2]
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    size = w * w + square
    across = (
        v[1] * axis[2] - v[2] * axis[1],
        v[2] * axis[0] - v[0] * axis[2],
        v[0] * axis[1] - v[1] * axis[0],
    )
    return [((w * w - square) * axis[i] + 2.0 * along * v[i] - 2.0 * w * across[i]) / size for i in range(3)]
