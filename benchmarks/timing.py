"""What all benchmarks share: interleaved best-of-k, tables, options of the command line."""

from __future__ import annotations

import argparse
import importlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

__all__ = ["at_error", "best_of", "options", "peer", "print_table", "ratio", "save"]


def best_of(measures: Mapping[str, Callable[[], float]], repetitions: int) -> dict[str, float]:
    """Return the least of several measurements of each, taken in turn, so that a slow moment hits all alike."""
    best = dict.fromkeys(measures, math.inf)
    for _ in range(repetitions):
        for name, measure in measures.items():
            best[name] = min(best[name], measure())
    return best


def ratio(one: float | None, other: float | None) -> str:
    """Return how many times the one is the other, as text; a dash if one of them is missing."""
    return f"{one / other:.2f}" if one and other else "-"


def number(value: Any) -> str:
    """Return a cell as text, numbers with three digits."""
    if value is None:
        return "-"
    if isinstance(value, float):
        if not math.isfinite(value):
            return "-"
        return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    return str(value)


def print_table(title: str, head: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Print a table, its first column to the left and the others to the right."""
    cells = [list(head), *[[number(cell) for cell in row] for row in rows]]
    widths = [max(len(row[i]) for row in cells) for i in range(len(head))]
    print(f"\n{title}\n")
    for position, row in enumerate(cells):
        print("  ".join(c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(row, widths, strict=True))))
        if position == 0:
            print("  ".join("-" * w for w in widths))


def at_error(points: Sequence[tuple[float, float]], target: float) -> float | None:
    """Return the cost of an error, interpolated between logarithms on the curve of measured points.

    It is the cost from which on *all* tighter tolerances are good enough: a single lucky one does not count.

    Parameters
    ----------
    points
        (error, cost), from the loosest tolerance to the tightest.
    target
        The error asked for.

    Returns
    -------
    float or None
        The cost of the loosest point where all are good enough; None where the tightest is not.
    """
    bad = [i for i, (error, _) in enumerate(points) if not error <= target]
    first = bad[-1] + 1 if bad else 0
    if first == len(points):
        return None
    error, cost = points[first]
    if first == 0 or error <= 0.0 or not math.isfinite(points[first - 1][0]):
        return cost
    worse, cheaper = points[first - 1]
    share = math.log(worse / target) / math.log(worse / error)
    return math.exp((1.0 - share) * math.log(cheaper) + share * math.log(cost))


def peer(name: str) -> ModuleType | None:
    """Return a module that is compared with, or None, which is said, if it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        print(f"{name} is not installed: not compared")
        return None


def options(
    description: str | None, arguments: Sequence[str] | None, *, plot: bool = False, scenes: Sequence[str] = ()
) -> argparse.Namespace:
    """Read the options that all scripts have."""
    parser = argparse.ArgumentParser(description=(description or "").split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="the smallest cases only, hardly repeated: does it run?")
    parser.add_argument("--repeat", type=int, default=7, metavar="K", help="best of so many repetitions (7)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was measured to a file")
    parser.add_argument("--cflags", default="-O3 -march=native", help="how the C by hand is compiled")
    if plot:
        parser.add_argument("--plot", type=Path, metavar="FOLDER", help="draw what was measured there")
    if scenes:
        parser.add_argument("--scenes", nargs="+", choices=scenes, default=scenes, help="which ones; all")
    chosen = parser.parse_args(arguments)
    if chosen.quick:
        chosen.repeat = 1
    return chosen


def save(path: Path | None, results: object) -> None:
    """Write results as JSON, if a file was asked for; what it has of other scenes or scripts is kept."""
    if path is not None:
        if isinstance(results, dict) and path.exists():
            results = json.loads(path.read_text(encoding="utf-8")) | results
        path.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
        print(f"\nwritten: {path}")
