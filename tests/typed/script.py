"""What a user writes, as mypy --strict and pyright see it: values with units, functions of time, parts by name."""

from __future__ import annotations

import atwood
from atwood import Component, Model, Number, Point, Scalar, Scene, connect, connector, observable, parameter, potential
from atwood_library import Force, Ground, Link, Pivot, PointMass, Rod
from atwood_library.scenes import DoublePendulum


class CubicSpring(Component):
    """A spring whose force grows with the cube of its length."""

    stiffness: Number = parameter(1.0, unit="N/m^3", minimum=0.0, doc="Force for an extension by one metre.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @potential
    def elastic_energy(self) -> Scalar:
        """Return the elastic energy."""
        return self.stiffness * self.length() ** 4 / 4.0

    @observable(unit="m", doc="Distance of the ends.")
    def length(self) -> Scalar:
        """Return the length."""
        return self.distance(self.a, self.b)


class Pendulum(Model):
    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of both rods together.")
    top: Point = connector(Point, "Where it hangs.")
    rod: Rod = Rod(length=length / 2)
    bob: PointMass = PointMass(mass="200 g")
    connections = [connect(top, rod.a), connect(rod.b, bob.point)]


class Swing(Scene):
    gravity = 1.62
    ground: Ground = Ground()
    pendulum: Pendulum = Pendulum(length="80 cm")
    connections = [connect(ground.frame, pendulum.top)]
    start = {"pendulum.rod.angle": "30 deg"}


scene = Scene(gravity="9.81 m/s^2", t_end="1 s")
ground = scene.add("ground", Ground())
hinge = scene.add("hinge", Pivot(motor=lambda t: 0.1 * atwood.sin(t)))
link = scene.add("link", Link(length="80 cm", mass=2))
spring = scene.add("spring", CubicSpring(stiffness="50 N/m^3"))
push = scene.add("push", Force(value=lambda t: 2.0 * t))
for ends in (
    (ground.frame, hinge.a),
    (hinge.b, link.a),
    (link.b, spring.b),
    (ground.frame, spring.a),
    (link.b, push.point),
):
    scene.connect(*ends)
scene.start = {"hinge.angle": "20 deg"}
scene.link.mass = "3 kg"
link.length = 0.7
arm: float = scene.link.length + link.length / 2.0
result = atwood.simulate(scene, t_end="0.5 s", outputs=11, until="hinge.angle crosses 2 rad")
last: float = result["hinge.angle"][-1] + result[hinge.angle][-1] + result[spring.length][-1]
print(arm, last, result.parts.hinge["angle"][0], atwood.simulate(Swing(), t_end=0.1).energy.max_drift)
print(atwood.sweep(DoublePendulum(length1="30 cm"), {"mass2": ["1 kg", 2.0]}, t_end=0.1, outputs=3).status)
