"""Kind `contacts`: bodies that fall on planes, bounce, slide and stick, in a plane or in space, against the laws.

A run is right where every law of contact holds at every moment: no gap is negative, no force pulls, only what touches
bears, friction stays within its cone, acts against what slips and lets what sticks not slip, and energy is only lost.
Both forms give the same motion, and so does the scene turned, moved, scaled, renamed and reordered.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field, replace

import numpy as np

import atwood as aw
from atwood import Scene, simulate
from atwood.errors import AtwoodError, StartError
from atwood_library import (
    BallContact,
    Box,
    BoxContact,
    Disc,
    DistanceContact,
    Force,
    Ground,
    Link,
    PointContact,
    PointMass,
    Sphere,
    Spring,
    VertexContact,
)

from .trial import Discarded, Finding, Trial

G = 9.81
END = 2.0
RTOL = 1e-9
MISSED = 1e-6
"""Share of the largest value by which a law may be missed."""
APART = 1e-5
"""Share of the size of the scene by which two runs may be apart; impacts that follow each other make errors grow."""


@dataclass(frozen=True)
class Body:
    """A body over the floor, in units of the scene's size: its kind, place, velocities and contacts."""

    kind: str
    mass: float
    place: tuple[float, float, float]
    velocity: tuple[float, float, float]
    angle: float
    spin: float
    friction: float
    static: float | None
    restitution: float
    law: str = "newton"


@dataclass(frozen=True)
class Draft:
    """A scene to be made in several ways: turned, moved, scaled, renamed, reordered."""

    space: str
    bodies: tuple[Body, ...]
    tilt: float
    walls: bool
    spring: float
    shortest: float
    turned: float = 0.0
    moved: tuple[float, float] = (0.0, 0.0)
    size: float = 1.0
    weight: float = 1.0
    prefix: str = "b"
    order: tuple[int, ...] = field(default=())


def draw(seed: int) -> Draft:
    """Return the scene of a seed."""
    random = np.random.default_rng(seed)
    space = "space" if random.random() < 0.3 else "plane"
    count = int(random.integers(1, 4 if space == "plane" else 3))
    kinds = ["mass", "disc", "box", "link"] if space == "plane" else ["mass", "mass", "disc", "disc", "box"]
    bodies = []
    for i in range(count):
        x = -1.5 + 1.5 * i + random.uniform(-0.2, 0.2)
        y = random.uniform(-0.5, 0.5) if space == "space" else 0.0
        friction = random.uniform(0.0, 1.0) if random.random() < 0.8 else 0.0
        static = friction * random.uniform(1.0, 1.5) if random.random() < 0.3 else None
        restitution = random.uniform(0.0, 0.8) if random.random() < 0.6 else 0.0
        height = random.uniform(0.9, 1.6) + 0.5 * abs(x)
        speeds = random.uniform(-1.5, 1.5, 3)
        across = float(speeds[1]) if space == "space" else 0.0
        bodies.append(
            Body(
                str(random.choice(kinds)),
                random.uniform(0.5, 2.0),
                (x, y, height),
                (float(speeds[0]), across, float(speeds[2])),
                random.uniform(-1.0, 1.0),
                random.uniform(-3.0, 3.0),
                friction,
                static,
                restitution,
            )
        )
    return Draft(
        space,
        tuple(bodies),
        tilt=random.uniform(-0.4, 0.4) if random.random() < 0.5 else 0.0,
        walls=bool(random.random() < 0.3),
        spring=random.uniform(5.0, 50.0) if count > 1 and random.random() < 0.5 else 0.0,
        shortest=random.uniform(0.8, 1.2) if count > 1 and random.random() < 0.3 else 0.0,
    )


def variant(draft: Draft, seed: int) -> Draft:
    """Return the same scene made otherwise."""
    random, kinds = np.random.default_rng([seed, 1]), {one.kind for one in draft.bodies}
    return replace(
        draft,
        turned=0.0 if draft.space == "space" and "box" in kinds else random.uniform(-3.0, 3.0),
        moved=(random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0)),
        size=10.0 ** random.uniform(-3.0, 3.0),
        weight=10.0 ** random.uniform(-2.0, 2.0),
        prefix="q",
        order=tuple(int(i) for i in random.permutation(len(draft.bodies))),
    )


@dataclass(frozen=True)
class Made:
    """A scene with the paths of its contacts, and for each body the connector whose place is compared."""

    scene: Scene
    gaps: tuple[tuple[str, Body], ...]
    places: tuple[str, ...]


def make(draft: Draft) -> Made:
    """Return the scene of a draft."""
    size, c, s = draft.size, math.cos(draft.turned), math.sin(draft.turned)

    def turn(v: tuple[float, float, float]) -> tuple[float, float, float]:
        return (c * v[0] + s * v[2], v[1], c * v[2] - s * v[0])

    def at(v: tuple[float, float, float]) -> tuple[float, float, float]:
        x, y, z = turn(v)
        return (size * (x + draft.moved[0]), size * y, size * (z + draft.moved[1]))

    scene = Scene(space=draft.space, gravity=0.0 if draft.turned else size * G)
    ground = scene.add("g", Ground(position=at((0.0, 0.0, 0.0))))
    planes = [((-math.sin(draft.tilt), 0.0, math.cos(draft.tilt)), (0.0, 0.0, 0.0))]
    if draft.walls:
        planes += [((1.0, 0.0, 0.0), (-3.0, 0.0, 0.0)), ((-1.0, 0.0, 0.0), (3.0, 0.0, 0.0))]
    carriers = [scene.add(f"w{j}", Ground(position=at(place))) if j else ground for j, (_, place) in enumerate(planes)]
    gaps: list[tuple[str, Body]] = []
    ends, places = {}, {}
    for i in draft.order or range(len(draft.bodies)):
        body, name = draft.bodies[i], f"{draft.prefix}{i}"
        mass = draft.weight * body.mass
        common = {"friction": body.friction, "static_friction": body.static, "restitution": body.restitution}
        if body.kind == "mass":
            part = scene.add(name, PointMass(mass=mass))
            spots, ends[i] = [part.point], part.point
        elif body.kind == "disc":
            kind = Disc if draft.space == "plane" else Sphere
            part = scene.add(name, kind(mass=mass, radius=0.2 * size))
            spots, ends[i] = [part.frame], part.frame
        elif body.kind == "box":
            part = scene.add(name, Box(mass=mass, length_x=0.5 * size, length_y=0.4 * size, length_z=0.3 * size))
            spots, ends[i] = [part.frame], part.frame
        else:
            part = scene.add(name, Link(length=0.6 * size, mass=mass))
            spots, ends[i] = [part.a, part.b], part.a
        for j, (normal, _) in enumerate(planes):
            for k, spot in enumerate(spots):
                path = f"{name}on{j}{k}"
                normal_now = turn(normal)
                if body.kind == "mass":
                    contact = scene.add(path, PointContact(normal=normal_now, **common))
                    scene.connect(spot, contact.point)
                elif body.kind == "disc":
                    contact = scene.add(path, BallContact(normal=normal_now, radius=0.2 * size, **common))
                    scene.connect(spot, contact.ball)
                elif body.kind == "box":
                    contact = scene.add(
                        path,
                        BoxContact(
                            normal=normal_now,
                            length=0.5 * size,
                            width=0.4 * size,
                            height=0.3 * size,
                            corners=4 if draft.space == "plane" else 8,
                            **common,
                        ),
                    )
                    scene.connect(spot, contact.box)
                else:
                    contact = scene.add(path, VertexContact(normal=normal_now, **common))
                    scene.connect(spot, contact.body)
                scene.connect(carriers[j].frame, contact.plane)
                corners = (4 if draft.space == "plane" else 8) if body.kind == "box" else 0
                gaps += [(f"{path}.corner[{n}]", body) for n in range(corners)] or [(path, body)]
        _start(scene, name, body, draft, at(body.place), tuple(size * x for x in turn(body.velocity)))
        places[i] = name
        if draft.turned:
            for k, spot in enumerate(spots):
                weight = scene.add(
                    f"weight{name}{k}", Force(direction=turn((0.0, 0.0, -1.0)), value=mass * G * size / len(spots))
                )
                scene.connect(spot, weight.point)
    if draft.spring:
        tie = scene.add("spring", Spring(stiffness=draft.weight * draft.spring, natural_length=size))
        scene.connect(ends[0], tie.a)
        scene.connect(ends[1], tie.b)
    if draft.shortest:
        tie = scene.add("apart", DistanceContact(lower=draft.shortest * size, restitution=0.5))
        scene.connect(ends[0], tie.a)
        scene.connect(ends[1], tie.b)
    return Made(scene, tuple(gaps), tuple(places[i] for i in range(len(draft.bodies))))


def _start(
    scene: Scene,
    name: str,
    body: Body,
    draft: Draft,
    place: tuple[float, ...],
    velocity: tuple[float, ...],
) -> None:
    axes = "xz" if draft.space == "plane" else "xyz"
    for axis, x, v in zip("xyz", place, velocity, strict=True):
        if axis in axes:
            scene.start[f"{name}.position.{axis}"] = x
            scene.start[f"{name}.velocity.{axis}"] = v
    if body.kind == "mass":
        return
    if draft.space == "plane":
        scene.start[f"{name}.angle"] = body.angle - draft.turned
        spun = "angular_velocity" if body.kind == "link" else "angular_velocity.y"
        scene.start[f"{name}.{spun}"] = body.spin
        return
    for axis, w in zip("xyz", (0.0, body.spin, 0.0), strict=True):
        scene.start[f"{name}.angular_velocity.{axis}"] = w


def laws_missed(made: Made, result: aw.Result, draft: Draft) -> list[Finding]:
    """Return what contradicts a law of contact along a run."""
    found: list[Finding] = []
    force = G * draft.size * draft.weight * sum(one.mass for one in draft.bodies)
    slips = ("slip",) if draft.space == "plane" else ("slip_in_space_1", "slip_in_space_2")
    names = ("friction_force",) if draft.space == "plane" else ("friction_1", "friction_2")
    law = "slip" if draft.space == "plane" else "slip_in_space"
    every = ("gap", "normal_force", "gap_state", *slips, *names, f"{law}_state")
    values = result.table([f"{path}.{name}" for path, _ in made.gaps for name in every])
    for path, body in made.gaps:
        gap, pressed, closed = (values[f"{path}.{name}"] for name in ("gap", "normal_force", "gap_state"))
        most = max(force, float(np.max(pressed)))
        speed = np.hypot.reduce([values[f"{path}.{name}"] for name in slips])
        rubs = np.hypot.reduce([values[f"{path}.{name}"] for name in names])
        fast = max(draft.size, float(np.max(speed)))
        state = values[f"{path}.{law}_state"]
        along = sum(values[f"{path}.{a}"] * values[f"{path}.{b}"] for a, b in zip(slips, names, strict=True))
        static = body.friction if body.static is None else body.static
        for what, miss in (
            ("a gap is negative", -gap / draft.size),
            ("a force pulls", -pressed / most),
            ("what is open bears", np.where(closed == 0.0, np.abs(pressed) / most, 0.0)),
            ("what is closed is open", np.where(closed == 1.0, gap / draft.size, 0.0)),
            (
                "friction is larger than it may be",
                (rubs - max(static, body.friction) * np.maximum(pressed, 0.0)) / most,
            ),
            ("what slips rubs otherwise", np.where(state == 1.0, np.abs(rubs - body.friction * pressed) / most, 0.0)),
            ("friction drives", along / (most * fast)),
            (
                "friction does not act against what slips",
                np.where(state == 1.0, (along + rubs * speed) / (most * fast), 0.0),
            ),
            ("what sticks slips", np.where(state == 2.0, speed / fast, 0.0)),
        ):
            worst = int(np.argmax(miss))
            if miss[worst] > MISSED:
                said = f"{path} at t = {result.time[worst]:.9g} by {miss[worst]:.3g}"
                found.append(Finding("wrong", f"{result.form}: {what}", f"{said}\n{draft}"))
    energy = result.energy.kinetic + result.energy.potential
    size = max(1e-300, float(np.max(np.abs(energy - energy[0]))), force * draft.size)
    rise = 0.0 if draft.turned else float(np.max(np.diff(energy))) / size
    if rise > MISSED:
        found.append(Finding("wrong", f"{result.form}: energy is made", f"{rise:.3g} of {size:.3g} J\n{draft}"))
    if result.energy.max_drift > MISSED:
        said = f"{result.energy.max_drift:.3g}\n{draft}"
        found.append(Finding("wrong", f"{result.form}: the ledger of the energy does not close", said))
    return found


def _run(made: Made, form: str) -> aw.Result:
    return simulate(made.scene, form=form, t_end=END, rtol=RTOL, outputs=201)


def check(seed: int) -> Trial:
    """Make the trial of a seed."""
    draft = draw(seed)
    tried = [draft.space, *(one.kind for one in draft.bodies)]
    findings: list[Finding] = []
    runs: list[tuple[Draft, Made, aw.Result]] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for drawn, form in ((draft, "reduced"), (draft, "dae"), (variant(draft, seed), "reduced")):
            made = make(drawn)
            try:
                result = _run(made, form)
            except StartError as error:
                if "inside" in str(error):
                    raise Discarded("starts inside") from None
                raise
            except AtwoodError as error:
                if "how forces are shared" in str(error):
                    raise Discarded("shares of forces that nothing determines") from None
                findings.append(Finding("refused", f"{form}: {type(error).__name__}", f"{error}\n{drawn}"))
                continue
            if result.status != "finished":
                findings.append(Finding("hang", f"{form}: {result.status}", f"{drawn}"))
                continue
            findings += laws_missed(made, result, drawn)
            runs.append((drawn, made, result))
    tried += [f"event {kind}" for kind in sorted({one.kind for _, _, result in runs for one in result.events})]
    for other in runs[1:]:
        findings += _compared(runs[0], other)
    return Trial((*tried, *(["compared"] if len(runs) == 3 else [])), tuple(findings))


def _compared(first: tuple[Draft, Made, aw.Result], other: tuple[Draft, Made, aw.Result]) -> list[Finding]:
    """Return where two runs of one scene come apart, before anything that amplifies rounding can be at fault."""
    draft, made, result = first
    drawn, again, twin = other
    c, s = math.cos(drawn.turned), math.sin(drawn.turned)
    worst = 0.0
    for a, b in zip(made.places, again.places, strict=True):
        x, z = (result[f"{a}.position.{axis}"][-1] for axis in "xz")
        there = c * x + s * z + drawn.moved[0], c * z - s * x + drawn.moved[1]
        here = [twin[f"{b}.position.{axis}"][-1] / drawn.size for axis in "xz"]
        worst = max(worst, *(abs(p - q) for p, q in zip(there, here, strict=True)))
    if worst <= APART:
        return []
    kind = "both forms" if draft is drawn else "a scene and the same turned, moved and scaled"
    return [Finding("wrong", f"{kind} come apart", f"{worst:.3g}\n{draft}\n{drawn}")]
