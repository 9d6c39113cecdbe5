"""Models: a class body with parameters, nested in a scene, with one part replaced by another."""

from atwood import Model, Number, Point, Scene, connect, connector, parameter, simulate
from atwood_library import Ground, PointMass, Rod, Spring


class Pendulum(Model):
    """A bob on a rod."""

    length: Number = parameter(1.0, unit="m", above=0.0, doc="Length of the rod.")
    top: Point = connector(Point, "Where it hangs.")
    end: Point = connector(Point, "The bob.")
    rod: Rod = Rod(length=length)
    bob: PointMass = PointMass(mass=1.0)
    connections = [connect(top, rod.a), connect(rod.b, bob.point), connect(end, bob.point)]


class LongPendulum(Pendulum):
    """The same, longer."""

    length = 1.5


class CoupledPendulums(Scene):
    """Two pendulums side by side with a spring between their bobs."""

    left_ground: Ground = Ground()
    right_ground: Ground = Ground(position=(1.0, 0.0, 0.0))
    left: Pendulum = Pendulum()
    right: Pendulum = Pendulum()
    spring: Spring = Spring(stiffness=2.0, natural_length=1.0)
    connections = [
        connect(left_ground.frame, left.top),
        connect(right_ground.frame, right.top),
        connect(spring.a, left.end),
        connect(spring.b, right.end),
    ]
    start = {"left.rod.angle": 0.2, "right.rod.angle": 0.0}


for scene in (CoupledPendulums(), CoupledPendulums(right=LongPendulum(rod=Rod(length=1.5, mass=0.3)))):
    result = simulate(scene, t_end=10.0)
    swing = max(abs(result["right.rod.angle"]))
    print(f"{type(scene.right).__name__:13s} swings up to {swing:.4f} rad, energy drift {result.energy.max_drift:.1e}")
