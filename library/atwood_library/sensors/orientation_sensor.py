"""OrientationSensor: how one frame is turned against another, as Euler angles of any convention."""

from __future__ import annotations

from itertools import permutations

from atwood import Component, Frame, Scalar, Vector, atan2, connector, cross, dot, observable, parameter, sqrt
from atwood_library.interfaces.poles import angle_off_pole, rate_off_pole
from atwood_library.interfaces.rotation_vector import rotation_vector

CONVENTIONS = tuple(
    first + second + third for first, second in permutations("xyz", 2) for third in "xyz" if third != second
)
"""The twelve sequences of axes."""


class OrientationSensor(Component):
    """Measures how frame b is turned against frame a: Euler angles, relative angular velocity, rotation vector.

    Frame a is turned into frame b by three turns, each about an axis of the frame that those before it have made. The
    convention names these axes in order: ``"zyz"`` and ``"zxz"`` are those of textbooks on tops, ``"zyx"`` is yaw,
    pitch, roll (Goldstein, section 4.4 and appendix A). The second angle is within 0 to a half turn where the first
    axis comes again, within a quarter turn either way where it does not; the others count turns. Where the first
    and the third axis are parallel, within 1e-10 rad, the first and third angles are zero and the rates have no value.
    A part of space.
    """

    synonyms = ("AbsoluteAngles", "RelativeAngles", "AbsoluteAngularVelocity", "RelativeAngularVelocity")
    spaces = ("space",)

    convention: str = parameter("zyz", choices=CONVENTIONS, doc="Axes of the three turns, in order.")
    a: Frame = connector(Frame, "The frame that the orientation is measured from.")
    b: Frame = connector(Frame, "The frame whose orientation is measured.")

    def _entry(self, row: str, column: str) -> Scalar:
        """Return the scalar product of an axis of a and an axis of b, by their names."""
        return dot(self.a.axes["xyz".index(row)], self.b.axes["xyz".index(column)])

    def _sequence(self) -> tuple[str, str, str, bool, float]:
        """Return the first two axes and the one that is left, whether the first comes again, and the sense."""
        i, j, last = tuple(self.convention)
        again = last == i
        k = next(axis for axis in "xyz" if axis not in (i, j)) if again else last
        return i, j, k, again, 1.0 if (i + j + k) in ("xyz", "yzx", "zxy") else -1.0

    @observable(unit="rad", doc="First Euler angle.", periodic=True, rate="rate_1", spaces=("space",))
    def angle_1(self) -> Scalar:
        """Return the angle of the first turn."""
        i, j, k, again, sense = self._sequence()
        if again:
            return angle_off_pole(self._entry(j, i), -sense * self._entry(k, i))
        return angle_off_pole(-sense * self._entry(j, k), self._entry(k, k))

    @observable(unit="rad", doc="Second Euler angle.", spaces=("space",))
    def angle_2(self) -> Scalar:
        """Return the angle of the second turn."""
        i, j, k, again, sense = self._sequence()
        if again:
            across = sqrt(self._entry(j, i) ** 2 + self._entry(k, i) ** 2)
            return atan2(across, self._entry(i, i))
        along = sqrt(self._entry(j, k) ** 2 + self._entry(k, k) ** 2)
        return atan2(sense * self._entry(i, k), along)

    @observable(unit="rad", doc="Third Euler angle.", periodic=True, rate="rate_3", spaces=("space",))
    def angle_3(self) -> Scalar:
        """Return the angle of the third turn."""
        i, j, k, again, sense = self._sequence()
        if again:
            return angle_off_pole(self._entry(i, j), sense * self._entry(i, k))
        return angle_off_pole(-sense * self._entry(i, j), self._entry(i, i))

    def _outer_axes(self) -> tuple[Vector, Vector, Vector, Scalar]:
        """Return the axes of the first and the third turn in world axes, their vector product, and its square."""
        first = self.a.axes["xyz".index(self.convention[0])]
        third = self.b.axes["xyz".index(self.convention[2])]
        normal = cross(first, third)
        return first, third, normal, dot(normal, normal)

    @observable(unit="rad/s", doc="Rate of the first angle.", spaces=("space",))
    def rate_1(self) -> Scalar:
        """Return the component of the relative angular velocity along the first axis, in the frame of the three."""
        _, third, normal, square = self._outer_axes()
        return rate_off_pole(dot(self.relative_spin(), cross(third, normal)), square, square)

    @observable(unit="rad/s", doc="Rate of the second angle.", spaces=("space",))
    def rate_2(self) -> Scalar:
        """Return the component of the relative angular velocity along the second axis, the normal of the others."""
        _, _, normal, square = self._outer_axes()
        _, _, _, again, sense = self._sequence()
        factor = 1.0 if again else -sense
        return rate_off_pole(factor * dot(self.relative_spin(), normal), sqrt(square), square)

    @observable(unit="rad/s", doc="Rate of the third angle.", spaces=("space",))
    def rate_3(self) -> Scalar:
        """Return the component of the relative angular velocity along the third axis."""
        first, _, normal, square = self._outer_axes()
        return rate_off_pole(dot(self.relative_spin(), cross(normal, first)), square, square)

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
