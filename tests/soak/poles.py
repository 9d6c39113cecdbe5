"""Angles at and near their poles: a ball that turns evenly, so that its orientation is known, read in any sequence."""

from __future__ import annotations

import math
from itertools import permutations
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import atwood_library as lib
from atwood import Scene, simulate

from .trial import Finding, Trial

SEQUENCES = [a + b + c for a, b in permutations("xyz", 2) for c in "xyz" if c != b]
NEAR = (0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-9, 1e-7, 1e-6, 1e-3, 0.5)


def check(seed: int) -> Trial:
    """Turn a ball about an axis of its angles, or about any, from a place at a pole or near it; then start it again."""
    chance = np.random.default_rng(seed)
    sequence, near = str(chance.choice(SEQUENCES)), float(chance.choice(NEAR))
    form = str(chance.choice(["reduced", "dae"]))
    again, side = sequence[0] == sequence[2], int(chance.integers(2))
    pole = math.pi * side if again else math.pi * (side - 0.5)
    angles = [float(chance.uniform(-3.0, 3.0)), pole - near if side else pole + near, float(chance.uniform(-3.0, 3.0))]
    mount = Rotation.random(random_state=int(chance.integers(2**31)))
    first = turn(mount, sequence, angles)
    way = str(chance.choice(["about the first axis", "through the pole", "anyhow", "at rest"]))
    spin = {
        "about the first axis": mount.apply(np.eye(3)["xyz".index(sequence[0])]) * 5.0,
        "through the pole": mount.apply(
            Rotation.from_euler(sequence[0], angles[0]).apply(np.eye(3)["xyz".index(sequence[1])])
        ),
        "anyhow": chance.normal(size=3) * 3.0,
        "at rest": np.zeros(3),
    }[way]
    scene = sensed(mount, sequence)
    scene.start.update({f"sensor.angle_{n}": angle for n, angle in enumerate(angles, start=1)})
    scene.start.update({f"ball.angular_velocity.{name}": float(spin[n]) for n, name in enumerate("xyz")})
    result = simulate(scene, form=form, t_end=2.0, outputs=int(chance.choice([2, 5, 41])), rtol=1e-11)
    findings = []
    told = np.array([result[f"sensor.angle_{n}"] for n in (1, 2, 3)])
    for k, t in enumerate(result.time):
        expected = Rotation.from_rotvec(spin * t) * first
        off = (turn(mount, sequence, told[:, k]).inv() * expected).magnitude()
        if not off < 1e-8:
            findings.append(Finding("wrong", f"{form}: the angles are of another orientation", f"{t}: {off}"))
            break
    if np.abs(told[:, 0] - angles).max() > (1e-3 if near < 1e-9 else 1e-6):
        findings.append(
            Finding("wrong", f"{form}: the angles at the start are not those said", f"{told[:, 0]}, {angles}")
        )
    if way in ("about the first axis", "at rest"):
        rates = np.array([result[f"sensor.rate_{n}"] for n in (1, 2, 3)])
        if near < 1e-12 and not np.all(np.isfinite(rates)):
            findings.append(Finding("wrong", f"{form}: an axis that stays at a pole has no rates", f"{rates}"))
    findings += restarted(scene, form, result, sequence, mount)
    return Trial((f"sequence {sequence}", f"near {near:g}", way, f"form {form}"), tuple(findings))


def turn(mount: Rotation, sequence: str, angles: Any) -> Rotation:
    """Return the orientation that angles stand for, from a frame that is turned itself."""
    return mount * Rotation.from_euler(sequence.upper(), np.asarray(angles))


def sensed(mount: Rotation, sequence: str) -> Scene:
    """Return a free ball, looked at from a frame that is turned."""
    scene, vector = Scene(space="space", gravity=0.0), mount.as_rotvec()
    angle = float(np.linalg.norm(vector))
    ground, ball = scene.add("ground", lib.Ground()), scene.add("ball", lib.RigidBody(moments=(1.0, 1.0, 1.0)))
    frame = scene.add("frame", lib.Weld(angle=angle, axis=tuple(map(float, vector / angle))))
    sensor = scene.add("sensor", lib.OrientationSensor(convention=sequence))
    for one, other in ((ground.frame, frame.a), (frame.b, sensor.a), (ball.frame, sensor.b)):
        scene.connect(one, other)
    return scene


def restarted(scene: Scene, form: str, result: Any, sequence: str, mount: Rotation) -> list[Finding]:
    """Start from the last angles and see whether the ball is where it was."""
    for n in (1, 2, 3):
        scene.start[f"sensor.angle_{n}"] = float(result[f"sensor.angle_{n}"][-1])
    found = simulate(scene, form=form, t_end=1e-6, outputs=2)
    off = [abs(found[path][0] - result[path][-1]) for path in (f"ball.{a}_axis.{b}" for a in "xyz" for b in "xyz")]
    return [] if max(off) < 1e-8 else [Finding("wrong", f"{form}: a restart begins elsewhere", f"{max(off)}")]
