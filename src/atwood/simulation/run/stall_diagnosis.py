"""Why a run cannot go on: tolerances that rounding does not allow, or motion that changes too fast."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from atwood.errors import AtwoodError, SolveError
from atwood.forms.assembly import Assembly
from atwood.integrators.methods import LEAST, Method
from atwood.integrators.protocol import Budget, Status, StepResult
from atwood.lazy_dataclasses import replace
from atwood.simulation.dynamics.scales import motion_names, motion_scales
from atwood.simulation.events.sampling import remembering
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.run.run_record import Run
from atwood.simulation.run.session import SolverRequest, open_session

_TIGHT = 1e-9
"""Failures at larger tolerances have other causes than rounding."""

_TRIAL = 300
"""So many steps show whether a run gets on with a tolerance."""

_ENOUGH = 1e-6
"""The share of the run that they must cover at least."""

_FAR = 1e-2
"""The same where they fail then: without the looks that a run takes at which constraints are kept."""


def allowed(options: RunOptions) -> RunOptions:
    """Return options with a tolerance that the arithmetic can meet; it is said in a warning if that is another one."""
    asked = options.relative_tolerance
    if not 0.0 < asked < LEAST:
        return options
    warnings.warn(
        f"rtol = {asked:g} is below what rounding allows: {LEAST:g} is taken instead, about the error of a few "
        "operations",
        stacklevel=4,
    )
    return replace(options, relative_tolerance=LEAST)


def too_tight(
    request: SolverRequest, method: Method, failed: StepResult, opened: StepResult | None = None
) -> SolveError | None:
    """Return the error of a run that failed since its tolerance is below what rounding allows; None if it is not.

    Larger tolerances are tried from where it failed, or from where it began, if it has not come far: the steps that it
    took until then need not have been good ones.
    """
    options, t = request.options, failed.t
    asked = options.relative_tolerance
    if asked > _TIGHT or not t < request.end:
        return None
    is_near = opened is not None and t - opened.t < _ENOUGH * (request.end - opened.t)
    here = opened if is_near and opened is not None else failed
    for factor in (10.0, 100.0, 1000.0):
        looser = replace(request, options=replace(options, relative_tolerance=factor * asked), budget=Budget(_TRIAL))
        try:
            found = open_session(looser, method, here.t, here.y, here.yp).advance(request.end)
        except AtwoodError:
            continue
        share = _FAR if found.status is Status.FAILED else _ENOUGH
        if found.t - here.t >= share * (request.end - here.t):
            error = SolveError(
                f"the relative tolerance, {asked:g}, is below what rounding allows here: {failed.message}",
                where=request.plan.assembly.flat.name,
                advice=f"Give rtol={factor * asked:g}, with which it goes on from there.",
            )
            error.tolerance = factor * asked  # type: ignore[attr-defined]
            return error
    return None


def raised_where_too_tight(solve: Callable[[RunOptions], Run], assembly: Assembly, options: RunOptions) -> Run:
    """Return a run, made again with a warning where its tolerance is below what rounding allows."""
    while True:
        try:
            return solve(options)
        except SolveError as error:
            tolerance: float | None = getattr(error, "tolerance", None)
            if tolerance is None or remembering(assembly):
                raise
        warnings.warn(
            f"rtol = {options.relative_tolerance:g} is below what rounding allows here: {tolerance:g} is taken instead",
            stacklevel=5,
        )
        options = replace(options, relative_tolerance=tolerance)


_LATER, _AT_START = (
    "Look at what came before: the error's `run`.",
    "Nothing came before: look at what acts at the start, or try a first_step far shorter than it takes to set in.",
)


def failed(message: str, scene: str, has_moved: bool) -> SolveError:
    """Return the error of a solver that failed, at the start of a run or later."""
    return SolveError(message, where=scene, advice=_LATER if has_moved else _AT_START)


def explain_stuck(plan: SceneProblem, failed: StepResult) -> SolveError | None:
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
