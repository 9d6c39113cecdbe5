"""Accelerations as a program of (t, q, u), for methods that need ``u'`` itself.

Three ways of solving the balance of forces are written out, and the cheapest is kept:

- the mass matrix of the generalized coordinates, which is short for few of them, or where they hardly touch;
- the bodies' own coordinates with the forces of the joints as further unknowns, masses first: what is left is one
  equation for each joint force, which touches only those of neighbouring joints;
- the same, one body after the other from the leaves of the mechanism to its root.

The last two grow with the number of bodies; the bodies' accelerations are projected back on the generalized
coordinates, in terms of which everything is written.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from functools import partial, reduce
from operator import add
from typing import TYPE_CHECKING, Literal, cast

from atwood.errors import AtwoodError
from atwood.expr import Expression, OutputGroup, Program, jacobian, live, solve, substitute
from atwood.expr.core.graph import MANY
from atwood.expr.simplify.collect import cost_of_nodes
from atwood.expr.simplify.polynomial import Effort
from atwood.forms.caches import Key, derive_once
from atwood.forms.program import rates_are_speeds, state_groups
from atwood.forms.quantities import to_maximal
from atwood.lazy_dataclasses import dataclass, names_of
from atwood.mechanics.dynamics.augmented import (
    Step,
    SymmetricSystem,
    back_substitute,
    difference,
    eliminate,
    fill_of,
    minimum_degree,
    place_differences,
    solution_of,
)
from atwood.mechanics.dynamics.equations import Equations

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly


_ACCELERATIONS: Key[AccelerationProgram | None] = Key("accelerations")

Method = Literal["mass matrix", "joint forces", "leaves to root", "numeric"]

_LARGEST_FILL = 20_000
"""More products than these are left to a loop when the program runs."""

_FEW = 6
"""Up to so many coordinates all ways are tried; beyond, a mass matrix that is full costs more than it can save."""

_FEW_IN_SPACE = 16
"""The same for rigid bodies in space, each of which is six unknowns beside the forces of its joint."""

_PAIR = 8
"""What is saved where a sine and a cosine are of the same angle, in additions."""

_MUCH = 400
"""More products than these for each unknown are no gain over a mass matrix."""

_SMALL = 300
"""Expressions of up to so many nodes are rewritten."""

_EFFORT = 1000
"""So many operations on single terms for each unknown are spent on that: several times what it takes in a chain."""


@dataclass(frozen=True, eq=False)
class AccelerationProgram:
    """The accelerations of the reduced form without loops.

    Attributes
    ----------
    program
        Program of (t, q, u) with the accelerations; before them the rates of the coordinates, unless these are the
        speeds.
    method
        How the balance of forces is solved.
    """

    program: Program
    method: Method


def accelerations_of(assembly: Assembly) -> AccelerationProgram | None:
    """Return the accelerations of a scene as what costs least, made once for all assemblies of its structure."""
    return assembly.shared.get(_ACCELERATIONS, lambda: acceleration_program(assembly))


def acceleration_program(assembly: Assembly, method: Method | None = None) -> AccelerationProgram | None:
    """Return the accelerations of a scene in generalized coordinates."""
    equations = assembly.reduced
    if equations.constraints:
        return None
    tree = is_tree(assembly) if equations.speeds and method in _OF_TREES else False
    read = _read(equations), _read(assembly.maximal) if tree else None, assembly.parameters, method
    word, found = derive_once("accelerations", equations.graph, read, lambda: _cheapest(assembly, method, tree))
    if not word:
        return None
    groups = state_groups(equations)
    title = f"{assembly.flat.name} (accelerations)"
    outputs: tuple[OutputGroup, ...] = (OutputGroup("accelerations", tuple(found)),)
    if not rates_are_speeds(equations):
        outputs = (OutputGroup("rates", equations.rates), *outputs)
    return AccelerationProgram(Program(title, groups, assembly.parameters, outputs), cast("Method", word))


_OF_TREES = (None, "joint forces", "leaves to root")

_NOT_READ = ("locals_", "site", "masses", "shapes", "decisions", "constants")
"""What equations were made of; their derivation reads what was made."""


def _read(equations: Equations) -> list[object]:
    """Return all of equations that their derivation can read."""
    return [getattr(equations, name) for name in names_of(type(equations)) if name not in _NOT_READ]


_Made = tuple[Method, list[Expression]]
_Way = Callable[[], _Made | None]
"""Derives accelerations in one way; None where it does not apply."""


def _cheapest(assembly: Assembly, method: Method | None, is_tree: bool) -> tuple[str, list[Expression]]:
    """Return the method whose accelerations cost least, and these; an empty word where none applies.

    Of a large scene those of one way are there at a time: the best are derived again if others came after them.
    """
    graph, ways = assembly.reduced.graph, _ways(assembly, method, is_tree)
    start, way = len(graph), next(ways, None)
    best: tuple[int, _Way] | None = None
    kept: _Made | None = None
    while way is not None:
        if len(graph) > MANY:
            kept = None
            graph.forget(start)
        made = way()
        if made is None:
            break
        price, waves = _price(made[1], assembly.parameters)
        if best is None or price < best[0]:
            best, kept = (price, way), made
        del made
        try:
            way = ways.send(waves)
        except StopIteration:
            break
    if best is not None and kept is None:
        graph.forget(start)
        kept = best[1]()
    return kept or ("", [])


def _price(values: Sequence[Expression], parameters: Sequence[Expression]) -> tuple[int, int]:
    """Return what an evaluation costs, and the number of sines and cosines of what varies.

    A sine comes with the cosine of the same angle for little more.
    """
    nodes = live(values)
    waves = [n for n in nodes if n.operation in ("sin", "cos") and not n.is_parametric]
    pairs = len(waves) - len({wave.arguments[0] for wave in waves})
    return cost_of_nodes(nodes, parameters) - _PAIR * pairs, len(waves)


def _ways(assembly: Assembly, method: Method | None, is_tree: bool) -> Generator[_Way, int, None]:
    """Yield the ways that apply, and take how many sines and cosines of what varies there are in each."""
    equations = assembly.reduced
    if not equations.speeds:
        yield lambda: ("mass matrix", [])
        return
    tree: _Tree | None = None
    if is_tree:
        tree = _Tree(assembly)
        for name, order in tree.orders():
            for differences in (True, False) if method in (None, name) else ():
                waves = yield partial(tree.made, name, order, differences)
                if waves <= 2 * len(tree.angles):
                    if name == "joint forces" and len(tree.u) > _FEW and tree.rewrites:
                        return  # nothing can be much shorter
                    break
    if method == "numeric":
        yield lambda: _by_mass_matrix(equations, assembly.rows, True)
    elif method == "mass matrix" or (method is None and (tree is None or not tree.works or len(tree.u) <= tree.few)):
        yield lambda: _by_mass_matrix(equations, assembly.rows, False)


# -- the mass matrix ----------------------------------------------------------------------------------------------


def _by_mass_matrix(equations: Equations, rows: Sequence[Expression], numeric: bool) -> _Made:
    """Return the accelerations from ``M a + bias = 0``."""
    found = jacobian(list(rows), list(equations.accelerations))
    bias = substitute(list(rows), dict.fromkeys(equations.accelerations, 0.0))
    full = found.by_place
    entries = {place: entry for place, entry in full.items() if place[0] <= place[1]}
    if numeric or _is_full(entries, len(rows)):
        return "numeric", _solve_numerically(entries, [-b for b in bias])
    return "mass matrix", [-value for value in _solve_in_order(entries, bias)]


def solve_symmetric(entries: Mapping[tuple[int, int], Expression], right: Sequence[Expression]) -> list[Expression]:
    """Return the solution of a positive definite system, written out where that is not too long."""
    return (_solve_numerically if _is_full(entries, len(right)) else _solve_in_order)(entries, right)


def _order(entries: Mapping[tuple[int, int], Expression], n: int) -> Sequence[int]:
    return minimum_degree(list(entries), n, [i for i in range(n) if (i, i) in entries and entries[i, i].is_parametric])


def _is_full(entries: Mapping[tuple[int, int], Expression], n: int) -> bool:
    """Return whether a matrix is left to a loop when the program runs."""
    return fill_of(list(entries), _order(entries, n)) > _LARGEST_FILL or any((i, i) not in entries for i in range(n))


def _solve_numerically(entries: Mapping[tuple[int, int], Expression], right: Sequence[Expression]) -> list[Expression]:
    n, zero = len(right), right[0].graph.zero
    matrix = [[entries.get((min(r, c), max(r, c)), zero) for c in range(n)] for r in range(n)]
    return solve(matrix, list(right))


def _solve_in_order(entries: Mapping[tuple[int, int], Expression], right: Sequence[Expression]) -> list[Expression]:
    return solution_of(eliminate(SymmetricSystem(entries, right, [1] * len(right)), _order(entries, len(right))))


# -- the augmented system -----------------------------------------------------------------------------------------


def is_tree(assembly: Assembly) -> bool:
    """Return whether the joints of a mechanism form a tree in which each takes away freedom of its own."""
    reduced = assembly.reduced
    if reduced.eliminated or reduced.solved_speeds or reduced.forest.loop_joints:
        return False
    maximal = assembly.maximal
    has_joints = bool(maximal.constraints or maximal.orientation_coordinates)
    return has_joints and len(reduced.speeds) == len(maximal.speeds) - len(maximal.constraints)


class _Tree:
    """The balance of forces of a tree in the speeds of its bodies, at a state of the generalized coordinates."""

    def __init__(self, assembly: Assembly) -> None:
        from atwood.expr.simplify.alike import Alike  # a scene that was run before is not derived

        self.reduced, self.maximal = assembly.reduced, assembly.maximal
        self.graph = self.reduced.graph
        self.parameters = assembly.parameters
        self.u = self.reduced.speeds
        self.differences = True
        self.alike = Alike(Effort(_EFFORT * (len(self.maximal.speeds) + len(self.maximal.constraints))))
        self.rewrites = not self.maximal.orientation_coordinates
        named = zip(self.reduced.coordinates, self.reduced.names, strict=True)
        self.angles = {q: i for i, (q, one) in enumerate(named) if one.unit == "rad"}
        outputs = to_maximal(assembly).outputs
        symbols = (*self.maximal.coordinates, *self.maximal.speeds)
        self.places = dict(zip(symbols, (*outputs[0].expressions, *outputs[1].expressions), strict=True))
        self.bodies = self._bodies_of_speeds()
        self.depth = {one.body: i for i, one in enumerate(self.reduced.forest.attachments, 1)}
        start = len(self.graph)
        self.system = self._system()
        self.graph.forget(start)
        self.works = all(not self.system.entries.get((i, i), self.graph.zero).is_zero for i in range(self.masses))

    @property
    def few(self) -> int:
        """Up to so many speeds the mass matrix is tried too."""
        return _FEW if self.rewrites else _FEW_IN_SPACE

    @property
    def masses(self) -> int:
        """Number of the bodies' speeds."""
        return len(self.maximal.speeds)

    def tidy(self, values: list[Expression]) -> list[Expression]:
        """Rewrite expressions of few neighbours as by hand; with quaternions there is nothing to be found."""
        nodes = live(values) if self.rewrites else []
        if not self.rewrites or len(nodes) > _SMALL:
            return values
        angles = sorted((a for a in nodes if a in self.angles), key=self.angles.__getitem__) if self.differences else []
        return self.alike.collect(values, nodes, angles)

    def _bodies_of_speeds(self) -> list[int]:
        forest = self.maximal.forest
        bodies = [0] * len(forest.speeds)
        for one in forest.attachments:
            for number in (*one.speeds, *one.spin):
                bodies[number] = one.body
        for turn in forest.orientations:
            if turn.coordinate is not None:
                bodies[turn.coordinate] = turn.body
        return bodies

    def _system(self) -> SymmetricSystem:
        """Return ``M a - G^T lambda = -bias``, ``G a = -gamma``."""
        maximal, n = self.maximal, self.masses
        at_rest = dict.fromkeys(maximal.accelerations, 0.0)
        mass = jacobian(list(maximal.rows), list(maximal.accelerations))
        constraint_jacobian = jacobian([one.rate for one in maximal.constraints], list(maximal.speeds))
        sides = [*maximal.rows, *(one.second for one in maximal.constraints)]
        sides = [-side for side in substitute(sides, at_rest)]
        made = place_differences([*mass.entries, *constraint_jacobian.entries, *sides], self.places)
        places = [(r, c) for r, c in zip(mass.rows, mass.columns, strict=True)]
        places += [(c, n + r) for r, c in zip(constraint_jacobian.rows, constraint_jacobian.columns, strict=True)]
        entries = {(i, j): entry for (i, j), entry in zip(places, made, strict=False) if i <= j}
        return SymmetricSystem(entries, made[len(places) :], [1] * n + [-1] * len(maximal.constraints))

    def orders(self) -> Iterator[tuple[Method, list[int]]]:
        """Yield the orders of elimination in which every pivot is positive and little is added."""
        if not self.works:
            return
        n = self.masses
        held: dict[int, list[int]] = {n + k: [] for k in range(len(self.maximal.constraints))}
        inside = True
        for i, j in self.system.entries:
            if j >= n:
                held[j].append(self.bodies[i])
            elif self.bodies[i] != self.bodies[j]:
                inside = False
        if any(len(set(bodies)) not in (1, 2) for bodies in held.values()):
            return
        child = {number: max(self.depth[body] for body in bodies) for number, bodies in held.items()}
        last = sorted(held, key=lambda number: -child[number])
        depths = [self.depth[body] for body in self.bodies]
        both = [(-depths[i], 0, i) for i in range(n)] + [(-child[j], 1, j) for j in held]
        masses_first: list[tuple[Method, list[int]]] = [("joint forces", [*range(n), *last])] if inside else []
        for name, order in (*masses_first, ("leaves to root", [number for _, _, number in sorted(both)])):
            if fill_of(list(self.system.entries), order) <= _MUCH * len(order):
                yield name, order

    def made(self, method: Method, order: Sequence[int], differences: bool) -> _Made | None:
        """Return the accelerations with the method that they are derived by."""
        found = self.accelerations(order, differences)
        return None if found is None else (method, found)

    def accelerations(self, order: Sequence[int], differences: bool) -> list[Expression] | None:
        """Return the accelerations of the generalized coordinates, by elimination in an order.

        With `differences` there may be sines and cosines of differences of angles: in a chain these take the place of
        those of the angles, but where many parts meet there is a difference for each pair.
        """
        self.differences, start = differences, len(self.graph)
        try:
            short, true = self._unknowns(eliminate(self.system, order, self.tidy))
        except AtwoodError:  # a pivot that is always zero
            return None
        self.graph.forget(start)
        return self._project(short, true)

    def _unknowns(self, steps: Sequence[Step]) -> tuple[dict[int, Expression], dict[Expression, Expression]]:
        """Return the accelerations of the bodies, and what the symbols in them stand for."""
        true: dict[Expression, Expression] = {}
        exact: dict[int, Expression] = {}
        short: dict[int, Expression] = {}
        for step in reversed(steps):
            self._find(step, exact, short, true)
        return {i: short[i] for i in range(self.masses)}, true

    def _find(
        self, step: Step, exact: dict[int, Expression], short: dict[int, Expression], true: dict[Expression, Expression]
    ) -> None:
        """Find one unknown: exactly, and in terms of symbols for those that are worked out by themselves."""
        p = step.unknown
        if step.is_near and p < self.masses:
            short[p] = back_substitute(step, short)
            exact[p] = back_substitute(step, exact)
            return
        exact[p] = back_substitute(step, exact)
        short[p] = self.graph.symbol(f"unknown {p}")
        true[short[p]] = exact[p]

    def _project(
        self, found: Mapping[int, Expression], true: Mapping[Expression, Expression]
    ) -> list[Expression] | None:
        """Return the accelerations of the generalized coordinates from those of the bodies."""
        reduced, maximal = self.reduced, self.maximal
        a = reduced.accelerations
        known: dict[Expression, Expression] = {}
        own = {turn.body: turn.coordinate for turn in maximal.forest.orientations}
        for turn in reduced.forest.orientations:
            if turn.coordinate is not None:
                number = own.get(turn.body)
                if number is None:
                    return None
                known[a[turn.coordinate]] = found[number]
        spins = {one.body: [found[i] for i in one.spin] for one in maximal.forest.attachments if one.spin}
        for one in reduced.forest.attachments:
            known.update(zip((a[i] for i in one.spin), spins[one.body] if one.spin else (), strict=True))
        joints = [one for one in reduced.forest.attachments if one.speeds]
        here = [_relative(reduced, one.node, one.parent) for one in joints]
        there = [value for one in joints for value in _relative(maximal, one.node, one.parent)]
        places = {**self.places, **{maximal.accelerations[i]: value for i, value in found.items()}}
        there = place_differences(there, places)
        for k, one in enumerate(joints):
            wanted, start = [a[i] for i in one.speeds], len(self.graph)
            d = len(here[k])
            mine, theirs = here[k], there[k * d : k * d + d]
            if one.turns_with_joint:
                mine = [*mine, *reduced.kinematics.angular_accelerations[one.body]]
                theirs = [*theirs, *spins[one.body]]
            solution = self._solve_joint(substitute(mine, known), theirs, wanted)
            if solution is None:
                return None
            known.update(zip(wanted, solution, strict=True))
            self.graph.forget(start)
        if any(symbol not in known for symbol in a):
            return None
        return substitute([known[symbol] for symbol in a], true)

    def _solve_joint(
        self, here: Sequence[Expression], there: Sequence[Expression], wanted: Sequence[Expression]
    ) -> list[Expression] | None:
        """Solve ``here = there``, which is affine in what is wanted, in the sense of least squares."""
        slopes = jacobian(list(here), list(wanted))
        zero = self.graph.zero
        entry = slopes.by_place
        rest = substitute(list(here), dict.fromkeys(wanted, 0.0))
        gaps = [t - r for t, r in zip(there, rest, strict=True)]
        k = len(wanted)
        columns = [[entry.get((r, c), zero) for r in range(len(here))] for c in range(k)]
        squares = {(i, j): _dot(columns[i], columns[j]) for i in range(k) for j in range(i, k)}
        if any(squares[i, i].is_zero for i in range(k)):
            return None
        steps = eliminate(SymmetricSystem(squares, [_dot(c, gaps) for c in columns], [1] * k), range(k), self.tidy)
        return self.tidy(solution_of(steps))


def _relative(equations: Equations, node: int, parent: int) -> list[Expression]:
    """Return the acceleration of a node less that of the node that it hangs on."""
    accelerations = equations.kinematics.accelerations
    return [difference(p, q) for p, q in zip(accelerations[node], accelerations[parent], strict=True)]


def _dot(a: Sequence[Expression], b: Sequence[Expression]) -> Expression:
    return reduce(add, [p * q for p, q in zip(a, b, strict=True)])
