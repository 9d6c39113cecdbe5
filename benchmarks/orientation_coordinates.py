"""Coordinates of orientations: what each kind costs for the same error, beside quaternions in the same run.

Whole runs are timed, from an assembled scene to its end, with all that restating takes. Errors are those of the axes at
the end, against Taylor series at rounding.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from timing import at_error, best_of, number, options, print_table, ratio, save

from atwood import Result, Scene, assemble, simulate
from atwood_library.scenes import FreeBody, HeavyTop, LagrangeTop

KINDS = ("quaternion", "euler-zyz", "euler-xyz")

CASES: dict[str, tuple[Callable[[], Scene], str, float]] = {
    "free-body": (lambda: FreeBody(moments=(1.0, 2.0, 3.0), spin=(1.0, 0.2, 1.3)), "body", 200.0),
    "heavy-top": (HeavyTop, "top", 20.0),
    "lagrange-top": (LagrangeTop, "top", 5.0),
}

TOLERANCES = {
    "explicit": (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10),
    "taylor": (1e-6, 1e-8, 1e-10, 1e-12),
    "ida": (1e-5, 1e-6, 1e-7, 1e-8),
}


def axes_at_end(result: Result, body: str) -> Any:
    """Return the nine components of a body's axes."""
    return np.array([result[f"{body}.{axis}_axis.{part}"][-1] for axis in "xyz" for part in "xyz"])


@cache
def exact(name: str) -> Any:
    """Return where the axes are in the end."""
    make, body, t_end = CASES[name]
    return axes_at_end(simulate(make(), rtol=1e-15, solver="taylor", t_end=t_end, outputs=2, samples=1), body)


def measure(name: str, solver: str, repeat: int, rtols: Sequence[float]) -> dict[str, Any]:
    """Time one scene with one method, in all kinds of coordinates."""
    make, body, t_end = CASES[name]
    curves: dict[str, list[tuple[float, float]]] = {kind: [] for kind in KINDS}
    seen: dict[str, tuple[int, int, int]] = {}
    assemblies = {kind: assemble(make(), orientation=kind) for kind in KINDS}
    for rtol in rtols:
        last: dict[str, Result] = {}

        def timed(kind: str, rtol: float = rtol, last: dict[str, Result] = last) -> Callable[[], float]:
            def once() -> float:
                began = time.perf_counter()
                settings = {"rtol": rtol, "solver": solver, "t_end": t_end, "outputs": 2, "samples": 1}
                last[kind] = simulate(assemblies[kind], **settings)
                return time.perf_counter() - began

            return once

        seconds = best_of({kind: timed(kind) for kind in KINDS}, repeat + 1)
        for kind, result in last.items():
            curves[kind].append((float(np.max(np.abs(axes_at_end(result, body) - exact(name)))), seconds[kind]))
            seen[kind] = (
                result.run.segments[0].plan.program.size,
                result.statistics.steps,
                len(result.coordinate_switches),
            )
    return {"case": name, "solver": solver, "curves": curves, "states, steps, restated": seen}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments)
    names = list(CASES)[: 1 if chosen.quick else None]
    rtols = {"explicit": (1e-6,)} if chosen.quick else TOLERANCES
    found = [measure(name, solver, chosen.repeat, rtols[solver]) for name in names for solver in rtols]
    rows = []
    for one in found:
        curves, seen = one["curves"], one["states, steps, restated"]
        target = np.exp(np.mean(np.log([error for error, _ in curves["quaternion"]])))
        base = at_error(curves["quaternion"], target)
        for kind in KINDS:
            cost = at_error(curves[kind], target)
            shown = ratio(cost, base), number(None if cost is None else 1e3 * cost)
            rows.append([f"{one['case']}, {one['solver']}", kind, f"{target:.0e}", *shown, *seen[kind]])
    head = ["scene, method", "coordinates", "error", "/ quaternion", "ms", "states", "steps", "restated"]
    print_table("Orientations: a whole run at the same error; steps at the tightest tolerance", head, rows)
    save(chosen.json, found)


if __name__ == "__main__":
    main()
