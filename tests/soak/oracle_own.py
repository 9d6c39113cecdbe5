"""What the oracle knows of components with laws of their own, of stops, and of feedback at sample times."""

from __future__ import annotations

from typing import Any

import numpy as np

from .description import Array, Tie
from .oracle_parts import ROWS, FrameState, Row, along

X, Y, Z = np.eye(3)


def _surface(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    (x, row_x), (y, row_y), (z, row_z) = (along(*frames, n) for n in (X, Y, Z))
    bend_1, bend_2 = 1.0 / tie.values["radius_1"], 1.0 / tie.values["radius_2"]
    return [(z - 0.5 * (bend_1 * x * x + bend_2 * y * y), row_z - bend_1 * x * row_x - bend_2 * y * row_y, 0.0)]


def _wire(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    (x, row_x), (y, row_y), (z, row_z) = (along(*frames, n) for n in (X, Y, Z))
    bend = 1.0 / tie.values["radius"]
    return [(z - 0.5 * bend * x * x, row_z - bend * x * row_x, 0.0), (y, row_y, 0.0)]


ALL_ROWS = {**ROWS, "own_surface": _surface, "own_wire": _wire}
"""Constraints by the sort of the tie, with those of a user's components."""

GAPS = ("translational_gap", "rotational_gap")
"""Stops on the coordinate of a joint."""


def own_force(tie: Tie, frames: list[FrameState], speeds: Array, t: float) -> Array | None:
    """Return the generalized force of a component of a user, or None if it is another part."""
    if tie.sort not in ("own_spring", "own_swirl"):
        return None
    a, b = frames
    d, values = b.p - a.p, tie.values
    if tie.sort == "own_spring":
        square = values["natural_length"] ** 2
        push = -values["stiffness"] * values["growth"].at(t) * (d @ d - square) / square * d
    else:
        push = np.cross(values["axis"], values["pulling"] * d + values["twisting"] * ((b.v - a.v) @ speeds))
    return (b.v - a.v).T @ push


def own_energy(tie: Tie, frames: list[FrameState], t: float) -> float:
    """Return the potential energy of a component of a user; zero if it has none."""
    if tie.sort != "own_spring":
        return 0.0
    d, square = frames[1].p - frames[0].p, tie.values["natural_length"] ** 2
    return float(0.25 * tie.values["stiffness"] * tie.values["growth"].at(t) * (d @ d - square) ** 2 / square)


def beyond(tie: Tie, value: float) -> float:
    """Return by how much a coordinate is beyond the ends of a gap: positive above, negative below."""
    return max(value - tie.values["upper"], 0.0) + min(value - tie.values["lower"], 0.0)


def wheel_inertia(tie: Tie, angle: float) -> tuple[float, float]:
    """Return the moment of inertia of a wheel whose inertia changes with its angle, and the derivative."""
    mean, swing = tie.values["mean"], tie.values["swing"]
    return mean + swing * np.cos(2.0 * angle), -2.0 * swing * np.sin(2.0 * angle)
