"""The Hamiltonian of a scene: in symbols where it is short, with a letter for each momentum, in numbers always."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import permutations
from typing import Any

import numpy as np

from atwood.arguments import FLAG, optional, takes
from atwood.arrays import FloatArray
from atwood.display import count_of
from atwood.errors import KernelEvaluationError, StartError, UnsupportedError
from atwood.expr import Expression, depends_on, substitute, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Lagrangian, lagrangian_of
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.orientation_coordinates import from_regular
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.arguments import ORIENTATION
from atwood.table import facts
from atwood.theory.dynamics.functions import Numbers
from atwood.theory.equations.equations import PARAMETERS
from atwood.theory.equations.formulas import EquationFormulas, Parameters
from atwood.theory.equations.solved import LARGEST_BLOCK, blocks, entries_of
from atwood.theory.equations.stated import GAUGE, with_gauge
from atwood.theory.formulas import page
from atwood.theory.formulas.described import Page, Paged
from atwood.theory.formulas.notation import SYMBOLS, momentum_symbol, notation_of, with_momenta
from atwood.theory.formulas.page import Line, Section
from atwood.theory.formulas.printers import Sympy, latex, objects, text
from atwood.theory.formulas.tree import Sum, Symbol, Term, cost, in_brackets, in_order, names_in, product
from atwood.theory.hamiltonian.legendre import (
    LegendreTransform,
    changes_in_time,
    check_mass,
    is_energy,
    refuse_without_hamiltonian,
)
from atwood.topology.orientation_coordinates import Orientation

_LONGEST = 2_000
"""Signs and symbols beyond which H is not written down."""

_GOLDSTEIN = "euler-zxz"
"""Orientation coordinates where a scene has quaternions, which have no momenta (Goldstein, section 4.4)."""


def with_momenta_of_its_own(assembly: Assembly) -> Assembly:
    """Return an assembly in coordinates that have momenta: Euler angles in place of quaternions; or refuse it."""
    refuse_without_hamiltonian(assembly)
    if any(one.kind == "quaternion" for one in assembly.reduced.orientation_coordinates):
        return assembly.other_mode(assembly.modes, {}, Orientation(_GOLDSTEIN))
    return assembly


def start_of(assembly: Assembly) -> tuple[FloatArray, FloatArray]:
    """Return coordinates and their derivatives where a scene starts; its speeds may be angular velocities.

    Raises
    ------
    StartError
        If the start is not consistent, or the coordinates are singular there.
    """
    begun = find_start(assembly)
    q = from_regular(assembly, begun.coordinates)
    try:
        rates = kinematic_map_of(assembly, "reduced").rates(begun.time, q, begun.speeds)
        return q, np.array(rates[: len(assembly.reduced.names)])
    except KernelEvaluationError as error:
        raise StartError(
            f"it starts where its coordinates as {assembly.orientation.kind!r} are singular",
            where=assembly.flat.name,
            advice="Ask for the Hamiltonian in other Euler angles, such as orientation='euler-zyx'.",
        ) from error


def read_hamiltonian(
    assembly: Assembly,
    parameters: Parameters = "symbolic",
    symbols: Mapping[str, str] | None = None,
    by_part: bool = False,
    gauge: Any = None,
) -> Hamiltonian:
    """Return the Hamiltonian of an assembly, with the rate of a function added to L."""
    assembly = with_momenta_of_its_own(assembly)
    found = lagrangian_of(assembly)
    plain = notation_of(assembly, found, symbols)
    found = with_gauge(assembly, found, plain, gauge)
    transform = LegendreTransform(assembly, found)
    check_mass(transform)
    notation = with_momenta(plain, found)
    formulas = EquationFormulas(assembly, found, notation, parameters, by_part)
    return Hamiltonian(formulas, transform, is_energy(transform))


@dataclass(frozen=True, eq=False)
class Hamiltonian(Paged):
    """The Hamiltonian ``H(q, p, t) = p q' - L`` of a scene (Goldstein, equation 8.15).

    Functions of numbers take one state, or many with a row each; time is that of the start where it is not given.
    Momenta belong to the coordinates in the same order. In sympy, coordinates and momenta are functions of `t`.

    Attributes
    ----------
    formulas
        What writes it.
    transform
        What computes it.
    is_energy
        Whether H is T + V; where motions are prescribed it may be something else that is kept (Goldstein, section 8.2).
    """

    formulas: EquationFormulas
    transform: LegendreTransform
    is_energy: bool

    # -- what there is ------------------------------------------------------------------------------------------------

    @property
    def assembly(self) -> Assembly:
        """The scene."""
        return self.formulas.assembly

    @property
    def name(self) -> str:
        """What the scene is called."""
        return self.formulas.name

    @property
    def _lagrangian(self) -> Lagrangian:
        return self.formulas.expressions

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the coordinates, in the order of q and of p."""
        return tuple(one.name for one in self._lagrangian.names)

    @cached_property
    def is_conserved(self) -> bool:
        """Whether H stays what it is: it does not depend on time, and no forces act that do not follow from it."""
        return not self.other_forces and not self.depends_on_time

    @cached_property
    def depends_on_time(self) -> bool:
        """Whether H depends on time, as compared at random states and times where time is in L at all."""
        found = self._lagrangian.lagrangian
        if depends_on(found, [one.symbol for one in self.assembly.relations]):
            return True
        return depends_on(found, [self._lagrangian.time]) and changes_in_time(self.transform)

    @cached_property
    def other_forces(self) -> tuple[str, ...]:
        """Paths of the parts whose forces do not follow from H: dampers and loads; they come on top of -dH/dq."""
        found = self._lagrangian
        acting = (one for one in found.parts if not (one.rayleigh.is_zero and all(f.is_zero for f in one.forces)))
        return tuple(one.path for one in acting)

    @property
    def sentence(self) -> str:
        """What H is, in words."""
        what = "H = T + V" if self.is_energy else "H is not T + V"
        if self.other_forces:
            names = ", ".join(self.other_forces[:3]) + (" and others" if len(self.other_forces) > 3 else "")
            return f"{what}; it changes, since forces act that do not follow from it ({names})."
        return f"{what}; {'it depends on time, and changes' if self.depends_on_time else 'it is conserved'}."

    # -- in numbers -----------------------------------------------------------------------------------------------

    def start(self) -> tuple[FloatArray, FloatArray]:
        """Return coordinates and momenta where the scene starts.

        Raises
        ------
        StartError
            If the start is not consistent, or the coordinates are singular there.
        """
        q, v = start_of(self.assembly)
        return q, self.momenta_at(q, v, find_start(self.assembly).time)

    def __call__(self, q: Numbers, p: Numbers, t: float | None = None) -> FloatArray:
        """Return H, J; a number, or one for each state."""
        return self.transform.value(q, p, t)

    def momenta_at(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return the momenta ``p = dL/dq'``.

        Parameters
        ----------
        q, v
            Coordinates and their derivatives.
        t
            Time, s.
        """
        return self.transform.momenta(q, v, t)

    def velocities_at(self, q: Numbers, p: Numbers, t: float | None = None) -> FloatArray:
        """Return the derivatives of the coordinates, ``q' = dH/dp``.

        Parameters
        ----------
        q, p, t
            See `__call__`.
        """
        return self.transform.velocities(q, p, t)

    def gradient(self, q: Numbers, p: Numbers, t: float | None = None) -> tuple[FloatArray, FloatArray]:
        """Return ``dH/dq`` and ``dH/dp``; the first is ``-dL/dq``, the second the velocities.

        Parameters
        ----------
        q, p, t
            See `__call__`.
        """
        v = self.velocities_at(q, p, t)
        return -self.transform.coordinate_gradient(q, v, t), v

    def time_derivative(self, q: Numbers, p: Numbers, t: float | None = None) -> FloatArray:
        """Return the partial derivative ``dH/dt = -dL/dt``, W.

        Parameters
        ----------
        q, p, t
            See `__call__`.
        """
        return -self.transform.time_derivative(q, self.velocities_at(q, p, t), t)

    def rates(self, q: Numbers, p: Numbers, t: float | None = None) -> tuple[FloatArray, FloatArray]:
        """Return q' and p' by Hamilton's equations, forces that do not follow from H included.

        Parameters
        ----------
        q, p, t
            See `__call__`.
        """
        v = self.velocities_at(q, p, t)
        forces = self.transform.coordinate_gradient(q, v, t)
        return v, forces + self.transform.forces(q, v, t) if self.other_forces else forces

    # -- in symbols -----------------------------------------------------------------------------------------------

    @property
    def coordinates(self) -> tuple[Sympy, ...]:
        """The coordinates q, functions of t."""
        return tuple(objects.letter(self.formulas.notation.symbols[q]) for q in self._lagrangian.coordinates)

    @property
    def momenta(self) -> tuple[Sympy, ...]:
        """The momenta p, functions of t."""
        return tuple(map(objects.letter, self._letters))

    @property
    def values(self) -> dict[Sympy, float]:
        """The value of each parameter's symbol, in SI units."""
        return {objects.letter(one): one.value for one in self.formulas.legend if one.value is not None}

    @cached_property
    def is_short(self) -> bool:
        """Whether H is written in symbols."""
        return self._written is not None

    @cached_property
    def expression(self) -> Sympy:
        """H as a sympy expression of coordinates, momenta, parameters and t.

        Raises
        ------
        UnsupportedError
            If it would be too long: numbers are there all the same.
        """
        formula = objects.formula(self.formula)
        for name, value in reversed(self.formulas.book.shared):
            formula = formula.xreplace({objects.formula(name): objects.formula(value)})
        return formula

    @property
    def definitions(self) -> tuple[Sympy, ...]:
        """What the momenta are in terms of coordinates and velocities: ``dL/dq'``, in the order of `momenta`."""
        return tuple(map(objects.formula, self._definitions))

    @cached_property
    def equations(self) -> tuple[tuple[Sympy, ...], tuple[Sympy, ...]]:
        """Hamilton's equations: q' = dH/dp, and -dH/dq, to which p' is equal where no other forces act."""
        made = self.expression
        return tuple(made.diff(p) for p in self.momenta), tuple(-made.diff(q) for q in self.coordinates)

    @property
    def formula(self) -> Sum:
        """H as a formula, which the views write; errors as of `expression`."""
        if self._written is None:
            raise UnsupportedError(
                f"its Hamiltonian in {count_of(len(self.paths), 'coordinate')} would fill a page",
                where=self.name,
                advice="It is there in numbers: call it with coordinates and momenta.",
            )
        return self._written

    @property
    def _letters(self) -> tuple[Symbol, ...]:
        found = self._lagrangian
        return tuple(self.formulas.notation.symbols[momentum_symbol(found, i)] for i in range(len(found.coordinates)))

    @cached_property
    def _definitions(self) -> tuple[Sum, ...]:
        return self.formulas.formulas(self.transform.momentum_expressions)

    @cached_property
    def _written(self) -> Sum | None:
        if not self.formulas.is_readable or self.transform.has_moving_mass:
            return None
        try:
            made = hamiltonian_formula(self.formulas, self.transform)
        except UnsupportedError:
            return None
        return made if made is not None and cost(made) <= _LONGEST else None

    # -- to be shown ----------------------------------------------------------------------------------------------

    @cached_property
    def sections(self) -> list[Section]:
        """What a page of it says, section by section."""
        if self._written is None:
            return []
        heads = [(latex.letter(one), text.letter(one)) for one in self._letters]
        lines = tuple(Line(head, one) for head, one in zip(heads, self._definitions, strict=True))
        said = [Section("Hamiltonian", (Line(("H", "H"), self.formula),), self.sentence), Section("Momenta", lines)]
        used = page.shared_lines((self.formula, *self._definitions), self.formulas.book.shared)
        said += [Section("Shared terms", used)] if used else []
        return page.with_names(said, self.formulas.notation.legend)

    @property
    def _page(self) -> Page:
        title = f"{self.name}: Hamiltonian"
        if self._written is None:
            return Page(title, facts=facts((), notes=(self._too_long, self.sentence)))
        return Page(title, tuple(self.sections), symbols=tuple(self._shown), by_part=self.formulas.by_part)

    def latex(self) -> str:
        """Return H in LaTeX."""
        if self._written is None:
            return rf"\text{{{self._too_long}}}".replace("_", r"\_")
        shared = page.shared_lines([self.formula], self.formulas.book.shared)
        return page.as_latex([Line(("H", "H"), self.formula), *shared], self.formulas.by_part)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data: H and the momenta in LaTeX, paths, and what is said of it."""
        made: dict[str, Any] = {"name": self.name, "coordinates": list(self.paths), "is_energy": self.is_energy}
        made |= {"is_conserved": self.is_conserved, "other_forces": list(self.other_forces)}
        made["hamiltonian"] = None if self._written is None else latex.formula(self.formula)
        made["momenta"] = [] if self._written is None else [latex.formula(one) for one in self._definitions]
        made |= page.terms_data(self.formula) if self._written is not None and self.formulas.by_part else {}
        made["symbols"] = page.symbols_data(self.formulas.legend)
        return made

    @property
    def _shown(self) -> list[Symbol]:
        used = {name.symbol for name in names_in([self.formula, *self._definitions])}
        return [one for one in self.formulas.legend if one in used or one.kind in ("coordinate", "momentum")]

    @property
    def _too_long(self) -> str:
        number = count_of(len(self.paths), "coordinate")
        return f"The Hamiltonian of {self.name} in {number} is there in numbers; in symbols it would fill a page."

    def __repr__(self) -> str:
        return f"Hamiltonian({self.name!r}: {count_of(len(self.paths), 'coordinate')}; {self.sentence[:-1]})"

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"


@takes(
    scene=SCENE, parameters=PARAMETERS, orientation=optional(ORIENTATION), symbols=SYMBOLS, by_part=FLAG, gauge=GAUGE
)
def hamiltonian(
    scene: Model | Assembly,
    *,
    parameters: str = "symbolic",
    orientation: str | None = None,
    symbols: Mapping[str, str] | None = None,
    by_part: bool = False,
    gauge: Any = None,
) -> Hamiltonian:
    """Return the Hamiltonian of a scene, ``H(q, p, t) = p q' - L`` with ``p = dL/dq'``.

    In symbols where it is short, in numbers always (Goldstein, section 8.1). Forces that are linear in the velocities,
    as of magnetic fields, are in it by their potentials; prescribed motions make it differ from T + V, or depend on
    time; dampers and loads come on top of it, and it says which parts they are.

    Parameters
    ----------
    scene
        The scene, or an assembly of it in the reduced form.
    parameters
        Symbols (``"symbolic"``), or the numbers in their place (``"values"``).
    orientation
        Euler angles in which orientations in space are; quaternions have no momenta, and ``"euler-zxz"`` takes their
        place.
    symbols
        See `atwood.equations`.
    by_part
        Say of each term which parts it comes from: of one in the momenta, those without which it would be another.
    gauge
        See `atwood.equations`: with df/dt added to L, ``p + df/dq`` takes the place of p, and ``H - df/dt`` that of H.

    Returns
    -------
    Hamiltonian
        Its expression, coordinates and momenta in sympy, and H, its derivatives and Hamilton's equations in numbers.

    Raises
    ------
    UnsupportedError
        If there is none: the scene rolls, closed loops tie its coordinates, parts have states of their own, or its mass
        matrix is singular.
    UsageError
        If an assembly is in the dae form.
    """
    assembly = smooth_assembly_of(scene, orientation=orientation)
    chosen: Any = parameters
    return read_hamiltonian(assembly, chosen, symbols, by_part, gauge)


def hamiltonian_formula(formulas: EquationFormulas, transform: LegendreTransform) -> Sum | None:
    """Return ``H = (p - a) M^-1 (p - a)/2 - L0`` as a formula; None where a block of M is too large.

    Each block of the mass matrix is taken apart as ``L D L^T``, in the order in which that is shortest: so each term
    is the square of a momentum, less what other momenta contribute to it, over twice an inertia. A term comes from the
    parts without whose part of L it would be another: where one of them is doubled, it changes.
    """
    found = transform.lagrangian
    entries, free = _inertia(formulas, transform, found.lagrangian)
    terms: list[Term] = []
    for block in blocks(transform.size, entries):
        if len(block) > LARGEST_BLOCK:
            return None
        ways = ((_squares(formulas, order, entries, free), order) for order in permutations(reversed(block)))
        best, order = min(ways, key=lambda one: cost(Sum(tuple(one[0]))))
        rates = [found.velocities[i] for i in block]
        acting = [one for one in found.parts if depends_on(one.lagrangian, rates)]
        doubled = {
            one.path: _squares(formulas, order, *_inertia(formulas, transform, found.lagrangian + one.lagrangian))
            for one in (acting if len(acting) > 1 else [])
        }
        for k, term in enumerate(best):
            owners = [path for path, other in doubled.items() if other[k] != term] or [one.path for one in acting]
            terms.append(replace(term, owners=tuple(owners)))
    still = dict.fromkeys(found.velocities, 0.0)
    own = {one.path: -substitute([one.lagrangian], still)[0] for one in found.parts}
    rest = formulas.formula(-substitute([found.lagrangian], still)[0], own, energy=True)
    return Sum((*terms, *rest.terms))


def _inertia(
    formulas: EquationFormulas, transform: LegendreTransform, lagrangian: Expression
) -> tuple[dict[tuple[int, int], Expression], list[Expression]]:
    """Return the entries of M that are not zero and ``p - a``, where ``M q' + a`` are the momenta."""
    rates = list(transform.velocity_symbols)
    momenta = vjp([lagrangian], [lagrangian.graph.one], rates)
    at_rest = substitute(momenta, dict.fromkeys(rates, 0.0))
    free = [momentum_symbol(transform.lagrangian, i) - one for i, one in enumerate(at_rest)]
    return entries_of(formulas, momenta, rates), free


def _squares(
    formulas: EquationFormulas,
    order: Sequence[int],
    entries: Mapping[tuple[int, int], Expression],
    free: Sequence[Expression],
) -> list[Term]:
    """Return the terms of a block, with its momenta eliminated in an order."""
    matrix = {(i, j): entries.get((i, j), free[0].graph.zero) for i in order for j in order}
    momenta = {i: free[i] for i in order}
    terms = []
    for k, one in enumerate(order):
        pivot = matrix[one, one]
        above, below = formulas.formula(momenta[one]), formulas.formula(pivot, energy=True)
        squared = above if len(above.terms) == 1 else in_brackets(above.terms)
        terms.append(in_order(product(Fraction(1, 2), [(squared, Fraction(2)), (below, Fraction(-1))])))
        for i in order[k + 1 :]:
            share = matrix[i, one] / pivot
            momenta[i] = momenta[i] - share * momenta[one]
            for j in order[k + 1 :]:
                matrix[i, j] = matrix[i, j] - share * matrix[one, j]
    return terms[::-1]
