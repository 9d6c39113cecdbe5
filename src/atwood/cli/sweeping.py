"""`atwood sweep`: one scene with many parameters and starts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click
import numpy as np

from atwood.arguments import FLAG
from atwood.cli.command import PICTURE, Request, command, written_as
from atwood.cli.errors import INTERRUPTED
from atwood.cli.output import print_json, progress_bar, warn, writer
from atwood.cli.scenes import check_applies, pairs, prepare, warn_of_radians
from atwood.errors import UsageError
from atwood.lazy_dataclasses import replace
from atwood.pipeline import assemble
from atwood.study import Sweep, sweep
from atwood.study.sweeps.files import check_sweep_target
from atwood.table import Table, facts, table

_ROWS, _COLUMNS, _REASONS = 16, 8, 5
"""So many runs, quantities and reasons are shown."""


def sweep_scene(request: Request) -> None:
    """Simulate SCENE with many parameters and starts, and show where the runs end."""
    varied = {"--vary": request.vary or {}, "--vary-start": request.start or {}}
    if not any(varied.values()):
        raise UsageError("nothing is varied", advice="Write --vary PATH=FROM:TO:COUNT or --vary-start PATH=A,B,C.")
    scene, name = prepare(request.scene, request.settings, request.start_values)
    check_applies(scene, request.form, request.level)
    for option, axes in varied.items():
        typed = dict(pairs(request.typed["start" if axes is request.start else "vary"], option))
        for path, values in axes.items():
            if isinstance(values, list):  # and no distribution
                warn_of_radians(scene, path, values, option, typed[path])
    with progress_bar(request.progress, name, lambda done, of: (done / of, f"{done}/{of}")) as progress:
        found = sweep(scene, **request.of(sweep), progress=progress, name=name)
    if request.save is not None:
        found.save(request.save)
    if request.plot is not None:
        found.plot(file=request.plot)
    if request.as_json:
        varied = {"vary": [*request.typed["vary"]], "vary_start": [*request.typed["start"]]}
        asked = {"set": list(request.settings), **varied}
        print_json({**found.to_dict(), "asked": asked})
    else:
        _print(found, request)
    if "interrupted" in found.status:
        warn("Interrupted.")
        click.get_current_context().exit(INTERRUPTED)


def _print(found: Sweep, request: Request) -> None:
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


COMMAND = command(
    "sweep",
    sweep_scene,
    sweep,
    assemble,
    leave=("name", "orientation"),
    more={"plot": PICTURE, "save": written_as(check_sweep_target), "progress": (FLAG, True)},
    names={"start": "--vary-start"},
)
