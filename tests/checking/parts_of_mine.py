"""Components that somebody could write: one that is sound, and one for each kind of mistake."""

import atwood as aw
from atwood import (
    Component,
    Frame,
    Load,
    Placement,
    Point,
    connector,
    constraint,
    discrete_state,
    dissipation,
    force,
    joint,
    observable,
    parameter,
    potential,
    update,
)


class Sound(Component):
    """A spring that hardens."""

    stiffness: float = parameter(3.0, unit="N/m^3", minimum=0.0, doc="Force for an extension by one metre.")
    length: float = parameter(1.0, unit="m", minimum=0.0, doc="Length without force.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @potential
    def energy(self):
        return self.stiffness * (self.distance(self.a, self.b) - self.length) ** 4 / 4.0


class _Pair(Component):
    """What the springs below have in common; it is no part by itself."""

    spaces = ("plane", "space")
    stiffness: float = parameter(3.0, unit="N/m", minimum=0.0, doc="Stiffness.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    def arm(self):
        return self.b.position - self.a.position


class WrongSign(_Pair):
    """Its loads grow the energy that it reports."""

    @force
    def pull(self):
        yield Load(self.b, self.arm() * self.stiffness)
        yield Load(self.a, -self.arm() * self.stiffness)

    @observable(unit="J", doc="Elastic energy.")
    def elastic_energy(self):
        return 0.5 * self.stiffness * aw.dot(self.arm(), self.arm())


class Undone(_Pair):
    """Its loads undo its potential."""

    @potential
    def energy(self):
        return 0.5 * self.stiffness * aw.dot(self.arm(), self.arm())

    @force
    def pull(self):
        yield Load(self.b, self.arm() * self.stiffness)
        yield Load(self.a, -self.arm() * self.stiffness)


class Twice(_Pair):
    """Its loads are those of its potential once more."""

    @potential
    def energy(self):
        return 0.5 * self.stiffness * aw.dot(self.arm(), self.arm())

    @force
    def pull(self):
        yield Load(self.b, -self.arm() * self.stiffness)
        yield Load(self.a, self.arm() * self.stiffness)


class Driving(_Pair):
    """Its damper drives."""

    @dissipation
    def loss(self):
        v = self.b.velocity - self.a.velocity
        return -0.5 * self.stiffness * aw.dot(v, v)


class NotAnEnergy(_Pair):
    """Its potential is a force times a stiffness."""

    @potential
    def energy(self):
        return 0.5 * self.stiffness * aw.norm(self.arm())


class WrongUnit(_Pair):
    """It reports an extension in square metres as metres."""

    @observable(unit="m", doc="Extension.")
    def extension(self):
        return aw.dot(self.arm(), self.arm())


class HiddenNumber(_Pair):
    """It holds a length that is no parameter."""

    @potential
    def energy(self):
        return 0.5 * self.stiffness * (aw.norm(self.arm()) - 0.3) ** 2


class NoReaction(_Pair):
    """It pulls at one end only."""

    @force
    def pull(self):
        yield Load(self.b, -self.arm() * self.stiffness)


class AgainstTheWorld(_Pair):
    """Its energy depends on where the scene is."""

    @potential
    def energy(self):
        return 0.5 * self.stiffness * self.b.position.x**2


class Branching(_Pair):
    """It branches with an if that numbers and expressions take differently."""

    @potential
    def energy(self):
        r = self.arm()
        far = isinstance(r.x, float) and r.x * r.x > 0.0
        return (1.0 if far else 0.5) * self.stiffness * aw.dot(r, r)


CUBE = aw.ExternalFunction("cube", lambda x: x**3, (aw.ExternalFunction("slope", lambda x: 3.3 * x * x),))


class WrongDerivative(Component):
    """Its function in Python has a derivative that is not its own."""

    spaces = ("plane",)
    size: float = parameter(1.0, unit="m", above=0.0, doc="Size.")
    scale: float = parameter(1.0, unit="J", doc="Size of the energy.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @potential
    def energy(self):
        return self.scale * aw.external(CUBE, aw.norm(self.b.position - self.a.position) / self.size)


class WrongJoint(Component):
    """A hinge that places its end off the constraint that it solves."""

    spaces = ("plane",)
    a: Frame = connector(Frame, "The frame that carries it.")
    b: Frame = connector(Frame, "The frame that turns.")

    @constraint(reaction="force", unit="N", doc="Force on b.")
    def together(self):
        return self.b.position - self.a.position

    @joint("a", "b", coordinates=("angle",), solves=("together",))
    def swing(self, angle):
        return Placement(aw.Vector(0.1, 0.0, 0.0), angle, axes="a")

    @observable(unit="rad", doc="Angle.")
    def angle(self):
        return self.b.angle - self.a.angle


class WrongName(_Pair):
    """An event that leads nowhere."""

    @aw.event(target="stopp", message="it is level", unit="m")
    def level(self):
        return self.arm().z


class BadPicture(_Pair):
    """It cannot say what it looks like."""

    def outline(self):
        return aw.Outline.box(self.stiffness, self.width, 1.0)


class Uneven(_Pair):
    """It holds where its constraint says, and its constraint is a length instead of an energy over a force."""

    @constraint(reaction="tension", unit="N*m", doc="Multiplier.")
    def together(self):
        return self.arm().x


class HalfTheForce(_Pair):
    """Its loads are half of what the energy that it reports asks for."""

    @force
    def pull(self):
        yield Load(self.a, 0.5 * self.stiffness * self.arm())
        yield Load(self.b, -0.5 * self.stiffness * self.arm())

    @observable(unit="J", doc="Energy.")
    def energy(self):
        return 0.5 * self.stiffness * aw.dot(self.arm(), self.arm())


class PushingDamper(_Pair):
    """A damper with the wrong sign."""

    damping: float = parameter(0.4, unit="N*s/m", minimum=0.0, doc="Damping.")

    @force
    def rub(self):
        speed = self.b.velocity - self.a.velocity
        yield Load(self.a, -self.damping * speed)
        yield Load(self.b, self.damping * speed)


class _Sampled(Component):
    """What the controllers below have in common."""

    period: float = parameter(0.1, unit="s", doc="Sample time.")
    y: aw.Scalar = discrete_state(unit="N", doc="Command.")


class Wordy(_Sampled):
    """Its command is a word."""

    @update(every="period", sets="y")
    def step(self):
        return "full"


class Generous(_Sampled):
    """It gives two numbers for one state."""

    @update(every="period", sets="y")
    def step(self):
        return 1.0, 2.0


class Raising(_Sampled):
    """Its update fails."""

    @update(every="period", sets="y")
    def step(self):
        return {}["gain"]
