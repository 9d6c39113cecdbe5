"""Errors read well, keep their pieces, and hint at what was meant."""

import pickle

import pytest

from atwood import Component, Point, Scalar, Scene, assemble, connector, errors, potential
from atwood.errors import AtwoodError, ParameterError, is_about, near_matches, suggestion, suggestion_in_parts
from atwood_library import PointMass


@pytest.mark.parametrize(
    ("where", "message", "advice", "text"),
    [
        ("", "mass is negative", "", "mass is negative"),
        ("crane.rope", "mass is negative", "", "crane.rope: mass is negative"),
        ("", "mass is negative", "Give a positive one.", "mass is negative. Give a positive one."),
        ("crane.rope", "mass is negative.", "Give one.", "crane.rope: mass is negative. Give one."),
        ("a", "no parameter 'mas'", "Did you mean 'mass'?", "a: no parameter 'mas'. Did you mean 'mass'?"),
        ("a", "is it a rope?", "Say so.", "a: is it a rope? Say so."),
    ],
)
def test_the_pieces_read_as_one_text(where: str, message: str, advice: str, text: str) -> None:
    error = AtwoodError(message, where=where, advice=advice)
    assert str(error) == text
    assert (error.message, error.where, error.advice) == (message, where, advice)


def test_every_public_error_is_an_atwood_error_with_a_docstring() -> None:
    classes = [getattr(errors, name) for name in errors.__all__ if name[0].isupper()]
    assert len(classes) == 11
    for cls in classes:
        assert issubclass(cls, AtwoodError)
        assert cls.__doc__
        with pytest.raises(AtwoodError, match=r"^here: wrong$"):
            raise cls("wrong", where="here")


def test_an_error_survives_the_way_between_processes() -> None:
    error = pickle.loads(pickle.dumps(ParameterError("too heavy", where="m1", advice="Take less.")))
    assert isinstance(error, ParameterError)
    assert str(error) == "m1: too heavy. Take less."


def test_near_matches_ignore_case_and_keep_the_spelling() -> None:
    assert near_matches("MASS", ["length", "Mass", "mast"]) == ["Mass", "mast"]
    assert near_matches("mass", ["Mass", "mass", "mast"], n=2) == ["Mass", "mass"]
    assert near_matches("mass", ["mass", "mass"]) == ["mass"]
    assert near_matches("mass", []) == []
    assert near_matches("mass", ["mass"], n=0) == []


def test_a_suggestion_names_what_looks_alike() -> None:
    assert suggestion("mas", ["mass", "length"]) == "Did you mean 'mass'?"
    assert suggestion("Frame_", ["frame_a", "frame_b"]) == "Did you mean 'frame_b' or 'frame_a'?"
    assert suggestion("ab", ["abc", "abd", "abe"]).count("'") == 6


def test_a_suggestion_lists_a_short_choice_and_says_nothing_of_a_long_one() -> None:
    assert suggestion("zzz", ["mass", "length"]) == "There is 'length', 'mass'"
    assert suggestion("zzz", [f"parameter{i}" for i in range(40)]) == ""
    assert suggestion("zzz", []) == ""


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("hinge.rate", "hinge has angle, force.x/y/z."),
        ("hinge.angel", "Did you mean 'hinge.angle'?"),
        ("hing.angle", "Did you mean 'hinge.angle'?"),
        ("car.wheel.rate", "car.wheel has turns."),
        ("car.motor.rate", "car has wheel.turns, speed."),
        ("zzz", "There are quantities of hinge, car.wheel, car."),
    ],
)
def test_what_a_part_has_is_said_where_nothing_looks_alike(path, expected):
    known = ["hinge.angle", "hinge.force.x", "hinge.force.y", "hinge.force.z", "car.wheel.turns", "car.speed"]
    assert suggestion_in_parts(path, known) == expected


@pytest.mark.parametrize(("where", "inside"), [("rod1", True), ("rod1.a", True), ("rod10", False), ("rod10.a", False)])
def test_a_part_is_not_one_whose_name_begins_alike(where: str, inside: bool) -> None:
    assert is_about(AtwoodError("it is wrong", where=where), "rod1") is inside


def test_a_law_that_asks_another_part_says_its_own() -> None:
    class Asks(Component):
        point: Point = connector(Point, "Where.")

        @potential
        def energy(self) -> Scalar:
            raise ParameterError("a wrong value", where="rod10.length")

    scene = Scene()
    bob, rod1 = scene.add("bob", PointMass()), scene.add("rod1", Asks())
    scene.connect(rod1.point, bob.point)
    with pytest.raises(ParameterError, match="a wrong value") as caught:
        assemble(scene)
    assert caught.value.where == "rod1.energy"
