"""Saving and loading results."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import netcdf_file

from atwood import ResultError, Scene, UsageError
from atwood.pipeline import simulate
from atwood.result import files
from atwood.result.files import load_result, save_result
from atwood.result.formats import matlab, netcdf
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


@pytest.mark.parametrize("suffix", [".nc", ".npz", ".csv", ".mat", ".NC"])
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


@pytest.mark.parametrize("suffix", [".nc", ".npz", ".mat"])
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
    names = [netcdf._name(path, taken) for path in ("rod[0].angle", "rod_0.angle", "a.längs")]
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


@pytest.mark.parametrize("name", ["run", "run.txt", "run.xls"])
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
    for suffix in (".nc", ".npz", ".csv", ".mat"):
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


@pytest.mark.parametrize("suffix", [".nc", ".npz", ".csv"])
def test_files_of_older_versions_are_read(suffix: str) -> None:
    saved = load_result(Path(__file__).parent / "saved_before" / f"run{suffix}")
    assert saved.time.tolist() == [0.0, 0.1, 0.2]
    assert saved["rod1.angle"][-1] == pytest.approx(1.376, abs=1e-3)
    assert saved.unit("bob2.position.x") == "m"
    assert saved.status == ("" if suffix == ".csv" else "finished")


def test_xarray_reads_a_run(result: Result, tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    data = result.to_xarray(["rod[0].angle", "bob[1].position.x"])
    assert list(data.data_vars) == ["rod[0].angle", "bob[1].position.x"]
    assert data["rod[0].angle"].attrs["units"] == "rad"
    assert data.attrs["form"] == "dae"
    chosen = data["rod[0].angle"].sel(time=0.25, method="nearest")
    assert float(chosen) == result["rod[0].angle"][10]
    with xarray.open_dataset(result.save(tmp_path / "run.nc"), engine="scipy") as opened:
        assert np.array_equal(opened["time"].values, result.time)
        assert opened["rod_0.angle"].attrs["path"] == "rod[0].angle"
        assert np.array_equal(opened["rod_0.angle"].values, result["rod[0].angle"])
    assert load_result(tmp_path / "run.nc").to_xarray()["rod[0].angle"].equals(data["rod[0].angle"])


def test_pandas_has_a_row_for_each_time(result: Result) -> None:
    pytest.importorskip("pandas")
    table = result.to_dataframe()
    assert table.index.name == "time"
    assert list(table.columns) == list(result.paths)
    assert np.array_equal(table["rod[1].angle"].to_numpy(), result["rod[1].angle"])
    assert table.attrs["units"]["rod[1].angle"] == "rad"
    assert list(result.to_dataframe(["rod[1].angle"])) == ["rod[1].angle"]


def test_what_is_not_installed_is_said(result: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, make in (("pandas", result.to_dataframe), ("xarray", result.to_xarray)):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(UsageError, match=rf"{name}.*atwood\[data\]"):
            make()


def test_matlab_reads_real_names(result: Result, tmp_path: Path) -> None:
    from scipy.io import loadmat

    data = loadmat(str(result.save(tmp_path / "run.mat")))
    assert data["time"].shape == data["rod_0_angle"].shape == (21, 1)
    assert np.array_equal(data["rod_0_angle"][:, 0], result["rod[0].angle"])
    about = json.loads(str(data["atwood"].item()))
    assert {one["name"]: one["path"] for one in about["variables"]}["rod_0_angle"] == "rod[0].angle"


def test_names_that_matlab_cannot_tell_apart() -> None:
    taken = {"end"}
    long = "a" * 80
    names = [matlab._name(path, taken) for path in ("a.b", "a_b", "end", "1x", f"{long}.x", f"{long}.y", "q'")]
    assert names[:4] == ["a_b", "a_b_2", "end_2", "x1x"]
    assert names[4] != names[5]
    assert all(len(name) <= 63 and name.isidentifier() for name in names)
