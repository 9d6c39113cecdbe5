"""Updates of states as expressions: laws that are arithmetic are called on symbols, and derived on the graph."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from atwood.errors import AtwoodError
from atwood.expr import Expression, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.model.declare.laws import numbers_in
from atwood.simulation.events.sampling import Sampler, in_order, update_inputs_of, with_states

_UPDATED: Key[tuple[Expression, ...] | None] = Key("states behind updates")


def updated(assembly: Assembly, sampler: Sampler, chosen: Sequence[int]) -> tuple[Expression, ...] | None:
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
