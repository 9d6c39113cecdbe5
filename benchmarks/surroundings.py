"""What surrounds a run: `simulate` again on an assembly, over its integration alone, for all scenes in both forms.

The integration is what the session's compiled calls take in the same run: steps of explicit methods and IDA's, called
without anything between them. Ratios are those of the whole call over these and 0.3 ms, medians of rounds in which
scenes take turns; time of the processor, BLAS with its own number of threads.
"""

from __future__ import annotations

import gc
import statistics
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from timing import options, print_table, save

from atwood import Assembly, AtwoodError, assemble, simulate
from atwood.integrators.ida.memory import IdaMemory
from atwood.integrators.moments import Moments
from atwood.integrators.stepper import Stepper
from atwood_library.scenes import SCENES

SPAN, OUTPUTS, ALLOWANCE, AT_MOST = 2.0, 201, 0.3, (2.0, 3.0)
"""Seconds of motion, outputs, ms that a call may take besides, and the goals: mostly, and always."""

RUNS_BEFORE = 30
"""After so many runs what pays is compiled, and classes that a run makes instances of have their constructors."""

_spent = [0.0]


def timed(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that adds what it takes to the integration, however its calls are nested."""
    inside = [False]

    def call(*given: Any) -> Any:
        if inside[0]:
            return function(*given)
        inside[0], began = True, time.process_time()
        try:
            return function(*given)
        finally:
            _spent[0] += time.process_time() - began
            inside[0] = False

    return call


def watch_calls() -> None:
    """Let compiled calls of sessions be timed from now on."""
    owners: list[type] = [Stepper]
    while owners:
        owner = owners.pop()
        owners += owner.__subclasses__()
        if "_go_on" in vars(owner):
            owner._go_on = timed(owner._go_on)  # type: ignore[attr-defined]
    Moments.advance = timed(Moments.advance)  # type: ignore[method-assign]
    IdaMemory.solve = timed(IdaMemory.solve)  # type: ignore[method-assign]
    filling = IdaMemory.fill
    IdaMemory.fill = lambda memory, monitor: timed(filling(memory, monitor))  # type: ignore[method-assign]


def once(assembly: Assembly, end: float) -> tuple[float, float]:
    """Return what a run takes, and its integration, ms."""
    _spent[0], began = 0.0, time.process_time()
    simulate(assembly, t_end=end, outputs=OUTPUTS)
    return 1e3 * (time.process_time() - began), 1e3 * _spent[0]


def prepared(name: str, form: str) -> tuple[Assembly, float]:
    """Return an assembly that has been run a few times, and how long its runs are."""
    scene = SCENES[name]()
    assembly, end = assemble(scene, form=form), min(SPAN, float(getattr(scene, "t_end", SPAN)))
    for _ in range(RUNS_BEFORE):
        simulate(assembly, t_end=end, outputs=OUTPUTS)
    return assembly, end


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    warnings.simplefilter("ignore")
    chosen = options(__doc__, arguments, scenes=list(SCENES))
    names = chosen.scenes[:2] if chosen.quick else chosen.scenes
    watch_calls()
    made: dict[tuple[str, str], tuple[Assembly, float]] = {}
    for name in names:
        for form in ("reduced", "dae"):
            try:
                made[name, form] = prepared(name, form)
            except AtwoodError as error:
                print(f"{name}, {form}: not run: {error.message}")
    rounds: dict[tuple[str, str], list[tuple[float, float]]] = {one: [] for one in made}
    gc.collect()
    for _ in range(chosen.repeat):
        for one, given in made.items():
            rounds[one].append(once(*given))
    found = {}
    for one, taken in rounds.items():
        ratio = statistics.median(whole / (inside + ALLOWANCE) for whole, inside in taken)
        found[one] = (ratio, min(whole for whole, _ in taken), min(inside for _, inside in taken))
    for form in ("reduced", "dae"):
        of_form = sorted(((row, name) for (name, kind), row in found.items() if kind == form), reverse=True)
        ratios = [row[0] for row, _ in of_form]
        reached = ", ".join(f"{sum(one <= most for one in ratios)} at most {most:g}" for most in AT_MOST)
        print_table(
            f"{form}: {len(ratios)} scenes, median {statistics.median(ratios):.2f}, {reached}",
            ["scene", "over integration + .3 ms", "whole, ms", "integration, ms"],
            [[name, *row] for row, name in of_form],
        )
    save(chosen.json, {"surroundings": {" ".join(one): row for one, row in found.items()}})


if __name__ == "__main__":
    main()
