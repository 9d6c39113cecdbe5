"""Accelerations and projections of a mechanism whose constraints stay, for methods that need ``u'`` itself.

The augmented system ``M a - G^T lambda = -bias``, ``G a = -gamma`` is eliminated on the graph, masses first and then
one constraint after the other (Featherstone, Rigid Body Dynamics Algorithms, 2008, sections 3.2 and 8.5). What is left
of the masses is ``G M^-1 G^T``, in which joints meet their neighbours alone; both parts are positive definite, so that
no pivot is searched for.  Where something has no inertia of its own but is held, ``M + sum s_k G_k^T G_k`` takes the
place of M, with the constraints that touch it: they make the addition ``-s_k G_k^T gamma_k``, which goes to the other
side (M. Fortin and R. Glowinski, Augmented Lagrangian Methods, 1983, chapter I).

A state is projected by the shortest displacement along the speeds, each measured by its size:
``d = -W G^T (G W G^T)^-1 g`` with ``W = diag(sizes^2)`` (Hairer, Lubich and Wanner, Geometric Numerical Integration,
2006, section IV.4).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise

from atwood.expr import Expression, InputGroup, OutputGroup, Program, jacobian, solve, substitute
from atwood.expr.simplify.factors import join_known_factors
from atwood.forms.program import rates_are_speeds, state_groups
from atwood.forms.residuals import keep_constraints
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.augmented import Step, SymmetricSystem, eliminate, fill_of, solution_of, with_right
from atwood.mechanics.dynamics.equations import Constraint, ContactRow, Equations

_LARGEST_FILL = 60_000
"""More products than these are left to a loop when the program runs."""

_FILL_OF_CONTACTS = 500
"""The same of gaps and slips: each may meet all others, so that products grow with the cube of their number."""

_ADDED = 1e-9
"""Of the diagonal of gaps and slips, which may repeat each other: what they miss shrinks by that in a step."""

Place = tuple[int, int]
_Slopes = dict[int, Expression]


@dataclass(frozen=True, eq=False)
class ConstrainedProgram:
    """What an explicit method needs of a mechanism whose constraints stay.

    The parameters of both programs are those of the scene, and then the size of a displacement along each speed.

    Attributes
    ----------
    accelerations
        Program of (t, q, u) with the accelerations; before them the rates of the coordinates, unless these are the
        speeds.
    projection
        Program of (t, q, u) with coordinates and speeds after one step of Newton's method towards the constraints on
        position and velocity, and by how much each speed's size the place has moved.
    """

    accelerations: Program
    projection: Program


def constrained_program(
    name: str,
    equations: Equations,
    rows: Sequence[Expression],
    parameters: Sequence[Expression],
    kept: Sequence[int],
    light: Sequence[int],
) -> ConstrainedProgram:
    """Return accelerations and projections of a mechanism whose constraints stay."""
    graph = equations.graph
    sizes = tuple(graph.symbol(f"size of {one.name}") for one in equations.speed_names)
    held = keep_constraints(equations, kept)
    start = len(graph)
    # Not kept in the cache: to name an entry, write and read it takes longer than this.
    found = [*_accelerations(held, rows, parameters, sizes, light), *_projection(held, sizes)]
    graph.forget(start)
    n, m = len(equations.coordinates), len(equations.speeds)
    groups, known = state_groups(equations), (*parameters, *sizes)
    outputs: tuple[OutputGroup, ...] = (OutputGroup("accelerations", tuple(found[:m])),)
    if not rates_are_speeds(equations):
        outputs = (OutputGroup("rates", equations.rates), *outputs)
    parts = (tuple(found[i:j]) for i, j in pairwise((m, m + n, 2 * m + n, 3 * m + n)))
    nearer = tuple(OutputGroup(*one) for one in zip(("coordinates", "speeds", "moved"), parts, strict=True))
    return ConstrainedProgram(
        Program(f"{name} (accelerations)", groups, known, outputs),
        Program(f"{name} (projection)", groups, known, nearer),
    )


def impact_program(
    name: str,
    equations: Equations,
    rows: Sequence[Expression],
    gaps: Sequence[ContactRow],
    parameters: Sequence[Expression],
    kept: Sequence[int],
    light: Sequence[int],
) -> Program:
    """Return the program of what an impact at one gap alone makes of a state, by Newton's law and without friction.

    Its inputs are (t, q, u, pick), the last 1 for the gap and 0 for the others; its outputs are coordinates, with the
    gap closed to rounding, and speeds, the rates of all gaps before and after, how these move by a unit of impulse, and
    the impulse. Its parameters are those of `ConstrainedProgram`.
    """
    graph, held = equations.graph, keep_constraints(equations, kept)
    sizes = tuple(graph.symbol(f"size of {one.name}") for one in equations.speed_names)
    picks = tuple(graph.symbol(f"pick of gap {i}") for i in range(len(gaps)))
    slopes = _slopes(equations, [one.row for one in gaps])

    def picked(values: Iterable[Expression | None]) -> Expression:
        terms = (pick * value for pick, value in zip(picks, values, strict=True) if value is not None)
        return sum(terms, graph.zero)

    push = [-picked(row.get(i, graph.zero) for row in slopes) for i in range(len(equations.speeds))]
    by_unit = _balanced(*_masses(held, rows), push, [graph.zero] * len(held.constraints), sizes, light)
    response = [sum((entry * by_unit[i] for i, entry in row.items()), graph.zero) for row in slopes]
    before = [one.row.rate for one in gaps]
    back = picked(response)
    impulse = -(1.0 + picked(one.restitution for one in gaps)) * picked(before) / back
    share = -picked(one.row.value for one in gaps) / back
    coordinates = _moved(equations, [share * one for one in by_unit])
    speeds = [u + impulse * one for u, one in zip(equations.speeds, by_unit, strict=True)]
    after = [rate + impulse * one for rate, one in zip(before, response, strict=True)]
    found = (*coordinates, *speeds, *before, *after, *response, impulse)
    groups = (*state_groups(equations), InputGroup("pick", picks))
    return Program(f"{name} (impact)", groups, (*parameters, *sizes), (OutputGroup("impact", found),))


def contacts_program(
    name: str,
    equations: Equations,
    rows: Sequence[Expression],
    contacts: Sequence[Sequence[ContactRow]],
    parameters: Sequence[Expression],
    kept: Sequence[int],
    light: Sequence[int],
) -> tuple[Program, list[tuple[int, int]]]:
    """Return the program of what asks for a set of contacts, and which limits read which forces.

    Equations are those where nothing touches, and contacts the rows of each gap and slip. Its inputs are (t, q, u). Its
    outputs are, of each row, values, rates, accelerations without contacts and restitutions; how all rows, and speeds,
    move by a unit of force along each; of each gap and slip four limits at no forces, and their slopes: sliding and
    static, then both backwards. Its parameters are those of `ConstrainedProgram`.
    """
    graph, held, flat = equations.graph, keep_constraints(equations, kept), [one for some in contacts for one in some]
    zero, sizes = graph.zero, tuple(graph.symbol(f"size of {one.name}") for one in equations.speed_names)
    slopes, entries, joints = _slopes(equations, [one.row for one in flat]), *_masses(held, rows)
    at_rest, still = dict.fromkeys(equations.accelerations, 0.0), [zero] * len(held.constraints)
    bias = substitute(list(rows), at_rest)
    gamma = substitute([one.second for one in held.constraints], at_rest)
    falling = _balanced(dict(entries), joints, bias, gamma, sizes, light)
    free = substitute([one.row.second for one in flat], dict(zip(equations.accelerations, falling, strict=True)))
    each = [
        _balanced(dict(entries), joints, [-row.get(i, zero) for i in range(len(bias))], still, sizes, light)
        for row in slopes
    ]
    response = [sum((e * one[i] for i, e in row.items()), zero) for row in slopes for one in each]
    reads = [one.read for one in flat]
    limits = [some[0].towards(way)[i] for way in (1.0, -1.0) for i in (0, 1) for some in contacts]
    shares = jacobian(limits, reads)
    pattern = sorted({(row % len(contacts), column) for row, column, _ in shares.triples})
    places = {(row, column): entry for row, column, entry in shares.triples}
    found = [
        *(zero if one.row.value is None else one.row.value for one in flat),
        *(one.row.rate for one in flat),
        *free,
        *(zero if one.restitution is None else one.restitution for one in flat),
        *response,
        *(x for one in each for x in one),
        *substitute(limits, dict.fromkeys(reads, zero)),
        *(places.get((k + g * len(contacts), column), zero) for g in range(4) for k, column in pattern),
    ]
    outputs = (OutputGroup("contacts", tuple(map(graph.convert, found))),)
    return Program(f"{name} (contacts)", state_groups(equations), (*parameters, *sizes), outputs), pattern


def _masses(equations: Equations, rows: Sequence[Expression]) -> tuple[dict[Place, Expression], list[_Slopes]]:
    """Return the entries of the mass matrix, and the rows of the constraint Jacobian."""
    mass = jacobian(list(rows), list(equations.accelerations))
    return {(r, c): e for r, c, e in mass.triples if r <= c}, _slopes(equations, equations.constraints)


def _balanced(
    entries: dict[Place, Expression],
    slopes: Sequence[_Slopes],
    bias: list[Expression],
    gamma: Sequence[Expression],
    sizes: Sequence[Expression],
    light: Sequence[int],
) -> list[Expression]:
    """Return the accelerations of ``M a - G^T lambda = -bias``, ``G a = -gamma``."""
    n, bare = len(bias), set(light)
    carrying = [k for k, row in enumerate(slopes) if not bare.isdisjoint(row)]
    if carrying:
        bias = _stiffen(entries, bias, [slopes[k] for k in carrying], [gamma[k] for k in carrying], sizes)
    places = {(c, n + k): e for k, row in enumerate(slopes) for c, e in row.items()}
    right = [-one for one in (*bias, *gamma)]
    signs = [1] * n + [-1] * len(slopes)
    return _Solved().solve(SymmetricSystem({**entries, **places}, right, signs))[:n]


def _accelerations(
    equations: Equations,
    rows: Sequence[Expression],
    parameters: Sequence[Expression],
    sizes: Sequence[Expression],
    light: Sequence[int],
) -> list[Expression]:
    at_rest = dict.fromkeys(equations.accelerations, 0.0)
    balance = _masses(equations, rows)
    bias = substitute(list(rows), at_rest)
    gamma = substitute([one.second for one in equations.constraints], at_rest)
    found = _balanced(*balance, bias, gamma, sizes, light)
    if not equations.contacts:
        return found
    return join_known_factors(_without_rounding(equations, found, sizes), (*parameters, *sizes))


def _without_rounding(
    equations: Equations, accelerations: Sequence[Expression], sizes: Sequence[Expression]
) -> list[Expression]:
    """Return accelerations without what rounding leaves of them along gaps and slips that hold.

    Forces that balance leave some 1e-16 of what they are. Where nothing moves steps become long, and add that up.
    """
    rows = [one.row for one in equations.contacts]
    known = dict(zip(equations.accelerations, accelerations, strict=True))
    misses, masks = substitute([row.second for row in rows], known), [one.mask for one in equations.contacts]
    changed = nearest(equations, rows, misses, sizes, masks)
    return [a - one * size for a, one, size in zip(accelerations, changed, sizes, strict=True)]


def _slopes(equations: Equations, rows: Sequence[Constraint]) -> list[_Slopes]:
    """Return the rows of the constraint Jacobian by column."""
    found = jacobian([one.rate for one in rows], list(equations.speeds))
    slopes: list[_Slopes] = [{} for _ in rows]
    for row, column, entry in found.triples:
        if not entry.is_zero:
            slopes[row][column] = entry
    return slopes


def _stiffen(
    entries: dict[Place, Expression],
    bias: list[Expression],
    slopes: Sequence[Mapping[int, Expression]],
    gamma: Sequence[Expression],
    sizes: Sequence[Expression],
) -> list[Expression]:
    """Add ``s_k G_k^T G_k`` to the mass matrix, and return what the bias is then.

    Each addition is as large as inertia: s_k is the mean of the diagonal of M over the square of the constraint's
    slope, in displacements of the sizes.
    """
    graph = sizes[0].graph
    inertia = graph.zero
    for i, size in enumerate(sizes):
        if (i, i) in entries:
            inertia = inertia + entries[i, i] * size * size
    bias = list(bias)
    for row, second in zip(slopes, gamma, strict=True):
        square = graph.zero
        for column, entry in row.items():
            square = square + (entry * sizes[column]) * (entry * sizes[column])
        share = inertia / (float(len(sizes)) * square)
        for i, first in row.items():
            weighted = share * first
            bias[i] = bias[i] + weighted * second
            for j, other in row.items():
                if i <= j:
                    entries[i, j] = entries.get((i, j), graph.zero) + weighted * other
    return bias


def _projection(equations: Equations, sizes: Sequence[Expression]) -> list[Expression]:
    """Return coordinates and speeds after one step of Newton's method, and the displacements in units of their sizes.

    Speeds are projected with the slopes of the place before the step: what that leaves is of second order.
    """
    one = equations.graph.one
    rows = [*((held, one) for held in equations.constraints), *((held.row, held.mask) for held in equations.contacts)]
    holding = [(held, mask) for held, mask in rows if held.holonomic and held.value is not None]
    values = [held.value for held, _ in holding if held.value is not None]
    closest = nearest_to(equations, [held for held, _ in holding], sizes, [mask for _, mask in holding])
    moved = closest(values)
    coordinates = _moved(equations, [-one * size for one, size in zip(moved, sizes, strict=True)])
    there = dict(zip(equations.coordinates, coordinates, strict=True))
    misses = substitute([held.rate for held, _ in rows], there)
    if len(holding) < len(rows):
        closest = nearest_to(equations, [held for held, _ in rows], sizes, [mask for _, mask in rows])
    changed = closest(misses)
    speeds = [u - one * size for u, one, size in zip(equations.speeds, changed, sizes, strict=True)]
    return [*coordinates, *speeds, *moved]


def nearest(
    equations: Equations,
    rows: Sequence[Constraint],
    right: Sequence[Expression],
    sizes: Sequence[Expression],
    masks: Sequence[Expression],
) -> list[Expression]:
    """Return the shortest solution of ``G d = right``, in units of the sizes; of rows whose mask is one, not zero."""
    return nearest_to(equations, rows, sizes, masks)(right)


def nearest_to(
    equations: Equations, rows: Sequence[Constraint], sizes: Sequence[Expression], masks: Sequence[Expression]
) -> Callable[[Sequence[Expression]], list[Expression]]:
    """Return what gives these solutions for any right-hand side; the matrix is eliminated once."""
    zero, slopes = equations.graph.zero, _slopes(equations, rows)
    scaled = [{c: mask * (e * sizes[c]) for c, e in row.items()} for row, mask in zip(slopes, masks, strict=True)]
    by_column: dict[int, list[int]] = {}
    for k, row in enumerate(scaled):
        for column in row:
            by_column.setdefault(column, []).append(k)
    entries: dict[Place, Expression] = {}
    for column, met in by_column.items():
        for a, i in enumerate(met):
            for j in met[a:]:
                entries[i, j] = entries.get((i, j), zero) + scaled[i][column] * scaled[j][column]
    for k, mask in enumerate(masks):
        if not (mask - 1.0).is_zero:
            entries[k, k] = (1.0 + _ADDED) * entries.get((k, k), zero) + (1.0 - mask)
    most = _LARGEST_FILL if all(mask.is_constant for mask in masks) else _FILL_OF_CONTACTS
    solved = _Solved(most)

    def shortest(right: Sequence[Expression]) -> list[Expression]:
        right = [mask * one for one, mask in zip(right, masks, strict=True)]
        found = solved.solve(SymmetricSystem(entries, right, [1] * len(right))) if right else []
        moved = [zero] * len(sizes)
        for row, multiplier in zip(scaled, found, strict=True):
            for column, entry in row.items():
                moved[column] = moved[column] + entry * multiplier
        return moved

    return shortest


def _moved(equations: Equations, displacements: Sequence[Expression]) -> list[Expression]:
    """Return the coordinates after displacements along the speeds."""
    if rates_are_speeds(equations):
        return [q + d for q, d in zip(equations.coordinates, displacements, strict=True)]
    tangent = jacobian(list(equations.rates[: equations.placing]), list(equations.speeds))
    coordinates = list(equations.coordinates)
    for row, column, entry in tangent.triples:
        coordinates[row] = coordinates[row] + entry * displacements[column]
    return coordinates


class _Solved:
    """Solutions of a system of masses and constraints, written out with so many products at most."""

    def __init__(self, most: int = _LARGEST_FILL) -> None:
        self._most = most
        self._steps: list[Step] = []

    def solve(self, system: SymmetricSystem) -> list[Expression]:
        """Return the solution; another one has the same matrix."""
        if self._steps:
            self._steps = with_right(self._steps, system.signs, system.right)
        else:
            places = list(system.entries)
            order = _order(places, system.signs)
            if fill_of(places, order) > self._most:
                return _solved_by_loops(system)
            self._steps = eliminate(system, order)
        return solution_of(self._steps)


def _solved_by_loops(system: SymmetricSystem) -> list[Expression]:
    """Return the same by elimination with pivots, for which no code of its own is written."""
    size = len(system.right)
    zero = system.right[0].graph.zero
    matrix = [[zero] * size for _ in range(size)]
    for (i, j), entry in system.entries.items():
        matrix[j][i] = entry
        matrix[i][j] = -entry if system.signs[i] != system.signs[j] else entry
    return solve(matrix, list(system.right))


def _order(places: Sequence[Place], signs: Sequence[int]) -> list[int]:
    """Return an order of elimination that adds few entries: always what has the fewest neighbours.

    A constraint can have its turn once all masses that it touches have had theirs: what is left of it by these is then
    positive, as long as constraints are independent.
    """
    from atwood.numerics.body_order import by_least, neighbours_of

    around = neighbours_of(places, len(signs))
    waiting = {i: sum(signs[j] > 0 for j in others) for i, others in enumerate(around) if signs[i] < 0}
    meets = {i: [j for j in others if signs[j] < 0] for i, others in enumerate(around) if signs[i] > 0}
    order: list[int] = []
    for i in by_least(around, lambda one: None if waiting.get(one) else len(around[one])):
        order.append(i)
        for a in meets.get(i, ()):
            waiting[a] -= 1
    return order
