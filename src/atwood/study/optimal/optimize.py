"""Inputs with which a motion costs least."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from functools import partial
from typing import Any

import numpy as np

from atwood.arguments import ANYTHING, BY_PATH, number, one_of, optional, takes, whole
from atwood.arrays import FloatArray
from atwood.errors import SolveError, UnsupportedError, UsageError
from atwood.expr import Expression, Graph, substitute
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.compose.composite import Model
from atwood.model.values.units import parse_quantity, parse_unit
from atwood.numerics.matrices import least_norm, or_one
from atwood.pipeline import SCENE, refuse_contacts, simulate, smooth_assembly_of
from atwood.result.result import Result
from atwood.simulation.dynamics.scales import coordinate_scales, motion_scales, scene_length
from atwood.simulation.problem.arguments import FORM
from atwood.study.optimal.collocation import POINTS, Collocation, Task
from atwood.study.optimal.interior_point import Found, least
from atwood.study.optimal.points import PointFunctions
from atwood.study.sensitivities.augmented import Augmented
from atwood.study.sensitivities.inputs import HELD, INPUTS, LINEAR, Driven, with_inputs
from atwood.study.sensitivities.quantities import written
from atwood.table import Shown, Table, table

_ROUNDS = 8
"""A mesh is refined so often at most."""

_BEYOND = 1e-6
"""In sizes of the quantities: what goes no further beyond a bound keeps to it."""

_WIDEST = 0.1
"""Intervals whose error is estimated as this share of the largest are halved."""


@dataclass(frozen=True, eq=False)
class Optimum(Shown):
    """Inputs with which a motion costs least, near by.

    Attributes
    ----------
    result
        The run with these inputs, as `atwood.simulate` makes it.
    inputs
        Times and values of each input at the nodes, in SI units, by path.
    cost
        What was to be least.
    duration
        How long the motion takes, s.
    error
        By how much the end of the run differs from that of the collocation, in the scene's sizes and times.
    intervals, steps
        Of the last mesh; of the method, on all meshes.
    """

    result: Result = field(repr=False)
    inputs: dict[str, tuple[FloatArray, FloatArray]]
    cost: float
    duration: float
    error: float
    intervals: int
    steps: int

    def tables(self) -> Sequence[Table]:
        """Return what was found, and the inputs."""
        facts = [
            ("cost", f"{self.cost:.12g}"),
            ("duration", f"{self.duration:.9g} s"),
            ("intervals", str(self.intervals)),
            ("error of the end", f"{self.error:.2g}"),
        ]
        title = f"Least cost of {self.result.assembly.flat.name}"
        rows = [
            (path, values[0], float(np.min(values)), float(np.max(values)), values[-1])
            for path, (_, values) in self.inputs.items()
        ]
        return [
            table(("", ""), facts, title=title),
            table(("input", "at the start", "least", "largest", "at the end"), rows),
        ]


class _Seen(Mapping[str, Any]):
    """What an objective is made of: quantities and inputs by path, and ``"time"``, as expressions."""

    def __init__(self, known: Mapping[str, Expression], find: Callable[[str], Expression], assembly: Assembly) -> None:
        self._known, self._find, self._assembly = known, find, assembly

    def __getitem__(self, path: str) -> Any:
        return self._known[path] if path in self._known else self._find(path)

    def __iter__(self) -> Iterator[str]:
        return iter((*self._known, *self._assembly.observables))

    def __len__(self) -> int:
        return len(self._known) + len(self._assembly.observables)


@takes(
    scene=SCENE,
    objective=ANYTHING,
    inputs=INPUTS,
    end=optional(BY_PATH),
    bounds=optional(BY_PATH),
    at_end=ANYTHING,
    t_end=ANYTHING,
    guess=optional(BY_PATH),
    between=one_of((LINEAR, HELD)),
    intervals=whole("a number of intervals", 2, 10_000),
    form=optional(FORM),
    tolerance=number("a tolerance between 0 and 1", above=0.0, below=1.0),
)
def optimize(
    scene: Model | Assembly,
    objective: Callable[[Mapping[str, Any]], Any] | str,
    *,
    inputs: Mapping[str, Any] | Iterable[str],
    end: Mapping[str, Any] | None = None,
    bounds: Mapping[str, Any] | None = None,
    at_end: Callable[[Mapping[str, Any]], Any] | None = None,
    t_end: Any = None,
    guess: Mapping[str, Any] | None = None,
    between: str = LINEAR,
    intervals: int = 20,
    form: str | None = None,
    tolerance: float = 1e-7,
) -> Optimum:
    """Return the inputs with which a motion costs least.

    States at Gauss's points and inputs at nodes are unknowns, the equations of motion are equations between them
    (direct collocation), and all derivatives are those of the scene's expressions. The mesh is refined until
    `atwood.simulate` with these inputs ends in the same state, and keeps to the bounds.

    Parameters
    ----------
    scene
        A smooth scene, or an assembly of it, with its start.
    objective
        A function of what is seen, whose integral over the motion is to be least: a mapping of quantities and inputs
        by path, and ``"time"``, in plain arithmetic, as ``lambda seen: seen["push.value"] ** 2``. Or ``"time"``.
    inputs
        Inputs (signals) by path, each with its least and its largest value, or None: ``{"push.value": (-10, 10)}``;
        or paths alone.
    end
        What is to hold at the end: quantities by path with a value, or the least and the largest.
    bounds
        The least and the largest value of quantities along the motion, by path. They are conditions at the nodes; where
        the run goes beyond one in between by more than a millionth of the quantity's size, the mesh is refined.
    at_end
        A function as `objective` is, whose value at the end is added to the cost.
    t_end
        When the motion ends, s; or the earliest and the latest such time; the scene's own end when not given.
    guess
        What to begin from: inputs, and quantities along the motion, by path: a number, or rows of time and value. The
        states of the first mesh are those nearest to a straight line in which these quantities have their values.
    between
        What an input is between two nodes: ``"linear"`` or ``"held"``.
    intervals
        Of the first mesh.
    form
        See `atwood.simulate`.
    tolerance
        By how much the end of the run may differ from that of the collocation, in the scene's sizes and times.

    Returns
    -------
    Optimum
        The inputs, what they cost, and the run with them.

    Raises
    ------
    UsageError
        If a path is none, or a range is empty.
    SolveError
        If no motion meets all conditions, or none is found, or an event happens on the way.
    """
    assembly = smooth_assembly_of(scene, form=form)
    begin = assembly.flat.t_start
    paths = dict(inputs) if isinstance(inputs, Mapping) else dict.fromkeys(inputs)
    if not paths:
        raise UsageError("no inputs are given that could be chosen", where=assembly.flat.name)
    span = _duration(assembly, t_end)
    given = dict(guess or {})
    courses = {path: _course(path, given[path]) for path in given if path not in paths}
    nodes: dict[str, Any] = {path: given.get(path, 0.0) for path in paths}
    first = begin + span[1]
    rows = {path: one if np.ndim(one) else [(begin, one), (first, one)] for path, one in nodes.items()}
    driven, made = with_inputs(assembly, rows, LINEAR, first)
    refuse_contacts(driven)
    task = _task(driven, made, objective, at_end, end or {}, bounds or {}, paths, span, courses)
    task = replace(task, is_held=between == HELD)
    return _refined(assembly, task, made, intervals, tolerance)


def _course(path: str, given: Any) -> FloatArray:
    """Return rows of time and value of a quantity that is guessed."""
    try:
        found = np.array(given, dtype=float)
    except (TypeError, ValueError):
        found = np.array(np.nan)
    rows = np.array([[0.0, float(found)]]) if found.ndim == 0 else found
    if not (rows.ndim == 2 and rows.shape[1] == 2 and np.all(np.isfinite(rows)) and np.all(np.diff(rows[:, 0]) > 0.0)):
        raise UsageError(
            f"its guess is {given!r}", where=path, advice="Give a number, or rows of time and value whose times rise."
        )
    return rows


def _duration(assembly: Assembly, t_end: Any) -> tuple[float, float]:
    """Return the least and the largest duration, s."""
    begin, where = assembly.flat.t_start, "t_end"
    given = assembly.flat.t_end if t_end is None else t_end
    low, high = given if isinstance(given, (tuple, list)) and len(given) == 2 else (given, given)
    found = tuple(_number(one, "s", where) - begin for one in (low, high))
    if not 0.0 < found[0] <= found[1] < np.inf:
        raise UsageError(f"there is no time from {found[0]:g} s to {found[1]:g} s after the start", where=where)
    return found[0], found[1]


def _number(value: Any, unit: str, where: str) -> float:
    if isinstance(value, str):
        return parse_quantity(value, parse_unit(unit or "1"), where)
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or np.isnan(value):
        raise UsageError(f"{value!r} is no number", where=where, advice="Give a number, or text with a unit.")
    return float(value)


def _ranges(given: Mapping[str, Any], units: Mapping[str, str]) -> FloatArray:
    """Return the least and the largest value of each path, shape (paths, 2)."""
    found = np.empty((len(given), 2))
    for k, (path, one) in enumerate(given.items()):
        if one is None:
            found[k] = -np.inf, np.inf
            continue
        pair = one if isinstance(one, (tuple, list)) and len(one) == 2 else (one, one)
        found[k] = [_number(value, units[path], path) for value in pair]
        if not found[k, 0] <= found[k, 1] or (np.isinf(found[k, 0]) and found[k, 0] == found[k, 1]):
            raise UsageError(f"its range from {found[k, 0]:g} to {found[k, 1]:g} is empty", where=path)
    return found


def _refuse_pieces(assembly: Assembly, made: Sequence[Driven]) -> None:
    """Refuse scenes whose equations change at moments of their own, or where something passes a place."""
    if assembly.relations or assembly.sides is not None:
        raise UnsupportedError(
            "a function of time, or a law that compares what moves, has pieces, and the motion is not smooth",
            where=assembly.flat.name,
            advice="Put a smooth function in its place, such as a tanh for a step.",
        )
    own = {one.part for one in made}
    other = next((one.path for one in assembly.discrete_states if one.path.rpartition(".")[0] not in own), None)
    if other is not None:
        raise UnsupportedError(
            "its values change at moments, between which a motion is not smooth",
            where=other,
            advice="Leave that part out, or put a law in its place that has no such moments.",
        )


def _task(
    assembly: Assembly,
    made: Sequence[Driven],
    objective: Callable[[Mapping[str, Any]], Any] | str,
    at_end: Callable[[Mapping[str, Any]], Any] | None,
    end: Mapping[str, Any],
    bounds: Mapping[str, Any],
    inputs: Mapping[str, Any],
    span: tuple[float, float],
    courses: Mapping[str, FloatArray],
) -> Task:
    """Return what is to be least, with all functions and their derivatives."""
    begin = assembly.flat.t_start
    segment = simulate(assembly, t_end=begin + 1e-3 * span[0], outputs=2).run.segments[0]
    plan, state = segment.plan, np.concatenate([segment.coordinates[:, 0], segment.speeds[:, 0]])
    _refuse_pieces(plan.assembly, made)
    equations = plan.assembly.own_equations
    augmented = Augmented(plan, begin, state, np.zeros((0, len(plan.assembly.parameters))))
    rates, symbols, known = _rates(augmented, made)

    def find(path: str) -> Expression:
        return substitute(list(written(plan, (path,), begin, state)), known)[0]

    drive = dict(zip((one.path for one in made), symbols, strict=True))
    seen = _Seen({**drive, "time": equations.time}, find, plan.assembly)
    cost = partial(_cost, seen, equations.graph)
    units = {
        path: plan.assembly.observables[path].unit for path in (*end, *bounds) if path in plan.assembly.observables
    }
    units |= {one.path: one.unit for one in made}

    if not callable(objective) and objective != "time":
        raise UsageError(f"{objective!r} is no objective", advice="Give a function of what is seen, or 'time'.")
    groups = (equations.time,), equations.coordinates, equations.speeds, symbols
    parameters = augmented.plain.accelerations.parameters
    make = partial(PointFunctions, plan.assembly, parameters, augmented.values, groups)
    motion = make([*rates, cost(objective, "objective")])
    ends, along = ([seen[path] for path in some] for some in (end, bounds))
    length, count = scene_length(assembly), len(equations.coordinates)
    sizes = np.concatenate([one(equations, length) for one in (coordinate_scales, motion_scales)])
    sizes[count:] /= span[0]
    task = Task(
        motion,
        make([*ends, cost(at_end, "at_end")]),
        make(along),
        _ranges(end, units),
        _ranges(bounds, units),
        _ranges(inputs, units),
        state,
        begin,
        span,
        (sizes, np.ones(len(made)), span[1]),
        guessed=make([seen[path] for path in courses]),
        courses=tuple(courses.values()),
    )
    task = replace(task, sizes=(_reached(task, made, count), *task.sizes[1:]))
    return replace(task, sizes=(task.sizes[0], _input_sizes(task, made, span[0]), span[1]))


def _cost(seen: _Seen, graph: Graph, function: Any, where: str) -> Expression:
    """Return what a function makes of what is seen: one for the time, zero for no function."""
    made = graph.one if isinstance(function, str) else graph.zero if function is None else function(seen)
    if not isinstance(made, (int, float, Expression)):
        raise UsageError(f"it returned {made!r}", where=where, advice="Return one number in plain arithmetic.")
    return graph.convert(made)


def _reached(task: Task, made: Sequence[Driven], coordinates: int) -> FloatArray:
    """Return sizes of states that are no smaller than what is to be reached with them; speeds follow coordinates."""
    sizes, point = task.sizes[0], _at_start(task, made)
    found = np.ones(len(sizes))
    for functions, given in ((task.ends, task.targets), (task.along, task.limits)):
        slopes = np.abs(functions.slopes(point).toarray()[: len(given), : len(sizes)]) * sizes
        largest = np.max(slopes, axis=1, initial=0.0)
        reach = np.max(np.abs(np.where(np.isfinite(given), given, 0.0)), axis=1, initial=0.0) / or_one(largest)
        moves = (slopes > 0.0) & (slopes >= 0.5 * largest[:, None])
        found = np.maximum(found, np.max(np.where(moves, reach[:, None], 0.0), axis=0, initial=0.0))
    if 2 * coordinates == len(found):
        found = np.tile(np.max(found.reshape(2, -1), axis=0), 2)
    return sizes * found


def _at_start(task: Task, made: Sequence[Driven]) -> FloatArray:
    return np.concatenate([task.start, [one.values[0] for one in made], [task.begin]])[None, :]


def _input_sizes(task: Task, made: Sequence[Driven], time: float) -> FloatArray:
    """Return sizes of inputs: their bounds, or what changes a speed by its size within a time."""
    n, m, sizes = len(task.start), len(made), task.sizes[0]
    slopes = np.abs(task.motion.slopes(_at_start(task, made)).toarray()[:n, n : n + m]) * time / sizes[:, None]
    effect = slopes.max(axis=0, initial=0.0)
    bounds = np.where(np.all(np.isfinite(task.inputs), axis=1), np.abs(task.inputs).max(axis=1), 0.0)
    return np.where(bounds > 0.0, bounds, 1.0 / or_one(effect))


def _rates(
    augmented: Augmented, made: Sequence[Driven]
) -> tuple[list[Expression], tuple[Expression, ...], dict[Expression, Expression | float]]:
    """Return rates of coordinates and speeds, symbols of the inputs, and what takes the place of their pieces."""
    assembly, plain = augmented.plan.assembly, augmented.plain
    graph = assembly.own_equations.graph
    held = {one.path: one.symbol for one in assembly.discrete_states}
    symbols = tuple(graph.symbol(f"input:{one.path}") for one in made)
    known: dict[Expression, Expression | float] = {}
    for one, symbol in zip(made, symbols, strict=True):
        first, value, slope = (held[f"{one.part}.piece[{i}]"] for i in range(3))
        known |= {first: 0.0, value: symbol, slope: 0.0}
    u = plain.accelerations.inputs[2].symbols
    rates = [e for group in plain.accelerations.outputs for e in group.expressions]
    rates = rates if len(plain.accelerations.outputs) == 2 else [*u, *rates]
    return substitute(rates, known), symbols, known


def _refined(assembly: Assembly, task: Task, made: Sequence[Driven], intervals: int, tolerance: float) -> Optimum:
    """Return the optimum on a mesh on which the run agrees with the collocation."""
    problem = Collocation(task, np.linspace(0.0, 1.0, intervals + 1))
    every, steps = _guessed(problem, made), 0
    for _ in range(_ROUNDS):
        mesh = problem.mesh
        found = _solved(problem, every, assembly, 1e-4 if steps else 0.1)
        every, steps = problem.full(found.x), steps + found.steps
        states, _, inputs, (span,), *_ = problem.parts(every)
        times = task.begin + span * mesh
        nodes = {one.path: (times, inputs[:, k]) for k, one in enumerate(made)}
        rows = {path: np.column_stack(pair) for path, pair in nodes.items()}
        between = HELD if task.is_held else LINEAR
        result = simulate(with_inputs(assembly, rows, between, times[-1])[0], t_end=times[-1], rtol=1e-11)
        if result.events:
            event = result.events[0]
            raise SolveError(
                f"at t = {event.time:.9g} s something happens ({event.kind}), and the motion is not smooth",
                where=event.part,
                advice="Bound the motion so that it does not come there.",
            )
        last = result.run.segments[-1]
        end = np.concatenate([last.coordinates[:, -1], last.speeds[:, -1]])
        error = float(np.max(np.abs(end - states[-1]) / task.sizes[0]))
        beyond = _beyond(task, result, times, inputs)
        if error <= tolerance and np.max(beyond) <= _BEYOND:
            cost = problem.values(found.x)[0] * problem.cost_size
            return Optimum(result, nodes, cost, float(span), error, len(mesh) - 1, steps)
        finer = mesh if error <= tolerance else _halved(problem, every)
        worst = np.flatnonzero(beyond > _BEYOND)
        before, problem = problem, Collocation(task, np.union1d(finer, 0.5 * (mesh[worst] + mesh[worst + 1])))
        every = _moved(before, problem, every)
    ends = f"the run still ends {error:.2g} of the scene's sizes beside the collocation"
    beyond_by = f"the run still goes {np.max(beyond):.2g} of their sizes beyond bounds"
    raise SolveError(
        f"on {len(mesh) - 1} intervals {ends if error > tolerance else beyond_by}",
        where=assembly.flat.name,
        advice="Ask for a larger tolerance, or bound the inputs.",
    )


def _beyond(task: Task, result: Result, times: FloatArray, inputs: FloatArray) -> FloatArray:
    """Return by how much a run goes beyond bounds in each interval, in sizes of the quantities, at its samples."""
    found = np.zeros(len(times) - 1)
    if not len(task.limits):
        return found
    segments = result.run.segments
    t = np.concatenate([one.time for one in segments])
    states = np.concatenate([np.concatenate([one.coordinates, one.speeds]) for one in segments], axis=1).T
    place = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
    share = (not task.is_held) * (t - times[place]) / np.diff(times)[place]
    drive = inputs[place] + share[:, None] * (inputs[place + 1] - inputs[place])
    values = task.along.values(np.column_stack([states, drive, t]))
    low, high = task.limits.T
    size = or_one(np.max(np.abs(values), axis=0))
    np.maximum.at(found, place, np.max(np.maximum(low - values, values - high) / size, axis=1))
    return found


def _solved(problem: Collocation, every: FloatArray, assembly: Assembly, barrier: float) -> Found:
    """Return the least cost on a mesh."""
    x = problem.free(every)
    cost, misses = problem.values(x)
    if not (np.isfinite(cost) and np.all(np.isfinite(misses))):
        raise SolveError(
            "the cost, or an acceleration, is no finite number where the search begins",
            where=assembly.flat.name,
            advice="Give a guess of the inputs, or a cost that has a value everywhere.",
        )
    diagonal = problem.bends(x, np.zeros(problem.linear.shape[0] + problem.slacks.shape[0])).diagonal()
    gradient, _ = problem.slopes(x)
    size = max(float(np.max(np.abs(one), initial=0.0)) for one in (gradient, diagonal))
    problem.cost_size = size or 1.0
    found = least(problem, x, barrier=barrier)
    if found.message:
        raise SolveError(
            f"no motion was found ({found.message}; its conditions are missed by {found.miss:.2g})",
            where=assembly.flat.name,
            advice="See whether what is to hold at the end can be reached; give a guess, or more intervals.",
        )
    return found


def _guessed(problem: Collocation, made: Sequence[Driven]) -> FloatArray:
    """Return the unknowns to begin with: straight from the start to what is to hold at the end, with given inputs."""
    task, mesh = problem.task, problem.mesh
    span = 0.5 * (task.duration[0] + task.duration[1])
    shares = [(np.array(one.times) - task.begin) / task.duration[1] for one in made]
    inputs = np.array([np.interp(mesh, share, one.values) for share, one in zip(shares, made, strict=True)]).T
    share = np.concatenate([mesh, (mesh[:-1, None] + np.diff(mesh)[:, None] * problem.nodes).ravel()])
    goal = _met(task, task.ends, task.targets, task.start, np.append(inputs[-1], task.begin + span))
    states = task.start + share[:, None] * (goal - task.start)
    if task.guessed is not None and task.courses:
        for k in np.flatnonzero(share > 0.0):
            t = task.begin + span * share[k]
            wanted = np.array([np.interp(t, *one.T) for one in task.courses])
            given = np.append([np.interp(share[k], mesh, one) for one in inputs.T], t)
            states[k] = _met(task, task.guessed, np.column_stack([wanted, wanted]), states[k], given)
    return _with_slacks(problem, np.concatenate([states.ravel(), inputs.ravel(), [span]]))


def _met(
    task: Task, functions: PointFunctions, targets: FloatArray, start: FloatArray, given: FloatArray
) -> FloatArray:
    """Return a state near another in which functions are within ranges; the other one where none is found.

    `given` are the inputs, and the time.
    """
    state, n, count = start.copy(), len(start), len(targets)
    for _ in range(30):
        point = np.concatenate([state, given])[None, :]
        values = functions.values(point)[0, :count]
        miss = np.clip(values, *targets.T) - values
        if np.max(np.abs(miss), initial=0.0) <= 1e-9 * (1.0 + np.max(np.abs(values), initial=0.0)):
            return state
        slopes = functions.slopes(point).toarray()[:count, :n] * task.sizes[0]
        state = state + task.sizes[0] * least_norm(slopes, miss)
    return start


def _with_slacks(problem: Collocation, main: FloatArray) -> FloatArray:
    every = np.concatenate([main, np.zeros(problem.total - len(main))])
    every = problem.full(problem.free(every))
    along = problem.task.along.values(problem.points(problem.at_nodes, every)).ravel()
    ends = problem.task.ends.values(problem.points(problem.at_end, every))[0, :-1]
    every[len(main) :] = np.concatenate([along, ends])
    return every


def _moved(before: Collocation, problem: Collocation, every: FloatArray) -> FloatArray:
    """Return unknowns on another mesh, along the polynomials of the one before."""
    states, inner, inputs, span, *_ = before.parts(every)
    wanted = (problem.mesh[:-1, None] + np.diff(problem.mesh)[:, None] * problem.nodes).ravel()
    points = np.concatenate([problem.mesh, wanted])
    at = np.clip(np.searchsorted(before.mesh, points, side="right") - 1, 0, before.count - 1)
    local = (points - before.mesh[at]) / np.diff(before.mesh)[at]
    known = np.concatenate([[0.0], before.nodes, [1.0]])
    powers = np.arange(len(known))
    weights = local[:, None] ** powers @ np.linalg.inv(known[:, None] ** powers)
    values = np.concatenate([states[:-1, None], inner, states[1:, None]], axis=1)[at]
    found = np.einsum("pk,pkn->pn", weights, values)
    driven = np.array([np.interp(problem.mesh, before.mesh, one) for one in inputs.T]).T
    return _with_slacks(problem, np.concatenate([found.ravel(), driven.ravel(), span]))


def _halved(problem: Collocation, every: FloatArray) -> FloatArray:
    """Return a mesh in which the intervals with the largest errors are halved.

    The rates are compared with the polynomial through all of their points but one.
    """
    points = problem.points(problem.inside, every)
    rates = problem.task.motion.values(points)[:, :-1].reshape(problem.count, POINTS, problem.n)
    differences = np.array([1.0 / np.prod(x - np.delete(problem.nodes, k)) for k, x in enumerate(problem.nodes)])
    off = np.abs(np.einsum("k,ikn->in", differences, rates)) / problem.task.sizes[0]
    sizes = np.max(off, axis=1) * np.diff(problem.mesh)
    worst = np.flatnonzero(sizes >= _WIDEST * np.max(sizes))
    middles = 0.5 * (problem.mesh[worst] + problem.mesh[worst + 1])
    return np.sort(np.concatenate([problem.mesh, middles]))
