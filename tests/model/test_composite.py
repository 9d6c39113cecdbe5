import copy
import pickle

import pytest
from hypothesis import given, settings, strategies as st

import atwood as aw
from atwood.model.local.flatten import flatten
from atwood_library import Mass1D, TranslationalFriction

from .things import (
    Bar,
    Bob,
    Driven,
    Gauge,
    HeavyBob,
    Hook,
    Outer,
    Pendulum,
    Push,
    Row,
    RowScene,
    TwoPendulums,
    Wheel,
    data_of,
    two_pendulums,
)


def fixed_scene() -> aw.Scene:
    scene = aw.Scene()
    scene.add("hook", Hook())
    scene.add("bar", Bar(length=1.0))
    scene.add("bobs", [Bob(), Bob()])
    scene.add("row", Row(n=3))
    scene.connect(scene.hook.frame, scene.bar.a)
    return scene


def refuses(scene, error, attempt, words=None):
    """The attempt fails with the error, and the scene is what it was, to the last object."""
    before, parts, attributes = data_of(scene), list(scene.parts.items()), dict(scene.__dict__)
    with pytest.raises(error, match=words):
        attempt(scene)
    assert data_of(scene) == before
    assert list(scene.parts.items()) == parts
    assert set(scene.__dict__) == set(attributes)


REFUSED = {
    "unknown part": (aw.UsageError, lambda s: s.set("bat.length", 1.0), "Did you mean 'bar'"),
    "a part of a leaf": (aw.UsageError, lambda s: s.set("bar.a.x", 1.0), "no part 'a'"),
    "element beyond the array": (aw.UsageError, lambda s: s.set("bobs[2].mass", 1.0), "bobs\\[2\\]"),
    "bad value": (aw.ParameterError, lambda s: s.set("bar.length", "-1 m"), "^bar.length"),
    "bad count": (aw.ParameterError, lambda s: s.set("row.n", 0), "^row.n"),
    "name taken": (aw.DeclarationError, lambda s: s.add("bar", Bob()), "already"),
    "name of a method": (aw.DeclarationError, lambda s: s.add("connect", Bob()), "meaning of its own"),
    "name of a parameter": (aw.DeclarationError, lambda s: s.add("gravity", Bob()), "meaning of its own"),
    "no identifier": (aw.DeclarationError, lambda s: s.add("two words", Bob()), "letters"),
    "hidden name": (aw.DeclarationError, lambda s: s.add("_bob", Bob()), "letter first"),
    "trailing newline": (aw.DeclarationError, lambda s: s.add("bob\n", Bob()), "letters"),
    "no component": (aw.DeclarationError, lambda s: s.add("x", 3), "no component"),
    "a class": (aw.DeclarationError, lambda s: s.add("x", Bob), r"Call the class: Bob\(\) and not Bob"),
    "a part that is there": (aw.DeclarationError, lambda s: s.add("x", s.bar), "already there as 'bar'"),
    "a part of a class": (aw.DeclarationError, lambda s: s.add("x", Pendulum.bar), "already there as 'Pendulum.bar'"),
    "one object twice": (aw.DeclarationError, lambda s: s.add("x", [Bob()] * 2), "twice"),
    "good and bad in an array": (aw.DeclarationError, lambda s: s.add("x", [Bob(), s.bar]), "already there"),
    "itself": (aw.DeclarationError, lambda s: s.add("x", s), "part of itself"),
    "what is around": (aw.DeclarationError, lambda s: s.row.add("x", s), "part of itself"),
    "joined to itself": (aw.ConnectError, lambda s: s.connect(s.bar.a, s.bar.a), "joined to itself"),
    "unlike": (aw.ConnectError, lambda s: s.connect(s.bar.a, Wheel().groove), "not in this model"),
    "no connector": (aw.ConnectError, lambda s: s.connect(s.bar, s.hook), "Name one of its connectors: a, b, hooks"),
    "a name": (aw.ConnectError, lambda s: s.connect("bar.a", "hook.frame"), "no connector"),
    "a signal": (aw.ConnectError, lambda s: s.connect(s.bar.length, s.hook.frame), r"signals as table\.output"),
    "an array of connectors": (aw.ConnectError, lambda s: s.connect(s.bar.hooks, s.hook.frame), "hooks\\[0\\]"),
    "part of another": (aw.ConnectError, lambda s: s.connect(Bar(length=1.0).a, s.bar.b), "Add the part first"),
    "connector of a class": (aw.ConnectError, lambda s: s.connect(Pendulum.top, s.bar.b), "another class"),
    "replace by unlike": (aw.DeclarationError, lambda s: s.replace("bar", Bob()), "no connector 'a'"),
    "replace nothing": (aw.DeclarationError, lambda s: s.replace("baar", Bob()), "Did you mean 'bar'"),
    "replace by nothing": (aw.DeclarationError, lambda s: s.replace("bar", None), "no component"),
    "unknown attribute": (aw.ParameterError, lambda s: setattr(s, "gravty", 1.0), "Did you mean 'gravity'"),
    "start of nan": (aw.StartError, lambda s: s.start.update({"bar.angle": float("nan")}), "bar.angle"),
    "start as a list": (aw.StartError, lambda s: setattr(s, "start", [1]), "by path"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused_changes_nothing(case):
    error, attempt, words = REFUSED[case]
    refuses(fixed_scene(), error, attempt, words)


def test_unlike_connectors_are_named():
    scene = aw.Scene()
    scene.add("wheel", Wheel())
    scene.add("bob", Bob())
    with pytest.raises(aw.ConnectError, match=r"wheel\.groove is a Groove and bob\.point is a Point"):
        scene.connect(scene.wheel.groove, scene.bob.point)
    with pytest.raises(aw.ConnectError, match=r"wheel\.groove is a Groove and bob\.point is a Point"):

        class Wrong(aw.Model):
            wheel: Wheel = Wheel()
            bob: Bob = Bob()
            connections = [aw.connect(wheel.groove, bob.point)]


def test_wrong_class_bodies():
    stray = Bob()
    for ends, words in (
        (lambda bob: aw.connect(bob.point, bob.point), "joined to itself"),
        (lambda bob: aw.connect(bob.point, stray.point), "not declared"),
        (lambda bob: aw.connect(bob, stray), "no connector"),
        (lambda bob: (bob.point, bob.point), "no connection"),
        (lambda bob: aw.connect(Bar.hooks, bob.point), "array"),
    ):
        with pytest.raises(aw.ConnectError, match=words):

            class Wrong(aw.Model):
                bob: Bob = Bob()
                connections = [ends(bob)]

    with pytest.raises(aw.DeclarationError, match="declared as 'one' and as 'two"):

        class Twins(aw.Model):
            one: Bob = Bob()
            two = one

    with pytest.raises(aw.DeclarationError, match="no component"):

        class Broken(Pendulum):
            bar = 3

    with pytest.raises(aw.DeclarationError, match="build"):

        class Open(aw.Model):
            n: int = aw.parameter(2, integer=True, doc="How many.")
            bar: Bar = Bar(length=1.0, count=n)
            connections = [aw.connect(bar.hooks[0], bar.a)]


# -- each its own -----------------------------------------------------------------------------------------------------


def test_prototypes_are_never_shared():
    one, other = Outer(), Outer()
    for path in ("left", "left.upper", "left.upper.bar", "pair[0]", "pair[1].bob"):
        assert one[path] is not other[path]
    one.set("left.upper.bob.mass", 9.0)
    one.pair[0].length = 7.0
    one.left.start["upper.bar.angle"] = 2.0
    one.left.connect(one.left.hook.frame, one.left.lower.bob.point)
    assert data_of(other) == data_of(Outer())
    assert Pendulum.bob.path == ""
    assert Outer.left.start["upper.bar.angle"] is TwoPendulums.tilt


def test_a_copy_is_its_own():
    scene = Outer()
    scene.add("extra", Row(n=2))
    twin = scene.copy()
    assert data_of(twin) == data_of(scene)
    before = data_of(scene)
    twin.set("extra.n", 4)
    twin.set("left.length", 2.0)
    twin.start["x.y"] = 1.0
    twin.connect(twin.extra["bobs[0]"].point, twin.left.hook.frame)
    assert data_of(scene) == before
    assert twin["extra.bobs[3]"].path == "extra.bobs[3]"
    assert twin.extra.copy().path == ""


def test_deepcopy_and_pickle():
    for scene in (Outer(), two_pendulums(), RowScene(n=4)):
        assert data_of(copy.deepcopy(scene)) == data_of(scene)
        assert data_of(pickle.loads(pickle.dumps(scene))) == data_of(scene)


# -- redeclaring ------------------------------------------------------------------------------------------------------


def test_a_part_is_replaced_by_keyword_subclass_or_replace():
    class Heavy(Pendulum):
        bob: Bob = HeavyBob()

    given = HeavyBob()
    made = [Pendulum(bob=given), Heavy(), Pendulum()]
    made[2].replace("bob", HeavyBob())
    for pendulum in made:
        assert data_of(pendulum)["parts"] == data_of(made[0])["parts"]
        assert pendulum.bob.mass == 5.0
        assert pendulum.bob.path == "bob"
    given.mass = 1.0
    assert made[0].bob.mass == 5.0  # a copy was taken
    for attempt in (lambda: Pendulum(bob=Bar(length=1.0)), lambda: Pendulum().replace("bob", Hook())):
        with pytest.raises(aw.DeclarationError, match="cannot take the place of a Bob"):
            attempt()
    with pytest.raises(aw.DeclarationError, match="cannot take the place of a Bob"):

        class Wrong(Pendulum):
            bob: Bob = Wheel()


def test_a_part_of_a_model_in_a_model_is_replaced_by_its_path():
    scene, other = Outer(), Outer()
    new = scene.replace("left.upper.bob", HeavyBob(mass=7.0))
    assert scene.left.upper.bob is new is scene["left.upper.bob"]
    assert new.path == "left.upper.bob"
    other.left.upper.replace("bob", HeavyBob(mass=7.0))
    assert data_of(scene) == data_of(other)
    assert data_of(scene.copy()) == data_of(scene)
    scene.replace("pair[1].bob", HeavyBob())
    assert scene.pair[1].bob.mass == 5.0
    with pytest.raises(aw.DeclarationError, match="cannot take the place of a HeavyBob"):
        scene.replace("left.upper.bob", Bar(length=1.0))
    with pytest.raises(aw.DeclarationError, match=r"left\.upper\.bob: it has no parts of its own"):
        scene.replace("left.upper.bob.hand", Bob())
    with pytest.raises(aw.UsageError, match="Did you mean 'upper'"):
        scene.replace("left.uper.bob", Bob())


def test_what_takes_the_place_of_a_part_must_have_all_its_connected_ends():
    class Deep(aw.Model):
        row: Row = Row(n=3)
        hook: Hook = Hook()

        def build(self):
            self.connect(self.hook.frame, self.row.bobs[2].point)

    model = Deep()
    refuses(model, aw.ConnectError, lambda m: m.replace("row", Row(n=2)), r"^row\.bobs\[2\]\.point")
    model.replace("row", Row(n=4))

    class Direct(aw.Model):
        row: Row = Row(n=3)
        hook: Hook = Hook()
        connections = [aw.connect(hook.frame, row["bobs[2]"].point)]

    assert len(Direct(row=Row(n=5)).row.bobs) == 5
    with pytest.raises(aw.ConnectError, match="connected with hook"):
        Direct(row=Row(n=1))
    with pytest.raises(aw.ConnectError, match="connected with hook"):

        class Shorter(Direct):
            row: Row = Row(n=2)


def test_arrays_are_replaced_as_arrays_or_one_by_one():
    scene = Outer(pair=[Pendulum(mass=8.0), Pendulum(mass=9.0)])
    assert [one.mass for one in scene.pair] == [8.0, 9.0]
    for wrong in (Pendulum(), [Pendulum()], [Pendulum(), Bob()], [Pendulum(), 3]):
        with pytest.raises(aw.DeclarationError, match=r"Outer\.pair"):
            Outer(pair=wrong)
    old = scene.pair[1]
    new = scene.replace("pair[1]", Pendulum(mass=3.0))
    assert scene.pair[1] is new is scene["pair[1]"]
    assert new.path == "pair[1]"
    with pytest.raises(aw.ConnectError, match="Add the part first"):
        scene.connect(old.top, scene.left.hook.frame)

    class Longer(Outer):
        pair: list[Pendulum] = [Pendulum(length=3.0), Pendulum(length=4.0)]

    assert [one.length for one in Longer().pair] == [3.0, 4.0]
    assert len(flatten(Longer()).connections) == len(flatten(Outer()).connections)


def test_an_heir_keeps_what_it_does_not_change():
    class Damped(TwoPendulums):
        gravity = 3.0
        brake: Push = Push()
        connections = [aw.connect(brake.point, TwoPendulums.lower.bob.point)]
        start = {"upper.bar.angle": 1.0}

    flat = flatten(Damped())
    assert flat.gravity == 3.0
    assert flat.connections[:2] == flatten(TwoPendulums()).connections[:2]
    assert ("brake.point", "lower.bob.point") in flat.connections
    assert flat.start == {"upper.bar.angle": 1.0}
    assert flat.guess == {"lower.bob.position.x": 0.05}


def test_parts_and_connections_of_all_bases_count():
    class Mixed(Pendulum, Driven):
        bob: Bob = HeavyBob()

    model = Mixed()
    assert set(model.parts) == {"bar", "bob", "push"}
    assert {("push.point", "bob.point"), ("bar.b", "bob.point")} < set(flatten(model).connections)


# -- building from parameters -----------------------------------------------------------------------------------------


def test_a_changed_count_keeps_what_was_set_and_added():
    scene = aw.Scene()
    row = scene.add("row", Row(n=3))
    hook = scene.add("hook", Hook())
    scene.connect(hook.frame, row.bobs[0].point)
    first = row.bobs[0]
    first.mass = 7.0
    scene.set("row.bar1.count", 2)
    push = row.add("push", Push(value=2.0))
    row.connect(push.point, row.bobs[1].point)
    row.replace("bobs[1]", HeavyBob())
    scene.set("row.n", 5)
    assert row.bobs[0] is first
    assert row.push is push
    assert [bob.mass for bob in row.bobs] == [7.0, 5.0, 1.0, 1.0, 1.0]
    assert type(row.bobs[1]) is HeavyBob
    assert row["bar1"].count == 2
    first.mass = 8.0  # whoever held a part still holds the real one
    connections = flatten(scene).connections
    assert flatten(scene).parts["row.bobs[0]"].values["mass"] == 8.0
    assert connections.count(("row.push.point", "row.bobs[1].point")) == 1
    assert len(connections) == 2 * 4 + 2
    row.pitch = "2 m"
    assert row["bar3"].length == 2.0
    assert [bob.mass for bob in row.bobs] == [8.0, 5.0, 1.0, 1.0, 1.0]
    row.n = 2
    assert list(row.parts) == ["bobs[0]", "bobs[1]", "bar0", "push"]


def test_a_count_that_would_tear_a_connection_is_refused():
    scene = aw.Scene()
    scene.add("row", Row(n=3))
    scene.add("hook", Hook())
    scene.connect(scene.hook.frame, scene.row.bobs[2].point)
    refuses(scene, aw.ConnectError, lambda s: s.set("row.n", 2), r"^row\.bobs\[2\]\.point: it is connected with hook")
    scene.set("row.n", 4)
    row = Row(n=3)
    push = row.add("push", Push())
    row.connect(push.point, row.bobs[2].point)
    refuses(row, aw.ConnectError, lambda r: setattr(r, "n", 1), "would no longer be there")


def test_connectors_of_an_array_have_the_names_that_it_counts():
    bar = Bar(length=1.0, count=12)
    names = [*bar.connectors(), "hooks", "hooks[12]", "hooks[07]", "hooks[-1]", "hooks[]", "hooks[1", "hooks[\u0663]"]
    names += ["a[0]", "hooks[1][2]", "hooks[" + 5000 * "9" + "]"]
    found = [name for name in names if bar._connector_named(name) is not None]
    assert found == ["a", "b", *(f"hooks[{i}]" for i in range(12))]


def test_a_failing_build_changes_nothing():
    class Fragile(aw.Model):
        n: int = aw.parameter(1, integer=True, doc="How many.")

        def build(self):
            for i in range(self.n):
                if i == 3:
                    raise ValueError("too many")
                self.add(f"bob{i}", Bob())

    model = Fragile(n=2)
    model.bob1.mass = 3.0
    refuses(model, ValueError, lambda m: setattr(m, "n", 5), "too many")
    assert model.n == 2
    with pytest.raises(ValueError, match="too many"):
        Fragile(n=4)


def test_a_count_can_be_that_of_the_model_around():
    scene = RowScene()
    assert len(scene.row.bobs) == 3
    assert scene["row.bar0"].length == 0.2
    scene.set("row.bobs[0].mass", 4.0)
    row = scene.row
    scene.n = 5
    assert scene.row is row
    assert [bob.mass for bob in row.bobs] == [4.0, 1.0, 1.0, 1.0, 1.0]
    refuses(scene, aw.ParameterError, lambda s: setattr(s, "n", 21))
    twin = scene.copy()
    twin.n = 1
    assert (len(twin.row.bobs), len(scene.row.bobs)) == (1, 5)

    class Nested(aw.Scene):
        m: int = aw.parameter(2, integer=True, doc="How many.")
        inner: RowScene = RowScene(n=m)

    nested = Nested(m=4)
    assert len(nested["inner.row"].bobs) == 4
    nested.m = 6
    assert len(nested["inner.row"].bobs) == 6
    nested.inner.n = 2
    nested.m = 9
    assert len(nested["inner.row"].bobs) == 2


def test_what_a_build_does_to_parts_is_its_own_to_change():
    class Tuned(aw.Model):
        x: float = aw.parameter(1.0, unit="kg", doc="Mass.")

        def build(self):
            bob = self.add("bob", Bob())
            bob.mass = 2 * self.x
            row = self.add("row", Row(n=2))
            row.set("bobs[0].mass", self.x)

    model = Tuned()
    model.x = 5.0
    assert (model.bob.mass, model["row.bobs[0]"].mass) == (10.0, 5.0)
    model.bob.mass = 1.0
    model.row.n = 3
    model.x = 6.0
    assert (model.bob.mass, len(model.row.bobs)) == (1.0, 3)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 6), st.integers(0, 5), st.floats(1e-9, 9.0)), max_size=12))
def test_any_order_of_counts_and_masses_gives_the_last_ones(steps):
    row = Row(n=1)
    wanted = [1.0]
    for n, index, mass in steps:
        row.n = n
        wanted = [*wanted, *[1.0] * n][:n]
        if index < n:
            row.bobs[index].mass = mass
            wanted[index] = mass
        assert [bob.mass for bob in row.bobs] == wanted
        assert [one.path for one in row.parts.values()] == list(row.parts)
    assert len(flatten(row).connections) == 2 * (len(wanted) - 1)


# -- signals ----------------------------------------------------------------------------------------------------------


def test_an_output_drives_an_input():
    scene = aw.Scene()
    gauge, push = scene.add("gauge", Gauge()), scene.add("push", Push())
    scene.connect(push.input("value"), gauge.output("value"))
    assert flatten(scene).links == {("push", "value"): ("gauge", "value")}
    assert flatten(scene).connections == ()
    for attempt, error in (
        (lambda: scene.connect(push.input("value"), gauge.output("reach")), aw.ConnectError),
        (lambda: scene.connect(push.input("value"), push.input("value")), aw.ConnectError),
        (lambda: scene.connect(push.input("value"), gauge.point), aw.ConnectError),
        (lambda: scene.connect(gauge.output("value"), gauge.output("reach")), aw.ConnectError),
        (lambda: push.input("valu"), aw.DeclarationError),
        (lambda: gauge.output("valu"), aw.DeclarationError),
    ):
        refuses(scene, error, lambda _, attempt=attempt: attempt())
    other = scene.add("other", Gauge())
    scene.connect(other.output("value"), push.input("value"))
    with pytest.raises(aw.DeclarationError, match="two outputs"):
        flatten(scene)


def test_a_model_passes_its_input_on():
    assert flatten(Driven(pull=3.0)).parts["push"].signals == {"value": 3.0}

    class Twice(aw.Scene):
        strength: float = aw.signal("2 kN", unit="N", doc="Force.")
        inner: Driven = Driven(pull=strength)
        gauge: Gauge = Gauge()

    scene = Twice()
    assert flatten(scene).parts["inner.push"].signals == {"value": 2000.0}
    scene.strength = lambda t: 5 * t
    assert flatten(scene).parts["inner.push"].signals["value"](2.0) == 10.0
    scene.connect(scene.gauge.output("value"), scene.inner.input("pull"))
    assert flatten(scene).links == {("inner.push", "value"): ("gauge", "value")}
    with pytest.raises(aw.DeclarationError, match="no arithmetic"):
        _ = 2 * Driven.pull
    with pytest.raises(aw.ParameterError, match="cannot follow the input"):
        Bob(mass=Driven.pull)


def test_what_could_be_joined_instead_is_named():
    scene = aw.Scene()
    mass, brake = scene.add("mass", Mass1D()), scene.add("brake", TranslationalFriction())
    for ends in ((mass.flange, brake.b), (brake.b, mass.flange)):
        with pytest.raises(aw.ConnectError, match=r"Connect mass\.slide, a Slide, instead of mass\.flange\."):
            scene.connect(*ends)
