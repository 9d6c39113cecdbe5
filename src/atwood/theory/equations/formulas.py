"""The formulas of a scene's equations of motion, made when they are asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Literal

from atwood.errors import UnsupportedError
from atwood.expr import Expression, SparseMatrix, count_operations, substitute
from atwood.expr.core import algebra
from atwood.expr.core.relations import Relation
from atwood.expr.simplify.polynomial import TooLargeError
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Lagrangian
from atwood.late import dataclass
from atwood.theory.equations.structure import Structure, structure_of
from atwood.theory.formulas.book import Book
from atwood.theory.formulas.notation import Notation
from atwood.theory.formulas.tree import Name, Sum, Symbol

__all__ = ["EquationFormulas", "Parameters", "Written"]

_READABLE_COORDINATES, _READABLE_OPERATIONS = 12, 2_500
"""Beyond either nobody reads equations: their structure is shown."""

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
    """

    assembly: Assembly
    expressions: Lagrangian
    notation: Notation
    parameters: Parameters = "symbolic"

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

    @property
    def is_readable(self) -> bool:
        """Whether somebody would read these equations; else `structure` says what there is to see."""
        return len(self.expressions.coordinates) <= _READABLE_COORDINATES and self._operations <= _READABLE_OPERATIONS

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
        return Book(
            names,
            tuple(angles),
            self.assembly.parameters,
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
        return substitute(list(values), self._meanings) if values and self._meanings else list(values)

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
        found = self.expressions
        linear = found.lagrangian - found.kinetic + found.potential
        return Written(
            kinetic=self.formula(found.kinetic, energy=True),
            potential=self.formula(found.potential, energy=True),
            linear=self.formula(linear, energy=True),
            rayleigh=self.formula(found.rayleigh, energy=True),
            momenta=self.formulas(found.momenta),
            forces=self.formulas(found.forces),
            velocity_terms=self.formulas(found.velocity_terms),
            rows=self.formulas(self.residuals),
            constraints=tuple(
                self.formula(one.rate if one.value is None else one.value, energy=True) for one in found.constraints
            ),
            rates=self.formulas(found.rates),
        )

    @property
    def residuals(self) -> tuple[Expression, ...]:
        """The equations of motion as expressions, forces of constraints included."""
        found = self.expressions
        return tuple(row - held for row, held in zip(found.rows, found.constraint_rows, strict=True))

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
