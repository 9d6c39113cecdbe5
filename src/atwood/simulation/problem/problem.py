"""From an assembled scene and its start to the problem that a driver solves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel, compile_ida_callbacks
from atwood.errors import SolveError
from atwood.expr import Program
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.loose import has_touched
from atwood.forms.program import FormProgram
from atwood.forms.residuals import NullSpaceProgram, keep_constraints, null_space_program
from atwood.integrators.methods import Method
from atwood.integrators.protocol import ImplicitProblem, LinearSolver, NativeCallbacks
from atwood.lazy_dataclasses import dataclass, replace
from atwood.numerics.matrices import Matrix, to_array
from atwood.simulation.dynamics.balance import Balance, balance_of, columns_of
from atwood.simulation.dynamics.redundancy import (
    RankFinding,
    choose_dependent_coordinates,
    review_kept,
    review_partitioning,
)
from atwood.simulation.dynamics.scales import Scales, multiplier_unit
from atwood.simulation.problem.options import with_nominal
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.codegen import IdaCallbacks
    from atwood.codegen.sundials.null_space import NullSpaceCallbacks
    from atwood.numerics.fixed_pivots import FixedPivots
    from atwood.simulation.problem.implicit_scene import CompiledNullSpace


_IDA: Key[IdaCallbacks] = Key("machine code for IDA")
_PIVOTS: Key[FixedPivots | None] = Key("elimination with fixed pivots")
_NULL_SPACE: Key[NullSpaceProgram] = Key("program of the null space")
_NULL_SPACE_CODE: Key[NullSpaceCallbacks] = Key("machine code of the null space")
_USED: Key[list[int]] = Key("for how many states programs have been worked out")
_REVIEWED: Key[RankFinding | None] = Key("better choice of constraints at the start")

_PULL = 1e3
"""In units of the scene's time, the rate at which implicit steps near gaps that are closed and what sticks."""

_LARGEST_COLUMNS = 20_000
"""Programs for many states that are larger are not compiled: that would take longer than it saves."""

_MANY_STATES = 1000
"""From so many states on, in runs of one structure, it pays to compile what is worked out for each."""


@dataclass
class SceneProblem:
    """What a run of one mode needs.

    Attributes
    ----------
    assembly
        The scene.
    balance
        The balance of forces in the coordinates of the form.
    finding
        Which of its constraints are independent.
    scales
        Sizes of the scene.
    sizes, coordinate_sizes
        Size of a displacement along each speed, and of each coordinate.
    program
        The form's programs; with loops in the reduced form, those for the dependent coordinates of the start.
    dependent, dependent_speeds
        With loops: the speeds along which displacements follow from constraints on positions, and the speeds that
        follow from all constraints, at present. They differ only if there are constraints on velocities alone.
    switches
        How often they changed.
    not_compilable
        What keeps the scene from being compiled, in words; empty if nothing does.
    relative_share
        Where bodies float far away, tolerances relative to unknowns are this share of those relative to their sizes.
    compiles_columns
        Whether programs for many states are compiled; asked for once many evaluations of few states are needed.
    has_rates
        Whether rates and projections on the constraints are machine code already.
    """

    assembly: Assembly
    balance: Balance
    finding: RankFinding
    scales: Scales
    sizes: FloatArray
    coordinate_sizes: FloatArray
    program: FormProgram
    dependent: tuple[int, ...]
    dependent_speeds: tuple[int, ...]
    switches: int = 0
    not_compilable: str = ""
    relative_share: float = 1.0
    compiles_columns: bool = False
    has_rates: bool = False
    _kernels: tuple[BoundKernel, BoundKernel] | None = field(default=None, repr=False)
    _seen: tuple[float, FloatArray] | None = field(default=None, repr=False)
    _null_space: CompiledNullSpace | None = field(default=None, repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        sizes = self.scales, self.sizes, self.coordinate_sizes
        state = self.dependent, self.dependent_speeds, self.switches, self.not_compilable, self.relative_share
        return _restored, (self.assembly, self.finding, *sizes, *state)

    @property
    def holds(self) -> bool:
        """Whether something holds the scene that its coordinates do not solve: constraints, gaps or slips."""
        return bool(self.finding.kept or self.assembly.own_equations.contacts)

    @property
    def kept(self) -> NDArray[np.intp] | None:
        """Numbers of the independent constraints; None if all are."""
        if not self.finding.redundant:
            return None
        return np.asarray(self.finding.kept, dtype=np.intp)

    @property
    def is_projected(self) -> bool:
        """Whether outputs are projected onto the constraints; plain index 1 shows its drift instead."""
        return self.balance.constraints > 0 and self.program.level != "index1"

    def in_piece(self, assembly: Assembly) -> SceneProblem:
        """Return the plan of the same scene with other relations of functions of time, after a time event."""
        balance = balance_of(assembly, assembly.form)
        return replace(self, assembly=assembly, balance=balance, _kernels=None, _seen=None, _null_space=None)

    def kernels(self) -> tuple[BoundKernel, BoundKernel]:
        """Return residual and Jacobian at present."""
        if self._kernels is None:
            assembly, program = self.assembly, self._present
            many = program.derivative.by_columns
            made = assembly.compiled(program.residual), assembly.compiled(program.jacobian, many)
            self._kernels = made[0].bind(self.values), made[1].bind(self.values)
        return self._kernels

    def columns(self, program: Program, states: int = 0) -> Callable[..., tuple[FloatArray, ...]]:
        """Return a program for many states: compiled where that was asked for or pays by now, else with NumPy."""
        compiles = self.pays(program, states)
        return self.assembly.columns(program) if compiles else self.assembly.kernel(program, vectorized=True)

    def pays(self, program: Program, states: int) -> bool:
        """Return whether it pays to compile what is worked out for so many more states."""
        used = self.assembly.shared.get(_USED, lambda: [0], program)
        used[0] += states
        is_often = self.compiles_columns or used[0] > _MANY_STATES
        return is_often and not self.not_compilable and program.size <= _LARGEST_COLUMNS

    @property
    def _present(self) -> FormProgram:
        """The form's programs for the present dependent coordinates, and for what touches."""
        chosen = kept_rows(self.finding), self.dependent, self.dependent_speeds
        if self.assembly.own_equations.contacts:
            from atwood.forms.pulled import form_at_contacts  # few scenes have gaps

            return form_at_contacts(self.assembly, *chosen)
        return self.assembly.form_program(*chosen) if self.dependent_speeds else self.program

    @property
    def values(self) -> FloatArray:
        """The parameters of the form's programs: those of the scene, and of what keeps to constraints."""
        own = self.assembly.parameter_values
        more = [_PULL / self.scales.time, *self.sizes] if has_touched(self.assembly) else []
        lever = [1.0 / self.scales.length**2] if self.program.extra else []
        return np.concatenate([own, more, lever])

    def review_partitioning(self, t: float, q: FloatArray) -> bool:
        """Choose other dependent coordinates if the present ones have become a poor choice; return whether it did."""
        if not self.dependent_speeds:
            return False
        constraint_jacobian = to_array(self.balance.constraints_at(t, q, np.zeros_like(self.sizes)).jacobian)
        speeds = review_partitioning(constraint_jacobian[list(self.finding.kept)], self.sizes, self.dependent_speeds)
        holding = self.balance.holding(self.finding.kept)
        is_same = len(holding) == len(speeds)
        places = speeds if is_same else review_partitioning(constraint_jacobian[holding], self.sizes, self.dependent)
        if (places, speeds) == (self.dependent, self.dependent_speeds):
            return False
        self.dependent, self.dependent_speeds = places, speeds
        self._kernels = None
        if self._null_space is not None:
            self._null_space.choose(places, speeds)
        self.switches += 1
        return True

    def better_kept(self, t: float, q: FloatArray) -> RankFinding | None:
        """Return which constraints are better kept at a place; None if those that are will do."""
        finding = review_kept(self.finding, self.balance, t, q, self.sizes)
        return None if finding is self.finding else finding

    def keep_better(self, t: float, q: FloatArray) -> None:
        """Keep the constraints that are better kept at a place, if those that are will not do."""
        about = t, q.tobytes(), self.sizes.tobytes(), self.finding.kept
        finding = self.assembly.kept.get(_REVIEWED, lambda: self.better_kept(t, q), *about)
        if finding is not None:
            self.keep(finding, t, q)

    def keep(self, finding: RankFinding, t: float, q: FloatArray) -> None:
        """Keep other constraints from a place on; programs and sessions for those before have had their day."""
        self.finding, self._kernels, self._null_space = finding, None, None
        if self.dependent_speeds:
            now = self.balance.constraints_at(t, q, np.zeros_like(self.sizes)).jacobian
            self.dependent, self.dependent_speeds = dependent_speeds_of(self.balance, finding, now, self.sizes)
        self.program = self.assembly.form_program(finding.kept, self.dependent, self.dependent_speeds)

    @property
    def reviews_outputs(self) -> bool:
        """Whether dependent coordinates are reviewed at outputs.

        Compiled functions tell by themselves when it is time to, from the speeds alone.
        """
        return bool(self.dependent_speeds) and (self._null_space is None or self.dependent != self.dependent_speeds)

    def check_held(self, t: float, q: FloatArray, u: FloatArray) -> None:
        """Refuse a state that misses constraints even after it has been projected onto them: they contradict."""
        now = self.balance.at(t, q, u)
        rows = self.balance.row_scales(now, t, q, self.sizes)
        misses = np.maximum(np.abs(now.value / rows), np.abs(now.rate / rows) * self.scales.time)
        if not np.all(misses <= tolerances.HELD):
            worst = int(np.argmax(np.where(np.isfinite(misses), misses, np.inf)))
            raise SolveError(
                f"at t = {t:.6g} the constraints cannot all be satisfied: the error of this one is "
                f"{misses[worst]:.3g} of the scene's "
                "size",
                where=self.assembly.own_equations.constraints[worst].label,
                advice="Drives or lengths contradict each other here, or the mechanism is locked.",
            )

    def between_steps(self, t: float) -> None:
        """Review the dependent coordinates where the solver last asked for a Jacobian; for a driver's poll."""
        if self._seen is not None:
            seen, self._seen = self._seen, None
            self.review_partitioning(*seen)

    def poll(self, method: Method) -> Callable[[float], None] | None:
        """Return what a driver calls between two steps; compiled functions tell by themselves when it is time to."""
        in_python = method.is_implicit and (method.is_interpreted or bool(self.not_compilable))
        return self.between_steps if self.dependent_speeds and in_python else None

    def problem(
        self,
        events: Callable[[float, FloatArray, FloatArray], FloatArray] | None = None,
        directions: tuple[int, ...] = (),
        rough: tuple[int, ...] = (),
        signs: tuple[int, ...] = (),
    ) -> ImplicitProblem:
        """Return the problem for a driver; its functions follow changes of the dependent coordinates."""
        size = self.program.size

        def residual(t: float, y: FloatArray, yp: FloatArray) -> Sequence[float]:
            values: Sequence[float] = self.kernels()[0]([t], y, yp)[0]
            return values

        def jacobian(t: float, y: FloatArray, yp: FloatArray, cj: float) -> Sequence[float] | FloatArray:
            kernel = self.kernels()[1]
            if self._present.derivative.by_columns:
                return columns_of(kernel, size, [t], y, yp, [cj]).T.ravel()
            values: Sequence[float] = kernel([t], y, yp, [cj])[0]
            return values

        def full_jacobian(t: float, y: FloatArray, yp: FloatArray, cj: float) -> FloatArray:
            self._seen = (t, self.program.split(y)[0].copy())
            full = np.zeros(size * size)
            present = self._present
            full[present.columns * size + present.rows] = self.kernels()[1]([t], y, yp, [cj])[0]
            return full

        pattern = (self._present.rows, self._present.columns)
        if self.dependent_speeds:
            pattern = (np.tile(np.arange(size), size), np.repeat(np.arange(size), size))
        return ImplicitProblem(
            size=size,
            residual=residual,
            jacobian=full_jacobian if self.dependent_speeds else jacobian,
            pattern=pattern,
            algebraic=self.program.algebraic,
            events=events,
            event_count=len(directions),
            event_directions=directions,
            event_rough=rough,
            event_signs=signs,
            native=self._native(),
            pivots=self._pivots if self.program.form == "dae" and not self._present.derivative.by_columns else None,
        )

    def _pivots(self, samples: Sequence[FloatArray]) -> FixedPivots | None:
        """Return how the Newton matrix of the dae form is eliminated."""
        from atwood.simulation.problem.implicit_scene import pivots_of

        shared, program = self.assembly.shared, self._present
        about = program, *(one.tobytes() for one in samples)
        kept = self.assembly.kept if samples else shared
        return kept.get(_PIVOTS, lambda: pivots_of(self.assembly.own_equations, program, samples), *about)

    def _native(self) -> Callable[[LinearSolver], NativeCallbacks] | None:
        """Return what compiles residual and Jacobian; None if nothing can."""
        if self.not_compilable:
            return None
        return self.compiled_null_space if self.dependent_speeds else self.compiled

    def compiled_null_space(self, linear_solver: LinearSolver) -> NativeCallbacks:
        """Return residual and Jacobian of the reduced form with loops as machine code, for one session."""
        from atwood.simulation.problem.implicit_scene import CompiledNullSpace, compile_null_space

        shared, kept = self.assembly.shared, self.finding.kept
        about = kept, has_touched(self.assembly)
        if self._null_space is None:
            program = shared.get(_NULL_SPACE, lambda: _null_space_program(self.assembly, kept), *about)
            self._null_space = CompiledNullSpace(program, self.values, self.sizes)
        made = self._null_space.program
        code = shared.get(_NULL_SPACE_CODE, lambda: compile_null_space(made, linear_solver), *about, linear_solver)
        coordinates = self.program.coordinates

        def review(t: float, y: FloatArray) -> bool:
            return self.review_partitioning(t, y[:coordinates])

        return self._null_space.callbacks(code, (self.dependent, self.dependent_speeds), review)

    def compiled(self, linear_solver: LinearSolver) -> NativeCallbacks:
        """Return residual and Jacobian as machine code, for one session."""
        from atwood.simulation.problem.implicit_scene import native_callbacks

        program = self._present
        code = self.assembly.shared.get(
            _IDA,
            lambda: compile_ida_callbacks(
                program.residual,
                program.jacobian,
                program.rows,
                program.columns,
                program.size,
                sparse=linear_solver == "sparse",
                is_list=linear_solver == "fixed",
                by_columns=program.derivative.by_columns,
            ),
            program,
            linear_solver,
        )
        return native_callbacks(code, code.bind(self.values))

    @property
    def angles(self) -> tuple[int, ...]:
        """Unknowns that are angles, whose size does not say how accurate they must be."""
        return tuple(i for i, one in enumerate(self.assembly.own_equations.names) if one.unit == "rad")

    def tolerances(self, relative: float, nominal: Mapping[str, float]) -> FloatArray:
        """Return the absolute tolerance of each unknown; multipliers are kept out of the error test.

        Those of the stabilised form move points by the scene's size in its time.
        """
        program, scales, equations = self.program, self.scales, self.assembly.own_equations
        kept = [equations.constraints[i] for i in self.finding.kept]
        forces = np.array([1e3 * scales.of(multiplier_unit(equations, one.key)) for one in kept])
        shifts = forces[[one.value is not None for one in kept]] * (scales.length / (scales.time * scales.force))
        motion = self.coordinate_sizes, self.sizes / scales.time
        if nominal:
            motion = with_nominal(self.assembly, self.assembly.own_equations, motion, nominal)
        return np.concatenate(
            [*(relative * one for one in motion), forces[: program.multipliers], shifts[: program.extra]]
        )


def _restored(
    assembly: Assembly,
    finding: RankFinding,
    scales: Scales,
    sizes: FloatArray,
    coordinate_sizes: FloatArray,
    dependent: tuple[int, ...],
    dependent_speeds: tuple[int, ...],
    switches: int,
    not_compilable: str,
    relative_share: float = 1.0,
) -> SceneProblem:
    """Return a plan from what a pickle has of it."""
    program = assembly.form_program(kept_rows(finding), dependent, dependent_speeds)
    parts = assembly, balance_of(assembly, assembly.form), finding, scales, sizes, coordinate_sizes, program
    return SceneProblem(*parts, dependent, dependent_speeds, switches, not_compilable, relative_share)


def _null_space_program(assembly: Assembly, kept: tuple[int, ...]) -> NullSpaceProgram:
    if assembly.own_equations.contacts:
        from atwood.forms.pulled import null_space_at_contacts  # few scenes have gaps

        return null_space_at_contacts(assembly, kept)
    equations = keep_constraints(assembly.own_equations, kept)
    return null_space_program(f"{assembly.flat.name} (reduced)", equations, assembly.parameters, assembly.rows)


def kept_rows(finding: RankFinding) -> tuple[int, ...] | None:
    """Return the numbers of the independent constraints; None if all are."""
    return finding.kept if finding.redundant else None


def dependent_speeds_of(
    balance: Balance, finding: RankFinding, constraint_jacobian: Matrix, sizes: FloatArray
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the speeds whose displacements follow from constraints on positions, and those that follow from all."""
    holding = balance.holding(finding.kept)
    speeds = choose_dependent_coordinates(constraint_jacobian[list(finding.kept)], sizes)
    if holding == list(finding.kept):
        return speeds, speeds
    return choose_dependent_coordinates(constraint_jacobian[list(holding)], sizes), speeds
