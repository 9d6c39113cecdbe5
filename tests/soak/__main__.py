"""The command: `python -m tests.soak`."""

from __future__ import annotations

import json
import signal
import time

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from .kinds import KINDS, run_trial
from .summary import as_data, progress_line, show
from .workers import Done, make_trials

MARK = 100
"""Trials after which a line says how far the command is."""


@click.command()
@click.option("--kind", "kinds", multiple=True, type=click.Choice(list(KINDS)), help="What to try; all if not given.")
@click.option("--count", default=100, show_default=True, help="Trials of each kind.")
@click.option("--seed", type=int, help="The first seed; from the clock if not given.")
@click.option("--only", type=int, help="Make the one trial of this seed, here, and show all that it says.")
@click.option("--workers", default=1, show_default=True, help="Processes.")
@click.option("--limit", default=60.0, show_default=True, help="Seconds of the processor for a trial; more is a hang.")
@click.option("--json", "as_json", is_flag=True, help="Print every finding and the counts as one JSON object.")
def main(
    kinds: tuple[str, ...], count: int, seed: int | None, only: int | None, workers: int, limit: float, as_json: bool
) -> None:
    """Make random trials and say what was found; the exit status is 1 if anything was."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    chosen = kinds or tuple(kind for kind in KINDS if kind != "memory")  # which takes long by itself
    console, began = Console(stderr=True), time.monotonic()
    if only is not None:
        done = [Done(kind, only, *run_trial(kind, only)) for kind in chosen]
    else:
        first = int(time.time()) % 1_000_000 * 1000 if seed is None else seed
        jobs = [(kind, first + i) for i in range(count) for kind in chosen]
        done = _make_all(jobs, workers, limit, console)
    if as_json:
        print(json.dumps(as_data(done, time.monotonic() - began), indent=1))
    else:
        show(done, Console(), time.monotonic() - began, detailed=only is not None)
    raise SystemExit(any(each.trial.findings for each in done))


def _make_all(jobs: list[tuple[str, int]], workers: int, limit: float, console: Console) -> list[Done]:
    done: list[Done] = []
    began = time.monotonic()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("trials", total=len(jobs))
        try:
            for each in make_trials(jobs, workers, limit):
                done.append(each)
                progress.advance(task)
                for finding in each.trial.findings:
                    said = f"{finding.gravity}: --kind {each.kind} --only {each.seed}: {finding.what}"
                    progress.console.print(said, markup=False, highlight=False, soft_wrap=True)
                if len(done) % MARK == 0 or len(done) == len(jobs):
                    said = progress_line(done, len(jobs), time.monotonic() - began)
                    progress.console.print(said, markup=False, highlight=False, soft_wrap=True)
        except KeyboardInterrupt:
            console.print(f"interrupted after {len(done)} of {len(jobs)} trials")
    return done


if __name__ == "__main__":
    main(prog_name="python -m tests.soak")
