"""Files that are written: whole or not at all, whoever else writes; and read without waiting for anybody."""

import json
import marshal
import os
import stat
import struct
import threading
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import atwood
from atwood import UsageError
from atwood.codegen import cache as disk
from atwood.files import check_directory, check_readable, write_atomically
from atwood.forms import caches as derived
from atwood.result.formats import npz as packed
from atwood.solids import read_stl
from atwood_library import Table
from atwood_library.scenes import DoublePendulum, SimplePendulum

posix = pytest.mark.skipif(os.name != "posix", reason="pipes, links and permissions are those of POSIX")


def test_many_threads_save_one_file(tmp_path: Path) -> None:
    scene, failed = SimplePendulum(), list[BaseException]()
    result = atwood.simulate(scene, t_end=0.1, outputs=5)

    def save() -> None:
        try:
            for _ in range(5):
                result.save(tmp_path / "run.npz")
                atwood.save_scene(scene, tmp_path / "scene.json")
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=save) for _ in range(8)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert not failed
    assert atwood.load_result(tmp_path / "run.npz")["rod.angle"] == pytest.approx(result["rod.angle"])
    assert atwood.to_data(atwood.load_scene(tmp_path / "scene.json")) == atwood.to_data(scene)
    assert sorted(os.listdir(tmp_path)) == ["run.npz", "scene.json"]


@posix
def test_the_name_in_between_cannot_be_foreseen_and_no_link_is_followed(tmp_path: Path) -> None:
    names, precious = set[str](), tmp_path / "precious"
    precious.write_text("keep")
    target = tmp_path / "target.txt"
    target.symlink_to(precious)

    def write(part: Path) -> None:
        names.add(str(part))
        assert stat.S_IMODE(part.parent.stat().st_mode) == 0o700
        part.write_text("new")

    for _ in range(3):
        write_atomically(target, write)
    assert len(names) == 3
    assert precious.read_text() == "keep"
    assert not target.is_symlink()
    assert target.read_text() == "new"


@posix
def test_permissions_are_those_of_the_file_before_or_of_any_new_file(tmp_path: Path) -> None:
    plain, target = tmp_path / "plain", tmp_path / "target"
    plain.write_text("")
    write_atomically(target, lambda part: part.write_text("new"))
    assert target.stat().st_mode == plain.stat().st_mode
    target.chmod(0o640)
    write_atomically(target, lambda part: part.write_text("newer"))
    assert stat.S_IMODE(target.stat().st_mode) == 0o640


def test_what_fails_in_between_leaves_what_was_there(tmp_path: Path) -> None:
    target = tmp_path / "target"
    target.write_text("before")

    def broken(part: Path) -> None:
        part.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_atomically(target, broken)
    assert target.read_text() == "before"
    assert os.listdir(tmp_path) == ["target"]


@posix
@pytest.mark.parametrize("suffix", [".nc", ".npz", ".csv", ".mat", ".json", ".stl"])
def test_nobody_waits_for_a_pipe(tmp_path: Path, suffix: str) -> None:
    pipe = tmp_path / f"pipe{suffix}"
    os.mkfifo(pipe)
    readers: dict[str, list[Any]] = {".json": [atwood.load_scene, atwood.load_sweep], ".stl": [read_stl]}
    for read in readers.get(suffix, [atwood.load_result, atwood.load_sweep]):
        with pytest.raises(atwood.AtwoodError, match="pipe"):
            read(pipe)
    for check in (check_directory, check_readable):
        with pytest.raises(UsageError, match="a pipe or a device"):
            check(pipe)
    assert stat.S_ISFIFO(pipe.stat().st_mode)


# -- the cache ---------------------------------------------------------------------------------------------------------


@posix
@pytest.mark.parametrize("kind", ["pipe", "directory", "device", "loop", "sparse"])
def test_an_entry_that_is_no_file_is_none(tmp_path: Path, kind: str) -> None:
    store = disk.Cache(tmp_path)
    path = tmp_path / "0123.kernel"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "directory":
        path.mkdir()
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "loop":
        path.symlink_to(path)
    else:
        with path.open("wb") as file:
            file.truncate(2**40)
    before = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
    assert store.read("0123") is None
    assert not before or len(os.listdir("/proc/self/fd")) == before


FORGED = [
    b"",
    b"garbage",
    marshal.dumps(None),
    marshal.dumps(("", 3)),
    marshal.dumps(("", [], [10**9])),
    marshal.dumps(("", [], [-1])),
    marshal.dumps((3, [], ["a"])),
    marshal.dumps(("", [("sin", (10**9,), None, False)], [])),
    marshal.dumps(("", [("sin", (), None, False)], [])),
    marshal.dumps(("", [("mul", (0,), None, False)], [])),
    marshal.dumps(("", [("mul", "ab", None, False)], [])),
    marshal.dumps(("", [([], (0,), None, False)], [])),
    marshal.dumps(("", [("constant", (), "x", False)], [])),
    marshal.dumps(("", [(1, 2)], [])),
]


@pytest.mark.sample(5)
@pytest.mark.parametrize("content", FORGED, ids=range(len(FORGED)))
def test_forged_derivations_are_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes) -> None:
    store = disk.Cache(tmp_path)
    monkeypatch.setattr(derived, "default_cache", lambda: store)
    expected = atwood.simulate(DoublePendulum(), t_end=0.1, outputs=2)["rod2.angle"]
    entries = list(tmp_path.glob("*.kernel"))
    assert entries
    for entry in entries:
        assert store.write(entry.stem, content)
    assert atwood.simulate(DoublePendulum(), t_end=0.1, outputs=2)["rod2.angle"] == pytest.approx(expected)


# -- what is read ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "bound",
    [
        "__class__",
        "length",
        ["div", 1, 0],
        ["mul", 1e308, 1e308],
        ["pow", 10, ["pow", 10, ["pow", 10, 10]]],
        ["pow", -8, 0.5],
        ["add", 10**400, 1],
    ],
    ids=str,
)
def test_bound_values_that_have_none_are_refused(bound: Any) -> None:
    """In a scene itself, in a part of it, and as a start value."""
    name = "atwood_library.scenes.double_pendulum:DoublePendulum"
    written = {"bound": bound}
    for scene in (
        {"class": name, "values": {"gravity": written}},
        {"class": name, "changes": {"settings": {"rod1": {"length": written}}}},
        {"class": name, "changes": {"starts": {"": {"start": {"rod1.angle": written}}}}},
    ):
        with pytest.raises(atwood.AtwoodError):
            atwood.assemble(atwood.from_data({"format": "atwood scene", "version": 1, "scene": scene}))


def test_what_a_class_cannot_be_made_of_is_an_error_of_ours() -> None:
    """Its regulator is worked out when it is made, by a function of scipy that gives up."""
    scene = {"class": "atwood_library.scenes.cart_pole:CartPole", "values": {"cart_mass": 1e30}}
    with pytest.raises(UsageError, match="cannot be what its classes are made of"):
        atwood.from_data({"format": "atwood scene", "version": 1, "scene": scene})


@pytest.mark.parametrize("suffix", [".npz", ".mat"])
def test_what_unpacks_to_more_than_any_run_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    """Zeros, packed to a thousandth."""
    monkeypatch.setattr(packed, "_MOST", 2**24)
    file, packer, zeros = tmp_path / f"bomb{suffix}", zlib.compressobj(9), bytes(2**22)
    if suffix == ".npz":
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as entries, entries.open("time.npy", "w") as entry:
            for _ in range(5):
                entry.write(zeros)
    else:
        content = b"".join(packer.compress(zeros) for _ in range(5)) + packer.flush()
        file.write_bytes(bytes(128) + struct.pack("<II", 15, len(content)) + content)
    for read in (atwood.load_result, atwood.load_sweep):
        with pytest.raises(UsageError, match="unpacks to more than"):
            read(file)


@pytest.mark.parametrize(
    ("time", "about"),
    [
        (np.zeros((3, 2)), {}),
        (np.array(["a"] * 3), {}),
        (np.ones(3) * 1j, {}),
        (np.zeros(2), {}),
        (np.zeros(3), {"metadata": 1}),
        (np.zeros(3), {"units": ["m"]}),
        (np.zeros(3), {"units": {}}),
        (np.zeros(3), {"meanings": "m"}),
    ],
)
def test_arrays_that_are_no_quantities_are_refused(tmp_path: Path, time: Any, about: dict[str, Any]) -> None:
    whole = {"metadata": {}, "units": {"a": "m"}, "meanings": {}, **about}
    np.savez(tmp_path / "run.npz", time=time, a=np.zeros(3), atwood=np.array(json.dumps(whole)))
    with pytest.raises(UsageError, match="this is no result"):
        atwood.load_result(tmp_path / "run.npz")


@pytest.mark.parametrize(
    "change",
    [{"time": 1.0}, {"time": []}, {"time": [[0.0]]}, {"status": [1, 2]}, {"status": []}, {"end_time": [1.0]}],
    ids=str,
)
def test_sweeps_that_do_not_fit_together_are_refused(tmp_path: Path, change: dict[str, Any]) -> None:
    file = tmp_path / "sweep.json"
    atwood.sweep(SimplePendulum(), {"rod.length": [1.0, 2.0]}, t_end=0.2, outputs=3).save(file)
    data = {key: one for key, one in json.loads(file.read_text()).items() if key not in ("checksum", "meanings")}
    file.write_text(json.dumps(data))
    assert len(atwood.load_sweep(file)) == 2
    file.write_text(json.dumps({**data, **change}))
    with pytest.raises(UsageError, match="this is no sweep"):
        atwood.load_sweep(file)


@posix
def test_tables_wait_for_no_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "table.csv")
    (tmp_path / "long.csv").write_text('"' + "x" * 200_000)
    for name, words in (("table.csv", "is no file"), ("long.csv", "cannot be read")):
        with pytest.raises(atwood.ParameterError, match=words):
            Table(table=str(tmp_path / name))
