"""Writing to a terminal, in colours."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

__all__ = ["ColourWriter"]


class ColourWriter:
    """Writes with rich; see `atwood.cli.output.Writer`."""

    def __init__(self, console: Console) -> None:
        self.console, self.width = console, console.width

    def line(self, *texts: tuple[str, str]) -> None:
        """Write a line."""
        self.console.print(Text.assemble(*texts), soft_wrap=True)

    def pairs(self, rows: Sequence[tuple[str, str]]) -> None:
        """Write labels and sentences."""
        table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
        table.add_column(style="cyan", no_wrap=True)
        table.add_column()
        for label, text in rows:
            table.add_row(label, Text(text))
        self.console.print(table)

    def table(self, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Write a table."""
        table = Table(box=None, header_style="cyan", padding=(0, 2, 0, 0))
        for heading in headings:
            name = heading.removesuffix(">")
            table.add_column(name, justify="left" if name == heading else "right", no_wrap=True)
        for row in rows:
            table.add_row(*map(Text, row))
        self.console.print(table)
