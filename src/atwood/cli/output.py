"""Writing to the terminal: strict JSON and rich text."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import click

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["Writer", "console", "print_json", "strict", "warn", "writer"]


def print_json(data: Mapping[str, Any]) -> None:
    """Write strict JSON to standard output.

    Parameters
    ----------
    data
        Plain data; numbers that are not finite become null.
    """
    import json

    click.echo(json.dumps(strict(data), indent=2, allow_nan=False))


def strict(value: Any) -> Any:
    """Return data as strict JSON knows it."""
    if isinstance(value, Mapping):
        return {str(key): strict(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [strict(one) for one in value]
    if isinstance(value, float):  # NumPy's floats are floats too
        return float(value) if math.isfinite(value) else None
    if value is None or isinstance(value, (str, bool, int)):
        return value
    return strict(value.item()) if hasattr(value, "item") else str(value)


def console() -> Console:
    """Return the console for texts on standard output; where there is no terminal it is 120 columns wide."""
    from rich.console import Console

    made = Console(highlight=False)
    if not made.is_terminal and "COLUMNS" not in os.environ:
        made = Console(highlight=False, width=120)
    return made


class Writer(Protocol):
    """Writes texts with styles, and tables, to standard output."""

    width: int

    def line(self, *texts: tuple[str, str]) -> None:
        """Write a line of texts, each with its style."""
        ...

    def pairs(self, rows: Sequence[tuple[str, str]]) -> None:
        """Write labels and sentences; these are wrapped."""
        ...

    def table(self, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Write a table, whose cells are never cut; headings that end with ``>`` have their columns to the right."""
        ...


def writer() -> Writer:
    """Return what writes to standard output: with colours where that is a terminal, and without rich elsewhere."""
    if sys.stdout.isatty() or os.environ.get("FORCE_COLOR"):
        from atwood.cli.colours import ColourWriter

        return ColourWriter(console())
    return PlainWriter()


class PlainWriter:
    """Writes for a file or a pipe, as wide as ``COLUMNS`` says, or 120 columns."""

    def __init__(self) -> None:
        told = os.environ.get("COLUMNS", "")
        self.width = int(told) if told.isdecimal() and int(told) > 0 else 120

    def line(self, *texts: tuple[str, str]) -> None:
        """Write a line."""
        click.echo("".join(text for text, _ in texts))

    def pairs(self, rows: Sequence[tuple[str, str]]) -> None:
        """Write labels and sentences."""
        from textwrap import wrap

        left = max((len(label) for label, _ in rows), default=0) + 2
        for label, text in rows:
            for i, part in enumerate(wrap(text, max(20, self.width - left), break_on_hyphens=False) or [""]):
                click.echo(f"{'' if i else label:{left}}{part}".rstrip())

    def table(self, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Write a table."""
        to_right = [heading.endswith(">") for heading in headings]
        lines = [[heading.removesuffix(">") for heading in headings], *rows]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        for cells in lines:
            placed = zip(cells, widths, to_right, strict=True)
            click.echo("  ".join(f"{cell:{'>' if right else '<'}{w}}" for cell, w, right in placed).rstrip())


def warn(text: str) -> None:
    """Write a line to standard error."""
    click.echo(text, err=True)
