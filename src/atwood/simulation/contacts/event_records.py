"""What is told of gaps and slips: impacts, changes of their states, and rests, as records of events."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import made_of, replace
from atwood.mechanics.dynamics.equations import ContactRow
from atwood.model.values.units import ALONG
from atwood.numerics.contact_sets import GOES_ON, OPEN, STICKS, State
from atwood.simulation.contacts.values import Layout
from atwood.simulation.events.modes import EventRecord, Impact

_RESTS = "impacts have accumulated: it rests"

_LOOKED_AT, _FEW = 10, 4
"""So many impacts before a rest say how intervals go on to shrink, and no fewer."""

_SWINGS = 0.02
"""Where others have impacts in between, factors that change by more than this swing: what is left is a guess."""

_LARGER = 3.0
"""Times how far a series seems to be off: it may be off by so much."""


def told_rest(t: float, key: tuple[str, str], left: float) -> EventRecord:
    """Return the event of a gap whose impacts have accumulated, which have come to an end some time later."""
    return EventRecord(t + left, *key, _RESTS, "", True, "rests")


def with_doubts(events: Sequence[EventRecord], least: float) -> tuple[EventRecord, ...]:
    """Return events in which times of rest say by how much they may be off, where that is more than a least time, s.

    What is left of a series whose intervals shrink by r is the last one times ``r/(1 - r)``, and takes about
    ``1/(1 - r)`` intervals. If r changes by d in each, a share of about ``d/(1 - r)^2`` of it is in doubt, as where
    what bounces is squeezed by what is nearly too heavy to come to rest. Where others have impacts in between it is no
    rounding that lets them rise and fall.
    """
    found = list(events)
    for number, one in enumerate(events):
        if one.message != _RESTS:
            continue
        times = [x.time for x in events[:number] if x.kind == "impact" and (x.part, x.law) == (one.part, one.law)]
        doubt = 0.0 if len(times) <= _FEW else one.time - times[-1]
        in_turn = doubt != 0.0 and any(
            x.kind == "impact" and x.part != one.part and times[-2] < x.time < times[-1] for x in events[:number]
        )
        for count in range(len(times), _FEW, -1):
            may_be_off, is_rounding = _doubt(times[max(0, count - _LOOKED_AT) : count], one.time, in_turn)
            doubt = min(doubt, may_be_off)
            if in_turn or not is_rounding:
                break
        if doubt > least:
            found[number] = replace(one, message=f"{one.message}, at a time that may be off by {doubt:.1g} s")
    return tuple(found)


def _doubt(times: Sequence[float], end: float, swings: bool) -> tuple[float, bool]:
    """Return by how much the end of a series may be off, as some impacts say, s, and whether rounding tells in these.

    Factors that rise and fall are rounding, and those before say more; of those that swing by themselves all count.
    """
    spans, left = np.diff(times), end - times[-1]
    if not np.all(spans > 0.0) or spans[-1] == spans[-2]:
        return left, True
    shares = spans[1:] / spans[:-1]
    changes = np.diff(shares)
    change = float(np.max(np.abs(changes)) if swings else abs(np.median(changes)))
    doubt = left * min(1.0, _LARGER * change / (1.0 - float(shares[-1])) ** 2)
    if swings and change > _SWINGS:
        doubt = _LARGER * left
    return doubt, bool(np.any(changes > 0.0) and np.any(changes < 0.0))


def told_change(t: float, first: ContactRow, before: State, after: State) -> EventRecord | None:
    """Return the event of a gap or a slip that has another state; None where it has none, or is loose."""
    (was, last), (state, way) = before, after
    part, name, _ = first.row.key
    said = ""
    if not first.is_slip and state != was:
        said, kind = (f"{name} closes", "closes") if state else (f"{name} opens", "opens")
    elif first.is_slip and state == was == GOES_ON and float(np.dot(way, last)) < 0.0:
        said, kind = f"{name} reverses", "reverses"
    elif first.is_slip and state != was and state:
        said, kind = (f"{name} sticks", "sticks") if state == STICKS else (f"{name} begins", "slips")
    return EventRecord(t, part, name, said, "", False, kind) if said else None


def told_changes(t: float, layout: Layout, before: Sequence[State], states: Sequence[State]) -> list[EventRecord]:
    """Return what is told of units whose states change."""
    found = (told_change(t, one, was, now) for one, was, now in zip(layout.first, before, states, strict=True))
    return [each for each in found if each is not None]


def told_impact(
    t: float,
    key: tuple[str, str],
    unit: str,
    impulses: tuple[float, ...],
    speeds: tuple[float, float],
    loss: float | None = None,
) -> EventRecord:
    """Return the event of an impact at a gap: impulses along it and along its slips, its rates before and after.

    Without friction the loss follows from these.
    """
    part, law = key
    before, after = speeds
    loss = -0.5 * impulses[0] * (before + after) if loss is None else loss
    own = {"time": t, "part": part, "law": law}
    struck = made_of(Impact, **own, impulse=impulses[0], friction=impulses[1:], before=before, after=after, loss=loss)
    said = f"an impact at {-before:.6g} {ALONG[unit]}/s"
    return made_of(EventRecord, **own, message=said, target="", impact=True, kind="impact", struck=struck)


def in_own_words(
    assembly: Assembly,
    layout: Layout,
    t: float,
    events: Sequence[EventRecord],
    states: tuple[Sequence[State], Sequence[State]],
) -> list[EventRecord]:
    """Return events in which gaps that have words of their own for what happens are told of in these.

    Parameters
    ----------
    assembly, layout, t
        The scene, its gaps and slips, and the time.
    events
        What has happened, as of any gap.
    states
        Those of all gaps and slips before and after it.
    """
    found = list(events)
    for one, (before, _), (after, _) in zip(layout.first, *states, strict=True):
        words, key = one.told(assembly.flat.parts), one.row.key[:2]
        if not any(words):
            continue
        own = [each for each in found if (each.part, each.law) == key]
        struck = next((each for each in own if each.impact), None)
        told = [] if struck is None or before == OPEN else [struck]
        happened = (before == OPEN and (after != OPEN or struck), after == OPEN and (before != OPEN or struck))
        for has, said, kind in zip(happened, words, ("closes", "opens"), strict=True):
            if not has:
                continue
            if said is None:
                told += [each for each in own if (each.kind == "opens") == (kind == "opens")]
                continue
            known = struck if kind == "closes" and struck else EventRecord(t, *key, "", "", False, kind)
            told.append(replace(known, **said._asdict()))
        place = found.index(own[0]) if own else len(found)
        found[place:] = [*told, *(each for each in found[place:] if (each.part, each.law) != key)]
    return found
