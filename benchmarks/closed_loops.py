"""Loops that formulas solve: milliseconds for an error, beside the same method on minimal equations by hand in C.

Both integrate one angle with the method of order 8(5,3). Atwood's time is that inside its session, with Taylor series
and IDA on the numeric loop beside it; whole calls of `simulate` on an assembly are told too.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from ctypes import c_double, c_long, c_void_p
from typing import Any

import by_hand
import numpy as np
from timing import at_error, options, print_table, ratio, save

from atwood import Scene, assemble, simulate
from atwood_library.scenes import FourBar, SliderCrank

CASES: dict[str, tuple[str, Callable[[], Scene], list[float], float, float]] = {
    "slider-crank": ("slider_crank", SliderCrank, [0.5, 1.5, 0.25, 0.5, 0.5, 9.81], 0.5, 3.0),
    "slider-crank, 30 rad/s": ("slider_crank", SliderCrank, [0.5, 1.5, 0.25, 0.5, 0.5, 9.81], 0.5, 30.0),
    "four-bar": ("four_bar", FourBar, [1.0, 2.5, 2.0, 2.5, 0.1, 0.25, 0.2, 9.81], 1.0, 2.0),
    "four-bar, 30 rad/s": ("four_bar", FourBar, [1.0, 2.5, 2.0, 2.5, 0.1, 0.25, 0.2, 9.81], 1.0, 30.0),
}
"""The file by hand, the scene, its parameters, and where the crank starts."""

T_END = 2.0
TOLERANCES = [10.0**-k for k in range(3, 14)]
ERRORS = (1e-3, 1e-6, 1e-9)


def by_hand_run(file: str, parameters: list[float], start: tuple[float, float], flags: str) -> Callable[[float], Any]:
    """Return what makes a run for a tolerance: its seconds and the angle at its end."""
    code = by_hand.load("explicit", flags, {"MECHANISM": f'"{file}.c"'})
    if code is None:
        raise SystemExit("no C compiler")
    integrate = code.integrate
    integrate.argtypes = [c_double, c_double, c_double, c_void_p, c_void_p, c_void_p]
    p, counts, y = np.array(parameters), np.zeros(3, dtype=c_long), np.zeros(2)

    def run(tolerance: float) -> tuple[float, float, float]:
        y[:] = start
        began = time.perf_counter()
        failed = integrate(T_END, tolerance, tolerance, p.ctypes.data, y.ctypes.data, counts.ctypes.data)
        spent = time.perf_counter() - began
        if failed:
            raise SystemExit(f"{file}: the run by hand failed at {tolerance:g}")
        return spent, spent, float(y[0])

    run.keep = code, p, counts, y  # type: ignore[attr-defined]  # C has only their addresses
    return run


def atwood_run(scene: Scene, start: tuple[float, float], solver: str) -> Callable[[float], Any]:
    """Return the same with Atwood: seconds of its integration, and of the whole call."""
    scene.start = {"crank.angle": start[0], "crank.angular_velocity": start[1]}
    assembly = assemble(scene)

    def run(tolerance: float) -> tuple[float, float, float]:
        began = time.perf_counter()
        result = simulate(assembly, t_end=T_END, rtol=tolerance, solver=solver, outputs=2, samples=1)
        spent = time.perf_counter() - began
        return result.run.statistics.seconds, spent, float(result["crank.angle"][-1])

    return run


def measure(name: str, flags: str, repetitions: int, tolerances: list[float]) -> dict[str, Any]:
    """Return seconds and errors of each side at each tolerance, in turn."""
    file, scene, parameters, *start = CASES[name]
    place = (start[0], start[1])
    sides = {
        "C": by_hand_run(file, parameters, place, flags),
        "explicit": atwood_run(scene(), place, "explicit"),
        "taylor": atwood_run(scene(), place, "taylor"),
        "ida": atwood_run(scene(), place, "ida"),
    }
    truth = sides["C"](1e-15)[2]
    found: dict[str, Any] = {side: [] for side in sides}
    for tolerance in tolerances:
        seconds = {side: [np.inf, np.inf] for side in sides}
        ends = {}
        for _ in range(repetitions):
            for side, run in sides.items():
                inside, whole, ends[side] = run(tolerance)
                seconds[side] = [min(seconds[side][0], inside), min(seconds[side][1], whole)]
        for side in sides:
            found[side].append((tolerance, *seconds[side], abs(ends[side] - truth)))
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table for each mechanism."""
    asked = options(__doc__, arguments)
    tolerances = TOLERANCES[:2] if asked.quick else TOLERANCES
    results = {}
    for name in CASES:
        found = results[name] = measure(name, asked.cflags, asked.repeat, tolerances)
        points = {side: [(error, inside) for _, inside, _, error in rows] for side, rows in found.items()}
        whole = {side: [(error, spent) for _, _, spent, error in rows] for side, rows in found.items()}
        rows = []
        for error in ERRORS:
            base = at_error(points["C"], error)
            cells = [at_error(points[side], error) for side in found]
            calls = at_error(whole["explicit"], error)
            rows.append(
                [
                    f"{error:g}",
                    *(None if cell is None else 1e3 * cell for cell in cells),
                    ratio(cells[1], base),
                    ratio(cells[2], base),
                    None if calls is None else 1e3 * calls,
                ]
            )
        head = ["error, rad", *(f"{side}, ms" for side in found), "explicit / C", "taylor / C", "simulate, ms"]
        print_table(f"{name}, {T_END:g} s", head, rows)
    save(asked.json, results)


if __name__ == "__main__":
    main()
