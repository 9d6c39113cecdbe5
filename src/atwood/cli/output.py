"""Writing to the terminal: strict JSON and rich text."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from atwood.display import plain
from atwood.table import WIDTH, Table


def print_json(data: Mapping[str, Any]) -> None:
    """Write strict JSON to standard output."""
    import json

    click.echo(json.dumps(strict(data), indent=2, allow_nan=False))


def strict(value: Any) -> Any:
    """Return a value as plain data, with None for numbers that are not finite."""
    import json

    return json.loads(json.dumps(plain(value)), parse_constant=lambda _: None)


class Writer:
    """Writes texts with styles, and tables, to a file or a pipe: as wide as ``COLUMNS`` says, or 120 columns."""

    def __init__(self) -> None:
        told = os.environ.get("COLUMNS", "")
        self.width = int(told) if told.isdecimal() and int(told) > 0 else WIDTH

    def line(self, *texts: tuple[str, str]) -> None:
        """Write a line of texts, each with its style."""
        click.echo("".join(text for text, _ in texts))

    def show(self, *tables: Table) -> None:
        """Write tables with their titles and notes, an empty line between them."""
        for number, one in enumerate(tables):
            if number:
                self.line()
            if one.title:
                self.line((one.title, "bold"))
            self.rows(one)
            for note in one.notes:
                self.line((note, "dim"))

    def rows(self, table: Table) -> None:
        """Write headings and rows of a table."""
        for line in table.lines(self.width):
            click.echo(line)

    def files(self, **written: Path | None) -> None:
        """Say which files were written, each with what was done."""
        for done, file in written.items():
            if file is not None:
                self.line((f"{done}: {file}", "dim"))


def writer() -> Writer:
    """Return what writes to standard output: with colours where that is a terminal, and without rich elsewhere."""
    if sys.stdout.isatty() or os.environ.get("FORCE_COLOR"):
        from atwood.cli.colours import ColourWriter

        return ColourWriter()
    return Writer()


def answer(as_json: bool, data: Mapping[str, Any], tables: Iterable[Table], **files: Path | None) -> None:
    """Write what was found: as JSON, or as tables and the names of files that were written."""
    if as_json:
        print_json(data)
        return
    out = writer()
    out.show(*tables)
    out.files(**files)


def warn(text: str) -> None:
    """Write a line to standard error."""
    click.echo(text, err=True)


@contextlib.contextmanager
def progress_bar(
    wanted: bool, name: str, share: Callable[..., tuple[float, str]]
) -> Iterator[Callable[..., object] | None]:
    """Show a progress bar on standard error while something goes on, if there is a terminal."""
    if not (wanted and sys.stderr.isatty()):
        yield None
        return
    from atwood.cli.colours import bar

    with bar(name) as update:
        yield lambda *told: update(*share(*told))
