"""Quantities of components as outputs of linear models."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import ParameterError, UnsupportedError, suggestion_in_parts
from atwood.expr import InputGroup, OutputGroup, Program, jacobian, live
from atwood.theory.linear.displacements import Minimal, image_of
from atwood.theory.linear.operating_point import OperatingPoint
from atwood.theory.linear.variations import Flow


def output_rows(point: OperatingPoint, flow: Flow, minimal: Minimal, paths: Sequence[str]) -> FloatArray:
    """Return how quantities change with minimal states and inputs, shape (quantities, columns of `Minimal`)."""
    found, known = [], point.assembly.start_observables
    for path in paths:
        if path not in known:
            raise ParameterError("there is no such quantity", where=path, advice=suggestion_in_parts(path, known))
        found.append(known[path].value)
    scene, now, inputs = point.scene, flow.variation, len(point.scene.inputs)
    total = np.zeros((len(found), minimal.states + inputs))
    if not found:
        return total
    parts = scene.differentiated("quantity", found)
    reads = {node for node in live(found) if node.is_symbol}
    reactions = [one for one in point.assembly.reactions if one.symbol in reads]
    by_reaction = jacobian(found, [one.symbol for one in reactions])
    outputs = [OutputGroup(f"quantity by {by}", tuple(matrix.entries)) for by, matrix in parts.places.items()]
    outputs.append(OutputGroup("by reactions", tuple(by_reaction.entries)))
    groups = (*scene.groups, InputGroup("reactions", tuple(one.symbol for one in reactions)))
    program = Program(f"{point.assembly.flat.name} outputs, varied", groups, point.assembly.parameters, tuple(outputs))
    values, changes = _reactions(point, flow, minimal, [one.path for one in reactions])
    state = (np.array([now.t]), now.q, now.u, now.a, now.multipliers, values)
    numbers = scene.evaluate(point.assembly.kernel(program), program, state)
    by = scene.matrices(parts, numbers)
    columns = minimal.states
    acceleration = flow.acceleration[:, : len(flow.field)] @ minimal.state
    acceleration[:, columns:] += flow.acceleration[:, len(flow.field) + 1 :]
    total += by["quantity", "q"] @ now.basis @ minimal.shift + by["quantity", "u"] @ minimal.speed
    total += by["quantity", "a"] @ acceleration
    total[:, columns:] += by["quantity", "w"]
    np.add.at(total, list(by_reaction.rows), numbers["by reactions"][:, None] * changes[list(by_reaction.columns)])
    return total


def _reactions(
    point: OperatingPoint, flow: Flow, minimal: Minimal, paths: Sequence[str]
) -> tuple[FloatArray, FloatArray]:
    """Return the values of reactions, and how they change with minimal states and inputs."""
    if not paths:
        return np.zeros(0), np.zeros((0, minimal.states + len(point.scene.inputs)))
    image, kept, _ = image_of(point.scene, flow, minimal)
    number = {one.key: i for i, one in enumerate(point.assembly.maximal.constraints)}
    of_path = {one.path: one for one in point.assembly.reactions}
    values, changes = [], []
    for path in paths:
        one = of_path[path]
        if one.key not in number or len(kept) < len(number):
            why = (
                "it is inside of a rigid body"
                if one.key not in number
                else "constraints are redundant, so that \
reactions are not unique"
            )
            raise UnsupportedError(
                f"it cannot be an output of a linear model: {why}", where=path, advice="Take another quantity."
            )
        values.append(one.sign * image.flow.variation.multipliers[number[one.key]])
        changes.append(one.sign * image.multiplier[number[one.key]])
    return np.array(values), np.array(changes)
