"""How right runs are: errors that were asked for beside true ones, what they cost, and how right estimates are.

Scenes whose motion is known (`known_motions.py`), in both forms. Cost is integration time of the run that is returned,
beside that of the loosest of many tolerances whose true error is below what was asked, each the best of several.
Estimates are taken at fixed tolerances for every quantity that is known.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from known_motions import Known, known_motions
from timing import options, print_table, save

import atwood
from atwood import SolveError, simulate

ASKED = (1e-4, 1e-6, 1e-8, 1e-10)
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
LADDER = tuple(10.0 ** (-k / 2) for k in range(2, 30))
FORMS = ("reduced", "dae")
FLOOR = 100.0 * 2.2e-16
"""Relative to a quantity's size: errors below are too near to rounding to be estimated."""


def true_error(known: Known, result: atwood.Result) -> float:
    """Return the largest error of positions and angles, scaled as an accuracy is."""
    exact = {path: value for path, value in known.exact(result.time).items() if path in result}
    scales = {"m": result.start.length, "rad": 1.0, "1": 1.0}
    errors = [
        float(np.max(np.abs(result[path] - value))) / scales[result.unit(path)]
        for path, value in exact.items()
        if result.unit(path) in scales
    ]
    return max(errors, default=0.0)


def asked_rows(known: Known, form: str, asked: Sequence[float], repeat: int) -> Iterator[dict[str, Any]]:
    """Ask for accuracies."""

    def seconds(**how: Any) -> float:
        assembly = atwood.assemble(known.scene, form=form)
        return min(simulate(assembly, **how).statistics.seconds for _ in range(repeat))

    ladder = []
    for rtol in LADDER:
        try:
            ladder.append((true_error(known, simulate(known.scene, form=form, rtol=rtol)), rtol))
        except SolveError:  # no step is small enough for it
            break
        if ladder[-1][0] <= 0.1 * min(asked):
            break
    for accuracy in asked:
        result = simulate(known.scene, form=form, accuracy=accuracy)
        enough = [rtol for error, rtol in ladder if error <= accuracy]
        taken = seconds(rtol=result.run.options.relative_tolerance)
        yield {
            "scene": known.name,
            "form": form,
            "asked": accuracy,
            "true/asked": true_error(known, result) / accuracy,
            "met": result.accuracy.is_met,
            "cost": taken / seconds(rtol=max(enough)) if enough else None,
        }


def estimate_rows(known: Known, form: str, tolerances: Sequence[float]) -> Iterator[dict[str, Any]]:
    """Estimate errors at fixed tolerances."""
    for rtol in tolerances:
        result = simulate(known.scene, form=form, rtol=rtol)
        for path, exact in known.exact(result.time).items():
            if path not in result:
                continue
            true = float(np.max(np.abs(result[path] - exact)))
            if true <= FLOOR * max(float(np.max(np.abs(exact))), 1e-300):
                continue
            ratio = float(np.max(result.error(path))) / true
            yield {"scene": known.name, "form": form, "rtol": rtol, "quantity": path, "estimate/true": ratio}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, and print two tables."""
    given = options(__doc__, arguments)
    asked, tolerances = ((1e-6,), (1e-6,)) if given.quick else (ASKED, TOLERANCES)
    rows, estimates = list[dict[str, Any]](), list[dict[str, Any]]()
    warnings.simplefilter("ignore")
    for known in known_motions(given.quick):
        for form in FORMS:
            print(f"{known.name}, {form}", file=sys.stderr, flush=True)
            rows += asked_rows(known, form, asked, 1 if given.quick else given.repeat)
            estimates += estimate_rows(known, form, tolerances)
    print_table(
        "Accuracy asked for: true error over it, and cost beside that of the loosest tolerance which meets it",
        ["scene", "form", "asked", "true/asked", "met", "cost"],
        [list(row.values()) for row in rows],
    )
    ratios = np.array([one["estimate/true"] for one in estimates])
    good = float(np.mean((ratios > 0.1) & (ratios < 10.0))) if len(ratios) else 1.0
    worst = sorted(estimates, key=lambda one: -abs(np.log10(max(one["estimate/true"], 1e-300))))[:10]
    print_table(
        f"{len(ratios)} estimates, {100.0 * good:.1f} % within a factor of ten; the worst ten",
        ["scene", "form", "rtol", "quantity", "estimate/true"],
        [list(row.values()) for row in worst],
    )
    save(given.json, {"accuracy": {"asked": rows, "estimates": estimates}})


if __name__ == "__main__":
    main()
