"""What singular positions cost a run that passes them, over its integration: rows of four-bars, Scott Russell's lift.

The integration is what the session's compiled calls take where Python passes the positions; a crossing is what a run
takes besides that and besides a run that ends before the first of them. Medians of rounds in which all take turns.
"""

from __future__ import annotations

import gc
import statistics
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import surroundings
from timing import options, print_table, save

from atwood import Assembly, Scene, assemble, simulate
from atwood.simulation.singular.monitor import SingularityMonitor
from atwood_library.scenes import FourBarRow, ScottRussellLift

BEFORE = 0.55
"""Seconds of motion before the first position."""

SCENES: dict[str, tuple[Callable[[], Scene], float]] = {
    "row of 1, 2 crossings": (lambda: FourBarRow(windows=1), 2.0),
    "row of 1, 10 crossings": (lambda: FourBarRow(windows=1), 10.0),
    "row of 1, 104 crossings": (lambda: FourBarRow(windows=1), 100.0),
    "row of 2, 10 crossings": (lambda: FourBarRow(windows=2), 10.0),
    "row of 3, 10 crossings": (lambda: FourBarRow(windows=3), 10.0),
    "Scott Russell, 9 crossings": (ScottRussellLift, 4.0),
}

_OWN = SingularityMonitor.pass_in_steps


def once(assembly: Assembly, end: float, in_python: bool = False) -> tuple[float, float]:
    """Return what a run takes, and its compiled calls, ms."""
    plain: Any = (lambda *_: None) if in_python else _OWN
    SingularityMonitor.pass_in_steps = plain  # type: ignore[method-assign]
    surroundings._spent[0], began = 0.0, time.process_time()
    simulate(assembly, t_end=end, outputs=201)
    return 1e3 * (time.process_time() - began), 1e3 * surroundings._spent[0]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    warnings.simplefilter("ignore")
    chosen = options(__doc__, arguments, scenes=list(SCENES))
    surroundings.watch_calls()
    for form in ("reduced", "dae"):
        rows = []
        for name in chosen.scenes:
            make, end = SCENES[name]
            own, python, short = (assemble(make(), form=form) for _ in range(3))
            taken = []
            gc.collect()
            for _ in range(surroundings.RUNS_BEFORE + chosen.repeat):
                whole, before, plain = once(own, end), once(short, BEFORE), once(python, end, in_python=True)
                integration = plain[1] - before[1]
                besides = (one[0] - before[0] - integration for one in (whole, plain))
                taken.append((whole[0], integration, *(one / integration for one in besides)))
            rows.append([name, *map(statistics.median, zip(*taken[surroundings.RUNS_BEFORE :], strict=True))])
        heads = ["scene", "whole, ms", "integration, ms", "crossings over it", "by Python"]
        print_table(form, heads, rows)
        save(chosen.json, {f"crossings {form}": {str(row[0]): row[1:] for row in rows}})


if __name__ == "__main__":
    main()
