"""How soon something happens: from starting a process to its printed result. For what follows see `opening.py`.

Processes are started in turn, in at least 15 rounds, and each is divided by the import of NumPy of its own round; the
medians of these ratios are shown, of time on the clock and of processor time (what others do on the machine changes the
first far more than the second). On both sides byte code is written before, BLAS has one thread, and output goes to a
pipe.
"""

from __future__ import annotations

import importlib.util
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from timing import options, print_table, save

ROOT = Path(__file__).resolve().parents[1]
ROUNDS = 15
CHAIN = "from atwood_library.scenes import Chain\n\nscene = Chain(links=40, mass=1.0 / 40)\n"
IMPORTS = {
    "empty process": "pass",
    "numpy": "import numpy",
    "numpy, llvmlite": "import numpy, llvmlite.binding",
    "numpy, click": "import numpy, click",
    "atwood": "import atwood",
    "a scene of the library": "from atwood_library.scenes import DoublePendulum",
    "atwood.pipeline": "import atwood.pipeline",
}
GOALS = {
    "atwood": 1.3,
    "warm run double-pendulum --t-end 10": 3.2,
    "cold run double-pendulum --t-end 10": "warm + 1.5",
}
PEERS = ("mujoco", "pinocchio", "exudyn", "heyoka", "casadi")
Spent = tuple[float, float]
"""Seconds on the clock, and of the processor."""


def environment() -> dict[str, str]:
    found = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    paths = [str(ROOT / "src"), str(ROOT / "library"), found.get("PYTHONPATH", "")]
    found["PYTHONPATH"] = os.pathsep.join(path for path in paths if path)
    return found | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def process(arguments: Sequence[str], cache: str = "") -> Spent:
    """Return what a process takes from its start to its end."""
    told = environment() | ({"ATWOOD_CACHE_DIR": cache} if cache else {})
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run([sys.executable, *arguments], env=told, capture_output=True, text=True)
    spent, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(arguments)} failed:\n{done.stderr}")
    return spent, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def processes(folder: Path, quick: bool) -> dict[str, Callable[[], Spent]]:
    """Return what starts each process; caches are filled, and byte code is written."""
    file = folder / "chain40.py"
    file.write_text(CHAIN, encoding="utf-8")
    runs = {"double-pendulum --t-end 10": ["double-pendulum", "--t-end", "10"]}
    imports = dict(IMPORTS)
    if not quick:
        runs["chain of 40 --t-end 1"] = [f"{file}:scene", "--t-end", "1"]
        imports |= {name: f"import {name}" for name in PEERS if importlib.util.find_spec(name) is not None}
    measures: dict[str, Callable[[], Spent]] = {}
    for name, code in imports.items():
        measures[name] = lambda code=code: process(["-c", code])
    warm = str(folder / "warm")

    def cold(command: Sequence[str]) -> Spent:
        with tempfile.TemporaryDirectory() as empty:
            return process(["-m", "atwood", "run", *command], empty)

    for name, command in runs.items():
        measures[f"warm run {name}"] = lambda command=command: process(["-m", "atwood", "run", *command], warm)
        measures[f"cold run {name}"] = lambda command=command: cold(command)
    return measures


def in_turn(measures: dict[str, Callable[[], Spent]], rounds: int) -> dict[str, list[Spent]]:
    """Return what each process took in each round; the first round of all is not kept."""
    spent: dict[str, list[Spent]] = {name: [] for name in measures}
    for number in range(rounds + 1):
        for name, measure in measures.items():
            one = measure()
            if number:
                spent[name].append(one)
    return spent


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments)
    rounds = 1 if chosen.quick else max(ROUNDS, chosen.repeat)
    with tempfile.TemporaryDirectory() as folder:
        spent = in_turn(processes(Path(folder), chosen.quick), rounds)
    rows, kept = [], {}
    for name, taken in spent.items():
        on_clock, of_processor = (
            statistics.median(one[kind] / other[kind] for one, other in zip(taken, spent["numpy"], strict=True))
            for kind in (0, 1)
        )
        kept[name] = {"clock": on_clock, "processor": of_processor, "seconds": min(one[0] for one in taken)}
        rows.append([name, on_clock, of_processor, kept[name]["seconds"], GOALS.get(name)])
    title = f"Processes, as times the import of NumPy; medians of {rounds} rounds"
    print_table(title, ["process", "clock", "processor", "least s", "goal"], rows)
    save(chosen.json, {"startup": kept})


if __name__ == "__main__":
    main()
