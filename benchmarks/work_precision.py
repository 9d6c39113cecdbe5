"""Milliseconds for an error: the double pendulum over 10 s, chains of 10 and 40 links over 1 s.

The error is the largest of the angles (double pendulum) or of the tip's position (chains) at the end, against an
extrapolation in 128 bits.  What is timed is the integration: for Atwood and the C by hand from making the solver's
memory to the state at the end, everything compiled; for the others the call that integrates.  "Atwood simulate" is the
whole public call on an assembled scene: start, run, 400 samples, result.
"""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import atwood_runs as atwood
import by_hand_runs as hand
import numpy as np
import peer_runs as other
from drawing import draw
from mechanisms import FloatArray, Mechanism, chain, double_pendulum
from timing import at_error, options, peer, print_table, ratio, save

from atwood.errors import AtwoodError

TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)

C, C_IDA = "C by hand, order 8(5,3)", "C by hand, IDA ggl"
EXPLICIT, TAYLOR = "Atwood explicit", "Atwood taylor"
IDA, HEYOKA = "Atwood IDA ggl", "heyoka"

JUDGED = [(EXPLICIT, C, 1.5), (TAYLOR, C, 1.5), (EXPLICIT, HEYOKA, 1.0), (TAYLOR, HEYOKA, 1.0), (IDA, C_IDA, 1.2)]
"""Who is compared with whom, and what the ratio should be at most."""

SLOW = 0.7
"""Seconds that all repetitions of one run may take."""

Run = Callable[[], tuple[float, FloatArray]]
Make = Callable[[float], Run]


def powers(first: float, last: float, step: float = 1.0) -> list[float]:
    """Return powers of ten, from 10^-first to 10^-last."""
    return [float(10.0**-k) for k in np.arange(first, last + 0.5 * step, step)]


def ways(mechanism: Mechanism, flags: str, quick: bool) -> dict[str, tuple[list[float], Make]]:
    """Return the tolerances of each way to solve a mechanism, from loose to tight, and what makes its runs."""
    reduced, dae = atwood.prepare(mechanism, "reduced"), atwood.prepare(mechanism, "dae")
    fine, coarse = powers(1.5, 14, 0.5), powers(2, 12)
    found: dict[str, tuple[list[float], Make]] = {}
    if hand.by_hand.compiler():
        absolute = dae.plan.tolerances(1.0, {})
        links = slice(4 * mechanism.links, None)

        def ida_by_hand(rtol: float, tuning: hand.Tuning, band: bool) -> Run:
            allowed = absolute * rtol
            allowed[links] = absolute[links]
            start = (dae.y, dae.yp)
            return hand.IdaRun(mechanism, start, rtol, allowed, flags, tuning=tuning, band=band)

        told = hand.tuned(6 * mechanism.links)
        found[C] = fine, lambda rtol: hand.explicit_run(mechanism, rtol, flags)  # type: ignore[dict-item, return-value]
        found[C_IDA] = coarse, partial(ida_by_hand, tuning=hand.PLAIN, band=False)
        found[f"{C_IDA}, Atwood's options"] = coarse, partial(ida_by_hand, tuning=told, band=False)
        if mechanism.links > 2:
            found[f"{C_IDA}, band solver"] = coarse, partial(ida_by_hand, tuning=hand.PLAIN, band=True)
            found[f"{C_IDA}, Atwood's options, band solver"] = coarse, partial(ida_by_hand, tuning=told, band=True)
    found[EXPLICIT] = fine, partial(atwood.explicit_run, reduced)
    found[TAYLOR] = [*fine, 1e-15], partial(atwood.taylor_run, reduced)
    found[IDA] = coarse, partial(atwood.ida_run, dae)
    found["Atwood IDA reduced"] = coarse, partial(atwood.ida_run, reduced)
    found["Atwood simulate, explicit"] = powers(2, 14), partial(atwood.whole_run, reduced, "explicit")
    return found if quick else found | others(mechanism)


def others(mechanism: Mechanism) -> dict[str, tuple[list[float], Make]]:
    """Return the ways of other packages that are installed."""
    found: dict[str, tuple[list[float], Make]] = {}
    steps = powers(1.5, 5 if mechanism.links < 40 else 4.5, 0.5)

    def fixed(make: Callable[[int], Run]) -> Make:
        return lambda share: make(round(1.0 / share))

    if heyoka := peer("heyoka"):
        found[HEYOKA] = powers(2, 17), partial(other.heyoka_run, heyoka, mechanism)
    if pinocchio := peer("pinocchio"):
        found["Pinocchio aba, SciPy DOP853"] = powers(2, 13), partial(other.pinocchio_run, pinocchio, mechanism)
        rk4 = partial(other.pinocchio_rk4_run, pinocchio, mechanism)
        found["Pinocchio aba, RK4 in Python"] = steps, fixed(rk4)
    if exudyn := peer("exudyn"):
        found["Exudyn, RK67"] = [h for h in steps if h > 2e-5], fixed(partial(other.exudyn_run, exudyn, mechanism))
    if mujoco := peer("mujoco"):
        found["MuJoCo RK4"] = steps, fixed(partial(other.mujoco_run, mujoco, mechanism))
    if peer("pydrake"):
        found["Drake, RK5"] = powers(3, 13), partial(other.drake_run, importlib.import_module("pydrake.all"), mechanism)
    if diffrax := peer("diffrax"):
        found["JAX, diffrax Dopri8"] = powers(2, 13), partial(other.diffrax_run, diffrax, mechanism)
    if mechanism.links <= 10 and peer("sympy"):
        found["sympy Kane, SciPy DOP853"] = powers(2, 13), partial(other.kane_run, mechanism)
    return found


def reference(mechanism: Mechanism) -> tuple[FloatArray, str]:
    """Return the end, and where it comes from."""
    found = hand.reference(mechanism)
    if found is not None:
        return found, "extrapolation in 128 bits"
    reduced = atwood.prepare(mechanism, "reduced")
    return atwood.explicit_run(reduced, 1e-14)()[1], "Atwood explicit at 1e-14"


def check(name: str, way: str, errors: Sequence[float]) -> None:
    """Refuse to time a way whose errors do not fall with its tolerance."""
    finite = [error for error in errors if np.isfinite(error)]
    if len(finite) < 2 or not min(finite) <= 0.05 * max(finite):
        raise SystemExit(f"{name}, {way}: the errors do not fall with the tolerance: {errors}")


def measure(mechanism: Mechanism, chosen: Any) -> dict[str, Any]:
    """Return the work-precision points of every way to solve a mechanism."""
    expected, source = reference(mechanism)
    runs: dict[tuple[str, float], Run] = {}
    errors: dict[tuple[str, float], float] = {}
    best: dict[tuple[str, float], float] = {}
    prepared: dict[str, float] = {}
    for way, (settings, make) in ways(mechanism, chosen.cflags, chosen.quick).items():
        began, used = time.perf_counter(), 0.0
        for setting in settings[:: 6 if chosen.quick else 1]:
            if used > 8.0:
                break  # tighter ones would only take longer
            try:
                run = make(setting)
                run()  # the first call may compile
                spent, values = run()
            except (AtwoodError, ArithmeticError) as error:
                print(f"{mechanism.name}, {way}, {setting:g}: {error}", file=sys.stderr)
                continue
            key, used = (way, setting), used + spent
            runs[key], best[key] = run, spent
            errors[key] = mechanism.error(values, expected)
        prepared[way] = time.perf_counter() - began - used
        check(mechanism.name, way, [error for (name, _), error in errors.items() if name == way])
    repeat_all(runs, best, chosen.repeat)
    points: dict[str, list[tuple[float, float, float]]] = {way: [] for way, _ in runs}
    for way, setting in runs:
        points[way].append((setting, errors[way, setting], 1e3 * best[way, setting]))
    return {"points": points, "reference": source, "prepared": prepared}


def repeat_all(runs: dict[tuple[str, float], Run], best: dict[tuple[str, float], float], repeat: int) -> None:
    """Measure everything in turn, again and again, short runs more often."""
    spent = dict.fromkeys(runs, 0.0)
    for _ in range(repeat):
        for key, run in runs.items():
            for _ in range(max(1, min(20, int(2e-3 / best[key])))):
                if spent[key] + best[key] > SLOW:
                    break
                seconds = run()[0]
                spent[key] += seconds
                best[key] = min(best[key], seconds)


def show(name: str, found: dict[str, Any]) -> dict[str, list[float | None]]:
    """Print the milliseconds at each error, with the ratio to the C by hand; return them."""
    at = {
        way: [at_error([(e, ms) for _, e, ms in points], target) for target in TARGETS]
        for way, points in found["points"].items()
    }
    first = at.get(C, at[EXPLICIT])
    rows: list[list[Any]] = []
    for way, values in at.items():
        rows.append([way, *(ratio(v, o) for v, o in zip(values, first, strict=True)), *values])
    head = ["", *(f"x at {t:g}" for t in TARGETS), *(f"ms at {t:g}" for t in TARGETS)]
    print_table(f"{name}: as many times {C if C in at else EXPLICIT}, and milliseconds, at an error", head, rows)
    rows = [
        [f"{one} / {two}", *(ratio(v, o) for v, o in zip(at[one], at[two], strict=True)), f"{most:g}"]
        for one, two, most in JUDGED
        if one in at and two in at
    ]
    print_table(f"{name}: ratios that have a goal", ["", *(f"at {t:g}" for t in TARGETS), "goal"], rows)
    print(f"The reference: {found['reference']}.")
    return at


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments, plot=True, scenes=("double", "10", "40"))
    todo = {"double": double_pendulum, "10": partial(chain, 10), "40": partial(chain, 40)}
    results: dict[str, Any] = {}
    for key in ("double",) if chosen.quick else chosen.scenes:
        mechanism = todo[key]()
        found = measure(mechanism, chosen)
        found["milliseconds"] = show(mechanism.name, found)
        found["errors"] = TARGETS
        results[mechanism.name] = found
    if chosen.plot:
        draw(chosen.plot, results)
    save(chosen.json, results)


if __name__ == "__main__":
    main()
