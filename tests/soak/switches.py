"""Kind `switches`: laws that compare where a mass is, narrow or not, against motions in pieces of constant force.

The force along a line is a sum of bands, signs, edges and stairs, written as forces or as potentials; the line is
turned, moved and scaled. Between two edges the motion is a parabola, which the oracle follows in plain numbers.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from atwood import (
    Component,
    Load,
    Point,
    Scene,
    absolute,
    connector,
    floor,
    force,
    maximum,
    minimum,
    potential,
    select,
    sign,
    simulate,
)
from atwood.errors import AtwoodError
from atwood_library import PointMass

from .trial import Discarded, Finding, Trial

WAYS = [("reduced", one) for one in ("auto", "explicit", "ida", "taylor", "gauss", "composition")]
WAYS += [("dae", "auto"), ("dae", "ida")]

SLOWEST = 0.02
"""An edge that is passed more slowly than this share of the first speed is no good for a comparison."""


@dataclass(frozen=True)
class Term:
    """Part of a force along a line: its edges, and how it is written as a force and as a potential, if it can be."""

    edges: tuple[float, ...]
    value: Callable[[float], float]
    as_force: Callable[[Any], Any]
    as_potential: Callable[[Any], Any] | None


def band(a: float, width: float, c: float) -> Term:
    """A force on a way of some width."""
    b = a + width
    return Term(
        (a, b),
        lambda x: c if a < x < b else 0.0,
        lambda x: select(x < a, 0.0, select(x <= b, c, 0.0)),
        lambda x: -c * minimum(maximum(x - a, 0.0), width),
    )


def edge(a: float, c: float) -> Term:
    """A force that changes its sign."""
    return Term((a,), lambda x: -c if x > a else c, lambda x: -c * sign(x - a), lambda x: c * absolute(x - a))


def side(a: float, c: float) -> Term:
    """A force on one side."""
    return Term(
        (a,), lambda x: c if x > a else 0.0, lambda x: select(x - a > 0.0, c, 0.0), lambda x: -c * maximum(x, a)
    )


def stairs(a: float, tread: float, c: float, count: int = 40) -> Term:
    """A force that grows by steps."""
    edges = tuple(a + i * tread for i in range(-count, count + 1))
    return Term(edges, lambda x: c * math.floor((x - a) / tread), lambda x: c * floor((x - a) / tread), None)


def draw_terms(random: np.random.Generator, as_potential: bool) -> list[Term]:
    """Return a random sum of forces, in units of a length and a time of one."""
    found = []
    for _ in range(int(random.integers(1, 6))):
        a, c = float(random.uniform(0.2, 3.0)), float(random.uniform(0.1, 1.0) * random.choice([-1.0, 1.0]))
        kind = random.choice(["band", "narrow", "edge", "side", *([] if as_potential else ["stairs"])])
        if kind in ("band", "narrow"):
            width = float(random.uniform(0.05, 0.5) if kind == "band" else 10.0 ** random.uniform(-4.0, -1.5))
            found.append(band(a, width, c if kind == "band" else c * random.uniform(1.0, 5.0)))
        elif kind == "edge":
            found.append(edge(a, abs(c)))
        else:
            found.append(side(a, c) if kind == "side" else stairs(a, float(random.uniform(0.2, 1.0)), -0.3 * abs(c)))
    return found


def follow(terms: Sequence[Term], x: float, v: float, end: float) -> tuple[float, int]:
    """Return where a mass of one is at an end, and how many edges it has passed."""
    edges = sorted({one for term in terms for one in term.edges})
    bounds = [-math.inf, *edges, math.inf]
    piece, t, passed = int(np.searchsorted(edges, x)), 0.0, 0
    while True:
        low, high = bounds[piece], bounds[piece + 1]
        if math.inf in (high, -low) and any(term.as_potential is None for term in terms):
            raise Discarded("beyond the stairs")
        inside = high - 1.0 if low == -math.inf else low + 1.0 if high == math.inf else 0.5 * (low + high)
        a = sum(term.value(inside) for term in terms)
        times = [(time, step) for bound, step in ((low, -1), (high, 1)) for time in passages(x - bound, v, a, step)]
        dt, step = min(times, default=(math.inf, 0))
        if t + dt >= end:
            dt = end - t
            return x + v * dt + 0.5 * a * dt * dt, passed
        x, v, t = bounds[piece + (step > 0)], v + a * dt, t + dt
        if abs(v) < SLOWEST:
            raise Discarded("an edge is hardly passed")
        piece, passed = piece + step, passed + 1
        if passed > 400:
            raise Discarded("too many edges")


def passages(gap: float, v: float, a: float, step: int) -> list[float]:
    """Return when ``gap + v t + a t^2 / 2`` leaves through zero in the direction of a step."""
    if not math.isfinite(gap):
        return []
    if a == 0.0:
        return [-gap / v] if v * step > 0.0 else []
    root = v * v - 2.0 * a * gap
    if root <= 0.0:
        return []
    speed = step * math.sqrt(root)  # with which it leaves
    time = (speed - v) / a if abs(speed + v) < abs(speed - v) else -2.0 * gap / (speed + v)
    return [time] if time > 1e-14 * (1.0 + abs(gap)) else []


def make(terms: Sequence[Term], x: float, v: float, frame: tuple[Any, Any, float, float], as_potential: bool) -> Scene:
    """Return the scene: a mass on a line through a place along a direction, with lengths and times in units."""
    direction, place, length, time = frame
    size = length / time**2

    class Law(Component):
        """The law."""

        point: Point = connector(Point, "Where it acts.")

        def along(self) -> Any:
            return sum(n * (p - c) for n, p, c in zip(direction, self.point.position, place, strict=True)) / length

    class Pushes(Law):
        @force
        def push(self) -> list[Load]:
            """Return the force."""
            value = size * sum(term.as_force(self.along()) for term in terms)
            return [Load(self.point, tuple(value * n for n in direction))]

    class Stores(Law):
        @potential
        def energy(self) -> Any:
            """Return the energy."""
            s = self.along()
            return size * length * sum(term.as_potential(s) for term in terms if term.as_potential is not None)

    scene = Scene(gravity=0.0, space="space" if direction[1] else "plane")
    bob, law = scene.add("bob", PointMass(mass=1.0)), scene.add("law", Stores() if as_potential else Pushes())
    scene.connect(bob.point, law.point)
    for i, axis in enumerate("xyz"):
        if axis != "y" or direction[1]:
            scene.start[f"bob.position.{axis}"] = place[i] + length * x * direction[i]
            scene.start[f"bob.velocity.{axis}"] = length / time * v * direction[i]
    return scene


def check(seed: int) -> Trial:
    """Make the trial of a seed."""
    random = np.random.default_rng(seed)
    form, solver = WAYS[random.integers(len(WAYS))]
    as_potential = solver in ("gauss", "composition") or bool(random.random() < 0.4)
    terms = draw_terms(random, as_potential)
    x, v, end = float(random.uniform(-1.0, 3.0)), float(random.uniform(0.5, 1.5)), float(random.uniform(3.0, 12.0))
    exact, passed = follow(terms, x, v, end)
    near = [follow(terms, x + dx, v + dv, end)[0] for dx, dv in ((1e-9, 0.0), (0.0, 1e-9))]
    growth = 1.0 + max(abs(one - exact) for one in near) / 1e-9
    if growth > 1e5:
        raise Discarded("it hangs on its start too much")
    direction = random.standard_normal(3) * (1.0, float(random.random() < 0.5), 1.0)
    direction /= np.linalg.norm(direction)
    length, time = 10.0 ** random.uniform(-3.0, 3.0), 10.0 ** random.uniform(-2.0, 2.0)
    place = length * random.uniform(-5.0, 5.0, 3) * (1.0, float(direction[1] != 0.0), 1.0)
    scene = make(terms, x, v, (direction.tolist(), place.tolist(), length, time), as_potential)
    rtol = 10.0 ** random.uniform(-11.0, -5.0)
    tried = (f"{form} {solver}", "potential" if as_potential else "force", f"edges {min(passed, 10)}", "compared")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            result = simulate(scene, t_end=time * end, form=form, solver=solver, rtol=rtol, outputs=11)
        except AtwoodError as error:
            return Trial(tried, (Finding("refused", f"{form} {solver} refuses", f"{error}"),))
    axes = zip(direction, "xyz", place, strict=True)
    found = sum(n * (result[f"bob.position.{a}"][-1] - c) for n, a, c in axes if n)
    error = abs(found / length - exact)
    if error <= growth * (1000.0 * rtol + 1e-11) * max(1.0, abs(exact)):
        return Trial(tried, ())
    detail = f"off by {error:.3g} of {exact:.6g} at rtol {rtol:.3g}, growth {growth:.3g}, {passed} edges"
    return Trial(tried, (Finding("wrong", f"{form} {solver} is wrong", detail),))
