"""What IDA is given of a scene: residual and Jacobian as machine code, and the order of elimination."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.sundials.null_space import (
    NullSpaceCallbacks,
    NullSpaceData,
    NullSpaceShape,
    compile_null_space_callbacks,
)
from atwood.codegen.sundials.residuals import Callbacks, UserData
from atwood.forms.program import FormProgram
from atwood.forms.residuals import NullSpaceProgram
from atwood.integrators.protocol import LinearSolver, NativeCallbacks
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.numerics.body_order import elimination_stages
from atwood.numerics.fixed_pivots import FixedPivots, fix_pivots
from atwood.simulation.dynamics.redundancy import POOR
from atwood.topology.graph import connected_groups


def compile_null_space(program: NullSpaceProgram, linear_solver: LinearSolver) -> NullSpaceCallbacks:
    """Return the compiled functions for a matrix of one kind."""
    return compile_null_space_callbacks(
        program.stack,
        program.derivatives,
        (program.jacobian_rows, program.jacobian_columns),
        (program.rows, program.columns),
        null_space_shape(program),
        sparse=linear_solver == "sparse",
    )


def native_callbacks(code: Callbacks, data: UserData, **more: Any) -> NativeCallbacks:
    """Return functions of IDA's with what they are given."""
    addresses = code.residual_address, code.jacobian_address, data.address, code.weights_address
    return NativeCallbacks(*addresses, data.set_weights, keep=(code, data), data_bytes=data.bytes, **more)


@dataclass
class CompiledNullSpace:
    """The compiled functions of a scene with its parameters, for as many sessions as ask for them.

    Attributes
    ----------
    program
        What they compute.
    parameter_values
        The values of the parameters.
    sizes
        The size of each speed.
    """

    program: NullSpaceProgram
    parameter_values: FloatArray
    sizes: FloatArray
    _sessions: weakref.WeakSet[NullSpaceData] = field(default_factory=weakref.WeakSet)

    def callbacks(
        self,
        code: NullSpaceCallbacks,
        dependent: tuple[tuple[int, ...], tuple[int, ...]],
        review: Callable[[float, FloatArray], bool],
    ) -> NativeCallbacks:
        """Return the functions for one session."""
        places, speeds = dependent
        data = code.bind(self.parameter_values, choice_lists(self.program, speeds, places), self.sizes, POOR)
        self._sessions.add(data)

        def attend(t: float, y: FloatArray) -> bool | None:
            return review(t, y) if data.take_attention() else None

        return native_callbacks(code, data, attend=attend, last_rate=lambda: data.rate)

    def choose(self, places: tuple[int, ...], speeds: tuple[int, ...]) -> None:
        """Make other displacements and speeds the dependent ones, in all sessions."""
        lists = choice_lists(self.program, speeds, places)
        for data in self._sessions:
            data.choice[:] = lists


def null_space_shape(program: NullSpaceProgram) -> NullSpaceShape:
    """Return how many there are of each in a mechanism."""
    return NullSpaceShape(program.coordinates, program.speeds, program.values, program.rates)


def choice_lists(
    program: NullSpaceProgram, dependent: tuple[int, ...], places: tuple[int, ...] | None = None
) -> NDArray[np.int64]:
    """Return a choice as the lists of numbers that compiled code reads.

    The rows come in the order kinematic rows of independent coordinates, constraints, balances of independent speeds,
    rates of constraints.
    """
    shape, given = null_space_shape(program), set(dependent)
    free = [i for i in range(shape.speeds) if i not in given]
    kinematic = [i for i in range(shape.coordinates) if i not in set(dependent if places is None else places)]
    balances = [shape.coordinates + i for i in free]
    values = [shape.size + j for j in range(shape.values)]
    rates = [shape.size + shape.values + j for j in range(shape.rates)]
    blocks = _blocks(program, dependent)
    starts = np.cumsum([0, *(len(constraints) for constraints, _ in blocks)]).tolist()
    starts += [starts[-1]] * (shape.rates + 1 - len(starts))
    lists = {
        "source": [*kinematic, *values, *balances, *rates],
        "target": [len(kinematic) + shape.values + k for k in range(shape.free)],
        "independent": free,
        "dependent": [i for _, speeds in blocks for i in speeds],
        "constraints": [j for constraints, _ in blocks for j in constraints],
        "starts": starts,
        "blocks": [len(blocks)],
    }
    return np.array([number for name in shape.choice if name != "end" for number in lists[name]], dtype=np.int64)


def _blocks(program: NullSpaceProgram, dependent: tuple[int, ...]) -> list[tuple[list[int], list[int]]]:
    """Return constraints and dependent speeds in groups that share nothing."""
    given = set(dependent)
    owner: dict[int, int] = {}
    shared = [
        (owner.setdefault(column, row), row)
        for row, column in zip(program.jacobian_rows.tolist(), program.jacobian_columns.tolist(), strict=True)
        if column in given
    ]
    blocks: list[tuple[list[int], list[int]]] = []
    for group in connected_groups(range(program.rates), shared):
        inside = set(group)
        blocks.append((group, [i for i in dependent if owner.get(i) in inside]))
    if all(len(constraints) == len(speeds) for constraints, speeds in blocks):
        return blocks
    return [(list(range(program.rates)), list(dependent))]  # it cannot be solved, which the numbers will say


def pivots_of(equations: Equations, program: FormProgram, samples: Sequence[FloatArray] = ()) -> FixedPivots | None:
    """Return how the matrix ``dF/dy + cj dF/dy'`` of the dae form is eliminated; None if its pattern forbids it.

    Coordinates and speeds have their pivots in their kinematic and dynamic rows, whose masses and rates make them
    positive; the multiplier of a constraint force in the constraint on velocities (or accelerations), and that which
    keeps positions in the constraint on positions.
    """
    first = program.coordinates + program.speeds
    rows = np.arange(program.size, dtype=np.intp)
    rows[first : first + program.multipliers] += program.extra
    rows[first + program.multipliers :] -= program.multipliers
    stages = elimination_stages(program.rows, program.columns, rows, _bodies(equations, program))
    return fix_pivots(program.rows, program.columns, rows, stages, samples)


def _bodies(equations: Equations, program: FormProgram) -> NDArray[np.intp]:
    """Return the number of the body of each unknown; -1 for multipliers."""
    forest = equations.forest
    number = {one.name: i for i, one in enumerate(equations.names)}
    speeds = {one.name: program.coordinates + i for i, one in enumerate(equations.speed_names)}
    found = np.full(program.size, -1, dtype=np.intp)

    def note(body: int, coordinates: tuple[int, ...], along: tuple[int, ...]) -> None:
        names = (forest.coordinates[i].name for i in coordinates), (forest.speeds[i].name for i in along)
        for numbers, those in zip((number, speeds), names, strict=True):
            found[[numbers[name] for name in those if name in numbers]] = body

    for one in forest.attachments:
        note(one.body, (*one.coordinates, *one.orientation), (*one.speeds, *one.spin))
    for step in forest.orientations:
        if step.coordinate is not None:
            note(step.body, (step.coordinate,), (step.coordinate,))
    # What belongs to no body, such as the states of parts, is eliminated by itself.
    alone = np.flatnonzero(found[: program.coordinates + program.speeds] < 0)
    found[alone] = len(forest.coordinates) + alone
    return np.where(found < 0, -1, np.unique(found, return_inverse=True)[1] - int(np.any(found < 0)))
