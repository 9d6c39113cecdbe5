"""CentralGravity: the attraction by a point, or by a sphere."""

from __future__ import annotations

from atwood import (
    Component,
    Frame,
    Number,
    Point,
    Scalar,
    Vector,
    connector,
    dot,
    norm,
    observable,
    parameter,
    potential,
    sqrt,
)


class CentralGravity(Component):
    """The attraction of a mass by a point, or a sphere, of gravitational parameter ``mu = G M``.

    Potential energy ``-mu m / r`` (Goldstein, section 3.7). Both ends feel the force, so that the source may itself be
    a body that moves.

    What is attracted has the mass of the body that `point` or `frame` is on, with all parts that are rigidly joined
    there. With ``attracts="body"`` that is an extended body, to second order in its size over the distance:
    ``-mu m/r - mu (tr J - 3 J_r)/(2 r^3)`` with its moment of inertia J_r about the line from the source to its centre
    of mass (MacCullagh's formula; Goldstein, section 5.8). Its torque is the gravity gradient ``3 mu/r^3 (e x J e)``,
    and its force is the derivative of the same energy, so that energy and angular momentum are kept. With
    ``attracts="point"`` all of the mass is taken to be at `point`.
    """

    synonyms = ("PointGravity", "Kepler force")

    gravitational_parameter: Number = parameter(
        3.986004418e14, unit="m^3/s^2", minimum=0.0, doc="G M of the source; by default that of the Earth."
    )
    attracts: str = parameter("point", choices=("point", "body"), doc="Whether a point mass or an extended body.")
    source: Point = connector(Point, "The centre of the source.")
    point: Point = connector(Point, "The point mass that is attracted.", when={"attracts": ("point",)})
    frame: Frame = connector(Frame, "The frame of the body that is attracted.", when={"attracts": ("body",)})

    def separation(self) -> Vector:
        """Return the way from the source to the centre of mass, in world axes."""
        if self.attracts == "point":
            return self.point.position - self.source.position
        arm = self.frame.to_world(self.frame.center_of_mass)
        separation: Vector = self.frame.position + arm - self.source.position
        return separation

    @potential
    def energy(self) -> Scalar:
        """Return the potential energy."""
        r = self.separation()
        square = dot(r, r)
        inverse = 1.0 / sqrt(square)
        if self.attracts == "point":
            return -(self.gravitational_parameter * self.point.mass * inverse)
        energy = -(self.gravitational_parameter * self.frame.mass * inverse)
        x, y, z = self.frame.inertia
        s = self.frame.to_frame(r)
        along = dot(s, Vector(dot(x, s), dot(y, s), dot(z, s)))
        spread = (x.x + y.y + z.z) - 3.0 * along / square
        return energy - 0.5 * self.gravitational_parameter * spread * (inverse * inverse * inverse)

    @observable(unit="m", doc="Distance of the centre of mass from the source.")
    def distance_apart(self) -> Scalar:
        """Return the distance."""
        return norm(self.separation())

    @observable(unit="m/s^2", doc="Acceleration of free fall at the centre of mass.")
    def pull(self) -> Scalar:
        """Return ``mu/r^2``."""
        r = self.separation()
        return self.gravitational_parameter / dot(r, r)
