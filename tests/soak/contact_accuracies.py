"""Kind `contact_accuracies`: scenes with impacts, stick-slip and clutches, asked for an accuracy, against closed forms.

A ball that bounces and slides, a block on a slope, a mass on a spring that friction stops, a clutch that takes two
wheels along, and two wheels with play, of any size and in either form. Their motions are known piece by piece.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable

import numpy as np

from atwood import Scene, simulate
from atwood_library import (
    Ground,
    Inertia,
    Mass1D,
    PointContact,
    PointMass,
    RotationalFriction,
    RotationalStop,
    TranslationalFriction,
    TranslationalSpringDamper,
)

from .accuracies import ASKED
from .trial import Finding, Trial

G = 9.81
KNOWN = 1e-14
"""The rounding of a closed form, relative to the extent, for each piece of it."""

Piece = tuple[float, Callable[[float], float]]
"""From when on a quantity is which function of the time since then."""
Made = tuple[Scene, float, dict[str, list[Piece]], float]
"""A scene, its end, what is known of its quantities, and their unit: the extent, or 1 for angles."""


def _fall(x: float, v: float, a: float) -> Callable[[float], float]:
    return lambda t: x + v * t + 0.5 * a * t * t


def bounces(chance: np.random.Generator, size: float) -> Made:
    """Return a ball that is thrown over a rough floor."""
    e, mu = float(chance.uniform(0.2, 0.7)), float(chance.uniform(0.02, 0.2))
    speed, up = float(chance.uniform(2.0, 4.0)), float(chance.uniform(1.0, 2.0))
    scene = Scene(gravity=G * size)
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=float(chance.uniform(0.5, 2.0))))
    floor = scene.add("c", PointContact(restitution=e, friction=mu))
    scene.connect(ground.frame, floor.plane)
    scene.connect(m.point, floor.point)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.0})
    scene.start.update({"m.velocity.x": speed * size, "m.velocity.z": up * size})
    t, x, ways, heights = 0.0, 0.0, list[Piece](), list[Piece]()
    while up > 1e-17:
        ways.append((t, _fall(x, speed, 0.0)))
        heights.append((t, _fall(0.0, up, -G)))
        flight = 2.0 * up / G
        t, x = t + flight, x + speed * flight
        speed -= min(mu * (1.0 + e) * up, speed)
        up *= e
    heights.append((t, _fall(0.0, 0.0, 0.0)))
    ways.append((t, _fall(x, speed, -mu * G)))
    rest = t + speed / (mu * G)
    ways.append((rest, _fall(x + 0.5 * speed**2 / (mu * G), 0.0, 0.0)))
    return scene, rest + 0.5, {"m.position.x": ways, "m.position.z": heights}, size


def slope(chance: np.random.Generator, size: float) -> Made:
    """Return a block that slides up a slope, and stays or slides back."""
    lean, mu, speed = float(chance.uniform(0.1, 0.8)), float(chance.uniform(0.1, 0.9)), float(chance.uniform(0.5, 3.0))
    c, s = math.cos(lean), math.sin(lean)
    if abs(mu * c - s) < 0.02:
        mu += 0.1
    scene = Scene(gravity=G * size)
    ground, m = scene.add("ground", Ground()), scene.add("m", PointMass(mass=float(chance.uniform(0.5, 2.0))))
    plane = scene.add("c", PointContact(normal=(-s, 0.0, c), friction=mu))
    scene.connect(ground.frame, plane.plane)
    scene.connect(m.point, plane.point)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.0})
    scene.start.update({"m.velocity.x": speed * size * c, "m.velocity.z": speed * size * s})
    slows = G * (s + mu * c)
    turn, far = speed / slows, 0.5 * speed**2 / slows
    back = min(0.0, -G * (s - mu * c))
    pieces = [(0.0, _fall(0.0, speed, -slows)), (turn, _fall(far, 0.0, back))]
    along = {f"m.position.{axis}": [(t, _times(f, by)) for t, f in pieces] for axis, by in (("x", c), ("z", s))}
    return scene, turn + 0.7, along, size


def _times(function: Callable[[float], float], by: float) -> Callable[[float], float]:
    return lambda t: by * function(t)


def spring(chance: np.random.Generator, size: float) -> Made:
    """Return a mass on a spring that dry friction brings to rest."""
    m, k = float(chance.uniform(0.5, 2.0)), float(chance.uniform(20.0, 80.0))
    most, x = float(chance.uniform(1.0, 5.0)), float(chance.uniform(0.5, 1.0))
    scene = Scene()
    mass = scene.add("m", Mass1D(mass=m))
    tie = scene.add("tie", TranslationalSpringDamper(stiffness=k, against="ground"))
    rub = scene.add("rub", TranslationalFriction(sliding=repr(most * size), against="ground"))
    scene.connect(mass.slide, tie.b)
    scene.connect(mass.slide, rub.b)
    scene.start.update({"m.displacement": x * size, "m.speed": 0.0})
    t, w, pieces, shift = 0.0, math.sqrt(k / m), list[Piece](), most / k
    while abs(x) > shift:
        middle = math.copysign(shift, x)
        pieces.append((t, lambda s, a=x - middle, b=middle: b + a * math.cos(w * s)))
        t, x = t + math.pi / w, 2.0 * middle - x
    pieces.append((t, lambda s, x=x: x))
    return scene, t + 0.3, {"m.displacement": pieces}, size


def clutch(chance: np.random.Generator, size: float) -> Made:
    """Return two wheels of which one takes the other along; size is that of their moments."""
    one, two = (float(x) for x in chance.uniform(0.5, 2.0, 2))
    fast, most = float(chance.uniform(5.0, 20.0)), float(chance.uniform(2.0, 10.0))
    scene = Scene()
    a, b = scene.add("a", Inertia(moment=one * size)), scene.add("b", Inertia(moment=two * size))
    rub = scene.add("rub", RotationalFriction(sliding=repr(most * size)))
    scene.connect(a.flange, rub.a)
    scene.connect(b.flange, rub.b)
    scene.start.update({"a.angle": 0.0, "b.angle": 0.0, "a.angular_velocity": fast, "b.angular_velocity": 0.0})
    t = fast / (most / one + most / two)
    both = one * fast / (one + two)
    ways = {}
    for name, speed, gain in (("a", fast, -most / one), ("b", 0.0, most / two)):
        slides = _fall(0.0, speed, gain)
        ways[f"{name}.angle"] = [(0.0, slides), (t, _fall(slides(t), both, 0.0))]
    return scene, t + 0.5, ways, 1.0


def play(chance: np.random.Generator, size: float) -> Made:
    """Return two wheels that strike each other within their play; size is that of their moments."""
    one, two = (float(x) for x in chance.uniform(0.5, 2.0, 2))
    fast, e, wide = float(chance.uniform(2.0, 6.0)), float(chance.uniform(0.5, 0.95)), float(chance.uniform(0.05, 0.3))
    scene = Scene()
    a, b = scene.add("a", Inertia(moment=one * size)), scene.add("b", Inertia(moment=two * size))
    stop = scene.add("play", RotationalStop(lower=-wide, upper=wide, restitution=e))
    scene.connect(a.flange, stop.a)
    scene.connect(b.flange, stop.b)
    scene.start.update({"a.angle": 0.0, "b.angle": 0.0, "a.angular_velocity": fast, "b.angular_velocity": 0.0})
    t, places, speeds, left = 0.0, [0.0, 0.0], [fast, 0.0], wide
    ways: dict[str, list[Piece]] = {"a.angle": [], "b.angle": []}
    for _ in range(6):
        for name, x, v in zip(ways, places, speeds, strict=True):
            ways[name].append((t, _fall(x, v, 0.0)))
        past = speeds[0] - speeds[1]
        flight = left / abs(past)
        places = [x + v * flight for x, v in zip(places, speeds, strict=True)]
        push = (1.0 + e) * past / (1.0 / one + 1.0 / two)
        speeds = [speeds[0] - push / one, speeds[1] + push / two]
        t, left = t + flight, 2.0 * wide
    return scene, t, ways, 1.0


def _known(pieces: list[Piece], times: np.ndarray) -> np.ndarray:
    starts = np.array([t for t, _ in pieces])
    which = np.maximum(np.searchsorted(starts, times, side="right") - 1, 0)
    return np.array([pieces[i][1](float(t) - pieces[i][0]) for t, i in zip(times, which, strict=True)])


def check(seed: int) -> Trial:
    """Ask for an accuracy, and compare what was reached with the true error."""
    chance = np.random.default_rng(seed)
    make = (bounces, slope, spring, clutch, play)[int(chance.integers(5))]
    size = float(10.0 ** chance.uniform(-2.0, 2.0))
    scene, end, known, unit = make(chance, size)
    asked, form = float(chance.choice(ASKED)), str(chance.choice(["reduced", "dae"]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = simulate(scene, form=form, t_end=end, accuracy=asked)
    accuracy, times = result.accuracy, np.asarray(result.time)
    true, scale = 0.0, result.start.length if unit == size and make not in (clutch, play) else 1.0
    by = size if make not in (clutch, play) else 1.0
    for path, pieces in known.items():
        true = max(true, float(np.max(np.abs(result[path] - by * _known(pieces, times)))) / scale)
    far = max(float(np.max(np.abs(result[path]))) for path in known) / scale
    room = KNOWN * len(next(iter(known.values()))) * max(1.0, far)
    tried = [make.__name__, form, f"asked {asked:g}", "met" if accuracy.is_met else "not met, and said"]
    figures = f"true {true:.2e}, reached {accuracy.reached:.2e}, asked {asked:g}, {form}: {make.__name__}"
    if not accuracy.is_known:
        return Trial((*tried, "not known"))
    if true > accuracy.reached + room:
        return Trial(tuple(tried), (Finding("wrong", f"{make.__name__}: an error above what was reached", figures),))
    is_close = accuracy.reached <= 10.0 * true + room
    is_rounding = not is_close and accuracy.reached <= 1e-11
    said = "reached at most 10 times the error" if is_close else "reached more than 10 times the error"
    return Trial((*tried, said + (", both below 1e-11" if is_rounding else "")))
