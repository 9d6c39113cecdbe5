"""Wheel: a wheel on an axle, which rolls on a plane."""

from __future__ import annotations

from atwood import Frame, Model, connect, connector, parameter
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.rolling_disc import RollingDisc
from atwood_library.parts.rigid_body import RigidBody


class Wheel(Model):
    """A wheel that turns freely on an axle and rolls on a plane without slipping.

    The axle is a frame of whatever carries the wheel: a cart, a fork, a rod. `bearing.angle` is the angle about the
    axle, `bearing.force` what the axle exerts on the wheel, `contact.normal_force` and the friction of `contact` what
    the plane does.
    """

    radius: float = parameter(0.3, unit="m", above=0.0, doc="Radius.")
    mass: float = parameter(1.0, unit="kg", minimum=0.0, doc="Mass.")
    axial: float = parameter(0.0, unit="kg*m^2", minimum=0.0, doc="Moment of inertia about the axle.")
    transverse: float = parameter(0.0, unit="kg*m^2", minimum=0.0, doc="Moment of inertia across the axle.")
    axis: tuple[float, float, float] = parameter(
        (0.0, 1.0, 0.0), turning=True, doc="Direction of the axle in its frame; the wheel turns right-handed about it."
    )
    normal: tuple[float, float, float] = parameter(
        (0.0, 0.0, 1.0), direction=True, doc="Normal of the plane in the frame of the ground, towards the wheel."
    )
    axle: Frame = connector(Frame, "The frame that carries the wheel, at its centre.")
    ground: Frame = connector(Frame, "The frame that carries the plane; its origin is in it.")
    bearing: Pivot = Pivot(axis=axis)
    rim: RigidBody = RigidBody(mass=mass)
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
        across, more = self.transverse, self.axial - self.transverse
        self.rim.moments = (across + more * x * x, across + more * y * y, across + more * z * z)
        self.rim.products = (more * x * y, more * x * z, more * y * z)
