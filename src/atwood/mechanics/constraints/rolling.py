"""What becomes of constraints on velocities: positions, fewer speeds, or what they are.

In turn, for the reduced form: those that can be integrated become constraints on positions, with the constant that the
start says, and are eliminated with the linear ones; in space, those that are left give speeds in terms of others, where
each can be solved for a speed whose coefficient is the same everywhere. Then the motion is written in the speeds that
are left (quasi-velocities), d'Alembert's principle along them has no multipliers, and nothing is constrained. Any other
constraint stays as it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from atwood.expr import Expression, depends_on, evaluate, jacobian, jvp, substitute, vjp
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.constraints.elimination import SOLVED, eliminate_linear
from atwood.mechanics.constraints.massless_spins import IDLE_SPIN, idle_speeds
from atwood.mechanics.constraints.pfaffian import (
    NEEDED,
    Form,
    Places,
    constant_pivot,
    is_idle,
    linear_integrals,
    pfaffian_forms,
    switches,
)
from atwood.mechanics.constraints.values import Values
from atwood.mechanics.dynamics.equations import Integral
from atwood.mechanics.dynamics.forces import Site, place_part
from atwood.mechanics.dynamics.inertia import Masses
from atwood.mechanics.kinematics.mechanism import Derivation, Mechanism, decide, extent, from_start
from atwood.mechanics.kinematics.motion import Motion, Movement
from atwood.model.local.parts import LocalConstraint
from atwood.topology.spanning_forest import SpanningForest

OnVelocities = Sequence[tuple[str, LocalConstraint]]


@dataclass(frozen=True)
class Taken:
    """What constraints on velocities have become.

    Attributes
    ----------
    solution
        Coordinates that are eliminated, in terms of those that are left.
    speeds
        The same for speeds.
    integrals
        Constraints that have become ones on positions.
    left
        Those that stay what they are.
    """

    solution: Mapping[Expression, Expression]
    speeds: Mapping[Expression, Expression]
    integrals: tuple[Integral, ...]
    left: tuple[tuple[str, LocalConstraint], ...]


def take_up(
    derivation: Derivation,
    site: Site,
    masses: Masses,
    forest: SpanningForest,
    motion: Motion,
    solution: Mapping[Expression, Expression],
    values: Values,
    rolling: OnVelocities,
) -> Taken:
    """Find out what becomes of constraints on velocities in the reduced form."""
    found, left = dict(solution), list(rolling)
    integrals: list[Integral] = []
    while left:
        integrals += _held_still(derivation, motion, found, values, len(integrals))
        state = motion.finish(found)
        places = Places(state, derivation.time)
        forms = _forms(derivation, site, state, left)
        moving = [form for form in forms if not is_idle(derivation, places, form)]
        left = [(form.path, form.constraint) for form in moving]
        even = not any(form.switches for form in moving)
        new = linear_integrals(derivation, places, moving, together=even)
        if not new:
            held = any(value is not SOLVED and _holds(value, found, state) for _, _, value in values)
            in_turn = even and not held and derivation.space.is_spatial
            speeds = _solved_speeds(derivation, places, moving) if in_turn else {}
            return Taken(found, speeds, tuple(integrals), () if speeds else tuple(left))
        made = [
            _integral(derivation, state, moving, members, c, len(integrals) + i) for i, (members, c) in enumerate(new)
        ]
        pending: Values = [
            (moving[members[-1]].path, moving[members[-1]].constraint, one.value)
            for (members, _), one in zip(new, made, strict=True)
        ]
        more = eliminate_linear(derivation, masses, forest, motion.all_coordinates, pending, found)
        used = {members[-1] for (members, _), (_, _, value) in zip(new, pending, strict=True) if value is SOLVED}
        if not used:
            return Taken(found, {}, tuple(integrals), tuple(left))
        found = more
        integrals += [one for (members, _), one in zip(new, made, strict=True) if members[-1] in used]
        left = [one for i, one in enumerate(left) if i not in used]
    return Taken(found, {}, tuple(integrals), ())


def without_idle_spins(
    derivation: Derivation, state: Movement, taken: Taken, on_velocities: OnVelocities, values: Values
) -> Taken:
    """Return the same with spins that have no inertia: each takes one speed away, where nothing else is constrained."""
    idle = tuple(one for one in on_velocities if one[1].law is IDLE_SPIN)
    if not idle:
        return taken
    alone = not taken.left and all(value is SOLVED for _, _, value in values)
    spins = idle_speeds(derivation, state) if alone else None
    if spins is None:
        return replace(taken, left=(*taken.left, *idle))
    rolling = dict(zip(taken.speeds, substitute(list(taken.speeds.values()), spins), strict=True))
    return replace(taken, speeds={**rolling, **spins})


def _held_still(
    derivation: Derivation,
    motion: Motion,
    solution: dict[Expression, Expression],
    values: Values,
    count: int,
) -> list[Integral]:
    """Eliminate coordinates that a constraint on positions keeps where they start, as both wheels do a cart's angle.

    Such a constraint depends on one coordinate alone, which is at a root of it that stands by itself.
    """
    made: list[Integral] = []
    state: Movement | None = None
    for number, (path, one, given) in enumerate(values):
        if given is SOLVED:
            continue
        value = substitute([given], solution)[0] if solution else given
        state = state or motion.finish(solution)
        places = Places(state, derivation.time)
        alone = None if switches([value]) else decide(derivation, partial(_depends_on_one, places, value))
        if alone is None:
            continue
        symbol = state.coordinates[alone]
        (gradient,) = jvp([value], {symbol: 1.0})
        is_length = state.names[alone].unit == "m"
        if not decide(derivation, partial(_stands_by_itself, places, symbol, gradient, is_length)):
            continue
        constant = derivation.table.graph.zero  # it shapes the equations, as other zeros do
        if not decide(derivation, partial(_is_at_zero, symbol, is_length)):
            constant = from_start(derivation, f"place {count + len(made)}", "reduced", symbol)
        solution.update({s: substitute([e], {symbol: constant})[0] for s, e in solution.items()})
        solution[symbol] = constant
        values[number] = (path, one, SOLVED)
        made.append(Integral(((path, one.law.name, one.index),), symbol - constant, constant, False))
        state = None  # it is another motion now
    return made


def _stands_by_itself(
    places: Places, symbol: Expression, gradient: Expression, is_length: bool, mechanism: Mechanism
) -> bool:
    """Return whether a coordinate starts at a root that stands by itself, of a value with the given slope.

    The slope depends on no other coordinate, so any place will do for those that the start gives in other coordinates.
    """
    assert mechanism.places is not None
    start = {**places.some(mechanism), **mechanism.table.values, **mechanism.places["reduced"]}
    step = 0.5 * _unit(mechanism, is_length)
    near, away = (evaluate([gradient], {**start, symbol: start[symbol] + far})[0] for far in (0.0, step))
    return abs(near) > 1e-3 * abs(away)


def _is_at_zero(symbol: Expression, is_length: bool, mechanism: Mechanism) -> bool:
    """Return whether a coordinate starts at zero, but for rounding."""
    assert mechanism.places is not None
    return abs(mechanism.places["reduced"][symbol]) <= 1e-13 * _unit(mechanism, is_length)


def _unit(mechanism: Mechanism, is_length: bool) -> float:
    return (extent(mechanism) or 1.0) if is_length else 1.0


def _depends_on_one(places: Places, value: Expression, mechanism: Mechanism) -> int | None:
    """Return the number of the only coordinate that a value depends on; None if it is not one with a speed of its own.

    What cancels but for rounding, as the product of two directions at a right angle, is no dependence; and what holds
    wherever it is asked depends on none.
    """
    state = places.state
    found = jacobian([value], [*state.coordinates, mechanism.time])
    is_certain = places.certain(mechanism, found.entries) if found.columns else np.zeros((0, 0))
    if len(is_certain) < NEEDED:
        return None
    which = [column for column, moves in zip(found.columns, np.any(is_certain, axis=0), strict=True) if moves]
    alone = which[0] if len(which) == 1 else len(state.coordinates)
    return alone if alone < len(state.coordinates) and state.rates[alone] in set(state.speeds) else None


def _holds(value: Expression, solution: Mapping[Expression, Expression], state: Movement) -> bool:
    return depends_on(substitute([value], solution)[0] if solution else value, state.coordinates)


def _forms(mechanism: Mechanism, site: Site, state: Movement, rolling: OnVelocities) -> list[Form]:
    forms = []
    for path, one in rolling:
        local = mechanism.locals_[path]
        part = place_part(site, local, state.kinematics)
        (form,) = pfaffian_forms(state, [(path, one, part.put([one.value])[0])])
        velocities = local.velocities
        gradients = part.put(vjp([one.value], [one.value.graph.constant(1.0)], velocities))
        moved = jacobian([part.mapping.get(s, s) for s in velocities], list(state.speeds))
        terms = tuple((c, gradients[r] * e) for r, c, e in moved.triples)
        forms.append(replace(form, terms=terms))
    return forms


def _integral(
    derivation: Derivation,
    state: Movement,
    forms: Sequence[Form],
    members: Sequence[int],
    coefficients: Mapping[int, Expression],
    number: int,
    form: str = "reduced",
) -> Integral:
    """Return an integral with its constant, a parameter that gets its value from the start."""
    graph = derivation.table.graph
    places = {rate: q for q, rate in zip(state.coordinates, state.rates, strict=True)}
    symbols = [places.get(speed) for speed in state.speeds] + [derivation.time]
    total = graph.zero
    for i, c in coefficients.items():
        symbol = symbols[i]
        assert symbol is not None
        total = total + c * symbol
    # Also where it is zero, which another start need not make it.
    constant = from_start(derivation, f"integral {number} ({form})", form, graph.convert(total))
    keys = tuple((forms[i].path, forms[i].constraint.law.name, forms[i].constraint.index) for i in members)
    return Integral(keys, graph.convert(total - constant), constant)


def _solved_speeds(derivation: Derivation, places: Places, forms: Sequence[Form]) -> dict[Expression, Expression]:
    """Return speeds in terms of the others, one for each form; none unless all forms can be solved so."""
    state = places.state
    rates = set(state.rates)
    solved: dict[Expression, Expression] = {}
    for form in forms:
        rate = substitute([form.rate], solved)[0] if solved else form.rate
        (now,) = pfaffian_forms(state, [(form.path, form.constraint, rate)])
        allowed = [i for i, speed in enumerate(state.speeds) if speed in rates and speed not in solved]
        chosen = constant_pivot(derivation, places, now, allowed)
        if chosen is None:
            return {}
        pivot, coefficient = chosen
        speed = state.speeds[pivot]
        # What is left without the speed is as short as it was; a sum over all slopes would be longer.
        value = -substitute([rate], {speed: 0.0})[0] / coefficient
        solved = {s: substitute([e], {speed: value})[0] for s, e in solved.items()}
        solved[speed] = value
    return solved


def integrated(
    derivation: Derivation, site: Site, state: Movement, rolling: OnVelocities
) -> dict[tuple[str, str, int], Integral]:
    """Return the constraints on velocities that are ones on positions by themselves, in the dae form."""
    if derivation.places is None or not rolling:
        return {}
    forms = _forms(derivation, site, state, rolling)
    found = linear_integrals(derivation, Places(state, derivation.time), forms, together=False)
    made = [_integral(derivation, state, forms, *one, number, "dae") for number, one in enumerate(found)]
    return {one.keys[-1]: one for one in made}
