"""Kind `stiff`: chains of masses with springs and dampers of any stiffness, in balance at the start or off it.

The last mass is pushed by a sine that is far slower than what dies away. The exact motion is the exponential of a
matrix. What a run costs is looked at, too: no problem of this kind needs more than 100,000 steps.
"""

from __future__ import annotations

import math
import warnings

import numpy as np

from atwood import simulate
from atwood.errors import AtwoodError

from ..helpers.chains import exact_chain, pushed_chain
from .trial import Finding, Trial

WAYS = [("reduced", "auto"), ("dae", "auto"), ("reduced", "ida"), ("dae", "ida")]

MOST_STEPS = 100_000


def check(seed: int) -> Trial:
    """Make the trial of a seed."""
    random = np.random.default_rng(seed)
    form, solver = WAYS[random.integers(len(WAYS))]
    count = int(random.integers(1, 4))
    stiffness = (10.0 ** random.uniform(2.0, 9.0, count)).tolist()
    ratios = random.choice([0.02, 0.1, 0.7, 1.0, 1.0, 3.0, 50.0], count)
    damping = [2.0 * math.sqrt(k) * z for k, z in zip(stiffness, ratios.tolist(), strict=True)]
    rate = 10.0 ** random.uniform(-2.0, 1.0)
    push = float(min(stiffness) * 10.0 ** random.uniform(-2.0, 0.0)), rate
    at = 0.0 if random.random() < 0.5 else 10.0 ** random.uniform(-6.0, -2.0)
    end = 10.0 ** random.uniform(-1.0, 1.5) / rate
    expected, values = exact_chain(stiffness, damping, push, at, end)
    rtol = 10.0 ** random.uniform(-9.0, -5.0)
    rings = np.abs(values.imag)
    ringing = rings * np.minimum(end, 40.0 / np.maximum(-values.real, 1e-300))  # radians before they have died away
    tried = (f"{form} {solver}", "off balance" if at else "in balance", f"masses {count}", "compared")
    scene = pushed_chain(stiffness, damping, push, at)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            run = simulate(scene, form=form, solver=solver, t_end=end, rtol=rtol, outputs=5, max_seconds=40.0)
        except AtwoodError as error:
            return Trial(tried, (Finding("refused", f"{form} {solver} refuses", f"{error}"),))
    about = f"k {stiffness}, c {damping}, push {push}, at {at:.3g}, end {end:.3g}, rtol {rtol:.3g}, {form} {solver}"
    if run.status != "finished":
        return Trial(tried, (Finding("hang", f"{solver}: {run.status}", about),))
    found = np.array([run[f"m{i}.position.x"][-1] - i - 1.0 for i in range(count)])
    error, findings = float(np.max(np.abs(found - expected))), []
    if not error < 1e3 * rtol * (count + float(np.max(np.abs(expected)))):
        findings.append(Finding("wrong", f"{solver} is wrong", f"off by {error:.3g}: {about}"))
    if run.statistics.steps > MOST_STEPS + 30.0 * float(np.max(ringing)):
        findings.append(Finding("hang", f"{solver}: far too many steps", f"{run.statistics.steps}: {about}"))
    return Trial(tried, tuple(findings))
