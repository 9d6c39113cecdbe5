"""RollingSphere: a ball that rolls on a plane."""

from __future__ import annotations

from atwood import Scalar, Vector
from atwood_library.interfaces.rolling import Rolling


class RollingSphere(Rolling):
    """A ball rolls on a plane without slipping; it may spin about the normal. In a plane it is a disc."""

    def height(self) -> Scalar:
        """Return the height of the centre above the plane: the radius."""
        return self.radius

    def to_center(self) -> Vector:
        """Return the vector from the contact to the centre."""
        return self.normal_in_world() * self.radius
