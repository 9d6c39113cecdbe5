"""Chains of masses with springs and dampers in a line, pushed at their end, and their exact motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.linalg import expm

from atwood import Scene, sin
from atwood_library import Damper, Force, Ground, PointMass, Spring


def pushed_chain(stiffness: Sequence[float], damping: Sequence[float], push: tuple[float, float], at: float) -> Scene:
    """Return masses of 1 kg, each tied to the one before by k and c, all moved from balance by a length.

    The last is pushed by a sine: its size, N, and its rate, rad/s.
    """
    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0))
    before: Any = scene.add("ground", Ground()).frame
    for i, (k, c) in enumerate(zip(stiffness, damping, strict=True)):
        mass = scene.add(f"m{i}", PointMass(mass=1.0))
        for name, tie in ((f"s{i}", Spring(stiffness=k, natural_length=1.0)), (f"d{i}", Damper(damping=c))):
            scene.add(name, tie)
            scene.connect(before, tie.a)
            scene.connect(tie.b, mass.point)
        scene.start.update({f"m{i}.position.x": i + 1.0 + at, f"m{i}.velocity.x": 0.0})
        before = mass.point
    size, rate = push
    force = scene.add("push", Force(value=lambda t: size * sin(rate * t)))
    scene.connect(force.point, before)
    return scene


def exact_chain(
    stiffness: Sequence[float], damping: Sequence[float], push: tuple[float, float], at: float, t: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements from balance by the exponential of the matrix with the push as two states.

    Also the eigenvalues of the motion without the push.
    """
    n = len(stiffness)
    matrix = np.zeros((2 * n + 2, 2 * n + 2))
    matrix[:n, n : 2 * n] = np.eye(n)
    for first, values in ((0, stiffness), (n, damping)):
        for i, value in enumerate(values):
            ends = [i] if i == 0 else [i - 1, i]
            for a in ends:
                for b in ends:
                    matrix[n + a, first + b] -= value * (1.0 if a == b else -1.0)
    size, rate = push
    matrix[2 * n - 1, 2 * n] = size
    matrix[2 * n, 2 * n + 1], matrix[2 * n + 1, 2 * n] = rate, -rate
    start = np.zeros(2 * n + 2)
    start[:n], start[-1] = at, 1.0
    return (expm(matrix * t) @ start)[:n], np.linalg.eigvals(matrix[: 2 * n, : 2 * n])
