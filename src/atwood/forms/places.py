"""Places of bodies in terms of generalized coordinates: what both forms have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from atwood.expr import Expression, OutputGroup, Program
from atwood.forms.program import state_groups
from atwood.mechanics.equations import Equations

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly

__all__ = ["to_maximal"]


def to_maximal(assembly: Assembly, given: Literal["reduced", "regular"] = "reduced") -> Program:
    """Return the program of (t, q, u) in generalized coordinates that gives maximal coordinates and speeds.

    Parameters
    ----------
    assembly
        The scene.
    given
        Which generalized coordinates: those of the reduced form, or the same with quaternions, in which starts are.
    """
    equations = assembly.in_coordinates(given)
    key = "to maximal" if equations is assembly.reduced else "regular to maximal"
    return assembly.shared.get(key, lambda: _make(assembly, equations, assembly.maximal))


def _make(assembly: Assembly, reduced: Equations, maximal: Equations) -> Program:
    forest = maximal.forest
    positions: list[Expression] = [reduced.graph.constant(0.0)] * len(forest.coordinates)
    speeds: list[Expression] = [reduced.graph.constant(0.0)] * len(forest.speeds)
    kinematics = reduced.kinematics
    for one in forest.attachments:
        for k, (coordinate, speed) in enumerate(zip(one.coordinates, one.speeds, strict=True)):
            positions[coordinate] = kinematics.placements.references[one.body][k]
            speeds[speed] = kinematics.reference_velocities[one.body][k]
        for k, number in enumerate(one.chart):
            positions[number] = kinematics.placements.quaternions[one.body][k]
        for k, number in enumerate(one.spin):
            speeds[number] = kinematics.angular_velocities[one.body][k]
    for turn in forest.orientations:
        if turn.coordinate is not None:
            positions[turn.coordinate] = kinematics.placements.angles[turn.body]
            speeds[turn.coordinate] = kinematics.angular_velocities[turn.body][0]
    for symbol, (coordinate, speed) in forest.counted.items():
        positions[coordinate] = kinematics.placements.joint_coordinates[symbol]
        speeds[speed] = kinematics.joint_rates[symbol]
    outputs = (OutputGroup("q", tuple(positions)), OutputGroup("u", tuple(speeds)))
    name = f"{assembly.flat.name} to maximal coordinates"
    return Program(name, state_groups(reduced), assembly.parameters, outputs)
