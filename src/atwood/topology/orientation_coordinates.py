"""Orientation coordinates: which kind of them a scene uses, and the coordinates of one orientation."""

from __future__ import annotations

from itertools import product
from math import pi

from atwood.errors import UsageError, suggestion
from atwood.lazy_dataclasses import dataclass

_EULER = tuple(f"euler-{a}{b}{c}" for a, b, c in product("xyz", repeat=3) if a != b != c)

ORIENTATIONS = ("quaternion", *_EULER)
"""In which coordinates orientations can be."""


@dataclass(frozen=True)
class Orientation:
    """In which coordinates the orientations of a scene are.

    Attributes
    ----------
    kind
        One of `ORIENTATIONS`.
    turned
        With Euler angles: the bodies whose angles are measured from the second base (`OrientationCoordinates.base`).
    """

    kind: str = "quaternion"
    turned: frozenset[str] = frozenset()


@dataclass(frozen=True)
class OrientationCoordinates:
    """Coordinates of an orientation, whose rates are not the speeds that belong to them.

    The size of a quaternion means nothing, nor that of a direction: everything that is computed from them is the same
    for any multiple. So no constraint holds it, and whoever hands a state on may bring it back to one. Euler
    angles are singular somewhere and are switched before they come near.

    Attributes
    ----------
    kind
        ``"quaternion"``: scalar part first. ``"euler-zyz"`` and its like: angles of turns one after another about axes
        of the frame that those before have made. Of both the speeds are the angular velocity in the axes of the body.
        ``"direction"``: cosine and sine of an angle in a plane; the speed is the angle's.
    coordinates, speeds
        Their numbers.
    body
        Name of what is turned.
    base
        Euler angles are measured from the world's axes if this is 0, from the world's y, z and x axes (as its x, y and
        z axes) if it is 1. Where one is singular, the other is farthest from being so.
    """

    kind: str
    coordinates: tuple[int, ...]
    speeds: tuple[int, ...]
    body: str
    base: int = 0

    @property
    def is_homogeneous(self) -> bool:
        """Whether the size of the coordinates means nothing."""
        return self.kind in ("quaternion", "direction")

    @property
    def reference(self) -> tuple[float, ...]:
        """Coordinates of no rotation; for Euler angles that are singular there, of a quarter turn."""
        if self.kind.startswith("euler-"):
            first, _, third = self.turns
            return 0.0, 0.5 * pi if first == third else 0.0, 0.0
        return (float(self.is_homogeneous), *[0.0] * (len(self.coordinates) - 1))

    @property
    def turns(self) -> tuple[int, int, int]:
        """Of Euler angles, the numbers of the axes that the turns are about."""
        first, second, third = ("xyz".index(letter) for letter in self.kind.removeprefix("euler-"))
        return first, second, third


def coordinates_of(kind: str, body: str) -> list[tuple[str, str]]:
    """Return names and units of the coordinates of an orientation."""
    if kind.startswith("euler-"):
        return [(f"{body}.euler.{name}", "rad") for name in ("phi", "theta", "psi")]
    return [(f"{body}.quaternion.{part}", "1") for part in "wxyz"]


def check_orientation(kind: str, form: str, space: str) -> None:
    """Refuse coordinates that there are not."""
    if kind not in ORIENTATIONS:
        raise UsageError(
            f"there are no coordinates of orientations {kind!r}",
            advice=suggestion(kind, ORIENTATIONS)
            or "There are quaternions ('quaternion') and Euler angles in the twelve conventions, such as 'euler-zyz'.",
        )
    if space != "space" and kind != "quaternion":
        raise UsageError(
            f"there are no orientations in a {space} for which {kind!r} would be coordinates",
            advice="Leave orientation out; it is for scenes in space.",
        )
    if form == "dae" and kind != "quaternion":
        raise UsageError(
            f"the dae form has orientations as quaternions, not {kind!r}",
            advice="Modes exchange states in its coordinates, which must be regular everywhere. Use the reduced form.",
        )
