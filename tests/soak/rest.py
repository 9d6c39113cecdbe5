"""Kind `rest`: equilibria of sums of polynomials, degenerate or not, against their known zeros.

A potential ``f(x) + g(z)`` is at rest where ``f' = 0`` and ``g' = 0``, which are products of powers here. A zero of odd
order at which the slope rises is a minimum in that direction. The plane is turned, moved and scaled.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from atwood import Scene, equilibria
from atwood.errors import AtwoodError
from atwood_library import PointMass, Potential

from .trial import Finding, Trial

SIDE = 2.0
"""All zeros lie within this distance of the middle, in units of the scene's length."""


def draw_zeros(random: np.random.Generator) -> list[tuple[float, int]]:
    """Return up to three zeros of a slope with their orders, well apart."""
    count = int(random.integers(1, 4))
    places = np.sort(random.uniform(-1.5, 1.5, count))
    while count > 1 and np.min(np.diff(places)) < 0.5:
        places = np.sort(random.uniform(-1.5, 1.5, count))
    return [(float(one), int(random.choice([1, 1, 1, 2, 3]))) for one in places]


def polynomial(zeros: list[tuple[float, int]], factor: float) -> np.polynomial.Polynomial:
    """Return the integral of the product of powers."""
    slope = np.polynomial.Polynomial([factor])
    for place, order in zeros:
        slope = slope * np.polynomial.Polynomial([-place, 1.0]) ** order
    return slope.integ()


def is_least(zeros: list[tuple[float, int]], factor: float, which: int) -> bool:
    """Return whether a zero of the slope is a minimum."""
    place, order = zeros[which]
    around = math.prod((place - other) ** n for other, n in zeros if other != place)
    return order % 2 == 1 and factor * around > 0.0


def written(one: np.polynomial.Polynomial) -> Callable[[Any], Any]:
    """Return the polynomial by Horner's rule."""

    def value(x: Any) -> Any:
        found: Any = 0.0
        for c in one.coef[::-1].tolist():
            found = found * x + c
        return found

    return value


def check(seed: int) -> Trial:
    """Make the trial of a seed."""
    random = np.random.default_rng(seed)
    sides = [(draw_zeros(random), float(random.choice([-1.0, 1.0])) * random.uniform(0.5, 2.0)) for _ in "xz"]
    f, g = (written(polynomial(*side)) for side in sides)
    angle = float(random.choice([0.0, random.uniform(-3.0, 3.0)]))
    length, energy = 10.0 ** random.uniform(-3.0, 3.0), 10.0 ** random.uniform(-3.0, 3.0)
    middle = length * random.uniform(-5.0, 5.0, 2)
    c, s = math.cos(angle), math.sin(angle)

    def potential(x: Any, z: Any) -> Any:
        x, z = (x - middle[0]) / length, (z - middle[1]) / length
        return energy * (f(c * x + s * z) + g(c * z - s * x))

    expected = {}
    for i, (a, m) in enumerate(sides[0][0]):
        for j, (b, n) in enumerate(sides[1][0]):
            stable = is_least(*sides[0], i) and is_least(*sides[1], j)
            expected[a, b] = stable, max(m, n)
    scene = Scene(gravity=0.0)
    field, bob = scene.add("field", Potential(energy_function=potential)), scene.add("bob", PointMass(mass=1.3))
    scene.connect(field.point, bob.point)
    start = middle + length * random.uniform(-1.0, 1.0, 2)
    reach = SIDE * 1.5 * length
    region = {}
    for axis, place, own in zip("xz", start, middle, strict=True):
        scene.start[f"bob.position.{axis}"], scene.start[f"bob.velocity.{axis}"] = float(place), 0.0
        region[f"bob.position.{axis}"] = float(own - reach), float(own + reach)
    worst = max(order for _, order in expected.values())
    tried = (f"at rest {len(expected)}", f"order {worst}", "compared")
    about = f"zeros {sides}, angle {angle:.3g}, length {length:.3g}, energy {energy:.3g}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = equilibria(scene, region=region)
        except AtwoodError as error:
            return Trial(tried, (Finding("refused", "equilibria: refused", f"{error}: {about}"),))
    findings, left = [], dict(expected)
    for one in found:
        x, z = ((one.values[f"bob.position.{axis}"] - own) / length for axis, own in zip("xz", middle, strict=True))
        a, b = c * x + s * z, c * z - s * x
        place = min(expected, key=lambda at: math.hypot(at[0] - a, at[1] - b))
        gap, (stable, order) = math.hypot(place[0] - a, place[1] - b), expected[place]
        if gap > (1e-6 if order == 1 else 1e-3):
            findings.append(
                Finding("wrong", "equilibria: there is none", f"at {a:.6g}, {b:.6g}, {gap:.3g} off: {about}")
            )
        elif place not in left:
            findings.append(Finding("wrong", "equilibria: one comes twice", f"at {a:.6g}, {b:.6g}: {about}"))
        else:
            del left[place]
            if one.stability != ("stable" if stable else "unstable"):
                what = "undecided" if one.stability not in ("stable", "unstable") else "another stability"
                gravity = "message" if what == "undecided" else "wrong"
                findings.append(
                    Finding(gravity, f"equilibria: {what}", f"{one.stability} at {place}, order {order}: {about}")
                )
    if left:
        findings.append(Finding("wrong", "equilibria: one is missed", f"{left}: {about}"))
    return Trial(tried, tuple(findings))
