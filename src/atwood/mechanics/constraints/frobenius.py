"""Whether constraints on velocities are integrable together, by the theorem of Frobenius.

Forms ``w_k`` that vanish on some directions of motion are integrable together if and only if their derivatives
``dw_k(X, Y)`` vanish for all pairs of these directions: then the motions stay on surfaces, even where nobody can write
down which (Neimark and Fufaev, Dynamics of Nonholonomic Systems, chapter 1). Directions are taken along the speeds,
which need not be rates of coordinates: ``dw(X, Y) = X(w(Y)) - Y(w(X)) - w([X, Y])``.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, jacobian, jvp, substitute
from atwood.mechanics.constraints.pfaffian import NEEDED, Places
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.numerics.rank import null_space
from atwood.numerics.solutions import least_squares
from atwood.tolerances import tolerances

__all__ = ["integrable_together"]


_LARGEST = 12
"""Up to so many speeds it is asked."""


def integrable_together(mechanism: Mechanism, equations: Equations) -> bool | None:
    """Return whether the constraints of a scene, all together, could be written as ones on positions.

    Parameters
    ----------
    mechanism
        The scene.
    equations
        Its equations, with the constraints that are asked about.

    Returns
    -------
    bool or None
        None if it cannot be told: with too many speeds, or where coefficients have no values.
    """
    n, m = len(equations.speeds), len(equations.constraints)
    if not m or n > _LARGEST:
        return None
    graph, still = equations.graph, dict.fromkeys(equations.speeds, 0.0)
    fields = _fields(equations)
    forms = np.full((m, n + 1), graph.zero, dtype=object)
    velocity_jacobian = jacobian([one.rate for one in equations.constraints], list(equations.speeds))
    for row, column, entry in zip(
        velocity_jacobian.rows, velocity_jacobian.columns, velocity_jacobian.entries, strict=True
    ):
        forms[row, column] = entry
    forms[:, n] = substitute([one.rate for one in equations.constraints], still)
    # How forms and fields change along each field, one sweep each.
    moving = [*forms.ravel(), *(component for field in fields for component in field[1])]
    changes = [jvp(moving, field[0]) for field in fields]
    places = Places(equations, equations.time)
    numbers = places.values(mechanism, [*moving, *(entry for change in changes for entry in change)])
    if len(numbers) < NEEDED:
        return None
    sizes, q = places.sizes(mechanism), len(equations.coordinates)
    return all(_vanishes(row, sizes, m, q) for row in numbers)


def _fields(equations: Equations) -> list[tuple[dict[Expression, Expression | float], list[Expression]]]:
    """Return, for each speed and for time, the direction in which coordinates move with it, and its components."""
    graph = equations.graph
    found = []
    for speed in (*equations.speeds, None):
        others: dict[Expression, Expression | float] = dict.fromkeys(equations.speeds, 0.0)
        components = (
            substitute(list(equations.rates), others) if speed is None else jvp(list(equations.rates), {speed: 1.0})
        )
        components = [graph.convert(c) for c in components]
        direction: dict[Expression, Expression | float] = dict(zip(equations.coordinates, components, strict=True))
        if speed is None:
            direction[equations.time] = 1.0
        found.append((direction, components))
    return found


def _vanishes(numbers: FloatArray, sizes: FloatArray, m: int, q: int) -> bool:
    """Return whether the derivatives of forms vanish on the directions that the forms leave, at one place.

    Displacements along the fields are counted in their sizes, and each form in that of its largest coefficient.
    """
    fields = len(sizes)
    moving, changes = numbers[: m * fields + fields * q], numbers[m * fields + fields * q :]
    changes = changes.reshape(fields, len(moving))
    forms, components = moving[: m * fields].reshape(m, fields), moving[m * fields :].reshape(fields, q)
    of_forms = changes[:, : m * fields].reshape(fields, m, fields)  # [i, k, j]: X_i(w_k(X_j))
    of_fields = changes[:, m * fields :].reshape(fields, fields, q)  # [i, j]: X_i(X_j)
    brackets = of_fields - of_fields.transpose(1, 0, 2)
    # A bracket has no part along time, and is a sum of the other fields.
    weights = least_squares(components[:-1].T, brackets.reshape(fields * fields, q).T)
    along = weights.T.reshape(fields, fields, fields - 1)
    left = of_forms.transpose(1, 0, 2)
    derivatives = left - left.transpose(0, 2, 1) - np.einsum("kl,ijl->kij", forms[:, :-1], along)
    forms, both = forms * sizes, np.outer(sizes, sizes)
    units = np.maximum(np.max(np.abs(forms), axis=1), 1e-300)
    left, derivatives = (one * both / units[:, None, None] for one in (left, derivatives))
    free = null_space(forms / units[:, None])
    rest = np.einsum("ia,kij,jb->kab", free, derivatives, free)
    largest = max(float(np.max(np.abs(left), initial=0.0)), 1.0)
    return bool(np.max(np.abs(rest), initial=0.0) <= tolerances.RANK * largest)
