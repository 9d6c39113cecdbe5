"""An assembled scene: its mechanism, its equations in both forms, and the programs made of them when asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from functools import cached_property, partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from atwood.arguments import BY_PATH, optional, takes
from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel, CompiledProgram
from atwood.display import count_of, fitted
from atwood.errors import UsageError
from atwood.expr import Expression, Program
from atwood.expr.core.relations import Relation, values_just_after
from atwood.forms.balance_program import BalanceProgram, RatesProgram, balance_program, rates_program
from atwood.forms.caches import Kept, Key, Shared, as_by_hand
from atwood.forms.other_values import MAXIMAL, REDUCED, REGULAR, Source, no_start_quantity
from atwood.forms.program import FormProgram
from atwood.forms.quantities import with_reactions
from atwood.forms.reassembly import follow, other_mode, recipe, with_flat
from atwood.forms.residuals import dae_form, keep_constraints, reduced_form
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.build import build_equations, resolve_signals
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.mechanism import Mechanism, discrete_states_of
from atwood.mechanics.outputs.observables import Observable, observe
from atwood.mechanics.outputs.reactions import Reaction, list_reactions
from atwood.mechanics.read import LineSigns
from atwood.model.local.flatten import FlatScene, flatten
from atwood.model.local.parts import DiscreteState, declared_starts
from atwood.topology.orientation_coordinates import Orientation
from atwood.topology.spanning_forest import grow_spanning_forest

if TYPE_CHECKING:
    from atwood.codegen.llvm.columns import ColumnKernel, ColumnProgram
    from atwood.forms.sides import Sides


FormName = Literal["reduced", "dae"]
Coordinates = Literal["reduced", "regular", "dae"]
"""Those of the reduced form, the same with quaternions for orientations, and those of the dae form."""

# What all assemblies of one structure share.
_ROWS: Key[tuple[Expression, ...]] = Key("equations of motion as by hand")
_DISCRETE_STATES: Key[tuple[DiscreteState, ...]] = Key("discrete states")
_FORM: Key[FormProgram] = Key("programs of the form")
_BALANCE: Key[BalanceProgram] = Key("balance of forces")
_RATES: Key[RatesProgram] = Key("rates of the coordinates")
_CODE: Key[CompiledProgram] = Key("Python code")
_COLUMNS: Key[ColumnProgram] = Key("machine code for many states")
_REACTIONS: Key[tuple[Reaction, ...]] = Key("reactions")
_OBSERVABLES: Key[Mapping[str, Observable]] = Key("quantities")
_START_OBSERVABLES: Key[Mapping[str, Observable]] = Key("quantities of the start")

_SETS: Key[dict[tuple[float, ...], Assembly]] = Key("the same with other discrete states")
_PIECES: Key[dict[tuple[float, ...], Assembly]] = Key("the same with other relations of functions of time")
_MOST_SETS = 64
"""So many sets of values of discrete states, or of relations, are remembered."""


@dataclass(frozen=True, eq=False)
class Assembly:
    """A scene that has been assembled in one form.

    Attributes
    ----------
    flat
        The scene as leaves and connections.
    mechanism
        Its nodes, bodies and laws.
    form, level
        ``"reduced"`` or ``"dae"``, and the level of the latter; empty for the reduced form.
    modes
        Mode of each part that has modes.
    source
        Where it comes from; None if it cannot be assembled again.
    why_new
        Why other values needed equations of their own; empty for what they did not.
    shared
        What all assemblies of this structure share: equations, programs and their code.
    orientation
        In which coordinates the reduced form has orientations in space.
    given_relations, held
        Values of `relations`, and of the discrete states of its parts; None for those that hold just after the start.
    given_values
        Values of the parameters from sample to sample, shape (parameters, samples); None for those of the mechanism.
    sides, side_values
        In a run, the relations of what moves that are parameters, and their values in a piece of the motion.
    kept
        What was made with these values: where it starts, for one.
    """

    flat: FlatScene
    mechanism: Mechanism
    form: FormName
    level: str
    modes: Mapping[str, str]
    source: Source | None = field(default=None, repr=False)
    why_new: str = ""
    shared: Shared = field(default_factory=Shared, repr=False)
    orientation: Orientation = field(default_factory=Orientation)
    given_relations: tuple[float, ...] | None = None
    held: tuple[float, ...] | None = None
    given_values: FloatArray | None = None
    sides: Sides | None = None
    side_values: tuple[float, ...] = ()
    kept: Kept = field(default_factory=Kept, init=False, repr=False)
    _kernels: dict[tuple[Program, bool], BoundKernel] = field(default_factory=dict, init=False, repr=False)
    _columns: dict[Program, ColumnKernel] = field(default_factory=dict, init=False, repr=False)

    def __copy__(self) -> Assembly:
        return self

    def __deepcopy__(self, memory: object) -> Assembly:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return recipe(self)

    def __repr__(self) -> str:
        flat, mechanism = self.flat, self.mechanism
        form = f"{self.form} form" + (f" ({self.level})" if self.level else "")
        where = {"line": "on a line", "plane": "in the plane", "space": "in space"}[flat.space.name]
        counts = f"{count_of(len(flat.parts), 'part')}, {count_of(len(mechanism.graph.joints), 'joint')}"
        return fitted(f"<Assembly of {flat.name}, {form}: a mechanism {where} of {counts}>")

    # -- equations ------------------------------------------------------------------------------------------------

    @property
    def reduced(self) -> Equations:
        """The equations in generalized coordinates."""
        return self.shared.get(REDUCED, lambda: self._equations("reduced", self.orientation))

    @property
    def regular(self) -> Equations:
        """The same with quaternions for orientations, which are regular everywhere: here starts are found."""
        if self.orientation == Orientation():
            return self.reduced
        return self.shared.get(REGULAR, lambda: self._equations("reduced", Orientation()))

    @property
    def maximal(self) -> Equations:
        """The equations in maximal coordinates, with every joint a constraint; orientations are quaternions."""
        return self.shared.get(MAXIMAL, lambda: self._equations("dae", Orientation()))

    def in_coordinates(self, form: Coordinates) -> Equations:
        """Return the equations in one kind of coordinates."""
        if form == "dae":
            return self.maximal
        return self.reduced if form == "reduced" else self.regular

    @cached_property
    def own_equations(self) -> Equations:
        """The equations in the form of this assembly."""
        return self.reduced if self.form == "reduced" else self.maximal

    def _equations(self, form: FormName, orientation: Orientation) -> Equations:
        mechanism = self.mechanism
        start = len(mechanism.table.graph)
        forest = grow_spanning_forest(
            form, mechanism.graph, mechanism.bodies, mechanism.locals_, mechanism.space, orientation
        )
        hangs = any(one.joint is not None for one in forest.attachments)
        if form == "reduced" and not hangs and not any(one.constraints for one in mechanism.locals_.values()):
            maximal = self.maximal  # where nothing is held either, these are the same coordinates
            if replace(maximal.forest, form=form) == forest and not maximal.constraints:
                return replace(maximal, forest=forest)
        with mechanism.relations.reading():
            made = build_equations(mechanism, forest)
        mechanism.table.graph.forget(start)
        is_left = any(symbol is value for symbol, value in made.read.items())
        return with_reactions(made, self.maximal) if form == "reduced" and is_left else made

    @property
    def rows(self) -> tuple[Expression, ...]:
        """The equations of motion of the reduced form, as short as they come."""
        reduced = self.reduced
        if reduced.read:  # what reactions are solved for with is nothing that one writes by hand
            return reduced.rows
        return self.shared.get(_ROWS, lambda: tuple(as_by_hand(reduced, self.parameters, reduced.rows)))

    # -- parameters -----------------------------------------------------------------------------------------------

    @cached_property
    def relations(self) -> tuple[Relation, ...]:
        """The relations of functions of time alone, whose values are the last parameters."""
        _ = self.own_equations  # in which the last of them are met: those of inputs that are linked to outputs
        if self.mechanism.links and (self.form == "dae" or self._has_timed_inputs()):
            _ = self.regular, self.maximal
        return tuple(self.mechanism.relations.found)

    def _has_timed_inputs(self) -> bool:
        """Return whether an input is linked to what is a function of time alone, as it then is in other coordinates."""
        relations, equations = self.mechanism.relations, self.reduced
        with self.shared.lock, relations.reading():
            found = resolve_signals(self.mechanism, equations.site, equations.kinematics)
            return any(relations.are_timed(value) for value in found.values())

    @cached_property
    def relation_values(self) -> tuple[float, ...]:
        """The values of the relations in this piece of a run: until the next time event."""
        if self.given_relations is not None:
            return self.given_relations
        if not self.relations:
            return ()
        with self.shared.lock:  # derivatives may be new to the graph
            return values_just_after(self.relations, self.mechanism.table.values, self.flat.t_start)

    @property
    def known_relations(self) -> dict[Expression, float]:
        """The values of the relations by symbol."""
        return dict(zip((one.symbol for one in self.relations), self.relation_values, strict=True))

    @property
    def known_values(self) -> dict[Expression, float]:
        """The values of parameters, discrete states and relations by symbol."""
        return dict(zip(self.parameters, self.parameter_values.tolist(), strict=True))

    def with_relations(self, values: Iterable[float]) -> Assembly:
        """Return the same in another piece of a run, with the same programs; equal ones are one."""
        given = tuple(map(float, values))
        return self._other(_PIECES, given, lambda: replace(self, given_relations=given))

    @property
    def discrete_states(self) -> tuple[DiscreteState, ...]:
        """The states of its parts that change at moments only, whose values are among the parameters."""
        return self.shared.get(_DISCRETE_STATES, lambda: discrete_states_of(self.mechanism))

    @cached_property
    def held_at_start(self) -> tuple[float, ...]:
        """Values of the discrete states before their first update."""
        if not self.discrete_states:
            return ()
        declared, flat = declared_starts(self.flat.parts, self.flat.t_start, is_discrete=True), self.flat
        return tuple({**declared, **flat.guess, **flat.start}[one.path] for one in self.discrete_states)

    @property
    def held_now(self) -> tuple[float, ...]:
        """Values of the discrete states in this piece of a run."""
        return self.held_at_start if self.held is None else self.held

    def with_held(self, values: Sequence[float]) -> Assembly:
        """Return the same with other values of the discrete states, with the same programs; equal ones are one."""
        held = tuple(values)
        return self._other(_SETS, held, lambda: replace(self, held=held))

    def _other(
        self, key: Key[dict[tuple[float, ...], Assembly]], values: tuple[float, ...], make: Callable[[], Assembly]
    ) -> Assembly:
        """Return the same with other values of one kind, each made once as long as there are not too many."""
        known = self.kept.get(key, dict)
        if values not in known:
            if len(known) >= _MOST_SETS:
                known.clear()
            made = known[values] = make()
            made.kept.get(key, lambda: known)
        return known[values]

    def with_held_of(self, other: Assembly) -> Assembly:
        """Return the same with the discrete states of another mode; what is not there has its start."""
        if other.shared is self.shared:
            return self.with_held(other.held_now)
        now = {one.path: value for one, value in zip(other.discrete_states, other.held_now, strict=True)}
        own = zip(self.discrete_states, self.held_at_start, strict=True)
        return self.with_held([now.get(one.path, value) for one, value in own])

    @cached_property
    def parameters(self) -> tuple[Expression, ...]:
        """The symbols of the parameters: discrete states after the scene's own, relations of functions of time last."""
        own = *(one.symbol for one in self.discrete_states), *(() if self.sides is None else self.sides.symbols)
        return (*self.mechanism.table.values, *own, *(one.symbol for one in self.relations))

    @cached_property
    def parameter_values(self) -> FloatArray:
        """The values of the parameters."""
        if self.given_values is not None:
            return self.given_values
        held = *self.held_now, *self.side_values
        return np.array([*self.mechanism.table.values.values(), *held, *self.relation_values], dtype=float)

    @takes(values=optional(BY_PATH), start=optional(BY_PATH), guess=optional(BY_PATH))
    def with_values(
        self,
        values: Mapping[str, Any] | None = None,
        *,
        start: Mapping[str, Any] | None = None,
        guess: Mapping[str, Any] | None = None,
    ) -> Assembly:
        """Return the same scene with other parameters or another start; nothing is compiled for it.

        A value that shapes the equations (a count, a choice, a direction, one that becomes or was exactly zero) has
        the scene assembled anew; `why_new` of what is returned then says why.

        Parameters
        ----------
        values
            Parameters by path, as for `Model.set`: numbers in SI units, or text with a unit.
        start, guess
            Start values and guesses by path that change or come on top; None lets one go.

        Raises
        ------
        ParameterError
            If there is no such parameter, or a value is not admissible.
        StartError
            If there is no such quantity to start with.
        UsageError
            If the scene is not known, since it was assembled from leaves.
        """
        if self.source is None:
            raise UsageError("it was assembled from leaves, so that its scene is not known", where=self.flat.name)
        for path in (*(start or ()), *(guess or ())):
            if path not in self.start_observables and path not in (*self.flat.start, *self.flat.guess):
                raise no_start_quantity(path, self.start_observables)
        scene = self.source.changed(values or {}, start or {}, guess or {})
        flat = replace(flatten(scene, self.flat.name), varied=self.flat.varied, contact_states=self.flat.contact_states)
        return self.with_flat(flat, replace(self.source, scene=scene))

    def with_rows(self, rows: FloatArray) -> Assembly:
        """Return the same for vectorized kernels alone, with parameters that differ from sample to sample.

        Parameters
        ----------
        rows
            Values of the parameters, shape (parameters, samples).
        """
        return replace(self, given_values=rows)

    def with_flat(self, flat: FlatScene, source: Source | None = None) -> Assembly:
        """Return the assembly of a scene with other values; see `atwood.forms.reassembly.with_flat`."""
        return with_flat(self, flat, source)

    def follow(self, flat: FlatScene, source: Source | None = None) -> tuple[Assembly | None, str]:
        """Return the same for values that keep the structure; see `atwood.forms.reassembly.follow`."""
        return follow(self, flat, source)

    def other_mode(
        self, modes: Mapping[str, str], line_signs: LineSigns, orientation: Orientation | None = None
    ) -> Assembly:
        """Return the scene in other modes; see `atwood.forms.reassembly.other_mode`."""
        return other_mode(self, modes, line_signs, orientation)

    # -- programs -------------------------------------------------------------------------------------------------

    def form_program(
        self,
        kept: Sequence[int] | None = None,
        dependent: Sequence[int] = (),
        dependent_speeds: Sequence[int] | None = None,
    ) -> FormProgram:
        """Return the programs for the solver.

        Parameters
        ----------
        kept
            Numbers of the constraints that are independent; all when None.
        dependent
            Reduced form with loops: the speeds along which displacements follow from the others.
        dependent_speeds
            The speeds that follow from the others; the same ones when None.
        """
        speeds = None if dependent_speeds is None else tuple(dependent_speeds)

        def make() -> FormProgram:
            equations = self.own_equations if kept is None else keep_constraints(self.own_equations, kept)
            name = f"{self.flat.name} ({self.form})"
            if self.form == "reduced":
                found = reduced_form(name, equations, self.parameters, lambda: self.rows, dependent, speeds)
            else:
                found = dae_form(
                    name, equations, self.parameters, self.level, partial(as_by_hand, equations, self.parameters)
                )
            return found.with_lock(self.shared.lock)

        return self.shared.get(_FORM, make, None if kept is None else tuple(kept), tuple(dependent), speeds)

    def balance(self, form: FormName) -> BalanceProgram:
        """Return the balance of forces in the coordinates of either form."""
        return self.shared.get(
            _BALANCE,
            lambda: balance_program(f"{self.flat.name} ({form})", self.in_coordinates(form), self.parameters),
            form,
        )

    def rates(self, form: Coordinates) -> RatesProgram:
        """Return how the coordinates move with their speeds."""
        return self.shared.get(
            _RATES,
            lambda: rates_program(f"{self.flat.name} ({form})", self.in_coordinates(form), self.parameters),
            form,
        )

    def kernel(self, program: Program, vectorized: bool = False) -> BoundKernel:
        """Return a program with the parameters of this scene, ready to run."""
        key = (program, vectorized)
        if key not in self._kernels:
            self._kernels[key] = self.compiled(program, vectorized).bind(self.parameter_values)
        return self._kernels[key]

    def columns(self, program: Program) -> ColumnKernel:
        """Return a program for many states as machine code with the parameters of this scene, ready to run."""
        if program not in self._columns:
            self._columns[program] = compiled_columns(self, program).bind(self.parameter_values)
        return self._columns[program]

    def compiled(self, program: Program, vectorized: bool = False) -> CompiledProgram:
        """Return a program as Python code or a tape, for any parameter values of this structure."""

        def make() -> CompiledProgram:
            from atwood.codegen.llvm.taped import TapedProgram

            return TapedProgram(program, vectorized)

        return self.shared.get(_CODE, make, program, vectorized)

    # -- what can be read -----------------------------------------------------------------------------------------

    @property
    def reactions(self) -> tuple[Reaction, ...]:
        """Every reaction that the components report."""
        return self.shared.get(_REACTIONS, lambda: list_reactions(self.mechanism))

    @property
    def observables(self) -> Mapping[str, Observable]:
        """Every quantity of every component, by path, in terms of this form's coordinates."""
        return self.shared.get(_OBSERVABLES, lambda: self._observe(self.own_equations))

    @property
    def start_observables(self) -> Mapping[str, Observable]:
        """Every quantity in terms of generalized coordinates, in which the start is solved."""
        if self.own_equations is self.regular:
            return self.observables
        return self.shared.get(_START_OBSERVABLES, lambda: self._observe(self.regular))

    def _observe(self, equations: Equations) -> Mapping[str, Observable]:
        # The Lagrangian is made of assemblies, and looked up when a momentum is wanted.
        momenta = lambda: import_module("atwood.forms.lagrangian").momenta_of(self, equations)  # noqa: E731
        return observe(self.mechanism, equations, self.reactions, self.shared.lock, momenta)


def compiled_columns(assembly: Assembly, program: Program) -> ColumnProgram:
    """Return a program for many states as machine code, for any parameter values of a structure."""
    from atwood.codegen.llvm.columns import compile_columns

    return assembly.shared.get(_COLUMNS, lambda: compile_columns(program), program)
