"""Kind `interrupts`: a process that runs and saves is killed, or meets Ctrl-C, at a random time.

Afterwards files are whole or absent, and with the kernels that it left in the cache the next run gives the same
numbers.
"""

from __future__ import annotations

import functools
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import atwood

from .interrupted import FILES
from .trial import Finding, Trial

ROOT = Path(__file__).resolve().parents[2]
ROUNDS = 50
"""More than are done before the signal comes."""

LONGEST = 4.0
"""The signal comes within so many seconds: the first round compiles, the others do not."""

PATIENCE = 30.0
"""Seconds within which a process must have ended after Ctrl-C."""


def check(seed: int) -> Trial:
    """Stop one process, and look at what it left."""
    chance = random.Random(seed)
    sent = chance.choice((signal.SIGKILL, signal.SIGINT))
    with tempfile.TemporaryDirectory() as directory:
        place = Path(directory, "files")
        cache = Path(directory, "kernels")
        place.mkdir()
        findings = _stop(place, cache, sent, LONGEST * chance.random() ** 2)
        present = [name for name in FILES if (place / name).exists()]
        findings += [finding for name in present for finding in _look_at(place / name)]
        left = sorted(path.name for path in place.iterdir() if path.name not in FILES)
        if left and sent == signal.SIGINT:
            findings.append(Finding("message", "Ctrl-C leaves files with other names", " ".join(left)))
        said, errors = _finish(place, cache)
        if said != _reference()[0]:
            findings.append(Finding("wrong" if said else "crash", "the next run is another", f"{said}\n{errors}"))
    return Trial((f"{sent.name}, {len(present)} files",), tuple(findings))


def _command(place: Path, cache: Path, rounds: int) -> tuple[list[str], dict[str, Any]]:
    path = os.pathsep.join(str(ROOT / name) for name in ("src", "library"))
    environment = {**os.environ, "PYTHONPATH": path, "ATWOOD_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "tests.soak.interrupted", str(place), str(rounds)]
    return command, {"cwd": ROOT, "env": environment, "text": True}


def _stop(place: Path, cache: Path, sent: signal.Signals, after: float) -> list[Finding]:
    """Start a process and send it a signal so many seconds after it began; return what is wrong with how it ended."""
    command, options = _command(place, cache, ROUNDS)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, **options, **pipes) as process:
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(after)
        process.send_signal(sent)
        try:
            _, errors = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            return [Finding("hang", "Ctrl-C does not end it", f"sent after {after:.3f} s")]
    if process.returncode not in (-signal.SIGKILL, 130) or (sent == signal.SIGINT and errors):
        said = errors.strip().rpartition("\n")[2]
        return [Finding("crash", f"{sent.name}: status {process.returncode}, {said[:60]}", errors)]
    return []


def _look_at(file: Path) -> list[Finding]:
    """Return what is wrong with a file that must be whole."""
    try:
        same = _meaning(file) == _reference()[1][file.name]
    except Exception as error:
        return [Finding("crash", f"half a file {file.suffix}: {type(error).__name__}", str(error))]
    return [] if same else [Finding("wrong", f"{file.suffix}: other values than were saved")]


def _meaning(file: Path) -> Any:
    if file.suffix == ".json":
        return atwood.to_data(atwood.load_scene(file))
    found = atwood.load_result(file)
    return found.time.tobytes(), {path: values.tobytes() for path, values in found.quantities.items()}


def _finish(place: Path, cache: Path) -> tuple[str, str]:
    """Let a process come to its end; return the checksum of its numbers and what it wrote about errors."""
    command, options = _command(place, cache, 1)
    done = subprocess.run(command, **options, capture_output=True, check=False)
    return done.stdout.removeprefix("ready\n").strip(), done.stderr


@functools.cache
def _reference() -> tuple[str, dict[str, Any]]:
    """Return the checksum and the files of a process that nobody stops."""
    with tempfile.TemporaryDirectory() as directory:
        place, cache = Path(directory), Path(directory, "kernels")
        said, errors = _finish(place, cache)
        assert said, errors
        return said, {name: _meaning(place / name) for name in FILES}
