"""RollingEllipsoid: an ellipsoid that rolls on a plane."""

from __future__ import annotations

from atwood import Number, Scalar, Triple, Vector, as_vector, dot, parameter, sqrt
from atwood_library.interfaces.rolling import Rolling


class RollingEllipsoid(Rolling):
    """An ellipsoid rolls on a plane without slipping: a rattleback, an egg, a pebble. A part of space.

    Its semi-axes are along the axes of frame b, at its centre; how the body's mass is spread is another matter. With
    the plane's normal n in the axes of b it touches at ``-(a1^2 n1, a2^2 n2, a3^2 n3)/h`` from its centre, which is at
    the height ``h = sqrt(a1^2 n1^2 + a2^2 n2^2 + a3^2 n3^2)`` (Bondi, Proceedings of the Royal Society A 405, 1986).
    """

    synonyms = ("Rattleback", "Celt", "Ellipsoid on a plane")
    spaces = ("space",)

    radius: Number = parameter(1.0, unit="m", above=0.0, doc="Unit of the semi-axes.")
    semi_axes: Triple = parameter(
        (1.0, 1.0, 1.0),
        size=3,
        above=0.0,
        doc="Semi-axes along x, y and z of frame b, in units of the radius.",
        symbol=("a", "b", "c"),
    )

    def scaled(self) -> tuple[Vector, Scalar]:
        """Return, in the axes of frame b, the normal with its components times squared semi-axes, and the height."""
        n, axes = self.b.to_frame(self.normal_in_world()), as_vector(self.semi_axes) * self.radius
        stretched = Vector(axes.x * axes.x * n.x, axes.y * axes.y * n.y, axes.z * axes.z * n.z)
        return stretched, sqrt(dot(stretched, n))

    def height(self) -> Scalar:
        """Return the height of the centre above the plane while it touches."""
        return self.scaled()[1]

    def to_center(self) -> Vector:
        """Return the vector from the contact to the centre in world axes."""
        stretched, height = self.scaled()
        return self.b.to_world(stretched / height)
