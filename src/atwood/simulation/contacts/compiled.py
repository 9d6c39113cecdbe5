"""What the routine of a set of contacts is given of a scene; see `atwood.integrators.sets`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.sundials.events import EventData
from atwood.expr import Program, depends_on, jacobian
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.constrained import contacts_program
from atwood.forms.loose import in_no_contact, is_loose, kept_touching, loose_equations
from atwood.integrators.embedded.rates import OwnRates
from atwood.integrators.set_jumps import EVENTS, SetCode, SetJump, SetJumps, SetLog, SetSolver
from atwood.integrators.sets import record as sets
from atwood.integrators.sets.record import UNITS
from atwood.integrators.sets.sizes import ROUNDED
from atwood.integrators.time_stepping.session import Change
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import ContactRow
from atwood.mechanics.outputs.event_functions import CLOSES, CONTACT, OPENS, RESTS, STOPS, YIELDS, EventFunction
from atwood.model.values.units import ALONG
from atwood.numerics.contact_sets import STICKS, State
from atwood.simulation.contacts.bounces import has_plain_impacts
from atwood.simulation.contacts.changes import NEAR, Changed, longest_left
from atwood.simulation.contacts.event_records import in_own_words, told_change, told_impact, told_rest
from atwood.simulation.contacts.states import states_of
from atwood.simulation.contacts.values import Layout, layout_of, unmoved
from atwood.simulation.events.modes import MARGIN, EventProbe, EventRecord, ToldLater, find_event_functions
from atwood.simulation.problem.explicit_scene import (
    light_speeds,
    own_rates_on_constraints,
    program_on_constraints,
    values_on_constraints,
)
from atwood.simulation.problem.problem import SceneProblem

HAPPENED = {CLOSES: sets.CLOSES, OPENS: sets.OPENS, YIELDS: sets.YIELDS, STOPS: sets.STOPS, RESTS: sets.STOPS}
"""What an event of a gap or a slip means to the routine; others say nothing of how it goes on."""

_SHORT = 300
"""Programs for all states that are no longer than this are used where nothing touches, too."""

FEW_ROWS = 8
"""The program of a set of so few gaps and slips is small, so that it pays from the first change on."""

_MOST_ROWS = 40
"""Of more rows the responses to each other, which grow with the square, take too long to write and to compile."""

_CODE: Key[tuple[SetData, SetCode] | None] = Key("machine code of sets")
_TABLE: Key[FloatArray] = Key("events of gaps and slips for routines")
_PARTS: Key[dict[str, int]] = Key("numbers of the parts that have contacts")
_STATES: Key[FloatArray] = Key("states of gaps and slips for routines")


@dataclass(frozen=True, eq=False)
class SetData:
    """Gaps and slips of a scene for the routine.

    Attributes
    ----------
    program, pattern
        See `atwood.forms.constrained.contacts_program`; parameters are those of `values_on_constraints`.
    layout
        The gaps and slips.
    units
        What is known beforehand of each, by the rows of `UNITS`; what is small and slow is that of a tolerance of one.
    """

    program: Program
    pattern: list[tuple[int, int]]
    layout: Layout
    units: FloatArray


def why_in_python(assembly: Assembly) -> str:
    """Return which limit of friction the routine cannot read, and why; empty where it reads all."""
    layout = layout_of(assembly)
    if not (layout.is_curved or layout.is_borne):
        return ""
    own = [one.read for one in layout.contacts]
    borne = [x for x in layout.read if x not in own]
    for one in layout.contacts:
        limits = [limit for way in (1.0, -1.0) for limit in one.towards(way)]
        name = ".".join(one.row.key[:2])
        if depends_on(limits, borne):
            return f"the limit of {name} reads forces of joints"
        if depends_on(list(jacobian(limits, own).entries), own):
            return f"the limit of {name} is curved in a force"
    raise AssertionError("no limit is curved, and none reads forces of joints")


def not_touching(assembly: Assembly) -> bool:
    """Return whether nothing touches, slips or sticks, whichever programs there are."""
    return not any(assembly.held_now[place] for places in layout_of(assembly).places for place in places)


def set_data(plan: SceneProblem, t: float, y: FloatArray) -> SetData:
    """Return what the routine is given, for a plan and a state of it."""
    assembly, layout = in_no_contact(plan.assembly), layout_of(plan.assembly)
    rows = assembly.rows if assembly.form == "reduced" else assembly.maximal.rows
    equations, loose = loose_equations(assembly, rows)
    own: dict[tuple[str, str], list[ContactRow]] = {}
    for one in assembly.own_equations.contacts:
        own.setdefault(one.row.key[:2], []).append(one)
    program, pattern = contacts_program(
        assembly.flat.name,
        equations,
        loose,
        [own[one.row.key[:2]] for one in layout.first],
        assembly.parameters,
        plan.finding.kept,
        light_speeds(plan, t, y),
    )
    return SetData(program, pattern, layout, _units(layout, plan))


def _units(layout: Layout, plan: SceneProblem) -> FloatArray:
    parts, owners = _parts_of(layout), layout.owners
    found, first = np.zeros((len(UNITS), len(layout.first))), 0
    for k, (one, rows) in enumerate(zip(layout.first, layout.units, strict=True)):
        size = plan.scales.of(ALONG[one.law.options.unit])
        values = {
            "first": first,
            "width": len(rows),
            "slip": one.is_slip,
            "at": layout.gap_of[k],
            "speed": one.is_speed,
            "poisson": one.is_poisson,
            "part": parts[one.row.key[0]],
            "owner": owners[k],
            "small": size,
            "slow": size / plan.scales.time,
            "rounding": ROUNDED * size,
            "unmoved": unmoved(one, plan.scales),
        }
        for name, value in values.items():
            found[UNITS[name], k] = value
        first += len(rows)
    return found


def changes_in_steps(plan: SceneProblem) -> bool:
    """Return whether steps can change the sets of a scene by themselves: its gaps and slips are in one direction."""
    assembly, equations = plan.assembly, plan.assembly.own_equations
    loops = plan.balance.constraints and assembly.form == "reduced"
    if loops or equations.orientation_coordinates or assembly.sides or not equations.contacts:
        return False
    layout = layout_of(assembly)
    return len(layout.contacts) <= _MOST_ROWS and all(len(rows) == 1 for rows in layout.units)


def kept_whole(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray, stops: bool) -> SceneProblem:
    """Return a plan with the programs for all states, if these are short and its steps can change sets by themselves.

    Then they need not stop where the last contact opens, and where the first one closes. Impacts that need no set are
    quicker with the programs for none, unless there have been many stops, as where they accumulate.
    """
    assembly = plan.assembly
    if not is_loose(assembly) or len(assembly.own_equations.contacts) > FEW_ROWS:
        return plan
    if has_plain_impacts(plan) and not stops:
        return plan
    if not changes_in_steps(plan) or why_in_python(assembly):
        return plan
    whole, y = plan.in_piece(kept_touching(assembly)), np.concatenate([q, u])
    watched = find_event_functions(whole.assembly)
    return whole if _is_short(whole, t, y) or _is_changed(whole, t, y, watched) else plan


def _is_changed(plan: SceneProblem, t: float, y: FloatArray, watched: Sequence[EventFunction]) -> bool:
    """Return whether steps change sets by themselves, where all that is watched are these events."""
    is_watched = any(one.target not in CONTACT for one in watched)
    return not (is_watched or plan.not_compilable) and changes_in_steps(plan) and _code_of(plan, t, y) is not None


def _is_short(plan: SceneProblem, t: float, y: FloatArray) -> bool:
    return program_on_constraints(plan, t, y).accelerations.size <= _SHORT


def sets_of(
    plan: SceneProblem, probe: EventProbe, t: float, y: FloatArray, events: EventData, rates: OwnRates
) -> SetJumps | None:
    """Return the changes of sets of a session; None where these are left to Python.

    Nothing but gaps and slips in one direction may be watched.
    """
    assembly, layout = plan.assembly, layout_of(plan.assembly)
    made = None
    if not is_loose(assembly) and _is_changed(plan, t, y, probe.event_functions):
        made = _code_of(plan, t, y)
    if made is None:
        return None
    (data, code), before = made, len(assembly.mechanism.table.values)
    places = np.array([[before + one[0], before + one[1] if len(one) > 1 else -1] for one in layout.places]).T
    given, count = (rates.prologues, rates.places, rates.scratch), len(layout.contacts)
    own, stays, loose = (code, data.pattern, _units(layout, plan), count), _is_short(plan, t, y), None
    if not stays and count <= FEW_ROWS:
        loose = own_rates_on_constraints(plan.in_piece(in_no_contact(assembly)), t, y)
        stays = loose is not None
    return SetJumps(*own, events, rates.rates, given, places, stays, loose)


def solver_of(plan: SceneProblem, t: float, y: FloatArray) -> SetSolver | None:
    """Return what finds sets where steps stop at each event; None where these are left to Python."""
    made = _code_of(plan, t, y) if changes_in_steps(plan) else None
    if made is None:
        return None
    (data, code), layout = made, layout_of(plan.assembly)
    return SetSolver(code, data.pattern, _units(layout, plan), len(layout.contacts))


def _code_of(plan: SceneProblem, t: float, y: FloatArray) -> tuple[SetData, SetCode] | None:
    """Return the machine code of sets; None where there is none."""
    assembly = plan.assembly

    def make() -> tuple[SetData, SetCode] | None:
        found = None if why_in_python(assembly) else set_data(plan, t, y)
        if found is None or found.program.calls_python:
            return None
        return found, SetCode(found.program)

    return assembly.shared.get(_CODE, make, assembly.form, plan.finding.kept, light_speeds(plan, t, y))


def fill_sets(
    jumps: SetJumps,
    plan: SceneProblem,
    probe: EventProbe,
    relative: float,
    impacts: Sequence[tuple[float, str]],
    shortest: float,
) -> None:
    """Give the changes of a session other parameters and states, and times and parts of the impacts before."""
    scales, functions = plan.scales, probe.event_functions
    table = plan.assembly.kept.get(_TABLE, lambda: _table(plan, functions, relative), functions, scales, relative)
    _give(jumps, plan, relative, impacts)
    jumps.begin_again(table, (shortest, *longest_left(relative, scales), scales.time))


def _table(plan: SceneProblem, functions: Sequence[EventFunction], relative: float) -> FloatArray:
    """Return what is known of each event, by the rows of `EVENTS`."""
    layout, table = layout_of(plan.assembly), np.zeros((len(EVENTS), len(functions)))
    numbers = {one.row.key[:2]: k for k, one in enumerate(layout.first)}
    for i, one in enumerate(functions):
        k, size = numbers[one.part, one.law], plan.scales.of_law(one.part, one.law, one.unit)
        placed = not layout.first[k].is_speed
        table[:, i] = k, HAPPENED.get(one.target, 0), MARGIN * relative * size, placed
    return table


def _states(assembly: Assembly) -> FloatArray:
    """Return the states of gaps and slips, and their directions."""
    found = states_of(layout_of(assembly), assembly.held_now)
    return np.array([[state, *way, *[0.0] * (2 - len(way))] for state, way in found]).T


def _give(jumps: SetSolver, plan: SceneProblem, relative: float, impacts: Sequence[tuple[float, str]]) -> None:
    """Give them parameters and states, and times and parts of the impacts before."""
    assembly = plan.assembly
    states = assembly.kept.get(_STATES, lambda: _states(assembly))
    parts = assembly.shared.get(_PARTS, lambda: _parts_of(layout_of(assembly)))
    past = [(time, parts[part]) for time, part in impacts if part in parts]
    jumps.give(values_on_constraints(plan), states, NEAR * max(relative, 1e-13), past)


def resolved(
    jumps: SetSolver,
    plan: SceneProblem,
    state: tuple[float, FloatArray, FloatArray],
    relative: float,
    triggers: Sequence[EventRecord],
    impacts: Sequence[tuple[float, str]],
    is_start: bool,
    told: float,
) -> Changed | None:
    """Return what `resolve` in `changes` does, by the routine; None where that leaves it to Python."""
    assembly, layout, (t, q, u) = plan.assembly, layout_of(plan.assembly), state
    _give(jumps, plan, relative, impacts)
    happened = {(one.part, one.law): float(HAPPENED.get(one.target, 0)) for one in triggers}
    codes = np.array([happened.get(one.row.key[:2], 0.0) for one in layout.first])
    found = jumps.resolve(t, np.concatenate([q, u]), codes, longest_left(relative, plan.scales), is_start)
    if found is None:
        return None
    one, closed = found[0]._replace(time=told), found[1]
    was = states_of(layout, assembly.held_now)
    if is_start:
        closes = [first.is_closed_at_start(assembly.flat.parts) for first in layout.first]
        before = [(STICKS, one[1]) if is_closed else one for one, is_closed in zip(was, closes, strict=True)]
    held = held_after(one, assembly)
    events = in_own_words(
        assembly, layout, told, _told(layout, one, was), (before if is_start else was, states_of(layout, held))
    )
    touching = list(assembly.held_now)
    for is_closed, places in zip(closed.tolist(), layout.places, strict=True):
        for place in places:
            touching[place] = float(is_closed)
    return Changed(one.states[1][len(q) :], held, tuple(events), tuple(touching) if closed.any() else ())


def noted_sets(log: SetLog, assembly: Assembly, changes: Callable[[], Sequence[Change]]) -> ToldLater:
    """Return what is told of changes, with the parts of the impacts among them."""
    first = layout_of(assembly).first
    return ToldLater(
        lambda: [event for one in changes() for event in one.told],
        lambda: [(time, first[gap].row.key[0]) for time, gap in log.strikes()],
    )


def held_after(jump: SetJump, assembly: Assembly) -> tuple[float, ...]:
    """Return the discrete states after a change."""
    layout, held = layout_of(assembly), list(assembly.held_now)
    for is_slip, places, values in zip(layout.is_slip, layout.places, jump.set.T.tolist(), strict=True):
        own = values if is_slip else (float(values[0] == STICKS),)
        for place, value in zip(places, own, strict=False):
            held[place] = value
    return tuple(held)


def told_sets(log: SetLog, assembly: Assembly) -> list[Change]:
    """Return changes with the discrete states after each, and what is told of it."""
    layout, held, found = layout_of(assembly), assembly.held_now, list[Change]()
    for one in log.changes():
        before, held = states_of(layout, held), held_after(one, assembly)
        told = in_own_words(assembly, layout, one.time, _told(layout, one, before), (before, states_of(layout, held)))
        strikes = any(each.impact for each in told)
        found.append(Change(one.time, one.states, held, told, strikes, one.stopped >= 0))
    return found


def _told(layout: Layout, one: SetJump, before: Sequence[State]) -> list[EventRecord]:
    """Return what is told of a change: of impacts, and of each gap and slip that has another state."""
    told = [] if one.stopped < 0 else [told_rest(one.time, layout.first[one.stopped].row.key[:2], one.left)]
    told += [_struck(layout, one.time, row) for row in one.struck.tolist()]
    for k, (state, *ways) in enumerate(one.set.T.tolist()):
        after: State = (int(state), tuple(ways[: len(layout.units[k])]))
        change = told_change(one.time, layout.first[k], before[k], after)
        told += [] if change is None else [change]
    return told


def _struck(layout: Layout, t: float, entry: Sequence[float]) -> EventRecord:
    k, before, after, loss, *impulses = entry
    number, first = int(k), layout.first[int(k)]
    rubs = [row for rows, at in zip(layout.units, layout.gap_of, strict=True) if at == number for row in rows]
    acting = tuple(impulses[row] for row in (*layout.units[number], *rubs))
    return told_impact(t, first.row.key[:2], first.law.options.unit, acting, (before, after), loss)


def _parts_of(layout: Layout) -> dict[str, int]:
    """Return numbers of the parts that have contacts."""
    return {part: i for i, part in enumerate(dict.fromkeys(one.row.key[0] for one in layout.first))}
