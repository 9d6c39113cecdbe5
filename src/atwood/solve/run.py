"""Runs: from start to end through all modes, with projected outputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from atwood.errors import SolveError, TopologyError, UsageError
from atwood.forms.assembly import Assembly
from atwood.solve.breaks import find_breaks
from atwood.solve.driver import Advance, Budget, Session, SolverOptions, Statistics, Status
from atwood.solve.modes import EventProbe, Happening, enter_mode
from atwood.solve.options import RunOptions, choose_solver, sample_times
from atwood.solve.problem import Plan, make_plan, pack_state
from atwood.solve.record import Recorder, Segment
from atwood.solve.scales import scene_length
from atwood.solve.start import Start, own_state

__all__ = ["Run", "run"]

FloatArray = NDArray[np.float64]

_CHATTER = 50
"""So many changes of mode without time passing end a run."""


@dataclass(frozen=True, eq=False)
class Run:
    """What a run produced.

    Attributes
    ----------
    segments
        The stretches between changes of mode.
    happenings
        Events, in order.
    statistics
        What the solver did.
    status
        ``"finished"``, ``"stopped"`` by an event, or ``"step_limit"``, ``"time_limit"``, ``"interrupted"``,
        ``"failed"``.
    message
        Why it ended, in words.
    start
        The start.
    options
        What was asked for.
    solver
        What solved it: a key of `SOLVERS`.
    """

    segments: tuple[Segment, ...]
    happenings: tuple[Happening, ...]
    statistics: Statistics
    status: str
    message: str
    start: Start
    options: RunOptions
    solver: str


def run(
    assembly: Assembly,
    start: Start,
    options: RunOptions,
    reassemble: Callable[[Mapping[str, str], Mapping[tuple[str, str, str], float]], Assembly],
) -> Run:
    """Run a scene from its start to its end.

    Parameters
    ----------
    assembly, start
        The scene and its start.
    options
        How.
    reassemble
        Gives the scene in other modes, with lengths on a line signed as given.

    Raises
    ------
    UsageError
        If the end is not after the start.
    SolveError
        If the solver fails; what came before is in its `run` attribute.
    """
    t = start.time
    if not options.t_end > t or not np.isfinite(options.t_end):
        raise UsageError(
            f"the end, t = {options.t_end:g}, is not after the start, t = {t:g}", advice="Give a later t_end."
        )
    solver = choose_solver(options.solver)
    times, shown = sample_times(t, options)
    _check_prescribed(assembly, times)
    q, u = own_state(assembly, start)
    breaks = find_breaks(assembly, t, options.t_end)
    segments: list[Segment] = []
    happenings: list[Happening] = []
    statistics = Statistics(error_test_failures=0, convergence_failures=0)
    recent, impact, show = 0, False, bool(shown[0])
    plan: Plan | None = None
    while True:
        if plan is None:
            plan = make_plan(assembly, t, q, u, start.length, options.t_end - start.time)
            probe = EventProbe(plan, t, q, u, options.relative_tolerance)
        recorder = Recorder(plan)
        limit = float(np.min(breaks[breaks[:, 0] > t, 0], initial=options.t_end))
        ahead = _until(times, shown, t, limit)
        outcome = _run_mode(plan, probe, recorder, t, q, u, ahead, show, limit, options, solver, statistics)
        segments.append(recorder.segment(impact))
        statistics = statistics + outcome.statistics
        status, message = outcome.status, outcome.message
        recent = recent + 1 if outcome.t - t < 1e-9 * (options.t_end - start.time) else 0
        t = outcome.t
        if outcome.happening is None:
            if status == "finished" and t < options.t_end:  # a law switches by the clock: on behind it
                behind = float(breaks[breaks[:, 0] == t, 1][0])
                show = bool(np.any(shown[(times > t) & (times <= behind)]))
                t, q, u, impact = behind, recorder.q[-1], recorder.u[-1], False
                continue
            break
        happenings.append(outcome.happening)
        if outcome.happening.target == "stop":
            status, message = "stopped", outcome.happening.describe()
            break
        if recent > _CHATTER:
            status, message = "failed", f"{outcome.happening.part} changes its mode endlessly at t = {t:.9g}"
            break
        assembly, q, u = enter_mode(
            (t, recorder.q[-1], recorder.u[-1]), assembly, outcome.happening, reassemble, start.length
        )
        plan, impact, show = None, outcome.happening.impact, True
        if t >= options.t_end:
            status, message = "finished", ""
            break
    made = Run(tuple(segments), tuple(happenings), statistics, status, message, start, options, solver)
    if status == "failed":
        error = SolveError(message, where=assembly.flat.name, advice="Look at what came before: the error's `run`.")
        error.run = made  # type: ignore[attr-defined]
        raise error
    return made


def _check_prescribed(assembly: Assembly, times: FloatArray) -> None:
    """Refuse motions that are prescribed for what is held, or twice over, where they contradict each other."""
    prescribed = assembly.equations.prescribed
    if not prescribed:
        return
    program = assembly.known_program("prescribed", "prescribed", lambda: [value for _, value in prescribed])
    n, m = len(assembly.equations.coordinates), len(assembly.equations.speeds)
    idle = (np.zeros(n), np.zeros(m), np.zeros(m), np.zeros(len(assembly.reactions)))
    misses = np.abs(assembly.kernel(program, vectorized=True)(times[None, :], *idle)[0])
    if float(np.max(misses)) > 1e-9 * scene_length(assembly):
        worst, moment = np.unravel_index(int(np.argmax(misses)), misses.shape)
        part, law, _ = prescribed[int(worst)][0]
        raise TopologyError(
            f"it cannot hold: at t = {times[moment]:.6g} what is prescribed contradicts what is held, by "
            f"{misses[worst, moment]:.3g}",
            where=f"{part}.{law}",
            advice="Two drives, or a drive and a fixed part, say different things about the same motion.",
        )


def _until(times: FloatArray, shown: NDArray[np.bool_], t: float, limit: float) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the samples after one time up to another, which is among them."""
    ahead = (times > t) & (times <= limit)
    chosen, seen = times[ahead], shown[ahead]
    if len(chosen) and chosen[-1] == limit:
        return chosen, seen
    return np.append(chosen, limit), np.append(seen, False)


@dataclass(frozen=True)
class _Outcome:
    t: float
    status: str
    message: str
    happening: Happening | None
    statistics: Statistics


def _run_mode(
    plan: Plan,
    probe: EventProbe,
    recorder: Recorder,
    t: float,
    q: FloatArray,
    u: FloatArray,
    ahead: tuple[FloatArray, NDArray[np.bool_]],
    first_shown: bool,
    limit: float,
    options: RunOptions,
    solver: str,
    spent: Statistics,
) -> _Outcome:
    """Integrate in one mode until a time, an event or a limit of the run."""
    times, shown = ahead
    n = plan.program.coordinates
    y, yp = (np.zeros(0), np.zeros(0)) if n == 0 else pack_state(plan, t, q, u)
    recorder.take(t, y, first_shown)
    already = probe.broken_at_start(t)
    if already is not None:
        return _Outcome(t, "event", "", already, Statistics())
    if n == 0:
        return _follow(probe, recorder, t, times, shown, options)
    session = _open(plan, probe, options, solver, t, limit, y, yp, spent)
    try:
        return _integrate(plan, probe, recorder, session, times, shown, options)
    except KeyboardInterrupt:  # from the progress function, or between two steps; what is there already is kept
        t = recorder.close()
        return _Outcome(t, "interrupted", f"interrupted (at t = {t:.9g})", None, session.statistics)


def _follow(
    probe: EventProbe,
    recorder: Recorder,
    t: float,
    times: FloatArray,
    shown: NDArray[np.bool_],
    options: RunOptions,
) -> _Outcome:
    """Go through a mode in which nothing is free to move: its state is a function of time, its events still happen."""
    nothing, last = np.zeros(0), t
    for moment, show in zip(times, shown, strict=True):
        happening = probe.between(last, float(moment))
        if happening is not None:
            recorder.take(happening.time, nothing, True)
            return _Outcome(happening.time, "event", "", happening, Statistics())
        last = float(moment)
        recorder.take(last, nothing, show)
        if options.progress is not None:
            options.progress(last)
    return _Outcome(last, "finished", "", None, Statistics())


def _integrate(
    plan: Plan,
    probe: EventProbe,
    recorder: Recorder,
    session: Session,
    times: FloatArray,
    shown: NDArray[np.bool_],
    options: RunOptions,
) -> _Outcome:
    """Advance from sample to sample."""
    split = plan.program.split
    for moment, show in zip(times, shown, strict=True):
        advance = session.advance(float(moment))
        if advance.status is Status.FAILED and plan.review_dependent(advance.t, split(advance.y)[0]):
            _restart(plan, session, advance)
            advance = session.advance(float(moment))
        if advance.status is Status.REACHED:
            q, u = recorder.take(advance.t, advance.y, show)
            plan.review_output(advance.t, q)
            _repair(plan, recorder, session, advance, q, u, options)
        elif advance.status is Status.EVENT:
            q, u = recorder.take(advance.t, advance.y, True)
            happening = probe.name(advance.t, advance.events)
            return _Outcome(advance.t, "event", "", happening, session.statistics)
        else:
            if not recorder.time or advance.t > recorder.time[-1]:
                recorder.take(advance.t, advance.y, True)
            return _Outcome(advance.t, advance.status.value, advance.message, None, session.statistics)
        if options.progress is not None:
            options.progress(float(moment))
    return _Outcome(float(times[-1]), "finished", "", None, session.statistics)


def _open(
    plan: Plan,
    probe: EventProbe,
    options: RunOptions,
    solver: str,
    t: float,
    limit: float,
    y: FloatArray,
    yp: FloatArray,
    spent: Statistics,
) -> Session:
    settings = SolverOptions(
        relative_tolerance=options.relative_tolerance,
        absolute_tolerances=plan.tolerances(options.relative_tolerance),
        max_step=_max_step(options, t, limit),
        max_order=options.max_order,
        horizon=options.t_end - t if options.t_end > t else 1.0,
    )
    budget = Budget(
        max_steps=None if options.max_steps is None else max(0, options.max_steps - spent.steps),
        wall_seconds=None if options.max_seconds is None else max(0.0, options.max_seconds - spent.seconds),
        poll=plan.poll(solver),
    )
    if solver == "explicit":
        return _open_explicit(plan, probe, settings, budget, t, y)
    problem = plan.problem(probe.function(), probe.directions)
    if solver == "ida":
        from atwood.solve import ida_native

        tuning = ida_native.IdaTuning(angle_like=plan.angles, stop_time=limit)
        return ida_native.open_session(problem, settings, t, y, yp, budget, tuning)
    from atwood.solve.ida_sundae import open_session

    return open_session(problem, settings, t, y, yp, budget)


def _max_step(options: RunOptions, t: float, limit: float) -> float | None:
    """Return the largest step: up to a switch by the clock, so short that nothing is passed over unseen."""
    if limit >= options.t_end:
        return options.max_step
    share = 0.25 * (limit - t)
    return share if options.max_step is None else min(share, options.max_step)


def _open_explicit(
    plan: Plan, probe: EventProbe, settings: SolverOptions, budget: Budget, t: float, y: FloatArray
) -> Session:
    from atwood.solve.explicit_scene import explicit_problem
    from atwood.solve.explicit_session import open_explicit

    assembly = plan.assembly
    problem = explicit_problem(assembly, probe.function(), probe.directions) if assembly.form == "reduced" else None
    if problem is None:
        raise UsageError(
            "the explicit method needs the reduced form of a scene without closed loops",
            where=assembly.flat.name,
            advice="Use the solver 'ida'.",
        )
    return open_explicit(problem, settings, t, y, budget)


def _restart(plan: Plan, session: Session, advance: Advance) -> None:
    q, u = (part.copy() for part in plan.program.split(advance.y))
    q, u = plan.balance.project(advance.t, q, u, plan.sizes)
    session.reinitialize(advance.t, *pack_state(plan, advance.t, q, u))


def _repair(
    plan: Plan,
    recorder: Recorder,
    session: Session,
    advance: Advance,
    q: FloatArray,
    u: FloatArray,
    options: RunOptions,
) -> None:
    """Go on from the recorded state where the solver's own has strayed.

    At index 1 with projection that is where the drift outgrows the error of the steps; for any orientation, where the
    size of its coordinates is no longer near one.
    """
    drift = max(recorder.held[-1]) if plan.program.level == "index1-projected" else 0.0
    strays = plan.balance.turning.strays(plan.program.split(advance.y)[0])
    if strays or drift > 100.0 * options.relative_tolerance:
        session.reinitialize(advance.t, *pack_state(plan, advance.t, q, u))
