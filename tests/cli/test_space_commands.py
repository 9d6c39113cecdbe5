"""What the commands show of scenes in space: turns, vectors and arrays, in few words."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from atwood.cli import main


def lines(*arguments: str) -> list[str]:
    result = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return [line.rstrip() for line in result.output.splitlines()]


def shown(*arguments: str) -> list[str]:
    """Return the names in the table of quantities."""
    listing = lines(*arguments)
    first = next(i for i, line in enumerate(listing) if line.startswith("quantity")) + 1
    last = next(i for i, line in enumerate(listing) if "more quantit" in line)
    return [line.split()[0] for line in listing[first:last]]


@pytest.mark.parametrize("orientation", ["quaternion", "euler-zyz"])
def test_of_a_body_that_turns_freely_its_spin_is_shown(orientation: str) -> None:
    names = shown("run", "free-body", "--t-end", "0.1", "--orientation", orientation)
    assert names == [f"body.{what}.{axis}" for what in ("position", "spin") for axis in "xyz"]


def test_what_does_not_move_comes_after_what_does_and_what_pulls() -> None:
    names = shown("run", "gyroscope", "--t-end", "0.1")
    assert names.index("inner.position.x") < names.index("ground.force.z")
    assert "outer.position.x" not in names  # it is at rest


HUNG = """
from atwood import Scene
from atwood_library import Cylinder, Ground, Spherical


def hung():
    scene = Scene(space="space")
    ground = scene.add("ground", Ground())
    ball = scene.add("ball", Spherical())
    rod = scene.add("rod", Cylinder(length=1.0, radius=0.1, axis="z"))
    scene.connect(ground.frame, ball.a)
    scene.connect(ball.b, rod.b)
    return scene
"""


def test_no_minus_zero_is_shown(tmp_path: Path) -> None:
    file = tmp_path / "hung.py"
    file.write_text(HUNG)
    listing = lines("run", f"{file}:hung", "--t-end", "0.1")
    row = next(line.split() for line in listing if line.startswith("rod.position.x"))
    assert row[1:5] == ["0", "0", "0", "0"]


def test_parameters_of_arrays_keep_their_values_and_units() -> None:
    listing = lines("info", "four-bar-row", "--set", "space=space")
    row = next(line.split() for line in listing if line.startswith("foot[0..2].stiffness"))
    assert row[1:3] == ["0", "N*m/rad"]


@pytest.mark.parametrize("width", [40, 60, 80])
def test_no_name_and_no_value_is_cut_where_the_terminal_is_narrow(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    listing = lines("info", "simple-pendulum")
    rows = [line.split() for line in listing[listing.index("") + 2 :]]
    assert ["rod.length", "1", "m"] in [row[:3] for row in rows]
    assert not any("…" in line for line in listing)


def test_what_a_start_leaves_free_is_said_in_its_own_words() -> None:
    text = " ".join(" ".join(lines("info", "free-body")).split())
    assert "the orientation of body" in text
    assert "no start value for body.position.x/y/z, the orientation of body, body.position.x'/y'/z':" in text
    assert "coordinates body.position.x/y/z, body.quaternion.w/x/y/z" in text


def test_several_start_values_follow() -> None:
    assert any("top.z_axis.z follow from the other start values" in line for line in lines("info", "lagrange-top"))


@pytest.mark.parametrize(
    ("name", "said"),
    [("", "it defines no scene, but functions: hung."), (":hang", "the file defines no 'hang'. Did you mean 'hung'?")],
)
def test_a_file_with_functions_says_their_names(tmp_path: Path, name: str, said: str) -> None:
    file = tmp_path / "hung.py"
    file.write_text(f"{HUNG}\n\ndef other(length):\n    return hung()\n")
    result = CliRunner().invoke(main, ["info", f"{file}{name}"])
    assert result.exit_code != 0
    assert said in result.output
