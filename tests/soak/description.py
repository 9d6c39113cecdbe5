"""The neutral description of a mechanism, from which both Atwood's scene and the oracle's system are built.

Everything is in space, also for scenes in a plane (x-z) or on a line: plain numbers in SI units, and rotation matrices
whose columns are the axes of a frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

WORLD = ""
"""The body that a mount in the world is on."""


@dataclass(frozen=True)
class Body:
    """A rigid body or a material point, and how it starts.

    Parameters
    ----------
    name
        Unlike all others.
    mass, center, inertia
        Mass, centre of mass in the body's frame, and inertia tensor about it in its axes; None for a material point.
    position, rotation
        Of the body's frame in the world.
    velocity, spin
        Of the body's frame: velocity of its origin, and angular velocity in world axes.
    """

    name: str
    mass: float
    position: Array
    velocity: Array
    center: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array | None = None
    rotation: Array = field(default_factory=lambda: np.eye(3))
    spin: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def is_point(self) -> bool:
        """Whether it has no orientation."""
        return self.inertia is None


@dataclass(frozen=True)
class Mount:
    """A frame that is fixed in a body, or in the world."""

    body: str
    position: Array
    rotation: Array = field(default_factory=lambda: np.eye(3))


@dataclass(frozen=True)
class Signal:
    """A function of time, ``offset + slope t + amplitude sin(frequency t + phase)``.

    From the time `kink` on its second derivative is larger by `jump`, so that its rate has a kink there.
    """

    offset: float = 0.0
    slope: float = 0.0
    amplitude: float = 0.0
    frequency: float = 1.0
    phase: float = 0.0
    kink: float = 0.0
    jump: float = 0.0

    def at(self, t: Any) -> Any:
        """Return the value; `t` may be complex."""
        late = t - self.kink if np.real(t) > self.kink else 0.0
        smooth = self.offset + self.slope * t + self.amplitude * np.sin(self.frequency * t + self.phase)
        return smooth + 0.5 * self.jump * late * late

    def rate(self, t: Any) -> Any:
        """Return the derivative."""
        late = t - self.kink if np.real(t) > self.kink else 0.0
        return self.slope + self.amplitude * self.frequency * np.cos(self.frequency * t + self.phase) + self.jump * late

    def scaled(self, factor: float, second: float) -> Signal:
        """Return what has other values, in another unit of time."""
        return Signal(
            factor * self.offset,
            factor * self.slope / second,
            factor * self.amplitude,
            self.frequency / second,
            self.phase,
            second * self.kink,
            factor * self.jump / second**2,
        )


@dataclass(frozen=True)
class Tie:
    """A joint or a force between mounts.

    Parameters
    ----------
    name
        Unlike all others.
    sort
        The name of the library's part in small letters, such as ``"pivot"``.
    mounts
        Where it is: frame a and frame b, mostly.
    values
        Parameters by the names that the library has; axes are unit vectors, functions of time are `Signal`.
    grips
        Of gears: the coordinates that they hold, as pairs of a joint's name and a coordinate's.
    """

    name: str
    sort: str
    mounts: tuple[Mount, ...] = ()
    values: dict[str, Any] = field(default_factory=dict)
    grips: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Mechanism:
    """Bodies and what ties them together.

    Parameters
    ----------
    space
        ``"line"`` (along x), ``"plane"`` (x-z) or ``"space"``.
    gravity
        Along -z.
    angles
        In a plane, the angle of each body with its turns, where they do not follow from the order of the bodies.
    """

    space: str
    gravity: float
    bodies: tuple[Body, ...]
    ties: tuple[Tie, ...]
    line: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    angles: dict[str, float] | None = None

    def body(self, name: str) -> Body:
        """Return the body of a name."""
        return next(body for body in self.bodies if body.name == name)

    def rigidly_joined(self, name: str) -> set[str]:
        """Return the names of all bodies that are welded to a body, itself included; the world is one of them."""
        found = {name}
        for _ in self.ties:
            for tie in self.ties:
                ends = {mount.body for mount in tie.mounts}
                if tie.sort == "weld" and ends & found:
                    found |= ends
        return found

    def loops(self, sorts: Iterable[str]) -> int:
        """Return how many loops the ties of some sorts make, the world being one body."""
        held = set(sorts)
        pieces = [{""}, *({body.name} for body in self.bodies)]
        count = 0
        for tie in self.ties:
            if tie.sort in held and tie.mounts:
                ends = {mount.body for mount in (tie.mounts[0], tie.mounts[-1])}
                joined = [piece for piece in pieces if piece & ends]
                count += len(joined) == 1
                pieces = [piece for piece in pieces if not piece & ends] + [set().union(*joined)]
            count += tie.sort in held and bool(tie.grips)  # a gear relates coordinates that there are already
        return count

    def turned(self, mount: Mount) -> Array:
        """Return the rotation of a mount in the world."""
        return (self.body(mount.body).rotation if mount.body else np.eye(3)) @ mount.rotation

    def tie(self, name: str) -> Tie:
        """Return the tie of a name."""
        return next(tie for tie in self.ties if tie.name == name)


def outline(mechanism: Mechanism) -> str:
    """Return in a few lines what ties which bodies together; all numbers follow from the seed."""
    lines = [f"{mechanism.space}, gravity {mechanism.gravity:g}, {', '.join(body.name for body in mechanism.bodies)}"]
    for tie in mechanism.ties:
        between = [mount.body or "world" for mount in tie.mounts] or [".".join(grip) for grip in tie.grips]
        more = ", ".join(name for name in tie.values if name not in ("axis", "length"))
        lines.append(f"  {tie.name}: {' - '.join(between)} {more}")
    return "\n".join(lines)


def cross_matrix(v: Array) -> Array:
    """Return the matrix of the cross product with a vector from the left."""
    return np.array([[0.0 * v[0], -v[2], v[1]], [v[2], 0.0 * v[0], -v[0]], [-v[1], v[0], 0.0 * v[0]]])


def rotation(axis: Array, angle: float) -> Array:
    """Return the rotation about a unit vector by an angle (Rodrigues' formula)."""
    k = cross_matrix(axis)
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)


def axis_and_angle(matrix: Array) -> tuple[Array, float]:
    """Return the unit vector and the angle of a rotation, which is at least zero."""
    vee = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    angle = float(np.arctan2(np.linalg.norm(vee), np.trace(matrix) - 1.0))
    if angle < 1e-300:
        return np.array([0.0, 0.0, 1.0]), 0.0
    if angle < 3.0:
        return vee / np.linalg.norm(vee), angle
    symmetric = matrix + matrix.T + (1.0 - np.trace(matrix)) * np.eye(3)  # (3 - tr) n n^T
    n = symmetric[:, int(np.argmax(np.diag(symmetric)))]
    n = n / np.linalg.norm(n)
    return (n if n @ vee >= 0.0 else -n), angle


def normals(axis: Array) -> tuple[Array, Array]:
    """Return the two normals of an axis by the convention that the library's parts document."""
    helper = np.eye(3)[(int(np.argmax(np.abs(axis))) + 1) % 3]
    first = helper - axis * (axis @ helper)
    first = first / np.linalg.norm(first)
    return first, np.cross(axis, first)
