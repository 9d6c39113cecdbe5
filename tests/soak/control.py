"""Errors of the library's scenes beside their tolerances, and beside what the motion itself makes of an error.

An error of more than 100 tolerances of a quantity's size, divided by the growth that the tangent flow gives, is one of
the control of steps.
"""

from __future__ import annotations

import warnings
from functools import cache

import numpy as np

from atwood import AtwoodError, Result, simulate, tangent_flow
from atwood_library.scenes import SCENES

from .trial import Discarded, Finding, Trial

MOST = 100.0
"""Tolerances, after division by the growth."""

END = 2.0
"""So much of each scene is compared at most, s."""

UNITS = ("m", "rad", "m/s", "rad/s")

STIFF = ("flyball-governor", "andrews-squeezer")
"""Scenes whose explicit steps are bounded by stability, and quantities of which are differences of large ones."""


def check(seed: int) -> Trial:
    """Compare one scene of the library in one form, at one tolerance and in two solvers, with a tight solution."""
    chance = np.random.default_rng(seed)
    name = str(chance.choice([one for one in SCENES if one not in STIFF]))
    form, rtol = str(chance.choice(["reduced", "dae"])), float(10.0 ** chance.uniform(-8.0, -4.0))
    findings = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        best, growth = reference(name)
        asked = {"t_end": best.time[-1], "outputs": best.time, "form": form, "rtol": rtol}
        for solver in ("auto", "explicit"):
            result = simulate(SCENES[name](), solver=solver, **asked)
            if len(result.time) != len(best.time):
                raise Discarded("an event ended it")
            worst, path = largest(result, best)
            if worst > MOST * rtol * growth:
                figures = f"{path}: {worst / rtol:.3g} tolerances, growth {growth:.3g}, {form}, {solver}, {rtol:.3g}"
                findings.append(Finding("wrong", f"{name}: an error beyond what tolerance and motion make", figures))
    return Trial((name, form), tuple(findings))


def largest(result: Result, best: Result) -> tuple[float, str]:
    """Return the largest error of a quantity, relative to the size of its vector or of the scene, and its path."""
    scales, worst, found = result.first_plan.scales, 0.0, ""
    vectors: dict[str, list[str]] = {}
    for path in result.paths:
        if path in best and result.unit(path) in UNITS and not path.endswith(("phi", "psi", "theta", "_rate")):
            vectors.setdefault(path[:-2] if path[-2:] in (".x", ".y", ".z") else path, []).append(path)
    for paths in vectors.values():
        right = np.array([best[path] for path in paths])
        size = max(float(np.max(np.linalg.norm(right, axis=0), initial=0.0)), scales.of(result.unit(paths[0])))
        error = float(np.max(np.abs(np.array([result[path] for path in paths]) - right), initial=0.0)) / size
        if error > worst:
            worst, found = error, paths[0]
    return worst, found


@cache
def reference(name: str) -> tuple[Result, float]:
    """Return a tight solution of a scene, and by how much errors grow on the way from one time to a later one."""
    scene = SCENES[name]()
    end = min(END, float(scene.t_end))
    times = np.linspace(0.0, end, 41)
    best = simulate(scene, rtol=1e-12, t_end=end, outputs=times)
    try:
        flow = tangent_flow(SCENES[name](), t_end=end, outputs=times, rtol=1e-9)
    except AtwoodError:  # events and other jumps
        return best, 1.0
    sizes = np.array([best.first_plan.scales.of(unit) for unit in flow.units])
    scaled = flow.matrices / sizes[None, :, None]
    growth = 1.0
    for k, start in enumerate(scaled):
        back = np.linalg.pinv(start)
        growth = max(growth, *(float(np.linalg.norm(later @ back, 2)) for later in scaled[k:]))
    return best, growth
