"""Impacts at one gap where nothing else touches: steps go on behind them without Python.

They are those of `atwood.simulation.contacts.changes`, which sees to all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.sundials.events import EventData
from atwood.forms.caches import Key
from atwood.forms.loose import is_loose
from atwood.integrators.jumps import JumpLog, Jumps
from atwood.integrators.protocol import CompiledRates
from atwood.mechanics.dynamics.equations import ContactRow
from atwood.mechanics.outputs.event_functions import CLOSES, EventFunction
from atwood.model.values.units import ALONG
from atwood.simulation.contacts.changes import NEAR, longest_left
from atwood.simulation.contacts.event_records import told_impact
from atwood.simulation.events.modes import LAST, EventProbe, EventRecord, ToldLater
from atwood.simulation.problem.explicit_scene import impact_code, values_on_constraints
from atwood.simulation.problem.problem import SceneProblem

_Table: TypeAlias = tuple[FloatArray, dict[str, int], list[int]]
_TABLE: Key[_Table] = Key("events of gaps for impacts in steps")


def _gaps(plan: SceneProblem) -> list[ContactRow]:
    return [one for one in plan.assembly.own_equations.contacts if not one.is_slip]


def _plain(plan: SceneProblem) -> dict[tuple[str, str], int]:
    """Return the numbers of the gaps without friction whose impacts are Newton's, and told of as such."""
    rubs = {(one.row.key[0], one.law.options.at) for one in plan.assembly.own_equations.contacts if one.is_slip}
    own = [one for one in enumerate(_gaps(plan)) if not one[1].is_poisson and not one[1].law.options.closes]
    return {one.row.key[:2]: i for i, one in own if one.row.key[:2] not in rubs}


def has_plain_impacts(plan: SceneProblem) -> bool:
    """Return whether there are impacts that steps make by themselves: no friction acts that needs no gap."""
    assembly, equations = plan.assembly, plan.assembly.own_equations
    always = any(one.is_speed or (one.is_slip and not one.law.options.at) for one in equations.contacts)
    holds = plan.balance.constraints or equations.orientation_coordinates or assembly.sides
    return not (always or holds) and bool(_plain(plan))


def bounces_of(
    plan: SceneProblem, probe: EventProbe, t: float, y: FloatArray, events: EventData, rates: CompiledRates
) -> Jumps | None:
    """Return the impacts of a session; None where there are none that can be made so.

    Nothing but gaps on places may be watched.
    """
    is_watched = any(one.target != CLOSES for one in probe.event_functions)
    if is_watched or not is_loose(plan.assembly) or not has_plain_impacts(plan):
        return None
    code = impact_code(plan, t, y, _gaps(plan))
    return None if code is None else Jumps(code, events, rates)


def fill_bounces(
    jumps: Jumps, plan: SceneProblem, probe: EventProbe, relative: float, impacts: Sequence[tuple[float, str]]
) -> None:
    """Give the impacts of a session other parameters, and the times and parts of the impacts before."""
    scales, functions = plan.scales, probe.event_functions
    about = functions, scales, relative
    table, numbers, parts = plan.assembly.kept.get(_TABLE, lambda: _table(plan, functions, relative), *about)
    past = [(time, numbers[part]) for time, part in impacts if part in numbers]
    jumps.fill(values_on_constraints(plan), table, parts, max(longest_left(relative, scales)), past)


def _table(plan: SceneProblem, functions: Sequence[EventFunction], relative: float) -> _Table:
    """Return what is known of each event, whose gap has no row if it is not plain, and the numbers of parts."""
    gaps, plain, scales = _gaps(plan), _plain(plan), plan.scales
    near = NEAR * max(relative, 1e-13)
    small = [near * scales.of(ALONG[one.law.options.unit]) for one in gaps]
    size = {one.row.key[:2]: each for one, each in zip(gaps, small, strict=True)}
    watched = [(one.part, one.law) for one in functions]
    rows, sizes = [plain.get(one, -1) for one in watched], np.array([size[one] for one in watched])
    parts = {part: i for i, part in enumerate(dict.fromkeys(one.row.key[0] for one in gaps))}
    return np.array([rows, sizes, sizes / scales.time]), parts, [parts[one.row.key[0]] for one in gaps]


def noted_bounces(log: JumpLog, plan: SceneProblem, probe: EventProbe) -> ToldLater:
    """Return what is told of impacts, and when which parts had the last of them."""
    watched = [(one.part, one.law) for one in probe.event_functions]

    def told() -> list[EventRecord]:
        units = {one.row.key[:2]: one.law.options.unit for one in _gaps(plan)}
        return [
            told_impact(
                one.time, watched[one.event], units[watched[one.event]], (one.impulse,), (one.before, one.after)
            )
            for one in log.jumps()
        ]

    def strikes() -> list[tuple[float, str]]:
        return [(time, watched[int(event)][0]) for time, event in log.entries[-LAST:, :2].tolist()]

    return ToldLater(told, strikes)
