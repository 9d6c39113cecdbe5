"""What a number of trials comes to, in words, tables and data."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .trial import GRAVITIES
from .workers import Done

SLOWEST = 5
"""Trials that are named because they took longest."""

SHOWN_SEEDS = 12
"""Seeds that are listed for one cause; the data has all."""


def progress_line(done: list[Done], total: int, seconds: float) -> str:
    """Return in one line how far the trials are, and what they have come to."""
    findings = sum(bool(each.trial.findings) for each in done)
    discarded = sum(any(word.startswith("discarded") for word in each.trial.tried) for each in done)
    mean = sum(each.seconds for each in done) / len(done)
    left = seconds / len(done) * (total - len(done))
    return (
        f"{len(done)} of {total}: {findings} with findings, {discarded} discarded, {mean:.2f} s a trial, "
        f"{seconds / 60.0:.1f} min, about {left / 60.0:.0f} min to go"
    )


def as_data(done: list[Done], seconds: float) -> dict[str, Any]:
    """Return all counts, findings and the slowest trials as plain data."""
    return {
        "seconds": round(seconds, 1),
        "tried": {kind: _counted(_of(done, kind)) for kind in _kinds(done)},
        "findings": [
            {"kind": each.kind, "seed": each.seed, **vars(finding)} for each in done for finding in each.trial.findings
        ],
    }


def show(done: list[Done], console: Console, seconds: float, detailed: bool) -> None:
    """Print what was tried, by kinds and groups of words, and what was found, by causes."""
    for kind in _kinds(done):
        counted = _counted(_of(done, kind))
        console.print(
            f"\n[bold]{kind}[/bold]: {counted['trials']} trials, {counted['seconds']:.0f} s of workers, "
            f"{counted['seconds_a_trial']:.2f} s a trial",
            highlight=False,
        )
        slowest = ", ".join(f"{each['seed']} ({each['seconds']:.1f} s)" for each in counted["slowest"])
        console.print(f"  slowest: {slowest}", highlight=False)
        for group, words in counted["words"].items():
            said = ", ".join(f"{word} {n}" for word, n in words.items())
            console.print(f"  {group}: {said}" if group else f"  {said}", markup=False, highlight=False)
    _show_findings(done, console, detailed)
    console.print(f"{len(done)} trials in {seconds / 60.0:.1f} min", highlight=False)


def _show_findings(done: list[Done], console: Console, detailed: bool) -> None:
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
        more = " ..." if len(seeds) > SHOWN_SEEDS else ""
        listed = " ".join(map(str, sorted(seeds)[:SHOWN_SEEDS])) + more
        table.add_row(gravity, kind, escape(what), str(len(seeds)), listed)
    console.print(table)


def _kinds(done: Iterable[Done]) -> list[str]:
    return sorted({each.kind for each in done})


def _of(done: Iterable[Done], kind: str) -> list[Done]:
    return [each for each in done if each.kind == kind]


def _counted(done: list[Done]) -> dict[str, Any]:
    """Return the counts of one kind; words such as ``"joint: pivot"`` are counted in their group."""
    words: dict[str, Counter[str]] = {}
    for each in done:
        for said in each.trial.tried:
            group, _, word = said.rpartition(": ") if said.count(": ") == 1 else ("", "", said)
            words.setdefault(group, Counter())[word] += 1
    total = sum(each.seconds for each in done)
    slowest = sorted(done, key=lambda each: -each.seconds)[:SLOWEST]
    return {
        "trials": len(done),
        "with_findings": sum(bool(each.trial.findings) for each in done),
        "seconds": round(total, 1),
        "seconds_a_trial": round(total / len(done), 3),
        "slowest": [{"seed": each.seed, "seconds": round(each.seconds, 2)} for each in slowest],
        "words": {group: dict(counts.most_common()) for group, counts in sorted(words.items())},
    }
