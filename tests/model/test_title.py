"""What a scene is called: by its class, by its variable, or as one says."""

import pickle

import pytest

import atwood
from atwood import Scene
from atwood_library import Ground, PointMass, Rod
from atwood_library.scenes import DoublePendulum


def built() -> Scene:
    scene = Scene()
    ground, rod, bob = scene.add("ground", Ground()), scene.add("rod", Rod(length=1.0)), scene.add("bob", PointMass())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    return scene


def test_a_class_gives_its_name():
    crane = DoublePendulum()
    assert atwood.assemble(crane).flat.name == "DoublePendulum"


def test_a_plain_scene_has_the_name_of_its_variable():
    crane = built()
    assert atwood.assemble(crane).flat.name == "crane"
    assert atwood.report(crane).scene == "crane"
    assert atwood.sweep(crane, {"rod.length": [1.0]}, t_end=0.1).scene == "crane"
    result = atwood.simulate(crane, t_end=0.1)
    assert repr(result).startswith("<Result of crane")
    assert pickle.loads(pickle.dumps(result)).assembly.flat.name == "crane"
    assert atwood.assemble(crane).with_values({"rod.length": 2.0}).flat.name == "crane"
    assert atwood.assemble(crane, name="hoist").flat.name == "hoist"


def test_a_word_that_says_nothing_leaves_the_name_to_the_caller():
    def run(scene: Scene) -> str:
        return atwood.assemble(scene).flat.name

    crane = built()
    assert run(crane) == "crane"
    assert run(built()) == "Scene"
    _hidden = built()
    assert run(_hidden) == "Scene"


def test_the_nearest_variable_counts():
    def run(hoist: Scene) -> str:
        return atwood.assemble(hoist).flat.name

    crane = built()
    assert run(crane) == "hoist"


def test_an_empty_scene_is_named_in_the_error():
    crane = Scene()
    with pytest.raises(atwood.DeclarationError, match=r"^crane: the scene has no parts"):
        atwood.assemble(crane)
