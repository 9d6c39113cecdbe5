"""`conserved`: what is conserved along the motions of a scene, and how far a run keeps it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import Kind, check, each, instance, optional, takes
from atwood.arrays import FloatArray
from atwood.display import data_of, fitted, listed
from atwood.errors import UsageError
from atwood.expr import Expression, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import lagrangian_of
from atwood.forms.quantities import coordinate_program
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assembly_of
from atwood.result.energy import ConservedLedger, ConservedValues
from atwood.result.result import Result
from atwood.simulation.contacts.chosen import has_contacts, loosened
from atwood.simulation.dynamics.orientation_coordinates import from_regular, to_regular
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.events.mode_change import generalized_state
from atwood.simulation.problem.arguments import ORIENTATION
from atwood.simulation.run.recorder import SegmentRecord
from atwood.table import Shown, Table, table
from atwood.theory.equations.formulas import EquationFormulas
from atwood.theory.equations.stated import GAUGE, with_gauge
from atwood.theory.formulas.notation import SYMBOLS, notation_of
from atwood.theory.formulas.page import Line, shared_lines
from atwood.theory.formulas.printers import Sympy, latex, objects, text
from atwood.theory.formulas.tree import Sum
from atwood.theory.symmetry.contacts import pushes_of
from atwood.theory.symmetry.find import Finding, find_conserved
from atwood.theory.symmetry.proof import Prover
from atwood.theory.symmetry.quantities import Quantities
from atwood.theory.symmetry.stated import Symmetry, check_symmetry
from atwood.tolerances import tolerances


@dataclass(frozen=True, eq=False)
class ConservedQuantity(Finding):
    """A quantity that is conserved along all motions of a scene.

    Attributes
    ----------
    name
        Such as ``"h"``, ``"p:rail.displacement"``, ``"P.x"``, ``"L.z"`` and ``"K.x"``.
    kind
        By what it is conserved: ``"energy function"``, ``"ignorable coordinate"``, ``"linear momentum"``, ``"angular
        momentum"``, ``"boost"``, ``"symmetric body"``, ``"rolling body"``, ``"affine symmetry"``, ``"symmetry in
        time"``, ``"quadratic in momenta"``, ``"total energy"`` where that is not the energy function, or ``"stated
        symmetry"``.
    unit
        Its SI unit.
    meaning
        What it is, in words.
    value
        The quantity on the symbols of the scene's Lagrangian.
    proven
        Whether it is proven on the expression graph; else it was checked at random states.
    evidence
        How it is known: proven, or checked at how many states, and why it is not proven.
    direction
        Of a total momentum or a boost, its direction in world axes; of a symmetric body, its axis in the body's.
    point
        Of an angular momentum, a point of its axis, m.
    formulas
        What writes it down.
    """

    formulas: EquationFormulas

    @cached_property
    def expression(self) -> Sympy:
        """The quantity as a sympy expression, in the symbols of `atwood.equations`.

        Raises
        ------
        UnsupportedError
            If it would fill a book.
        """
        return objects.formula(self._written)

    @cached_property
    def _written(self) -> Sum:
        return self.formulas.formula(self.value, energy=True)

    @property
    def _shared(self) -> tuple[Line, ...]:
        return shared_lines([self._written], self.formulas.book.shared)

    def latex(self) -> str:
        """Return the quantity in LaTeX."""
        told = [f"{one.left[0]} = {latex.formula(one.formula)}" for one in self._shared]
        return r", \quad ".join([latex.formula(self._written), *told])

    def text(self) -> str:
        """Return the quantity in plain text, for a terminal; empty where nobody would read it."""
        if not self.formulas.is_readable:
            return ""
        told = [f"{one.left[1]} = {text.formula(one.formula)}" for one in self._shared]
        return ", ".join([text.formula(self._written), *told])

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        expression = str(self.expression) if self.formulas.is_readable else None
        told = data_of(self, "name", "kind", "unit", "meaning", "proven", "evidence")
        return {**told, "expression": expression, **data_of(self, "direction", "point")}

    def __str__(self) -> str:
        return f"{self.name}: {self.meaning}; {self.evidence}"

    def __repr__(self) -> str:
        return fitted(f"<ConservedQuantity {self}>")

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"


class Conserved(Shown, Sequence[ConservedQuantity]):
    """What is conserved along the motions of a scene: a sequence of quantities, also by name.

    What is proven and what was checked at states is in it; `proven`, `checked` and `not_looked_for` say which.

    Parameters
    ----------
    quantities
        What is conserved.
    notes
        What is not, and what it depends on.
    scene
        What the scene is called.
    not_looked_for
        What may be conserved besides.
    """

    def __init__(
        self,
        quantities: Sequence[ConservedQuantity],
        notes: Sequence[str],
        scene: str,
        not_looked_for: Sequence[str] = (),
    ) -> None:
        self.quantities, self.notes, self.scene = tuple(quantities), tuple(notes), scene
        self.not_looked_for = tuple(not_looked_for)

    @property
    def proven(self) -> tuple[ConservedQuantity, ...]:
        """The quantities that are proven to be conserved."""
        return tuple(one for one in self.quantities if one.proven)

    @property
    def checked(self) -> tuple[ConservedQuantity, ...]:
        """The quantities that stay at all states that were looked at, which is no proof."""
        return tuple(one for one in self.quantities if not one.proven)

    def __len__(self) -> int:
        return len(self.quantities)

    def __iter__(self) -> Iterator[ConservedQuantity]:
        return iter(self.quantities)

    def __getitem__(self, key: Any) -> Any:
        """Return a quantity by its number or its name."""
        if not isinstance(key, str):
            return self.quantities[key]
        for one in self.quantities:
            if one.name == key:
                return one
        names = [one.name for one in self.quantities]
        told = f"Conserved are {', '.join(names)}." if names else "Nothing is."
        raise UsageError("it is not conserved", where=f"{self.scene}: {key}", advice=told)

    def __contains__(self, key: object) -> bool:
        return key in self.quantities or any(one.name == key for one in self.quantities)

    def along(self, result: Result) -> ConservedLedger:
        """Return the quantities along a run, and how far they drift.

        Parameters
        ----------
        result
            The run, in either form.

        Raises
        ------
        UsageError
            If it is a run of another scene.
        """
        result = check(instance("what `simulate` returned", Result), result, "result", "along")
        if not self.quantities:
            return ConservedLedger(())
        source = self.quantities[0].formulas
        quantities = Quantities(source.assembly, source.expressions)
        values, sizes = along_run(quantities, [one.value for one in self], result)
        rows = zip(self, values, sizes, strict=True)
        return ConservedLedger(
            tuple(ConservedValues(one.name, one.kind, one.unit, row, float(size)) for one, row, size in rows)
        )

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the quantities."""
        return tuple(one.name for one in self.quantities)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        names = {kind: [one.name for one in getattr(self, kind)] for kind in ("proven", "checked")}
        found = [one.to_dict() for one in self]
        return {"scene": self.scene, "conserved": found, **names, **data_of(self, "not_looked_for", "notes")}

    def __str__(self) -> str:
        lines = [self._heading]
        for one in (*self.proven, *self.checked):
            lines.append(f"  {one}")
            lines += [f"      {one.text()}"] * one.formulas.is_readable
        lines += [f"  not looked for: {one}" for one in self.not_looked_for]
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])

    @property
    def _heading(self) -> str:
        return f"{self.scene}: {len(self.proven)} proven to be conserved, {len(self.checked)} checked"

    def __repr__(self) -> str:
        parts = [("proven", self.proven), ("checked", self.checked)]
        told = "; ".join(f"{name} {listed([one.name for one in some])}" for name, some in parts if some)
        return f"Conserved({self.scene!r}: {told or 'nothing'})"

    def tables(self) -> tuple[Table, ...]:
        """Return a row for each quantity, with how it is known."""
        rows = [(one.name, one.kind, one.text(), one.meaning, one.evidence) for one in self]
        heads = ("name", "kind", "expression", "meaning", "how it is known")
        below = [*(f"not looked for: {one}" for one in self.not_looked_for), *self.notes]
        return (table(heads, rows, self._heading, ["; ".join(below)]),)


def _listed(value: Any) -> Any:
    return _SYMMETRIES.read([value] if isinstance(value, Symmetry) else value)


_SYMMETRIES = each(instance("a Symmetry", Symmetry), "symmetries, as a list")
_BEYOND = (
    "integrals of more than second order in the momenta, or whose terms are more than quadratic: state them, `Symmetry`"
)
_ROLLING = "integrals of rolling besides angular momenta"
SYMMETRIES = Kind("a Symmetry, or a list of them", _listed)


@takes(scene=SCENE, symmetries=SYMMETRIES, orientation=optional(ORIENTATION), symbols=SYMBOLS, gauge=GAUGE)
def conserved(
    scene: Model | Assembly,
    symmetries: Symmetry | Sequence[Symmetry] = (),
    *,
    orientation: str | None = None,
    symbols: Mapping[str, str] | None = None,
    gauge: Any = None,
) -> Conserved:
    """Return what is conserved along all motions of a scene.

    Momenta of ignorable coordinates; the energy function ``h = sum p q' - L`` (Jacobi integral), and whether it is
    T + V; linear and angular momentum along all directions in which the scene is invariant, whatever these are; boosts
    of closed scenes; angular momenta of symmetric bodies about their own axes; of scenes of few free coordinates, also
    polynomials in momenta, coordinates and time, to second order in the momenta: p + m g t, h - Omega L, the vector of
    Laplace, Runge and Lenz.

    Each is proven on the expression graph, for all states and parameters, or where that is too large, checked at random
    states, which it says.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    symmetries
        Symmetries that are stated, besides those that are found.
    orientation
        See `atwood.assemble`. With Euler angles, these can be ignorable coordinates.
    symbols
        See `atwood.equations`.
    gauge
        See `atwood.equations`: momenta are those of L + df/dt.

    Returns
    -------
    Conserved
        The quantities, each with a name, an expression, and how it is known; and what is not conserved.

    Raises
    ------
    StartError
        If the scene has no consistent start.
    UsageError
        If a symmetry that is stated is none; the error has a state at which it fails.
    """
    whole = assembly_of(scene, orientation=orientation)
    assembly = loosened(whole) if has_contacts(whole) else whole
    found = lagrangian_of(assembly, "reduced")
    notation = notation_of(assembly, found, symbols)
    found = with_gauge(assembly, found, notation, gauge)
    quantities = Quantities(assembly, found)
    prover, formulas = Prover(quantities, notation), EquationFormulas(assembly, found, notation)
    every: Any = symmetries
    stated = [check_symmetry(one, quantities, prover, formulas) for one in every]
    pushes = () if assembly is whole else pushes_of(whole, assembly)
    findings = find_conserved(assembly, quantities, prover, pushes)
    made = [ConservedQuantity(**vars(one), formulas=formulas) for one in (*findings.items, *stated)]
    beyond = [_BEYOND, *([_ROLLING] if any(not one.holonomic for one in assembly.reduced.constraints) else [])]
    return Conserved(made, findings.notes, assembly.flat.name, beyond)


def along_run(quantities: Quantities, values: Sequence[Expression], result: Result) -> tuple[FloatArray, FloatArray]:
    """Return quantities at the output times of a run, and the sizes of their terms."""
    assembly = quantities.assembly
    _check_alike(assembly, result.assembly)
    e, own = assembly.reduced, quantities.on_speeds(values)
    # What a quantity is the sum of, as far as velocities tell: total momenta can be zero.
    terms = [[u * slope for u, slope in zip(e.speeds, vjp([one], [e.graph.one], e.speeds), strict=True)] for one in own]
    flat = [one for row in terms for one in row]
    program = coordinate_program(assembly, "conserved along a run", e, {"values": own, "terms": flat})
    pieces, sizes = [], np.zeros(len(own))
    for segment in result.run.segments:
        shown = segment.shown
        if not np.any(shown):
            continue
        q, u = _states(assembly, segment, result.start.length)
        kernel = _as_in(assembly, segment).kernel(program, vectorized=True)
        found, parts = kernel(segment.time[None, shown], q[:, shown], u[:, shown])
        pieces.append(np.asarray(found))
        parts = np.sum(np.abs(np.reshape(parts, (len(own), len(e.speeds), -1))), axis=1)
        sizes = np.fmax(sizes, np.nanmax(np.maximum(parts, np.abs(found)), axis=1, initial=0.0))
    return np.concatenate(pieces, axis=1), sizes


def _check_alike(assembly: Assembly, other: Assembly) -> None:
    if assembly.shared is other.shared and assembly.mechanism is other.mechanism:
        return
    own, its = ({one.name: value for one, value in a.mechanism.table.values.items()} for a in (assembly, other))
    if [one.name for one in assembly.regular.names] != [one.name for one in other.regular.names] or own != its:
        changed = next((name for name in own if own[name] != its.get(name)), "")
        raise UsageError(
            "the quantities are of another scene" + (f": {changed} is another there" if changed else ""),
            where=other.flat.name,
            advice="Give `conserved` the scene that is run.",
        )


def _as_in(assembly: Assembly, segment: SegmentRecord) -> Assembly:
    """Return a scene with what the clock and discrete states are in a segment of a run."""
    its = segment.assembly
    if len(assembly.relations) == len(its.relations):
        assembly = assembly.with_relations(its.relation_values)
    now = dict(zip((one.path for one in its.discrete_states), its.held_now, strict=True))
    return assembly.with_held([now[one.path] for one in assembly.discrete_states]) if now else assembly


def _states(assembly: Assembly, segment: SegmentRecord, length: float) -> tuple[FloatArray, FloatArray]:
    """Return the states of a segment in the coordinates and speeds of the reduced form of a scene.

    Those of a mode in which bodies are where these coordinates cannot put them are not known (nan).
    """
    its, q, u = segment.assembly, segment.coordinates, segment.speeds
    alike = [one.name for one in its.regular.names] == [one.name for one in assembly.regular.names]
    if its.form == "reduced" and alike and its.regular.speed_names == assembly.regular.speed_names:
        return from_regular(assembly, to_regular(its, q)), u
    big_q, big_u = maximal_state(its, segment.time, q, u)
    places, speeds = np.full((len(assembly.regular.names), len(segment.time)), np.nan), []
    for k in np.flatnonzero(segment.shown):
        own, whole = (q[:, k], u[:, k]), (big_q[:, k], big_u[:, k])
        place, speed, miss = generalized_state(its, assembly, float(segment.time[k]), own, whole, length)
        if np.max(np.abs(miss), initial=0.0) <= tolerances.IN_PLACE:
            places[:, k] = place
        speeds.append(speed)
    moving = np.full((len(assembly.regular.speeds), len(segment.time)), np.nan)
    moving[:, segment.shown] = np.array(speeds).T
    return from_regular(assembly, places), moving
