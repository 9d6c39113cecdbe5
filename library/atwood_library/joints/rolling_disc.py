"""RollingDisc: a thin disc, or the edge of a wheel, that rolls on a plane."""

from __future__ import annotations

from atwood import Scalar, Triple, Vector, as_vector, dot, parameter, sqrt
from atwood_library.interfaces.rolling import Rolling


class RollingDisc(Rolling):
    """A thin disc rolls on a plane without slipping: its edge touches the plane and does not move against it.

    It may lean to any side and roll along any curve; lying flat it has no contact point, and the run ends with an
    error. In a plane it rolls along a line, with its axis across the page.
    """

    synonyms = ("RollingWheel", "Rolling contact", "RollingWheelSet", "MultiBody.Joints.RollingWheelSet")

    axis: Triple = parameter((0.0, 1.0, 0.0), turning=True, doc="Axis of symmetry of the disc in frame b.")

    def uprightness(self) -> tuple[Scalar, Scalar]:
        """Return cosine and sine of the angle between the disc's axis and the plane's normal."""
        lean = dot(self.normal_in_world(), self.b.to_world(as_vector(self.axis)))
        return lean, sqrt(1.0 - lean * lean)

    def height(self) -> Scalar:
        """Return the height of the centre above the plane while it touches."""
        return self.radius * self.uprightness()[1] if self.in_space else self.radius

    def to_center(self) -> Vector:
        """Return the vector from the contact to the centre: up along the disc as steeply as there is."""
        if not self.in_space:
            return self.normal_in_world() * self.radius
        lean, sine = self.uprightness()
        steepest: Vector = self.normal_in_world() - self.b.to_world(as_vector(self.axis)) * lean
        up: Vector = steepest * (self.radius / sine)
        return up
