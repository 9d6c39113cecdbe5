"""Trials of relations: the same mechanism said, or solved, in another way does the same."""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np

from atwood import AtwoodError, Result

from .build import moving_axes
from .description import Array, Mechanism, Signal, outline
from .draw import draw, settled
from .oracle import Oracle
from .relations import RELATIONS, NotAdmitted, Related
from .scenes import T_END, Way, run_scene, started_as, stem
from .trial import Discarded, Finding, Trial

ALLOWED = 1e-6
"""Difference between two runs, relative to the size of what is compared; forces ten times that."""

ONE_WAY = ("damper", "drag", "torsion_damper", "own_swirl", "own_leak", "sampled")
"""Parts whose motion does not go back the way that it came, or whose functions of time do not."""


def check(seed: int) -> Trial:
    """Compare the runs of a scene and of another form of it: by the first of some relations that it admits."""
    random = np.random.default_rng([seed, 2])
    mechanism = draw(seed)
    way = Way(str(random.choice(["reduced", "dae"])), solver="ida-sundae", start="all")
    for relation in random.permutation([*RELATIONS, "solved otherwise", "reversed", "floating"]):
        words = (f"relation: {relation}", f"space: {mechanism.space}", f"form: {way.form}")
        if relation == "solved otherwise":
            return _compare(mechanism, Related(mechanism), way, _other_way(random, mechanism), words)
        with contextlib.suppress(NotAdmitted):
            if relation == "reversed":
                return _reversed(mechanism, way, words)
            if relation == "floating":
                return _floating(mechanism, way, words)
            return _compare(mechanism, RELATIONS[relation](mechanism, random), way, way, words)
    raise AssertionError("a scene can always be solved otherwise")


def _compare(mechanism: Mechanism, related: Related, way: Way, other: Way, words: tuple[str, ...]) -> Trial:
    relation = words[0].removeprefix("relation: ")
    results: list[Result] = []
    refused: list[str] = []
    for one, how, t_end in ((mechanism, way, T_END), (related.mechanism, other, T_END * related.stretch)):
        try:
            results.append(run_scene(one, how, t_end))
        except AtwoodError as error:
            refused.append(f"{how}: {error}\n{outline(one)}")
    if len(refused) == 2:
        raise Discarded("refused both ways")
    if refused:
        return Trial(words, (Finding("refused", f"{relation}: in one of two ways", refused[0]),))
    first, second = results
    if "time_limit" in (first.status, second.status):  # by the clock, on a machine that others use
        raise Discarded("out of time")
    if first.status != second.status:
        said = f"{way}: {first.status} {first.message}\n{other}: {second.status} {second.message}\n{outline(mechanism)}"
        return Trial(words, (Finding("wrong", f"{relation}: the end", said),))
    gaps = _differences(first, second, related, mechanism)
    wrong = [(what, gap) for what, gap in gaps if not gap <= ALLOWED]
    if not wrong:
        return Trial((*words, f"compared {first.status}"))
    numbers = ", ".join(f"{what} {gap:.1e}" for what, gap in wrong)
    detail = f"{way} and {other}: {numbers}\n{outline(mechanism)}"
    return Trial(words, (Finding("wrong", f"{relation}: {wrong[0][0].split(' ')[-1]}", detail),))


def _other_way(random: np.random.Generator, mechanism: Mechanism) -> Way:
    """Return a way to solve a scene, compiled mostly."""
    if random.random() < 0.5:
        level = str(random.choice(["ggl", "index1-projected"]))
        return Way("dae", level, str(random.choice(["ida", "ida-sundae"])), start="all")
    orientation = "quaternion"
    if mechanism.space == "space":
        orientation = str(random.choice(["quaternion", "euler-zyx", "euler-xyz", "euler-zyz"]))
    return Way("reduced", "ggl", str(random.choice(["auto", "ida"])), orientation, "all")


def _differences(first: Result, second: Result, related: Related, mechanism: Mechanism) -> list[tuple[str, float]]:
    matrix = np.eye(3) if related.matrix is None else related.matrix
    shift = np.zeros((3, 1)) if related.shift is None else related.shift[:, None]
    size = abs(np.linalg.det(matrix)) ** (1.0 / 3.0)
    freedom = [_freedom(result) for result in (first, second)]
    found = [("degrees of freedom", float(abs(freedom[0] - freedom[1])))]
    axes, other_axes = moving_axes(mechanism), moving_axes(related.mechanism)
    kept = ["xyz".index(axis) for axis in other_axes]
    matrix = matrix[np.ix_(kept, ["xyz".index(axis) for axis in axes])]
    for body in mechanism.bodies:
        name = related.names(body.name)
        for quantity, time, origin in (("position", 1.0, shift[kept]), ("velocity", related.stretch, 0.0)):
            if _is_split(related, body.name):
                continue  # its centre of mass is elsewhere
            one = np.array([first.array(f"{body.name}.{quantity}.{axis}") for axis in axes])
            other = np.array([second.array(f"{name}.{quantity}.{axis}") for axis in other_axes])
            found.append((f"{body.name} {quantity}", _apart(matrix @ one / time + origin, other, size / time)))
    oracle = Oracle(mechanism)
    if oracle.rank == len(oracle.owners()):  # otherwise forces are not all unique
        found += _forces(first, second, related, mechanism)
    return found


def _is_split(related: Related, name: str) -> bool:
    return any(body.name == f"{name}_other" for body in related.mechanism.bodies)


def _forces(first: Result, second: Result, related: Related, mechanism: Mechanism) -> list[tuple[str, float]]:
    """Compare the sizes of forces, which do not depend on axes."""
    found = []
    size = 1.0
    for tie in mechanism.ties:
        paths = [path for path in first.paths if path.startswith((f"{tie.name}.force.", f"{tie.name}.tension"))]
        if paths:
            one = np.linalg.norm([first.array(path) for path in paths], axis=0)
            renamed = [path.replace(tie.name, related.names(tie.name), 1) for path in paths]
            renamed = [path for path in renamed if path in second]
            other = np.linalg.norm([second.array(path) for path in renamed], axis=0) / related.force
            size = max(size, float(np.max(one)))
            if not np.any(np.isnan(one) | np.isnan(other)):
                found.append((f"{tie.name} force", float(np.max(np.abs(one - other))) / 10.0))
    return [(what, gap / size) for what, gap in found]


def _freedom(result: Result) -> int:
    plan = result.run.segments[0].plan
    return len(plan.assembly.own_equations.speeds) - plan.finding.rank


def _reversed(mechanism: Mechanism, way: Way, words: tuple[str, ...]) -> Trial:
    """Run a scene without friction there and back again."""
    for tie in mechanism.ties:
        bent = any(isinstance(value, Signal) and value.jump for value in tie.values.values())
        if bent or tie.sort in ONE_WAY or any("damping" in name for name in tie.values):
            raise NotAdmitted
    if mechanism.space == "plane":
        raise NotAdmitted
    try:
        there = run_scene(mechanism, way)
    except AtwoodError as error:
        raise Discarded(f"refused: {stem(error)}") from error
    if there.status != "finished":
        raise Discarded(there.status)
    if any(np.max(np.abs(there.array(path))) > 3.0 for path in there.paths if path.endswith((".angle", ".angle_a"))):
        raise NotAdmitted
    end = started_as(mechanism, there, -1)
    bodies = tuple(replace(body, velocity=-body.velocity, spin=-body.spin) for body in end.bodies)
    ties = tuple(
        replace(tie, values={name: _backwards(value) for name, value in tie.values.items()}) for tie in end.ties
    )
    try:
        back = run_scene(replace(end, bodies=bodies, ties=ties), way)
    except AtwoodError as error:
        return Trial(words, (Finding("refused", f"reversed: {stem(error)}", f"{way}: {error}\n{outline(mechanism)}"),))
    gaps = []
    for body in mechanism.bodies:
        for axis in moving_axes(mechanism):
            path = f"{body.name}.position.{axis}"
            gaps.append(_apart(there.array(path)[:1], back.array(path)[-1:], 1.0))
    if back.status == "finished" and max(gaps) > ALLOWED:
        detail = f"{way}: {max(gaps):.1e}\n{outline(mechanism)}"
        return Trial(words, (Finding("wrong", "reversed: position", detail),))
    return Trial((*words, f"compared {back.status}"))


FROM_OUTSIDE = ("force", "torque", "drag", "sampled", "own_swirl", "own_leak", "own_flywheel")
"""Parts that may push against the world, or hold momentum that is in no body."""


def _floating(mechanism: Mechanism, way: Way, words: tuple[str, ...]) -> Trial:
    """Let go of the world: momentum, angular momentum and the balance of energy stay."""
    inner = {
        tie.name
        for tie in mechanism.ties
        if all(mount.body for mount in tie.mounts)
        and tie.sort not in FROM_OUTSIDE
        and not (tie.sort == "rod" and tie.values.get("mass"))
    }
    ties = [tie for tie in mechanism.ties if tie.name in inner and {joint for joint, _ in tie.grips} <= inner]
    if not ties or mechanism.space == "line":
        raise NotAdmitted
    afloat = settled(replace(mechanism, gravity=0.0, ties=tuple(ties)))
    try:
        result = run_scene(afloat, way)
    except AtwoodError as error:
        raise Discarded(f"refused: {stem(error)}") from error
    if result.status != "finished":
        raise Discarded(result.status)
    start, end = (_momentum(started_as(afloat, result, at)) for at in (0, -1))
    ledger = result.energy  # whose drift is relative to what is exchanged, which may be nothing here
    off = float(np.max(np.abs(ledger.total - ledger.work - ledger.total[0])))
    gap, drift = _apart(start, end, 1.0), off / (1.0 + float(np.max(ledger.kinetic)))
    findings = [
        Finding("wrong", f"floating: {what}", f"{way}: {value:.1e}\n{outline(afloat)}")
        for what, value, allowed in (("momentum", gap, ALLOWED), ("energy", drift, ALLOWED))
        if not value <= allowed
    ]
    return Trial((*words, "compared finished"), tuple(findings))


def _momentum(mechanism: Mechanism) -> Array:
    """Return momentum and angular momentum about the origin of all bodies, as far as the space has them."""
    momentum, angular = np.zeros(3), np.zeros(3)
    for body in mechanism.bodies:
        arm = body.rotation @ body.center
        own = body.mass * (body.velocity + np.cross(body.spin, arm))
        momentum += own
        angular += np.cross(body.position + arm, own)
        if body.inertia is not None:
            angular += body.rotation @ body.inertia @ body.rotation.T @ body.spin
    if mechanism.space == "plane":  # bodies may be off it, and held in it
        return np.array([momentum[0], momentum[2], angular[1]])
    return np.concatenate([momentum, angular])


def _backwards(value: object) -> object:
    """Return a function of time run backwards from the end."""
    if not isinstance(value, Signal):
        return value
    phase = value.frequency * T_END + value.phase
    return Signal(value.offset + value.slope * T_END, -value.slope, value.amplitude, -value.frequency, phase)


def _apart(one: Array, other: Array, size: float) -> float:
    return float(np.max(np.abs(one - other), initial=0.0)) / (size + float(np.max(np.abs(other), initial=0.0)))
