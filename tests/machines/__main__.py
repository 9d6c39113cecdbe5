"""The command: `python -m tests.machines`."""

from __future__ import annotations

import json

import click
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .emulated import MACHINES
from .run import Run, run_as
from .tightest import Bound, tightest


@click.command()
@click.option("--machine", "names", multiple=True, type=click.Choice(list(MACHINES)), help="Which; all if not given.")
@click.option("--part", "parts", multiple=True, help="A folder, file or test; the whole suite if not given.")
@click.option("--workers", default=1, show_default=True, help="Processes of each run.")
@click.option("--tightest", "count", default=50, show_default=True, help="How many bounds to show.")
@click.option("--json", "as_json", is_flag=True, help="Print outcomes and bounds as one JSON object.")
def main(names: tuple[str, ...], parts: tuple[str, ...], workers: int, count: int, as_json: bool) -> None:
    """Run the suite as on other machines; say what failed there, and which bounds are tight."""
    console = Console(stderr=as_json)
    runs: dict[str, Run] = {}
    for name in names or MACHINES:
        if not MACHINES[name].possible:
            console.print(f"{name}: left out, this machine cannot do what it does")
            continue
        runs[name] = run_as(MACHINES[name], parts, workers)
        _show_failures(name, runs[name], console)
    bounds = tightest(runs, count)
    if as_json:
        print(json.dumps({"machines": {name: _as_data(run) for name, run in runs.items()}, "bounds": _all(bounds)}))
    else:
        _show_runs(runs, console)
        _show_bounds(bounds, list(runs), console)
    raise SystemExit(any(run.failed or not run.finished for run in runs.values()))


def _count(run: Run, outcome: str) -> int:
    return sum(each == outcome for each in run.outcomes.values())


def _as_data(run: Run) -> dict[str, object]:
    counts = {outcome: _count(run, outcome) for outcome in ("passed", "failed", "skipped")}
    return {**counts, "seconds": round(run.seconds, 1), "finished": run.finished, "failed_tests": run.failed}


def _all(bounds: list[Bound]) -> list[dict[str, object]]:
    return [{"test": bound.test, "compared": bound.text, "ratios": bound.ratios} for bound in bounds]


def _show_failures(name: str, run: Run, console: Console) -> None:
    if not run.finished:
        console.print(f"{name}: pytest ended with status {run.status}:\n{run.said[-4000:]}", markup=False)
    for test in run.failed:
        console.print(f"{name}: failed: {test}", markup=False, highlight=False, soft_wrap=True)


def _show_runs(runs: dict[str, Run], console: Console) -> None:
    table = Table("machine", "passed", "failed", "skipped", "seconds")
    for name, run in runs.items():
        outcomes = (str(_count(run, outcome)) for outcome in ("passed", "failed", "skipped"))
        table.add_row(name, *outcomes, f"{run.seconds:.0f}")
    console.print(table)


def _show_bounds(bounds: list[Bound], machines: list[str], console: Console) -> None:
    console.print("The tightest bounds: value / bound")
    for bound in bounds:
        ratios = "  ".join(f"{name} {bound.ratios[name]:.2g}" for name in machines if name in bound.ratios)
        console.print(
            f"[bold]{ratios}[/]  {escape(bound.test)}\n    {escape(bound.text)}", highlight=False, soft_wrap=True
        )


if __name__ == "__main__":
    main(prog_name="python -m tests.machines")
