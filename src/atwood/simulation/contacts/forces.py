"""Forces and impulses of gaps and slips in given states."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.numerics.contact_sets import GOES_ON, STICKS, Limits, State, balancing, is_back
from atwood.numerics.matrices import least_norm, or_one
from atwood.simulation.contacts.values import ContactValues

MOST_TURNS = 50
"""Limits that are curved in the forces are met in so many turns at most."""


def forces_in(values: ContactValues, states: Sequence[State], rates: FloatArray | None = None) -> FloatArray:
    """Return the forces of all rows in some states of the units, or impulses, whatever their signs and sizes are.

    Parameters
    ----------
    values, states
        Gaps and slips, and what they do.
    rates
        Of all rows, which impulses take away where something sticks; accelerations are, by forces, if not given.
    """
    free, count = values.accelerations() if rates is None else rates, len(values.contacts)
    forces = np.zeros(count)
    for _ in range(MOST_TURNS):
        limits = values.limits_at(forces) if rates is None else of_impulses(values.limits_at(forces))
        matrix, right = np.eye(count), np.zeros(count)
        for number, (rows, (state, way)) in enumerate(zip(values.units, states, strict=True)):
            for row, part in zip(rows, way, strict=True):
                if state == STICKS:
                    matrix[row], right[row] = values.response[row], -free[row]
                elif state == GOES_ON:
                    side = limits[is_back(way)]
                    matrix[row] = matrix[row] + part * side.shares[number]
                    right[row] = -part * side.free[number]
        more, least = np.zeros((0, count)), np.zeros(0)
        holding = rows_that_hold(values.units, states)
        if len(holding) > 1:
            slopes, offset = values.sharing
            gives = np.diag(slopes)[holding] > 0.0
            alone = balancing(values.response[np.ix_(holding, holding)], gives, values.row_sizes[holding]).T
            more, least = alone @ slopes[holding], np.zeros(len(alone))
            if rates is None:  # joints have no impulses before
                least = alone @ offset[holding]
            size = or_one(np.max(np.abs(more), axis=1, initial=0.0))
            more, least = more / size[:, None], least / size
        last, forces = forces, least_norm(np.vstack([matrix, more]), np.append(right, -least))
        if not values.layout.is_curved or is_same(last, forces):
            break
    return forces


def of_impulses(limits: tuple[Limits, Limits], pressed: FloatArray | None = None) -> tuple[Limits, Limits]:
    """Return limits of impulses: finite forces have none, and what follows from other forces is a share of these.

    Those of impulses that act already are known.
    """
    known = np.zeros(limits[0].shares.shape[1]) if pressed is None else pressed
    ahead, back = (
        Limits(one.shares @ known, one.shares, one.static_shares @ known, one.static_shares) for one in limits
    )
    return ahead, back


def rows_that_hold(units: Sequence[Sequence[int]], states: Sequence[State]) -> list[int]:
    """Return the rows that hold."""
    return [row for rows, one in zip(units, states, strict=True) if one[0] == STICKS for row in rows]


def is_same(last: FloatArray, now: FloatArray) -> bool:
    """Return whether forces are the same but for rounding."""
    return float(np.max(np.abs(now - last), initial=0.0)) <= 1e-12 * float(np.max(np.abs(now), initial=0.0))
