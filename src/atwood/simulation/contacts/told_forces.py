"""Forces of places by formulas of the state, compared with those that numbers give.

Formulas add a small share to what may repeat itself (`atwood.mechanics.constraints.read_multipliers`). So the force of
a place with next to no lever about a joint comes out too small, and the motion shows next to nothing of it.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.display import listed
from atwood.errors import UnsupportedError
from atwood.expr import Program
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.quantities import coordinate_program
from atwood.numerics.contact_sets import NOTHING
from atwood.numerics.matrices import or_one
from atwood.simulation.contacts.forces import forces_in, rows_that_hold
from atwood.simulation.contacts.states import states_of
from atwood.simulation.contacts.values import ContactValues, layout_of

_TOLD: Key[Program] = Key("forces of gaps and slips by formulas")

_ALIKE: Key[bool] = Key("that numbers give the same forces, at the state that was last asked about")

_OFF = 1e-3
"""Of the largest force: what is off by more is refused. Forces are in units in which each moves its own row alike."""

_NEXT_TO_NONE = 1e-8
"""Of how rows move with nothing else held: formulas are looked at where joints and other places leave less in some
direction, which is more than rounding."""


def check_told_forces(assembly: Assembly, state: tuple[float, FloatArray, FloatArray], length: float) -> None:
    """Refuse places whose forces formulas do not give.

    Parameters
    ----------
    assembly
        The scene, with the states of its gaps and slips.
    state
        Time, coordinates and speeds in its form, on the constraints.
    length
        Extent of the scene, m.

    Raises
    ------
    UnsupportedError
        If a force is off by more than a thousandth of the largest.
    """
    t, q, u = state
    assembly.kept.get(_ALIKE, lambda: _are_alike(assembly, state, length), t, q.tobytes(), u.tobytes(), length)


def _are_alike(assembly: Assembly, state: tuple[float, FloatArray, FloatArray], length: float) -> bool:
    """Return that no force is off, or refuse places of which one is."""
    equations, contacts = assembly.own_equations, layout_of(assembly).contacts
    told = [equations.read[one.row.multiplier] for one in contacts if one.row.multiplier in equations.read]
    if len(told) < len(contacts) or (len(contacts) == 1 and not assembly.maximal.constraints):
        return True
    values = ContactValues(assembly, *state, length)
    rows = rows_that_hold(values.units, states_of(values.layout, assembly.held_now))
    sizes = np.sqrt(or_one(values.alone[rows]))
    moved, ways = np.linalg.eigh(values.response[np.ix_(rows, rows)] / sizes / sizes[:, None])
    if not np.any((moved > NOTHING) & (moved < _NEXT_TO_NONE)):
        return True
    program = assembly.shared.get(_TOLD, lambda: coordinate_program(assembly, _TOLD.name, equations, told))
    (given,) = assembly.kernel(program)([state[0]], *state[1:])
    found = forces_in(values, states_of(values.layout, assembly.held_now))
    there = ways[:, moved > NOTHING]
    off = np.abs(there @ (there.T @ (sizes * (np.array(given)[rows] - found[rows]))))
    most = float(np.max(np.abs(sizes * found[rows])))
    worst = rows[int(np.argmax(off))] if rows else 0
    others = dict.fromkeys(contacts[rows[i]].row.key[0] for i in np.flatnonzero(off > _OFF * most).tolist())
    if others:
        where = contacts[worst].row.key[0]
        also, unit = listed(one for one in others if one != where), contacts[worst].law.options.unit
        raise UnsupportedError(
            f"its force is {found[worst]:.4g} {unit}, and formulas give {given[worst]:.4g}: "
            "joints and other places hold all but next to nothing of what it holds",
            where=where,
            advice="Move it away from the joint or the place next to it, or leave it out"
            + (f"; the same is so of {also}." if also else "."),
        )
    return True
