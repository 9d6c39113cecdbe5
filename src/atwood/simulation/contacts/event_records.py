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


def told_rest(t: float, key: tuple[str, str], left: float) -> EventRecord:
    """Return the event of a gap whose impacts have accumulated, which have come to an end some time later."""
    return EventRecord(t + left, *key, "impacts have accumulated: it rests", "", True, "rests")


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
        said, kind = (f"{name} sticks", "sticks") if state == STICKS else (f"{name} goes on", "slips")
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
