"""Constraints where their parts are: their values, and their rates as the dual of their forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from atwood.errors import UnsupportedError
from atwood.expr import Expression, depends_on, jacobian, jvp, live
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Constraint, ContactRow, Integral, constraint_levels
from atwood.mechanics.dynamics.forces import (
    PlacedPart,
    RatesOfSymbols,
    Site,
    in_body,
    in_coordinates,
    in_joint_coordinates,
    is_on_velocities,
    joint_gradients,
    local_gradients,
    place_part,
    rates_of_symbols,
)
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.mechanics.kinematics.motion import Movement
from atwood.mechanics.kinematics.positions import Kinematics, Placements
from atwood.model.local.parts import LocalConstraint, LocalPart
from atwood.topology.spanning_forest import SpanningForest

Values = list[tuple[str, LocalConstraint, Expression]]
"""Constraints with the path of their part and an expression: their value, or their multiplier."""


@dataclass(frozen=True)
class LeftOver:
    """The constraints that the forest does not solve.

    Attributes
    ----------
    on_positions
        Holonomic ones.
    on_velocities
        Those that hold velocities only.
    """

    on_positions: tuple[tuple[str, LocalConstraint], ...]
    on_velocities: tuple[tuple[str, LocalConstraint], ...]


def holds_velocities(mechanism: Mechanism) -> bool:
    """Return whether a scene has a constraint on velocities."""
    for local in mechanism.locals_.values():
        if local.constraints:
            read = {node.index for node in live([one.value for one in local.constraints])}
            if any(symbol.index in read for symbol in local.velocities):
                return True
    return False


def find_constraints(mechanism: Mechanism, forest: SpanningForest, placements: Placements) -> LeftOver:
    """Return the constraints that hold only if somebody sees to it, in joint coordinates where these are known."""
    positions: list[tuple[str, LocalConstraint]] = []
    velocities: list[tuple[str, LocalConstraint]] = []
    for path, local in mechanism.locals_.items():
        for constraint in local.constraints:
            if depends_on(constraint.value, list(local.signal_symbols.values())):
                raise UnsupportedError(
                    "a constraint cannot follow the output of another component",
                    where=f"{path}.{constraint.law.name}",
                    advice="Give the input as a function of time.",
                )
            if (path, constraint.law.name, constraint.index) in forest.solved or constraint.value.is_zero:
                continue
            one = in_coordinates(local, constraint, placements)
            if is_on_velocities(local, one.value):
                velocities.append((path, one))
                continue
            if depends_on(one.value, [state.symbol for state in local.states]):
                raise UnsupportedError(
                    "a constraint on positions cannot follow a continuous state",
                    where=f"{path}.{constraint.law.name}",
                    advice="Write it as one on velocities, which may read the state and whose rate is then known.",
                )
            positions.append((path, one))
    return LeftOver(tuple(positions), tuple(velocities))


def constraint_values(
    mechanism: Mechanism, site: Site, placements: Placements, left: Sequence[tuple[str, LocalConstraint]]
) -> Values:
    """Return the value of each constraint in terms of coordinates."""
    still = Kinematics(placements, placements.positions, {}, {}, {}, {}, {})
    parts = {path: place_part(site, mechanism.locals_[path], still) for path in {path for path, _ in left}}
    return [(path, c, parts[path].put([c.value])[0]) for path, c in left]


def levels(
    mechanism: Mechanism, site: Site, state: Movement, chosen: Values, placed: Sequence[Expression]
) -> list[Constraint]:
    """Return holonomic constraints with their time derivatives."""
    found: list[Constraint] = []
    moving: dict[str, RatesOfSymbols] = {}
    by_parts = mechanism.space.is_spatial
    symbols = (state.coordinates, state.rates, state.speeds, state.accelerations)
    rates, seconds = constraint_levels([] if by_parts else placed, mechanism.time, *symbols)
    for number, ((path, one, multiplier), value) in enumerate(zip(chosen, placed, strict=True)):
        if by_parts:
            part = place_part(site, mechanism.locals_[path], state.kinematics)
            rate = _rate_by_gradients(part, one, mechanism.time)
            if path not in moving:
                moving[path] = rates_of_symbols(part)
            second = _differentiated(part, jvp([one.value], moving[path][0])[0], moving[path])
        else:
            rate, second = rates[number], seconds[number]
        key = (path, one.law.name, one.index)
        found.append(Constraint(key, one.reaction, one.sign, value, rate, second, multiplier, stiffness=one.stiffness))
    return found


def velocity_levels(
    mechanism: Mechanism,
    site: Site,
    state: Movement,
    chosen: Values,
    signals: Mapping[Expression, Expression],
    integrals: Mapping[tuple[str, str, int], Integral],
) -> list[Constraint]:
    """Return constraints on velocities with their time derivative; those that are integrals hold positions too."""
    found = []
    for path, one, multiplier in chosen:
        local = mechanism.locals_[path]
        _check_affine(path, local, one)
        part = place_part(site, local, state.kinematics, signals)
        rate = part.put([one.value])[0]
        second = _differentiated(part, one.value)
        key = (path, one.law.name, one.index)
        integral = integrals.get(key)
        value = None if integral is None else integral.value
        known = key, one.reaction, one.sign, value, rate, second, multiplier
        found.append(Constraint(*known, integral is not None, one.stiffness))
    return found


def contact_rows(
    mechanism: Mechanism, site: Site, state: Movement, signals: Mapping[Expression, Expression]
) -> tuple[ContactRow, ...]:
    """Return the gaps and slips of all parts where these are."""
    found: list[ContactRow] = []
    for path, local in mechanism.locals_.items():
        part = place_part(site, local, state.kinematics, signals) if local.contacts else None
        for one in local.contacts:
            assert part is not None
            held = in_coordinates(local, one.row, state.kinematics.placements)
            if one.is_slip or one.law.options.level == "velocity":
                (row,) = velocity_levels(mechanism, site, state, [(path, held, one.multiplier)], signals, {})
            else:
                placed = part.put([held.value])
                (row,) = levels(mechanism, site, state, [(path, held, one.multiplier)], placed)
            limits = (one.direction, one.limit, one.static_limit, one.restitution)
            given = [one.mask, one.force, *(x for x in limits if x is not None)]
            values, _ = in_joint_coordinates(local, state.kinematics, given)
            mask, force, *more = part.put(values)
            rest = iter(more)
            is_poisson = not one.is_slip and one.law.options.is_poisson(local.part.values)
            way, most, static, share = (None if x is None else next(rest) for x in limits)
            found.append(ContactRow(row, one.read, mask, force, one.law, way, most, static, share, is_poisson))
    return tuple(found)


def _check_affine(path: str, local: LocalPart, one: LocalConstraint) -> None:
    velocities = [s for connector in local.connectors.values() for s in (*connector.velocity, *connector.spin)]
    if depends_on(jacobian([one.value], velocities).entries, velocities):
        raise UnsupportedError(
            "a velocity constraint must be linear in the velocities",
            where=f"{path}.{one.law.name}",
            advice="Write it as a sum of velocities times functions of positions, angles and time.",
        )


def _rate_by_gradients(part: PlacedPart, one: LocalConstraint, time: Expression) -> Expression:
    """Return the rate of a constraint: the virtual power of its force for a multiplier of one, and what time adds."""
    site, kinematics = part.site, part.kinematics
    (total,) = part.put(jvp([one.value], {time: 1.0}))
    for name, gradients, torques in local_gradients(part.local, one.value, site.graph.constant(1.0)):
        node = site.node(part.local.part.path, name)
        body = site.bodies.body_of[node]
        for gradient, v in zip(part.put(gradients), kinematics.velocities[node], strict=True):
            total = total + gradient * v
        if torques and not all(gradient.is_zero for gradient in torques):
            torque = in_body(site, node, part.put(torques))
            for t, w in zip(torque, kinematics.angular_velocities[body], strict=True):
                total = total + t * w
    for symbol, gradient in joint_gradients(part.local, one.value):
        total = total + part.put([gradient])[0] * kinematics.joint_rates[symbol]
    return total


def _differentiated(part: PlacedPart, value: Expression, rates_of: RatesOfSymbols | None = None) -> Expression:
    """Return the time derivative of an expression of local positions, orientations, velocities and states, in place."""
    along, placed = rates_of_symbols(part) if rates_of is None else rates_of
    states = part.local.states
    if depends_on(value, [one.symbol for one in states]):
        rates, _ = in_joint_coordinates(part.local, part.kinematics, [one.rate for one in states])
        along = {**along, **dict(zip((one.symbol for one in states), rates, strict=True))}
    return replace(part, mapping={**part.mapping, **placed}).put(jvp([value], along))[0]
