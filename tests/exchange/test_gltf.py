"""Shapes and motion as glTF: the file is sound, and bodies are in it where they are along the run."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from atwood import AtwoodError, Result, Scene, save_result, simulate
from atwood_library import Box, Ground, Pivot, PointMass, Spring
from atwood_library.scenes import DoublePendulum


@pytest.fixture(scope="module")
def result() -> Result:
    scene = Scene(space="space")
    ground = scene.add("ground", Ground())
    pivot = scene.add("pivot", Pivot(axis=(0.0, 1.0, 0.0)))
    box = scene.add("box", Box(length_x=1.0, length_y=0.1, length_z=0.2))
    spring, bob = scene.add("spring", Spring(stiffness=50.0, natural_length=0.5)), scene.add("bob", PointMass(mass=0.2))
    for ends in ((ground.frame, pivot.a), (pivot.b, box.a), (box.b, spring.a), (spring.b, bob.point)):
        scene.connect(*ends)
    scene.start.update({"pivot.angle": 0.2, "bob.position.y": 0.3, "bob.position.x": 1.0, "bob.position.z": -0.5})
    return simulate(scene, t_end=0.5, outputs=51)


def opened(file: Path) -> tuple[dict[str, Any], bytes]:
    data = file.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    rest, kind = struct.unpack_from("<I4s", data, 20 + size)
    assert kind == b"BIN\0"
    assert 28 + size + rest == len(data)
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def numbers(said: dict[str, Any], binary: bytes, index: int) -> Any:
    accessor = said["accessors"][index]
    view = said["bufferViews"][accessor["bufferView"]]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    found = np.frombuffer(binary, "<f4", accessor["count"] * width, view["byteOffset"]).reshape(-1, width)
    if "min" in accessor:
        assert found.min(axis=0).tolist() == accessor["min"]
    return found.astype(float)


def test_bodies_are_where_they_are_along_the_run(result: Result, tmp_path: Path) -> None:
    said, binary = opened(result.save(tmp_path / "run.glb"))
    (animation,) = said["animations"]
    box = next(i for i, node in enumerate(said["nodes"]) if node["name"] == "box")
    rows = {}
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        if channel["target"]["node"] == box:
            rows[channel["target"]["path"]] = numbers(said, binary, sampler["output"])
            times = numbers(said, binary, sampler["input"])[:, 0]
            assert np.all(np.diff(times) > 0.0)
    assert times == pytest.approx(result.time, abs=1e-6)
    angle = 2.0 * np.arctan2(rows["rotation"][:, 1], rows["rotation"][:, 3])
    assert angle == pytest.approx(result.array("pivot.angle"), abs=1e-6)
    assert rows["rotation"][:, [0, 2]] == pytest.approx(0.0, abs=1e-6)
    points = np.concatenate(
        [
            numbers(said, binary, one["attributes"]["POSITION"])
            for one in said["meshes"][said["nodes"][box]["mesh"]]["primitives"]
        ]
    )
    assert np.ptp(points[:, 0]) > 0.99
    spring = next(node for node in said["nodes"] if node["name"] == "spring")
    length = float(
        np.hypot(
            result.array("bob.position.y")[0],
            np.hypot(*(result.array(f"bob.position.{c}")[0] - result.array(f"box.position.{c}")[0] * 2 for c in "xz")),
        )
    )
    assert spring["scale"][2] == pytest.approx(length, rel=1e-6)
    assert said["nodes"][-1]["children"] == list(range(len(said["nodes"]) - 1))


def test_what_has_no_such_picture_is_refused(result: Result, tmp_path: Path) -> None:
    with pytest.raises(AtwoodError, match="only scenes in space"):
        simulate(DoublePendulum(), t_end=0.1).save(tmp_path / "run.glb")
    with pytest.raises(AtwoodError, match="no quantities by path"):
        save_result(result, tmp_path / "run.glb", ["pivot.angle"])
    with pytest.raises(AtwoodError):
        result.save(tmp_path / "none" / "run.glb")
    assert not list(tmp_path.iterdir())
