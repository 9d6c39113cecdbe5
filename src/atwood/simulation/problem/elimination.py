"""The order in which the Newton matrix of the dae form is eliminated: body after body, from the ends of trees on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.forms.program import FormProgram
from atwood.mechanics.dynamics.equations import Equations
from atwood.numerics.body_order import elimination_stages
from atwood.numerics.fixed_pivots import FixedPivots, fix_pivots


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
