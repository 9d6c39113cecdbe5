"""Sweeps: what a run costs beyond its integration, one thread against two, and how soon another value starts.

Ten thousand double pendulums of one second with different starts, from one assembly.  "integration" is the time in the
method itself, as the compiled loop over the runs takes it; everything else is overhead.  Runs one by one are `simulate`
on the same assembly with other start values.  Two processes, each with half of the runs in one thread, show what the
machine allows at the moment: other work on it hits both.
"""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from timing import best_of, number, options, print_table, save

from atwood import assemble, simulate, sweep
from atwood_library.scenes import SCENES, DoublePendulum

RUNS, SINGLE = 10_000, 300


def half(given: dict[str, Any]) -> float:
    """Make runs in a process of their own, which keeps its assembly; return the time."""
    assembly = vars(half).setdefault("assembly", None) or assemble(DoublePendulum())
    half.assembly = assembly  # type: ignore[attr-defined]
    began = time.perf_counter()
    sweep(assembly, start=given, combine="list", t_end=1.0, solver="explicit", threads=1)
    return time.perf_counter() - began


def starts(runs: int) -> dict[str, Any]:
    """Return angles of a double pendulum, one of each for each run."""
    random = np.random.default_rng(7)
    return {f"rod{k}.angle": random.uniform(-2.0, 2.0, runs) for k in (1, 2)}


def measure_sweeps(runs: int, repetitions: int) -> list[dict[str, Any]]:
    """Return the times of sweeps in one thread and in two, and of runs one by one."""
    assembly = assemble(DoublePendulum())
    values, masses = starts(runs), {"bob1.mass": np.random.default_rng(8).uniform(0.5, 2.0, runs)}
    few = {path: column[:SINGLE] for path, column in values.items()}
    inside: dict[str, float] = {}

    def swept(name: str, vary: Any, given: Any, **more: Any) -> Callable[[], float]:
        def call() -> float:
            found = sweep(assembly, vary, start=given, combine="list", t_end=1.0, solver="explicit", **more)
            statistics = found.statistics
            assert not found.failed
            per_run = statistics.wall_seconds / len(found)
            inside[name] = min(inside.get(name, np.inf), statistics.solver_seconds / len(found))
            return per_run

        return call

    kinds = {
        "starts, 1 thread": swept("starts, 1 thread", None, values, threads=1),
        "starts, 2 threads": swept("starts, 2 threads", None, values, threads=2),
        "masses, 1 thread": swept("masses, 1 thread", masses, values, threads=1),
        "starts one by one": swept("starts one by one", None, few, threads=1, max_seconds=1e9),
    }
    halves = [{path: column[k::2] for path, column in values.items()} for k in (0, 1)]
    with multiprocessing.get_context("spawn").Pool(2) as pool:

        def processes() -> float:
            return max(pool.map(half, halves, chunksize=1)) / runs

        processes()
        best = best_of({**kinds, "starts, 2 processes": processes}, repetitions)
    alone = best["starts, 1 thread"]
    return [
        {
            "name": name,
            "us_a_run": 1e6 * best[name],
            "us_integration": 1e6 * inside[name] if name in inside else None,
            "us_overhead": 1e6 * (best[name] - inside[name]) if name in inside and "2" not in name else None,
            "times_faster_than_one_thread": alone / best[name],
        }
        for name in best
    ]


def measure_changes(names: Sequence[str], repetitions: int) -> list[dict[str, Any]]:
    """Return how long it takes from other values to the first step, and from a scene assembled anew."""
    found = []
    for name in names:
        scene = SCENES[name]()
        first = assemble(scene)
        path = next(iter(first.flat.start), "") or next(iter(first.flat.guess))
        gravity = [scene.gravity]

        def change(first: Any = first, gravity: list[float] = gravity) -> float:
            gravity[0] += 1e-6
            began = time.perf_counter()
            _first_step(first.with_values({"gravity": gravity[0]}))
            return time.perf_counter() - began

        def start(first: Any = first, path: str = path) -> float:
            began = time.perf_counter()
            _first_step(first.with_values(start={path: first.flat.start.get(path, first.flat.guess.get(path))}))
            return time.perf_counter() - began

        def anew(scene: Any = scene) -> float:
            began = time.perf_counter()
            _first_step(assemble(scene))
            return time.perf_counter() - began

        best = best_of({"parameter": change, "start": start, "assembled anew": anew}, repetitions)
        found.append({"scene": name, **{kind: 1e3 * seconds for kind, seconds in best.items()}})
    return found


def _first_step(assembly: Any) -> None:
    """Take one step, with no output on the way."""
    simulate(assembly, t_end=1.0, max_steps=1, outputs=2, samples=1)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, and print tables."""
    chosen = options(__doc__, arguments)
    sweeps = measure_sweeps(200 if chosen.quick else RUNS, chosen.repeat)
    names = (
        ["double-pendulum"] if chosen.quick else ["simple-pendulum", "double-pendulum", "four-bar", "chain", "atwood"]
    )
    changes = measure_changes(names, chosen.repeat if chosen.quick else 5 * chosen.repeat)
    print_table(
        "double pendulums of 1 s at rtol 1e-8, microseconds a run",
        ["sweep", "all", "integration", "overhead", "one thread / this"],
        [list(row.values()) for row in sweeps],
    )
    print_table(
        "milliseconds to the end of the first step",
        ["scene", "other parameter", "other start", "assembled anew", "anew / parameter"],
        [[*row.values(), number(row["assembled anew"] / row["parameter"])] for row in changes],
    )
    save(chosen.json, {"sweeps": sweeps, "changes": changes})


if __name__ == "__main__":
    main(sys.argv[1:])
