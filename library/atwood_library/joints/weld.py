"""Weld: a rigid connection of two frames."""

from __future__ import annotations

from typing import Any

from atwood import (
    Component,
    Frame,
    Number,
    ParameterError,
    Placement,
    Scalar,
    Triple,
    as_vector,
    atan2,
    connector,
    cross,
    dot,
    is_zero,
    joint,
    norm,
    parameter,
    sqrt,
    turn,
)
from atwood_library.interfaces.euler_angles import CONVENTIONS


class Weld(Component):
    """A rigid connection: frame b keeps its place in frame a. What it joins becomes one body.

    How frame b is turned is said by an angle about an axis, by where two of its axes point, or by three angles one
    after the other, as those that an `OrientationSensor` reports. Its `force` and `torque` are what it exerts on frame
    b and everything that hangs on it.
    """

    synonyms = ("FixedTranslation", "FixedRotation", "Rigid connection", "Fixed joint")

    displacement: Triple = parameter(
        (0.0, 0.0, 0.0), unit="m", size=3, doc="Position of frame b in the axes of frame a."
    )
    turned_by: str = parameter(
        "angle", choices=("angle", "two axes", "three angles"), doc="What says how frame b is turned."
    )
    angle: Number = parameter(0.0, unit="rad", doc="Rotation of frame b from frame a, right-handed about the axis.")
    axis: Triple = parameter(
        (0.0, -1.0, 0.0), turning=True, doc="Axis of the rotation; unless reversed, counter-clockwise in a plane."
    )
    x_axis: Triple = parameter(
        (1.0, 0.0, 0.0), direction=True, doc="Of two axes, where the x axis of frame b points, in frame a."
    )
    y_axis: Triple = parameter(
        (0.0, 1.0, 0.0),
        size=3,
        structural=True,
        doc="Of two axes, where the y axis of frame b points, as far as it is square to its x axis; in a plane unused.",
    )
    convention: str = parameter("xyz", choices=CONVENTIONS, doc="Axes of the three turns, in order.")
    angles: Triple = parameter(
        (0.0, 0.0, 0.0), unit="rad", size=3, doc="Three angles, each about an axis that the turns before it have made."
    )
    a: Frame = connector(Frame, "One frame.")
    b: Frame = connector(Frame, "The other frame.")

    def check_values(self) -> None:
        """Refuse two axes that are parallel."""
        x, y = as_vector(self.x_axis), as_vector(self.y_axis)
        if self.turned_by == "two axes" and not norm(cross(x, y)) > 1e-6 * norm(y):
            raise ParameterError(
                "it is parallel to x_axis, or zero",
                where=f"{self.path or type(self).__name__}.y_axis",
                advice="Give another direction, of which the part square to x_axis is taken.",
            )

    @joint("a", "b", rigid=True, spaces=("line", "plane", "space"), reaction="exerted on frame b")
    def fixation(self) -> Placement:
        """Place b in the axes of a."""
        rotation = self.rotation_in_space() if self.in_space else self.rotation_in_plane()
        return Placement(as_vector(self.displacement), rotation, axes="a")

    def rotation_in_plane(self) -> Scalar:
        """Return the rotation of frame b in the plane, counter-clockwise, rad."""
        if self.turned_by == "angle":
            return -as_vector(self.axis).y * self.angle
        if self.turned_by == "two axes":
            return atan2(as_vector(self.x_axis).z, as_vector(self.x_axis).x)
        total: Scalar = 0.0
        for name, angle in zip(self.convention, as_vector(self.angles), strict=True):
            if name == "y":
                total = total - angle
            elif not is_zero(angle):
                raise ParameterError(
                    f"in a plane nothing turns about {name}", where=f"{self.path}.angles", advice="Turn about y only."
                )
        return total

    def rotation_in_space(self) -> Any:
        """Return the rotation of frame b in space."""
        if self.turned_by == "angle":
            axis = as_vector(self.axis)
            return turn(axis, self.angle) if not is_zero(self.angle) else -axis.y * self.angle
        if self.turned_by == "three angles":
            first, second, third = (_AXES[name] for name in self.convention)
            angles = as_vector(self.angles)
            return turn(first, angles.x).then(second, angles.y).then(third, angles.z)
        # About z and the new y the x axis is turned to where it should be, and about that the y axis.
        x, y = as_vector(self.x_axis), as_vector(self.y_axis)
        level = sqrt(x.x * x.x + x.y * x.y)
        across = as_vector((-x.y / level, x.x / level, 0.0)) if not is_zero(level) else as_vector((0.0, 1.0, 0.0))
        yaw, pitch = (atan2(x.y, x.x) if not is_zero(level) else 0.0), atan2(-x.z, level)
        roll = atan2(dot(y, cross(x, across)), dot(y, across))
        return turn(_AXES["z"], yaw).then(_AXES["y"], pitch).then(_AXES["x"], roll)


_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
