"""Places of bodies in terms of generalized coordinates: what both forms have in common."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from atwood.expr import Expression, OutputGroup, Program
from atwood.forms.program import state_groups
from atwood.mechanics.equations import Equations

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly

__all__ = ["maximal_program", "regular_to_maximal"]


def maximal_program(name: str, reduced: Equations, maximal: Equations, parameters: Collection[Expression]) -> Program:
    """Return the program of (t, q, u) in generalized coordinates that gives maximal coordinates and speeds.

    Parameters
    ----------
    name
        Named in messages.
    reduced, maximal
        The equations in either coordinates.
    parameters
        The symbols of parameters.
    """
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
    return Program(name, state_groups(reduced), tuple(parameters), outputs)


def regular_to_maximal(assembly: Assembly) -> Program:
    """Return the same program for generalized coordinates with quaternions, in which starts are.

    Parameters
    ----------
    assembly
        The scene.
    """
    if assembly.regular is assembly.reduced:
        return assembly.to_maximal
    parts = f"{assembly.flat.name} to maximal coordinates", assembly.regular, assembly.maximal, assembly.parameters
    return assembly.shared.get("regular to maximal", lambda: maximal_program(*parts))
