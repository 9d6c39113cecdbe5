"""What an FMU says beyond the motion: on what each variable depends, and derivatives along directions."""

from __future__ import annotations

from collections.abc import Sequence

from atwood.expr import Expression, InputGroup, OutputGroup, Program, dependencies as symbols_in, jvp
from atwood.expr.core.graph import Graph
from atwood.plotting.live.mode import ModeText

Dependencies = list[list[int]]
"""For each variable the numbers of the states, and after them of the inputs, on which it depends."""


def known_symbols(mode: ModeText, inputs: Sequence[int]) -> list[Expression]:
    """Return the symbols of states and inputs."""
    equations = mode.equations
    return [*equations.coordinates, *equations.speeds, *(mode.assembly.parameters[number] for number in inputs)]


def dependencies(mode: ModeText, inputs: Sequence[int]) -> tuple[Dependencies, Dependencies]:
    """Return on what rates of states depend, and quantities; inputs are numbers of parameters."""
    reads = {one: {k} for k, one in enumerate(known_symbols(mode, inputs))}

    def read(values: Sequence[Expression]) -> Dependencies:
        return [sorted(set().union(*(reads[one] for one in own))) for own in symbols_in(values, list(reads))]

    rates = read(_rates(mode))
    own = rates[len(mode.equations.coordinates) :]
    reads |= {one: set(found) for one, found in zip(mode.equations.accelerations, own, strict=True)}
    return rates, read(_quantities(mode))


def _rates(mode: ModeText) -> list[Expression]:
    groups = [list(one.expressions) for one in mode.programs["kernel"].outputs]
    return [*(groups[0] if len(groups) == 2 else mode.equations.speeds), *groups[-1]]


def _quantities(mode: ModeText) -> list[Expression]:
    loads = mode.programs.get("loads")
    return [*mode.programs["quantities"].outputs[0].expressions, *(loads.outputs[0].expressions if loads else ())]


def tangent_programs(mode: ModeText, inputs: Sequence[int]) -> dict[str, Program]:
    """Return the derivatives of rates and of quantities along a direction of states and inputs, as programs."""
    graph, equations = mode.equations.graph, mode.equations
    knowns = known_symbols(mode, inputs)
    along = _symbols(graph, "along known", len(knowns))
    of_accelerations = _symbols(graph, "along acceleration", len(equations.accelerations))
    size = len(knowns) - len(inputs)
    directions = InputGroup("dy", tuple(along[:size])), InputGroup("dp", tuple(along[size:]))
    seeds = dict(zip(knowns, along, strict=True))
    state = mode.programs["kernel"].inputs
    name, parameters = mode.flat.name, mode.assembly.parameters
    found = OutputGroup("rates", tuple(jvp(_rates(mode), seeds)))
    rates = Program(f"{name} (rates along)", (*state, *directions), parameters, (found,))
    seeds |= dict(zip(equations.accelerations, of_accelerations, strict=True))
    found = OutputGroup("quantities", tuple(jvp(_quantities(mode), seeds)))
    groups = (*state, InputGroup("a", tuple(equations.accelerations)), directions[0])
    groups = (*groups, InputGroup("da", tuple(of_accelerations)), directions[1])
    return {
        "rates_tangent": rates,
        "quantities_tangent": Program(f"{name} (quantities along)", groups, parameters, (found,)),
    }


def _symbols(graph: Graph, name: str, count: int) -> list[Expression]:
    return [graph.symbol(f"{name} {k}") for k in range(count)]
