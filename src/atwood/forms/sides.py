"""Relations of what moves, taken out of the equations that are run: each keeps its value in a piece of the motion.

A law that reads ``select(x < 1, a, b)`` is smooth on both sides of its switch. So for a run a symbol stands for each
relation, as for relations of functions of time (`atwood.expr.core.relations`); the run stops where its difference
passes zero, and goes on with another value of the same programs. Whatever else reads a scene sees its laws as they are.

A relation stays in its place, and its root is found all the same, where a branch has no value behind it: a root of what
becomes negative. One on which the motion stays, as a sign of friction at rest, is handed back to the laws altogether.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from atwood.expr import Expression, InputGroup, OutputGroup, Program, live
from atwood.expr.core.algebra import build
from atwood.expr.core.relations import MotionRelations, Relation
from atwood.forms.caches import Key, Shared
from atwood.forms.other_values import MAXIMAL, REDUCED, REGULAR
from atwood.forms.program import state_groups
from atwood.forms.quantities import to_maximal
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Equations

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly


_WALLED: Key[frozenset[int] | None] = Key("relations of what moves that stay in the laws")
_SIDES: Key[Sides] = Key("relations of what moves, taken out")
_PROGRAM: Key[Program] = Key("differences of relations of what moves")

_WALLS = frozenset({"sqrt", "log", "pow", "asin", "acos"})
"""Operations that have no value beyond some value of what they are of."""


@dataclass(frozen=True, eq=False)
class Sides:
    """The relations of what moves in a scene that is run.

    Attributes
    ----------
    relations
        The relations, in terms of the coordinates of the form, each after those that it reads.
    handed
        Numbers of those that are evaluated where they stand, and are not looked for.
    shared
        What the scene shares with others whose relations are taken out alike.
    taken_out
        Takes the same relations out of expressions in coordinates of the form.
    """

    relations: tuple[Relation, ...]
    handed: frozenset[int]
    shared: Shared
    taken_out: Callable[[Sequence[Expression]], list[Expression]]

    @property
    def symbols(self) -> tuple[Expression, ...]:
        """What stands for the relations: parameters of all programs."""
        return tuple(one.symbol for one in self.relations)

    def program(self, assembly: Assembly) -> Program:
        """Return the program of (t, q, u, values of relations) with the differences, and how large their terms are."""
        return self.shared.get(_PROGRAM, lambda: self._program(assembly))

    def _program(self, assembly: Assembly) -> Program:
        symbols, parameters = self.symbols, assembly.parameters
        differences = tuple(one.difference for one in self.relations)
        terms = [one.arguments if one.operation in ("add", "sub") else (one,) for one in differences]
        sizes = [sum((build(a.graph, "absolute", (a,)) for a in some[1:]), abs(some[0])) for some in terms]
        groups = *state_groups(assembly.own_equations), InputGroup("sides", symbols)
        outputs = OutputGroup("differences", differences), OutputGroup("sizes", tuple(sizes))
        return Program("relations of what moves", groups, tuple(p for p in parameters if p not in symbols), outputs)


def has_sides(assembly: Assembly) -> bool:
    """Return whether laws of a scene compare what moves."""
    return _walls(assembly) is not None


def in_pieces(assembly: Assembly, handed: frozenset[int] = frozenset(), layered: bool = False) -> Assembly:
    """Return a scene whose relations of what moves are parameters; the scene itself if there are none."""
    walls = _walls(assembly)
    if walls is None:
        return assembly
    sides = assembly.shared.get(_SIDES, lambda: _make(assembly, handed | walls, handed, layered), handed, layered)
    return replace(assembly, shared=sides.shared, sides=sides, side_values=(0.0,) * len(sides.relations))


def guards(assembly: Assembly) -> list[tuple[int, Expression]]:
    """Return the numbers of the relations that are looked for, and what is positive as long as each keeps its value."""
    sides = assembly.sides
    found = () if sides is None else enumerate(sides.relations)
    return [(i, _guard(one)) for i, one in found if sides is not None and i not in sides.handed]


def _guard(one: Relation) -> Expression:
    value, difference = one.symbol, one.difference
    if one.kind == "floor":
        return (difference - value) * (value + 1.0 - difference)
    return difference * (value if one.kind == "sign" else 1.0 - 2.0 * value)


def _walls(assembly: Assembly) -> frozenset[int] | None:
    """Return the numbers of the relations that are looked for, but stay in the laws; None if there are none at all."""
    return assembly.shared.get(_WALLED, lambda: _find_walls(assembly))


def _find_walls(assembly: Assembly) -> frozenset[int] | None:
    own = assembly.own_equations
    if own.read:  # what reactions are solved for with compares, too, at each of its steps
        return None
    relations = MotionRelations(assembly.mechanism.relations, (*own.coordinates, *own.speeds))
    taken = _mapped(own, lambda values: relations.taken_out(values, {}))
    return frozenset(_behind_walls(relations.found, taken)) if relations.found else None


def _make(assembly: Assembly, left: frozenset[int], handed: frozenset[int], layered: bool) -> Sides:
    own = assembly.own_equations
    relations = MotionRelations(assembly.mechanism.relations, (*own.coordinates, *own.speeds), left, layered)
    shared = Shared(assembly.shared.family)
    shared.lock = assembly.shared.lock  # there is one graph
    made = _mapped(own, lambda values: relations.taken_out(values, {}))
    if assembly.form == "reduced":  # accelerations of trees are found from the bodies' own equations
        maximal = assembly.maximal
        symbols = (*maximal.coordinates, *maximal.speeds)
        places = dict(zip(symbols, to_maximal(assembly).results, strict=True))
        bodies = _mapped(maximal, lambda values: relations.taken_out(values, places))
        shared.get(REDUCED, lambda: made)
        shared.get(MAXIMAL, lambda: bodies)
    else:
        shared.get(REDUCED, lambda: assembly.reduced)
        shared.get(MAXIMAL, lambda: made)
    if assembly.regular is not assembly.reduced:
        shared.get(REGULAR, lambda: assembly.regular)
    found = tuple(relations.found)
    return Sides(found, handed, shared, lambda values: relations.taken_out(values, {}, is_closed=True))


def _mapped(equations: Equations, change: Callable[[list[Expression]], list[Expression]]) -> Equations:
    """Return equations whose motion is expressed otherwise; how places are computed stays as it is."""
    names = ("rates", "rows", "constraint_rows", "rows_with_multipliers", "rates_with_multipliers")
    kept = [one for one in equations.constraints if one.value is not None]
    values = [one for name in names for one in getattr(equations, name)]
    values += [*equations.read.values(), *(one.value for one in kept if one.value is not None)]
    values += [value for one in equations.constraints for value in (one.rate, one.second)]
    found = iter(change(values))
    changed: dict[str, Any] = {name: tuple(next(found) for _ in getattr(equations, name)) for name in names}
    read = {symbol: next(found) for symbol in equations.read}
    places = {one.key: next(found) for one in kept}
    constraints = tuple(
        replace(one, value=places.get(one.key), rate=next(found), second=next(found)) for one in equations.constraints
    )
    return replace(equations, **changed, read=read, constraints=constraints)


def _behind_walls(found: Sequence[Relation], equations: Equations) -> set[int]:
    """Return the numbers of the relations with whose value kept an expression could be without one further on."""
    nodes = live([*equations.rates, *equations.rows, *(one.second for one in equations.constraints)])
    number = {one.symbol: i for i, one in enumerate(found)}
    walls = {
        node
        for node in nodes
        if node.operation in _WALLS and not node.is_parametric and not _is_never_negative(node.arguments[0])
    }
    reading = [node for node in nodes if node.operation == "select" and not walls.isdisjoint(live(node.arguments[1:]))]
    read = live([*walls, *(node.arguments[0] for node in reading)])
    return {number[one] for one in read if one in number}


def _is_never_negative(node: Expression) -> bool:
    if node.operation == "constant":
        return bool(node.value >= 0.0)
    if node.operation == "add":
        return all(map(_is_never_negative, node.arguments))
    return node.operation in ("exp", "cosh", "sqrt") or (node.operation == "mul" and len(set(node.arguments)) == 1)
