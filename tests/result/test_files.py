"""Saving and loading results."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.io import netcdf_file

from atwood import ResultError, Scene, UsageError
from atwood.pipeline import simulate
from atwood.result import files
from atwood.result.files import load_result, save_result
from atwood.result.result import Result
from atwood_library import Ground, PointMass, Rod


@pytest.fixture(scope="module")
def result() -> Result:
    scene = Scene(t_end=0.5)
    ground = scene.add("ground", Ground())
    rods = scene.add("rod", [Rod(length=0.5), Rod(length=0.7)])
    bobs = scene.add("bob", [PointMass(), PointMass(mass=2.0)])
    scene.connect(ground.frame, rods[0].a)
    scene.connect(rods[0].b, bobs[0].point)
    scene.connect(rods[0].b, rods[1].a)
    scene.connect(rods[1].b, bobs[1].point)
    scene.start["rod[0].angle"] = 1.0
    return simulate(scene, form="dae", outputs=21)


@pytest.mark.parametrize("suffix", [".nc", ".npz", ".csv", ".NC"])
def test_round_trip_is_exact(result: Result, tmp_path: Path, suffix: str) -> None:
    file = result.save(tmp_path / f"run{suffix}")
    saved = load_result(file)
    assert saved.paths == result.paths
    assert np.array_equal(saved.time, result.time)
    for path in result.paths:
        assert np.array_equal(saved[path], result[path]), path
        assert saved.unit(path) == result.unit(path)
    assert saved.at(-1) == result.at(-1)
    assert saved.group("rod[1]").keys() == result.group("rod[1]").keys()
    assert [one.name for one in tmp_path.iterdir()] == [file.name]


@pytest.mark.parametrize("suffix", [".nc", ".npz"])
def test_what_is_known_about_a_run_is_kept(result: Result, tmp_path: Path, suffix: str) -> None:
    saved = load_result(result.save(tmp_path / f"run{suffix}"))
    assert saved.status == "finished"
    assert saved.metadata["form"] == "dae"
    assert saved.metadata["solver"]["steps"] == result.statistics.steps
    assert saved.metadata["asked"]["start"] == {"rod[0].angle": 1.0}
    assert "numpy" in saved.metadata["versions"]
    assert saved.describe("rod[0].tension") == result.describe("rod[0].tension")


def test_netcdf_is_read_by_others(result: Result, tmp_path: Path) -> None:
    file = result.save(tmp_path / "run.nc")
    with netcdf_file(str(file), "r", mmap=False) as data:
        variable = data.variables["rod_0.angle"]
        assert variable.dimensions == ("time",)
        assert variable.units == b"rad"
        assert variable.path == b"rod[0].angle"
        assert variable.long_name
        assert data.variables["time"].units == b"s"


def test_names_that_netcdf_cannot_tell_apart() -> None:
    taken: set[str] = set()
    names = [files._netcdf_name(path, taken) for path in ("rod[0].angle", "rod_0.angle", "a.längs")]
    assert names == ["rod_0.angle", "rod_0.angle_2", "a.l_ngs"]


def test_csv_is_plain(result: Result, tmp_path: Path) -> None:
    file = result.save(tmp_path / "run.csv", ["rod[0].angle", "rod[0].tension"])
    with file.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream))
    assert rows[0] == ["time [s]", "rod[0].angle [rad]", "rod[0].tension [N]"]
    assert len(rows) == 23
    assert rows[-1][0].startswith("# rows: 21")
    assert np.array_equal(np.loadtxt(file, delimiter=",", skiprows=1)[:, 1], result["rod[0].angle"])
    assert float(rows[-2][1]) == result["rod[0].angle"][-1]


@pytest.mark.parametrize("name", ["run", "run.txt", "run.mat"])
def test_unknown_suffix(result: Result, tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError, match=r"\.nc .*\.npz .*\.csv"):
        result.save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_failed_write_leaves_what_was_there(result: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "run.npz"
    file.write_text("before", encoding="utf-8")

    def fail(stream: object, arrays: object) -> None:
        stream.write(b"half")  # type: ignore[attr-defined]
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files, "_savez", fail)
    with pytest.raises(UsageError, match="No space left"):
        save_result(result, file)
    assert file.read_text(encoding="utf-8") == "before"
    assert [one.name for one in tmp_path.iterdir()] == ["run.npz"]


def test_reading_what_is_no_result(result: Result, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such file"):
        load_result(tmp_path / "run.nc")
    with pytest.raises(UsageError, match="no such directory"):
        result.save(tmp_path / "missing" / "run.nc")
    for suffix in (".nc", ".npz", ".csv"):
        file = tmp_path / f"wrong{suffix}"
        file.write_bytes(b"something else, that is no result\n1,2,3\n")
        with pytest.raises(UsageError, match="no result"):
            load_result(file)
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(UsageError, match="no result"):
        load_result(tmp_path / "other.npz")


def test_unknown_quantities(result: Result, tmp_path: Path) -> None:
    saved = load_result(result.save(tmp_path / "run.npz", ["rod[0].angle"]))
    with pytest.raises(ResultError, match=r"rod\[0\]\.angle"):
        saved.array("rod[0].angel")
    with pytest.raises(ResultError):
        saved["bob"]
    with pytest.raises(ResultError):
        result.save(tmp_path / "run.npz", ["rod[0].angel"])
