"""Looking up parts by the command line: what there is, and what each has."""

import json

import pytest
from click.testing import CliRunner, Result

import atwood_library
from atwood import Component
from atwood.cli import main
from atwood.cli.parts import parts_called

OFFERED = {name: getattr(atwood_library, name) for name in atwood_library.__all__}
PARTS = [name for name, one in OFFERED.items() if isinstance(one, type) and issubclass(one, Component)]


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, arguments, catch_exceptions=False)


def test_every_part_is_listed_with_a_line() -> None:
    listed = json.loads(run("list", "--parts", "--json").output)["parts"]
    assert sorted(one["name"] for one in listed) == sorted(PARTS)
    assert all(one["summary"].endswith(".") for one in listed)
    text = run("list", "--parts").output
    assert all(name in text for name in PARTS)


@pytest.mark.parametrize("name", PARTS)
def test_every_part_says_what_it_has(name: str) -> None:
    kind = getattr(atwood_library, name)
    data = json.loads(run("info", name, "--json").output)
    assert [one["name"] for one in data.get("parameters", [])] == list(kind.parameter_specs())
    assert [one["name"].removesuffix("[...]") for one in data.get("connectors", [])] == list(kind.connector_specs())
    assert [one["name"] for one in data.get("inputs", [])] == list(kind.signal_specs())
    text = run("info", name).output
    for heading in ("connectors", "parameters", "inputs", "quantities", "parts"):
        assert all(one["name"] in text for one in data.get(heading, []))


def test_a_hinge_has_its_quantities_with_units_and_spaces() -> None:
    data = json.loads(run("info", "Pivot", "--json").output)
    units = {one["name"]: one["unit"] for one in data["quantities"]}
    assert units == {
        "angle": "rad", "angular_velocity": "rad/s", "torque": "N*m", "force": "N", "bearing_1": "N*m",
        "bearing_2": "N*m", "above_lower_stop": "rad", "above_lower_stop_state": "", "lower_stop_torque": "N*m",
        "below_upper_stop": "rad", "below_upper_stop_state": "", "upper_stop_torque": "N*m",
    }  # fmt: skip
    meanings = {one["name"]: one["meaning"] for one in data["quantities"]}
    assert meanings["angle"].endswith("(plane and space only)")
    assert meanings["torque"].endswith("(space only)")
    assert not meanings["force"].endswith("only)")


def test_defaults_are_written_as_a_reader_would() -> None:
    def default(part: str, name: str) -> str:
        rows = json.loads(run("info", part, "--json").output)["parameters"]
        return next(one["default"] for one in rows if one["name"] == name)

    assert default("MeshBody", "file") == "required"
    assert default("Pivot", "axis") == "(0, -1, 0)"
    assert default("Box", "density") == "none"
    assert default("Rope", "starts") == "taut (or slack)"


def test_a_connector_says_with_which_choice_it_is_there() -> None:
    rows = json.loads(run("info", "Force", "--json").output)["connectors"]
    assert {one["name"]: one["meaning"].partition(" (")[2] for one in rows} == {
        "point": "with resolved_in=world or other)", "frame": "with resolved_in=body)",
        "other": "with resolved_in=other)",
    }  # fmt: skip


def test_a_part_made_of_parts_names_them() -> None:
    parts = json.loads(run("info", "Wheel", "--json").output)["parts"]
    assert {one["name"]: one["kind"] for one in parts} == {
        "bearing": "Pivot", "rim": "Rim", "contact": "RollingDisc"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("Pivott",), "Pivott: there is no such part. Did you mean 'Pivot'?"),
        (("Zzz",), "See `atwood list --parts`."),
        (("LagrangeTop",), "The scene is 'lagrange-top'."),
        (("Pivot", "--set", "stiffness=1"), "this is a part"),
    ],
)
def test_what_is_no_part_is_refused(arguments: tuple[str, ...], said: str) -> None:
    result = run("info", *arguments)
    assert result.exit_code != 0
    assert said in result.output


@pytest.mark.parametrize("word", ["Revolute", "revolute", "hinge", "pin joint"])
def test_a_part_is_found_by_what_others_call_it(word: str) -> None:
    assert json.loads(run("info", word, "--json").output)["part"] == "Pivot"
    assert "Also called: Revolute" in run("info", word).output


def test_parts_that_share_a_synonym_are_all_shown() -> None:
    found = json.loads(run("info", "RollingWheel", "--json").output)["parts"]
    assert [one["part"] for one in found] == ["RollingDisc", "Wheel"]


def test_a_synonym_is_not_inherited() -> None:
    class Loose(atwood_library.Pivot):
        """A hinge of one's own."""

    assert "synonyms" not in vars(Loose)
    assert list(parts_called("Revolute")) == ["Pivot"]


def test_no_part_has_its_own_name_as_a_synonym() -> None:
    for name in PARTS:
        assert name not in vars(getattr(atwood_library, name)).get("synonyms", ())


def test_a_run_stops_at_a_condition_and_notes_others() -> None:
    arguments = ("run", "simple-pendulum", "--until", "rod.angle crosses 0", "--record", "rod.angle falls below 20 deg")
    found = json.loads(run(*arguments, "--json").output)
    assert found["status"] == "stopped"
    assert [one["what"] for one in found["happenings"]] == ["rod.angle falls below 20 deg", "rod.angle crosses 0"]
    assert "stopped: at t = " in run(*arguments, "--no-progress").output
    wrong = CliRunner().invoke(main, ["run", "simple-pendulum", "--until", "rod.angle croses 0"])
    assert wrong.exit_code == 1
    assert "Did you mean 'crosses'?" in wrong.output


def test_a_word_that_is_no_name_finds_what_mentions_it() -> None:
    found = json.loads(run("info", "motor", "--json").output)["mentioned"]
    assert {"what": "part", "name": "Rotor"}.items() <= next(one for one in found if one["name"] == "Rotor").items()
    assert "clutches" in [one["name"] for one in found], "scenes are found too"
    assert "Rotor" in run("info", "motor").output


@pytest.mark.parametrize("word", ["fluid", "flexible", "zzz"])
def test_a_word_that_nothing_mentions_says_where_to_look(word: str) -> None:
    refused = CliRunner().invoke(main, ["info", word])
    assert refused.exit_code == 1
    assert "atwood list --parts" in refused.stderr


@pytest.mark.parametrize("word", ["rigidbody", "rigid-body", "RIGID BODY", "rigid_body"])
def test_a_part_is_found_however_its_name_is_written(word: str) -> None:
    assert list(parts_called(word)) == ["RigidBody"]
    assert json.loads(run("info", word, "--json").output)["part"] == "RigidBody"
