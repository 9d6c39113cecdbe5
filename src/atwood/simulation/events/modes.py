"""Events and modes: what is watched, and how a state is taken into another mode.

An event maps (mode, q, u) to (mode, q, u). States pass between modes through maximal coordinates, which both share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import SolveError
from atwood.expr import Expression, OutputGroup, Program, depends_on, evaluate, jacobian
from atwood.forms.assembly import Assembly
from atwood.forms.event_program import event_program
from atwood.forms.kept import Key
from atwood.forms.places import to_maximal
from atwood.forms.quantities import known_program, observer
from atwood.integrators.protocol import StepResult
from atwood.late import dataclass
from atwood.linalg.matrices import is_full, scaled, to_array
from atwood.mechanics.dynamics.equations import Constraint
from atwood.mechanics.outputs.event_functions import EventFunction, list_event_functions
from atwood.simulation.dynamics.balance import Balance, BalanceValues, balance_of
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of, reference_coordinates
from atwood.simulation.dynamics.line_signs import actual_line_signs
from atwood.simulation.dynamics.orientation_coordinates import (
    COORDINATE_SWITCH,
    Reassemble,
    switch_coordinates,
    switch_functions,
)
from atwood.simulation.dynamics.rank import least_norm
from atwood.simulation.dynamics.reactions import ReactionSolver, maximal_state
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.problem.conditions import Condition, condition_functions
from atwood.simulation.problem.problem import Plan
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventCode, EventData

__all__ = [
    "EventProbe",
    "EventRecord",
    "enter_mode",
    "find_event_functions",
    "generalized_speeds",
    "generalized_state",
    "plastic_impact",
]

_EVENT_FUNCTIONS: Key[tuple[EventFunction, ...]] = Key("event functions")
_NEEDS: Key[_Needs] = Key("what event functions read")
_EVENTS: Key[Program] = Key("events")
_EVENT_CODE: Key[EventCode | None] = Key("machine code of events")
_IS_THERE: Key[Program] = Key("whether an event is there")
_REACTION_EVENTS: Key[tuple[EventFunction, ...]] = Key("event functions that read reactions")
_MAXIMAL: Key[tuple[Program, tuple[int, ...], tuple[int, ...]]] = Key("maximal coordinates and their Jacobian")


@dataclass(frozen=True)
class EventRecord:
    """An event that has happened.

    Attributes
    ----------
    time
        s.
    part, law
        Whose event it is.
    message
        What has happened, in words.
    target
        The mode it led to, or ``"stop"``; empty where no mode changed.
    impact
        Whether velocities jumped.
    """

    time: float
    part: str
    law: str
    message: str
    target: str
    impact: bool

    def describe(self) -> str:
        """Return what happened, where and when."""
        return f"at t = {self.time:.9g} s, {self.part}{': ' if self.part else ''}{self.message}"


def find_event_functions(assembly: Assembly) -> tuple[EventFunction, ...]:
    """Return what is watched in the modes of an assembly."""
    return assembly.shared.get(
        _EVENT_FUNCTIONS,
        lambda: (
            *list_event_functions(assembly.mechanism, assembly.own_equations, assembly.reactions, assembly.modes),
            *switch_functions(assembly.own_equations),  # last: of what happens at the same time, the others come first
        ),
    )


@dataclass(frozen=True)
class _Needs:
    """Whether events read reactions, or accelerations."""

    reactions: bool
    accelerations: bool


def _find_needs(assembly: Assembly, event_functions: Sequence[EventFunction]) -> _Needs:
    symbols, accelerations = [one.symbol for one in assembly.reactions], assembly.own_equations.accelerations
    return _Needs(
        any(depends_on(one.value, symbols) for one in event_functions),
        any(depends_on(one.value, accelerations) for one in event_functions),
    )


class EventProbe:
    """The events of one mode as a function of the solver's state.

    Parameters
    ----------
    plan
        The scene in its mode.
    t, q, u
        The state at the start of the mode.
    tolerance
        Relative tolerance of the run. A one-sided event that starts within ten times this of zero, as a rope does that
        has just gone slack, happens only when it has passed zero by as much; else errors of a step would set it off.
    conditions
        What the run looks for besides.
    """

    def __init__(
        self,
        plan: Plan,
        t: float,
        q: FloatArray,
        u: FloatArray,
        tolerance: float,
        conditions: tuple[Condition, ...] = (),
    ) -> None:
        self.plan, self._conditions = plan, conditions
        self.assembly = assembly = plan.assembly
        self.event_functions = (*condition_functions(assembly, conditions), *find_event_functions(assembly))
        self.needs = assembly.shared.get(_NEEDS, lambda: _find_needs(assembly, self.event_functions), conditions)
        self.reactions = ReactionSolver(assembly, t, q, u) if self.needs.reactions else None
        self.kernel = (
            assembly.kernel(
                known_program(assembly, _EVENTS, lambda: [one.value for one in self.event_functions], conditions)
            )
            if self.event_functions
            else None
        )
        scales = plan.scales
        sizes = {"m": scales.length, "N": scales.force, "m/s": scales.length / scales.time}
        small = [10.0 * tolerance * sizes.get(one.unit, 1.0) for one in self.event_functions]
        self._shift = np.zeros(len(small))
        values = np.asarray(self.values(t, q, u)) if self.event_functions else np.zeros(0)
        self.broken = next(
            (
                one
                for one, v, s in zip(self.event_functions, values, small, strict=True)
                if one.direction * v > s and not one.is_noted
            ),
            None,
        )
        for i, (one, value) in enumerate(zip(self.event_functions, values, strict=True)):
            if abs(value) <= small[i] and not one.is_noted:
                self._shift[i] = -one.direction * small[i]

    @property
    def directions(self) -> tuple[int, ...]:
        """Direction of each event."""
        return tuple(one.direction for one in self.event_functions)

    @property
    def rough(self) -> tuple[int, ...]:
        """Numbers of the events whose exact time does not matter."""
        return tuple(i for i, one in enumerate(self.event_functions) if one.target == COORDINATE_SWITCH)

    def values(self, t: float, q: FloatArray, u: FloatArray) -> FloatArray:
        """Return the value of each event at a state, shifted where it starts at zero."""
        assert self.kernel is not None
        reactions: Any = [0.0] * len(self.assembly.reactions)
        accelerations = np.zeros_like(u)
        if self.reactions is not None:
            found, _ = self.reactions.at(np.array([t]), q[:, None], u[:, None])
            reactions = found[:, 0]
        if self.needs.accelerations and len(u):
            accelerations, _ = self.plan.balance.accelerate(t, q, u, self.plan.kept)
        values: FloatArray = np.asarray(self.kernel([t], q, u, accelerations, reactions)[0]) + self._shift
        return values

    def compiled(self, for_ida: bool) -> EventData | None:
        """Return the same as machine code, for one session; None if nothing is watched, or it cannot be compiled.

        Parameters
        ----------
        for_ida
            Whether SUNDIALS is to call it.
        """
        if not self.event_functions or not len(self.assembly.own_equations.coordinates):
            return None
        kept, maximal = self.plan.finding.kept, () if self.reactions is None else self.reactions.finding.kept

        def make() -> EventCode | None:
            program = event_program(self.assembly, [one.value for one in self.event_functions], kept, maximal)
            if program is None or any(node.operation == "external" for node in program.nodes):
                return None
            try:
                from atwood.codegen.sundials.events import compile_events
            except ImportError:  # no compiler
                return None
            return compile_events(program, for_ida)

        code = self.assembly.shared.get(_EVENT_CODE, make, kept, maximal, for_ida, self._conditions)
        return None if code is None else code.bind(self.assembly.parameter_values, self._shift)

    def function(self) -> Callable[[float, FloatArray, FloatArray], FloatArray] | None:
        """Return the events as a function of the solver's vector; None if nothing is watched."""
        if not self.event_functions:
            return None
        n, m = len(self.assembly.own_equations.coordinates), len(self.assembly.own_equations.speeds)
        return lambda t, y, yp: self.values(t, y[:n], y[n : n + m])

    def broken_at_start(self, t: float) -> EventRecord | None:
        """Return the first event whose one-sided bound does not hold from the outset."""
        return None if self.broken is None else self._record(t, self.broken)

    def between(self, start: float, end: float) -> EventRecord | None:
        """Return the first event between two times in which nothing is free to move; None if there is none."""
        if not self.event_functions:
            return None
        nothing = np.zeros(0)
        before, after = self.values(start, nothing, nothing), self.values(end, nothing, nothing)
        found: list[tuple[float, EventFunction]] = []
        for i, function in enumerate(self.event_functions):
            if before[i] == 0.0 or np.sign(before[i]) == np.sign(after[i]):
                continue
            if function.direction and np.sign(after[i] - before[i]) != function.direction:
                continue
            low, high = start, end
            while high - low > 4e-16 * max(abs(low), abs(high), end - start):
                middle = 0.5 * (low + high)
                if not low < middle < high:
                    break
                same = np.sign(self.values(middle, nothing, nothing)[i]) == np.sign(before[i])
                low, high = (middle, high) if same else (low, middle)
            found.append((high, function))
        return self._record(*min(found, key=lambda one: one[0])) if found else None

    def name(self, step: StepResult) -> EventRecord | None:
        """Return what happened when the driver reports an event, and does not go on as before; None if it does."""
        return next((self._record(step.t, one) for one in self._fired(step) if one.target), None)

    def noted(self, step: StepResult) -> list[EventRecord]:
        """Return what changes nothing among what the driver reports."""
        return [self._record(step.t, one) for one in self._fired(step) if not one.target]

    def _fired(self, step: StepResult) -> list[EventFunction]:
        """Return what the driver reports, without zeros that do not count."""
        fired = [one for one, sign in zip(self.event_functions, step.events, strict=True) if sign]
        return [one for one in fired if one.is_there is None or self._is_there(step, one)]

    def _is_there(self, step: StepResult, one: EventFunction) -> bool:
        assembly, expression = self.assembly, one.is_there
        assert expression is not None
        program = known_program(assembly, _IS_THERE, lambda: [expression], one.law, self._conditions)
        kernel = assembly.kernel(program)
        q, u = self.plan.program.split(step.y)
        return bool(kernel([step.t], q, u, np.zeros_like(u), [0.0] * len(assembly.reactions))[0][0] > 0.0)

    def _record(self, t: float, function: EventFunction) -> EventRecord:
        return EventRecord(t, function.part, function.law, function.message, function.target, function.impact)


def enter_mode(
    state: tuple[float, FloatArray, FloatArray],
    assembly: Assembly,
    event: EventRecord,
    reassemble: Reassemble,
    length: float,
) -> tuple[Assembly, FloatArray, FloatArray]:
    """Return the scene in the mode that an event leads to, with its state.

    Parameters
    ----------
    state
        Time, coordinates and speeds just before the event.
    assembly
        The scene before the event.
    event
        The event.
    reassemble
        Gives the scene in other modes and orientation coordinates.
    length
        Extent of the scene, m.
    """
    t, q, u = state
    big_q, big_u = (x[:, 0] for x in maximal_state(assembly, np.array([t]), q[:, None], u[:, None]))
    line_signs = actual_line_signs(assembly, t, q, u, assembly.form)
    after = reassemble({**assembly.modes, event.part: event.target}, line_signs, assembly.orientation)
    sizes = motion_scales(after.maximal, length)
    balance = balance_of(after, "dae")
    if event.impact:
        met, _ = balance.project(t, big_q, big_u, sizes)
        _check_in_place(event, balance.kinematic_map.difference(t, big_q, met) / sizes)
        big_u = plastic_impact(after, balance, event, (t, met, big_u), sizes)
        big_q = met
    if after.form == "dae":
        return after, big_q, big_u
    q, u, miss = generalized_state(assembly, after, t, (q, u), (big_q, big_u), length)
    _check_in_place(event, miss)
    return *switch_coordinates(after, q, reassemble), u


def _check_in_place(event: EventRecord, moved: FloatArray) -> None:
    """Refuse a change of mode that would move bodies."""
    farthest = float(np.max(np.abs(moved), initial=0.0))
    if not farthest <= tolerances.IN_PLACE:
        raise SolveError(
            f"at t = {event.time:.6g} a change of mode ({event.message}) would change a position discontinuously by "
            f"{farthest:.3g} of the scene's size",
            where=event.part,
            advice="The position violates the constraints of the new mode: change the start, or the condition of "
            "the event.",
        )


def plastic_impact(
    after: Assembly,
    balance: Balance,
    event: EventRecord,
    state: tuple[float, FloatArray, FloatArray],
    sizes: FloatArray,
) -> FloatArray:
    """Return the velocities after an impact: the nearest admissible ones in the metric of the masses.

    Impulses act along the constraints only: ``M (u+ - u-) = G^T Lambda``, ``G u+ + g_t = 0``. One that is one-sided, as
    a rope is that can only pull, bears impulses of one sign: an impact that needs the other one is refused.

    Parameters
    ----------
    after, balance
        The scene after the impact, and its balance of forces in maximal coordinates.
    event
        What the impact is told as.
    state
        Time, coordinates and speeds just before it, in maximal coordinates.
    sizes
        Size of a displacement along each speed.
    """
    t, q, u = state
    now = balance.at(t, q, u)
    velocities, impulses = _solve_impact(now, u, sizes, balance.row_scales(now, t, q, sizes))
    size = float(np.max(np.abs(impulses), initial=0.0))
    for one, impulse in zip(after.maximal.constraints, impulses, strict=True):
        if abs(impulse) > 1e-9 * size and _is_refused(after, one, state, one.sign * impulse):
            raise SolveError(
                f"at t = {t:.6g} the impact ({event.message}, {event.part}) needs an impulse of the sign that "
                "this one-sided constraint cannot transmit: a rope would have to push",
                where=one.key[0],
                advice="Simultaneous impacts of several one-sided constraints, some of which open, are not supported.",
            )
    return velocities


_SIZES = (1e-9, 1e9)
"""Between these, beside the impulses, lies any force that an event could compare a reaction with."""


def _is_refused(
    after: Assembly, constraint: Constraint, state: tuple[float, FloatArray, FloatArray], impulse: float
) -> bool:
    """Return whether events of its part let go of a constraint for a reaction of this sign, however small or large.

    A limit in both directions, or one that is not zero, makes no constraint one-sided.
    """
    part, own = constraint.key[0], [one.symbol for one in after.reactions if one.key == constraint.key]
    event_functions = [
        one for one in _reaction_event_functions(after) if one.part == part and depends_on(one.value, own)
    ]
    if not event_functions:
        return False
    t, q, u = state
    equations = after.maximal
    known: dict[Expression, float] = dict(zip(after.parameters, after.parameter_values, strict=True))
    known |= {equations.time: t, **dict(zip(equations.coordinates, q, strict=True))}
    known |= dict(zip((*equations.speeds, *equations.accelerations), (*u, *np.zeros_like(u)), strict=True))
    known |= dict.fromkeys((one.symbol for one in after.reactions), 0.0)

    def lets_go(reaction: float) -> bool:
        values = evaluate([one.value for one in event_functions], {**known, **dict.fromkeys(own, reaction)})
        return any(one.direction * value > 0.0 for one, value in zip(event_functions, values, strict=True))

    refused, other = (all(lets_go(sign * size * impulse) for size in _SIZES) for sign in (1.0, -1.0))
    return refused and not other


def _reaction_event_functions(assembly: Assembly) -> tuple[EventFunction, ...]:
    """Return the events that read reactions, in maximal coordinates."""
    symbols = [one.symbol for one in assembly.reactions]

    def make() -> tuple[EventFunction, ...]:
        every = list_event_functions(assembly.mechanism, assembly.maximal, assembly.reactions, assembly.modes)
        return tuple(one for one in every if depends_on(one.value, symbols))

    return assembly.shared.get(_REACTION_EVENTS, make)


def _solve_impact(
    now: BalanceValues, u: FloatArray, sizes: FloatArray, rows: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return velocities after an impact, and impulses: those of least size where constraints depend on each other.

    All is written in displacements of the scene's size, and impulses come out as their work along these: what is small
    beside the rest is then small in truth, and not in its unit.
    """
    if not is_full(now.mass):
        from atwood.linalg.sparse import solve_bordered

        solved = solve_bordered(now.mass, now.jacobian, -(now.mass @ u), now.explicit_rate)
        if solved is not None:
            return solved[0], solved[1] * rows
    m, n = len(now.gamma), len(u)
    mass, slope = sizes[:, None] * to_array(now.mass) * sizes, to_array(scaled(now.jacobian, sizes, rows))
    mass = mass / (np.max(np.abs(mass), initial=0.0) or 1.0)
    matrix = np.block([[mass, -slope.T], [slope, np.zeros((m, m))]])
    found = np.linalg.lstsq(matrix, np.concatenate([mass @ (u / sizes), -now.explicit_rate / rows]), rcond=1e-12)[0]
    return found[:n] * sizes, found[n:]


def generalized_state(
    before: Assembly,
    after: Assembly,
    t: float,
    own: tuple[FloatArray, FloatArray],
    maximal: tuple[FloatArray, FloatArray],
    length: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the generalized coordinates and speeds, with quaternions, that give the same maximal ones.

    Parameters
    ----------
    before, after
        The scene that a state is of, and that whose generalized coordinates are sought.
    t
        Time.
    own, maximal
        The state in the coordinates of its own form, and in maximal ones.
    length
        Extent of the scene, m.

    Returns
    -------
    coordinates, speeds, miss
        The state, and by how much it misses the maximal coordinates, each in its own size.
    """
    equations = after.regular
    reduced_map, maximal_map = kinematic_map_of(after, "regular"), kinematic_map_of(after, "dae")
    program, rows, columns = _maximal_places(after)
    kernel = after.kernel(program)
    names = tuple(c.name for c in equations.names)
    known = [name for name in names if name in before.observables]
    q, still = reference_coordinates(equations), np.zeros(len(equations.speeds))
    if known:
        read = before.kernel(observer(before, tuple(known)))
        idle = [0.0] * len(before.reactions)
        values = read([t], *own, np.zeros_like(own[1]), idle)[0]
        for name, value in zip(known, values, strict=True):
            q[names.index(name)] = value
    turned = {orientation.body: list(orientation.coordinates) for orientation in after.maximal.orientation_coordinates}
    for orientation in equations.orientation_coordinates:
        if orientation.body in turned:
            q[list(orientation.coordinates)] = maximal[0][turned[orientation.body]]
    q = reduced_map.normalized(q)
    scales = motion_scales(after.maximal, length)
    matrix = np.zeros((len(scales), len(still)))
    for _ in range(30):
        now, _, entries = kernel([t], q, still)
        matrix[rows, columns] = entries
        miss = maximal_map.difference(t, maximal_map.normalized(np.asarray(now)), maximal[0]) / scales
        step = least_norm(matrix / scales[:, None], miss)
        q = reduced_map.moved(t, q, step)
        if float(np.max(np.abs(step), initial=0.0)) < 1e-14 * max(1.0, float(np.max(np.abs(q), initial=0.0))):
            break
    return q, generalized_speeds(after, t, q, maximal[1], scales), miss


def generalized_speeds(after: Assembly, t: float, q: FloatArray, speeds: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return the generalized speeds, with quaternions, that give the same speeds in maximal coordinates.

    Parameters
    ----------
    after
        The scene.
    t, q
        Time and generalized coordinates.
    speeds, sizes
        Speeds in maximal coordinates, and the size of a displacement along each.
    """
    program, rows, columns = _maximal_places(after)
    still = np.zeros(len(after.regular.speeds))
    matrix = np.zeros((len(sizes), len(still)))
    _, explicit_rate, matrix[rows, columns] = after.kernel(program)([t], q, still)
    return least_norm(matrix / sizes[:, None], (speeds - np.asarray(explicit_rate)) / sizes)


def _maximal_places(after: Assembly) -> tuple[Program, tuple[int, ...], tuple[int, ...]]:
    """Return the program that gives maximal coordinates, their speeds, the Jacobian of these, and its pattern.

    Speeds of bodies change with generalized speeds as their places do with displacements along these.
    """

    def make() -> tuple[Program, tuple[int, ...], tuple[int, ...]]:
        placing = to_maximal(after, "regular")
        derivative = jacobian(list(placing.outputs[1].expressions), list(after.regular.speeds))
        outputs = (*placing.outputs, OutputGroup("jacobian", tuple(derivative.entries)))
        program = Program(f"{after.flat.name} change of mode", placing.inputs, after.parameters, outputs)
        return program, derivative.rows, derivative.columns

    return after.shared.get(_MAXIMAL, make)
