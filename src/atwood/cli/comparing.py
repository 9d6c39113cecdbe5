"""`atwood compare`: what each form costs for which error."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from atwood.cli.output import console, print_json
from atwood.cli.scenes import prepare
from atwood.late import dataclass

if TYPE_CHECKING:
    from rich.table import Table

    from atwood.study import Comparison, ComparisonRow
from atwood.study.comparison.compare import RELATIVE

__all__ = ["CompareRequest", "compare_scene"]


@dataclass(frozen=True)
class CompareRequest:
    """What was asked for on the command line; see the options of `atwood compare`."""

    scene: str
    settings: tuple[str, ...] = ()
    starts: tuple[str, ...] = ()
    t_end: float | None = None
    rtols: tuple[float, ...] = ()
    max_seconds: float | None = None
    plot: Path | None = None
    progress: bool = True
    as_json: bool = False


def compare_scene(request: CompareRequest) -> None:
    """Compare the forms of a scene, and show what came of it.

    Parameters
    ----------
    request
        What was asked for.
    """
    if request.plot is not None:
        from atwood.plotting.canvas import check_picture

        check_picture(request.plot)
    scene, name = prepare(request.scene, request.settings, request.starts)
    from atwood.study.comparison.compare import TOLERANCES, compare

    with _progress(request.progress) as progress:
        found = compare(
            scene,
            t_end=request.t_end,
            rtols=request.rtols or TOLERANCES,
            max_seconds=request.max_seconds,
            name=name,
            progress=progress,
        )
    if request.plot is not None:
        found.plot(request.plot)
    if request.as_json:
        print_json(found.to_dict())
        return
    _print(found)
    if request.plot is not None:
        console().print(f"plotted: {request.plot}", style="dim", soft_wrap=True)


def _print(found: Comparison) -> None:
    from rich.text import Text

    out = console()
    out.print(Text.assemble((found.scene, "bold"), f" to t = {found.t_end:g} s"))
    out.print(Text(f"Errors are against {found.reference.description}."))
    if found.reference.note:
        out.print(Text(found.reference.note))
    out.print()
    out.print(_table(found))
    out.print(RELATIVE, style="dim")
    if any(row.within_reference for row in found.rows):
        out.print("* within ten times the error of the reference itself", style="dim")
    out.print()
    out.print(Text(found.verdict, style="bold"))


def _table(found: Comparison) -> Table:
    from rich.table import Table

    table = Table(box=None, header_style="cyan", padding=(0, 2, 0, 0))
    table.add_column("form", no_wrap=True, min_width=22)
    for heading in ("rtol", "error", "time, ms", "steps", "energy drift", "constraint drift"):
        table.add_column(heading, justify="right", no_wrap=True)
    shown = ""
    for row in found.rows:
        if shown and row.label != shown:
            table.add_section()
        if row.reason:
            table.add_row(row.label, f"{row.rtol:.0e}", "failed")
        else:
            table.add_row(row.label if row.label != shown else "", f"{row.rtol:.0e}", *_numbers(row))
        shown = row.label
    failed = [row for row in found.rows if row.reason]
    if failed:
        table.caption = "\n".join(f"{row.label} at {row.rtol:.0e} failed: {row.reason}" for row in failed)
        table.caption_justify = "left"
    return table


def _numbers(row: ComparisonRow) -> list[str]:
    error, wall = row.error or 0.0, row.wall_s or 0.0
    mark = "*" if row.within_reference else " "
    drifts = [f"{drift or 0.0:.1e}" for drift in (row.energy_drift, row.constraint_drift)]
    return [f"{error:.1e}{mark}", f"{1e3 * wall:.3g}", str(row.steps), *drifts]


@contextlib.contextmanager
def _progress(wanted: bool) -> Iterator[Callable[[str, int, int], object] | None]:
    """Say on standard error what is being done, if there is a terminal."""
    if not (wanted and sys.stderr.isatty()):
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda what, done, of: bar.update(task, description=what, completed=done, total=of)
