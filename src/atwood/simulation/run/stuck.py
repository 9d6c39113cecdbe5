"""What moves fastest where a solver cannot go on, for the error that says so."""

from __future__ import annotations

import numpy as np

from atwood.errors import SolveError
from atwood.integrators.protocol import StepResult
from atwood.simulation.dynamics.scales import motion_names, motion_scales
from atwood.simulation.problem.problem import Plan

_LATER, _AT_START = (
    "Look at what came before: the error's `run`.",
    "Nothing came before: look at what acts at the start, or try a first_step far shorter than it takes to set in.",
)


def failed(message: str, scene: str, has_moved: bool) -> SolveError:
    """Return the error of a solver that failed, at the start of a run or later."""
    return SolveError(message, where=scene, advice=_LATER if has_moved else _AT_START)


def explain_stuck(plan: Plan, failed: StepResult) -> SolveError | None:
    """Return the error of a run that failed, with the motion that changes fastest there; None if nothing moves.

    Changes of speeds are compared in units of the scene's length, or one radian, so that metres and radians compare.
    """
    equations = plan.assembly.own_equations
    _, speeds = plan.program.split(failed.y)
    _, rates = plan.program.split(failed.yp)
    sizes = motion_scales(equations, plan.scales.length)
    changes = np.abs(np.where(np.isfinite(rates), rates, np.inf)) / sizes
    if not len(changes) or not np.max(changes) > 0.0:
        return None
    fastest = int(np.argmax(changes))
    unit = equations.speed_names[fastest].unit
    name = motion_names(equations)[fastest]
    return SolveError(
        f"{failed.message}; what changes fastest there is {name}, at {speeds[fastest]:.3g} {unit} and by "
        f"{rates[fastest]:.3g} {unit} in a second",
        where=plan.assembly.flat.name,
        advice=f"Look at what acts on {name}, and at what came before: the error's `run`.",
    )
