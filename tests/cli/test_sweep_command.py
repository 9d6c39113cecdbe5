"""`atwood sweep`."""

import csv
import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from atwood.cli import main
from atwood.errors import UsageError
from atwood.pipeline import simulate
from atwood.ranges import values_of
from atwood_library.scenes import DoublePendulum

FILE = Path(__file__).with_name("scenes_for_tests.py")
SWING = f"{FILE}:Swing"


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["sweep", *arguments], catch_exceptions=False)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0.5:2:4", [0.5, 1.0, 1.5, 2.0]),
        ("0:90:4deg", ["0.0 deg", "30.0 deg", "60.0 deg", "90.0 deg"]),
        ("1:1:1", [1.0]),
        ("2:-2:3 m/s", ["2.0 m/s", "0.0 m/s", "-2.0 m/s"]),
        ("1,2,5", [1.0, 2.0, 5.0]),
        ("1,2,5 kg", ["1 kg", "2 kg", "5 kg"]),
        ("1 kg,500 g", ["1 kg", "500 g"]),
        ("stop,slack", ["stop", "slack"]),
    ],
)
def test_values(text: str, values: list[object]) -> None:
    assert values_of(text) == values


@pytest.mark.parametrize("text", ["1:2", "1:2:0", "a:2:3", "1:2:3:4", "1,,2", "1:2:-3"])
def test_values_that_say_nothing(text: str) -> None:
    with pytest.raises(UsageError):
        values_of(text)


def scene_file(folder: Path) -> str:
    file = folder / "scene.py"
    file.write_text("from atwood_library.scenes import DoublePendulum\n\n\ndef make():\n    return DoublePendulum()\n")
    return f"{file}:make"


def test_json_holds_every_run(tmp_path: Path) -> None:
    scene = scene_file(tmp_path)
    options = ["--vary", "mass2=0.5:1.5:2", "--vary-start", "rod1.angle=10:50:2deg", "--t-end", "0.5"]
    done = run(scene, *options, "--quantity", "bob2.position.x", "--json")
    assert done.exit_code == 0, done.output
    data = json.loads(done.stdout)
    assert data["shape"] == [2, 2]
    assert data["parameters"]["mass2"] == [0.5, 0.5, 1.5, 1.5]
    assert data["status"] == ["finished"] * 4
    for k, mass in enumerate(data["parameters"]["mass2"]):
        made = DoublePendulum(mass2=mass)
        made.start["rod1.angle"] = data["start"]["rod1.angle"][k]
        alone = simulate(made, t_end=0.5).array("bob2.position.x")[-1]
        assert data["quantities"]["bob2.position.x"][k][0] == pytest.approx(alone, rel=1e-9)


def test_few_runs_are_shown_one_by_one_and_many_by_their_extremes(tmp_path: Path) -> None:
    scene = scene_file(tmp_path)
    few = run(scene, "--vary", "mass2=1,2,3 kg", "--t-end", "0.2")
    assert few.exit_code == 0
    assert "3 finished" in few.stdout
    assert "3 of 3 many at a time" in few.stdout
    many = run(scene, "--vary", "mass2=0.5:2:40", "--t-end", "0.2", "--threads", "1")
    assert "smallest" in many.stdout
    assert "40 finished" in many.stdout
    assert "1 thread" in many.stdout


def test_failures_are_named(tmp_path: Path) -> None:
    done = run(scene_file(tmp_path), "--vary-start", "bob1.position.x=1,0.5", "--t-end", "0.2")
    assert done.exit_code == 0
    assert "1 finished, 1 failed" in done.stdout
    assert "run 1:" in done.stdout
    assert "contradict" in done.stdout


def test_files(tmp_path: Path) -> None:
    scene = scene_file(tmp_path)
    done = run(
        scene,
        "--vary",
        "mass2=1,2",
        "--t-end",
        "0.2",
        "--save",
        str(tmp_path / "a.csv"),
        "--plot",
        str(tmp_path / "a.png"),
    )
    assert done.exit_code == 0, done.output
    with (tmp_path / "a.csv").open(newline="") as file:
        assert [float(row["mass2 [kg]"]) for row in csv.DictReader(file)] == [1.0, 2.0]
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
    mapped = run(
        scene,
        "--vary",
        "mass2=1:2:3",
        "--vary-start",
        "rod1.angle=0:1:3",
        "--t-end",
        "0.1",
        "--plot",
        str(tmp_path / "b.svg"),
    )
    assert mapped.exit_code == 0, mapped.output
    assert "<svg" in (tmp_path / "b.svg").read_text()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ([], "nothing is varied"),
        (["--vary", "mass2"], "Write --vary PATH=VALUE"),
        (["--vary", "mas2=1,2"], "Did you mean 'mass2'"),
        (["--vary", "mass2=1,2 m"], "kg"),
        (["--vary-start", "rod1.angel=1,2"], "rod1.angle"),
        (["--vary", "mass2=1,2", "--quantity", "bob3"], "bob2"),
        (["--vary", "mass2=1,2", "--save", "a.xyz"], "suffix"),
        (["--vary", "mass2=1,2", "--plot", "nowhere/a.png"], "no such directory"),
        (["--vary", "mass2=1,2", "--vary", "mass1=1,2,3", "--combine", "list"], "differ in length"),
    ],
)
def test_bad_input(tmp_path: Path, options: list[str], said: str) -> None:
    done = run(scene_file(tmp_path), *options)
    assert done.exit_code != 0
    assert said in done.stderr
    assert "Traceback" not in done.output
