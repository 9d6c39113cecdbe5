"""An assembled scene: its mechanism, its equations in both forms, and the programs made of them when asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from atwood.errors import ParameterError, suggestion
from atwood.expr import Expression, InputGroup, OutputGroup, Program
from atwood.expr.collect import collect
from atwood.forms.dae import dae_form, keep_constraints
from atwood.forms.program import (
    BalanceProgram,
    FormProgram,
    RatesProgram,
    balance_program,
    rates_program,
    state_groups,
)
from atwood.forms.reduced import reduced_form
from atwood.kernels import BoundKernel, compile_program
from atwood.mechanics.build import Mechanism, build_equations
from atwood.mechanics.equations import Equations
from atwood.mechanics.observables import Observable, Reaction, energies, list_reactions, observe
from atwood.model.flatten import FlatScene
from atwood.topology.forest import grow_forest

__all__ = ["Assembly", "FormName"]

FormName = Literal["reduced", "dae"]
FloatArray = NDArray[np.float64]

_BY_HAND = 12
"""Up to so many coordinates the equations are rewritten; beyond, the recursion is shorter than any closed form."""


@dataclass(frozen=True, eq=False)
class Assembly:
    """A scene that has been assembled in one form.

    Attributes
    ----------
    flat
        The scene as leaves and connections.
    mechanism
        Its nodes, bodies and laws.
    form
        ``"reduced"`` or ``"dae"``.
    level
        Level of the dae form; empty for the reduced form.
    modes
        Mode of each part that has modes.
    """

    flat: FlatScene
    mechanism: Mechanism
    form: FormName
    level: str
    modes: Mapping[str, str]
    _made: dict[Any, Any] = field(default_factory=dict, repr=False)

    # -- equations ------------------------------------------------------------------------------------------------

    @cached_property
    def reduced(self) -> Equations:
        """The equations in generalized coordinates."""
        return self._equations("reduced")

    @cached_property
    def maximal(self) -> Equations:
        """The equations in maximal coordinates, with every joint a constraint."""
        return self._equations("dae")

    @property
    def equations(self) -> Equations:
        """The equations in the form of this assembly."""
        return self.reduced if self.form == "reduced" else self.maximal

    def _equations(self, form: FormName) -> Equations:
        mechanism = self.mechanism
        forest = grow_forest(form, mechanism.graph, mechanism.bodies, mechanism.locals_, mechanism.space)
        return build_equations(mechanism, forest)

    @cached_property
    def rows(self) -> tuple[Expression, ...]:
        """The equations of motion of the reduced form, as short as they come."""
        return tuple(self._tidy(self.reduced, self.reduced.rows))

    def _tidy(self, equations: Equations, rows: Sequence[Expression]) -> list[Expression]:
        """Write rows as an expert would by hand, for scenes of the size that one would do by hand."""
        if len(equations.coordinates) > _BY_HAND:
            return list(rows)
        angles = [q for q, c in zip(equations.coordinates, equations.names, strict=True) if c.unit == "rad"]
        return collect(list(rows), angles, self.parameters)

    # -- parameters -----------------------------------------------------------------------------------------------

    @property
    def parameters(self) -> tuple[Expression, ...]:
        """The symbols of the parameters."""
        return tuple(self.mechanism.table.values)

    @property
    def parameter_values(self) -> FloatArray:
        """The values of the parameters."""
        return np.array(list(self.mechanism.table.values.values()), dtype=float)

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
            Reduced form with loops: the coordinates that follow from the others.
        dependent_speeds
            The same for the speeds; those of the dependent coordinates when None.
        """
        speeds = None if dependent_speeds is None else tuple(dependent_speeds)
        key = ("form", None if kept is None else tuple(kept), tuple(dependent), speeds)
        if key not in self._made:
            equations = self.equations if kept is None else keep_constraints(self.equations, kept)
            name = f"{self.flat.name} ({self.form})"
            if self.form == "reduced":
                self._made[key] = reduced_form(name, equations, self.parameters, self.rows, dependent, speeds)
            else:
                residual = partial(self._tidy, equations)
                self._made[key] = dae_form(name, equations, self.parameters, self.level, residual)
        made: FormProgram = self._made[key]
        return made

    def balance(self, form: FormName) -> BalanceProgram:
        """Return the balance of forces in the coordinates of either form."""
        key = ("balance", form)
        if key not in self._made:
            equations = self.reduced if form == "reduced" else self.maximal
            self._made[key] = balance_program(f"{self.flat.name} ({form})", equations, self.parameters)
        made: BalanceProgram = self._made[key]
        return made

    def rates(self, form: FormName) -> RatesProgram:
        """Return how the coordinates of either form move with its speeds."""
        key = ("rates", form)
        if key not in self._made:
            equations = self.reduced if form == "reduced" else self.maximal
            self._made[key] = rates_program(f"{self.flat.name} ({form})", equations, self.parameters)
        made: RatesProgram = self._made[key]
        return made

    def kernel(self, program: Program, vectorized: bool = False) -> BoundKernel:
        """Return a program with the parameters of this scene, ready to run."""
        key = ("kernel", id(program), vectorized)
        if key not in self._made:
            # The program is kept with its kernel, so that its identity stays its own.
            self._made[key] = (program, compile_program(program, vectorized=vectorized).bind(self.parameter_values))
        made: BoundKernel = self._made[key][1]
        return made

    # -- what can be read -----------------------------------------------------------------------------------------

    @cached_property
    def reactions(self) -> tuple[Reaction, ...]:
        """Every reaction that the components report."""
        return list_reactions(self.mechanism)

    @cached_property
    def observables(self) -> dict[str, Observable]:
        """Every quantity of every component, by path, in terms of this form's coordinates."""
        return observe(self.mechanism, self.equations, self.reactions)

    @cached_property
    def start_observables(self) -> dict[str, Observable]:
        """Every quantity in terms of generalized coordinates, in which the start is solved."""
        return self.observables if self.form == "reduced" else observe(self.mechanism, self.reduced, self.reactions)

    def find_observables(self, paths: Sequence[str]) -> list[Observable]:
        """Return observables by path.

        Raises
        ------
        ParameterError
            If there is no such quantity.
        """
        for path in paths:
            if path not in self.observables:
                raise ParameterError(
                    "there is no such quantity", where=path, advice=suggestion(path, list(self.observables))
                )
        return [self.observables[path] for path in paths]

    def observer(self, paths: tuple[str, ...]) -> Program:
        """Return the program of (t, q, u, a, reactions) that gives quantities by path."""
        key = ("observer", paths)
        if key not in self._made:
            expressions = tuple(one.value for one in self.find_observables(paths))
            self._made[key] = self.state_program("quantities", expressions)
        made: Program = self._made[key]
        return made

    @cached_property
    def energy_program(self) -> Program:
        """The program of (t, q, u, a, reactions) that gives kinetic and potential energy."""
        return self.state_program("energies", energies(self.mechanism, self.equations))

    def state_program(self, name: str, expressions: Sequence[Expression]) -> Program:
        """Return a program of (t, q, u, a, reactions) in the coordinates of this form."""
        equations = self.equations
        groups = (
            *state_groups(equations),
            InputGroup("a", equations.accelerations),
            InputGroup("reactions", tuple(one.symbol for one in self.reactions)),
        )
        outputs = (OutputGroup(name, tuple(expressions)),)
        return Program(f"{self.flat.name} {name}", groups, self.parameters, outputs)

    def coordinate_program(self, name: str, equations: Equations, expressions: Sequence[Expression]) -> Program:
        """Return a program of (t, q, u) in the coordinates of the given equations."""
        outputs = (OutputGroup(name, tuple(expressions)),)
        return Program(f"{self.flat.name} {name}", state_groups(equations), self.parameters, outputs)

    @cached_property
    def to_maximal(self) -> Program:
        """The program of (t, q, u) of the reduced form that gives maximal coordinates and speeds."""
        reduced, forest = self.reduced, self.maximal.forest
        positions: list[Expression] = [reduced.graph.constant(0.0)] * len(forest.coordinates)
        speeds: list[Expression] = [reduced.graph.constant(0.0)] * len(forest.speeds)
        kinematics = reduced.kinematics
        for one in forest.attachments:
            for k, (coordinate, speed) in enumerate(zip(one.coordinates, one.speeds, strict=True)):
                positions[coordinate] = kinematics.placements.references[one.body][k]
                speeds[speed] = kinematics.reference_velocities[one.body][k]
            for k, number in enumerate(one.chart):
                positions[number] = kinematics.placements.quaternions[one.body][k]
            for k, number in enumerate(one.spin):
                speeds[number] = kinematics.angular_velocities[one.body][k]
        for turn in forest.orientations:
            if turn.coordinate is not None:
                positions[turn.coordinate] = kinematics.placements.angles[turn.body]
                speeds[turn.coordinate] = kinematics.angular_velocities[turn.body][0]
        outputs = (OutputGroup("q", tuple(positions)), OutputGroup("u", tuple(speeds)))
        return Program(f"{self.flat.name} to maximal coordinates", state_groups(reduced), self.parameters, outputs)
