"""`atwood info`: the mechanism report."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from atwood.cli.output import console, print_json
from atwood.cli.scenes import prepare

if TYPE_CHECKING:
    from atwood.reporting import MechanismReport

__all__ = ["show_info"]


def show_info(
    scene: str,
    settings: Sequence[str],
    starts: Sequence[str],
    as_json: bool,
    moved: bool = False,
    orientation: str = "quaternion",
) -> None:
    """Show what a scene is made of.

    Parameters
    ----------
    scene, settings, starts
        See `atwood.cli.scenes.prepare`.
    as_json
        Whether to write JSON.
    moved
        Whether to show, instead of the parameters, all that the start moved.
    orientation
        See `atwood.assemble`.
    """
    from atwood.reporting import report

    model, name = prepare(scene, settings, starts)
    found = report(model, name, orientation=orientation)
    if as_json:
        print_json(found.to_dict())
    else:
        _print(found, moved)


def _print(found: MechanismReport, moved: bool) -> None:
    from rich.table import Table
    from rich.text import Text

    from atwood.reporting.text import facts, shorten, title

    out = console()
    out.print(Text(title(found), style="bold"))
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(style="cyan", no_wrap=True)
    table.add_column(overflow="fold")
    for label, text in facts(found):
        table.add_row(label, Text(text))
    out.print(table)
    if moved:
        out.print()
        out.print(Text(str(found.initialization)), soft_wrap=True)
        return
    groups: dict[tuple[str, float, str, str], list[str]] = {}
    for one in found.parameters:
        if isinstance(one.value, (int, float)):
            alike = (re.sub(r"\[\d+\]", "[]", one.path), one.value, one.unit, one.meaning)
            groups.setdefault(alike, []).append(one.path)
    out.print()
    listing = Table(box=None, header_style="cyan", padding=(0, 2, 0, 0))
    listing.add_column("parameter", no_wrap=True)
    listing.add_column("value", justify="right", no_wrap=True)
    listing.add_column("unit", no_wrap=True)
    listing.add_column("meaning", overflow="fold")
    for (_, value, unit, meaning), paths in list(groups.items())[:_SHOWN]:
        listing.add_row(shorten(paths, 3, least=2), f"{value:g}", "" if unit == "1" else unit, meaning)
    out.print(listing)
    if len(groups) > _SHOWN:
        out.print(f"... and {len(groups) - _SHOWN} more; --json shows all", style="dim")


_SHOWN = 16
