"""Milliseconds for an error: the double pendulum over 10 s, chains of 10 and 40 links over 1 s.

The error is the largest of the angles (double pendulum) or of the tip's position (chains) at the end, against
a solution at a much tighter tolerance.  Times are those of the integration alone.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import peers
from timing import at_error, best_of, options, peer, print_table, ratio, save

from atwood import AtwoodError, Model, assemble, simulate
from atwood_library.scenes import Chain, DoublePendulum

TARGETS = (1e-3, 1e-6, 1e-9)

EARLIER: dict[str, dict[str, tuple[float | None, ...]]] = {
    "double pendulum": {
        "C by hand, order 8(5,3)": (0.069, 0.150, 0.32),
        "heyoka (Taylor)": (0.119, 0.176, 0.176),
        "Pinocchio, RK4 in C++ / with SciPy": (3.7, 7.4, 28.0),
        "Exudyn": (3.7, 11.5, 37.0),
        "MuJoCo RK4": (9.2, 24.0, 170.0),
        "C by hand with IDA, stabilised DAE": (3.8, 17.5, None),
        "sympy (Kane) with SciPy": (36.0, 74.0, 237.0),
    },
    "chain of 10": {
        "C by hand, order 8(5,3)": (0.072, 0.18, 0.33),
        "heyoka (Taylor)": (0.51, 0.51, 0.68),
        "Pinocchio, RK4 in C++ / with SciPy": (10.0, 18.0, 43.0),
        "Exudyn": (6.7, 28.0, 79.0),
        "MuJoCo RK4": (3.8, 9.8, 36.0),
        "C by hand with IDA, stabilised DAE": (2.0, 7.0, None),
        "sympy (Kane) with SciPy": (27.0, 51.0, 87.0),
    },
    "chain of 40": {
        "C by hand, order 8(5,3)": (0.84, 1.6, 2.1),
        "heyoka (Taylor)": (5.1, 5.1, 18.0),
        "Pinocchio, RK4 in C++ / with SciPy": (40.0, 81.0, 81.0),
        "Exudyn": (395.0, 395.0, 1712.0),
        "MuJoCo RK4": (26.0, 138.0, None),
        "C by hand with IDA, stabilised DAE": (18.0, 81.0, 169.0),
    },
}
"""Milliseconds at `TARGETS`, measured on one quiet core before the project began."""

WAYS = {
    "Atwood explicit": ("reduced", "explicit", 1e-14),
    "Atwood IDA reduced": ("reduced", "ida", 1e-12),
    "Atwood IDA dae ggl": ("dae", "ida", 1e-12),
}

Run = Callable[[], tuple[float, Any]]


def turned(difference: Any) -> Any:
    """Return differences of angles without whole turns."""
    return (difference + np.pi) % (2.0 * np.pi) - np.pi


def atwood_run(assembly: Any, solver: str, rtol: float, t_end: float, paths: Sequence[str]) -> tuple[float, Any]:
    """Return seconds and the quantities at the end."""
    result = simulate(assembly, solver=solver, rtol=rtol, t_end=t_end, outputs=2, samples=1)
    return result.statistics.seconds, np.array([result.array(path)[-1] for path in paths])


def scipy_run(rates: Any, rtol: float) -> tuple[float, Any]:
    """Return seconds and the angles at the end, by SciPy."""
    from scipy.integrate import solve_ivp

    start = [np.pi / 2.0, np.pi / 2.0, 0.0, 0.0]
    began = time.perf_counter()
    made = solve_ivp(rates, (0.0, 10.0), start, method="DOP853", rtol=rtol, atol=rtol)
    return time.perf_counter() - began, made.y[:2, -1]


def curves(name: str, scene: Model, t_end: float, paths: Sequence[str], chosen: Any) -> dict[str, Any]:
    """Return the work-precision points of every way to solve a scene."""
    angles = name == "double pendulum"
    assemblies = {form: assemble(scene, form=form) for form in ("reduced", "dae")}
    [(_, best), (_, second)] = (
        atwood_run(assemblies["reduced"], "explicit", rtol, t_end, paths) for rtol in (1e-14, 3e-14)
    )

    def error_of(values: Any) -> float:
        difference = values - best
        return float(np.max(np.abs(turned(difference) if angles else difference)))

    tolerances = [10.0**-k for k in ((3, 6) if chosen.quick else range(2, 14))]
    runs: dict[str, list[tuple[float, Run]]] = {}
    for way, (form, solver, least) in WAYS.items():
        runs[way] = [
            (rtol, partial(atwood_run, assemblies[form], solver, rtol, t_end, paths))
            for rtol in tolerances
            if rtol >= least * 0.99
        ]
    if angles and not chosen.quick and peer("sympy"):
        rates = peers.kane_double_pendulum()
        runs["sympy Kane, SciPy DOP853"] = [(rtol, partial(scipy_run, rates, rtol)) for rtol in tolerances[:11:2]]
    points: dict[str, list[tuple[float, float, float]]] = {way: [] for way in runs}
    for rtol in tolerances:
        errors: dict[str, float] = {}
        measures: dict[str, Callable[[], float]] = {}
        for way, listed in runs.items():
            run = dict(listed).get(rtol)
            if run is None:
                continue
            try:
                spent, values = run()
            except AtwoodError as error:
                print(f"{name}, {way}, rtol {rtol:g}: {error.message}")
                continue
            errors[way] = error_of(values)
            measures[way] = partial(lambda run: run()[0], run) if spent < 0.5 else partial(float, spent)
        spent_best = best_of(measures, chosen.repeat)
        for way, error in errors.items():
            points[way].append((rtol, error, 1e3 * spent_best[way]))
    return {"points": points, "reference": error_of(second)}


def show(name: str, found: dict[str, Any]) -> None:
    """Print the milliseconds at each error, with the ratio to the first way."""
    at = {
        way: [at_error([(e, ms) for _, e, ms in points], target) for target in TARGETS]
        for way, points in found["points"].items()
    }
    earlier = EARLIER[name]
    reference = earlier["C by hand, order 8(5,3)"]
    by_ida = earlier["C by hand with IDA, stabilised DAE"]
    rows: list[list[Any]] = []
    for way, values in at.items():
        ours = at["Atwood explicit"]
        rows.append([way, *(ratio(v, o) for v, o in zip(values, ours, strict=True)), *values])
    head = ["measured now", *(f"x at {t:g}" for t in TARGETS), *(f"ms at {t:g}" for t in TARGETS)]
    print_table(f"{name}: milliseconds at an error, and as many times Atwood explicit", head, rows)
    print(f"The reference is good to about {found['reference']:.1e}.")
    rows = [[way, *values] for way, values in earlier.items()]
    rows.append(["Atwood explicit now / C order 8(5,3) then", *map(ratio, at["Atwood explicit"], reference)])
    rows.append(["Atwood IDA dae ggl now / C with IDA then", *map(ratio, at["Atwood IDA dae ggl"], by_ida)])
    head = ["measured on one quiet core before the project began", *(f"ms at {t:g}" for t in TARGETS)]
    print_table(f"{name}: earlier figures (a slower core: see README before dividing)", head, rows)


def draw(path: Any, results: dict[str, Any]) -> None:
    """Draw time against error."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(results), figsize=(5.0 * len(results), 4.5), squeeze=False)
    for axis, (name, found) in zip(axes[0], results.items(), strict=True):
        for way, points in found["points"].items():
            axis.loglog([e for _, e, _ in points], [ms for _, _, ms in points], "o-", label=way)
        axis.set(title=name, xlabel="error at the end", ylabel="ms")
        axis.invert_xaxis()
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path)
    print(f"\nwritten: {path}")


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments, plot=True)
    todo: list[tuple[str, Model, float, list[str]]] = [
        ("double pendulum", DoublePendulum(), 10.0, ["rod1.angle", "rod2.angle"])
    ]
    for n in () if chosen.quick else (10, 40):
        tip = [f"bob[{n - 1}].position.{axis}" for axis in "xz"]
        todo.append((f"chain of {n}", Chain(links=n, mass=1.0 / n), 1.0, tip))
    results = {}
    for name, scene, t_end, paths in todo:
        results[name] = curves(name, scene, t_end, paths, chosen)
        show(name, results[name])
    if chosen.plot:
        draw(chosen.plot, results)
    save(chosen.json, results)


if __name__ == "__main__":
    main()
