"""Constraint forces that laws of force read, as functions of the state.

Friction needs the normal force, which is known only together with the accelerations.  In maximal coordinates, where
every joint has its multipliers, both solve ``M a - G^T lambda = -w``, ``G a = -gamma``, in which w is what is left of
the balance of forces, and depends on some of the multipliers: z.  They solve ``z = z_0 - A w(z)``.  Where w is affine
in z that is a linear system; else Newton's method is written out, from the multipliers without these forces on, and
what has not converged has no value.

Where joints close a loop, constraints may be redundant. Then some multipliers are not determined, and what forces make
of them must not depend on these, which is checked in numbers. A small multiple of its diagonal is added to
``G M^-1 G^T`` and taken back by iteration (iterated Tikhonov regularization: Engl, Hanke and Neubauer, Regularization
of Inverse Problems, section 5.1), since no choice of independent constraints need hold all along a motion. It is so
small that rows which nearly repeat others have their forces, as a place next to a hinge.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np

from atwood.errors import AtwoodError, UnsupportedError
from atwood.expr import Expression, absolute, depends_on, jacobian, select, solve, sqrt, substitute, vjp
from atwood.lazy_dataclasses import replace
from atwood.mechanics.dynamics.augmented import (
    Step,
    SymmetricSystem,
    eliminate,
    fill_of,
    minimum_degree,
    solution_of,
    with_right,
)
from atwood.mechanics.dynamics.equations import Constraint, ContactRow, Equations
from atwood.mechanics.kinematics.mechanism import Derivation, Mechanism, decide
from atwood.model.local.parts import multiplier_symbol
from atwood.numerics.rank import least_inertia

_ITERATIONS = 6
"""Each step squares the error; from a friction of half the normal force on, this many reach that of rounding."""

_CONVERGED = 1e-9
"""Relative to the multipliers: what is further from a solution after all steps is none."""

_ADDED = 1e-10
"""Relative to the diagonal of ``G M^-1 G^T``: what is added to it where constraints may be redundant."""

_TIMES = 3
"""So often the system is solved with it; of a direction with an eigenvalue of 1e-7 a share of 1e-9 is missing then."""

_LEAST_INERTIA = 1e-9
"""In units of the diagonal of the mass matrix: what has less in some direction has none there."""

Number = TypeVar("Number", Expression, float)
"""A formula, or its value."""

_LARGEST_FILL, _MANY_CONTACTS, _FILL_OF_CONTACTS = 20_000, 8, 5
"""Beyond so many products it is solved in numbers; with more gaps and slips than that beyond so many an unknown."""


def _check_reads(mechanism: Mechanism, read: Sequence[Expression], equations: Equations) -> None:
    """Refuse a law of force that reads a multiplier which nothing determines."""
    graph = mechanism.table.graph
    known = {one.multiplier for one in equations.constraints}
    known |= {*equations.contact_multipliers}
    known |= {multiplier_symbol(graph, *key) for key in mechanism.bodies.idle}
    for symbol in read:
        if symbol not in known:
            raise UnsupportedError(
                "a force depends on this reaction, which is not determined: all that the constraint joins is fixed or "
                "prescribed",
                where=symbol.name.removeprefix("lambda:").partition("[")[0],
                advice="Give the part that reads it a force of its own, such as an input.",
            )


def are_own(mechanism: Derivation, equations: Equations, read: Sequence[Expression]) -> bool:
    """Return whether multipliers that forces read follow in generalized coordinates alone, without other joints'.

    They are those of gaps and slips then, nothing else is held, everything has inertia, and none may repeat others: how
    these share a load is weighed by the masses of bodies, while a place near a joint has next to no lever. Where no
    body hangs on a joint, maximal coordinates are these, too.
    """
    hangs = any(one.joint is not None for one in equations.forest.attachments)
    if not hangs or equations.constraints or not {*read} <= {*equations.contact_multipliers}:
        return False
    rows = [one.row for one in equations.contacts]
    slopes = jacobian([one.rate for one in rows], list(equations.speeds)).by_place
    if _close_loops(mechanism, rows) or _are_crowded(slopes):
        return False
    mass = jacobian(list(equations.rows), list(equations.accelerations)).by_place
    symbols = (*equations.coordinates, *equations.speeds)
    is_whole = all((i, i) in mass for i in range(len(equations.speeds)))
    return is_whole and bool(decide(mechanism, partial(_has_inertia, dict(mass), symbols)))


def known_multipliers(
    mechanism: Derivation, equations: Equations, read: Sequence[Expression]
) -> dict[Expression, Expression]:
    """Return the multipliers that forces read, in terms of time, coordinates and speeds.

    Those of gaps and slips are among the unknowns, and not among the forces: only limits of friction read them there.
    """
    _check_reads(mechanism, read, equations)
    rows, speeds, accelerations = equations.rows, equations.speeds, equations.accelerations
    constraints, contacts = equations.constraints, equations.contacts
    graph, n = equations.graph, len(speeds)
    if contacts and not n:
        raise UnsupportedError(
            "nothing in the scene can move by itself, so that no force of a contact follows from a motion",
            where=contacts[0].row.key[0],
            advice="Let what touches move by the forces that act on it, or leave the contact out.",
        )
    number = {one.multiplier: n + i for i, one in enumerate((*constraints, *(one.row for one in contacts)))}
    own = {one.row.multiplier: graph.zero for one in contacts}
    number |= {one.read: number[one.row.multiplier] for one in contacts}
    known: dict[Expression, Expression] = {symbol: graph.zero for symbol in read if symbol not in number}
    if len(known) == len(read):
        return known
    at_rest = dict.fromkeys(accelerations, graph.zero)
    bias = substitute(list(rows), {**at_rest, **known, **own})
    wanted = [symbol for symbol in read if symbol in number and symbol not in own]
    stand_ins = {i: graph.symbol(f"force row {i}") for i, row in enumerate(bias) if depends_on(row, wanted)}
    right = [-stand_ins.get(i, row) for i, row in enumerate(bias)]
    right += [-one for one in substitute([one.second for one in constraints], at_rest)]
    seconds = substitute([one.row.second for one in contacts], at_rest)
    right += [-(one.mask * second) for one, second in zip(contacts, seconds, strict=True)]
    system = _System(rows, speeds, accelerations, constraints, right, contacts)
    held = [*constraints, *(one.row for one in contacts)]
    system.sharing = _sharing(mechanism, held, n) if system.stiffness else []
    can_repeat = _close_loops(mechanism, held)
    can_repeat = can_repeat or (bool(contacts) and _are_crowded(system.slopes))
    if can_repeat:
        symbols = (*equations.coordinates, *speeds)
        system.has_inertia = decide(mechanism, partial(_has_inertia, dict(system.mass), symbols))
    solved = _without_choice(system, speeds) if can_repeat else _solve_system(system)
    if wanted:
        known |= _forces_met(wanted, [solved[number[symbol]] for symbol in wanted], stand_ins, bias)
    placed = dict(zip(stand_ins.values(), substitute([bias[i] for i in stand_ins], known), strict=True))
    return {**known, **dict(zip(own, substitute([solved[number[symbol]] for symbol in own], placed), strict=True))}


def _forces_met(
    wanted: Sequence[Expression],
    found: Sequence[Expression],
    stand_ins: Mapping[int, Expression],
    bias: Sequence[Expression],
) -> dict[Expression, Expression]:
    """Return the multipliers that forces read, from what they are in terms of the rows of these forces."""
    graph = bias[0].graph
    forces, values = list(stand_ins.values()), [bias[i] for i in stand_ins]
    if len(found) < len(forces):
        slopes = [vjp([one], [1.0], forces) for one in found]
        shares = {(r, k): one for r, row in enumerate(slopes) for k, one in enumerate(row) if not one.is_zero}
    else:
        shares = jacobian(found, forces).by_place
    rest = substitute(found, dict.fromkeys(forces, graph.zero))
    try:
        found = _fixed_point(wanted, rest, shares, values)
    except AtwoodError as error:
        raise UnsupportedError(
            f"a force depends on a reaction that is constant here, where the force has no derivative ({error.message})",
            where=wanted[0].name.removeprefix("lambda:").partition("[")[0],
            advice="Round off the law there, as sqrt(n*n + a*a) instead of sqrt(n*n) with a small force a.",
        ) from error
    return dict(zip(wanted, found, strict=True))


class _System:
    """The balance ``M a - G^T lambda = r``, ``G a + C lambda = s`` with a diagonal C.

    Attributes
    ----------
    mass, slopes
        Entries of M, and those of G with the rows behind those of M, by row and column.
    right
        The right-hand side.
    diagonal
        The diagonal of C; empty where it is zero. A row of a gap that is open says that its multiplier is zero.
    masses
        Number of accelerations.
    stiffness, bare
        Stiffness of rows that share loads as springs do, and the entries of G without masks.
    sharing
        Groups of rows among which forces that balance each other stay, as far as is known.
    of_contacts
        The rows of gaps and slips.
    is_regular
        Whether C is positive definite.
    has_inertia
        Whether M is so, but for accelerations that have no entries in it: these come last, and all others in any order.
    steps
        How it was eliminated, with the last right-hand side; empty where it was not.
    """

    def __init__(
        self,
        rows: Sequence[Expression],
        speeds: Sequence[Expression],
        accelerations: Sequence[Expression],
        constraints: Sequence[Constraint],
        right: Sequence[Expression],
        contacts: Sequence[ContactRow],
    ) -> None:
        self.masses, self.right = len(speeds), list(right)
        mass = jacobian(list(rows), list(accelerations))
        rates = [*(one.rate for one in constraints), *(one.row.rate for one in contacts)]
        held = jacobian(rates, list(speeds))
        self.mass = mass.by_place
        count, zero = len(constraints), speeds[0].graph.zero
        self.slopes = {
            (self.masses + r, c): e if r < count else contacts[r - count].mask * e for r, c, e in held.triples
        }
        self.diagonal: list[Expression] = []
        if contacts:
            self.diagonal = [*([zero] * count), *(1.0 - one.mask for one in contacts)]
        rows_held = [*constraints, *(one.row for one in contacts)]
        self.stiffness = {
            self.masses + i: one.stiffness for i, one in enumerate(rows_held) if one.stiffness is not None
        }
        self.bare = {(self.masses + r, c): e for r, c, e in held.triples}
        self.is_regular = self.has_inertia = False
        self.sharing: list[list[int]] = []
        self.steps: list[Step] = []
        self.of_contacts = range(self.masses + count, len(self.right)) if contacts else range(0)

    def times(self, solved: Sequence[Expression], diagonal: Sequence[Expression]) -> list[Expression]:
        """Return the left-hand side for some accelerations and multipliers, with a diagonal of its own."""
        found = [solved[0].graph.zero] * len(solved)
        for (r, c), entry in self.mass.items():
            found[r] = found[r] + entry * solved[c]
        for (r, c), entry in self.slopes.items():
            found[c] = found[c] - entry * solved[r]
            found[r] = found[r] + entry * solved[c]
        for r, entry in enumerate(diagonal, self.masses):
            found[r] = found[r] + entry * solved[r]
        return found


def _has_inertia(
    mass: Mapping[tuple[int, int], Expression], symbols: Sequence[Expression], mechanism: Mechanism
) -> bool:
    """Return whether all accelerations with entries in the mass matrix have inertia, in units of their diagonal."""
    random = np.random.default_rng(0)  # how bodies are turned makes no difference
    place = dict(zip(symbols, random.uniform(-1.0, 1.0, len(symbols)).tolist(), strict=True))
    number = {i: k for k, i in enumerate(sorted({i for one in mass for i in one}))}
    full = np.zeros((len(number), len(number)))
    for (i, j), entry in zip(mass, mechanism.values_at_start(mass.values(), place), strict=True):
        full[number[i], number[j]] = entry
    return least_inertia(full) > _LEAST_INERTIA


def _close_loops(mechanism: Mechanism, constraints: Sequence[Constraint]) -> bool:
    """Return whether parts with constraints close a loop of bodies, so that constraints may be redundant."""
    group: dict[int, int] = {}

    def leader(body: int) -> int:
        while group.setdefault(body, body) != body:
            body = group[body]
        return body

    for bodies in _bodies_of(mechanism, constraints).values():
        leaders = {leader(body) for body in bodies}
        if len(leaders) < len(bodies):
            return True
        group.update(dict.fromkeys(leaders, min(leaders)))
    return False


def _bodies_of(mechanism: Mechanism, constraints: Sequence[Constraint]) -> dict[str, set[int]]:
    """Return the bodies that each part with constraints joins."""
    body_of, node_of, parts = mechanism.bodies.body_of, mechanism.graph.node_of, mechanism.locals_
    paths = dict.fromkeys(one.key[0] for one in constraints)
    return {path: {body_of[node_of[path, name]] for name in parts[path].connectors} for path in paths}


def _sharing(mechanism: Mechanism, constraints: Sequence[Constraint], first: int) -> list[list[int]]:
    """Return the rows, counted from the first, in groups: loads are shared among bodies that no single one parts."""
    from networkx import Graph, biconnected_components

    bodies = _bodies_of(mechanism, constraints)
    graph: Graph[int] = Graph()
    graph.add_edges_from((a, b) for own in bodies.values() for a in own for b in own if a < b)
    every: Any = biconnected_components(graph)  # sets, which its types do not say
    places: list[set[int]] = list(every)
    found: dict[tuple[int, ...], list[int]] = {}
    for row, one in enumerate(constraints, first):
        own = bodies[one.key[0]]
        key = next((place for place in places if len(own) > 1 and own <= place), own)
        found.setdefault(tuple(sorted(key)), []).append(row)
    return list(found.values())


def _are_crowded(slopes: Iterable[tuple[int, int]]) -> bool:
    """Return whether some rows hold fewer speeds than they are, as two brakes on one shaft (Koenig's matching)."""
    columns: dict[int, list[int]] = {}
    for row, column in slopes:
        columns.setdefault(row, []).append(column)
    holder: dict[int, int] = {}

    def finds_place(row: int, tried: set[int]) -> bool:
        for column in columns[row]:
            if column not in tried:
                tried.add(column)
                if column not in holder or finds_place(holder[column], tried):
                    holder[column] = row
                    return True
        return False

    return not all(finds_place(row, set()) for row in columns)


def _without_choice(system: _System, speeds: Sequence[Expression]) -> list[Expression]:
    """Return accelerations and multipliers, of which those that are not determined are as small as can be.

    With ``A + d D`` in the place of ``A = G M^-1 G^T`` multipliers are found to what rounding has made of those that
    balance each other, 1/d times as large. So they are put as ``D^-1 G y``, which has none of these: the same system
    gives y.
    """
    graph, n = speeds[0].graph, system.masses
    slopes = {(r - n, c): entry for (r, c), entry in system.bare.items()}
    inertia = {c: entry for (r, c), entry in system.mass.items() if r == c}
    weights = weights_of(slopes, inertia, [graph.zero] * (len(system.right) - n))
    weights = [graph.one if one.is_zero else one for one in weights]
    for row, one in _give_way(system).items():
        weights[row - n] = one
    masked = system.diagonal or [graph.zero] * len(weights)
    system.is_regular = True
    system.diagonal = [one + _ADDED * weight for one, weight in zip(masked, weights, strict=True)]
    solved = _iterated(system, masked)
    system.right = [*([graph.zero] * n), *(x * weight for x, weight in zip(solved[n:], weights, strict=True))]
    within = _iterated(system, masked)
    least = [graph.zero] * len(weights)
    for (r, c), entry in system.slopes.items():
        least[r - n] = least[r - n] + entry * within[c]
    return [*solved[:n], *(x / weight for x, weight in zip(least, weights, strict=True))]


def weights_of(
    slopes: Mapping[tuple[int, int], Number], inertia: Mapping[int, Number], none: list[Number]
) -> list[Number]:
    """Return by which weights D the least forces ``f D f`` are meant, where nothing else says how forces are shared.

    They are by how much rows move by their own forces with nothing else held. Coordinates without inertia have that
    which rows give them together, so that their units make no difference.

    Parameters
    ----------
    slopes
        Entries of the slopes of rows along speeds, by row and speed.
    inertia
        The diagonal of the mass matrix, where there is some.
    none
        A zero for each row.
    """
    found, own, light = list(none), dict[int, list[Number]](), dict[int, Number]()
    for (r, c), entry in slopes.items():
        if c in inertia:
            own.setdefault(r, []).append(1.0 / inertia[c])
            found[r] = found[r] + entry * entry / inertia[c]
    for (r, c), entry in slopes.items():
        if c not in inertia and r in own:
            given = entry * entry * float(len(own[r])) / sum(own[r], none[r])
            light[c] = light.get(c, none[r]) + given
    for (r, c), entry in slopes.items():
        if c in light:
            found[r] = found[r] + entry * entry / _or_one(light[c])
    return found


def _or_one(size: Number) -> Number:
    """Return a size to divide by: one in place of zero."""
    if isinstance(size, Expression):
        found: Expression = select(size > 0.0, size, 1.0)
        return found
    return size or 1.0


def _iterated(system: _System, masked: Sequence[Expression]) -> list[Expression]:
    """Return what solves a system with another diagonal, from solutions with its own."""
    solved, right = _solve_system(system), list(system.right)
    for _ in range(_TIMES - 1):
        system.right = [side - one for side, one in zip(right, system.times(solved, masked), strict=True)]
        solved = [one + more for one, more in zip(solved, _solve_system(system), strict=True)]
    return solved


def _give_way(system: _System) -> dict[int, Expression]:
    """Return by how much rows give way to a unit of force, in a unit for each group in which forces can be shared.

    With ``A + c C`` in the place of A, the limit for small c has ``C f`` square to all forces that balance each other:
    the least elastic energy. The unit is such that no row gives way by more than its own entry of A.
    """
    found: dict[int, Expression] = {}
    own = dict.fromkeys(system.stiffness, system.right[0].graph.zero)
    for (row, column), entry in system.bare.items():
        if row in own and (column, column) in system.mass:
            own[row] = own[row] + entry * entry / system.mass[column, column]
    for group in system.sharing:
        some = [row for row in group if row in own and not own[row].is_zero]
        unit = sum((1.0 / (own[row] * system.stiffness[row]) for row in some), system.right[0].graph.zero)
        found |= {row: float(len(some)) / (unit * system.stiffness[row]) for row in some}
    return found


def _solve_system(system: _System) -> list[Expression]:
    """Return accelerations and multipliers: written out if that is short, else in numbers.

    Of one system only the right-hand side changes from one solution to the next.
    """
    n, size, full, right = system.masses, len(system.right), system.mass, system.right
    signs = [1] * n + [-1] * (size - n)
    if system.steps:
        system.steps = with_right(system.steps, signs, right)
        return solution_of(system.steps)
    upper = {(r, c): e for (r, c), e in full.items() if r <= c} | {(c, r): e for (r, c), e in system.slopes.items()}
    upper |= {(n + i, n + i): one for i, one in enumerate(system.diagonal) if not one.is_zero}
    places, light = list(upper), {i for i in range(n) if (i, i) not in full}
    any_order = system.is_regular and system.has_inertia
    if any_order:
        order = sorted(minimum_degree(places, size), key=lambda i: i in light)
    else:
        order = [*range(n), *(i for i in minimum_degree(_after(places, n, size), size) if i >= n)]
    if all((i, i) in upper for i in system.of_contacts) and system.is_regular:  # many at a body of few coordinates
        order = [*system.of_contacts, *(i for i in order if i not in system.of_contacts)]
    most = _FILL_OF_CONTACTS * size if len(system.of_contacts) > _MANY_CONTACTS else _LARGEST_FILL
    if (any_order or not light) and fill_of(places, order) <= most:
        try:
            system.steps = eliminate(SymmetricSystem(upper, right, signs), order)
        except (AtwoodError, KeyError):  # a pivot that is always zero
            system.steps = []
        if system.steps:
            return solution_of(system.steps)
    matrix = dict(full)
    for (i, j), entry in system.slopes.items():
        matrix[i, j], matrix[j, i] = entry, -entry
    matrix |= {(i, i): entry for i, entry in enumerate(system.diagonal, n)}
    return _solve_apart(matrix, right)


def _by_row(matrix: Mapping[tuple[int, int], Expression]) -> dict[int, list[tuple[int, Expression]]]:
    """Return the columns and entries of each row."""
    found: dict[int, list[tuple[int, Expression]]] = {}
    for (row, column), entry in matrix.items():
        found.setdefault(row, []).append((column, entry))
    return found


def _solve_apart(matrix: Mapping[tuple[int, int], Expression], right: Sequence[Expression]) -> list[Expression]:
    """Return what solves a system in numbers: unknowns that share nothing are factored by themselves.

    Where nothing determines some of them all are solved for together: in a program that is no value, and no error.
    """
    from networkx import Graph, connected_components

    if not right:
        return []
    graph, found, every = right[0].graph, list(right), range(len(right))
    entries = [place for place, entry in matrix.items() if not entry.is_zero]
    places: Graph[int] = Graph()
    places.add_nodes_from(every)
    places.add_edges_from(entries)
    is_full = all(len(set(ones)) == len(right) for ones in zip(*entries, strict=True))  # no row or column is zero
    groups: Any = connected_components(places)  # sets, which its types do not say
    parts = sorted(sorted(one) for one in groups) if entries and is_full else [[*every]]
    try:
        for group in parts:
            rows = [[matrix.get((i, j), graph.zero) for j in group] for i in group]
            for i, one in zip(group, solve(rows, [right[i] for i in group]), strict=True):
                found[i] = graph.convert(one)
    except AtwoodError:  # some are numbers
        rows = [[matrix.get((i, j), graph.zero) for j in every] for i in every]
        return [graph.convert(one) for one in solve(rows, list(right))]
    return found


def _after(places: Sequence[tuple[int, int]], n: int, size: int) -> list[tuple[int, int]]:
    """Return where constraints meet when the masses have been eliminated."""
    near: dict[int, set[int]] = {i: {i} for i in range(n)}
    for i, j in places:
        if j < n:
            near[i].add(j)
            near[j].add(i)
    held: dict[int, set[int]] = {}
    for i, j in places:
        if i < n <= j:
            for k in near[i]:
                held.setdefault(k, set()).add(j)
    return [(a, b) for group in held.values() for a in group for b in group if a < b < size]


def _fixed_point(
    unknowns: Sequence[Expression],
    rest: Sequence[Expression],
    shares: Mapping[tuple[int, int], Expression],
    forces: Sequence[Expression],
) -> list[Expression]:
    """Return z with ``z = rest + shares w(z)``."""
    graph, count = rest[0].graph, len(unknowns)
    slopes = jacobian(list(forces), list(unknowns))
    turns = slopes.by_place
    is_affine = not depends_on(turns.values(), list(unknowns))
    if is_affine and len(forces) < count:
        return _met_by_forces(rest, shares, turns, substitute(list(forces), dict(zip(unknowns, rest, strict=True))))

    def times(matrix: Mapping[tuple[int, int], Expression], vector: Sequence[Expression]) -> list[Expression]:
        total = [graph.zero] * count
        for (r, c), entry in matrix.items():
            total[r] = total[r] + entry * vector[c]
        return total

    matrix = {(i, i): graph.one for i in range(count)}
    turns_of = _by_row(turns)
    for (r, k), share in shares.items():
        for c, turn in turns_of.get(k, ()):
            matrix[r, c] = matrix.get((r, c), graph.zero) - share * turn

    def gaps_at(values: Sequence[Expression]) -> list[Expression]:
        """Return by how much values miss the equations."""
        given = times(shares, substitute(list(forces), dict(zip(unknowns, values, strict=True))))
        return [z - r - g for z, r, g in zip(values, rest, given, strict=True)]

    def step(values: Sequence[Expression]) -> list[Expression]:
        there = substitute(list(matrix.values()), dict(zip(unknowns, values, strict=True)))
        gaps = gaps_at(values)
        moves = _solve_apart(dict(zip(matrix, there, strict=True)), gaps)
        if is_affine:
            return [value - move for value, move in zip(values, moves, strict=True)]
        # A solution stays where it is: where nothing presses, the size of a force has no slope.
        is_open = sum((absolute(gap) for gap in gaps), graph.zero) > 0.0
        return [select(is_open, value - move, value) for value, move in zip(values, moves, strict=True)]

    none = [graph.zero] * count
    if is_affine:
        return step(none)
    values = [-gap for gap in gaps_at(none)]
    for _ in range(_ITERATIONS):
        values = step(values)
    gaps = gaps_at(values)
    size = sum((absolute(one) for one in (*values, *rest)), graph.zero)
    miss = sum((absolute(one) for one in gaps), graph.zero)
    # The square root of minus one where Newton's method has not converged: no value rather than a wrong one.
    valid = sqrt(select(miss <= _CONVERGED * size, graph.one, -graph.one))
    return [graph.convert(value * valid) for value in values]


def _met_by_forces(
    rest: Sequence[Expression],
    shares: Mapping[tuple[int, int], Expression],
    turns: Mapping[tuple[int, int], Expression],
    forces: Sequence[Expression],
) -> list[Expression]:
    """Return z with ``z = rest + S w``, ``w = forces + T (z - rest)``, by ``(1 - T S) w = forces``: they are fewer."""
    graph, count = rest[0].graph, len(forces)
    matrix = {(i, i): graph.one for i in range(count)}
    shares_of = _by_row(shares)
    for (r, k), turn in turns.items():
        for c, share in shares_of.get(k, ()):
            matrix[r, c] = matrix.get((r, c), graph.zero) - turn * share
    met, found = _solve_apart(matrix, forces), list(rest)
    for (k, c), share in shares.items():
        found[k] = found[k] + share * met[c]
    return found


def with_known(equations: Equations, read: Mapping[Expression, Expression]) -> Equations:
    """Return equations with functions of the state in place of the multipliers that forces read."""
    known = substitute([*equations.rows, *equations.rates], dict(read))
    rows, rates = tuple(known[: len(equations.rows)]), tuple(known[len(equations.rows) :])
    made = replace(equations, rows=rows, rates=rates, read=dict(read))
    kept = set(equations.multipliers)  # those of what coordinates solve, and of gaps and slips, are nowhere else
    own = {x: value for x, value in read.items() if x not in kept}
    left = substitute([*equations.rows, *equations.rates], own) if own else [*equations.rows, *equations.rates]
    return replace(
        made, rows_with_multipliers=tuple(left[: len(rows)]), rates_with_multipliers=tuple(left[len(rows) :])
    )
