"""Components, models and scenes that the tests of this folder share; at module level, so that they can be stored."""

from itertools import pairwise
from typing import Any

import atwood as aw
from atwood.model.declare.time_functions import write_function
from atwood.model.local.flatten import FlatScene, flatten


class Bob(aw.Component):
    """A mass point."""

    mass: float = aw.parameter(1.0, unit="kg", minimum=0.0, doc="Mass.")
    point: aw.Point = aw.connector(aw.Point, "Where it is.")

    @aw.inertia
    def material_point(self):
        yield aw.PointInertia((self.point,), ((self.mass,),))

    @aw.observable(unit="m", doc="Position.")
    def position(self):
        return self.point.position


class HeavyBob(Bob):
    """A mass point with another default."""

    mass = "5 kg"


class Bar(aw.Component):
    """A massless rod."""

    length: float = aw.parameter(unit="m", above=0.0, doc="Length.")
    direction: tuple = aw.parameter((1.0, 0.0, 0.0), size=3, structural=True, doc="A direction.")
    count: int = aw.parameter(1, integer=True, minimum=0, maximum=50, doc="A count.")
    kind: str = aw.parameter("hard", choices=("hard", "soft"), doc="A word.")
    limit: float = aw.parameter(None, unit="N", doc="A force, if there is one.")
    a: aw.Point = aw.connector(aw.Point, "One end.")
    b: aw.Point = aw.connector(aw.Point, "The other end.")
    hooks: Any = aw.connector(aw.Point, "Hooks.", count="count")

    @aw.constraint(reaction="tension", sign=-1.0, doc="Tension.")
    def fixed_distance(self):
        return self.distance(self.a, self.b) - self.length

    @aw.observable(unit="rad", doc="Angle.", spaces=("plane",))
    def angle(self):
        r = self.b.position - self.a.position
        return aw.atan2(r.x, -r.z)


class Hook(aw.Component):
    """A fixed frame."""

    frame: aw.Frame = aw.connector(aw.Frame, "The frame.")


class Wheel(aw.Component):
    """Something with a groove."""

    groove: aw.Groove = aw.connector(aw.Groove, "The groove.")


class Push(aw.Component):
    """A force as a function of time."""

    value: float = aw.signal(0.0, unit="N", doc="Force along x.")
    point: aw.Point = aw.connector(aw.Point, "Where it acts.")

    @aw.force
    def push(self):
        yield aw.Load(self.point, aw.Vector(self.value, 0.0, 0.0))


class Gauge(aw.Component):
    """A force that follows a distance."""

    gain: float = aw.parameter(2.0, unit="N/m", doc="Gain.")
    point: aw.Point = aw.connector(aw.Point, "The point.")

    @aw.observable(unit="N", doc="A force.")
    def value(self):
        return self.gain * self.point.position.x

    @aw.observable(unit="m", doc="A length.")
    def reach(self):
        return self.point.position.x


class Pendulum(aw.Model):
    """A bar with a bob."""

    length: float = aw.parameter(1.0, unit="m", above=0.0, doc="Length.")
    mass: float = aw.parameter(1.0, unit="kg", above=0.0, doc="Mass.")
    top: aw.Point = aw.connector(aw.Point, "Where it hangs.")
    bar: Bar = Bar(length=length)
    bob: Bob = Bob(mass=2.0 * mass)
    connections = [aw.connect(top, bar.a), aw.connect(bar.b, bob.point)]


class Row(aw.Model):
    """As many bobs as asked for, joined by bars."""

    n: int = aw.parameter(2, integer=True, minimum=1, maximum=20, doc="How many.")
    pitch: float = aw.parameter(0.5, unit="m", above=0.0, doc="Distance.")

    def build(self):
        bobs = self.add("bobs", [Bob() for _ in range(self.n)])
        for i, (one, other) in enumerate(pairwise(bobs)):
            bar = self.add(f"bar{i}", Bar(length=self.pitch))
            self.connect(one.point, bar.a)
            self.connect(bar.b, other.point)


class Driven(aw.Model):
    """A bob with a push; the model's own input is passed on."""

    pull: float = aw.signal(0.0, unit="N", doc="Force.")
    bob: Bob = Bob()
    push: Push = Push(value=pull)
    connections = [aw.connect(push.point, bob.point)]


class TwoPendulums(aw.Scene):
    """One pendulum below the other, declared as a class."""

    length: float = aw.parameter(0.7, unit="m", above=0.0, doc="Length of both.")
    tilt: float = aw.parameter(0.3, unit="rad", doc="Angle at the start.")
    gravity = 1.62
    hook: Hook = Hook()
    upper: Pendulum = Pendulum(length=length)
    lower: Pendulum = Pendulum(length=length / 2, mass="300 g")
    connections = [aw.connect(hook.frame, upper.top), aw.connect(upper.bob.point, lower.top)]
    start = {"upper.bar.angle": tilt, "lower.bar.angle": "30 deg"}
    guess = {"lower.bob.position.x": "5 cm"}


class RowScene(aw.Scene):
    """A row whose count is that of the scene, and another one by itself."""

    n: int = aw.parameter(3, integer=True, minimum=1, maximum=20, doc="How many.")
    row: Row = Row(n=n, pitch="20 cm")
    hook: Hook = Hook()


class Outer(aw.Scene):
    """A scene with scenes in it."""

    left: TwoPendulums = TwoPendulums(length=1.5)
    pair: list[Pendulum] = [Pendulum(), Pendulum(mass=4.0)]
    connections = [aw.connect(pair[0].top, left.hook.frame), aw.connect(pair[1].top, pair[0].bob.point)]
    start = {"left.upper.bar.angle": 0.1}


def two_pendulums() -> aw.Scene:
    """The scene of `TwoPendulums`, put together step by step."""
    scene = aw.Scene(gravity=1.62)
    hook = scene.add("hook", Hook())
    upper = scene.add("upper", Pendulum(length=0.7))
    lower = scene.add("lower", Pendulum(length="35 cm", mass=0.3))
    scene.connect(hook.frame, upper.top)
    scene.connect(upper.bob.point, lower.top)
    scene.start["upper.bar.angle"] = 0.3
    scene.start["lower.bar.angle"] = "30 deg"
    scene.guess["lower.bob.position.x"] = 0.05
    return scene


def plain(flat: FlatScene) -> dict[str, Any]:
    """A flattened scene as data that can be compared, functions of time as the steps they do."""

    def value(one):
        return write_function(one, "") if callable(one) else one

    return {
        "settings": (flat.space.name, [tuple(one) for one in flat.space.basis], flat.gravity, flat.t_start, flat.t_end),
        "parts": [
            (path, type(part.component), dict(part.values), {k: value(v) for k, v in part.signals.items()})
            for path, part in flat.parts.items()
        ],
        "connections": flat.connections,
        "links": dict(flat.links),
        "start": dict(flat.start),
        "guess": dict(flat.guess),
    }


def data_of(scene: aw.Model) -> dict[str, Any]:
    return plain(flatten(scene))
