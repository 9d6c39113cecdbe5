"""Knots: what moves without inertia, and where it is follows from the balance of the forces on it.

The equation of motion along such a direction has no acceleration: ``Q(q, u, t) = 0``. It is taken as a constraint, on
positions where no damper acts and else on velocities. Its own force is zero, since along that direction nothing else
could balance it; so it does no work, and all forms, starts and methods treat it as they do any constraint.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from atwood.errors import AtwoodError, TopologyError
from atwood.expr import Expression, depends_on, jacobian, jvp, live, substitute
from atwood.expr.core.analysis import dependents
from atwood.mechanics.constraints.elimination import solved_with
from atwood.mechanics.constraints.pfaffian import Places
from atwood.mechanics.constraints.values import Values
from atwood.mechanics.dynamics.equations import Constraint, constraint_levels
from atwood.mechanics.kinematics.mechanism import Derivation, Mechanism, decide, place_of_largest
from atwood.mechanics.kinematics.motion import Movement
from atwood.model.local.parts import multiplier_symbol

BALANCES = {"force_balance": "N", "torque_balance": "N*m"}
"""Names of these constraints and units of their multipliers; they miss by what would have to move to bring balance."""

Balance = tuple[int, Expression]
"""Number of the speed along which nothing has inertia, and the force there."""


def linear_knots(
    derivation: Derivation, state: Movement, rows: Sequence[Expression], values: Values
) -> dict[Expression, Expression]:
    """Return the coordinates that follow from a balance of forces that is linear in them."""
    found: dict[Expression, Expression] = {}
    light = _without_inertia(rows, state)
    of_speed = {rate: q for q, rate in zip(state.coordinates, state.rates, strict=True)}
    for k in light:
        row, own = rows[k], of_speed.get(state.speeds[k])
        if own is None or depends_on(row, state.speeds):
            continue
        (force,) = substitute([row], found)
        (slope,) = jvp([force], {own: 1.0})
        if not slope.is_parametric or not decide(derivation, partial(_size, Places(state, derivation.time), slope)):
            continue
        if depends_on([value for _, _, value in values], [own]):
            continue
        _check_untouched(derivation, state.speed_names[k].name, force)
        found = solved_with(found, force, own, slope)
    return found


def balance_knots(
    derivation: Derivation,
    state: Movement,
    rows: Sequence[Expression],
    forces: Sequence[Expression],
    constraints: Sequence[Constraint],
) -> tuple[tuple[Expression, ...], tuple[Constraint, ...]]:
    """Return the forces of constraints, and the constraints, with those of knots."""
    found, made, pushes = _balances(derivation, state, rows, constraints), list(constraints), list(forces)
    rates = dict(zip(state.coordinates, state.rates, strict=True))
    along: dict[Expression, Expression | float] = {derivation.time: 1.0, **rates}
    along.update(zip(state.speeds, state.accelerations, strict=True))
    for number, (k, force) in enumerate(found):
        name = state.speed_names[k]
        is_rate = depends_on(force, state.speeds)
        own = state.speeds[k] if is_rate else next((q for q, rate in rates.items() if rate is state.speeds[k]), None)
        slope = None if own is None else _slope(derivation, state, force, own)
        if slope is None or (is_rate and _bends(force, state.speeds)):
            continue  # nothing balances it, and it is refused as what has no mass
        _check_untouched(derivation, name.name, force)
        value = force / slope
        if is_rate:
            rate, (second,) = value, jvp([value], along)
        else:
            (rate,), (second,) = constraint_levels(
                [value], derivation.time, state.coordinates, state.rates, state.speeds, state.accelerations
            )
        law = "force_balance" if name.unit == "m/s" else "torque_balance"
        path = _part_of(derivation, name.name)
        multiplier = multiplier_symbol(derivation.table.graph, path, law, number)
        key = path, law, number
        made.append(Constraint(key, law, 1.0, None if is_rate else value, rate, second, multiplier, not is_rate))
        slopes = jacobian([rate], list(state.speeds))
        for column, entry in zip(slopes.columns, slopes.entries, strict=True):
            pushes[column] = pushes[column] + multiplier * entry
    return tuple(pushes), tuple(made)


def _balances(
    derivation: Derivation, state: Movement, rows: Sequence[Expression], constraints: Sequence[Constraint]
) -> list[Balance]:
    """Return the directions without inertia that constraints leave free, and the forces along them.

    Constraints among what has no inertia, such as gears, join speeds where their coefficients are the same everywhere;
    where these change, they hold what they touch.
    """
    multipliers = [one.multiplier for one in constraints]
    light = [state.speeds[k] for k in _without_inertia(rows, state) if not depends_on(rows[k], multipliers)]
    solved: dict[Expression, Expression] = {}
    for one in constraints if light else ():
        slopes = jacobian([one.rate], light)
        touched = [light[column] for column in slopes.columns]
        if not all(entry.is_parametric for entry in slopes.entries):
            light = [symbol for symbol in light if symbol not in touched]
            continue
        terms = [entry * symbol for entry, symbol in zip(slopes.entries, touched, strict=True)]
        if not terms:
            continue
        (joined,) = substitute([sum(terms[1:], terms[0])], solved)
        left = jacobian([joined], light)
        if not left.entries:
            continue
        pivot = decide(derivation, partial(place_of_largest, tuple(left.entries)))
        symbol = light[left.columns[pivot]]
        solved = solved_with(solved, joined, symbol, left.entries[pivot])
    found = []
    for k, symbol in enumerate(state.speeds):
        if symbol in light and symbol not in solved:
            force = rows[k]
            for other, value in solved.items():
                (share,) = jvp([value], {symbol: 1.0})
                force = force + share * rows[state.speeds.index(other)]
            found.append((k, force))
    return found


def _without_inertia(rows: Sequence[Expression], state: Movement) -> list[int]:
    """Return the numbers of the rows without accelerations; none where nothing has mass and would move by itself."""
    heavy = dependents(live(rows), state.accelerations)
    light = [k for k, row in enumerate(rows) if row.index not in heavy]
    return light if len(light) < len(rows) else []


def _check_untouched(mechanism: Mechanism, name: str, force: Expression) -> None:
    """Refuse a balance with the force of a gap or a slip, which has a value where it holds alone."""
    for path, local in mechanism.locals_.items():
        for one in local.contacts:
            if depends_on(force, [one.multiplier]):
                raise TopologyError(
                    f"it has no mass, and {path}.{one.law.name} acts on it: nothing else says how it moves",
                    where=_part_of(mechanism, name),
                    advice="Give it a mass, or a moment of inertia; a small one will do.",
                )


def _slope(derivation: Derivation, state: Movement, force: Expression, own: Expression) -> Expression | None:
    """Return by how much a force grows along its own direction, or the size of that where it changes; None if zero."""
    (slope,) = jvp([force], {own: 1.0})
    if slope.is_zero:
        return None
    size = decide(derivation, partial(_size, Places(state, derivation.time), slope))
    if not size:
        return None
    return slope if slope.is_parametric else derivation.table.graph.constant(size)


def _size(places: Places, slope: Expression, mechanism: Mechanism) -> float:
    """Return the size of a slope, by its mean over some places."""
    numbers = np.zeros(0)
    try:
        numbers = np.abs(places.values(mechanism, [slope]))
    except AtwoodError:  # it reads what is known in a run only
        return 1.0
    return float(np.mean(numbers)) if len(numbers) else 0.0


def _bends(force: Expression, speeds: Sequence[Expression]) -> bool:
    """Return whether a force is not affine in the speeds."""
    return depends_on(jacobian([force], list(speeds)).entries, speeds)


def _part_of(mechanism: Mechanism, name: str) -> str:
    """Return the part that a speed belongs to."""
    while name and name not in mechanism.locals_:
        name = name.rpartition(".")[0]
    return name or next(iter(mechanism.locals_))
