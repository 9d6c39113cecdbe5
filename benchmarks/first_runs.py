"""The first result of a scene whose structure is new to the process and to the cache, over the import of NumPy.

In each round a process imports NumPy and Atwood and runs other scenes, so that what a machine compiles once, whatever
the scene, is in the cache; modules have bytecode, as where they are installed. For each scene and form it forks: the
child takes a copy of that cache, and makes the scene and its first result. The ratio is of time of the processor, or of
the clock, over that of the import in that round; medians of the rounds are shown. LLVM is what is awaited of it.
"Again" is the same structure in a new scene in the same child. BLAS has one thread.
"""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

SPAN = 0.01
"""Seconds of motion: all that is seen is the way to the first result."""

BEFORE = ("double-pendulum", "slider-crank", "spherical-pendulum", "atwood", "stick-slip")
"""What was run before, in both forms; those of them that are measured follow others."""

TAPED = ("flyball-governor", "heavy-top", "four-bar", "two-body", "strandbeest", "double-cardan-twice")
"""The same, with something beside that makes another structure of them: their programs are long enough for tapes, and
between them they use all routines that a machine compiles once."""

FORMS = ("reduced", "dae")
GOALS = {"trees": 2.0, "reduced": 5.0, "dae": 10.0}
Made = dict[str, dict[str, float]]


def scenes() -> dict[str, Callable[[], Any]]:
    """Return what is run: the library's scenes, and trees of ten bodies."""
    from atwood_library.scenes import SCENES, Chain

    trees: dict[str, Callable[[], Any]] = {"chain of 10": lambda: Chain(links=10)}
    return trees | dict(SCENES)


def one_round(names: Sequence[str], report: Path) -> None:
    """Import NumPy, run other scenes, and each of these in a child; write what was measured."""
    began, clock = time.process_time(), time.perf_counter()
    import numpy  # noqa: F401

    imported = {"processor": time.process_time() - began, "clock": time.perf_counter() - clock}
    warnings.simplefilter("ignore")
    from atwood import simulate
    from atwood_library import PointMass

    made, found = scenes(), dict[str, Any]()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ATWOOD_CACHE_DIR"] = known = str(Path(folder) / "known")
        for name in BEFORE:
            for form in FORMS:
                simulate(made[name](), form=form, t_end=SPAN)
        for name in TAPED:
            for form in FORMS:
                scene = made[name]()
                scene.add("beside", PointMass(mass=1.0))
                simulate(scene, form=form, t_end=SPAN)
        for name in names:
            for form in FORMS:
                found[f"{name} {form}"] = in_child(made[name], form, known, Path(folder))
    report.write_text(json.dumps({"import": imported, "runs": found}), encoding="utf-8")


def in_child(make: Callable[[], Any], form: str, known: str, folder: Path) -> Any:
    """Return what the first result of a scene takes in a child of this process."""
    written = folder / "child.json"
    written.unlink(missing_ok=True)
    child = os.fork()
    if not child:
        try:
            written.write_text(json.dumps(first_result(make, form, known, folder / "new")), encoding="utf-8")
        finally:
            os._exit(0)
    os.waitpid(child, 0)
    shutil.rmtree(folder / "new", ignore_errors=True)
    return json.loads(written.read_text(encoding="utf-8")) if written.exists() else None


def first_result(make: Callable[[], Any], form: str, known: str, own: Path) -> dict[str, float] | None:
    """Make a scene and its first result, and those again; None where the scene does not run in this form."""
    from atwood import AtwoodError, simulate
    from atwood.codegen.llvm import build, tiers

    os.environ["ATWOOD_CACHE_DIR"] = str(shutil.copytree(known, own))
    compiling, awaited = build.compile_text, [0.0]

    def timed(*given: Any, **named: Any) -> bytes:
        began = time.perf_counter()
        try:
            return compiling(*given, **named)
        finally:
            awaited[0] += time.perf_counter() - began

    build.compile_text = tiers.compile_text = timed
    spent = {}
    for key in ("", " again"):
        processor, clock = time.process_time(), time.perf_counter()
        try:
            result = simulate(make(), form=form, t_end=SPAN)
        except AtwoodError:
            return None
        spent[f"processor{key}"] = time.process_time() - processor
        spent[f"clock{key}"] = time.perf_counter() - clock
        if not key:
            spent["LLVM"] = awaited[0]
            spent |= {f"stage {name}": seconds for name, seconds in result.timings.items()}
    return spent


def ratios(rounds: Sequence[Any], run: str) -> dict[str, float]:
    """Return the medians over the rounds of what a run takes, each over its round's import."""
    kept: dict[str, list[float]] = {}
    for one in rounds:
        for key, seconds in (one["runs"][run] or {}).items():
            kept.setdefault(key, []).append(seconds / one["import"]["processor" if "processor" in key else "clock"])
    return {key: statistics.median(several) for key, several in kept.items()}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    from timing import options, print_table, save

    chosen = options(__doc__, arguments, scenes=list(scenes()))
    names = chosen.scenes[:2] if chosen.quick else chosen.scenes
    rounds = []
    told = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    told.pop("PYTHONDONTWRITEBYTECODE", None)
    for _ in range(chosen.repeat):
        with tempfile.TemporaryDirectory() as folder:
            report = Path(folder) / "round.json"
            subprocess.run([sys.executable, __file__, "--round", str(report), *names], env=told, check=True)
            rounds.append(json.loads(report.read_text(encoding="utf-8")))
    found: Made = {run: made for run in rounds[0]["runs"] if (made := ratios(rounds, run))}
    columns = ("processor", "clock", "LLVM", "processor again")
    for form in FORMS:
        of_form = {run.removesuffix(f" {form}"): made for run, made in found.items() if run.endswith(f" {form}")}
        rows = [[scene, *map(made.get, columns)] for scene, made in of_form.items()]
        rows.sort(key=lambda row: -row[1])
        reached = sum(row[1] <= GOALS[form] for row in rows)
        title = f"{form}: first results, as times the import of NumPy; {reached} of {len(rows)} at most {GOALS[form]:g}"
        print_table(f"{title}, median {statistics.median(row[1] for row in rows):.2g}", ["scene", *columns], rows)
    save(chosen.json, {"first runs": found})


if __name__ == "__main__":
    if sys.argv[1:2] == ["--round"]:
        one_round(sys.argv[3:], Path(sys.argv[2]))
    else:
        main()
