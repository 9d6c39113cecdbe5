"""The formulas of a scene's equations of motion, made when they are asked for, with closed loops in closed form.

In closed loops an unknown that is linear is solved for; an angle in ``A cos + B sin + C = 0`` is ``atan2(B, A) +-
acos(-C/sqrt(A^2 + B^2))``; of two angles in two equations that are linear in the sine and cosine of one, these are
solved for, and their squares, whose sum is one, leave an equation in the other (as Freudenstein's of the four-bar
linkage).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from itertools import combinations
from typing import Literal

from atwood.errors import UnsupportedError
from atwood.expr import Expression, SparseMatrix, count_operations, depends_on, live, substitute, vjp
from atwood.expr.core import algebra
from atwood.expr.core.relations import Relation
from atwood.expr.simplify.polynomial import TooLargeError
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Contribution, Lagrangian, rows_by_part
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.equations.euler_angles import middle_angles, with_one_sign
from atwood.theory.equations.pages import Structure, structure_of
from atwood.theory.equations.solved import quantity_of, solved_for
from atwood.theory.formulas.book import Book
from atwood.theory.formulas.notation import Notation, momentum_symbol, with_momenta
from atwood.theory.formulas.page import Line, line_for
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.tree import Name, Sum, Symbol, cost, fraction

_READABLE_COORDINATES, _READABLE_OPERATIONS = 12, 2_500
"""Beyond either nobody reads equations: their structure is shown."""

_WRITTEN_OUT = 1e7
"""Terms and factors of formulas, with what they share written each time: choices within choices double it."""

_WRITABLE = 5_000
"""Beyond so many operations no formulas are made at all."""

Parameters = Literal["symbolic", "values"]


@dataclass(frozen=True, eq=False)
class EquationFormulas:
    """The equations of motion of a scene as formulas.

    Attributes
    ----------
    assembly
        The scene.
    expressions
        The same as expressions of the graph.
    notation
        What stands for what.
    parameters
        ``"symbolic"`` or ``"values"``.
    by_part
        Whether pages say of each term which parts it comes from.
    is_solved, paths
        Whether pages have the accelerations, and which quantities.
    """

    assembly: Assembly
    expressions: Lagrangian
    notation: Notation
    parameters: Parameters = "symbolic"
    by_part: bool = False
    is_solved: bool = False
    paths: tuple[str, ...] = ()

    # -- as formulas --------------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """What the scene is called."""
        return self.assembly.flat.name

    @property
    def form(self) -> str:
        """``"reduced"`` or ``"dae"``."""
        return self.assembly.form

    @property
    def legend(self) -> tuple[Symbol, ...]:
        """The symbols in order, each with letter, path, unit, meaning and value; see `symbol`."""
        every = self.notation.legend
        return every if self.parameters == "symbolic" else tuple(one for one in every if one.kind != "parameter")

    @cached_property
    def is_readable(self) -> bool:
        """Whether somebody would read these equations; else `structure` says what there is to see."""
        if len(self.expressions.coordinates) > _READABLE_COORDINATES or self._operations > _READABLE_OPERATIONS:
            return False
        rows, sizes = self.expressions.rows, dict[int, float]()  # with all that is shared written each time anew
        for node in live(list(rows)):
            sizes[node.index] = 1.0 + sum(sizes[one.index] for one in node.arguments)
        return sum(sizes[one.index] for one in rows if one.index in sizes) <= _WRITTEN_OUT

    @cached_property
    def _operations(self) -> int:
        return sum(count_operations(list(self.expressions.rows), self.assembly.parameters).values())

    @cached_property
    def structure(self) -> Structure:
        """How many unknowns, equations and operations there are, and which depends on which."""
        return structure_of(self.assembly, self.expressions, self._operations)

    @cached_property
    def book(self) -> Book:
        """What writes the formulas."""
        found, notation = self.expressions, self.notation
        names = {expression: Name(symbol) for expression, symbol in notation.symbols.items()}
        names |= {expression: Name(symbol, dots) for expression, (symbol, dots) in notation.velocities.items()}
        angles = [q for q, name in zip(found.coordinates, found.names, strict=True) if name.unit == "rad"]
        orientations = [one for one in found.equations.orientation_coordinates if one.kind == "quaternion"]
        own = (expression for expression, symbol in notation.symbols.items() if symbol.kind == "parameter")
        return Book(
            names,
            tuple(angles),
            tuple(dict.fromkeys((*self.assembly.parameters, *own))),
            self.parameters == "symbolic",
            [[found.coordinates[i] for i in one.coordinates] for one in orientations],
        )

    @cached_property
    def _meanings(self) -> dict[Expression, Expression | float]:
        """What is put in place of symbols: equal moments, relations of time, and perhaps the values of parameters."""
        known: dict[Expression, Expression | float] = dict(self.notation.merged)
        if self.parameters == "values":
            known |= self.assembly.mechanism.table.values
        for one in self.assembly.relations:
            known[one.symbol] = substitute([_as_condition(one)], known)[0]
        return known

    def _plain(self, values: Sequence[Expression]) -> list[Expression]:
        found = substitute(list(values), self._meanings) if values and self._meanings else list(values)
        for angle, is_sine in self._middle_angles if found else ():
            found = with_one_sign(found, angle, is_sine, self.book.angles, self.book.parameters)
        return found

    @cached_property
    def sign_said(self) -> str:
        """Where the formulas hold, in words, where roots of squares of sines are written as these."""
        roots = [one for one in live([self.expressions.potential, *self._balance]) if one.operation == "sqrt"]
        waves = [(self.notation.symbols[q].name, "sin" if s else "cos") for q, s in self._middle_angles if roots]
        return "; ".join(
            f"{wave} {name} is positive: where it is zero, Euler angles are singular" for name, wave in waves
        )

    @cached_property
    def _middle_angles(self) -> list[tuple[Expression, bool]]:
        return middle_angles(self.expressions)

    def formula(self, value: Expression, shares: Mapping[str, Expression] | None = None, energy: bool = False) -> Sum:
        """Return an expression as a formula: the shortest, or as it is computed where that is too long.

        Parameters
        ----------
        value
            The expression.
        shares
            What it is the sum of, by part: each term then says from which parts it comes.
        energy
            Whether terms with one coefficient are put together, and squares of sums may stay.
        """
        whole, *parts = self._plain([value, *(shares or {}).values()])
        try:
            if self.is_readable:
                return self.book.write(whole, dict(zip(shares or {}, parts, strict=True)), energy)
        except TooLargeError:
            pass
        return self._as_computed([whole])[0]

    def formulas(self, values: Sequence[Expression]) -> tuple[Sum, ...]:
        """Return several expressions as formulas."""
        if self.is_readable:
            return tuple(map(self.formula, values))
        return tuple(self._as_computed(self._plain(values))) if values else ()

    def _as_computed(self, values: Sequence[Expression]) -> list[Sum]:
        if self._operations > _WRITABLE:
            raise UnsupportedError(
                f"its equations take {self._operations} operations and would fill a book",
                where=self.name,
                advice="`structure` shows what they are like, and atwood.dynamics has them as functions of numbers.",
            )
        return self.book.write_plainly(values)

    @cached_property
    def written(self) -> Written:
        """The formulas."""
        return self._write(())

    @cached_property
    def written_by_part(self) -> Written:
        """The formulas with the parts that each term comes from: where their own terms are proven to be its sum."""
        return self._write(self.expressions.parts)

    def _write(self, parts: Sequence[Contribution]) -> Written:
        """Return the formulas; with parts, each term with those that it comes from."""
        found = self.expressions

        def whole(total: Expression, own: Callable[[Contribution], Expression]) -> Sum:
            return self._parted(total, {one.path: own(one) for one in parts}, True)

        def each(values: Sequence[Expression], own: Mapping[str, Sequence[Expression]]) -> tuple[Sum, ...]:
            if not own:
                return self.formulas(values)
            shares = ({path: several[k] for path, several in own.items()} for k in range(len(values)))
            return tuple(map(self._parted, values, shares))

        seed = [found.graph.one]
        held = [(one.key[0], one.rate if one.value is None else one.value) for one in found.constraints]
        return Written(
            kinetic=whole(found.kinetic, lambda one: one.kinetic),
            potential=whole(found.potential, lambda one: one.potential),
            linear=whole(found.lagrangian - found.kinetic + found.potential, _linear_terms),
            rayleigh=whole(found.rayleigh, lambda one: one.rayleigh),
            momenta=each(found.momenta, {one.path: vjp([one.lagrangian], seed, [*found.velocities]) for one in parts}),
            forces=each(found.forces, {one.path: one.forces for one in parts}),
            velocity_terms=self.written.velocity_terms if parts else self.formulas(found.velocity_terms),
            rows=each(self.residuals, rows_by_part(found) if parts else {}),
            constraints=tuple(self._parted(value, {path: value} if parts else {}, True) for path, value in held),
            rates=self.written.rates if parts else self.formulas(found.rates),
        )

    def _parted(self, total: Expression, own: Mapping[str, Expression], energy: bool = False) -> Sum:
        """Return a formula with the parts of each term, where what these have is proven to add up to it."""
        graph = self.expressions.graph
        is_sum = own and self.is_readable and not self.formula(total - sum(own.values(), graph.zero)).terms
        return self.formula(total, own if is_sum else None, energy)

    @cached_property
    def momenta_shown(self) -> tuple[Sum, ...]:
        """The momenta as a page shows them: in terms of each other where that is shorter, as ``p_psi`` in ``p_phi``."""
        found, shown = self.expressions, list(self.written.momenta)
        if self.by_part:
            return self.written_by_part.momenta
        if not self.is_readable or found.has_angular_velocities or found.is_restricted:
            return tuple(shown)
        other = EquationFormulas(self.assembly, found, with_momenta(self.notation, found), self.parameters)
        values, changed = self._plain(found.momenta), set[int]()
        for j, (rate, value) in enumerate(zip(found.velocities, values, strict=True)):
            slope = vjp([value], [found.graph.one], [rate])[0]
            if j in changed or not slope.is_parametric or slope.is_zero or len(shown[j].terms) < _SUM:
                continue
            given = (momentum_symbol(found, j) - substitute([value], {rate: 0.0})[0]) / slope
            for i, one in enumerate(values):
                if i != j and depends_on(one, [rate]):
                    made = other.formula(substitute([one], {rate: given})[0])
                    if cost(made) < cost(shown[i]):
                        shown[i] = made
                        changed |= {i, j}
        return tuple(shown)

    @cached_property
    def lines_solved(self) -> tuple[Line, ...]:
        """The accelerations and the multipliers as functions of the state."""
        self._refuse_what_nobody_reads()
        found, notation = self.expressions, self.notation
        names = [Name(*notation.velocities[one]) for one in found.accelerations]
        names += [Name(notation.symbols[one.multiplier]) for one in found.constraints]
        values = [fraction(*self.formulas(pair)) for pair in solved_for(self)]
        if any(cost(one) > _LONGEST_FRACTION for one in values):
            raise UnsupportedError(
                "its accelerations would fill a page",
                where=self.name,
                advice="The equations of motion are shorter, and atwood.dynamics solves them in numbers.",
            )
        return tuple(line_for(name, one) for name, one in zip(names, values, strict=True))

    def _refuse_what_nobody_reads(self) -> None:
        if not self.is_readable:
            raise UnsupportedError(
                "its equations are too many to be solved and read",
                where=self.name,
                advice="atwood.dynamics solves them in numbers, and atwood.simulate gives its quantities.",
            )

    def written_quantity(self, path: str) -> Sum:
        """Return a quantity of a part as a formula; see `quantity_of`."""
        self._refuse_what_nobody_reads()
        total, shares = quantity_of(self, path)
        return self._parted(total, shares)

    @cached_property
    def residuals(self) -> tuple[Expression, ...]:
        """The equations of motion as expressions, forces of constraints included."""
        return tuple(self._plain(self._balance))

    @cached_property
    def _balance(self) -> list[Expression]:
        found = self.expressions
        return [row - held for row, held in zip(found.rows, found.constraint_rows, strict=True)]

    def _matrix(self, matrix: SparseMatrix, shape: tuple[int, int]) -> tuple[tuple[Sum, ...], ...]:
        entries = [[Sum(())] * shape[1] for _ in range(shape[0])]
        for row, column, entry in zip(matrix.rows, matrix.columns, self.formulas(matrix.entries), strict=True):
            entries[row][column] = entry
        return tuple(tuple(row) for row in entries)

    @cached_property
    def mass(self) -> tuple[tuple[Sum, ...], ...]:
        """The mass matrix as formulas."""
        n = len(self.expressions.velocities)
        return self._matrix(self.expressions.mass_matrix, (n, n))

    @cached_property
    def slopes(self) -> tuple[tuple[Sum, ...], ...]:
        """The constraint Jacobian as formulas."""
        found = self.expressions
        return self._matrix(found.constraint_jacobian, (len(found.constraints), len(found.velocities)))


_LONGEST_FRACTION = 250
"""Signs and symbols of an acceleration beyond which none are written down."""


def _linear_terms(part: Contribution) -> Expression:
    """Return what a part adds to L besides T - V."""
    return part.lagrangian - part.kinetic + part.potential


_SUM = 2
"""A momentum of fewer terms is no shorter than what it stands for."""


@dataclass(frozen=True)
class Written:
    """The formulas of a scene."""

    kinetic: Sum
    potential: Sum
    linear: Sum
    rayleigh: Sum
    momenta: tuple[Sum, ...]
    forces: tuple[Sum, ...]
    velocity_terms: tuple[Sum, ...]
    rows: tuple[Sum, ...]
    constraints: tuple[Sum, ...]
    rates: tuple[Sum, ...]


def _as_condition(one: Relation) -> Expression:
    """Return what a relation of time says, for people to read."""
    zero = one.difference.graph.zero
    if one.kind in ("less", "less_equal"):
        return one.difference.graph.node(one.kind, (one.difference, zero))
    return one.difference if one.kind == "nonzero" else algebra.unary(one.kind, one.difference)


_LONGEST = 250
"""Equations of more operations are not looked at: nobody would solve them by hand."""


def solve_closures(equations: Sequence[Sympy], unknowns: Sequence[Sympy]) -> list[dict[Sympy, Sympy]] | None:
    """Return the solutions of closed loops, one for each way in which they can be put together."""
    if not unknowns:
        return [{}] if not equations else None
    for size, solve in ((1, _alone), (2, _pair)):
        for chosen in combinations(equations, size):
            inside = [one for one in unknowns if any(equation.has(one) for equation in chosen)]
            if len(inside) == size:
                found = solve(chosen, inside)
                if found is not None:
                    rest = [one for one in equations if one not in chosen]
                    return _with_rest(found, rest, [one for one in unknowns if one not in inside])
    return None


def _with_rest(
    ways: Sequence[dict[Sympy, Sympy]], rest: Sequence[Sympy], others: Sequence[Sympy]
) -> list[dict[Sympy, Sympy]] | None:
    """Return the solutions of what is left for each way of putting together what was solved."""
    inner = solve_closures(rest, others)  # in terms of what was solved, whichever way
    if inner is None:
        return None
    return [{**way, **{k: v.xreplace(way) for k, v in one.items()}} for way in ways for one in inner]


def _alone(equations: Sequence[Sympy], unknowns: Sequence[Sympy]) -> list[dict[Sympy, Sympy]] | None:
    """Return the solutions of one equation in one unknown."""
    (equation,), (unknown,) = equations, unknowns
    values = _values(equation, unknown)
    return None if values is None else [{unknown: one} for one in values]


def _values(equation: Sympy, unknown: Sympy) -> list[Sympy] | None:
    """Return the values of the only unknown of an equation."""
    parts = _linear(equation, unknown)
    if parts is not None:
        a, b, c = parts
        if a == 0 and b == 0:
            return None
        turn, reach = sympy.atan2(b, a), sympy.acos(-c / sympy.sqrt(a**2 + b**2))
        return [turn + reach, turn - reach]
    slope = sympy.diff(equation, unknown)
    if slope.has(unknown) or slope == 0:
        return None
    return [sympy.expand(-equation.subs(unknown, 0) / slope)]


def _linear(equation: Sympy, angle: Sympy) -> tuple[Sympy, Sympy, Sympy] | None:
    """Return A, B and C of ``A cos + B sin + C``, if an equation is that in an angle."""
    if equation.count_ops() > _LONGEST:
        return None
    c, s = sympy.Dummy("c"), sympy.Dummy("s")
    written = sympy.expand(sympy.expand_trig(equation)).subs({sympy.cos(angle): c, sympy.sin(angle): s})
    written = sympy.expand(sympy.expand(written).subs(s**2, 1 - c**2))
    if written.has(angle) or not written.has(c, s):
        return None
    a, b = written.diff(c), written.diff(s)
    if a.has(c, s) or b.has(c, s):
        return None
    return a, b, sympy.expand(written - a * c - b * s)


def _pair(equations: Sequence[Sympy], unknowns: Sequence[Sympy]) -> list[dict[Sympy, Sympy]] | None:
    """Return the solutions of two equations in two unknowns."""
    for angle, other in (tuple(unknowns), tuple(unknowns)[::-1]):
        parts = [_linear(one, angle) for one in equations]
        if parts[0] is None or parts[1] is None:
            continue
        (a1, b1, c1), (a2, b2, c2) = parts[0], parts[1]
        measure = sympy.expand(a1 * b2 - a2 * b1)
        if measure == 0 or measure.has(other):
            continue
        cosine, sine = (b1 * c2 - b2 * c1) / measure, (a2 * c1 - a1 * c2) / measure
        closing = sympy.expand((b1 * c2 - b2 * c1) ** 2 + (a2 * c1 - a1 * c2) ** 2 - measure**2)
        values = _values(closing, other)
        if values is not None:
            return [{other: one, angle: sympy.atan2(sine, cosine).subs(other, one)} for one in values]
    return None
