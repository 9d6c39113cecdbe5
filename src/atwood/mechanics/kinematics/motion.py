"""How a mechanism moves in terms of the coordinates that are left after elimination, in a plane and in space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from atwood.expr import Expression, jvp, substitute
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.mechanics.kinematics.orientation import orientation_rates
from atwood.mechanics.kinematics.positions import (
    BodyShape,
    Components,
    Kinematics,
    Placements,
    differentiate,
    lifted_accelerations,
    place,
)
from atwood.mechanics.kinematics.spatial import Course, move_in_space
from atwood.topology.orientation_coordinates import OrientationCoordinates
from atwood.topology.spanning_forest import Coordinate, SpanningForest

Lifted = tuple[dict[int, Components], dict[int, Components]]
Solution = Mapping[Expression, Expression]
"""Coordinates that are eliminated, in terms of those that are left; or speeds."""

_NONE: Solution = {}


@dataclass(frozen=True)
class _Symbols:
    """Symbols of the independent coordinates and speeds of a spanning forest, with names and rates."""

    coordinates: tuple[Expression, ...]
    speeds: tuple[Expression, ...]
    accelerations: tuple[Expression, ...]
    names: tuple[Coordinate, ...]
    speed_names: tuple[Coordinate, ...]
    rates: tuple[Expression, ...]
    orientation_coordinates: tuple[OrientationCoordinates, ...]


@dataclass(frozen=True)
class Movement(_Symbols):
    """Coordinates, speeds, and everything that moves with them.

    Attributes
    ----------
    coordinates, speeds, accelerations
        The symbols that are left.
    names, speed_names
        Names and units of coordinates and speeds.
    rates
        Derivatives of the coordinates.
    orientation_coordinates
        Coordinates that stand for an orientation together.
    kinematics
        Positions, velocities, accelerations.
    lifted
        Accelerations less that of free fall, of nodes and of reference points.
    """

    kinematics: Kinematics
    lifted: Lifted


class Finish(Protocol):
    """Gives the motion in terms of what solutions for coordinates and for speeds leave."""

    def __call__(self, solution: Solution, speeds: Solution = _NONE) -> Movement:
        """Return the motion."""
        ...


@dataclass(frozen=True)
class Motion:
    """Placements in all coordinates of a forest, from which motion follows when it is known which of them are left.

    Attributes
    ----------
    all_coordinates
        The symbols of the forest's coordinates.
    placements
        Positions and orientations in terms of these.
    finish
        Gives the motion in the coordinates that a solution leaves, and, in space, in the speeds that a second one does.
    """

    all_coordinates: tuple[Expression, ...]
    placements: Placements
    finish: Finish


def _all_symbols(mechanism: Mechanism, forest: SpanningForest) -> tuple[Expression, ...]:
    return tuple(mechanism.table.graph.symbol(f"q:{c.name}") for c in forest.coordinates)


def _left(mechanism: Mechanism, forest: SpanningForest, solution: Solution, solved: Solution = _NONE) -> _Symbols:
    """Return the symbols that a solution for coordinates leaves, and one for speeds."""
    graph = mechanism.table.graph
    every = _all_symbols(mechanism, forest)
    kept = [i for i, symbol in enumerate(every) if symbol not in solution]
    gone = {f"{c.name}'" for i, c in enumerate(forest.coordinates) if every[i] in solution}
    gone |= {f"{speed.name.removeprefix('u:')}{end}" for speed in solved for end in ("'", "")}
    kept_speeds = [i for i, one in enumerate(forest.speeds) if one.name not in gone]
    place, place_of_speed = ({i: k for k, i in enumerate(some)} for some in (kept, kept_speeds))
    stems = [forest.speeds[i].name.removesuffix("'") for i in kept_speeds]
    u = tuple(graph.symbol(f"u:{stem}") for stem in stems)
    a = tuple(graph.symbol(f"a:{stem}") for stem in stems)
    orientation_coordinates = tuple(
        replace(
            one,
            coordinates=tuple(place[i] for i in one.coordinates),
            speeds=tuple(place_of_speed[i] for i in one.speeds if i in place_of_speed),
        )
        for one in forest.orientation_coordinates
    )
    q = tuple(every[i] for i in kept)
    rates: dict[int, Expression] = {}
    for orientation, one in zip(orientation_coordinates, forest.orientation_coordinates, strict=True):
        spin = [graph.symbol(f"u:{forest.speeds[i].name}") for i in one.speeds]
        parts = orientation_rates(
            orientation, [q[i] for i in orientation.coordinates], [solved.get(speed, speed) for speed in spin]
        )
        rates.update(zip(orientation.coordinates, (graph.convert(part) for part in parts), strict=True))
    own = [graph.symbol(f"u:{forest.coordinates[i].name}") for i in kept]
    return _Symbols(
        q,
        u,
        a,
        tuple(forest.coordinates[i] for i in kept),
        tuple(forest.speeds[i] for i in kept_speeds),
        tuple(rates[i] if i in rates else solved.get(speed, speed) for i, speed in enumerate(own)),
        orientation_coordinates,
    )


def motion_in_plane(mechanism: Mechanism, forest: SpanningForest, shape_of: Mapping[int, BodyShape]) -> Motion:
    """Return the motion of a mechanism on a line or in a plane."""
    graph, space = mechanism.table.graph, mechanism.space
    every = _all_symbols(mechanism, forest)
    origin = tuple(graph.symbol(f"origin:{axis}") for axis in space.axis_names)
    movable = place(graph, mechanism.bodies, forest, shape_of, every, space, origin)
    placements = _substituted(movable, dict.fromkeys(origin, graph.zero))

    def finish(solution: Solution, speeds: Solution = _NONE) -> Movement:
        assert not speeds, "in a plane, places are differentiated by coordinates, whose rates are speeds"
        left = _left(mechanism, forest, solution)
        q, u, a, time = left.coordinates, left.speeds, left.accelerations, mechanism.time
        still = _substituted(placements, solution) if solution else placements
        lifting = _substituted(movable, solution) if solution else movable
        kinematics = _with_joint_references(mechanism, differentiate(still, time, q, u, a), time, q, u, a)
        lifted = lifted_accelerations(lifting, origin, space.components(mechanism.gravity), time, q, u, a)
        return Movement(**vars(left), kinematics=kinematics, lifted=lifted)

    return Motion(every, placements, finish)


def _with_joint_references(
    mechanism: Mechanism,
    kinematics: Kinematics,
    time: Expression,
    q: Sequence[Expression],
    u: Sequence[Expression],
    a: Sequence[Expression],
) -> Kinematics:
    """Return kinematics with the rates of the joint coordinates that other parts take hold of."""
    held = {symbol for local in mechanism.locals_.values() for symbol in local.formulas}
    known = {symbol: value for symbol, value in kinematics.placements.joint_coordinates.items() if symbol in held}
    if not known:
        return kinematics
    first: dict[Expression, Expression | float] = {time: 1.0, **dict(zip(q, u, strict=True))}
    rates = jvp(list(known.values()), first)
    seconds = jvp(rates, {**first, **dict(zip(u, a, strict=True))})
    return replace(
        kinematics,
        joint_rates=dict(zip(known, rates, strict=True)),
        joint_accelerations=dict(zip(known, seconds, strict=True)),
    )


def motion_in_space(mechanism: Mechanism, forest: SpanningForest, shape_of: Mapping[int, BodyShape]) -> Motion:
    """Return the motion of a mechanism in space."""

    def finish(solution: Solution, speeds: Solution = _NONE) -> Movement:
        left = _left(mechanism, forest, solution, speeds)
        graph = mechanism.table.graph
        stems = [one.name.removesuffix("'") for one in forest.speeds]
        every_speed = [graph.symbol(f"u:{stem}") for stem in stems]
        every_rate = [graph.symbol(f"a:{stem}") for stem in stems]
        spins = {speed: value for speed, value in speeds.items() if speed not in set(left.rates)}
        turning = substitute(list(spins.values()), dict(zip(every_speed, every_rate, strict=True)))
        spin_rates = dict(zip(spins, turning, strict=True))  # these are linear, with coefficients of parameters
        course = Course(
            [solution.get(symbol, symbol) for symbol in every],
            [spins.get(speed, speed) for speed in every_speed],
            [spin_rates.get(speed, rate) for speed, rate in zip(every_speed, every_rate, strict=True)],
            {mechanism.time: 1.0, **dict(zip(left.coordinates, left.rates, strict=True))},
            dict(zip(left.speeds, left.accelerations, strict=True)),
        )
        moved = move_in_space(graph, mechanism.bodies, forest, shape_of, course, mechanism.gravity)
        return Movement(**vars(left), kinematics=moved[0], lifted=moved[1])

    every = _all_symbols(mechanism, forest)
    return Motion(every, finish({}).kinematics.placements, finish)


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
