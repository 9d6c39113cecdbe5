"""Whether constraints may be sums of waves in two unknowns, seen from numbers before any formula is derived.

To derive the coefficients of a form and to compare it costs many times what the values at some places do, and most
pairs of unknowns of a mechanism in space have none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.rounding import WAYS, RoughProgram
from atwood.expr import Expression
from atwood.forms.loops.branches import Place
from atwood.numerics.solutions import least_squares

__all__ = ["ConstraintShapes"]

_LEFT = 1e-6
"""What a form may leave of the largest value: far more than rounding, which is looked at when formulas are compared."""


class ConstraintShapes:
    """The values of constraints where two unknowns vary.

    Parameters
    ----------
    values
        The constraints.
    coordinates
        Their unknowns.
    place
        Values of the parameters, and the length of the scene.
    elsewhere
        Values of time and of all coordinates, at which those that do not vary stay.
    """

    def __init__(
        self,
        values: Sequence[Expression],
        coordinates: Sequence[Expression],
        place: Place,
        elsewhere: Mapping[Expression, float],
    ) -> None:
        self._values, self._place = values, place
        self._rows = {one: k for k, one in enumerate(elsewhere)}
        self._at = np.repeat(np.array(list(elsewhere.values()))[:, None], WAYS, axis=1)
        self._coordinates = coordinates
        self._programs: dict[tuple[int, ...], RoughProgram] = {}
        random = np.random.default_rng(1)
        self._shares = random.uniform(-1.0, 1.0, (2, WAYS))

    def may_be(self, ks: tuple[int, ...], unknowns: Mapping[int, bool], nested: float = 0.0) -> bool:
        """Return whether constraints may be sums of a constant and of first harmonics, or powers, of each unknown.

        One length may stand in second degree; beside one angle, also in products with its harmonics.

        Parameters
        ----------
        ks
            Numbers of the constraints.
        unknowns
            Numbers of the coordinates; whether each is an angle.
        nested
            So many times the second is counted in the first.
        """
        at, basis, moved = self._at.copy(), [np.ones(WAYS)], []
        for share, is_angle in zip(self._shares, unknowns.values(), strict=False):
            moved.append(np.pi * share if is_angle else self._place.length * share)
            basis += [np.cos(moved[-1]), np.sin(moved[-1])] if is_angle else [moved[-1] / self._place.length]
        if len(basis) == 2:
            basis.append(basis[1] ** 2)
        elif len(basis) == 4:  # an angle and a length, in whichever order
            waves, length = (basis[1:3], basis[3]) if next(iter(unknowns.values())) else (basis[2:], basis[1])
            basis += [length * wave for wave in waves]
        if nested:
            moved[0] = moved[0] - nested * moved[1]
        for number, values in zip(unknowns, moved, strict=True):
            at[self._rows[self._coordinates[number]]] = values
        found = self._program(ks)(np.array(list(self._place.parameters.values())), at)
        return _is_combination(found, np.array(basis))

    def turns_about(self, ks: tuple[int, ...], number: int, others: Sequence[int]) -> bool:
        """Return whether an angle may turn three constraints about an axis that does not depend on other unknowns.

        Parameters
        ----------
        ks
            Numbers of the constraints.
        number, others
            Numbers of the angle and of the other unknowns.
        """
        axes = []
        for share in (0.3, -0.4):
            at = self._at.copy()
            for other in others:
                at[self._rows[self._coordinates[other]]] = share * self._place.length
            angle = np.pi * self._shares[0]
            at[self._rows[self._coordinates[number]]] = angle
            found = self._program(ks)(np.array(list(self._place.parameters.values())), at)
            basis = np.array([np.ones(WAYS), np.cos(angle), np.sin(angle)])
            if not np.all(np.isfinite(found)):
                return True
            if not _is_combination(found, basis):
                return False
            _, p, q = least_squares(basis.T, found.T)
            axes.append(np.cross(p, q) / max(float(p @ p), np.finfo(float).tiny))
        return bool(np.max(np.abs(axes[0] - axes[1])) <= _LEFT)

    def _program(self, ks: tuple[int, ...]) -> RoughProgram:
        if ks not in self._programs:
            symbols = tuple(self._place.parameters), tuple(self._rows)
            self._programs[ks] = RoughProgram(symbols, [self._values[k] for k in ks])
        return self._programs[ks]


def _is_combination(values: FloatArray, basis: FloatArray) -> bool:
    """Return whether rows are combinations of others; True where they have no value, which formulas may have."""
    if not np.all(np.isfinite(values)):
        return True
    weights = least_squares(basis.T, values.T)
    left = values - (basis.T @ weights).T
    return bool(np.max(np.abs(left)) <= _LEFT * np.max(np.abs(values)))
