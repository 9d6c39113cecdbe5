"""Consistent start values, from what the user fixes and guesses.

Positions first: Newton's method finds the configuration nearest to the guesses that fulfils the constraints and
everything that is fixed. Then speeds, a linear problem of the same kind. Accelerations and multipliers follow from the
balance of forces. On a line, lengths take their signs from where things then are.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, KernelEvaluationError, StartError
from atwood.expr import Expression, Program, SparseMatrix, evaluate, jacobian
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.other_values import starting
from atwood.forms.quantities import coordinate_program, to_maximal
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Equations
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of, reference_coordinates
from atwood.simulation.dynamics.numerical_failure import (
    ADVICE_AT_START,
    is_numerical,
    numerical_failure,
    undefined_value_at,
)
from atwood.simulation.dynamics.orientation_coordinates import Reassemble, from_regular, own_names, switch_coordinates
from atwood.simulation.dynamics.scales import coordinate_scales, motion_scales, scene_length
from atwood.simulation.initialization.positions import solve_positions, solve_speeds
from atwood.simulation.initialization.system import sort_targets
from atwood.tolerances import tolerances

_POSITIONS: Key[Program] = Key("positions of nodes on the line")

LineSigns = dict[tuple[str, str, str], float]


def actual_line_signs(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, form: str) -> LineSigns:
    """Return, for pairs of connectors of each part, the sign of the second's position minus the first's."""
    if not assembly.mechanism.space.is_line:
        return {}
    equations = assembly.reduced if form == "reduced" else assembly.maximal
    positions = equations.kinematics.placements.positions
    nodes = list(positions)
    program = assembly.shared.get(
        _POSITIONS,
        lambda: coordinate_program(assembly, "places", equations, [positions[node][0] for node in nodes]),
        form,
    )
    places = dict(zip(nodes, assembly.kernel(program)([t], q, u)[0], strict=True))
    found: LineSigns = {}
    for path, local in assembly.mechanism.locals_.items():
        for a in local.connectors:
            for b in local.connectors:
                gap = places[equations.site.node(path, b)] - places[equations.site.node(path, a)]
                if gap != 0.0:
                    found[path, a, b] = 1.0 if gap > 0.0 else -1.0
    return found


def line_signs_differ(assembly: Assembly, actual: LineSigns) -> bool:
    """Return whether the signs that lengths were given differ from where things are."""
    for (path, a, b), sign in actual.items():
        given = assembly.mechanism.locals_[path].binding.line_signs or {}
        order = list(assembly.mechanism.locals_[path].connectors)
        usual = 1.0 if order.index(a) < order.index(b) else -1.0  # what laws take where the start does not tell
        if given.get((a, b), usual) != sign:
            return True
    return False


@dataclass(frozen=True)
class Start:
    """A consistent start in generalized coordinates.

    Attributes
    ----------
    time
        s.
    coordinates, speeds
        Of the reduced form, with orientations as quaternions.
    length
        Extent of the scene, m.
    free_coordinates, free_speeds
        Names of the coordinates that nothing fixed, and of those whose speed nothing fixed: they kept their guess as
        far as they could. A speed that is the rate of no coordinate has its own name.
    repeated
        Paths of fixed values that follow from the others.
    rough
        Coordinates at which bodies were placed by what is said of them, before constraints and what is fixed were
        met; see `atwood.simulation.initialization.report`.
    """

    time: float
    coordinates: FloatArray
    speeds: FloatArray
    length: float
    free_coordinates: tuple[str, ...]
    free_speeds: tuple[str, ...]
    repeated: tuple[str, ...]
    rough: FloatArray


_START: Key[Start] = Key("start")
_IN_MAXIMAL: Key[tuple[FloatArray, FloatArray]] = Key("start in maximal coordinates")
_SIGNS_TRIED = 4
"""So many starts are found with signs of their own, one after the other: more than two are hardly ever needed."""
_INTEGRAL_GRADIENTS: Key[list[SparseMatrix]] = Key("gradients of integrals")


def own_state(assembly: Assembly, start: Start) -> tuple[FloatArray, FloatArray]:
    """Return a start in the coordinates of the form of an assembly."""
    if assembly.form == "reduced":
        return from_regular(assembly, start.coordinates), start.speeds
    return start_in_maximal(assembly, start)


def start_in_maximal(assembly: Assembly, start: Start) -> tuple[FloatArray, FloatArray]:
    """Return a start in maximal coordinates, whatever the form of an assembly."""

    def placed() -> tuple[FloatArray, FloatArray]:
        q, u = assembly.kernel(to_maximal(assembly, "regular"))([start.time], start.coordinates, start.speeds)
        return kinematic_map_of(assembly, "dae").normalized(np.asarray(q, dtype=float)), np.asarray(u, dtype=float)

    about = start.time, start.coordinates.tobytes(), start.speeds.tobytes()
    q, u = assembly.kept.get(_IN_MAXIMAL, placed, *about)
    return q.copy(), u.copy()


def settle(assembly: Assembly, start: Start, reassemble: Reassemble) -> tuple[Assembly, FloatArray, FloatArray]:
    """Return an assembly in orientation coordinates that are regular at a start, with the start in its coordinates."""
    if assembly.form == "reduced":
        return *switch_coordinates(assembly, start.coordinates, reassemble), start.speeds
    return assembly, *own_state(assembly, start)


def find_start(assembly: Assembly) -> Start:
    """Find a consistent start; it is found once for an assembly."""
    return assembly.kept.get(_START, lambda: _find(assembly))


def has_start(assembly: Assembly) -> bool:
    """Return whether the start of an assembly has been found."""
    return assembly.kept.known(_START) is not None


def take_start(assembly: Assembly, before: Assembly) -> None:
    """Take up the start of an assembly of the same structure, if all values that it follows from are the same."""
    start, flat, other = before.kept.known(_START), assembly.flat, before.flat
    values = [
        (one.gravity, one.start, one.guess, [(part.values, part.signals) for part in one.parts.values()])
        for one in (flat, other)
    ]
    if start is not None and values[0] == values[1]:
        assembly.kept.get(_START, lambda: start)


def start_with_line_signs(assembly: Assembly) -> tuple[Assembly, Start]:
    """Return an assembly whose lengths on a line are signed as at the start, and the start.

    Signs are assumed from the values that were given. A start that contradicts them is found again with its own, in
    generalized coordinates, as all starts are.
    """
    for _ in range(_SIGNS_TRIED):
        start = find_start(assembly)
        actual = actual_line_signs(assembly, start.time, start.coordinates, start.speeds, "reduced")
        if not line_signs_differ(assembly, actual):
            return assembly, start
        assembly = assembly.other_mode(assembly.modes, actual)  # the same modes with other signs
    raise StartError(
        "it depends on the signs of lengths where things start, and on where they start, which signs these are",
        where=assembly.flat.name,
        advice="Give start positions instead of guesses, so that it is clear what is on which side.",
    )


def _find(assembly: Assembly) -> Start:
    start = _solved(assembly)
    for values in (start.coordinates, start.speeds, start.rough):
        values.flags.writeable = False
    return start


def _solved(assembly: Assembly) -> Start:
    before = starting(assembly)
    if before is not assembly:
        return _taken_up(assembly, before, find_start(before))
    equations, length = with_closed(assembly), scene_length(assembly)
    if not 1e-100 < length < 1e100:
        raise StartError(
            f"the extent of the scene, {length:g} m, is too large to compute with",
            where=assembly.flat.name,
            advice="Look at its lengths and at the start values that are lengths.",
        )
    positions, speeds = sort_targets(assembly, equations)
    scales = motion_scales(equations, length)
    t = assembly.flat.t_start
    try:
        at = solve_positions(assembly, equations, positions, scales, length, t)
        u, free_u, repeated_u = solve_speeds(assembly, equations, speeds, scales, length, t, at.coordinates)
    except KernelEvaluationError as error:
        raise _without_value(assembly, t, error) from error
    except (ValueError, ArithmeticError) as error:
        if not is_numerical(error):
            raise
        raise _unworkable(assembly, t, error) from error
    free = own_names(assembly, at.free)
    return Start(t, at.coordinates, u, length, free, free_u, (*at.repeated, *repeated_u), at.rough)


def with_closed(assembly: Assembly) -> Equations:
    """Return the equations in which starts are found: with gaps that start closed among the constraints."""
    equations = assembly.regular
    closed = [one.row for one in equations.contacts if one.is_closed_at_start(assembly.flat.parts)]
    if not closed:
        return equations
    locals_ = dict(equations.locals_)
    for path, law, _ in (row.key for row in closed):
        local = locals_[path]
        held = (one.row for one in local.contacts if one.law.name == law)
        locals_[path] = replace(local, constraints=(*local.constraints, *held))
    return replace(equations, constraints=(*equations.constraints, *closed), locals_=locals_)


def _without_value(assembly: Assembly, t: float, error: KernelEvaluationError) -> AtwoodError:
    """Return the error that names the law that has no value where bodies are placed if nothing is said of them."""
    at_rest = reference_coordinates(assembly.own_equations)
    found = undefined_value_at(assembly, t, at_rest, np.zeros(len(assembly.own_equations.speeds)))
    if found is None:
        return error
    why = f" ({found.reason})" if found.reason else ""
    return StartError(
        f"{found.quantity} has no value where the start puts the bodies at first{why}",
        where=found.part,
        advice=f"Give start values or guesses, of places and orientations, with which it has one. {ADVICE_AT_START}",
    )


def _unworkable(assembly: Assembly, t: float, error: Exception) -> StartError:
    """Return the error of a start whose numbers could not be worked with."""
    at_rest, still = reference_coordinates(assembly.own_equations), np.zeros(len(assembly.own_equations.speeds))
    found = numerical_failure(assembly, t, at_rest, still, error)
    return StartError(found.message, where=found.where, advice=found.advice)


def _taken_up(assembly: Assembly, starting: Assembly, start: Start) -> Start:
    """Return a start in the coordinates and speeds that constraints on velocities leave."""
    before, after = starting.regular, assembly.regular
    q = dict(zip(before.coordinates, start.coordinates.tolist(), strict=True))
    u = dict(zip(before.speeds, start.speeds.tolist(), strict=True))
    place = {**assembly.known_values, before.time: start.time, **q}
    sizes = np.maximum(coordinate_scales(before, start.length), np.abs(start.coordinates))
    integral_gradients = assembly.shared.get(
        _INTEGRAL_GRADIENTS, lambda: [jacobian([one.value], before.coordinates) for one in after.integrals]
    )
    for one, slopes in zip(after.integrals, integral_gradients, strict=True):
        (missed,) = evaluate([one.value], place)
        terms = np.abs(evaluate(slopes.entries, place)) * sizes[list(slopes.columns)]
        if not abs(missed) <= tolerances.CLOSED * float(np.max(terms, initial=0.0)):
            raise StartError(
                f"the equations were made for another start, and a constant of integration differs by {missed:g}",
                where=one.keys[-1][0],
                advice="Assemble the scene anew, or give the start to `with_values`.",
            )
    kept = [before.coordinates.index(symbol) for symbol in after.coordinates]
    speeds = np.array([u[symbol] for symbol in after.speeds])
    return replace(start, coordinates=start.coordinates[kept], speeds=speeds, rough=start.rough[kept])


def find_places(assembly: Assembly) -> dict[str, dict[Expression, float]]:
    """Return the start of a scene by the symbols of its coordinates, in both forms.

    Constraints on velocities that can be integrated have constants of integration, which are read from there.
    """
    start = find_start(assembly)
    reduced, maximal = assembly.regular, assembly.maximal
    q, _ = assembly.kernel(to_maximal(assembly, "regular"))([start.time], start.coordinates, start.speeds)
    held = (one.symbol for one in assembly.discrete_states)
    known = {assembly.mechanism.time: start.time, **assembly.known_relations}
    known |= dict(zip(held, assembly.held_at_start, strict=True))
    return {
        "reduced": {**known, **dict(zip(reduced.coordinates, start.coordinates.tolist(), strict=True))},
        "dae": {**known, **dict(zip(maximal.coordinates, (float(x) for x in q), strict=True))},
    }
