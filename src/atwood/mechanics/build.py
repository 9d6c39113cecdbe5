"""From forest to equations: placements, linear elimination, derivatives, rows."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from atwood.errors import DeclarationError
from atwood.expr import Expression, Graph, live, read_by, substitute
from atwood.lazy_dataclasses import replace
from atwood.mechanics.constraints.elimination import (
    SOLVED,
    check_held,
    drop_closed,
    eliminate_linear,
    without_whole_turns,
)
from atwood.mechanics.constraints.knots import balance_knots, linear_knots
from atwood.mechanics.constraints.massless_spins import IDLE_SPIN
from atwood.mechanics.constraints.read_multipliers import are_own, known_multipliers, with_known
from atwood.mechanics.constraints.rolling import Taken, integrated, take_up, without_idle_spins
from atwood.mechanics.constraints.values import (
    Values,
    constraint_values,
    contact_rows,
    find_constraints,
    levels,
    velocity_levels,
)
from atwood.mechanics.dynamics.augmented import difference
from atwood.mechanics.dynamics.equations import Equations, force_rows, motion_rows
from atwood.mechanics.dynamics.forces import Site, in_joint_coordinates, place_part
from atwood.mechanics.dynamics.inertia import Masses, add_masses, check_masses
from atwood.mechanics.kinematics.mechanism import Derivation, Mechanism, derivation_of
from atwood.mechanics.kinematics.motion import Motion, Movement, motion_in_plane, motion_in_space
from atwood.mechanics.kinematics.orientation import body_offsets
from atwood.mechanics.kinematics.positions import BodyShape, Kinematics, shapes
from atwood.model.declare.component import bind
from atwood.model.local.parts import LocalConstraint, LocalState, multiplier_symbol
from atwood.model.values.space import Vector
from atwood.topology.spanning_forest import Coordinate, SpanningForest


def build_equations(mechanism: Mechanism, forest: SpanningForest) -> Equations:
    """Derive the equations of motion of a mechanism in one form."""
    derivation = derivation_of(mechanism)
    graph, bodies, space = derivation.table.graph, derivation.bodies, derivation.space
    layouts = {body.index: body_offsets(body, space) for body in bodies.bodies}
    masses = add_masses(derivation.graph, bodies, derivation.locals_, layouts, space)
    check_masses(masses, derivation.table.values)
    shape_of = _from_origin(shapes(bodies, layouts, {i: one.center for i, one in masses.bodies.items()}), derivation)
    turns = {node: turn for _, body_turns in layouts.values() for node, turn in body_turns.items()}
    site = Site(graph, derivation.graph, bodies, space, turns)
    motion = (motion_in_space if space.is_spatial else motion_in_plane)(derivation, forest, shape_of)
    values, taken = _use_up(derivation, site, masses, forest, motion)
    state, signals, rows, values, taken = _moving(derivation, site, masses, forest, motion, values, taken)
    values, prescribed = drop_closed(derivation, state.coordinates, values)
    held = [(path, c, _multiplier(graph, path, c)) for path, c, _ in values]
    rolling = [(path, c, _multiplier(graph, path, c)) for path, c in taken.left]
    integrals = integrated(derivation, site, state, taken.left) if forest.form == "dae" else {}
    # Before the constraints' rates, which can then be written with the slopes that the forces are made of.
    forces = force_rows(site, derivation.locals_, state.kinematics, [*held, *rolling], signals, state.speeds)
    constraints = (
        *levels(derivation, site, state, held, [value for _, _, value in values]),
        *velocity_levels(derivation, site, state, rolling, signals, integrals),
    )
    pushes, constraints = balance_knots(derivation, state, rows, forces, constraints)
    parts = _states(derivation, site, state.kinematics, signals)
    made = Equations(
        graph=graph,
        forest=forest,
        site=site,
        locals_=derivation.locals_,
        masses=masses,
        shapes=shape_of,
        kinematics=state.kinematics,
        time=derivation.time,
        coordinates=(*state.coordinates, *(one.symbol for one in parts)),
        speeds=state.speeds,
        accelerations=state.accelerations,
        names=(
            *_counted_from(derivation, forest, state.names),
            *(Coordinate(one.path, one.unit) for one in parts),
        ),
        speed_names=state.speed_names,
        rates=(*state.rates, *(one.rate for one in parts)),
        rows=tuple(rows),
        constraint_rows=pushes,
        constraints=constraints,
        eliminated=_names_of(forest, motion.all_coordinates, taken.solution),
        prescribed=prescribed,
        orientation_coordinates=state.orientation_coordinates,
        solved_speeds=tuple(s.name.removeprefix("u:") for s in taken.speeds),
        integrals=(*taken.integrals, *integrals.values()),
        states=parts,
        constants=dict(derivation.found),
        contacts=contact_rows(derivation, site, state, signals),
    )
    read = _read_multipliers(derivation, signals) if derivation.can_read_multipliers else []
    if read and forest.form == "reduced" and not are_own(derivation, made, read):
        return replace(made, read=dict(zip(read, read, strict=True)), decisions=tuple(derivation.decided))
    with derivation.relations.reading(False):
        made = with_known(made, known_multipliers(derivation, made, read)) if read else made
    return replace(made, decisions=tuple(derivation.decided))  # with those about what is read


def _moving(
    derivation: Derivation,
    site: Site,
    masses: Masses,
    forest: SpanningForest,
    motion: Motion,
    values: Values,
    taken: Taken,
) -> tuple[Movement, dict[Expression, Expression], list[Expression], Values, Taken]:
    """Return how the mechanism moves, with its linked inputs and its forces, with linear knots eliminated."""
    while True:
        state = motion.finish(taken.solution, taken.speeds)
        signals = resolve_signals(derivation, site, state.kinematics)
        rows = motion_rows(site, derivation.locals_, masses, state.kinematics, state.lifted, signals, state.speeds)
        knots = linear_knots(derivation, state, rows, values) if forest.form == "reduced" and not taken.left else {}
        if not knots:
            return state, signals, rows, values, taken
        placed = dict(zip(taken.solution, substitute(list(taken.solution.values()), knots), strict=True))
        taken = replace(taken, solution={**placed, **knots})
        values = [(path, c, substitute([v], knots)[0]) for path, c, v in values]


def _use_up(
    derivation: Derivation, site: Site, masses: Masses, forest: SpanningForest, motion: Motion
) -> tuple[Values, Taken]:
    """Use up the constraints that eliminate coordinates or speeds of the reduced form."""
    found = find_constraints(derivation, forest, motion.placements)
    values = constraint_values(derivation, site, motion.placements, found.on_positions)
    if derivation.space.is_planar:
        named = zip(motion.all_coordinates, forest.coordinates, strict=True)
        values = without_whole_turns(derivation, [symbol for symbol, one in named if one.unit == "rad"], values)
    check_held(derivation, masses, forest, motion.all_coordinates, values, found.on_velocities)
    if forest.form != "reduced":
        return values, Taken({}, {}, (), found.on_velocities)
    solution = eliminate_linear(derivation, masses, forest, motion.all_coordinates, values)
    taken = Taken(solution, {}, (), found.on_velocities)
    if derivation.places is not None:
        others = [one for one in found.on_velocities if one[1].law is not IDLE_SPIN]
        taken = take_up(derivation, site, masses, forest, motion, solution, values, others)
        taken = without_idle_spins(derivation, motion.finish(taken.solution), taken, found.on_velocities, values)
    solution = dict(taken.solution)
    return [
        (path, c, substitute([v], solution)[0] if solution else v) for path, c, v in values if v is not SOLVED
    ], taken


def _from_origin(shape_of: Mapping[int, BodyShape], mechanism: Mechanism) -> Mapping[int, BodyShape]:
    """Return the shapes of bodies, with what is fixed as positions are counted."""
    table, space, world = mechanism.table, mechanism.space, shape_of[0]
    if not table.origin:
        return shape_of
    origin = space.vector(table.origin)

    def counted(place: Vector) -> Vector:
        pairs = ((table.graph.convert(p), table.graph.convert(o)) for p, o in zip(place, origin, strict=True))
        return Vector(*(difference(p, o) for p, o in pairs))

    offsets = {node: counted(place) for node, place in world.offsets.items()}
    return {**shape_of, 0: BodyShape(offsets, world.turns, counted(world.reference))}


def _counted_from(mechanism: Mechanism, forest: SpanningForest, names: Sequence[Coordinate]) -> tuple[Coordinate, ...]:
    """Return the names of coordinates, of which positions say what they are counted from, if not the world's origin."""
    if mechanism.origin is None:
        return tuple(names)
    free = (one for one in forest.attachments if one.joint is None)
    positions = {forest.coordinates[i].name for one in free for i in one.coordinates}
    beyond = f" from {'.'.join(mechanism.origin)}"
    return tuple(replace(one, name=one.name + beyond) if one.name in positions else one for one in names)


def _names_of(forest: SpanningForest, symbols: Sequence[Expression], chosen: Collection[Expression]) -> tuple[str, ...]:
    """Return the names of the coordinates whose symbols are among those that were chosen."""
    return tuple(one.name for one, symbol in zip(forest.coordinates, symbols, strict=True) if symbol in chosen)


def _states(
    mechanism: Mechanism, site: Site, kinematics: Kinematics, signals: Mapping[Expression, Expression]
) -> tuple[LocalState, ...]:
    """Return the continuous states of all parts, with their rates where the parts are."""
    found: list[LocalState] = []
    for local in mechanism.locals_.values():
        if local.states:
            rates, _ = in_joint_coordinates(local, kinematics, [one.rate for one in local.states])
            placed = place_part(site, local, kinematics, signals).put(rates)
            found += (replace(one, rate=rate) for one, rate in zip(local.states, placed, strict=True))
    return tuple(found)


def _multiplier(graph: Graph, path: str, one: LocalConstraint) -> Expression:
    return multiplier_symbol(graph, path, one.law.name, one.index)


def _read_multipliers(mechanism: Mechanism, signals: Mapping[Expression, Expression]) -> list[Expression]:
    """Return the multipliers that laws of force read, by themselves or through linked inputs."""
    read = [symbol for local in mechanism.locals_.values() for symbol in local.reads]
    graph, feeding = mechanism.table.graph, {source: None for source, _ in mechanism.links.values()}
    offered = [_multiplier(graph, path, c) for path in feeding for c in mechanism.locals_[path].constraints]
    used = {node.index for node in live(list(signals.values()))} if offered else set()
    read += [symbol for symbol in offered if symbol.index in used]
    return list(dict.fromkeys(read))


def resolve_signals(
    mechanism: Mechanism, site: Site, kinematics: Kinematics, read: Mapping[Expression, Expression] | None = None
) -> dict[Expression, Expression]:
    """Return what each linked input stands for, and the multipliers that laws of force read where these are known."""
    with mechanism.relations.reading():
        found = _resolved(mechanism, site, kinematics)
    if read:
        found = {**dict(zip(found, substitute(list(found.values()), dict(read)), strict=True)), **read}
    return found


def _resolved(mechanism: Mechanism, site: Site, kinematics: Kinematics) -> dict[Expression, Expression]:
    raw: dict[Expression, Expression] = {}
    for (path, name), (source, observable) in mechanism.links.items():
        if name not in mechanism.locals_[path].signal_symbols:
            continue  # a function of time, which is in place already
        local = mechanism.locals_[source]
        from atwood.model.local.laws import output_value  # few scenes have links

        inputs = replace(local.binding, values={**local.binding.values, **local.signal_symbols})
        value = output_value(local.part, bind(local.part.component, inputs), observable, mechanism.space)
        (value,), _ = in_joint_coordinates(local, kinematics, [site.graph.convert(value)])
        (raw[mechanism.locals_[path].signal_symbols[name]],) = place_part(site, local, kinematics).put([value])
    return _in_turn(mechanism, raw)


def _in_turn(mechanism: Mechanism, raw: Mapping[Expression, Expression]) -> dict[Expression, Expression]:
    """Return what inputs stand for without other inputs in it."""
    reads = {symbol: read_by([value], raw) for symbol, value in raw.items()}
    found: dict[Expression, Expression] = {}
    while len(found) < len(raw):
        ready = [one for one in raw if one not in found and all(other in found for other in reads[one])]
        if not ready:
            raise _circle(mechanism, {one: reads[one] for one in raw if one not in found})
        for one in ready:
            found[one] = substitute([raw[one]], found)[0] if reads[one] else raw[one]
    return {one: found[one] for one in raw}


def _circle(mechanism: Mechanism, reads: Mapping[Expression, list[Expression]]) -> DeclarationError:
    """Return the error that names inputs that feed each other in a circle, in the order in which they do."""
    way = [next(iter(reads))]
    while way.count(way[-1]) < 2:
        way.append(next(one for one in reads[way[-1]] if one in reads))
    circle = way[way.index(way[-1]) : -1][::-1]
    ends = {
        mechanism.locals_[path].signal_symbols.get(name): (".".join(source), f"{path}.{name}")
        for (path, name), source in mechanism.links.items()
    }
    steps = ", ".join(" -> ".join(ends[one]) for one in circle)
    return DeclarationError(
        f"inputs and outputs form an algebraic loop: {steps}",
        where=ends[circle[0]][1],
        advice="Break the loop with a part that has a state, such as a filter or a delay, or solve it within one part.",
    )
