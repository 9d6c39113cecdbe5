"""Forces of places by formulas of the state, compared with those that numbers give.

Formulas add a small share to what may repeat itself (`atwood.mechanics.constraints.read_multipliers`). So the force of
a place with next to no lever about a joint comes out too small, and the motion shows next to nothing of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.display import listed
from atwood.errors import UnsupportedError
from atwood.expr import Program
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.quantities import coordinate_program
from atwood.numerics.contact_sets import GOES_ON, State, is_back
from atwood.numerics.matrices import least_norm, or_one
from atwood.numerics.rank import decompose
from atwood.simulation.contacts.forces import rows_that_hold
from atwood.simulation.contacts.states import states_of
from atwood.simulation.contacts.values import ContactValues, layout_of
from atwood.simulation.dynamics.scales import coordinate_scales
from atwood.tolerances import tolerances

_TOLD: Key[Program] = Key("forces of gaps and slips by formulas")

_OFF = 1e-3
"""Of the largest force: what is off by more is refused. Forces are in units in which each moves its own row alike."""

_NEXT_TO_NONE = 1e-4
"""Of the slopes of rows: formulas are looked at where joints and other places leave less in some direction."""

_ROUNDED = 1e-13
"""The same: what is left of less is rounding, and held by joints and other places; far away so many times more."""


def check_told_forces(
    assembly: Assembly, state: tuple[float, FloatArray, FloatArray], length: float, error: float = 0.0
) -> None:
    """Refuse places whose forces formulas do not give.

    Parameters
    ----------
    assembly
        The scene, with the states of its gaps and slips.
    state
        Time, coordinates and speeds in its form, on the constraints.
    length
        Extent of the scene, m.
    error
        How far the state may be off, in sizes of the scene: by so much of what falls may things move otherwise.

    Raises
    ------
    UnsupportedError
        If a force is off by more than a thousandth of the largest, or what is pressed opens.
    """
    equations, contacts = assembly.own_equations, layout_of(assembly).contacts
    told = [equations.read[one.row.multiplier] for one in contacts if one.row.multiplier in equations.read]
    if len(told) < len(contacts) or (len(contacts) == 1 and not assembly.maximal.constraints):
        return
    values = ContactValues(assembly, *state, length)
    states = states_of(values.layout, assembly.held_now)
    rows = rows_that_hold(values.units, states)
    loose, sizes = [i for i in _at_rest(values) if i not in rows], np.sqrt(or_one(values.alone))
    near, response = [*rows, *loose], values.response / sizes / sizes[:, None]
    if not np.any(np.linalg.eigvalsh(response[np.ix_(near, near)]) < _NEXT_TO_NONE**2):
        return
    along, falls, rest = values.by_free_ways()
    rounded = _ROUNDED * float(max(1.0, *np.abs(state[1] / coordinate_scales(equations, length))))
    parts, each = decompose(along[rows] / sizes[rows, None], rounded, is_whole=False), np.linalg.norm(along, axis=1)
    left = parts.values[: parts.rank]
    loose = [i for i in loose if rounded < each[i] / sizes[i] < _NEXT_TO_NONE]
    if not loose and not np.any(left < _NEXT_TO_NONE):
        return
    program = assembly.shared.get(_TOLD, lambda: coordinate_program(assembly, _TOLD.name, equations, told))
    given = np.array(assembly.kernel(program)([state[0]], *state[1:])[0])
    given, follows = _with_rubbing(values, states, given)
    goes, least = falls + along.T @ given, max(rounded, error) * float(np.max(np.abs(falls), initial=0.0))
    moving = (rest + along @ goes) / sizes
    for i in (i for i in loose if moving[i] < -least):
        raise _refused(values, i, "it is pressed, and opens", [])
    if not np.any(left < _NEXT_TO_NONE):
        return
    by_force = parts.right[: parts.rank] @ along.T @ follows[:, rows] / sizes[rows]
    each = or_one(np.linalg.norm(by_force, axis=1))
    wrong = parts.right[: parts.rank] @ goes + parts.range.T @ (rest[rows] / sizes[rows]) / left
    off = least_norm(by_force / each[:, None], np.where(np.abs(wrong) > least, wrong, 0.0) / each)
    found = given[rows] - off / sizes[rows]
    most, off = float(np.max(np.abs(sizes[rows] * found))), np.abs(off)
    if np.any(off > _OFF * most):
        worst = int(np.argmax(off))
        unit = contacts[rows[worst]].law.options.unit
        said = f"its force is {found[worst]:.4g} {unit}, and formulas give {given[rows[worst]]:.4g}"
        raise _refused(values, rows[worst], said, [rows[i] for i in np.flatnonzero(off > _OFF * most).tolist()])


def _with_rubbing(values: ContactValues, states: Sequence[State], given: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return forces with those of what slips, which formulas have as loads, and how they follow those given."""
    forces, follows, limits = given.copy(), np.eye(len(given)), values.limits_at(given)
    for k, (rows, (state, way)) in enumerate(zip(values.units, states, strict=True)):
        if state == GOES_ON:
            side = limits[is_back(way)]
            follows[list(rows)] = -np.outer(way, side.shares[k])
            forces[list(rows)] = -np.array(way) * side.free[k] + follows[list(rows)] @ given
    return forces, follows


def _at_rest(values: ContactValues) -> list[int]:
    """Return the rows of gaps that are at zero and do not open but by rounding."""
    touching, rates = values.touching(tolerances.CLOSED), np.abs(values.slopes) @ np.abs(values.u)
    is_gap = {one[0] for one, is_slip in zip(values.units, values.layout.is_slip, strict=True) if not is_slip}
    return [i for i in is_gap if touching[i] and values.rates[i] <= _ROUNDED * rates[i]]


def _refused(values: ContactValues, worst: int, said: str, others: Sequence[int]) -> UnsupportedError:
    names = [values.contacts[i].row.key[0] for i in (worst, *others)]
    also = listed(dict.fromkeys(one for one in names if one != names[0]))
    return UnsupportedError(
        f"{said}: joints and other places hold all but next to nothing of what it holds",
        where=names[0],
        advice="Move it away from the joint or the place next to it, or leave it out"
        + (f"; the same is so of {also}." if also else "."),
    )
