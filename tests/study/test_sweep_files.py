"""Sweeps in files and tables: all of it comes back, names are real and unlike, other programs read what they should."""

import csv
import json
import random
from pathlib import Path

import numpy as np
import pytest

from atwood import Scene, Sweep, UsageError, load_sweep, sweep
from atwood_library import Ground, PointMass, Rod, Rope
from atwood_library.scenes import DoublePendulum, RollingDisc

from ..soak.files import DAMAGES

SUFFIXES = (".nc", ".npz", ".mat", ".csv", ".json")
BEFORE = Path(__file__).parent / "saved_before"


def failing() -> Scene:
    """A bob on a rope of fixed length, which some starts contradict."""
    scene = Scene()
    ground, rope = scene.add("ground", Ground()), scene.add("rope", Rod(length=1.0))
    bob = scene.add("bob", PointMass())
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    scene.start["bob.position.x"] = 0.0
    return scene


def words() -> Scene:
    scene = Scene()
    ground, rope, bob = (
        scene.add("ground", Ground()),
        scene.add("rope", Rope(length=1.0)),
        scene.add("bob", PointMass()),
    )
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    scene.start["bob.position.x"] = 0.3
    return scene


def _made(name: str) -> Sweep:
    angles = {"rod1.angle": np.linspace(0.2, 1.2, 4)}
    if name == "grid":
        kept = ["rod1.angle", "bob2.position.x"]
        return sweep(DoublePendulum(), {"bob1.mass": [1.0, 3.0]}, start=angles, t_end=0.2, outputs=3, quantities=kept)
    if name == "list":
        values = {"bob1.mass": [1.0, 2.0, 3.0, 4.0]}
        return sweep(DoublePendulum(), values, start=angles, combine="list", t_end=0.2, outputs=3)
    if name == "ends":
        return sweep(DoublePendulum(), {"rod1.length": [1.0, 2.0]}, t_end=0.2)
    if name == "failures":
        start = {"bob.position.x": [0.0, 7.0, 0.5]}
        return sweep(failing(), start=start, t_end=0.2, outputs=3, quantities=["bob"])
    if name == "words":
        return sweep(words(), {"rope.when_slack": ["stop", "slack", "ignore"][:2], "bob.mass": [1.0, 2.0]}, t_end=0.1)
    assert name == "of the scene"
    return sweep(RollingDisc(), {"gravity": [1.6, 9.8]}, t_end=0.1)


CASES = ("grid", "list", "ends", "failures", "words", "of the scene")


@pytest.fixture(scope="module")
def sweeps() -> dict[str, Sweep]:
    return {name: _made(name) for name in CASES}


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("name", CASES)
def test_all_of_a_sweep_comes_back(sweeps, tmp_path: Path, name: str, suffix: str) -> None:
    found = sweeps[name]
    back = load_sweep(found.save(tmp_path / f"sweep{suffix}"))
    assert_same(back, found)
    beside = ["sweep.csv.json"] * (suffix == ".csv")
    assert sorted(one.name for one in tmp_path.iterdir()) == [f"sweep{suffix}", *beside]


def assert_same(one: Sweep, other: Sweep) -> None:
    assert json.dumps(one.to_dict()) == json.dumps(other.to_dict())
    assert dict(one.meanings) == dict(other.meanings)
    for path, values in other.varied.items():
        assert one.varied[path].dtype.kind == values.dtype.kind
        assert np.array_equal(one.varied[path], values)
    for path in other.paths:
        assert np.array_equal(one[path], other[path], equal_nan=True)
    assert one.statistics == other.statistics
    assert one.steps.dtype == other.steps.dtype
    assert repr(one) == repr(other)


@pytest.mark.parametrize("name", ["grid", "ends"])
@pytest.mark.parametrize("suffix", [".nc", ".json"])
def test_files_of_older_versions_are_read(name: str, suffix: str) -> None:
    found = load_sweep(BEFORE / f"{name}{suffix}")
    assert (found.scene, found.form, found.rtol) == ("DoublePendulum", "reduced", 1e-8)
    assert found.parameters["bob1.mass"].tolist() == ([1.0] * 3 + [2.0] * 3 if name == "grid" else [1.0, 2.0])
    if name == "grid":
        assert found.shape == (2, 3)
        assert found.start["rod1.angle"].tolist() == [0.5, 1.0, 1.5] * 2
        assert found["rod1.angle"][4].tolist() == [1.0, 0.9643136126066646, 0.8612720827492673]
        assert found.units == {"bob1.mass": "kg", "rod1.angle": "rad", "bob2.position.x": "m"}
    else:
        assert found.end("rod1.angle").tolist() == [1.376295495665038, 1.3755814428090056]
    assert found.status == ("finished",) * len(found)
    assert found.statistics.runs == len(found)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("damage", DAMAGES, ids=lambda one: one.__name__)
def test_a_damaged_file_never_gives_another_sweep(sweeps, tmp_path: Path, suffix: str, damage) -> None:
    chance, file = random.Random(3), tmp_path / f"sweep{suffix}"
    content = sweeps["grid"].save(file).read_bytes()
    sound = 0
    for _ in range(6):
        file.write_bytes(damage(chance, content))
        try:
            back = load_sweep(file)
        except UsageError as error:
            sound += str(file) in str(error)
            continue
        assert_same(back, sweeps["grid"])
        sound += 1  # the damage changed nothing that is read
    assert sound == 6


@pytest.mark.parametrize("name", CASES)
def test_no_two_columns_have_one_name(sweeps, tmp_path: Path, name: str) -> None:
    found = sweeps[name]
    with found.save(tmp_path / "sweep.csv").open(newline="", encoding="utf-8") as file:
        heads, *rows = csv.reader(file)
    assert len(heads) == len(set(heads)) == 3 + len(found.varied) + len(found.paths)
    assert len(rows) == len(found) * len(found.time)


def test_what_was_varied_has_a_name_of_its_own(sweeps, tmp_path: Path) -> None:
    with sweeps["list"].save(tmp_path / "sweep.csv").open(newline="", encoding="utf-8") as file:
        row = next(csv.DictReader(file))
    assert float(row["bob1.mass [kg]"]) == 1.0
    assert float(row["start.rod1.angle [rad]"]) == float(row["rod1.angle [rad]"]) == 0.2


def test_what_holds_no_sweep_is_refused(sweeps, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such file"):
        load_sweep(tmp_path / "sweep.nc")
    with pytest.raises(UsageError, match=r"\.csv, \.nc, \.npz, \.mat, \.json"):
        load_sweep(tmp_path / "sweep.xls")
    for suffix in SUFFIXES:
        file = tmp_path / f"wrong{suffix}"
        file.write_bytes(b"something else\n1,2\n")
        with pytest.raises(UsageError, match="no sweep"):
            load_sweep(file)


def test_a_csv_is_numbers_to_others_and_needs_what_is_beside_it(sweeps, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    file = sweeps["list"].save(tmp_path / "sweep.csv")
    table = pandas.read_csv(file)
    assert len(table) == 12
    assert np.array_equal(table["rod1.angle [rad]"].to_numpy().reshape(4, 3), sweeps["list"]["rod1.angle"])
    (tmp_path / "sweep.csv.json").unlink()
    with pytest.raises(UsageError, match="the file beside it"):
        load_sweep(file)


def test_a_csv_of_an_older_version_is_read() -> None:
    found = load_sweep(BEFORE / "list.csv")
    assert found.parameters["bob1.mass"].tolist() == [1.0, 2.0]
    assert found["rod1.angle"][:, -1] == pytest.approx([1.376295495665038, 1.3755814428090056])


# -- tables ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_xarray_opens_the_file_as_the_dataset(sweeps, tmp_path: Path, name: str) -> None:
    xarray = pytest.importorskip("xarray")
    found = sweeps[name]
    data = found.to_xarray()
    with xarray.open_dataset(found.save(tmp_path / "sweep.nc"), engine="scipy") as opened:
        assert set(opened.data_vars) == set(data.data_vars)
        assert set(opened.coords) == set(data.coords)
        for key in data.variables:
            assert opened[key].dims == data[key].dims
            assert np.array_equal(opened[key].values.astype(str), data[key].values.astype(str))
            assert opened[key].attrs.get("units") == data[key].attrs.get("units")
            assert opened[key].attrs["path"] == key


def test_a_grid_is_read_by_what_was_varied(sweeps) -> None:
    pytest.importorskip("xarray")
    found, data = sweeps["grid"], sweeps["grid"].to_xarray()
    assert data["rod1.angle"].dims == ("bob1.mass", "start.rod1.angle", "time")
    chosen = data["bob2.position.x"].sel({"bob1.mass": 3.0, "start.rod1.angle": 1.2}, method="nearest")
    assert np.array_equal(chosen.values, found["bob2.position.x"][7])
    assert int(chosen["run"]) == 7
    assert data["start.rod1.angle"].attrs["units"] == "rad"
    assert data["bob1.mass"].attrs["units"] == "kg"
    assert data["status"].values.tolist() == [["finished"] * 4] * 2


def test_a_list_has_its_values_along_the_runs(sweeps) -> None:
    pytest.importorskip("xarray")
    data = sweeps["list"].to_xarray()
    assert data["rod1.angle"].dims == ("run", "time")
    assert data["bob1.mass"].dims == ("run",)
    assert set(data.coords) == {"run", "time", "bob1.mass", "start.rod1.angle"}


@pytest.mark.parametrize("name", CASES)
def test_a_table_has_a_row_for_each_run_and_time(sweeps, name: str) -> None:
    pytest.importorskip("pandas")
    found = sweeps[name]
    table = found.to_dataframe()
    assert table.index.names == ["run", "time"]
    assert len(table) == len(found) * len(found.time)
    assert table.columns.is_unique
    assert set(table.columns) <= set(table.attrs["units"]) | {"status"}
    last = table.xs(len(found) - 1, level="run")
    for path in found.paths:
        assert np.array_equal(last[path].to_numpy(), found[path][-1], equal_nan=True)


def test_matlab_reads_real_names(sweeps, tmp_path: Path) -> None:
    from scipy.io import loadmat

    data = loadmat(str(sweeps["grid"].save(tmp_path / "sweep.mat")))
    assert data["rod1_angle"].shape == (2, 4, 3)
    assert data["start_rod1_angle"].shape == (4, 1)
    assert np.array_equal(data["bob2_position_x"].reshape(8, 3), sweeps["grid"]["bob2.position.x"])
