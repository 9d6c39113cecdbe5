"""Kind `levels`: how often and when a motion passes levels near its extremes, against closed forms.

A mass swings on a spring, damped or not, or is thrown up; a level lies a share of 1e-2 to 1e-9 of the motion's size
below an extreme or above it. It is a condition that is recorded and an event of a part that counts it. The line is
turned, lengths and times are in any units.
"""

from __future__ import annotations

import math
import warnings
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq

from atwood import Scene, simulate
from atwood.errors import AtwoodError
from atwood_library import Damper, Force, Ground, PointMass, Spring

from ..helpers.counters import Counter
from .trial import Discarded, Finding, Trial

WAYS = [("reduced", one) for one in ("auto", "explicit", "ida", "taylor")]
WAYS += [("dae", "auto"), ("dae", "ida")]


class Motion:
    """A motion ``offset + size x(t)`` along a line, with the times at which it is at rest."""

    def __init__(self, random: np.random.Generator) -> None:
        self.is_thrown = bool(random.random() < 0.3)
        self.damping = 0.0 if random.random() < 0.5 else 10.0 ** random.uniform(-4.0, -1.5)
        self.rate, self.phase = random.uniform(1.0, 30.0), random.uniform(0.2, 3.0)
        self.speed = random.uniform(0.5, 2.0)
        self.end = 1.5 * self.speed if self.is_thrown else random.uniform(2.0, 40.0) / self.rate * 2.0 * math.pi

    def value(self, t: float) -> float:
        if self.is_thrown:
            return self.speed * t - 0.5 * t * t
        return math.exp(-self.damping * t) * math.cos(self.rate * t + self.phase)

    def velocity(self, t: float) -> float:
        if self.is_thrown:
            return self.speed - t
        angle = self.rate * t + self.phase
        return -math.exp(-self.damping * t) * (self.rate * math.sin(angle) + self.damping * math.cos(angle))

    def extremes(self) -> list[float]:
        """Return the times at which it is at rest."""
        if self.is_thrown:
            return [self.speed]
        first = (-math.atan2(self.damping, self.rate) - self.phase) % math.pi / self.rate
        return [t for t in np.arange(first, self.end, math.pi / self.rate).tolist() if t < self.end]

    def passages(self, level: float) -> list[tuple[float, int]]:
        """Return when it passes a level, and in which direction."""
        ends = [0.0, *self.extremes(), self.end]
        found = []
        for a, b in pairwise(ends):
            below, above = self.value(a) - level, self.value(b) - level
            if below * above < 0.0:
                t = brentq(lambda t: self.value(t) - level, a, b, xtol=1e-15 * self.end, rtol=1e-15)
                found.append((t, 1 if above > 0.0 else -1))
        return found


def make(motion: Motion, length: float, time: float, axis: str, offset: float) -> Scene:
    """Return the scene of a motion along an axis, from an offset on."""
    direction = tuple(float(axis == one) for one in "xyz")
    scene = Scene(space="line", line_axis=direction, gravity=0.0)
    bob, ground = scene.add("bob", PointMass(mass=2.0)), scene.add("ground", Ground())
    size, unit = 2.0 * length / time**2, 2.0 / time
    if motion.is_thrown:
        push = scene.add("push", Force(value=-size, direction=direction))
        scene.connect(push.point, bob.point)
    else:
        stiffness = unit / time * (motion.rate**2 + motion.damping**2)
        spring = scene.add("spring", Spring(stiffness=stiffness, natural_length=offset * length))
        damper = scene.add("damper", Damper(damping=2.0 * unit * motion.damping))
        for tie in (spring, damper):
            scene.connect(ground.frame, tie.a)
            scene.connect(tie.b, bob.point)
    scene.start[f"bob.position.{axis}"] = length * (offset + motion.value(0.0))
    scene.start[f"bob.velocity.{axis}"] = length / time * motion.velocity(0.0)
    return scene


def check(seed: int) -> Trial:
    """Make the trial of a seed."""
    random = np.random.default_rng(seed)
    form, solver = WAYS[random.integers(len(WAYS))]
    motion, share = Motion(random), 10.0 ** random.uniform(-9.0, -2.0)
    rtol = max(1e-13, min(1e-6, 1e-5 * share))
    if share < 1e-7 and solver == "ida":
        raise Discarded("IDA does not come so close")
    extreme = random.choice(motion.extremes())
    size = abs(motion.value(extreme)) or 1.0
    level = float(motion.value(extreme) * (1.0 + share * float(random.choice([-1.0, -1.0, 1.0]))))
    expected = motion.passages(level)
    misses = [abs(motion.value(t) - level) / size for t in (*motion.extremes(), 0.0, motion.end)]
    if min(misses) < 0.3 * share:
        raise Discarded("another extreme is nearer to the level")
    length, time = 10.0 ** random.uniform(-3.0, 3.0), 10.0 ** random.uniform(-2.0, 2.0)
    axis, offset = str(random.choice(list("xyz"))), float(random.uniform(3.0, 6.0))
    scene = make(motion, length, time, axis, offset)
    place = float(length * (offset + level))
    counter = scene.add("counter", Counter(level=place, axis="xyz".index(axis)))
    scene.connect(counter.point, scene["bob"].point)
    way = str(random.choice(["crosses", "rises above", "falls below"]))
    wanted = [t for t, up in expected if way == "crosses" or up == (1 if way == "rises above" else -1)]
    condition = f"bob.position.{axis} {way} {place!r} m"
    kind = "thrown" if motion.is_thrown else "damped" if motion.damping else "swings"
    tried = (f"{form} {solver}", kind, f"share 1e{math.floor(math.log10(share))}", "compared")
    given: dict[str, Any] = {"form": form, "solver": solver, "rtol": rtol, "outputs": 5, "max_seconds": 30.0}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            result = simulate(scene, t_end=time * motion.end, record=condition, **given)
        except AtwoodError as error:
            return Trial(tried, (Finding("refused", f"{form} {solver} refuses", f"{error}"),))
    told = [one.time / time for one in result.events if one.message == condition]
    counted = int(result["counter.passed"][-1])
    about = f"share {share:.3g}, rtol {rtol:.3g}, {kind}, {form}"
    findings = []
    if len(told) != len(wanted):
        findings.append(
            Finding("wrong", f"{solver}: recorded too many or too few", f"{len(told)}, not {len(wanted)}, {about}")
        )
    else:
        gaps = [abs(a - b) * abs(motion.velocity(b)) for a, b in zip(told, wanted, strict=True)]
        if gaps and max(gaps) > (1e6 if solver == "ida" else 1e4) * rtol + 1e-10:
            findings.append(Finding("wrong", f"{solver}: recorded at another time", f"by {max(gaps):.3g}, {about}"))
    if counted != len(expected):
        findings.append(
            Finding("wrong", f"{solver}: counted too many or too few", f"{counted}, not {len(expected)}, {about}")
        )
    return Trial(tried, tuple(findings))
