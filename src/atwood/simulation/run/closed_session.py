"""Explicit methods for mechanisms whose loops are solved by formulas: what is integrated and what is handed out.

A session has the independent coordinates for its unknowns; whoever uses it gives and gets all coordinates and speeds of
the reduced form. Dead centres and quarter turns of counted directions are event functions beside those of the scene.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, substitute
from atwood.forms.caches import Key
from atwood.integrators.explicit_session import ExplicitSession, OnStiff
from atwood.integrators.methods import Method, Task
from atwood.integrators.protocol import LOOSEST, Budget, ExplicitProblem, SolverOptions, Statistics, Status, StepResult
from atwood.integrators.session import Session
from atwood.lazy_dataclasses import replace
from atwood.simulation.problem.closed_loops import Solved, levels, solve_at, stay_at
from atwood.simulation.problem.explicit_scene import explicit_problem_of
from atwood.simulation.run.session import SolverRequest, equations_of

if TYPE_CHECKING:
    from atwood.codegen.sundials.events import EventCode


_BETTER = 2.0
"""Another choice takes over where it is so many times as far from a dead centre."""


_FARTHEST = 0.3
"""Where dead centres may be near, no angle changes by more radians in a step.

One angle and its rate are so few unknowns that now and then an estimate of the error is small by chance: of steps twice
as long, one in some thousands erred by a thousand tolerances.
"""

_FIRST = 0.05
"""The first step after a change of coordinates, as a share of that."""


class ClosedLoopSession(Session):
    """A run in progress, of the independent coordinates of closed loops.

    Parameters
    ----------
    request
        What is to be solved.
    method
        An explicit method.
    t, y
        Start values of all coordinates and speeds.
    solved
        The loops on the branch of the start.
    on_stiff
        See `~atwood.integrators.explicit_session.ExplicitSession`.
    on_dead_centre
        Called with the time and the state where a dead centre of every choice comes near; the session then ends with
        `Status.STIFF`.
    """

    solves_loops = True

    def __init__(
        self,
        request: SolverRequest,
        method: Method,
        t: float,
        y: FloatArray,
        solved: Solved,
        on_stiff: OnStiff | None,
        on_dead_centre: Callable[[float, FloatArray], None] | None,
    ) -> None:
        self._request, self._method, self._on_stiff, self._on_dead_centre = request, method, on_stiff, on_dead_centre
        self._before = Statistics(error_test_failures=0, convergence_failures=0)
        self._solved = solved
        self._count = len(request.probe.directions)
        self._events: Program | None = None
        self._session = self._open(t, solved.reduced(y))

    @property
    def statistics(self) -> Statistics:
        """What the session has cost so far, over all its choices."""
        return self._before + self._session.statistics

    @property
    def here(self) -> StepResult:
        """The state that was handed out last."""
        here = self._session.here
        return replace(here, y=self._solved.state(here.t, here.y), events=here.events[: self._count])

    @property
    def handed_on(self) -> tuple[int, ...]:
        """What a start from here is to know of the events of parts."""
        return self._session.handed_on[: self._count]

    @property
    def states(self) -> int:
        """How many unknowns are integrated at present."""
        loops = self._solved.form.loops
        return len(loops.independent) + len(loops.speeds)

    def reinitialize(self, t: float, y: FloatArray, yp: FloatArray | None = None) -> None:
        """Go on from another state."""
        solved = self._at(t, y)
        if solved is None:
            raise UsageError("formulas do not lead to this state")
        self._change(t, y, solved)

    def advance(self, t_out: float) -> StepResult:
        """Go on to exactly a time, or stop earlier at an event, a limit or a failure."""
        while True:
            found = self._handed_out(self._session.advance(t_out))
            if found is not None:
                return found

    def sample(self, times: FloatArray) -> tuple[FloatArray, FloatArray, StepResult]:
        """Go on through many times at once, as far as nothing stops it."""
        parts: list[FloatArray] = []
        done = 0
        while True:
            y, _, result = self._session.sample(times[done:])
            is_often = self._request.plan.pays(self._solved.form.states, len(y))
            parts.append(self._solved.states(times[done : done + len(y)], y, is_often))
            done += len(y)
            found = self._handed_out(result, parts[-1][-1] if len(y) and result.status is Status.REACHED else None)
            if found is not None:
                values = np.concatenate(parts)
                return values, np.zeros_like(values), found

    # -- choices --------------------------------------------------------------------------------------------------

    def _handed_out(self, result: StepResult, known: FloatArray | None = None) -> StepResult | None:
        """Return what is handed out; None where only a choice or a count has changed and the run goes on."""
        y = self._solved.state(result.t, result.y) if known is None else known
        full = replace(result, y=y, yp=self._rates(result, y), events=tuple(result.events[: self._count]))
        if result.status is not Status.EVENT:
            return full
        own = [i for i, fired in enumerate(result.events[self._count :]) if fired]
        margins = 2 * self._watched(self._solved)[0]
        dead = any(i < margins for i in own)
        for i in own:
            if i >= margins:
                self._solved = self._solved.flipped(i - margins, result.t, result.y)
        if any(full.events):
            return full
        if dead:
            solved = self._better(result, y)
            if solved is None:
                if self._on_dead_centre is not None:
                    self._on_dead_centre(result.t, y)
                return replace(full, status=Status.STIFF, message="a dead centre is near")
            self._change(result.t, y, solved)
        elif own and self._reads_counts():
            self._change(result.t, y, self._solved)
        return None

    def _better(self, result: StepResult, y: FloatArray) -> Solved | None:
        """Return the best choice from here on: the present one unless another is clearly farther from a dead centre."""
        found = self._at(result.t, y)
        if found is None or found.form is self._solved.form:
            return found
        plan = self._request.plan
        here = stay_at(plan, self._solved.form, result.t, *plan.program.split(y))
        return found if here is None or found.margin > _BETTER * here.margin else here

    def _at(self, t: float, y: FloatArray) -> Solved | None:
        plan = self._request.plan
        return solve_at(plan, t, *plan.program.split(y))

    def _change(self, t: float, y: FloatArray, solved: Solved) -> None:
        """Go on from a state with another choice, or on another branch."""
        self._before, self._solved = self.statistics, solved
        self._before = replace(self._before, reinitializations=self._before.reinitializations + 1)
        self._session = self._open(t, solved.reduced(y))

    def _rates(self, result: StepResult, y: FloatArray) -> FloatArray:
        plan = self._request.plan
        q, u = plan.program.split(y)
        return np.concatenate([plan.balance.kinematic_map.rates(result.t, q, u), np.zeros_like(u)])

    def _reads_counts(self) -> bool:
        """Return whether what is integrated or looked for reads an angle whose half turns are counted."""
        found = self._solved.form
        symbols = [symbol for one in found.loops.counted for symbol in one.symbols]
        read = [*found.accelerations.program.results, *(() if self._events is None else self._events.results)]
        return any(depends_on(one, symbols) for one in read)

    # -- sessions -------------------------------------------------------------------------------------------------

    def _open(self, t: float, y: FloatArray) -> Session:
        request, solved, probe = self._request, self._solved, self._request.probe
        found, assembly = solved.form.accelerations, solved.assembly
        margins, counted = self._watched(solved)
        low, near = levels(solved)
        shifts = np.repeat([-low, -near, 0.0], [margins, margins, counted])
        directions = (*probe.directions, *(-1 for _ in range(2 * margins)), *(0 for _ in range(counted)))
        given, guard = self._on_stiff, request.guard(self._method, (solved.form, solved.values))

        def on_stiff(t: float, y: FloatArray) -> bool:
            return given is not None and given(t, self._solved.state(t, y))

        asked, longest = None if given is None else on_stiff, np.inf
        if not solved.is_clear:
            about = solved, t, y.tobytes()
            longest = assembly.kept.get(_LONGEST, lambda: self._longest_step(solved, t, y), *about)
        can_go_on = self._method.tableau is not None or self._method.kind == "series"
        # What dead centres and counts are looked out for with has the values of these loops; events of parts have more.
        is_kept = can_go_on and not (probe.directions or self._before.steps) and guard is None
        known = request.kept.begin_again(request, self._method, t, y, asked, solved) if is_kept else None
        if known is not None:
            known.limit_steps(longest)
            code = self._event_code(solved) if directions else None
            self._events = None if code is None else code[0]
            return known
        problem = explicit_problem_of(
            assembly, found, solved.values, self._function(solved, shifts) if directions else None, directions
        )
        # Choices change at the end of a step, and not within it, where a state is known less well.
        first = len(probe.directions)
        ends = (*range(first, first + margins), *range(first + 2 * margins, len(directions)))
        own = self.handed_on if self._before.steps else probe.handed
        signs = (*own, *(0 for _ in directions[first:])) if own else ()
        problem = replace(problem, event_rough=(*probe.rough, *ends), event_signs=signs, guard=guard)
        self._events = None
        if directions and problem.compiled is not None:
            problem = self._with_compiled(problem, solved, shifts)
        settings, budget = self._settings(t, solved), self._budget()
        if self._before.steps and np.isfinite(longest):  # steps grow by themselves from one that is surely short
            settings = replace(settings, first_step=min(_FIRST * longest, settings.horizon))
        series, canonical = equations_of(request, problem, (t, y), solved)
        task = Task(
            settings,
            t,
            y,
            budget=budget,
            end=request.end,
            on_stiff=asked,
            explicit=problem,
            series=series,
            hamiltonian=canonical,
        )
        session = self._method.open(task)
        if is_kept and problem.compiled is not None and not (directions and problem.compiled_events is None):
            assert isinstance(session, ExplicitSession)
            request.kept.keep(request, self._method, asked, session, lambda one: session.stop_at(one.end), solved)
        if np.isfinite(longest):
            session.limit_steps(longest)
        return session

    @staticmethod
    def _longest_step(solved: Solved, t: float, y: FloatArray) -> float:
        """Return in what time no angle changes by more than formulas near a dead centre let be estimated."""
        names, speed_names = solved.assembly.reduced.names, solved.assembly.reduced.speed_names
        is_angular = np.array([one.unit == "rad/s" for one in speed_names])
        fastest = float(np.max(np.abs(solved.state(t, y)[len(names) :][is_angular]), initial=0.0))
        return _FARTHEST / fastest if fastest > 0.0 else np.inf

    @staticmethod
    def _watched(solved: Solved) -> tuple[int, int]:
        """Return how many dead centres and counted directions are looked out for."""
        return 0 if solved.is_clear else len(solved.form.loops.margins), len(solved.form.loops.counted)

    def _settings(self, t: float, solved: Solved) -> SolverOptions:
        settings = self._request.settings(t, LOOSEST)
        absolute = np.asarray(settings.absolute_tolerances)
        return replace(settings, absolute_tolerances=solved.reduced(absolute))

    def _budget(self) -> Budget:
        budget = self._request.budget
        if budget.max_steps is None:
            return budget
        return replace(budget, max_steps=max(0, budget.max_steps - self._before.steps))

    def _function(self, solved: Solved, shifts: FloatArray) -> Callable[[float, FloatArray, FloatArray], FloatArray]:
        """Return all event functions, in Python."""
        own = self._request.probe.function()
        n, kernel = len(solved.independent), solved.kernel(solved.form.watched)
        margins, _ = self._watched(solved)
        first = len(solved.form.loops.margins) - margins

        def values(t: float, y: FloatArray, yp: FloatArray) -> FloatArray:
            found = kernel([t], y[:n], y[n:])[0][first:]
            watched = np.array([*found[:margins], *found]) + shifts
            if own is None:
                return watched
            full = solved.state(t, y)
            return np.concatenate([own(t, full, np.zeros_like(full)), watched])

        return values

    def _with_compiled(self, problem: ExplicitProblem, solved: Solved, shifts: FloatArray) -> ExplicitProblem:
        """Return a problem whose event functions are machine code too, if they can be."""
        made = self._event_code(solved)
        if made is None:
            return problem
        self._events, code = made
        data = code.bind(solved.values, np.concatenate([self._request.probe.shift, shifts]))
        return replace(problem, events=data.function(), compiled_events=data)

    def _event_code(self, solved: Solved) -> tuple[Program, EventCode] | None:
        """Return all event functions, and their machine code; None where there is none."""
        request, shared = self._request, solved.assembly.shared
        about = solved.form, solved.is_clear, request.plan.finding.kept, request.probe.key
        return shared.get(_CODE, lambda: _event_code(request, solved), *about)


_CODE: Key[tuple[Program, EventCode] | None] = Key("event functions with dead centres")

_LONGEST: Key[float] = Key("the longest step where dead centres are looked out for, at the state last asked about")


def _event_code(request: SolverRequest, solved: Solved) -> tuple[Program, EventCode] | None:
    """Return the event functions of a scene, then dead centres and counted directions, as machine code."""
    form, assembly = solved.form, solved.assembly
    watched = form.watched
    graph = assembly.reduced.graph
    own: list[Expression] = []
    shift: tuple[Expression, ...] = ()
    if request.probe.directions:
        found = request.probe.program()
        if found is None:
            return None
        own, shift = substitute(list(found.results), form.known), found.inputs[3].symbols
    all_ahead, margins = watched.outputs[0].expressions, len(form.loops.margins)
    ahead = all_ahead[margins:] if solved.is_clear else (*all_ahead[:margins], *all_ahead)  # margins have two levels
    more = tuple(graph.symbol(f"event shift of loops {i}") for i in range(len(ahead)))
    values = (*own, *(v + s for v, s in zip(ahead, more, strict=True)))
    groups = (*watched.inputs, InputGroup("shift", (*shift, *more)))
    program = Program(f"{watched.name} and events", groups, watched.parameters, (OutputGroup("events", values),))
    if program.calls_python:
        return None
    from atwood.codegen.sundials.events import compile_events

    return program, compile_events(program, for_ida=False)
