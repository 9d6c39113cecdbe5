"""Positions and speeds at the start, nearest to the guesses, that fulfil the constraints and what is fixed.

Positions are found by Newton's method; joints whose angles nothing is said of are not wound up on the way. Speeds are a
linear problem, once positions are known.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError, StartError
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.quantities import to_maximal
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.outputs.observables import Observable, beside
from atwood.model.local.parts import declared_starts
from atwood.numerics.matrices import Matrix, least_norm, or_one, scaled
from atwood.numerics.rank import certain, row_scales, row_sizes
from atwood.simulation.dynamics.kinematic_map import (
    KinematicMap,
    best_rough_orientation,
    kinematic_map_of,
    reference_coordinates,
)
from atwood.simulation.dynamics.scales import motion_names
from atwood.simulation.initialization.closure_error import wrongly_turned
from atwood.simulation.initialization.errors import (
    Failed,
    contradicted,
    contradiction,
    explain_positions,
    far_from_guess,
    freedom_at,
    wrong_way_round,
)
from atwood.simulation.initialization.loop_closure import closest, placed_in_turn, places_around, units_of_rows
from atwood.simulation.initialization.system import Level, System, Target, counted, named_once, nearest, said
from atwood.tolerances import tolerances

_NEAR = 1.0
"""How far what is guessed may be moved where only a place far off fulfils all: rad, or shares of the scene's size."""


@dataclass(frozen=True)
class Positions:
    """Where a scene starts.

    Attributes
    ----------
    coordinates
        The start.
    rough
        Where bodies were placed by what is said of them, before the constraints moved them.
    free, repeated
        Coordinates that nothing determines, and fixed values that follow from others.
    """

    coordinates: FloatArray
    rough: FloatArray
    free: tuple[str, ...]
    repeated: tuple[str, ...]


def solve_positions(
    assembly: Assembly, equations: Equations, level: Level, scales: FloatArray, length: float, t: float
) -> Positions:
    """Return coordinates that fulfil constraints and what is fixed."""
    level, start = _without_states(assembly, equations, level, t)
    every = [*level.guessed, *level.fixed]
    kinematic_map = kinematic_map_of(assembly, "regular")
    q, is_direct = said(equations.coordinates, every, start)
    fixed = named_once(equations.coordinates, level.fixed)
    if is_direct and fixed is not None and kinematic_map.is_plain and _is_open(equations):  # no iteration, no rank
        free = (one.name for i, one in enumerate(equations.names[: equations.placing]) if i not in fixed)
        return Positions(q, q.copy(), tuple(free), ())
    q = near_to = _turned(equations, kinematic_map, q)
    if not is_direct:
        system = System(assembly, equations, every, False)
        near = _brought_near(system, equations, scales, t, q)
        if _far_off(system, scales, t, near) > 1.0:  # what is said may fit together but for whole turns
            system = System(assembly, equations, every, False, whole_turns=True)
            other = _brought_near(system, equations, scales, t, q)
            near = other if _far_off(system, scales, t, other) < 1e-3 else near
        q = _better_placed(equations, system, scales, length, t, near_to, near)
    q = rough = unwound(assembly, equations, every, False, scales, length, t, near_to, q)
    system = System(assembly, equations, level.fixed, True)
    q, residual, matrix = nearest(system, scales, t, q)
    if not _is_met(residual) or wrongly_turned(assembly, equations, t, q):
        failed = Failed(assembly, equations, level, scales, length, t, rough, q, residual)
        q, matrix = _elsewhere(failed, system)
    q = unwound(assembly, equations, every, True, scales, length, t, near_to, q)
    errors = system.errors.of_jacobian(t, q, scales)
    tangent = None if kinematic_map.is_plain else kinematic_map.reach(t, q)
    names = [one.name for one in equations.names[: equations.placing]]
    tangent = None if tangent is None else tangent[: equations.placing]
    return Positions(q, rough, *counted(names, tangent, level.fixed, system.constraints, matrix, errors))


def _is_open(equations: Equations) -> bool:
    """Return whether no constraint is left on positions."""
    return not equations.forest.loop_joints and all(one.value is None for one in equations.constraints)


def _without_states(assembly: Assembly, equations: Equations, level: Level, t: float) -> tuple[Level, FloatArray]:
    """Return what is said of places alone, and coordinates at rest in which the states of parts have their starts."""
    q = reference_coordinates(equations)
    known = declared_starts(assembly.flat.parts, t) if equations.states else {}
    q[equations.placing :] = [known[one.path] for one in equations.states]
    symbols = {one.symbol: i for i, one in enumerate(equations.states, start=equations.placing)}
    for one in (*level.guessed, *level.fixed) if symbols else ():
        if one.observable.value in symbols:
            q[symbols[one.observable.value]] = one.value
    symbols |= {one.symbol: -1 for one in assembly.discrete_states}
    kept = ([one for one in ones if one.observable.value not in symbols] for ones in (level.fixed, level.guessed))
    return Level(*kept), q


def _is_met(residual: FloatArray) -> bool:
    return float(np.max(np.abs(residual), initial=0.0)) <= tolerances.MET


def _elsewhere(failed: Failed, system: System) -> tuple[FloatArray, Matrix]:
    """Return the place nearest to the guess, of those that other ways lead to; raise what says why there is none."""
    assembly, equations, t, scales = failed.assembly, failed.equations, failed.time, failed.scales
    assert system.kinematic_map is not None
    units = units_of_rows(assembly, equations, system, failed.length)
    hangs = not failed.level.guessed  # where no place is preferred, what nothing holds up is down
    best: tuple[float, FloatArray, Matrix] | None = None
    wrong = wrongly_turned(assembly, equations, t, failed.nearest) if _is_met(failed.residual) else []
    for number, place in enumerate(places_around(system, scales, t, failed.rough, hangs)):
        try:
            near = closest(system, units, scales, t, place, iterations=40)
            if not near.size < 0.1:
                continue
            q, residual, matrix = nearest(system, scales, t, near.coordinates)
            if not _is_met(residual):
                continue
        except (KernelEvaluationError, np.linalg.LinAlgError):
            continue
        turned = wrongly_turned(assembly, equations, t, q)
        if turned:
            wrong = turned
            continue
        off = float(np.linalg.norm(system.kinematic_map.difference(t, failed.rough, q) / scales))
        if best is None or off < best[0]:
            best = off, q, matrix
        if number == 0 or (hangs and number == 1):
            return q, matrix
    if best is None:
        raise wrong_way_round(failed, wrong[0]) if wrong else explain_positions(failed)
    if _strays(failed, best[1]):
        raise far_from_guess(failed, best[1], wrong)
    return best[1], best[2]


def _strays(failed: Failed, q: FloatArray) -> bool:
    """Return whether a place is so far from what is guessed that it is not what was meant."""
    if not failed.level.guessed:
        return False
    system = System(failed.assembly, failed.equations, failed.level.guessed, False)
    before, after = (system.at(failed.time, place, np.zeros_like(failed.scales))[0] for place in (failed.rough, q))
    sizes = [failed.length if one.observable.unit == "m" else 1.0 for one in failed.level.guessed]
    return bool(np.any((np.abs(after) - np.abs(before)) / np.array(sizes) > _NEAR))


def _brought_near(system: System, equations: Equations, scales: FloatArray, t: float, q: FloatArray) -> FloatArray:
    """Return a configuration near what is said of it; orientations begin elsewhere where they do not get there."""
    near: FloatArray | None = None
    try:
        near, residual, _ = nearest(system, scales, t, q, iterations=20)
        if not equations.orientation_coordinates or _is_met(residual):
            return near
    except KernelEvaluationError:
        if not equations.orientation_coordinates:
            raise
    turned = best_rough_orientation(equations, lambda trial: _far_off(system, scales, t, trial), q)
    found = nearest(system, scales, t, turned, iterations=20)[0]
    # What is said may not fit together; then the better of the two is what was meant.
    if near is None or _far_off(system, scales, t, found) < _far_off(system, scales, t, near):
        return found
    return near


def _better_placed(
    equations: Equations, system: System, scales: FloatArray, length: float, t: float, q: FloatArray, near: FloatArray
) -> FloatArray:
    """Return a configuration nearer to what is said than one that was found, if bodies are better placed in turn."""
    left = _far_off(system, scales, t, near)
    if not left > 1e-12:
        return near
    found = nearest(system, scales, t, placed_in_turn(equations, system, length, t, q), iterations=20)[0]
    return found if _far_off(system, scales, t, found) < 0.5 * left else near


def _far_off(system: System, scales: FloatArray, t: float, q: FloatArray) -> float:
    """Return how far a configuration is from what is asked for; infinite where that has no value."""
    try:
        residual, matrix = system.at(t, q, np.zeros(system.speeds))
    except KernelEvaluationError:
        return np.inf
    return float(np.sum((residual / row_scales(matrix, scales, system.errors.near(t, q, scales))) ** 2))


def _turned(equations: Equations, kinematic_map: KinematicMap, q: FloatArray) -> FloatArray:
    """Return rough coordinates whose orientations mean something."""
    for orientation in equations.orientation_coordinates:
        if not np.any(q[list(orientation.coordinates)]):
            raise StartError("coordinates of an orientation that are all zero mean nothing", where=orientation.body)
    return kinematic_map.normalized(q)


_TURN = 2.0 * np.pi


def unwound(
    assembly: Assembly,
    equations: Equations,
    targets: Sequence[Target],
    constrained: bool,
    scales: FloatArray,
    length: float,
    t: float,
    near: FloatArray,
    q: FloatArray,
) -> FloatArray:
    """Return the same position with each joint angle, which counts turns, within half a turn of its start value.

    Newton's method may go round on its way, and a spring on the joint would begin wound up. A turn is taken back if no
    body stands otherwise without it, and what is said holds as before.
    """
    if not assembly.mechanism.space.is_spatial:  # in a plane angles are absolute, and not those of joints
        return q
    of_charts = {number for orientation in equations.orientation_coordinates for number in orientation.coordinates}
    whole = np.round((q - near) / _TURN)
    wound = [i for i, one in enumerate(equations.names) if one.unit == "rad" and i not in of_charts and whole[i] != 0.0]
    if not wound:
        return q
    system = System(assembly, equations, targets, constrained)
    still = np.zeros_like(scales)
    before, matrix = system.at(t, q, still)
    allowed = tolerances.CLOSED * row_sizes(matrix, scales)
    places = _places(assembly, t, q, length)
    for i in wound:
        trial = q.copy()
        trial[i] -= whole[i] * _TURN
        is_met = np.all(np.abs(system.at(t, trial, still)[0] - before) <= allowed)
        if is_met and np.max(np.abs(_places(assembly, t, trial, length) - places)) <= tolerances.CLOSED:
            q = trial
    return q


def _places(assembly: Assembly, t: float, q: FloatArray, length: float) -> FloatArray:
    """Return where bodies are, by the scene's extent, and how they are turned, the same after whole turns."""
    forest = assembly.maximal.forest
    given = assembly.kernel(to_maximal(assembly, "regular"))([t], q, np.zeros(len(assembly.regular.speeds)))[0]
    found = np.asarray(given, dtype=float)
    rotations = [
        np.outer(v, v).ravel() / (v @ v)
        for v in (found[list(one.coordinates)] for one in forest.orientation_coordinates)
    ]
    of_charts = [number for one in forest.orientation_coordinates for number in one.coordinates]
    counted = [number for number, _ in forest.counted.values()]
    return np.concatenate([np.delete(found, [*of_charts, *counted]) / length, *rotations])


_KNOWN = 1e-6
"""Rounding of what is prescribed counts where it is no larger share of what moves."""


def _least_rates(assembly: Assembly, level: Level, rows: FloatArray, length: float, fastest: float) -> FloatArray:
    """Return for each condition what counts as nothing: rounding beside what is fastest, or not seen in all the time.

    Not seen is what takes nothing farther, in all the time of the scene, than what is apart in one place: so speeds
    that a run gave, with their rounding, are a start again, also of a mechanism that was just at rest.
    """
    said = np.array([abs(one.value) for one in level.fixed])
    units = np.array([length if one.observable.unit == "m/s" else 1.0 for one in level.fixed])
    span = assembly.flat.t_end - assembly.flat.t_start
    rate = max(fastest, float(np.max(said / units, initial=0.0)))
    sizes = np.concatenate([rows[: len(rows) - len(units)], units])
    unseen = tolerances.CLOSED / span * sizes if span > 0.0 else 0.0
    return rate * certain(np.zeros_like(sizes), sizes) + unseen


def _speeds_alone(
    assembly: Assembly, equations: Equations, level: Level
) -> tuple[FloatArray, tuple[str, ...], tuple[str, ...]] | None:
    """Return what `solve_speeds` does where all that is said is of speeds themselves, and nothing twice; else None."""
    paths = tuple(one.path for one in (*level.fixed, *level.guessed))
    places = assembly.shared.get(_PLACES, lambda: _speeds_by_path(assembly, equations, paths), paths)
    fixed = {places[one.path] for one in level.fixed if one.path in places}
    if len(fixed) < len(level.fixed) or not all(one.path in places for one in level.guessed):
        return None
    u = np.zeros(len(equations.speeds))
    for one in (*level.guessed, *level.fixed):
        u[places[one.path]] = one.value
    return u, tuple(name for i, name in enumerate(motion_names(equations)) if i not in fixed), ()


_PLACES: Key[dict[str, int]] = Key("speeds by path")


def _speeds_by_path(assembly: Assembly, equations: Equations, paths: Sequence[str]) -> dict[str, int]:
    """Return the numbers of speeds by the paths of quantities that are these speeds, or rates of their coordinates.

    Among these are all such of the parts that paths are of.
    """
    observables: dict[str, Observable] = {}
    for path in paths:
        observables.update(beside(assembly.start_observables, path))
    speeds = {symbol: i for i, symbol in enumerate(equations.speeds)}
    found = {path: speeds[one.value] for path, one in observables.items() if one.value in speeds}
    if kinematic_map_of(assembly, "regular").is_plain:
        coordinates = {symbol: i for i, symbol in enumerate(equations.coordinates[: equations.placing])}
        shown = (one for one in observables.values() if one.rate and one.value in coordinates)
        found |= {one.rate: coordinates[one.value] for one in shown}
    return found


def solve_speeds(
    assembly: Assembly, equations: Equations, level: Level, scales: FloatArray, length: float, t: float, q: FloatArray
) -> tuple[FloatArray, tuple[str, ...], tuple[str, ...]]:
    """Return speeds that fulfil constraints and what is fixed; which nothing determines, and what repeats others."""
    u, is_direct = said(equations.speeds, [*level.guessed, *level.fixed], np.zeros(len(equations.speeds)))
    if not equations.constraints:
        told = _speeds_alone(assembly, equations, level)
        if told is not None:  # no iteration, no rank
            return told
    if level.guessed and not is_direct:
        rough = System(assembly, equations, level.guessed, False, of_speeds=True)
        residual, matrix = rough.at(t, q, u)
        u = u - scales * least_norm(scaled(matrix, scales), residual)
    system = System(assembly, equations, level.fixed, True, of_speeds=True)
    errors = system.errors.of_jacobian(t, q, scales, of_rates=True)
    prescribed = system.errors.of_values(t, q, scales) if system.errors.moves_by_itself else np.zeros_like(errors)
    for _ in range(3):  # linear: the second pass takes out rounding
        residual, matrix = system.at(t, q, u)
        if not np.any(residual):
            break
        rows = row_scales(matrix, scales, errors)
        u = u - scales * least_norm(scaled(matrix, scales, rows), residual / rows, 1.0)
        fastest = float(np.max(np.abs(u / scales), initial=0.0))
        # A row that changes little is known no better than what is prescribed in it rounds; at rest that says nothing.
        if float(np.max(prescribed, initial=0.0)) < _KNOWN * fastest * float(np.max(rows, initial=0.0)):
            errors = np.maximum(errors, prescribed / fastest)
    residual, matrix = system.at(t, q, u)
    if residual.size:
        rows = row_scales(matrix, scales, errors)
        # Each equation is measured by its own terms, so that what is small beside another speed is not lost.
        own = abs(matrix) @ np.abs(u)
        own[system.constraints :] += [abs(x.value) for x in level.fixed]
        # What is summed up within an equation rounds, even if all that comes out of it is zero.
        fastest = float(np.max(np.abs(u / scales), initial=0.0))
        own += certain(errors, rows) * fastest / tolerances.MET_SPEEDS
        own += _least_rates(assembly, level, rows, length, fastest) / tolerances.MET_SPEEDS
        share = np.abs(residual) / or_one(own)
        if not float(np.max(share)) <= tolerances.MET_SPEEDS:
            # What is prescribed rounds as well, also where no speed enters: in rows that hold nothing.
            own += tolerances.CERTAIN * system.errors.of_values(t, q, scales) / tolerances.MET_SPEEDS
            share = np.abs(residual) / or_one(own)
        if not float(np.max(share)) <= tolerances.MET_SPEEDS:
            freedom = freedom_at(assembly, equations, scales, t, q)
            held = contradicted(equations, share[: system.constraints])
            raise contradiction(level.fixed, share[system.constraints :], freedom, held=held)
        matrix = scaled(matrix, scales)
    return u, *counted(motion_names(equations), None, level.fixed, system.constraints, matrix, errors)
