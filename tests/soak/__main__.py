"""The command: `python -m tests.soak`."""

from __future__ import annotations

import json
import signal
import time
from collections import Counter

import click
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from .kinds import KINDS, run_trial
from .trial import GRAVITIES
from .workers import Done, make_trials


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
    console = Console(stderr=True)
    if only is not None:
        done = [Done(kind, only, *run_trial(kind, only)) for kind in chosen]
    else:
        first = int(time.time()) % 1_000_000 * 1000 if seed is None else seed
        jobs = [(kind, first + i) for i in range(count) for kind in chosen]
        done = _make_all(jobs, workers, limit, console)
    if as_json:
        print(json.dumps(_as_data(done), indent=1))
    else:
        _show(done, Console(), detailed=only is not None)
    raise SystemExit(any(each.trial.findings for each in done))


def _make_all(jobs: list[tuple[str, int]], workers: int, limit: float, console: Console) -> list[Done]:
    done: list[Done] = []
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("trials", total=len(jobs))
        try:
            for each in make_trials(jobs, workers, limit):
                done.append(each)
                progress.advance(task)
                for finding in each.trial.findings:
                    said = f"{finding.gravity}: --kind {each.kind} --only {each.seed}: {finding.what}"
                    progress.console.print(said, markup=False, highlight=False)
        except KeyboardInterrupt:
            console.print(f"interrupted after {len(done)} of {len(jobs)} trials")
    return done


def _as_data(done: list[Done]) -> dict[str, object]:
    return {
        "tried": {kind: dict(_counts(done, kind)) for kind in sorted({each.kind for each in done})},
        "findings": [
            {"kind": each.kind, "seed": each.seed, **vars(finding)} for each in done for finding in each.trial.findings
        ],
    }


def _counts(done: list[Done], kind: str) -> Counter[str]:
    counts: Counter[str] = Counter()
    for each in done:
        if each.kind == kind:
            counts.update(["trials", *each.trial.tried])
    return counts


def _show(done: list[Done], console: Console, detailed: bool) -> None:
    for kind in sorted({each.kind for each in done}):
        counts = _counts(done, kind)
        slowest = max((each for each in done if each.kind == kind), key=lambda each: each.seconds)
        console.print(f"\n[bold]{kind}[/bold]: {counts.pop('trials')} trials, the slowest {slowest.seconds:.1f} s")
        console.print(f"  (seed {slowest.seed})")
        console.print("  " + ", ".join(f"{word} {n}" for word, n in counts.most_common()), highlight=False)
    causes: dict[tuple[str, str, str], list[int]] = {}
    for each in done:
        for finding in each.trial.findings:
            causes.setdefault((finding.gravity, each.kind, finding.what), []).append(each.seed)
            if detailed:
                console.print(f"\n{finding.gravity}: {finding.what}\n{finding.detail}", markup=False, highlight=False)
    if not causes:
        console.print("\nnothing was found")
        return
    table = Table("gravity", "kind", "what", "times", "seeds")
    for (gravity, kind, what), seeds in sorted(causes.items(), key=lambda item: GRAVITIES.index(item[0][0])):
        table.add_row(gravity, kind, escape(what), str(len(seeds)), " ".join(map(str, seeds[:5])))
    console.print(table)


if __name__ == "__main__":
    main(prog_name="python -m tests.soak")
