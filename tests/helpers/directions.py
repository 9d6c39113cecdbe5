"""Planar scenes whose angles are replaced by two coordinates each, as orientations in space have more than speeds.

An angle becomes a direction (c, s), of which only the ratio means something, with the angle's speed:
``c' = -s u``, ``s' = c u``. So the motion is known: it is that of the ordinary scene.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

from atwood import Model
from atwood.expr import Expression, OutputGroup, Program, atan2, cos, sin, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.other_values import MAXIMAL, REDUCED
from atwood.forms.program import state_groups
from atwood.forms.quantities import TO_MAXIMAL, to_maximal
from atwood.mechanics.dynamics.equations import Equations
from atwood.pipeline import assemble
from atwood.topology.orientation_coordinates import OrientationCoordinates
from atwood.topology.spanning_forest import Coordinate

Rewriter = Callable[[list[Expression]], list[Expression]]


@dataclass(frozen=True)
class _Place:
    """An expression that was taken out, by its number."""

    number: int


def _taken_out(value: Any, found: list[Expression]) -> Any:
    """Return a value with its expressions taken out; parts of a mechanism that hold no coordinates stay as they are."""
    if isinstance(value, Expression):
        found.append(value)
        return _Place(len(found) - 1)
    if isinstance(value, tuple):
        return tuple(_taken_out(one, found) for one in value)
    if isinstance(value, Mapping):
        return {key: _taken_out(one, found) for key, one in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{one.name: _taken_out(getattr(value, one.name), found) for one in fields(value)})
    return value


def _put_back(value: Any, made: list[Expression]) -> Any:
    if isinstance(value, _Place):
        return made[value.number]
    if isinstance(value, tuple):
        return tuple(_put_back(one, made) for one in value)
    if isinstance(value, dict):
        return {key: _put_back(one, made) for key, one in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{one.name: _put_back(getattr(value, one.name), made) for one in fields(value)})
    return value


def rewritten(value: Any, mapping: Mapping[Expression, Expression]) -> Any:
    """Return a tree of expressions with symbols replaced."""
    found: list[Expression] = []
    skeleton = _taken_out(value, found)
    return _put_back(skeleton, substitute(found, mapping) if found else [])


def directions_of(equations: Equations) -> tuple[Equations, dict[Expression, Expression]]:
    """Return equations with a direction for each angle, and what each angle is in terms of it."""
    graph = equations.graph
    coordinates: list[Expression] = []
    names: list[Coordinate] = []
    rates: list[Expression] = []
    orientation_coordinates: list[OrientationCoordinates] = []
    angles: dict[Expression, Expression] = {}
    for number, (q, one, u) in enumerate(zip(equations.coordinates, equations.names, equations.speeds, strict=True)):
        if one.unit != "rad":
            coordinates.append(q)
            names.append(one)
            rates.append(u)
            continue
        c, s = graph.symbol(f"{q.name}.c"), graph.symbol(f"{q.name}.s")
        angles[q] = atan2(s, c)
        orientation_coordinates.append(
            OrientationCoordinates("direction", (len(coordinates), len(coordinates) + 1), (number,), one.name)
        )
        coordinates += [c, s]
        names += [Coordinate(f"{one.name}.c", "1"), Coordinate(f"{one.name}.s", "1")]
        rates += [-(s * u), c * u]
    made = replace(
        equations,
        coordinates=tuple(coordinates),
        names=tuple(names),
        rates=tuple(rates),
        orientation_coordinates=tuple(orientation_coordinates),
        kinematics=rewritten(equations.kinematics, angles),
        rows=rewritten(equations.rows, angles),
        constraint_rows=rewritten(equations.constraint_rows, angles),
        constraints=rewritten(equations.constraints, angles),
    )
    return made, angles


def with_directions(scene: Model, form: str = "reduced", level: str = "ggl") -> Assembly:
    """Return an assembled scene with a direction for each of its angles, in either form."""
    return turn_directed(assemble(scene, form=form, level=level))


def turn_directed(assembly: Assembly) -> Assembly:
    """Replace the angles of an assembly that nothing has been made of yet."""
    plain, maximal = assembly.reduced, assembly.maximal
    placing = to_maximal(assembly)
    reduced, angles = directions_of(plain)
    positions, speeds = (substitute(list(group.expressions), angles) for group in placing.outputs)
    turned: list[Expression] = []
    for place, one in zip(positions, maximal.names, strict=True):
        turned += [cos(place), sin(place)] if one.unit == "rad" else [place]
    outputs = (OutputGroup("q", tuple(turned)), OutputGroup("u", tuple(speeds)))
    program = Program(placing.name, state_groups(reduced), placing.parameters, outputs)
    made = {REDUCED: reduced, MAXIMAL: directions_of(maximal)[0], (TO_MAXIMAL, True): program}
    assembly.shared._made.update(made)
    vars(assembly).pop("own_equations", None)  # known since it was assembled
    return assembly
