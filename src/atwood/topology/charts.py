"""Charts: groups of coordinates that stand for an orientation together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["Chart"]


@dataclass(frozen=True)
class Chart:
    """Coordinates of an orientation that are more than the speeds that belong to them.

    The size of the coordinates' vector means nothing: everything that is computed from them is the same for any
    multiple. So no constraint holds it, and whoever hands a state on may bring it back to one.

    Attributes
    ----------
    kind
        ``"quaternion"``: scalar part first; the speeds are the angular velocity in the axes of the body.
        ``"direction"``: cosine and sine of an angle in a plane; the speed is the angle's.
    coordinates, speeds
        Their numbers.
    body
        Name of what is turned.
    """

    kind: Literal["quaternion", "direction"]
    coordinates: tuple[int, ...]
    speeds: tuple[int, ...]
    body: str
