"""Saving and loading results."""

import csv
import json
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.io import netcdf_file

from atwood import ExternalFunction, ResultError, Scene, UsageError, external
from atwood.pipeline import simulate
from atwood.result.files import load_result, save_result
from atwood.result.formats import companion, matlab, netcdf
from atwood.result.result import Result
from atwood_library import Force, Ground, PointMass, Rod
from atwood_library.scenes import DoublePendulum


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
    beside = ["run.csv.json"] * (suffix == ".csv")
    assert sorted(one.name for one in tmp_path.iterdir()) == [file.name, *beside]


@pytest.mark.parametrize("suffix", [".nc", ".npz", ".mat", ".csv"])
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
    assert len(rows) == 22
    assert np.array_equal(np.loadtxt(file, delimiter=",", skiprows=1)[:, 1], result["rod[0].angle"])
    assert float(rows[-1][1]) == result["rod[0].angle"][-1]


def test_pandas_reads_a_csv_as_numbers(result: Result, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    table = pandas.read_csv(result.save(tmp_path / "run.csv"))
    assert all(kind == np.float64 for kind in table.dtypes)
    assert table["time [s]"].to_list() == result.time.tolist()
    assert table["rod[0].tension [N]"].to_list() == result["rod[0].tension"].tolist()


def test_a_csv_is_checked_by_the_file_beside_it(result: Result, tmp_path: Path) -> None:
    file, beside = result.save(tmp_path / "run.csv", ["rod[0].angle"]), tmp_path / "run.csv.json"
    content, about = file.read_bytes(), beside.read_bytes()
    for damaged in (content[:-30], content.replace(b"1.0", b"1.5", 1), content.rpartition(b"\n0.5")[0] + b"\n"):
        file.write_bytes(damaged)
        with pytest.raises(UsageError, match=r"run\.csv\.json"):
            load_result(file)
    file.write_bytes(content.replace(b"\n", b"\r\n"))  # as some mail programs make it
    assert load_result(file)["rod[0].angle"].tolist() == result["rod[0].angle"].tolist()
    beside.write_bytes(about.replace(b"finished", b"stopped!"))
    with pytest.raises(UsageError, match="other contents"):
        load_result(file)
    beside.unlink()
    alone = load_result(file)
    assert alone.metadata == {}
    assert alone["rod[0].angle"].tolist() == result["rod[0].angle"].tolist()


def test_who_is_stopped_between_two_files_leaves_a_pair(
    result: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = result.save(tmp_path / "run.csv", ["rod[0].angle"])
    written, write = [], companion.write_atomically

    def stopped(target: Path, how: object) -> None:
        if len(written) == 1:
            raise KeyboardInterrupt
        written.append(target)
        write(target, how)  # type: ignore[arg-type]

    monkeypatch.setattr(companion, "write_atomically", stopped)
    with pytest.raises(KeyboardInterrupt):
        result.save(file, ["rod[1].angle"])
    assert load_result(file).paths == ("rod[0].angle",)
    monkeypatch.undo()
    result.save(file, ["rod[1].angle"])
    assert load_result(file).paths == ("rod[1].angle",)
    assert len(json.loads((tmp_path / "run.csv.json").read_text(encoding="utf-8"))["contents"]) == 1


@pytest.mark.parametrize("suffix", [".nc", ".npz", ".mat", ".csv"])
def test_a_saved_run_can_be_run_again(tmp_path: Path, suffix: str) -> None:
    scene = DoublePendulum(length1="80 cm")
    scene.rod2.length = 0.7
    scene.start["rod1.angle"] = "30 deg"
    times = np.linspace(0.0, 0.6, 7)
    run = simulate(
        scene, form="dae", t_end=2.0, rtol=1e-9, outputs=times, solver="ida", until="rod1.angle falls below 20 deg"
    )
    saved = load_result(run.save(tmp_path / f"run{suffix}", ["rod1.angle"]))
    assert saved.metadata["parameters"]["length1"] == saved.metadata["parameters"]["rod1.length"] == 0.8
    assert saved.metadata["parameters"]["rod2.length"] == 0.7
    assert saved.metadata["parameters"]["gravity"] == 9.81
    again = simulate(saved.scene(), **saved.settings())
    assert (again.form, again.level, again.status) == ("dae", "ggl", "stopped")
    assert again.time.tolist() == saved.time.tolist()
    assert again["rod1.angle"].tolist() == saved["rod1.angle"].tolist()
    on = simulate(saved.scene(), **saved.settings(until=None, form="reduced", level=None, t_end="0.7 s"))
    assert (on.form, on.time[-1]) == ("reduced", 0.6)


def test_what_no_file_holds_is_said(tmp_path: Path) -> None:
    stop = simulate(DoublePendulum(), t_end=0.2, outputs=3, until=lambda q: q["bob1.position.z"] < -5.0, accuracy=1e-5)
    saved = load_result(stop.save(tmp_path / "run.npz"))
    with pytest.raises(UsageError, match=r"function.*settings\(until="):
        saved.settings()
    assert saved.settings(until=None)["accuracy"] == 1e-5
    with pytest.raises(UsageError, match="older version"):
        load_result(Path(__file__).parent / "saved_before" / "run.nc").scene()
    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0))
    mass, push = scene.add("mass", PointMass()), scene.add("push", Force())
    scene.connect(mass.point, push.point)
    scene.set("push.value", lambda t: external(ExternalFunction("wind", abs), t))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        blown = simulate(scene, t_end=0.1, outputs=2)
    with pytest.raises(UsageError, match="External functions"):
        load_result(blown.save(tmp_path / "blown.npz")).scene()


@pytest.mark.parametrize("name", ["run", "run.txt", "run.xls"])
def test_unknown_suffix(result: Result, tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError, match=r"\.nc .*\.npz .*\.csv"):
        result.save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_failed_write_leaves_what_was_there(result: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "run.npz"
    file.write_text("before", encoding="utf-8")

    def fail(stream: object, **arrays: object) -> None:
        stream.write(b"half")  # type: ignore[attr-defined]
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", fail)
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
