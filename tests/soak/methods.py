"""Trials of methods: a scene in other ways to solve it, with switches, an accuracy asked for, swept, and stopped."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from atwood import AtwoodError, Result, Scene, UnsupportedError, UsageError, select, simulate, sweep
from atwood_library import Force

from .build import build_scene, moving_axes
from .description import Array, Mechanism, outline
from .draw import draw
from .scenes import stem
from .trial import Discarded, Finding, Trial

T_END = 0.3
LARGEST = 4
"""Bodies: the methods are tried here, and large scenes only take longer."""

ALLOWED = 2e-6
"""Difference of positions from a run with a tighter tolerance, relative to their size, at a tolerance of 1e-9."""

ESTIMATED = 1e-12
"""Below that errors are rounding, of which no estimate is asked."""

SWITCHED = 0.4
"""Share of the run after which a force changes."""

SOLVERS = (
    ("reduced", {"solver": "explicit"}),
    ("reduced", {"solver": "taylor"}),
    ("reduced", {"solver": "gauss", "order": 6}),
    ("reduced", {"solver": "composition", "order": 6}),
    ("reduced", {"solver": "ida"}),
    ("dae", {"solver": "ida", "level": "index1-projected"}),
    ("dae", {"solver": "ida-sundae"}),
)
"""Forms and methods; a scene has some of them only, and the others say so."""


def check(seed: int) -> Trial:
    """Solve the scene of a seed in one way and in some others, and ask for its accuracy, a sweep and a stop."""
    random = np.random.default_rng([seed, 3])
    mechanism = draw(seed, own=False)
    if len(mechanism.bodies) > LARGEST:
        raise Discarded("large")
    pushed = random.random() < 0.4
    words = [mechanism.space, *sorted({tie.sort for tie in mechanism.ties}), *(["switch"] if pushed else [])]

    def scene() -> Scene:
        made = build_scene(mechanism, "all")
        if pushed:
            _push(made, mechanism, np.random.default_rng([seed, 4]))
        return made

    try:
        known = simulate(scene(), t_end=T_END, rtol=1e-12, outputs=5, max_seconds=30.0)
    except AtwoodError as error:
        raise Discarded(f"refused: {stem(error)}") from error
    if known.status != "finished":
        raise Discarded(known.status)
    findings: list[Finding] = []
    for part in (_other_solvers, _accuracy, _swept, _stopped):
        found, said = part(scene, mechanism, known, random)
        findings += [replace(one, detail=f"{one.detail}\n{outline(mechanism)}") for one in found]
        words += said
    return Trial(tuple(words), tuple(findings))


_Found = tuple[list[Finding], list[str]]


def _push(scene: Scene, mechanism: Mechanism, random: np.random.Generator) -> None:
    """Add a force on one of the bodies that changes at a moment."""
    body = mechanism.bodies[random.integers(len(mechanism.bodies))]
    before, after = (float(size) for size in body.mass * random.uniform(-20.0, 20.0, 2))
    direction = mechanism.line if mechanism.space == "line" else random.uniform(-1.0, 1.0, 3) * (1.0, 0.0, 1.0)
    part = scene.add("push", Force(direction=tuple(direction / np.linalg.norm(direction))))
    scene.set("push.value", lambda t: select(t < SWITCHED * T_END, before, after))
    scene.connect(scene[body.name].point if body.is_point else scene[body.name].frame, part.point)


def places(result: Result, mechanism: Mechanism) -> Array:
    """Return the positions of all bodies at the outputs."""
    axes = moving_axes(mechanism)
    table = result.table([f"{body.name}.position.{axis}" for body in mechanism.bodies for axis in axes])
    return np.array(list(table.values()))


def _apart(one: Array, other: Array) -> float:
    return float(np.max(np.abs(one - other), initial=0.0)) / (1.0 + float(np.max(np.abs(other), initial=0.0)))


def _other_solvers(
    scene: Callable[[], Scene], mechanism: Mechanism, known: Result, random: np.random.Generator
) -> _Found:
    """Compare two other ways to solve the scene."""
    found, words = [], []
    for k in random.choice(len(SOLVERS), 2, replace=False):
        form, how = SOLVERS[k]
        name = f"{form} {how['solver']}"
        try:
            result = simulate(scene(), form=form, t_end=T_END, rtol=1e-9, outputs=5, max_seconds=30.0, **how)
        except (UnsupportedError, UsageError) as error:
            words.append(f"{name}: not for it")
            if not error.advice:
                found.append(Finding("message", f"{name}: no remedy is said", str(error)))
            continue
        except AtwoodError as error:
            found.append(Finding("refused", f"{name}: {stem(error)}", str(error)))
            continue
        if result.status != "finished":
            words.append(f"{name}: {result.status}")
            continue
        gap = _apart(places(result, mechanism), places(known, mechanism))
        words.append(f"compared {name}")
        if not gap < ALLOWED and not _falls(scene, mechanism, known, form, how, gap):
            found.append(Finding("wrong", f"{name}: positions", f"{gap:.1e}"))
    return found, words


def _falls(
    scene: Callable[[], Scene], mechanism: Mechanism, known: Result, form: str, how: dict[str, object], gap: float
) -> bool:
    """Return whether the difference falls with the tolerance, as where a motion is sensitive to its errors."""
    try:
        finer = simulate(scene(), form=form, t_end=T_END, rtol=1e-11, outputs=5, max_seconds=30.0, **how)
    except AtwoodError:
        return False
    return gap < 100.0 * ALLOWED and _apart(places(finer, mechanism), places(known, mechanism)) < 0.2 * gap


def _accuracy(scene: Callable[[], Scene], mechanism: Mechanism, known: Result, random: np.random.Generator) -> _Found:
    """Ask for an accuracy, or for the error of a run; compare both with the tighter run."""
    asked = float(10.0 ** random.uniform(-9.0, -3.0)) if random.random() < 0.5 else None
    form = str(random.choice(["reduced", "dae"]))
    how: dict[str, float] = (
        {"rtol": float(10.0 ** random.uniform(-9.0, -4.0))} if asked is None else {"accuracy": asked}
    )
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            result = simulate(scene(), form=form, t_end=T_END, outputs=5, max_seconds=30.0, **how)
            if result.status != "finished":
                return [], [f"accuracy: {result.status}"]
            paths = [f"{body.name}.position.{axis}" for body in mechanism.bodies for axis in moving_axes(mechanism)]
            estimate = float(np.max([np.abs(result.error(path)) for path in paths]))
            accuracy = result.accuracy
        except AtwoodError as error:
            return [Finding("refused", f"accuracy: {stem(error)}", f"{form} {how}: {error}")], []
    error = float(np.max(np.abs(places(result, mechanism) - places(known, mechanism))))
    length = result.run.segments[0].plan.scales.length
    detail = f"{form} {how}: error {error:.1e}, estimate {estimate:.1e}, {accuracy.describe()}"
    found = []
    if asked is not None and error > 3.0 * asked * length + ESTIMATED * length and accuracy.is_met and not said:
        found.append(Finding("wrong", "accuracy: it is not met, and not said", detail))
    if error < ESTIMATED * length:
        return found, ["error: rounding"]
    if estimate < 0.01 * error:
        found.append(Finding("wrong", "error: the estimate is a hundredth of it", detail))
    return found, [f"error: the estimate is {'within a factor of ten' if 0.1 < estimate / error < 10.0 else 'off'}"]


def _swept(scene: Callable[[], Scene], mechanism: Mechanism, known: Result, random: np.random.Generator) -> _Found:
    """Compare a sweep over the mass of a body with single runs."""
    if random.random() < 0.6:
        return [], []
    body = mechanism.bodies[random.integers(len(mechanism.bodies))]
    masses, path = [body.mass, 1.3 * body.mass], f"{body.name}.mass"
    paths = [f"{one.name}.position.{axis}" for one in mechanism.bodies for axis in moving_axes(mechanism)]
    try:
        many = sweep(scene(), {path: masses}, quantities=paths, t_end=T_END, rtol=1e-9, outputs=5, threads=1)
        alone = []
        for mass in masses:
            one = scene()
            one.set(path, mass)
            alone.append(simulate(one, t_end=T_END, rtol=1e-9, outputs=5, max_seconds=30.0))
    except AtwoodError as error:
        return [Finding("refused", f"sweep: {stem(error)}", str(error))], []
    if any(result.status != "finished" for result in alone):
        return [], ["sweep: not to the end"]
    gap = max(
        _apart(np.array([many[path][k] for path in paths]), places(result, mechanism)) for k, result in enumerate(alone)
    )
    return [] if gap < ALLOWED else [Finding("wrong", "sweep: positions", f"{gap:.1e}")], ["compared sweep"]


def _stopped(scene: Callable[[], Scene], mechanism: Mechanism, known: Result, random: np.random.Generator) -> _Found:
    """Stop where a position crosses the value that it has at some output, and look when that is."""
    number, axis = random.integers(len(mechanism.bodies)), str(random.choice(list(moving_axes(mechanism))))
    path = f"{mechanism.bodies[number].name}.position.{axis}"
    values, at = known[path], int(random.integers(1, 4))
    others = np.delete(values, at)
    speed = float(known[path.replace("position", "velocity")][at])
    monotonic = np.all(np.diff(values) > 0.0) or np.all(np.diff(values) < 0.0)
    if not monotonic or abs(speed) < 1e-2 or np.min(np.abs(others - values[at])) < 1e-3:
        return [], []
    form, solver = str(random.choice(["reduced", "dae"])), str(random.choice(["auto", "ida"]))
    level = float(values[at])
    try:
        result = simulate(
            scene(), form=form, solver=solver, t_end=T_END, rtol=1e-9, until=f"{path} crosses {level!r}", outputs=5
        )
    except AtwoodError as error:
        return [Finding("refused", f"until: {stem(error)}", str(error))], []
    if result.status != "stopped":
        return [Finding("wrong", f"until: {result.status}", f"{form} {solver} {path} {level} {values}")], []
    late = abs(float(result.time[-1] - known.time[at]))
    gap = abs(float(result[path][-1]) - level) / (1.0 + abs(level))
    wrong = gap > 1e-8 or late * abs(speed) > ALLOWED * (1.0 + float(np.max(np.abs(values))))
    # A motion that goes back and forth between outputs may be there before.
    back = result.time[-1] < known.time[at] and gap < 1e-8
    return [
        Finding("wrong", "until: the time", f"{form} {solver} {path}: {late:.1e} s, {gap:.1e}")
    ] if wrong and not back else [], ["compared until"]
