"""Runs of a sweep side by side in the lanes of vectors: what one takes over a run alone, and beside heyoka's batches.

Two thousand double pendulums, chains of ten, tumbling bodies and slider-cranks, each run with a parameter or a start of
its own, at rtol 1e-8, in one thread. "alone" is the same sweep with its runs one after another in scalar code, which is
what a sweep was without lanes. Times are those of the integration, without what is prepared and read out; columns are
medians of ratios, each taken of sweeps that were made right after each other. All runs have the same bits: that is
checked. The last column is a run with 201 outputs over one with two.

heyoka gets Atwood's accelerations of the double pendulum, operation by operation, with gravity as a parameter of each
lane, and its batches have the width that is best here; the error is the median over runs of that of the angles at the
end, against a tolerance of 1e-14.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from taylor import heyoka_system
from timing import at_error, best_of, options, peer, print_table, ratio, save

from atwood import assemble, sweep
from atwood.codegen.llvm.engine import lane_count
from atwood.study.sweeps import motions
from atwood_library.scenes import SCENES

CASES = {
    "double pendulum": ("double-pendulum", "gravity", (5.0, 15.0), 10.0),
    "chain of 10": ("chain", "gravity", (5.0, 15.0), 1.0),
    "tumbling body": ("free-body", "body.spin.y", (0.5, 3.0), 10.0),
    "slider-crank": ("slider-crank", "gravity", (5.0, 15.0), 10.0),
}
"""Scene, what differs from run to run and between which values, and the end, s."""

TOLERANCES, TARGETS = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12), (1e-6, 1e-9)


def swept(assembly: Any, case: str, runs: int, width: int, **more: Any) -> tuple[float, Any]:
    """Make a sweep with so many runs side by side, 1 for one after another; return seconds a run, and the sweep."""
    _, path, (low, high), t_end = CASES[case]
    values = {path: np.random.default_rng(5).uniform(low, high, runs)}
    given = {"start": values} if path in assembly.flat.start else {"vary": values}
    kept = motions.lane_count
    motions.lane_count = lambda: width if width > 1 else 10**9  # type: ignore[assignment]
    try:
        found = sweep(assembly, combine="list", t_end=t_end, threads=1, **{"rtol": 1e-8, "outputs": 2, **given, **more})
    finally:
        motions.lane_count = kept
    assert found.statistics.batched == runs
    return found.statistics.solver_seconds / runs, found


def measure(case: str, solver: str, runs: int, repeat: int) -> dict[str, Any]:
    """Return microseconds a run alone, the shares of it that lanes take, and what outputs add."""
    assembly, most = assemble(SCENES[CASES[case][0]]()), lane_count()
    widths = [width for width in (1, 2, 4, 8) if width <= most]
    times: dict[Any, list[float]] = {width: [] for width in (*widths, "outputs")}
    first = None
    for turn in range(repeat + 1):
        for width in widths:
            seconds, found = swept(assembly, case, runs, width, solver=solver)
            bits = [found[path].tobytes() for path in found.paths]
            first = bits if first is None else first
            assert bits == first
            times[width].append(seconds)
        times["outputs"].append(swept(assembly, case, runs, most, solver=solver, outputs=201)[0])
        if not turn:  # the first may compile
            times = {key: [] for key in times}
    shares = {
        width: statistics.median(a / b for a, b in zip(times[width], times[1], strict=True)) for width in widths[1:]
    }
    with_outputs = statistics.median(a / b for a, b in zip(times["outputs"], times[most], strict=True))
    return {"us_alone": 1e6 * statistics.median(times[1]), "shares": shares, "outputs": with_outputs}


def heyoka_runs(heyoka: Any, assembly: Any, runs: int, width: int, tolerance: float) -> Callable[[], tuple[float, Any]]:
    """Return what makes all double pendulums with heyoka: seconds a run, and the angles at the end."""
    gravities = np.random.default_rng(5).uniform(*CASES["double pendulum"][2], runs)
    symbols = [one.name for one in assembly.parameters]
    system = heyoka_system(heyoka, assembly, {symbols.index("gravity"): heyoka.par[0]})
    start = np.array([np.pi / 2, np.pi / 2, 0.0, 0.0])
    integrator = heyoka.taylor_adaptive_batch(
        system, np.repeat(start[:, None], width, axis=1), tol=tolerance, pars=np.zeros((1, width))
    )

    def call() -> tuple[float, Any]:
        ends, began = np.empty((2, runs)), time.perf_counter()
        for k in range(0, runs, width):
            integrator.state[:] = start[:, None]
            integrator.pars[0] = gravities[k : k + width]
            integrator.set_time(0.0)
            integrator.step([0.05] * width)  # at this start it has no step of its own; see `taylor.py`
            integrator.propagate_until(10.0)
            ends[:, k : k + width] = integrator.state[:2]
        return (time.perf_counter() - began) / runs, ends

    return call


def beside_heyoka(heyoka: Any, runs: int, repeat: int) -> list[list[Any]]:
    """Return microseconds a run at equal errors of the double pendulum."""
    case, most = "double pendulum", lane_count()
    assembly = assemble(SCENES["double-pendulum"]())

    def own(solver: str, rtol: float) -> Callable[[], tuple[float, Any]]:
        def call() -> tuple[float, Any]:
            seconds, found = swept(assembly, case, runs, most, solver=solver, rtol=rtol)
            return seconds, np.array([found.end(f"rod{k}.angle") for k in (1, 2)])

        return call

    best = own("taylor", 1e-14)()[1]
    ways: dict[str, Callable[[float], Callable[[], tuple[float, Any]]]] = {
        "Taylor series": lambda rtol: own("taylor", rtol),
        "8(5,3)": lambda rtol: own("explicit", rtol),
        **{
            f"heyoka, {width} lanes": lambda rtol, width=width: heyoka_runs(heyoka, assembly, runs, width, rtol)
            for width in (4, 8)
            if width <= most
        },
    }
    points: dict[str, list[tuple[float, float]]] = {name: [] for name in ways}
    for rtol in TOLERANCES:
        calls = {name: way(rtol) for name, way in ways.items()}
        errors = {name: float(np.median(np.max(np.abs(call()[1] - best), axis=0))) for name, call in calls.items()}
        seconds = best_of({name: lambda call=call: call()[0] for name, call in calls.items()}, repeat)
        for name in ways:
            points[name].append((errors[name], 1e6 * seconds[name]))
    found = {name: [at_error(listed, target) for target in TARGETS] for name, listed in points.items()}
    peers = [
        min(one for one in column if one)
        for column in zip(*(v for k, v in found.items() if "heyoka" in k), strict=True)
    ]
    return [[name, *values, *map(ratio, values, peers)] for name, values in found.items()]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments, scenes=list(CASES))
    runs, most = (64, lane_count()) if chosen.quick else (2000, lane_count())
    rows, results = [], {}
    for case in ("double pendulum",) if chosen.quick else chosen.scenes:
        for solver in ("taylor", "explicit"):
            found = results[f"{case}, {solver}"] = measure(case, solver, runs, chosen.repeat)
            shares = [found["shares"].get(width) for width in (2, 4, 8)]
            rows.append([f"{case}, {solver}", found["us_alone"], *shares, found["outputs"]])
    head = ["", "us alone", *(f"{width} lanes" for width in (2, 4, 8)), "201 outputs"]
    print_table(f"a run in lanes over one alone (this machine: {most} lanes)", head, rows)
    heyoka = peer("heyoka") if not chosen.quick else None
    if heyoka is not None:
        print_table(
            "double pendulum, microseconds a run at an error, and over heyoka's best",
            ["", *(f"us at {t:g}" for t in TARGETS), *(f"x at {t:g}" for t in TARGETS)],
            beside_heyoka(heyoka, runs, chosen.repeat),
        )
    save(chosen.json, results)


if __name__ == "__main__":
    main()
