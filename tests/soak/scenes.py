"""Trials of scenes: Atwood in both forms against the oracle, and what both say of freedom and redundancy."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from atwood import AtwoodError, Result, SolveError, simulate

from .build import build_scene, moving_axes
from .description import Array, Body, Mechanism, Tie, outline, rotation
from .draw import draw
from .oracle import Oracle, Place
from .oracle_own import ALL_ROWS
from .oracle_parts import GEARS
from .trial import Discarded, Finding, Trial

T_END = 0.3
TOLERANCE = 1e-9
"""Relative tolerance of Atwood's runs."""

ALLOWED = 2e-6
"""Difference from the oracle, relative to the size of what is compared; of reactions ten times that."""


@dataclass(frozen=True)
class Way:
    """How a scene is run."""

    form: str
    level: str = "ggl"
    solver: str = "auto"
    orientation: str = "quaternion"
    start: str = "speeds"

    def words(self) -> tuple[str, ...]:
        """Return what is counted of it."""
        form = f"dae {self.level}" if self.form == "dae" else f"reduced {self.orientation}"
        return f"form: {form}", f"solver: {self.form} {self.solver}", f"start: {self.start}"


def ways(seed: int, space: str) -> tuple[Way, Way]:
    """Return how the scene of a seed is run in each form: mostly without compiling, which takes longest."""
    random = np.random.default_rng([seed, 1])
    start = str(random.choice(["speeds", "all"], p=[0.75, 0.25]))
    solver = "auto" if random.random() < 0.2 else "ida-sundae"
    level = str(random.choice(["ggl", "index1-projected", "index1"], p=[0.8, 0.1, 0.1]))
    orientation = "quaternion"
    if space == "space" and random.random() < 0.2:
        orientation = str(random.choice(["euler-xyz", "euler-zyx", "euler-zxz"]))
    return Way("reduced", "ggl", solver, orientation, start), Way("dae", level, solver, "quaternion", start)


def check(seed: int) -> Trial:
    """Compare the scene of a seed with the oracle."""
    mechanism = draw(seed)
    return check_mechanism(mechanism, ways(seed, mechanism.space))


def check_mechanism(mechanism: Mechanism, some_ways: tuple[Way, ...]) -> Trial:
    """Compare a mechanism, run in some ways, with the oracle."""
    findings: list[Finding] = []
    tried = [*covered(mechanism), *dict.fromkeys(word for way in some_ways for word in way.words())]
    known: tuple[Oracle, list[tuple[Place, Array]]] | None = None
    times = np.zeros(0)
    for way in some_ways:
        words = f"{way.form} {way.level if way.form == 'dae' else way.orientation} {way.solver} start={way.start}"
        try:
            result = run_scene(mechanism, way)
        except AtwoodError as error:
            if isinstance(error, SolveError) and _has_no_way_on(mechanism):
                tried.append("comes to where the oracle has no way on")
            else:
                findings.append(Finding("refused", stem(error), f"{words}: {error}\n{outline(mechanism)}"))
            continue
        if result.status != "finished":
            tried.append(f"{result.status}: {stem(result.message)}")
            continue
        read_at_once(result, mechanism)
        started = oracle_of(mechanism, result)
        missed = started.missed()
        if not missed < 1e-7:
            findings.append(Finding("wrong", "the start misses constraints", f"{words}: {missed}"))
            continue
        if not started.is_clear:
            tried.append("nearly singular where it starts")
            continue
        if known is None or not _start_alike(known[0], started) or not np.array_equal(times, result.time):
            times = result.time
            try:
                known = started, started.run(result.time, 1e-10)
            except Discarded as reason:
                return Trial((*tried, f"discarded: {reason}"), tuple(findings))
        tried.append(f"compared {way.form}")
        loose = 300.0 if way.level == "index1" else 1.0
        wrong = [(what, gap) for what, gap in _differences(result, *known) if not gap <= ALLOWED * loose]
        if wrong and _is_error_of_steps(mechanism, way, known, dict(wrong)):
            tried.append("sensitive")
        elif wrong:
            numbers = ", ".join(f"{what} {gap:.1e}" for what, gap in wrong)
            findings.append(Finding("wrong", f"{way.form}: {wrong[0][0]}", f"{words}: {numbers}\n{outline(mechanism)}"))
    return Trial(tuple(tried), tuple(findings))


def covered(mechanism: Mechanism) -> list[str]:
    """Return what is counted of a mechanism: its space, how many bodies and loops it has, and its parts."""
    parts = {tie.sort for tie in mechanism.ties}
    holding = {tie.sort for tie in mechanism.ties if tie.sort in (*ALL_ROWS, *GEARS)}
    return [
        f"space: {mechanism.space}",
        f"bodies: {len(mechanism.bodies)}",
        f"loops: {mechanism.loops(holding)}",
        *(f"{'joint' if sort in holding else 'load'}: {sort}" for sort in sorted(parts)),
    ]


def read_at_once(result: Result, mechanism: Mechanism) -> None:
    """Work out all that is compared in one pass: a program for each quantity would take longer than the run."""
    names = {body.name for body in mechanism.bodies} | {tie.name for tie in mechanism.ties}
    ends = ("position", "velocity", "angular_velocity", "x_axis", "y_axis", "z_axis", "angle", "angular_speed")
    parts = (path.split(".") for path in result.paths)
    result.table([".".join(part) for part in parts if part[0] in names and part[1] in ends])


def _has_no_way_on(mechanism: Mechanism) -> bool:
    """Return whether the motion comes to a singular position, or to where two points meet that attract each other."""
    return Oracle(mechanism).is_singular_on_the_way(np.linspace(0.0, T_END, 31))


def _is_error_of_steps(
    mechanism: Mechanism, way: Way, known: tuple[Oracle, list[tuple[Place, Array]]], wrong: Mapping[str, float]
) -> bool:
    """Return whether what differs falls with the tolerance, as where a motion is sensitive to its errors."""
    if not max(wrong.values()) < 100.0 * ALLOWED:
        return False
    try:
        finer = dict(_differences(run_scene(mechanism, way, rtol=TOLERANCE / 100.0), *known))
    except AtwoodError:
        return False
    return all(finer[what] < 0.2 * gap for what, gap in wrong.items())


def _differences(result: Result, oracle: Oracle, states: list[tuple[Place, Array]]) -> list[tuple[str, float]]:
    """Return what was compared and by how much it differs, the worst for each quantity."""
    worst: dict[str, float] = {}
    every = *_freedom(result, oracle), *_motion(result, oracle, states), *_reactions(result, oracle, states)
    for what, gap in every:
        worst[what] = gap if np.isnan(gap) else max(gap, worst.get(what, 0.0))
    return list(worst.items())


def _start_alike(one: Oracle, other: Oracle) -> bool:
    (place, speeds), (own, own_speeds) = one.start(), other.start()
    gaps = np.abs(place.centers - own.centers), np.abs(place.rotations - own.rotations), np.abs(speeds - own_speeds)
    return max(float(np.max(gap, initial=0.0)) for gap in gaps) < 1e-8


def oracle_of(mechanism: Mechanism, result: Result) -> Oracle:
    """Return the oracle that starts as a run did; angles of joints have their turns from there, if they count turns."""
    oracle = Oracle(started_as(mechanism, result))
    if mechanism.space == "space":
        for tie in mechanism.ties:
            if tie.sort in ("pivot", "cylindrical", "screw") and f"{tie.name}.angle" in result:
                oracle.count_from(tie.name, "angle", float(result.array(f"{tie.name}.angle")[0]))
    if mechanism.space == "plane":
        for tie in mechanism.ties:
            if f"{tie.name}.angle" in result:
                angle = float(result.array(f"{tie.name}.angle")[0])
                oracle.count_from(tie.name, "angle", angle)
                oracle.count_from(tie.name, "twist", -angle if tie.sort == "bushing" else angle)
    return oracle


def started_as(mechanism: Mechanism, result: Result, at: int = 0) -> Mechanism:
    """Return the mechanism as a run of it started, or as it was at another of its times."""
    bodies, axes = [], moving_axes(mechanism)
    for body in mechanism.bodies:

        def read(name: str, of: str = axes, body: Body = body) -> Array:
            return np.array([result.array(f"{body.name}.{name}.{a}")[at] if a in of else 0.0 for a in "xyz"])

        turned, spin, center = body.rotation, body.spin * 0.0, read("position")
        if mechanism.space != "space":  # what lies across is where it was
            center = np.where([a in axes for a in "xyz"], center, body.position + body.rotation @ body.center)
        if not body.is_point and mechanism.space == "space":
            turned = np.array([read(name) for name in ("x_axis", "y_axis", "z_axis")]).T
            spin = read("angular_velocity")
        elif not body.is_point and mechanism.space == "plane":
            turned = rotation(np.array([0.0, -1.0, 0.0]), float(result.array(f"{body.name}.angle")[at]))
            spin = np.array([0.0, -float(result.array(f"{body.name}.angular_speed")[at]), 0.0])
        arm = turned @ body.center
        velocity = read("velocity") - np.cross(spin, arm)
        bodies.append(replace(body, position=center - arm, rotation=turned, spin=spin, velocity=velocity))
    return replace(mechanism, bodies=tuple(bodies))


def run_scene(mechanism: Mechanism, way: Way, t_end: float = T_END, rtol: float = TOLERANCE) -> Result:
    """Build a mechanism and run it."""
    scene = build_scene(mechanism, "guess" if way.start == "speeds" else "all")
    if way.start == "speeds":
        scene.start.update(independent_speeds(mechanism))
    return simulate(
        scene,
        form=way.form,
        level=way.level,
        orientation=way.orientation,
        solver=way.solver,
        t_end=t_end,
        outputs=4,
        rtol=rtol,
        max_seconds=30.0,
    )


def independent_speeds(mechanism: Mechanism) -> dict[str, float]:
    """Return as many start speeds as there are degrees of freedom, from which the others follow well."""
    oracle = Oracle(mechanism)
    place, speeds = oracle.start()
    _, rows, _ = oracle.constraints(place, 0.0)
    free = np.linalg.svd(rows.real)[2][oracle.rank :] if len(rows) else np.eye(oracle.size)
    paths = speed_paths(oracle)
    found: dict[str, float] = {}
    for _ in range(len(free)):  # QR with pivoting: the speed that is freest, given those taken
        k = int(np.argmax(np.linalg.norm(free, axis=0)))
        path, factor = paths[k]
        found[path] = factor * float(speeds[k])
        direction = free[:, k] / np.linalg.norm(free[:, k])
        free = free - np.outer(direction, direction @ free)
    return found


def speed_paths(oracle: Oracle) -> list[tuple[str, float]]:
    """Return the path of each of the oracle's speeds, and the factor between both."""
    space, axes = oracle.mechanism.space, moving_axes(oracle.mechanism)
    found: list[tuple[str, float]] = []
    for body in oracle.mechanism.bodies:
        found += [(f"{body.name}.velocity.{axis}", 1.0) for axis in axes]
        if not body.is_point and space == "space":
            found += [(f"{body.name}.angular_velocity.{axis}", 1.0) for axis in axes]
        elif not body.is_point and space == "plane":
            found.append((f"{body.name}.angular_speed", -1.0))
    return found


def _freedom(result: Result, oracle: Oracle) -> Iterator[tuple[str, float]]:
    plan = result.run.segments[0].plan
    equations = plan.assembly.own_equations
    rank, rows = plan.finding.rank, len(equations.constraints)
    yield "degrees of freedom", abs(len(equations.speeds) - rank - (oracle.size - oracle.rank))
    if result.form == "dae":
        more, idle = rows - rank - (len(oracle.owners()) - oracle.rank), _idle(oracle)
        yield "redundant constraints", max(more, -idle - more, 0)


def _idle(oracle: Oracle) -> int:
    """Return the number of constraints between parts of one rigid body, which Atwood may leave out."""
    mechanism = oracle.mechanism
    idle = {
        tie.name
        for tie in mechanism.ties
        if tie.sort != "weld" and tie.mounts
        if {mount.body for mount in tie.mounts} <= mechanism.rigidly_joined(tie.mounts[0].body)
    }
    return sum(owner in idle for owner, _ in oracle.owners())


def _motion(result: Result, oracle: Oracle, states: list[tuple[Place, Array]]) -> Iterator[tuple[str, float]]:
    bodies = oracle.mechanism.bodies
    wanted = np.array([state[1] for state in states]).T
    got = np.array([factor * result.array(path) for path, factor in speed_paths(oracle)])
    yield "speeds", _apart(got, wanted)
    axes = moving_axes(oracle.mechanism)
    kept = ["xyz".index(axis) for axis in axes]
    for i, body in enumerate(bodies):
        places = np.array([place.centers[i] for place, _ in states]).T
        got = np.array([result.array(f"{body.name}.position.{axis}") for axis in axes])
        yield "position", _apart(got, places[kept])
        if oracle.mechanism.space == "space" and not body.is_point:
            turned = np.array([place.rotations[i][:, 0] for place, _ in states]).T
            yield "orientation", _apart(np.array([result.array(f"{body.name}.x_axis.{a}") for a in "xyz"]), turned)
    energies = np.array([oracle.energy(*state, float(t)) for state, t in zip(states, result.time, strict=True)])
    ledger = result.energy
    yield "kinetic energy", _apart(ledger.kinetic, energies[:, 0])
    yield "potential energy", _apart(ledger.potential - ledger.potential[0], energies[:, 1] - energies[0, 1])


def _reactions(result: Result, oracle: Oracle, states: list[tuple[Place, Array]]) -> Iterator[tuple[str, float]]:
    """Compare the reactions that are unique at the start and at the end."""
    wanted: list[tuple[int, str, str, float, float]] = []
    for at in (0, -1):
        known = oracle.reactions(*states[at], float(result.time[at]))
        size = max((float(np.max(np.abs(load))) for _, load, _ in known.values()), default=1.0)
        for name, (multipliers, load, is_unique) in known.items():
            tie = oracle.mechanism.tie(name)
            for path, value, unique in named_reactions(tie, multipliers, load, is_unique, oracle.mechanism.space):
                if unique and np.isfinite(value):
                    wanted.append((at, f"{name}.{path}", f"{tie.sort}.{path}", value, size))
    table = result.table(list(dict.fromkeys(path for _, path, _, _, _ in wanted))) if wanted else {}
    for at, path, what, value, size in wanted:
        got = float(table[path][at])
        yield what, abs(got - value) / (1.0 + size) / 10.0 if np.isfinite(got) else np.inf


def named_reactions(
    tie: Tie, multipliers: Array, load: Array, is_unique: Array, space: str
) -> Iterator[tuple[str, float, bool]]:
    """Yield the library's reactions of a joint: the path, the value, and whether it is unique."""
    unique_force, unique_torque, unique = bool(np.all(is_unique[:3])), bool(np.all(is_unique[3:6])), is_unique[6:]
    names = {"slider": ("guide_force", "guide_torque"), "cylindrical": ("", ""), "rotary_drive": ("force", ""),
             "weld": ("force", "torque"), "pivot": ("force", "torque")}.get(tie.sort)  # fmt: skip
    if tie.sort in ("spherical", "universal", "constant_velocity", "drive", "rolling_disc", "rolling_sphere"):
        names = ("force", "")
    axes = {"space": "xyz", "plane": "xz"}.get(space, "x")  # a line along x, or not compared
    if names and names[0] and (space == "space" or tie.sort != "slider"):
        for k, axis in enumerate("xyz"):
            if axis in axes:
                yield f"{names[0]}.{axis}", float(load[k]), unique_force
            if names[1] and space == "space":
                yield f"{names[1]}.{axis}", float(load[3 + k]), unique_torque
    if tie.sort in ("rod", "rope"):
        yield "tension", -float(multipliers[0]), bool(unique[0])
    scalars: Mapping[str, Mapping[str, tuple[int, float]]] = {
        "universal": {"cross_torque": (3, -1.0)},
        "constant_velocity": {"shaft_torque": (3, 1.0)},
        "planar": {"normal_force": (0, 1.0)},
        "point_on_plane": {"normal_force": (0, 1.0)},
        "point_on_circle": {"axial_force": (0, 1.0), "radial_force": (1, 1.0)},
        "own_surface": {"normal": (0, 1.0)},
        "own_wire": {"normal": (0, 1.0), "across": (1, 1.0)},
        "point_on_line": {"side_force_1": (0, 1.0), "side_force_2": (1, 1.0)},
        "cylindrical": {"guide_1": (0, 1.0), "guide_2": (1, 1.0)},
    }
    if space == "space":
        for path, (k, factor) in scalars.get(tie.sort, {}).items():
            yield path, factor * float(multipliers[k]), bool(unique[k])
        if tie.sort == "rotary_drive":
            yield "motor_torque", float(multipliers[-1]), bool(unique[-1])
    elif space == "plane" and tie.sort in ("slider", "weld", "drive", "rotary_drive"):
        name = "torque"
        yield name, -float(load[4]), unique_torque


def _apart(one: Array, other: Array) -> float:
    return float(np.max(np.abs(one - other), initial=0.0)) / (1.0 + float(np.max(np.abs(other), initial=0.0)))


def stem(error: Any) -> str:
    """Return what an error says, without names and numbers, so that errors of one kind are alike."""
    text = str(error).split("\n")[0]
    if isinstance(error, AtwoodError):
        text = f"{type(error).__name__}: {error.message}"
    text = re.sub(r"\b[\w.]*\d[\w.\[\]]*( = -?[\d.e+-]+)?(, |\b)", "#", text)
    return re.sub(r"(#\W*)+", "# ", text)[:160]
