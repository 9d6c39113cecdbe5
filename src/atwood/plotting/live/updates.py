"""Updates of states at moments, traced to expressions, or as data where they read nothing that moves."""

from __future__ import annotations

from typing import Any

import numpy as np

from atwood.errors import AtwoodError, ParameterError
from atwood.expr import Program
from atwood.forms.quantities import coordinate_program
from atwood.model.declare.laws import numbers_in
from atwood.plotting.live.mode import ModeText, NotLiveError
from atwood.simulation.events.sampling import Update, evaluated, find_sampler, in_order, update_inputs_of, with_states


def add_updates(mode: ModeText) -> None:
    """Add the programs of the updates of a scene, when they are due, and what they set.

    Raises
    ------
    NotLiveError
        If an update cannot be traced: it branches on numbers, calls other functions, or may remember what it did.
    """
    assembly, flat = mode.assembly, mode.flat
    mode.data["held"] = {
        one.path: len(assembly.mechanism.table.values) + i for i, one in enumerate(assembly.discrete_states)
    }
    try:
        sampler = find_sampler(assembly, flat.t_start, mode.end, np.zeros(0))
    except ParameterError:  # as of a table that ends
        sampler = find_sampler(assembly, flat.t_start, flat.t_end, np.zeros(0))
        mode.data["schedule"]["end"] = flat.t_end
    if not sampler.updates:
        return
    reading = update_inputs_of(assembly)
    number = {one: k for k, one in enumerate(sampler.updates)}
    laws: list[dict[str, Any]] = []
    for k, one in enumerate(sampler.updates):
        laws.append({"sets": [_place(mode, path) for path in one.sets]})
        if one.law.options.when and not one.reads:
            moments = [(i, float(t)) for i, t in enumerate(sampler.times) if k in sampler.due[i]]
            laws[-1]["given"] = {i: _given(mode, one, t) for i, t in moments}
        else:
            mode.programs[f"update_{k}"] = _traced(mode, one)
    orders = [[number[one] for one in in_order([sampler.updates[i] for i in due], reading)] for due in sampler.due]
    mode.data["updates"] = {"laws": laws, "times": sampler.times.tolist(), "due": orders}
    for event in mode.data["events"]:
        called = sampler.due_after(event["part"], event["law"])
        event["updates"] = [number[one] for one in in_order([sampler.updates[i] for i in called], reading)]


def _given(mode: ModeText, one: Update, t: float) -> list[float]:
    """Return what an update sets at a time, whatever the states are."""
    reading, held = update_inputs_of(mode.assembly), mode.assembly.held_now
    q, u = mode.plan.program.split(np.array(mode.data["state"]))
    states = [held, tuple(one + 1.0 for one in held)]
    found = [evaluated(one, mode.assembly, t, reading.values(mode.assembly, t, q, u, each), reading) for each in states]
    if found[0] != found[1]:
        raise NotLiveError(f"{one.path}.{one.law.name} is an update that reads its states and branches on the time")
    return found[0]


def _place(mode: ModeText, path: str) -> tuple[str, int]:
    """Return whether what is set is among the parameters or the coordinates, and its number."""
    held: dict[str, int] = mode.data["held"]
    if path in held:
        return "held", held[path]
    return "state", update_inputs_of(mode.assembly).states[path]


def _traced(mode: ModeText, one: Update) -> Program:
    """Return an update as a program of (t, q, u)."""
    assembly, equations, graph = mode.assembly, mode.equations, mode.equations.graph
    label = f"{one.path}.{one.law.name}"
    if not one.law.options.pure:
        raise NotLiveError(
            f"{label} is an update that may remember what it was called with: pure=True says it does not"
        )
    local, reading = assembly.mechanism.locals_[one.path], update_inputs_of(assembly)
    symbols = {state.path: state.symbol for state in assembly.discrete_states}
    symbols |= {state.path: state.symbol for state in equations.states}
    known: dict[str, Any] = dict(local.binding.values)
    inputs = zip(reading.inputs, reading.program.results, strict=True)
    known |= {name: value for (path, name), value in inputs if path == one.path}
    bound = with_states(assembly, one.path, equations.time, known, symbols.__getitem__)
    try:
        found = tuple(graph.convert(value) for value in numbers_in(getattr(bound, one.law.name)()))
    except (AtwoodError, TypeError, ValueError) as error:
        raise NotLiveError(f"{label} is an update that cannot be written as a formula: {error}") from error
    if len(found) != len(one.sets):
        raise NotLiveError(f"{label} is an update that returns {len(found)} numbers for {len(one.sets)}")
    return coordinate_program(assembly, f"({label})", equations, {"sets": found})
