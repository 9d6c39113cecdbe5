"""Loops as functions of the independent coordinates: branches of the formulas, and accelerations on them.

A branch is told by signs of roots and directions from which angles are counted. Positions follow from the formulas of
`atwood.forms.loops.assur_groups`, with sines and cosines of dependent angles as they come out there, so that no angle
is made of them and taken apart again. Speeds and accelerations follow from the rates of the constraints, group by
group: ``u_d = W u_i + w``, ``a_d = W a_i + c``. The balance of forces is projected with the same W (A. A. Shabana,
Dynamics of Multibody Systems, 4th edition, section 5.6, embedding technique).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import cached_property

from atwood.expr import (
    Expression,
    InputGroup,
    OutputGroup,
    Program,
    absolute,
    cos,
    depends_on,
    floor,
    jacobian,
    live,
    sign,
    sin,
    solve,
    substitute,
)
from atwood.forms.accelerations import AccelerationProgram
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Equations

_WHOLE = 1e-3
"""An angle that is not so near to the formula's but for whole turns is not on its branch."""


@dataclass(frozen=True, eq=False)
class Place:
    """Where formulas are compared with constraints, and where a run begins.

    Attributes
    ----------
    parameters
        Their values.
    here
        Time and coordinates of an admissible position.
    length
        The extent of the scene, m.
    """

    parameters: Mapping[Expression, float]
    here: Mapping[Expression, float]
    length: float

    @cached_property
    def known(self) -> Mapping[Expression, float]:
        """The values of parameters, and time and coordinates."""
        return {**self.parameters, **self.here}


@dataclass(frozen=True, eq=False)
class Heading:
    """A direction ``(p, q)``, from which an angle is counted so that it has no jumps.

    Where one can tell that it never turns away by a quarter from a sum of known angles and a phase, that is what it is
    counted from. Else it is counted from a phase alone, ahead of it or behind it, and whenever it turns away by a
    quarter, which is an event, from the other side.

    Attributes
    ----------
    phase
        The symbol of the phase.
    flip, offset
        Symbols of the side, 1 or -1, and of the half turns since the start; None where none are counted.
    ahead, beside
        Then the components along the phase and across it.
    values
        What its symbols are at a position, in terms of parameters, time and coordinates.
    lead
        By how much one wave is larger than all others together: positive where the direction cannot turn away. None
        where that is counted.
    most
        The longest that the direction can be; None where that is not known.
    """

    phase: Expression
    flip: Expression | None = None
    offset: Expression | None = None
    ahead: Expression | None = None
    beside: Expression | None = None
    values: Mapping[Expression, Expression] = field(default_factory=dict)
    lead: Expression | None = None
    most: Expression | None = None

    @property
    def symbols(self) -> tuple[Expression, ...]:
        """Its symbols."""
        return tuple(one for one in (self.phase, self.flip, self.offset) if one is not None)

    def with_places(self, moved: Callable[[Expression], Expression]) -> Heading:
        """Return the same with other expressions for what depends on coordinates."""
        ahead, beside = (None if one is None else moved(one) for one in (self.ahead, self.beside))
        return replace(
            self, ahead=ahead, beside=beside, values={symbol: moved(one) for symbol, one in self.values.items()}
        )


@dataclass(frozen=True, eq=False)
class Group:
    """One constraint with one unknown coordinate, or the constraints of a joint with two.

    Attributes
    ----------
    unknowns
        Numbers of the coordinates that it gives.
    constraints
        Numbers of its constraints.
    along
        For each equation for the speeds of the unknowns, by what to multiply the constraints.
    places
        Each unknown, and its sine and cosine if it is an angle, in terms of what was known before.
    margins
        The square of the sine of the angle between two links or a link and a slide; 0 at a dead centre.
    signs
        Symbols of the signs of roots, and what has the sign in terms of all coordinates.
    turns
        Symbols of whole turns, and what they are.
    headings
        Directions that unknown angles are counted from.
    """

    unknowns: tuple[int, ...]
    constraints: tuple[int, ...]
    along: tuple[tuple[Expression, ...], ...]
    places: Mapping[Expression, Expression]
    margins: tuple[Expression, ...] = ()
    signs: Mapping[Expression, Expression] | None = None
    turns: Mapping[Expression, Expression] | None = None
    headings: tuple[Heading, ...] = ()


@dataclass(frozen=True, eq=False)
class ClosedLoops:
    """The dependent coordinates of a mechanism as functions of the independent ones.

    Attributes
    ----------
    independent
        Numbers of the independent coordinates.
    speeds
        Numbers of the independent speeds.
    own_speeds
        The number of the speed that is the rate of a coordinate, for all that have such.
    groups
        What is solved, one after the other.
    """

    independent: tuple[int, ...]
    speeds: tuple[int, ...]
    own_speeds: Mapping[int, int]
    groups: tuple[Group, ...]

    @property
    def rates_are_speeds(self) -> bool:
        """Whether the rate of every independent coordinate is the speed of the same number."""
        return tuple(self.own_speeds.get(i) for i in self.independent) == self.speeds

    @property
    def places(self) -> dict[Expression, Expression]:
        """All dependent coordinates, and their sines and cosines, in terms of independent coordinates and branches."""
        found: dict[Expression, Expression] = {}
        for group in self.groups:
            found.update(zip(group.places, self._known(list(group.places.values()), found), strict=True))
        return found

    @staticmethod
    def _known(values: list[Expression], found: Mapping[Expression, Expression]) -> list[Expression]:
        return substitute(values, found) if found else values

    @property
    def branches(self) -> tuple[Expression, ...]:
        """Symbols of the signs, phases and turns that tell positions apart: parameters of every program."""
        every = ((*(g.signs or ()), *(s for h in g.headings for s in h.symbols), *(g.turns or ())) for g in self.groups)
        return tuple(itertools.chain.from_iterable(every))

    @property
    def margins(self) -> list[Expression]:
        """How far each group is from its dead centres."""
        return [one for group in self.groups for one in group.margins]

    @property
    def counted(self) -> list[Heading]:
        """The directions whose half turns are counted."""
        return [one for group in self.groups for one in group.headings if one.flip is not None]

    def values(self) -> tuple[list[Expression], list[Expression]]:
        """Return the values of the branches at an admissible position, and what must be positive there.

        All in terms of parameters, time and coordinates. Where something is not positive, formulas do not lead there.
        """
        found: dict[Expression, Expression] = {}
        conditions: list[Expression] = []
        for group in self.groups:
            found.update((symbol, sign(value)) for symbol, value in (group.signs or {}).items())
            for heading in group.headings:
                found.update(heading.values)
                conditions += () if heading.lead is None else (heading.lead,)
        for group in self.groups:
            for symbol, value in (group.turns or {}).items():
                turns = substitute([value], found)[0] / math.tau
                whole = floor(turns + 0.5)
                conditions.append(_WHOLE - absolute(turns - whole))
                found[symbol] = math.tau * whole
        return [found[symbol] for symbol in self.branches], conditions


Matrix = dict[tuple[int, int], Expression]


@dataclass(frozen=True, eq=False)
class ClosedForm:
    """A mechanism with loops in terms of independent coordinates alone; branches are parameters after all others.

    Attributes
    ----------
    loops
        What the dependent coordinates are.
    accelerations
        Program of (t, q_i, u_i) with the accelerations of the independent coordinates.
    states
        Program of (t, q_i, u_i) with all coordinates and all speeds.
    known
        All coordinates and speeds, in terms of the independent ones.
    watched
        Program of (t, q_i, u_i) with the distances from dead centres and then the components of counted directions
        ahead, which must not pass zero; and with the components of the latter across.
    branches
        Program of (t, q) with the values of the branches at an admissible position, and with conditions that must be
        positive there.
    """

    loops: ClosedLoops
    accelerations: AccelerationProgram
    states: Program
    known: Mapping[Expression, Expression]
    watched: Program
    branches: Program


def closed_form(
    name: str,
    equations: Equations,
    parameters: Sequence[Expression],
    loops: ClosedLoops,
    rows: Sequence[Expression] | None = None,
) -> ClosedForm | None:
    """Return the programs of a mechanism whose loops are solved by formulas.

    None where a dependent coordinate is read otherwise than by its sine and cosine, as by a law in a sum with another
    angle that is not one of the mechanism.
    """
    free, moving = dict.fromkeys(loops.independent), dict.fromkeys(loops.speeds)
    moved = _Moved(equations, loops)
    q, u = equations.coordinates, equations.speeds
    places = loops.places
    speeds = {u[d]: moved.speed(d) for d in moved.order}
    found = _accelerations(equations, _with_single_angles(list(equations.rows if rows is None else rows)), moved)
    rates = [] if loops.rates_are_speeds else [equations.rates[i] for i in free]
    found, speeds = _with_formulas([*rates, *found], speeds, places)
    inputs = (
        InputGroup("t", (equations.time,)),
        InputGroup("q", tuple(q[i] for i in free)),
        InputGroup("u", tuple(u[i] for i in moving)),
    )
    known = tuple(parameters) + loops.branches
    states = (
        OutputGroup("coordinates", tuple(places.get(one, one) for one in q)),
        OutputGroup("speeds", tuple(speeds.get(one, one) for one in u)),
    )
    counted = loops.counted
    beside = [one.beside for one in counted if one.beside is not None]
    looked_at = [*loops.margins, *(one.ahead for one in counted if one.ahead is not None), *beside]
    looked_at = substitute(looked_at, places) if places and looked_at else looked_at
    cut = len(looked_at) - len(beside)
    watched = OutputGroup("ahead", tuple(looked_at[:cut])), OutputGroup("beside", tuple(looked_at[cut:]))
    dependent = [
        *(one for i, one in enumerate(q) if i not in free),
        *(one for i, one in enumerate(u) if i not in moving),
    ]
    if depends_on((*found, *places.values(), *speeds.values(), *looked_at), dependent):
        return None
    title = f"{name} (closed form)"
    values, conditions = loops.values()
    branches = Program(
        f"{title} branches",
        (inputs[0], InputGroup("q", q)),
        tuple(parameters),
        (OutputGroup("branches", tuple(values)), OutputGroup("conditions", tuple(conditions))),
    )
    outputs = (OutputGroup("rates", tuple(found[: len(rates)])),) if rates else ()
    outputs = (*outputs, OutputGroup("accelerations", tuple(found[len(rates) :])))
    accelerations = Program(f"{title} accelerations", inputs, known, outputs)
    return ClosedForm(
        loops,
        AccelerationProgram(accelerations, "mass matrix"),
        Program(f"{title} states", inputs, known, states),
        {**places, **speeds},
        Program(f"{title} dead centres", inputs, known, watched),
        branches,
    )


def in_terms_of_independent(form: ClosedForm, values: Sequence[Expression]) -> list[Expression]:
    """Return functions of all coordinates and speeds as functions of the independent ones."""
    return substitute(_with_single_angles(list(values)), form.known)


def _with_formulas(
    found: Sequence[Expression], speeds: Mapping[Expression, Expression], places: Mapping[Expression, Expression]
) -> tuple[list[Expression], dict[Expression, Expression]]:
    """Replace dependent speeds, and then dependent coordinates with their sines and cosines."""
    if not speeds:
        return list(found), {}
    made = substitute([*substitute(list(found), speeds), *speeds.values()], places)
    return made[: len(found)], dict(zip(speeds, made[len(found) :], strict=True))


def _with_single_angles(rows: list[Expression]) -> list[Expression]:
    """Return rows with sines and cosines of sums of coordinates as products of those of one coordinate."""
    waves = [node for node in live(rows) if node.operation in ("sin", "cos") and not node.is_parametric]
    parts = {node: _parts(node.arguments[0]) for node in waves}
    split = {node: found for node, found in parts.items() if found is not None}
    return substitute(rows, {n: found[n.operation == "sin"] for n, found in split.items()}) if split else rows


def _parts(angle: Expression) -> tuple[Expression, Expression] | None:
    """Return cosine and sine of a sum of coordinates by those of one; None for one coordinate, and other angles."""
    if angle.operation == "neg":
        found = _wave(angle.arguments[0])
        return None if found is None else (found[0], -found[1])
    if angle.operation not in ("add", "sub"):
        return None
    one, other = (_wave(argument) for argument in angle.arguments)
    if one is None or other is None:
        return None
    (c, s), (d, e) = one, other
    e = e if angle.operation == "add" else -e
    return c * d - s * e, s * d + c * e


def _wave(angle: Expression) -> tuple[Expression, Expression] | None:
    return (cos(angle), sin(angle)) if angle.is_symbol else _parts(angle)


class _Moved:
    """How dependent coordinates move with independent ones: ``u_d = W u_i + w``, ``a_d = W a_i + c``."""

    def __init__(self, equations: Equations, loops: ClosedLoops) -> None:
        self.graph, self.free, self.own = equations.graph, loops.speeds, loops.own_speeds
        self.speeds = equations.speeds
        one = self.graph.one
        self.weights: Matrix = {(i, k): one for k, i in enumerate(self.free)}
        self.bias: dict[int, Expression] = {}
        self.shift: dict[int, Expression] = {}
        self.order: list[int] = []
        used = sorted({k for group in loops.groups for k in group.constraints})
        chosen = [equations.constraints[k] for k in used]
        found = jacobian([one.rate for one in chosen], list(equations.speeds))
        self.slopes: dict[int, dict[int, Expression]] = {k: {} for k in used}
        for r, c, entry in found.triples:
            self.slopes[used[r]][c] = entry
        self.place = {c: i for i, c in enumerate(self.free)}  # of a speed, among those that are known
        rates = substitute([one.rate for one in chosen], dict.fromkeys(equations.speeds, 0.0))
        seconds = substitute([one.second for one in chosen], dict.fromkeys(equations.accelerations, 0.0))
        self.explicit = dict(zip(used, rates, strict=True))
        self.gamma = dict(zip(used, seconds, strict=True))
        for group in loops.groups:
            self._add(group)

    def _add(self, group: Group) -> None:
        """Solve the rates of a group for the speeds of its unknowns."""
        unknowns = tuple(self.own[number] for number in group.unknowns)
        matrix = [[self._slope(group, row, c) for c in unknowns] for row in group.along]
        for k in range(len(self.free)):
            right = [-self._along(group, row, k) for row in group.along]
            for unknown, weight in zip(unknowns, _cramer(matrix, right), strict=True):
                if not weight.is_zero:
                    self.weights[unknown, k] = weight
        for target, start in ((self.shift, self.explicit), (self.bias, self.gamma)):
            right = [-self._rest(group, row, start, target) for row in group.along]
            found = _cramer(matrix, right)
            target.update((c, one) for c, one in zip(unknowns, found, strict=True) if not one.is_zero)
        self.order += unknowns
        for c in unknowns:
            self.place[c] = len(self.place)

    def _reads(self, group: Group) -> list[int]:
        """Return the known speeds that the constraints of a group read, in the order in which they became known."""
        found = {c for k in group.constraints for c in self.slopes[k] if c in self.place}
        return sorted(found, key=self.place.__getitem__)

    def _slope(self, group: Group, row: Sequence[Expression], column: int) -> Expression:
        total = self.graph.zero
        for factor, k in zip(row, group.constraints, strict=True):
            if column in self.slopes[k]:
                total = total + factor * self.slopes[k][column]
        return total

    def _along(self, group: Group, row: Sequence[Expression], k: int) -> Expression:
        """Return the rate of an equation for a unit of an independent speed, with what is known to follow it."""
        total = self.graph.zero
        for c in self._reads(group):
            if (c, k) in self.weights:
                total = total + self._slope(group, row, c) * self.weights[c, k]
        return total

    def _rest(
        self,
        group: Group,
        row: Sequence[Expression],
        start: Mapping[int, Expression],
        known: Mapping[int, Expression],
    ) -> Expression:
        """Return what an equation has besides: of its own, and by what was found before."""
        total = self.graph.zero
        for factor, k in zip(row, group.constraints, strict=True):
            total = total + factor * start[k]
        for c in self._reads(group):
            if c in known:
                total = total + self._slope(group, row, c) * known[c]
        return total

    def speed(self, d: int) -> Expression:
        """Return a dependent speed, in terms of all coordinates and the independent speeds."""
        total = self.shift.get(d, self.graph.zero)
        for k, i in enumerate(self.free):
            if (d, k) in self.weights:
                total = total + self.weights[d, k] * self.speeds[i]
        return total


def _cramer(matrix: Sequence[Sequence[Expression]], right: Sequence[Expression]) -> list[Expression]:
    """Solve one or two equations."""
    if all(one.is_zero for one in right):
        return list(right)
    if len(right) == 1:
        return [right[0] / matrix[0][0]]
    (a, b), (c, d) = matrix
    over = 1.0 / (a * d - b * c)
    return [(d * right[0] - b * right[1]) * over, (a * right[1] - c * right[0]) * over]


def _accelerations(equations: Equations, rows: list[Expression], moved: _Moved) -> list[Expression]:
    """Return the accelerations of the independent coordinates from ``W^T (M (W a + c) + bias) = 0``."""
    graph, n = equations.graph, len(moved.free)
    if not n:
        return []
    found = jacobian(rows, list(equations.accelerations))
    right = substitute(rows, dict.fromkeys(equations.accelerations, 0.0))
    pushed: Matrix = {}
    for r, c, entry in found.triples:
        for k in range(n):
            if (c, k) in moved.weights:
                pushed[r, k] = pushed.get((r, k), graph.zero) + entry * moved.weights[c, k]
        if c in moved.bias:
            right[r] = right[r] + entry * moved.bias[c]
    mass = [[graph.zero] * n for _ in range(n)]
    force = [graph.zero] * n
    for (r, j), weight in moved.weights.items():
        force[j] = force[j] - weight * right[r]
        for k in range(j, n):
            if (r, k) in pushed:
                mass[j][k] = mass[j][k] + weight * pushed[r, k]
    for j in range(n):
        for k in range(j):
            mass[j][k] = mass[k][j]
    return [graph.convert(one) for one in solve(mass, force)]
