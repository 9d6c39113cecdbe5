"""Runs side by side from given states: a hash of where they end, whatever the width and the processor.

    python -m tests.machines.lanes 4        in lanes of this width, 1 for one run after another

States and tolerances are given, since a start is found with libraries whose last bits depend on the processor.
"""

from __future__ import annotations

import hashlib
import sys

import numpy as np

from atwood import assemble
from atwood.integrators.batch import Batch
from atwood.integrators.lanes import LaneBatch
from atwood.integrators.methods import METHODS
from atwood.simulation.problem.options import RunOptions
from atwood.study.sweeps import motions
from atwood_library.scenes import SCENES

RUNS, SOLVERS = 21, ("taylor", "explicit")


def ends(solver: str, width: int) -> str:
    """Return a hash of states and steps of double pendulums, each with a start and parameters of its own."""
    assembly = assemble(SCENES["double-pendulum"]())
    motion, options = motions.Motion(assembly), RunOptions(3.0, 1e-9)
    given = motion, METHODS[solver], options, assembly.parameter_values
    states = np.array([[0.1 + 0.12 * k, 1.5 - 0.1 * k, 0.0, 0.25 * k] for k in range(RUNS)])
    parameters = np.tile(assembly.parameter_values, (RUNS, 1)) * (1.0 + 2.0**-5 * np.arange(RUNS)[:, None])
    more = 0.0, np.array([0.7, 1.5, 3.0]), states, np.full(states.shape, 1e-9), None, parameters
    if width == 1:
        batch: Batch | LaneBatch = Batch(motions.open_places(*given), *more)
    else:
        motions.lane_count = lambda: width  # type: ignore[assignment]
        places = motions.open_lanes(*given, RUNS)
        assert places is not None
        batch = LaneBatch(places, *more)
    while not batch.advance():
        pass
    assert not batch.codes.any()
    numbers = np.concatenate([batch.values.ravel(), batch.steps.astype(float)])
    return hashlib.sha256(numbers.astype("<f8").tobytes()).hexdigest()[:16]


if __name__ == "__main__":
    print(*(ends(solver, int(sys.argv[1])) for solver in SOLVERS))
