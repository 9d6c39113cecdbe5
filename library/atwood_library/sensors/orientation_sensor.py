"""OrientationSensor: how one frame is turned against another, as Euler angles of any convention."""

from __future__ import annotations

from collections.abc import Mapping

from atwood import Component, Frame, Scalar, Vector, connector, observable, parameter
from atwood_library.interfaces.euler_angles import CONVENTIONS, EulerAngles, restated_angles
from atwood_library.interfaces.rotation_vector import rotation_vector


class OrientationSensor(Component):
    """Measures how frame b is turned against frame a: Euler angles, relative angular velocity, rotation vector.

    Frame a is turned into frame b by three turns, each about an axis of the frame that those before it have made. The
    convention names these axes in order: ``"zyz"`` and ``"zxz"`` are those of textbooks on tops, ``"zyx"`` is yaw,
    pitch, roll (Goldstein, section 4.4 and appendix A). The second angle is within 0 to a half turn where the first
    axis comes again, within a quarter turn either way where it does not; the others count turns. Where the first
    and the third axis are parallel, within 1e-12 rad, only the sum or the difference of the first and the third angle
    has a value: at the start of a run, if it does not say them, the first is zero, and along the run the other
    combination stays what it was before. There the rates have values as long as the axes stay parallel.
    A part of space.
    """

    synonyms = ("AbsoluteAngles", "RelativeAngles", "AbsoluteAngularVelocity", "RelativeAngularVelocity")
    spaces = ("space",)

    convention: str = parameter("zyz", choices=CONVENTIONS, doc="Axes of the three turns, in order.")
    a: Frame = connector(Frame, "The frame that the orientation is measured from.")
    b: Frame = connector(Frame, "The frame whose orientation is measured.")

    def restate_start(self, given: Mapping[str, float], space: str) -> dict[str, float]:
        """Return start values with the three angles said as the axes that they stand for; those not given are zero."""
        return restated_angles(given, self.convention, ("angle_1", "angle_2", "angle_3"), ("x_axis", "z_axis"))

    def euler_angles(self) -> EulerAngles:
        """Return the angles."""
        return EulerAngles(self.convention, self.a.axes, self.b.axes, self.relative_spin())

    @observable(unit="rad", doc="First Euler angle.", periodic=True, rate="rate_1", pole="pole", spaces=("space",))
    def angle_1(self) -> Scalar:
        """Return the angle of the first turn."""
        return self.euler_angles().first()

    @observable(unit="rad", doc="Second Euler angle.", spaces=("space",))
    def angle_2(self) -> Scalar:
        """Return the angle of the second turn."""
        return self.euler_angles().second()

    @observable(unit="rad", doc="Third Euler angle.", periodic=True, rate="rate_3", pole="pole", spaces=("space",))
    def angle_3(self) -> Scalar:
        """Return the angle of the third turn."""
        return self.euler_angles().last()

    @observable(
        unit="1", doc="At a pole, the sign with which angle 3 is added to angle 1; else zero.", spaces=("space",)
    )
    def pole(self) -> Scalar:
        """Return the sign, which is there the cosine between the first and the third axis."""
        return self.euler_angles().pole()

    @observable(unit="rad/s", doc="Rate of the first angle.", spaces=("space",))
    def rate_1(self) -> Scalar:
        """Return the component of the relative angular velocity along the first axis, in the frame of the three."""
        return self.euler_angles().rates()[0]

    @observable(unit="rad/s", doc="Rate of the second angle.", spaces=("space",))
    def rate_2(self) -> Scalar:
        """Return the component of the relative angular velocity along the second axis, the normal of the others."""
        return self.euler_angles().rates()[1]

    @observable(unit="rad/s", doc="Rate of the third angle.", spaces=("space",))
    def rate_3(self) -> Scalar:
        """Return the component of the relative angular velocity along the third axis."""
        return self.euler_angles().rates()[2]

    @observable(unit="1", doc="Frame b's x axis in the axes of frame a.", spaces=("space",))
    def x_axis(self) -> Vector:
        """Return the axis."""
        return self.a.to_frame(self.b.axes[0])

    @observable(unit="1", doc="Frame b's z axis in the axes of frame a.", spaces=("space",))
    def z_axis(self) -> Vector:
        """Return the axis."""
        return self.a.to_frame(self.b.axes[2])

    def relative_spin(self) -> Vector:
        """Return the angular velocity of frame b as seen from frame a, in world axes."""
        spin: Vector = self.b.angular_velocity - self.a.angular_velocity
        return spin

    @observable(unit="rad/s", doc="Angular velocity of frame b as seen from frame a, in its axes.", spaces=("space",))
    def angular_velocity(self) -> Vector:
        """Return the relative angular velocity."""
        return self.a.to_frame(self.relative_spin())

    @observable(unit="rad", doc="Rotation vector of frame b from frame a.", spaces=("space",))
    def rotation(self) -> Vector:
        """Return the rotation vector; it has no value at half a turn."""
        return rotation_vector(self.a, self.b)
