"""Trials of memory: many runs of ten kinds in one process, which must not grow."""

from __future__ import annotations

import contextlib
import gc
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from atwood import AtwoodError, load_result, report, save_result, simulate, sweep
from atwood_library.scenes import SCENES

from .trial import Discarded, Finding, Trial

RUNS = 10_000
"""Runs of one trial; with the command's limit raised: ``--kind memory --count 1 --limit 7200``."""

WARM = 30
"""Runs of each kind before memory is looked at: what is loaded and kept once is there by then."""

ALLOWED = 20e6
"""Bytes by which the process may grow."""


def _run(name: str, **options: Any) -> Callable[[np.random.Generator], object]:
    """Return a function that runs a library scene, its gravity a little different each time."""

    def go(random: np.random.Generator) -> object:
        scene = SCENES[name](gravity=9.0 + float(random.random()))
        result = simulate(scene, t_end=0.02, outputs=3, **options)
        return result.table(), result.energy.max_drift

    return go


def _refused(random: np.random.Generator) -> object:
    scene = SCENES["four-bar"]()
    scene.start["nothing.there"] = float(random.random())
    with contextlib.suppress(AtwoodError):
        simulate(scene, t_end=0.02)
    return None


def _swept(random: np.random.Generator) -> object:
    values = 0.5 + random.random(4)
    return sweep(SCENES["double-pendulum"](), vary={"mass2": values}, t_end=0.02, outputs=3)


def _saved(random: np.random.Generator) -> object:
    result = simulate(SCENES["simple-pendulum"](gravity=9.0 + float(random.random())), t_end=0.02, outputs=3)
    with tempfile.TemporaryDirectory() as directory:
        return load_result(save_result(result, Path(directory) / "run.nc"))


KINDS: dict[str, Callable[[np.random.Generator], object]] = {
    "explicit": _run("double-pendulum", solver="explicit"),
    "taylor": _run("double-pendulum", solver="taylor"),
    "dae": _run("double-pendulum", form="dae"),
    "python kernels": _run("double-pendulum", solver="ida-sundae"),
    "loop": _run("four-bar"),
    "space": _run("heavy-top"),
    "report": lambda random: report(SCENES["simple-pendulum"](gravity=9.0 + float(random.random()))).to_dict(),
    "refused": _refused,
    "sweep": _swept,
    "saved": _saved,
}
"""Ten kinds of runs."""


def resident() -> int:
    """Return the memory of this process, bytes.

    Raises
    ------
    Discarded
        Where the system does not tell.
    """
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError as error:
        raise Discarded("this system does not tell the memory of a process") from error
    return pages * 4096


def growth(runs: int, seed: int, kinds: tuple[str, ...] = tuple(KINDS), warm: int = WARM) -> int:
    """Return by how many bytes the process grows in so many runs, after some to warm up."""
    random = np.random.default_rng(seed)
    for _ in range(warm):
        for kind in kinds:
            KINDS[kind](random)
    gc.collect()
    before = resident()
    for i in range(runs):
        KINDS[kinds[i % len(kinds)]](random)
    gc.collect()
    return resident() - before


def check(seed: int) -> Trial:
    """Make many runs and look how much the process has grown."""
    grown = growth(RUNS, seed)
    words = (f"{RUNS} runs grow by {grown / 1e6:.1f} MB",)
    return Trial(words, (Finding("wrong", "memory grows", words[0]),) if grown > ALLOWED else ())
