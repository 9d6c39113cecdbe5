"""Scenes that the tests of the command line give as files."""

from atwood import Scene, connect, log
from atwood_library import Force, Ground, PointMass, Rod


class Swing(Scene):
    """A bob on a rod."""

    ground: Ground = Ground()
    rod: Rod = Rod(length=2.0)
    bob: PointMass = PointMass(mass=3.0)
    connections = [connect(ground.frame, rod.a), connect(rod.b, bob.point)]
    start = {"rod.angle": 0.5, "rod.angular_velocity": 0.0}
    t_end = 1.0


def make():
    print("this goes to standard error")
    return Swing(gravity=1.0)


def broken():
    scene = Scene()
    scene.add("rod", Rod(length=-1.0))  # line 25
    return scene


def raises():
    return {}["missing"]  # line 30


instance = Swing()
number = 3


def ends():
    """Return a scene that cannot go on after 0.5 s."""
    scene = Scene(gravity=0.0, t_end=2.0)
    bob = scene.add("bob", PointMass())
    push = scene.add("push", Force(value=lambda t: log(1.0 - 2.0 * t)))
    scene.connect(push.point, bob.point)
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": 0.0, "bob.velocity.x": 0.0, "bob.velocity.z": 0.0})
    return scene
