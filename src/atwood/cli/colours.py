"""Writing to a terminal, in colours."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator

import rich.table
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from atwood.cli.output import Writer
from atwood.table import WIDTH, Table


class ColourWriter(Writer):
    """Writes with rich; where there is no terminal, as wide as a pipe."""

    def __init__(self) -> None:
        self.console = Console(highlight=False)
        if not self.console.is_terminal and "COLUMNS" not in os.environ:
            self.console = Console(highlight=False, width=WIDTH)
        self.width = self.console.width

    def line(self, *texts: tuple[str, str]) -> None:
        """Write a line."""
        self.console.print(Text.assemble(*texts), soft_wrap=True)

    def rows(self, table: Table) -> None:
        """Write a table: labels and headings in colour."""
        style = None if table.has_headings else "cyan"
        made = rich.table.Table(box=None, show_header=table.has_headings, header_style="cyan", padding=(0, 2, 0, 0))
        for number, one in enumerate(table.columns):
            side, first = "right" if one.align == ">" else "left", style if number == 0 else None
            made.add_column(one.heading, justify=side, no_wrap=one.align != "~", overflow="fold", style=first)  # type: ignore[arg-type]
        for row in table.cells():
            made.add_row(*map(Text, row))
        self.console.print(made)


@contextlib.contextmanager
def bar(name: str) -> Iterator[Callable[[float, str], object]]:
    """Show a bar on standard error; what is given takes a share that is done, and words."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[words]}"), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task(name, total=1.0, words="")
        yield lambda share, words: shown.update(task, completed=share, words=words)
