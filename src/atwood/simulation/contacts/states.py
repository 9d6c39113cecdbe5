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


def without_loose(layout: Layout, states: Sequence[State]) -> list[State]:
    """Return states of all units in which a slip at a gap that is open is open, too: it neither holds nor rubs."""
    is_loose = [at >= 0 and states[at][0] == OPEN for at in layout.gap_of]
    return [(OPEN, (0.0,) * len(one[1])) if off else one for one, off in zip(states, is_loose, strict=True)]


def values_of_states(layout: Layout, held: Sequence[float], states: Sequence[State]) -> list[float]:
    """Return discrete states with those of all units."""
    found = list(held)
    for one, places, (state, way) in zip(layout.first, layout.places, states, strict=True):
        for place, value in zip(
            places, (float(state), *way) if one.is_slip else (float(state == STICKS),), strict=True
        ):
            found[place] = value
    return found
