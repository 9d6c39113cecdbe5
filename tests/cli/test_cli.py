"""The command line, mostly in this process."""

import json
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from atwood.cli import main
from atwood.cli.output import strict
from atwood.cli.summary import sparkline
from atwood.model.compose.serialization import GROUP
from atwood.result.files import load_result

FILE = Path(__file__).with_name("scenes_for_tests.py")

installed = pytest.mark.skipif(not entry_points(group=GROUP), reason="the library makes itself known when installed")


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, arguments, catch_exceptions=False)


def run_json(*arguments: str) -> dict:
    def refuse(name: str) -> float:
        raise AssertionError(f"{name} is not strict JSON")

    done = run(*arguments, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout, parse_constant=refuse)


# -- run ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("form", "level", "states", "multipliers"),
    [("reduced", "", 2, []), ("dae", "ggl", 6, ["rod.fixed_distance"]), ("dae", "index1", 5, ["rod.fixed_distance"])],
)
def test_run_as_json(form: str, level: str, states: int, multipliers: list[str]) -> None:
    choice = ["--form", form, *(["--level", level] if level else [])]
    data = run_json("run", f"{FILE}:Swing", "--outputs", "11", *choice)
    assert {
        "scene", "form", "level", "degrees_of_freedom", "coordinates", "speeds", "multipliers", "states", "solver",
        "start", "end", "energy", "constraint_max",
    } <= data.keys()  # fmt: skip
    assert (data["scene"], data["form"], data["level"]) == ("Swing", form, level)
    assert data["degrees_of_freedom"] == 1
    assert data["states"] == states
    assert data["multipliers"] == multipliers
    assert len(data["coordinates"]) == len(data["speeds"])
    assert set(data["solver"]) == {
        "name", "why", "choices", "steps", "residual_evaluations", "jacobian_evaluations", "wall_s"
    }  # fmt: skip
    (used,) = data["solver"]["choices"]
    assert used["solver"] == ("ida" if level == "index1" else "explicit")
    assert data["solver"]["why"] == f"{used['name']}: {used['reason']}"
    assert data["solver"]["steps"] > (10 if level == "index1" else 4)
    assert set(data["energy"]) >= {"start", "end", "max_drift"}
    assert data["energy"]["max_drift"] < 1e-4
    assert data["constraint_max"] < (1e-12 if level != "index1" else 1e-5)
    assert data["start"]["rod.angle"] == pytest.approx(0.5)
    assert data["asked"]["rtol"] == 1e-8
    assert {"atwood", "scikit-sundae", "sundials", "numpy", "python"} <= data["versions"].keys()


def test_both_forms_give_the_same_paths_and_agree() -> None:
    one = run_json("run", f"{FILE}:Swing", "--rtol", "1e-10")
    other = run_json("run", f"{FILE}:Swing", "--rtol", "1e-10", "--form", "dae")
    assert one["end"].keys() == other["end"].keys()
    for path, value in one["end"].items():
        assert other["end"][path] == pytest.approx(value, abs=1e-6), path


def test_parameters_and_start_values_can_be_set_with_units() -> None:
    data = run_json(
        "run", f"{FILE}:Swing", "--set", "rod.length=50 cm", "--set", "gravity=0", "--start", "rod.angle=30 deg",
        "--start", "rod.angular_velocity=2", "--t-end", "1.5",
    )  # fmt: skip
    assert data["end"]["rod.angle"] == pytest.approx(np.pi / 6.0 + 3.0, abs=1e-6)
    assert data["end"]["rod.tension"] == pytest.approx(3.0 * 0.5 * 4.0, rel=1e-6)
    assert data["t_end"] == 1.5
    assert data["asked"]["set"] == ["rod.length=50 cm", "gravity=0"]


def test_a_run_is_shown_as_text() -> None:
    done = run("run", f"{FILE}:Swing", "--form", "dae")
    assert done.exit_code == 0
    for word in (
        "Swing, dae, explicit",
        "1 degree of freedom",
        "Dormand-Prince 8(5,3)",
        "rod.tension",
        "before projection",
    ):
        assert word in done.stdout
    assert done.stderr == ""


def test_of_many_events_the_first_and_the_last_are_shown_in_order() -> None:
    text = run("run", "bouncing-ball").stdout
    lines = [line for line in text.splitlines() if line.startswith(("event", "    "))]
    assert [line.startswith("event") for line in lines] == [True] * 12 + [False] + [True] * 4
    assert lines[12].strip() == "83 more events until t = 8.57854 s: --json shows all"
    assert lines[-1].endswith("t = 8.57894918 s, floor: impacts have accumulated: it rests")
    assert "work -9.81 J" in text


def test_work_that_is_rounding_is_not_shown() -> None:
    text = run("run", "newtons-cradle").stdout
    assert "energy     -47.8491 J to -47.8491 J; the balance" in text


@pytest.mark.parametrize("suffix", ["nc", "npz", "csv"])
def test_a_run_is_saved(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"swing.{suffix}"
    data = run_json("run", f"{FILE}:Swing", "--outputs", "5", "--save", str(file))
    saved = load_result(file)
    assert len(saved.time) == 5
    assert saved["rod.angle"][-1] == data["end"]["rod.angle"]


def test_a_run_is_plotted(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    file = tmp_path / "swing.svg"
    assert run("run", f"{FILE}:Swing", "--plot", str(file)).exit_code == 0
    assert "<svg" in file.read_text(encoding="utf-8")


@installed
def test_a_run_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    files = [tmp_path / name for name in ("front.svg", "above.svg", "moving.gif", "plane.png")]
    for file, view in zip(files[:2], ("0,0", "0,90"), strict=True):
        done = run("run", "free-body", "--t-end", "0.5", "--outputs", "11", "--draw", str(file), "--view", view)
        assert done.exit_code == 0, done.output
        assert f"drawn: {file}" in done.stdout
    assert files[0].read_text(encoding="utf-8") != files[1].read_text(encoding="utf-8")
    assert run("run", "free-body", "--t-end", "0.1", "--outputs", "5", "--draw", str(files[2])).exit_code == 0
    assert files[2].read_bytes().startswith(b"GIF89a")
    assert run("run", f"{FILE}:Swing", "--draw", str(files[3])).exit_code == 0
    assert files[3].read_bytes().startswith(b"\x89PNG")


@installed
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["free-body", "--view", "1,2"], "--draw FILE"),
        (["free-body", "--view", "1", "--draw", "a.png"], "azimuth and elevation in degrees"),
        (["free-body", "--view", "0,95", "--draw", "a.png"], "elevation of 95 degrees"),
        (["simple-pendulum", "--view", "1,2", "--draw", "a.png"], "always seen from the front"),
        (["free-body", "--draw", "a.avi"], ".gif"),
    ],
)
def test_what_cannot_be_drawn(arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    done = run("run", *arguments)
    assert done.exit_code == 1
    assert said in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("solver", ["auto", "ida", "explicit", "taylor"])
def test_what_came_before_a_failure_is_saved(solver: str, tmp_path: Path) -> None:
    file = tmp_path / "before.npz"
    done = run("run", f"{FILE}:ends", "--solver", solver, "--save", str(file), "--json")
    assert done.exit_code == 1
    error = json.loads(done.stdout)["error"]
    assert error["where"] == "push"
    assert "the input 'value' has no value" in error["message"]
    assert f"up to t = 0.5 s, is in {file}" in done.stderr
    saved = load_result(file)
    assert saved.time[-1] == pytest.approx(0.5, abs=1e-3)
    assert len(saved.time) > 40
    assert saved["bob.velocity.x"][-1] == pytest.approx(-0.5, abs=0.01)
    assert not run("run", f"{FILE}:ends").stdout


def test_a_scene_that_cannot_start_saves_nothing(tmp_path: Path) -> None:
    file = tmp_path / "nothing.npz"
    done = run("run", f"{FILE}:raises", "--save", str(file))
    assert done.exit_code == 1
    assert not file.exists()


def test_the_largest_step_and_what_solves_it_are_said() -> None:
    shown = run("run", f"{FILE}:Swing", "--max-step", "0.01", "--no-progress").stdout
    assert "Dormand-Prince 8(5,3): its coordinates are independent" in " ".join(shown.split())
    data = run_json("run", f"{FILE}:Swing", "--max-step", "0.01")
    assert data["asked"]["max_step"] == 0.01
    assert data["solver"]["steps"] >= 100


def test_a_limit_ends_a_run_early_and_says_so() -> None:
    data = run_json("run", f"{FILE}:Swing", "--max-steps", "3")
    assert data["status"] == "step_limit"
    assert data["t_end"] < 1.0
    assert "out of steps" in run("run", f"{FILE}:Swing", "--max-steps", "3").stdout


# -- where scenes come from --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["Swing", "make", "instance"])
def test_a_scene_can_be_a_class_a_function_or_an_instance(name: str) -> None:
    data = run_json("run", f"{FILE}:{name}", "--outputs", "2")
    assert data["scene"] == name


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("broken", [":25", "-1", "length"]),
        ("raises", [":30", "KeyError"]),
        ("number", ["no scene"]),
        ("Swng", ["Swng", "'Swing'"]),
    ],
)
def test_errors_in_a_file_are_placed(name: str, parts: list[str]) -> None:
    done = run("run", f"{FILE}:{name}")
    assert done.exit_code == 1
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ")
    assert len(done.stderr.splitlines()) == 1
    for part in parts:
        assert part in done.stderr


def test_a_file_that_is_not_python(tmp_path: Path) -> None:
    file = tmp_path / "bad.py"
    file.write_text("x = 1\ny = (\n", encoding="utf-8")
    done = run("info", f"{file}:x")
    assert done.exit_code == 1
    assert "bad.py:2" in done.stderr


def test_a_file_with_two_scenes_must_say_which(tmp_path: Path) -> None:
    file = tmp_path / "two.py"
    file.write_text("from atwood import Scene\nclass A(Scene): ...\nclass B(Scene): ...\n", encoding="utf-8")
    done = run("info", str(file))
    assert done.exit_code == 1
    assert "A, B" in done.stderr
    assert run("info", str(FILE.with_name("nothing.py"))).exit_code == 1


@installed
def test_an_unknown_scene_gets_a_near_match() -> None:
    done = run("run", "simple-pendlum")
    assert done.exit_code == 1
    assert "simple-pendulum" in done.stderr
    assert "atwood list" in run("run", "xyzzy").stderr


def test_errors_are_json_too() -> None:
    done = run("run", f"{FILE}:Swing", "--set", "bob.mas=1", "--json")
    assert done.exit_code == 1
    error = json.loads(done.stdout)["error"]
    assert set(error) == {"message", "where", "advice"}
    assert "mas" in error["message"]
    assert "mass" in error["advice"]
    assert done.stderr.startswith("Error: ")


@pytest.mark.parametrize(
    "arguments",
    [
        ["--t-end", "-1"],
        ["--rtol", "2"],
        ["--set", "rod.length=nan"],
        ["--set", "rod.length=-1"],
        ["--set", "rod.length"],
        ["--start", "rod.angle=x"],
        ["--start", "rod.angel=1"],
        ["--start", "bob.position.x=7"],
        ["--save", "result.xyz"],
        ["--save", "no/such/directory/result.nc"],
        ["--plot", "result"],
    ],
)
def test_bad_input_is_one_line_and_exit_code_one(arguments: list[str]) -> None:
    done = run("run", f"{FILE}:Swing", *arguments)
    assert done.exit_code == 1
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("arguments", [["run"], ["rnu"], ["run", "x", "--form", "dea"], ["run", "x", "--outputs", "1"]])
def test_bad_usage_is_exit_code_two(arguments: list[str]) -> None:
    assert run(*arguments).exit_code == 2


@pytest.mark.parametrize(
    ("arguments", "command", "said"),
    [
        (["run", "--json"], "main run", "Missing argument 'SCENE'"),
        (["rnu", "--json"], "main", "No such command 'rnu'"),
        (["--form", "dae", "--json", "run"], "main", "No such option"),
        (["run", "x", "--json", "--form", "dea"], "main run", "'dea' is not one of"),
        (["modes", "x", "--json", "--nothing"], "main modes", "No such option"),
    ],
)
def test_bad_usage_is_json_too_where_that_is_asked_for(arguments: list[str], command: str, said: str) -> None:
    done = run(*arguments)
    error = json.loads(done.stdout)["error"]
    assert done.exit_code == 2
    assert said in error["message"]
    assert error["where"] == command
    assert error["advice"] == f"Try '{command} --help'."
    assert said in done.stderr


# -- list, info, compare -----------------------------------------------------------------------------------------------


@installed
def test_list() -> None:
    assert "double-pendulum" in run("list").stdout
    scenes = run_json("list")["scenes"]
    assert {"simple-pendulum", "four-bar"} <= {one["name"] for one in scenes}
    assert all(one["summary"] for one in scenes)


def test_info() -> None:
    data = run_json("info", f"{FILE}:Swing")
    assert data["degrees_of_freedom"] == 1
    assert data["constraints"] == 1
    assert data["loops"] == 0
    assert data["bodies"] == ["bob"]
    assert data["joints"] == ["rod"]
    assert data["coordinates"] == ["rod.angle"]
    assert data["redundant"] == data["merged"] == data["dropped"] == []
    assert data["states"] == {"reduced": 2, "dae": 6}
    assert data["operations"]["reduced"]["sin"] == 1
    text = run("info", f"{FILE}:Swing").stdout
    assert "1 degree of freedom" in text
    assert "rod.length" in text


def test_compare(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    file = tmp_path / "compare.png"
    arguments = ["compare", f"{FILE}:Swing", "--t-end", "0.5", "--rtol", "1e-4", "--rtol", "1e-6"]
    data = run_json(*arguments, "--plot", str(file))
    assert len(data["rows"]) == 2 * len({(row["form"], row["level"], row["solver"]) for row in data["rows"]}) >= 10
    for row in data["rows"]:
        assert {
            "form", "level", "solver", "rtol", "error", "wall_s", "steps", "energy_drift", "constraint_drift",
        } <= row.keys()  # fmt: skip
    assert file.stat().st_size > 1000
    text = run(*arguments).stdout
    assert "Errors are against" in text
    assert "index1-projected" in text


# -- the process -------------------------------------------------------------------------------------------------------


def python(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False, env=environment())


def environment() -> dict[str, str]:
    import os

    root = Path(__file__).resolve().parents[2]
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(root / "src"), str(root / "library")])}


HEAVY = ("sympy", "scipy", "matplotlib", "sksundae", "networkx")


def test_starting_imports_nothing_heavy() -> None:
    done = python("-c", f"import sys, atwood.cli; print([m for m in {HEAVY} if m in sys.modules])")
    assert done.stdout.strip() == "[]", done.stderr


@pytest.mark.parametrize("command", [["--help"], ["run", "--help"], ["--version"], ["list"]])
def test_help_imports_nothing_heavy(command: list[str]) -> None:
    done = python("-X", "importtime", "-m", "atwood.cli", *command)
    assert done.returncode == 0, done.stderr
    loaded = {line.rpartition("|")[2].strip().split(".")[0] for line in done.stderr.splitlines()}
    assert "click" in loaded
    assert not loaded & set(HEAVY)


def test_the_package_is_a_command() -> None:
    done = python("-m", "atwood", "--help")
    assert done.returncode == 0
    assert done.stdout.startswith("Usage: atwood ")


@pytest.mark.skipif(sys.platform == "win32", reason="signals differ")
def test_ctrl_c_shows_and_saves_what_is_done(tmp_path: Path) -> None:
    file = tmp_path / "part.npz"
    script = (
        "import os, signal, threading\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it\n"
        "from atwood.cli import main\n"
        "from atwood.integrators.explicit_session import ExplicitSession\n"
        "inner, timers = ExplicitSession.sample, []\n"
        "def sample(*arguments):\n"
        "    if not timers:  # once it takes steps, however long it took to get there\n"
        "        timers.append(threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)))\n"
        "        timers[0].start()\n"
        "    return inner(*arguments)\n"
        "ExplicitSession.sample = sample\n"
        f"main(['run', {str(FILE) + ':Swing'!r}, '--t-end', '1e6', '--json', '--save', {str(file)!r}])\n"
    )
    done = python("-c", script)
    assert done.returncode == 130, done.stderr
    data = json.loads(done.stdout)
    assert data["status"] == "interrupted"
    assert 0.0 < data["t_end"] < 1e6
    assert load_result(file).time[-1] == data["t_end"]
    assert "Interrupted" in done.stderr


# -- small things ------------------------------------------------------------------------------------------------------


def test_numbers_that_json_does_not_know_become_null() -> None:
    data = {"a": float("nan"), "b": [np.float64(1.5), float("inf")], "c": np.int64(2), "d": np.bool_(True), "e": None}
    assert strict(data) == {"a": None, "b": [1.5, None], "c": 2, "d": True, "e": None}
    assert json.dumps(strict(data), allow_nan=False)


def test_sparklines() -> None:
    assert sparkline(np.linspace(0.0, 1.0, 8), 8) == "▁▂▃▄▅▆▇█"
    assert set(sparkline(np.ones(5))) == {"─"}
    assert sparkline(np.array([np.nan])) == ""


def test_a_start_value_that_the_scene_fixes_can_be_let_go() -> None:
    pytest.importorskip("atwood_library")
    end = run_json(
        "run", "simple-pendulum", "--t-end", "0.1", "--start", "rod.angle=free", "--start", "bob.position.x=0.5"
    )
    assert end["start"]["bob.position.x"] == pytest.approx(0.5)
    assert end["start"]["rod.angle"] == pytest.approx(np.arcsin(0.5))


@pytest.mark.parametrize("option", ["--start", "--set"])
def test_an_angle_beyond_a_turn_without_a_unit_is_warned_of(option: str) -> None:
    path = "rod.angle" if option == "--start" else "release_angle"
    done = run("run", "simple-pendulum", "--t-end", "0.01", option, f"{path}=90")
    assert f"Warning: {option} {path}: it is taken as 90 rad, which is 5156.62 degrees" in done.stderr
    assert "write '90 deg'" in done.stderr
    for value in ("90 deg", "3.1", "90 rad"):
        assert "Warning" not in run("run", "simple-pendulum", "--t-end", "0.01", option, f"{path}={value}").stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no such device")
@pytest.mark.parametrize("command", [["list"], ["--help"], ["list", "--json"]])
def test_standard_output_that_is_full_is_said_without_a_traceback(command: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "atwood", *command],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            env=environment(),
            check=False,
        )
    assert done.returncode == 1
    assert done.stderr.startswith("Error: standard output: it cannot be written (No space left on device).")
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr


def test_warnings_are_lines_of_their_own() -> None:
    done = python("-m", "atwood", "run", "simple-pendulum", "--rtol", "1e-20", "--t-end", "0.1")
    assert done.returncode == 0
    first = done.stderr.splitlines()[0]
    assert first.startswith("Warning: rtol = 1e-20 is below what rounding allows")
    assert ".py" not in done.stderr
