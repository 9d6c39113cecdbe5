"""States of gaps and slips as units have them, and as values of the discrete states of a scene."""

from __future__ import annotations

from collections.abc import Sequence

from atwood.numerics.contact_sets import OPEN, STICKS, State
from atwood.simulation.contacts.values import Layout


def states_of(layout: Layout, held: Sequence[float]) -> list[State]:
    """Return the states of all units that discrete states say."""
    found: list[State] = []
    for one, places in zip(layout.first, layout.places, strict=True):
        state, *way = (held[place] for place in places)
        found.append((int(state), tuple(way)) if one.is_slip else ((STICKS if state else OPEN), (0.0,)))
    return found


def values_of_states(layout: Layout, held: Sequence[float], states: Sequence[State]) -> list[float]:
    """Return discrete states with those of all units; a slip at a gap that is open is open, too."""
    found = list(held)
    for one, at, places, (state, way) in zip(layout.first, layout.gap_of, layout.places, states, strict=True):
        if one.is_slip and at >= 0 and states[at][0] == OPEN:
            state, way = OPEN, (0.0,) * len(way)
        for place, value in zip(
            places, (float(state), *way) if one.is_slip else (float(state == STICKS),), strict=True
        ):
            found[place] = value
    return found
