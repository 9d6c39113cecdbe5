"""Shape: what rigid bodies of a simple shape have in common: mass or density, and inertia that follows from sizes."""

from __future__ import annotations

from atwood import Number, ParameterError, Scalar, Vector, as_vector, parameter
from atwood_library.interfaces.solid import Solid, Tensor

__all__ = ["Axis", "Shape", "along", "diagonal", "revolved"]

Axis = str | Vector | tuple[float, float, float]
"""An axis of the frame: ``"x"``, ``"y"`` or ``"z"``, or a unit vector in its axes."""


class Shape(Solid):
    """A homogeneous rigid body of a simple shape; subclasses say its volume, and its inertia per mass.

    Its mass is given, or follows from its density. What is rigidly joined to it, by a connection of frames or through a
    `Weld`, is one body with it. Closed forms of inertia: Goldstein, Poole and Safko, Classical Mechanics, chapter 5;
    Beer and Johnston, Vector Mechanics for Engineers, table of mass moments of inertia.
    """

    mass: Number | None = parameter(
        None, unit="kg", minimum=0.0, doc="Mass; if neither it nor the density is given, 1 kg."
    )
    density: Number | None = parameter(
        None, unit="kg/m^3", above=0.0, doc="Density, from which the mass follows; give it or the mass."
    )

    def volume(self) -> Scalar:
        """Return the volume, m^3."""
        raise NotImplementedError

    def gyration(self) -> Tensor:
        """Return the inertia tensor about the centre of mass per mass, in the axes of the frame, m^2."""
        raise NotImplementedError

    def total_mass(self) -> Scalar:
        """Return the mass."""
        if self.density is not None:
            return self.density * self.volume()
        return 1.0 if self.mass is None else self.mass

    def tensor(self) -> Tensor:
        """Return the inertia tensor."""
        mass, (x, y, z) = self.total_mass(), self.gyration()
        return (
            (mass * x[0], mass * x[1], mass * x[2]),
            (mass * y[0], mass * y[1], mass * y[2]),
            (mass * z[0], mass * z[1], mass * z[2]),
        )

    def check_values(self) -> None:
        """Refuse a mass and a density at once, and a density where there is no volume."""
        if self.mass is not None and self.density is not None:
            raise ParameterError(
                "both its mass and its density are given",
                where=self.path or type(self).__name__,
                advice="Give one of them; the other one is None.",
            )
        if self.density is not None and not self.volume() > 0.0:
            raise ParameterError(
                "a shape without volume has no mass from its density",
                where=f"{self.path or type(self).__name__}.density",
                advice="Give its mass instead.",
            )

    def check_hole(self, inner: float, outer: float) -> None:
        """Refuse a hole that is larger than what it is in.

        Parameters
        ----------
        inner, outer
            Radii, m.
        """
        if inner > outer:
            raise ParameterError(
                f"the inner radius, {inner:g} m, is greater than the outer one, {outer:g} m",
                where=f"{self.path or type(self).__name__}.inner_radius",
                advice="Give an inner radius from zero to the outer one.",
            )


def along(axis: Axis, distance: Scalar) -> Vector:
    """Return a vector along an axis of the frame.

    Parameters
    ----------
    axis
        ``"x"``, ``"y"`` or ``"z"``, or a unit vector.
    distance
        Its component there.
    """
    if not isinstance(axis, str):
        vector: Vector = as_vector(axis) * distance
        return vector
    return Vector(*(distance if name == axis else 0.0 for name in "xyz"))


def diagonal(x: Scalar, y: Scalar, z: Scalar) -> Tensor:
    """Return a tensor with principal axes along the frame's."""
    return (x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)


def revolved(axis: Axis, about: Scalar, across: Scalar) -> Tensor:
    """Return the tensor of a body of revolution.

    Parameters
    ----------
    axis
        Its axis: ``"x"``, ``"y"`` or ``"z"``, or a unit vector n.
    about, across
        Its moments about the axis and across it; the tensor is ``across 1 + (about - across) n n``.
    """
    if isinstance(axis, str):
        return diagonal(*(about if name == axis else across for name in "xyz"))
    n = tuple(as_vector(axis))
    x, y, z = (
        tuple((about - across) * (a * b) + (across if i == k else 0.0) for k, b in enumerate(n))
        for i, a in enumerate(n)
    )
    return (x[0], x[1], x[2]), (y[0], y[1], y[2]), (z[0], z[1], z[2])
