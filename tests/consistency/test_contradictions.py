"""Components whose laws contradict each other are refused when a scene with one of them is assembled."""

import math
import re

import pytest

import atwood as aw
from atwood_library import Ground, PointMass, RigidBody, Slider


class Wire(aw.Component):
    """A rod between points, which is sound."""

    spaces = ("plane",)
    length: float = aw.parameter(1.0, unit="m", above=0.0, doc="Length.")
    offset: float = aw.parameter(0.0, unit="rad", doc="Where the angle is zero.")
    a: aw.Point = aw.connector(aw.Point, "One end.")
    b: aw.Point = aw.connector(aw.Point, "The other end.")

    @aw.constraint(reaction="tension", unit="N", sign=-1.0, doc="Tension.")
    def wire(self):
        r = self.b.position - self.a.position
        return (aw.dot(r, r) - self.length**2) / (2.0 * self.length)

    @aw.joint("a", "b", coordinates=("angle",), solves=("wire",))
    def swing(self, angle):
        angle = angle + self.offset
        return aw.Placement(aw.Vector(self.length * aw.sin(angle), 0.0, -self.length * aw.cos(angle)))

    @aw.observable(unit="rad", doc="Angle.", periodic=True, rate="angular_velocity")
    def angle(self):
        r = self.b.position - self.a.position
        return aw.atan2(r.x, -r.z) - self.offset

    @aw.observable(unit="rad/s", doc="Rate of the angle.")
    def angular_velocity(self):
        r, v = self.b.position - self.a.position, self.b.velocity - self.a.velocity
        return (r.x * v.z - r.z * v.x) / self.length**2


class Hinge(aw.Component):
    """A hinge between frames, which is sound."""

    spaces = ("plane", "space")
    a: aw.Frame = aw.connector(aw.Frame, "The frame that carries it.")
    b: aw.Frame = aw.connector(aw.Frame, "The frame that turns.")

    @aw.constraint(reaction="force", unit="N", doc="Force on b.")
    def together(self):
        return self.b.position - self.a.position

    @aw.constraint(reaction=("lock_1", "lock_2"), unit="N*m", doc="Torque on b.", spaces=("space",))
    def upright(self):
        return aw.dot(self.a.axes[0], self.b.axes[2]), aw.dot(self.a.axes[1], self.b.axes[2])

    @aw.joint("a", "b", coordinates=("angle",), solves=("together", "upright"), spaces=("space",))
    def turn(self, angle):
        return aw.Placement(aw.Vector(0.0, 0.0, 0.0), aw.turn((0.0, 0.0, 1.0), angle), axes="a")

    @aw.joint("a", "b", coordinates=("angle",), solves=("together",))
    def turn_in_plane(self, angle):
        return aw.Placement(aw.Vector(0.0, 0.0, 0.0), angle)

    @aw.observable(unit="rad", doc="Angle.", periodic=True, rate="speed")
    def angle(self):
        if not self.in_space:
            return self.b.angle - self.a.angle
        return aw.atan2(aw.dot(self.b.axes[0], self.a.axes[1]), aw.dot(self.b.axes[0], self.a.axes[0]))

    @aw.observable(unit="rad/s", doc="Rate of the angle.")
    def speed(self):
        spin = self.b.angular_velocity - self.a.angular_velocity
        return aw.dot(spin, self.a.axes[2]) if self.in_space else -spin.y


def scene_with(part, space="plane"):
    scene = aw.Scene(space=space)
    ground, held = scene.add("ground", Ground()), scene.add("held", part)
    framed = isinstance(part.b, aw.Frame)
    body = scene.add("body", RigidBody(mass=2.0, moments=(0.3, 0.3, 0.3)) if framed else PointMass(mass=2.0))
    scene.connect(ground.frame, held.a)
    scene.connect(held.b, body.frame if framed else body.point)
    return scene


def refused(part, space="plane"):
    with pytest.raises(aw.DeclarationError) as caught:
        aw.assemble(scene_with(part, space))
    assert re.search(rf"{__name__.rpartition('.')[2]}\.py, line \d+", str(caught.value))
    return str(caught.value)


@pytest.mark.parametrize(("part", "space"), [(Wire(), "plane"), (Wire(offset=0.3), "plane"), (Hinge(), "plane")])
def test_sound_ones_are_taken(part, space):
    assert aw.assemble(scene_with(part, space)).regular is not None


def test_a_sound_hinge_in_space_is_taken():
    assert aw.assemble(scene_with(Hinge(), "space")).regular is not None


def test_a_slider_along_an_oblique_line_is_taken():
    """Its normal is square to the line but for rounding, and so is the constraint."""
    for angle in (0.3, 0.7, 1.1, 2.0, 2.9):
        axis = (math.cos(angle), 0.0, math.sin(angle))
        scene = aw.Scene(space="line", line_axis=axis)
        ground, slider = scene.add("ground", Ground()), scene.add("slider", Slider(axis=axis))
        bob = scene.add("bob", PointMass())
        scene.connect(ground.frame, slider.a)
        scene.connect(slider.b, bob.point)
        assert aw.assemble(scene).regular is not None


# -- joints against constraints ----------------------------------------------------------------------------------------


class WireOfOtherLength(Wire):
    @aw.joint("a", "b", coordinates=("angle",), solves=("wire",))
    def swing(self, angle):
        return aw.Placement(aw.Vector(self.length * aw.sin(angle), 0.0, -1.1 * self.length * aw.cos(angle)))


class WireWrongWithAnOffset(Wire):
    """Sound while the offset is zero."""

    @aw.joint("a", "b", coordinates=("angle",), solves=("wire",))
    def swing(self, angle):
        return aw.Placement(aw.Vector(self.length * aw.sin(angle + self.offset), 0.0, -self.length * aw.cos(angle)))


class HingeAboutAnotherAxis(Hinge):
    @aw.joint("a", "b", coordinates=("angle",), solves=("together", "upright"), spaces=("space",))
    def turn(self, angle):
        return aw.Placement(aw.Vector(0.0, 0.0, 0.0), aw.turn((0.0, 1.0, 0.0), angle), axes="a")


class HingeInWrongAxes(Hinge):
    """Its displacement is in the axes of a, and its constraint in those of the world."""

    @aw.constraint(reaction="force", unit="N", doc="Force on b.")
    def together(self):
        return self.b.position - self.a.position - aw.Vector(0.1, 0.0, 0.0)

    @aw.joint("a", "b", coordinates=("angle",), solves=("together",))
    def turn_in_plane(self, angle):
        return aw.Placement(aw.Vector(0.1, 0.0, 0.0), angle, axes="a")


@pytest.mark.parametrize(
    ("part", "space", "constraint"),
    [
        (WireOfOtherLength(), "plane", "wire"),
        (WireOfOtherLength(length=1e-3), "plane", "wire"),
        (WireOfOtherLength(length=1e6), "plane", "wire"),
        (WireWrongWithAnOffset(offset=0.2), "plane", "wire"),
        (HingeAboutAnotherAxis(), "space", "upright"),
        (HingeInWrongAxes(), "plane", "together"),
    ],
)
def test_a_joint_that_does_not_solve_its_constraint(part, space, constraint):
    text = refused(part, space)
    assert f"it says that it solves '{constraint}'" in text
    assert "held." in text


def test_what_is_wrong_for_some_values_only_is_found_when_they_are_given():
    aw.assemble(scene_with(WireWrongWithAnOffset()))
    refused(WireWrongWithAnOffset(offset=0.2))


class WireThatSolvesNothing(Wire):
    @aw.joint("a", "b", coordinates=("angle",))
    def swing(self, angle):
        return aw.Placement(aw.Vector(self.length * aw.sin(angle), 0.0, -self.length * aw.cos(angle)))


class HingeThatForgetsItsBearing(Hinge):
    @aw.joint("a", "b", coordinates=("angle",), solves=("together",), spaces=("space",))
    def turn(self, angle):
        return aw.Placement(aw.Vector(0.0, 0.0, 0.0), aw.turn((0.0, 0.0, 1.0), angle), axes="a")


@pytest.mark.parametrize(
    ("part", "space", "text"),
    [
        (WireThatSolvesNothing(), "plane", "of 2 ways in which 'b' can move it holds 1, and it solves none"),
        (HingeThatForgetsItsBearing(), "space", "of 6 ways in which 'b' can move it holds 5"),
    ],
)
def test_a_joint_that_holds_more_than_its_constraints(part, space, text):
    assert text in refused(part, space)


# -- coordinates against observables -----------------------------------------------------------------------------------


class WireWithTheAngleFromAbove(Wire):
    @aw.observable(unit="rad", doc="Angle.", periodic=True, rate="angular_velocity")
    def angle(self):
        r = self.b.position - self.a.position
        return aw.atan2(r.x, r.z)


class WireInDegrees(Wire):
    @aw.observable(unit="rad", doc="Angle.", periodic=True, rate="angular_velocity")
    def angle(self):
        r = self.b.position - self.a.position
        return aw.atan2(r.x, -r.z) * (180.0 / math.pi)


class HingeWithTheOtherSense(Hinge):
    @aw.joint("a", "b", coordinates=("angle",), solves=("together",))
    def turn_in_plane(self, angle):
        return aw.Placement(aw.Vector(0.0, 0.0, 0.0), -angle)


@pytest.mark.parametrize("part", [WireWithTheAngleFromAbove(), WireInDegrees(), HingeWithTheOtherSense()])
def test_an_observable_that_differs_from_the_coordinate_of_its_name(part):
    assert "the observable 'angle' is" in refused(part)


class WireWithTheRateReversed(Wire):
    @aw.observable(unit="rad/s", doc="Rate of the angle.")
    def angular_velocity(self):
        r, v = self.b.position - self.a.position, self.b.velocity - self.a.velocity
        return (r.z * v.x - r.x * v.z) / self.length**2


class HingeWithTheRateOfOneEnd(Hinge):
    """It forgets that frame a may turn as well."""

    @aw.observable(unit="rad/s", doc="Rate of the angle.")
    def speed(self):
        return -self.b.angular_velocity.y


class Gauge(aw.Component):
    """Measures a height, without any joint."""

    spaces = ("plane",)
    a: aw.Point = aw.connector(aw.Point, "One end.")
    b: aw.Point = aw.connector(aw.Point, "The other end.")

    @aw.observable(unit="m", doc="Height.", rate="climb")
    def height(self):
        return self.b.position.z - self.a.position.z

    @aw.observable(unit="m/s", doc="Rate of the height.")
    def climb(self):
        return 2.0 * (self.b.velocity.z - self.a.velocity.z)


@pytest.mark.parametrize("part", [WireWithTheRateReversed(), HingeWithTheRateOfOneEnd(), Gauge()])
def test_a_rate_that_is_not_the_derivative(part):
    assert re.search("its rate '.*' is .* where its derivative is", refused(part))


# -- names against names -----------------------------------------------------------------------------------------------


class SolvesNoName(Wire):
    @aw.joint("a", "b", coordinates=("angle",), solves=("wyre",))
    def swing(self, angle):
        return aw.Placement(aw.Vector(self.length * aw.sin(angle), 0.0, -self.length * aw.cos(angle)))


class CoordinateWithoutObservable(Wire):
    @aw.joint("a", "b", coordinates=("angel",), solves=("wire",))
    def swing(self, angel):
        return aw.Placement(aw.Vector(self.length * aw.sin(angel), 0.0, -self.length * aw.cos(angel)))


class EndsNowhere(Wire):
    @aw.joint("a", "c", coordinates=("angle",), solves=("wire",))
    def swing(self, angle):
        return aw.Placement(aw.Vector(self.length * aw.sin(angle), 0.0, -self.length * aw.cos(angle)))


class TakesNoCoordinate(Wire):
    @aw.joint("a", "b", coordinates=("angle",), solves=("wire",))
    def swing(self):
        return aw.Placement(aw.Vector(0.0, 0.0, -self.length))


class StopsNowhere(Wire):
    @aw.event(target="stopp", message="it is level")
    def level(self):
        return self.b.position.z


class ActsInNoMode(Wire):
    modes = ("taut", "slack")

    @aw.event(target="slack", message="it is level", modes=("tight",))
    def level(self):
        return self.b.position.z


class LeadsToNoMode(Wire):
    modes = ("taut", "slack")
    then: str = aw.parameter("slack", choices=("slack", "torn"), doc="What happens.")

    @aw.event(target="then", message="it is level")
    def level(self):
        return self.b.position.z


class HasNoSuchRate(Wire):
    @aw.observable(unit="rad", doc="Angle.", periodic=True, rate="angular_speed")
    def angle(self):
        r = self.b.position - self.a.position
        return aw.atan2(r.x, -r.z)


class ReportsTwice(Wire):
    @aw.observable(unit="N", doc="Tension.")
    def tension(self):
        return 0.0


@pytest.mark.parametrize(
    ("part", "text"),
    [
        (SolvesNoName(), "it names a constraint 'wyre' that does not exist"),
        (CoordinateWithoutObservable(), "it names an observable 'angel' that does not exist"),
        (EndsNowhere(), "it names a connector 'c' that does not exist"),
        (TakesNoCoordinate(), "it takes nothing and its coordinates are 'angle'"),
        (StopsNowhere(), "its target 'stopp' is no mode, nor 'stop'"),
        (ActsInNoMode(), "it names a mode 'tight' that does not exist"),
        (LeadsToNoMode(), "its target 'then' offers a mode 'torn' that does not exist"),
        (HasNoSuchRate(), "it names an observable 'angular_speed' that does not exist"),
        (ReportsTwice(), "its reaction 'tension' has the name of an observable"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, aw.Component) else "",
)
def test_names_that_name_nothing(part, text):
    assert text in refused(part)


def test_a_near_name_is_offered():
    assert "Did you mean 'wire'?" in refused(SolvesNoName())
    assert "Did you mean 'stop'?" in refused(StopsNowhere())


class HasAParameterCalledStop(Wire):
    """Its parameter has the name of what every event can lead to."""

    stop: float = aw.parameter(3.0, unit="m", doc="Where something else stops.")

    @aw.event(target="stop", message="it is high enough", unit="m")
    def high(self):
        return self.b.position.z + 0.9


def test_a_parameter_called_stop_leaves_the_end_of_the_run_alone():
    scene = scene_with(HasAParameterCalledStop())
    scene.start["held.angle"], scene.start["held.angular_velocity"] = 0.0, 2.0
    result = aw.simulate(scene, t_end=5.0)
    assert result.time[-1] < 1.0
    assert result["body.position.z"][-1] == pytest.approx(-0.9, abs=1e-7)


# -- what it costs -----------------------------------------------------------------------------------------------------


def test_a_class_is_looked_at_once(monkeypatch):
    from atwood.consistency import check

    class Fresh(Wire):
        pass

    looked, look = [], check.contradictions
    monkeypatch.setattr(check, "contradictions", lambda part, space: looked.append(part.path) or look(part, space))
    for length in (1.0, 2.0, 3.0):
        aw.assemble(scene_with(Fresh(length=length)))
        aw.assemble(scene_with(Fresh(length=length)), form="dae")
    assert [path for path in looked if path == "held"] == ["held", "held"]  # where a length is one, and where it is not


class WireOfARoot(Wire):
    """A rod whose placement has a root in the place of a cosine: right as long as it hangs."""

    @aw.joint("a", "b", coordinates=("angle",), solves=("wire",))
    def swing(self, angle):
        x = aw.sin(angle + self.offset)
        return aw.Placement(aw.Vector(self.length * x, 0.0, -self.length * aw.sqrt(1.0 - x * x)))


class Bar(aw.Component):
    """A guide along x, on which a bead keeps on one side of z = 0 from a place on."""

    spaces = ("plane",)
    a: aw.Point = aw.connector(aw.Point, "Where it begins.")
    b: aw.Point = aw.connector(aw.Point, "The bead.")

    @aw.constraint(reaction="push", unit="N", doc="Force on the bead.")
    def guide(self):
        return self.b.position.z - self.a.position.z

    @aw.joint("a", "b", coordinates=("way",), solves=("guide",))
    def slide(self, way):
        return aw.Placement(aw.Vector(way, 0.0, aw.maximum(-way - 5.0, 0.0)))

    @aw.observable(unit="m", doc="How far it is.")
    def way(self):
        return self.b.position.x - self.a.position.x


@pytest.mark.parametrize(("part", "text"), [(WireOfARoot(), "the observable 'angle' is"), (Bar(), "solves 'guide'")])
def test_what_is_wrong_far_from_zero_only_is_found(part, text):
    assert text in refused(part)


class BarThatIsSquared(aw.Component):
    """A guide on a frame, whose constraint is the square of a distance, which nothing can be held by."""

    spaces = ("plane",)
    a: aw.Frame = aw.connector(aw.Frame, "Where it begins.")
    b: aw.Point = aw.connector(aw.Point, "The bead.")

    def seen(self):
        return self.a.to_frame(self.b.position - self.a.position)

    @aw.constraint(reaction="push", unit="N", doc="Force on the bead.")
    def guide(self):
        return self.seen().z ** 2

    @aw.joint("a", "b", coordinates=("way",), solves=("guide",))
    def slide(self, way):
        return aw.Placement(aw.Vector(way, 0.0, 0.0), axes="a")

    @aw.observable(unit="m", doc="How far it is.")
    def way(self):
        return self.seen().x


def test_a_square_that_is_to_be_zero_holds_nothing():
    assert "of 2 ways in which 'b' can move it holds 1, and the constraints" in refused(BarThatIsSquared())


class WireWithALengthTooFew(Wire):
    """A rod whose rate forgets a length, which does not matter while that is one."""

    @aw.observable(unit="rad/s", doc="Rate of the angle.")
    def angular_velocity(self):
        r, v = self.b.position - self.a.position, self.b.velocity - self.a.velocity
        return (r.x * v.z - r.z * v.x) / self.length


def test_a_power_of_one_does_not_hide_what_is_wrong_with_other_values():
    aw.assemble(scene_with(WireWithALengthTooFew()))
    assert "its rate 'angular_velocity' is" in refused(WireWithALengthTooFew(length=2.0))


class GuideThatTurnsALittle(aw.Component):
    """A guide that keeps its end from turning, with a placement that turns it by less than what counts as wrong."""

    spaces = ("plane",)
    a: aw.Frame = aw.connector(aw.Frame, "What carries it.")
    b: aw.Frame = aw.connector(aw.Frame, "What slides.")

    @aw.constraint(reaction="push", unit="N", doc="Force on b.")
    def guide(self):
        return self.a.to_frame(self.b.position - self.a.position).z

    @aw.constraint(reaction="torque", unit="N*m", doc="Torque on b.")
    def lock(self):
        return self.b.angle - self.a.angle

    @aw.joint("a", "b", coordinates=("way",), solves=("guide", "lock"))
    def slide(self, way):
        return aw.Placement(aw.Vector(way, 0.0, 0.0), 1e-8 * way, axes="a")

    @aw.observable(unit="m", doc="How far it is.")
    def way(self):
        return self.a.to_frame(self.b.position - self.a.position).x


def test_a_turn_too_small_to_be_told_from_none_is_refused_by_name():
    scene = aw.Scene()
    ground, guide, body = (
        scene.add("ground", Ground()),
        scene.add("guide", GuideThatTurnsALittle()),
        RigidBody(mass=1.0),
    )
    scene.add("body", body)
    scene.connect(ground.frame, guide.a)
    scene.connect(guide.b, body.frame)
    with pytest.raises(aw.UnsupportedError, match=r"guide.slide: a coordinate of it turns b"):
        aw.simulate(scene)
