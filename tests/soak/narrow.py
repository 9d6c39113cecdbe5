"""Kind `narrow`: smooth laws that act narrowly or briefly, against quadratures.

A mass goes along a line in the plane, which is turned, moved and scaled, over bells of a potential and is pushed by
bells of time, each as narrow as 1e-4 of the way. Hills and wells are crossed in a time that is an integral; pulses of
time add their integrals.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.integrate import quad

import atwood
from atwood import Component, Load, Point, Scalar, Scene, Vector, connector, force, potential, simulate
from atwood.errors import AtwoodError
from atwood_library import PointMass

from .trial import Discarded, Finding, Trial

WAYS = [("reduced", one) for one in ("auto", "explicit", "ida", "taylor", "gauss", "composition")]
WAYS += [("dae", "auto"), ("dae", "ida")]

SHAPES: dict[str, Callable[[Scalar], Scalar]] = {
    "gauss": lambda s: atwood.exp(-(s * s)),
    "lorentz": lambda s: 1 / (1 + s * s),
    "step bell": lambda s: 1 - atwood.tanh(s) ** 2,
    "two edges": lambda s: 0.5 * (atwood.tanh(s + 2) - atwood.tanh(s - 2)),
    "ripple": lambda s: atwood.sin(20 * s) * atwood.exp(-(s * s)),
    "corners": lambda s: atwood.sqrt(s * s + 4) - atwood.sqrt(s * s + 1),
    "power": lambda s: ((1 + atwood.cos(1e-2 * s)) / 2) ** 20_000,
}
"""Bells of one unit's height and about a unit's width; the power comes again after some 600 units."""


@dataclass(frozen=True)
class Bell:
    """A bell of some height about a place, or a moment."""

    shape: str
    at: float
    width: float
    height: float

    def __call__(self, x: Scalar) -> Scalar:
        return self.height * SHAPES[self.shape]((x - self.at) / self.width)

    def cuts(self, end: float) -> list[float]:
        """Return where an integral up to an end is divided."""
        if self.shape == "power":
            again = 200.0 * math.pi * self.width
            middles = [self.at + k * again for k in range(-math.ceil(end / again), math.ceil(end / again) + 1)]
            return [one + k * self.width for one in middles for k in (-12.0, -4.0, 0.0, 4.0, 12.0)]
        steps = [2.0**k for k in range(-1, 40) if 2.0**k * self.width < end]
        return [one for k in steps for one in (self.at - k * self.width, self.at + k * self.width)] + [self.at]


def integral(function: Callable[[float], float], bells: list[Bell], end: float) -> float:
    """Return an integral from zero on that is divided where bells are."""
    cuts = sorted({0.0, end, *(c for one in bells for c in one.cuts(end) if 0.0 < c < end)})
    return sum(quad(function, a, b, epsabs=1e-13, epsrel=1e-11, limit=200)[0] for a, b in pairwise(cuts))


def check(seed: int) -> Trial:
    """Compare one scene, in one way, with its quadrature."""
    rng = np.random.default_rng(seed)
    form, solver = WAYS[rng.integers(len(WAYS))]
    of_time = bool(rng.random() < 0.4) and solver not in ("gauss", "composition")
    shapes = [one for one in SHAPES if one != "power" or of_time]
    bells = [
        Bell(
            str(rng.choice(shapes)),
            float(rng.uniform(1.0, 9.0)),
            float(10 ** rng.uniform(-4 if one_narrow else -2, -0.5)),
            float(rng.uniform(-1.0, 0.2)),
        )
        for one_narrow in (True,) + (False,) * int(rng.integers(0, 3))
    ]
    limits = {"power": (0.0, 1e-2), "ripple": (2e-3, 1.0)}
    bells = [replace(one, width=float(np.clip(one.width, *limits.get(one.shape, (0.0, 1.0))))) for one in bells]
    scale, turn, shift = float(10 ** rng.uniform(-3, 3)), float(rng.uniform(-3, 3)), rng.uniform(-3, 3, 2)
    along = np.array([math.cos(turn), math.sin(turn)])

    class Along(Component):
        point: Point = connector(Point, "What is on the line.")

        def way(self) -> Scalar:
            place = self.point.position
            return ((place.x - scale * shift[0]) * along[0] + (place.z - scale * shift[1]) * along[1]) / scale

        if of_time:

            @force
            def pushes(self) -> list[Load]:
                size = scale * sum(one(self.time) for one in bells)
                return [Load(self.point, force=Vector(size * along[0], 0.0, size * along[1]))]

        else:

            @potential
            def hills(self) -> Scalar:
                return scale**2 * sum(one(self.way()) for one in bells)

    scene = Scene(gravity=0.0, t_end=10.0)
    mass, law = scene.add("mass", PointMass(mass=1.0)), scene.add("law", Along())
    scene.connect(law.point, mass.point)
    speed = 0.0 if of_time else 1.0
    for axis, place, direction in zip("xz", scale * shift, along, strict=True):
        scene.start[f"mass.position.{axis}"] = float(place)
        scene.start[f"mass.velocity.{axis}"] = float(scale * speed * direction)
    options = {"accuracy": 1e-8} if rng.random() < 0.3 else {}
    about = f"{form} {solver} {options} {'time' if of_time else 'place'} {bells} x{scale:.3g}"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = simulate(scene, form=form, solver=solver, max_seconds=30.0, **options)
    except AtwoodError as error:
        return Trial((about,), (Finding("refused", f"{type(error).__name__} in {solver}", str(error)),))
    if result.time[-1] < 10.0:
        return Trial((about,), (Finding("hang", f"{solver} is slow", result.status),))
    reached = [result[f"mass.position.{axis}"][-1] / scale - at for axis, at in zip("xz", shift, strict=True)]
    way = float(along @ np.array(reached))
    error = _of_time(bells, way) if of_time else _of_place(bells, way)
    bound = {"ida": 1e-3}.get(solver, 1e-4)
    if options:
        bound = max(1e-6, 30.0 * result.accuracy.reached)
    if not error < bound:
        return Trial((about,), (Finding("wrong", f"{solver} errs by {error:.1e}", about),))
    return Trial((f"{solver} agrees",), ())


def _of_time(bells: list[Bell], way: float) -> float:
    return abs(way - integral(lambda t: (10.0 - t) * sum(float(one(t)) for one in bells), bells, 10.0))


def _of_place(bells: list[Bell], way: float) -> float:
    """Return by how much a mass is off, from the time that it should have taken to where it is."""
    energy = 0.5 + sum(float(one(0.0)) for one in bells)
    about = [one.at + share * one.width for one in bells for share in np.linspace(-4.0, 4.0, 801).tolist()]
    if any(energy - sum(float(one(x)) for one in bells) < 0.05 for x in about if x > 0.0):
        raise Discarded("it may turn back")  # which is none of the quadrature's
    if not way > 0.0:
        return math.inf
    taken = integral(lambda x: 1.0 / math.sqrt(2.0 * (energy - sum(float(one(x)) for one in bells))), bells, way)
    return abs(taken - 10.0) * math.sqrt(2.0 * (energy - sum(float(one(way)) for one in bells)))
