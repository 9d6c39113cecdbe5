"""What a time event does to the state: nothing, unless a prescribed motion jumps there.

A jump of acceleration, or of a force, leaves positions and velocities as they are. A jump of velocity is an impact:
impulses act along all constraints, and what is free keeps its momentum. A jump of position is refused, since no
motion leads across it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.errors import SolveError
from atwood.expr import Expression, depends_on
from atwood.forms.assembly import Assembly
from atwood.mechanics.equations import Constraint
from atwood.solve.balance import balance_of
from atwood.solve.matrices import scaled, to_array
from atwood.solve.modes import Happening, generalized_speeds, plastic_impact
from atwood.solve.rank import RANK
from atwood.solve.reactions import maximal_state
from atwood.solve.scales import motion_scales

__all__ = ["pass_time_event"]

FloatArray = NDArray[np.float64]

_IN_PLACE = 1e-7
"""Relative to the scene's size: by how much a prescribed motion may jump and still counts as continuous."""

_SAME_SPEED = 1e-9
"""Relative to the largest speed: by how much velocities may differ without an impact."""

_HOLDS = 1e-6
"""Relative to the largest speed: by how much velocities after an impact may miss a constraint."""


def pass_time_event(
    before: Assembly, after: Assembly, t: float, q: FloatArray, u: FloatArray, length: float
) -> tuple[FloatArray, FloatArray, Happening | None]:
    """Return the state just after a time event, and the impact if there is one.

    Parameters
    ----------
    before, after
        The scene on both sides of the event.
    t, q, u
        Time and state just before it, in the coordinates of the form.
    length
        Extent of the scene, m.

    Raises
    ------
    SolveError
        If a prescribed position jumps, or prescribed velocities contradict each other after the event.
    """
    if not after.shared.get("motion switches", lambda: _motion_switches(after)):
        return q, u, None
    big_q, big_u = (x[:, 0] for x in maximal_state(before, np.array([t]), q[:, None], u[:, None]))
    sizes = motion_scales(after.maximal, length)
    balance = balance_of(after, "dae")
    was, now = balance_of(before, "dae").at(t, big_q, big_u), balance.at(t, big_q, big_u)
    rows = balance.row_scales(now, t, big_q, sizes)
    constraints = after.maximal.constraints
    moved = np.abs(now.value - was.value) / rows
    if np.max(moved, initial=0.0) > _IN_PLACE:
        worst = int(np.argmax(moved))
        by = _in_words(after, constraints[worst], float(now.value[worst] - was.value[worst]))
        raise SolveError(
            f"at t = {t:.9g} its prescribed motion jumps{by}, and nothing can move so far at once",
            where=constraints[worst].label,
            advice="Prescribe a motion that is continuous; its speed may jump, which is an impact.",
        )
    slopes = [to_array(scaled(one.slope, sizes, rows)) for one in (was, now)]
    turned_over = np.flatnonzero(np.sum(slopes[0] * slopes[1], axis=1) < -RANK)
    if len(turned_over):  # as after a jump by half a turn, at which the sine of an angle is zero again
        raise SolveError(
            f"at t = {t:.9g} its prescribed motion jumps by more than a quarter turn",
            where=constraints[int(turned_over[0])].label,
            advice="Prescribe a motion that is continuous; its speed may jump, which is an impact.",
        )
    fastest = max(float(np.max(np.abs(x), initial=0.0)) for x in (big_u / sizes, was.drift / rows, now.drift / rows))
    missed = np.abs(now.rate - was.rate) / rows
    if np.max(missed, initial=0.0) <= _SAME_SPEED * fastest:
        return q, u, None
    path, law, _ = constraints[int(np.argmax(missed))].key
    happening = Happening(t, path, law, "the speed of the prescribed motion jumps: an impact", "", True)
    big_u = plastic_impact(after, balance, happening, (t, big_q, big_u), sizes)
    left = np.abs(now.slope @ big_u + now.drift) / rows
    if np.max(left) > _HOLDS * fastest:
        raise SolveError(
            f"at t = {t:.9g} prescribed motions jump in speed, and no velocities meet them all",
            where=constraints[int(np.argmax(left))].label,
            advice="Two drives, or a drive and a fixed part, contradict each other from there on.",
        )
    if after.form == "dae":
        return q, big_u, happening
    return q, generalized_speeds(after, t, q, big_u, sizes), happening


def _motion_switches(assembly: Assembly) -> bool:
    """Return whether a relation of functions of time is read by anything that holds or prescribes a motion."""
    mechanism = assembly.mechanism
    symbols = mechanism.relations.symbols
    values: list[Expression] = [c.value for local in mechanism.locals_.values() for c in local.constraints]
    linked = [one for local in mechanism.locals_.values() for one in local.signal_symbols.values()]
    return any(depends_on(value, (*symbols, *linked)) for value in values)


def _in_words(assembly: Assembly, constraint: Constraint, jump: float) -> str:
    """Return by how much a constraint jumps; nothing where it has no unit of its own."""
    path, law, _ = constraint.key
    for one in assembly.mechanism.locals_[path].constraints:
        if one.law.name == law:
            unit = {"N": "m", "N*m": "rad"}.get(one.law.options.unit)
            return "" if unit is None else f" by {abs(jump):.3g} {unit}"
    return ""
