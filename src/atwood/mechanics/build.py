"""From forest to equations: placements, linear elimination, derivatives, rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from atwood.errors import DeclarationError, TopologyError, UnsupportedError
from atwood.expr import Expression, affine_coefficients, depends_on, evaluate, substitute
from atwood.mechanics.equations import (
    Constraint,
    Equations,
    constraint_levels,
    force_rows,
    motion_rows,
    put_in_place,
)
from atwood.mechanics.forces import Site, local_map
from atwood.mechanics.inertia import Masses, add_masses
from atwood.mechanics.kinematics import (
    Kinematics,
    Placements,
    body_offsets,
    differentiate,
    lifted_accelerations,
    place,
    shapes,
)
from atwood.mechanics.mechanism import CLOSES, Mechanism, check_closures, decide, extent, make_gravity
from atwood.model.component import bind
from atwood.model.local import LocalConstraint
from atwood.model.vector import Vector
from atwood.topology.forest import Forest

__all__ = ["Mechanism", "build_equations", "check_closures", "extent", "make_gravity", "resolve_signals"]


def build_equations(mechanism: Mechanism, forest: Forest) -> Equations:
    """Derive the equations of motion of a mechanism in one form.

    Parameters
    ----------
    mechanism
        The mechanism.
    forest
        How its configuration is computed; it says which form it is.

    Raises
    ------
    TopologyError
        If rigid parts contradict each other.
    UnsupportedError
        If a law asks for what this version cannot do.
    """
    graph, bodies, space = mechanism.table.graph, mechanism.bodies, mechanism.space
    layouts = {body.index: body_offsets(body, space) for body in bodies.bodies}
    masses = add_masses(mechanism.graph, bodies, mechanism.locals_, layouts)
    shape_of = shapes(bodies, {index: one.center for index, one in masses.bodies.items()}, space)
    site = Site(
        graph,
        mechanism.graph,
        bodies,
        space,
        {node: turn for _, turns in layouts.values() for node, turn in turns.items()},
    )
    q = tuple(graph.symbol(f"q:{c.name}") for c in forest.coordinates)
    origin = tuple(graph.symbol(f"origin:{axis}") for axis in space.axis_names)
    movable = place(graph, mechanism.graph, bodies, forest, shape_of, mechanism.locals_, q, space, origin)
    placements = _substituted(movable, dict.fromkeys(origin, graph.zero))
    left = _unsolved(mechanism, forest)
    values = _constraint_values(mechanism, site, placements, left)
    _check_held(mechanism, masses, forest, q, values)
    names, eliminated = list(forest.coordinates), []
    if forest.form == "reduced":
        solution = _eliminate(mechanism, masses, forest, q, values)
        if solution:
            placements, movable = _substituted(placements, solution), _substituted(movable, solution)
            values = [(path, c, substitute([v], solution)[0]) for path, c, v in values if v is not _SOLVED]
            gone = set(solution)
            eliminated = [c.name for c, s in zip(forest.coordinates, q, strict=True) if s in gone]
            names = [c for c, s in zip(forest.coordinates, q, strict=True) if s not in gone]
            q = tuple(s for s in q if s not in gone)
    values, prescribed = _drop_closed(mechanism, q, values)
    u = tuple(graph.symbol(f"u:{c.name}") for c in names)
    a = tuple(graph.symbol(f"a:{c.name}") for c in names)
    kinematics = differentiate(placements, mechanism.time, q, u, a)
    lifted = lifted_accelerations(movable, origin, space.components(mechanism.gravity), mechanism.time, q, u, a)
    signals = resolve_signals(mechanism, site, kinematics)
    multipliers = [
        graph.symbol(f"lambda:{path}.{local_constraint.law.name}[{local_constraint.index}]")
        for path, local_constraint, _ in values
    ]
    chosen = [(path, c, multiplier) for (path, c, _), multiplier in zip(values, multipliers, strict=True)]
    rows = motion_rows(site, mechanism.locals_, masses, kinematics, lifted, signals, u)
    # Before the constraints' rates, which can then be written with the slopes that the forces are made of.
    constraint_rows = force_rows(site, mechanism.locals_, kinematics, chosen, signals, u)
    constraints = _differentiated(values, multipliers, mechanism.time, q, u, a)
    return Equations(
        graph=graph,
        forest=forest,
        site=site,
        locals_=mechanism.locals_,
        masses=masses,
        shapes=shape_of,
        kinematics=kinematics,
        time=mechanism.time,
        coordinates=q,
        speeds=u,
        accelerations=a,
        names=tuple(names),
        rows=tuple(rows),
        constraint_rows=tuple(constraint_rows),
        constraints=tuple(constraints),
        eliminated=tuple(eliminated),
        prescribed=prescribed,
    )


Values = list[tuple[str, LocalConstraint, Expression]]


def _differentiated(
    values: Values,
    multipliers: Sequence[Expression],
    time: Expression,
    q: Sequence[Expression],
    u: Sequence[Expression],
    a: Sequence[Expression],
) -> list[Constraint]:
    """Return the constraints that are left with their time derivatives."""
    found = []
    for (path, one, value), multiplier in zip(values, multipliers, strict=True):
        rate, second = constraint_levels(value, time, q, u, a)
        key = (path, one.law.name, one.index)
        found.append(Constraint(key, one.reaction, one.sign, value, rate, second, multiplier))
    return found


def _unsolved(mechanism: Mechanism, forest: Forest) -> list[tuple[str, LocalConstraint]]:
    found = []
    for path, local in mechanism.locals_.items():
        for constraint in local.constraints:
            velocities = [v for c in local.connectors.values() for v in c.velocity]
            velocities += [c.angular_speed for c in local.connectors.values() if c.angular_speed is not None]
            where = f"{path}.{constraint.law.name}"
            if depends_on(constraint.value, velocities):
                raise UnsupportedError("a constraint on velocities cannot be handled yet", where=where)
            if depends_on(constraint.value, list(local.signal_symbols.values())):
                raise UnsupportedError(
                    "a constraint cannot follow the output of another component",
                    where=where,
                    advice="Give the input as a function of time.",
                )
            if (path, constraint.law.name, constraint.index) not in forest.solved and not constraint.value.is_zero:
                found.append((path, constraint))
    return found


def _constraint_values(
    mechanism: Mechanism, site: Site, placements: Placements, left: Sequence[tuple[str, LocalConstraint]]
) -> Values:
    still = Kinematics(placements, placements.positions, {}, placements.angles, {}, {}, {})
    maps = {path: local_map(site, mechanism.locals_[path], still) for path in {path for path, _ in left}}
    return [(path, c, put_in_place(c.value, maps[path])) for path, c in left]


def _check_held(
    mechanism: Mechanism, masses: Masses, forest: Forest, q: tuple[Expression, ...], values: Values
) -> None:
    """Refuse a body that has no mass and that no joint or constraint holds."""
    weightless = _weightless(mechanism, masses, forest)
    for one in forest.attachments:
        if one.joint is not None or not weightless.issuperset(one.coordinates):
            continue
        own = [q[number] for number in one.coordinates]
        if not any(depends_on(value, own) for _, _, value in values):
            raise TopologyError(
                "it hangs free and has no mass: a force would accelerate it without bound",
                where=mechanism.bodies.bodies[one.body].name,
                advice="Connect it to something that has a mass or holds it, give it a mass, or remove it.",
            )


class _Solved:
    """Marks a constraint that elimination has used up."""


_SOLVED: Expression = _Solved()  # type: ignore[assignment]


def _eliminate(
    mechanism: Mechanism, masses: Masses, forest: Forest, q: tuple[Expression, ...], values: Values
) -> dict[Expression, Expression]:
    """Solve linear constraints for one coordinate each; mark them in `values`.

    Coordinates of what has no mass go first, then those that were met last, so that the names that a reader expects
    stay.
    """
    parameters = mechanism.table.values
    weightless = _weightless(mechanism, masses, forest)
    solution: dict[Expression, Expression] = {}
    for number, (path, constraint, original) in enumerate(values):
        value = substitute([original], solution)[0]
        free = [s for s in q if s not in solution]
        affine = affine_coefficients(value, free, list(parameters))
        if affine is None:
            continue
        coefficients, remainder = affine
        light = [q.index(symbol) in weightless for symbol in free]
        index = decide(mechanism, partial(_pivot, list(coefficients), light))
        if index is None:
            continue
        pivot = coefficients[index]
        total = remainder
        for i, coefficient in enumerate(coefficients):
            if i != index:
                total = total + coefficient * free[i]
        expression = -total / pivot
        solution = {s: substitute([e], {free[index]: expression})[0] for s, e in solution.items()}
        solution[free[index]] = mechanism.table.graph.convert(expression)
        values[number] = (path, constraint, _SOLVED)
    return solution


def _pivot(coefficients: list[Expression], light: list[bool], mechanism: Mechanism) -> int | None:
    """Return which coordinate to solve a linear constraint for: a weightless one, or the last; None if there is none.

    What is smaller than a tenth of the largest coefficient is not divided by.
    """
    sizes = [abs(c) for c in evaluate(coefficients, mechanism.table.values)] if coefficients else []
    largest = max(sizes, default=0.0)
    if largest == 0.0:
        return None
    return max((i for i, size in enumerate(sizes) if size >= 0.1 * largest), key=lambda i: (light[i], i))


def _weightless(mechanism: Mechanism, masses: Masses, forest: Forest) -> set[int]:
    """Return the numbers of the coordinates that only place a body without mass."""
    massive = {mechanism.bodies.body_of[node] for one in masses.coupled for node in one.nodes} | set(masses.bodies)
    return {number for one in forest.attachments if one.body not in massive for number in one.coordinates}


def _substituted(placements: Placements, solution: Mapping[Expression, Expression]) -> Placements:
    """Return placements with coordinates replaced: one walk over the whole position program."""
    positions, references = placements.positions, placements.references
    points = [c for group in (positions, references) for p in group.values() for c in p]
    values = iter(substitute([*points, *placements.angles.values(), *placements.joint_coordinates.values()], solution))
    return Placements(
        positions={i: tuple(next(values) for _ in p) for i, p in positions.items()},
        references={i: tuple(next(values) for _ in p) for i, p in references.items()},
        angles={i: next(values) for i in placements.angles},
        joint_coordinates={s: next(values) for s in placements.joint_coordinates},
    )


Prescribed = tuple[tuple[tuple[str, str, int], Expression], ...]


def _drop_closed(mechanism: Mechanism, q: tuple[Expression, ...], values: Values) -> tuple[Values, Prescribed]:
    """Take out the constraints that no coordinate can change; return the rest, and those that depend on time.

    Those that do not are checked here; functions of time are checked when it is known for which times.
    """
    kept: Values = []
    prescribed = []
    for path, constraint, value in values:
        if value is _SOLVED:
            continue
        if depends_on(value, q):
            kept.append((path, constraint, value))
            continue
        if depends_on(value, [mechanism.time]):
            prescribed.append(((path, constraint.law.name, constraint.index), value))
            continue
        decide(mechanism, partial(_check_closed, f"{path}.{constraint.law.name}", value))
    return kept, tuple(prescribed)


def _check_closed(where: str, value: Expression, mechanism: Mechanism) -> None:
    """Refuse a constraint between what is fixed that does not hold."""
    (miss,) = evaluate([value], mechanism.table.values)
    if not abs(miss) <= CLOSES * (extent(mechanism) or 1.0):
        raise TopologyError(
            f"it cannot hold: everything it joins is fixed, and it misses by {miss:g}",
            where=where,
            advice="Two grounds fight, or a length does not fit between them: change a length or a position.",
        )


def resolve_signals(mechanism: Mechanism, site: Site, kinematics: Kinematics) -> dict[Expression, Expression]:
    """Return what each linked input stands for.

    Raises
    ------
    DeclarationError
        If inputs feed each other in a circle, or an output needs what is known only after the forces are.
    """
    raw: dict[Expression, Expression] = {}
    for (path, name), (source, observable) in mechanism.links.items():
        if name not in mechanism.locals_[path].signal_symbols:
            continue  # a function of time, which is in place already
        local = mechanism.locals_[source]
        law, _, axis = observable.partition(".")
        inputs = replace(local.binding, values={**local.binding.values, **local.signal_symbols})
        value = getattr(bind(local.part.component, inputs), law)()
        if isinstance(value, Vector):
            if axis not in ("x", "y", "z"):
                raise DeclarationError(
                    "it is a vector",
                    where=f"{source}.{observable}",
                    advice=f"Connect {observable}.x or {observable}.z.",
                )
            value = getattr(value, axis)
        placed = put_in_place(site.graph.convert(value), local_map(site, local, kinematics))
        raw[mechanism.locals_[path].signal_symbols[name]] = placed
    for _ in range(len(raw)):
        pending = [s for s, e in raw.items() if depends_on(e, list(raw))]
        if not pending:
            return raw
        raw = {s: substitute([e], raw)[0] for s, e in raw.items()}
    if any(depends_on(e, list(raw)) for e in raw.values()):
        names = ", ".join(f"{path}.{name}" for path, name in mechanism.links)
        raise DeclarationError(f"inputs and outputs feed each other in a circle: {names}")
    return raw
