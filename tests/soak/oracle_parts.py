"""What the oracle knows of each part: its constraints, the coordinates of its joint, its energy and its friction.

Written from textbooks, by hand, and apart from the library: velocities of frames are matrices on the speeds of all
bodies, so that a constraint's row is what its rate would be; forces of energies are derivatives by complex steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from .description import Array, Signal, Tie, cross_matrix, normals


@dataclass(frozen=True)
class FrameState:
    """A frame: position, axes as columns, and the matrices of its velocity and its angular velocity."""

    p: Array
    axes: Array
    v: Array
    w: Array


Row = tuple[Any, Array, Any]
"""A constraint: its value, its row on the speeds, and its partial derivative by time."""


def along(a: FrameState, b: FrameState, n: Array) -> tuple[Any, Array]:
    """Return the distance of b along a direction of frame a, and the row of its rate."""
    n, d = a.axes @ n, b.p - a.p
    return n @ d, n @ (b.v - a.v) + np.cross(n, d) @ a.w


def between(a: FrameState, b: FrameState, u: Array, v: Array) -> tuple[Any, Array]:
    """Return the product of a direction of a and one of b, and the row of its rate."""
    u, v = a.axes @ u, b.axes @ v
    return u @ v, np.cross(u, v) @ (a.w - b.w)


def about(a: FrameState, b: FrameState, axis: Array) -> tuple[Any, Array]:
    """Return the angle of b from a about an axis that both share, within a turn, and the row of its rate."""
    n1, n2 = normals(axis)
    turned = b.axes @ n1
    angle = np.arctan2((turned @ (a.axes @ n2)).real, (turned @ (a.axes @ n1)).real)
    return angle, (a.axes @ axis) @ (b.w - a.w)


def distance(a: FrameState, b: FrameState) -> tuple[Any, Array]:
    """Return the distance of two points and the row of its rate."""
    d = b.p - a.p
    size = np.sqrt(d @ d)
    return size, (d / size) @ (b.v - a.v)


def _plain(pair: tuple[Any, Array]) -> Row:
    return pair[0], pair[1], 0.0


def _together(a: FrameState, b: FrameState) -> list[Row]:
    return [(b.p[i] - a.p[i], b.v[i] - a.v[i], 0.0) for i in range(3)]


def _parallel(a: FrameState, b: FrameState, axis: Array) -> list[Row]:
    return [_plain(between(a, b, n, axis)) for n in normals(axis)]


def _sideways(a: FrameState, b: FrameState, axis: Array) -> list[Row]:
    return [_plain(along(a, b, n)) for n in normals(axis)]


def _unturned(a: FrameState, b: FrameState) -> list[Row]:
    x, y, z = np.eye(3)
    return [_plain(between(a, b, z, y)), _plain(between(a, b, x, z)), _plain(between(a, b, y, x))]


def _turned(a: FrameState, b: FrameState, axis: Array, angle: Any, rate: Any) -> Row:
    """Return the constraint that the angle about a shared axis has a given value, whose rate is given."""
    n1, n2 = normals(axis)
    turned = b.axes @ n1
    sine, cosine = turned @ (a.axes @ n2), turned @ (a.axes @ n1)
    return sine * np.cos(angle) - cosine * np.sin(angle), (a.axes @ axis) @ (b.w - a.w), -rate


def _pivot(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    a, b = frames
    return _together(a, b) + _parallel(a, b, tie.values["axis"])


def _slider(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    a, b = frames
    return _sideways(a, b, tie.values["axis"]) + _unturned(a, b)


def _cylindrical(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    a, b = frames
    return _sideways(a, b, tie.values["axis"]) + _parallel(a, b, tie.values["axis"])


def _screw(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    a, b = frames
    axis, lead = tie.values["axis"], tie.values["pitch"] / (2.0 * np.pi)
    shift, shift_row = along(a, b, axis)
    value, turn_row, _ = _turned(a, b, axis, shift / lead, 0.0)
    return [*_cylindrical(tie, frames, t), (lead * value, lead * turn_row - shift_row, 0.0)]


def _spherical(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    return _together(*frames)


def _universal(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    a, b = frames
    return [*_together(a, b), _plain(between(a, b, tie.values["axis_a"], tie.values["axis_b"]))]


def _constant_velocity(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    a, b = frames
    x, y, _ = np.eye(3)
    (one, row_1), (other, row_2) = between(a, b, y, x), between(a, b, x, y)
    return [*_together(a, b), (0.5 * (one - other), 0.5 * (row_1 - row_2), 0.0)]


def _planar(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    a, b = frames
    return [_plain(along(a, b, tie.values["axis"])), *_parallel(a, b, tie.values["axis"])]


def _weld(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    return _together(*frames) + _unturned(*frames)


def _point_on_line(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    return _sideways(*frames, tie.values["axis"])


def _point_on_plane(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    return [_plain(along(*frames, tie.values["axis"]))]


def _point_on_circle(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    size, row = distance(*frames)
    return [_plain(along(*frames, tie.values["axis"])), (size - tie.values["radius"], row, 0.0)]


def _rod(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    size, row = distance(*frames)
    return [(size - tie.values["length"], row, 0.0)]


def _rope(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    pieces = [distance(p, q) for p, q in pairwise(frames)]
    return [(sum(size for size, _ in pieces) - tie.values["length"], sum(row for _, row in pieces), 0.0)]


def _drive(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    a, b = frames
    axis, motion = tie.values["axis"], tie.values["motion"]
    value, row = along(a, b, axis)
    return [*_sideways(a, b, axis), (value - motion.at(t), row, -motion.rate(t)), *_unturned(a, b)]


def _rotary_drive(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    a, b = frames
    axis, motion = tie.values["axis"], tie.values["rotation"]
    return [*_pivot(tie, frames, t), _turned(a, b, axis, motion.at(t), motion.rate(t))]


def _rolling(tie: Tie, frames: list[FrameState], t: Any) -> list[Row]:
    """Return that body and plane do not move against each other at the contact; along the normal that is touching."""
    a, b = frames
    normal, radius = tie.values["normal"], tie.values["radius"]
    n = a.axes @ normal
    height, arm = radius, radius * n
    if tie.sort == "rolling_disc":
        axis = b.axes @ tie.values["axis"]
        lean = n @ axis
        sine = np.sqrt(1.0 - lean * lean)
        height, arm = radius * sine, (n - lean * axis) * (radius / sine)
    slip = b.v + cross_matrix(arm) @ b.w - a.v + cross_matrix(b.p - arm - a.p) @ a.w
    n1, n2 = (a.axes @ direction for direction in normals(normal))
    return [(n @ (b.p - a.p) - height, n @ slip, 0.0), (0.0, n1 @ slip, 0.0), (0.0, n2 @ slip, 0.0)]


ROWS: dict[str, Callable[[Tie, list[FrameState], Any], list[Row]]] = {
    "pivot": _pivot,
    "slider": _slider,
    "cylindrical": _cylindrical,
    "screw": _screw,
    "spherical": _spherical,
    "universal": _universal,
    "constant_velocity": _constant_velocity,
    "planar": _planar,
    "weld": _weld,
    "point_on_line": _point_on_line,
    "point_on_plane": _point_on_plane,
    "point_on_circle": _point_on_circle,
    "rod": _rod,
    "rope": _rope,
    "drive": _drive,
    "rotary_drive": _rotary_drive,
    "rolling_disc": _rolling,
    "rolling_sphere": _rolling,
}
"""Constraints by the sort of the tie."""


def coordinates(tie: Tie, frames: list[FrameState]) -> dict[str, tuple[Any, Array]]:
    """Return the coordinates of a joint and the rows of their rates; angles within a turn."""
    sort, values, found = tie.sort, tie.values, {}
    if sort in ("pivot", "cylindrical", "screw", "planar"):
        found["angle"] = about(*frames, values["axis"])
    if sort in ("slider", "cylindrical", "screw", "point_on_line"):
        found["displacement"] = along(*frames, values["axis"])
    if sort in ("planar", "point_on_plane"):
        first, second = normals(values["axis"])
        found.update(displacement_1=along(*frames, first), displacement_2=along(*frames, second))
    if sort == "point_on_circle":
        (n1, n2), (a, b) = normals(values["axis"]), frames
        (x, row_x), (y, row_y) = along(a, b, n1), along(a, b, n2)
        found["angle"] = np.arctan2(y.real, x.real), (x * row_y - y * row_x) / (x * x + y * y)
    if sort == "universal":
        a, b = frames
        one, two = values["axis_a"], values["axis_b"]
        three = np.cross(one, two)
        second, first = b.axes @ two, a.axes @ one
        angle_a = np.arctan2((second @ (a.axes @ three)).real, (second @ (a.axes @ two)).real)
        angle_b = np.arctan2((first @ (b.axes @ three)).real, (first @ (b.axes @ one)).real)
        found["angle_a"] = angle_a, first @ (b.w - a.w)
        found["angle_b"] = angle_b, second @ (b.w - a.w)
    return found


GEARS = ("gear", "slide_gear", "rack_and_pinion", "planetary_gear")
"""Parts that hold coordinates of joints together."""


def meshing(tie: Tie, held: list[tuple[Any, Array]]) -> Row:
    """Return the constraint of a gear between coordinates."""
    values = tie.values
    if tie.sort == "planetary_gear":
        factors = (1.0, -(1.0 + values["ratio"]), values["ratio"])  # sun, carrier, ring
    else:
        factors = (1.0, -(values["radius"] if tie.sort == "rack_and_pinion" else values["ratio"]))
    value = sum(factor * one for factor, (one, _) in zip(factors, held, strict=True)) - values.get("offset", 0.0)
    return value, sum(factor * row for factor, (_, row) in zip(factors, held, strict=True)), 0.0


LOADED = {
    "pivot": {"angle": ("stiffness", "natural_angle", "damping", "motor")},
    "screw": {"angle": ("stiffness", "natural_angle", "damping", "motor")},
    "point_on_circle": {"angle": ("stiffness", "natural_angle", "damping", "motor")},
    "slider": {"displacement": ("stiffness", "natural_length", "damping", "actuator")},
    "point_on_line": {"displacement": ("stiffness", "natural_length", "damping", "actuator")},
    "cylindrical": {
        "displacement": ("stiffness", "natural_length", "damping", "actuator"),
        "angle": ("torsional_stiffness", "natural_angle", "torsional_damping", "motor"),
    },
    "planar": {
        "displacement_1": ("stiffness", "", "damping", "actuator_1"),
        "displacement_2": ("stiffness", "", "damping", "actuator_2"),
        "angle": ("torsional_stiffness", "natural_angle", "torsional_damping", "motor"),
    },
    "point_on_plane": {
        "displacement_1": ("stiffness", "", "damping", "actuator_1"),
        "displacement_2": ("stiffness", "", "damping", "actuator_2"),
    },
    "universal": {
        "angle_a": ("stiffness_a", "natural_angle_a", "damping_a", "motor_a"),
        "angle_b": ("stiffness_b", "natural_angle_b", "damping_b", "motor_b"),
    },
}
"""Names of the stiffness, the place without force, the damping and the motor that act on each coordinate."""

BALLS = ("spherical", "constant_velocity")
"""Joints with a spring against the whole turn, a damper against every turn, and three motors."""


def spring_energy(
    tie: Tie, p: Array, axes: Array, q: Array, turned: Array, near: float | None = None, along: Array | None = None
) -> Any:
    """Return the potential energy of a part between frame a (p, axes) and frame b (q, turned), or None without one.

    In a plane the angle of a torsion spring or of a bushing counts turns, and is the one nearest to `near`. On a line
    the length of a spring is signed: it is the component of its ends' distance in the direction `along`.
    """
    values, d = tie.values, q - p
    relative = axes.T @ turned
    if tie.sort == "spring":
        length = np.sqrt(d @ d) if along is None else d @ along
        stretch = length - values["natural_length"] if values["natural_length"] else None
        return 0.5 * values["stiffness"] * (d @ d if stretch is None else stretch * stretch)
    if tie.sort in BALLS:
        return values.get("stiffness", 0.0) * (1.5 - 0.5 * np.trace(relative))
    if tie.sort == "torsion_spring":
        twist = _nearest(_twist(relative, values["axis"]), near) - values["natural_angle"]
        return 0.5 * values["stiffness"] * twist * twist
    if tie.sort == "bushing":
        stretch = axes.T @ d - values["free_displacement"]
        y = np.array([0.0, 1.0, 0.0])
        rotated = _rotation_vector(relative) if near is None else y * _nearest(_twist(relative, y), near)
        turn = rotated - values["free_rotation"]
        return 0.5 * (values["stiffness"] @ stretch**2 + values["turning_stiffness"] @ turn**2)
    if tie.sort == "central_gravity":
        return _attraction(values, d, relative=turned)
    return None


def _attraction(values: dict[str, Any], d: Array, relative: Array) -> Any:
    """Return the energy of a body in the field of a point: that of its mass, and MacCullagh's for its extent."""
    mass, center, tensor = values["attracted"]
    if values["attracts"] == "body":
        d = d + relative @ center
    square = d @ d
    energy = -values["gravitational_parameter"] * mass / np.sqrt(square)
    if values["attracts"] == "body":
        e = relative.T @ d
        spread = np.trace(tensor) - 3.0 * (e @ tensor @ e) / square
        energy = energy - 0.5 * values["gravitational_parameter"] * spread / square**1.5
    return energy


def twist_in_plane(tie: Tie, axes: Array, turned: Array) -> float:
    """Return the angle that a torsion spring or a bushing in a plane acts on, within a turn."""
    axis = tie.values["axis"] if tie.sort == "torsion_spring" else np.array([0.0, 1.0, 0.0])
    return float(np.real(_twist(axes.T @ turned, axis)))


def _nearest(angle: Any, near: float | None) -> Any:
    return angle if near is None else angle + 2.0 * np.pi * np.round((near - np.real(angle)) / (2.0 * np.pi))


def _twist(relative: Array, axis: Array) -> Any:
    """Return the twist of a rotation about an axis: twice the angle of the quaternion's part along it."""
    n1, n2 = normals(axis)
    cosine = n1 @ relative @ n1 + n2 @ relative @ n2
    sine = n2 @ relative @ n1 - n1 @ relative @ n2
    guess = np.arctan2(sine.real, cosine.real)
    # The arctangent as a function of complex numbers, near its real value.
    return guess + (sine * np.cos(guess) - cosine * np.sin(guess)) / (cosine * np.cos(guess) + sine * np.sin(guess))


def _rotation_vector(relative: Array) -> Array:
    """Return the rotation vector of a rotation that is well below half a turn; the matrix may be complex."""
    vee = 0.5 * np.array(
        [relative[2, 1] - relative[1, 2], relative[0, 2] - relative[2, 0], relative[1, 0] - relative[0, 1]]
    )
    versine = 0.5 * (3.0 - np.trace(relative))  # 1 - cos x
    half = np.sqrt(0.5 * versine)  # sin x/2
    if abs(half) < 1e-4:
        return vee * (1.0 + versine / 3.0 + 2.0 * versine * versine / 15.0)
    angle = 2.0 * np.arcsin(half)
    return vee * (angle / np.sin(angle))


def friction(tie: Tie, frames: list[FrameState], speeds: Array) -> Array | None:
    """Return the generalized force of a part's dampers, or None without any."""
    values = tie.values
    if tie.sort == "damper":
        _, row = distance(*frames)
        return -values["damping"] * (row @ speeds) * row
    if tie.sort == "drag":
        velocity = frames[0].v @ speeds - values["wind"]
        factor = values["linear"] + values["quadratic"] * np.sqrt(velocity @ velocity)
        return -frames[0].v.T @ (factor * velocity)
    if tie.sort in BALLS and values.get("damping"):
        relative = frames[1].w - frames[0].w
        return -values["damping"] * (relative.T @ (relative @ speeds))
    if tie.sort == "torsion_damper":
        a, b = frames
        one, other = a.axes @ values["axis"], b.axes @ values["axis"]
        row = ((one + other) / (1.0 + one @ other)) @ (b.w - a.w)
        return -values["damping"] * (row @ speeds) * row
    if tie.sort == "bushing":
        a, b = frames
        slide = a.axes.T @ (b.v - a.v + cross_matrix(b.p - a.p) @ a.w)
        turn = a.axes.T @ (b.w - a.w)
        total = slide.T @ (values["damping"] * (slide @ speeds))
        return -total - turn.T @ (values["turning_damping"] * (turn @ speeds))
    return None


def applied(tie: Tie, frames: list[FrameState], t: float) -> Array | None:
    """Return the generalized force of what acts as a function of time, or None if nothing does."""
    values = tie.values
    if tie.sort in BALLS and "motor_x" in values:
        a, b = frames
        motors = np.array([values[f"motor_{axis}"].at(t) for axis in "xyz"])
        return (b.w - a.w).T @ (a.axes @ motors)
    if tie.sort in ("force", "torque"):
        axes = {"world": np.eye(3), "body": frames[0].axes, "other": frames[-1].axes}[values["resolved_in"]]
        signal: Signal = values["value"]
        if tie.sort == "force":
            return frames[0].v.T @ (axes @ values["direction"] * signal.at(t))
        back = frames[-1].w if values["reacts_on"] == "other" else 0.0
        return (frames[0].w - back).T @ (axes @ values["axis"] * signal.at(t))
    return None
