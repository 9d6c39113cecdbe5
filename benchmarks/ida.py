"""Time per step of IDA: Atwood, a whole program by hand in C against the same library, and Python callbacks.

All solve the stabilised DAE form with the same start and tolerances, and IDA is told the same.  A step is timed inside
the integration, and a run from making IDA's memory to freeing it.  Atwood and the C by hand then take the same steps
but for rounding.  The C by hand has a band solver for chains, and Atwood eliminates with fixed pivots.  Python
callbacks are Atwood's driver with the same problem without its compiled functions: plain Python called through ctypes.
The row of scikit-sundae is that package's own driver, with its own options.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import by_hand
from atwood_runs import Prepared, ida_session, prepare
from by_hand_runs import IdaRun, tuned
from mechanisms import Mechanism, chain, double_pendulum, pendulum
from timing import best_of, options, print_table, ratio, save

from atwood.integrators.ida import library as sundials_library
from atwood.integrators.protocol import Status

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.helpers import scikit_sundae

GOAL, GOAL_PYTHON = 1.2, 8.0
"""Atwood / C at most, and Python callbacks / Atwood at least."""

Measure = Callable[[], tuple[float, float, int]]
"""A run: its seconds, those of the integration alone, and steps."""


def mechanisms(quick: bool) -> list[Mechanism]:
    """Return what is timed."""
    found = [pendulum()]
    return found if quick else [*found, double_pendulum(), chain(10), chain(40)]


def atwood_measure(prepared: Prepared, rtol: float, python: bool = False) -> Measure:
    """Return a run with Atwood's driver."""
    open_session, t_end = ida_session(prepared, rtol, python), prepared.mechanism.t_end

    def run() -> tuple[float, float, int]:
        began = time.perf_counter()
        session = open_session()
        status = session.advance(t_end).status
        session.close()
        spent = time.perf_counter() - began
        if status is not Status.REACHED:
            raise SystemExit("a run did not reach its end")
        return spent, session.statistics.seconds, session.statistics.steps

    return run


def sundae_measure(prepared: Prepared, rtol: float) -> Measure:
    """Return a run through scikit-sundae."""
    problem, settings, t_end = prepared.plan.problem(), prepared.settings(rtol), prepared.mechanism.t_end

    def run() -> tuple[float, float, int]:
        began = time.perf_counter()
        session = scikit_sundae.open_session(problem, settings, 0.0, prepared.y, prepared.yp)
        status = session.advance(t_end).status
        spent = time.perf_counter() - began
        if status is not Status.REACHED:
            raise SystemExit("a run did not reach its end")
        return spent, session.statistics.seconds, session.statistics.steps

    return run


def hand_measure(prepared: Prepared, rtol: float, flags: str) -> Measure:
    """Return a run by hand, after its answer has been compared with Atwood's."""
    run = IdaRun(
        prepared.mechanism,
        (prepared.y, prepared.yp),
        rtol,
        prepared.plan.tolerances(rtol, {}),
        flags,
        tuning=tuned(6 * prepared.mechanism.links),
        band=prepared.mechanism.links > 2,
    )
    mechanism = prepared.mechanism
    with ida_session(prepared, rtol)() as session:
        ours = prepared.at_end(session.advance(mechanism.t_end).y)
    tight = IdaRun(mechanism, (prepared.y, prepared.yp), 1e-10, prepared.plan.tolerances(1e-10, {}), flags)()[1]
    own, by_c = mechanism.error(ours, tight), mechanism.error(run()[1], tight)
    if by_c > 100.0 * own + 1e-9 or (rtol <= 1e-6 and mechanism.links == 1 and by_c > 1e-3):
        raise SystemExit(f"{mechanism.name}: the C by hand has an error of {by_c:.1e}, Atwood {own:.1e}")

    def measure() -> tuple[float, float, int]:
        return run()[0], run.seconds, run.steps

    return measure


def measure(mechanism: Mechanism, rtol: float, chosen: Any) -> dict[str, Any]:
    """Time one mechanism at one tolerance."""
    prepared = prepare(mechanism, "dae")
    runs: dict[str, Measure] = {"atwood": atwood_measure(prepared, rtol)}
    if by_hand.compiler():
        runs["hand"] = hand_measure(prepared, rtol, chosen.cflags)
    if mechanism.links == 1:
        runs["python"] = atwood_measure(prepared, rtol, python=True)
        runs["sundae"] = sundae_measure(prepared, rtol)
    steps: dict[str, int] = {}
    alone: dict[str, float] = {}

    def timed(key: str) -> float:
        whole, seconds, steps[key] = runs[key]()
        alone[key] = min(alone.get(key, seconds), seconds)
        return whole

    repeat = chosen.repeat * (5 if mechanism.links < 40 else 1)
    fast = {key: partial(timed, key) for key in runs if key in ("atwood", "hand")}
    slow = {key: partial(timed, key) for key in runs if key not in fast}
    seconds = best_of(fast, repeat) | best_of(slow, min(chosen.repeat, 3))
    return {"case": mechanism.name, "rtol": rtol, "seconds": seconds, "alone": alone, "steps": steps}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments)
    if not sundials_library.available():
        print(f"nothing to measure: {sundials_library.why_not()}")
        return
    if by_hand.compiler() is None:
        print("no C compiler: nothing by hand to compare with")
    found = [
        measure(mechanism, rtol, chosen)
        for mechanism in mechanisms(chosen.quick)
        for rtol in ((1e-6,) if chosen.quick else (1e-4, 1e-6, 1e-8))
    ]
    table = []
    for row in found:
        seconds, alone, steps = row["seconds"], row["alone"], row["steps"]
        each = {key: 1e6 * alone[key] / steps[key] for key in alone}
        ours = each["atwood"]
        table.append([row["case"], f"{row['rtol']:g}", ratio(ours, each.get("hand")), ratio(each.get("python"), ours)])
        table[-1] += [ratio(seconds["atwood"], seconds.get("hand")), ratio(seconds.get("sundae"), seconds["atwood"])]
        table[-1] += [each.get(key) for key in ("atwood", "hand", "python", "sundae")]
        table[-1] += [steps.get(key) for key in ("atwood", "hand", "sundae")]
        table[-1] += [1e6 * seconds[key] if key in seconds else None for key in ("atwood", "hand")]
    head = ["dae ggl", "rtol", f"Atwood / C (<= {GOAL:g})", f"Python / Atwood (>= {GOAL_PYTHON:g})"]
    head += ["a run: Atwood / C", "sundae / Atwood", "Atwood us/step", "C us/step", "Python us/step", "sundae us/step"]
    head += ["Atwood steps", "C steps", "sundae steps", "Atwood run us", "C run us"]
    print_table(f"IDA, a step; C with {chosen.cflags}", head, table)
    save(chosen.json, {"ida": found})


if __name__ == "__main__":
    main()
