"""Switches of orientation coordinates along a run, in numbers: from any coordinates to any others.

Euler angles are left before they become singular, and go on from another base, with equations of their own. The speeds
are the angular velocity in the axes of the body before and after.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.orientation import FARTHEST_COSINE, orientation_margin, quaternion_product
from atwood.mechanics.outputs.event_functions import EventFunction
from atwood.topology.orientation_coordinates import Orientation, OrientationCoordinates

Reassemble = Callable[[Mapping[str, str], Mapping[tuple[str, str, str], float], Orientation], Assembly]

COORDINATE_SWITCH = "coordinate switch"
"""Target of the event that orientation coordinates are to be switched."""

_NEARLY = 0.95
"""What is so near to where coordinates are switched is switched with another that is there."""

_FARTHEST_STEP = 2.0
"""Angle that a body may turn in a step, rad: together with their margin it is less than a full turn."""


@dataclass(frozen=True)
class CoordinateSwitch:
    """A change of the coordinates of an orientation.

    Attributes
    ----------
    time
        When, s.
    body
        Of which body.
    """

    time: float
    body: str


def switch_functions(equations: Equations) -> tuple[EventFunction, ...]:
    """Return what tells that orientation coordinates are to be switched."""
    found = []
    for body_orientation in equations.orientation_coordinates:
        margin = orientation_margin(body_orientation, [equations.coordinates[i] for i in body_orientation.coordinates])
        if margin is not None:
            says = "its orientation goes on in other coordinates"
            found.append(
                EventFunction(body_orientation.body, "orientation", margin, 1, COORDINATE_SWITCH, says, "1", False)
            )
    return tuple(found)


def to_regular(assembly: Assembly, q: FloatArray) -> FloatArray:
    """Return generalized coordinates with quaternions, from those of the reduced form; one state or many."""
    return _carried(assembly, assembly.reduced, assembly.regular, q)


def from_regular(assembly: Assembly, q: FloatArray) -> FloatArray:
    """Return coordinates of the reduced form from those with quaternions; see `to_regular`."""
    return _carried(assembly, assembly.regular, assembly.reduced, q)


def _carried(assembly: Assembly, before: Equations, after: Equations, q: FloatArray) -> FloatArray:
    if before is after:
        return q
    if (_plain(before), before.speed_names) != (_plain(after), after.speed_names):
        raise UsageError(
            f"with orientations as {assembly.orientation.kind!r} other coordinates or speeds are eliminated",
            where=assembly.flat.name,
            advice="Use quaternions.",
        )
    found = np.full((len(after.coordinates), *q.shape[1:]), np.nan)
    number = {one.name: i for i, one in enumerate(before.names)}
    for i, one in enumerate(after.names):
        if one.name in number:
            found[i] = q[number[one.name]]
    for old, new in zip(before.orientation_coordinates, after.orientation_coordinates, strict=True):
        found[list(new.coordinates)] = _coordinates(new, _quaternion(old, q[list(old.coordinates)]))
    return found


def own_names(assembly: Assembly, names: Sequence[str]) -> tuple[str, ...]:
    """Return names of coordinates with quaternions as those of the reduced form."""
    regular, reduced = assembly.regular, assembly.reduced
    if regular is reduced:
        return tuple(names)
    stands: dict[str, list[str]] = {}
    for old, new in zip(regular.orientation_coordinates, reduced.orientation_coordinates, strict=True):
        own = [reduced.names[i].name for i in new.coordinates]
        stands |= {regular.names[i].name: own for i in old.coordinates}
    return tuple(dict.fromkeys(one for name in names for one in stands.get(name, [name])))


def longest_step(equations: Equations, u: FloatArray) -> float:
    """Return the longest step that an explicit method may take with coordinates that can be switched, s or infinity.

    A uniform turn is a straight line in some of them, and its steps would grow until rounding is amplified; and a
    step that is longer than the margin could pass its singular place unseen.
    """
    if not equations.orientation_coordinates:
        return np.inf
    own = [
        list(body_orientation.speeds)
        for body_orientation in equations.orientation_coordinates
        if not body_orientation.is_homogeneous
    ]
    fastest = max((float(np.linalg.norm(u[one])) for one in own), default=0.0)
    return _FARTHEST_STEP / fastest if fastest > 0.0 else np.inf


def _plain(equations: Equations) -> list[str]:
    """Return the names of coordinates that are not of orientations."""
    turned = {i for body_orientation in equations.orientation_coordinates for i in body_orientation.coordinates}
    return [one.name for i, one in enumerate(equations.names) if i not in turned]


def switch_coordinates(assembly: Assembly, q: FloatArray, reassemble: Reassemble) -> tuple[Assembly, FloatArray]:
    """Return a scene in coordinates that are far from singular, and its coordinates there."""
    orientation = assembly.orientation
    if not orientation.kind.startswith("euler-"):
        return assembly, from_regular(assembly, q)
    turned = set(orientation.turned)
    for body_orientation, regular in zip(
        assembly.reduced.orientation_coordinates, assembly.regular.orientation_coordinates, strict=True
    ):
        first, _, third = body_orientation.turns
        along = _matrix(body_orientation.base, q[list(regular.coordinates)])[first, third]
        if abs(along) > _NEARLY * FARTHEST_COSINE:
            turned ^= {body_orientation.body}
    if turned != orientation.turned:
        other = Orientation(orientation.kind, frozenset(turned))
        assembly = reassemble(assembly.modes, assembly.mechanism.line_signs or {}, other)
    return assembly, from_regular(assembly, q)


def _matrix(base: int, quaternion: FloatArray) -> FloatArray:
    """Return rotation matrices, seen from a base, from quaternions of shape (4,) or (4, samples)."""
    w, x, y, z = quaternion / np.sqrt(np.sum(quaternion**2, axis=0))
    matrix = np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
    return matrix if base == 0 else matrix[[1, 2, 0]]


def _quaternion(body_orientation: OrientationCoordinates, values: FloatArray) -> FloatArray:
    """Return unit quaternions from orientation coordinates."""
    if body_orientation.is_homogeneous:
        return np.asarray(values / np.sqrt(np.sum(values**2, axis=0)))
    found = np.array([1.0, 0.0, 0.0, 0.0] if body_orientation.base == 0 else [0.5, 0.5, 0.5, 0.5])
    found = found.reshape(4, *[1] * (values.ndim - 1)) * np.ones(values.shape[1:])
    for axis, angle in zip(body_orientation.turns, values, strict=True):
        turn = np.zeros_like(found)
        turn[0], turn[1 + axis] = np.cos(0.5 * angle), np.sin(0.5 * angle)
        found = np.array(quaternion_product([*found], [*turn]))
    return found


def _coordinates(body_orientation: OrientationCoordinates, quaternion: FloatArray) -> FloatArray:
    """Return orientation coordinates from unit quaternions."""
    if body_orientation.is_homogeneous:
        return quaternion
    return _euler_angles(body_orientation.turns, _matrix(body_orientation.base, quaternion))


def _euler_angles(turns: tuple[int, int, int], matrix: FloatArray) -> FloatArray:
    """Return the angles of three turns, of shape (3,) or (3, samples), from a rotation matrix.

    With i, j, k their axes and l the third besides i and j: the column of the last axis and the row of the first one
    are those of two turns alone.
    """
    i, j, k = turns
    l = 3 - i - j
    even = 1.0 if (j - i) % 3 == 1 else -1.0
    if i == k:
        return np.array(
            [
                np.arctan2(matrix[j, i], -even * matrix[l, i]),
                np.arctan2(np.hypot(matrix[j, i], matrix[l, i]), matrix[i, i]),
                np.arctan2(matrix[i, j], even * matrix[i, l]),
            ]
        )
    return np.array(
        [
            np.arctan2(-even * matrix[j, k], matrix[k, k]),
            np.arctan2(even * matrix[i, k], np.hypot(matrix[i, i], matrix[i, j])),
            np.arctan2(-even * matrix[i, j], matrix[i, i]),
        ]
    )
