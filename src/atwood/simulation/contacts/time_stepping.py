"""Gaps and slips in steps of Moreau and Jean: impulses for what is closed in the middle of a step.

A closed gap has ``p >= 0``, ``v + e v_0 >= 0`` and ``p (v + e v_0) = 0``, with its rates v at the end and v_0 at the
start of the step and its restitution e: Newton's law. A slip has Coulomb's friction, with its rate at the end. What
limits have besides shares in forces acts for the length of the step (V. Acary, B. Brogliato 2008, section 10.1).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import SolveError, UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import to_maximal
from atwood.integrators.time_stepping.session import ImpulsiveProblem, Pushed
from atwood.mechanics.outputs.event_functions import CONTACT
from atwood.model.values.units import ALONG
from atwood.numerics.contact_sets import OPEN, STICKS, Limits, State, find_states
from atwood.simulation.contacts.changes import CONTRADICT
from atwood.simulation.contacts.crowd import crowd_of
from atwood.simulation.contacts.event_records import told_changes, told_impact
from atwood.simulation.contacts.forces import MOST_TURNS, is_same
from atwood.simulation.contacts.states import states_of, values_of_states, without_loose
from atwood.simulation.contacts.values import ContactValues, layout_of
from atwood.simulation.dynamics.orientation_coordinates import to_regular
from atwood.simulation.dynamics.scales import Scales
from atwood.simulation.events.mode_change import generalized_speeds
from atwood.simulation.events.modes import EventProbe, EventRecord
from atwood.simulation.problem.explicit_scene import constrained_problem, explicit_problem
from atwood.simulation.problem.problem import SceneProblem

_CLOSED = 1e-12
"""In units of the scene: gaps that are no larger are closed."""

_ROUNDED = 1e-9
"""Of the work of impulses, and of the speeds of a scene: rounding makes no more."""

_BRIEF = 2.0
"""Times the change of a rate that forces make in a step: what approaches faster collides, and the others are held."""


def impulsive_problem(
    plan: SceneProblem, probe: EventProbe, t: float, y: FloatArray, step: float, impacts: str
) -> ImpulsiveProblem:
    """Return the motion of a scene for steps that look for no event, from a state on."""
    _check(plan, probe, impacts)
    n = plan.program.coordinates
    sizes = np.concatenate([plan.coordinate_sizes, plan.sizes / plan.scales.time])
    crowd = crowd_of(plan, t, y)
    if crowd is not None:
        if t <= plan.assembly.flat.t_start:  # behind a time event discs are in each other by as much as they were
            crowd.check_start(y)
        smooth = explicit_problem(plan.assembly) if plan.assembly.form == "reduced" else None
        return ImpulsiveProblem(smooth or constrained_problem(plan, t, y), n, sizes, step, crowd.touching)
    touching = ContactsInSteps(plan.assembly, plan.scales, n).touching
    return ImpulsiveProblem(constrained_problem(plan, t, y), n, sizes, step, touching)


def _check(plan: SceneProblem, probe: EventProbe, impacts: str) -> None:
    """Refuse what needs events, and laws that steps do not know."""
    refused = [
        (f"{one.part}.{one.law}", "time stepping looks for no event, and this one is declared")
        for one in probe.event_functions
        if one.target not in CONTACT
    ]
    refused += [
        (one.row.key[0], "time stepping knows no impacts of Poisson's law")
        for one in plan.assembly.own_equations.contacts
        if one.is_poisson
    ]
    if impacts != "together":
        what = f"time stepping does not tell impacts in a step apart, so that impacts={impacts!r} means nothing"
        refused.append((plan.assembly.flat.name, what))
    if refused:
        where, what = refused[0]
        raise UnsupportedError(what, where=where, advice="Leave the solver out: it then looks for events.")


class ContactsInSteps:
    """The gaps and slips of a scene, step by step.

    Parameters
    ----------
    assembly
        The scene, in which nothing touches.
    scales
        Its sizes.
    coordinates
        The number of its coordinates.
    """

    def __init__(self, assembly: Assembly, scales: Scales, coordinates: int) -> None:
        self.assembly, self.scales, self.coordinates = assembly, scales, coordinates
        self.layout = layout_of(assembly)
        self.states = states_of(self.layout, assembly.held_now)

    def touching(self, t: float, y: FloatArray, u: FloatArray, h: float) -> _InStep | None:
        """Return what may touch at a state, in a step that begins with speeds u; None where nothing is closed."""
        layout = self.layout
        if not layout.contacts:
            return None
        values = ContactValues(self.assembly, t, y[: self.coordinates], u, self.scales.length)
        closed = [k for k, is_slip in enumerate(layout.is_slip) if not is_slip and self._is_closed(k, values, h)]
        places = {-1, *closed}
        chosen = [*closed, *(k for k, is_slip in enumerate(layout.is_slip) if is_slip and layout.gap_of[k] in places)]
        if not chosen and not any(state for state, _ in self.states):
            return None
        if self.assembly.form == "dae":  # so that what repeats itself is not contradicted
            values = values.with_speeds(values.allowed(u))
        return _InStep(self, values, y[: self.coordinates], u, h, closed, chosen)

    def _is_closed(self, k: int, values: ContactValues, h: float) -> bool:
        """Return whether a gap is closed; one that was stays so within what its velocities leave open in a step."""
        if k in self.layout.speeds:
            return True
        row, unit = self.layout.units[k][0], self.layout.first[k].law.options.unit
        gap, small = values.values[row], _CLOSED * self.scales.of(ALONG[unit])
        if self.states[k][0] != STICKS or gap <= small:
            return bool(gap <= small)
        return bool(gap <= small + h * h * abs(values.accelerations()[row]))


class _InStep:
    """What is closed in one step, or rubs without a gap."""

    def __init__(
        self,
        contacts: ContactsInSteps,
        values: ContactValues,
        q: FloatArray,
        u: FloatArray,
        h: float,
        closed: list[int],
        chosen: list[int],
    ) -> None:
        self.contacts, self.values, self.q, self.u, self.h = contacts, values, q, u, h
        self.closed, self.chosen = closed, chosen
        self.before = contacts.states

    def pushed(self, free: FloatArray) -> Pushed:
        """Return what contacts do, given the speeds at the end of the step without them."""
        values, assembly = self.values, self.contacts.assembly
        if not self.chosen:
            self.contacts.states = states = states_of(values.layout, [0.0] * len(assembly.held_now))
            none = np.zeros(0)
            return Pushed(0.0 * free, False, 0.0, None, partial(self._told, [], none, none, none, states))
        start = values.rates
        if assembly.form == "dae":
            ahead = values.allowed(free)
        else:
            ahead = np.asarray(assembly.kernel(to_maximal(assembly))([values.t], self.q, free)[1], dtype=float)
        rates = start + values.slopes @ (ahead - values.u)
        wanted, by_forces = rates.copy(), np.abs(rates - start)
        # A bounce that ends within the step is none: its energy would come from nowhere.
        gaps = {k: values.units[k][0] for k in self.closed}
        bounces = {k: i for k, i in gaps.items() if -start[i] * values.restitution[i] > by_forces[i]}
        for i in bounces.values():
            wanted[i] += values.restitution[i] * start[i]
        impulses, states = self._solved(wanted)
        for k in bounces:
            states[k] = (OPEN, (0.0,))
        states = without_loose(values.layout, states)
        after = rates + values.response @ impulses
        work = 0.5 * impulses * (start + after)
        change = values.speeds_by(impulses)
        if assembly.form == "reduced":
            whole = values.u + change
            whole = generalized_speeds(assembly, values.t, to_regular(assembly, self.q), whole, values.sizes)
            change = whole - self.u
        hit = [k for k, i in gaps.items() if impulses[i] > 0.0 and -start[i] > _BRIEF * by_forces[i]]
        told = partial(self._told, hit, impulses, rates, after, states)
        self._check_energy(work, impulses, by_forces)
        self.contacts.states = states
        held = values_of_states(values.layout, assembly.held_now, states)
        return Pushed(change, bool(hit), 0.0, tuple(held) if self.chosen else None, told)

    def _solved(self, wanted: FloatArray) -> tuple[FloatArray, list[State]]:
        """Return the impulses that the laws of contact and friction allow, and the states of all units."""
        values, h = self.values, self.h
        found = np.zeros(len(wanted))
        guess: list[State] = [(STICKS, (0.0,) * len(values.units[k])) for k in self.chosen]
        states = [(OPEN, (0.0,) * len(rows)) for rows in values.units]
        for _ in range(MOST_TURNS):
            ahead, back = (
                Limits(h * one.free, one.shares, h * one.static_free, one.static_shares)
                for one in values.limits_at(found / h)
            )
            solved = find_states(values.chosen(self.chosen, wanted, {}, (ahead, back)), guess)
            if solved is None:
                name = values.layout.first[self.chosen[0]].row.key[0]
                what = f"at t = {values.t:.9g} no impulses satisfy the laws of contact and friction"
                raise SolveError(what, where=name, advice=CONTRADICT)
            last, found = found, np.zeros(len(wanted))
            found[[row for k in self.chosen for row in values.units[k]]] = solved.forces
            guess = list(solved.states)
            if not values.layout.is_curved or is_same(last, found):
                break
        for k, state in zip(self.chosen, guess, strict=True):
            states[k] = state
        return found, states

    def _check_energy(self, work: FloatArray, impulses: FloatArray, by_forces: FloatArray) -> None:
        """Refuse impacts that make energy; what forces do within the step is left to it."""
        scales = self.contacts.scales
        slow = [_ROUNDED * scales.of(ALONG[one.law.options.unit]) / scales.time for one in self.values.contacts]
        made = float(np.sum(work))
        if made > float(np.sum(np.abs(impulses) * (by_forces + slow))) + _ROUNDED * float(np.sum(np.abs(work))):
            worst = max(self.chosen, key=lambda k: float(work[self.values.units[k][0]]))
            raise SolveError(
                f"at t = {self.values.t:.9g} Newton's law of impact would make energy, {made:.3g} J",
                where=self.values.layout.first[worst].row.key[0],
                advice="Leave the solver out, and choose Poisson's law of impact for the part.",
            )

    def _told(
        self,
        hit: list[int],
        impulses: FloatArray,
        before: FloatArray,
        after: FloatArray,
        states: list[State],
        time: float,
    ) -> list[EventRecord]:
        """Return the impacts of the step, and what opens, closes, sticks or slips from it on."""
        values, events = self.values, list[EventRecord]()
        for k in hit:
            rubs = [row for j in self.chosen if values.gap_of[j] == k for row in values.units[j]]
            rows, one = [values.units[k][0], *rubs], values.layout.first[k]
            loss = -0.5 * float(np.sum((impulses * (before + after))[rows]))
            speeds = float(before[rows[0]]), float(after[rows[0]])
            key = one.row.key[:2]
            events.append(told_impact(time, key, one.law.options.unit, tuple(impulses[rows].tolist()), speeds, loss))
        return events + told_changes(time, values.layout, self.before, states)
