"""Files that are cut off, or damaged anywhere: they are refused, or give what was saved."""

from __future__ import annotations

import functools
import json
import random
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import atwood
from atwood import AtwoodError

from .trial import Finding, Trial

SUFFIXES = (".csv", ".nc", ".npz", ".mat", ".json")


def check(seed: int) -> Trial:
    """Damage one file of each kind in one way."""
    chance = random.Random(seed)
    tried, findings = [], []
    for suffix in SUFFIXES:
        damage = chance.choice(DAMAGES)
        content = saved(suffix)
        damaged = damage(chance, content)
        outcome, finding = read_damaged(suffix, damaged)
        tried.append(f"{suffix} {damage.__name__}: {outcome}")
        if finding is not None:
            findings.append(finding)
    return Trial(tuple(tried), tuple(findings))


def read_damaged(suffix: str, content: bytes) -> tuple[str, Finding | None]:
    """Read a file, and say what came of it; other values than the saved ones are a finding, as is any other error."""
    with tempfile.TemporaryDirectory() as directory, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        file = Path(directory, f"damaged{suffix}")
        file.write_bytes(content)
        if suffix == ".csv":
            Path(directory, "damaged.csv.json").write_bytes(original(suffix).with_name("saved.csv.json").read_bytes())
        try:
            read = meaning(suffix, file)
        except AtwoodError as error:
            helps = str(file) in str(error) or error.where
            return "refused", None if helps else Finding("message", f"{suffix}: which file is not said", str(error))
        except Exception as error:
            return "raised", Finding("crash", f"{suffix}: {type(error).__name__}", str(error))
        if read != meaning(suffix, original(suffix)):
            return "other values", Finding("wrong", f"{suffix}: other values than were saved", repr(content[:2000]))
    return "the same", None


def meaning(suffix: str, file: Path) -> Any:
    """Return all that a reader of a file sees of it, as something that can be compared."""
    if suffix == ".json":
        return atwood.to_data(atwood.load_scene(file))
    found = atwood.load_result(file)
    quantities = {path: np.asarray(values, dtype="<f8").tobytes() for path, values in found.quantities.items()}
    return found.time.tobytes(), quantities, dict(found.units), dict(found.meanings), json.dumps(found.metadata)


@functools.cache
def _directory() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory()


@functools.cache
def original(suffix: str) -> Path:
    """Return a sound file: a short run, or a scene with what can be changed on one."""
    from atwood_library.scenes import SCENES

    scene = SCENES["double-pendulum"]()
    file = Path(_directory().name, f"saved{suffix}")
    if suffix == ".json":
        scene.set("rod1.length", 0.75)
        scene.start["rod1.angle"] = "30 deg"
        atwood.save_scene(scene, file)
    else:
        atwood.simulate(scene, t_end=0.5, outputs=11, solver="explicit").save(
            file, ["rod1.angle", "rod1.tension", "bob2.position.x"]
        )
    return file


@functools.cache
def saved(suffix: str) -> bytes:
    """Return the content of a sound file."""
    return original(suffix).read_bytes()


# -- damages -----------------------------------------------------------------------------------------------------------


def flipped(chance: random.Random, content: bytes) -> bytes:
    """Turn one bit over."""
    place = chance.randrange(len(content))
    return content[:place] + bytes([content[place] ^ 1 << chance.randrange(8)]) + content[place + 1 :]


def truncated(chance: random.Random, content: bytes) -> bytes:
    """Cut the end off."""
    return content[: chance.randrange(len(content))]


def without_a_line(chance: random.Random, content: bytes) -> bytes:
    """Take out one line, or what lies between two bytes that would end one."""
    lines = content.splitlines(keepends=True)
    del lines[chance.randrange(len(lines))]
    return b"".join(lines)


def without_a_piece(chance: random.Random, content: bytes) -> bytes:
    """Take out some bytes."""
    place = chance.randrange(len(content))
    return content[:place] + content[place + chance.choice((1, 8, 100)) :]


def overwritten(chance: random.Random, content: bytes) -> bytes:
    """Write zeros, or anything, over some bytes, as a disk may."""
    place, size = chance.randrange(len(content)), chance.choice((1, 8, 512))
    size = min(size, len(content) - place)
    new = bytes(size) if chance.random() < 0.5 else chance.randbytes(size)
    return content[:place] + new + content[place + size :]


def repeated(chance: random.Random, content: bytes) -> bytes:
    """Write some bytes twice."""
    place = chance.randrange(len(content))
    piece = content[place : place + chance.choice((1, 8, 100))]
    return content[:place] + piece + content[place:]


def digits_changed(chance: random.Random, content: bytes) -> bytes:
    """Write another digit for one, as a hand may."""
    places = [i for i, byte in enumerate(content) if 48 <= byte <= 57]
    place = chance.choice(places)
    return content[:place] + bytes([48 + (content[place] - 48 + chance.randrange(1, 10)) % 10]) + content[place + 1 :]


DAMAGES: tuple[Callable[[random.Random, bytes], bytes], ...] = (
    flipped,
    truncated,
    without_a_line,
    without_a_piece,
    overwritten,
    repeated,
    digits_changed,
)
