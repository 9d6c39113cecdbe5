"""One set of contacts, in which some gaps are closed and some slips stick, as a scene of ordinary constraints.

Between two events a scene moves as in one set. There what holds is a constraint and what slips a load, and theory of
smooth systems applies to it. It says what is true of neighbours as long as the set is strictly complementary: forces
of closed gaps push, what sticks has a reserve, open gaps are open, and what slips moves (C. Glocker, *Set-Valued Force
Laws*, 2001).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from atwood.arguments import BY_PATH, optional
from atwood.arrays import FloatArray
from atwood.errors import UsageError, suggestion
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.loose import state_paths
from atwood.forms.reassembly import assembled
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import ContactRow
from atwood.model.declare.contact_laws import value_names
from atwood.model.declare.laws import Law
from atwood.model.local.flatten import FlatScene
from atwood.model.values.units import ALONG
from atwood.numerics.contact_sets import GOES_ON, OPEN, STICKS, State
from atwood.simulation.contacts.changes import resolve
from atwood.simulation.contacts.forces import forces_in
from atwood.simulation.contacts.groups import refuse_groups
from atwood.simulation.contacts.states import states_of
from atwood.simulation.contacts.values import ContactValues, layout_of
from atwood.simulation.dynamics.orientation_coordinates import from_regular
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.dynamics.scales import Scales, find_scales
from atwood.simulation.events.mode_change import generalized_state
from atwood.simulation.initialization.start import find_start
from atwood.tolerances import tolerances

CONTACTS = optional(replace(BY_PATH, word="GAP=STATE"))

_IN_SET: Key[Assembly] = Key("the scene in one set of contacts")


class Margin(NamedTuple):
    """How far a gap or a slip is from the border of its state.

    Attributes
    ----------
    path, law
        The part, and the path of the gap or the slip.
    what
        What the value is of: a force, a reserve of friction, a gap or a speed.
    value, small
        Its value, and what is zero but for rounding.
    unit
        SI unit of both.
    """

    path: str
    law: str
    what: str
    value: float
    small: float
    unit: str

    @property
    def is_strict(self) -> bool:
        """Whether neighbours are in the same state."""
        return self.value > self.small

    @property
    def is_met(self) -> bool:
        """Whether the state is possible here."""
        return self.value >= -self.small


@dataclass(frozen=True, eq=False)
class ContactSet:
    """Which gaps of a scene are closed, and what sticks, slips or touches nothing.

    Attributes
    ----------
    words
        For each gap and slip by path: open or closed; loose, sticks, or where it slips to.
    states
        The same as values of discrete states by path.
    margins
        How far each is from the border of its state.
    """

    words: Mapping[str, str]
    states: Mapping[str, float]
    margins: tuple[Margin, ...] = ()

    @property
    def reserves(self) -> dict[str, float]:
        """What friction could hold besides, N or N m, of each slip that sticks by path."""
        return {one.law: one.value for one in self.margins if self.words[one.law] == "sticks"}


def has_contacts(assembly: Assembly) -> bool:
    """Return whether a scene has gaps or slips in no set that is chosen."""
    refuse_groups(assembly)
    return any(local.contacts for local in assembly.mechanism.locals_.values())


def in_set(assembly: Assembly, states: Mapping[str, float]) -> Assembly:
    """Return a scene in one set of contacts, with ordinary constraints for what holds.

    Constraints on velocities stay as they are, also those that could be integrated: what sticks may stick elsewhere.
    """
    flat = replace(assembly.flat, contact_states=dict(states))
    form = assembly.form, assembly.level, assembly.orientation.kind
    origin, signs = assembly.mechanism.origin, assembly.mechanism.line_signs

    def make() -> Assembly:
        return assembled(type(assembly), flat, None, *form, assembly.modes, signs, origin=origin)

    made = assembly.shared.get(_IN_SET, make, tuple(sorted(states.items())))
    followed, _ = made.follow(flat)
    found = make() if followed is None else followed
    now = dict(zip((one.path for one in assembly.discrete_states), assembly.held_now, strict=True))
    found = replace(found, held=tuple(now[one.path] for one in found.discrete_states), source=assembly.source)
    is_alike = len(found.relations) == len(assembly.relations)
    return found.with_relations(assembly.relation_values) if is_alike else found


def set_at(
    assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float, is_settled: bool = False
) -> ContactSet:
    """Return the set that a scene is in, or enters, at a state, with how far everything in it is from its border.

    Parameters
    ----------
    assembly
        The scene.
    t, q, u
        The state in the coordinates of its form.
    length
        Extent of the scene, m.
    is_settled
        Whether discrete states of the assembly say the set.
    """
    values = ContactValues(assembly, t, q, u, length)
    flat = assembly.flat
    scales = find_scales(
        assembly, length, values.u, values.falling, values.sizes, max(flat.t_end - flat.t_start, 0.0) or 1.0
    )
    held = assembly.held_now
    if not is_settled:
        changed = resolve(assembly, (t, q, u), length, scales, 0.1 * tolerances.CLOSED, is_start=True)
        struck = next((one for one in changed.events if one.impact), None)
        if struck is not None:
            raise UsageError(
                f"something collides here: {struck.message}",
                where=f"{struck.part}.{struck.law}",
                advice="Look at a state at which nothing approaches what it touches.",
            )
        held = changed.held
    states = states_of(values.layout, held)
    return set_of(assembly.flat, values.layout.first, states, margins_in(values, states, scales))


def state_in_set(
    before: Assembly, after: Assembly, t: float, q: FloatArray, u: FloatArray, length: float
) -> tuple[FloatArray, FloatArray]:
    """Return a state of a scene in the generalized coordinates and speeds of one of its sets, or the other way."""
    whole = maximal_state(before, np.array([t]), q[:, None], u[:, None])
    sides = [(one.maximal.names, one.maximal.speed_names) for one in (before, after)]
    maximal = [  # an angle that no law of a set reads is none of its coordinates: it is not known there
        np.array([dict(zip((x.name for x in had), values[:, 0], strict=True)).get(x.name, np.nan) for x in wanted])
        for values, had, wanted in zip(whole, *sides, strict=True)
    ]
    place, speeds, _ = generalized_state(before, after, t, (q, u), (maximal[0], maximal[1]), length)
    return place, speeds


def refuse_border(found: ContactSet) -> None:
    """Refuse a set in which something is at the border of its state, so that neighbours are in other sets."""
    one = next((one for one in found.margins if not one.is_strict), None)
    if one is not None:
        raise UsageError(
            f"{one.what} is at its border, {one.value:.3g} {one.unit}: neighbours are in other sets of contacts",
            where=one.law,
            advice="Look at a state beside it: gaps are open or pressed there, and what rubs slips or has a reserve.",
        )


def named_set(assembly: Assembly, given: Mapping[str, Any]) -> ContactSet:
    """Return the set that is meant by states of gaps and slips by path; gaps that are not named are open."""
    first = layout_of(assembly).first
    known = {_law(one): one for one in first}
    for path in given:
        if path not in known:
            raise UsageError("it is no gap and no slip", where=path, advice=suggestion(path, list(known)))
    states: list[State] = []
    for path, one in known.items():
        count, choices = len(one.law.options.reactions), _choices(one.law)
        gap = f"{one.row.key[0]}.{one.law.options.at}" if one.is_slip and one.law.options.at else ""
        default = "open" if not one.is_slip else "loose" if gap and given.get(gap, "open") == "open" else ""
        word = given.get(path, default)
        if word not in choices or (gap and word != "loose" and given.get(gap, "open") == "open"):
            said = f"it cannot be {word!r}" if word else "nothing says whether it slips"
            more = f", with {gap} closed" if gap else ""
            raise UsageError(said, where=path, advice=f"Choose of {', '.join(choices)}{more}.")
        number = {"open": OPEN, "loose": OPEN, "closed": STICKS, "sticks": STICKS}.get(word, GOES_ON)
        way = (-1.0 if word == "slips backwards" else 1.0, 0.0)[:count] if number == GOES_ON else (0.0,) * count
        states.append((number, way))
    return set_of(assembly.flat, first, states)


def words_of(flat: FlatScene) -> dict[str, str]:
    """Return the set that is chosen for a scene in words: what each gap and slip does, by path."""
    found: dict[str, str] = {}
    for path, part in flat.parts.items():
        for law in part.component.contact_laws().values():
            state = flat.contact_states.get(f"{path}.{law.name}_state")
            if state is not None:
                back = flat.contact_states.get(f"{path}.{value_names(law)[0]}_direction", 0.0) < 0.0
                number = {OPEN: 0, GOES_ON: 2, STICKS: 1}[int(state)] if law.kind == "friction" else int(state)
                found[f"{path}.{law.name}"] = _choices(law)[3 if number == 2 and back else number]
    return found


def _choices(law: Law) -> tuple[str, ...]:
    if law.kind == "unilateral":
        return "open", "closed"
    ways = ("slips forwards", "slips backwards") if len(law.options.reactions) == 1 else ("slips",)
    return "loose", "sticks", *ways


def _law(one: ContactRow) -> str:
    return ".".join(one.row.key[:2])


def states_by_path(first: Sequence[ContactRow], states: Sequence[State]) -> dict[str, float]:
    """Return states of gaps and slips as values of discrete states by path."""
    values: dict[str, float] = {}
    for one, (state, way) in zip(first, states, strict=True):
        told = (float(state), *way) if one.is_slip else (float(state == STICKS),)
        values |= dict(zip(state_paths(one), told, strict=True))
    return values


def set_of(
    flat: FlatScene, first: Sequence[ContactRow], states: Sequence[State], margins: tuple[Margin, ...] = ()
) -> ContactSet:
    """Return the set of contacts that states are."""
    values = states_by_path(first, states)
    return ContactSet(words_of(replace(flat, contact_states=values)), values, margins)


def margins_in(values: ContactValues, states: Sequence[State], scales: Scales) -> tuple[Margin, ...]:
    """Return how far each gap and slip is from the border of its state."""
    forces = forces_in(values, states)
    limits, found = values.limits_at(forces), []
    for k, (one, (state, _), rows) in enumerate(zip(values.layout.first, states, values.units, strict=True)):
        unit, own = one.law.options.unit, forces[list(rows)]
        along = ALONG[unit]
        static = [side.static_free[k] + float(side.static_shares[k] @ forces) for side in limits]
        if state == STICKS and one.is_slip:
            held = min(static[1] - own[0], static[0] + own[0]) if len(rows) == 1 else static[0] - math.hypot(*own)
            told = "what friction could hold besides", float(held), unit
        elif state == STICKS:
            told = "its force", float(own[0] + static[0]), unit
        elif one.is_slip:
            if state == OPEN:
                continue  # nothing that rubs
            told = "its speed", math.hypot(*values.rates[list(rows)]), f"{along}/s"
        elif one.is_speed:
            told = "its speed", float(values.rates[rows[0]]), f"{along}/s"
        else:
            told = "the gap", float(values.values[rows[0]]), along
        found.append(Margin(one.row.key[0], _law(one), *told[:2], tolerances.CLOSED * scales.of(told[2]), told[2]))
    return tuple(found)


def in_named_set(assembly: Assembly, given: Mapping[str, Any] | None) -> Assembly:
    """Return a scene in the set that is meant, or in that of its start; as it is where it has no gaps and no slips."""
    if given is not None:
        return in_set(assembly, named_set(assembly, given).states)
    if not has_contacts(assembly):
        return assembly
    start, whole = find_start(assembly), replace(assembly, form="reduced", level="")
    q = from_regular(assembly, start.coordinates)
    return in_set(assembly, set_at(whole, start.time, q, start.speeds, start.length).states)


def loosened(assembly: Assembly) -> Assembly:
    """Return a scene in generalized coordinates in which every gap is open and nothing rubs."""
    whole = replace(assembly, form="reduced", level="")
    paths = (path for one in whole.reduced.contacts for path in state_paths(one))
    return in_set(whole, dict.fromkeys(paths, 0.0))


def words_text(words: Mapping[str, str]) -> str:
    """Return a set in a line."""
    return ", ".join(f"{path} {word}" for path, word in words.items())
