"""What happens to a state between two stretches of a run, and what that does to the derivatives of the state.

Let an event happen at ``t1`` where ``g(t, y, p) = 0``, and let it make ``y+ = h(t, y, p)`` of the state before it. Then
``dt1/dp = -(g_y s + g_p) / (g_t + g_y f-)``, and behind it ``s+ = dh - f+ dt1/dp``, where dh is the change of h along
``(dt1/dp, s + f- dt1/dp, 1)`` (M. A. Aizerman, F. R. Gantmakher, Quart. J. Mech. Appl. Math. 11, 1958; R. I. Leine,
H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, section 7.1). Times of events and the
right-hand sides are derived on the graph, and so are updates that are arithmetic; what impacts and other updates work
out in numbers is by differences.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, UnsupportedError
from atwood.expr import Expression, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.outputs.event_functions import CONTACT, RUNS, UPDATE
from atwood.model.declare.laws import numbers_in
from atwood.simulation.contacts.changes import resolve
from atwood.simulation.events.impacts_in_time import jumped
from atwood.simulation.events.mode_change import enter_mode
from atwood.simulation.events.modes import EventProbe, EventRecord
from atwood.simulation.events.sampling import Sampler, in_order, update_inputs_of, with_states
from atwood.simulation.events.sides import SIDE
from atwood.simulation.problem.explicit_scene import nearest_state
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.run.recorder import Recorder
from atwood.simulation.run.run import Walk
from atwood.simulation.run.run_record import Outcome
from atwood.simulation.run.session import KeptSession
from atwood.study.sensitivities.inputs import is_nodes

State = tuple[float, FloatArray, FloatArray]
Beside = Callable[[Assembly], Assembly]
"""Gives a scene with a value moved a little, in the same mode and piece of the run."""


_UPDATED: Key[tuple[Expression, ...] | None] = Key("states behind updates")


@dataclass(frozen=True, eq=False)
class Change:
    """Something that happens to a state at a moment.

    Attributes
    ----------
    assembly
        The scene before it.
    apply
        Gives coordinates, speeds and discrete states behind it, from those before it in a scene.
    enters
        The parts of inputs of which another piece begins, where that is all that happens.
    updated
        Discrete states and coordinates behind it, where these have formulas and speeds stay as they are.
    """

    assembly: Assembly
    apply: Callable[[Beside, State], tuple[FloatArray, FloatArray, tuple[float, ...]]]
    enters: tuple[str, ...] = ()
    updated: tuple[Expression, ...] | None = None


@dataclass(frozen=True, eq=False)
class Leg:
    """A stretch of a run as it was made.

    Attributes
    ----------
    changes
        What happened just before it.
    plan, assembly
        The scene in it; the second with its laws as they are.
    probe
        What was watched; None where nothing happens.
    begin, end
        The states at its ends.
    outcome
        How it ended; None where nothing comes after it.
    number
        Of its record among the segments of the run.
    """

    changes: tuple[Change, ...]
    plan: SceneProblem
    assembly: Assembly
    probe: EventProbe | None
    begin: State
    end: State
    outcome: Outcome | None
    number: int


def _stays(beside: Beside, state: State) -> tuple[FloatArray, FloatArray, tuple[float, ...]]:
    raise NotImplementedError  # what it changes is known


class _Session(KeptSession):
    """Sessions that stop at every event."""

    def jumps(self, assembly: Assembly) -> bool:
        return False


class WatchedWalk(Walk):
    """The way of a run that takes note of what happens to its state."""

    passes_moments = False

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self._kept, self.legs, self.changes = _Session(), list[Leg](), list[Change]()

    def _segment(self) -> tuple[Recorder, Outcome]:
        count = len(self.segments)
        recorder, outcome = super()._segment()
        if len(self.segments) > count:
            assert self.plan is not None
            assert self.probe is not None
            begin, end = (self.t, self.q, self.u), recorder.last()[:3]
            parts = self.plan, self.assembly, self.probe, begin, end, outcome, len(self.segments) - 1
            self.legs.append(Leg(tuple(self.changes), *parts))
            self.changes = []
        return recorder, outcome

    def _update(self, due: Sequence[int]) -> None:
        sampler, before = self.sampler, self.assembly
        nodes = [i for i in due if is_nodes(before, sampler.updates[i].path)]
        if nodes:  # they read nothing, and come first
            parts = tuple(sampler.updates[i].path for i in nodes)
            self.changes.append(Change(before, _stays, parts))
            before = before.with_held(sampler.call(nodes, before, self.t, self.q, self.u).held)
        chosen = tuple(i for i in due if i not in nodes)

        def apply(beside: Beside, state: State) -> tuple[FloatArray, FloatArray, tuple[float, ...]]:
            t, q, u = state
            made = sampler.call(chosen, beside(assembly), t, q, u)
            return made.coordinates, u, made.held

        assembly = before
        if chosen:
            self.changes.append(Change(assembly, apply, updated=_updated(assembly, sampler, chosen)))
        super()._update(due)

    def _jump(self, before: Assembly, show_both: bool = False) -> None:
        now, length, reassemble = self.assembly, self.start.length, self._reassemble

        def apply(beside: Beside, state: State) -> tuple[FloatArray, FloatArray, tuple[float, ...]]:
            there = beside(before)
            after = there.with_relations(now.relation_values) if now.relations else there
            _, q, u, _ = jumped(there, after, state, length, reassemble)
            return q, u, there.held_now

        q, u, shared = self.q, self.u, self.assembly.shared
        super()._jump(before, show_both)
        if self.assembly.shared is not shared:
            raise UnsupportedError(
                f"at t = {self.t:.9g} s a prescribed motion lets go, over which there are no derivatives",
                where=self.assembly.flat.name,
                advice="Let the run end before.",
            )
        if not (np.array_equal(q, self.q) and np.array_equal(u, self.u)):
            self.changes.append(Change(before, apply))

    def _settled(self, plan: SceneProblem) -> SceneProblem:
        triggers, assembly, before = self._unsettled, self.assembly, (self.u, self.held)
        made = super()._settled(plan)
        if triggers and all(one.target == RUNS for one in triggers) and np.array_equal(self.u, before[0]):
            return made  # it goes on as it has begun to, and friction is against that already
        if triggers and (self.u is not before[0] or self.held != before[1]):
            self.changes.append(self._contact(plan, assembly, triggers))
        return made

    def _contact(self, plan: SceneProblem, assembly: Assembly, triggers: Sequence[EventRecord]) -> Change:
        length, options, scales = self.start.length, self.options, plan.scales
        impacts, one_by_one = list(self._impacts), options.impacts == "one_by_one"

        def apply(beside: Beside, state: State) -> tuple[FloatArray, FloatArray, tuple[float, ...]]:
            t, q, u = state
            there, looser = beside(assembly), 1e3 * options.relative_tolerance
            own = plan.in_piece(self._sides.like(there, plan))
            q, u = nearest_state(own, t, q, u)  # what misses a gap that is closed would be an impact, or none
            touching = resolve(there, state, length, scales, looser, triggers, one_by_one, impacts).touching
            if touching:
                met = self._sides.like(there.with_held(touching), plan)
                q, _ = nearest_state(own.in_piece(met), t, q, u)
            found = resolve(there, (t, q, u), length, scales, looser, triggers, one_by_one, impacts)
            return q, found.speeds, found.held

        return Change(assembly, apply)

    def _enter(self, outcome: Outcome, recorder: Recorder) -> None:
        event, assembly = outcome.event, self.assembly
        length = self.start.length
        assert event is not None
        if event.target not in (*CONTACT, UPDATE, SIDE):

            def apply(beside: Beside, state: State) -> tuple[FloatArray, FloatArray, tuple[float, ...]]:
                there = beside(assembly)

                def reassemble(*about: Any) -> Assembly:
                    found = there.other_mode(*about)
                    return found.with_held(there.held_now) if there.discrete_states else found

                _, q, u = enter_mode(state, there, replace(event, time=state[0]), reassemble, length)
                return q, u, there.held_now

            self.changes.append(Change(assembly, apply))
        super()._enter(outcome, recorder)

    def _switch_coordinates(self, event: EventRecord, recorder: Recorder) -> None:
        raise UnsupportedError(
            "coordinates of an orientation are switched on the way",
            where=event.part,
            advice="Ask with orientation='quaternion'.",
        )


def _updated(assembly: Assembly, sampler: Sampler, chosen: Sequence[int]) -> tuple[Expression, ...] | None:
    """Return discrete states and coordinates behind updates, in terms of those before.

    None where a law asks what a number is, as for a sign or a place in a list.
    """

    def make() -> tuple[Expression, ...] | None:
        try:
            return _called(assembly, sampler, chosen)
        except (AtwoodError, TypeError, ValueError, ArithmeticError, AttributeError, IndexError, KeyError):
            return None

    return assembly.shared.get(_UPDATED, make, tuple(chosen))


def _called(assembly: Assembly, sampler: Sampler, chosen: Sequence[int]) -> tuple[Expression, ...]:
    reading, graph = update_inputs_of(assembly), assembly.own_equations.graph
    (time,), q, _, held = (one.symbols for one in reading.program.inputs)
    before = (*held, *q)
    places = {path: len(held) + k for path, k in reading.states.items()} | dict(reading.held)
    now = list(before)
    for one in in_order([sampler.updates[i] for i in chosen], reading):
        part, local = assembly.flat.parts[one.path], assembly.mechanism.locals_[one.path]
        known = {name: _symbolic(local.binding.values.get(name), value) for name, value in part.values.items()}
        inputs = substitute(list(reading.program.results), dict(zip(before, now, strict=True)))
        known |= {name: value for (path, name), value in zip(reading.inputs, inputs, strict=True) if path == one.path}
        states = {path: now[k] for path, k in places.items()}
        bound = with_states(assembly, one.path, time, known, states.__getitem__)
        given = list(numbers_in(getattr(bound, one.law.name)()))
        for path, value in zip(one.sets, given, strict=True):
            now[places[path]] = graph.convert(value)
    return tuple(now)


def _symbolic(symbolic: Any, known: Any) -> Any:
    """Return a parameter with symbols for the numbers that are no part of the structure."""
    if isinstance(symbolic, (tuple, list)):
        return tuple(_symbolic(*pair) for pair in zip(symbolic, known, strict=True))
    return symbolic if isinstance(symbolic, Expression) else known
