"""What gaps and slips do at a moment: impacts, and which of them hold from then on.

Between two moments the states of gaps and slips are parameters of the equations. At a moment velocities jump where a gap
closes with a speed, and the states are found anew such that no inequality is contradicted at accelerations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import SolveError, StartError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import ContactRow
from atwood.mechanics.outputs.event_functions import OPENS, YIELDS
from atwood.numerics.contact_sets import GOES_ON, OPEN, STICKS, Found, all_states, find_states
from atwood.numerics.matrices import least_norm
from atwood.simulation.contacts.values import ContactValues, state_paths
from atwood.simulation.dynamics.orientation_coordinates import to_regular
from atwood.simulation.dynamics.scales import Scales
from atwood.simulation.events.mode_change import generalized_speeds
from atwood.simulation.events.modes import EventRecord

_NEAR = 10.0
"""Times the relative tolerance, in sizes of the scene: what is nearer to zero is there."""

_MOST_TURNS = 50
"""Limits that are curved in the forces are met in so many turns at most."""

_MOST_IMPACTS = 1000
"""So many impacts one after the other happen at one moment at most."""


@dataclass(frozen=True, eq=False)
class Changed:
    """What has become of a scene at a moment.

    Attributes
    ----------
    speeds
        Those of the form.
    held
        Values of the discrete states.
    events
        What has happened.
    """

    speeds: FloatArray
    held: tuple[float, ...]
    events: tuple[EventRecord, ...]


class _Moment:
    """Gaps and slips at one moment, while it is worked out what becomes of them."""

    def __init__(
        self, values: ContactValues, scales: Scales, relative: float, triggers: Sequence[EventRecord], rests: bool
    ) -> None:
        self.values, self.rests = values, rests
        self.contacts, self.t = values.contacts, values.t
        self.u = values.u.copy()
        paths = {one.path: i for i, one in enumerate(values.assembly.discrete_states)}
        assembly = values.assembly
        self.held = list(assembly.held_at_start if assembly.held is None else assembly.held)
        self.places = [tuple(paths[path] for path in state_paths(one)) for one in self.contacts]
        self.states = [int(self.held[place[0]]) for place in self.places]
        self.before = [self._state(i) for i in range(len(self.contacts))]
        units = [{"N": "m", "N*m": "rad"}[one.law.options.unit] for one in self.contacts]
        near = _NEAR * max(relative, 1e-13)
        self.small = near * np.array([scales.of(unit) for unit in units])
        self.slow = self.small / scales.time
        self.triggers = {one.part + "." + one.law: one.target for one in triggers}
        self.events: list[EventRecord] = []

    def _state(self, i: int) -> tuple[int, float]:
        state = int(self.held[self.places[i][0]])
        if self.contacts[i].is_slip:
            return state, float(self.held[self.places[i][1]])
        return (STICKS if state else OPEN), 0.0

    def trigger(self, i: int) -> str:
        """Return the target of the event of a row; empty where it has none now."""
        part, law, _ = self.contacts[i].row.key
        return self.triggers.get(f"{part}.{law}", "")

    @property
    def touching(self) -> list[int]:
        """The gaps that are closed."""
        values = self.values
        return [
            i
            for i, one in enumerate(self.contacts)
            if not one.is_slip and (self.before[i][0] == STICKS or values.values[i] <= self.small[i])
        ]

    def rates(self) -> FloatArray:
        """Return the rates of all rows now."""
        return self.values.rates + self.values.slopes @ (self.u - self.values.u)

    def slips_at(self, gaps: Sequence[int]) -> list[int]:
        """Return the slips that may rub where some gaps are closed."""
        at, places = self.values.gap_of, set(gaps)
        return [
            i for i, one in enumerate(self.contacts) if one.is_slip and (at[i] in places or not one.law.options.at)
        ]

    # -- impacts --------------------------------------------------------------------------------------------------

    def collide(self, one_by_one: bool) -> None:
        """Let what approaches collide, until nothing does."""
        for _ in range(_MOST_IMPACTS):
            rates, touching = self.rates(), self.touching
            coming = [i for i in touching if rates[i] < -self.slow[i]]
            if not coming:
                return
            if one_by_one:
                fastest = min(rates[i] for i in coming)
                coming = [i for i in coming if rates[i] <= fastest * (1.0 - 1e-9)]
                touching = coming
            self._impact(touching, rates)
        raise SolveError(
            f"at t = {self.t:.9g} impacts follow each other without end",
            where=self.contacts[0].row.key[0],
            advice="With impacts='together' they are solved at once.",
        )

    def _impact(self, touching: list[int], rates: FloatArray) -> None:
        values = self.values
        chosen = [*touching, *self.slips_at(touching)]
        share = np.zeros(len(self.contacts)) if self.rests else values.restitution
        poisson = [i for i in touching if self.contacts[i].law.options.impact_law == "poisson"]
        free = rates.copy()
        for i in touching:
            if i not in poisson:
                free[i] -= share[i] * max(-rates[i], 0.0)  # it opens with this speed, or faster
        impulses = self._impulses(chosen, free)
        if any(share[i] * impulses[i] > 0.0 for i in poisson):
            again = np.where(np.isin(np.arange(len(free)), poisson), share * impulses, 0.0)
            free = free + values.response @ (impulses + again)
            impulses = impulses + again + self._impulses(chosen, free)
        after = rates + values.response @ impulses
        work, size = 0.5 * impulses * (rates + after), 0.5 * np.abs(impulses) * (np.abs(rates) + np.abs(after))
        if float(np.sum(work)) > 1e-9 * float(np.sum(size)):
            worst = max(touching, key=lambda i: float(work[i]))
            raise SolveError(
                f"at t = {self.t:.9g} Newton's law of impact would make energy of {float(np.sum(work)):.3g} J",
                where=self.contacts[worst].row.key[0],
                advice="Declare the gap with impact_law='poisson', or choose that law of the part.",
            )
        self.u = self.u + values.speeds_by(impulses)
        for i in touching:
            if rates[i] < -self.slow[i]:
                part, law, _ = self.contacts[i].row.key
                said = f"an impact at {-rates[i]:.6g} {'m/s' if self.contacts[i].law.options.unit == 'N' else 'rad/s'}"
                self.events.append(EventRecord(self.t, part, law, said, "", True, "impact"))

    def _impulses(self, chosen: list[int], free: FloatArray) -> FloatArray:
        """Return the impulses of all rows, with velocities in place of accelerations: only limits by forces count."""
        values, count = self.values, len(self.contacts)
        found = np.zeros(count)
        for _ in range(_MOST_TURNS):
            _, shares, _, static_shares = values.limits_at(found)
            none = np.zeros(count)
            rows = values.rows(chosen, free, none, (none, shares, none, static_shares))
            solved = find_states(rows, [STICKS] * len(chosen), [0.0] * len(chosen))
            if solved is None:
                raise self._contradiction("no impulses satisfy the laws of impact and friction", chosen)
            last, found = found, np.zeros(count)
            found[chosen] = solved.forces
            if float(np.max(np.abs(found - last), initial=0.0)) <= 1e-12 * float(np.max(np.abs(found), initial=0.0)):
                break
        return found

    # -- accelerations --------------------------------------------------------------------------------------------

    def settle(self, past: bool) -> None:
        """Find the states that hold from now on."""
        values, rates = self.values, self.rates()
        gaps = [i for i in self.touching if abs(rates[i]) <= self.slow[i] and self.trigger(i) != OPENS]
        slips = self.slips_at(gaps)
        given = np.zeros(len(self.contacts))
        for i in slips:
            if abs(rates[i]) > self.slow[i]:
                given[i] = np.sign(rates[i])
            elif self.trigger(i) == YIELDS:
                given[i] = self._yielding(i)
        chosen = [*gaps, *slips]
        found = self._found(chosen, given)
        if found is None:
            found = self._jammed(chosen, given)
        self._take(chosen, found, given, rates)
        held = [i for k, i in enumerate(chosen) if found.states[k] == STICKS and found.forces is not None]
        if held:  # what holds from now on holds to rounding
            now = self.rates()
            push = np.zeros(len(self.contacts))
            push[held] = least_norm(values.response[np.ix_(held, held)], -now[held])
            self.u = self.u + values.speeds_by(push)

    def _found(self, chosen: list[int], given: FloatArray) -> Found | None:
        values, free = self.values, self.values.accelerations()
        forces, found, states = np.zeros(len(self.contacts)), None, [self.before[i] for i in chosen]
        for _ in range(_MOST_TURNS):
            limits = values.limits_at(forces)
            found = find_states(values.rows(chosen, free, given, limits), *self._split(states, chosen))
            if found is None:
                return None
            last, forces = forces, np.zeros(len(self.contacts))
            forces[chosen] = found.forces
            states = list(zip(found.states, found.directions, strict=True))
            if float(np.max(np.abs(forces - last), initial=0.0)) <= 1e-12 * float(
                np.max(np.abs(forces), initial=0.0)
            ):
                break
        self.forces = forces
        return found

    def _split(self, states: list[tuple[int, float]], chosen: list[int]) -> tuple[list[int], list[float]]:
        """Return states and directions; a gap that has just come to rest is closed, to begin with."""
        first = [
            STICKS if not self.contacts[i].is_slip and s == OPEN and abs(self.rates()[i]) <= self.slow[i] else s
            for i, (s, _) in zip(chosen, states, strict=True)
        ]
        return first, [d for _, d in states]

    def _yielding(self, i: int) -> float:
        """Return the direction in which what sticks begins to slip: against the force that could hold it no longer."""
        closed = [k for k, one in enumerate(self.contacts) if self.before[k][0] == STICKS]
        values, free = self.values, self.values.accelerations()
        forces, fixed = np.zeros(len(self.contacts)), [k for k in range(len(self.contacts)) if self.before[k][0] == GOES_ON]
        for _ in range(_MOST_TURNS):
            limits, shares, _, _ = values.limits_at(forces)
            matrix, right = np.eye(len(forces)), np.zeros(len(forces))
            for k in closed:
                matrix[k], right[k] = values.response[k], -free[k]
            for k in fixed:
                matrix[k] += self.before[k][1] * shares[k]
                right[k] = -self.before[k][1] * limits[k]
            last, forces = forces, least_norm(matrix, right)
            if float(np.max(np.abs(forces - last))) <= 1e-9 * float(np.max(np.abs(forces))):
                break
        return -1.0 if forces[i] > 0.0 else 1.0

    def _jammed(self, chosen: list[int], given: FloatArray) -> Found:
        """Where no accelerations contradict nothing an impulse acts (Painleve's paradox); then states are found."""
        values, count = self.values, len(self.contacts)
        none, rates = np.zeros(count), self.rates()
        _, shares, _, static_shares = values.limits_at(none)
        rows = values.rows(chosen, rates, none, (none, shares, none, static_shares))
        best = max(all_states(rows), key=lambda one: float(np.sum(np.abs(one.forces))), default=None) if count < 9 else None
        if best is None or not float(np.sum(np.abs(best.forces))) > 0.0:
            raise self._contradiction("no accelerations and no impulses satisfy contact and friction", chosen)
        push = np.zeros(count)
        push[chosen] = best.forces
        self.u = self.u + values.speeds_by(push)
        gaps = [i for i in chosen if push[i] > 0.0 and not self.contacts[i].is_slip]
        part, law, _ = self.contacts[gaps[0]].row.key
        self.events.append(EventRecord(self.t, part, law, "friction jams it: an impulse", "", True, "jams"))
        moved = self.rates()
        given = np.where(np.abs(moved) > self.slow, np.sign(moved), 0.0)
        found = self._found(chosen, np.where(values.is_slip, given, 0.0))
        if found is None:
            raise self._contradiction("no accelerations satisfy contact and friction after an impulse", chosen)
        return found

    def _take(self, chosen: list[int], found: Found, given: FloatArray, rates: FloatArray) -> None:
        """Take the states over, and tell what has changed."""
        states = dict(zip(chosen, zip(found.states, found.directions, strict=True), strict=True))
        for i, one in enumerate(self.contacts):
            state, direction = states.get(i, (OPEN, 0.0))
            if one.is_slip:
                at = self.values.gap_of[i]
                if at >= 0 and states.get(at, (OPEN, 0.0))[0] == OPEN:
                    state, direction = OPEN, 0.0
                self.held[self.places[i][0]], self.held[self.places[i][1]] = float(state), direction
            else:
                state = 1 if state == STICKS else 0
                self.held[self.places[i][0]] = float(state)
            self._tell(i, one, (STICKS if state and not one.is_slip else state, direction))

    def _tell(self, i: int, one: ContactRow, now: tuple[int, float]) -> None:
        was, kind = self.before[i], ""
        if not one.is_slip:
            kind = "closes" if now[0] > was[0] else "opens" if now[0] < was[0] else ""
            said = f"{one.row.key[1]} {kind}"
        elif now != was:
            kind = {STICKS: "sticks", GOES_ON: "slips"}.get(now[0], "")
            kind = "reverses" if now[0] == was[0] == GOES_ON else kind
            said = f"{one.row.key[1]} {kind}"
        if kind:
            part, law, _ = one.row.key
            self.events.append(EventRecord(self.t, part, law, said, "", False, kind))

    def _contradiction(self, what: str, chosen: list[int]) -> SolveError:
        names = ", ".join(dict.fromkeys(self.contacts[i].row.key[0] for i in chosen))
        return SolveError(
            f"at t = {self.t:.9g} {what} ({names})",
            where=self.contacts[chosen[0]].row.key[0] if chosen else "",
            advice="Contacts contradict each other here: look at what moves them, and at their friction.",
        )

    def check_start(self) -> None:
        """Refuse a start inside of something."""
        for i, one in enumerate(self.contacts):
            if not one.is_slip and self.values.values[i] < -self.small[i]:
                unit = "m" if one.law.options.unit == "N" else "rad"
                raise StartError(
                    f"it starts inside, by {-self.values.values[i]:.6g} {unit}",
                    where=one.row.key[0],
                    advice="Start where the gap is zero or positive.",
                )


def resolve(
    assembly: Assembly,
    state: tuple[float, FloatArray, FloatArray],
    length: float,
    scales: Scales,
    relative: float,
    triggers: Sequence[EventRecord] = (),
    one_by_one: bool = False,
    rests: bool = False,
    is_start: bool = False,
) -> Changed:
    """Return what becomes of gaps and slips at a moment.

    Parameters
    ----------
    assembly
        The scene, with the states before.
    state
        Time, coordinates and speeds in its form.
    length, scales
        Extent and sizes of the scene.
    relative
        Relative tolerance of the run.
    triggers
        The events that have led here.
    one_by_one
        Whether of several impacts the fastest comes first.
    rests
        Whether impacts have accumulated, so that nothing rebounds.
    is_start
        Whether the run begins here.
    """
    t, q, u = state
    moment = _Moment(ContactValues(assembly, t, q, u, length), scales, relative, triggers, rests)
    if is_start:
        moment.check_start()
    moment.collide(one_by_one)
    moment.settle(not is_start)
    if np.array_equal(moment.u, moment.values.u):
        speeds = u
    elif assembly.form == "dae":
        speeds = moment.u
    else:
        speeds = generalized_speeds(assembly, t, to_regular(assembly, q), moment.u, moment.values.sizes)
    return Changed(speeds, tuple(moment.held), tuple(moment.events))
