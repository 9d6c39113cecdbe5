"""Files by somebody who means harm: scenes, runs, sweeps, meshes and tables; an error of ours, and no code is run."""

from __future__ import annotations

import copy
import functools
import json
import os
import random
import struct
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import atwood
import atwood_library as lib
from atwood import AtwoodError
from atwood.solids import read_stl
from atwood_library.scenes import SCENES

from .files import original, saved
from .trial import Finding, Trial

STRANGER = "stranger_to_atwood"
"""A module that writes down that it was imported."""

NUMBERS = (1e400, -1e400, float("nan"), 10**400, -(10**400), 1e308, 5e-324, 0, -1, 2**63, 10**30)
TEXTS = (
    *("", "x", "\0", "\ud800", "9" * 5000, "9**9**9**9", "(" * 3000, "t" * 3000, "1e400 m", "__class__", "__dict__"),
    *("../../x", "a.b", "é", "a[0]", "a[99999999999]", "scene", "t", "2*t", "__import__('os')", "lambda: 0"),
    *(f"{STRANGER}:Own", "os:system", "builtins:eval", "atwood:simulate", "atwood.cli.app:main", "atwood:Scene.mro"),
    *("atwood_library.parts.rod:Rod", "atwood:Scene", "atwood:__loader__", "atwood.__main__:A", "atwood_library:Rod"),
)
SHAPES: tuple[Any, ...] = (
    *(None, True, False, [], {}, [[]], [None], {"": 1}, {"class": 1}, {"bound": "__class__"}, {"bound": []}),
    {"bound": ["pow", 10, ["pow", 10, ["pow", 10, 10]]]},
    *({"bound": ["div", 1, 0]}, {"bound": ["mul", 1e308, 1e308]}, {"function": "x"}, {"function": [["sin", "t"]]}),
    *(
        {"function": [["solve", 10**9, "t"]]},
        {"function": [["add", "t", "t"] for _ in range(3000)]},
        {"class": f"{STRANGER}:Own"},
    ),
    {"function": [[["sin", "x"]]], "arguments": ["__class__"], "text": 5},
)


def check(seed: int) -> Trial:
    """Write one file of each sort, and read it."""
    chance, tried, findings = random.Random(seed), [], []
    with tempfile.TemporaryDirectory() as directory, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        room = Path(directory)
        (room / f"{STRANGER}.py").write_text("import pathlib\npathlib.Path(__file__).with_name('ran').touch()\n")
        sys.path.insert(0, directory)
        try:
            for sort in (scene_file, result_file, sweep_file, mesh_file, table_file, no_file):
                name, attempt = sort(chance, room)
                try:
                    attempt()
                    tried.append(f"{name}: read")
                except AtwoodError:
                    tried.append(f"{name}: refused")
                except Exception as error:
                    findings.append(Finding("crash", f"{name}: {type(error).__name__}", str(error)[:2000]))
                if (room / "ran").exists() or STRANGER in sys.modules:
                    findings.append(Finding("wrong", f"{name}: code of somebody else is run"))
        finally:
            sys.path.remove(directory)
    return Trial(tuple(tried), tuple(findings))


Attempt = tuple[str, Callable[[], object]]


def value(chance: random.Random) -> Any:
    """Return what should not be there."""
    return chance.choice((chance.choice(NUMBERS), chance.choice(TEXTS), copy.deepcopy(chance.choice(SHAPES))))


def places(data: Any) -> Iterator[tuple[Any, Any]]:
    """Yield everything in plain data that can be replaced: what it is in, and its key."""
    for key in list(data) if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ():
        yield data, key
        yield from places(data[key])


def spoilt(chance: random.Random, data: Any) -> Any:
    """Return plain data with some of it replaced, renamed, added, or nested deeply."""
    data = copy.deepcopy(data)
    for number in range(chance.choice((1, 1, 1, 2, 5)) - 1, -1, -1):
        inside, key = chance.choice(list(places(data)))
        how = chance.randrange(5)
        if how == 1 and isinstance(inside, dict):
            inside[chance.choice(TEXTS)] = inside.pop(key)
        elif how == 2 and isinstance(inside, dict):
            inside[chance.choice(TEXTS)] = value(chance)
        elif how == 3 and not number:
            deep: Any = inside[key]
            for _ in range(chance.choice((3, 50, 150))):
                deep = [deep] if chance.random() < 0.5 else {"class": "atwood:Scene", "changes": {"added": {"a": deep}}}
            inside[key] = deep
        else:
            inside[key] = value(chance)
    return data


def text_of(chance: random.Random, data: Any) -> str:
    """Return JSON, now and then with a key twice, or not closed."""
    text = json.dumps(data)
    if chance.random() < 0.1:
        text = text.replace("{", '{"class": "os:x", ', chance.randrange(3))
    return chance.choice(("[", '{"a":')) * 100_000 if chance.random() < 0.03 else text


@functools.cache
def scene_data(name: str) -> Any:
    return atwood.to_data(SCENES[name]())


def scene_file(chance: random.Random, room: Path) -> Attempt:
    """Spoil a scene anywhere, or give a parameter or a start that it has a value that it should not have."""
    file, name = room / "scene.json", chance.choice(CHEAP)
    data = copy.deepcopy(scene_data(name))
    if chance.random() < 0.4:
        data = spoilt(chance, json.loads(original(".json").read_text()) if chance.random() < 0.5 else data)
        if isinstance(data, dict):
            data.pop("checksum", None)
    else:
        changes, scene = data["scene"].setdefault("changes", {}), SCENES[name]()
        path = chance.choice([*scene.parts, ""])
        part = scene[path] if path else scene
        for parameter in chance.sample(sorted(part.parameter_specs()), min(1, len(part.parameter_specs()))):
            given = changes.setdefault("settings", {}) if path else data["scene"]
            given.setdefault(path if path else "values", {})[parameter] = value(chance)
        if chance.random() < 0.4:
            start = changes.setdefault("starts", {}).setdefault("", {}).setdefault("start", {})
            start[chance.choice([*scene.start, *TEXTS])] = value(chance)
    file.write_text(text_of(chance, data), encoding="utf-8", errors="surrogatepass")
    return "scene", lambda: atwood.simulate(atwood.load_scene(file), t_end=1e-3, outputs=2, max_seconds=3.0)


CHEAP = ("simple-pendulum", "double-pendulum", "atwood", "four-bar", "driven-pendulum", "cart-pole")


def result_file(chance: random.Random, room: Path) -> Attempt:
    if chance.random() < 0.5:
        suffix = chance.choice((".nc", ".mat", ".npz", ".csv"))
        content = bytearray(saved(suffix))
        for _ in range(chance.choice((1, 2, 8))):  # sizes and kinds stand near the beginning
            at = chance.randrange(min(len(content) - 4, chance.choice((64, 400, 10**6))))
            content[at : at + 4] = chance.choice((b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\0", b"\xff" * 4))
        (room / f"run{suffix}").write_bytes(content)
        return f"run {suffix}", lambda: told(atwood.load_result(room / f"run{suffix}"))
    about: Any = {"metadata": {"a": 1}, "units": {"a": "m"}, "meanings": {"a": "b"}}
    about = spoilt(chance, about)
    arrays = {"time": array(chance), "a": array(chance), "atwood": np.array(json.dumps(about))}
    np.savez(room / "run.npz", allow_pickle=True, **arrays)
    return "run made up", lambda: told(atwood.load_result(room / "run.npz"))


def array(chance: random.Random) -> Any:
    """Return an array of any kind."""
    return chance.choice(
        (np.zeros(3), np.zeros((3, 2)), np.array(["a"] * 3), np.zeros(()), np.zeros(0), np.ones(3) * 1j)
    )


def told(read: Any) -> object:
    """Look at all of what was read."""
    return repr(read), [read[path].sum() for path in read], read.to_dataframe()


@functools.cache
def sweep_data() -> Any:
    with tempfile.TemporaryDirectory() as directory:
        file = Path(directory, "sweep.json")
        atwood.sweep(SCENES["simple-pendulum"](), {"rod.length": [1.0, 2.0]}, t_end=0.2, outputs=3).save(file)
        data = json.loads(file.read_text())
    return {name: one for name, one in data.items() if name not in ("checksum", "meanings")}


def sweep_file(chance: random.Random, room: Path) -> Attempt:
    (room / "sweep.json").write_text(text_of(chance, spoilt(chance, sweep_data())), encoding="utf-8")
    return "sweep", lambda: repr(atwood.load_sweep(room / "sweep.json"))


def mesh_file(chance: random.Random, room: Path) -> Attempt:
    x, y, z, o = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    faces = ((o, y, x), (o, x, z), (o, z, y), (x, y, z))
    corners = [number for face in faces for corner in ((0.0, 0.0, 0.0), *face) for number in corner]
    for _ in range(chance.choice((0, 1, 3))):
        corners[chance.randrange(48)] = chance.choice((-1.0, float("nan"), float("inf"), 3e38, 1e-45))
    count = chance.choice((4, 4, 4, 0, 2**32 - 1, 3, 5))
    content = bytes(80) + struct.pack("<I", count)
    content += b"".join(struct.pack("<12f", *corners[12 * i : 12 * i + 12]) + b"\0\0" for i in range(4))
    words = ("solid", "endsolid", "facet", "vertex 1 2 3", "vertex 1e999 nan x", "vertex", "\0", " " * 3000, "é")
    ascii_text = "\n".join(["solid", *(chance.choice(words) for _ in range(chance.randrange(30)))])
    (room / "mesh.stl").write_bytes(content if chance.random() < 0.5 else ascii_text.encode())

    def body() -> object:
        read_stl(room / "mesh.stl")
        scene = atwood.Scene(space="space")
        scene.add("body", lib.MeshBody(file=str(room / "mesh.stl"), density=1000.0))
        return atwood.simulate(scene, t_end=1e-3, outputs=2)

    return "mesh", body


def table_file(chance: random.Random, room: Path) -> Attempt:
    cells = ("nan", "1e999", "1e308", "", '"', "x", "9" * 4000, "#", ";", "\0", "t", "1,5", "-1", "1,2")
    rows = [[f"{number}", f"{chance.random()}"] for number in range(chance.randrange(6))]
    for row in chance.sample(rows, min(len(rows), chance.choice((0, 1, 1, 3)))):
        row[chance.randrange(2)] = chance.choice(cells)
    (room / "table.csv").write_bytes("\n".join(map(",".join, rows)).encode(chance.choice(("utf-8", "utf-8", "utf-16"))))
    return "table", lambda: driven(room / "table.csv")


def driven(table: Path) -> object:
    """Run a mass that a table pushes."""
    scene = atwood.Scene(space="plane")
    mass, push = scene.add("mass", lib.PointMass()), scene.add("push", lib.Force())
    scene.connect(push.point, mass.point)
    scene.connect(scene.add("table", lib.Table(table=str(table))).output("value"), push.input("value"))
    return atwood.simulate(scene, t_end=1e-3, outputs=2)


def no_file(chance: random.Random, room: Path) -> Attempt:
    """Read what is no file: nothing waits for it."""
    suffix, kind = chance.choice((".json", ".npz", ".nc", ".csv", ".mat", ".stl")), chance.choice("pldn")
    place = room / f"none{suffix}"
    if kind == "p" and hasattr(os, "mkfifo"):
        os.mkfifo(place)
    elif kind == "l":
        place.symlink_to(chance.choice((place, Path("/dev/zero"), room, room / "none")))
    elif kind == "d":
        place.mkdir()
    readers = (atwood.load_scene, atwood.load_result, atwood.load_sweep, read_stl, driven)
    return "no file", functools.partial(chance.choice(readers), place)
