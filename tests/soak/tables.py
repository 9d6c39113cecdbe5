"""Tables by chance, as forces, as drives of springs and as winches, against the interpolants of scipy.

The motion between two rows is integrated by itself with the interpolant, and the next begins where it ends. A winch
whose rope would have to push lets its load fly until the rope is taut again, by closed formulas.
"""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy import interpolate
from scipy.integrate import solve_ivp

from atwood import AtwoodError, Component, Scene, simulate
from atwood_library import Drive, Force, Ground, PointMass, Rope, Spring, Table

from ..helpers.tethers import Tether
from .trial import Finding, Trial

Place = Callable[[float], float]

SOLVERS = (("reduced", "auto"), ("reduced", "ida"), ("reduced", "taylor"), ("dae", "auto"), ("dae", "ida"))
AGREES = 3e-5
"""Of the size of the motion, at rtol 1e-9."""


def check(seed: int) -> Trial:
    """Run one table in one role, in one form with one solver, and compare."""
    chance = random.Random(seed)
    role = chance.choice((pushed, driven, hoisted))
    form, solver = chance.choice([one for one in SOLVERS if role is not hoisted or one[1] != "taylor"])  # no loops
    if role is hoisted and solver == "ida":  # which does not follow gaps: "auto" never chooses it for one
        role = hoisted_by_modes
    what = f"{role.__name__}: {form}, {solver}"
    scale = 10.0 ** chance.uniform(-2.0, 2.0)
    scene, quantity, expected = role(chance, scale)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            result = simulate(scene, form=form, solver=solver, rtol=1e-9, outputs=21)
            estimate = float(np.max(result.error(quantity)))
        except AtwoodError as error:
            return Trial((what,), (Finding("refused", f"{what}: refused", str(error)),))
    found, true = result[quantity], expected(result.time)
    miss, size = float(np.max(np.abs(found - true))), scale
    if not miss <= AGREES * size:
        return Trial((what,), (Finding("wrong", f"{what}: off", f"by {miss / size:.3g} of its size"),))
    if not miss <= 10.0 * estimate + 1e-8 * size:
        detail = f"off by {miss / size:.3g} of its size, estimated {estimate / size:.3g}"
        return Trial((what,), (Finding("wrong", f"{what}: worse than estimated", detail),))
    return Trial((what,))


def table(chance: random.Random, size: float) -> tuple[Table, Place, list[float]]:
    """Return a table, its interpolant, and the times of its rows."""
    times = np.cumsum([0.0, *(10.0 ** chance.uniform(-2.0, 0.0) for _ in range(chance.randint(2, 9)))])
    values = np.array([0.0, *(chance.uniform(-size, size) for _ in times[1:])])
    kind = chance.choice(("linear", "akima", "cubic"))
    kinds = {"akima": interpolate.Akima1DInterpolator, "cubic": interpolate.CubicSpline}
    plain = kind == "linear" or len(times) < 3
    place: Place = (lambda t: float(np.interp(t, times, values))) if plain else kinds[kind](times, values)
    return Table(table=np.column_stack([times, values]), interpolation=kind), place, times.tolist()


def swinging(push: Place, times: list[float], mass: float, stiffness: float, size: float) -> Place:
    """Return the displacement of a mass on a spring, at rest at first, under a force."""

    def at(asked: np.ndarray) -> np.ndarray:
        state, found = np.zeros(2), np.zeros(len(asked))
        for begin, end in pairwise(times):
            inside = (asked >= begin) & (asked <= end)
            moments = np.unique(np.concatenate([asked[inside], [end]]))

            def rate(t: float, y: np.ndarray) -> list[float]:
                return [y[1], (push(t) - stiffness * y[0]) / mass]

            solved = solve_ivp(
                rate, (begin, end), state, method="DOP853", rtol=1e-11, atol=1e-13 * size, t_eval=moments
            )
            found[inside] = np.interp(asked[inside], moments, solved.y[0])
            state = solved.y[:, -1]
        return found

    return at


def oscillator(chance: random.Random, scale: float, end: float) -> tuple[Scene, str, float, float]:
    """Return a mass on a spring along one of the axes, with a drive at the other end, and where the mass is shown."""
    axis = chance.choice("xyz")
    along = tuple(float(one == axis) for one in "xyz")
    scene = Scene(space="line", line_axis=along, gravity=0.0, t_end=end)
    mass, stiffness = 10.0 ** chance.uniform(-1.0, 1.0), 10.0 ** chance.uniform(0.0, 2.0)
    spring = scene.add("spring", Spring(stiffness=stiffness, natural_length=20.0 * scale))
    ground, drive = scene.add("ground", Ground()), scene.add("drive", Drive(axis=along))
    bob = scene.add("bob", PointMass(mass=mass))
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, spring.a)
    scene.connect(spring.b, bob.point)
    scene.start.update({f"bob.position.{axis}": 20.0 * scale, f"bob.velocity.{axis}": 0.0})
    return scene, f"bob.position.{axis}", mass, stiffness


def pushed(chance: random.Random, scale: float) -> tuple[Scene, str, Place]:
    """A table is a force on a mass on a spring."""
    own, push, times = table(chance, scale)
    scene, quantity, mass, stiffness = oscillator(chance, scale, times[-1])
    source, force = scene.add("table", own), scene.add("force", Force(direction=scene.line_axis))
    scene.connect(source.output("value"), force.input("value"))
    scene.connect(force.point, scene["bob"].point)
    at = swinging(push, times, mass, stiffness, scale)
    return scene, quantity, lambda t: 20.0 * scale + at(t)


def driven(chance: random.Random, scale: float) -> tuple[Scene, str, Place]:
    """A table moves the other end of the spring."""
    own, place, times = table(chance, scale)
    scene, quantity, mass, stiffness = oscillator(chance, scale, times[-1])
    source = scene.add("table", own)
    scene.connect(source.output("value"), scene["drive"].input("motion"))
    at = swinging(lambda t: stiffness * place(t), times, mass, stiffness, scale)
    return scene, quantity, lambda t: 20.0 * scale + at(t)


def hoisted(chance: random.Random, scale: float) -> tuple[Scene, str, Place]:
    """A winch winds in, stops, and its load flies on until the rope, which is a gap, is taut again."""
    return flying(chance, scale, Rope(length=5.0 * scale, when_slack="slack"))


def hoisted_by_modes(chance: random.Random, scale: float) -> tuple[Scene, str, Place]:
    """The same with a rope that has a mode each for taut and slack."""
    return flying(chance, scale, Tether(length=5.0 * scale))


def flying(chance: random.Random, scale: float, part: Component) -> tuple[Scene, str, Place]:
    """Return the load of a winch on a rope that is taut, then slack, then taut."""
    gravity, speed = 10.0 ** chance.uniform(0.0, 1.5) * scale, chance.uniform(0.1, 1.0) * scale
    stops, length = chance.uniform(0.1, 1.0), 5.0 * scale
    caught = stops + 2.0 * speed / gravity
    scene = Scene(
        space=chance.choice(("line", "plane", "space")), gravity=gravity, t_end=caught + chance.uniform(0.1, 0.5)
    )
    if scene.space == "line":
        scene.set("line_axis", (0.0, 0.0, 1.0))
    rows = [(0.0, 0.0), (stops, -speed * stops), (10.0 + caught, -speed * stops)]
    ground, rope = scene.add("ground", Ground()), scene.add("rope", part)
    load, winch = (
        scene.add("load", PointMass(mass=10.0 ** chance.uniform(-2.0, 2.0))),
        scene.add("winch", Table(table=rows)),
    )
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, load.point)
    scene.connect(winch.output("value"), rope.input("paid_out"))
    scene.guess["load.position.z"] = -length

    def at(t: np.ndarray) -> np.ndarray:
        since = np.clip(t - stops, 0.0, caught - stops)
        return -length + speed * np.minimum(t, stops) + speed * since - 0.5 * gravity * since**2

    return scene, "load.position.z", at
