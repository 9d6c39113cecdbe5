"""Wheel: a wheel on an axle, which rolls on a plane."""

from __future__ import annotations

from atwood import Frame, Model, Number, Triple, connect, connector, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.rolling_disc import RollingDisc
from atwood_library.parts.rim import Rim


class Wheel(Model):
    """A wheel that turns freely on an axle and rolls on a plane without slipping.

    The axle is a frame of whatever carries the wheel: a cart, a fork, a rod. `bearing.angle` is the angle about the
    axle, `bearing.force` what the axle exerts on the wheel, `contact.normal_force` and the friction of `contact` what
    the plane does.
    """

    synonyms = ("RollingWheel", "RollingWheelSet", "MultiBody.Parts.RollingWheelSet")

    radius: Number = parameter(0.3, unit="m", above=0.0, doc="Radius.")
    mass: Number = parameter(1.0, unit="kg", minimum=0.0, doc="Mass.")
    axial: Number | None = parameter(
        None, unit="kg*m^2", minimum=0.0, doc="Moment of inertia about the axle; of a uniform disc if not given."
    )
    transverse: Number | None = parameter(
        None, unit="kg*m^2", minimum=0.0, doc="Moment of inertia across the axle; half of that about it if not given."
    )
    axis: Triple = parameter(
        (0.0, 1.0, 0.0), turning=True, doc="Direction of the axle in its frame; the wheel turns right-handed about it."
    )
    normal: Triple = parameter(
        (0.0, 0.0, 1.0), direction=True, doc="Normal of the plane in the frame of the ground, towards the wheel."
    )
    axle: Frame = connector(Frame, "The frame that carries the wheel, at its centre.")
    ground: Frame = connector(Frame, "The frame that carries the plane; its origin is in it.")
    bearing: Pivot = Pivot(axis=axis)
    rim: Rim = Rim(mass=mass, radius=radius, axis=axis)
    contact: RollingDisc = RollingDisc(radius=radius, axis=axis, normal=normal)
    connections = [
        connect(axle, bearing.a),
        connect(bearing.b, rim.frame),
        connect(ground, contact.a),
        connect(rim.frame, contact.b),
    ]

    def build(self) -> None:
        """Give the wheel its inertia, about whichever axis it has."""
        x, y, z = self.axis
        axial = 0.5 * self.mass * self.radius**2 if self.axial is None else self.axial
        across = 0.5 * axial if self.transverse is None else self.transverse
        more = axial - across
        self.rim.moments = (across + more * x * x, across + more * y * y, across + more * z * z)
        self.rim.products = (more * x * y, more * x * z, more * y * z)
