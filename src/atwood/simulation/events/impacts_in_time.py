"""What a time event does to the state: nothing, unless a prescribed motion jumps there.

A jump of acceleration, or of a force, leaves positions and velocities as they are. A jump of velocity is an impact:
impulses act along all constraints, and what is free keeps its momentum. A jump of position is refused, since no
motion leads across it.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import BoolArray, FloatArray
from atwood.errors import KernelEvaluationError, SolveError
from atwood.expr import depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import replace
from atwood.mechanics.constraints.knots import BALANCES
from atwood.mechanics.dynamics.equations import Constraint
from atwood.model.values.units import ALONG
from atwood.numerics.matrices import scaled, to_array
from atwood.numerics.newton import Missing, newton
from atwood.simulation.dynamics.balance import Balance, BalanceValues, balance_of
from atwood.simulation.dynamics.orientation_coordinates import Reassemble
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.events.mode_change import (
    LetsGo,
    enter_mode,
    generalized_speeds,
    generalized_state,
    plastic_impact,
)
from atwood.simulation.events.modes import EventRecord
from atwood.tolerances import tolerances

_MOTION_SWITCHES: Key[bool] = Key("whether prescribed motion switches")


_SAME_SPEED = 1e-9
"""Relative to the largest speed: by how much velocities may differ without an impact."""

_ITERATIONS, _ROUNDED = 30, 1e-15
"""So many steps of Newton's method at most, and how short the last one is relative to coordinates."""

_HOLDS = 1e-6
"""Relative to the largest speed: by how much velocities after an impact may miss a constraint."""


def jumped(
    before: Assembly,
    after: Assembly,
    state: tuple[float, FloatArray, FloatArray],
    length: float,
    reassemble: Reassemble,
) -> tuple[Assembly, FloatArray, FloatArray, tuple[EventRecord, ...]]:
    """Return the scene and its state where prescribed motions switch, and what has happened.

    A one-sided constraint that could not bear the impulse of a jump lets go: the mode is entered in which it does not
    act, with the velocities before the jump, and what else jumps is an impact there. Where a part is to stop the run
    then, the state stays as it is.
    """
    events: list[EventRecord] = []
    while True:
        try:
            if not events:
                return after, *pass_time_event(before, after, *state, length)
            first = replace(events[0], impact=any(one.impact for one in events))
            modes = {one.part: one.target for one in events}
            return *enter_mode(state, before, first, reassemble, length, modes), (first, *events[1:])
        except LetsGo as error:
            events.append(error.event)
        if events[-1].target == "stop":
            return after, *state[1:], tuple(events)


def pass_time_event(
    before: Assembly, after: Assembly, t: float, q: FloatArray, u: FloatArray, length: float
) -> tuple[FloatArray, FloatArray, tuple[EventRecord, ...]]:
    """Return the state just after a time event, and the impacts, one for each part whose motion jumps in speed."""
    if not motion_switches(after):
        return q, u, ()
    big_q, big_u = (x[:, 0] for x in maximal_state(before, np.array([t]), q[:, None], u[:, None]))
    sizes = motion_scales(after.maximal, length)
    balance = balance_of(after, "dae")
    was, now = balance_of(before, "dae").at(t, big_q, big_u), _values_after(after, balance, t, big_q, big_u)
    rows = balance.row_scales(now, t, big_q, sizes)
    knots = np.array([one.key[1] in BALANCES for one in after.maximal.constraints], dtype=bool)
    _check_places(after, t, (was, now), sizes, rows, knots)
    if knots.any() and np.max(np.abs(now.value - was.value)[knots]) > 0.0:
        big_q = _rebalanced(balance, t, big_q, now)
        now = _values_after(after, balance, t, big_q, big_u)
        if after.form == "reduced":
            q, u, _ = generalized_state(before, after, t, (q, u), (big_q, big_u), length)
    if after.form == "dae":  # a jump as small as rounding allows leaves nothing that would have to be caught up with
        q, u = balance.project(t, big_q, big_u, sizes)
        big_q = q
    fastest = max(
        float(np.max(np.abs(x), initial=0.0))
        for x in (big_u / sizes, was.explicit_rate / rows, now.explicit_rate / rows)
    )
    jumps = np.abs(now.rate - was.rate) / rows
    constraints = after.maximal.constraints
    faster = [constraints[i].key for i in np.flatnonzero(jumps > _SAME_SPEED * fastest)]
    if not faster:
        return q, u, ()
    laws = {part: law for part, law, _ in reversed(faster) if law not in BALANCES}
    message = "the speed of the prescribed motion jumps: an impact"
    impacts = tuple(EventRecord(t, part, law, message, "", True) for part, law in reversed(laws.items()))
    told = impacts[0] if impacts else EventRecord(t, *faster[0][:2], message, "", True)
    try:
        big_u = plastic_impact(after, balance, told, (t, big_q, big_u), sizes)
    except LetsGo as error:  # other velocities may jump nevertheless
        error.event = replace(error.event, impact=bool(laws.keys() - {error.event.part}))
        raise
    left = np.abs(now.jacobian @ big_u + now.explicit_rate) / rows
    if np.max(left) > _HOLDS * fastest:
        raise SolveError(
            f"at t = {t:.9g} the velocities of prescribed motions jump, and no velocities satisfy all constraints",
            where=constraints[int(np.argmax(left))].label,
            advice="Two drives, or a drive and a fixed part, contradict each other from there on.",
        )
    if after.form == "dae":
        return q, big_u, impacts
    return q, generalized_speeds(after, t, q, big_u, sizes), impacts


def motion_switches(assembly: Assembly) -> bool:
    """Return whether a constraint may change at a time event or with a discrete state."""
    return assembly.shared.get(_MOTION_SWITCHES, lambda: bool(switching(assembly)))


def _values_after(after: Assembly, balance: Balance, t: float, q: FloatArray, u: FloatArray) -> BalanceValues:
    """Return the balance just after an event; refuse motions that are infinitely fast there."""
    try:
        return balance.at(t, q, u)
    except KernelEvaluationError as error:
        raise SolveError(
            f"at t = {t:.9g} its prescribed motion switches to one without a finite value, speed or acceleration",
            where=switching(after)[0],
            advice="Look at the function just after that time: the square root of the time since then has an "
            "infinite derivative.",
        ) from error


def _rebalanced(balance: Balance, t: float, q: FloatArray, now: BalanceValues) -> FloatArray:
    """Return the coordinates at which forces that have jumped balance: what has no mass goes there at once."""
    free = ~np.any(to_array(now.mass) != 0.0, axis=1)

    def look(place: FloatArray) -> Missing:
        there = balance.constraints_at(t, place, np.zeros(len(free)))
        return Missing(there.value, np.ones(len(there.value)), lambda: to_array(there.jacobian)[:, free])

    def moved(place: FloatArray, by: FloatArray) -> FloatArray:
        step = np.zeros(len(free))
        step[free] = by
        return balance.kinematic_map.moved(t, place, step)

    far = _ROUNDED * float(np.max(np.abs(q)))
    return newton(look, moved, q, np.ones(int(free.sum())), steps=_ITERATIONS, still=far)[0]


def _check_places(
    after: Assembly,
    t: float,
    sides: tuple[BalanceValues, BalanceValues],
    sizes: FloatArray,
    rows: FloatArray,
    knots: BoolArray,
) -> None:
    """Refuse motions that jump in position; knots have no mass, and may."""
    was, now = sides
    constraints = after.maximal.constraints
    moved = np.where(knots, 0.0, np.abs(now.value - was.value) / rows)
    worst = int(np.argmax(moved))
    by = ""
    if moved[worst] > tolerances.HELD:
        by = _in_words(after, constraints[worst], float(now.value[worst] - was.value[worst]))
    else:  # by half a turn, at which the sine of an angle is zero again, the constraint is turned over
        jacobians = [to_array(scaled(one.jacobian, sizes, rows)) for one in sides]
        over = np.flatnonzero((np.sum(jacobians[0] * jacobians[1], axis=1) < -tolerances.RANK) & ~knots)
        if not len(over):
            return
        worst, by = int(over[0]), " by more than a quarter turn"
    raise SolveError(
        f"at t = {t:.9g} its prescribed motion jumps{by}, and no position can change discontinuously",
        where=constraints[worst].label,
        advice="Prescribe a motion that is continuous; its speed may jump, which is an impact.",
    )


def switching(assembly: Assembly) -> list[str]:
    """Return the parts with a constraint that reads a relation of functions of time, or may do so through a link."""
    found = []
    for path, local in assembly.mechanism.locals_.items():
        held = (one.symbol for one in assembly.discrete_states)
        read = (*assembly.mechanism.relations.symbols, *held, *local.signal_symbols.values())
        if depends_on([one.value for one in local.constraints], read):
            found.append(path)
    read = (*assembly.mechanism.relations.symbols, *(one.symbol for one in assembly.discrete_states))
    for one in assembly.maximal.constraints:
        if one.key[1] in BALANCES and depends_on(one.rate if one.value is None else one.value, read):
            found.append(one.key[0])
    return found


def _in_words(assembly: Assembly, constraint: Constraint, jump: float) -> str:
    """Return by how much a constraint jumps; nothing where it has no unit of its own."""
    path, law, _ = constraint.key
    for one in assembly.mechanism.locals_[path].constraints:
        if one.law.name == law:
            unit = ALONG.get(one.law.options.unit)
            return "" if unit is None else f" by {abs(jump):.3g} {unit}"
    return ""
