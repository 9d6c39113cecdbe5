"""Updates of states at moments: sample times that are known beforehand, and events.

A run stops at each sample time, as it does at a time event, and goes on with other values of the parameters that stand
for discrete states: no equation, program or kernel is made for it. Updates are called on numbers, so that they may be
any Python; what they read is one program.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arrays import FloatArray, IntArray
from atwood.codegen import BoundKernel
from atwood.errors import AtwoodError, DeclarationError, ParameterError, SolveError, UsageError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.program import state_groups
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.build import resolve_signals
from atwood.model.declare.component import Binding, Component, bind
from atwood.model.declare.laws import Law, numbers_in
from atwood.simulation.events.time_events import MOMENT

_SAMPLER: Key[Sampler] = Key("sample times")

_UPDATED: Key[dict[tuple[Hashable, ...], Updated]] = Key("what updates have made of states")

TRACED: Key[set[str]] = Key("updates that are known to be formulas")

_MOST = 10_000_000
"""More sample times than these are no run."""


@dataclass(frozen=True)
class Updated:
    """What updates have made of a state.

    Attributes
    ----------
    held
        Values of the discrete states.
    coordinates
        Those of the form.
    """

    held: tuple[float, ...]
    coordinates: FloatArray


@dataclass(frozen=True)
class Update:
    """One update law of a part.

    Attributes
    ----------
    path, law
        Whose it is.
    every, offset
        Its sample time, and when it is called first after the start, s; None where an event calls it.
    sets
        Paths of the numbers that it sets.
    reads
        The inputs that it reads.
    """

    path: str
    law: Law
    every: float | None
    offset: float
    sets: tuple[str, ...]
    reads: tuple[str, ...]

    @property
    def label(self) -> str:
        """Its path."""
        return f"{self.path}.{self.law.name}"


@dataclass(frozen=True, eq=False)
class Sampler:
    """The sample times of a scene in a run, and what happens then.

    Attributes
    ----------
    updates
        Its update laws.
    times
        When there is something to do, s, in order.
    due
        For each of these, which updates.
    """

    updates: tuple[Update, ...]
    times: FloatArray
    due: Sequence[tuple[int, ...]]

    def next(self, t: float, end: float) -> float:
        """Return the next sample time after a time, or the end of the run."""
        number = int(self.times.searchsorted(t, side="right"))
        return float(self.times[number]) if number < len(self.times) else end

    def with_stops(self, times: FloatArray) -> Sampler:
        """Return the same with further times, at which nothing is due of itself."""
        merged = np.union1d(self.times, times)
        return Sampler(self.updates, merged, [self.due_at(t) for t in merged.tolist()])

    def due_at(self, t: float) -> tuple[int, ...]:
        """Return which updates are due at a time."""
        number = int(self.times.searchsorted(t, side="left"))
        return self.due[number] if number < len(self.times) and self.times[number] == t else ()

    def due_at_each(self, times: FloatArray) -> tuple[list[tuple[int, ...]], IntArray]:
        """Return which updates are due together at some times, and the number of that for each; a run again has it."""
        about = times.tobytes()
        if about not in self._known:
            due, ways = dict(zip(self.times.tolist(), self.due, strict=True)), dict[tuple[int, ...], int]()
            number = np.array([ways.setdefault(due.get(t, ()), len(ways)) for t in times.tolist()])
            self._known.clear()
            self._known[about] = list(ways), number
        return self._known[about]

    @cached_property
    def _known(self) -> dict[bytes, tuple[list[tuple[int, ...]], IntArray]]:
        return {}

    @property
    def is_pure(self) -> bool:
        """Whether all updates give the same where they are called again."""
        return all(one.law.options.pure for one in self.updates)

    def due_after(self, part: str, event: str) -> tuple[int, ...]:
        """Return which updates an event calls."""
        return tuple(i for i, one in enumerate(self.updates) if one.path == part and one.law.options.at == event)

    def call(self, chosen: Iterable[int], assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> Updated:
        """Return what updates make of a state, one after the other; those that are formulas are not asked twice."""
        chosen, traced = tuple(chosen), assembly.shared.known(TRACED) or ()
        if not all(self.updates[i].label in traced for i in chosen):
            return self._call(chosen, assembly, t, q, u)
        about = chosen, t, q.tobytes(), u.tobytes()
        found = assembly.kept.recall(_UPDATED, lambda: self._call(chosen, assembly, t, q, u), *about)
        return Updated(found.held, found.coordinates.copy())

    def _call(self, chosen: Iterable[int], assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> Updated:
        reading = update_inputs_of(assembly)
        held = list(assembly.held_now)
        q, values = q.copy(), None
        order = in_order([self.updates[i] for i in chosen], reading)
        for one in order:
            if values is None:
                values = reading.values(assembly, t, q, u, held)
            given = evaluated(one, assembly, t, values, reading)
            for path, value in zip(one.sets, given, strict=True):
                if path in reading.held:
                    held[reading.held[path]] = value
                else:
                    q[reading.states[path]] = value
            values = None
        return Updated(tuple(held), q)


def in_order(updates: Sequence[Update], reading: UpdateInputs) -> list[Update]:
    """Return updates of one moment, each after those that set what its inputs are made of."""
    if len(updates) < 2:
        return list(updates)
    before: dict[str, set[str]] = {one.label: set() for one in updates}
    last: dict[str, str] = {}
    for one in updates:
        for other in updates:
            fed = {path for name in one.reads for path in reading.feeds[one.path, name]}
            if other is not one and other.path != one.path and fed & set(other.sets):
                before[one.label].add(other.label)
        if one.path in last:  # those of one part in the order in which they are declared
            before[one.label].add(last[one.path])
        last[one.path] = one.label
    waiting, found = {one.label: one for one in updates}, []
    while waiting:
        ready = [label for label in waiting if not before[label] & set(waiting)]
        if not ready:
            raise DeclarationError(
                f"sampled parts form an algebraic loop: {' -> '.join(_circle(waiting, before))}",
                where=next(iter(waiting)),
                advice="Break the loop with a delay of one sample.",
            )
        found.append(waiting.pop(ready[0]))
    return found


def _circle(waiting: Mapping[str, Update], before: Mapping[str, set[str]]) -> list[str]:
    """Return a circle among updates that wait for each other, from one that feeds to the one that is fed."""
    way = [next(iter(waiting))]
    while way.count(way[-1]) < 2:
        way.append(min(before[way[-1]] & set(waiting)))
    return way[way.index(way[-1]) :][::-1]


def evaluated(
    one: Update, assembly: Assembly, t: float, values: Mapping[str, Mapping[str, Any]], reading: UpdateInputs
) -> list[float]:
    """Return the numbers that one update returns."""
    known = {**assembly.flat.parts[one.path].values, **values.get(one.path, {})}
    bound = with_states(assembly, one.path, t, known, lambda state: values[""].get(state, 0.0))
    try:
        given = [float(value) for value in numbers_in(getattr(bound, one.law.name)())]
    except AtwoodError:
        raise
    except Exception as error:  # whatever somebody's own Python can raise
        raise SolveError(
            f"at t = {t:.9g} the update raises {type(error).__name__}: {error}",
            where=one.label,
            advice="It is called on numbers: parameters, inputs, states and the time.",
        ) from error
    if len(given) != len(one.sets) or not np.all(np.isfinite(given)):
        raise SolveError(
            f"at t = {t:.9g} it returns {given}, which is no finite number for each of {', '.join(one.sets)}",
            where=one.label,
        )
    return given


def with_states(assembly: Assembly, path: str, t: Any, known: Mapping[str, Any], state: Callable[[str], Any]) -> Any:
    """Return a component with its parameters and inputs as they are known, and its states by their paths."""
    part, space = assembly.flat.parts[path], assembly.mechanism.space
    found = dict(known)
    for name, spec in part.component.state_specs().items():
        numbers = [state(f"{path}.{own}") for own in spec.names(part.values)]
        found[name] = numbers[0] if spec.count is None else tuple(numbers)
    return bind(part.component, Binding(values=found, time=t, space=space.name, line=space.line))


def remembering(assembly: Assembly) -> list[str]:
    """Return the parts whose updates may give something else when a scene is solved once more."""
    parts = assembly.flat.parts.items()
    return [path for path, part in parts if any(not law.options.pure for law in part.component.laws("update"))]


_AGAIN = "; or run it again with a smaller rtol"


def refuse_updates(assembly: Assembly, lost: str = "estimated error", instead: str = _AGAIN) -> None:
    """Refuse to solve a scene twice whose parts call functions at sample times; say what it has not, then."""
    for path in remembering(assembly):
        raise UsageError(
            "it calls functions at sample times, which may remember what they were called with: the scene is not "
            f"solved twice, and so has no {lost}",
            where=path,
            advice=f"Mark them with @update(..., pure=True) if they do not{instead}.",
        )


def find_sampler(assembly: Assembly, start: float, end: float, moments: FloatArray) -> Sampler:
    """Return the updates of a scene, and when they are due in a run."""
    about = start, end, moments.tobytes()
    return assembly.kept.get(_SAMPLER, lambda: _find_sampler(assembly, start, end, moments), *about)


def _find_sampler(assembly: Assembly, start: float, end: float, moments: FloatArray) -> Sampler:
    for path, part in assembly.flat.parts.items():
        if type(part.component).check_run is not Component.check_run:
            _bound(assembly, path, start).check_run(start, end)
    updates = tuple(_updates(assembly))
    times: dict[float, list[int]] = {}
    for number, one in enumerate(updates):
        for t in _times(one, assembly, start, end):
            times.setdefault(t, []).append(number)
    order = sorted(times)
    merged: list[float] = []
    due: list[tuple[int, ...]] = []
    for t in order:
        if merged and t - merged[-1] <= MOMENT * np.spacing(abs(t)):
            due[-1] = tuple(sorted({*due[-1], *times[t]}))
        else:
            merged.append(t)
            due.append(tuple(times[t]))
    if updates:
        reading = update_inputs_of(assembly)
        for chosen in set(due):
            in_order([updates[i] for i in chosen], reading)
    return Sampler(updates, _snapped(np.array(merged), moments), due)


def _updates(assembly: Assembly) -> Iterable[Update]:
    for path, part in assembly.flat.parts.items():
        laws = part.component.laws("update")
        specs = part.component.state_specs() if laws else {}
        for law in laws:
            options = law.options
            sets = tuple(f"{path}.{own}" for name in options.sets for own in specs[name].names(part.values))
            reads = tuple(part.signals) if options.reads is None else options.reads
            every = None if options.every is None else _seconds(part, law, "every")
            if every is not None and not every > 0.0:
                where = f"{path}.{options.every}" if isinstance(options.every, str) else f"{path}.{law.name}"
                raise ParameterError(
                    f"its sample time is {every:g} s", where=where, advice="Give a sample time above zero."
                )
            yield Update(path, law, every, _seconds(part, law, "offset"), sets, reads)


def _seconds(part: Any, law: Law, option: str) -> float:
    given = getattr(law.options, option)
    return float(part.values[given] if isinstance(given, str) else given)


def _bound(assembly: Assembly, path: str, t: float) -> Any:
    """Return a component with its parameters as numbers."""
    component = assembly.flat.parts[path].component
    return bind(component, Binding(values=assembly.flat.parts[path].values, time=t))


def _times(one: Update, assembly: Assembly, start: float, end: float) -> list[float]:
    """Return when an update is due; pieces of functions of time do not begin at the very end of a run."""
    if one.law.options.when:
        given = np.array([start, *getattr(_bound(assembly, one.path, start), one.law.options.when)()], dtype=float)
        return [float(t) for t in np.unique(given) if start <= t < end - MOMENT * np.spacing(abs(end))]
    if one.every is None:
        return []
    span = end - start - one.offset
    if span / one.every > _MOST:
        raise ParameterError(
            f"its sample time {one.every:g} s asks for more than {_MOST} updates in this run", where=one.label
        )
    count = max(0, int(np.ceil(span / one.every)) + 1)
    times = start + (one.offset + one.every * np.arange(count))
    return [min(float(t), end) for t in times if t <= end + MOMENT * np.spacing(abs(end))]


def _snapped(times: FloatArray, moments: FloatArray) -> FloatArray:
    """Return times, those that are as good as one of some moments put there."""
    if not len(times) or not len(moments):
        return times
    after = np.clip(np.searchsorted(moments, times), 1, max(1, len(moments) - 1))
    low, high = moments[after - 1], moments[np.minimum(after, len(moments) - 1)]
    nearest = np.where(times - low < high - times, low, high)
    return np.where(np.abs(nearest - times) <= MOMENT * np.spacing(np.abs(times)), nearest, times)


_BOUND_KERNELS: Key[dict[bytes, BoundKernel]] = Key("what updates read, with parameters")


_MOST_KERNELS = 64
"""So many programs with other parameters are kept ready."""


@dataclass(frozen=True, eq=False)
class UpdateInputs:
    """What updates read, as one program.

    Attributes
    ----------
    program
        Of (t, q, u, held), with the inputs of all parts that have updates.
    inputs
        Part and name of each of its results.
    feeds
        For each of these, the paths of the states that it depends on.
    held, states
        Numbers of discrete states among the assembly's, and of continuous ones among the coordinates, by path.
    """

    program: Program
    inputs: tuple[tuple[str, str], ...]
    feeds: Mapping[tuple[str, str], frozenset[str]]
    held: Mapping[str, int]
    states: Mapping[str, int]

    def values(
        self, assembly: Assembly, t: float, q: FloatArray, u: FloatArray, held: Sequence[float]
    ) -> dict[str, dict[str, Any]]:
        """Return what the laws of parts read: inputs by part and name, and states by path under an empty name."""
        (results,) = self._kernel(assembly)([t], q, u, held)
        found: dict[str, dict[str, Any]] = {"": {path: float(q[i]) for path, i in self.states.items()}}
        found[""] |= {path: held[i] for path, i in self.held.items()}
        for (part, name), value in zip(self.inputs, results, strict=True):
            found.setdefault(part, {})[name] = float(value)
        return found

    def _kernel(self, assembly: Assembly) -> BoundKernel:
        """Return the program with the values of all parameters but the discrete states, which are arguments here."""
        first = len(assembly.mechanism.table.values)
        values = assembly.parameter_values
        others = np.concatenate([values[:first], values[first + len(assembly.discrete_states) :]])
        known, about = assembly.shared.get(_BOUND_KERNELS, dict), others.tobytes()
        if about not in known:
            if len(known) >= _MOST_KERNELS:
                known.clear()
            known[about] = assembly.compiled(self.program).bind(others)
        return known[about]


_UPDATE_INPUTS: Key[UpdateInputs] = Key("what updates read")


def update_inputs_of(assembly: Assembly) -> UpdateInputs:
    """Return what the updates of a scene read."""
    return assembly.shared.get(_UPDATE_INPUTS, lambda: _read_inputs(assembly))


def _read_inputs(assembly: Assembly) -> UpdateInputs:
    mechanism, equations, graph = assembly.mechanism, assembly.own_equations, assembly.own_equations.graph
    signals = resolve_signals(mechanism, equations.site, equations.kinematics, equations.read)
    places, expressions = [], []
    for path, local in mechanism.locals_.items():
        for name in local.part.signals if local.part.component.laws("update") else ():
            symbol = local.signal_symbols.get(name)
            places.append((path, name))
            expressions.append(graph.convert(local.binding.values[name] if symbol is None else signals[symbol]))
    late = [*equations.accelerations, *equations.multipliers, *(one.symbol for one in assembly.reactions)]
    for (path, name), value in zip(places, expressions, strict=True):
        if depends_on(value, late):
            raise DeclarationError(
                "it is sampled, and reads accelerations or reactions that no force reads",
                where=f"{path}.{name}",
                advice="Sample positions, velocities and states.",
            )
    symbols: dict[Expression, str] = {one.symbol: one.path for one in assembly.discrete_states}
    symbols |= {one.symbol: one.path for one in equations.states}
    feeds = {
        place: frozenset(path for symbol, path in symbols.items() if depends_on(value, [symbol]))
        for place, value in zip(places, expressions, strict=True)
    }
    held = tuple(one.symbol for one in assembly.discrete_states)
    rest = tuple(one for one in assembly.parameters if one not in set(held))
    groups = (*state_groups(equations), InputGroup("held", held))
    program = Program(
        f"{assembly.flat.name} sampled inputs", groups, rest, (OutputGroup("inputs", tuple(expressions)),)
    )
    return UpdateInputs(
        program,
        tuple(places),
        feeds,
        {one.path: i for i, one in enumerate(assembly.discrete_states)},
        {one.path: i for i, one in enumerate(equations.states, start=equations.placing)},
    )
