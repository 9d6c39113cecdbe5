"""Other descriptions of the same mechanism: turned, moved, scaled, mirrored, named and ordered otherwise, split."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .build import plane_angles
from .description import Array, Body, Mechanism, Mount, Signal, Tie, rotation


class NotAdmitted(Exception):
    """A mechanism does not admit a relation."""


@dataclass(frozen=True)
class Related:
    """A mechanism that does the same as another one, and how both compare.

    Parameters
    ----------
    mechanism
        The other mechanism.
    names
        Its name for each body and each tie.
    matrix, shift, stretch
        Places of the first, times the matrix and plus the shift, are those of the other; speeds are divided by
        `stretch`, by which time runs slower.
    force
        By how much forces are larger.
    """

    mechanism: Mechanism
    names: Callable[[str], str] = str
    matrix: Array | None = None
    shift: Array | None = None
    stretch: float = 1.0
    force: float = 1.0


def renamed(mechanism: Mechanism, random: np.random.Generator) -> Related:
    """Return the mechanism with its parts in another order and with other names."""
    order = random.permutation(len(mechanism.bodies) + len(mechanism.ties))
    words = [body.name for body in mechanism.bodies] + [tie.name for tie in mechanism.ties]
    letters = "qzahm"
    new = {word: f"{letters[int(k) % 5]}{int(k)}x" for word, k in zip(words, order, strict=True)} | {"": ""}

    def mount(one: Mount) -> Mount:
        return replace(one, body=new[one.body])

    bodies = [replace(body, name=new[body.name]) for body in mechanism.bodies]
    ties = [
        replace(
            tie,
            name=new[tie.name],
            mounts=tuple(mount(one) for one in tie.mounts),
            grips=tuple((new[joint], name) for joint, name in tie.grips),
        )
        for tie in mechanism.ties
    ]
    shuffled = (
        tuple(bodies[k] for k in random.permutation(len(bodies))),
        tuple(ties[k] for k in random.permutation(len(ties))),
    )
    angles = (
        {new[name]: angle for name, angle in plane_angles(mechanism).items()} if mechanism.space == "plane" else None
    )
    return Related(replace(mechanism, bodies=shuffled[0], ties=shuffled[1], angles=angles), new.__getitem__)


def moved_and_turned(mechanism: Mechanism, random: np.random.Generator) -> Related:
    """Return the mechanism elsewhere and turned: about the vertical, or in any way where there is no weight."""
    if any(tie.sort == "sampled" for tie in mechanism.ties):  # which looks along an axis of the world
        raise NotAdmitted
    angle = float(random.uniform(-np.pi, np.pi))
    up, across = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    shift = 3.0 * random.uniform(-1.0, 1.0, 3)
    if mechanism.space == "space":
        n = random.normal(size=3)
        turn = rotation(n / np.linalg.norm(n) if mechanism.gravity == 0.0 else up, angle)
    elif mechanism.space == "plane":
        turn = rotation(across, angle) if mechanism.gravity == 0.0 else np.eye(3)
        shift[1] = 0.0
    else:
        turn = np.round(rotation(up, 0.5 * np.pi))
        shift = turn @ np.array([shift[0], 0.0, 0.0])
    bodies = tuple(
        replace(
            body,
            position=turn @ body.position + shift,
            velocity=turn @ body.velocity,
            spin=turn @ body.spin,
            rotation=body.rotation if body.is_point else turn @ body.rotation,
        )
        for body in mechanism.bodies
    )
    ties = tuple(_placed(tie, turn, shift) for tie in mechanism.ties)
    if mechanism.space == "line":  # bodies on a line do not turn: what they carry is turned instead
        bodies = tuple(
            replace(new, rotation=old.rotation, center=turn @ old.center)
            for new, old in zip(bodies, mechanism.bodies, strict=True)
        )
        ties = tuple(_turned_on_line(new, old, turn) for new, old in zip(ties, mechanism.ties, strict=True))
    return Related(replace(mechanism, bodies=bodies, ties=ties, line=turn @ mechanism.line), str, turn, shift)


def _turned_on_line(tie: Tie, before: Tie, turn: Array) -> Tie:
    """Return a tie whose mounts keep their axes, with its own direction turned: along another line."""
    mounts = tuple(
        replace(new, rotation=old.rotation, position=turn @ old.position if old.body else new.position)
        for new, old in zip(tie.mounts, before.mounts, strict=True)
    )
    values = {**tie.values, "axis": turn @ tie.values["axis"]} if "axis" in tie.values else tie.values
    return replace(tie, mounts=mounts, values=values)


def _placed(tie: Tie, turn: Array, shift: Array) -> Tie:
    mounts = tuple(
        mount if mount.body else Mount("", turn @ mount.position + shift, turn @ mount.rotation) for mount in tie.mounts
    )
    values = dict(tie.values)
    if tie.sort == "drag":
        values["wind"] = turn @ values["wind"]
    if tie.sort == "own_swirl":
        values["axis"] = turn @ values["axis"]
    if tie.sort in ("force", "torque") and values["resolved_in"] == "world":
        name = "direction" if tie.sort == "force" else "axis"
        values[name] = turn @ values[name]
    return replace(tie, mounts=mounts, values=values)


LINEAR = ("slider", "cylindrical", "planar", "point_on_line", "point_on_plane", "spring", "bushing", "damper",
          "own_spring", "translational_gap", "sampled")  # fmt: skip
"""Parts whose stiffness and damping are of displacements."""


def dimensions(sort: str, name: str) -> tuple[int, int, int]:
    """Return the exponents of mass, length and time of a part's parameter."""
    if name == "offset":
        return (0, 0, 0) if sort in ("gear", "planetary_gear") else (0, 1, 0)
    if name in ("lower", "upper"):
        return (0, 1, 0) if sort == "translational_gap" else (0, 0, 0)
    lengths = ["length", "natural_length", "radius", "radius_1", "radius_2", "pitch", "free_displacement", "motion"]
    known = {
        "mass": (1, 0, 0),
        "linear": (1, 0, -1),
        "mean": (1, 2, 0),
        "swing": (1, 2, 0),
        "twisting": (1, 0, -1),
        "pulling": (1, 0, -2),
        "period": (0, 0, 1),
        "quadratic": (1, -1, 0),
        "wind": (0, 1, -1),
        "gravitational_parameter": (0, 3, -2),
        **dict.fromkeys(lengths, (0, 1, 0)),
    }
    if name in known:
        return known[name]
    turning = sort not in LINEAR or name.startswith(("turning", "torsional"))
    if "stiffness" in name:
        return (1, 2, -2) if turning else (1, 0, -2)
    if "damping" in name:
        return (1, 2, -1) if turning else (1, 0, -1)
    if name.startswith("motor") or (sort == "torque" and name == "value"):
        return 1, 2, -2
    if name.startswith("actuator") or (sort == "force" and name == "value"):
        return 1, 1, -2
    return 0, 0, 0


DECADES = 6.0
"""Decades by which mass, length and time are scaled at most, each by itself."""


def scaled(mechanism: Mechanism, random: np.random.Generator) -> Related:
    """Return the mechanism in other units of mass, length and time."""
    kilogram, metre, second = (float(10.0 ** random.uniform(-DECADES, DECADES)) for _ in range(3))

    def times(value: Any, exponents: tuple[int, int, int]) -> Any:
        m, l, t = exponents
        factor = kilogram**m * metre**l * second**t
        if isinstance(value, Signal):
            return value.scaled(factor, second)
        return value if isinstance(value, str) or exponents == (0, 0, 0) else factor * value

    def part(tie: Tie) -> Tie:
        values = {name: times(value, dimensions(tie.sort, name)) for name, value in tie.values.items()}
        for name, value in tie.values.items():
            if isinstance(value, Signal) and dimensions(tie.sort, name) == (0, 0, 0):
                values[name] = value.scaled(1.0, second)
        mounts = tuple(replace(mount, position=metre * mount.position) for mount in tie.mounts)
        return replace(tie, mounts=mounts, values=values)

    bodies = tuple(
        replace(
            body,
            mass=kilogram * body.mass,
            position=metre * body.position,
            velocity=metre / second * body.velocity,
            center=metre * body.center,
            inertia=None if body.inertia is None else kilogram * metre**2 * body.inertia,
            spin=body.spin / second,
        )
        for body in mechanism.bodies
    )
    gravity, ties = mechanism.gravity * metre / second**2, tuple(part(tie) for tie in mechanism.ties)
    new = replace(mechanism, gravity=gravity, bodies=bodies, ties=ties)
    return Related(new, str, metre * np.eye(3), np.zeros(3), second, kilogram * metre / second**2)


TURNING = (
    "own_swirl",
    "pivot",
    "rotary_drive",
    "universal",
    "torque",
    "torsion_spring",
    "torsion_damper",
    "rolling_disc",
)
"""Parts whose axes are those of a rotation, which a mirror turns round."""

UNMIRRORED = ("screw", "cylindrical", "planar", "point_on_plane", "point_on_circle", "rack_and_pinion", "drag")


def mirrored(mechanism: Mechanism, random: np.random.Generator) -> Related:
    """Return the mechanism in a mirror across y."""
    if mechanism.space != "space" or any(tie.sort in UNMIRRORED for tie in mechanism.ties):
        raise NotAdmitted
    mirror = np.diag([1.0, -1.0, 1.0])

    def part(tie: Tie) -> Tie:
        values = dict(tie.values)
        for name in ("axis", "axis_a", "axis_b", "direction", "normal", "free_displacement", "free_rotation"):
            if name in values:
                turns = name == "free_rotation" or (tie.sort in TURNING and name.startswith("axis"))
                values[name] = (-1.0 if turns else 1.0) * (mirror @ values[name])
        for name in ("motor_x", "motor_z"):
            if name in values:
                signal = values[name]
                values[name] = replace(signal, offset=-signal.offset, amplitude=-signal.amplitude, jump=-signal.jump)
        mounts = tuple(
            replace(mount, position=mirror @ mount.position, rotation=mirror @ mount.rotation @ mirror)
            for mount in tie.mounts
        )
        return replace(tie, mounts=mounts, values=values)

    bodies = tuple(
        replace(
            body,
            position=mirror @ body.position,
            velocity=mirror @ body.velocity,
            center=mirror @ body.center,
            inertia=None if body.inertia is None else mirror @ body.inertia @ mirror,
            rotation=mirror @ body.rotation @ mirror,
            spin=-mirror @ body.spin,
        )
        for body in mechanism.bodies
    )
    ties = tuple(part(tie) for tie in mechanism.ties)
    return Related(replace(mechanism, bodies=bodies, ties=ties), str, mirror, np.zeros(3))


def split(mechanism: Mechanism, random: np.random.Generator) -> Related:
    """Return the mechanism with one of its bodies made of two that are welded together."""
    whole = [body for body in mechanism.bodies if body.inertia is not None]
    if not whole or any(tie.sort == "sampled" for tie in mechanism.ties):  # which looks at the centre of mass
        raise NotAdmitted
    body = whole[random.integers(len(whole))]
    share, arm = float(random.uniform(0.2, 0.8)), 0.05 * random.uniform(-1.0, 1.0, 3)
    if mechanism.space != "space":
        arm = arm * np.array([1.0, 0.0, 0.0 if mechanism.space == "line" else 1.0])
    # Both parts have their centres on a line through that of the whole (Steiner's theorem).
    first, second = body.center + arm, body.center - arm * share / (1.0 - share)
    assert body.inertia is not None
    spread = sum(
        m * (np.eye(3) * (d @ d) - np.outer(d, d))
        for m, d in ((share * body.mass, first - body.center), ((1.0 - share) * body.mass, second - body.center))
    )
    rest = body.inertia - spread
    moments = np.linalg.eigvalsh(rest)
    if moments[0] <= 0.0 or moments[2] > moments[0] + moments[1]:
        raise NotAdmitted
    other: Body = replace(
        body, name=f"{body.name}_other", mass=(1.0 - share) * body.mass, center=second, inertia=0.4 * rest
    )
    own = replace(body, mass=share * body.mass, center=first, inertia=0.6 * rest)
    bodies = [*(own if one is body else one for one in mechanism.bodies), other]
    weld = Tie("seam", "weld", (Mount(body.name, np.zeros(3)), Mount(other.name, np.zeros(3))))
    ties = []
    for tie in mechanism.ties:
        takes = random.random() < 0.5
        mounts = [replace(m, body=other.name) if m.body == body.name and takes else m for m in tie.mounts]
        ties.append(replace(tie, mounts=tuple(mounts)))
    known = plane_angles(mechanism) if mechanism.space == "plane" else None
    angles = None if known is None else {**known, other.name: known[body.name]}
    return Related(replace(mechanism, bodies=tuple(bodies), ties=(*ties, weld), angles=angles))


RELATIONS = {
    "renamed": renamed,
    "moved and turned": moved_and_turned,
    "scaled": scaled,
    "mirrored": mirrored,
    "split": split,
}
