"""Damaged files give what was saved, or are refused: a few of the soak's trials, and files of older versions."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

import atwood

from .files import DAMAGES, SUFFIXES, meaning, original, read_damaged, saved


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("damage", DAMAGES, ids=lambda one: one.__name__)
def test_a_damaged_file_never_gives_other_values(suffix, damage) -> None:
    chance = random.Random(7)
    for _ in range(12):
        _, finding = read_damaged(suffix, damage(chance, saved(suffix)))
        assert finding is None, finding


@pytest.mark.parametrize("rows", [1, 5, 11])
def test_a_csv_without_its_last_rows_is_refused(rows: int) -> None:
    lines = saved(".csv").splitlines(keepends=True)
    for kept in (lines[:-rows], [*lines[: -rows - 1], lines[-1]]):
        outcome, finding = read_damaged(".csv", b"".join(kept))
        assert (outcome, finding) == ("refused", None)


def test_files_without_a_checksum_still_load(tmp_path: Path) -> None:
    old = tmp_path / "old.csv"
    old.write_bytes(saved(".csv"))
    assert meaning(".csv", old)[:3] == meaning(".csv", original(".csv"))[:3]
    with np.load(original(".npz")) as data:
        arrays = {name: data[name] for name in data.files}
    arrays["atwood"] = np.array(str(arrays["atwood"]).replace('"checksum"', '"something"'))
    np.savez(tmp_path / "old.npz", allow_pickle=False, **arrays)
    assert meaning(".npz", tmp_path / "old.npz") == meaning(".npz", original(".npz"))
    (tmp_path / "old.nc").write_bytes(saved(".nc").replace(b"checksum", b"somethin"))
    assert meaning(".nc", tmp_path / "old.nc") == meaning(".nc", original(".nc"))


def test_a_scene_changed_by_hand_can_be_read_without_its_checksum(tmp_path: Path) -> None:
    text = saved(".json").decode().replace("0.75", "0.85")
    file = tmp_path / "scene.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(atwood.UsageError, match=r"scene\.json.*take the entry 'checksum' away"):
        atwood.load_scene(file)
    file.write_text("\n".join(one for one in text.splitlines() if "checksum" not in one).replace("},\n}", "}\n}"))
    assert atwood.load_scene(file)["rod1"].length == 0.85


@pytest.mark.parametrize("name", ["", ".", "x" * 300 + ".npz", "no/such/run.npz", "run.npz/run.npz"])
def test_no_place_for_a_file(tmp_path: Path, name: str) -> None:
    (tmp_path / "run.npz").write_bytes(saved(".npz"))
    result = atwood.simulate(scene(), t_end=0.01)
    where = str(tmp_path / name) if name else tmp_path
    for attempt in (lambda: result.save(where), lambda: atwood.load_result(where), lambda: atwood.load_scene(where)):
        with pytest.raises(atwood.UsageError):
            attempt()
    with pytest.raises(atwood.UsageError):
        atwood.save_scene(scene(), where)
    assert (tmp_path / "run.npz").read_bytes() == saved(".npz")


def scene() -> atwood.Scene:
    from atwood_library.scenes import SCENES

    return SCENES["simple-pendulum"]()
