"""Closed loops: milliseconds for an error, beside the same method on minimal equations by hand in C.

The C integrates one angle with the method of order 8(5,3); loops of planar linkages are closed by formulas there, and
Bricard's by Newton's method. Atwood's time is that inside its session; whole calls of `simulate` on an assembly are
told too. Errors are those of the angle at the end, against an extrapolation in 128 bits.
"""

from __future__ import annotations

import math
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from ctypes import c_double, c_int, c_long, c_void_p
from dataclasses import dataclass, field
from typing import Any

import by_hand
import numpy as np
from timing import at_error, options, print_table, ratio, save

from atwood import Scene, assemble, simulate
from atwood.errors import AtwoodError
from atwood_library.scenes import AndrewsSqueezer, Bricard, FourBar, SliderCrank

ERRORS = (1e-3, 1e-6, 1e-9, 1e-11)
SOLVERS = ("explicit", "taylor", "ida")
FORMS = ("reduced", "dae")


@dataclass(frozen=True)
class Work:
    """A mechanism for C and for Atwood.

    Attributes
    ----------
    file, parameters, defines
        The mechanism by hand.
    scene, angle, guess
        Atwood's, the path of the angle that the C integrates, and where the others are at the start.
    start, t_end
        Angle and rate at the start, and the end, s.
    """

    file: str
    scene: Callable[[], Scene]
    parameters: Sequence[float]
    angle: str
    start: tuple[float, float]
    t_end: float
    guess: Mapping[str, float] = field(default_factory=dict)
    defines: Mapping[str, object] = field(default_factory=dict)


CRANK, COUPLER = "crank.angle", "coupler.angle"
SLIDER, BARS = [0.5, 1.5, 0.25, 0.5, 0.5, 9.81], [1.0, 2.5, 2.0, 2.5, 0.1, 0.25, 0.2, 9.81]

CASES: dict[str, Work] = {
    "slider-crank": Work("slider_crank", SliderCrank, SLIDER, CRANK, (0.5, 3.0), 2.0),
    "slider-crank of 0.15 m, 30 rad/s": Work(
        "slider_crank",
        lambda: SliderCrank(crank_length=0.15, rod_length=0.35),
        [0.15, 0.35, *SLIDER[2:]],
        CRANK,
        (0.5, 30.0),
        1.0,
    ),
    "four-bar": Work("four_bar", FourBar, BARS, CRANK, (1.0, 2.0), 2.0),
    "four-bar, 30 rad/s": Work("four_bar", FourBar, BARS, CRANK, (1.0, 30.0), 2.0),
    "four-bar with a dead centre in each swing": Work(
        "double_rocker",
        lambda: FourBar(crank_length=2.0, coupler_length=1.0, rocker_length=2.5, frame_length=2.5),
        [2.0, 1.0, 2.5, *BARS[3:]],
        COUPLER,
        (0.3, 12.0),
        2.0,
        {"crank.angle": 1.1, "rocker.angle": 2.0},
        {"SIDE": 1},
    ),
    "Andrews' squeezer": Work(
        "andrews", AndrewsSqueezer, [0.033, 4530.0, 0.07785], "k1.angle", (-0.06171389001427645, 0.0), 0.03
    ),
    "Bricard": Work("bricard", Bricard, [1.0, 1.0, 0.1, 9.81], "hinge1.angle", (0.0, 0.0), 10.0),
}

TOLERANCES = [10.0 ** (-0.5 * k) for k in range(4, 29)]


def truth(work: Work) -> float:
    """Return the angle at the end."""
    for number in ("_Float128", "long double"):
        try:
            defines = {"MECHANISM": f'"{work.file}.c"', "REAL": number, **work.defines}
            code = by_hand.load("reference", "-O2", defines)
        except subprocess.CalledProcessError:
            continue
        if code is None:
            break
        code.reference.argtypes = [c_double, c_double, c_void_p, c_int, c_void_p]
        code.reference.restype = c_long
        p, y = np.array(work.parameters), np.array(work.start)
        if code.reference(work.t_end, 1e-18, p.ctypes.data, len(p), y.ctypes.data) >= 0:
            return float(y[0])
    raise SystemExit(f"{work.file}: no reference")


def by_hand_run(work: Work, flags: str) -> Callable[[float], Any]:
    """Return what makes a run for a tolerance: its seconds, twice, and the angle at its end."""
    code = by_hand.load("explicit", flags, {"MECHANISM": f'"{work.file}.c"', **work.defines})
    if code is None:
        raise SystemExit("no C compiler")
    integrate = code.integrate
    integrate.argtypes = [c_double, c_double, c_double, c_void_p, c_void_p, c_void_p]
    p, counts, y = np.array(work.parameters), np.zeros(3, dtype=c_long), np.zeros(2)

    def run(tolerance: float) -> tuple[float, float, float]:
        y[:] = work.start
        began = time.perf_counter()
        failed = integrate(work.t_end, tolerance, tolerance, p.ctypes.data, y.ctypes.data, counts.ctypes.data)
        spent = time.perf_counter() - began
        return (spent, spent, math.nan if failed else float(y[0]))

    run.keep = code, p, counts, y  # type: ignore[attr-defined]  # C has only their addresses
    return run


def atwood_run(work: Work, form: str, solver: str) -> Callable[[float], Any] | None:
    """Return the same with Atwood: seconds of its integration, and of the whole call; None where it refuses."""
    scene = work.scene()
    rate = work.angle.replace("angle", "angular_velocity")
    scene.start = {work.angle: work.start[0], rate: work.start[1]} if work.file != "bricard" else scene.start
    scene.guess.update(work.guess)
    assembly = assemble(scene, form=form)

    def run(tolerance: float) -> tuple[float, float, float]:
        began = time.perf_counter()
        result = simulate(assembly, t_end=work.t_end, rtol=tolerance, solver=solver, outputs=2, samples=1)
        spent = time.perf_counter() - began
        return result.run.statistics.seconds, spent, float(result[work.angle][-1])

    try:
        run(1e-6)  # compiles
    except AtwoodError:
        return None
    return run


def sides_of(work: Work, flags: str) -> dict[str, Callable[[float], Any]]:
    """Return all ways to run it."""
    sides = {"C": by_hand_run(work, flags)}
    for form in FORMS:
        for solver in SOLVERS:
            run = atwood_run(work, form, solver)
            if run is not None:
                sides[solver if form == "reduced" else f"dae {solver}"] = run
    return sides


def measure(work: Work, flags: str, repetitions: int, tolerances: list[float]) -> dict[str, Any]:
    """Return seconds and errors of each side at each tolerance, in turn."""
    sides, exact = sides_of(work, flags), truth(work)
    found: dict[str, Any] = {side: [] for side in sides}
    for tolerance in tolerances:
        seconds = {side: [np.inf, np.inf] for side in sides}
        ends: dict[str, float] = {}
        for _ in range(repetitions):
            for side, run in sides.items():
                if side in ends and ends[side] != ends[side]:
                    continue
                try:
                    inside, whole, ends[side] = run(tolerance)
                except AtwoodError:
                    ends[side] = math.nan
                    continue
                seconds[side] = [min(seconds[side][0], inside), min(seconds[side][1], whole)]
        for side in sides:
            if math.isfinite(ends[side]):
                found[side].append((tolerance, *seconds[side], abs(ends[side] - exact)))
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table for each mechanism."""
    asked = options(__doc__, arguments, scenes=list(CASES))
    tolerances = TOLERANCES[:16:8] if asked.quick else TOLERANCES
    results = {}
    for name in list(asked.scenes)[: 1 if asked.quick else None]:
        found = results[name] = measure(CASES[name], asked.cflags, asked.repeat, tolerances)
        points = {side: [(error, inside) for _, inside, _, error in rows] for side, rows in found.items()}
        whole = {side: [(error, spent) for _, _, spent, error in rows] for side, rows in found.items()}
        head = ["", *(f"x C at {t:g}" for t in ERRORS), *(f"ms at {t:g}" for t in ERRORS), "least error"]
        rows = []
        for side in found:
            cells = [at_error(points[side], error) for error in ERRORS]
            base = [at_error(points["C"], error) for error in ERRORS]
            milliseconds = [None if cell is None else 1e3 * cell for cell in cells]
            least = min((error for error, _ in points[side]), default=math.nan)
            rows.append([side, *map(ratio, cells, base), *milliseconds, f"{least:.0e}"])
        if "explicit" in whole:
            cells = [at_error(whole["explicit"], error) for error in ERRORS]
            rows.append(
                [
                    "simulate, explicit",
                    *map(ratio, cells, base),
                    *(None if cell is None else 1e3 * cell for cell in cells),
                    "",
                ]
            )
        print_table(f"{name}, {CASES[name].t_end:g} s", head, rows)
    save(asked.json, results)


if __name__ == "__main__":
    main()
