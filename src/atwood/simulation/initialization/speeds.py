"""Speeds at the start: a linear problem, once positions are known."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.forms.assembly import Assembly
from atwood.forms.kept import Key
from atwood.mechanics.dynamics.equations import Equations
from atwood.numerics.independence import certain, row_scales
from atwood.numerics.matrices import or_one, scaled
from atwood.numerics.solutions import least_norm
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.scales import motion_names
from atwood.simulation.initialization.errors import contradicted, contradiction, freedom_at
from atwood.simulation.initialization.system import Level, System, counted, said
from atwood.tolerances import tolerances

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


def _told(
    assembly: Assembly, equations: Equations, level: Level
) -> tuple[FloatArray, tuple[str, ...], tuple[str, ...]] | None:
    """Return what `solve_speeds` does where all that is said is of speeds themselves, and nothing twice; else None."""
    places = assembly.shared.get(_PLACES, lambda: _speeds_by_path(assembly, equations))
    fixed = {places[one.path] for one in level.fixed if one.path in places}
    if len(fixed) < len(level.fixed) or not all(one.path in places for one in level.guessed):
        return None
    u = np.zeros(len(equations.speeds))
    for one in (*level.guessed, *level.fixed):
        u[places[one.path]] = one.value
    return u, tuple(name for i, name in enumerate(motion_names(equations)) if i not in fixed), ()


_PLACES: Key[dict[str, int]] = Key("speeds by path")


def _speeds_by_path(assembly: Assembly, equations: Equations) -> dict[str, int]:
    """Return the numbers of speeds by the paths of quantities that are these speeds, or rates of their coordinates."""
    observables = assembly.start_observables
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
        told = _told(assembly, equations, level)
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
