"""The state just after an event: the mode that is entered, impacts, and the same state in other coordinates."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from functools import partial

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import SolveError
from atwood.expr import Expression, OutputGroup, Program, depends_on, evaluate, jacobian
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.quantities import observer, to_maximal
from atwood.mechanics.dynamics.equations import Constraint
from atwood.mechanics.outputs.event_functions import UPDATE, EventFunction, list_event_functions
from atwood.numerics.matrices import is_full, least_norm
from atwood.numerics.newton import Missing, newton
from atwood.numerics.sparse import solve_bordered
from atwood.simulation.dynamics.balance import LIGHT, Balance, BalanceValues, balance_of, even_balance
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of, reference_coordinates
from atwood.simulation.dynamics.orientation_coordinates import (
    Reassemble,
    switch_coordinates,
)
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.dynamics.scales import coordinate_scales, motion_scales
from atwood.simulation.events.modes import EventRecord
from atwood.simulation.initialization.start import actual_line_signs
from atwood.tolerances import tolerances

_REACTION_EVENTS: Key[tuple[EventFunction, ...]] = Key("event functions that read reactions")


_READ: Key[tuple[list[int], Program | None]] = Key("generalized coordinates of another mode")
_ENTERED: Key[dict[tuple[Hashable, ...], tuple[FloatArray, FloatArray]]] = Key("states on entering a mode")
_MAXIMAL: Key[tuple[Program, tuple[int, ...], tuple[int, ...]]] = Key("maximal coordinates and their Jacobian")


class LetsGo(SolveError):
    """An impact would need an impulse that a one-sided constraint cannot bear.

    Attributes
    ----------
    event
        The event in which its part lets go, with the mode that this leads to.
    """

    event: EventRecord


def enter_mode(
    state: tuple[float, FloatArray, FloatArray],
    assembly: Assembly,
    event: EventRecord,
    reassemble: Reassemble,
    length: float,
    also: Mapping[str, str] | None = None,
) -> tuple[Assembly, FloatArray, FloatArray]:
    """Return the scene in the mode that an event leads to, with its state."""
    t, q, u = state
    line_signs = actual_line_signs(assembly, t, q, u, assembly.form)
    after = reassemble({**assembly.modes, event.part: event.target, **(also or {})}, line_signs, assembly.orientation)
    about = assembly, event.part, event.law, event.message, event.impact, t, q.tobytes(), u.tobytes(), length
    if "external" in after.maximal.graph.operations:  # functions in Python are asked again
        q, u = _entered(state, assembly, after, event, length)
    else:
        entered = after.kept.recall(_ENTERED, lambda: _entered(state, assembly, after, event, length), *about)
        q, u = (one.copy() for one in entered)
    return (after, q, u) if after.form == "dae" else (*switch_coordinates(after, q, reassemble), u)


def _entered(
    state: tuple[float, FloatArray, FloatArray], assembly: Assembly, after: Assembly, event: EventRecord, length: float
) -> tuple[FloatArray, FloatArray]:
    """Return the state of the scene in another mode, with quaternions."""
    t, q, u = state
    big_q, big_u = (x[:, 0] for x in maximal_state(assembly, np.array([t]), q[:, None], u[:, None]))
    sizes = motion_scales(after.maximal, length)
    balance = balance_of(after, "dae")
    if event.impact:
        met, _ = balance.project(t, big_q, big_u, sizes)
        _check_in_place(event, balance.kinematic_map.difference(t, big_q, met) / sizes)
        big_u = plastic_impact(after, balance, event, (t, met, big_u), sizes)
        big_q = met
    if after.form == "dae":
        return big_q, big_u
    q, u, miss = generalized_state(assembly, after, t, (q, u), (big_q, big_u), length)
    _check_in_place(event, miss)
    return q, u


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
    """
    t, q, u = state
    now = balance.at(t, q, u)
    velocities, impulses = _solve_impact(now, u, sizes, balance.row_scales(now, t, q, sizes))
    # Beside what moves: where nothing with mass is struck, impulses are rounding alone, of either sign.
    size = float(np.max(np.abs([*impulses, *(sizes * (now.mass @ u))]), initial=0.0))
    for one, impulse in zip(after.maximal.constraints, impulses, strict=True):
        refused_by = refusing(after, one, state, one.sign * impulse) if abs(impulse) > 1e-9 * size else None
        if refused_by is not None:
            error = LetsGo(
                f"at t = {t:.6g} the impact ({event.message}, {event.part}) needs an impulse of the sign that "
                "this one-sided constraint cannot transmit: a rope would have to push",
                where=one.key[0],
                advice="Simultaneous impacts of several one-sided constraints, some of which open, are not supported.",
            )
            if refused_by.target in ("", UPDATE):
                raise SolveError(error.message, where=error.where, advice=error.advice)
            error.event = EventRecord(t, refused_by.part, refused_by.law, refused_by.message, refused_by.target, False)
            raise error
    return velocities


_SIZES = (1e-9, 1e9)
"""Between these, beside the impulses, lies any force that an event could compare a reaction with."""


def refusing(
    after: Assembly, constraint: Constraint, state: tuple[float, FloatArray, FloatArray], impulse: float
) -> EventFunction | None:
    """Return the event of its part that lets go of a constraint for a reaction of this sign, however small or large.

    A limit in both directions, or one that is not zero, makes no constraint one-sided.
    """
    part, own = constraint.key[0], [one.symbol for one in after.reactions if one.key == constraint.key]
    event_functions = [
        one for one in _reaction_event_functions(after) if one.part == part and depends_on(one.value, own)
    ]
    if not event_functions:
        return None
    t, q, u = state
    equations = after.maximal
    known: dict[Expression, float] = dict(zip(after.parameters, after.parameter_values, strict=True))
    known |= {equations.time: t, **dict(zip(equations.coordinates, q, strict=True))}
    known |= dict(zip((*equations.speeds, *equations.accelerations), (*u, *np.zeros_like(u)), strict=True))
    known |= dict.fromkeys((one.symbol for one in after.reactions), 0.0)

    def letting_go(reaction: float) -> list[EventFunction]:
        values = evaluate([one.value for one in event_functions], {**known, **dict.fromkeys(own, reaction)})
        return [one for one, value in zip(event_functions, values, strict=True) if one.direction * value > 0.0]

    refused, other = ([letting_go(sign * size * impulse) for size in _SIZES] for sign in (1.0, -1.0))
    return refused[0][0] if all(refused) and not all(other) else None


def _reaction_event_functions(assembly: Assembly) -> tuple[EventFunction, ...]:
    """Return the events that read reactions, in maximal coordinates."""
    symbols = [one.symbol for one in assembly.reactions]

    def make() -> tuple[EventFunction, ...]:
        every = list_event_functions(assembly.mechanism, assembly.maximal, assembly.reactions, assembly.modes)
        return tuple(one for one in every if depends_on(one.value, symbols))

    return assembly.shared.get(_REACTION_EVENTS, make)


_STEPS, _STILL = 30, 1e-14
"""So many steps lead to generalized coordinates at most, the last of them so short beside these."""


def _solve_impact(
    now: BalanceValues, u: FloatArray, sizes: FloatArray, rows: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return velocities after an impact, and impulses: those of least size where constraints depend on each other.

    All is written in displacements of the scene's size, and impulses come out as their work along these: what is small
    beside the rest is then small in truth, and not in its unit.
    """
    if not is_full(now.mass):
        solved = solve_bordered(now.mass, now.jacobian, -(now.mass @ u), now.explicit_rate)
        if solved is not None:
            return solved[0], solved[1] * rows
    n = len(u)
    matrix, _ = even_balance(now, sizes, rows)
    right = np.concatenate([matrix[:n, :n] @ (u / sizes), -now.explicit_rate / rows])
    found = least_norm(matrix, right, errors=LIGHT)
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

    Maximal ones that are nan are not known, and may be anything.
    """
    equations = after.regular
    reduced_map, maximal_map = kinematic_map_of(after, "regular"), kinematic_map_of(after, "dae")
    program, rows, columns = maximal_places(after)
    kernel = after.kernel(program)
    names = tuple([one.name for one in equations.names])
    places, reading = before.shared.get(_READ, lambda: _read_of(before, names), names)
    q, still = reference_coordinates(equations), np.zeros(len(equations.speeds))
    if reading is not None:
        idle = [0.0] * len(before.reactions)
        q[places] = before.kernel(reading)([t], *own, np.zeros_like(own[1]), idle)[0]
    turned = {orientation.body: list(orientation.coordinates) for orientation in after.maximal.orientation_coordinates}
    for orientation in equations.orientation_coordinates:
        if orientation.body in turned:
            q[list(orientation.coordinates)] = maximal[0][turned[orientation.body]]
    q = reduced_map.normalized(q)
    scales, own_scales = motion_scales(after.maximal, length), motion_scales(equations, length)

    def look(place: FloatArray) -> Missing:
        found, _, entries = kernel([t], place, still)
        matrix = np.zeros((len(scales), len(still)))
        matrix[rows, columns] = entries
        matrix[np.isnan(maximal[1])] = 0.0
        found = maximal_map.normalized(np.asarray(found))
        apart = maximal_map.difference(t, found, np.where(np.isnan(maximal[0]), found, maximal[0]))
        return Missing(-apart, scales, lambda: matrix)

    far = _STILL * float(np.max(np.abs(q) / coordinate_scales(equations, length), initial=1.0))
    q, now = newton(look, partial(reduced_map.moved, t), q, own_scales, steps=_STEPS, still=far)
    return q, generalized_speeds(after, t, q, maximal[1], scales), now.value / scales


def _read_of(before: Assembly, names: Sequence[str]) -> tuple[list[int], Program | None]:
    """Return which generalized coordinates can be read in the mode before, and the program that does."""
    known = {i: name for i, name in enumerate(names) if name in before.observables}
    return list(known), observer(before, tuple(known.values())) if known else None


def generalized_speeds(after: Assembly, t: float, q: FloatArray, speeds: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return the generalized speeds, with quaternions, that give the same speeds in maximal coordinates."""
    program, rows, columns = maximal_places(after)
    still = np.zeros(len(after.regular.speeds))
    matrix = np.zeros((len(sizes), len(still)))
    _, explicit_rate, matrix[rows, columns] = after.kernel(program)([t], q, still)
    known = ~np.isnan(speeds)
    return least_norm((matrix / sizes[:, None])[known], ((speeds - np.asarray(explicit_rate)) / sizes)[known])


def maximal_places(after: Assembly) -> tuple[Program, tuple[int, ...], tuple[int, ...]]:
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
