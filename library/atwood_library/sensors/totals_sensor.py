"""TotalsSensor: momentum, angular momentum, centre of mass and inertia of the model that it is placed in."""

from __future__ import annotations

from atwood import Component, Point, Scalar, Vector, connector, cross, dot, observable, parameter


class TotalsSensor(Component):
    """Measures all parts of the model that it is placed in together, about any point.

    The point is the origin of the world, the centre of mass, or a connector, which may move. Angular momentum about a
    point that moves is that of the motion against the world, ``sum (r - a) x m v`` (Goldstein, section 1.2). Without a
    sensor, results have ``momentum``, ``angular_momentum``, ``center_of_mass``, ``kinetic_energy``, ``total_energy``,
    ``power`` and the inertia of a scene, and of each model in it, by its path: ``result["arm.momentum.x"]``.
    """

    synonyms = ("Momentum", "Angular momentum", "Centre of mass", "Inertia tensor")

    about: str = parameter(
        "origin", choices=("origin", "center_of_mass", "point"), doc="The point that moments are taken about."
    )
    point: Point = connector(Point, "The point that moments are taken about.", when={"about": ("point",)})

    def pole(self) -> Vector:
        """Return the point that moments are taken about."""
        if self.about == "point":
            return self.point.position
        return self.middle() if self.about == "center_of_mass" else Vector(0.0, 0.0, 0.0)

    def middle(self) -> Vector:
        """Return the centre of mass."""
        middle: Vector = self.total_around("first_moment") / self.total_around("mass")
        return middle

    @observable(unit="kg", doc="Mass of the model.")
    def mass(self) -> Scalar:
        """Return the mass."""
        return self.total_around("mass")

    @observable(unit="m", doc="Centre of mass of the model, in world axes.")
    def center_of_mass(self) -> Vector:
        """Return the centre of mass."""
        return self.middle()

    @observable(unit="kg*m/s", doc="Momentum of the model, in world axes.")
    def momentum(self) -> Vector:
        """Return the momentum."""
        momentum: Vector = self.total_around("momentum")
        return momentum

    @observable(unit="kg*m^2/s", doc="Angular momentum about the point, in world axes.", spaces=("space",))
    def angular_momentum(self) -> Vector:
        """Return the angular momentum."""
        return self.turning()

    @observable(
        unit="kg*m^2/s", doc="Angular momentum about the point, counter-clockwise in a plane.", spaces=("plane",)
    )
    def angular_momentum_in_plane(self) -> Scalar:
        """Return the angular momentum about the normal."""
        return -1.0 * self.turning().y

    def turning(self) -> Vector:
        """Return the angular momentum about the pole."""
        whole: Vector = self.total_around("angular_momentum") - cross(self.pole(), self.total_around("momentum"))
        return whole

    def parallel(self, r: Vector, s: Vector) -> tuple[Vector, Vector]:
        """Return moments and products of ``(r . s) 1 - (r s + s r)/2``."""
        square = dot(r, s)
        moments = Vector(square - r.x * s.x, square - r.y * s.y, square - r.z * s.z)
        products = Vector(r.x * s.y + r.y * s.x, r.x * s.z + r.z * s.x, r.y * s.z + r.z * s.y) * -0.5
        return moments, products

    def inertia(self, which: int) -> Vector:
        """Return moments or products of inertia about the pole: ``J - 2 a s + m a a`` with the first moment s."""
        a, s = self.pole(), self.total_around("first_moment")
        of_origin: Vector = self.total_around("moments" if which == 0 else "products")
        mixed, own = self.parallel(a, s)[which], self.parallel(a, a)[which]
        whole: Vector = of_origin - mixed * 2.0 + own * self.total_around("mass")
        return whole

    @observable(
        unit="kg*m^2",
        doc="Entries Jxx, Jyy, Jzz of the inertia tensor about the point, in world axes.",
        spaces=("space",),
    )
    def moments(self) -> Vector:
        """Return the moments."""
        return self.inertia(0)

    @observable(
        unit="kg*m^2",
        doc="Entries Jxy, Jxz, Jyz of the inertia tensor about the point, in world axes.",
        spaces=("space",),
    )
    def products(self) -> Vector:
        """Return the products."""
        return self.inertia(1)

    @observable(unit="kg*m^2", doc="Moment of inertia about the point.", spaces=("plane",))
    def moment(self) -> Scalar:
        """Return the moment about the normal."""
        return self.inertia(0).y

    @observable(unit="W", doc="Rate of the kinetic and potential energy of the model.")
    def power(self) -> Scalar:
        """Return the power."""
        return self.total_around("power")
