"""Consistent start values, from what the user fixes and guesses.

Positions first: Newton's method finds the configuration nearest to the guesses that fulfils the constraints and
everything that is fixed. Then speeds, a linear problem of the same kind. Accelerations and multipliers follow from the
balance of forces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from atwood.errors import KernelEvaluationError, StartError
from atwood.expr import Expression, OutputGroup, Program, depends_on, evaluate, jacobian, jvp, live
from atwood.forms.assembly import Assembly
from atwood.forms.program import state_groups
from atwood.forms.source import no_start_quantity
from atwood.mechanics.equations import Equations
from atwood.mechanics.observables import Observable
from atwood.solve.matrices import (
    Matrix,
    from_entries,
    independent_rows,
    is_full,
    least_norm,
    row_scales,
    scaled,
    to_array,
)
from atwood.solve.scales import motion_names, motion_scales, scene_length
from atwood.solve.turning import Turning, resting_place, roughly_turned, turning_of

__all__ = [
    "Conditions",
    "Level",
    "Start",
    "Target",
    "find_start",
    "own_state",
    "sort_targets",
    "start_conditions",
]

FloatArray = NDArray[np.float64]

_MET = 1e-11
"""Relative to the scene's sizes: how well a start condition must be met."""


@dataclass(frozen=True)
class Start:
    """A consistent start in generalized coordinates.

    Attributes
    ----------
    time
        s.
    coordinates, speeds
        Of the reduced form.
    length
        Extent of the scene, m.
    free_coordinates, free_speeds
        Names of the coordinates that nothing fixed, and of those whose speed nothing fixed: they kept their guess as
        far as they could. A speed that is the rate of no coordinate has its own name.
    repeated
        Paths of fixed values that follow from the others.
    """

    time: float
    coordinates: FloatArray
    speeds: FloatArray
    length: float
    free_coordinates: tuple[str, ...]
    free_speeds: tuple[str, ...]
    repeated: tuple[str, ...]


def own_state(assembly: Assembly, start: Start) -> tuple[FloatArray, FloatArray]:
    """Return a start in the coordinates of the form of an assembly."""
    if assembly.form == "reduced":
        return start.coordinates, start.speeds
    q, u = assembly.kernel(assembly.to_maximal)([start.time], start.coordinates, start.speeds)
    return turning_of(assembly, "dae").normalized(np.asarray(q, dtype=float)), np.asarray(u, dtype=float)


@dataclass(frozen=True)
class Target:
    """A quantity with the value that it is to have at the start."""

    path: str
    value: float
    observable: Observable


@dataclass(frozen=True)
class Level:
    """Targets of one level, position or velocity, split into what is fixed and what is guessed."""

    fixed: list[Target]
    guessed: list[Target]


def find_start(assembly: Assembly) -> Start:
    """Find a consistent start.

    Parameters
    ----------
    assembly
        The scene, with its start values and guesses.

    Raises
    ------
    StartError
        If a start value names no quantity, or they contradict each other or the constraints.
    """
    equations, length = assembly.reduced, scene_length(assembly)
    positions, speeds = sort_targets(assembly, equations)
    scales = motion_scales(equations, length)
    t = assembly.flat.t_start
    q, free_q, repeated_q = _solve_positions(assembly, equations, positions, scales, t)
    u, free_u, repeated_u = _solve_speeds(assembly, equations, speeds, scales, t, q)
    return Start(t, q, u, length, free_q, free_u, (*repeated_q, *repeated_u))


def sort_targets(assembly: Assembly, equations: Equations) -> tuple[Level, Level]:
    """Return what is said of positions and of speeds at the start."""
    levels = (Level([], []), Level([], []))
    for is_fixed, given in ((True, assembly.flat.start), (False, assembly.flat.guess)):
        for path, value in _restated(assembly, given).items():
            number = assembly.shared.get(("start level", path), partial(_find_level, assembly, equations, path))
            level = levels[number]
            target = Target(path, value, assembly.start_observables[path])
            (level.fixed if is_fixed else level.guessed).append(target)
    return levels


def _restated(assembly: Assembly, given: Mapping[str, float]) -> dict[str, float]:
    """Return start values with those that a part says in another way said so; see `Component.restate_start`."""
    found = dict(given)
    said: dict[str, dict[str, float]] = {}
    for key, value in given.items():
        path, _, name = key.rpartition(".")
        if path in assembly.flat.parts:
            said.setdefault(path, {})[name] = value
    for path, own in said.items():
        part = assembly.flat.parts[path]
        restated = part.component.restate_start(own, assembly.mechanism.space.name)
        if restated != own:
            for name in own:
                del found[f"{path}.{name}"]
            found.update({f"{path}.{name}": value for name, value in restated.items()})
    return found


def _find_level(assembly: Assembly, equations: Equations, path: str) -> int:
    """Return whether a start value is of positions (0) or of speeds (1)."""
    observables = assembly.start_observables
    if path not in observables:
        raise no_start_quantity(path, observables)
    one = observables[path]
    reads = {node for node in live([one.value]) if node.is_symbol}
    late, speeds = assembly.shared.get("start symbols", lambda: _later_symbols(assembly, equations))
    if not late.isdisjoint(reads):
        raise StartError(
            "it follows from positions and speeds and cannot be chosen at the start",
            where=path,
            advice="Give coordinates, positions and velocities.",
        )
    own = [symbol for symbol in reads if symbol in speeds]
    if not own:
        return 0
    if not _is_linear(one.value, own):
        raise StartError(
            "it is not linear in the speeds and cannot be chosen at the start", where=path, advice="Give velocities."
        )
    return 1


def _later_symbols(assembly: Assembly, equations: Equations) -> tuple[frozenset[Expression], frozenset[Expression]]:
    """Return what is known only after positions and speeds, and the speeds."""
    late = frozenset([*equations.accelerations, *(one.symbol for one in assembly.reactions)])
    return late, frozenset(equations.speeds)


def _is_linear(value: Expression, speeds: Sequence[Expression]) -> bool:
    """Return whether an expression is linear in the speeds: its derivative along them does not depend on them."""
    directions: dict[Expression, Expression | float] = {u: u.graph.symbol(f"direction:{u.name}") for u in speeds}
    return value.is_symbol or not depends_on(jvp([value], directions)[0], speeds)


@dataclass(frozen=True)
class Conditions:
    """The conditions of a start as a program, with their derivatives; the same for all values of a structure."""

    program: Program
    rows: tuple[int, ...]
    columns: tuple[int, ...]
    shape: tuple[int, int]


def start_conditions(
    assembly: Assembly, equations: Equations, targets: Sequence[Target], constrained: bool, of_speeds: bool
) -> Conditions:
    """Return the conditions of a start.

    Parameters
    ----------
    assembly, equations
        The scene.
    targets
        What is to be met.
    constrained
        Whether the constraints are among the conditions, before the targets.
    of_speeds
        Whether they are on speeds, or on coordinates.
    """

    def make() -> Conditions:
        constraints: list[Expression] = []
        if constrained and of_speeds:
            constraints = [one.rate for one in equations.constraints]
        elif constrained:
            constraints = [one.value for one in equations.constraints if one.value is not None]
        unknowns = equations.speeds if of_speeds else equations.coordinates
        expressions = [*constraints, *(one.observable.value for one in targets)]
        entries = jacobian(expressions, list(unknowns)) if expressions else None
        outputs = (
            OutputGroup("values", tuple(expressions)),
            OutputGroup("slopes", tuple(entries.entries) if entries else ()),
        )
        program = Program(f"{assembly.flat.name} start", state_groups(equations), assembly.parameters, outputs)
        places = (tuple(entries.rows), tuple(entries.columns)) if entries else ((), ())
        return Conditions(program, *places, (len(expressions), len(unknowns)))

    return assembly.shared.get(("start", tuple(one.path for one in targets), constrained, of_speeds), make)


class _System:
    """Values and derivatives of targets and constraints along the speeds: of places, or of speeds themselves."""

    def __init__(
        self,
        assembly: Assembly,
        equations: Equations,
        targets: Sequence[Target],
        constrained: bool,
        of_speeds: bool = False,
    ) -> None:
        made = start_conditions(assembly, equations, targets, constrained, of_speeds)
        self.turning = None if of_speeds else turning_of(assembly, "reduced")
        self.kernel = assembly.kernel(made.program)
        self.rows, self.columns, self.shape = made.rows, made.columns, made.shape
        self.targets, self.constraints = targets, made.shape[0] - len(targets)
        self.speeds = len(equations.speeds)

    def at(self, t: float, q: FloatArray, u: FloatArray) -> tuple[FloatArray, Matrix]:
        """Return what is missing in each equation, and the derivatives."""
        values, slopes = self.kernel([t], q, u)
        matrix = from_entries(self.rows, self.columns, slopes, self.shape)
        if self.turning is not None and not self.turning.is_plain:
            matrix = to_array(matrix) @ self.turning.tangent(t, q)
        missing = np.asarray(values, dtype=float)
        for i, target in enumerate(self.targets, start=self.constraints):
            missing[i] -= target.value
            if target.observable.periodic:
                missing[i] = np.remainder(missing[i] + np.pi, 2.0 * np.pi) - np.pi
        return missing, matrix


def _newton(
    system: _System, scales: FloatArray, t: float, q: FloatArray, iterations: int = 60
) -> tuple[FloatArray, FloatArray, Matrix]:
    """Move to the nearest configuration that fulfils a system; return it with what is missing, scaled."""
    still = np.zeros_like(scales)
    assert system.turning is not None
    missing, matrix = system.at(t, q, still)
    rows = row_scales(matrix, scales)
    for _ in range(iterations):
        size = float(np.max(np.abs(missing / rows), initial=0.0))
        if size < 1e-15:
            break
        step = scales * least_norm(scaled(matrix, scales, rows), missing / rows)
        longest = float(np.max(np.abs(step / scales), initial=0.0))
        step *= min(1.0, 0.5 / longest) if longest > 0.5 else 1.0
        for _ in range(8):
            trial = system.turning.moved(t, q, -step)
            new_missing, new_matrix = system.at(t, trial, still)
            if float(np.max(np.abs(new_missing / rows))) < size or longest < 1e-9:
                break
            step *= 0.5
        if float(np.max(np.abs(new_missing / rows))) >= size and size < _MET:
            break
        q, missing, matrix = trial, new_missing, new_matrix
        rows = row_scales(matrix, scales)
    # What hardly changes with any coordinate, as where links line up, is measured by the scene.
    sizes = np.maximum(rows, 1e-4 * max(np.max(rows, initial=0.0), np.max(scales, initial=0.0)))
    return q, missing / sizes, scaled(matrix, scales, rows)


def _solve_positions(
    assembly: Assembly, equations: Equations, level: Level, scales: FloatArray, t: float
) -> tuple[FloatArray, tuple[str, ...], tuple[str, ...]]:
    rough = [*level.guessed, *level.fixed]
    turning = turning_of(assembly, "reduced")
    q, is_direct = _said(equations.coordinates, rough, resting_place(equations))
    q = _turned(equations, turning, q)
    if not is_direct:
        q = _brought_near(_System(assembly, equations, rough, False), equations, scales, t, q)
    system = _System(assembly, equations, level.fixed, True)
    q, missing, matrix = _newton(system, scales, t, q)
    if missing.size and not float(np.max(np.abs(missing))) <= _MET:
        _explain_positions(assembly, equations, level, scales, t, q, missing)
    tangent = None if turning.is_plain else turning.tangent(t, q)
    for chart in equations.charts:  # what turns at all has no orientation, whichever coordinate shows it here
        assert tangent is not None
        tangent[list(chart.coordinates)] = np.max(np.abs(tangent[list(chart.coordinates)]), axis=0)
    names = [one.name for one in equations.names]
    return q, *_counted(names, tangent, level.fixed, system.constraints, matrix)


def _brought_near(system: _System, equations: Equations, scales: FloatArray, t: float, q: FloatArray) -> FloatArray:
    """Return a configuration near what is said of it; orientations begin elsewhere where they do not get there."""
    try:
        near, missing, _ = _newton(system, scales, t, q, iterations=20)
        if not equations.charts or float(np.max(np.abs(missing), initial=0.0)) <= _MET:
            return near
    except KernelEvaluationError:
        if not equations.charts:
            raise
    turned = roughly_turned(equations, lambda trial: _far_off(system, t, trial), q)
    return _newton(system, scales, t, turned, iterations=20)[0]


def _far_off(system: _System, t: float, q: FloatArray) -> float:
    """Return how far a configuration is from what is asked for; infinite where that has no value."""
    try:
        missing, matrix = system.at(t, q, np.zeros(system.speeds))
    except KernelEvaluationError:
        return np.inf
    rows = np.max(np.abs(matrix), axis=1, initial=0.0)
    return float(np.sum((missing / np.where(rows > 0.0, rows, 1.0)) ** 2))


def _said(unknowns: Sequence[Expression], targets: Sequence[Target], otherwise: FloatArray) -> tuple[FloatArray, bool]:
    """Return what is said of unknowns themselves, which needs no iteration, and whether that is all that is said."""
    values, is_direct = otherwise.copy(), True
    places = {symbol: i for i, symbol in enumerate(unknowns)} if targets else {}
    for target in targets:
        if target.observable.value in places:
            values[places[target.observable.value]] = target.value
        else:
            is_direct = False
    return values, is_direct


def _turned(equations: Equations, turning: Turning, q: FloatArray) -> FloatArray:
    """Return rough coordinates whose orientations mean something."""
    for chart in equations.charts:
        if not np.any(q[list(chart.coordinates)]):
            raise StartError("coordinates of an orientation that are all zero mean nothing", where=chart.body)
    return turning.normalized(q)


def _explain_positions(
    assembly: Assembly,
    equations: Equations,
    level: Level,
    scales: FloatArray,
    t: float,
    q: FloatArray,
    missing: FloatArray,
) -> None:
    """Raise the error that says whether a loop cannot close or the start contradicts itself."""
    if any(one.holonomic for one in equations.constraints):
        system = _System(assembly, equations, [], True)
        nearest, alone, _ = _newton(system, scales, t, q)
        if not float(np.max(np.abs(alone))) <= _MET:
            _raise_open_loop(assembly, equations, t, nearest, alone)
    _raise_contradiction(level.fixed, missing[len(missing) - len(level.fixed) :], equations)


def _raise_open_loop(
    assembly: Assembly, equations: Equations, t: float, nearest: FloatArray, missing: FloatArray
) -> None:
    """Raise the error that names the loop that cannot close."""
    holding = [one for one in equations.constraints if one.value is not None]
    worst = holding[int(np.argmax(np.abs(missing)))]
    values = [one.value for one in holding if one.key[0] == worst.key[0] and one.value is not None]
    place = {equations.time: t, **dict(zip(equations.coordinates, nearest.tolist(), strict=True))}
    miss = max(abs(v) for v in evaluate(values, {**assembly.mechanism.table.values, **place}))
    loop = _loop_through(assembly, worst.key[0])
    raise StartError(
        f"the loop cannot close here: the nearest position found misses by {miss:.3g}"
        + (f" (the loop of {', '.join(loop)})" if loop else ""),
        where=worst.key[0],
        advice="Check the lengths of the loop, or guess a start nearer to a position in which it closes.",
    )


def _loop_through(assembly: Assembly, part: str) -> list[str]:
    """Return the parts of the shortest loop through a joint, in order, with the bodies between them."""
    import networkx as nx

    graph, bodies = assembly.mechanism.graph, assembly.mechanism.bodies
    others: nx.Graph[int] = nx.Graph()
    ends: tuple[int, int] | None = None
    for joint in graph.joints:
        pair = (bodies.body_of[joint.a], bodies.body_of[joint.b])
        if joint.part == part:
            ends = pair
        elif not joint.is_rigid:
            others.add_edge(*pair, part=joint.part)
    if ends is None or not all(end in others for end in ends) or not nx.has_path(others, *ends):
        return []
    way = nx.shortest_path(others, *ends)
    found = [part]
    for here, there in pairwise(way):
        found += [*([bodies.bodies[here].name] if here else []), others.edges[here, there]["part"]]
    return [*found, *([bodies.bodies[way[-1]].name] if way[-1] else [])]


def _raise_contradiction(fixed: Sequence[Target], missing: FloatArray, equations: Equations) -> None:
    failing = [
        f"{target.path} = {target.value:g}" for target, miss in zip(fixed, missing, strict=True) if abs(miss) > _MET
    ]
    names = failing or [f"{target.path} = {target.value:g}" for target in fixed]
    freedom = len(equations.speeds) - len(equations.constraints)
    where = next((t.path for t, m in zip(fixed, missing, strict=True) if abs(m) > _MET), fixed[0].path if fixed else "")
    raise StartError(
        f"the start values contradict each other or the constraints: {', '.join(names)} cannot all hold",
        where=where,
        advice=f"The mechanism has {freedom} free coordinate{'s' if freedom != 1 else ''}; "
        "fix fewer values, or give some as guesses (on the command line: --start PATH=free).",
    )


def _solve_speeds(
    assembly: Assembly, equations: Equations, level: Level, scales: FloatArray, t: float, q: FloatArray
) -> tuple[FloatArray, tuple[str, ...], tuple[str, ...]]:
    u, is_direct = _said(equations.speeds, [*level.guessed, *level.fixed], np.zeros(len(equations.speeds)))
    if level.guessed and not is_direct:
        rough = _System(assembly, equations, level.guessed, False, of_speeds=True)
        missing, matrix = rough.at(t, q, u)
        u = u - scales * least_norm(scaled(matrix, scales), missing)
    system = _System(assembly, equations, level.fixed, True, of_speeds=True)
    for _ in range(3):  # linear: the second pass takes out rounding
        missing, matrix = system.at(t, q, u)
        if not np.any(missing):
            break
        rows = row_scales(matrix, scales)
        u = u - scales * least_norm(scaled(matrix, scales, rows), missing / rows)
    missing, matrix = system.at(t, q, u)
    if missing.size:
        rows = row_scales(matrix, scales)
        # Each equation is measured by its own terms, so that what is small beside another speed is not lost.
        own = abs(matrix) @ np.abs(u)
        # What is summed up within an equation rounds, even if all that comes out of it is zero.
        fastest = float(np.max(np.abs(u / scales), initial=0.0))
        own += 1e-6 * fastest * row_scales(matrix, scales)
        own[system.constraints :] += [abs(x.value) for x in level.fixed]
        share = np.abs(missing) / np.where(own > 0.0, own, 1.0)
        if not float(np.max(share)) <= 1e-8:
            _raise_contradiction(level.fixed, share[system.constraints :], equations)
        matrix = scaled(matrix, scales, rows)
    names = motion_names(equations)
    return u, *_counted(names, None, level.fixed, system.constraints, matrix)


def _counted(
    names: Sequence[str], tangent: FloatArray | None, fixed: Sequence[Target], constraints: int, matrix: Matrix
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return which coordinates or speeds nothing determines, and which fixed values repeat others.

    Of coordinates, `tangent` says how they move with the speeds; None where each has its own.
    """
    if 0 in matrix.shape:
        return tuple(names), ()
    kept = set(independent_rows(matrix))
    repeated = tuple(t.path for i, t in enumerate(fixed, start=constraints) if i not in kept)
    if len(kept) == matrix.shape[1]:
        return (), repeated
    if not is_full(matrix):
        from atwood.solve.sparse import free_columns

        return tuple(n for n, is_free in zip(names, free_columns(matrix), strict=True) if is_free), repeated
    _, sizes, directions = np.linalg.svd(matrix)
    rank = int(np.sum(sizes > 1e-9 * max(sizes[0], 1e-300))) if sizes.size else 0
    open_directions = directions[rank:] if tangent is None else directions[rank:] @ tangent.T
    free = tuple(
        n for i, n in enumerate(names) if open_directions.size and np.max(np.abs(open_directions[:, i])) > 1e-6
    )
    return free, repeated
