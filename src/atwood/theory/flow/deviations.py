"""The variational equations of a scene along its motion, step by step."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.forms.assembly import Assembly
from atwood.late import dataclass
from atwood.model.compose.composite import Model
from atwood.theory.flow.field import States, VariationalEquations, variational_equations
from atwood.theory.flow.smooth_motion import SmoothMotion
from atwood.theory.flow.steps import Steps, find_steps
from atwood.theory.linear.minimal import Minimal, find_minimal
from atwood.theory.linear.steady import pace_of
from atwood.theory.linear.variations import LinearScene

__all__ = ["Deviations", "find_deviations"]

_SHARE = 0.1
"""Steps are begun with so many for each of the solver; they are halved where they are too long."""

_LOOKS = 20
"""The pace of a motion is that at so many times."""

_BLOCK = 20_000
"""The equations are evaluated at so many states at a time."""


@dataclass(frozen=True, eq=False)
class Deviations:
    """What the steps over a motion do to deviations from it.

    Attributes
    ----------
    motion
        The motion.
    scene
        The scene's equations at the start; names and sizes are the same all along.
    minimal
        Independent deviations at the start, and what follows from them.
    sizes
        What deviations of displacements and speeds are compared with: the scene's extent in m, 1 rad, and these times
        the pace at which things happen along the motion.
    edges, propagators
        The steps, s; and what they do, shape (steps, m, m).
    """

    motion: SmoothMotion
    scene: LinearScene
    minimal: Minimal
    sizes: FloatArray
    edges: FloatArray
    propagators: FloatArray

    @property
    def start(self) -> FloatArray:
        """Deviations of all displacements and speeds at the start by the independent ones, shape (m, columns)."""
        return self.minimal.state[:, : self.minimal.states]

    def equations(self) -> VariationalEquations:
        """Return the variational equations at the edges of the steps."""
        stretches = self.motion.stretches
        found = []
        for number, one in enumerate(stretches):
            last = number == len(stretches) - 1
            inside = (self.edges >= one.begin) & ((self.edges <= one.end) if last else (self.edges < one.end))
            found.append(_evaluated(self.motion, number, self.edges[inside]))
        names = [one.name for one in fields(VariationalEquations)]
        return VariationalEquations(**{name: np.concatenate([getattr(v, name) for v in found]) for name in names})


def _evaluated(motion: SmoothMotion, number: int, times: FloatArray) -> VariationalEquations:
    one = motion.stretches[number]
    return variational_equations(one.scene, one.kept, motion.states(number, times))


def find_deviations(scene: Model | Assembly, outputs: Any, tolerance: float, options: dict[str, Any]) -> Deviations:
    """Choose steps over the motion of a scene, and find what they do.

    Parameters
    ----------
    scene, outputs, options
        What `atwood.simulate` is given. Outputs are edges of steps.
    tolerance
        Of each step, relative to what it does.

    Raises
    ------
    UsageError, SolveError
        As `SmoothMotion` and `find_steps` do.
    """
    motion = SmoothMotion(scene, outputs, options)
    first = motion.stretches[0]
    states = motion.states(0, np.linspace(first.begin, first.end, _LOOKS))
    flows = [first.scene.flow(t, q, u, first.kept) for t, q, u in zip(states.time, states.q.T, states.u.T, strict=True)]
    pace = float(np.sqrt(np.mean([pace_of(first.scene, flow) ** 2 for flow in flows])))
    sizes = np.concatenate([first.scene.displacement_sizes, first.scene.sizes * pace])
    minimal = find_minimal(first.scene, flows[0], first.kept)
    steps = [_steps(motion, number, sizes, tolerance) for number in range(len(motion.stretches))]
    return Deviations(
        motion=motion,
        scene=first.scene,
        minimal=minimal,
        sizes=sizes,
        edges=np.concatenate([steps[0].edges, *(one.edges[1:] for one in steps[1:])]),
        propagators=np.concatenate([one.propagators for one in steps]),
    )


def _steps(motion: SmoothMotion, number: int, sizes: FloatArray, tolerance: float) -> Steps:
    """Return the steps over one stretch: begun with those that the solver took, cut at outputs."""
    one, result = motion.stretches[number], motion.result
    share = (one.end - one.begin) / (motion.stretches[-1].end - motion.stretches[0].begin)
    count = max(1, round(_SHARE * result.statistics.steps * share))
    times = result.time[(result.time > one.begin) & (result.time < one.end)]
    even = np.linspace(one.begin, one.end, count + 1)
    near = np.min(np.abs(even[1:-1, None] - times), axis=1, initial=np.inf) if count > 1 else np.zeros(0)
    edges = np.concatenate([[one.begin], times, even[1:-1][near > 0.25 * (one.end - one.begin) / count], [one.end]])

    def field(at: FloatArray) -> FloatArray:
        states: States = motion.states(number, at)
        blocks = range(0, len(at), _BLOCK)
        found = [variational_equations(one.scene, one.kept, states[k : k + _BLOCK]).matrix for k in blocks]
        return np.concatenate(found)

    return find_steps(field, np.unique(edges), sizes, tolerance, motion.assembly.flat.name)
