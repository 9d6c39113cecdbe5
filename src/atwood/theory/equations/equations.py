"""The equations of motion of a scene for people to read: sympy objects, LaTeX, Markdown, plain text and Python code.

The equations of motion of a scene, to be read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

from atwood.arguments import FLAG, one_of, optional, takes
from atwood.errors import UnsupportedError, UsageError, suggestion
from atwood.expr import Expression, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import lagrangian_of, rows_by_part, with_signs
from atwood.lazy_dataclasses import dataclass, replace
from atwood.lazy_modules import sympy
from atwood.model.compose.composite import Model
from atwood.model.declare.connectors import PATHS
from atwood.model.values.letters import SIGNED_LETTERS
from atwood.pipeline import SCENE, assembly_of
from atwood.simulation.contacts.chosen import CONTACTS, in_named_set
from atwood.simulation.problem.arguments import FORM, ORIENTATION
from atwood.theory.equations.formulas import EquationFormulas, Parameters, solve_closures
from atwood.theory.equations.pages import (
    Structure,
    as_data,
    asked_sections,
    equation_lines,
    module_of,
    page_of_equations,
)
from atwood.theory.equations.stated import GAUGE, with_gauge
from atwood.theory.formulas import page
from atwood.theory.formulas.described import Page, Paged
from atwood.theory.formulas.notation import notation_of
from atwood.theory.formulas.page import Line, Section
from atwood.theory.formulas.printers import Sympy, objects
from atwood.theory.formulas.tree import Sum


def read_equations(
    assembly: Assembly,
    parameters: Parameters = "symbolic",
    symbols: Mapping[str, str] | None = None,
    gauge: Any = None,
) -> EquationsOfMotion:
    """Return the equations of motion of an assembly, to be read, with the rate of a function added to L."""
    turned = [path for path, letter in (symbols or {}).items() if letter.startswith("-")]
    found = with_signs(lagrangian_of(assembly), turned) if turned else lagrangian_of(assembly)
    given = {f"-{path}" if path in turned else path: letter.lstrip("-") for path, letter in (symbols or {}).items()}
    notation = notation_of(assembly, found, given)
    return EquationsOfMotion(assembly, with_gauge(assembly, found, notation, gauge), notation, parameters)


@dataclass(frozen=True, eq=False)
class PartOfEquations:
    """What one part, or a model with all its parts, contributes to the equations of motion; sympy objects.

    Attributes
    ----------
    path
        The part.
    kinetic_energy, potential_energy, lagrangian, rayleigh_function
        J, and W.
    generalized_forces
        One for each velocity.
    rows
        What it adds to each equation of motion, forces of its constraints included; empty where velocities are not all
        derivatives of free coordinates, so that the equations are not those of a sum of Lagrangians.
    """

    path: str
    kinetic_energy: Sympy
    potential_energy: Sympy
    lagrangian: Sympy
    rayleigh_function: Sympy
    generalized_forces: tuple[Sympy, ...]
    rows: tuple[Sympy, ...]


class EquationsOfMotion(Paged, EquationFormulas):
    """The equations of motion of a scene, to be read.

    Lagrange's equations with multipliers, ``d/dt dL/dq' - dL/dq + dR/dq' = Q + G^T lambda`` with ``g(q, t) = 0`` and
    ``G = dg/dq`` (Goldstein, equations 1.57, 1.70 and 2.23). Where orientations are quaternions, velocities are the
    components of angular velocities in the axes of the body, and the equations are Euler's. Coordinates are functions
    of ``t``, as `sympy.physics.mechanics.dynamicsymbols` makes them; parameters are plain symbols.

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

    # -- as sympy objects ---------------------------------------------------------------------------------------------

    def symbol(self, path: str) -> Sympy:
        """Return the sympy symbol of a coordinate, multiplier or parameter by its path.

        Raises
        ------
        UsageError
            If nothing has this path.
        """
        for one in self.legend:
            if one.path == path:
                return objects.letter(one)
        if f"-{path}" in [one.path for one in self.legend]:
            return -self.symbol(f"-{path}")
        merged = {other.name: first for other, first in self.notation.merged.items()}
        if path in merged and self.parameters == "symbolic":
            return objects.formula(self.formula(merged[path]))
        raise UsageError("it has no symbol", where=path, advice=suggestion(path, [one.path for one in self.legend]))

    @property
    def values(self) -> dict[Sympy, float]:
        """The value of each parameter's symbol, in SI units."""
        return {objects.letter(one): one.value for one in self.legend if one.value is not None}

    @property
    def coordinates(self) -> tuple[Sympy, ...]:
        """The coordinates q, functions of t."""
        return tuple(objects.letter(self.notation.symbols[q]) for q in self.expressions.coordinates)

    @property
    def velocities(self) -> tuple[Sympy, ...]:
        """The velocities: derivatives of coordinates, and components of angular velocities in the axes of a body."""
        return tuple(objects.letter(*self.notation.velocities[u]) for u in self.expressions.velocities)

    @property
    def accelerations(self) -> tuple[Sympy, ...]:
        """The derivatives of the velocities."""
        return tuple(objects.letter(*self.notation.velocities[a]) for a in self.expressions.accelerations)

    @property
    def multipliers(self) -> tuple[Sympy, ...]:
        """One for each constraint; the generalized force of the constraints is ``G^T lambda``."""
        return tuple(objects.letter(self.notation.symbols[one.multiplier]) for one in self.expressions.constraints)

    @property
    def rates(self) -> tuple[Sympy, ...]:
        """The derivatives of the coordinates in terms of the velocities."""
        return tuple(map(objects.formula, self.written.rates))

    @property
    def kinetic_energy(self) -> Sympy:
        """The kinetic energy T, J."""
        return objects.formula(self.written.kinetic)

    @property
    def potential_energy(self) -> Sympy:
        """The potential energy V, J; weight included."""
        return objects.formula(self.written.potential)

    @property
    def rayleigh_function(self) -> Sympy:
        """The Rayleigh function R, W."""
        return objects.formula(self.written.rayleigh)

    @property
    def lagrangian(self) -> Sympy:
        """The Lagrangian, J: T - V, and terms linear in the velocities, as of a charge in a magnetic field."""
        return self.kinetic_energy - self.potential_energy + objects.formula(self.written.linear)

    @property
    def momenta(self) -> tuple[Sympy, ...]:
        """The momenta ``dL/dq'``; for an angular velocity the angular momentum, in the axes of the body."""
        return tuple(map(objects.formula, self.written.momenta))

    @property
    def mass_matrix(self) -> Sympy:
        """The mass matrix M."""
        return _sympy_matrix(self.mass)

    @property
    def velocity_terms(self) -> tuple[Sympy, ...]:
        """What is left of ``d/dt dT/dq' - dT/dq`` where accelerations are zero."""
        return tuple(map(objects.formula, self.written.velocity_terms))

    @property
    def generalized_forces(self) -> tuple[Sympy, ...]:
        """The generalized forces Q of loads: those that neither V nor R give."""
        return tuple(map(objects.formula, self.written.forces))

    @property
    def constraints(self) -> tuple[Sympy, ...]:
        """What stays zero: functions g of coordinates and time; of constraints on velocities these themselves."""
        return tuple(map(objects.formula, self.written.constraints))

    @property
    def constraint_jacobian(self) -> Sympy:
        """The matrix G of derivatives of the constraints by the coordinates, or of their rates by the velocities."""
        return _sympy_matrix(self.slopes)

    @property
    def rows(self) -> tuple[Sympy, ...]:
        """The equations of motion: each is zero. ``M a`` and velocity terms, less all forces."""
        return tuple(map(objects.formula, self.written.rows))

    @property
    def shared(self) -> tuple[tuple[Sympy, Sympy], ...]:
        """Names in formulas that are too long to be written out, and what they stand for, in order."""
        _ = self.written
        return tuple((objects.formula(name), objects.formula(value)) for name, value in self.book.shared)

    @property
    def solved(self) -> dict[Sympy, Sympy]:
        """The accelerations and the multipliers as functions of the state.

        Raises
        ------
        UnsupportedError
            If too many equations hang together, or the formulas would fill a page.
        """
        names = (*self.accelerations, *self.multipliers)
        return dict(zip(names, (objects.formula(one.formula) for one in self.lines_solved), strict=True))

    @property
    def constraint_powers(self) -> tuple[Sympy, ...]:
        """The power of each constraint's forces, W: ``-lambda dg/dt``, zero where a constraint does not move."""
        found = self.expressions
        still = substitute([one.rate for one in found.constraints], dict.fromkeys(found.velocities, 0.0))
        powers = (-one.multiplier * rate for one, rate in zip(found.constraints, still, strict=True))
        return tuple(objects.formula(self.formula(one)) for one in powers)

    def quantity(self, path: str) -> Sympy:
        """Return a quantity of a part as a formula: what a sensor measures, an energy, or a reaction.

        Parameters
        ----------
        path
            The quantity, such as ``"rod.tension"``. Reactions of joints that the coordinates solve follow from the
            balance of forces; they are in terms of coordinates, velocities and accelerations.

        Raises
        ------
        ParameterError
            If there is no such quantity.
        UnsupportedError
            If it is a reaction that hangs together with others.
        """
        return objects.formula(self.written_quantity(path))

    def eliminate(self, *paths: str) -> list[dict[Sympy, Sympy]]:
        """Return dependent coordinates of closed loops in closed form.

        Parameters
        ----------
        *paths
            Coordinates, as many as there are constraints.

        Returns
        -------
        list of dict
            What each of these coordinates is in terms of the others: one dictionary for each way in which the mechanism
            can be put together, such as a four-bar linkage with its coupler on either side.

        Raises
        ------
        UnsupportedError
            If there is no closed form that one would find by hand.
        UsageError
            If a path is no coordinate, or their number is not that of the constraints.
        """
        if len(paths) != len(self.expressions.constraints) or not all(
            one.holonomic for one in self.expressions.constraints
        ):
            raise UsageError(
                f"{len(paths)} coordinates cannot follow from {len(self.expressions.constraints)} constraints",
                where=self.name,
                advice="Name a coordinate for each constraint on positions.",
            )
        unknowns = [self.symbol(path) for path in paths]
        for path, one in zip(paths, unknowns, strict=True):
            if one not in self.coordinates:
                raise UsageError("it is no coordinate", where=path)
        found = solve_closures(self.constraints, unknowns)
        if found is None:
            raise UnsupportedError(
                "its loops have no closed form that one would find by hand",
                where=self.name,
                advice="Keep the constraints and their multipliers, or name other coordinates.",
            )
        return found

    def terms(self, path: str) -> PartOfEquations:
        """Return what a part contributes, or a model with all its parts.

        Parameters
        ----------
        path
            The part, such as ``"rod1"``.

        Raises
        ------
        UsageError
            If there is no such part.
        """
        every = list(self.assembly.mechanism.locals_)
        chosen = [one for one in every if one == path or one.startswith((f"{path}.", f"{path}["))]
        if not chosen:
            raise UsageError("there is no such part", where=path, advice=suggestion(path, every))
        found = self.expressions
        own = [one for one in found.parts if one.path in chosen]

        def total(values: Sequence[Expression], energy: bool = False) -> Sympy:
            return objects.formula(self.formula(sum(values, found.graph.zero), energy=energy))

        shares = rows_by_part(found)
        rows = [[shares[one][k] for one in shares if one in chosen] for k in range(len(found.velocities))]
        return PartOfEquations(
            path,
            total([one.kinetic for one in own], True),
            total([one.potential for one in own], True),
            total([one.lagrangian for one in own], True),
            total([one.rayleigh for one in own], True),
            tuple(total([one.forces[k] for one in own]) for k in range(len(found.velocities))),
            tuple(map(total, rows)) if shares else (),
        )

    # -- to be shown --------------------------------------------------------------------------------------------------

    @cached_property
    def _page(self) -> Page | Structure:
        if not self.is_readable:
            return self.structure
        return page_of_equations(self, self.written_by_part if self.by_part else self.written)

    @property
    def _hovering(self) -> Page | Structure:
        """The page on which each term says from which parts it comes."""
        return page_of_equations(self, self.written_by_part) if self.is_readable else self.structure

    def latex(self) -> str:
        """Return the equations of motion, and the constraints if there are any, as an aligned block of LaTeX."""
        if not self.is_readable:
            return self.structure.latex()
        lines = equation_lines(self.written_by_part if self.by_part else self.written)
        lines += [line for one in asked_sections(self) for line in one.lines if isinstance(line, Line)]
        shared = page.shared_lines((one.formula for one in lines), self.book.shared)
        return page.as_latex([*lines, *shared], self.by_part)

    def html(self) -> str:
        """Return symbols, energies and equations as HTML with formulas in MathML, which browsers show."""
        return self._hovering.html()

    @cached_property
    def sections(self) -> list[Section]:
        """What a page of them says, section by section."""
        found = self._page
        return list(found.sections) if isinstance(found, Page) else []

    def python(self) -> str:
        """Return a module of Python that computes and solves the equations, with nothing but `math` and NumPy.

        It holds for the modes that the parts start in: events are not in it. Of multipliers that redundant constraints
        leave open, it gives the smallest.

        Raises
        ------
        UnsupportedError
            If the scene calls functions of somebody's own, which cannot be written down, or reads values that are held
            from sample to sample, which are no coordinates.
        """
        return module_of(self)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data: symbols with paths and units, formulas in LaTeX and as expressions of Python."""
        return as_data(self)

    def __repr__(self) -> str:
        n, m = len(self.expressions.velocities), len(self.expressions.constraints)
        held = f", {m} constraint{'s' if m > 1 else ''}" if m else ""
        return f"EquationsOfMotion({self.name!r}, {self.form}: {n} equation{'s' if n > 1 else ''} of motion{held})"

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"

    def _repr_html_(self) -> str:
        found = self._hovering
        if isinstance(found, Page):
            found = replace(found, sections=tuple(one for one in found.sections if one.title not in _NOT_IN_NOTEBOOKS))
        return found.notebook()


_NOT_IN_NOTEBOOKS = ("Momenta", "Generalized forces", "Kinematics", "Mass matrix", "Constraint Jacobian")
"""Headings of what a notebook leaves to the pages."""


def _sympy_matrix(entries: Sequence[Sequence[Sum]]) -> Sympy:
    columns = len(entries[0]) if entries else 0
    return sympy.ImmutableMatrix(len(entries), columns, [objects.formula(one) for row in entries for one in row])


PARAMETERS = one_of(("symbolic", "values"))


@takes(
    scene=SCENE,
    form=optional(FORM),
    parameters=PARAMETERS,
    orientation=optional(ORIENTATION),
    symbols=optional(SIGNED_LETTERS),
    by_part=FLAG,
    solved=FLAG,
    quantities=PATHS,
    gauge=GAUGE,
    contacts=CONTACTS,
)
def equations(
    scene: Model | Assembly,
    *,
    form: str | None = None,
    parameters: str = "symbolic",
    orientation: str | None = None,
    symbols: Mapping[str, str] | None = None,
    by_part: bool = False,
    solved: bool = False,
    quantities: Iterable[str] | None = None,
    gauge: Any = None,
    contacts: Mapping[str, str] | None = None,
) -> EquationsOfMotion:
    """Return the equations of motion of a scene, to be read.

    Lagrange's equations ``d/dt dL/dq' - dL/dq + dR/dq' = Q + G^T lambda``, ``g(q, t) = 0``, with symbols as in a
    textbook (theta_1, x, m, l, g) and a legend that says what they stand for. Formulas are short: what belongs together
    is put together, sums and differences of angles are recognised. Shown in a notebook, or by `latex`, `markdown`,
    `text` and `python`; everything else is sympy objects.

    Parameters
    ----------
    scene
        The scene, or an assembly of it; what contradicts that is refused.
    form
        Whether constraints are eliminated (``"reduced"``, as usual) or kept (``"dae"``). In generalized coordinates
        (Lagrange's equations of the second kind) constraints of closed loops stay, with multipliers; in the dae form
        every joint is a constraint with a multiplier (of the first kind).
    parameters
        Symbols (``"symbolic"``), or the numbers in their place (``"values"``).
    orientation
        See `atwood.assemble`. With Euler angles L is a function of these and their derivatives; with quaternions the
        velocities are angular velocities in the axes of the body.
    symbols
        Letters by path, before those of declarations and of `Scene.symbols`: ``{"hoop.angle": "theta"}``. Of a part it
        is what stands below its letters. Two parameters may share a letter where they are equal. A coordinate may have
        the other sign: with ``{"rod.angle": "-theta"}`` theta is counted the other way round.
    by_part
        Say of each term which parts it comes from. A formula is left without where the parts' own terms are not proven
        to add up to it, or the equations are no sum over parts: where rolling is solved, and in quaternions.
    solved
        Write the accelerations and the multipliers as functions of the state, too; see `EquationsOfMotion.solved`.
    quantities
        Paths of quantities of parts that are written as formulas, too, such as ``["rod.tension"]``: what sensors
        measure, energies and reactions; see `EquationsOfMotion.quantity`.
    gauge
        A function f of coordinates and time whose rate df/dt is added to L, in the letters of the equations: text such
        as ``"m*x*t"`` or a sympy expression. It leaves the equations, and changes momenta and H.
    contacts
        Which gaps are ``"closed"``, and what ``"sticks"``, ``"slips forwards"`` or ``"slips backwards"`` (in two
        directions ``"slips"``) or is ``"loose"``, by path: ``{"floor.gap": "closed", "floor.slip": "sticks"}``. Gaps
        that are not named are open. If not given, what the scene does at its start.

    Returns
    -------
    EquationsOfMotion
        Energies, momenta, mass matrix, forces, constraints and equations. What is too large to be read says so, and
        shows its structure.

    Raises
    ------
    UsageError
        If orientations are in three coordinates that are no Euler angles, nothing has the path of a letter, or one
        letter would stand for two things.
    """
    assembly = in_named_set(assembly_of(scene, form=form, orientation=orientation), contacts)
    chosen: Any = parameters
    made = read_equations(assembly, chosen, symbols, gauge)
    paths = tuple(quantities or ())
    return EquationsOfMotion(assembly, made.expressions, made.notation, chosen, by_part, solved, paths)
