"""From starting a process to its printed result, with an empty and with a filled cache; and what imports cost."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from timing import best_of, options, print_table, ratio, save

ROOT = Path(__file__).resolve().parents[1]
CHAIN = "from atwood_library.scenes import Chain\n\nscene = Chain(links=40, mass=1.0 / 40)\n"
IMPORTS = ("", "numpy", "atwood", "atwood_library.scenes", "scipy.integrate", "sksundae", "networkx", "sympy")
PEERS = ("mujoco", "pinocchio", "exudyn", "heyoka", "casadi")


def process(arguments: Sequence[str], cache: str = "") -> float:
    """Return the seconds of a process from its start to its end; byte code is cached."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    paths = [str(ROOT / "src"), str(ROOT / "library"), environment.get("PYTHONPATH", "")]
    environment["PYTHONPATH"] = os.pathsep.join(path for path in paths if path)
    if cache:
        environment["ATWOOD_CACHE_DIR"] = cache
    began = time.perf_counter()
    done = subprocess.run([sys.executable, *arguments], env=environment, capture_output=True, text=True)
    spent = time.perf_counter() - began
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(arguments)} failed:\n{done.stderr}")
    return spent


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments)
    repeat = min(chosen.repeat, 5)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "chain40.py"
        file.write_text(CHAIN, encoding="utf-8")
        runs = {"double-pendulum --t-end 10": ["double-pendulum", "--t-end", "10"]}
        if not chosen.quick:
            runs["chain of 40, 1 s"] = [f"{file}:scene", "--t-end", "1"]
        warm = str(Path(folder) / "warm")

        def cold(command: Sequence[str]) -> float:
            with tempfile.TemporaryDirectory() as empty:
                return process(["-m", "atwood", "run", *command], empty)

        measures: dict[str, Callable[[], float]] = {}
        for name, command in runs.items():
            process(["-m", "atwood", "run", *command], warm)  # fill the cache, and write byte code
            measures[f"cold {name}"] = lambda command=command: cold(command)
            measures[f"warm {name}"] = lambda command=command: process(["-m", "atwood", "run", *command], warm)
        installed = [name for name in PEERS if importlib.util.find_spec(name) is not None]
        for name in IMPORTS[:3] if chosen.quick else [*IMPORTS, *installed]:
            measures[f"import {name}"] = lambda name=name: process(["-c", f"import {name}" if name else "pass"])
        best = best_of(measures, repeat)
    rows = [
        [
            name,
            ratio(best[f"cold {name}"], best[f"warm {name}"]),
            best[f"cold {name}"],
            best[f"warm {name}"],
            "0.8, 0.5" if name.startswith("double") else "2, -",
        ]
        for name in runs
    ]
    print_table("atwood run, whole process", ["scene", "cold / warm", "cold s", "warm s", "goals s"], rows)
    empty = best["import "]
    rows = [
        [name[7:] or "(nothing)", ratio(seconds - empty, empty), seconds - empty, seconds]
        for name, seconds in best.items()
        if name.startswith("import ")
    ]
    print_table("Imports", ["module", "/ empty process", "s more", "s in all"], rows)
    save(chosen.json, {"startup": best})


if __name__ == "__main__":
    main()
