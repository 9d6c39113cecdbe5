"""Kind `interrupts`: a process that runs and saves is killed, or meets Ctrl-C, at a random time.

Afterwards files are whole or absent, and with the kernels that it left in the cache the next run gives the same
numbers. A third of the processes are commands of `atwood`, which end with status 130 and without a traceback.
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

from .interrupted import BESIDE, FILES
from .trial import Finding, Trial

ROOT = Path(__file__).resolve().parents[2]
ROUNDS = 100_000
"""More than are done before the signal comes."""

LONGEST = 4.0
"""The signal comes within so many seconds: the first round compiles, the others do not."""

COMMANDS = (
    ("run", "double-pendulum", "--t-end", "3000", "--outputs", "20000", "--save", "{place}/run.nc"),
    ("run", "four-bar", "--form", "dae", "--t-end", "2000", "--save", "{place}/run.csv"),
    ("run", "double-pendulum", "--solver", "ida-sundae", "--t-end", "300", "--json"),
    ("sweep", "double-pendulum", "--vary", "mass2=0.5:2:3000", "--t-end", "100", "--save", "{place}/many.nc"),
    ("sweep", "four-bar", "--form", "dae", "--vary-start", "crank.angle=0:1:500", "--save", "{place}/many.npz"),
    ("compare", "double-pendulum", "--t-end", "200"),
    ("run", "double-pendulum", "--t-end", "5", "--draw", "{place}/motion.gif"),
)
"""Commands of `atwood` that take longer than `LONGEST`."""

PATIENCE = 30.0
"""Seconds within which a process must have ended after Ctrl-C."""


def check(seed: int) -> Trial:
    """Stop one process, and look at what it left."""
    chance = random.Random(seed)
    sent = chance.choice((signal.SIGKILL, signal.SIGINT))
    after = LONGEST * chance.random() ** 2
    if chance.random() < 1.0 / 3.0:
        return _stop_command(chance.choice(COMMANDS), sent, after)
    with tempfile.TemporaryDirectory() as directory:
        place = Path(directory, "files")
        cache = Path(directory, "kernels")
        place.mkdir()
        command, options = _command(place, cache, ROUNDS)
        findings = _stop(command, options, sent, after)
        present = [name for name in FILES if (place / name).exists()]
        findings += [finding for name in present for finding in _look_at(place / name)]
        left = sorted(path.name for path in place.iterdir() if path.name not in (*FILES, BESIDE))
        if left and sent == signal.SIGINT:
            findings.append(Finding("message", "Ctrl-C leaves files with other names", " ".join(left)))
        said, errors = _finish(place, cache)
        if said != _reference()[0]:
            findings.append(Finding("wrong" if said else "crash", "the next run is another", f"{said}\n{errors}"))
    return Trial((f"{sent.name}, {len(present)} files",), tuple(findings))


def _stop_command(arguments: tuple[str, ...], sent: signal.Signals, after: float) -> Trial:
    """Stop a command of `atwood`, and read the file that it has saved, if it has."""
    with tempfile.TemporaryDirectory() as directory:
        place = Path(directory, "files")
        place.mkdir()
        _, options = _command(place, Path(directory, "kernels"), 1)
        program = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
        program += "from atwood.cli import main; print('ready', flush=True); main()"
        words = [word.format(place=place) for word in arguments]
        findings = _stop([sys.executable, "-c", program, *words], options, sent, after)
        for file in sorted(place.iterdir()):
            if file.name == BESIDE:
                continue
            if file.suffix not in (".nc", ".npz", ".csv", ".gif"):
                if sent == signal.SIGINT:
                    findings.append(Finding("message", "Ctrl-C leaves files with other names", file.name))
            elif file.suffix != ".gif":
                findings += _read_whole(file, arguments[0])
    return Trial((f"{sent.name}: atwood {arguments[0]}",), tuple(findings))


def _read_whole(file: Path, command: str) -> list[Finding]:
    """Return what is wrong with a file of a command, which may end early but not in the middle of a number."""
    try:
        (atwood.load_sweep if command == "sweep" else atwood.load_result)(file)
    except Exception as error:
        return [Finding("crash", f"half a file {file.suffix}: {type(error).__name__}", str(error))]
    return []


def _command(place: Path, cache: Path, rounds: int) -> tuple[list[str], dict[str, Any]]:
    path = os.pathsep.join(str(ROOT / name) for name in ("src", "library"))
    environment = {**os.environ, "PYTHONPATH": path, "ATWOOD_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "tests.soak.interrupted", str(place), str(rounds)]
    return command, {"cwd": ROOT, "env": environment, "text": True}


def _stop(command: list[str], options: dict[str, Any], sent: signal.Signals, after: float) -> list[Finding]:
    """Start a process and send it a signal so many seconds after it began; return what is wrong with how it ended."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, **options, **pipes) as process:
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(after)
        if process.poll() is not None:
            errors = process.communicate()[1]
            return [Finding("crash", f"it ends with status {process.returncode}", errors)] if process.returncode else []
        process.send_signal(sent)
        try:
            _, errors = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            return [Finding("hang", "Ctrl-C does not end it", f"sent after {after:.3f} s")]
    is_quiet = not errors.strip() or (errors.startswith("Interrupted") and "Traceback" not in errors)
    if process.returncode not in (-signal.SIGKILL, 130) or (sent == signal.SIGINT and not is_quiet):
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
