"""Kind `stiff`: chains of masses with springs and dampers of any stiffness, in balance at the start or off it.

The last mass is pushed by a sine that is far slower than what dies away. The exact motion is the exponential of a
matrix. What a run costs is looked at, too: no problem of this kind needs more than 100,000 steps.
"""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
from scipy.linalg import expm

from atwood import Scene, simulate, sin
from atwood.errors import AtwoodError
from atwood_library import Damper, Force, Ground, PointMass, Spring

from .trial import Finding, Trial

WAYS = [("reduced", "auto"), ("dae", "auto"), ("reduced", "ida"), ("dae", "ida")]

MOST_STEPS = 100_000


def make(stiffness: list[float], damping: list[float], push: tuple[float, float], at: float) -> Scene:
    """Return masses of 1 kg, each tied to the one before; all are moved from balance by a length."""
    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0))
    before: Any = scene.add("ground", Ground()).frame
    for i, (k, c) in enumerate(zip(stiffness, damping, strict=True)):
        mass = scene.add(f"m{i}", PointMass(mass=1.0))
        for name, tie in ((f"s{i}", Spring(stiffness=k, natural_length=1.0)), (f"d{i}", Damper(damping=c))):
            scene.add(name, tie)
            scene.connect(before, tie.a)
            scene.connect(tie.b, mass.point)
        scene.start.update({f"m{i}.position.x": i + 1.0 + at, f"m{i}.velocity.x": 0.0})
        before = mass.point
    size, rate = push
    force = scene.add("push", Force(value=lambda t: size * sin(rate * t)))
    scene.connect(force.point, before)
    return scene


def exact(
    stiffness: list[float], damping: list[float], push: tuple[float, float], at: float, t: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements from balance, and the eigenvalues of the motion without the push."""
    n = len(stiffness)
    matrix = np.zeros((2 * n + 2, 2 * n + 2))
    matrix[:n, n : 2 * n] = np.eye(n)
    for first, values in ((0, stiffness), (n, damping)):
        for i, value in enumerate(values):
            ends = [i] if i == 0 else [i - 1, i]
            for a in ends:
                for b in ends:
                    matrix[n + a, first + b] -= value * (1.0 if a == b else -1.0)
    size, rate = push
    matrix[2 * n - 1, 2 * n] = size
    matrix[2 * n, 2 * n + 1], matrix[2 * n + 1, 2 * n] = rate, -rate
    start = np.zeros(2 * n + 2)
    start[:n], start[-1] = at, 1.0
    return (expm(matrix * t) @ start)[:n], np.linalg.eigvals(matrix[: 2 * n, : 2 * n])


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
    expected, values = exact(stiffness, damping, push, at, end)
    rtol = 10.0 ** random.uniform(-9.0, -5.0)
    rings = np.abs(values.imag)
    ringing = rings * np.minimum(end, 40.0 / np.maximum(-values.real, 1e-300))  # radians before they have died away
    tried = (f"{form} {solver}", "off balance" if at else "in balance", f"masses {count}", "compared")
    scene = make(stiffness, damping, push, at)
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
