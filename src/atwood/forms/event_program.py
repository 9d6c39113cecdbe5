"""Values of events as a program of (t, q, u) alone: what they read of accelerations and reactions is solved for in it.

A rope goes slack where its tension vanishes. The tension is a reaction, which follows from the balance of forces in
maximal coordinates, where every joint is a constraint: ``M a - G^T lambda = -bias``, ``G a = -gamma``.
"""

from __future__ import annotations

from collections.abc import Sequence

from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, jacobian, read_by, solve, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.program import state_groups
from atwood.forms.quantities import internal_reactions_of, to_maximal
from atwood.mechanics.dynamics.equations import Equations

_LARGEST = 120
"""More unknowns than these are not solved for densely at every step."""


def event_program(
    assembly: Assembly, values: Sequence[Expression], kept: Sequence[int], kept_maximal: Sequence[int]
) -> Program | None:
    """Return the program of (t, q, u, shift) with the values of events, each with its shift added."""
    equations = assembly.own_equations
    known: dict[Expression, Expression] = {}
    symbols = read_by(values, [one.symbol for one in assembly.reactions])
    if symbols:
        found = solved_reactions(assembly, set(symbols), kept_maximal)
        if found is None:
            return None
        known.update(found)
    if depends_on(values, equations.accelerations):
        solved = _solve(equations, kept)
        if solved is None:
            return None
        known.update(zip(equations.accelerations, solved, strict=False))
    graph = equations.graph
    shifts = tuple(graph.symbol(f"event shift {i}") for i in range(len(values)))
    written = substitute(list(values), known) if known else list(values)
    outputs = (OutputGroup("events", tuple(v + s for v, s in zip(written, shifts, strict=True))),)
    groups = (*state_groups(equations), InputGroup("shift", shifts))
    return Program(f"{assembly.flat.name} event functions", groups, assembly.parameters, outputs)


def _solve(equations: Equations, kept: Sequence[int]) -> list[Expression] | None:
    """Return accelerations and multipliers of a balance of forces with independent constraints."""
    graph, n, m = equations.graph, len(equations.speeds), len(kept)
    if n + m > _LARGEST:
        return None
    at_rest = dict.fromkeys(equations.accelerations, 0.0)
    constraints = [equations.constraints[i] for i in kept]
    mass = jacobian(list(equations.rows), list(equations.accelerations))
    constraint_jacobian = jacobian([one.rate for one in constraints], list(equations.speeds)) if m else None
    matrix = [[graph.zero] * (n + m) for _ in range(n + m)]
    for row, column, entry in mass.triples:
        matrix[row][column] = entry
    if constraint_jacobian is not None:
        for row, column, entry in constraint_jacobian.triples:
            matrix[n + row][column] = entry
            matrix[column][n + row] = -entry
    sides = [*equations.rows, *(one.second for one in constraints)]
    right = [-side for side in substitute(sides, at_rest)]
    return [graph.convert(one) for one in solve(matrix, right)]


def solved_reactions(
    assembly: Assembly, wanted: set[Expression], kept: Sequence[int]
) -> dict[Expression, Expression] | None:
    """Return reactions in terms of the form's coordinates and speeds; None where these do not give them."""
    maximal = assembly.maximal
    if len(kept) != len(maximal.constraints):
        return None
    solved = _solve(maximal, kept)
    if solved is None:
        return None
    n = len(maximal.speeds)
    solution = dict(zip((*maximal.accelerations, *maximal.multipliers), solved, strict=True))
    of_constraint = {one.key: i for i, one in enumerate(maximal.constraints)}
    internal = internal_reactions_of(assembly)
    found: dict[Expression, Expression] = {}
    for one in assembly.reactions:
        if one.symbol not in wanted:
            continue
        if one.axis >= 0:
            if internal is None or one.path not in internal.rows:
                return None
            value = substitute([internal.program.results[internal.rows[one.path]]], solution)[0]
        elif one.key in of_constraint:
            value = one.sign * solved[n + of_constraint[one.key]]
        else:
            value = maximal.graph.zero
        found[one.symbol] = value
    if assembly.form == "reduced":
        symbols = (*maximal.coordinates, *maximal.speeds)
        places = dict(zip(symbols, to_maximal(assembly).results, strict=True))
        found = dict(zip(found, substitute(list(found.values()), places), strict=True))
    return found
