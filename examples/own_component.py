"""A component of one's own: a spring whose force grows with the cube of its extension."""

from atwood import Component, Number, Point, Scalar, Scene, connector, observable, parameter, potential, simulate
from atwood_library import Ground, PointMass


class CubicSpring(Component):
    """A spring whose force grows with the cube of its extension."""

    stiffness: Number = parameter(1.0, unit="N/m^3", minimum=0.0, doc="Force for an extension by one metre.")
    natural_length: Number = parameter(1.0, unit="m", minimum=0.0, doc="Length without force.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @potential
    def elastic_energy(self) -> Scalar:
        """Return the elastic energy."""
        extension = self.distance(self.a, self.b) - self.natural_length
        return self.stiffness * extension**4 / 4.0

    @observable(unit="m", doc="Distance of the ends.")
    def length(self) -> Scalar:
        """Return the length."""
        return self.distance(self.a, self.b)


scene = Scene()
ground = scene.add("ground", Ground())
spring = scene.add("spring", CubicSpring(stiffness=50.0))
bob = scene.add("bob", PointMass(mass=1.0))
scene.connect(ground.frame, spring.a)
scene.connect(spring.b, bob.point)
scene.start.update({"bob.position.x": 0.3, "bob.position.z": -1.2})
result = simulate(scene, t_end=5.0)
print(f"longest {result['spring.length'].max():.6f} m, energy drift {result.energy.max_drift:.1e}")
