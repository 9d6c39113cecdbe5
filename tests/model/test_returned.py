"""Laws that return the wrong thing, names that are not there, masses below zero: errors say what is wanted."""

import pytest

import atwood as aw
import atwood_library as lib


def with_law(mark, law) -> aw.Component:
    """Return a part between two points with one law."""

    def body(self):
        return law(self)

    body.__name__ = "law"

    class Mine(aw.Component):
        a: aw.Point = aw.connector(aw.Point, "One end.")
        b: aw.Point = aw.connector(aw.Point, "The other end.")

    return type("Mine", (Mine,), {"law": mark(body)})()


def run(part: aw.Component) -> aw.Result:
    scene = aw.Scene()
    ground, mine, bob = scene.add("ground", lib.Ground()), scene.add("part", part), scene.add("bob", lib.PointMass())
    scene.connect(ground.frame, mine.a)
    scene.connect(mine.b, bob.point)
    scene.start["bob.position.z"] = -1.0
    result = aw.simulate(scene, t_end=0.1, outputs=2)
    assert "part.nothing" not in result
    return result


LOAD = aw.Vector(1.0, 0.0, 0.0)
CONSTRAINT = aw.constraint(reaction="r", unit="N", doc="Reaction.")
OBSERVABLE = aw.observable(unit="m", doc="Something.")
EVENT = aw.event(target="stop", message="it happened")


@pytest.mark.parametrize(
    ("mark", "law", "text"),
    [
        (aw.potential, lambda self: None, "it returns nothing"),
        (aw.potential, lambda self: self.b.position, "it returns a Vector where one number is wanted"),
        (aw.dissipation, lambda self: None, "it returns nothing"),
        (aw.force, lambda self: None, "it returns nothing"),
        (aw.force, lambda self: aw.Load(self.b, LOAD), "it returns one Load and no list"),
        (aw.force, lambda self: LOAD, "it returns a Vector"),
        (aw.force, lambda self: [LOAD], "it gives a Vector where a Load or CoordinateLoad is wanted"),
        (aw.inertia, lambda self: None, "it returns nothing"),
        (aw.inertia, lambda self: aw.PointInertia((self.b,), ((1.0,),)), "it returns one PointInertia and no list"),
        (CONSTRAINT, lambda self: None, "it returns nothing"),
        (CONSTRAINT, lambda self: self.b, "where a number is wanted"),
        (OBSERVABLE, lambda self: None, "it returns nothing"),
        (OBSERVABLE, lambda self: 1.0 + "m", "the law cannot be evaluated"),
        (EVENT, lambda self: None, "it returns nothing"),
    ],
)
def test_what_a_law_returns(mark, law, text: str) -> None:
    with pytest.raises(aw.DeclarationError, match=text) as caught:
        run(with_law(mark, law))
    assert caught.value.where == "part.law"


def test_a_connector_that_is_not_there() -> None:
    with pytest.raises(aw.DeclarationError, match=r"a Mass1D has no 'point'.*Its connectors are flange, slide\."):
        _ = lib.Mass1D().point
    with pytest.raises(aw.AtwoodError, match="Did you mean 'frame'"):
        _ = lib.RigidBody().frames
    assert not hasattr(lib.Mass1D(), "point")  # it stays an AttributeError, as Python expects


def test_masses_that_add_up_to_less_than_nothing() -> None:
    negative = with_law(aw.inertia, lambda self: [aw.PointInertia((self.b,), ((-3.0,),))])
    with pytest.raises(aw.ParameterError, match="the mass of the body is -2 kg in all") as caught:
        run(negative)
    assert "part" in caught.value.where
    hole = with_law(aw.inertia, lambda self: [aw.PointInertia((self.b,), ((-0.5,),))])
    assert run(hole)["bob.acceleration.z"][0] == pytest.approx(-9.81)
