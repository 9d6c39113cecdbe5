"""From where a scene in space is seen: a parallel projection onto the page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from atwood.arguments import show
from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.lazy_dataclasses import dataclass

View: TypeAlias = Sequence[float] | str
"""Azimuth and elevation of the eye, degrees; as a text with a comma between them."""

DEFAULT_VIEW = (30.0, 20.0)
"""From the front, a little from the right and from above."""

_ADVICE = "Give azimuth and elevation in degrees, such as 30, 20: a little from the right of the front, and from above."


@dataclass(frozen=True)
class Camera:
    """An eye that is infinitely far away, so that what is parallel stays parallel and nothing shrinks with distance.

    From the front, at azimuth and elevation zero, it sees the x-z plane just as scenes in the plane are drawn: x to
    the right, z upwards, y into the page.

    Attributes
    ----------
    azimuth
        How far the eye has gone round the z axis from the front, degrees; positive towards the right, that is +x.
    elevation
        How far it is above the horizontal plane, degrees; 90 looks straight down.
    """

    azimuth: float
    elevation: float

    @cached_property
    def axes(self) -> FloatArray:
        """The page's right and up, and the direction towards the eye, in world axes: the rows of a rotation matrix."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        (sa, ca), (se, ce) = ((math.sin(angle), math.cos(angle)) for angle in (a, e))
        return np.array([[ca, sa, 0.0], [-sa * se, ca * se, ce], [sa * ce, -ca * ce, se]])

    @property
    def towards(self) -> FloatArray:
        """Unit vector towards the eye, in world axes."""
        return np.asarray(self.axes[2])

    def project(self, points: ArrayLike) -> FloatArray:
        """Return where points are on the page."""
        return np.asarray(np.asarray(points, dtype=float) @ self.axes[:2].T)

    def depth(self, points: ArrayLike) -> FloatArray:
        """Return how near points are to the eye, m, shape (...): what is larger hides what is smaller."""
        return np.asarray(np.asarray(points, dtype=float) @ self.axes[2])


def as_camera(view: View | None) -> Camera:
    """Return the camera of a view."""
    given = DEFAULT_VIEW if view is None else view
    try:
        numbers = [float(number) for number in (given.split(",") if isinstance(given, str) else given)]
    except Exception:  # what is no sequence of numbers may raise anything
        numbers = []
    if len(numbers) != 2 or not all(math.isfinite(number) for number in numbers):
        raise UsageError(f"{show(view)} is no direction to look from", where="view", advice=_ADVICE)
    azimuth, elevation = numbers
    if abs(elevation) > 90.0:
        advice = "It lies between -90, straight from below, and 90, straight from above; first comes the azimuth."
        raise UsageError(f"the elevation of {elevation:g} degrees does not exist", where="view", advice=advice)
    return Camera(azimuth, elevation)


def check_view(space: str, view: View | None) -> bool:
    """Return whether a scene is in space, or raise an error where a view is given and it is not."""
    if space != "space" and view is not None:
        where = {"plane": "in a plane", "line": "on a line"}[space]
        advice = "Leave the view away; only scenes in space have other sides."
        raise UsageError(f"a scene {where} is always seen from the front", where="view", advice=advice)
    return space == "space"
