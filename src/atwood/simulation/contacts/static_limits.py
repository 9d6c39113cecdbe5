"""Limits of friction that contradict each other: what sticks has to be held by as much as what slips is.

What slips would stop and could not stay otherwise, and would begin to slip and stop without end.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import StartError
from atwood.forms.assembly import Assembly
from atwood.numerics.matrices import least_norm
from atwood.simulation.contacts.values import ContactValues, layout_of
from atwood.tolerances import tolerances


def check_static_limits(assembly: Assembly, state: tuple[float, FloatArray, FloatArray], length: float) -> None:
    """Refuse a law of friction whose static limit is below its limit where it does not slip.

    Both are evaluated where no slip goes on, with what presses as it is without contacts, and with each gap pressed.

    Parameters
    ----------
    assembly
        The scene.
    state
        Time, coordinates and speeds in its form.
    length
        Extent of the scene, m.

    Raises
    ------
    StartError
        If a static limit is smaller.
    """
    first = layout_of(assembly).first
    if all(one.static_limit is one.limit for one in first if one.is_slip):
        return
    values = ContactValues(assembly, *state, length)
    slips = [row for rows, one in zip(values.units, first, strict=True) if one.is_slip for row in rows]
    push = np.zeros(len(values.contacts))
    push[slips] = least_norm(values.response[np.ix_(slips, slips)], -values.rates[slips])
    still = values.with_speeds(values.u + values.speeds_by(push))
    pressed = np.array([0.0 if one.is_slip else 1.0 for one in values.contacts])
    slow = tolerances.CLOSED * float(np.max(np.abs(values.rates), initial=0.0))
    for forces in (0.0 * pressed, pressed / float(np.max(np.diag(values.response), initial=0.0) or 1.0)):
        for side in still.limits_at(forces):
            most = side.free + side.shares @ forces, side.static_free + side.static_shares @ forces
            for one, rows, slips_by, sticks_by in zip(first, values.units, *most, strict=True):
                is_still = np.max(np.abs(still.rates[list(rows)])) <= slow
                if one.is_slip and is_still and max(0.0, sticks_by) < slips_by * (1.0 - tolerances.CLOSED):
                    raise StartError(
                        f"the limit of its friction while it sticks, {sticks_by:.6g} {one.law.options.unit}, is below "
                        f"that while it begins to slip, {slips_by:.6g} {one.law.options.unit}",
                        where=".".join(one.row.key[:2]),
                        advice="What slips would stop and could not stay: give it a static limit from there on.",
                    )
