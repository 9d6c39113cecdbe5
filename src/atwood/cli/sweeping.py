"""`atwood sweep`: one scene with many parameters and starts."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from atwood.cli.errors import INTERRUPTED
from atwood.cli.output import print_json, progress_bar, warn, writer
from atwood.cli.scenes import check_applies, pairs, prepare, warn_of_radians
from atwood.errors import UsageError
from atwood.late import dataclass, replace
from atwood.table import Table, facts, table
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.study import Sweep

__all__ = ["SweepRequest", "read_values", "sweep_scene"]

_ROWS, _COLUMNS, _REASONS = 16, 8, 5
"""So many runs, quantities and reasons are shown."""

_RANGE = re.compile(r"([^:]+):([^:]+):\s*(\d+)\s*([^:]*)\Z")
_LARGEST = 10_000_000


@dataclass(frozen=True)
class SweepRequest:
    """What was asked for on the command line; see the options of `atwood sweep`."""

    scene: str
    settings: tuple[str, ...] = ()
    starts: tuple[str, ...] = ()
    vary: tuple[str, ...] = ()
    vary_start: tuple[str, ...] = ()
    combine: str = "grid"
    quantities: tuple[str, ...] = ()
    form: str = "reduced"
    level: str = "ggl"
    t_end: float | None = None
    rtol: float = tolerances.RTOL
    accuracy: float | None = None
    solver: str = "auto"
    outputs: int | None = None
    max_steps: int | None = None
    max_seconds: float | None = None
    threads: int | None = None
    plot: Path | None = None
    save: Path | None = None
    progress: bool = True
    as_json: bool = False


def sweep_scene(request: SweepRequest) -> None:
    """Sweep a scene, and show, save and plot what came of it.

    Parameters
    ----------
    request
        What was asked for.
    """
    _check_files(request)
    vary = {path: read_values(text, "--vary") for path, text in pairs(request.vary, "--vary")}
    start = {path: read_values(text, "--vary-start") for path, text in pairs(request.vary_start, "--vary-start")}
    if not vary and not start:
        raise UsageError("nothing is varied", advice="Write --vary PATH=FROM:TO:COUNT or --vary-start PATH=A,B,C.")
    scene, name = prepare(request.scene, request.settings, request.starts)
    check_applies(scene, request.form, request.level)
    for option, texts, axes in (("--vary", request.vary, vary), ("--vary-start", request.vary_start, start)):
        typed = dict(pairs(texts, option))
        for path, values in axes.items():
            warn_of_radians(scene, path, values, option, typed[path])
    from atwood.study import sweep

    with progress_bar(request.progress, name, lambda done, of: (done / of, f"{done}/{of}")) as progress:
        found = sweep(
            scene,
            vary,
            start=start,
            combine=request.combine,
            quantities=request.quantities or None,
            t_end=request.t_end,
            outputs=request.outputs,
            form=request.form,
            level=request.level,
            rtol=request.rtol,
            accuracy=request.accuracy,
            solver=request.solver,
            max_steps=request.max_steps,
            max_seconds=request.max_seconds,
            threads=request.threads,
            progress=progress,
            name=name,
        )
    if request.save is not None:
        found.save(request.save)
    if request.plot is not None:
        found.plot(file=request.plot)
    if request.as_json:
        asked = {"set": list(request.settings), "vary": list(request.vary), "vary_start": list(request.vary_start)}
        print_json({**found.to_dict(), "asked": asked})
    else:
        _print(found, request)
    if "interrupted" in found.status:
        warn("Interrupted.")
        click.get_current_context().exit(INTERRUPTED)


def read_values(text: str, option: str) -> list[Any]:
    """Return the values that a text stands for.

    Parameters
    ----------
    text
        ``"0.5:2:16"``: 16 values, evenly from 0.5 to 2; ``"0:90:10deg"``: the same in a unit; ``"1,2,5 kg"``: a list,
        in which a unit at its end holds for all numbers without one.
    option
        Where it was given.
    """
    found = _RANGE.match(text)
    if found is not None:
        first, last, count, unit = found.groups()
        number = int(count)
        if not 1 <= number <= _LARGEST:
            raise UsageError(f"{number} is no number of values", where=option, advice="Write FROM:TO:COUNT.")
        values = np.linspace(_number(first, text, option), _number(last, text, option), number).tolist()
        return [f"{value!r} {unit.strip()}" for value in values] if unit.strip() else values
    if ":" in text:
        raise UsageError(f"{text!r} is no range", where=option, advice="Write FROM:TO:COUNT, such as 0:90:10deg.")
    parts = [part.strip() for part in text.split(",")]
    if not all(parts):
        raise UsageError(f"{text!r} lacks a value", where=option, advice="Write A,B,C.")
    tail = re.match(r"[-+.\deE]+\s*([A-Za-z%].*)\Z", parts[-1])
    numbers = [_maybe_number(part) for part in parts]
    if tail is None:
        return [part if number is None else number for part, number in zip(parts, numbers, strict=True)]
    return [part if number is None else f"{part} {tail[1]}" for part, number in zip(parts, numbers, strict=True)]


def _maybe_number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _number(part: str, text: str, option: str) -> float:
    number = _maybe_number(part)
    if number is None:
        raise UsageError(
            f"{part.strip()!r} in {text!r} is no number", where=option, advice="Give the unit at the end: 0:90:10deg."
        )
    return number


def _check_files(request: SweepRequest) -> None:
    """Refuse files that could not be written before any work is done."""
    if request.save is not None:
        from atwood.study.sweeps.files import check_sweep_target

        check_sweep_target(request.save)
    if request.plot is not None:
        from atwood.plotting.canvas import check_picture

        check_picture(request.plot)


# -- what is shown -----------------------------------------------------------------------------------------------------


def _print(found: Sweep, request: SweepRequest) -> None:
    out, more = writer(), len(found.paths) - _COLUMNS
    out.show(facts(_facts(found), f"{found.scene}, {found.form} form, to t = {found.time[-1]:g} s"))
    out.line()
    notes = [f"{more} more quantities: --json or --save FILE shows all"] if more > 0 else []
    out.show(replace(_runs(found) if len(found) <= _ROWS else _extremes(found), notes=tuple(notes)))
    out.files(saved=request.save, plotted=request.plot)


def _facts(found: Sweep) -> Iterator[tuple[str, str]]:
    statistics = found.statistics
    for path, values in found.varied.items():
        distinct = found.axis(path)
        unit = f" {found.units[path]}" if found.units.get(path) else ""
        if values.dtype.kind == "f":
            yield "varied", f"{path} from {np.min(values):.6g} to {np.max(values):.6g}{unit}, {len(distinct)} values"
        else:
            yield "varied", f"{path}: {', '.join(map(str, dict.fromkeys(distinct.tolist())))}"
    counts = {status: found.status.count(status) for status in dict.fromkeys(found.status)}
    yield "runs", ", ".join(f"{count} {status.replace('_', ' ')}" for status, count in counts.items())
    for run in found.failed[:_REASONS]:
        yield "", f"run {run}: {found.messages.get(run, found.status[run])}"
    if len(found.failed) > _REASONS:
        yield "", f"and {len(found.failed) - _REASONS} more"
    how = f"{statistics.batched} of {statistics.runs} many at a time in machine code"
    yield "how", f"one by one: {statistics.why_single}" if statistics.why_single else how
    if statistics.reassembled:
        run, reason = next(iter(statistics.reassembled.items()))
        yield "assembled", f"anew for {len(statistics.reassembled)} of the runs; in run {run} since {reason}"
    each = 1e6 * statistics.wall_seconds / max(1, statistics.runs)
    threads = f"{statistics.threads} thread{'s' if statistics.threads != 1 else ''}"
    yield "time", f"{statistics.wall_seconds:.3g} s, {each:.4g} microseconds a run, {threads}"


def _runs(found: Sweep) -> Table:
    """Return the table of all runs, each with what was varied and where it ends."""
    paths = found.paths[:_COLUMNS]
    columns = [*found.varied.values(), *(found.end(path) for path in paths)]
    rows = [
        (str(run), *(_text(values[run]) for values in columns), status.replace("_", " "))
        for run, status in enumerate(found.status)
    ]
    return table([*(f"{name}>" for name in ("run", *found.varied, *paths)), "status"], rows)


def _extremes(found: Sweep) -> Table:
    """Return the table of the smallest and largest ends, and where they are."""
    rows = []
    for path in found.paths[:_COLUMNS]:
        ends = found.end(path)
        cells = ["-", "", "-", ""]
        if np.any(np.isfinite(ends)):
            places = [int(place) for place in (np.nanargmin(ends), np.nanargmax(ends))]
            cells = [text for k in places for text in (_text(ends[k]), str(k))]
        rows.append((path, *cells, found.units[path]))
    return table(("quantity", "smallest>", "in run>", "largest>", "in run>", "unit"), rows)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}" if np.isfinite(value) else "-"
    return str(value)
