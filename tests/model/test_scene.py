import math

import pytest

import atwood as aw
from atwood.model.local.flatten import flatten

from .things import Bob, Hook, Outer, Pendulum, TwoPendulums, data_of, two_pendulums


def test_class_style_and_imperative_style_flatten_to_the_same_data():
    assert data_of(TwoPendulums()) == data_of(two_pendulums())
    changed = TwoPendulums(length="1.2 m", tilt=0.5)
    other = two_pendulums()
    other.set("upper.length", 1.2)
    other.set("lower.length", 0.6)
    other.start["upper.bar.angle"] = 0.5
    assert data_of(changed) == data_of(other)


def test_leaves_have_dotted_paths_and_their_own_values():
    flat = flatten(Outer())
    assert list(flat.parts)[:3] == ["left.hook", "left.upper.bar", "left.upper.bob"]
    assert flat.parts["left.lower.bar"].values["length"] == 0.75
    assert flat.parts["pair[1].bob"].values["mass"] == 8.0
    assert ("pair[0].top", "left.hook.frame") in flat.connections
    assert flat.name == "Outer"
    assert flatten(Outer(), "mine").name == "mine"


def test_a_plain_model_is_taken_as_a_scene():
    flat = flatten(Pendulum())
    assert (flat.space.name, flat.gravity, flat.start) == ("plane", 9.81, {})
    with pytest.raises(aw.UsageError, match="no scene"):
        flatten(Bob())
    with pytest.raises(aw.DeclarationError, match="no parts"):
        flatten(aw.Scene())


def test_the_line_has_a_direction():
    scene = TwoPendulums(space="line", line_axis=(0, 0, -2))
    assert tuple(flatten(scene).space.line) == (0.0, 0.0, -1.0)
    scene.line_axis = (0, 0, 0)
    with pytest.raises(aw.DeclarationError, match="no length"):
        flatten(scene)
    with pytest.raises(aw.ParameterError, match="line, plane, space"):
        TwoPendulums(space="sphere")


# -- start ------------------------------------------------------------------------------------------------------------


def test_every_scene_has_its_own_start():
    one, other = TwoPendulums(), TwoPendulums()
    one.start["upper.bar.angle"] = 2.0
    del one.start["lower.bar.angle"]
    assert dict(other.start)["lower.bar.angle"] == "30 deg"
    assert flatten(TwoPendulums()).start == flatten(other).start
    assert flatten(one).start == {"upper.bar.angle": 2.0}
    assert TwoPendulums.start["lower.bar.angle"] == "30 deg"


def test_start_can_be_given_as_a_whole():
    scene = TwoPendulums()
    given = {"upper.bar.angle": 1}
    scene.start = given
    given["lower.bar.angle"] = 9.0
    scene.guess = {}
    assert flatten(scene).start == {"upper.bar.angle": 1.0}
    assert flatten(scene).guess == {}
    scene.start.update({"lower.bar.angle": "10 deg"})
    assert flatten(scene).start["lower.bar.angle"] == math.radians(10)


def test_parameters_in_the_start_follow():
    scene = TwoPendulums(tilt="20 deg")
    assert flatten(scene).start["upper.bar.angle"] == math.radians(20)
    scene.tilt = 0.1
    assert flatten(scene).start["upper.bar.angle"] == 0.1

    class Half(TwoPendulums):
        start = {"upper.bar.angle": TwoPendulums.tilt / 2}

    assert flatten(Half(tilt=0.4)).start == {"upper.bar.angle": 0.2}


def test_scenes_within_contribute_their_start_and_the_outer_one_wins():
    flat = flatten(Outer())
    assert flat.start == {"left.upper.bar.angle": 0.1, "left.lower.bar.angle": math.radians(30)}
    assert flat.guess == {"left.lower.bob.position.x": 0.05}


def test_start_values_in_text_know_their_unit():
    scene = two_pendulums()
    scene.start = {"upper.bar.angle": "90 deg", "upper.bob.position.x": "50 cm", "upper.bar.b.velocity.x": "3.6 km/h"}
    start = flatten(scene).start
    assert start == pytest.approx(
        {"upper.bar.angle": math.pi / 2, "upper.bob.position.x": 0.5, "upper.bar.b.velocity.x": 1}
    )
    for key, value in (("upper.bar.angle", "3 m"), ("upper.bob.position.x", "2 kg"), ("upper.bar.b.velocity.x", "2 m")):
        scene.start = {key: value}
        with pytest.raises(aw.StartError, match="does not measure") as caught:
            flatten(scene)
        assert caught.value.where == key
    scene.start = {"upper.bar.angle": TwoPendulums.length}
    with pytest.raises(aw.StartError, match="in m and not in rad"):
        flatten(scene)


@pytest.mark.parametrize("bad", [math.nan, math.inf, True, None, "fast", "nan", "3 parsec", [1.0], 1j, Bob], ids=repr)
def test_start_values_are_checked_when_given(bad):
    scene = two_pendulums()
    before = data_of(scene)
    for attempt in (
        lambda: scene.start.update({"upper.bar.angle": bad}),
        lambda: scene.guess.__setitem__("upper.bar.angle", bad),
        lambda: setattr(scene, "start", {"lower.bar.angle": 1.0, "upper.bar.angle": bad}),
    ):
        with pytest.raises(aw.StartError, match=r"upper\.bar\.angle"):
            attempt()
    assert data_of(scene) == before
    with pytest.raises(aw.StartError, match=r"Wrong\.upper\.bar\.angle"):

        class Wrong(TwoPendulums):
            start = {"upper.bar.angle": bad}


@pytest.mark.parametrize("bad", [3, "", None])
def test_paths_of_start_values_are_text(bad):
    with pytest.raises(aw.StartError, match="no path"):
        aw.Scene().start[bad] = 1.0


def test_a_start_that_says_nothing_by_path():
    with pytest.raises(aw.StartError, match="by path"):

        class Wrong(aw.Scene):
            start = [1.0]


def test_a_build_can_say_the_start():
    class Stack(aw.Scene):
        n: int = aw.parameter(2, integer=True, doc="How many.")
        guess = {"x": 1.0}

        def build(self):
            for i in range(self.n):
                self.add(f"bob{i}", Bob())
                self.start[f"bob{i}.position.x"] = float(i)

    scene = Stack()
    scene.start["bob0.position.x"] = 9.0
    scene.start["mine"] = 4.0
    del scene.guess["x"]
    kept = scene.start
    scene.n = 3
    assert scene.start is kept
    assert dict(scene.start) == {"bob0.position.x": 9.0, "bob1.position.x": 1.0, "bob2.position.x": 2.0, "mine": 4.0}
    assert dict(scene.guess) == {}
    scene.n = 1
    assert dict(scene.start) == {"bob0.position.x": 9.0, "mine": 4.0}


def test_looking_into_a_scene():
    scene = Outer()
    assert "left.upper.bar" in scene
    assert "left.upper.rod" not in scene
    assert list(scene) == ["left", "pair[0]", "pair[1]"]
    with pytest.raises(TypeError):
        scene.parts["x"] = Hook()
    with pytest.raises(aw.UsageError, match=r"^left\.upper: there is no part 'ba'"):
        _ = scene["left.upper.ba"]
