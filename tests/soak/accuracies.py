"""Accuracies that are asked for, of masses that meet narrow laws, short pulses, tables and stops.

A mass moves along one line, in a scene of any size, place and direction. The oracle is scipy's method of order 8 in
steps that no law is narrower than, from one corner of a law to the next.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import atwood
from atwood import Scene, simulate
from atwood_library import Force, Mass1D, PointMass, Potential, Table, TranslationalGap

from .trial import Discarded, Finding, Trial

ASKED = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)

KNOWN = 1e-11
"""The oracle's own error, relative to the extent."""


@dataclass
class Line:
    """Forces on 1 kg along a line, in units of the scene's length and of seconds.

    Attributes
    ----------
    hills
        Height, J/kg, place and width of each.
    pulses
        Momentum, time and width of each.
    rows
        Times and forces of a table; none if empty.
    pull
        Stiffness of a spring to where the line begins.
    stop
        Where a stop stands, and its stiffness; none if not given.
    """

    start: float
    speed: float
    hills: list[tuple[float, float, float]] = field(default_factory=list)
    pulses: list[tuple[float, float, float]] = field(default_factory=list)
    rows: list[tuple[float, float]] = field(default_factory=list)
    pull: float = 0.0
    stop: tuple[float, float] | None = None

    def acceleration(self, t: float, x: float, touches: bool) -> float:
        """Return the force on 1 kg."""
        found = -self.pull * x
        for height, place, width in self.hills:
            s = (x - place) / width
            found += 2.0 * height * s / width * math.exp(-s * s)
        for momentum, time, width in self.pulses:
            found += momentum / (width * math.sqrt(math.pi)) * math.exp(-(((t - time) / width) ** 2))
        if self.rows:
            found += float(np.interp(t, *zip(*self.rows, strict=True)))
        if self.stop is not None and touches:
            found -= self.stop[1] * (x - self.stop[0])
        return found

    def path(self, times: np.ndarray) -> np.ndarray:
        """Return where the mass is, by scipy."""
        narrow = [width / 4.0 for _, _, width in self.hills]
        corners = sorted({float(times[-1]), *(t for t, _ in self.rows if 0.0 < t < times[-1])})
        near = [(time - 8.0 * w, time + 8.0 * w, w / 3.0) for _, time, w in self.pulses]
        corners = sorted({*corners, *(t for a, b, _ in near for t in (a, b) if 0.0 < t < times[-1])})
        y, t, touches, found = np.array([self.start, self.speed]), 0.0, False, np.empty_like(times)
        found[0] = self.start
        count = 0
        for corner in corners:
            while t < corner:
                count += 1
                if count > 500:
                    raise Discarded("it chatters")
                middle = 0.5 * (t + corner)
                steps = [s for a, b, s in near if a < middle < b] + [n / 8.0 for n in narrow]
                level = math.inf if self.stop is None else self.stop[0]

                def passes(_: float, y: np.ndarray, level: float = level) -> float:
                    return float(y[0] - level)

                passes.terminal = True  # type: ignore[attr-defined]
                passes.direction = -1.0 if touches else 1.0  # type: ignore[attr-defined]
                done = solve_ivp(
                    lambda t, y, on=touches: [y[1], self.acceleration(t, y[0], on)],
                    (t, corner),
                    y,
                    method="DOP853",
                    rtol=3e-14,
                    atol=1e-15,
                    max_step=min(steps, default=np.inf),
                    events=None if self.stop is None else [passes],
                    dense_output=True,
                )
                inside = (times > t) & (times <= done.t[-1])
                if np.any(inside):
                    found[inside] = done.sol(times[inside])[0]
                y, t = done.y[:, -1], float(done.t[-1])
                if done.status == 1:
                    touches = not touches
        return found


def drawn(chance: np.random.Generator) -> Line:
    """Return forces at random: one to three laws, of which one at least is narrow, short, or has corners."""
    line = Line(0.0, float(chance.uniform(0.5, 2.0)))
    kinds = chance.choice(["hill", "pulse", "table", "spring", "stop"], size=int(chance.integers(1, 4)), replace=False)
    for kind in kinds:
        if kind == "hill":
            height = float(chance.uniform(-0.6, 0.4)) * 0.5 * line.speed**2
            line.hills.append((height, float(chance.uniform(0.5, 3.0)), float(10.0 ** chance.uniform(-2.5, -0.5))))
        elif kind == "pulse":
            width = float(10.0 ** chance.uniform(-3.0, -0.5))
            line.pulses.append((float(chance.uniform(-1.0, 1.0)), float(chance.uniform(0.5, 3.5)), width))
        elif kind == "table":
            times = np.concatenate([[0.0], np.sort(chance.uniform(0.2, 3.9, 4)), [5.0]])
            line.rows = [(float(t), float(f)) for t, f in zip(times, chance.uniform(-1.0, 1.0, 6), strict=True)]
        elif kind == "spring":
            line.pull = float(chance.uniform(0.3, 10.0))
        else:
            line.stop = float(chance.uniform(0.3, 1.0)), float(10.0 ** chance.uniform(1.0, 4.0))
    return line


def built(line: Line, chance: np.random.Generator) -> tuple[Scene, Any, float]:
    """Return a scene of these forces, what gives the way along the line of its result, and the scene's unit of length.

    It is on a line, or anywhere in the plane or in space, along any direction; a stop needs the line.
    """
    size, mass = float(10.0 ** chance.uniform(-2.0, 2.0)), float(10.0 ** chance.uniform(-1.0, 1.0))
    space = "line" if line.stop is not None else str(chance.choice(["line", "plane", "space"]))
    axes = {"line": "x", "plane": "xz", "space": "xyz"}[space]
    direction = chance.normal(size=len(axes)) if len(axes) > 1 else np.array([1.0])
    direction /= np.linalg.norm(direction)
    place = size * chance.uniform(-2.0, 2.0, len(axes)) if line.stop is None else np.zeros(len(axes))
    if space == "line":
        place = np.zeros(1)
    scene = Scene(space=space, gravity=0.0, t_end=4.0)
    body = scene.add("m", Mass1D(mass=mass) if space == "line" else PointMass(mass=mass))
    end = body.flange if space == "line" else body.point
    along = "+".join(f"({d!r})*({x}-({p!r}))" for d, x, p in zip(direction.tolist(), axes, place.tolist(), strict=True))
    whole = [0.0, 0.0, 0.0]
    for x, d in zip(axes, direction, strict=True):
        whole["xyz".index(x)] = float(d)
    for k, (height, centre, width) in enumerate(line.hills):
        energy = f"({height * mass * size**2!r})*exp(-((({along})-({centre * size!r}))/({width * size!r}))^2)"
        scene.connect(end, scene.add(f"hill{k}", Potential(energy_function=energy)).point)
    for k, (momentum, time, width) in enumerate(line.pulses):
        most = momentum * mass * size / (width * math.sqrt(math.pi))
        law = Force(
            direction=tuple(whole), value=lambda t, a=most, b=time, w=width: a * atwood.exp(-(((t - b) / w) ** 2))
        )
        scene.connect(end, scene.add(f"pulse{k}", law).point)
    if line.rows:
        force = scene.add("force", Force(direction=tuple(whole)))
        table = scene.add("table", Table(table=tuple((t, f * mass * size) for t, f in line.rows)))
        scene.connect(end, force.point)
        scene.connect(table.output("value"), force.input("value"))
    if line.pull:
        energy = f"({0.5 * line.pull * mass!r})*({along})^2"
        scene.connect(end, scene.add("pull", Potential(energy_function=energy)).point)
    if line.stop is not None:
        options = {"ends": "upper", "upper": line.stop[0] * size, "stiffness": line.stop[1] * mass}
        scene.connect(body.slide, scene.add("stop", TranslationalGap(against="ground", **options)).b)
    names = ("displacement", "speed") if space == "line" else ("position", "velocity")
    for x, d, p in zip(axes, direction, place, strict=True):
        dot = "" if space == "line" else f".{x}"
        scene.start[f"m.{names[0]}{dot}"] = float(p + d * size * line.start)
        scene.start[f"m.{names[1]}{dot}"] = float(d * size * line.speed)

    def read(result: atwood.Result) -> np.ndarray:
        found = sum(d * (result[f"m.position.{x}"] - p) for d, x, p in zip(direction, axes, place, strict=True))
        return np.asarray(found)

    return scene, read, size


def check(seed: int) -> Trial:
    """Ask for an accuracy, and compare what was reached with the true error."""
    chance = np.random.default_rng(seed)
    line = drawn(chance)
    scene, read, size = built(line, chance)
    asked, form = float(chance.choice(ASKED)), str(chance.choice(["reduced", "dae"]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = simulate(scene, form=form, accuracy=asked, max_seconds=30.0)
    if result.status != "finished":
        raise Discarded(f"the run was not finished: {result.status}")
    accuracy = result.accuracy
    exact = line.path(np.asarray(result.time)) * size
    true = float(np.max(np.abs(read(result) - exact))) / result.start.length
    known = KNOWN * max(1.0, float(np.max(np.abs(exact))) / result.start.length)
    tried = [form, f"asked {asked:g}", "met" if accuracy.is_met else "not met, and said"]
    tried += [name for name in ("hills", "pulses", "rows", "pull", "stop") if getattr(line, name)]
    findings = []
    if not accuracy.is_known:
        tried.append("not known")
    elif true > accuracy.reached + known:
        figures = f"true {true:.2e}, reached {accuracy.reached:.2e}, asked {asked:g}, {form}: {line}"
        findings.append(Finding("wrong", "an error above what was reached", figures))
    else:
        is_close = accuracy.reached <= 10.0 * true + known
        tried.append("reached at most 10 times the error" if is_close else "reached more than 10 times the error")
    return Trial(tuple(tried), tuple(findings))
